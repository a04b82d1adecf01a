//! A path in one gear with everything a vehicle needs to drive it: position, heading and curvature at every distance.
//!
//! Curvature is continuous and piecewise linear in the distance (a chain of clothoids), and heading and position are
//! its integrals, so a bicycle model that steers as the profile says stays on it. The discrete profile of upstream
//! (headings and curvatures by finite differences of points) is what [`PathProfile::through`] starts from.

use motion::pose::normalize_radian;
use motion::{Point2, Vector2};
use nalgebra::Vector3;

use crate::pose::{Gear, PlanarPose};
use crate::tolerance::{PATH_END_M, PATH_END_RAD};

/// A path in one gear.
#[derive(Clone, Debug, PartialEq)]
pub struct PathProfile {
    gear: Gear,
    step_m: f64,
    /// Poses `step_m` of travel apart; at least two. Headings are continuous, not normalised.
    poses: Vec<PlanarPose>,
    /// Curvature at each pose, linear in between, 1/m.
    curvatures: Vec<f64>,
}

impl PathProfile {
    /// The path from `start` with `curvatures` (at least two), `step_m` of travel apart.
    #[must_use]
    pub fn integrate(gear: Gear, start: PlanarPose, step_m: f64, curvatures: Vec<f64>) -> Self {
        let mut poses = Vec::with_capacity(curvatures.len());
        poses.push(start);
        let mut pose = start;
        for pair in curvatures.windows(2) {
            pose = advance(&pose, gear, pair[0], (pair[1] - pair[0]) / step_m, step_m);
            poses.push(pose);
        }
        Self { gear, step_m, poses, curvatures }
    }

    /// The path from `start` (with a curvature, or with any) to `end`, both met exactly, that passes close by `points`:
    /// evenly spaced (nearly), from the position of `start` to that of `end`, at least three.
    ///
    /// Curvature is that of the points, changed as little as the ends demand and never beyond `max_curvature`. How
    /// close the path comes to the points depends on how well they go together with the ends: check it for collisions.
    /// `None` when no such path was found.
    #[must_use]
    pub fn through(
        points: &[Point2],
        (start, start_curvature): (PlanarPose, Option<f64>),
        end: PlanarPose,
        gear: Gear,
        max_curvature: f64,
    ) -> Option<Self> {
        let (step_m, mut curvatures) = discrete_curvatures(points, gear)?;
        let mut held = vec![false; points.len()];
        if let Some(curvature) = start_curvature {
            (curvatures[0], held[0]) = (curvature, true);
        }
        let curvatures = curvatures.into_iter().map(|k| k.clamp(-max_curvature, max_curvature)).collect();
        let mut path = Self::integrate(gear, start, step_m, curvatures);
        for _ in 0..CORRECTIONS {
            if path.take_end(&end) {
                return Some(path);
            }
            path = path.corrected(&end, max_curvature, &mut held)?;
        }
        None
    }

    /// A circular arc, or a straight line for curvature 0, of `length_m` of travel from `start`; `end` is its end as the
    /// caller knows it.
    #[must_use]
    pub fn arc(gear: Gear, start: PlanarPose, curvature: f64, length_m: f64, end: PlanarPose) -> Self {
        let steps = (length_m / ARC_STEP_M).ceil().max(1.0);
        let mut path = Self::integrate(gear, start, length_m / steps, vec![curvature; steps as usize + 1]);
        if let Some(last) = path.poses.last_mut() {
            *last = end;
        }
        path
    }

    /// Gear of the whole path.
    #[must_use]
    pub fn gear(&self) -> Gear {
        self.gear
    }

