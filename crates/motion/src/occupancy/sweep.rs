//! What a body covers between two samples of its motion.
//!
//! Between two samples the position goes in a straight line and the yaw turns evenly. A slice covers the convex hull
//! of the outline at both samples, grown by the bulge of the rotation, `r (1 - cos(turn / 2))`, and by how far the
//! true motion strays from the straight line ([`Deviation`]). A slice that turns by more than
//! [`SUBDIVISION_TURN_RAD`] puts further outlines into the hull.

use super::bounds::Bounds;
use super::outline::{Outline, PlanarPose};
use crate::geometry::{OrientedBox, Point2, Vector2, convex_hull};

/// A slice that turns by more than this \[rad\] is divided.
pub const SUBDIVISION_TURN_RAD: f64 = 0.2;
/// Cosine of [`SUBDIVISION_TURN_RAD`], rounded up so that a slice is rather divided than not.
const SUBDIVISION_COSINE: f64 = 0.980_067;

/// Slices of one group of [`Sweep::groups`].
pub const GROUP: usize = 8;

/// How far a motion strays from the straight line between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Distance of positions from the line \[m\].
    pub position_m: f64,
    /// Length of the difference of headings; a point at distance r from the origin of the body is moved by r times it.
    pub heading: f64,
}

impl Deviation {
    /// Takes into account that the motion from `start` to `end` passes `via`.
    pub fn pass(&mut self, start: &PlanarPose, end: &PlanarPose, via: &PlanarPose) {
        let line = end.position - start.position;
        let along = line.dot(&(via.position - start.position));
        let squared = line.norm_squared();
        let ratio = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.5 };
        let straight = start.between(end, ratio);
        self.position_m = self.position_m.max((via.position - straight.position).norm());
        self.heading = self.heading.max((via.heading - straight.heading).norm());
    }

    /// How far a point at most `radius_m` from the origin of the body may be off \[m\].
    #[must_use]
    #[inline]
    pub fn reach_m(&self, radius_m: f64) -> f64 {
        self.position_m + self.heading * radius_m
    }
}

/// The motion between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// Pose at its start.
    pub start: PlanarPose,
    /// Pose at its end.
    pub end: PlanarPose,
    /// By how much the hull is grown to all sides \[m\].
    pub growth_m: f64,
    /// Number of parts that the turn is divided into, 1 or more.
    parts: u32,
}

impl Slice {
    #[inline]
    fn new(radius_m: f64, start: &PlanarPose, end: &PlanarPose, deviation: &Deviation) -> Self {
        let cos = start.heading.dot(&end.heading);
        let (parts, half_turn_cos) = if cos > SUBDIVISION_COSINE {
            (1, (0.5 + 0.5 * if cos < 1.0 { cos } else { 1.0 }).sqrt())
        } else {
            let turn = start.turn_to(end);
            let parts = (turn / SUBDIVISION_TURN_RAD).ceil().max(1.0);
            (parts as u32, (turn / parts * 0.5).cos())
        };
        let growth_m = radius_m * (1.0 - half_turn_cos) + deviation.reach_m(radius_m);
        Self { start: *start, end: *end, growth_m, parts }
    }

    /// True if the same poses are on the way.
    #[inline]
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.start.is_same(&other.start) && self.end.is_same(&other.end) && self.parts == other.parts
    }

    /// The poses between start and end whose outlines belong to the hull as well.
    #[inline]
    fn inner_poses(&self) -> impl Iterator<Item = PlanarPose> + '_ {
        (1..self.parts).map(|part| self.start.between(&self.end, f64::from(part) / f64::from(self.parts)))
    }
}

/// A row of slices of one or more moving bodies.
#[derive(Clone, Debug, Default)]
pub struct Sweep {
    slices: Vec<Slice>,
    boxes: Vec<OrientedBox>,
    bounds: Vec<Bounds>,
    groups: Vec<Bounds>,
}

impl Sweep {
    /// Forgets all slices and keeps the memory.
    pub fn clear(&mut self) {
        self.slices.clear();
        self.boxes.clear();
        self.bounds.clear();
        self.groups.clear();
    }

    /// Number of slices.
    #[must_use]
    #[inline]
    pub fn len(&self) -> usize {
        self.slices.len()
    }

