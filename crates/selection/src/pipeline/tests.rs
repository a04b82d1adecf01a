//! What leaves a step when one of its parts does not keep its promises.

use super::*;
use crate::concatenator::Concatenator;
use crate::parameters::RankerParameters;
use crate::ranker::{Ranked, Ranker};
use crate::test_scene::scene;
use messages::autoware_internal_planning_msgs::{CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::std_msgs::{Header, Text};
use motion::VehicleInfo;
use std::panic::resume_unwind;
use std::sync::Arc;

/// Where the ranker under test breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Breaks {
    Never,
    Ranking,
    Remembering,
    Configuring,
}

/// The ranker, until it breaks.
#[derive(Debug)]
struct Broken(Ranker, Breaks);

impl Broken {
    fn at(&mut self, place: Breaks) {
        if self.1 == place {
            self.1 = Breaks::Never;
            resume_unwind(Box::new("on purpose"));
        }
    }
}

impl Rank for Broken {
    fn configure(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        self.at(Breaks::Configuring);
        self.0.configure(parameters, sources);
    }

    fn rank(&mut self, scene: &Scene, candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking {
        self.at(Breaks::Ranking);
        self.0.rank(scene, candidates, verdicts)
    }

    fn remember(&mut self, scene: &Scene, candidates: &[Candidate], ranking: &Ranking) {
        self.0.remember(scene, candidates, ranking);
        self.at(Breaks::Remembering);
    }

    fn forget(&mut self) {
        self.0.forget();
    }
}

fn ranker() -> Ranker {
    Ranker::new(RankerParameters::default(), GeneratorSource::table(&["DiffusionPlanner_"]))
}

fn pipeline(ranker: impl Rank + 'static) -> Pipeline {
    let parameters = ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    Pipeline::new(Validator::new(parameters, &VehicleInfo::default()).unwrap(), ranker)
}

/// Candidates of one generator; the speed of each is its number. The last one is no trajectory.
fn candidates(count: u32) -> Concatenated {
    let point = |number: u32, index: i64| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(index * 100_000_000),
        longitudinal_velocity_mps: number as f32,
        ..TrajectoryPoint::default()
    };
    let candidate = |number: u32| {
        let points = if number + 1 == count { 1 } else { 2 };
        Arc::new(CandidateTrajectory {
            header: Header { stamp: Time { sec: 10, nanosec: 0 }, frame_id: "map".to_owned() },
            points: (0..points).map(|index| point(number, index)).collect(),
            ..CandidateTrajectory::default()
        })
    };
    let name = Text { data: "DiffusionPlanner_0".to_owned() };
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&CandidateTrajectories {
        candidate_trajectories: (0..count).map(candidate).collect(),
        generator_info: vec![GeneratorInfo { generator_name: name, ..GeneratorInfo::default() }],
    });
    concatenator.get(Time { sec: 10, nanosec: 0 })
}

fn judge(validator: &Validator, scene: &Scene, candidates: &[Candidate]) -> (Vec<Verdict>, Vec<u64>) {
    judge_in_order(validator, scene, candidates, &mut Scratch::default(), || 0)
}

fn numbers(set: &CandidateTrajectories) -> Vec<u32> {
    set.candidate_trajectories
        .iter()
        .map(|message| message.points[0].longitudinal_velocity_mps as u32)
        .collect()
}

#[test]
fn a_ranker_that_panics_costs_the_choice_of_its_cycle_and_nothing_else() {
    let concatenated = candidates(4);
    for breaks in [Breaks::Ranking, Breaks::Remembering] {
        let mut pipeline = pipeline(Broken(ranker(), breaks));
        let step = pipeline.step(&scene(), &concatenated, &judge, || 0);
        assert_eq!(numbers(&step.validated), [0, 1, 2], "{breaks:?}");
        assert!(
            step.selected.is_none() && step.scored.scored_candidate_trajectories.is_empty(),
            "{breaks:?}"
        );
        assert_eq!(step.ranking, Ranking::failed("on purpose".to_owned()), "{breaks:?}");

        let step = pipeline.step(&scene(), &concatenated, &judge, || 0);
        assert_eq!(step.selected.map(|selected| selected.key), Some(concatenated.candidates[0].key));
        assert_eq!(step.ranking.previous_source, None, "{breaks:?}: what was half remembered is forgotten");
        assert_eq!(step.ranking.failure, None);
    }
}