    /// Distance travelled along the path, positive in both gears, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.step_m * (self.poses.len() - 1) as f64
    }

    /// Travel between neighbouring poses, m.
    #[must_use]
    pub fn step_m(&self) -> f64 {
        self.step_m
    }

    /// Poses from start to end, [`Self::step_m`] of travel apart.
    #[must_use]
    pub fn poses(&self) -> &[PlanarPose] {
        &self.poses
    }

    /// Curvatures at the poses, linear in between, 1/m.
    #[must_use]
    pub fn curvatures(&self) -> &[f64] {
        &self.curvatures
    }

    /// Pose and curvature after `position_m` of travel; those of the ends before the start and beyond the end.
    #[must_use]
    pub fn at(&self, position_m: f64) -> (PlanarPose, f64) {
        let last = self.poses.len() - 1;
        let step = (position_m / self.step_m).max(0.0) as usize;
        if step >= last {
            return (self.poses[last], self.curvatures[last]);
        }
        let travel = (position_m - step as f64 * self.step_m).max(0.0);
        let curvature = self.curvatures[step];
        let slope = (self.curvatures[step + 1] - curvature) / self.step_m;
        (advance(&self.poses[step], self.gear, curvature, slope, travel), curvature + slope * travel)
    }

    /// Highest speed in each step at which front wheels that turn at `steer_rate_rps` at most follow the curvature,
    /// and `top_mps` at most.
    #[must_use]
    pub fn steering_caps(&self, wheel_base_m: f64, steer_rate_rps: f64, top_mps: f64) -> Vec<f64> {
        let cap = |pair: &[f64]| {
            // d steer / ds = wheel_base * d curvature / ds / (1 + (wheel_base * curvature)²)
            let least = if pair[0] * pair[1] <= 0.0 { 0.0 } else { pair[0].abs().min(pair[1].abs()) };
            let slope = (pair[1] - pair[0]).abs() / self.step_m;
            let per_metre = wheel_base_m * slope / (1.0 + (wheel_base_m * least).powi(2));
            if per_metre * top_mps <= steer_rate_rps { top_mps } else { steer_rate_rps / per_metre }
        };
        self.curvatures.windows(2).map(cap).collect()
    }

    /// Takes over `end` as the last pose if the path comes that close to it.
    fn take_end(&mut self, end: &PlanarPose) -> bool {
        let Some(last) = self.poses.last_mut() else { return false };
        let met = last.distance_m(end) < PATH_END_M && (last.yaw - end.yaw).abs() < PATH_END_RAD;
        if met {
            *last = *end;
        }
        met
    }

    /// One Newton step towards `end`: the smallest change of curvatures and of the step length that leads there.
    ///
    /// Curvatures that reach `max_curvature` are `held` there from then on.
    fn corrected(&self, end: &PlanarPose, max_curvature: f64, held: &mut [bool]) -> Option<Self> {
        let last = self.poses.last()?;
        let first = self.poses.first()?;
        let miss = Vector3::new(end.x - last.x, end.y - last.y, end.yaw - last.yaw);
        let sign = self.gear.sign();
        // What the end does when the heading turns by one at a pose.
        let turn = |pose: &PlanarPose| Vector3::new(pose.y - last.y, last.x - pose.x, 1.0);
        let share =
            |k: usize| if k == 0 || k + 1 == self.poses.len() { self.step_m / 2.0 } else { self.step_m };
        let grow =
            self.poses.iter().zip(&self.curvatures).enumerate().fold(
                Vector3::new(last.x - first.x, last.y - first.y, 0.0),
                |sum, (k, (pose, curvature))| sum + turn(pose) * (sign * curvature * share(k)),
            );
        let grow_ease = 1.0 / (self.length_m() * GROWTH_CURVATURE * GROWTH_CURVATURE);
        let mut gram = grow * grow.transpose() * grow_ease;
        for (k, pose) in self.poses.iter().enumerate().filter(|(k, _)| !held[*k]) {
            gram += turn(pose) * turn(pose).transpose() * share(k);
        }
        let multiplier = gram.cholesky()?.solve(&miss);
        let mut curvatures = self.curvatures.clone();
        for ((curvature, pose), held) in
            curvatures.iter_mut().zip(&self.poses).zip(held).filter(|(_, h)| !**h)
        {
            *curvature += sign * turn(pose).dot(&multiplier);
            // What holding it here leaves undone is up to the others in the next step.
            *held = curvature.abs() > max_curvature;
            *curvature = curvature.clamp(-max_curvature, max_curvature);
        }
        let growth = 1.0 + grow.dot(&multiplier) * grow_ease;
        (0.5..2.0)
            .contains(&growth)
            .then(|| Self::integrate(self.gear, *first, self.step_m * growth, curvatures))
    }
}

/// Newton steps to the end of a path before it is given up.
const CORRECTIONS: usize = 20;
/// Curvature (1/m) of which a change along the whole path is as bad as a path twice as long.
const GROWTH_CURVATURE: f64 = 0.3;
/// Longest step of an arc, m.
const ARC_STEP_M: f64 = 0.1;

