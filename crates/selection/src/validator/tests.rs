//! What the validator promises about enforcement, order, failures and memory.

use super::*;
use crate::report;
use crate::test_scene::{candidate_of, scene, straight};
use crate::verdict::{Evidence, Failure, Metric};
use messages::autoware_internal_planning_msgs::ControlPoint;
use std::sync::atomic::{AtomicU64, Ordering};

/// A filter that does what it is told.
struct Scripted {
    name: &'static str,
    judge: fn(&Candidate) -> Judgement,
    observe: fn(),
    remember: fn(u64),
    /// Candidates folded so far: its memory.
    folded: u64,
}

impl Filter for Scripted {
    fn name(&self) -> &'static str {
        self.name
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn observe(&mut self, _: &Scene) {
        (self.observe)();
    }

    fn judge(&self, _: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        let mut judgement = (self.judge)(candidate);
        judgement.metrics.push(Metric {
            name: "folded",
            value: self.folded as f64,
            threshold: f64::NAN,
            risk: RiskLevel::Safe,
        });
        judgement
    }

    fn remember(&mut self, judged: &[(&Candidate, &Judgement)]) {
        (self.remember)(self.folded);
        self.folded += judged.len() as u64;
    }
}

fn accept(_: &Candidate) -> Judgement {
    Judgement::feasible([])
}

fn reject(_: &Candidate) -> Judgement {
    let danger = Metric { name: "m", value: 1.0, threshold: 0.0, risk: RiskLevel::Danger };
    Judgement { feasible: false, ..Judgement::feasible([danger]) }
}

fn panic_on_slow(candidate: &Candidate) -> Judgement {
    assert!(candidate.points[0].longitudinal_velocity_mps > 1.0, "too slow for me");
    Judgement::feasible([])
}

fn nothing() {}

fn scripted(
    name: &'static str,
    judge: fn(&Candidate) -> Judgement,
    observe: fn(),
    remember: fn(u64),
) -> Make {
    Arc::new(move |_: &ValidatorParameters| {
        Box::new(Scripted { name, judge, observe, remember, folded: 0 }) as Box<dyn Filter>
    })
}

fn no_filters() -> ValidatorParameters {
    ValidatorParameters {
        filter_names: vec![String::new()],
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    }
}

/// Name, enforcement and behaviour of a filter.
type Script = (&'static str, Enforcement, fn(&Candidate) -> Judgement);

fn validator(filters: &[Script]) -> Validator {
    let mut validator = Validator::new(no_filters(), &VehicleInfo::default()).unwrap();
    for &(name, enforcement, judge) in filters {
        validator.load("safety", enforcement, scripted(name, judge, nothing, |_| ()));
    }
    validator
}

fn judge(validator: &Validator, candidate: &Candidate) -> Verdict {
    validator.judge(&scene(), candidate, &mut Scratch::default(), || 0, &mut [])
}

#[test]
fn without_filters_every_valid_candidate_is_accepted() {
    let verdict = judge(&validator(&[]), &candidate_of(straight(5, 5.0)));
    assert!(verdict.accepted && verdict.feasible);
    assert_eq!(verdict.risk, RiskLevel::Safe);
}

#[test]
fn enforced_filters_reject_and_shadow_filters_only_report() {
    use Enforcement::*;
    /// Name of the case, filters, accepted, feasible, risk.
    type Case =
        (&'static str, Vec<(&'static str, Enforcement, fn(&Candidate) -> Judgement)>, bool, bool, RiskLevel);
    let cases: Vec<Case> = vec![
        ("enforced accepts", vec![("a", Enforced, accept)], true, true, RiskLevel::Safe),
        ("enforced rejects", vec![("a", Enforced, reject)], false, false, RiskLevel::Danger),
        ("shadow rejects", vec![("a", Shadow, reject)], true, false, RiskLevel::Safe),
        ("one of each", vec![("a", Enforced, accept), ("b", Shadow, reject)], true, false, RiskLevel::Safe),
        (
            "both reject",
            vec![("a", Enforced, reject), ("b", Shadow, reject)],
            false,
            false,
            RiskLevel::Danger,
        ),
    ];
    for (name, filters, accepted, feasible, risk) in cases {
        let verdict = judge(&validator(&filters), &candidate_of(straight(5, 5.0)));
        assert_eq!((verdict.accepted, verdict.feasible, verdict.risk), (accepted, feasible, risk), "{name}");
    }
}

