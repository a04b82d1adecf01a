//! Owns the pipeline (filters and ranker with their memory) and the rayon pool; turns a cycle into its report.
//!
//! The arbiter thread never waits for judging: the pipeline goes out to the pool with the cycle and comes back with the
//! report. Few candidates are judged inline, because waking a pool costs more than they do. Changed parameters take
//! effect between two cycles.
//!
//! A cycle with a deadline is cut, not late: candidates whose turn has not come by then are not judged and so not
//! published; the newest are judged first. Such a cycle never runs inline, and should a filter not come back at all, the
//! cycle is given up after [`GRACE`]: it publishes nothing, then or ever.

mod custody;

pub(crate) use custody::Custody;

use crate::cycle::{Cycle, CycleReport, Judged, Outcome, Share};
use crate::lifeline::Lifeline;
use crate::publisher::{PublishCycle, Publisher};
use actix::{Actor, Addr, AsyncContext, Context, Handler, Message};
use rayon::ThreadPool;
use selection::panics::caught;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Candidate, Pipeline, Scene, Scratch, Validator, Verdict};
use std::cell::RefCell;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use tracing::{error, warn};

/// Up to this many candidates are judged on the arbiter thread. Waking the pool after 100 ms of sleep costs about as
/// much as judging eight candidates.
const INLINE_CANDIDATES: usize = 8;
/// A cycle that has not come back so long after its deadline is given up. Longer than any candidate takes to judge.
const GRACE: Duration = Duration::from_millis(50);

/// Why a cycle was given up.
const NEVER_CAME_BACK: &str = "the validation did not come back within its budget; nothing is published";

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// The owner of the pipeline.
#[derive(Debug)]
pub(crate) struct Validation {
    pub(crate) pool: Arc<ThreadPool>,
    publisher: Addr<Publisher>,
    /// Away while a cycle is judged.
    pipeline: Custody<Box<Pipeline>>,
    /// Parameters that arrived while the pipeline was away.
    changed: Changes,
    count_allocations: Option<CountAllocations>,
    _lifeline: Lifeline,
}

/// Heap allocations of the calling thread so far.
type CountAllocations = fn() -> u64;

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
    pub(crate) fn new(
        pipeline: Pipeline,
        pool: Arc<ThreadPool>,
        publisher: Addr<Publisher>,
        count_allocations: Option<CountAllocations>,
        lifeline: Lifeline,
    ) -> Self {
        Self {
            pool,
            publisher,
            pipeline: Custody::of(Box::new(pipeline)),
            changed: Changes::default(),
            count_allocations,
            _lifeline: lifeline,
        }
    }

    /// Changes the parameters, now or when the pipeline is back.
    fn change(&mut self, note: impl FnOnce(&mut Changes)) {
        note(&mut self.changed);
        if let Some(pipeline) = self.pipeline.here() {
            std::mem::take(&mut self.changed).apply(pipeline);
        }
    }

    /// Whether the cycle that the pipeline comes back from is still waited for.
    fn take_back(&mut self, mut pipeline: Box<Pipeline>, cycle: u64) -> bool {
        std::mem::take(&mut self.changed).apply(&mut pipeline);
        self.pipeline.take_back(pipeline, cycle)
    }

    fn publish(&self, report: CycleReport) {
        self.publisher.do_send(PublishCycle(Box::new(report)));
    }

    /// Ends the cycle without a result if it is still being judged so long after its deadline.
    fn give_up_late(&mut self, cycle: &Cycle, deadline: Instant, ctx: &mut Context<Self>) {
        let number = cycle.number;
        let late = CycleReport { cycle: cycle.clone(), outcome: Outcome::Failed(NEVER_CAME_BACK.to_owned()) };
        let wait = deadline.saturating_duration_since(Instant::now()) + GRACE;
        ctx.run_later(wait, move |validation, _| {
            if validation.pipeline.give_up(number) {
                validation.publish(late);
            }
        });
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
            self.publish(CycleReport { cycle, outcome });
            return;
        }
        let Some(mut pipeline) = self.pipeline.hand_out(cycle.number) else {
            // A filter has not come back from a cycle that was given up; this one must end all the same.
            let outcome = Outcome::Failed("an earlier cycle is still being judged".to_owned());
            self.publish(CycleReport { cycle, outcome });
            return;
        };
        let count_allocations = self.count_allocations;
        if let Some(deadline) = cycle.deadline {
            self.give_up_late(&cycle, deadline, ctx);
        } else if cycle.concatenated.candidates.len() <= INLINE_CANDIDATES {
            let report = run_cycle(&mut pipeline, cycle, &|work| vec![work.share(count_allocations)]);
            self.take_back(pipeline, report.cycle.number);
            self.publish(report);
            return;
        }
        let me = ctx.address();
        self.pool.spawn(move || {
            let report =
                run_cycle(&mut pipeline, cycle, &|work| rayon::broadcast(|_| work.share(count_allocations)));
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
        let number = judged.report.cycle.number;
        if self.take_back(judged.pipeline, number) {
            self.publish(judged.report);
        } else {
            warn!("cycle {number} came back after it was given up; its result is dropped");
        }
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

/// One whole cycle, with threads that take their shares of the judging. Filters catch their own panics; should anything
/// else break, the cycle fails and publishes nothing.
fn run_cycle(pipeline: &mut Pipeline, cycle: Cycle, share_out: &ShareOut<'_>) -> CycleReport {
    let (began, shares) = (Instant::now(), RefCell::default());
    let step = caught(|| {
        let judge_all = |validator: &Validator, scene: &Scene, candidates: &[Candidate]| {
            let judged = judge_all(validator, scene, candidates, cycle.deadline, share_out);
            shares.replace(judged.shares);
            (judged.verdicts, judged.filters_ns)
        };
        pipeline.step(&cycle.scene, &cycle.concatenated, &judge_all, monotonic_ns)
    });
    let outcome = match step {
        Ok(step) => Outcome::Judged(Box::new(Judged::new(step, began, shares.take()))),
        Err(panic) => {
            error!("cycle {} failed: the validation panicked outside of its filters: {panic}", cycle.number);
            Outcome::Failed("the validation panicked outside of its filters".to_owned())
        }
    };
    CycleReport { cycle, outcome }
}

/// Lets every thread that is to judge take its share.
type ShareOut<'a> = dyn Fn(&Work<'_>) -> Vec<Done> + 'a;

/// The candidates of a cycle as a queue from which threads take until it is empty or the deadline has come; taking one
/// costs little beside judging it.
struct Work<'a> {
    validator: &'a Validator,
    scene: &'a Scene,
    candidates: &'a [Candidate],
    deadline: Option<Instant>,
    /// Places of the candidates, the most urgent first.
    order: Vec<usize>,
    /// The first in `order` that nobody has taken.
    next: AtomicUsize,
}

