//! Owns the filters with their memory and the rayon pool; turns a cycle into its report.
//!
//! The arbiter thread never waits for judging: the validator goes out to the pool with the cycle and comes back with the
//! report. Few candidates are judged inline, because waking a pool costs more than they do. Changed parameters take
//! effect between two cycles.

use crate::cycle::{Cycle, CycleReport, Judged, Outcome};
use crate::publisher::{PublishCycle, Publisher};
use actix::{Actor, Addr, AsyncContext, Context, Handler, Message};
use rayon::ThreadPool;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSlice;
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Scene, Scratch, Validator, Verdict, report};
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
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

/// The owner of the filters.
#[derive(Debug)]
pub(crate) struct Validation {
    pool: Arc<ThreadPool>,
    publisher: Addr<Publisher>,
    /// Away while a cycle is judged.
    validator: Option<Box<Validator>>,
    /// Parameters that arrived while the validator was away.
    changed: Option<ValidatorParameters>,
}

impl Validation {
    pub(crate) fn new(validator: Validator, pool: Arc<ThreadPool>, publisher: Addr<Publisher>) -> Self {
        Self { pool, publisher, validator: Some(Box::new(validator)), changed: None }
    }

    fn take_back(&mut self, mut validator: Box<Validator>, report: CycleReport) {
        if let Some(parameters) = self.changed.take() {
            validator.configure(parameters);
        }
        self.validator = Some(validator);
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
        let Some(mut validator) = self.validator.take() else {
            // The scheduler runs one cycle at a time, so this is a defect; the cycle must end all the same.
            let outcome = Outcome::Failed("the previous cycle is still being judged".to_owned());
            self.publisher.do_send(PublishCycle(Box::new(CycleReport { cycle, outcome })));
            return;
        };
        if cycle.concatenated.candidates.len() <= INLINE_CANDIDATES {
            let report = judge_cycle(&mut validator, cycle, &judge_inline);
            self.take_back(validator, report);
            return;
        }
        let me = ctx.address();
        self.pool.spawn(move || {
            let report = judge_cycle(&mut validator, cycle, &judge_in_parallel);
            me.do_send(CycleJudged { validator, report });
        });
    }
}

/// The validator comes back with its report.
#[derive(Debug)]
struct CycleJudged {
    validator: Box<Validator>,
    report: CycleReport,
}

impl Message for CycleJudged {
    type Result = ();
}

impl Handler<CycleJudged> for Validation {
    type Result = ();

    fn handle(&mut self, judged: CycleJudged, _: &mut Self::Context) {
        self.take_back(judged.validator, judged.report);
    }
}

/// Parameters that take effect with the next cycle.
#[derive(Debug)]
pub(crate) struct SetValidatorParameters(pub(crate) ValidatorParameters);

impl Message for SetValidatorParameters {
    type Result = ();
}

impl Handler<SetValidatorParameters> for Validation {
    type Result = ();

    fn handle(&mut self, SetValidatorParameters(parameters): SetValidatorParameters, _: &mut Self::Context) {
        match &mut self.validator {
            Some(validator) => validator.configure(parameters),
            None => self.changed = Some(parameters),
        }
    }
}

/// Judges all candidates of a scene; gives verdicts in candidate order and nanoseconds by filter.
type JudgeAll = dyn Fn(&Validator, &Scene, &[Candidate]) -> (Vec<Verdict>, Vec<u64>);

/// One whole cycle. Filters catch their own panics; should anything else break, the cycle fails and publishes nothing.
fn judge_cycle(validator: &mut Validator, cycle: Cycle, judge_all: &JudgeAll) -> CycleReport {
    let judged = catch_unwind(AssertUnwindSafe(|| {
        let started = Instant::now();
        validator.observe(&cycle.scene);
        let observe = started.elapsed();
        let candidates = &cycle.concatenated.candidates;
        let (verdicts, times_ns) = judge_all(validator, &cycle.scene, candidates);
        validator.remember(candidates, &verdicts);
        let judge = started.elapsed().saturating_sub(observe);
        Judged {
            validated: Arc::new(report::validated_set(&cycle.concatenated, &verdicts)),
            reports: Arc::new(report::validation_reports(validator, candidates, &verdicts)),
            filters: report::filter_summaries(validator, &verdicts),
            filter_times: times_ns.into_iter().map(Duration::from_nanos).collect(),
            verdicts,
            observe,
            judge,
        }
    }));
    let outcome = match judged {
        Ok(judged) => Outcome::Judged(judged),
        Err(_) => {
            error!("cycle {} failed: the validation panicked outside of its filters", cycle.number);
            Outcome::Failed("the validation panicked outside of its filters".to_owned())
        }
    };
    CycleReport { cycle, outcome }
}

fn judge_inline(validator: &Validator, scene: &Scene, candidates: &[Candidate]) -> (Vec<Verdict>, Vec<u64>) {
    let mut times_ns = vec![0; validator.filters().len()];
    let verdicts = SCRATCH.with_borrow_mut(|scratch| {
        let mut judge = |candidate| validator.judge(scene, candidate, scratch, monotonic_ns, &mut times_ns);
        candidates.iter().map(&mut judge).collect()
    });
    (verdicts, times_ns)
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
