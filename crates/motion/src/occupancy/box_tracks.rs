//! Many moving boxes at common time steps, and the first of them that a row of boxes meets.

use super::bounds::Bounds;
use crate::geometry::{OrientedBox, Point2, Vector2};

/// Steps that a box around the motion of a track spans: long enough to save tests, short enough to stay near the track.
const CHUNK: usize = 5;
/// Tracks whose nearness fits into one word.
const WORD: usize = u64::BITS as usize;
/// Slack of the tests before the exact one \[m\]: rounding must not dismiss boxes that touch at a corner.
const GRAIN_M: f64 = 1e-9;

/// The first step at which two boxes touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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
    /// Chunk by chunk, then track by track, then step by step: the loops run in this order, because what happens at one
    /// step nearly always happens at the next, and a processor guesses it right. The last chunk is full length.
    boxes: Vec<OrientedBox>,
    /// Chunk by chunk, then track by track: where a track is during the steps of a chunk.
    chunks: Vec<Bounds>,
    /// The same in boxes turned as the track is: what drives alongside is apart only seen along the road.
    covers: Vec<Cover>,
    turned: Vec<OrientedBox>,
    radii_m: Vec<f64>,
}

/// Everywhere: meets everything.
const EVERYWHERE: Bounds = Bounds {
    min: Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    max: Point2::new(f64::INFINITY, f64::INFINITY),
};

impl BoxTracks {
    /// Room for `tracks` boxes over `steps` time steps, all of them nowhere yet. Memory is reused.
    pub fn reset(&mut self, tracks: usize, steps: usize) {
        (self.tracks, self.steps) = (tracks, steps);
        let nowhere = OrientedBox {
            center: Point2::new(f64::INFINITY, f64::INFINITY),
            axis: nalgebra::Vector2::new(1.0, 0.0),
            half_length_m: 0.0,
            half_width_m: 0.0,
        };
        self.boxes.clear();
        let chunks = tracks * steps.div_ceil(CHUNK);
        self.boxes.resize(chunks * CHUNK, nowhere);
        self.chunks.clear();
        self.chunks.resize(chunks, Bounds::EMPTY);
        self.covers.clear();
        self.covers.resize(chunks, Cover::NOTHING);
        self.turned.clear();
        self.turned.resize(chunks, nowhere);
        self.radii_m.clear();
        self.radii_m.resize(tracks, 0.0);
    }

    /// Puts the box of a track at a step, once for each step. The size of a track may change from step to step.
    ///
    /// # Panics
    /// When the track or step is not below the numbers given to [`Self::reset`].
    pub fn set(&mut self, track: usize, step: usize, at: &OrientedBox) {
        assert!(track < self.tracks && step < self.steps, "track {track}, step {step}");
        let chunk = step / CHUNK * self.tracks + track;
        self.boxes[chunk * CHUNK + step % CHUNK] = *at;
        let radius_m = at.half_length_m.hypot(at.half_width_m) + GRAIN_M;
        // A track with a not-a-number is near everything: it must not be dismissed.
        let radius_m = if radius_m.is_nan() { f64::INFINITY } else { radius_m };
        self.radii_m[track] = self.radii_m[track].max(radius_m);
        let is_known = at.center.x.is_finite() && at.center.y.is_finite();
        let here = Bounds { min: at.center, max: at.center }.grown(radius_m);
        self.covers[chunk] = self.covers[chunk].with(at);
        self.turned[chunk] = self.covers[chunk].turned();
        let chunk = &mut self.chunks[chunk];
        *chunk = if is_known { chunk.joined(&here) } else { EVERYWHERE };
    }

    /// Number of time steps.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The first step at which one of `boxes` (one for each step, from step 0) overlaps or touches the box of a track
    /// at the same step, and the lowest number of such a track. Boxes beyond the last step meet nothing.
    ///
    /// Exact, with the answers of [`OrientedBox::overlaps`]. Boxes around a few steps of both motions dismiss most
    /// tracks, boxes turned as they are most of the rest.
    #[must_use]
    pub fn first_collision(&self, boxes: &[OrientedBox]) -> Option<BoxCollision> {
        if self.tracks == 0 {
            return None;
        }
        let boxes = &boxes[..boxes.len().min(self.steps)];
        let mut radius = Radius::default();
        for (number, (chunk, bounds)) in
            boxes.chunks(CHUNK).zip(self.chunks.chunks_exact(self.tracks)).enumerate()
        {
            let around = around(chunk, &mut radius);
            let mut hit = None;
            for (word, bounds) in bounds.chunks(WORD).enumerate() {
                let near = near_mask(&around, bounds);
                if near != 0 {
                    self.find_in_chunk(chunk, number, word * WORD, near, &mut radius, &mut hit);
                }
            }
            if hit.is_some() {
                return hit;
            }
        }
        None
    }

