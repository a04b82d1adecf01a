//! Which piece of a plan the vehicle is to follow now.
//!
//! A plan is cut where the gear changes. The vehicle follows one part until it stands at its end, then the next, and
//! never goes back to one that it has left. Its place on the part is found by the overlap of vehicle outlines, and part
//! and plan are re-timed so that the place has time 0 and arc length 0: that is what the next cycle's stitching counts
//! from.

mod moves;
mod overlap;
mod parameters;

use std::ops::Range;

use motion::pose::normalize_radian;
use motion::{OrientedBox, Pose, VehicleInfo};
use moves::{Move, due_move, due_point};
pub use overlap::intersection_over_union;
pub use parameters::PartitionParameters;

use crate::pose::{Gear, PlanarPose};
use crate::stitcher::{DiscretizedPoint, DiscretizedTrajectory, PathPoint};
use crate::tolerance::{NEAR_EQUAL_OVERLAP, SAME_PLACE_M, STEP_DIRECTION_M};
use crate::vehicle_model::VehicleState;

/// Parts that are remembered as left behind; more than any sensible manoeuvre has.
const REMEMBERED_PARTS: usize = 64;

/// A stretch of a plan in one gear.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its points: arc length from 0 at its first point, falling in reverse. The last one is where the vehicle comes to
    /// rest; it keeps the curvature of the motion that led to it.
    pub trajectory: DiscretizedTrajectory,
    /// Its gear.
    pub gear: Gear,
    /// Index of its first point in the plan. Neighbouring parts share a point.
    pub first: usize,
}

/// Names a part across cycles: re-timing and stitching leave its end in place, bit for bit.
type PartKey = ([u64; 3], Gear);

impl Part {
    /// Indices of the points that may be driven from a time on, s, on the part's times: up to the next stop; while the
    /// vehicle stands on its way to turn its wheels, the points of that stand.
    #[must_use]
    pub fn until_stop(&self, time_s: f64) -> Range<usize> {
        let points = &self.trajectory.points;
        let Move { stop, .. } = due_move(points, time_s);
        let from = points.partition_point(|point| point.relative_time_s < time_s);
        let end = if from < stop.first { stop.first } else { stop.last };
        from.min(end)..end + 1
    }

    fn key(&self) -> PartKey {
        let end = self.trajectory.points.last().and_then(|p| p.path_point).unwrap_or_default().pose;
        ([end.x.to_bits(), end.y.to_bits(), end.yaw.to_bits()], self.gear)
    }
}

/// Why there is nothing to follow.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PartitionError {
    /// A plan has at least two points, each with a pose.
    #[error("the plan has {points} points with a pose; two are the least that can be driven")]
    TooShort {
        /// Points with a pose.
        points: usize,
    },
    /// The vehicle is too far from every part that is left.
    #[error(
        "Fail to find nearest trajectory point to follow: the vehicle is farther than {range_m} m from what is left of the plan"
    )]
    NothingNear {
        /// How far was looked, m.
        range_m: f64,
    },
}

/// What to follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// The part, re-timed.
    pub part: Part,
    /// Index of the vehicle's place in the part.
    pub place: usize,
    /// Index of the part in the plan.
    pub part_index: usize,
    /// Parts of the plan.
    pub parts: usize,
    /// The whole plan, re-timed, arc length from the place and growing in both gears.
    pub stitched: DiscretizedTrajectory,
}

/// Keeps track of where the vehicle is on its plan.
#[derive(Clone, Debug)]
pub struct Partitioner {
    parameters: PartitionParameters,
    vehicle: VehicleInfo,
    /// Parts that were followed since planning began; the last one is now.
    followed: Vec<PartKey>,
}

/// The vehicle, as matching sees it.
struct Ego {
    pose: PlanarPose,
    outline: OrientedBox,
    moving_rad: f64,
    speed_mps: f64,
}