    /// True when there are no slices.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.slices.is_empty()
    }

    /// Adds a slice.
    pub fn push(&mut self, outline: &Outline, start: PlanarPose, end: PlanarPose, deviation: &Deviation) {
        self.row(outline, &start).go(&end, deviation);
    }

    /// Adds slices of one body, the first of which begins at a place.
    #[inline]
    pub fn row<'s>(&'s mut self, outline: &'s Outline, start: &PlanarPose) -> Row<'s> {
        Row { last: Placed::new(outline, start), outline, sweep: self, stands: false }
    }

    /// Adds the last slice `count` times more, that of a body that goes on standing. Nothing if there is none.
    pub fn repeat_last(&mut self, count: usize) {
        let (Some(&slice), Some(&turned), Some(&bounds)) =
            (self.slices.last(), self.boxes.last(), self.bounds.last())
        else {
            return;
        };
        let length = self.slices.len() + count;
        self.slices.resize(length, slice);
        self.boxes.resize(length, turned);
        self.bounds.resize(length, bounds);
        // The group that the last slice belongs to holds it already.
        self.groups.resize(length.div_ceil(GROUP), bounds);
    }

    #[inline]
    fn add_bounds(&mut self, bounds: Bounds) {
        if self.bounds.len().is_multiple_of(GROUP) {
            self.groups.push(bounds);
        } else if let Some(group) = self.groups.last_mut() {
            *group = group.joined(&bounds);
        }
        self.bounds.push(bounds);
    }

    /// The slice at a place.
    ///
    /// # Panics
    /// When the place is not below [`Self::len`].
    #[must_use]
    #[inline]
    pub fn slice(&self, at: usize) -> &Slice {
        &self.slices[at]
    }

    /// A box at any angle that holds all that a slice covers.
    ///
    /// # Panics
    /// When the place is not below [`Self::len`].
    #[must_use]
    #[inline]
    pub fn bounding_box(&self, at: usize) -> &OrientedBox {
        &self.boxes[at]
    }

    /// Boxes along the map axes, one around each slice.
    #[must_use]
    #[inline]
    pub fn bounds(&self) -> &[Bounds] {
        &self.bounds
    }

    /// The slices whose boxes along the map axes meet a box, ascending.
    pub fn near<'s>(&'s self, around: &'s Bounds) -> impl Iterator<Item = usize> + 's {
        let groups = self.groups.iter().enumerate().filter(|(_, group)| group.meets(around));
        groups
            .flat_map(|(group, _)| group * GROUP..((group + 1) * GROUP).min(self.len()))
            .filter(|&at| self.bounds[at].meets(around))
    }

    /// Boxes along the map axes around each [`GROUP`] slices: the first around slices 0 to [`GROUP`] - 1, and so on.
    #[must_use]
    #[inline]
    pub fn groups(&self) -> &[Bounds] {
        &self.groups
    }

    /// The convex hull of the outline along a slice, without its growth. The buffers are overwritten; the hull is in the
    /// second one.
    ///
    /// # Panics
    /// When the place is not below [`Self::len`].
    pub fn hull<'b>(
        &self,
        at: usize,
        outline: &Outline,
        buffers: &'b mut (Vec<Point2>, Vec<Point2>),
    ) -> &'b [Point2] {
        let (points, hull) = buffers;
        self.take_hull(at, outline, points, hull);
        hull
    }

    /// Writes the same; the points are overwritten too.
    pub(super) fn take_hull(
        &self,
        at: usize,
        outline: &Outline,
        points: &mut Vec<Point2>,
        hull: &mut Vec<Point2>,
    ) {
        points.clear();
        let slice = &self.slices[at];
        outline.place(&slice.start, points);
        slice.inner_poses().for_each(|pose| outline.place(&pose, points));
        outline.place(&slice.end, points);
        convex_hull(points, hull);
    }
}

/// Slices that are added one after the other: each end is where the next one starts, and is measured once.
#[derive(Debug)]
pub struct Row<'s> {
    sweep: &'s mut Sweep,
    outline: &'s Outline,
    last: Placed,
    /// True if the last slice is that of a body that stands.
    stands: bool,
}

/// A body at a place.
#[derive(Clone, Copy, Debug)]
struct Placed {
    pose: PlanarPose,
    /// The middle of the rectangle around it.
    center: Point2,
    bounds: Bounds,
}

impl Placed {
    #[inline]
    fn new(outline: &Outline, pose: &PlanarPose) -> Self {
        Self { pose: *pose, center: outline.center_at(pose), bounds: outline.bounds_at(pose) }
    }
}

impl Row<'_> {
    /// Adds a slice from where the last one ended.
    #[inline]
    pub fn go(&mut self, end: &PlanarPose, deviation: &Deviation) {
        let stands = end.is_same(&self.last.pose) && *deviation == Deviation::default();
        if stands && self.stands {
            return self.sweep.repeat_last(1);
        }
        self.stands = stands;
        let to = Placed::new(self.outline, end);
        let slice = Slice::new(self.outline.radius_m(), &self.last.pose, end, deviation);
        let (bounds, turned) = if slice.parts == 1 {
            around_ends(self.outline, &slice, &self.last, &to)
        } else {
            around_turn(self.outline, &slice)
        };
        self.sweep.add_bounds(bounds.grown(slice.growth_m));
        self.sweep.boxes.push(turned);
        self.sweep.slices.push(slice);
        self.last = to;
    }

    /// The next slice begins at another place than where the last one ended.
    pub fn restart(&mut self, start: &PlanarPose) {
        self.last = Placed::new(self.outline, start);
        self.stands = false;
    }
}

