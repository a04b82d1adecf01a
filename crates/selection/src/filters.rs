//! The contract of a filter, and the table of filters that exist.

pub mod boundary_departure;
pub mod collision_check;
pub mod crosswalk;
pub mod out_of_lane;
pub mod traffic_light;
pub mod vehicle_constraint;

use crate::candidate::Candidate;
use crate::parameters::ValidatorParameters;
use crate::scene::{HdMap, Scene};
use crate::verdict::Judgement;
use messages::autoware_internal_planning_msgs::PlanningFactor;
use motion::VehicleInfo;
use std::fmt;

/// Judges candidates against one kind of danger or rule.
///
/// Memory that comes from sensors is updated in [`observe`](Filter::observe), once per cycle, and is read-only while
/// judging. Memory that comes from candidates is kept by candidate key, judged at its value at the start of the cycle,
/// and folded in [`remember`](Filter::remember). So verdicts depend neither on threads nor on other candidates.
pub trait Filter: Send + Sync {
    /// Stable snake_case name, as it appears in reports and parameters.
    fn name(&self) -> &'static str;

    /// Takes changed parameters; called between two cycles.
    fn configure(&mut self, parameters: &ValidatorParameters);

    /// Tells, before [`observe`](Filter::observe), which candidates will be judged in the cycle: what none of them can
    /// come near need not be worked out. It must change no judgement. Their data was not checked yet. Without this call
    /// any candidate may come.
    fn announce(&mut self, _candidates: &[Candidate]) {}

    /// Once per cycle, before any candidate: update memory that comes from sensors, precompute what all candidates
    /// share.
    fn observe(&mut self, _scene: &Scene) {}

    /// Pure and parallel: the same scene, candidate and memory give the same judgement on any thread, in any order.
    /// The candidate's data is valid: at least two points, all numbers finite, times never decrease, places within
    /// 1e8 m of the origin of the map. Points may still be that far apart: do not walk over what lies between.
    fn judge(&self, scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement;

    /// Once per cycle, after all candidates, in message order: fold what each candidate left behind.
    fn remember(&mut self, _judged: &[(&Candidate, &Judgement)]) {}

    /// One line of plain words on why the candidate is not feasible: what, where, when. `None` if it is feasible.
    fn explain(&self, judgement: &Judgement) -> Option<String> {
        crate::verdict::explain(judgement)
    }

    /// What a judgement leaves open, whatever it says: parts that were not assessed, and why, in one line. `None` if
    /// everything was looked at, or nothing was ([`Judgement::failure`] tells that).
    fn not_assessed(&self, _judgement: &Judgement) -> Option<String> {
        None
    }

    /// How full its memory is, for whoever watches that it stays bounded: what it keeps of candidates and things from
    /// cycle to cycle, not what follows from a map or a route. `None` if it has none.
    fn fill(&self) -> Option<Fill> {
        None
    }

    /// Why the planner would have to do something about this candidate, for whoever watches the planning. It changes no
    /// verdict.
    fn planning_factor(&self, _scene: &Scene, _judgement: &Judgement) -> Option<PlanningFactor> {
        None
    }
}

/// How full a memory is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Fill {
    /// Entries that it has.
    pub entries: usize,
    /// Most entries that it may have.
    pub bound: usize,
}

impl fmt::Debug for dyn Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Filter").field(&self.name()).finish()
    }
}

/// Buffers that a thread reuses from candidate to candidate, so that judging allocates nothing in steady state.
/// Their content means nothing between two calls, or says which cycle of which filter it belongs to.
#[derive(Debug, Default)]
pub struct Scratch {
    /// One number for each point of a candidate.
    pub per_point: Vec<f64>,
    /// The stretch of a candidate along which crosswalks are looked for.
    pub(crate) path: crosswalk::Path,
    /// Stop lines of crosswalks under a candidate.
    pub(crate) crossings: Vec<crosswalk::Crossing>,
    /// A candidate's own copy of whom it waits for at one crosswalk.
    pub(crate) waits: Vec<crosswalk::Wait>,
    /// Stances of the vehicle along a candidate, and the borders beside them.
    pub boundary_departure: boundary_departure::Buffer,
    /// Motions of the vehicle and searches of the collision check.
    pub collision_check: collision_check::Workspace,
    /// Outlines and pieces of the out-of-lane check.
    pub out_of_lane: out_of_lane::Workspace,
}

