//! Which border segments each side of the vehicle is measured against.
//!
//! Along the candidate, at every point first the left and then the right side looks at the segments nearest to its
//! front corner and claims those that are nearer to it than to the other side. A claimed segment stays with its side,
//! and counts at all points of the candidate, also earlier ones.

use motion::Point2;

use super::borders::{Borders, NEAREST, Neighbourhoods};
use super::stance::{Side, Stance};

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
                if near.iter().all(|&border| self.is_taken(border)) {
                    continue;
                }
                for &border in nearest_of(borders, near, corner).borders() {
                    if !self.is_taken(border)
                        && borders.is_at_height(border, stance.z_m, vehicle_height_m)
                        && is_nearer_to(side, stance, borders, border)
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

    #[inline]
    fn take(&mut self, border: u32, side: Side) {
        self.taken[border as usize / 64] |= 1 << (border % 64);
        match side {
            Side::Left => self.left.push(border),
            Side::Right => self.right.push(border),
        }
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

    #[inline]
    fn offer(&mut self, distance_m2: f64, border: u32) {
        let is_before = |d: f64, b: u32| distance_m2 < d || (distance_m2 == d && border < b);
        let last = NEAREST - 1;
        if self.count == NEAREST && !is_before(self.distances_m2[last], self.borders[last]) {
            return;
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
    }
}

#[inline]
fn nearest_of(borders: &Borders, near: &[u32], place: Point2) -> Ranking {
    let mut ranking = Ranking { count: 0, distances_m2: [0.0; NEAREST], borders: [0; NEAREST] };
    for &border in near {
        ranking.offer(borders.line(border).squared_distance_to_point(place), border);
    }
    ranking
}

/// True if the segment is not farther from this side than from the other.
fn is_nearer_to(side: Side, stance: &Stance, borders: &Borders, border: u32) -> bool {
    let line = borders.line(border);
    let (left, right) =
        (line.squared_distance(&stance.side(Side::Left)), line.squared_distance(&stance.side(Side::Right)));
    match side {
        Side::Left => left <= right,
        Side::Right => right <= left,
    }
}
