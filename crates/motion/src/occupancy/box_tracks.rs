//! Many moving boxes at common time steps, and the first of them that a row of boxes meets.

use crate::geometry::{OrientedBox, Point2, Vector2};

/// Boxes are tested in groups of this many, so that the loop over a group becomes vector instructions.
const LANES: usize = 4;

/// The first step at which two boxes touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxCollision {
    /// Time step.
    pub step: usize,
    /// Number of the track, in the order in which they were added.
    pub track: usize,
}

/// Where several boxes of constant size are at each of a number of time steps. All tracks have a pose at every step.
#[derive(Clone, Debug, Default)]
pub struct BoxTracks {
    steps: usize,
    tracks: usize,
    /// Tracks rounded up to whole groups of lanes; what is beyond [`Self::tracks`] is infinitely far away.
    stride: usize,
    // Step by step, then track by track.
    x: Vec<f64>,
    y: Vec<f64>,
    axis: Vec<Vector2>,
    // Track by track.
    radius_m: Vec<f64>,
    half_length_m: Vec<f64>,
    half_width_m: Vec<f64>,
}

impl BoxTracks {
    /// Room for `tracks` boxes over `steps` time steps, all of them nowhere yet. Memory is reused.
    pub fn reset(&mut self, tracks: usize, steps: usize) {
        (self.tracks, self.steps) = (tracks, steps);
        self.stride = tracks.next_multiple_of(LANES);
        for column in [&mut self.x, &mut self.y] {
            column.clear();
            column.resize(self.stride * steps, f64::INFINITY);
        }
        self.axis.clear();
        self.axis.resize(self.stride * steps, Vector2::new(1.0, 0.0));
        for column in [&mut self.radius_m, &mut self.half_length_m, &mut self.half_width_m] {
            column.clear();
            column.resize(self.stride, 0.0);
        }
    }

    /// Puts the box of a track at a step. The size is that of the track: the last one given holds for all steps.
    ///
    /// # Panics
    /// When the track or step is not below the numbers given to [`Self::reset`].
    pub fn set(&mut self, track: usize, step: usize, at: &OrientedBox) {
        assert!(track < self.tracks && step < self.steps, "track {track}, step {step}");
        let place = step * self.stride + track;
        (self.x[place], self.y[place], self.axis[place]) = (at.center.x, at.center.y, at.axis);
        (self.half_length_m[track], self.half_width_m[track]) = (at.half_length_m, at.half_width_m);
        self.radius_m[track] = at.half_length_m.hypot(at.half_width_m);
    }

    /// Number of time steps.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The first step at which one of `boxes` (one for each step, from step 0) overlaps or touches the box of a track
    /// at the same step, and the lowest number of such a track. Boxes beyond the last step meet nothing.
    ///
    /// Exact: a circle test only dismisses pairs that are far apart.
    #[must_use]
    pub fn first_collision(&self, boxes: &[OrientedBox]) -> Option<BoxCollision> {
        if self.tracks == 0 {
            return None;
        }
        let columns = self.x.chunks_exact(self.stride).zip(self.y.chunks_exact(self.stride));
        for (step, (own, (x, y))) in boxes.iter().zip(columns).enumerate() {
            let radius_m =
                (own.half_length_m * own.half_length_m + own.half_width_m * own.half_width_m).sqrt();
            for group in (0..self.stride).step_by(LANES) {
                let lanes = group..group + LANES;
                let near = is_any_near(
                    own.center,
                    radius_m,
                    &x[lanes.clone()],
                    &y[lanes.clone()],
                    &self.radius_m[lanes.clone()],
                );
                if !near {
                    continue;
                }
                if let Some(track) = lanes.into_iter().find(|&track| self.is_hit(own, radius_m, step, track))
                {
                    return Some(BoxCollision { step, track });
                }
            }
        }
        None
    }

    #[inline]
    fn is_hit(&self, own: &OrientedBox, radius_m: f64, step: usize, track: usize) -> bool {
        let place = step * self.stride + track;
        let center = Point2::new(self.x[place], self.y[place]);
        if track >= self.tracks || is_far(own.center, radius_m, center.x, center.y, self.radius_m[track]) {
            return false;
        }
        own.overlaps(&OrientedBox {
            center,
            axis: self.axis[place],
            half_length_m: self.half_length_m[track],
            half_width_m: self.half_width_m[track],
        })
    }
}

