//! What a filter or the ranker may do wrong, and what it costs: the judgement, the choice or the cycle that it happened
//! in. Nothing leaves that was not accepted, it is reported, and the next cycle is normal.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/faulty.rs"]
mod faulty;
#[path = "support/inputs.rs"]
mod inputs;

use crossbeam_channel::unbounded;
use faulty::{START, Scripted, Setup, THREADS, anchor, break_down, number_of, ranker, validator};
use messages::diagnostic_msgs::DiagnosticStatus;
use selection::parameters::RankerParameters;
use selection::ranker::GeneratorSource;
use selection::{Candidate, Evidence, Judgement, Metric, Rank, Ranker, Ranking, RiskLevel, Scene, Verdict};
use selector_actors::topics::OutputMessage;
use selector_actors::{Outcome, OutputTopic, Parameters};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const ERROR: u8 = DiagnosticStatus::ERROR;
/// More than are judged inline, so that the pool has its share.
const MANY: u32 = 32;

/// True once.
#[derive(Clone, Default)]
struct Once(Arc<AtomicBool>);

impl Once {
    fn arm(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn break_down_if_armed(&self) {
        if self.0.swap(false, Ordering::Relaxed) {
            break_down();
        }
    }
}

fn number(candidate: &Candidate) -> u32 {
    number_of(&candidate.message.points)
}

#[test]
fn a_filter_that_panics_over_some_candidates_costs_these() {
    for threads in THREADS {
        for count in [4, MANY] {
            let judge = |candidate: &Candidate| {
                if number(candidate) % 3 == 1 && candidate.message.points.len() == 2 {
                    break_down();
                }
                Judgement::feasible([])
            };
            let filter = Scripted { judge: Arc::new(judge), ..Scripted::default() };
            let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
            let seen = node.cycle(&anchor(START, count));
            let good: Vec<u32> = (0..count).filter(|number| number % 3 != 1).collect();
            let bad = count as usize - good.len();
            assert_eq!(seen.validated(), Some(good));
            assert_eq!(seen.told()[0], (ERROR, "A filter panicked"));
            assert_eq!(seen.value("scripted_filter.rejected"), Some(&bad.to_string()[..]));
            assert_eq!(seen.value("scripted_filter.worst_risk"), Some("fatal"));
            assert_eq!(seen.driven(), Some(0));
            node.cycle(&anchor(START, 1)).assert_normal(1, "the next cycle");
        }
    }
}

#[test]
fn a_filter_that_panics_before_judging_costs_its_cycle() {
    for threads in THREADS {
        let once = Once::default();
        let panics = once.clone();
        let observe = move |_: &Scene| panics.break_down_if_armed();
        let filter = Scripted { observe: Arc::new(observe), ..Scripted::default() };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        node.assert_normal("before");
        once.arm();
        let seen = node.cycle(&anchor(START, MANY));
        assert_eq!((seen.validated(), seen.driven()), (Some(Vec::new()), None));
        assert_eq!(seen.told(), [(ERROR, "A filter panicked"), (ERROR, "Every candidate was rejected")]);
        node.assert_normal("the next cycle");
    }
}

#[test]
fn a_filter_that_panics_while_remembering_is_reported_and_costs_its_memory() {
    for threads in THREADS {
        let once = Once::default();
        let panics = once.clone();
        let remember = move |_| panics.break_down_if_armed();
        let filter = Scripted { remember: Arc::new(remember), ..Scripted::default() };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        once.arm();
        let seen = node.cycle(&anchor(START, MANY));
        assert_eq!(seen.validated().map(|set| set.len()), Some(MANY as usize), "all were judged");
        assert_eq!(seen.told()[0], (ERROR, "A filter panicked"));
        node.assert_normal("the next cycle");
    }
}

#[test]
fn a_filter_that_panics_over_changed_parameters_costs_the_next_cycle() {
    for threads in THREADS {
        let once = Once::default();
        let panics = once.clone();
        let configure = move |_: &_| panics.break_down_if_armed();
        let filter = Scripted { configure: Arc::new(configure), ..Scripted::default() };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        node.assert_normal("before");
        once.arm();
        node.system.configure(Parameters {
            fallback_period_ms: 150,
            duration_time_s: 0.2,
            cycle_budget: None,
            validator: faulty::parameters(),
            ranker: RankerParameters::default(),
            sources: faulty::sources(),
        });
        let seen = node.cycle(&anchor(START, MANY));
        assert_eq!(
            (seen.validated(), seen.driven()),
            (Some(Vec::new()), None),
            "who knows what it checks now"
        );
        assert_eq!(seen.told()[0], (ERROR, "A filter panicked"));
        node.assert_normal("the next cycle");
    }
}

#[test]
fn a_filter_that_does_not_come_back_costs_its_cycles_and_its_late_result_never_leaves() {
    for threads in THREADS {
        // The first candidate to be judged blocks its thread until the sender is gone; the others pass.
        let (release, wait) = unbounded::<()>();
        let first = Once::default();
        first.arm();
        let blocks = first.clone();
        let judge = move |_: &Candidate| {
            if blocks.0.swap(false, Ordering::Relaxed) {
                let _ = wait.recv();
            }
            Judgement::feasible([])
        };
        let filter = Scripted { judge: Arc::new(judge), ..Scripted::default() };
        let budget = Some(Duration::from_millis(20));
        let node = Setup { validator: validator(filter), budget, ..Setup::new(threads) }.start();
        for why in [
            "the validation did not come back within its budget; nothing is published",
            "an earlier cycle is still being judged",
            "an earlier cycle is still being judged",
        ] {
            let seen = node.cycle(&anchor(START, MANY));
            assert_eq!((seen.validated(), seen.driven()), (None, None), "on {threads} threads");
            assert_eq!(seen.told(), [(ERROR, why)]);
        }
        drop(release);
        let numbers: Vec<u64> = std::iter::repeat_with(|| node.cycle(&anchor(START, 1)))
            .take(100_000)
            .find(|seen| matches!(seen.report.outcome, Outcome::Judged(_)))
            .map(|seen| {
                seen.assert_normal(1, "one candidate, of this cycle; the 32 of the first one are gone");
                seen.report.cycle.number
            })
            .into_iter()
            .collect();
        assert!(numbers[0] > 3);
    }
}

#[test]
fn a_node_whose_filter_never_comes_back_can_be_stopped() {
    for threads in THREADS {
        let (_keep, wait) = unbounded::<()>();
        let judge = move |_: &Candidate| {
            let _ = wait.recv();
            Judgement::feasible([])
        };
        let filter = Scripted { judge: Arc::new(judge), ..Scripted::default() };
        let budget = Some(Duration::from_millis(5));
        let node = Setup { validator: validator(filter), budget, ..Setup::new(threads) }.start();
        node.bring(&anchor(START, MANY));
        let state = node.system.stop().unwrap();
        assert_eq!(state.cycles, 1);
    }
}

/// Numbers that are none, places that are not there, thousands of metrics, and contradictions.
fn nonsense(candidate: &Candidate) -> Judgement {
    let metric = |value: f64, risk| Metric { name: "m", value, threshold: f64::NEG_INFINITY, risk };
    let nowhere = Evidence {
        index: usize::MAX,
        time_s: f64::NAN,
        x_m: f64::INFINITY,
        y_m: f64::NAN,
        element_id: Some(i64::MIN),
        regulatory_element_id: Some(i64::MAX),
        object_id: None,
    };
    match number(candidate) % 4 {
        0 => Judgement {
            evidence: Some(nowhere),
            ..Judgement::feasible([
                metric(f64::NAN, RiskLevel::Safe),
                metric(f64::INFINITY, RiskLevel::Fatal),
            ])
        },
        1 => Judgement { feasible: true, ..Judgement::not_assessed("") },
        2 => Judgement { feasible: true, ..Judgement::panicked("although it did not".to_owned()) },
        _ => Judgement {
            feasible: false,
            evidence: Some(nowhere),
            ..Judgement::feasible((0..5000).map(|_| metric(f64::NAN, RiskLevel::Safe)))
        },
    }
}

#[test]
fn a_filter_that_returns_nonsense_lets_only_pass_what_it_found_feasible() {
    for threads in THREADS {
        let talks = Once::default();
        let nonsense_now = talks.clone();
        let judge = move |candidate: &Candidate| {
            if nonsense_now.0.load(Ordering::Relaxed) { nonsense(candidate) } else { Judgement::feasible([]) }
        };
        let filter = Scripted { judge: Arc::new(judge), ..Scripted::default() };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        talks.arm();
        let seen = node.cycle(&anchor(START, MANY));
        let feasible: Vec<u32> = (0..MANY).filter(|number| number % 4 == 0).collect();
        assert_eq!(seen.validated(), Some(feasible));
        let judged = seen.judged().unwrap();
        assert!(
            judged.verdicts.iter().all(|verdict| verdict.judgements[0].evidence.is_none()),
            "no such places"
        );
        let Some(OutputMessage::Reports(reports)) = seen.on(OutputTopic::ValidationReports) else { panic!() };
        assert_eq!(reports.reports.len(), MANY as usize, "every candidate is reported");
        assert_eq!(seen.value("scripted_filter.rejected"), Some("24"));
        talks.0.store(false, Ordering::Relaxed);
        node.assert_normal("the next cycle");
    }
}

/// A ranker that breaks down when it is armed.
#[derive(Debug)]
struct Fragile {
    ranker: Ranker,
    ranking: Arc<AtomicBool>,
    remembering: Arc<AtomicBool>,
}

impl Rank for Fragile {
    fn configure(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        self.ranker.configure(parameters, sources);
    }