impl Partitioner {
    /// One that has not followed anything.
    #[must_use]
    pub fn new(parameters: PartitionParameters, vehicle: VehicleInfo) -> Self {
        Self { parameters, vehicle, followed: Vec::new() }
    }

    /// Planning begins anew: the next plan is followed from its first part.
    pub fn restart(&mut self) {
        self.followed.clear();
    }

    /// The part to follow and the vehicle's place on it. `due_s` is the time, on the plan's own times, that it is now.
    ///
    /// # Errors
    /// The plan has no motion, or the vehicle is nowhere near it.
    pub fn follow(
        &mut self,
        plan: &DiscretizedTrajectory,
        due_s: f64,
        vehicle: &VehicleState,
    ) -> Result<Followed, PartitionError> {
        let parts = gear_parts(plan)?;
        let ego = self.ego(vehicle);
        let (part_index, place) = if self.followed.is_empty() {
            // As early as fits: a first plan is driven from its beginning.
            let place = self.place_on(&parts[0], &ego, f64::NEG_INFINITY, false);
            (0, place.ok_or_else(|| self.nothing_near())?)
        } else {
            self.locate(&parts, due_s, &ego)?
        };
        self.remember(parts[part_index].key());
        Ok(retimed(plan, &parts, part_index, place))
    }

    fn remember(&mut self, key: PartKey) {
        if self.followed.last() != Some(&key) {
            if self.followed.len() == REMEMBERED_PARTS {
                self.followed.remove(0);
            }
            self.followed.push(key);
        }
    }

    fn locate(&self, parts: &[Part], due_s: f64, ego: &Ego) -> Result<(usize, usize), PartitionError> {
        // Another plan may come to the same end by other parts, which are driven first.
        let current = parts
            .iter()
            .position(|part| self.followed.last() == Some(&part.key()))
            .filter(|&current| parts[..current].iter().all(|part| self.followed.contains(&part.key())));
        if let Some(current) = current
            && self.is_over(&parts[current], due_s, ego)
        {
            let last = parts[current].trajectory.points.len() - 1;
            return Ok(if current + 1 < parts.len() { (current + 1, 0) } else { (current, last) });
        }
        let left_behind = self.followed.split_last().map_or(&[][..], |(_, before)| before);
        // The current part first, even if the vehicle seems to be heading elsewhere: a later part may pass the same
        // place, and a gear that is not engaged yet says nothing.
        let others = (current.map_or(0, |current| current + 1)..parts.len())
            .filter(|&index| !left_behind.contains(&parts[index].key()));
        for index in current.into_iter().chain(others) {
            let place = |careful| self.place_on(&parts[index], ego, due_s, careful);
            if let Some(place) = place(true).or_else(|| place(false)) {
                return Ok((index, place));
            }
        }
        Err(self.nothing_near())
    }

    fn nothing_near(&self) -> PartitionError {
        PartitionError::NothingNear { range_m: self.parameters.distance_search_range }
    }

    /// Whether the vehicle (nearly) stands at the end of a part and the part's time has passed.
    fn is_over(&self, part: &Part, due_s: f64, ego: &Ego) -> bool {
        let points = &part.trajectory.points;
        due_point(points, due_s) + 1 == points.len() && self.has_reached(points.last(), ego)
    }

