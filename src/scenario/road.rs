//! The shape of the generated road, and lines to drive along on it.
//!
//! The road is a reference line with a sine as its curvature, so that heading and curvature are known exactly and
//! paths on it are smooth at any resolution. `s` is the length along the reference line, which is the middle line
//! of the road; offsets are positive to the left of the direction of growing `s`.

use messages::geometry_msgs::{Point, Pose, Quaternion};
use std::f64::consts::{PI, TAU};

/// Where the reference line begins; far from the origin, so that nothing works there by accident.
const START_M: [f64; 2] = [1000.0, 2000.0];
/// Height of the road.
pub(crate) const ELEVATION_M: f64 = 12.0;
/// Heading at s = 0.
const START_HEADING_RAD: f64 = 0.35;
/// Largest curvature: a radius of 160 m.
const MAX_CURVATURE: f64 = 1.0 / 160.0;
/// Length of one left and one right bend.
const WAVE_LENGTH_M: f64 = 300.0;
/// The reference line bends between these; before and behind it goes on straight, for predictions that leave the map.
const BENDS_M: [f64; 2] = [-150.0, 600.0];
/// Distance of the nodes from which positions are integrated.
const NODE_DISTANCE_M: f64 = 1.0;
/// Step of the numerical derivative of the heading.
const DERIVATIVE_STEP_M: f64 = 0.01;

/// A smooth change of the lateral offset.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shift {
    /// Where it begins.
    pub(crate) from_s_m: f64,
    /// How long it takes along the road.
    pub(crate) length_m: f64,
    /// By how much; positive to the left.
    pub(crate) by_m: f64,
}

/// A line along the road.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Track {
    /// Offset from the reference line, positive to the left of growing `s`.
    pub(crate) offset_m: f64,
    /// Change of the offset, for tracks in the direction of growing `s`.
    pub(crate) shift: Option<Shift>,
    /// Whether it is driven towards smaller `s`.
    pub(crate) oncoming: bool,
}

impl Track {
    /// A line at a constant offset, driven towards growing `s`.
    pub(crate) fn forward(offset_m: f64) -> Self {
        Self { offset_m, shift: None, oncoming: false }
    }

    /// A line at a constant offset, driven towards smaller `s`.
    pub(crate) fn oncoming(offset_m: f64) -> Self {
        Self { offset_m, shift: None, oncoming: true }
    }

    /// +1 towards growing `s`, -1 against it.
    pub(crate) fn direction(&self) -> f64 {
        if self.oncoming { -1.0 } else { 1.0 }
    }

    /// Offset and its derivative by `s`.
    fn offset(&self, s_m: f64) -> (f64, f64) {
        let Some(shift) = self.shift else { return (self.offset_m, 0.0) };
        let u = ((s_m - shift.from_s_m) / shift.length_m).clamp(0.0, 1.0);
        // The quintic with zero slope and curvature at both ends: the start fits the lane it leaves.
        let share = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        let slope = 30.0 * u * u * (1.0 - u) * (1.0 - u) / shift.length_m;
        (self.offset_m + shift.by_m * share, shift.by_m * slope)
    }
}

/// The shape of the road.
#[derive(Debug)]
pub(crate) struct Road {
    nodes: Vec<[f64; 2]>,
}

impl Road {
    /// Integrates the reference line.
    pub(crate) fn new() -> Self {
        let count = ((BENDS_M[1] - BENDS_M[0]) / NODE_DISTANCE_M) as usize;
        let mut position = [0.0; 2];
        let mut nodes = vec![position];
        for index in 0..count {
            let s_m = BENDS_M[0] + index as f64 * NODE_DISTANCE_M;
            position = integrate(position, s_m, NODE_DISTANCE_M);
            nodes.push(position);
        }
        let origin = nodes[(-BENDS_M[0] / NODE_DISTANCE_M) as usize];
        for node in &mut nodes {
            *node = [node[0] - origin[0] + START_M[0], node[1] - origin[1] + START_M[1]];
        }
        Self { nodes }
    }

    /// Position on the reference line.
    fn reference(&self, s_m: f64) -> [f64; 2] {
        let index = ((s_m - BENDS_M[0]) / NODE_DISTANCE_M).floor().clamp(0.0, (self.nodes.len() - 1) as f64);
        let node_s_m = BENDS_M[0] + index * NODE_DISTANCE_M;
        integrate(self.nodes[index as usize], node_s_m, s_m - node_s_m)
    }

    /// Position at an offset from the reference line.
    pub(crate) fn position(&self, s_m: f64, offset_m: f64) -> [f64; 2] {
        let [x, y] = self.reference(s_m);
        let (sin, cos) = heading(s_m).sin_cos();
        [x - offset_m * sin, y + offset_m * cos]
    }

    /// Pose on a track, on the ground and in the direction of travel.
    pub(crate) fn pose(&self, track: &Track, s_m: f64) -> Pose {
        let [x, y] = self.position(s_m, track.offset(s_m).0);
        pose_at([x, y], track_heading(track, s_m))
    }

