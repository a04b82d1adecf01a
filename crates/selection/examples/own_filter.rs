//! A filter of one's own: past people on foot at walking pace only.

use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedObjects};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::unique_identifier_msgs::Uuid;
use motion::{Point2, Posed, VehicleInfo};
use selection::parameters::ValidatorParameters;
use selection::validator::UnknownFilter;
use selection::{
    Candidate, Enforcement, Evidence, Filter, Judgement, Metric, RiskLevel, Scene, Scratch, Validator,
};
use std::sync::Arc;

const WALKING_PACE_MPS: f64 = 2.0;
const NEAR_M: f64 = 3.0;

#[derive(Default)]
struct WalkingPaceFilter {
    people: Vec<(Uuid, Point2)>,
}

impl Filter for WalkingPaceFilter {
    fn name(&self) -> &'static str {
        "walking_pace_filter"
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    // What all candidates share is worked out once per cycle.
    fn observe(&mut self, scene: &Scene) {
        self.people.clear();
        for object in scene.objects.iter().flat_map(|message| &message.objects) {
            if object.classification.iter().any(|class| class.label == ObjectClassification::PEDESTRIAN) {
                let place = object.kinematics.initial_pose_with_covariance.pose.position;
                self.people.push((object.object_id, Point2::new(place.x, place.y)));
            }
        }
    }

    // Only reads: any thread may judge any candidate at any time.
    fn judge(&self, scene: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        if scene.objects.is_none() {
            return Judgement::not_assessed("objects are not available");
        }
        let (mut fastest, mut first) = (0.0_f64, None);
        for (index, point) in candidate.points.iter().enumerate() {
            let speed = f64::from(point.longitudinal_velocity_mps).abs();
            let near = |(_, place): &&(Uuid, Point2)| (place - point.point()).norm() < NEAR_M;
            if speed > WALKING_PACE_MPS
                && let Some((person, _)) = self.people.iter().find(near)
            {
                fastest = fastest.max(speed);
                first.get_or_insert(Evidence { object_id: Some(*person), ..Evidence::at(candidate, index) });
            }
        }
        let risk = if first.is_some() { RiskLevel::Danger } else { RiskLevel::Safe };
        let metric = Metric { name: "speed_near_people", value: fastest, threshold: WALKING_PACE_MPS, risk };
        Judgement { feasible: first.is_none(), evidence: first, ..Judgement::feasible([metric]) }
    }
}

fn main() -> Result<(), UnknownFilter> {
    let vehicle = VehicleInfo::default();
    let parameters = ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    let mut validator = Validator::new(parameters, &vehicle)?;
    let make = |_: &ValidatorParameters| Box::<WalkingPaceFilter>::default() as Box<dyn Filter>;
    validator.load("safety", Enforcement::Enforced, Arc::new(make));

    let class = ObjectClassification { label: ObjectClassification::PEDESTRIAN, probability: 1.0 };
    let mut person = PredictedObject { classification: vec![class], ..PredictedObject::default() };
    person.kinematics.initial_pose_with_covariance.pose.position.x = 10.0;
    let objects = PredictedObjects { objects: vec![person], ..PredictedObjects::default() };
    let mut scene = Scene::empty(Time::default(), Arc::new(vehicle));
    scene.objects = Some(Arc::new(objects));

    for speed in [1.5, 5.0] {
        let mut message = CandidateTrajectory::default();
        for step in 0..100 {
            let mut point =
                TrajectoryPoint { longitudinal_velocity_mps: speed, ..TrajectoryPoint::default() };
            point.time_from_start = Duration::from_nanoseconds(step * 100_000_000);
            point.pose.position.x = f64::from(speed) * point.time_from_start.seconds();
            message.points.push(point);
        }
        let candidate = Candidate::new(Arc::new(message), "example".into(), 0);
        validator.observe(&scene);
        let verdict = validator.judge(&scene, &candidate, &mut Scratch::default(), || 0, &mut []);
        let why = validator.filters()[0].explain(&verdict.judgements[0]);
        println!("{speed} m/s: {}", why.as_deref().unwrap_or("accepted"));
        assert_eq!(verdict.accepted, f64::from(speed) <= WALKING_PACE_MPS);
    }
    Ok(())
}