    /// The point of the due move whose vehicle outline overlaps the vehicle's most; of nearly equal ones the one that is
    /// due. Careful: among those that lie ahead and are driven the way the vehicle is heading. Otherwise any near one.
    ///
    /// Within reach of the stop that ends the move time alone decides: the vehicle need not come any closer, and a move
    /// may be shorter than that reach. So it does where the vehicle stands beyond.
    fn place_on(&self, part: &Part, ego: &Ego, due_s: f64, careful: bool) -> Option<usize> {
        let points = &part.trajectory.points;
        let Move { from, stop } = due_move(points, due_s);
        if self.has_reached(points.get(stop.first), ego) {
            return Some(due_point(points, due_s).clamp(from, stop.last));
        }
        let overlap = |(index, point): (usize, &DiscretizedPoint)| {
            let pose = point.path_point?.pose;
            self.is_candidate(&pose, part.gear, ego, careful).then(|| {
                let outline = outline(&self.vehicle, &pose);
                (index, intersection_over_union(&outline, &ego.outline), point.relative_time_s)
            })
        };
        let overlaps: Vec<(usize, f64, f64)> =
            points.iter().enumerate().take(stop.first + 1).skip(from).filter_map(overlap).collect();
        let best = overlaps.iter().map(|&(_, ratio, _)| ratio).fold(f64::NEG_INFINITY, f64::max);
        let &(place, ..) = overlaps
            .iter()
            .filter(|&&(_, ratio, _)| ratio >= best - NEAR_EQUAL_OVERLAP)
            .min_by(|a, b| (a.2 - due_s).abs().total_cmp(&(b.2 - due_s).abs()))?;
        // One that has rolled past a stop and stands will not come any closer to it.
        let stands = ego.speed_mps.abs() < self.parameters.linear_velocity_threshold_on_ego;
        if place == stop.first && stands {
            return Some(due_point(points, due_s).clamp(stop.first, stop.last));
        }
        Some(place)
    }

    fn is_candidate(&self, pose: &PlanarPose, gear: Gear, ego: &Ego, careful: bool) -> bool {
        let p = &self.parameters;
        let distance_m = ego.pose.distance_m(pose);
        if distance_m >= p.distance_search_range || !careful {
            return distance_m < p.distance_search_range;
        }
        let turn = normalize_radian(moving_direction(pose, gear) - ego.moving_rad).abs();
        let towards = (pose.y - ego.pose.y).atan2(pose.x - ego.pose.x);
        let aside = normalize_radian(towards - ego.moving_rad).abs();
        turn < p.heading_search_range && (distance_m < SAME_PLACE_M || aside < p.heading_track_range)
    }

    /// Whether the vehicle (nearly) stands where the motion to a point ends.
    fn has_reached(&self, stop: Option<&DiscretizedPoint>, ego: &Ego) -> bool {
        let Some(end) = stop.and_then(|point| point.path_point) else {
            return false;
        };
        let p = &self.parameters;
        let (sin, cos) = end.pose.yaw.sin_cos();
        let (dx, dy) = (ego.pose.x - end.pose.x, ego.pose.y - end.pose.y);
        (dy * cos - dx * sin).abs() < p.lateral_offset_to_midpoint
            && (dx * cos + dy * sin).abs() < p.longitudinal_offset_to_midpoint
            && end.pose.yaw_to(&ego.pose).abs() < p.heading_offset_to_midpoint
            && ego.speed_mps.abs() < p.linear_velocity_threshold_on_ego
            && intersection_over_union(&outline(&self.vehicle, &end.pose), &ego.outline)
                > p.vehicle_box_iou_threshold_to_midpoint
    }

    fn ego(&self, vehicle: &VehicleState) -> Ego {
        Ego {
            pose: vehicle.pose,
            outline: outline(&self.vehicle, &vehicle.pose),
            moving_rad: moving_direction(&vehicle.pose, vehicle.gear),
            speed_mps: vehicle.speed_mps,
        }
    }
}

fn moving_direction(pose: &PlanarPose, gear: Gear) -> f64 {
    match gear {
        Gear::Forward => pose.yaw,
        Gear::Reverse => pose.yaw + std::f64::consts::PI,
    }
}

/// The vehicle's outline at a pose of its rear axle.
pub(crate) fn outline(vehicle: &VehicleInfo, pose: &PlanarPose) -> OrientedBox {
    OrientedBox::around(
        &Pose::from_xy_yaw(pose.x, pose.y, pose.yaw),
        vehicle.max_longitudinal_offset_m(),
        -vehicle.min_longitudinal_offset_m(),
        vehicle.max_lateral_offset_m(),
        -vehicle.min_lateral_offset_m(),
    )
}

