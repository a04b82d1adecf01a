//! Which part of the map is on the page, and where.
//!
//! The picture is turned so that the vehicle drives to the right. It holds all of the candidate that is looked at, and
//! as much around it as fits the page.

use super::svg::Px;
use motion::{Point2, Pose};

/// Width of every picture, px.
pub(super) const WIDTH_PX: f64 = 960.0;
const LEAST_HEIGHT_PX: f64 = 250.0;
const MOST_HEIGHT_PX: f64 = 470.0;
/// Around what must be seen, m.
const MARGIN_M: f64 = 4.0;
/// No picture shows less than this, m: fewer metres would make a car fill the page.
const LEAST_WIDTH_M: f64 = 44.0;
/// Places farther from the vehicle than this are not asked for, m: one that is astray must not shrink all others.
const FARTHEST_M: f64 = 120.0;
/// Lines may be off by this, px.
const GRAIN_PX: f64 = 0.4;

/// From map to page.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    sin: f64,
    cos: f64,
    /// Left edge and upper edge in the turned frame, m.
    left_m: f64,
    top_m: f64,
    scale: f64,
    height_px: f64,
}

impl Camera {
    /// A camera that shows the vehicle and, of the places, those that are near enough.
    pub(super) fn new(ego: &Pose, places: impl Iterator<Item = Point2>) -> Self {
        let (sin, cos) = ego.yaw().sin_cos();
        let turned = |p: Point2| (cos * p.x + sin * p.y, cos * p.y - sin * p.x);
        let ego = ego.point();
        let is_near = |p: &Point2| (p - ego).norm() <= FARTHEST_M;
        let (u, v) = turned(ego);
        let ([mut left, mut right], [mut low, mut high]) = ([u, u], [v, v]);
        for (u, v) in places.filter(is_near).map(turned) {
            (left, right) = (left.min(u), right.max(u));
            (low, high) = (low.min(v), high.max(v));
        }
        let (wide_m, high_m) = (right - left + 2.0 * MARGIN_M, high - low + 2.0 * MARGIN_M);
        let scale = (WIDTH_PX / wide_m.max(LEAST_WIDTH_M)).min(MOST_HEIGHT_PX / high_m);
        let height_px = (high_m * scale).max(LEAST_HEIGHT_PX);
        Self {
            sin,
            cos,
            left_m: 0.5 * (left + right) - 0.5 * WIDTH_PX / scale,
            top_m: 0.5 * (low + high) + 0.5 * height_px / scale,
            scale,
            height_px,
        }
    }

    /// Height of the drawing, px.
    pub(super) fn height_px(&self) -> f64 {
        self.height_px
    }

    /// Length on the page, px.
    pub(super) fn length(&self, length_m: f64) -> f64 {
        length_m * self.scale
    }

    /// Place on the page.
    pub(super) fn at(&self, place: Point2) -> Px {
        let (u, v) = (self.cos * place.x + self.sin * place.y, self.cos * place.y - self.sin * place.x);
        [(u - self.left_m) * self.scale, (self.top_m - v) * self.scale]
    }

    /// Whether a place is on the page, with this much around it, px.
    pub(super) fn shows(&self, [x, y]: Px, around: f64) -> bool {
        (-around..=WIDTH_PX + around).contains(&x) && (-around..=self.height_px + around).contains(&y)
    }

    /// Corners on the page; `None` if the shape is not on it, or not finite.
    pub(super) fn shape(&self, corners: impl Iterator<Item = Point2>) -> Option<Vec<Px>> {
        let corners: Vec<Px> = thinned(corners.map(|corner| self.at(corner)));
        self.meets(&corners).then_some(corners)
    }

    /// The parts of a line that are on the page.
    pub(super) fn runs(&self, line: impl Iterator<Item = Point2>) -> Vec<Vec<Px>> {
        let line: Vec<Px> = thinned(line.map(|place| self.at(place)));
        let mut runs: Vec<Vec<Px>> = Vec::new();
        let mut is_on = false;
        for pair in line.windows(2) {
            let meets = self.meets(pair);
            match runs.last_mut().filter(|_| is_on && meets) {
                Some(run) => run.push(pair[1]),
                None if meets => runs.push(pair.to_vec()),
                None => {}
            }
            is_on = meets;
        }
        runs
    }

    /// Whether the box around places meets the page; false if one of them is not finite.
    fn meets(&self, places: &[Px]) -> bool {
        let end = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
            places.iter().map(|place| place[axis]).fold(start, pick)
        };
        let [left, right] = [end(0, f64::min, f64::INFINITY), end(0, f64::max, f64::NEG_INFINITY)];
        let [top, bottom] = [end(1, f64::min, f64::INFINITY), end(1, f64::max, f64::NEG_INFINITY)];
        places.iter().flatten().all(|number| number.is_finite())
            && left <= WIDTH_PX
            && right >= 0.0
            && top <= self.height_px
            && bottom >= 0.0
    }
}

