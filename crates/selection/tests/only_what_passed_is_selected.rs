//! Whatever filters answer about whatever candidates: what a step selects passed every enforced filter, is the first of
//! those with the best score, and nothing is selected only if nothing could be.
//!
//! Filters give drawn answers; what has to come out is worked out from the answers alone.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use proptest::prelude::*;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::pipeline::{Step, judge_in_order};
use selection::ranker::GeneratorSource;
use selection::{
    Candidate, Concatenated, Concatenator, Enforcement, Filter, Judgement, Metric, Pipeline, Ranker,
    RiskLevel, Scene, Scratch, Validator,
};
use std::sync::Arc;

const NAMES: [&str; 4] =
    ["DiffusionPlanner_0", "MinimumRuleBasedPlanner_Go", "MinimumRuleBasedPlanner_Stop", "SafePlanner"];
const RISKS: [RiskLevel; 5] =
    [RiskLevel::Safe, RiskLevel::LowCaution, RiskLevel::HighCaution, RiskLevel::Danger, RiskLevel::Fatal];
const FILTERS: usize = 3;
/// Which of the filters only watches.
const SHADOW: usize = 2;

/// What a filter says about a candidate.
#[derive(Debug, Clone, Copy)]
enum Answer {
    Feasible(usize),
    Infeasible(usize),
    NotAssessed,
    Panic,
}

/// A candidate to be: its planner, whether its numbers are numbers, and what each filter will say.
#[derive(Debug, Clone)]
struct Plan {
    planner: usize,
    is_valid: bool,
    answers: [Answer; FILTERS],
}

/// Finds its answer by the number that the candidate carries as speed.
struct Scripted {
    place: usize,
    plans: Arc<Vec<Plan>>,
}

impl Filter for Scripted {
    fn name(&self) -> &'static str {
        ["a_filter", "b_filter", "c_filter"][self.place]
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        let metric = |risk: usize| Metric { name: "m", value: 0.0, threshold: 0.0, risk: RISKS[risk] };
        match self.plans[number_of(&candidate.message)].answers[self.place] {
            Answer::Feasible(risk) => Judgement::feasible([metric(risk)]),
            Answer::Infeasible(risk) => Judgement { feasible: false, ..Judgement::feasible([metric(risk)]) },
            Answer::NotAssessed => Judgement::not_assessed("not today"),
            // Without the report on stderr.
            Answer::Panic => std::panic::resume_unwind(Box::new("on purpose")),
        }
    }
}

fn number_of(message: &CandidateTrajectory) -> usize {
    message.points[0].longitudinal_velocity_mps as usize
}

fn candidates_of(plans: &[Plan]) -> CandidateTrajectories {
    let id = |planner: usize| Uuid { uuid: [planner as u8 + 1; 16] };
    let candidate = |(number, plan): (usize, &Plan)| {
        let point = |index: i64| TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds(index * 100_000_000),
            longitudinal_velocity_mps: number as f32,
            acceleration_mps2: if plan.is_valid { 0.0 } else { f32::NAN },
            ..TrajectoryPoint::default()
        };
        Arc::new(CandidateTrajectory {
            header: Header { stamp: Time { sec: 10, nanosec: 0 }, frame_id: "map".to_owned() },
            generator_id: id(plan.planner),
            points: vec![point(0), point(1)],
            ..CandidateTrajectory::default()
        })
    };
    let info = |(planner, name): (usize, &&str)| GeneratorInfo {
        generator_id: id(planner),
        generator_name: Text { data: (*name).to_owned() },
    };
    CandidateTrajectories {
        candidate_trajectories: plans.iter().enumerate().map(candidate).collect(),
        generator_info: NAMES.iter().enumerate().map(info).collect(),
    }
}

