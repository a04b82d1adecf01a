//! Loads filters and puts their judgements together.
//!
//! Owns the loaded filters with their memory. What it promises: the data-validity check comes first and always counts;
//! every filter judges every candidate with valid data; an enforced filter that objects, cannot judge or panics keeps
//! the candidate in; a shadow filter never does; where the settings want no full report, a filter without memory of
//! candidates is not asked about one that is rejected already, which changes neither what is accepted nor any memory; a
//! panic costs only the judgement it came with and leaves the filter usable; a judgement that contradicts itself counts as
//! an objection; judgements are in ascending order of the filters' names.

use crate::candidate::Candidate;
use crate::data_validity;
use crate::filters::{CLASSES, Fill, Filter, FilterClass, Scratch};
use crate::panics::caught;
use crate::parameters::ValidatorParameters;
use crate::scene::Scene;
use crate::verdict::{self, Judgement, RiskLevel, Verdict};
use messages::autoware_internal_planning_msgs::PlanningFactor;
use motion::VehicleInfo;
use smallvec::SmallVec;
use std::sync::Arc;

/// Whether a filter's objection removes a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Enforcement {
    /// It does.
    Enforced,
    /// It is only reported.
    Shadow,
}

/// Makes a filter anew; used at start and after a filter lost its memory to a panic.
type Make = Arc<dyn Fn(&ValidatorParameters) -> Box<dyn Filter> + Send + Sync>;

/// A filter with its place in the validator.
pub struct LoadedFilter {
    filter: Box<dyn Filter>,
    name: &'static str,
    category: &'static str,
    enforcement: Enforcement,
    /// Whether it has to judge every candidate for the sake of its memory.
    remembers: bool,
    cost_rank: u8,
    make: Make,
    /// Why the filter judges nothing until it is made anew, if it does not.
    broken: Option<String>,
    /// Why the filter lost its memory at the end of the cycle, if it did.
    lost_memory: Option<String>,
}

impl std::fmt::Debug for LoadedFilter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LoadedFilter")
            .field("filter", &self.filter)
            .field("enforcement", &self.enforcement)
            .field("broken", &self.broken)
            .finish_non_exhaustive()
    }
}

impl LoadedFilter {
    /// Name of the filter.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Category of the filter.
    #[must_use]
    pub fn category(&self) -> &'static str {
        self.category
    }

    /// Whether its objection counts.
    #[must_use]
    pub fn enforcement(&self) -> Enforcement {
        self.enforcement
    }

    /// One line of plain words on why the candidate is not feasible, as the filter tells it; general words where the
    /// filter has none of its own. `None` if the candidate is feasible.
    #[must_use]
    pub fn explain(&self, judgement: &Judgement) -> Option<String> {
        // An explanation must not cost the report it belongs to, so a panic in it counts as no words.
        caught(|| self.filter.explain(judgement)).ok().flatten().or_else(|| verdict::explain(judgement))
    }

    /// What the filter leaves open in this judgement, in its words. `None` if nothing.
    #[must_use]
    pub fn not_assessed(&self, judgement: &Judgement) -> Option<String> {
        caught(|| self.filter.not_assessed(judgement)).ok().flatten()
    }

    /// Why the filter lost its memory at the end of the last cycle: the text of a panic. `None` if it did not.
    #[must_use]
    pub fn lost_memory(&self) -> Option<&str> {
        self.lost_memory.as_deref()
    }

    /// How full the filter's memory is; `None` if it has none, or cannot tell.
    #[must_use]
    pub fn fill(&self) -> Option<Fill> {
        caught(|| self.filter.fill()).ok().flatten()
    }

    /// Why the planner would have to do something about the candidate, if the filter can tell.
    #[must_use]
    pub fn planning_factor(&self, scene: &Scene, judgement: &Judgement) -> Option<PlanningFactor> {
        // As with explanations: a panic counts as nothing to tell.
        caught(|| self.filter.planning_factor(scene, judgement)).ok().flatten()
    }

    /// Starts with empty memory. A filter that cannot even be made stays broken.
    fn renew(&mut self, parameters: &ValidatorParameters) {
        let renewed = caught(|| {
            let spent = std::mem::replace(&mut self.filter, (self.make)(parameters));
            // The new one is in its place already: what becomes of the old one is of no matter.
            let _ = caught(|| drop(spent));
        });
        self.broken = renewed.err();
    }
}

