//! The score table of the original, ties, unknown generators, empty sets, disabled terms, memory, and quality.

use super::*;
use crate::candidate::CandidateKey;
use crate::parameters::QualityMetric;
use crate::scene::Epoch;
use crate::test_scene::{scene, straight};
use crate::verdict::Judgement;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::LaneletRoute;
use messages::builtin_interfaces::Time;
use messages::nav_msgs::Odometry;
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use proptest::prelude::*;
use std::sync::Arc;

const DIFFUSION: &str = "DiffusionPlanner_0";
const GO: &str = "MinimumRuleBasedPlanner_Go";
const STOP: &str = "MinimumRuleBasedPlanner_Stop";
const RISKS: [RiskLevel; 5] =
    [RiskLevel::Safe, RiskLevel::LowCaution, RiskLevel::HighCaution, RiskLevel::Danger, RiskLevel::Fatal];

fn shipped() -> Vec<GeneratorSource> {
    GeneratorSource::table(&[
        "DiffusionPlanner_",
        "MinimumRuleBasedPlanner_Go",
        "MinimumRuleBasedPlanner_Stop",
    ])
}

fn ranker() -> Ranker {
    Ranker::new(RankerParameters::default(), shipped())
}

fn ranker_with(change: impl FnOnce(&mut RankerParameters)) -> Ranker {
    let mut parameters = RankerParameters::default();
    change(&mut parameters);
    Ranker::new(parameters, shipped())
}

/// A candidate of the planner with this number and name.
fn candidate(number: u8, name: &str, sample: u32, speed_mps: f32) -> Candidate {
    let message = CandidateTrajectory {
        header: Header { stamp: Time { sec: 10, nanosec: 0 }, frame_id: "map".to_owned() },
        generator_id: Uuid { uuid: [number; 16] },
        ..CandidateTrajectory::default()
    };
    let mut candidate = Candidate::new(Arc::new(message), name.into(), sample);
    candidate.points = Arc::new(straight(80, speed_mps).into_iter().collect());
    candidate
}

fn verdict(candidate: &Candidate, accepted: bool, risk: RiskLevel) -> Verdict {
    Verdict {
        key: candidate.key,
        accepted,
        feasible: accepted,
        risk,
        data_validity: Judgement::feasible([]),
        judgements: [].into_iter().collect(),
    }
}

fn accept(candidates: &[Candidate]) -> Vec<Verdict> {
    candidates.iter().map(|candidate| verdict(candidate, true, RiskLevel::Safe)).collect()
}

/// Ranks one candidate for each generator name and risk.
fn rank(ranker: &mut Ranker, entries: &[(&str, RiskLevel)]) -> (Vec<Candidate>, Ranking) {
    let candidates: Vec<_> =
        (1_u8..).zip(entries).map(|(number, (name, _))| candidate(number, name, 0, 5.0)).collect();
    let verdicts: Vec<_> = candidates
        .iter()
        .zip(entries)
        .map(|(candidate, (_, risk))| verdict(candidate, true, *risk))
        .collect();
    let ranking = ranker.rank(&scene(), &candidates, &verdicts);
    (candidates, ranking)
}

fn scores(ranking: &Ranking) -> Vec<f32> {
    ranking.ranked.iter().map(|ranked| ranked.score).collect()
}

fn bits(scores: &[f32]) -> Vec<u32> {
    scores.iter().map(|score| score.to_bits()).collect()
}

#[test]
#[expect(clippy::excessive_precision, reason = "the figures as the original prints them")]
fn scores_of_every_risk_and_source() {
    let table = [
        [1.0, 0.913_461_538_461_538_44, 0.903_846_153_846_153_85],
        [0.923_076_923_076_923_13, 0.836_538_461_538_461_56, 0.826_923_076_923_076_87],
        [0.692_307_692_307_692_29, 0.605_769_230_769_230_84, 0.596_153_846_153_846_15],
        [0.230_769_230_769_230_73, 0.144_230_769_230_769_27, 0.134_615_384_615_384_58],
        [0.230_769_230_769_230_73, 0.144_230_769_230_769_27, 0.134_615_384_615_384_58],
    ];
    for (risk, row) in RISKS.into_iter().zip(table) {
        let (_, ranking) = rank(&mut ranker(), &[(DIFFUSION, risk), (GO, risk), (STOP, risk)]);
        let expected = row.map(|score: f64| score as f32);
        assert_eq!(bits(&scores(&ranking)), bits(&expected), "{risk}");
    }
}

