//! Centerlines as Autoware's map loader adds them before it publishes a map.

use crate::error::MapError;
use crate::map::elements::Polyline;
use crate::map::store::{AttributeRecord, Handle, LaneletRecord, LineRecord, PointRecord, Span, Store};

/// Most points of all centerlines of a map: ten thousand kilometres of lanes, more than a large city has. A file of a few
/// hundred bytes can claim more than any memory holds.
const MAX_POINTS: usize = 2_000_000;

/// Gives every lanelet whose bounds have at least two points a centerline of its own points and line, in no
/// layer. A centerline that was there is remembered in the attribute `waypoints`.
///
/// # Errors
/// [`MapError::EndlessCenterline`] where that would take more than [`MAX_POINTS`].
pub(super) fn add(store: &mut Store, resolution_m: f64) -> Result<(), MapError> {
    let (mut left, mut right) = (Vec::new(), Vec::new());
    let mut room = MAX_POINTS;
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
        // Saturates where the length is not even finite.
        let segments = ((longer / resolution_m).ceil() as usize).max(1);
        room = room.checked_sub(segments.saturating_add(1)).ok_or(MapError::EndlessCenterline {
            lanelet: lanelet.id,
            length_m: longer,
            limit: MAX_POINTS,
        })?;
        let middles: Vec<[f64; 3]> = resampled(&left, segments)
            .zip(resampled(&right, segments))
            .map(|(l, r)| std::array::from_fn(|axis| (l[axis] + r[axis]) / 2.0))
            .collect();
        let centerline = push_line(store, &middles);
        store.lanelets[at] = LaneletRecord { attributes, centerline, ..lanelet };
    }
    Ok(())
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
    use crate::osm::{self, OsmOptions};
    use crate::projection::Projector;

    #[test]
    fn resampling_walks_the_line_in_equal_steps() {
        let line = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 5.0, 0.0]];
        let found: Vec<_> = resampled(&line, 4).collect();
        let expected = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 3.0, 0.0], [3.0, 5.0, 0.0]];
        assert_eq!(found, expected);
        let standing = [[1.0, 1.0, 1.0]; 2];
        assert_eq!(resampled(&standing, 1).collect::<Vec<_>>(), standing);
    }

    #[test]
    fn a_lanelet_around_the_world_and_farther_gets_no_centerline() {
        for (far, is_refused) in
            [("1e3", false), ("9e7", true), ("1e9", true), ("1e12", true), ("1e300", true)]
        {
            let node = |id, x: &str, y| {
                format!(
                    r#"<node id="{id}" lat="0" lon="0"><tag k="local_x" v="{x}"/><tag k="local_y" v="{y}"/></node>"#
                )
            };
            let nodes = [node(1, "0", 0), node(2, far, 0), node(3, "0", 3), node(4, far, 3)].concat();
            let text = format!(
                r#"<osm>{nodes}<way id="10"><nd ref="3"/><nd ref="4"/></way><way id="11"><nd ref="1"/><nd ref="2"/></way>
                   <relation id="20"><member type="way" role="left" ref="10"/><member type="way" role="right" ref="11"/>
                   <tag k="type" v="lanelet"/><tag k="subtype" v="road"/></relation></osm>"#
            );
            let options = OsmOptions { projector: Some(Projector::Local), ..OsmOptions::default() };
            let read = osm::read([text.as_bytes()], &options);
            let refused = matches!(read, Err(MapError::EndlessCenterline { lanelet: 20, .. }));
            assert_eq!(refused, is_refused, "{far}: {:?}", read.err());
        }
    }
}
