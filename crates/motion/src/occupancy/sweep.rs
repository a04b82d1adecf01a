//! What a body covers between two samples of its motion.
//!
//! Between two samples the position goes in a straight line and the yaw turns evenly. A slice covers the convex hull
//! of the outline at both samples, grown by the bulge of the rotation, `r (1 - cos(turn / 2))`, and by how far the
//! true motion strays from the straight line ([`Deviation`]). A slice that turns by more than
//! [`SUBDIVISION_TURN_RAD`] puts further outlines into the hull.

use super::bounds::Bounds;
use super::outline::{Outline, PlanarPose};
use crate::geometry::{OrientedBox, Point2, convex_hull, convex_overlap_within};

/// A slice that turns by more than this \[rad\] is divided.
pub const SUBDIVISION_TURN_RAD: f64 = 0.2;
/// Cosine of [`SUBDIVISION_TURN_RAD`], rounded up so that a slice is rather divided than not.
const SUBDIVISION_COSINE: f64 = 0.980_067;

/// Slices of one group of [`Sweep::groups`].
pub const GROUP: usize = 8;
/// Depth \[m\] from which on an overlap is beyond doubt, whatever is rounded where.
const DEPTH_M: f64 = 1e-6;

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
    fn new(radius_m: f64, start: PlanarPose, end: PlanarPose, deviation: &Deviation) -> Self {
        let cos = start.heading.dot(&end.heading);
        let (parts, half_turn_cos) = if cos > SUBDIVISION_COSINE {
            (1, (0.5 + 0.5 * cos.min(1.0)).sqrt())
        } else {
            let turn = start.turn_to(&end);
            let parts = (turn / SUBDIVISION_TURN_RAD).ceil().max(1.0);
            (parts as u32, (turn / parts * 0.5).cos())
        };
        let growth_m = radius_m * (1.0 - half_turn_cos) + deviation.reach_m(radius_m);
        Self { start, end, growth_m, parts }
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
        let slice = Slice::new(outline.radius_m(), start, end, deviation);
        let sum = start.heading + end.heading;
        let length = sum.norm();
        // Opposite headings have no middle; any axis bounds, a good one bounds tightly.
        let axis = if length > 0.1 { sum / length } else { start.heading };
        let covered = |pose: &PlanarPose| (outline.bounds_at(pose), outline.bounds_along(pose, axis));
        let join = |a: (Bounds, Bounds), b: (Bounds, Bounds)| (a.0.joined(&b.0), a.1.joined(&b.1));
        let mut all = join(covered(&start), covered(&end));
        for pose in slice.inner_poses() {
            all = join(all, covered(&pose));
        }
        let (bounds, along) = all;
        let (along, across) = ((along.min, along.max), nalgebra::Vector2::new(-axis.y, axis.x));
        let middle = along.0 + (along.1 - along.0) * 0.5;
        self.boxes.push(OrientedBox {
            center: Point2::from(axis * middle.x + across * middle.y),
            axis,
            half_length_m: (along.1.x - along.0.x) * 0.5 + slice.growth_m,
            half_width_m: (along.1.y - along.0.y) * 0.5 + slice.growth_m,
        });
        let bounds = bounds.grown(slice.growth_m);
        if self.slices.len().is_multiple_of(GROUP) {
            self.groups.push(bounds);
        } else if let Some(group) = self.groups.last_mut() {
            *group = group.joined(&bounds);
        }
        self.bounds.push(bounds);
        self.slices.push(slice);
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
        points.clear();
        let slice = &self.slices[at];
        outline.place(&slice.start, points);
        slice.inner_poses().for_each(|pose| outline.place(&pose, points));
        outline.place(&slice.end, points);
        convex_hull(points, hull);
        hull
    }
}

/// Memory for the exact test of two slices.
#[derive(Clone, Debug, Default)]
pub struct HullBuffers {
    first: (Vec<Point2>, Vec<Point2>),
    second: (Vec<Point2>, Vec<Point2>),
}

/// True when what two slices cover may overlap: never false where the bodies touch at any two moments inside the
/// slices.
///
/// # Panics
/// When a place is not below the length of its sweep.
#[must_use]
#[inline]
pub fn slices_meet(
    (a_outline, a, a_at): (&Outline, &Sweep, usize),
    (b_outline, b, b_at): (&Outline, &Sweep, usize),
    buffers: &mut HullBuffers,
) -> bool {
    a.bounds[a_at].meets(&b.bounds[b_at])
        && near_slices_meet((a_outline, a, a_at), (b_outline, b, b_at), buffers)
}