fn step(plans: &[Plan], with_quality: bool) -> (Concatenated, Step) {
    let parameters = ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    let mut validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
    let shared = Arc::new(plans.to_vec());
    for place in 0..FILTERS {
        let enforcement = if place == SHADOW { Enforcement::Shadow } else { Enforcement::Enforced };
        let plans = shared.clone();
        let make = move |_: &ValidatorParameters| {
            Box::new(Scripted { place, plans: plans.clone() }) as Box<dyn Filter>
        };
        validator.load("test", enforcement, Arc::new(make));
    }
    let sources = GeneratorSource::table(&["DiffusionPlanner_", NAMES[1], NAMES[2]]);
    let mut parameters = RankerParameters::default();
    parameters.evaluation.enable = with_quality;
    let mut pipeline = Pipeline::new(validator, Ranker::new(parameters, sources));
    let now = Time { sec: 10, nanosec: 0 };
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&candidates_of(plans));
    let concatenated = concatenator.get(now);
    let scene = Scene::empty(now, Arc::new(VehicleInfo::default()));
    let judge = |validator: &Validator, scene: &Scene, candidates: &[Candidate]| {
        judge_in_order(validator, scene, candidates, &mut Scratch::default(), || 0)
    };
    let step = pipeline.step(&scene, &concatenated, &judge, || 0);
    (concatenated, step)
}

/// The worst risk over the enforced filters; `None` if one of them objects.
fn risk_if_accepted(plan: &Plan) -> Option<usize> {
    let enforced = plan.answers.iter().enumerate().filter(|(place, _)| *place != SHADOW);
    let risks = enforced.map(|(_, answer)| match answer {
        Answer::Feasible(risk) => Some(*risk),
        _ => None,
    });
    let risks: Option<Vec<usize>> = risks.collect();
    risks.filter(|_| plan.is_valid).map(|risks| risks.into_iter().max().unwrap_or(0))
}

/// The score as the table of the original has it; `None` for planners that cannot be ranked.
fn score(plan: &Plan) -> Option<f32> {
    let risk = [0.0, 0.1, 0.4, 1.0, 1.0][risk_if_accepted(plan)?];
    let source = [0.0, 0.45, 0.5].get(plan.planner)?;
    Some((1.0 - (20.0 * risk + 5.0 * source) / 26.0) as f32)
}

fn any_answer() -> impl Strategy<Value = Answer> {
    prop_oneof![
        6 => (0..RISKS.len()).prop_map(Answer::Feasible),
        2 => (0..RISKS.len()).prop_map(Answer::Infeasible),
        1 => Just(Answer::NotAssessed),
        1 => Just(Answer::Panic),
    ]
}

prop_compose! {
    fn any_plan()(
        planner in 0..NAMES.len(),
        is_valid in prop::bool::weighted(0.9),
        answers in [any_answer(), any_answer(), any_answer()],
    ) -> Plan {
        Plan { planner, is_valid, answers }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn what_is_selected_passed_every_enforced_filter_and_is_the_first_best(
        plans in prop::collection::vec(any_plan(), 0..12), with_quality in any::<bool>(),
    ) {
        let (concatenated, step) = step(&plans, with_quality);
        let order: Vec<usize> =
            concatenated.candidates.iter().map(|candidate| number_of(&candidate.message)).collect();
        let mut best: Option<(usize, f32)> = None;
        for &number in &order {
            if let Some(score) = score(&plans[number])
                && best.is_none_or(|(_, highest)| score > highest)
            {
                best = Some((number, score));
            }
        }
        let selected = step.selected.as_ref().map(|selected| {
            (selected.trajectory.points[0].longitudinal_velocity_mps as usize, selected.score)
        });
        prop_assert_eq!(selected, best);
        let numbers = |set: &mut dyn Iterator<Item = &Arc<CandidateTrajectory>>| -> Vec<usize> {
            set.map(|message| number_of(message)).collect()
        };
        let accepted: Vec<usize> =
            order.iter().copied().filter(|number| risk_if_accepted(&plans[*number]).is_some()).collect();
        prop_assert_eq!(numbers(&mut step.validated.candidate_trajectories.iter()), accepted.clone());
        let scored: Vec<usize> =
            accepted.iter().copied().filter(|number| score(&plans[*number]).is_some()).collect();
        let mut published =
            step.scored.scored_candidate_trajectories.iter().map(|scored| &scored.candidate_trajectory);
        prop_assert_eq!(numbers(&mut published), scored.clone());
        prop_assert_eq!(step.ranking.unranked.len(), accepted.len() - scored.len());
    }
}
