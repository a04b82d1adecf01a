//! Centerlines as Autoware's map loader adds them before it publishes a map.

use crate::map::elements::Polyline;
use crate::map::store::{AttributeRecord, Handle, LaneletRecord, LineRecord, PointRecord, Span, Store};

/// Gives every lanelet whose bounds have at least two points a centerline of its own points and line, in no
/// layer. A centerline that was there is remembered in the attribute `waypoints`.
pub(super) fn add(store: &mut Store, resolution_m: f64) {
    let (mut left, mut right) = (Vec::new(), Vec::new());
    // In the order of ids, so that the same map gets the same new ids.
    let mut order: Vec<usize> = (0..store.lanelets.len()).collect();
    order.sort_by_key(|at| store.lanelets[*at].id);
    for at in order {
        let lanelet = store.lanelets[at];
        positions(store, lanelet.left, &mut left);
        positions(store, lanelet.right, &mut right);
        if left.len() < 2 || right.len() < 2 {
            continue;
        }
        let attributes = with_waypoints(store, &lanelet);
        let longer = length(&left).max(length(&right));
        let segments = ((longer / resolution_m).ceil() as usize).max(1);
        let middles: Vec<[f64; 3]> = resampled(&left, segments)
            .zip(resampled(&right, segments))
            .map(|(l, r)| std::array::from_fn(|axis| (l[axis] + r[axis]) / 2.0))
            .collect();
        let centerline = push_line(store, &middles);
        store.lanelets[at] = LaneletRecord { attributes, centerline, ..lanelet };
    }
}

fn positions(store: &Store, line: Handle, out: &mut Vec<[f64; 3]>) {
    out.clear();
    out.extend(Polyline::new(store, line).positions());
}

fn with_waypoints(store: &mut Store, lanelet: &LaneletRecord) -> Span {
    if lanelet.centerline == Handle::NONE {
        return lanelet.attributes;
    }
    let line = store.lines[lanelet.centerline.index()].id;
    let key = store.push_key(b"waypoints");
    let value = store.push_text(line.to_string().as_bytes());
    let start = store.attributes.len();
    // First of equal keys, so that it replaces one that the file already has.
    store.attributes.push(AttributeRecord { key, value });
    store.attributes.extend_from_within(lanelet.attributes.range());
    store.close_attributes(start)
}

fn push_line(store: &mut Store, positions: &[[f64; 3]]) -> Handle {
    let id = next_id(store);
    let start = store.line_points.len();
    for position in positions {
        let id = next_id(store);
        store.line_points.push(store.points.len() as u32);
        store.points.push(PointRecord { id, position: *position, attributes: Span::default() });
    }
    let points = Span::new(start, store.line_points.len());
    let index = store.lines.len() as u32;
    store.lines.push(LineRecord { id, attributes: Span::default(), points });
    Handle::new(index, false)
}

fn next_id(store: &mut Store) -> i64 {
    let id = store.id_counter;
    store.id_counter = id.saturating_add(1);
    id
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2) + (b[2] - a[2]).powi(2)).sqrt()
}

fn length(line: &[[f64; 3]]) -> f64 {
    line.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// Positions at `segments` + 1 equal steps of arc length, with both ends. The line has at least two points.
fn resampled(line: &[[f64; 3]], segments: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
    let step = length(line) / segments as f64;
    // `end` is the far end of the current segment of the line, `passed` the arc length at its near end.
    let (mut end, mut passed) = (1, 0.0);
    (0..=segments).map(move |at| {
        if at == segments {
            return line[line.len() - 1];
        }
        let wanted = step * at as f64;
        let mut segment = distance(line[end - 1], line[end]);
        while end + 1 < line.len() && passed + segment <= wanted {
            passed += segment;
            end += 1;
            segment = distance(line[end - 1], line[end]);
        }
        let share = if segment > 0.0 { ((wanted - passed) / segment).clamp(0.0, 1.0) } else { 0.0 };
        let (a, b) = (line[end - 1], line[end]);
        std::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resampling_walks_the_line_in_equal_steps() {
        let line = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 5.0, 0.0]];
        let found: Vec<_> = resampled(&line, 4).collect();
        let expected = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 3.0, 0.0], [3.0, 5.0, 0.0]];
        assert_eq!(found, expected);
        let standing = [[1.0, 1.0, 1.0]; 2];
        assert_eq!(resampled(&standing, 1).collect::<Vec<_>>(), standing);
    }
}