#[test]
fn disabled_terms_cost_nothing_but_their_scale_still_counts() {
    type Case = (fn(&mut RankerParameters), [f64; 3]);
    // Of LOW_CAUTION diffusion, SAFE go, HIGH_CAUTION stop.
    let cases: [Case; 6] = [
        (|_| (), [1.0 - 2.0 / 26.0, 1.0 - 2.25 / 26.0, 1.0 - 10.5 / 26.0]),
        (|p| p.safety.enable = false, [1.0, 1.0 - 2.25 / 26.0, 1.0 - 2.5 / 26.0]),
        (|p| p.source.enable = false, [1.0 - 2.0 / 26.0, 1.0, 1.0 - 8.0 / 26.0]),
        (
            |p| {
                p.safety.enable = false;
                p.source.enable = false;
            },
            [1.0, 1.0, 1.0],
        ),
        (|p| p.evaluation.scale = 0.0, [1.0 - 2.0 / 25.0, 1.0 - 2.25 / 25.0, 1.0 - 10.5 / 25.0]),
        (
            |p| {
                p.safety.scale = 3e-7;
                p.source.scale = 3e-7;
                p.evaluation.scale = 3e-7;
            },
            [0.0, 0.0, 0.0],
        ),
    ];
    let entries = [(DIFFUSION, RiskLevel::LowCaution), (GO, RiskLevel::Safe), (STOP, RiskLevel::HighCaution)];
    for (number, (change, expected)) in cases.into_iter().enumerate() {
        let (_, ranking) = rank(&mut ranker_with(change), &entries);
        for (score, expected) in scores(&ranking).into_iter().zip(expected) {
            assert!(
                (f64::from(score) - expected).abs() < 1e-7,
                "case {number}: {score} instead of {expected}"
            );
        }
    }
}

#[test]
fn scores_are_not_clamped() {
    let (_, ranking) =
        rank(&mut ranker_with(|p| p.safety.penalty = vec![3.0; 5]), &[(DIFFUSION, RiskLevel::Safe)]);
    assert!((scores(&ranking)[0] - (1.0 - 60.0 / 26.0)).abs() < 1e-6);
    assert!(ranking.best().is_some(), "a negative score is a score");
}

#[test]
fn best_of_a_set() {
    use RiskLevel::*;
    /// What is ranked, and the place of the best.
    type Case = (&'static [(&'static str, RiskLevel)], Option<usize>);
    let cases: [Case; 8] = [
        (&[(STOP, Safe), (GO, Safe), (DIFFUSION, Safe)], Some(2)),
        (
            &[
                (DIFFUSION, Fatal),
                (DIFFUSION, Danger),
                (DIFFUSION, HighCaution),
                (DIFFUSION, LowCaution),
                (DIFFUSION, Safe),
            ],
            Some(4),
        ),
        (&[(GO, Safe), (DIFFUSION, LowCaution)], Some(1)),
        (&[(DIFFUSION, HighCaution), (GO, Safe)], Some(1)),
        (&[(DIFFUSION, Safe), (DIFFUSION, Safe), (DIFFUSION, Safe)], Some(0)),
        (&[(GO, Safe), (DIFFUSION, Danger), (DIFFUSION, Fatal)], Some(0)),
        (&[(DIFFUSION, Danger), (DIFFUSION, Fatal)], Some(0)),
        (&[], None),
    ];
    for (entries, best) in cases {
        let (_, ranking) = rank(&mut ranker(), entries);
        assert_eq!(ranking.best().map(|best| best.index), best, "{entries:?}");
    }
}

