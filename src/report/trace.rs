//! A run as a trace that Chrome and Perfetto show: a span for every cycle, every thread's chunk of candidates, and every
//! filter in it.
//!
//! The tracks are `triggers` (from arrival to the beginning of the cycle), `cycles` (with their stages) and one for each
//! thread that judges. A thread judges candidate after candidate with all filters; within its chunk the filters' spans
//! show how much of it each filter took, one behind the other, not when. Bounded: the first [`MAX_CYCLES`] are traced.

use selector_actors::cycle::{CycleReport, CycleTimes, Judged, Outcome};
use serde_json::{Value, json};
use std::io::Write;
use std::time::{Duration, Instant};

/// Most cycles in a trace; viewers get slow beyond.
pub const MAX_CYCLES: usize = 20_000;

const TRIGGERS: usize = 1;
const CYCLES: usize = 2;
/// Track of the first thread that judges.
const FIRST_THREAD: usize = 10;

/// Spans gathered cycle by cycle.
#[derive(Debug)]
pub struct Trace {
    start: Instant,
    spans: Vec<Span>,
    cycles: usize,
    threads: usize,
    left_out: u64,
}

#[derive(Debug)]
struct Span {
    track: usize,
    name: String,
    begins: Duration,
    took: Duration,
    arguments: Value,
}

impl Trace {
    /// An empty trace whose time begins at `start`.
    #[must_use]
    pub fn new(start: Instant) -> Self {
        Self { start, spans: Vec::new(), cycles: 0, threads: 0, left_out: 0 }
    }

    /// Takes in one cycle.
    pub fn add(&mut self, report: &CycleReport, times: CycleTimes) {
        if self.cycles == MAX_CYCLES {
            self.left_out += 1;
            return;
        }
        self.cycles += 1;
        let cycle = &report.cycle;
        let taken_up = cycle.arrived + cycle.receive;
        let mut at = cycle.arrived;
        for (stage, took) in [("receive", cycle.receive), ("buffer", cycle.buffer), ("wait", cycle.wait())] {
            at = self.span(TRIGGERS, stage, at.max(cycle.arrived), took, json!({ "cycle": cycle.number }));
        }
        let ended = cycle.arrived + times.cycle;
        let (accepted, not_judged) = match &report.outcome {
            Outcome::Judged(judged) => {
                let accepted = judged.verdicts.iter().filter(|verdict| verdict.accepted).count();
                (accepted, judged.not_judged())
            }
            _ => (0, 0),
        };
        let arguments = json!({
            "trigger": cycle.trigger.name(),
            "candidates": cycle.concatenated.candidates.len(),
            "accepted": accepted,
            "not_judged": not_judged,
            "early_return": report.outcome.early_return(),
            "waited_us": micros(cycle.started.saturating_duration_since(taken_up)),
        });
        let whole = ended.saturating_duration_since(cycle.started);
        self.span(CYCLES, &format!("cycle {}", cycle.number), cycle.started, whole, arguments);
        self.span(CYCLES, "snapshot", cycle.started, cycle.snapshot, Value::Null);
        if let Outcome::Judged(judged) = &report.outcome {
            self.add_judged(judged);
        }
        self.span(
            CYCLES,
            "publish",
            ended.checked_sub(times.publish).unwrap_or(ended),
            times.publish,
            Value::Null,
        );
    }

    fn add_judged(&mut self, judged: &Judged) {
        let mut at = judged.began;
        for (stage, took) in [
            ("observe", judged.observe),
            ("judge", judged.judge),
            ("rank", judged.rank + judged.adapt),
            ("report", judged.report),
        ] {
            at = self.span(CYCLES, stage, at, took, Value::Null);
        }
        self.threads = self.threads.max(judged.shares.len());
        for (thread, share) in judged.shares.iter().enumerate() {
            let track = FIRST_THREAD + thread;
            let arguments = json!({ "candidates": share.candidates, "allocations": share.allocations });
            self.span(track, "chunk", share.began, share.ended - share.began, arguments);
            let mut at = share.began;
            for (filter, &took) in judged.filters[1..].iter().zip(&share.filter_times) {
                at = self.span(track, filter.name, at, took, Value::Null);
            }
        }
    }

    /// Adds a span and gives its end.
    fn span(
        &mut self,
        track: usize,
        name: &str,
        begins: Instant,
        took: Duration,
        arguments: Value,
    ) -> Instant {
        let since_start = begins.saturating_duration_since(self.start);
        self.spans.push(Span { track, name: name.to_owned(), begins: since_start, took, arguments });
        begins + took
    }

    /// Cycles that are not traced because there were too many.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Writes the trace in Chrome's JSON form.
    ///
    /// # Errors
    /// The writer fails.
    pub fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        write!(out, "{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[")?;
        let threads = (0..self.threads).map(|thread| (FIRST_THREAD + thread, format!("judge-{thread}")));
        let tracks = [(TRIGGERS, "triggers".to_owned()), (CYCLES, "cycles".to_owned())];
        for (index, (track, name)) in tracks.into_iter().chain(threads).enumerate() {
            let comma = if index == 0 { "" } else { "," };
            let named = json!({
                "ph": "M", "name": "thread_name", "pid": 1, "tid": track, "args": { "name": name },
            });
            writeln!(out, "{comma}{named}")?;
        }
        for span in &self.spans {
            let mut event = json!({
                "ph": "X",
                "name": span.name,
                "pid": 1,
                "tid": span.track,
                "ts": micros(span.begins),
                "dur": micros(span.took),
            });
            if !span.arguments.is_null() {
                event["args"] = span.arguments.clone();
            }
            writeln!(out, ",{event}")?;
        }
        writeln!(out, "]}}")
    }
}

fn micros(took: Duration) -> f64 {
    took.as_nanos() as f64 / 1000.0
}