#[test]
fn all_filters_judge_in_order_of_their_names() {
    let validator = validator(&[("b", Enforcement::Enforced, reject), ("a", Enforcement::Shadow, reject)]);
    let names: Vec<_> = validator.filters().iter().map(LoadedFilter::name).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(judge(&validator, &candidate_of(straight(5, 5.0))).judgements.len(), 2, "no short-circuit");
}

/// Filters with their cost rank; those whose name begins with `m` remember.
fn stopping_early(filters: &[(Script, u8)]) -> Validator {
    let parameters = ValidatorParameters { stop_at_first_rejection: true, ..no_filters() };
    let mut validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
    for &((name, enforcement, judge), cost_rank) in filters {
        let make = scripted(name, judge, nothing, |_| ());
        validator.add("safety", enforcement, make, (name.starts_with('m'), cost_rank));
    }
    validator
}

#[test]
fn where_no_full_report_is_wanted_a_rejected_candidate_is_shown_to_those_who_remember_only() {
    use Enforcement::*;
    let asked = |filters: &[(Script, u8)]| -> Vec<bool> {
        let verdict = judge(&stopping_early(filters), &candidate_of(straight(5, 5.0)));
        verdict.judgements.iter().map(Judgement::was_needed).collect()
    };
    let must_not: fn(&Candidate) -> Judgement = |_| panic!("must not be asked");
    // Judgements come in the order of the names, whoever is asked first.
    assert_eq!(
        asked(&[(("a", Enforced, must_not), 9), (("b", Enforced, reject), 1), (("c", Shadow, must_not), 0)]),
        [false, true, false],
        "the cheapest enforced filter first, shadow filters last"
    );
    assert_eq!(asked(&[(("a", Shadow, reject), 0), (("b", Enforced, accept), 1)]), [true, true]);
    assert_eq!(
        asked(&[
            (("a", Enforced, must_not), 0),
            (("m1", Enforced, reject), 5),
            (("m2", Enforced, reject), 6),
            (("m3", Shadow, accept), 7),
        ]),
        [false, true, true, true],
        "whoever remembers sees every candidate"
    );
    // A filter of a deployment's own may remember: it is always asked.
    let mut own = stopping_early(&[(("m", Enforced, reject), 0)]);
    own.load("", Shadow, scripted("own", accept, nothing, |_| ()));
    assert!(judge(&own, &candidate_of(straight(5, 5.0))).judgements.iter().all(Judgement::was_needed));
}

#[test]
fn a_filter_that_was_not_asked_is_reported_as_such_and_counts_as_nothing() {
    use Enforcement::*;
    let validator = stopping_early(&[(("a", Shadow, reject), 1), (("b", Enforced, reject), 0)]);
    let candidates = [candidate_of(straight(5, 5.0))];
    let verdict = judge(&validator, &candidates[0]);
    assert!(!verdict.accepted && !verdict.feasible && verdict.risk == RiskLevel::Danger);
    assert_eq!(report::rejection_names(&verdict.judgements[0]).count(), 0);
    let verdicts = [verdict];
    let summaries = report::filter_summaries(&validator, &verdicts);
    let counts: Vec<_> = summaries.iter().map(|summary| (summary.judged, summary.rejected)).collect();
    assert_eq!(counts, [(1, 0), (0, 0), (1, 1)], "data validity, a, b");
    let reports = report::validation_reports(&validator, &candidates, &verdicts).reports;
    let of_a: Vec<_> = reports[0].metrics.iter().filter(|metric| metric.validator_name == "a").collect();
    assert_eq!((of_a.len(), &*of_a[0].metric_name), (1, report::NOT_ASSESSED), "no word on feasibility");
    assert!(validator.filters()[0].explain(&verdicts[0].judgements[0]).unwrap().starts_with("not assessed"));
}

