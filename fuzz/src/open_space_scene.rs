//! The open-space planner on arbitrary scenes: whatever it claims to be a plan, an independent look finds nothing wrong
//! with.

#[path = "../../crates/open-space/tests/support/judge.rs"]
mod judge;

use super::are_one_in;
use arbitrary::{Arbitrary, Unstructured};
use motion::{Point2, VehicleDimensions, VehicleInfo};
use open_space::planner::Step;
use open_space::{
    Interruption, Limits, OpenSpaceParameters, PlanError, PlanarPose, Planner, Problem, Supervisor,
};

/// One input in so many is planned to its end, and begins rolling, if it was drawn so. The others are interrupted soon, and
/// begin at rest: programs are solved for one that rolls, whatever the time.
const PATIENT: u64 = 8;
/// One in so many has the lengths of cars, not those of the models that the others have, but is as coarse as those.
const LARGE: u64 = 16;
/// One in so many has lattices, points and passes as fine and as many as shipped; it takes twenty times as long.
const IN_FULL: u64 = 512;
/// Lengths of a model, to those of what it is a model of. A field of distances, of cells of 0.1 m, is a tenth as large.
const MODEL: f64 = 0.3;

/// Nodes that each search may expand: a run takes a millisecond, not seconds. And those of a run in full.
const MAX_EXPANSIONS: [u32; 2] = [40, 400];

/// How long lengths, lists and the patience are.
#[derive(Clone, Copy)]
struct Size {
    /// Of all lengths, and so of speeds: times are the same.
    scale: f64,
    is_patient: bool,
    is_in_full: bool,
}

impl Size {
    fn of(bytes: &[u8]) -> Self {
        let scale = if are_one_in(LARGE, bytes) { 1.0 } else { MODEL };
        Self { scale, is_patient: are_one_in(PATIENT, bytes), is_in_full: are_one_in(IN_FULL, bytes) }
    }

    /// So many questions whether to go on are answered with yes.
    fn questions(self, drawn: &Drawn) -> u32 {
        match self {
            Self { is_in_full: true, .. } => 1_000,
            Self { is_patient: true, .. } => 1 + u32::from(drawn.interrupted_after / 8),
            _ => 1 + u32::from(drawn.interrupted_after / 32),
        }
    }
}

/// A number in centimetres, or hundredths of anything; now and then one that nobody would write.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hundredths<const LARGEST: i32>(pub(crate) f64);

impl<'a, const LARGEST: i32> Arbitrary<'a> for Hundredths<LARGEST> {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(match u.arbitrary::<u8>()? {
            255 => u.arbitrary()?,
            254 => u
                .choose(&[f64::NAN, f64::INFINITY, -f64::INFINITY, -0.0, f64::MAX, f64::MIN_POSITIVE])
                .copied()?,
            high => {
                let number = i32::from(high) << 8 | i32::from(u.arbitrary::<u8>()?);
                f64::from(number % (2 * LARGEST + 1) - LARGEST) / 100.0
            }
        }))
    }
}

type Metres = Hundredths<600>;
type Radians = Hundredths<315>;

#[derive(Debug, Arbitrary)]
struct Place {
    x: Metres,
    y: Metres,
    yaw: Radians,
}

impl Place {
    fn pose(&self, scale: f64) -> PlanarPose {
        PlanarPose::new(scale * self.x.0, scale * self.y.0, self.yaw.0)
    }
}

#[derive(Debug, Arbitrary)]
enum Obstacle {
    Wall { points: Vec<(Metres, Metres)> },
    Solid { points: Vec<(Metres, Metres)> },
    Box { at: Place, length: Hundredths<400>, width: Hundredths<250> },
}

impl Obstacle {
    /// Of some points at most.
    fn polyline(&self, most: usize, scale: f64) -> Vec<Point2> {
        let point = |(x, y): &(Metres, Metres)| Point2::new(scale * x.0, scale * y.0);
        match self {
            Self::Wall { points } => points.iter().take(most).map(point).collect(),
            Self::Solid { points } => {
                let mut outline: Vec<Point2> = points.iter().take(most).map(point).collect();
                outline.extend(outline.first().copied());
                outline
            }
            Self::Box { at, length, width } => {
                let (sin, cos) = at.yaw.0.sin_cos();
                [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]]
                    .map(|[a, b]| (a * length.0 / 2.0, b * width.0 / 2.0))
                    .map(|(a, b)| (at.x.0 + cos * a - sin * b, at.y.0 + sin * a + cos * b))
                    .map(|(x, y)| Point2::new(scale * x, scale * y))
                    .to_vec()
            }
        }
    }
}

#[derive(Debug, Arbitrary)]
struct Drawn {
    goal: Place,
    start: Place,
    /// Drawn limits instead of those as shipped: of speeds, acceleration, jerk and steering.
    limits: Option<[u8; 5]>,
    start_speed: u8,
    interrupted_after: u8,
    /// Instead of told that its time is up, if large.
    is_cancelled: u8,
    small_vehicle: bool,
    bounds: Option<[Metres; 4]>,
    obstacles: Vec<Obstacle>,
}

