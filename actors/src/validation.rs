//! Owns the pipeline (filters and ranker with their memory) and the rayon pool; turns a cycle into its report.
//!
//! The arbiter thread never waits for judging: the pipeline goes out to the pool with the cycle and comes back with the
//! report. Few candidates are judged inline, because waking a pool costs more than they do. Changed parameters take
//! effect between two cycles.

use crate::cycle::{Cycle, CycleReport, Outcome};
use crate::publisher::{PublishCycle, Publisher};
use actix::{Actor, Addr, AsyncContext, Context, Handler, Message};
use rayon::ThreadPool;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSlice;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::pipeline::{JudgeAll, judge_in_order};
use selection::ranker::GeneratorSource;
use selection::{Candidate, Pipeline, Scene, Scratch, Validator, Verdict};
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock};
use std::time::Instant;
use tracing::error;

/// Up to this many candidates are judged on the arbiter thread. Waking the pool after 100 ms of sleep costs about as
/// much as judging eight candidates.
const INLINE_CANDIDATES: usize = 8;
/// Candidates per piece of work on the pool: large enough to hide the cost of stealing, small enough to spread 64
/// candidates over the cores.
const CHUNK: usize = 8;

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// The owner of the pipeline.
#[derive(Debug)]
pub(crate) struct Validation {
    pool: Arc<ThreadPool>,
    publisher: Addr<Publisher>,
    /// Away while a cycle is judged.
    pipeline: Option<Box<Pipeline>>,
    /// Parameters that arrived while the pipeline was away.
    changed: Changes,
}

/// Parameters that wait for the end of a cycle.
#[derive(Debug, Default)]
struct Changes {
    validator: Option<ValidatorParameters>,
    ranker: Option<(RankerParameters, Vec<GeneratorSource>)>,
}

impl Changes {
    fn apply(self, pipeline: &mut Pipeline) {
        if let Some(parameters) = self.validator {
            pipeline.configure_validator(parameters);
        }
        if let Some((parameters, sources)) = self.ranker {
            pipeline.configure_ranker(parameters, sources);
        }
    }
}

impl Validation {
    pub(crate) fn new(pipeline: Pipeline, pool: Arc<ThreadPool>, publisher: Addr<Publisher>) -> Self {
        Self { pool, publisher, pipeline: Some(Box::new(pipeline)), changed: Changes::default() }
    }

    /// Changes the parameters, now or when the pipeline is back.
    fn change(&mut self, note: impl FnOnce(&mut Changes)) {
        note(&mut self.changed);
        if let Some(pipeline) = &mut self.pipeline {
            std::mem::take(&mut self.changed).apply(pipeline);
        }
    }

    fn take_back(&mut self, mut pipeline: Box<Pipeline>, report: CycleReport) {
        std::mem::take(&mut self.changed).apply(&mut pipeline);
        self.pipeline = Some(pipeline);
        self.publisher.do_send(PublishCycle(Box::new(report)));
    }
}

impl Actor for Validation {
    type Context = Context<Self>;
}

impl Message for Cycle {
    type Result = ();
}

impl Handler<Cycle> for Validation {
    type Result = ();

    fn handle(&mut self, cycle: Cycle, ctx: &mut Self::Context) {
        let outcome = if cycle.concatenated.candidates.is_empty() {
            Some(Outcome::NoCandidates)
        } else {
            cycle.scene.missing_input().map(Outcome::MissingInput)
        };
        if let Some(outcome) = outcome {
            self.publisher.do_send(PublishCycle(Box::new(CycleReport { cycle, outcome })));
            return;
        }
        let Some(mut pipeline) = self.pipeline.take() else {
            // The scheduler runs one cycle at a time, so this is a defect; the cycle must end all the same.
            let outcome = Outcome::Failed("the previous cycle is still being judged".to_owned());
            self.publisher.do_send(PublishCycle(Box::new(CycleReport { cycle, outcome })));
            return;
        };
        if cycle.concatenated.candidates.len() <= INLINE_CANDIDATES {
            let report = run_cycle(&mut pipeline, cycle, &judge_inline);
            self.take_back(pipeline, report);
            return;
        }
        let me = ctx.address();
        self.pool.spawn(move || {
            let report = run_cycle(&mut pipeline, cycle, &judge_in_parallel);
            me.do_send(CycleJudged { pipeline, report });
        });
    }
}