    /// Looks for hits of the boxes of a chunk with the tracks of a mask that come before the one known.
    #[inline]
    fn find_in_chunk(
        &self,
        boxes: &[OrientedBox],
        chunk: usize,
        first_track: usize,
        mut near: u64,
        radius: &mut Radius,
        found: &mut Option<BoxCollision>,
    ) {
        let cover = Cover::around(boxes).turned();
        while near != 0 {
            let track = first_track + near.trailing_zeros() as usize;
            near &= near - 1;
            let place = chunk * self.tracks + track;
            if !cover.overlaps(&self.turned[place]) {
                continue;
            }
            let others = &self.boxes[place * CHUNK..][..CHUNK];
            let track_radius_m = self.radii_m[track];
            for (step, (own, other)) in (chunk * CHUNK..).zip(boxes.iter().zip(others)) {
                let between = other.center - own.center;
                let reach_m = radius.of(own) + track_radius_m;
                let is_far = between.norm_squared() > reach_m * reach_m;
                if !is_far && own.overlaps(other) {
                    let hit = BoxCollision { step, track };
                    *found = Some(found.map_or(hit, |known| known.min(hit)));
                    break;
                }
            }
        }
    }
}

/// A box around a few boxes that is turned as the first of them.
#[derive(Clone, Copy, Debug)]
struct Cover {
    origin: Point2,
    axis: Vector2,
    /// Along the axis and across it, from the origin.
    extent: Bounds,
}

impl Cover {
    /// Around nothing.
    const NOTHING: Self =
        Self { origin: Point2::new(0.0, 0.0), axis: Vector2::new(1.0, 0.0), extent: Bounds::EMPTY };

    /// The cover of some boxes, turned as the middle one; of anything if a number of theirs is none.
    #[inline]
    fn around(boxes: &[OrientedBox]) -> Self {
        let Some(middle) = boxes.get(boxes.len() / 2) else { return Self::NOTHING };
        boxes.iter().fold(Self::NOTHING.with(middle), Self::with)
    }

    #[inline]
    fn with(self, at: &OrientedBox) -> Self {
        let is_first = self.extent == Bounds::EMPTY;
        let (origin, axis) = if is_first { (at.center, at.axis) } else { (self.origin, self.axis) };
        let way = at.center - origin;
        let middle = Point2::new(axis.dot(&way), axis.perp(&way));
        let (cos, sin) = (axis.dot(&at.axis).abs(), axis.perp(&at.axis).abs());
        let reach = Vector2::new(
            at.half_length_m * cos + at.half_width_m * sin,
            at.half_length_m * sin + at.half_width_m * cos,
        );
        let here = Bounds { min: middle - reach, max: middle + reach };
        let is_known = (here.min.x + here.min.y + here.max.x + here.max.y).is_finite();
        Self { origin, axis, extent: if is_known { self.extent.joined(&here) } else { EVERYWHERE } }
    }

    /// As a box, a little larger; not a number, so that it overlaps everything, if it is around anything.
    #[inline]
    fn turned(&self) -> OrientedBox {
        let half = (self.extent.max - self.extent.min) * 0.5;
        let middle = self.extent.min + half;
        OrientedBox {
            center: self.origin + self.axis * middle.x + Vector2::new(-self.axis.y, self.axis.x) * middle.y,
            axis: self.axis,
            half_length_m: half.x + GRAIN_M,
            half_width_m: half.y + GRAIN_M,
        }
    }
}

/// The box around a few boxes; everywhere if one of them is not a number.
#[inline]
fn around(boxes: &[OrientedBox], radius: &mut Radius) -> Bounds {
    let (mut bounds, mut reach_m, mut sum) = (Bounds::EMPTY, 0.0_f64, 0.0);
    for own in boxes {
        let center = own.center;
        bounds = bounds.joined(&Bounds { min: center, max: center });
        reach_m = reach_m.max(radius.of(own));
        sum += center.x + center.y + own.half_length_m + own.half_width_m;
    }
    if f64::is_nan(sum) { EVERYWHERE } else { bounds.grown(reach_m) }
}

#[inline]
fn near_mask(around: &Bounds, bounds: &[Bounds]) -> u64 {
    bounds.iter().enumerate().fold(0, |mask, (bit, other)| mask | u64::from(around.meets(other)) << bit)
}

/// Radius of the circle around a box, computed anew only when the size changes: within one row it seldom does.
#[derive(Default)]
struct Radius {
    half: (f64, f64),
    radius_m: f64,
}

impl Radius {
    #[inline]
    fn of(&mut self, own: &OrientedBox) -> f64 {
        let half = (own.half_length_m, own.half_width_m);
        if half != self.half {
            *self = Self { half, radius_m: half.0.hypot(half.1) };
        }
        self.radius_m
    }
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
        tracks.set(0, 0, &at(50.0, 0.0, 0.0, 4.0, 2.0));
        assert!(tracks.first_collision(&[at(f64::NAN, 0.0, 0.0, 4.0, 2.0)]).is_some());
    }

    #[test]
    fn more_tracks_than_a_word_holds() {
        let mut tracks = BoxTracks::default();
        tracks.reset(150, 7);
        for (track, step) in (0..150).flat_map(|track| (0..7).map(move |step| (track, step))) {
            let x = if (track, step) == (70, 6) || (track, step) == (140, 5) { 0.0 } else { 90.0 };
            tracks.set(track, step, &at(x, 0.0, 0.0, 4.0, 2.0));
        }
        let own = vec![at(0.0, 0.0, 0.0, 4.0, 2.0); 7];
        assert_eq!(tracks.first_collision(&own), Some(BoxCollision { step: 5, track: 140 }));
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
