//! Is a piece of an arc free: the swept shape of the piece, made once and placed wherever it is driven.

use motion::Point2;

use crate::arc::Arc;
use crate::collision::{CollisionChecker, Placement, Shape};
use crate::pose::PlanarPose;
use crate::reeds_shepp::Word;

/// Arcs are tested in pieces no longer than this, m: longer ones sweep more than the vehicle does.
const PIECE_M: f64 = 0.25;

/// An arc cut into equal pieces, with the shape that each piece sweeps.
#[derive(Clone, Debug)]
pub(super) struct SweptArc {
    arc: Arc,
    pieces: u32,
    shape: Shape,
    /// End of the first piece, in the frame of its beginning.
    step: Placement,
    /// End of the arc in the frame of its beginning.
    end: PlanarPose,
}

impl SweptArc {
    pub(super) fn new(checker: &CollisionChecker, arc: Arc) -> Self {
        let origin = PlanarPose::default();
        let pieces = (arc.length_m.abs() / PIECE_M).ceil().max(1.0);
        let piece = Arc::new(arc.curvature, arc.length_m / pieces);
        let piece_end = piece.end(&origin);
        Self {
            arc,
            pieces: pieces as u32,
            shape: Shape::sweep(&checker.rectangle(), &piece_end),
            step: Placement::new(&piece_end),
            end: arc.end(&origin),
        }
    }

    pub(super) fn arc(&self) -> Arc {
        self.arc
    }

    /// Where the arc ends when it begins at `from`, which is placed at `place`.
    pub(super) fn end(&self, from: &PlanarPose, place: &Placement) -> PlanarPose {
        let end = place.to_world(self.end.point());
        PlanarPose::new(end.x, end.y, from.yaw + self.end.yaw)
    }

    /// Where what is placed at `place` is placed after the arc.
    pub(super) fn after(&self, place: &Placement) -> Placement {
        place.then(&Placement::new(&self.end))
    }

    /// Whether the arc can be driven from `place`, which is within bounds, keeping `inflation_m` from everything.
    pub(super) fn is_free(&self, checker: &CollisionChecker, place: &Placement, inflation_m: f64) -> bool {
        let mut place = *place;
        (0..self.pieces).all(|_| {
            let next = place.then(&self.step);
            let free = checker.holds(next.origin())
                && checker.holds(self.farthest(place, next))
                && checker.shape_is_free(&place, &self.shape, inflation_m);
            place = next;
            free
        })
    }

    /// Where the piece from one placement to the other is farthest out between its ends, along x and along y; where it
    /// is not, its end.
    fn farthest(&self, from: Placement, to: Placement) -> Point2 {
        let (start, end, mut farthest) = (from.direction(), to.direction(), to.origin());
        // An arc turns back along an axis where it runs across it.
        if start.x * end.x < 0.0 {
            farthest.x = from.origin().x + (start.y.signum() - start.y) / self.arc.curvature;
        }
        if start.y * end.y < 0.0 {
            farthest.y = from.origin().y - (start.x.signum() - start.x) / self.arc.curvature;
        }
        farthest
    }
}

/// Whether `word` can be driven from `from`, which is within bounds, keeping `inflation_m` from everything.
pub(super) fn word_is_free(
    checker: &CollisionChecker,
    from: &PlanarPose,
    word: &Word,
    inflation_m: f64,
) -> bool {
    // The joints lie furthest out: most words that fail do so at one.
    let mut joint = *from;
    for arc in word.arcs().split_last().map_or(&[][..], |(_, before)| before) {
        joint = arc.end(&joint);
        if !checker.is_free(&joint, inflation_m) {
            return false;
        }
    }
    let mut pose = *from;
    word.arcs().iter().all(|&arc| {
        let free = SweptArc::new(checker, arc).is_free(checker, &Placement::new(&pose), inflation_m);
        pose = arc.end(&pose);
        free
    })
}

/// A steering angle held in one gear: a step of the lattice, and a small one to come close to what blocks the way.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    pub(super) step: SweptArc,
    creep: SweptArc,
}

/// Creeps in a step.
const CREEPS: u32 = 8;

impl Motion {
    pub(super) fn new(checker: &CollisionChecker, arc: Arc) -> Self {
        let creep = Arc::new(arc.curvature, arc.length_m / f64::from(CREEPS));
        Self { step: SweptArc::new(checker, arc), creep: SweptArc::new(checker, creep) }
    }

