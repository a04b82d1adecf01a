//! Seeded parking scenes, for tests and measurements: the same seed gives the same scenes on every machine.
//!
//! Every kind of scene runs from generous (tightness 0) to about the limit of what can be driven (1): gaps beside the
//! vehicle from 0.6 to 0.3 m, aisles from 1.45 to 0.9 times what one sweep needs. Start and goal are free by 5 cm at
//! least; whether there is a way between them is not promised for the tight ones.

mod build;

use motion::{Point2, VehicleDimensions, VehicleInfo};

use crate::collision::CollisionChecker;
use crate::pose::PlanarPose;
use crate::problem::{Limits, Problem};

/// Room that the vehicle has at start and goal at least, m.
const END_ROOM_M: f64 = 0.05;
/// Drawings of a scene before one whose start or goal is not free is taken after all.
const TRIES: usize = 200;

/// What is to be done in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SceneKind {
    /// Into a gap between cars along the lane.
    Parallel,
    /// Nose first into a slot at 90 degrees.
    PerpendicularForward,
    /// Tail first into a slot at 90 degrees.
    PerpendicularReverse,
    /// Nose or tail first into a slot at 30, 45 or 60 degrees.
    Angled,
    /// Turn round at a closed end.
    DeadEnd,
    /// Into a slot at 90 degrees from an aisle with cars on its other side.
    NarrowAisle,
    /// Out of a slot into the lane.
    PullOut,
    /// Turn round between two walls.
    UTurn,
    /// To a free place among boxes and pillars in a walled yard.
    Clutter,
}

impl SceneKind {
    /// Every kind.
    pub const ALL: [Self; 9] = [
        Self::Parallel,
        Self::PerpendicularForward,
        Self::PerpendicularReverse,
        Self::Angled,
        Self::DeadEnd,
        Self::NarrowAisle,
        Self::PullOut,
        Self::UTurn,
        Self::Clutter,
    ];

    /// In snake_case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parallel => "parallel",
            Self::PerpendicularForward => "perpendicular_forward",
            Self::PerpendicularReverse => "perpendicular_reverse",
            Self::Angled => "angled",
            Self::DeadEnd => "dead_end",
            Self::NarrowAisle => "narrow_aisle",
            Self::PullOut => "pull_out",
            Self::UTurn => "u_turn",
            Self::Clutter => "clutter",
        }
    }
}

/// A generated scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Kind and number.
    pub name: String,
    /// What is to be done.
    pub kind: SceneKind,
    /// 0 generous, 1 at the limit.
    pub tightness: f64,
    /// The problem.
    pub problem: Problem,
}

/// Random numbers of one scene: splitmix64.
#[derive(Clone, Debug)]
struct Random(u64);

impl Random {
    fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `low..high`.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }
}

/// Scenes of all kinds in turn, `per_kind` of each, tightness evenly from 0 to 1.
pub fn suite(seed: u64, per_kind: u32) -> impl Iterator<Item = Scene> {
    (0..per_kind).flat_map(move |number| {
        SceneKind::ALL.into_iter().map(move |kind| {
            let tightness = (f64::from(number) + 0.5) / f64::from(per_kind);
            scene(kind, tightness, seed, number)
        })
    })
}

/// One scene. `tightness` is between 0 and 1.
#[must_use]
pub fn scene(kind: SceneKind, tightness: f64, seed: u64, number: u32) -> Scene {
    let mut random = Random(seed);
    for key in [kind as u64, u64::from(number)] {
        random = Random(random.next_u64() ^ key.wrapping_mul(0xd134_2543_de82_ef95));
    }
    let is_free = |problem: &Problem| {
        CollisionChecker::new(problem).is_ok_and(|checker| {
            checker.is_free(&problem.start, END_ROOM_M) && checker.is_free(&problem.goal, END_ROOM_M)
        })
    };
    // Cars of random sizes at random places may be in the way of the start: try again, but not for ever.
    let mut problem = build::problem(kind, tightness, &mut random);
    for _ in 0..TRIES {
        if is_free(&problem) {
            break;
        }
        problem = build::problem(kind, tightness, &mut random);
    }
    Scene { name: format!("{}_{number:03}", kind.name()), kind, tightness, problem }
}

/// The vehicles that scenes are made for, equally often.
fn vehicle(random: &mut Random) -> VehicleInfo {
    let sample = VehicleDimensions::default();
    let dimensions = match random.next_u64() % 3 {
        0 => sample,
        1 => VehicleDimensions {
            wheel_base_m: 3.66,
            front_overhang_m: 0.95,
            rear_overhang_m: 1.35,
            wheel_tread_m: 1.73,
            left_overhang_m: 0.145,
            right_overhang_m: 0.145,
            max_steer_angle_rad: 0.61,
            ..sample
        },
        _ => VehicleDimensions {
            wheel_base_m: 2.8448,
            front_overhang_m: 1.0452,
            rear_overhang_m: 1.043,
            wheel_tread_m: 1.6,
            left_overhang_m: 0.255,
            right_overhang_m: 0.255,
            max_steer_angle_rad: 0.512_69,
            ..sample
        },
    };
    // All three pass the check; the sample vehicle would stand in for one that did not.
    VehicleInfo::new(dimensions).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_scenes_and_another_gives_others() {
        let first: Vec<_> = suite(7, 2).map(|s| format!("{s:?}")).collect();
        let again: Vec<_> = suite(7, 2).map(|s| format!("{s:?}")).collect();
        assert_eq!(first, again);
        let other: Vec<_> = suite(8, 2).map(|s| format!("{s:?}")).collect();
        assert!(first.iter().zip(&other).all(|(a, b)| a != b));
        assert_eq!(first.len(), 18);
    }

    #[test]
    fn starts_and_goals_are_free_and_apart() {
        for scene in suite(1, 12) {
            let problem = &scene.problem;
            let checker = CollisionChecker::new(problem).unwrap();
            assert!(checker.is_free(&problem.start, END_ROOM_M), "{}", scene.name);
            assert!(checker.is_free(&problem.goal, END_ROOM_M), "{}", scene.name);
            assert!(problem.start.distance_m(&problem.goal) > 1.0, "{}", scene.name);
            assert!(problem.obstacles.len() >= 2, "{}", scene.name);
        }
    }
}
