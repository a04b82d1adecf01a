//! Spatial queries give what a look at every element gives, on generated maps and on real ones.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/shared.rs"]
mod shared;

use lanelet_map::index::{NearSegment, OutlineIndex, SegmentIndex};
use lanelet_map::{Map, MapBuilder, archive};
use proptest::prelude::*;

/// Lines on a coarse lattice, so that equal distances are frequent.
fn lattice_map(lines: &[Vec<(i8, i8)>]) -> Map {
    let mut builder = MapBuilder::new();
    let mut next_point = 1;
    for (at, line) in lines.iter().enumerate() {
        let mut ids = Vec::new();
        for (x, y) in line {
            builder.point(next_point, [f64::from(*x), f64::from(*y), 0.0], &[]).unwrap();
            ids.push(next_point);
            next_point += 1;
        }
        let kind = if at % 5 == 4 { "line_thin" } else { "road_border" };
        builder.line_string(1000 - at as i64, &ids, &[("type", kind)]).unwrap();
    }
    builder.build().unwrap()
}

fn distance(index: &SegmentIndex, segment: usize, [px, py]: [f64; 2]) -> f64 {
    let segment = index.segments()[segment];
    let (ax, ay) = (segment.start[0] - px, segment.start[1] - py);
    let (dx, dy) = (segment.end[0] - segment.start[0], segment.end[1] - segment.start[1]);
    let length_2 = dx * dx + dy * dy;
    let share = if length_2 > 0.0 { (-(ax * dx + ay * dy) / length_2).clamp(0.0, 1.0) } else { 0.0 };
    (ax + share * dx).hypot(ay + share * dy)
}