#[test]
fn filters_with_memory_of_candidates_say_so() {
    // Whoever adds a filter that folds memory of candidates has to say so here and in the table.
    let remembering = CLASSES.iter().filter(|class| class.remembers).map(|class| class.short_name);
    assert_eq!(
        remembering.collect::<Vec<_>>(),
        ["crosswalk_filter", "traffic_light_filter", "uncrossable_boundary_departure_filter"]
    );
}

#[test]
fn invalid_data_is_rejected_whatever_the_filters_say_and_no_filter_sees_it() {
    let validator = validator(&[("a", Enforcement::Enforced, |_| panic!("must not be asked"))]);
    let verdict = judge(&validator, &candidate_of(straight(1, 5.0)));
    assert!(!verdict.accepted && !verdict.feasible);
    assert_eq!((verdict.risk, verdict.judgements.len()), (RiskLevel::Danger, 0));
}

#[test]
fn a_panic_costs_only_the_judgement_it_came_with() {
    let enforced = validator(&[("a", Enforcement::Enforced, panic_on_slow)]);
    let slow = judge(&enforced, &candidate_of(straight(5, 0.5)));
    assert!(!slow.accepted);
    assert_eq!(slow.risk, RiskLevel::Fatal);
    assert_eq!(slow.judgements[0].failure, Some(Failure::Panicked("too slow for me".to_owned())));
    assert!(judge(&enforced, &candidate_of(straight(5, 5.0))).accepted);

    let shadow = validator(&[("a", Enforcement::Shadow, panic_on_slow)]);
    let slow = judge(&shadow, &candidate_of(straight(5, 0.5)));
    assert!(slow.accepted && !slow.feasible, "a shadow filter never rejects");
    assert_eq!(slow.judgements[0].risk(), RiskLevel::Fatal, "but its failure is in the report");
}

#[test]
fn a_panic_while_observing_fails_every_judgement_of_the_cycle_and_the_next_cycle_is_normal() {
    static CYCLE: AtomicU64 = AtomicU64::new(0);
    fn observe() {
        assert!(CYCLE.fetch_add(1, Ordering::Relaxed) != 1, "second cycle");
    }
    let mut validator = validator(&[]);
    validator.load("safety", Enforcement::Enforced, scripted("a", accept, observe, |_| ()));
    let candidates = [candidate_of(straight(5, 5.0))];
    let mut accepted = Vec::new();
    for _ in 0..3 {
        validator.observe(&scene());
        let verdict = judge(&validator, &candidates[0]);
        accepted.push(verdict.accepted);
        validator.remember(&candidates, &[verdict]);
    }
    assert_eq!(accepted, [true, false, true]);
}

/// Panics when it is told for the second time which candidates will come.
struct Startled;

static TOLD: AtomicU64 = AtomicU64::new(0);

impl Filter for Startled {
    fn name(&self) -> &'static str {
        "startled"
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn announce(&mut self, candidates: &[Candidate]) {
        assert_eq!(candidates.len(), 1);
        assert!(TOLD.fetch_add(1, Ordering::Relaxed) != 1, "second cycle");
    }

    fn judge(&self, _: &Scene, _: &Candidate, _: &mut Scratch) -> Judgement {
        Judgement::feasible([])
    }
}

#[test]
fn a_panic_over_announced_candidates_fails_every_judgement_of_the_cycle_and_the_next_cycle_is_normal() {
    let mut validator = validator(&[]);
    let make: Make = Arc::new(|_: &ValidatorParameters| Box::new(Startled) as Box<dyn Filter>);
    validator.load("safety", Enforcement::Enforced, make);
    let candidates = [candidate_of(straight(5, 5.0))];
    let mut accepted = Vec::new();
    for _ in 0..3 {
        validator.announce(&candidates);
        validator.observe(&scene());
        let verdict = judge(&validator, &candidates[0]);
        accepted.push(verdict.accepted);
        validator.remember(&candidates, &[verdict]);
    }
    assert_eq!(accepted, [true, false, true]);
}