#[test]
fn ties_go_to_the_first_candidate_in_the_bits_that_are_published() {
    // Penalties whose difference is lost in 32 bits: the first of both is best, though the second's score is larger.
    let mut ranker = ranker_with(|p| p.source.penalty = vec![1e-9, 0.0, 0.5]);
    let (_, ranking) = rank(&mut ranker, &[(DIFFUSION, RiskLevel::Safe), (GO, RiskLevel::Safe)]);
    assert_eq!(bits(&scores(&ranking)), bits(&[1.0, 1.0]));
    assert_eq!(ranking.best().unwrap().index, 0);
}

#[test]
fn only_accepted_candidates_are_ranked() {
    let candidates =
        [candidate(1, DIFFUSION, 0, 5.0), candidate(1, DIFFUSION, 1, 5.0), candidate(2, STOP, 0, 5.0)];
    let mut verdicts = accept(&candidates);
    verdicts[0] = verdict(&candidates[0], false, RiskLevel::Safe);
    let ranking = ranker().rank(&scene(), &candidates, &verdicts);
    assert_eq!(ranking.ranked.iter().map(|ranked| ranked.index).collect::<Vec<_>>(), [1, 2]);
    assert!(ranking.unranked.is_empty(), "rejected candidates are the validator's to report");
    assert_eq!(ranking.best().unwrap().index, 1);
    // Verdicts that belong to other candidates let nothing through.
    verdicts.swap(1, 2);
    assert_eq!(ranker().rank(&scene(), &candidates, &verdicts).best(), None);
}

#[test]
fn risk_is_that_of_the_trajectory_and_not_of_its_generator() {
    let candidates =
        [candidate(1, DIFFUSION, 0, 5.0), candidate(1, DIFFUSION, 1, 5.0), candidate(1, DIFFUSION, 2, 5.0)];
    let risks = [RiskLevel::HighCaution, RiskLevel::LowCaution, RiskLevel::Safe];
    let verdicts: Vec<_> =
        candidates.iter().zip(risks).map(|(candidate, risk)| verdict(candidate, true, risk)).collect();
    let ranking = ranker().rank(&scene(), &candidates, &verdicts);
    let penalties: Vec<_> = ranking.ranked.iter().map(|ranked| ranked.penalties.safety).collect();
    assert_eq!(penalties, [0.4, 0.1, 0.0], "upstream gives all three that of the first");
    assert_eq!(ranking.best().unwrap().index, 2);
}

#[test]
fn what_cannot_be_ranked_is_reported_with_the_reason() {
    let entries = [
        ("SafePlanner", RiskLevel::Safe),
        (GO, RiskLevel::Safe),
        ("MinimumRuleBasedPlanner", RiskLevel::Safe),
    ];
    let (_, ranking) = rank(&mut ranker(), &entries);
    assert_eq!(ranking.unranked, [(0, Unrankable::UnknownGenerator), (2, Unrankable::UnknownGenerator)]);
    assert_eq!(ranking.best().unwrap().index, 1);
    // Parameters that the settings refuse must not let a NaN win either.
    let mut ranker = ranker_with(|p| p.source.penalty[1] = f64::NAN);
    let (_, ranking) =
        rank(&mut ranker, &[("x", RiskLevel::Safe), (GO, RiskLevel::Safe), (STOP, RiskLevel::Safe)]);
    assert_eq!(ranking.unranked, [(0, Unrankable::UnknownGenerator), (1, Unrankable::ScoreIsNoNumber)]);
    assert_eq!(ranking.best().unwrap().index, 2);
}

#[test]
fn each_generator_of_the_scored_set_is_listed_once() {
    let candidates = [
        candidate(2, STOP, 0, 5.0),
        candidate(1, DIFFUSION, 0, 5.0),
        candidate(1, DIFFUSION, 1, 5.0),
        candidate(3, "SafePlanner", 0, 5.0),
    ];
    let ranking = ranker().rank(&scene(), &candidates, &accept(&candidates));
    let info = |number: u8, name: &str| GeneratorInfo {
        generator_id: Uuid { uuid: [number; 16] },
        generator_name: Text { data: name.to_owned() },
    };
    let generators = [info(1, DIFFUSION), info(3, "SafePlanner"), info(2, STOP)];
    let message = ranking.to_message(&candidates, &accept(&candidates), &generators);
    assert_eq!(message.generator_info, [info(2, STOP), info(1, DIFFUSION)]);
    let order: Vec<_> = message
        .scored_candidate_trajectories
        .iter()
        .map(|scored| scored.candidate_trajectory.generator_id.uuid[0])
        .collect();
    assert_eq!(order, [2, 1, 1], "input order, not sorted");
    assert_eq!(Ranking::default().to_message(&[], &[], &generators), ScoredCandidateTrajectories::default());
    let mut verdicts = accept(&candidates);
    verdicts[0].accepted = false;
    verdicts.swap(1, 2);
    let message = ranking.to_message(&candidates, &verdicts, &generators);
    assert!(message.scored_candidate_trajectories.is_empty(), "refused, or judged under another's name");
}