/// A kind of filter that can be loaded by name.
#[derive(Debug, Clone, Copy)]
pub struct FilterClass {
    /// Name in `filter_names`, for example `safety::VehicleConstraintFilter`. The part before `::` is the category.
    pub class_name: &'static str,
    /// Name of the filter itself, for example `vehicle_constraint_filter`.
    pub short_name: &'static str,
    /// Whether it folds memory of candidates: then it has to judge each of them, whatever others have found.
    pub remembers: bool,
    /// Place among the filters by what judging a candidate costs, the cheapest first.
    pub cost_rank: u8,
    /// Derives ahead what the filter needs of a map, if that takes long.
    pub prepare_map: Option<fn(&HdMap, &ValidatorParameters)>,
    /// Makes the filter.
    pub make: fn(&ValidatorParameters, &VehicleInfo) -> Box<dyn Filter>,
}

impl FilterClass {
    /// Text before the first `::` of the class name; empty if there is none.
    #[must_use]
    pub fn category(&self) -> &'static str {
        self.class_name.split_once("::").map_or("", |(category, _)| category)
    }

    /// The class with this name.
    #[must_use]
    pub fn find(class_name: &str) -> Option<&'static Self> {
        CLASSES.iter().find(|class| class.class_name == class_name)
    }
}

/// Every filter that can be loaded, in order of evaluation (ascending short name).
pub const CLASSES: &[FilterClass] = &[
    FilterClass {
        class_name: "safety::CollisionCheckFilter",
        short_name: collision_check::NAME,
        remembers: false,
        cost_rank: 5,
        prepare_map: Some(|map, _| {
            collision_check::priority_of(map);
        }),
        make: |parameters, vehicle| {
            Box::new(collision_check::CollisionCheckFilter::new(&parameters.collision_check, vehicle))
        },
    },
    FilterClass {
        class_name: "traffic_rule::CrosswalkFilter",
        short_name: crosswalk::NAME,
        remembers: true,
        cost_rank: 1,
        prepare_map: None,
        make: |parameters, vehicle| {
            Box::new(crosswalk::CrosswalkFilter::new(
                parameters.crosswalk.clone(),
                vehicle.max_longitudinal_offset_m(),
            ))
        },
    },
    FilterClass {
        class_name: "safety::OutOfLaneFilter",
        short_name: out_of_lane::NAME,
        remembers: false,
        cost_rank: 4,
        prepare_map: Some(|map, parameters| {
            out_of_lane::road_of(map, &parameters.out_of_lane.lanelet_subtypes);
        }),
        make: |parameters, vehicle| {
            Box::new(out_of_lane::OutOfLaneFilter::new(parameters.out_of_lane.clone(), vehicle))
        },
    },
    FilterClass {
        class_name: "traffic_rule::TrafficLightFilter",
        short_name: traffic_light::NAME,
        remembers: true,
        cost_rank: 0,
        prepare_map: None,
        make: |parameters, vehicle| {
            Box::new(traffic_light::TrafficLightFilter::new(
                parameters.traffic_light.clone(),
                vehicle.max_longitudinal_offset_m(),
            ))
        },
    },
    FilterClass {
        class_name: "safety::UncrossableBoundaryDepartureFilter",
        short_name: boundary_departure::NAME,
        remembers: true,
        cost_rank: 3,
        prepare_map: Some(|map, parameters| {
            boundary_departure::borders_of(map, &parameters.boundary_departure.boundary_types);
        }),
        make: |parameters, vehicle| {
            Box::new(boundary_departure::UncrossableBoundaryDepartureFilter::new(
                parameters.boundary_departure.clone(),
                *vehicle,
            ))
        },
    },
    FilterClass {
        class_name: "safety::VehicleConstraintFilter",
        short_name: vehicle_constraint::NAME,
        remembers: false,
        cost_rank: 2,
        prepare_map: None,
        make: |parameters, vehicle| {
            Box::new(vehicle_constraint::VehicleConstraintFilter::new(
                parameters.vehicle_constraint.clone(),
                vehicle.wheel_base_m(),
            ))
        },
    },
];