#[test]
fn a_panic_while_remembering_starts_the_filter_anew() {
    let mut validator = validator(&[]);
    let remember: fn(u64) = |folded| assert!(folded < 2, "memory is full");
    validator.load("safety", Enforcement::Enforced, scripted("a", accept, nothing, remember));
    let candidates = [candidate_of(straight(5, 5.0))];
    let mut seen = Vec::new();
    for _ in 0..4 {
        let verdict = judge(&validator, &candidates[0]);
        seen.push(verdict.judgements[0].metrics[0].value as u64);
        validator.remember(&candidates, &[verdict]);
    }
    assert_eq!(seen, [0, 1, 2, 0]);
}

/// Panics where it is told to; the numbers count down to the panic.
struct Fragile {
    configure: Arc<AtomicU64>,
    remember: Arc<AtomicU64>,
}

fn panic_at_zero(count: &AtomicU64) {
    if count.fetch_sub(1, Ordering::Relaxed) == 0 {
        std::panic::resume_unwind(Box::new("on purpose"));
    }
}

impl Filter for Fragile {
    fn name(&self) -> &'static str {
        "fragile"
    }

    fn configure(&mut self, _: &ValidatorParameters) {
        panic_at_zero(&self.configure);
    }

    fn judge(&self, _: &Scene, _: &Candidate, _: &mut Scratch) -> Judgement {
        Judgement::feasible([])
    }

    fn remember(&mut self, _: &[(&Candidate, &Judgement)]) {
        panic_at_zero(&self.remember);
    }
}

/// A filter that panics at these calls: of `make`, `configure` and `remember`.
fn fragile(make: u64, configure: u64, remember: u64) -> Validator {
    let [make, configure, remember] =
        [make, configure, remember].map(|count| Arc::new(AtomicU64::new(count)));
    let mut validator = validator(&[]);
    let make = move |_: &ValidatorParameters| {
        panic_at_zero(&make);
        Box::new(Fragile { configure: configure.clone(), remember: remember.clone() }) as Box<dyn Filter>
    };
    validator.load("safety", Enforcement::Enforced, Arc::new(make));
    validator
}

/// Whether a candidate is accepted, and how often the filter is said to have panicked, in each of some cycles.
fn cycles<const COUNT: usize>(validator: &mut Validator) -> [(bool, usize); COUNT] {
    let candidates = [candidate_of(straight(5, 5.0))];
    [(); COUNT].map(|()| {
        validator.observe(&scene());
        let verdicts = [judge(validator, &candidates[0])];
        validator.remember(&candidates, &verdicts);
        (verdicts[0].accepted, report::filter_summaries(validator, &verdicts)[1].panicked)
    })
}

const NEVER: u64 = u64::MAX;

#[test]
fn a_panic_over_changed_parameters_costs_the_filter_one_cycle() {
    let mut validator = fragile(NEVER, 0, NEVER);
    assert_eq!(cycles(&mut validator), [(true, 0)]);
    validator.configure(no_filters());
    assert_eq!(cycles(&mut validator), [(false, 1), (true, 0)]);
}

#[test]
fn a_lost_memory_is_reported() {
    let mut validator = fragile(NEVER, NEVER, 1);
    assert_eq!(cycles(&mut validator), [(true, 0), (true, 1), (true, 0)]);
}

#[test]
fn a_filter_that_cannot_be_made_anew_judges_nothing_until_it_can() {
    // Made once when it is loaded; the second time fails.
    let mut validator = fragile(1, NEVER, 1);
    assert_eq!(cycles(&mut validator), [(true, 0), (true, 1), (false, 1), (true, 0)]);
}

#[test]
fn a_judgement_that_contradicts_itself_counts_as_an_objection() {
    let nonsense: fn(&Candidate) -> Judgement =
        |_| Judgement { feasible: true, ..Judgement::not_assessed("it is fine, but I could not look") };
    let verdict =
        judge(&validator(&[("a", Enforcement::Enforced, nonsense)]), &candidate_of(straight(5, 5.0)));
    assert!(!verdict.accepted && !verdict.feasible);
    assert_eq!(verdict.risk, RiskLevel::Danger);
}

