//! Geometry in few digits: whole centimetres from an origin, polylines thinned and written as steps.

use motion::Point2;
use selector_actors::Cycle;

/// Deviation of a thinned line from the whole one that no eye can tell on a page, m.
const THINNING_M: f64 = 0.05;

/// Where the page's coordinates start, in the map frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Origin {
    x_m: f64,
    y_m: f64,
}

impl Origin {
    /// The vehicle's place in a cycle, on a whole metre; the map's origin if the vehicle is unknown.
    pub(super) fn of(cycle: &Cycle) -> Self {
        let odometry = cycle.scene.odometry.as_ref();
        odometry.map_or_else(Self::default, |odometry| {
            let position = odometry.pose.pose.position;
            Self { x_m: whole(position.x), y_m: whole(position.y) }
        })
    }

    pub(super) fn position(self) -> [f64; 2] {
        [self.x_m, self.y_m]
    }

    /// Centimetres from the origin.
    pub(super) fn code(self, point: Point2) -> [i64; 2] {
        [centimetres(point.x - self.x_m), centimetres(point.y - self.y_m)]
    }

    /// A polyline, thinned: the first point, then the step to each next one.
    pub(super) fn line(self, points: impl IntoIterator<Item = Point2>) -> Vec<i64> {
        let finite = points.into_iter().filter(|point| point.x.is_finite() && point.y.is_finite());
        self.steps(thinned(&finite.collect::<Vec<_>>()))
    }

    /// A polyline with every point: the first point, then the step to each next one.
    pub(super) fn steps(self, points: impl IntoIterator<Item = Point2>) -> Vec<i64> {
        let mut last = [0, 0];
        let mut steps = Vec::new();
        for point in points {
            let code = self.code(point);
            steps.extend([code[0] - last[0], code[1] - last[1]]);
            last = code;
        }
        steps
    }
}

fn whole(metres: f64) -> f64 {
    if metres.is_finite() { metres.round() } else { 0.0 }
}

/// Lengths and angles alike: hundredths, of metres or of radians times ten (see [`milliradians`]).
pub(super) fn centimetres(metres: f64) -> i64 {
    // Saturates, and gives 0 for what is no number: a page must be drawn all the same.
    (metres * 100.0).round() as i64
}

pub(super) fn milliradians(angle_rad: f64) -> i64 {
    (angle_rad * 1000.0).round() as i64
}

/// Ramer, Douglas and Peucker: drops points that lie within the tolerance of the line between those that stay.
fn thinned(points: &[Point2]) -> Vec<Point2> {
    let Some(last) = points.len().checked_sub(1) else { return Vec::new() };
    let mut keep = vec![false; points.len()];
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let distance = |at: usize| distance_to_chord(points[at], points[from], points[to]);
        let farthest = (from + 1..to).max_by(|&one, &other| distance(one).total_cmp(&distance(other)));
        if let Some(at) = farthest
            && distance(at) > THINNING_M
        {
            keep[at] = true;
            open.extend([(from, at), (at, to)]);
        }
    }
    points.iter().zip(keep).filter_map(|(point, stays)| stays.then_some(*point)).collect()
}

fn distance_to_chord(point: Point2, from: Point2, to: Point2) -> f64 {
    let (chord, offset) = (to - from, point - from);
    let length = chord.norm_squared();
    let along = if length > 0.0 { (offset.dot(&chord) / length).clamp(0.0, 1.0) } else { 0.0 };
    (offset - chord * along).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn straight_lines_keep_their_ends() {
        let line: Vec<_> = (0..50).map(|i| Point2::new(f64::from(i), 2.0)).collect();
        assert_eq!(Origin::default().line(line), [0, 200, 4900, 0]);
        assert_eq!(Origin::default().line([]), [] as [i64; 0]);
        assert_eq!(Origin::default().line([Point2::new(1.0, 1.0)]), [100, 100]);
    }

    #[test]
    fn what_is_no_number_is_left_out() {
        let line = [Point2::new(0.0, 0.0), Point2::new(f64::NAN, 1.0), Point2::new(3.0, 0.0)];
        assert_eq!(Origin::default().line(line), [0, 0, 300, 0]);
    }

    proptest! {
        #[test]
        fn every_point_is_near_the_thinned_line(
            points in proptest::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64), 2..40),
        ) {
            let points: Vec<_> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let thin = thinned(&points);
            prop_assert_eq!((thin.first(), thin.last()), (points.first(), points.last()));
            for point in &points {
                let nearest = thin
                    .windows(2)
                    .map(|ends| distance_to_chord(*point, ends[0], ends[1]))
                    .fold(f64::INFINITY, f64::min);
                prop_assert!(nearest <= THINNING_M + 1e-9);
            }
        }
    }
}
