//! Verdicts do not depend on how many threads judge, nor on the order of the generators in a message.
//!
//! Drives of random candidates are made from the golden sequences: every cycle takes the scene of a golden cycle and
//! candidates of any cycle of the same sequence under generators that come and go. They pass through concatenator and
//! validator as in a node. Nothing but a seed decides what is drawn.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

#[path = "golden_support/shared.rs"]
mod shared;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::std_msgs::Text;
use messages::unique_identifier_msgs::Uuid;
use selection::filters::CLASSES;
use selection::parameters::ValidatorParameters;
use selection::{
    Candidate, CandidateKey, Concatenator, Enforcement, Filter, Judgement, Metric, RiskLevel, Scene, Scratch,
    Validator, Verdict,
};
use trajectory_selector::golden::{Maps, Sequence, sequence_files};

const SEED: u64 = 0x5eed_0001;
/// Cycles in all drives together.
const CYCLES: usize = 1000;
const GENERATORS: u64 = 4;
const MAX_SAMPLES: u64 = 3;
/// Each filter accepts and rejects more candidates than this, so that equal verdicts mean something.
const LEAST: usize = 100;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn shuffle<T>(&mut self, values: &mut [T]) {
        for index in (1..values.len()).rev() {
            values.swap(index, self.below(index as u64 + 1) as usize);
        }
    }
}

/// What one cycle of a drive receives.
struct Step {
    parameters: Option<ValidatorParameters>,
    scene: Scene,
    message: CandidateTrajectories,
}

fn generator(number: u64) -> Uuid {
    Uuid { uuid: (u128::from(number) + 1).to_be_bytes() }
}

/// A message of this cycle's time with candidates from anywhere in the sequence.
fn draw_message(random: &mut Random, sequence: &Sequence, scene: &Scene) -> CandidateTrajectories {
    let mut message = CandidateTrajectories::default();
    for number in 0..GENERATORS {
        // Every fifth generator is silent: its older candidates are used again, or its memory grows old.
        if random.below(5) == 0 {
            continue;
        }
        let generator_id = generator(number);
        let name = format!("generator_{number}");
        message.generator_info.push(GeneratorInfo { generator_id, generator_name: Text { data: name } });
        for _ in 0..1 + random.below(MAX_SAMPLES) {
            let cycle = &sequence.cycles[random.below(sequence.cycles.len() as u64) as usize];
            let drawn = &cycle.candidates[random.below(cycle.candidates.len() as u64) as usize];
            let mut trajectory = CandidateTrajectory { generator_id, ..(*drawn.message).clone() };
            trajectory.header.stamp = scene.now;
            message.candidate_trajectories.push(Arc::new(trajectory));
        }
    }
    message
}

/// The same message with its generators in another order. Samples keep their order: it names them.
fn permuted(random: &mut Random, message: &CandidateTrajectories) -> CandidateTrajectories {
    let mut generator_info = message.generator_info.clone();
    random.shuffle(&mut generator_info);
    let of = |info: &GeneratorInfo| {
        let id = info.generator_id;
        message.candidate_trajectories.iter().filter(move |t| t.generator_id == id).cloned()
    };
    let candidate_trajectories = generator_info.iter().flat_map(of).collect();
    CandidateTrajectories { candidate_trajectories, generator_info }
}

type Judge = fn(&Validator, &Scene, &[Candidate]) -> Vec<Verdict>;

fn on_one_thread(validator: &Validator, scene: &Scene, candidates: &[Candidate]) -> Vec<Verdict> {
    let mut scratch = Scratch::default();
    candidates
        .iter()
        .map(|candidate| validator.judge(scene, candidate, &mut scratch, || 0, &mut []))
        .collect()
}

/// Every second candidate on another thread, the last ones first.
fn on_two_threads(validator: &Validator, scene: &Scene, candidates: &[Candidate]) -> Vec<Verdict> {
    let judge_from = |first: usize| -> Vec<(usize, Verdict)> {
        let mut scratch = Scratch::default();
        let mine = (first..candidates.len()).step_by(2).rev();
        mine.map(|index| (index, validator.judge(scene, &candidates[index], &mut scratch, || 0, &mut [])))
            .collect()
    };
    let mut verdicts = std::thread::scope(|scope| {
        let other = scope.spawn(|| judge_from(1));
        let mut verdicts = judge_from(0);
        verdicts.extend(other.join().unwrap());
        verdicts
    });
    verdicts.sort_by_key(|(index, _)| *index);
    verdicts.into_iter().map(|(_, verdict)| verdict).collect()
}

/// Everything that is said in each cycle, by candidate. The text of a number tells all of its bits.
type Said = Vec<BTreeMap<CandidateKey, String>>;

