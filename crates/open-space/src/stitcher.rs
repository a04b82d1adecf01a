//! Where a new plan starts: at the end of a piece of the previous trajectory, or where the vehicle is.
//!
//! The piece is cut so that the planner's result continues what the vehicle is about to drive anyway. Whatever speaks
//! against the previous trajectory is named by a [`ReplanReason`], and the plan starts from the vehicle instead. The
//! order of the tests is part of the contract.

mod discretized;

use std::fmt;

pub use discretized::{
    DiscretizedPoint, DiscretizedTrajectory, NotLater, PathPoint, PublishedTrajectory, interpolated_angle,
};
use motion::Point2;
use motion::pose::normalize_radian;

use crate::pose::PlanarPose;
use crate::tolerance::MATCH_BUFFER_M2;
use crate::vehicle_model::{VehicleState, predict};

/// Below this speed (m/s) ...
const STANDING_SPEED_MPS: f64 = 0.1;

/// ... and this acceleration (m/s²) a plan starts from the vehicle's state as it is.
const STANDING_ACCELERATION_MPS2: f64 = 0.4;

/// What the stitcher is asked.
#[derive(Clone, Copy, Debug)]
pub struct StitchRequest<'a> {
    /// The vehicle.
    pub vehicle: &'a VehicleState,
    /// Now, s, on the clock of the previous trajectory's header.
    pub now_s: f64,
    /// How far ahead of now the plan shall start, s.
    pub period_s: f64,
    /// Time ahead of now to which the vehicle is predicted where the previous trajectory cannot be used, s.
    pub reinit_cycle_s: f64,
    /// Points kept before the vehicle. 0 keeps none.
    pub preserved_points: usize,
    /// Whether a vehicle that is too far off the previous trajectory makes it unusable.
    pub replan_by_offset: bool,
    /// Whether previous trajectories are used at all.
    pub enabled: bool,
    /// Limits of `replan_by_offset`.
    pub offset_limits: OffsetLimits,
    /// The previous trajectory.
    pub previous: Option<&'a PublishedTrajectory>,
}

/// How far the vehicle may be off the previous trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffsetLimits {
    /// Across the path, m.
    pub lateral_m: f64,
    /// Along the path between where it is and where it should be by now, m.
    pub longitudinal_m: f64,
}

impl Default for OffsetLimits {
    fn default() -> Self {
        Self { lateral_m: 0.5, longitudinal_m: 2.5 }
    }
}

/// Why a plan starts from the vehicle's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReplanReason {
    /// Stitching is switched off.
    Disabled,
    /// There is no previous trajectory.
    NoPrevious,
    /// A person drives.
    ManualMode,
    /// The previous trajectory has no points.
    EmptyPrevious,
    /// The previous trajectory has not begun.
    BeforePrevious,
    /// The previous trajectory has ended.
    BeyondPrevious,
    /// A point that is needed does not say where it is.
    MissingPathPoint,
    /// The vehicle is beside the path by this much, m, positive to the right.
    LateralOffset(f64),
    /// The vehicle is behind (positive) or ahead of its place on the path by this much, m.
    LongitudinalOffset(f64),
}

impl fmt::Display for ReplanReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let offset =
            "the distance between matched point and actual position is too large. Replan is triggered.";
        match self {
            Self::Disabled => f.write_str("stitch is disabled by gflag."),
            Self::NoPrevious => f.write_str("replan for no previous trajectory."),
            Self::ManualMode => f.write_str("replan for manual mode."),
            Self::EmptyPrevious => f.write_str("replan for empty previous trajectory."),
            Self::BeforePrevious => {
                f.write_str("replan for current time smaller than the previous trajectory's first time.")
            }
            Self::BeyondPrevious => {
                f.write_str("replan for current time beyond the previous trajectory's last time")
            }
            Self::MissingPathPoint => f.write_str("replan for previous trajectory missed path point"),
            Self::LateralOffset(lateral_m) => {
                write!(f, "{offset} lat_diff = {}", six_digits(*lateral_m))
            }
            Self::LongitudinalOffset(longitudinal_m) => {
                write!(f, "{offset} lon_diff = {}", six_digits(*longitudinal_m))
            }
        }
    }
}

/// Rounded to the six significant digits that logs carry.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Where a plan starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Stitching {
    /// At least one point; the last is the start of the plan, with s = 0. Times count from now.
    pub trajectory: DiscretizedTrajectory,
    /// Why the previous trajectory was not used, if it was not.
    pub replan: Option<ReplanReason>,
}

/// The start of a plan that does not continue a trajectory: one point at the vehicle, stamped `cycle_s` ahead, its
/// motion predicted that far unless the vehicle (nearly) stands.
#[must_use]
pub fn compute_reinit_stitching_trajectory(cycle_s: f64, vehicle: &VehicleState) -> DiscretizedTrajectory {
    let stands = vehicle.speed_mps.abs() < STANDING_SPEED_MPS
        && vehicle.acceleration_mps2.abs() < STANDING_ACCELERATION_MPS2;
    let start = if stands { *vehicle } else { predict(cycle_s, vehicle) };
    DiscretizedTrajectory { points: vec![reinit_point(cycle_s, &start)] }
}