/// What one thread did of a cycle.
struct Done {
    /// Verdicts with the place of their candidate.
    verdicts: Vec<(usize, Verdict)>,
    filters_ns: Vec<u64>,
    share: Share,
}

impl Work<'_> {
    /// The calling thread's share.
    fn share(&self, count_allocations: Option<CountAllocations>) -> Done {
        let began = Instant::now();
        let allocations = || count_allocations.map_or(0, |count| count());
        let mut verdicts = Vec::with_capacity(self.candidates.len());
        let mut filters_ns = vec![0; self.validator.filters().len()];
        let mut allocated = 0;
        SCRATCH.with_borrow_mut(|scratch| {
            while let Some(index) = self.take() {
                let candidate = &self.candidates[index];
                // Its points are made from the message at first use: once, however often it is judged.
                let _ = candidate.points.len();
                let before = allocations();
                let verdict =
                    self.validator.judge(self.scene, candidate, scratch, monotonic_ns, &mut filters_ns);
                allocated += allocations() - before;
                verdicts.push((index, verdict));
            }
        });
        let share = Share {
            began,
            ended: Instant::now(),
            candidates: verdicts.len(),
            filter_times: filters_ns.iter().copied().map(Duration::from_nanos).collect(),
            allocations: allocated,
        };
        Done { verdicts, filters_ns, share }
    }

    /// The place of the next candidate. The clock is asked before one is taken: what is judged are then the first ones
    /// of the order, without a gap.
    fn take(&self) -> Option<usize> {
        if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return None;
        }
        self.order.get(self.next.fetch_add(1, Ordering::Relaxed)).copied()
    }
}

/// What all threads together did.
struct AllJudged {
    verdicts: Vec<Verdict>,
    filters_ns: Vec<u64>,
    shares: Vec<Share>,
}

/// The verdicts of all threads, in the order of the candidates.
fn judge_all(
    validator: &Validator,
    scene: &Scene,
    candidates: &[Candidate],
    deadline: Option<Instant>,
    share_out: &ShareOut<'_>,
) -> AllJudged {
    let (order, next) = (urgent_first(candidates, deadline), AtomicUsize::new(0));
    let done = share_out(&Work { validator, scene, candidates, deadline, order, next });
    let mut verdicts: Vec<Option<Verdict>> = candidates.iter().map(|_| None).collect();
    let mut filters_ns = vec![0; validator.filters().len()];
    let mut shares = Vec::with_capacity(done.len());
    for one in done {
        for (index, verdict) in one.verdicts {
            verdicts[index] = Some(verdict);
        }
        for (total, time) in filters_ns.iter_mut().zip(one.filters_ns) {
            *total += time;
        }
        shares.push(one.share);
    }
    let judged = verdicts.into_iter().zip(candidates);
    let verdicts =
        judged.map(|(verdict, candidate)| verdict.unwrap_or_else(|| Verdict::out_of_time(candidate.key)));
    AllJudged { verdicts: verdicts.collect(), filters_ns, shares }
}

/// The order in which candidates are judged: as they are, or the newest first where some may be left out.
fn urgent_first(candidates: &[Candidate], deadline: Option<Instant>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    if deadline.is_some() {
        order.sort_by_key(|index| std::cmp::Reverse(candidates[*index].message.header.stamp.nanoseconds()));
    }
    order
}

/// Nanoseconds since the first call.
fn monotonic_ns() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    u64::try_from(START.get_or_init(Instant::now).elapsed().as_nanos()).unwrap_or(u64::MAX)
}