impl Drawn {
    fn parameters(&self, size: Size) -> OpenSpaceParameters {
        let mut parameters = OpenSpaceParameters::default();
        let (search, smoother) = (&mut parameters.search, &mut parameters.smoother);
        search.max_expansions = MAX_EXPANSIONS[usize::from(size.is_in_full)];
        search.extra_expansions = 0;
        if !size.is_in_full {
            (search.xy_grid_resolution, search.phi_grid_resolution) = (0.6 * size.scale, 0.25);
            search.grid_a_star_xy_resolution = size.scale;
            search.node_radius *= size.scale;
            search.clearance *= size.scale;
            search.next_node_num = 6;
            search.pose_spacing = 0.3 * size.scale;
            (smoother.interpolated_delta_s, smoother.max_passes) = (0.4 * size.scale, 3);
            smoother.default_bound *= size.scale;
            smoother.clearance *= size.scale;
        }
        parameters
    }

    fn problem(&self, Size { scale, is_patient, is_in_full }: Size) -> Problem {
        let (most_obstacles, most_points) = if is_in_full { (16, 12) } else { (5, 6) };
        // The slower the vehicle may be, the longer it is under way.
        let least = if is_in_full { 0.05 } else { 0.5 };
        let limits = self.limits.map_or_else(Limits::default, |drawn| {
            let [forward, reverse, acceleration, jerk, steering] = drawn.map(|x| least + f64::from(x) / 64.0);
            Limits {
                max_speed_forward_mps: forward,
                max_speed_reverse_mps: reverse,
                max_acceleration_mps2: acceleration,
                max_jerk_mps3: 2.0 * jerk,
                max_steer_rate_rps: steering / 2.0,
            }
        });
        let limits = Limits {
            max_speed_forward_mps: scale * limits.max_speed_forward_mps,
            max_speed_reverse_mps: scale * limits.max_speed_reverse_mps,
            max_acceleration_mps2: scale * limits.max_acceleration_mps2,
            max_jerk_mps3: scale * limits.max_jerk_mps3,
            ..limits
        };
        let mut dimensions = *VehicleInfo::default().dimensions();
        if self.small_vehicle {
            dimensions = VehicleDimensions { wheel_base_m: 1.2, wheel_tread_m: 0.8, ..dimensions };
        }
        for length_m in [
            &mut dimensions.wheel_radius_m,
            &mut dimensions.wheel_width_m,
            &mut dimensions.wheel_base_m,
            &mut dimensions.wheel_tread_m,
            &mut dimensions.front_overhang_m,
            &mut dimensions.rear_overhang_m,
            &mut dimensions.left_overhang_m,
            &mut dimensions.right_overhang_m,
        ] {
            *length_m *= scale;
        }
        let bounds = self.bounds.as_ref().map_or([-6.0, 6.0, -6.0, 6.0], |drawn| {
            // An immense region has more cells than anything else.
            let near = |bound: f64| if bound.is_finite() { bound.clamp(-8.0, 8.0) } else { bound };
            let bound = |k: usize| if is_in_full { drawn[k].0 } else { near(drawn[k].0) };
            let [a, b, c, d] = [0, 1, 2, 3].map(bound);
            [a.min(b), a.max(b), c.min(d), c.max(d)]
        });
        let is_rolling = is_patient && self.start_speed > 200;
        let start_speed_mps = if is_rolling { f64::from(self.start_speed) / 100.0 - 2.2 } else { 0.0 };
        Problem {
            vehicle: VehicleInfo::new(dimensions).expect("a vehicle that can be"),
            limits,
            bounds: bounds.map(|bound| scale * bound),
            obstacles: self
                .obstacles
                .iter()
                .take(most_obstacles)
                .map(|obstacle| obstacle.polyline(most_points, scale))
                .collect(),
            start: self.start.pose(scale),
            start_speed_mps: scale * start_speed_mps,
            start_acceleration_mps2: 0.0,
            start_curvature: (self.start_speed > 100)
                .then(|| (f64::from(self.start_speed) - 178.0) / 500.0 / scale),
            goal: self.goal.pose(scale),
        }
    }
}

/// Lets the planner go on for so many questions.
struct Budget {
    questions: u32,
    then: Interruption,
}

impl Supervisor for Budget {
    fn interruption(&mut self) -> Option<Interruption> {
        self.questions = self.questions.saturating_sub(1);
        (self.questions == 0).then_some(self.then)
    }

    fn begin(&mut self, _: Step) {}
}

/// A scene to park in.
pub fn open_space(bytes: &[u8]) {
    let Ok(drawn) = Drawn::arbitrary_take_rest(Unstructured::new(bytes)) else { return };
    let size = Size::of(bytes);
    let problem = drawn.problem(size);
    let mut budget = Budget {
        questions: size.questions(&drawn),
        then: if drawn.is_cancelled > 224 { Interruption::Cancelled } else { Interruption::OutOfTime },
    };
    match Planner::new(drawn.parameters(size)).plan(&problem, &mut budget) {
        Ok(plan) => {
            let points = &plan.trajectory.points;
            assert!(points.iter().all(|point| {
                let numbers = [point.time_s, point.curvature, point.speed_mps, point.acceleration_mps2];
                point.pose.is_finite() && numbers.iter().all(|number| number.is_finite())
            }));
            let faults = judge::faults(&plan.trajectory, &problem);
            assert!(faults.is_empty(), "{:?}\n{problem:#?}", faults.first());
        }
        // What it made itself must pass its own last check.
        Err(PlanError::Invalid(violation)) => panic!("{violation}\n{problem:#?}"),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}
