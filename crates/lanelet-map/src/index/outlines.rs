//! Outlines of lanelets and polygons: which of them hold a point, lie near it, or meet a footprint.

use super::planar::{holds, meets_convex, outline_distance};
use super::tree::{Aabb, BoxTree};
use crate::map::Map;

/// The closed outline of a lanelet (left bound, then right bound backwards) or polygon.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Id of the lanelet or polygon.
    pub id: i64,
    /// Corners in metres, in the x-y plane; the last one is joined to the first.
    pub corners: Vec<[f64; 2]>,
}

/// The outlines of the lanelets or polygons of some kinds.
///
/// What an outline encloses is counted by winding: where an outline runs over itself, both sheets are inside.
/// Borders belong to it.
#[derive(Debug, Clone)]
pub struct OutlineIndex {
    outlines: Vec<Outline>,
    tree: BoxTree,
}

impl OutlineIndex {
    /// Lanelets whose `subtype` is one of `subtypes`. Lanelets with an empty bound have no outline and are left
    /// out.
    #[must_use]
    pub fn of_lanelets<T: AsRef<str>>(map: &Map, subtypes: &[T]) -> Self {
        let lanelets = map
            .lanelets()
            .filter(|lanelet| is_one_of(lanelet.subtype(), subtypes))
            .filter(|lanelet| !lanelet.left().is_empty() && !lanelet.right().is_empty());
        Self::new(lanelets.map(|lanelet| Outline { id: lanelet.id(), corners: planar(lanelet.outline()) }))
    }

    /// Polygons whose `type` is one of `types`.
    #[must_use]
    pub fn of_polygons<T: AsRef<str>>(map: &Map, types: &[T]) -> Self {
        let polygons = map.polygons().filter(|polygon| is_one_of(polygon.attribute("type"), types));
        Self::new(polygons.map(|polygon| Outline { id: polygon.id(), corners: planar(polygon.positions()) }))
    }

    /// The given outlines, in the given order. Outlines of fewer than three corners enclose nothing and are left out.
    #[must_use]
    pub fn new(outlines: impl IntoIterator<Item = Outline>) -> Self {
        let outlines: Vec<Outline> =
            outlines.into_iter().filter(|outline| outline.corners.len() > 2).collect();
        let boxes: Vec<Aabb> =
            outlines.iter().map(|outline| Aabb::around(outline.corners.iter().copied())).collect();
        let tree = BoxTree::new(&boxes);
        Self { outlines, tree }
    }

    /// All outlines, in the order of ids (of the given order, if they were given).
    #[must_use]
    pub fn outlines(&self) -> &[Outline] {
        &self.outlines
    }

    /// The outlines that hold a point, as places in [`Self::outlines`], ascending. `found` is overwritten.
    pub fn holding(&self, point: [f64; 2], found: &mut Vec<usize>) {
        self.collect(&Aabb { min: point, max: point }, found, |corners| holds(corners, point));
    }

    /// The outlines at most `distance` metres away from a point (0 inside), as places, ascending. `found` is
    /// overwritten.
    pub fn near(&self, point: [f64; 2], distance: f64, found: &mut Vec<usize>) {
        let reach = Aabb { min: point, max: point }.grown(distance);
        self.collect(&reach, found, |corners| outline_distance(corners, point) <= distance);
    }

    /// The outlines that share at least one point with a convex polygon, as places, ascending. The polygon may run
    /// either way round and have any number of corners from 1. `found` is overwritten.
    pub fn meeting(&self, convex: &[[f64; 2]], found: &mut Vec<usize>) {
        let reach = Aabb::around(convex.iter().copied());
        self.collect(&reach, found, |corners| meets_convex(corners, convex));
    }

    fn collect(&self, reach: &Aabb, found: &mut Vec<usize>, is_wanted: impl Fn(&[[f64; 2]]) -> bool) {
        found.clear();
        self.tree.meeting(reach, |item| {
            if is_wanted(&self.outlines[item as usize].corners) {
                found.push(item as usize);
            }
        });
        found.sort_unstable();
    }
}

fn is_one_of<T: AsRef<str>>(kind: Option<&str>, wanted: &[T]) -> bool {
    kind.is_some_and(|kind| wanted.iter().any(|wanted| wanted.as_ref() == kind))
}

fn planar(positions: impl Iterator<Item = [f64; 3]>) -> Vec<[f64; 2]> {
    positions.map(|[x, y, _]| [x, y]).collect()
}