fn reinit_point(cycle_s: f64, state: &VehicleState) -> DiscretizedPoint {
    DiscretizedPoint {
        path_point: Some(PathPoint {
            pose: state.pose,
            z: state.z,
            curvature: state.curvature,
            ..PathPoint::default()
        }),
        speed_mps: state.speed_mps,
        acceleration_mps2: state.acceleration_mps2,
        relative_time_s: cycle_s,
        ..DiscretizedPoint::default()
    }
}

/// The piece of the previous trajectory that a new plan continues, or the vehicle's state where there is none.
#[must_use]
pub fn compute_stitching_trajectory(request: &StitchRequest<'_>) -> Stitching {
    match continued(request) {
        Ok(trajectory) => Stitching { trajectory, replan: None },
        Err(reason) => Stitching {
            trajectory: compute_reinit_stitching_trajectory(request.reinit_cycle_s, request.vehicle),
            replan: Some(reason),
        },
    }
}

fn continued(request: &StitchRequest<'_>) -> Result<DiscretizedTrajectory, ReplanReason> {
    if !request.enabled {
        return Err(ReplanReason::Disabled);
    }
    let previous = request.previous.ok_or(ReplanReason::NoPrevious)?;
    if !request.vehicle.automatic {
        return Err(ReplanReason::ManualMode);
    }
    let (points, elapsed_s) = (&previous.trajectory.points, request.now_s - previous.header_time_s);
    let by_time = previous.trajectory.lower_bound(elapsed_s).ok_or(ReplanReason::EmptyPrevious)?;
    if by_time == 0 && elapsed_s < points[0].relative_time_s {
        return Err(ReplanReason::BeforePrevious);
    }
    if by_time + 1 >= points.len() {
        return Err(ReplanReason::BeyondPrevious);
    }
    let due = points[by_time].path_point.ok_or(ReplanReason::MissingPathPoint)?;
    let place = request.vehicle.pose.point();
    let by_place = previous
        .trajectory
        .nearest_with_buffer(place, MATCH_BUFFER_M2)
        .ok_or(ReplanReason::MissingPathPoint)?;
    if request.replan_by_offset
        && let Some(matched) = points[by_place].path_point
    {
        offsets_within(&request.offset_limits, position_projection(place, &matched), due.s_m)?;
    }
    let matched = by_time.min(by_place);
    let start = matched.saturating_sub(request.preserved_points);
    let end = previous.trajectory.lower_bound(elapsed_s + request.period_s).unwrap_or(matched).max(start);
    cut(&points[start..=end], elapsed_s)
}

fn offsets_within(limits: &OffsetLimits, actual: Projection, due_s_m: f64) -> Result<(), ReplanReason> {
    let longitudinal_m = due_s_m - actual.s_m;
    let beyond = |offset_m: f64, limit_m: f64| offset_m.is_nan() || offset_m.abs() > limit_m;
    if beyond(actual.right_m, limits.lateral_m) {
        return Err(ReplanReason::LateralOffset(actual.right_m));
    }
    if beyond(longitudinal_m, limits.longitudinal_m) {
        return Err(ReplanReason::LongitudinalOffset(longitudinal_m));
    }
    Ok(())
}

/// The points with times from now and arc lengths that end at 0.
fn cut(points: &[DiscretizedPoint], elapsed_s: f64) -> Result<DiscretizedTrajectory, ReplanReason> {
    let start = points.last().and_then(|point| point.path_point).ok_or(ReplanReason::MissingPathPoint)?;
    let rebased = |point: &DiscretizedPoint| {
        let path_point = point.path_point.ok_or(ReplanReason::MissingPathPoint)?;
        Ok(DiscretizedPoint {
            path_point: Some(PathPoint { s_m: path_point.s_m - start.s_m, ..path_point }),
            relative_time_s: point.relative_time_s - elapsed_s,
            ..*point
        })
    };
    Ok(DiscretizedTrajectory { points: points.iter().map(rebased).collect::<Result<_, _>>()? })
}

/// Where a place lies beside a path point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Arc length of the foot on the path point's heading line, m.
    pub s_m: f64,
    /// Distance from that line, positive to the right, m.
    pub right_m: f64,
}

/// Projects a place onto the heading line of a path point.
#[must_use]
pub fn position_projection(place: Point2, path_point: &PathPoint) -> Projection {
    let offset = place - path_point.pose.point();
    let (sin, cos) = path_point.pose.yaw.sin_cos();
    Projection {
        s_m: offset.x * cos + offset.y * sin + path_point.s_m,
        right_m: offset.x * sin - offset.y * cos,
    }
}

/// Moves a previous trajectory into the frame of a vehicle that has itself moved by (`x_diff_m`, `y_diff_m`) and turned
/// by `theta_diff_rad` since: the inverse of that motion. For frames that travel with the vehicle.
pub fn transform_last_published_trajectory(
    x_diff_m: f64,
    y_diff_m: f64,
    theta_diff_rad: f64,
    previous: &mut PublishedTrajectory,
) {
    let (cos, k) = (theta_diff_rad.cos(), -theta_diff_rad.sin());
    let shift_x = -(cos * x_diff_m - k * y_diff_m);
    let shift_y = -(k * x_diff_m + cos * y_diff_m);
    for path_point in previous.trajectory.points.iter_mut().filter_map(|point| point.path_point.as_mut()) {
        let PlanarPose { x, y, yaw } = path_point.pose;
        path_point.pose = PlanarPose::new(
            cos * x - k * y + shift_x,
            k * x + cos * y + shift_y,
            normalize_radian(yaw - theta_diff_rad),
        );
    }
}

#[cfg(test)]
mod tests;
