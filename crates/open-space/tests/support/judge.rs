//! An independent look at trajectories: shares no code with the planner's own checks.

use motion::{Point2, VehicleInfo};
use open_space::{Problem, Trajectory, TrajectoryPoint};

/// Travel between poses at which the footprint is held against the obstacles, m.
const STEP_M: f64 = 0.02;
/// Part by which rounding may exceed a limit.
const ROOM: f64 = 1.0 + 1e-3;
/// Points closer in time than this have no jerk worth the name, s.
const SHORTEST_S: f64 = 1e-3;

/// Everything that is wrong with a trajectory, in words; empty where it may be driven.
pub(crate) fn faults(trajectory: &Trajectory, problem: &Problem) -> Vec<String> {
    let points = &trajectory.points;
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return vec!["no points".into()] };
    let mut faults = Vec::new();
    let mut expect = |good: bool, what: &dyn Fn() -> String| {
        if !good {
            faults.push(what());
        }
    };
    let apart = |a: &TrajectoryPoint, b: &open_space::PlanarPose| {
        let turn = (a.pose.yaw - b.yaw).rem_euclid(std::f64::consts::TAU);
        ((a.pose.x - b.x).hypot(a.pose.y - b.y), turn.min(std::f64::consts::TAU - turn))
    };
    let (start_m, start_rad) = apart(first, &problem.start);
    expect(start_m < 1e-3 && start_rad < 1e-3, &|| format!("starts {start_m} m, {start_rad} rad off"));
    let (end_m, end_rad) = apart(last, &problem.goal);
    expect(end_m <= 0.05 && end_rad <= 1_f64.to_radians(), &|| format!("ends {end_m} m, {end_rad} rad off"));
    expect(last.speed_mps == 0.0 && last.acceleration_mps2 == 0.0, &|| "does not end at rest".into());
    let limits = &problem.limits;
    let sharpest = problem.vehicle.max_curvature();
    for (k, point) in points.iter().enumerate() {
        let speed = point.speed_mps;
        expect(
            (-limits.max_speed_reverse_mps * ROOM..=limits.max_speed_forward_mps * ROOM).contains(&speed),
            &|| format!("{speed} m/s at {k}"),
        );
        expect(point.acceleration_mps2.abs() <= limits.max_acceleration_mps2 * ROOM, &|| {
            format!("{} m/s² at {k}", point.acceleration_mps2)
        });
        expect(point.curvature.abs() <= sharpest * ROOM, &|| format!("{} 1/m at {k}", point.curvature));
    }
    for (k, pair) in points.windows(2).enumerate() {
        let (a, b) = (&pair[0], &pair[1]);
        let dt = b.time_s - a.time_s;
        expect(dt > 0.0 && dt <= 0.1 + 1e-9, &|| format!("{dt} s after {k}"));
        let rate = (b.steer_rad - a.steer_rad) / dt;
        expect(dt < SHORTEST_S || rate.abs() <= limits.max_steer_rate_rps * ROOM, &|| {
            format!("{rate} rad/s after {k}")
        });
        let jerk = (b.acceleration_mps2 - a.acceleration_mps2) / dt;
        expect(dt < SHORTEST_S || jerk.abs() <= limits.max_jerk_mps3 * 1.01, &|| {
            format!("{jerk} m/s³ after {k}")
        });
        let travel = (b.pose.x - a.pose.x).hypot(b.pose.y - a.pose.y);
        let mean = 0.5 * (a.speed_mps + b.speed_mps).abs() * dt;
        expect((travel - mean).abs() < 3e-3, &|| format!("{travel} m instead of {mean} after {k}"));
    }
    faults.extend(collision(points, problem));
    faults
}

/// The first pose at which the vehicle touches something, every 2 cm of travel.
fn collision(points: &[TrajectoryPoint], problem: &Problem) -> Option<String> {
    let corners = Corners::of(&problem.vehicle);
    points.windows(2).find_map(|pair| {
        let (a, b) = (&pair[0].pose, &pair[1].pose);
        let parts = ((b.x - a.x).hypot(b.y - a.y) / STEP_M).ceil().max(1.0);
        // Headings are continuous along a trajectory.
        (0..=parts as usize).map(|k| k as f64 / parts).find_map(|t| {
            let between = |a: f64, b: f64| a + (b - a) * t;
            let (x, y, yaw) = (between(a.x, b.x), between(a.y, b.y), between(a.yaw, b.yaw));
            let hit = problem.obstacles.iter().position(|line| corners.touch(line, x, y, yaw))?;
            Some(format!("touches obstacle {hit} at ({x:.3}, {y:.3}, {yaw:.3})"))
        })
    })
}

/// The vehicle's outline about its reference point.
struct Corners {
    front: f64,
    rear: f64,
    left: f64,
    right: f64,
}

impl Corners {
    fn of(vehicle: &VehicleInfo) -> Self {
        let d = vehicle.dimensions();
        Self {
            front: d.wheel_base_m + d.front_overhang_m,
            rear: -d.rear_overhang_m,
            left: 0.5 * d.wheel_tread_m + d.left_overhang_m,
            right: -0.5 * d.wheel_tread_m - d.right_overhang_m,
        }
    }

    fn touch(&self, line: &[Point2], x: f64, y: f64, yaw: f64) -> bool {
        let (sin, cos) = yaw.sin_cos();
        let local: Vec<(f64, f64)> = line
            .iter()
            .map(|p| (cos * (p.x - x) + sin * (p.y - y), cos * (p.y - y) - sin * (p.x - x)))
            .collect();
        let closed = line.len() > 3 && line.first() == line.last();
        local.windows(2).any(|pair| self.cuts(pair[0], pair[1]))
            || (local.len() == 1 && self.cuts(local[0], local[0]))
            || (closed && is_inside(&local))
    }

    /// Whether a segment reaches into the outline (Liang and Barsky).
    fn cuts(&self, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> bool {
        let (dx, dy) = (x1 - x0, y1 - y0);
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (p, q) in
            [(-dx, x0 - self.rear), (dx, self.front - x0), (-dy, y0 - self.right), (dy, self.left - y0)]
        {
            if p == 0.0 {
                if q < 0.0 {
                    return false;
                }
            } else if p < 0.0 {
                enter = enter.max(q / p);
            } else {
                leave = leave.min(q / p);
            }
        }
        enter <= leave
    }
}

/// Whether the reference point, here the origin, lies in the polygon: then all of the vehicle does, or it cuts its edge.
fn is_inside(polygon: &[(f64, f64)]) -> bool {
    let crossings = polygon.windows(2).filter(|pair| {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        (y0 > 0.0) != (y1 > 0.0) && x0 - y0 * (x1 - x0) / (y1 - y0) > 0.0
    });
    crossings.count() % 2 == 1
}