fn check_nearest(index: &SegmentIndex, point: [f64; 2], count: usize, found: &[NearSegment]) {
    let mut all: Vec<(f64, usize)> =
        (0..index.segments().len()).map(|segment| (distance(index, segment, point), segment)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(found.len(), count.min(all.len()));
    for (near, (expected, _)) in found.iter().zip(&all) {
        assert!((near.distance - expected).abs() < 1e-9, "{near:?} instead of {expected}");
        assert!((distance(index, near.segment, point) - near.distance).abs() < 1e-9);
    }
    for pair in found.windows(2) {
        let key = |near: &NearSegment| {
            let segment = index.segments()[near.segment];
            (segment.line_string, segment.index)
        };
        assert!(
            pair[0].distance < pair[1].distance
                || (pair[0].distance == pair[1].distance && key(&pair[0]) < key(&pair[1]))
        );
    }
    if let Some(last) = found.last() {
        for (expected, segment) in &all {
            let is_found = found.iter().any(|near| near.segment == *segment);
            assert!(is_found || *expected >= last.distance - 1e-9);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nearest_segments(
        lines in prop::collection::vec(prop::collection::vec((-20_i8..20, -20_i8..20), 1..8), 0..40),
        x in -25_i8..25, y in -25_i8..25, count in 0_usize..8,
    ) {
        let map = lattice_map(&lines);
        let index = SegmentIndex::new(&map, &["road_border"]);
        let point = [f64::from(x) / 2.0, f64::from(y) / 2.0];
        let mut found = Vec::new();
        index.nearest(point, count, &mut found);
        check_nearest(&index, point, count, &found);
    }

    /// Lines along the axes of a lattice: all distances are exact, so that ties are true ties.
    #[test]
    fn ties_are_broken_by_line_string_and_index(
        starts in prop::collection::vec((-6_i8..6, -6_i8..6, prop::collection::vec(-4_i8..4, 1..6)), 1..30),
        x in -8_i8..8, y in -8_i8..8, count in 1_usize..8,
    ) {
        let lines: Vec<Vec<(i8, i8)>> = starts
            .iter()
            .map(|(x, y, steps)| {
                let (mut x, mut y) = (*x, *y);
                let mut line = vec![(x, y)];
                for (at, step) in steps.iter().enumerate() {
                    if at % 2 == 0 { x += step } else { y += step }
                    line.push((x, y));
                }
                line
            })
            .collect();
        let map = lattice_map(&lines);
        let index = SegmentIndex::new(&map, &["road_border", "line_thin"]);
        let point = [f64::from(x) / 2.0, f64::from(y) / 2.0];
        let mut expected: Vec<(f64, i64, u32)> = index
            .segments()
            .iter()
            .map(|segment| {
                let gap = |axis: usize| {
                    let (a, b) = (segment.start[axis], segment.end[axis]);
                    (a.min(b) - point[axis]).max(point[axis] - a.max(b)).max(0.0)
                };
                ((gap(0) * gap(0) + gap(1) * gap(1)).sqrt(), segment.line_string, segment.index)
            })
            .collect();
        expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
        expected.truncate(count);
        let mut found = Vec::new();
        index.nearest(point, count, &mut found);
        let found: Vec<(f64, i64, u32)> = found
            .iter()
            .map(|near| {
                let segment = index.segments()[near.segment];
                (near.distance, segment.line_string, segment.index)
            })
            .collect();
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn segments_near_a_point(
        lines in prop::collection::vec(prop::collection::vec((-20_i8..20, -20_i8..20), 1..8), 0..40),
        x in -25_i8..25, y in -25_i8..25, reach in 0.0..12.0_f64,
    ) {
        let map = lattice_map(&lines);
        let index = SegmentIndex::new(&map, &["road_border"]);
        let point = [f64::from(x) / 2.0, f64::from(y) / 2.0];
        let mut found = Vec::new();
        index.near(point, reach, &mut found);
        check_nearest(&index, point, found.len(), &found);
        for segment in 0..index.segments().len() {
            let away = distance(&index, segment, point);
            if (away - reach).abs() > 1e-9 {
                prop_assert_eq!(found.iter().any(|near| near.segment == segment), away < reach);
            }
        }
    }

    #[test]
    fn segments_in_a_box(
        lines in prop::collection::vec(prop::collection::vec((-20_i8..20, -20_i8..20), 1..8), 0..40),
        x in -22_i8..22, y in -22_i8..22, width in 0_i8..9, height in 0_i8..9,
    ) {
        let map = lattice_map(&lines);
        let index = SegmentIndex::new(&map, &["road_border", "line_thin"]);
        let (min, max) = ([f64::from(x), f64::from(y)], [f64::from(x + width), f64::from(y + height)]);
        let mut found = Vec::new();
        index.within(min, max, &mut found);
        for (at, segment) in index.segments().iter().enumerate() {
            // Clip the segment against the box: what is left between the two shares is inside.
            let (mut low, mut high) = (0.0_f64, 1.0_f64);
            for axis in 0..2 {
                let (start, along) = (segment.start[axis], segment.end[axis] - segment.start[axis]);
                if along == 0.0 {
                    if start < min[axis] || start > max[axis] { high = -1.0; }
                } else {
                    let (a, b) = ((min[axis] - start) / along, (max[axis] - start) / along);
                    low = low.max(a.min(b));
                    high = high.min(a.max(b));
                }
            }
            if (low - high).abs() > 1e-9 {
                prop_assert_eq!(found.contains(&at), low < high, "{:?}", segment);
            }
        }
    }
}

#[test]
fn an_index_of_nothing_answers_nothing() {
    let map = lattice_map(&[]);
    let index = SegmentIndex::new(&map, &["road_border"]);
    let mut found = vec![NearSegment { distance: 0.0, segment: 0 }];
    index.nearest([0.0, 0.0], 5, &mut found);
    assert!(found.is_empty());
    index.near([0.0, 0.0], f64::INFINITY, &mut found);
    assert!(found.is_empty());
    let outlines = OutlineIndex::of_lanelets(&map, &["road"]);
    let mut places = vec![1];
    outlines.holding([0.0, 0.0], &mut places);
    assert!(places.is_empty());
}

#[test]
fn nearest_segments_of_real_maps() {
    let Some(dir) = shared::shared("nearest_segments_of_real_maps") else { return };
    for path in shared::golden_maps(&dir) {
        let map = archive::decode(&std::fs::read(path.with_extension("bin")).unwrap()).unwrap();
        let index = SegmentIndex::new(&map, &["road_border"]);
        let mut found = Vec::new();
        let points =
            map.lanelets().flat_map(|lanelet| lanelet.left().positions().take(2).collect::<Vec<_>>());
        for [x, y, _] in points.step_by(9).take(60) {
            index.nearest([x + 0.3, y - 0.2], 5, &mut found);
            check_nearest(&index, [x + 0.3, y - 0.2], 5, &found);
        }
    }
}

#[test]
fn lanelets_of_real_maps() {
    let Some(dir) = shared::shared("lanelets_of_real_maps") else { return };
    for path in shared::golden_maps(&dir) {
        let map = archive::decode(&std::fs::read(path.with_extension("bin")).unwrap()).unwrap();
        let index = OutlineIndex::of_lanelets(&map, &["road", "road_shoulder"]);
        assert!(!index.outlines().is_empty());
        assert!(index.outlines().is_sorted_by_key(|outline| outline.id));
        let (mut holding, mut near, mut meeting) = (Vec::new(), Vec::new(), Vec::new());
        for lanelet in map.lanelets().filter(|l| l.subtype() == Some("road")).take(40) {
            let (Some(left), Some(right)) =
                (lanelet.left().positions().nth(1), lanelet.right().positions().nth(1))
            else {
                continue;
            };
            let point = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
            index.holding(point, &mut holding);
            index.near(point, 0.0, &mut near);
            index.meeting(&[point], &mut meeting);
            assert_eq!(holding, near, "{}", path.display());
            assert_eq!(holding, meeting, "{}", path.display());
            index.near(point, 20.0, &mut near);
            assert!(holding.iter().all(|place| near.contains(place)));
            let footprint = [
                [point[0] - 4.0, point[1] - 1.0],
                [point[0] + 4.0, point[1] - 1.0],
                [point[0] + 4.0, point[1] + 1.0],
                [point[0] - 4.0, point[1] + 1.0],
            ];
            index.meeting(&footprint, &mut meeting);
            assert!(holding.iter().all(|place| meeting.contains(place)));
            assert!(meeting.iter().all(|place| near.contains(place)));
        }
    }
}