/// Derives from a map, ahead of the first cycle that has it, what the loaded filters need of it: for the map of a city
/// that takes longer than a cycle may. It changes no verdict, only when the work is done.
pub fn prepare_map(map: &HdMap, parameters: &ValidatorParameters) {
    let is_loaded = |class: &&FilterClass| {
        let mut names = parameters.filter_names.iter().chain(&parameters.shadow_mode_filter_names);
        names.any(|name| name == class.class_name)
    };
    for prepare in CLASSES.iter().filter(is_loaded).filter_map(|class| class.prepare_map) {
        prepare(map, parameters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Validator;
    use crate::scene::Epoch;
    use lanelet_map::MapBuilder;
    use messages::autoware_perception_msgs::PredictedObjects;
    use messages::std_msgs::Header;
    use std::sync::Arc;

    #[test]
    fn classes_are_in_order_of_evaluation_and_unique() {
        assert!(CLASSES.windows(2).all(|pair| pair[0].short_name < pair[1].short_name));
        assert_eq!(FilterClass::find("safety::VehicleConstraintFilter").unwrap().category(), "safety");
        assert!(FilterClass::find("safety::Nonsense").is_none());
    }

    /// A road, and everything that a cycle needs.
    fn scene() -> Scene {
        let mut builder = MapBuilder::new();
        for (id, y) in [(1, 2.0), (2, -2.0)] {
            builder
                .line_string_at(id, &[[0.0, y, 0.0], [100.0, y, 0.0]], &[("type", "road_border")])
                .unwrap();
        }
        builder.lanelet(3, 1, 2, &[("subtype", "road")]).unwrap();
        let mut scene = crate::test_scene::scene();
        let map = Arc::new(builder.build().unwrap());
        scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), map) });
        scene.odometry = Some(Arc::default());
        scene.acceleration = Some(Arc::default());
        scene.objects = Some(Arc::new(PredictedObjects {
            header: Header { frame_id: "map".to_owned(), ..Header::default() },
            ..PredictedObjects::default()
        }));
        scene
    }

    #[test]
    fn filters_use_what_was_prepared_and_only_for_their_parameters() {
        let scene = scene();
        let map = &scene.map.as_ref().unwrap().value;
        let mut parameters = ValidatorParameters::default();
        prepare_map(map, &parameters);
        let prepared = parameters.clone();
        // Who has the tables, beside the map and this question.
        let users = || {
            let is_missing = || panic!("not prepared");
            let borders = map.survey.borders.of(&prepared.boundary_departure.boundary_types, is_missing);
            let road = map.survey.road.of(&prepared.out_of_lane.lanelet_subtypes, || panic!("not prepared"));
            let priority = map.survey.priority.get().unwrap();
            (
                Arc::strong_count(&borders.unwrap()) - 2,
                Arc::strong_count(&road.unwrap()) - 2,
                Arc::strong_count(priority) - 1,
            )
        };
        assert_eq!(users(), (0, 0, 0));
        let mut validator = Validator::new(parameters.clone(), &scene.vehicle).unwrap();
        validator.observe(&scene);
        let (borders, road, priority) = users();
        assert!(borders >= 1 && road == 1 && priority == 1, "{borders}, {road}, {priority}");
        parameters.boundary_departure.boundary_types = vec!["curbstone".to_owned()];
        validator.configure(parameters);
        validator.observe(&scene);
        assert_eq!(users(), (0, 1, 1), "borders of other types were prepared");
    }
}