#[test]
fn memory_of_what_was_chosen() {
    let mut ranker = ranker_with(|p| p.evaluation.trajectory_history_size = 3);
    assert_eq!(rank(&mut ranker, &[(STOP, RiskLevel::Safe)]).1.previous_source, None);
    for cycle in 1..20 {
        let (candidates, ranking) = rank(&mut ranker, &[(STOP, RiskLevel::Safe)]);
        ranker.remember(&scene(), &candidates, &ranking);
        assert_eq!(ranker.history().len(), cycle.min(3));
    }
    assert!(ranker.history().previous().is_some());
    let (candidates, empty) = rank(&mut ranker, &[]);
    assert_eq!(empty.previous_source, Some(SourceName::BackupPlannerStop));
    ranker.remember(&scene(), &candidates, &empty);
    assert!(ranker.history().previous().is_none(), "an empty cycle clears the previous one");
    assert_eq!(ranker.history().len(), 3, "and keeps the history");
}

/// A scene in which quality can be measured: odometry at the origin and a route.
fn measurable() -> Scene {
    let mut scene = scene();
    scene.odometry = Some(Arc::new(Odometry::default()));
    scene.route = Some(Epoch { number: 1, value: Arc::new(LaneletRoute::default()) });
    scene
}

fn quality(ranking: &Ranking) -> Vec<f64> {
    ranking.ranked.iter().map(|ranked| ranked.penalties.quality).collect()
}

#[test]
fn quality_is_off_by_default_and_needs_a_route() {
    let candidates = [candidate(1, DIFFUSION, 0, 2.0), candidate(1, DIFFUSION, 1, 9.0)];
    let verdicts = accept(&candidates);
    assert_eq!(quality(&ranker().rank(&measurable(), &candidates, &verdicts)), [0.0, 0.0]);
    let mut enabled = ranker_with(|p| p.evaluation.enable = true);
    assert!(quality(&enabled.rank(&measurable(), &candidates, &verdicts))[0] > 0.0);
    assert_eq!(quality(&enabled.rank(&scene(), &candidates, &verdicts)), [0.0, 0.0], "no route, no odometry");
}

/// What upstream computes: every compressed metric normalised against itself, so the weights add up whatever the
/// candidate does.
fn upstream_penalty(candidate: &Candidate) -> f64 {
    let parameters = RankerParameters::default().evaluation;
    let surroundings = Surroundings {
        ego: &Default::default(),
        wheel_base_m: 2.79,
        lanes: &PreferredLanes::default(),
        history: &History::default(),
        parameters: &parameters,
    };
    let measured = metrics::Measured::new(surroundings, candidate).unwrap();
    let total: f32 = QualityMetric::ALL
        .into_iter()
        .map(|metric| {
            let compressed = quality::compressed(&parameters, metric, &measured.values(metric)) as f32;
            let range = compressed;
            let normalised = if range.abs() < f32::EPSILON { 1.0 } else { compressed / range };
            parameters.of(metric).weight as f32 * normalised
        })
        .sum();
    1.0 - f64::from(total)
}