#[test]
fn a_place_beyond_the_candidate_is_no_place() {
    let at = |index| Evidence { index, ..Evidence::at(&candidate_of(straight(5, 5.0)), 0) };
    let judgement = |index| Judgement { evidence: Some(at(index)), ..Judgement::default() };
    for (index, kept) in [(0, true), (4, true), (5, false), (usize::MAX, false)] {
        let made = made_sense_of(judgement(index), &candidate_of(straight(5, 5.0)));
        assert_eq!(made.evidence.is_some(), kept, "{index}");
    }
}

#[test]
fn invalid_data_and_failures_leave_no_memory() {
    let mut validator = validator(&[("a", Enforcement::Enforced, panic_on_slow)]);
    let candidates =
        [candidate_of(straight(1, 5.0)), candidate_of(straight(5, 0.5)), candidate_of(straight(5, 5.0))];
    let verdicts: Vec<_> = candidates.iter().map(|candidate| judge(&validator, candidate)).collect();
    validator.remember(&candidates, &verdicts);
    let next = judge(&validator, &candidates[2]);
    assert_eq!(next.judgements[0].metrics[0].value as u64, 1, "only the third candidate counts");
}

#[test]
fn loading_by_name() {
    let vehicle = VehicleInfo::default();
    let load = |enforced: &[&str], shadow: &[&str]| {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        let parameters = ValidatorParameters {
            filter_names: names(enforced),
            shadow_mode_filter_names: names(shadow),
            ..ValidatorParameters::default()
        };
        Validator::new(parameters, &vehicle)
    };
    let name = "safety::VehicleConstraintFilter";
    assert_eq!(load(&[""], &[]).unwrap().filters().len(), 0, "an empty name is skipped");
    let both = load(&[name, name], &[name]).unwrap();
    assert_eq!(both.filters().len(), 1);
    assert_eq!(both.filters()[0].enforcement(), Enforcement::Enforced, "a filter in both lists is enforced");
    assert_eq!(both.filters()[0].category(), "safety");
    let error = load(&["safety::Typo"], &[]).unwrap_err();
    assert!(error.to_string().contains("safety::Typo") && error.to_string().contains(name), "{error}");
}

#[test]
fn reports_list_every_metric_and_the_feasibility_of_each_filter() {
    let validator = validator(&[("a", Enforcement::Shadow, reject), ("b", Enforcement::Enforced, accept)]);
    let candidates = [candidate_of(straight(5, 5.0)), candidate_of(straight(1, 5.0))];
    let verdicts: Vec<_> = candidates.iter().map(|candidate| judge(&validator, candidate)).collect();
    let reports = report::validation_reports(&validator, &candidates, &verdicts).reports;
    let listed = |index: usize| -> Vec<(String, u8)> {
        let metrics = reports[index].metrics.iter();
        metrics
            .map(|metric| (format!("{}/{}", metric.validator_name, metric.metric_name), metric.risk.level))
            .collect()
    };
    let expected: Vec<(String, u8)> = [
        ("data_validity/data_validity", 0),
        ("a/m", 3),
        ("a/folded", 0),
        ("a/trajectory_feasibility", 3),
        ("b/folded", 0),
        ("b/trajectory_feasibility", 0),
    ]
    .map(|(name, level)| (name.to_owned(), level))
    .into();
    assert_eq!(listed(0), expected);
    assert_eq!(reports[0].risk.level, 0, "a shadow filter's metrics do not count");
    assert_eq!(listed(1), [("data_validity/data_validity".to_owned(), 3)]);
    assert_eq!(reports[1].risk.level, 3);

    let summaries = report::filter_summaries(&validator, &verdicts);
    let counts: Vec<_> =
        summaries.iter().map(|filter| (filter.name, filter.judged, filter.rejected)).collect();
    assert_eq!(counts, [("data_validity", 2, 1), ("a", 1, 1), ("b", 1, 0)]);
    assert_eq!(summaries[1].first_reason.as_deref(), Some("Found failed metrics"));
    assert_eq!(report::rejection_names(&verdicts[0].judgements[0]).collect::<Vec<_>>(), ["m"]);
}

