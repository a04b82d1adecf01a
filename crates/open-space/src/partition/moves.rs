//! A part falls into moves from one stop to the next: where its wheels must turn far the vehicle stands on its way.
//!
//! Place alone cannot tell a vehicle that has come to a stop from one that has stood there for long enough; time can.

use crate::stitcher::DiscretizedPoint;
use crate::tolerance::{STANDSTILL_MPS, STEP_DIRECTION_M};

/// Points at rest in one place, by their indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stop {
    pub(super) first: usize,
    pub(super) last: usize,
}

/// A stretch of a part up to a stop, which must not be passed before it is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Move {
    /// Index of the point that it begins at.
    pub(super) from: usize,
    /// The stop that it ends with.
    pub(super) stop: Stop,
}

/// The move of a part that is due at a time, s: the last one from when its stop begins.
pub(super) fn due_move(points: &[DiscretizedPoint], due_s: f64) -> Move {
    let (mut from, mut first) = (0, 0);
    for last in 0..points.len() - 1 {
        if stays(&points[last], &points[last + 1]) {
            continue;
        }
        if first < last {
            if points[last].relative_time_s > due_s {
                return Move { from, stop: Stop { first, last } };
            }
            from = last;
        }
        first = last + 1;
    }
    Move { from, stop: Stop { first, last: points.len() - 1 } }
}

/// The last point that is due at a time, s; the first one where none is.
pub(super) fn due_point(points: &[DiscretizedPoint], due_s: f64) -> usize {
    points.partition_point(|point| point.relative_time_s <= due_s).saturating_sub(1)
}

fn stays(point: &DiscretizedPoint, next: &DiscretizedPoint) -> bool {
    let stands = |point: &DiscretizedPoint| point.speed_mps.abs() < STANDSTILL_MPS;
    let step_m = point.path_point.zip(next.path_point).map(|(from, to)| from.pose.distance_m(&to.pose));
    stands(point) && stands(next) && step_m.is_none_or(|step_m| step_m < STEP_DIRECTION_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::PlanarPose;
    use crate::stitcher::PathPoint;

    /// A point each second at these places.
    fn points(places: &[f64]) -> Vec<DiscretizedPoint> {
        let point = |(index, &x): (usize, &f64)| {
            let stays = |other: Option<&f64>| other == Some(&x);
            let stands = stays(places.get(index + 1)) || stays(index.checked_sub(1).map(|i| &places[i]));
            DiscretizedPoint {
                path_point: Some(PathPoint { pose: PlanarPose::new(x, 0.0, 0.0), ..PathPoint::default() }),
                speed_mps: if stands { 0.0 } else { 1.0 },
                relative_time_s: index as f64,
                ..DiscretizedPoint::default()
            }
        };
        places.iter().enumerate().map(point).collect()
    }

    #[test]
    fn the_move_that_is_due() {
        let part = points(&[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 3.0, 4.0]);
        for (due_s, from, first, last) in [
            (f64::NEG_INFINITY, 0, 0, 2),
            (1.9, 0, 0, 2),
            (2.0, 2, 4, 5),
            (4.9, 2, 4, 5),
            (5.0, 5, 7, 7),
            (99.0, 5, 7, 7),
        ] {
            assert_eq!(due_move(&part, due_s), Move { from, stop: Stop { first, last } }, "{due_s} s");
        }
    }

    #[test]
    fn a_stand_at_the_end_belongs_to_it() {
        let part = points(&[0.0, 1.0, 2.0, 2.0]);
        for due_s in [0.0, 9.0] {
            assert_eq!(due_move(&part, due_s), Move { from: 0, stop: Stop { first: 2, last: 3 } });
        }
    }

    #[test]
    fn the_point_that_is_due() {
        let part = points(&[0.0, 1.0, 2.0]);
        for (due_s, index) in [(-1.0, 0), (0.0, 0), (0.9, 0), (1.0, 1), (9.0, 2)] {
            assert_eq!(due_point(&part, due_s), index, "{due_s} s");
        }
    }
}