/// A filter name in the configuration that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no filter `{class_name}`; known: {}", known_classes())]
pub struct UnknownFilter {
    /// The name as configured.
    pub class_name: String,
}

fn known_classes() -> String {
    CLASSES.iter().map(|class| class.class_name).collect::<Vec<_>>().join(", ")
}

/// Measures how long a filter takes. A function, so that nothing here reads a clock of its own: gives nanoseconds since
/// any fixed instant.
pub type Stopwatch = fn() -> u64;

/// The loaded filters.
#[derive(Debug)]
pub struct Validator {
    filters: Vec<LoadedFilter>,
    /// Places of the filters in the order in which a rejected candidate is found with the least effort: those that
    /// have to judge it anyway, then the enforced ones, the cheapest first.
    quickest: Vec<usize>,
    parameters: ValidatorParameters,
}

impl Validator {
    /// Loads the filters named in the parameters. Empty names are skipped; a filter named twice is loaded once, and
    /// one named in both lists is enforced.
    ///
    /// # Errors
    /// A name that no filter has.
    pub fn new(parameters: ValidatorParameters, vehicle: &VehicleInfo) -> Result<Self, UnknownFilter> {
        let mut validator = Self { filters: Vec::new(), quickest: Vec::new(), parameters };
        let enforced = validator.parameters.filter_names.clone();
        let shadow = validator.parameters.shadow_mode_filter_names.clone();
        let names = enforced.iter().map(|name| (name, Enforcement::Enforced));
        for (name, enforcement) in names.chain(shadow.iter().map(|name| (name, Enforcement::Shadow))) {
            if name.is_empty() {
                continue;
            }
            let class = FilterClass::find(name).ok_or_else(|| UnknownFilter { class_name: name.clone() })?;
            let (make, vehicle) = (class.make, *vehicle);
            let make = Arc::new(move |parameters: &ValidatorParameters| make(parameters, &vehicle));
            validator.add(class.category(), enforcement, make, (class.remembers, class.cost_rank));
        }
        Ok(validator)
    }

    /// Adds a filter that is not in the table, unless one of its name is loaded already. Filters of a deployment's own
    /// come in this way; they judge every candidate, because they may have memory of it.
    pub fn load(&mut self, category: &'static str, enforcement: Enforcement, make: Make) {
        self.add(category, enforcement, make, (true, u8::MAX));
    }

    fn add(
        &mut self,
        category: &'static str,
        enforcement: Enforcement,
        make: Make,
        (remembers, cost_rank): (bool, u8),
    ) {
        let filter = make(&self.parameters);
        let name = filter.name();
        if self.filters.iter().any(|loaded| loaded.name == name) {
            return;
        }
        self.filters.push(LoadedFilter {
            filter,
            name,
            category,
            enforcement,
            remembers,
            cost_rank,
            make,
            broken: None,
            lost_memory: None,
        });
        self.filters.sort_by_key(LoadedFilter::name);
        self.quickest = (0..self.filters.len()).collect();
        self.quickest.sort_by_key(|&index| {
            let LoadedFilter { remembers, enforcement, cost_rank, .. } = self.filters[index];
            (!remembers, enforcement == Enforcement::Shadow, cost_rank)
        });
    }

    /// The loaded filters in order of evaluation.
    #[must_use]
    pub fn filters(&self) -> &[LoadedFilter] {
        &self.filters
    }

    /// The parameters of the filters.
    #[must_use]
    pub fn parameters(&self) -> &ValidatorParameters {
        &self.parameters
    }

    /// Hands changed parameters to every filter; to be called between two cycles. Which filters are loaded stays. A
    /// filter that panics here judges nothing in the next cycle and then starts anew with these parameters.
    pub fn configure(&mut self, parameters: ValidatorParameters) {
        self.parameters = parameters;
        for loaded in &mut self.filters {
            if let Err(panic) = caught(|| loaded.filter.configure(&self.parameters)) {
                loaded.broken = Some(panic);
            }
        }
    }

    /// Before [`Self::observe`]: the candidates that will be judged in the cycle, and no others will. A filter that panics
    /// here judges nothing in this cycle.
    pub fn announce(&mut self, candidates: &[Candidate]) {
        for loaded in self.filters.iter_mut().filter(|loaded| loaded.broken.is_none()) {
            loaded.broken = caught(|| loaded.filter.announce(candidates)).err();
        }
    }