/// How often each filter, and all of them together, accepted a candidate, rejected it, and could not judge.
#[derive(Default)]
struct Counts(BTreeMap<&'static str, [usize; 3]>);

impl Counts {
    fn count(&mut self, validator: &Validator, verdict: &Verdict) {
        self.0.entry("all").or_default()[usize::from(!verdict.accepted)] += 1;
        for (loaded, judgement) in validator.filters().iter().zip(&verdict.judgements) {
            let kind = if judgement.failure.is_some() { 2 } else { usize::from(!judgement.feasible) };
            self.0.entry(loaded.name()).or_default()[kind] += 1;
        }
    }

    fn add(&mut self, other: &Self) {
        for (name, counts) in &other.0 {
            let sums = self.0.entry(name).or_default();
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        }
    }
}

/// Drives once, with the filters that are built and one more.
fn drive<'a>(
    sequence: &Sequence,
    extra: Option<fn() -> Box<dyn Filter>>,
    steps: impl Iterator<Item = (&'a Step, CandidateTrajectories)>,
    judge: Judge,
) -> (Said, Counts) {
    let mut parameters = sequence.parameters.clone();
    parameters.filter_names = CLASSES.iter().map(|class| class.class_name.to_owned()).collect();
    let mut validator = Validator::new(parameters, &sequence.vehicle).unwrap();
    if let Some(make) = extra {
        validator.load("test", Enforcement::Enforced, Arc::new(move |_: &ValidatorParameters| make()));
    }
    let mut concatenator = Concatenator::new(0.2);
    let mut counts = Counts::default();
    let said = steps.map(|(step, message)| {
        if let Some(parameters) = &step.parameters {
            validator.configure(parameters.clone());
        }
        concatenator.add(&message);
        let candidates = concatenator.get(step.scene.now).candidates;
        validator.announce(&candidates);
        validator.observe(&step.scene);
        let verdicts = judge(&validator, &step.scene, &candidates);
        validator.remember(&candidates, &verdicts);
        for verdict in &verdicts {
            counts.count(&validator, verdict);
        }
        verdicts.iter().map(|verdict| (verdict.key, format!("{verdict:?}"))).collect()
    });
    let said = said.collect();
    (said, counts)
}

fn draw_steps(random: &mut Random, sequence: &Sequence) -> Vec<Step> {
    let step = |cycle: &trajectory_selector::golden::Cycle| Step {
        parameters: cycle.parameters.clone(),
        scene: cycle.scene.clone(),
        message: draw_message(random, sequence, &cycle.scene),
    };
    sequence.cycles.iter().map(step).collect()
}

/// Drives the same steps on one thread, on two, and with permuted generators: what each says, and how often what was
/// said the first time.
fn three_ways(
    random: &mut Random,
    sequence: &Sequence,
    extra: Option<fn() -> Box<dyn Filter>>,
) -> ([Said; 3], Counts) {
    let steps = draw_steps(random, sequence);
    let as_drawn = || steps.iter().map(|step| (step, step.message.clone()));
    let (one, counts) = drive(sequence, extra, as_drawn(), on_one_thread);
    let (two, _) = drive(sequence, extra, as_drawn(), on_two_threads);
    let other_order = steps.iter().map(|step| (step, permuted(random, &step.message)));
    let (permuted, _) = drive(sequence, extra, other_order, on_one_thread);
    ([one, two, permuted], counts)
}

#[test]
fn threads_and_the_order_of_generators_change_no_verdict() {
    let Some(golden) = shared::golden("threads_and_the_order_of_generators_change_no_verdict") else {
        return;
    };
    let files = sequence_files(&[golden.join("open")]).unwrap();
    let mut maps = Maps::default();
    let mut random = Random(SEED);
    let (mut cycles, mut counts) = (0, Counts::default());
    while cycles < CYCLES {
        let file = &files[random.below(files.len() as u64) as usize];
        let sequence = Sequence::read(file, &mut maps).unwrap();
        let ([one, two, permuted], of_drive) = three_ways(&mut random, &sequence, None);
        for (cycle, said) in one.iter().enumerate() {
            assert_eq!(said, &two[cycle], "{} cycle {cycle}: two threads", sequence.name);
            assert_eq!(said, &permuted[cycle], "{} cycle {cycle}: permuted generators", sequence.name);
        }
        cycles += sequence.cycles.len();
        counts.add(&of_drive);
    }
    println!("{cycles} cycles; accepted, rejected, not assessed:");
    for (name, [accepted, rejected, not_assessed]) in &counts.0 {
        println!("{name}: {accepted}, {rejected}, {not_assessed}");
        assert!(*accepted > LEAST && *rejected > LEAST, "both verdicts of {name} are compared");
    }
    assert_eq!(counts.0.len(), CLASSES.len() + 1);
}

/// Counts in a place that all candidates share: what the contract forbids.
#[derive(Default)]
struct Leaky(AtomicU64);

impl Filter for Leaky {
    fn name(&self) -> &'static str {
        "leaky"
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        let before = self.0.fetch_add(candidate.points.len() as u64, Ordering::Relaxed);
        let metric =
            Metric { name: "leak", value: before as f64, threshold: f64::NAN, risk: RiskLevel::Safe };
        Judgement::feasible([metric])
    }
}

#[test]
fn a_filter_whose_candidates_see_each_other_is_found() {
    let Some(golden) = shared::golden("a_filter_whose_candidates_see_each_other_is_found") else { return };
    let file: PathBuf = golden.join("open/open_intersection_007_vc.json");
    let sequence = Sequence::read(&file, &mut Maps::default()).unwrap();
    let ([one, two, permuted], _) =
        three_ways(&mut Random(SEED), &sequence, Some(|| Box::<Leaky>::default()));
    assert_ne!(one, two);
    assert_ne!(one, permuted);
}