/// Step length along a path through evenly spaced points, and its curvature at each of them.
fn discrete_curvatures(points: &[Point2], gear: Gear) -> Option<(f64, Vec<f64>)> {
    let chords: Vec<_> = points.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let steps = chords.len();
    if steps < 2 || chords.iter().any(|chord| chord.norm_squared() == 0.0) {
        return None;
    }
    let headings: Vec<f64> = chords.iter().map(|chord| chord.y.atan2(chord.x)).collect();
    let turns: Vec<f64> = headings.windows(2).map(|pair| normalize_radian(pair[1] - pair[0])).collect();
    // An arc is longer than its chord by a 24th of the square of its angle.
    let bend = turns.iter().map(|turn| turn * turn).sum::<f64>() / (24.0 * turns.len() as f64);
    let step_m = chords.iter().map(Vector2::norm).sum::<f64>() / steps as f64 * (1.0 + bend);
    // The turn between two chords is the mean curvature about their common point, times the step.
    let inner: Vec<f64> = turns.iter().map(|turn| gear.sign() * turn / step_m).collect();
    let beyond = |edge: usize, next: usize| 2.0 * inner[edge] - inner[next.min(inner.len() - 1)];
    let last = inner.len() - 1;
    let mut curvatures = vec![beyond(0, 1)];
    curvatures.extend(&inner);
    curvatures.push(beyond(last, last.saturating_sub(1)));
    Some((step_m, curvatures))
}

