//! The rule as it is written down, step by step, without any bound or index: every border is looked at everywhere.

use lanelet_map::Map;
use motion::footprint::Footprint;
use motion::trajectory::cumulative_arc_length;
use motion::{Point2, Segment, TrajectoryPoint, Vector2};

/// A segment between two successive vertices of a line string of the configured types.
struct Border {
    line_string: i64,
    line: Segment,
    heights_m: [f64; 2],
}

/// The parameters that the geometry depends on.
pub(super) struct Rule {
    pub(super) lateral_margin_m: f64,
    pub(super) braking_m: f64,
    pub(super) cutoff_s: f64,
    pub(super) vehicle_height_m: f64,
}

/// Result of one side: lateral distance, index of the point, whether critical, line string.
pub(super) type Outcome = Option<(f64, usize, bool, i64)>;

fn borders_of(map: &Map, types: &[String]) -> Vec<Border> {
    let mut borders = Vec::new();
    for line in map.line_strings() {
        if !line.attribute("type").is_some_and(|kind| types.iter().any(|wanted| wanted == kind)) {
            continue;
        }
        let vertices: Vec<[f64; 3]> = line.positions().collect();
        for pair in vertices.windows(2) {
            borders.push(Border {
                line_string: line.id(),
                line: Segment::new(Point2::new(pair[0][0], pair[0][1]), Point2::new(pair[1][0], pair[1][1])),
                heights_m: [pair[0][2], pair[1][2]],
            });
        }
    }
    borders
}

/// Sides of a footprint: left, right.
fn sides(footprint: &Footprint) -> [Segment; 2] {
    [footprint.left_side(), footprint.right_side()]
}

/// Borders of both sides in the order of claims.
fn claims(
    borders: &[Border],
    points: &[TrajectoryPoint],
    placed: &[Footprint],
    rule: &Rule,
) -> [Vec<usize>; 2] {
    let mut claimed = [Vec::new(), Vec::new()];
    for (point, footprint) in points.iter().zip(placed) {
        let sides = sides(footprint);
        for side in 0..2 {
            let corner = sides[side].start;
            let mut order: Vec<usize> = (0..borders.len()).collect();
            let distance = |at: usize| borders[at].line.squared_distance_to_point(corner);
            order.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
            for &at in order.iter().take(5) {
                let Border { line, heights_m, .. } = &borders[at];
                let z = point.pose.position.z;
                let off = (heights_m[0] - z).abs().min((heights_m[1] - z).abs());
                let is_nearer =
                    line.squared_distance(&sides[side]) <= line.squared_distance(&sides[1 - side]);
                let is_free = !claimed[0].contains(&at) && !claimed[1].contains(&at);
                if is_free && off < rule.vehicle_height_m && is_nearer {
                    claimed[side].push(at);
                }
            }
        }
    }
    claimed
}

/// Distance, offset and way from the vehicle to the border, of a side beside a border.
fn nearest_projection(side: &Segment, border: &Segment) -> Option<(f64, f64, Vector2)> {
    if let Some(crossing) = side.intersection(border) {
        return Some((0.0, (crossing - side.start).norm(), Vector2::zeros()));
    }
    let mut options: Vec<(f64, f64, Vector2)> = Vec::new();
    let mut add = |point: Point2, line: &Segment, from_vehicle: bool| {
        let (w, v) = (point - line.start, line.vector());
        let (c1, c2) = (v.dot(&w), v.norm_squared());
        if 0.0 <= c1 && c1 <= c2 {
            let foot = line.start + v * (c1 / c2);
            let (on_vehicle, to_border) =
                if from_vehicle { (point, foot - point) } else { (foot, point - foot) };
            options.push((to_border.norm_squared().sqrt(), (on_vehicle - side.start).norm(), to_border));
        }
    };
    add(side.start, border, true);
    add(side.end, border, true);
    add(border.start, side, false);
    add(border.end, side, false);
    options.into_iter().reduce(|best, other| if other.0 < best.0 { other } else { best })
}

/// What counts for a side at one footprint: distance, offset, way to the border, border.
fn beside(
    borders: &[Border],
    claimed: &[usize],
    footprint: &Footprint,
    side: &Segment,
) -> Option<(f64, f64, Vector2, usize)> {
    let mut hit: Option<(f64, f64, Vector2, usize)> = None;
    let mut nearest: Option<(f64, f64, Vector2, usize)> = None;
    for &at in claimed {
        let line = &borders[at].line;
        let offset = if footprint.front_edge().intersection(line).is_some() {
            Some(0.0)
        } else if footprint.rear_edge().intersection(line).is_some() {
            Some(side.length())
        } else {
            None
        };
        if let Some(offset) = offset {
            if hit.is_none_or(|hit| offset > hit.1) {
                hit = Some((0.0, offset, Vector2::zeros(), at));
            }
        } else if let Some((lateral, offset, way)) = nearest_projection(side, line)
            && lateral < nearest.map_or(f64::MAX, |nearest| nearest.0)
        {
            nearest = Some((lateral, offset, way, at));
        }
    }
    hit.or(nearest)
}

/// Outcomes of the left and the right side; `None` if no border is near the candidate.
pub(super) fn evaluate(
    map: &Map,
    types: &[String],
    points: &[TrajectoryPoint],
    outline: &Footprint,
    rule: &Rule,
) -> Option<[Outcome; 2]> {
    let borders = borders_of(map, types);
    let placed: Vec<Footprint> = points.iter().map(|point| outline.placed_at(&point.pose)).collect();
    let mut along = Vec::new();
    cumulative_arc_length(points, &mut along);
    let claimed = claims(&borders, points, &placed, rule);
    if claimed.iter().all(Vec::is_empty) {
        return None;
    }
    Some([0, 1].map(|side| {
        let mut passed = false;
        let mut least: Outcome = None;
        for (index, point) in points.iter().enumerate() {
            let line = sides(&placed[index])[side];
            let Some((mut lateral, offset, way, at)) =
                beside(&borders, &claimed[side], &placed[index], &line)
            else {
                continue;
            };
            if lateral > 0.0 && passed {
                let cross = (line.start - line.end).perp(&way);
                if (side == 0 && cross < 0.0) || (side == 1 && cross > 0.0) {
                    lateral = -lateral;
                }
            }
            passed |= lateral < 0.01;
            let is_soon =
                along[index] - offset <= rule.braking_m || point.time_from_start.seconds() <= rule.cutoff_s;
            if lateral <= rule.lateral_margin_m && is_soon {
                return Some((lateral, index, true, borders[at].line_string));
            }
            if least.is_none_or(|least| lateral < least.0) {
                least = Some((lateral, index, false, borders[at].line_string));
            }
        }
        least
    }))
}