    /// Length of the track per length of the reference line.
    fn stretch(track: &Track, s_m: f64) -> f64 {
        let (offset_m, slope) = track.offset(s_m);
        let along = 1.0 - offset_m * curvature(s_m);
        (along * along + slope * slope).sqrt()
    }

    /// Where one arrives after a distance on the track.
    pub(crate) fn advance(track: &Track, s_m: f64, distance_m: f64) -> f64 {
        let half_way_m = s_m + 0.5 * track.direction() * distance_m / Self::stretch(track, s_m);
        s_m + track.direction() * distance_m / Self::stretch(track, half_way_m)
    }

    /// Curvature of the track in the direction of travel, 1/m, positive to the left.
    pub(crate) fn track_curvature(track: &Track, s_m: f64) -> f64 {
        let [before, after] = [-1.0, 1.0].map(|side| track_heading(track, s_m + side * DERIVATIVE_STEP_M));
        track.direction() * (after - before) / (2.0 * DERIVATIVE_STEP_M * Self::stretch(track, s_m))
    }
}

/// Pose on the ground.
pub(crate) fn pose_at([x, y]: [f64; 2], yaw_rad: f64) -> Pose {
    Pose { position: Point { x, y, z: ELEVATION_M }, orientation: Quaternion::from_yaw(yaw_rad) }
}

fn track_heading(track: &Track, s_m: f64) -> f64 {
    let (offset_m, slope) = track.offset(s_m);
    let forward = heading(s_m) + slope.atan2(1.0 - offset_m * curvature(s_m));
    if track.oncoming { forward + PI } else { forward }
}

fn curvature(s_m: f64) -> f64 {
    let bends = (BENDS_M[0]..=BENDS_M[1]).contains(&s_m);
    if bends { MAX_CURVATURE * (TAU * s_m / WAVE_LENGTH_M).sin() } else { 0.0 }
}

/// Heading of the reference line: the integral of its curvature.
pub(crate) fn heading(s_m: f64) -> f64 {
    let s_m = s_m.clamp(BENDS_M[0], BENDS_M[1]);
    let wave = WAVE_LENGTH_M / TAU;
    START_HEADING_RAD + MAX_CURVATURE * wave * (1.0 - (s_m / wave).cos())
}

/// Moves along the reference line by Gauss-Legendre quadrature of its direction; exact to rounding within a node
/// distance, and on the straight ends.
fn integrate([x, y]: [f64; 2], s_m: f64, by_m: f64) -> [f64; 2] {
    let node = (0.6_f64).sqrt();
    let mut sum = [0.0; 2];
    for (at, weight) in [(-node, 5.0 / 18.0), (0.0, 8.0 / 18.0), (node, 5.0 / 18.0)] {
        let (sin, cos) = heading(s_m + 0.5 * by_m * (1.0 + at)).sin_cos();
        sum = [sum[0] + weight * cos, sum[1] + weight * sin];
    }
    [x + by_m * sum[0], y + by_m * sum[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
        (a[0] - b[0]).hypot(a[1] - b[1])
    }

    #[test]
    fn the_line_begins_where_it_should_and_has_its_length() {
        let road = Road::new();
        assert!(distance(road.position(0.0, 0.0), START_M) < 1e-9);
        let step = 0.37;
        let mut s_m = -200.0;
        while s_m < 650.0 {
            let chord = distance(road.position(s_m, 0.0), road.position(s_m + step, 0.0));
            assert!((chord - step).abs() < 1e-5, "{chord} at {s_m}");
            s_m += step;
        }
    }

    #[test]
    fn advancing_on_a_track_covers_the_distance() {
        let road = Road::new();
        let shift = Shift { from_s_m: 100.0, length_m: 25.0, by_m: 5.0 };
        let tracks = [
            Track::forward(-1.75),
            Track::oncoming(1.75),
            Track { shift: Some(shift), ..Track::forward(0.0) },
        ];
        for track in tracks {
            let mut s_m = 90.0;
            for _ in 0..200 {
                let next_m = Road::advance(&track, s_m, 0.1);
                let [a, b] = [s_m, next_m].map(|s| road.pose(&track, s).position);
                let chord = (a.x - b.x).hypot(a.y - b.y);
                assert!((chord - 0.1).abs() < 1e-5, "{chord} at {s_m} on {track:?}");
                s_m = next_m;
            }
        }
    }

    #[test]
    fn turning_left_is_positive_in_both_directions() {
        let s_m = WAVE_LENGTH_M / 4.0;
        assert!((Road::track_curvature(&Track::forward(0.0), s_m) - MAX_CURVATURE).abs() < 1e-6);
        assert!((Road::track_curvature(&Track::oncoming(0.0), s_m) + MAX_CURVATURE).abs() < 1e-6);
    }
}
