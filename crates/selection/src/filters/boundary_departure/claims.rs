//! Which border segments each side of the vehicle is measured against.
//!
//! Along the candidate, at every point first the left and then the right side looks at the segments nearest to its
//! front corner and claims those that are nearer to it than to the other side. A claimed segment stays with its side,
//! and counts at all points of the candidate, also earlier ones.

use motion::{Point2, Segment};

use super::borders::{Borders, NEAREST, Neighbourhood, Neighbourhoods};
use super::stance::{Side, Stance};
use super::tolerance::CONTACT_M;

/// The segments of both sides, each in the order in which they were claimed.
#[derive(Debug, Default)]
pub(super) struct Claims {
    pub(super) left: Vec<u32>,
    pub(super) right: Vec<u32>,
    /// One bit for each segment of the map: claimed by either side.
    taken: Vec<u64>,
}

impl Claims {
    /// Claims the borders along these stances.
    pub(super) fn collect(
        &mut self,
        borders: &Borders,
        neighbourhoods: &mut Neighbourhoods,
        stances: &[Stance],
        vehicle_height_m: f64,
    ) {
        self.left.clear();
        self.right.clear();
        self.taken.clear();
        self.taken.resize(borders.len().div_ceil(64), 0);
        for stance in stances {
            for side in Side::BOTH {
                let corner = stance.side(side).start;
                let near = neighbourhoods.around(borders, corner);
                if near.possibly_nearest().all(|near| self.is_taken(near.border)) {
                    continue;
                }
                for &border in nearest_of(borders, near, corner).borders() {
                    if !self.is_taken(border)
                        && borders.is_at_height(border, stance.z_m, vehicle_height_m)
                        && is_nearer_to(side, stance, borders.line(border))
                    {
                        self.take(border, side);
                    }
                }
            }
        }
    }

    #[inline]
    fn is_taken(&self, border: u32) -> bool {
        self.taken[border as usize / 64] >> (border % 64) & 1 == 1
    }

    fn take(&mut self, border: u32, side: Side) {
        self.taken[border as usize / 64] |= 1 << (border % 64);
        match side {
            Side::Left => self.left.push(border),
            Side::Right => self.right.push(border),
        }
    }
}

/// True if the segment is not farther from this side than from the other.
#[inline]
fn is_nearer_to(side: Side, stance: &Stance, line: &Segment) -> bool {
    if let Some(nearer) = half_of(stance, line) {
        return nearer == side;
    }
    let (this, other) = (stance.side(side), stance.side(side.other()));
    line.squared_distance(&this) <= line.squared_distance(&other)
}

/// The side of the vehicle's middle line that the whole segment lies on: it is nearer to the side there, as the sides
/// mirror each other in that line. `None` if that cannot be told.
#[inline]
fn half_of(stance: &Stance, line: &Segment) -> Option<Side> {
    /// Squared length below which the corner of the vehicle is a right angle, m².
    const RIGHT_ANGLE_M2: f64 = 1e-9;
    let across = stance.front_left - stance.front_right;
    let along = stance.rear_left - stance.front_left;
    if across.dot(&along).abs() > RIGHT_ANGLE_M2 {
        return None;
    }
    let to_left = |end: Point2| across.dot(&((end - stance.front_left) + (end - stance.front_right)));
    let (start, end) = (to_left(line.start), to_left(line.end));
    let clear = CONTACT_M * across.norm_squared();
    if start > clear && end > clear {
        Some(Side::Left)
    } else if start < -clear && end < -clear {
        Some(Side::Right)
    } else {
        None
    }
}

/// The nearest segments to a place so far, nearest first, equally near ones in the order of segments.
struct Ranking {
    count: usize,
    distances_m2: [f64; NEAREST],
    borders: [u32; NEAREST],
}

impl Ranking {
    #[inline]
    fn borders(&self) -> &[u32] {
        &self.borders[..self.count]
    }

    /// Takes the segment in if it belongs here.
    #[inline]
    fn offer(&mut self, distance_m2: f64, border: u32) -> bool {
        let is_before = |d: f64, b: u32| distance_m2 < d || (distance_m2 == d && border < b);
        let last = NEAREST - 1;
        if self.count == NEAREST && !is_before(self.distances_m2[last], self.borders[last]) {
            return false;
        }
        let mut at = self.count.min(last);
        self.count = at + 1;
        while at > 0 && is_before(self.distances_m2[at - 1], self.borders[at - 1]) {
            self.distances_m2[at] = self.distances_m2[at - 1];
            self.borders[at] = self.borders[at - 1];
            at -= 1;
        }
        self.distances_m2[at] = distance_m2;
        self.borders[at] = border;
        true
    }
}

#[inline]
fn nearest_of(borders: &Borders, near: Neighbourhood<'_>, place: Point2) -> Ranking {
    let mut ranking = Ranking { count: 0, distances_m2: [0.0; NEAREST], borders: [0; NEAREST] };
    let mut limit_m = f64::INFINITY;
    for near_one in near.borders {
        if near_one.is_beyond(limit_m) {
            break;
        }
        let border = near_one.border;
        let is_in = ranking.offer(borders.line(border).squared_distance_to_point(place), border);
        if is_in && ranking.count == NEAREST {
            limit_m = near.limit_m(ranking.distances_m2[NEAREST - 1].sqrt());
        }
    }
    ranking
}