/// The line without places that no eye would miss (Ramer, Douglas and Peucker); both ends always stay, and so does what
/// is no number.
fn thinned(places: impl Iterator<Item = Px>) -> Vec<Px> {
    let places: Vec<Px> = places.collect();
    let Some(last) = places.len().checked_sub(1) else { return places };
    let mut stays = vec![false; places.len()];
    (stays[0], stays[last]) = (true, true);
    let mut spans = vec![(0, last)];
    while let Some((from, to)) = spans.pop() {
        let off = |at: &usize| distance(places[*at], places[from], places[to]);
        let farthest = (from + 1..to).max_by(|a, b| off(a).total_cmp(&off(b)));
        if let Some(farthest) = farthest.filter(|at| off(at) > GRAIN_PX) {
            stays[farthest] = true;
            spans.extend([(from, farthest), (farthest, to)]);
        }
    }
    places.into_iter().zip(stays).filter_map(|(place, stays)| stays.then_some(place)).collect()
}

/// From a place to the line between two others; infinite where there is none.
fn distance(place: Px, start: Px, end: Px) -> f64 {
    let [dx, dy] = [end[0] - start[0], end[1] - start[1]];
    let [px, py] = [place[0] - start[0], place[1] - start[1]];
    let squared = dx * dx + dy * dy;
    let part = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let distance = (px - part * dx).hypot(py - part * dy);
    if distance.is_finite() { distance } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn line(places: &[(f64, f64)]) -> impl Iterator<Item = Point2> {
        places.iter().map(|&(x, y)| Point2::new(x, y))
    }

    #[test]
    fn the_vehicle_drives_to_the_right() {
        let ego = Pose::from_xy_yaw(100.0, 50.0, FRAC_PI_2);
        let camera = Camera::new(&ego, line(&[(100.0, 50.0), (100.0, 90.0)]));
        let (start, end) = (camera.at(Point2::new(100.0, 50.0)), camera.at(Point2::new(100.0, 90.0)));
        let left = camera.at(Point2::new(98.0, 50.0));
        assert!(end[0] - start[0] > 600.0 && (end[1] - start[1]).abs() < 1e-6);
        assert!(left[1] < start[1], "left of the vehicle is up");
        for place in [start, end] {
            assert!(camera.shows(place, 0.0));
        }
    }

    #[test]
    fn a_place_astray_does_not_shrink_the_rest() {
        let ego = Pose::from_xy_yaw(0.0, 0.0, 0.0);
        let near = Camera::new(&ego, line(&[(30.0, 0.0)]));
        let astray = Camera::new(&ego, line(&[(30.0, 0.0), (1e9, 0.0), (f64::NAN, 0.0)]));
        assert_eq!(near.length(1.0), astray.length(1.0));
    }

    #[test]
    fn lines_are_cut_into_what_is_seen() {
        let camera = Camera::new(&Pose::from_xy_yaw(0.0, 0.0, 0.0), line(&[(40.0, 0.0)]));
        let far = 1e4;
        let runs = camera.runs(line(&[(0.0, 0.0), (20.0, 0.0), (far, far), (far, 0.0), (21.0, 0.0)]));
        assert_eq!(runs.len(), 2, "{runs:?}");
        assert!(camera.runs(line(&[(far, far), (far, 0.0)])).is_empty());
        assert!(camera.shape(line(&[(0.0, 0.0), (1.0, 0.0), (f64::NAN, 1.0)])).is_none());
    }

    #[test]
    fn straight_lines_need_two_places_and_corners_stay() {
        let straight = (0..50).map(|step| [f64::from(step), 0.1 * f64::from(step % 2)]);
        assert_eq!(thinned(straight).len(), 2);
        let corner = [[0.0, 0.0], [5.0, 0.0], [10.0, 0.0], [10.0, 5.0], [10.0, 10.0]];
        assert_eq!(thinned(corner.into_iter()), [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]);
        let back = [[0.0, 0.0], [10.0, 0.0], [4.0, 0.0]];
        assert_eq!(thinned(back.into_iter()), back);
        let broken = [[0.0, 0.0], [f64::NAN, 0.0], [4.0, 0.0]];
        assert_eq!(thinned(broken.into_iter()).len(), 3);
        assert!(thinned(std::iter::empty()).is_empty());
    }

    #[test]
    fn a_tall_scene_fits_too() {
        let camera = Camera::new(&Pose::from_xy_yaw(0.0, 0.0, 0.0), line(&[(5.0, 80.0), (5.0, -80.0)]));
        assert!(camera.height_px() <= MOST_HEIGHT_PX + 1e-9);
        assert!(camera.shows(camera.at(Point2::new(5.0, 80.0)), 0.0));
    }
}
