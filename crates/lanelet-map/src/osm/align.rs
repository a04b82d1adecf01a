//! Which way round a lanelet reads its bounds: so that the left one lies to the left of the right one.

/// Whether the left and the right bound must be read the other way round. Bounds are given in the present reading
/// order. Bounds that touch count as neither left nor right and are turned at every call.
pub(super) fn turns(left: &[[f64; 3]], right: &[[f64; 3]]) -> (bool, bool) {
    if left.is_empty() || right.is_empty() || (left.len() <= 1 && right.len() <= 1) {
        return (false, false);
    }
    let is_right_of_left = signed_distance(left, middle(right)) < 0.0;
    let turn_left = left.len() > 1 && !is_right_of_left;
    let middle_of_left = if turn_left {
        let turned: Vec<[f64; 3]> = left.iter().rev().copied().collect();
        middle(&turned)
    } else {
        middle(left)
    };
    let is_left_of_right = signed_distance(right, middle_of_left) > 0.0;
    (turn_left, right.len() > 1 && !is_left_of_right)
}

/// A point halfway by count; of up to two points the mean. The line is not empty.
fn middle(line: &[[f64; 3]]) -> [f64; 3] {
    if line.len() > 2 {
        return line[line.len() / 2];
    }
    let (first, last) = (line[0], line[line.len() - 1]);
    std::array::from_fn(|axis| (first[axis] + last[axis]) / 2.0)
}

/// Distance in space from a line, positive where the point lies to its left in the x-y plane.
fn signed_distance(line: &[[f64; 3]], point: [f64; 3]) -> f64 {
    let mut nearest = (f64::INFINITY, 0, false);
    for at in 1..line.len() {
        let (distance_2, at_end) = to_segment(line[at - 1], line[at], point);
        if distance_2 < nearest.0 {
            nearest = (distance_2, at, at_end);
        }
    }
    let (distance_2, end, at_end) = nearest;
    if end == 0 {
        return f64::NAN;
    }
    let (a, b) = (line[end - 1], line[end]);
    let mut left = is_left(a, b, point);
    // Beyond a corner the segment after it may see the point on the other side; the sharper one is right.
    let after_corner = line.iter().position(|p| *p == b).and_then(|first| line.get(first + 1));
    if let Some(c) = after_corner.filter(|_| at_end)
        && is_left(b, *c, point) != left
        && is_left(a, b, *c) == left
    {
        left = !left;
    }
    if left { distance_2.sqrt() } else { -distance_2.sqrt() }
}

fn is_left(a: [f64; 3], b: [f64; 3], point: [f64; 3]) -> bool {
    (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0.0
}

/// Squared distance to a segment, and whether the nearest place is its end.
fn to_segment(a: [f64; 3], b: [f64; 3], point: [f64; 3]) -> (f64, bool) {
    let difference = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| p[axis] - q[axis]) };
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let (along, to_point) = (difference(b, a), difference(point, a));
    let projection = dot(to_point, along);
    let length_2 = dot(along, along);
    let (foot, at_end) = if projection <= 0.0 {
        (a, false)
    } else if length_2 <= projection {
        (b, true)
    } else {
        let share = projection / length_2;
        (std::array::from_fn(|axis| a[axis] + share * along[axis]), false)
    };
    let gap = difference(point, foot);
    (dot(gap, gap), at_end)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UPPER: [[f64; 3]; 3] = [[0.0, 3.0, 0.0], [5.0, 3.0, 0.0], [10.0, 3.0, 0.0]];
    const LOWER: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0]];

    fn reversed(line: &[[f64; 3]]) -> Vec<[f64; 3]> {
        line.iter().rev().copied().collect()
    }

    #[test]
    fn bounds_are_turned_into_one_direction() {
        let (upper_back, lower_back) = (reversed(&UPPER), reversed(&LOWER));
        assert_eq!(turns(&UPPER, &LOWER), (false, false));
        assert_eq!(turns(&upper_back, &LOWER), (true, false));
        assert_eq!(turns(&UPPER, &lower_back), (false, true));
        assert_eq!(turns(&upper_back, &lower_back), (true, true));
        assert_eq!(turns(&LOWER, &UPPER), (true, true));
    }

    #[test]
    fn bounds_that_touch_are_turned() {
        assert_eq!(turns(&LOWER, &LOWER), (true, true));
    }

    #[test]
    fn nothing_is_done_without_points() {
        assert_eq!(turns(&[], &LOWER), (false, false));
        assert_eq!(turns(&UPPER, &[]), (false, false));
        assert_eq!(turns(&UPPER[..1], &LOWER[..1]), (false, false));
        assert_eq!(turns(&UPPER[..1], &reversed(&LOWER)), (false, true));
    }

    #[test]
    fn beyond_a_sharp_corner_the_side_is_that_of_the_inner_angle() {
        // A line that goes east and turns back sharply to the left; the point lies beyond the corner.
        let line = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        assert!(signed_distance(&line, [12.0, 0.5, 0.0]) < 0.0);
        assert!(signed_distance(&line, [5.0, 0.5, 0.0]) > 0.0);
    }
}