/// A filter that tells of as many places as it is made with; it panics over more than four.
struct Telling {
    name: &'static str,
    places: usize,
}

impl Filter for Telling {
    fn name(&self) -> &'static str {
        self.name
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, _: &Candidate, _: &mut Scratch) -> Judgement {
        Judgement::feasible([])
    }

    fn planning_factor(&self, _: &Scene, _: &Judgement) -> Option<PlanningFactor> {
        assert!(self.places <= 4, "too many for me");
        let place = |index: usize| ControlPoint { distance: index as f32, ..ControlPoint::default() };
        Some(PlanningFactor {
            module: self.name.to_owned(),
            control_points: (0..self.places).map(place).collect(),
            behavior: PlanningFactor::STOP,
            detail: self.name.to_owned(),
            ..PlanningFactor::default()
        })
    }
}

#[test]
fn planning_factors_of_all_filters_are_told_with_at_most_two_places() {
    let mut validator = Validator::new(no_filters(), &VehicleInfo::default()).unwrap();
    for (name, places) in [("none", 0), ("one", 1), ("panics", 5), ("three", 3), ("two", 2)] {
        let make = move |_: &ValidatorParameters| Box::new(Telling { name, places }) as Box<dyn Filter>;
        validator.load("test", Enforcement::Shadow, Arc::new(make));
    }
    let candidates =
        [candidate_of(straight(5, 5.0)), candidate_of(straight(1, 5.0)), candidate_of(straight(6, 5.0))];
    let verdicts: Vec<_> = candidates.iter().map(|candidate| judge(&validator, candidate)).collect();
    let told = report::planning_factors(&validator, &scene(), &verdicts);
    assert_eq!((told.header.stamp, told.header.frame_id.as_str()), (scene().now, "map"));
    assert!(
        told.factors.iter().all(|factor| factor.module == "trajectory_validator" && factor.behavior == 3)
    );
    let places = |factor: &PlanningFactor| -> Vec<f32> {
        factor.control_points.iter().map(|point| point.distance).collect()
    };
    let listed: Vec<_> = told.factors.iter().map(|factor| (factor.detail.as_str(), places(factor))).collect();
    let of_one_candidate = [("one", vec![0.0]), ("three", vec![0.0, 2.0]), ("two", vec![0.0, 1.0])];
    assert_eq!(listed, [of_one_candidate.clone(), of_one_candidate].concat(), "the second has no valid data");
    assert!(report::planning_factors(&validator, &scene(), &[]).factors.is_empty());
}

#[test]
fn each_generator_of_the_validated_set_is_listed_once() {
    use crate::concatenator::Concatenator;
    use messages::autoware_internal_planning_msgs::{
        CandidateTrajectories, CandidateTrajectory, GeneratorInfo,
    };
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&CandidateTrajectories {
        candidate_trajectories: (0..3).map(|_| Arc::new(CandidateTrajectory::default())).collect(),
        generator_info: vec![GeneratorInfo::default()],
    });
    let concatenated = concatenator.get(Default::default());
    let verdict = |accepted| Verdict {
        key: concatenated.candidates[0].key,
        accepted,
        feasible: accepted,
        risk: RiskLevel::Safe,
        data_validity: Judgement::default(),
        judgements: SmallVec::new(),
    };
    let set = report::validated_set(&concatenated, &[verdict(true), verdict(false), verdict(true)]);
    assert_eq!((set.candidate_trajectories.len(), set.generator_info.len()), (2, 1));
    let none = report::validated_set(&concatenated, &[verdict(false), verdict(false), verdict(false)]);
    assert_eq!((none.candidate_trajectories.len(), none.generator_info.len()), (0, 0));
}
