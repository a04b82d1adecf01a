//! The state table of the hysteresis, and what the memory keeps.

use super::*;
use crate::candidate::CandidateKey;
use messages::unique_identifier_msgs::Uuid;

const BUFFERS: Buffers = Buffers { on_s: 0.15, off_s: 0.15 };

fn finding(is_critical: bool, time_s: f64) -> Evaluation {
    let finding = Finding { lateral_m: 0.0, index: 0, time_s, border: 0, is_critical };
    Evaluation { left: None, right: Some(finding) }
}

/// Feeds steps of (time, evaluation) and gives the statuses.
fn statuses(steps: &[(f64, Option<Evaluation>)]) -> Vec<Status> {
    let mut hysteresis = Hysteresis::default();
    steps.iter().map(|(now_s, evaluation)| hysteresis.update(*now_s, evaluation.as_ref(), BUFFERS)).collect()
}

#[test]
fn state_table() {
    use Status::{Clear, Critical, Pending};
    let (safe, late, soon) = (Some(finding(false, 3.0)), Some(finding(true, 3.0)), Some(finding(true, 0.1)));
    /// Name, evaluations at their times, expected status after each.
    type Case = (&'static str, Vec<(f64, Option<Evaluation>)>, Vec<Status>);
    let cases: [Case; 7] = [
        ("never seen: at once", vec![(1000.0, late)], vec![Critical]),
        ("on buffer", vec![(10.0, safe), (10.1, late), (10.2, late)], vec![Clear, Pending, Critical]),
        ("due at once", vec![(10.0, safe), (10.1, soon)], vec![Clear, Critical]),
        ("off buffer", vec![(10.0, late), (10.1, safe), (10.2, safe)], vec![Critical, Critical, Clear]),
        (
            "nothing near ends a hold",
            vec![(10.0, late), (10.1, None), (10.12, safe)],
            vec![Critical, Clear, Clear],
        ),
        (
            "critical again while held",
            vec![(10.0, late), (10.1, safe), (10.14, late)],
            vec![Critical, Critical, Pending],
        ),
        ("time goes back", vec![(10.0, late), (9.5, safe), (9.0, late)], vec![Critical, Critical, Pending]),
    ];
    for (name, steps, expected) in cases {
        assert_eq!(statuses(&steps), expected, "{name}");
    }
}

#[test]
fn a_buffer_that_is_met_exactly_is_over() {
    // In f64 the difference is 0.30000000000000027.
    let buffers = Buffers { on_s: 0.3, off_s: 0.3 };
    let mut hysteresis = Hysteresis::default();
    hysteresis.update(3.319, Some(&finding(false, 3.0)), buffers);
    assert_eq!(hysteresis.update(3.619, Some(&finding(true, 3.0)), buffers), Status::Critical);
}

fn key(sample: u32) -> CandidateKey {
    CandidateKey { generator: Uuid::default(), sample }
}

#[test]
fn memory_forgets_what_is_old_and_everything_when_time_goes_back() {
    let mut seen = Hysteresis::default();
    seen.update(5.0, Some(&finding(true, 3.0)), BUFFERS);
    let mut memory = Memory::default();
    memory.advance(5.0, BUFFERS);
    memory.store(key(1), seen);
    memory.advance(15.0, BUFFERS);
    memory.store(key(2), seen);
    assert_eq!((memory.recall(key(1)), memory.recall(key(3))), (seen, Hysteresis::default()));
    memory.advance(15.1, BUFFERS);
    assert_eq!((memory.recall(key(1)), memory.recall(key(2))), (Hysteresis::default(), seen));
    memory.advance(14.2, BUFFERS);
    assert_eq!(memory.recall(key(2)), seen, "a little jitter");
    memory.advance(13.1, BUFFERS);
    assert_eq!(memory.recall(key(2)), Hysteresis::default());
}

#[test]
fn a_long_buffer_is_remembered_longer() {
    let buffers = Buffers { on_s: 0.1, off_s: 3.0 };
    let seen = Hysteresis::default();
    let mut memory = Memory::default();
    memory.advance(5.0, buffers);
    memory.store(key(1), seen);
    memory.advance(34.9, buffers);
    assert_eq!(memory.len(), 1);
    memory.advance(35.1, buffers);
    assert_eq!(memory.len(), 0);
}
