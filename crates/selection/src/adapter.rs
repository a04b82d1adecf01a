//! From the best candidate to the messages that drive the vehicle.
//!
//! Nothing is resampled, smoothed or decided here: header, points and turn indicator command go out as they came in.
//! This is the last gate: what was not accepted in this very cycle does not pass, whatever the ranking says.

use crate::candidate::{Candidate, CandidateKey};
use crate::ranker::{Ranking, accepted_at};
use crate::verdict::Verdict;
use messages::autoware_internal_debug_msgs::Float64Stamped;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::Trajectory;
use messages::autoware_vehicle_msgs::TurnIndicatorsCommand;
use messages::builtin_interfaces::Time;
use std::sync::Arc;

/// The trajectory to drive.
#[derive(Debug, Clone)]
pub struct Selected {
    /// The candidate that it was.
    pub key: CandidateKey,
    /// Name of its generator.
    pub generator_name: Arc<str>,
    /// Its score.
    pub score: f32,
    /// The message.
    pub trajectory: Arc<Trajectory>,
    turn_indicators: TurnIndicatorsCommand,
}

/// The best candidate of a ranking, if there is one and it was accepted. `verdicts` has one verdict for each candidate.
#[must_use]
pub fn select(candidates: &[Candidate], verdicts: &[Verdict], ranking: &Ranking) -> Option<Selected> {
    let best = ranking.best()?;
    let candidate = accepted_at(best.index, candidates, verdicts)?;
    let CandidateTrajectory { header, points, turn_indicators_command, .. } = &*candidate.message;
    Some(Selected {
        key: candidate.key,
        generator_name: candidate.generator_name.clone(),
        score: best.score,
        trajectory: Arc::new(Trajectory { header: header.clone(), points: points.clone() }),
        turn_indicators: *turn_indicators_command,
    })
}

impl Selected {
    /// What the turn indicators shall do, as of `now`. `NO_COMMAND` where candidates carry no command.
    #[must_use]
    pub fn turn_indicators(&self, now: Time) -> TurnIndicatorsCommand {
        TurnIndicatorsCommand { stamp: now, ..self.turn_indicators }
    }

    /// How old the trajectory is when it leaves at `now`, s. Negative for one stamped in the future.
    #[must_use]
    pub fn latency(&self, now: Time) -> Float64Stamped {
        let stamp = self.trajectory.header.stamp;
        let age_ns = now.nanoseconds().saturating_sub(stamp.nanoseconds());
        Float64Stamped { stamp: now, data: age_ns as f64 * 1e-9 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::RankerParameters;
    use crate::ranker::{GeneratorSource, Ranker};
    use crate::test_scene::scene;
    use crate::verdict::{Judgement, RiskLevel};
    use messages::autoware_planning_msgs::TrajectoryPoint;
    use messages::std_msgs::Header;
    use messages::unique_identifier_msgs::Uuid;

    fn candidate(number: u8, name: &str, command: u8) -> Candidate {
        let point =
            |speed| TrajectoryPoint { longitudinal_velocity_mps: speed, ..TrajectoryPoint::default() };
        let message = CandidateTrajectory {
            header: Header {
                stamp: Time { sec: 9, nanosec: 750_000_000 },
                frame_id: format!("map of {number}"),
            },
            generator_id: Uuid { uuid: [number; 16] },
            points: vec![point(f32::from(number)), point(0.1)],
            turn_indicators_command: TurnIndicatorsCommand { stamp: Time { sec: 3, nanosec: 0 }, command },
        };
        Candidate::new(Arc::new(message), name.into(), 0)
    }

    fn verdict(candidate: &Candidate, accepted: bool) -> Verdict {
        Verdict {
            key: candidate.key,
            accepted,
            feasible: accepted,
            risk: RiskLevel::Safe,
            data_validity: Judgement::feasible([]),
            judgements: [].into_iter().collect(),
        }
    }

    fn three() -> (Vec<Candidate>, Vec<Verdict>) {
        let candidates = vec![
            candidate(1, "MinimumRuleBasedPlanner_Stop", TurnIndicatorsCommand::DISABLE),
            candidate(2, "DiffusionPlanner_0", TurnIndicatorsCommand::ENABLE_LEFT),
            candidate(3, "DiffusionPlanner_1", TurnIndicatorsCommand::ENABLE_RIGHT),
        ];
        let verdicts = candidates.iter().map(|candidate| verdict(candidate, true)).collect();
        (candidates, verdicts)
    }

    fn rank(candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking {
        let entries = ["DiffusionPlanner_", "MinimumRuleBasedPlanner_Stop"];
        Ranker::new(RankerParameters::default(), GeneratorSource::table(&entries)).rank(
            &scene(),
            candidates,
            verdicts,
        )
    }

    #[test]
    fn the_best_candidate_goes_out_as_it_came_in() {
        let (candidates, verdicts) = three();
        let selected = select(&candidates, &verdicts, &rank(&candidates, &verdicts)).unwrap();
        let message = &candidates[1].message;
        assert_eq!(selected.key, candidates[1].key);
        assert_eq!(&*selected.generator_name, "DiffusionPlanner_0");
        assert_eq!(selected.score.to_bits(), 1.0_f32.to_bits());
        assert_eq!(
            (&selected.trajectory.header, &selected.trajectory.points),
            (&message.header, &message.points)
        );
    }

    #[test]
    fn every_command_to_the_indicators_passes_with_the_stamp_of_now() {
        let now = Time { sec: 10, nanosec: 5 };
        for command in 0..=3 {
            let candidates = [candidate(2, "DiffusionPlanner_0", command)];
            let verdicts = [verdict(&candidates[0], true)];
            let selected = select(&candidates, &verdicts, &rank(&candidates, &verdicts)).unwrap();
            assert_eq!(selected.turn_indicators(now), TurnIndicatorsCommand { stamp: now, command });
        }
    }

    #[test]
    fn latency_is_the_age_of_the_trajectory() {
        let (candidates, verdicts) = three();
        let selected = select(&candidates, &verdicts, &rank(&candidates, &verdicts)).unwrap();
        for (now, age_s) in [((10, 0), 0.25), ((9, 750_000_000), 0.0), ((9, 500_000_000), -0.25)] {
            let now = Time { sec: now.0, nanosec: now.1 };
            let latency = selected.latency(now);
            assert_eq!(latency.stamp, now);
            assert!((latency.data - age_s).abs() < 1e-12, "{} at {now:?}", latency.data);
        }
    }

    #[test]
    fn of_an_empty_set_nothing_is_selected() {
        assert!(select(&[], &[], &Ranking::default()).is_none());
        let (candidates, _) = three();
        let rejected: Vec<_> = candidates.iter().map(|candidate| verdict(candidate, false)).collect();
        assert!(select(&candidates, &rejected, &rank(&candidates, &rejected)).is_none());
    }

    #[test]
    fn what_was_not_accepted_in_this_cycle_does_not_pass_whatever_the_ranking_says() {
        let (candidates, mut verdicts) = three();
        let ranking = rank(&candidates, &verdicts);
        verdicts[1].accepted = false;
        assert!(select(&candidates, &verdicts, &ranking).is_none());
        verdicts[1].accepted = true;
        verdicts.swap(1, 2);
        assert!(select(&candidates, &verdicts, &ranking).is_none(), "the verdict of another candidate");
        assert!(select(&candidates[..1], &verdicts, &ranking).is_none());
    }
}