/// The boxes around a slice that hardly turns, along the map axes without its growth and along its own heading with it.
#[inline]
fn around_ends(outline: &Outline, slice: &Slice, from: &Placed, to: &Placed) -> (Bounds, OrientedBox) {
    let (start, end) = (&slice.start, &slice.end);
    let bounds = from.bounds.joined(&to.bounds);
    // Halfway between both headings: the outline reaches as far across and along at one end as at the other.
    let axis = start.heading + end.heading;
    let axis = axis / axis.norm();
    let reach = outline.reach_along(Vector2::new(axis.dot(&start.heading), axis.perp(&start.heading)));
    let (from, to) = (from.center, to.center);
    let way = to - from;
    let turned = OrientedBox {
        center: from + way * 0.5,
        axis,
        half_length_m: axis.dot(&way).abs() * 0.5 + reach.x + slice.growth_m,
        half_width_m: axis.perp(&way).abs() * 0.5 + reach.y + slice.growth_m,
    };
    (bounds, turned)
}

/// The same for a slice that is divided.
#[cold]
fn around_turn(outline: &Outline, slice: &Slice) -> (Bounds, OrientedBox) {
    let (start, end) = (&slice.start, &slice.end);
    let sum = start.heading + end.heading;
    let length = sum.norm();
    // Opposite headings have no middle; any axis bounds, a good one bounds tightly.
    let axis = if length > 0.1 { sum / length } else { start.heading };
    let covered = |pose: &PlanarPose| (outline.bounds_at(pose), outline.bounds_along(pose, axis));
    let join = |a: (Bounds, Bounds), b: (Bounds, Bounds)| (a.0.joined(&b.0), a.1.joined(&b.1));
    let ends = join(covered(start), covered(end));
    let (bounds, along) = slice.inner_poses().fold(ends, |all, pose| join(all, covered(&pose)));
    let (half, middle) = ((along.max - along.min) * 0.5, along.min + (along.max - along.min) * 0.5);
    let turned = OrientedBox {
        center: Point2::from(axis * middle.x + Vector2::new(-axis.y, axis.x) * middle.y),
        axis,
        half_length_m: half.x + slice.growth_m,
        half_width_m: half.y + slice.growth_m,
    };
    (bounds, turned)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sweep(outline: &Outline, start: PlanarPose, end: PlanarPose) -> Sweep {
        let mut sweep = Sweep::default();
        sweep.push(outline, start, end, &Deviation::default());
        sweep
    }

    #[test]
    fn what_goes_on_standing_is_covered_as_before() {
        let outline = Outline::rectangle(3.8, 1.1, 0.9, 0.7);
        let (from, to) = (PlanarPose::new(0.0, 0.0, 0.2), PlanarPose::new(1.0, 0.5, 0.3));
        let mut repeated = Sweep::default();
        repeated.repeat_last(3);
        assert!(repeated.is_empty());
        let mut pushed = Sweep::default();
        for sweep in [&mut repeated, &mut pushed] {
            sweep.push(&outline, from, to, &Deviation::default());
            sweep.push(&outline, to, to, &Deviation::default());
        }
        repeated.repeat_last(1);
        repeated.repeat_last(2 * GROUP - 1);
        for _ in 0..2 * GROUP {
            pushed.push(&outline, to, to, &Deviation::default());
        }
        assert_eq!((repeated.bounds(), repeated.groups()), (pushed.bounds(), pushed.groups()));
        assert_eq!((repeated.slices, repeated.boxes), (pushed.slices, pushed.boxes));
    }

    #[test]
    fn a_bend_between_samples_grows_the_slice() {
        let (start, end) = (PlanarPose::new(0.0, 0.0, 0.0), PlanarPose::new(10.0, 0.0, 0.0));
        let mut deviation = Deviation::default();
        deviation.pass(&start, &end, &PlanarPose::new(5.0, 2.0, 0.1));
        assert!((deviation.position_m - 2.0).abs() < 1e-12);
        assert!((deviation.heading - 2.0 * 0.05_f64.sin()).abs() < 1e-12);
        assert!((deviation.reach_m(4.0) - 2.0 - 8.0 * 0.05_f64.sin()).abs() < 1e-12);
    }

    prop_compose! {
        fn any_pose(reach: f64)(x in -reach..reach, y in -reach..reach, yaw in -3.2..3.2_f64) -> PlanarPose {
            PlanarPose::new(x, y, yaw)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        /// What the slice covers lies in its boxes.
        #[test]
        fn boxes_hold_the_body(a0 in any_pose(6.0), a1 in any_pose(6.0), ratio in 0.0..1.0_f64) {
            let outline = Outline::rectangle(3.8, 1.1, 0.9, 0.7);
            let swept = sweep(&outline, a0, a1);
            let mut corners = Vec::new();
            outline.place(&a0.between(&a1, ratio), &mut corners);
            let (bounds, turned) = (swept.bounds()[0].grown(1e-6), swept.bounding_box(0));
            for corner in corners {
                prop_assert!(bounds.holds(corner));
                let d = corner - turned.center;
                prop_assert!(turned.axis.dot(&d).abs() <= turned.half_length_m + 1e-6);
                prop_assert!(turned.axis.perp(&d).abs() <= turned.half_width_m + 1e-6);
            }
        }

        /// The boxes around what an outline covers hold those around what a part of it covers, but for what is rounded.
        #[test]
        fn a_part_of_an_outline_covers_no_more(
            (front, rear, left, right) in (0.5..5.0_f64, 0.5..2.0_f64, 0.5..1.5_f64, 0.5..1.5_f64),
            (less_front, less_rear, less_aside) in (0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64),
            poses in proptest::collection::vec(any_pose(20.0), 2..20),
            (position_m, heading) in (0.0..0.5_f64, 0.0..0.2_f64),
            far in prop_oneof![Just(0.0), Just(1e5), Just(1e9)],
        ) {
            let whole = Outline::rectangle(front, rear, left, right);
            let (front, rear) = (front - 0.5 * less_front, rear - 0.5 * less_rear);
            let part = Outline::rectangle(front, rear, left - 0.5 * less_aside, right - 0.5 * less_aside);
            prop_assert!(whole.holds(&part) && (part == whole || !part.holds(&whole)));
            let deviation = Deviation { position_m, heading };
            let at = |pose: &PlanarPose| PlanarPose { position: pose.position + Vector2::new(far, -far), ..*pose };
            let swept = |outline: &Outline| {
                let mut sweep = Sweep::default();
                poses.windows(2).for_each(|pair| sweep.push(outline, at(&pair[0]), at(&pair[1]), &deviation));
                sweep
            };
            let (swept, of_whole) = (swept(&part), swept(&whole));
            for (part, whole) in swept.bounds().iter().zip(of_whole.bounds()) {
                let whole = whole.grown(1e-6 + 1e-9 * far);
                prop_assert!(whole.holds(part.min) && whole.holds(part.max));
            }
            for at in 0..swept.len() {
                let (part, whole) = (swept.bounding_box(at), of_whole.bounding_box(at));
                let rounding_m = 1e-6 + 1e-9 * far;
                prop_assert_eq!(part.axis, whole.axis);
                for corner in part.corners() {
                    let from_middle = corner - whole.center;
                    prop_assert!(whole.axis.dot(&from_middle).abs() <= whole.half_length_m + rounding_m);
                    prop_assert!(whole.axis.perp(&from_middle).abs() <= whole.half_width_m + rounding_m);
                }
            }
            let around = swept.bounds()[0].grown(10.0);
            let near: Vec<usize> = swept.near(&around).collect();
            let meets = |at: &usize| swept.bounds()[*at].meets(&around);
            prop_assert_eq!(near, (0..swept.len()).filter(meets).collect::<Vec<_>>());
        }

        /// A row covers what its slices cover one by one, wherever it stands.
        #[test]
        fn a_row_is_its_slices(places in proptest::collection::vec((any_pose(6.0), 1..4_usize), 1..12)) {
            let outline = Outline::rectangle(3.8, 1.1, 0.9, 0.7);
            let poses: Vec<PlanarPose> =
                places.iter().flat_map(|(pose, count)| std::iter::repeat_n(*pose, *count)).collect();
            let (mut swept, mut pushed) = (Sweep::default(), Sweep::default());
            let mut row = swept.row(&outline, &poses[0]);
            for pair in poses.windows(2) {
                row.go(&pair[1], &Deviation::default());
                pushed.push(&outline, pair[0], pair[1], &Deviation::default());
            }
            prop_assert_eq!((swept.bounds(), swept.groups()), (pushed.bounds(), pushed.groups()));
            prop_assert_eq!((swept.slices, swept.boxes), (pushed.slices, pushed.boxes));
        }
    }
}