    /// Once per cycle, before any candidate is judged. A filter that panics here judges nothing in this cycle: its
    /// judgements are failures.
    pub fn observe(&mut self, scene: &Scene) {
        for loaded in &mut self.filters {
            loaded.lost_memory = None;
            if loaded.broken.is_none() {
                loaded.broken = caught(|| loaded.filter.observe(scene)).err();
            }
        }
    }

    /// Judges one candidate with every filter that is needed. `times_ns[i]` grows by the time that filter `i` took; slots that are
    /// not there are not measured.
    pub fn judge(
        &self,
        scene: &Scene,
        candidate: &Candidate,
        scratch: &mut Scratch,
        stopwatch: Stopwatch,
        times_ns: &mut [u64],
    ) -> Verdict {
        let data_validity = data_validity::judge(scene, candidate);
        let mut judgements = SmallVec::new();
        if data_validity.feasible {
            judgements.extend(self.filters.iter().map(|_| Judgement::not_needed()));
            let mut is_rejected = false;
            let mut started = stopwatch();
            for &index in &self.quickest {
                let loaded = &self.filters[index];
                if is_rejected && self.parameters.stop_at_first_rejection && !loaded.remembers {
                    continue;
                }
                let judgement = judge_with(loaded, scene, candidate, scratch);
                is_rejected |= loaded.enforcement == Enforcement::Enforced && !judgement.feasible;
                judgements[index] = judgement;
                let ended = stopwatch();
                if let Some(time) = times_ns.get_mut(index) {
                    *time += ended.saturating_sub(started);
                }
                started = ended;
            }
        }
        self.verdict(candidate, data_validity, judgements)
    }

    fn verdict(
        &self,
        candidate: &Candidate,
        data_validity: Judgement,
        judgements: SmallVec<[Judgement; 6]>,
    ) -> Verdict {
        let is_enforced = |index: usize| self.filters[index].enforcement == Enforcement::Enforced;
        let enforced = judgements.iter().enumerate().filter(|(index, _)| is_enforced(*index));
        Verdict {
            key: candidate.key,
            accepted: data_validity.feasible && enforced.clone().all(|(_, judgement)| judgement.feasible),
            feasible: data_validity.feasible && judgements.iter().all(|judgement| judgement.feasible),
            risk: enforced.map(|(_, judgement)| judgement.risk()).fold(data_validity.risk(), RiskLevel::max),
            data_validity,
            judgements,
        }
    }

    /// Once per cycle, after all candidates: lets every filter fold its memory, candidates in message order. Candidates
    /// with invalid data and judgements that panicked leave nothing behind. A filter that panics here starts anew with
    /// empty memory, which is the cautious state of every filter.
    pub fn remember(&mut self, candidates: &[Candidate], verdicts: &[Verdict]) {
        for (index, loaded) in self.filters.iter_mut().enumerate() {
            let judged: Vec<(&Candidate, &Judgement)> = candidates
                .iter()
                .zip(verdicts)
                .filter_map(|(candidate, verdict)| Some((candidate, verdict.judgements.get(index)?)))
                .filter(|(_, judgement)| judgement.failure.is_none())
                .collect();
            if loaded.broken.is_none() {
                loaded.broken = caught(|| loaded.filter.remember(&judged)).err();
                loaded.lost_memory = loaded.broken.clone();
            }
            if loaded.broken.is_some() {
                loaded.renew(&self.parameters);
            }
        }
    }
}

fn judge_with(
    loaded: &LoadedFilter,
    scene: &Scene,
    candidate: &Candidate,
    scratch: &mut Scratch,
) -> Judgement {
    if let Some(what) = &loaded.broken {
        return Judgement::panicked(what.clone());
    }
    match caught(|| loaded.filter.judge(scene, candidate, &mut *scratch)) {
        Ok(judgement) => made_sense_of(judgement, candidate),
        Err(panic) => {
            *scratch = Scratch::default();
            Judgement::panicked(panic)
        }
    }
}

/// Who could not judge has found nothing feasible, and a violation is at a point that is there.
fn made_sense_of(mut judgement: Judgement, candidate: &Candidate) -> Judgement {
    judgement.feasible &= judgement.failure.is_none();
    judgement.evidence = judgement.evidence.filter(|evidence| evidence.index < candidate.points.len());
    judgement
}

#[cfg(test)]
mod tests;
