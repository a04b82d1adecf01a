//! Whether what two bodies cover in a slice of their motion meets.
//!
//! Boxes decide nearly all pairs: apart, or one body in the other beyond doubt. Hulls decide the rest.

use super::outline::{Outline, PlanarPose};
use super::sweep::{Slice, Sweep};
use crate::geometry::{OrientedBox, Point2, convex_overlap_within};

/// Hulls that are kept of each of two bodies.
const MOST_HULLS: usize = 128;
/// Corners that a hull has room for from the start: those of most are fewer.
const HULL_CORNERS: usize = 16;
/// Depth \[m\] from which on an overlap is beyond doubt, whatever is rounded where.
const DEPTH_M: f64 = 1e-6;

/// Memory for the exact test of two slices.
#[derive(Clone, Debug, Default)]
pub struct HullBuffers {
    first: Vec<Point2>,
    second: Vec<Point2>,
    known_firsts: KnownHulls,
    known_seconds: KnownHulls,
}

/// Hulls of slices that were asked for lately: a slice that is near one other is often near several. They are known by
/// what they are hulls of, not by where that is kept.
#[derive(Clone, Debug, Default)]
struct KnownHulls {
    /// By the place of the slice, over and over.
    hulls: Vec<KnownHull>,
    points: Vec<Point2>,
}

#[derive(Clone, Debug)]
struct KnownHull {
    slice: Slice,
    /// Corners of the outline; none at first, which no outline has.
    corners: Vec<Point2>,
    hull: Vec<Point2>,
}

impl KnownHulls {
    /// The convex hull of the outline along a slice, without its growth.
    fn get(&mut self, (outline, sweep, at): (&Outline, &Sweep, usize)) -> &[Point2] {
        let slice = sweep.slice(at);
        if self.hulls.is_empty() {
            let room = || Vec::with_capacity(HULL_CORNERS);
            self.hulls.resize_with(MOST_HULLS, || KnownHull { slice: *slice, corners: room(), hull: room() });
        }
        let known = &mut self.hulls[at % MOST_HULLS];
        if !(known.slice.is_same(slice) && outline.has_corners(&known.corners)) {
            // Nothing is known while it is made.
            known.corners.clear();
            sweep.take_hull(at, outline, &mut self.points, &mut known.hull);
            known.slice = *slice;
            known.corners.extend_from_slice(outline.corners());
        }
        &known.hull
    }
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
    a.bounds()[a_at].meets(&b.bounds()[b_at])
        && near_slices_meet((a_outline, a, a_at), (b_outline, b, b_at), buffers)
}

/// As [`slices_meet`] for slices whose boxes along the map axes are known to meet.
///
/// # Panics
/// When a place is not below the length of its sweep.
#[must_use]
pub fn near_slices_meet(
    (a_outline, a, a_at): (&Outline, &Sweep, usize),
    (b_outline, b, b_at): (&Outline, &Sweep, usize),
    buffers: &mut HullBuffers,
) -> bool {
    if !a.bounding_box(a_at).overlaps(b.bounding_box(b_at)) {
        return false;
    }
    if ends_overlap((a_outline, a.slice(a_at)), (b_outline, b.slice(b_at))) {
        return true;
    }
    let growth_m = a.slice(a_at).growth_m + b.slice(b_at).growth_m;
    let first = buffers.known_firsts.get((a_outline, a, a_at));
    let second = buffers.known_seconds.get((b_outline, b, b_at));
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
    let (first, second) = (&mut buffers.first, &mut buffers.second);
    first.clear();
    second.clear();
    a_outline.place(a, first);
    b_outline.place(b, second);
    convex_overlap_within(first, second, 0.0)
}

#[cfg(test)]
mod tests {
    use super::super::sweep::Deviation;
    use super::*;
    use proptest::prelude::*;

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

    prop_compose! {
        fn any_pose(reach: f64)(x in -reach..reach, y in -reach..reach, yaw in -3.2..3.2_f64) -> PlanarPose {
            PlanarPose::new(x, y, yaw)
        }
    }

    fn any_outline() -> impl Strategy<Value = Outline> {
        let corners = proptest::collection::vec((-2.0..3.0_f64, -1.5..1.5_f64), 0..6);
        prop_oneof![
            (0.1..4.0_f64, 0.0..2.0_f64, 0.1..1.5_f64)
                .prop_map(|(front, rear, half)| Outline::rectangle(front, rear, half, half)),
            corners.prop_map(|corners| {
                let points: Vec<Point2> = corners.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
                Outline::hull_of(&points)
            }),
        ]
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

        /// What was asked before changes no answer, though hulls are kept.
        #[test]
        fn kept_hulls_are_those_of_the_slices_asked_for(
            rows in proptest::collection::vec((any_outline(), any_pose(4.0), any_pose(4.0)), 2..5),
        ) {
            let sweeps: Vec<Sweep> = rows.iter().map(|(outline, from, to)| sweep(outline, *from, *to)).collect();
            let mut kept = HullBuffers::default();
            for (a, b) in (0..rows.len()).flat_map(|a| (0..rows.len()).map(move |b| (a, b))) {
                let (first, second) = ((&rows[a].0, &sweeps[a], 0), (&rows[b].0, &sweeps[b], 0));
                let fresh = slices_meet(first, second, &mut HullBuffers::default());
                prop_assert_eq!(slices_meet(first, second, &mut kept), fresh);
            }
        }
    }
}
