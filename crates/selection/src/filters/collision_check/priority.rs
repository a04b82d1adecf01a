//! Whether a pedestrian or bicycle goes first where its way crosses that of the vehicle.
//!
//! Outside of intersections it does; inside an intersection only on a crosswalk or walkway.

use lanelet_map::Map;
use lanelet_map::index::{Outline, OutlineIndex};
use motion::Point2;
use motion::occupancy::Bounds;
use std::collections::BTreeSet;

/// Map elements that decide about priority.
#[derive(Debug)]
pub(crate) struct PriorityMap {
    /// Lanelets that belong to an intersection: where they lie, and the polygon that they name.
    members: Vec<(Bounds, i64)>,
    intersections: OutlineIndex,
    crossings: OutlineIndex,
}

/// Memory of a question.
#[derive(Debug, Default)]
pub(super) struct PriorityBuffers {
    corners: Vec<[f64; 2]>,
    found: Vec<usize>,
}

impl PriorityMap {
    pub(super) fn new(map: &Map) -> Self {
        let members: Vec<(Bounds, i64)> = map
            .lanelets()
            .filter_map(|lanelet| {
                let polygon = leading_integer(lanelet.attribute("intersection_area")?);
                let corners = lanelet.outline().map(|[x, y, _]| Point2::new(x, y));
                (polygon != 0).then(|| (around(corners), polygon))
            })
            .collect();
        let crossings = OutlineIndex::of_lanelets(map, &["crosswalk", "walkway"]);
        Self { intersections: named_polygons(map, &members), members, crossings }
    }

    /// True if a pedestrian or bicycle that covers this convex polygon goes first.
    pub(super) fn is_prioritized(&self, covered: &[Point2], buffers: &mut PriorityBuffers) -> bool {
        let PriorityBuffers { corners, found } = buffers;
        corners.clear();
        corners.extend(covered.iter().map(|corner| [corner.x, corner.y]));
        let bounds = around(covered.iter().copied());
        self.intersections.meeting(corners, found);
        let is_in_intersection = found.iter().any(|&place| {
            let id = self.intersections.outlines()[place].id;
            self.members.iter().any(|(member, polygon)| *polygon == id && member.meets(&bounds))
        });
        if !is_in_intersection {
            return true;
        }
        self.crossings.meeting(corners, found);
        !found.is_empty()
    }
}

fn named_polygons(map: &Map, members: &[(Bounds, i64)]) -> OutlineIndex {
    let ids: BTreeSet<i64> = members.iter().map(|(_, id)| *id).collect();
    OutlineIndex::new(ids.into_iter().filter_map(|id| {
        let corners = map.polygon(id)?.positions().map(|[x, y, _]| [x, y]).collect();
        Some(Outline { id, corners })
    }))
}

fn around(points: impl Iterator<Item = Point2>) -> Bounds {
    points.fold(Bounds::EMPTY, |all, point| all.joined(&Bounds { min: point, max: point }))
}

/// The integer that a text begins with, as C's `atoll` reads it; 0 if there is none.
fn leading_integer(text: &str) -> i64 {
    let text = text.trim_start();
    let sign_length = usize::from(text.starts_with(['-', '+']));
    let digits = text[sign_length..].bytes().take_while(u8::is_ascii_digit).count();
    let number = text[..sign_length + digits].strip_prefix('+').unwrap_or(&text[..sign_length + digits]);
    number.parse().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_read_as_far_as_they_go() {
        for (text, number) in
            [("42", 42), (" 42abc", 42), ("-7", -7), ("+3", 3), ("none", 0), ("", 0), ("-", 0), ("1.9", 1)]
        {
            assert_eq!(leading_integer(text), number, "{text:?}");
        }
    }
}
