//! The union of the road lanelets, and whether a convex outline lies on it.

use super::borders::Borders;
use super::lanes::Lanes;
use super::quad::Quad;
use lanelet_map::Map;
use lanelet_map::index::OutlineIndex;
use motion::Point2;
use motion::geometry::convex_overlap_within;
use motion::occupancy::Bounds;

/// The road, made once for a map.
#[derive(Debug)]
pub(crate) struct Road {
    outlines: OutlineIndex,
    pub(super) lanes: Lanes,
    borders: Borders,
}

impl Road {
    /// The lanelets of some subtypes; `None` if there are none.
    pub(super) fn new(map: &Map, subtypes: &[String]) -> Option<Self> {
        let outlines = OutlineIndex::of_lanelets(map, subtypes);
        let lanes = Lanes::new(outlines.outlines())?;
        let borders = Borders::new(&outlines, &lanes);
        Some(Self { outlines, lanes, borders })
    }

    /// True if a convex outline inside a box meets no border and begins on the road: then all of it is on the road.
    pub(super) fn covers(&self, outline: &[Point2], bounds: &Bounds, holding: &mut Vec<usize>) -> bool {
        let meets_border = self
            .borders
            .any_meeting(bounds, |border| convex_overlap_within(outline, &[border.start, border.end], 0.0));
        !meets_border && outline.first().is_some_and(|&first| self.holds(first, holding))
    }

    /// As [`Self::covers`] for the outline of the vehicle. A point that is known to be on the road saves a search if the
    /// outline holds it.
    pub(super) fn covers_vehicle(&self, at: &Quad, known: Option<Point2>, holding: &mut Vec<usize>) -> bool {
        let meets_border = self.borders.any_meeting(&at.bounds, |border| {
            !at.is_clearly_apart_from(border)
                && convex_overlap_within(&at.corners, &[border.start, border.end], 0.0)
        });
        !meets_border
            && (known.is_some_and(|point| at.clearly_holds(point)) || self.holds(at.corners[0], holding))
    }

    fn holds(&self, point: Point2, holding: &mut Vec<usize>) -> bool {
        self.outlines.holding([point.x, point.y], holding);
        !holding.is_empty()
    }
}