/// The pipeline comes back with its report.
#[derive(Debug)]
struct CycleJudged {
    pipeline: Box<Pipeline>,
    report: CycleReport,
}

impl Message for CycleJudged {
    type Result = ();
}

impl Handler<CycleJudged> for Validation {
    type Result = ();

    fn handle(&mut self, judged: CycleJudged, _: &mut Self::Context) {
        self.take_back(judged.pipeline, judged.report);
    }
}

/// Parameters of the filters that take effect with the next cycle.
#[derive(Debug)]
pub(crate) struct SetValidatorParameters(pub(crate) ValidatorParameters);

impl Message for SetValidatorParameters {
    type Result = ();
}

impl Handler<SetValidatorParameters> for Validation {
    type Result = ();

    fn handle(&mut self, SetValidatorParameters(parameters): SetValidatorParameters, _: &mut Self::Context) {
        self.change(|changes| changes.validator = Some(parameters));
    }
}

/// Parameters of the ranker that take effect with the next cycle.
#[derive(Debug)]
pub(crate) struct SetRankerParameters(pub(crate) RankerParameters, pub(crate) Vec<GeneratorSource>);

impl Message for SetRankerParameters {
    type Result = ();
}

impl Handler<SetRankerParameters> for Validation {
    type Result = ();

    fn handle(&mut self, set: SetRankerParameters, _: &mut Self::Context) {
        let SetRankerParameters(parameters, sources) = set;
        self.change(|changes| changes.ranker = Some((parameters, sources)));
    }
}

/// One whole cycle. Filters catch their own panics; should anything else break, the cycle fails and publishes nothing.
fn run_cycle(pipeline: &mut Pipeline, cycle: Cycle, judge_all: &JudgeAll<'_>) -> CycleReport {
    let step = catch_unwind(AssertUnwindSafe(|| {
        pipeline.step(&cycle.scene, &cycle.concatenated, judge_all, monotonic_ns)
    }));
    let outcome = match step {
        Ok(step) => Outcome::Judged(Box::new(step.into())),
        Err(_) => {
            error!("cycle {} failed: the validation panicked outside of its filters", cycle.number);
            Outcome::Failed("the validation panicked outside of its filters".to_owned())
        }
    };
    CycleReport { cycle, outcome }
}

fn judge_inline(validator: &Validator, scene: &Scene, candidates: &[Candidate]) -> (Vec<Verdict>, Vec<u64>) {
    SCRATCH.with_borrow_mut(|scratch| judge_in_order(validator, scene, candidates, scratch, monotonic_ns))
}

/// Chunks may finish in any order; the verdicts are collected in the order of the candidates.
fn judge_in_parallel(
    validator: &Validator,
    scene: &Scene,
    candidates: &[Candidate],
) -> (Vec<Verdict>, Vec<u64>) {
    let mut chunks = Vec::new();
    candidates
        .par_chunks(CHUNK)
        .map(|chunk| judge_inline(validator, scene, chunk))
        .collect_into_vec(&mut chunks);
    let mut times_ns = vec![0; validator.filters().len()];
    let mut verdicts = Vec::with_capacity(candidates.len());
    for (chunk_verdicts, chunk_times) in chunks {
        verdicts.extend(chunk_verdicts);
        for (total, time) in times_ns.iter_mut().zip(chunk_times) {
            *total += time;
        }
    }
    (verdicts, times_ns)
}

/// Nanoseconds since the first call.
fn monotonic_ns() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    u64::try_from(START.get_or_init(Instant::now).elapsed().as_nanos()).unwrap_or(u64::MAX)
}