#[test]
fn upstreams_quality_is_a_constant_and_ours_tells_candidates_apart() {
    let (slow, fast) = (candidate(1, DIFFUSION, 0, 2.0), candidate(1, DIFFUSION, 1, 9.0));
    for candidate in [&slow, &fast] {
        assert!((upstream_penalty(candidate) + 0.300_000_071_525_573_73).abs() < 1e-12);
    }
    let candidates = [slow, fast];
    let mut ranker = ranker_with(|p| p.evaluation.enable = true);
    let ranking = ranker.rank(&measurable(), &candidates, &accept(&candidates));
    // Only the distance travelled differs, of weight 0.3 in 1.3.
    let expected = [0.3 / 1.3, 0.0];
    for (found, expected) in quality(&ranking).into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
    }
    assert_eq!(ranking.best().unwrap().index, 1, "upstream takes the first");
    assert!((scores(&ranking)[0] - (1.0 - 0.3 / 1.3 / 26.0) as f32).abs() < 1e-7);
}

#[test]
fn a_candidate_far_from_the_vehicle_gets_the_worst_quality() {
    let mut far = candidate(1, DIFFUSION, 0, 9.0);
    far.points = Arc::new(
        straight(80, 9.0)
            .into_iter()
            .map(|mut point| {
                point.pose.position.y = 50.0;
                point
            })
            .collect(),
    );
    let candidates = [far, candidate(1, DIFFUSION, 1, 2.0)];
    let mut ranker = ranker_with(|p| p.evaluation.enable = true);
    let penalties = quality(&ranker.rank(&measurable(), &candidates, &accept(&candidates)));
    assert_eq!(penalties, [1.0, 0.0]);
}

prop_compose! {
    fn any_entries()(
        entries in prop::collection::vec((0..4_u8, 0..5_usize, any::<bool>(), 0.5..15.0_f32), 0..12),
    ) -> Vec<(Candidate, bool, RiskLevel)> {
        let name = |kind: u8| [DIFFUSION, GO, STOP, "SafePlanner"][usize::from(kind)];
        let mut samples = [0; 4];
        entries
            .into_iter()
            .map(|(kind, risk, accepted, speed)| {
                let sample = &mut samples[usize::from(kind)];
                *sample += 1;
                (candidate(kind + 1, name(kind), *sample - 1, speed), accepted, RISKS[risk])
            })
            .collect()
    }
}

fn rank_entries(entries: &[(Candidate, bool, RiskLevel)], with_quality: bool) -> Ranking {
    let candidates: Vec<_> = entries.iter().map(|(candidate, ..)| candidate.clone()).collect();
    let verdicts: Vec<_> =
        entries.iter().map(|(candidate, accepted, risk)| verdict(candidate, *accepted, *risk)).collect();
    ranker_with(|p| p.evaluation.enable = with_quality).rank(&measurable(), &candidates, &verdicts)
}

proptest! {
    #[test]
    fn every_accepted_candidate_is_ranked_or_reported_and_no_other(
        entries in any_entries(), with_quality in any::<bool>(),
    ) {
        let ranking = rank_entries(&entries, with_quality);
        let mut told: Vec<usize> = ranking.ranked.iter().map(|ranked| ranked.index).collect();
        told.extend(ranking.unranked.iter().map(|(index, _)| *index));
        told.sort_unstable();
        let accepted = entries.iter().enumerate().filter(|(_, (_, accepted, _))| *accepted);
        prop_assert_eq!(told, accepted.map(|(index, _)| index).collect::<Vec<_>>());
        let highest = ranking.ranked.iter().map(|ranked| ranked.score).fold(f32::MIN, f32::max);
        let first = ranking.ranked.iter().find(|ranked| ranked.score == highest);
        prop_assert_eq!(ranking.best(), first);
    }

    #[test]
    fn the_order_of_candidates_changes_no_score(
        entries in any_entries(), turn in 0..12_usize, with_quality in any::<bool>(),
    ) {
        let by_key = |ranking: &Ranking, entries: &[(Candidate, bool, RiskLevel)]| {
            let key = |ranked: &Ranked| entries[ranked.index].0.key;
            let mut scores: Vec<(CandidateKey, u32)> =
                ranking.ranked.iter().map(|ranked| (key(ranked), ranked.score.to_bits())).collect();
            scores.sort_unstable();
            scores
        };
        let mut turned = entries.clone();
        turned.rotate_left(turn % entries.len().max(1));
        turned.reverse();
        let (before, after) = (rank_entries(&entries, with_quality), rank_entries(&turned, with_quality));
        prop_assert_eq!(by_key(&before, &entries), by_key(&after, &turned));
    }
}