/// Pose after `travel_m` in `gear` from `from`, where the curvature is `curvature` and grows by `slope` per metre.
fn advance(from: &PlanarPose, gear: Gear, curvature: f64, slope: f64, travel_m: f64) -> PlanarPose {
    let sign = gear.sign();
    let yaw = |u: f64| from.yaw + sign * u * (curvature + slope * u / 2.0);
    let (mut x, mut y) = (0.0, 0.0);
    // Gauss's rule with three points: exact to the last place for the turns of a step.
    for (node, weight) in [(0.112_701_665_379_258_31, 5.0), (0.5, 8.0), (0.887_298_334_620_741_7, 5.0)] {
        let (sin, cos) = yaw(node * travel_m).sin_cos();
        x += weight * cos;
        y += weight * sin;
    }
    let scale = sign * travel_m / 18.0;
    PlanarPose { x: from.x + scale * x, y: from.y + scale * y, yaw: yaw(travel_m) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    /// By the midpoint rule in a thousand steps for each of the profile's.
    fn drive(path: &PathProfile) -> PlanarPose {
        let mut pose = path.poses()[0];
        for pair in path.curvatures().windows(2) {
            for k in 0..1000 {
                let ds = path.gear().sign() * path.step_m() / 1000.0;
                let curvature = pair[0] + (pair[1] - pair[0]) * (f64::from(k) + 0.5) / 1000.0;
                let middle = pose.yaw + 0.5 * ds * curvature;
                pose = PlanarPose::new(
                    pose.x + ds * middle.cos(),
                    pose.y + ds * middle.sin(),
                    pose.yaw + ds * curvature,
                );
            }
        }
        pose
    }

    fn points(path: &PathProfile) -> Vec<Point2> {
        path.poses().iter().map(PlanarPose::point).collect()
    }

    #[test]
    fn an_arc_is_a_circle() {
        for (gear, x, yaw) in [(Gear::Forward, 2.0, PI / 2.0), (Gear::Reverse, -2.0, -PI / 2.0)] {
            let end = PlanarPose::new(x, 2.0, yaw);
            let path = PathProfile::arc(gear, PlanarPose::default(), 0.5, PI, end);
            assert!(drive(&path).distance_m(&end) < 1e-6);
            assert!((path.length_m() - PI).abs() < 1e-12);
            let (middle, curvature) = path.at(PI / 2.0);
            assert!(
                middle.distance_m(&PlanarPose::new(x / 2.0_f64.sqrt(), 2.0 - 2.0_f64.sqrt(), 0.0)) < 1e-9
            );
            assert_eq!(curvature, 0.5);
            assert_eq!(path.at(PI), (end, 0.5));
            assert_eq!(path.at(-1.0), (PlanarPose::default(), 0.5));
        }
    }

    #[test]
    fn steering_caps_by_hand() {
        let path =
            PathProfile::integrate(Gear::Forward, PlanarPose::default(), 0.1, vec![0.0, 0.0, 0.02, 0.04]);
        let caps = path.steering_caps(2.5, 0.25, 1.5);
        assert_eq!(caps[0], 1.5, "a straight line needs no steering");
        // 2.5 m * 0.2 / m² = 0.5 rad/m at most, so 0.5 m/s
        assert!((caps[1] - 0.5).abs() < 1e-12);
        assert!((caps[2] - 0.5 * (1.0 + 0.05_f64.powi(2))).abs() < 1e-12);
    }

    #[test]
    fn a_path_through_points_of_a_shifted_end_still_ends_there() {
        let path = PathProfile::integrate(Gear::Reverse, PlanarPose::new(3.0, 1.0, 0.4), 0.1, vec![0.1; 40]);
        let mut end = path.poses()[39];
        end.x += 0.02;
        end.yaw -= 0.01;
        let found =
            PathProfile::through(&points(&path), (path.poses()[0], None), end, Gear::Reverse, 0.2).unwrap();
        assert_eq!(*found.poses().last().unwrap(), end);
        assert!(drive(&found).distance_m(&end) < 1e-6);
        assert!(found.poses().iter().zip(path.poses()).all(|(a, b)| a.distance_m(b) < 0.03));
    }

    #[test]
    fn impossible_ends_are_refused() {
        let path =
            PathProfile::arc(Gear::Forward, PlanarPose::default(), 0.0, 2.0, PlanarPose::new(2.0, 0.0, 0.0));
        let sideways = PlanarPose::new(2.0, 1.5, 0.0);
        assert_eq!(
            PathProfile::through(&points(&path), (path.poses()[0], None), sideways, Gear::Forward, 0.2),
            None
        );
        assert_eq!(
            PathProfile::through(&points(&path)[..1], (path.poses()[0], None), sideways, Gear::Forward, 0.2),
            None
        );
    }

    proptest! {
        #[test]
        fn a_path_is_found_again_from_its_points(
            gear in prop::sample::select(vec![Gear::Forward, Gear::Reverse]),
            x in -20.0..20.0_f64, y in -20.0..20.0_f64, yaw in -7.0..7.0_f64,
            bends in prop::collection::vec(-0.28..0.28_f64, 3..8), step in 0.05..0.12_f64,
        ) {
            let between = |pair: &[f64]| {
                let (a, b) = (pair[0], pair[1]);
                (0..8).map(move |k| a + (b - a) * f64::from(k) / 8.0)
            };
            let curvatures: Vec<f64> = bends.windows(2).flat_map(between).collect();
            let path = PathProfile::integrate(gear, PlanarPose::new(x, y, yaw), step, curvatures);
            let end = *path.poses().last().unwrap();
            prop_assert!(drive(&path).distance_m(&end) < 1e-5 * path.length_m());
            let found = PathProfile::through(&points(&path), (path.poses()[0], None), end, gear, 0.3).unwrap();
            prop_assert_eq!(*found.poses().last().unwrap(), end);
            for (a, b) in found.poses().iter().zip(path.poses()) {
                prop_assert!(a.distance_m(b) < 2e-3 && (a.yaw - b.yaw).abs() < 4e-3, "{a:?} {b:?}");
            }
            prop_assert!(found.curvatures().iter().all(|k| k.abs() <= 0.3));
        }

        #[test]
        fn any_distance_lies_between_its_neighbours(
            curvatures in prop::collection::vec(-0.3..0.3_f64, 2..20), ratio in 0.0..1.0_f64,
        ) {
            let path = PathProfile::integrate(Gear::Forward, PlanarPose::default(), 0.1, curvatures);
            let position = ratio * path.length_m();
            let (pose, curvature) = path.at(position);
            let (k, n) = ((position / 0.1) as usize, path.poses().len() - 1);
            prop_assert!(pose.distance_m(&path.poses()[k.min(n)]) <= 0.1 + 1e-9);
            prop_assert!(pose.distance_m(&path.poses()[(k + 1).min(n)]) <= 0.1 + 1e-9);
            let pair = [path.curvatures()[k.min(n)], path.curvatures()[(k + 1).min(n)]];
            prop_assert!(curvature >= pair[0].min(pair[1]) - 1e-12 && curvature <= pair[0].max(pair[1]) + 1e-12);
        }
    }
}