#[test]
fn a_ranker_that_panics_over_its_parameters_goes_on_with_empty_memory() {
    let concatenated = candidates(2);
    let mut pipeline = pipeline(Broken(ranker(), Breaks::Configuring));
    pipeline.step(&scene(), &concatenated, &judge, || 0);
    pipeline.configure_ranker(RankerParameters::default(), GeneratorSource::table(&["DiffusionPlanner_"]));
    let step = pipeline.step(&scene(), &concatenated, &judge, || 0);
    assert!(step.selected.is_some());
    assert_eq!(step.ranking.previous_source, None);
}

/// Ranks what nobody asked for: candidates that were refused, and places that there are not.
#[derive(Debug)]
struct Nonsense;

impl Rank for Nonsense {
    fn configure(&mut self, _: RankerParameters, _: Vec<GeneratorSource>) {}

    fn rank(&mut self, scene: &Scene, candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking {
        let mut ranking = ranker().rank(scene, candidates, verdicts);
        let ranked = ranking.ranked[0];
        let at = |index| Ranked { index, score: f32::NAN, ..ranked };
        ranking.ranked = vec![at(candidates.len() - 1), at(usize::MAX), at(1)];
        ranking
    }

    fn remember(&mut self, _: &Scene, _: &[Candidate], _: &Ranking) {}

    fn forget(&mut self) {}
}

#[test]
fn a_ranking_of_what_was_refused_selects_nothing() {
    let step = pipeline(Nonsense).step(&scene(), &candidates(4), &judge, || 0);
    assert!(step.selected.is_none());
    let scored = step.scored.scored_candidate_trajectories;
    assert_eq!(scored.len(), 1);
    assert_eq!(scored[0].candidate_trajectory.points[0].longitudinal_velocity_mps as u32, 1);
}

#[test]
fn a_candidate_whose_verdict_is_not_in_its_place_counts_as_not_judged() {
    /// What becomes of the verdicts, and which candidates are still accepted. The fourth is never.
    type Case = (&'static str, fn(&mut Vec<Verdict>), &'static [u32]);
    let cases: [Case; 6] = [
        ("as they are", |_| (), &[0, 1, 2]),
        ("none", Vec::clear, &[]),
        ("too few", |verdicts| verdicts.truncate(2), &[0, 1]),
        ("too many", |verdicts| verdicts.push(verdicts[0].clone()), &[0, 1, 2]),
        ("the one of a candidate that was refused elsewhere", |verdicts| verdicts.swap(0, 3), &[1, 2]),
        ("shifted by one", |verdicts| verdicts.rotate_right(1), &[]),
    ];
    let concatenated = candidates(4);
    for (name, change, accepted) in cases {
        let judge = |validator: &Validator, scene: &Scene, candidates: &[Candidate]| {
            let (mut verdicts, times) = judge(validator, scene, candidates);
            change(&mut verdicts);
            (verdicts, times)
        };
        let step = pipeline(ranker()).step(&scene(), &concatenated, &judge, || 0);
        assert_eq!(numbers(&step.validated), accepted, "{name}");
        assert_eq!((step.verdicts.len(), step.reports.reports.len()), (4, 4), "{name}");
        assert_eq!(step.selected.is_some(), !accepted.is_empty(), "{name}");
        assert!(step.verdicts.iter().all(|verdict| verdict.is_judged() || !verdict.accepted), "{name}");
    }
}