/// True when two circles are apart. False for not-a-number, which must not dismiss anything. The radius has a grain
/// added, because a rounded square root must not dismiss boxes that touch at a corner.
#[inline]
fn is_far(center: Point2, radius_m: f64, x: f64, y: f64, other_radius_m: f64) -> bool {
    let (dx, dy, reach) = (x - center.x, y - center.y, radius_m + other_radius_m + 1e-9);
    dx * dx + dy * dy > reach * reach
}

#[inline]
fn is_any_near(center: Point2, radius_m: f64, x: &[f64], y: &[f64], radii_m: &[f64]) -> bool {
    let mut near = false;
    for ((x, y), other) in x.iter().zip(y).zip(radii_m) {
        near |= !is_far(center, radius_m, *x, *y, *other);
    }
    near
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::pose::Pose;

    fn at(x: f64, y: f64, yaw: f64, length: f64, width: f64) -> OrientedBox {
        OrientedBox::around(
            &Pose::from_xy_yaw(x, y, yaw),
            length / 2.0,
            length / 2.0,
            width / 2.0,
            width / 2.0,
        )
    }

    #[test]
    fn the_first_step_and_the_lowest_track_win() {
        let mut tracks = BoxTracks::default();
        tracks.reset(3, 4);
        for step in 0..4 {
            tracks.set(0, step, &at(100.0, 0.0, 0.0, 4.0, 2.0));
            tracks.set(1, step, &at(10.0, 0.0, 0.0, 4.0, 2.0));
            tracks.set(2, step, &at(10.0, 0.5, 1.0, 4.0, 2.0));
        }
        let own: Vec<OrientedBox> =
            (0..6).map(|step| at(3.0 * f64::from(step), 0.0, 0.0, 4.0, 2.0)).collect();
        assert_eq!(tracks.first_collision(&own), Some(BoxCollision { step: 2, track: 1 }));
        assert_eq!(tracks.first_collision(&own[..2]), None);
        tracks.reset(0, 4);
        assert_eq!(tracks.first_collision(&own), None);
        tracks.reset(5, 0);
        assert_eq!((tracks.first_collision(&own), tracks.steps()), (None, 0));
    }

    #[test]
    fn tracks_that_were_not_set_are_nowhere() {
        let mut tracks = BoxTracks::default();
        tracks.reset(2, 1);
        assert_eq!(tracks.first_collision(&[at(0.0, 0.0, 0.0, 4.0, 2.0)]), None);
    }

    #[test]
    fn not_a_number_is_no_way_past() {
        let mut tracks = BoxTracks::default();
        tracks.reset(1, 1);
        tracks.set(0, 0, &at(f64::NAN, 0.0, 0.0, 4.0, 2.0));
        assert!(tracks.first_collision(&[at(50.0, 0.0, 0.0, 4.0, 2.0)]).is_some());
    }

    proptest! {
        #[test]
        fn equals_testing_every_pair(
            own in proptest::collection::vec((-6.0..6.0_f64, -6.0..6.0_f64, -4.0..4.0_f64), 1..8),
            others in proptest::collection::vec(
                ((-9.0..9.0_f64, -9.0..9.0_f64, -4.0..4.0_f64), (0.0..5.0_f64, 0.0..2.0_f64)), 0..11),
            drift in -1.0..1.0_f64,
        ) {
            let mut tracks = BoxTracks::default();
            tracks.reset(others.len(), own.len());
            let moved = |((x, y, yaw), (l, w)): ((f64, f64, f64), (f64, f64)), step: usize| {
                at(x + drift * step as f64, y, yaw + 0.1 * step as f64, l, w)
            };
            for (track, other) in others.iter().enumerate() {
                for step in 0..own.len() {
                    tracks.set(track, step, &moved(*other, step));
                }
            }
            let own: Vec<OrientedBox> = own.into_iter().map(|(x, y, yaw)| at(x, y, yaw, 4.0, 1.8)).collect();
            let expected = own.iter().enumerate().find_map(|(step, own)| {
                let track = others.iter().position(|other| own.overlaps(&moved(*other, step)))?;
                Some(BoxCollision { step, track })
            });
            prop_assert_eq!(tracks.first_collision(&own), expected);
        }
    }
}
