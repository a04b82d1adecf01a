//! Segments of line strings of given types: the nearest ones to a point, and those in a box.

use super::planar::{segment_distance, segment_meets_box};
use super::tree::{Aabb, BoxTree};
use crate::map::Map;

/// A piece of a line string between two successive points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Id of the line string.
    pub line_string: i64,
    /// Number of the first point in the line string's reading order; the second has the next number.
    pub index: u32,
    /// x, y, z of the first point in metres.
    pub start: [f64; 3],
    /// x, y, z of the second point in metres.
    pub end: [f64; 3],
}

/// An answer to [`SegmentIndex::nearest`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearSegment {
    /// Distance in the x-y plane in metres.
    pub distance: f64,
    /// Place in [`SegmentIndex::segments`].
    pub segment: usize,
}

/// All segments of the line strings of some types.
#[derive(Debug, Clone)]
pub struct SegmentIndex {
    segments: Vec<Segment>,
    tree: BoxTree,
}

impl SegmentIndex {
    /// Takes all line strings of the map whose attribute `type` is one of `types`. Segments of length 0 are kept.
    #[must_use]
    pub fn new<T: AsRef<str>>(map: &Map, types: &[T]) -> Self {
        let mut segments = Vec::new();
        for line in map.line_strings() {
            let kind = line.attribute("type");
            if !kind.is_some_and(|kind| types.iter().any(|wanted| wanted.as_ref() == kind)) {
                continue;
            }
            let pairs = line.positions().zip(line.positions().skip(1));
            segments.extend(pairs.zip(0..).map(|((start, end), index)| Segment {
                line_string: line.id(),
                index,
                start,
                end,
            }));
        }
        let boxes: Vec<Aabb> = segments
            .iter()
            .map(|segment| Aabb::around([planar(segment.start), planar(segment.end)]))
            .collect();
        let tree = BoxTree::new(&boxes);
        Self { segments, tree }
    }

    /// All segments, in the order of (line string id, index).
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The `count` nearest segments to a point by exact distance, nearest first; segments at the same
    /// distance in the order of (line string id, index). `found` is overwritten.
    pub fn nearest(&self, point: [f64; 2], count: usize, found: &mut Vec<NearSegment>) {
        found.clear();
        if count == 0 {
            return;
        }
        self.tree.nearest(point, |item| {
            let segment = item as usize;
            let Segment { start, end, .. } = self.segments[segment];
            let distance = segment_distance(planar(start), planar(end), point);
            let place = found.partition_point(|near| {
                near.distance < distance || (near.distance == distance && near.segment < segment)
            });
            if place < count {
                found.truncate(count - 1);
                found.insert(place, NearSegment { distance, segment });
            }
            if found.len() < count { f64::INFINITY } else { found[count - 1].distance.powi(2) }
        });
    }

    /// All segments within `distance` metres of a point (inclusive), nearest first; segments at the same distance in
    /// the order of (line string id, index). `found` is overwritten.
    pub fn near(&self, point: [f64; 2], distance: f64, found: &mut Vec<NearSegment>) {
        found.clear();
        let around = Aabb::around([point]).grown(distance);
        self.tree.meeting(&around, |item| {
            let segment = item as usize;
            let Segment { start, end, .. } = self.segments[segment];
            let near = NearSegment { distance: segment_distance(planar(start), planar(end), point), segment };
            if near.distance <= distance {
                found.push(near);
            }
        });
        found.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.segment.cmp(&b.segment)));
    }

    /// The segments that meet a box (borders included), as places in [`Self::segments`], ascending. `found` is
    /// overwritten.
    pub fn within(&self, min: [f64; 2], max: [f64; 2], found: &mut Vec<usize>) {
        found.clear();
        self.tree.meeting(&Aabb { min, max }, |item| {
            let Segment { start, end, .. } = self.segments[item as usize];
            if segment_meets_box(planar(start), planar(end), min, max) {
                found.push(item as usize);
            }
        });
        found.sort_unstable();
    }
}

fn planar([x, y, _]: [f64; 3]) -> [f64; 2] {
    [x, y]
}