/// Cuts a plan where its gear changes. The point of the change ends one part and begins the next.
///
/// The gear of a step is the side of the vehicle that it leads to; where a step is too short to have a direction it is
/// the sign of the speed, and where nothing moves that of the next step that does: at a change of gear the vehicle
/// stands to turn its wheels for the way to come.
///
/// # Errors
/// There are fewer than two points, or one without a pose.
pub fn gear_parts(plan: &DiscretizedTrajectory) -> Result<Vec<Part>, PartitionError> {
    let path: Vec<PathPoint> = plan.points.iter().map_while(|point| point.path_point).collect();
    if path.len() < 2 || path.len() < plan.points.len() {
        return Err(PartitionError::TooShort { points: path.len() });
    }
    let gears = step_gears(&plan.points, &path);
    let mut parts = Vec::new();
    let mut first = 0;
    for step in 1..=gears.len() {
        if step == gears.len() || gears[step] != gears[first] {
            parts.push(gear_part(&plan.points[first..=step], gears[first], first, step == gears.len()));
            first = step;
        }
    }
    Ok(parts)
}

fn step_gears(points: &[DiscretizedPoint], path: &[PathPoint]) -> Vec<Gear> {
    let gear = |step: usize| {
        let (from, to) = (path[step].pose, path[step + 1].pose);
        let ahead = if from.distance_m(&to) >= STEP_DIRECTION_M {
            (to.x - from.x) * from.yaw.cos() + (to.y - from.y) * from.yaw.sin()
        } else {
            points[step].speed_mps + points[step + 1].speed_mps
        };
        if ahead > 0.0 {
            Some(Gear::Forward)
        } else if ahead < 0.0 {
            Some(Gear::Reverse)
        } else {
            None
        }
    };
    let steps = points.len() - 1;
    let mut later = (0..steps).rev().find_map(gear).unwrap_or(Gear::Forward);
    let mut gears = vec![later; steps];
    for step in (0..steps).rev() {
        later = gear(step).unwrap_or(later);
        gears[step] = later;
    }
    gears
}

fn gear_part(points: &[DiscretizedPoint], gear: Gear, first: usize, is_last: bool) -> Part {
    let (mut s_m, mut before) = (0.0, None::<PlanarPose>);
    let restarted = |point: &DiscretizedPoint| {
        let path_point = point.path_point.unwrap_or_default();
        s_m += gear.sign() * before.map_or(0.0, |pose| pose.distance_m(&path_point.pose));
        before = Some(path_point.pose);
        DiscretizedPoint { path_point: Some(PathPoint { s_m, ..path_point }), ..*point }
    };
    let mut points: Vec<DiscretizedPoint> = points.iter().map(restarted).collect();
    if !is_last && let [.., before, end] = &mut points[..] {
        // Curvature, steering and acceleration at the change belong to the motion that leaves it.
        end.steer_rad = before.steer_rad;
        end.acceleration_mps2 = 0.0;
        if let (Some(end), Some(before)) = (&mut end.path_point, &before.path_point) {
            end.curvature = before.curvature;
        }
    }
    Part { trajectory: DiscretizedTrajectory { points }, gear, first }
}

fn retimed(plan: &DiscretizedTrajectory, parts: &[Part], part_index: usize, place: usize) -> Followed {
    let mut part = parts[part_index].clone();
    let mut stitched = plan.clone();
    rebase(&mut part.trajectory, place);
    rebase(&mut stitched, part.first + place);
    Followed { part, place, part_index, parts: parts.len(), stitched }
}

/// Counts times and arc lengths from the point at `origin`.
fn rebase(trajectory: &mut DiscretizedTrajectory, origin: usize) {
    let point = trajectory.points[origin];
    let s_m = point.path_point.unwrap_or_default().s_m;
    for shifted in &mut trajectory.points {
        shifted.relative_time_s -= point.relative_time_s;
        if let Some(path_point) = &mut shifted.path_point {
            path_point.s_m -= s_m;
        }
    }
}

#[cfg(test)]
mod tests;