    /// How far this motion goes from `place` before something blocks it, with the sign of the gear, m; none if
    /// nothing does within `steps` steps.
    pub(super) fn until_blocked(
        &self,
        checker: &CollisionChecker,
        place: &Placement,
        inflation_m: f64,
        steps: u32,
    ) -> Option<f64> {
        let mut place = *place;
        for step in 0..steps {
            if self.step.is_free(checker, &place, inflation_m) {
                place = self.step.after(&place);
                continue;
            }
            let mut creeps = 0;
            while creeps < CREEPS && self.creep.is_free(checker, &place, inflation_m) {
                place = self.creep.after(&place);
                creeps += 1;
            }
            let length_m =
                self.step.arc().length_m * f64::from(step) + self.creep.arc().length_m * f64::from(creeps);
            return Some(length_m);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use motion::VehicleInfo;

    use super::*;
    use crate::problem::{Limits, Problem};
    use crate::reeds_shepp::Words;

    /// An open field.
    fn checker(bounds: [f64; 4]) -> CollisionChecker {
        CollisionChecker::new(&Problem {
            vehicle: VehicleInfo::default(),
            limits: Limits::default(),
            bounds,
            obstacles: Vec::new(),
            start: PlanarPose::default(),
            start_speed_mps: 0.0,
            start_acceleration_mps2: 0.0,
            start_curvature: None,
            goal: PlanarPose::default(),
        })
        .unwrap()
    }

    /// A half circle of 8 m radius to the left reaches x = 8 m half way; both its ends are at x = 0.
    #[test]
    fn an_arc_whose_ends_are_within_bounds_is_not_free_where_it_swings_out_of_them() {
        let (start, end) = (PlanarPose::default(), PlanarPose::new(0.0, 16.0, PI));
        let words = Words::between(&start, &end, 1.0 / 8.0);
        let word = *words.as_slice().iter().min_by(|a, b| a.length_m().total_cmp(&b.length_m())).unwrap();
        assert!((word.length_m() - 8.0 * PI).abs() < 1e-6, "the half circle");
        for (x_max, is_free) in [(8.1, true), (7.9, false)] {
            assert_eq!(word_is_free(&checker([-20.0, x_max, -20.0, 20.0]), &start, &word, 0.0), is_free);
            // The other way round, and mirrored.
            let mirrored = checker([-x_max, 20.0, -20.0, 20.0]);
            let back = Arc::new(-1.0 / 8.0, -8.0 * PI);
            assert_eq!(
                SweptArc::new(&mirrored, back).is_free(&mirrored, &Placement::new(&start), 0.0),
                is_free
            );
        }
    }

    /// Wherever along a piece it is farthest out: not only in its middle.
    #[test]
    fn a_piece_swings_out_where_it_turns_back() {
        for (curvature, length_m) in [(0.2, PIECE_M), (-0.2, PIECE_M), (0.2, -PIECE_M), (-0.2, -PIECE_M)] {
            for share in [0.05, 0.3, 0.5, 0.9] {
                // Begins so far before the place where it runs along y, farthest out along x.
                let arc = Arc::new(curvature, length_m);
                let top = PlanarPose::new(0.0, 0.0, if curvature > 0.0 { PI / 2.0 } else { -PI / 2.0 });
                let from = Arc::new(curvature, -share * length_m).end(&top);
                for yaw in [0.0, PI / 2.0, PI, -PI / 2.0] {
                    let (sin, cos) = f64::sin_cos(yaw);
                    let turned = PlanarPose::new(
                        cos * from.x - sin * from.y,
                        sin * from.x + cos * from.y,
                        from.yaw + yaw,
                    );
                    let is_free = |room_m: f64| {
                        let checker = checker([
                            if yaw == PI { -room_m } else { -20.0 },
                            if yaw == 0.0 { room_m } else { 20.0 },
                            if yaw == -PI / 2.0 { -room_m } else { -20.0 },
                            if yaw == PI / 2.0 { room_m } else { 20.0 },
                        ]);
                        SweptArc::new(&checker, arc).is_free(&checker, &Placement::new(&turned), 0.0)
                    };
                    assert!(is_free(1e-4) && !is_free(-1e-5), "{curvature} {length_m} {share} {yaw}");
                }
            }
        }
    }

    /// A single piece whose ends are within bounds and whose middle, a millimetre further out, is not.
    #[test]
    fn the_middle_and_the_end_of_a_piece_count() {
        let arc = Arc::new(0.2, PIECE_M);
        // Its middle is where it is furthest along x.
        let from = Arc::new(0.2, -PIECE_M / 2.0).end(&PlanarPose::new(0.0, 0.0, PI / 2.0));
        let is_free = |x_max: f64| {
            let checker = checker([-20.0, x_max, -20.0, 20.0]);
            assert!(checker.holds(from.point()) && checker.holds(arc.end(&from).point()));
            SweptArc::new(&checker, arc).is_free(&checker, &Placement::new(&from), 0.0)
        };
        assert!(is_free(1e-4) && !is_free(-1e-4));
        // A straight piece whose middle is within bounds and whose end is not.
        let straight = |x_max: f64| {
            let checker = checker([-20.0, x_max, -20.0, 20.0]);
            let arc = SweptArc::new(&checker, Arc::new(0.0, 0.2));
            arc.is_free(&checker, &Placement::new(&PlanarPose::default()), 0.0)
        };
        assert!(straight(0.21) && !straight(0.19));
    }
}
