//! Hand-made problems and coarse paths for tests.

use motion::{Point2, VehicleInfo};

use crate::arc::Arc;
use crate::hybrid_a_star::{CoarsePath, GearPart};
use crate::pose::{Gear, PlanarPose};
use crate::problem::{Limits, Problem};

/// Arcs of (curvature, length) in one gear from `start`.
pub(crate) fn part(gear: Gear, start: PlanarPose, arcs: &[(f64, f64)]) -> GearPart {
    let mut part = GearPart { gear, poses: vec![start], arcs: Vec::new() };
    for (curvature, length) in arcs {
        let arc = Arc::new(*curvature, gear.sign() * length);
        part.poses.push(arc.end(part.poses.last().unwrap()));
        part.arcs.push(arc);
    }
    part
}

/// Parts one after the other, the first in `gear`, and the problem they solve without obstacles.
pub(crate) fn manoeuvre(gear: Gear, start: PlanarPose, parts: &[&[(f64, f64)]]) -> (Problem, CoarsePath) {
    let mut path = CoarsePath { parts: Vec::new(), cost_m: 0.0, inflation_m: 0.1, expansions: 0 };
    let (mut gear, mut pose) = (gear, start);
    for arcs in parts {
        let part = part(gear, pose, arcs);
        pose = *part.poses.last().unwrap();
        gear = gear.reversed();
        path.parts.push(part);
    }
    (Problem { start, goal: pose, ..problem(vec![]) }, path)
}

/// From the origin to the origin among `obstacles`.
pub(crate) fn problem(obstacles: Vec<Vec<Point2>>) -> Problem {
    Problem {
        vehicle: VehicleInfo::default(),
        limits: Limits::default(),
        bounds: [-60.0, 60.0, -60.0, 60.0],
        obstacles,
        start: PlanarPose::default(),
        start_speed_mps: 0.0,
        start_acceleration_mps2: 0.0,
        start_curvature: None,
        goal: PlanarPose::default(),
    }
}