    fn rank(&mut self, scene: &Scene, candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking {
        Once(self.ranking.clone()).break_down_if_armed();
        self.ranker.rank(scene, candidates, verdicts)
    }

    fn remember(&mut self, scene: &Scene, candidates: &[Candidate], ranking: &Ranking) {
        Once(self.remembering.clone()).break_down_if_armed();
        self.ranker.remember(scene, candidates, ranking);
    }

    fn forget(&mut self) {
        self.ranker.forget();
    }
}

#[test]
fn a_ranker_that_panics_costs_the_choice_and_the_validated_set_still_leaves() {
    for threads in THREADS {
        for count in [4, MANY] {
            let [ranking, remembering] = [Once::default(), Once::default()];
            let fragile =
                Fragile { ranker: ranker(), ranking: ranking.0.clone(), remembering: remembering.0.clone() };
            let node = Setup { ranker: Box::new(fragile), ..Setup::new(threads) }.start();
            node.assert_normal("before");
            for breaks in [ranking, remembering] {
                breaks.arm();
                let seen = node.cycle(&anchor(START, count));
                assert_eq!(seen.validated().map(|set| set.len()), Some(count as usize));
                let Some(OutputMessage::Scored(scored)) = seen.on(OutputTopic::ScoredTrajectories) else {
                    panic!("scores are published, if only to say that there are none")
                };
                assert!(scored.scored_candidate_trajectories.is_empty());
                for topic in [OutputTopic::Trajectory, OutputTopic::TurnIndicators, OutputTopic::Latency] {
                    assert!(seen.on(topic).is_none(), "{}", topic.full_name());
                }
                assert_eq!(seen.told(), [(DiagnosticStatus::OK, "OK"), (ERROR, "The ranker panicked")]);
                assert_eq!(seen.value("ranker.panic"), Some("broken on purpose"));
                node.assert_normal("the next cycle");
            }
        }
    }
}