fn near_slices_meet(
    (a_outline, a, a_at): (&Outline, &Sweep, usize),
    (b_outline, b, b_at): (&Outline, &Sweep, usize),
    buffers: &mut HullBuffers,
) -> bool {
    if !a.boxes[a_at].overlaps(&b.boxes[b_at]) {
        return false;
    }
    if ends_overlap((a_outline, &a.slices[a_at]), (b_outline, &b.slices[b_at])) {
        return true;
    }
    let growth_m = a.slices[a_at].growth_m + b.slices[b_at].growth_m;
    let first = a.hull(a_at, a_outline, &mut buffers.first);
    let second = b.hull(b_at, b_outline, &mut buffers.second);
    convex_overlap_within(first, second, growth_m)
}

/// True only if the bodies, both rectangles, overlap beyond doubt with one at an end of its slice and the other at one
/// of its own. Most slices that meet do, and four tests of boxes cost less than two hulls.
fn ends_overlap((a_outline, a): (&Outline, &Slice), (b_outline, b): (&Outline, &Slice)) -> bool {
    let core = |outline: &Outline, pose: &PlanarPose| {
        let placed = outline.box_at(pose);
        OrientedBox {
            half_length_m: placed.half_length_m - DEPTH_M,
            half_width_m: placed.half_width_m - DEPTH_M,
            ..placed
        }
    };
    a_outline.is_rectangle() && b_outline.is_rectangle() && {
        let others = [core(b_outline, &b.start), core(b_outline, &b.end)];
        [&a.start, &a.end].iter().any(|pose| {
            let own = core(a_outline, pose);
            others.iter().any(|other| own.overlaps(other))
        })
    }
}

/// True when two placed outlines overlap or touch.
#[must_use]
pub fn placed_meet(
    (a_outline, a): (&Outline, &PlanarPose),
    (b_outline, b): (&Outline, &PlanarPose),
    buffers: &mut HullBuffers,
) -> bool {
    if !a_outline.box_at(a).overlaps(&b_outline.box_at(b)) {
        return false;
    }
    let (first, second) = (&mut buffers.first.0, &mut buffers.second.0);
    first.clear();
    second.clear();
    a_outline.place(a, first);
    b_outline.place(b, second);
    convex_overlap_within(first, second, 0.0)
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
    fn a_thin_object_between_two_samples_is_hit() {
        let car = Outline::rectangle(3.8, 1.1, 0.95, 0.95);
        let post = Outline::rectangle(0.01, 0.01, 0.01, 0.01);
        let driven = sweep(&car, PlanarPose::new(0.0, 0.0, 0.0), PlanarPose::new(40.0, 0.0, 0.0));
        let mut buffers = HullBuffers::default();
        for (y, expected) in [(0.0, true), (0.955, true), (0.97, false)] {
            let at = PlanarPose::new(20.0, y, 0.3);
            let meets = slices_meet((&car, &driven, 0), (&post, &sweep(&post, at, at), 0), &mut buffers);
            assert_eq!(meets, expected, "{y}");
        }
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

        /// Wherever the two bodies touch at any two moments of their slices, the slices meet.
        #[test]
        fn no_contact_is_missed(
            a0 in any_pose(6.0), a1 in any_pose(6.0), b0 in any_pose(6.0), b1 in any_pose(6.0),
            (front, rear, half) in (0.1..4.0_f64, 0.0..2.0_f64, 0.1..1.5_f64),
        ) {
            let (a, b) = (Outline::rectangle(front, rear, half, half), Outline::rectangle(half, half, 0.3, 0.3));
            let (sa, sb) = (sweep(&a, a0, a1), sweep(&b, b0, b1));
            let meets = slices_meet((&a, &sa, 0), (&b, &sb, 0), &mut HullBuffers::default());
            for i in 0..=20 {
                for k in 0..=20 {
                    let at = |from: &PlanarPose, to, step| from.between(to, f64::from(step) / 20.0);
                    if a.box_at(&at(&a0, &a1, i)).overlaps(&b.box_at(&at(&b0, &b1, k))) {
                        prop_assert!(meets, "contact at {i} {k}");
                    }
                }
            }
        }

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
    }
}
