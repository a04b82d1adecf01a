//! The kinds of scenes, drawn with the lane along the x axis, then turned and moved.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{Limits, PlanarPose, Point2, Problem, Random, SceneKind, VehicleInfo};
use crate::collision::Rectangle;

/// Half the length of the stretch of lane that is drawn, m.
const HALF_STREET_M: f64 = 16.0;

/// Sizes that scenes are drawn from.
struct Sizes {
    front: f64,
    rear: f64,
    half_width: f64,
    radius: f64,
    /// Free space beside the vehicle in its slot.
    gap: f64,
    tightness: f64,
}

impl Sizes {
    fn of(vehicle: &VehicleInfo, tightness: f64) -> Self {
        let rectangle = Rectangle::of(vehicle);
        Self {
            front: rectangle.front_m,
            rear: -rectangle.rear_m,
            half_width: rectangle.left_m,
            radius: 1.0 / vehicle.max_curvature(),
            gap: 0.6 - 0.3 * tightness,
            tightness,
        }
    }

    fn length(&self) -> f64 {
        self.front + self.rear
    }

    /// From generous to tight.
    fn tightening(&self, generous: f64, tight: f64) -> f64 {
        generous + (tight - generous) * self.tightness
    }

    /// Radius of the outer front corner in the tightest turn.
    fn outer_radius(&self) -> f64 {
        (self.radius + self.half_width).hypot(self.front)
    }

    /// Width of the aisle that lets the vehicle back into a slot at 90 degrees in one sweep.
    fn aisle_for_reverse(&self) -> f64 {
        let inner = self.radius - self.half_width;
        self.outer_radius() - (2.0 * inner * self.gap - self.gap * self.gap).max(0.0).sqrt()
    }

    /// The same for driving in forward.
    fn aisle_for_forward(&self) -> f64 {
        let side = self.radius + self.half_width;
        (self.outer_radius().powi(2) - (side + self.gap).powi(2)).max(0.0).sqrt() + side
    }
}

/// A scene while it is drawn.
struct Drawing<'r> {
    random: &'r mut Random,
    obstacles: Vec<Vec<Point2>>,
}

impl Drawing<'_> {
    fn wall(&mut self, points: &[(f64, f64)]) {
        self.obstacles.push(points.iter().map(|&(x, y)| Point2::new(x, y)).collect());
    }

    /// A closed box, half of the time with its corners cut.
    fn car(&mut self, (x, y): (f64, f64), yaw: f64, length: f64, width: f64) {
        let (l, w) = (length / 2.0, width / 2.0);
        let cut = 0.35_f64.min(0.5 * w);
        let outline: &[(f64, f64)] = if self.random.chance(0.5) {
            &[(l, w), (-l, w), (-l, -w), (l, -w), (l, w)]
        } else {
            &[
                (l, w - cut),
                (l - cut, w),
                (cut - l, w),
                (-l, w - cut),
                (-l, cut - w),
                (cut - l, -w),
                (l - cut, -w),
                (l, cut - w),
                (l, w - cut),
            ]
        };
        let (sin, cos) = (yaw + self.random.between(-0.02, 0.02)).sin_cos();
        let placed = outline.iter().map(|&(u, v)| Point2::new(x + u * cos - v * sin, y + u * sin + v * cos));
        self.obstacles.push(placed.collect());
    }

    /// Cars side by side along x with their noses at `y`, or turned along the lane, outside of `keep_out`.
    fn row(&mut self, y: f64, along: bool, keep_out: (f64, f64)) {
        for side in [-1.0, 1.0] {
            let mut edge = if side < 0.0 { -keep_out.0 } else { keep_out.1 };
            while edge < HALF_STREET_M {
                let (length, width) = (self.random.between(3.9, 4.8), self.random.between(1.7, 1.9));
                let (across, deep) = if along { (length, width) } else { (width, length) };
                let middle = y - 0.5 * deep;
                self.car(
                    (side * (edge + 0.5 * across), middle),
                    if along { 0.0 } else { FRAC_PI_2 },
                    length,
                    width,
                );
                edge += across + self.random.between(0.5, 1.1);
            }
        }
    }

    fn lane_wall(&mut self, y: f64) {
        self.wall(&[(-HALF_STREET_M - 6.0, y), (HALF_STREET_M + 6.0, y)]);
    }
}

/// Start, goal and box of the reference point.
type Task = (PlanarPose, PlanarPose, [f64; 4]);

pub(super) fn problem(kind: SceneKind, tightness: f64, random: &mut Random) -> Problem {
    let vehicle = super::vehicle(random);
    let sizes = Sizes::of(&vehicle, tightness);
    let mut drawing = Drawing { random, obstacles: Vec::new() };
    let (start, goal, bounds) = match kind {
        SceneKind::Parallel => parallel(&mut drawing, &sizes),
        SceneKind::PerpendicularForward => {
            slot(&mut drawing, &sizes, FRAC_PI_2, true, sizes.aisle_for_forward(), false)
        }
        SceneKind::PerpendicularReverse => {
            slot(&mut drawing, &sizes, FRAC_PI_2, false, sizes.aisle_for_reverse(), false)
        }
        SceneKind::Angled => angled(&mut drawing, &sizes),
        SceneKind::DeadEnd => dead_end(&mut drawing, &sizes),
        SceneKind::NarrowAisle => {
            let forward = drawing.random.chance(0.3);
            let aisle = if forward { sizes.aisle_for_forward() } else { sizes.aisle_for_reverse() };
            slot(&mut drawing, &sizes, FRAC_PI_2, forward, 0.9 * aisle, true)
        }
        SceneKind::PullOut => pull_out(&mut drawing, &sizes),
        SceneKind::UTurn => u_turn(&mut drawing, &sizes),
        SceneKind::Clutter => clutter(&mut drawing, &sizes),
    };
    let obstacles = drawing.obstacles;
    let problem = Problem {
        vehicle,
        limits: Limits::default(),
        bounds,
        obstacles,
        start,
        start_speed_mps: 0.0,
        start_acceleration_mps2: 0.0,
        start_curvature: None,
        goal,
    };
    // A third of the scenes are turned. Bounds stay a box about all of the old one.
    let turn = if random.chance(0.3) { random.between(-PI, PI) } else { 0.0 };
    let shift = (random.between(-150.0, 150.0), random.between(-150.0, 150.0));
    moved(problem, turn, shift)
}

fn moved(mut problem: Problem, turn: f64, (dx, dy): (f64, f64)) -> Problem {
    let (sin, cos) = turn.sin_cos();
    let place = |p: Point2| Point2::new(dx + cos * p.x - sin * p.y, dy + sin * p.x + cos * p.y);
    for point in problem.obstacles.iter_mut().flatten() {
        *point = place(*point);
    }
    for pose in [&mut problem.start, &mut problem.goal] {
        let p = place(pose.point());
        *pose = PlanarPose::new(p.x, p.y, pose.yaw + turn);
    }
    let [x0, x1, y0, y1] = problem.bounds;
    let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| place(Point2::new(x, y)));
    let (low, high) = corners.iter().fold((corners[0], corners[0]), |(l, h), c| (l.inf(c), h.sup(c)));
    problem.bounds = [low.x, high.x, low.y, high.y];
    problem
}

/// A pose in the lane, a little off its direction.
fn in_lane(drawing: &mut Drawing<'_>, x: f64, y: f64, yaw: f64) -> PlanarPose {
    let random = &mut *drawing.random;
    PlanarPose::new(
        x + random.between(-0.3, 0.3),
        y + random.between(-0.1, 0.1),
        yaw + random.between(-0.08, 0.08),
    )
}

/// A row of cars along the lane with a gap in it, the lane above.
fn parallel(drawing: &mut Drawing<'_>, sizes: &Sizes) -> Task {
    let gap = sizes.length() + sizes.tightening(2.4, 0.6);
    let depth = 2.0 * sizes.half_width + 0.25;
    let lane = sizes.tightening(6.0, 4.0);
    drawing.row(0.0, true, (-0.5 * gap, 0.5 * gap));
    drawing.lane_wall(-depth);
    drawing.lane_wall(lane);
    let goal = PlanarPose::new(-0.5 * (sizes.front - sizes.rear), -0.5 * depth, 0.0);
    let start = in_lane(drawing, 0.5 * gap - sizes.rear + 1.0, sizes.half_width + 0.9, 0.0);
    (start, goal, [-HALF_STREET_M, HALF_STREET_M, -depth, lane])
}

/// A slot at `angle` to the lane, below it, with cars beside it or an outline round it.
fn slot(
    drawing: &mut Drawing<'_>,
    sizes: &Sizes,
    angle: f64,
    forward: bool,
    need: f64,
    cars_opposite: bool,
) -> Task {
    let aisle = need * sizes.tightening(1.45, 0.9);
    // The bottom runs along the lane: the vehicle's near corner meets it before its axis does.
    let slant = sizes.half_width / angle.tan();
    let depth = sizes.length() + 0.4 + slant;
    let half = sizes.half_width + sizes.gap;
    // The slot's axis leads down from the middle of its mouth.
    let axis = (-angle.cos(), -angle.sin());
    let half_mouth = half / angle.sin();
    let deep = |x: f64| (x + depth * axis.0, depth * axis.1);
    if angle == FRAC_PI_2 && drawing.random.chance(0.6) {
        drawing.row(0.0, false, (-half, half));
        drawing.lane_wall(-depth);
    } else {
        let far = HALF_STREET_M + 6.0;
        drawing.wall(&[
            (-far, 0.0),
            (-half_mouth, 0.0),
            deep(-half_mouth),
            deep(half_mouth),
            (half_mouth, 0.0),
            (far, 0.0),
        ]);
    }
    if cars_opposite {
        drawing.row(aisle + 4.9, false, (0.0, 0.0));
    } else {
        drawing.lane_wall(aisle);
    }
    // Nose or tail 0.3 m from the bottom of the slot.
    let along = depth - slant - 0.3 - if forward { sizes.front } else { sizes.rear };
    let heading = axis.1.atan2(axis.0) + if forward { 0.0 } else { PI };
    let goal = PlanarPose::new(along * axis.0, along * axis.1, heading);
    // Nose first comes from the side that the slot opens to, tail first from the other.
    let from = if forward { half_mouth + sizes.front + 2.5 } else { half_mouth + 1.0 };
    let (x, yaw) = if forward { (from, PI) } else { (from, 0.0) };
    let y = (0.5 * aisle).min(sizes.half_width + 1.2);
    let start = in_lane(drawing, x, y, yaw);
    (start, goal, [-HALF_STREET_M, HALF_STREET_M, -depth, aisle])
}

fn angled(drawing: &mut Drawing<'_>, sizes: &Sizes) -> Task {
    let angle = [30.0_f64, 45.0, 60.0][(drawing.random.next_u64() % 3) as usize].to_radians();
    let need = sizes.half_width * 2.0 + 0.55 * sizes.length() * angle.sin() + 0.8;
    slot(drawing, sizes, angle, true, need, false)
}

fn dead_end(drawing: &mut Drawing<'_>, sizes: &Sizes) -> Task {
    let width = sizes.length().hypot(2.0 * sizes.half_width) * sizes.tightening(2.0, 1.2);
    drawing.wall(&[(-HALF_STREET_M - 6.0, 0.0), (8.0, 0.0), (8.0, -width), (-HALF_STREET_M - 6.0, -width)]);
    let post = drawing.random.between(-12.0, -9.0);
    drawing.car((post, -width - 1.0), 0.0, 4.0, 1.6);
    let start = in_lane(drawing, -1.5, -0.7 * width, 0.0);
    let goal = PlanarPose::new(-9.0, -0.3 * width, PI);
    (start, goal, [-HALF_STREET_M, 8.0, -width, 0.0])
}

fn u_turn(drawing: &mut Drawing<'_>, sizes: &Sizes) -> Task {
    let width = sizes.length().hypot(2.0 * sizes.half_width) * sizes.tightening(2.1, 1.2);
    drawing.lane_wall(0.0);
    drawing.lane_wall(width);
    let start = in_lane(drawing, 0.0, 0.3 * width, 0.0);
    let goal = PlanarPose::new(drawing.random.between(-4.0, 4.0), 0.7 * width, PI);
    (start, goal, [-HALF_STREET_M, HALF_STREET_M, 0.0, width])
}

/// Out of a parallel or perpendicular slot: the way in, driven the other way.
fn pull_out(drawing: &mut Drawing<'_>, sizes: &Sizes) -> Task {
    let (lane, parked, bounds) = match drawing.random.next_u64() % 3 {
        0 => parallel(drawing, sizes),
        1 => slot(drawing, sizes, FRAC_PI_2, true, sizes.aisle_for_forward(), false),
        _ => slot(drawing, sizes, FRAC_PI_2, false, sizes.aisle_for_reverse(), false),
    };
    (parked, lane, bounds)
}

fn clutter(drawing: &mut Drawing<'_>, sizes: &Sizes) -> Task {
    let half = sizes.tightening(13.0, 10.0);
    drawing.wall(&[(-half, -half), (half, -half), (half, half), (-half, half), (-half, -half + 1e-3)]);
    let boxes = 4 + (8.0 * sizes.tightness) as usize;
    for _ in 0..boxes {
        let random = &mut *drawing.random;
        let at = (random.between(-half, half), random.between(-half, half));
        let (yaw, length, width) =
            (random.between(-PI, PI), random.between(0.4, 4.5), random.between(0.4, 1.9));
        drawing.car(at, yaw, length, width);
    }
    let mut pose = |low: f64, high: f64| {
        let random = &mut *drawing.random;
        PlanarPose::new(
            random.between(low, high),
            random.between(-half + 2.0, half - 2.0),
            random.between(-PI, PI),
        )
    };
    let (start, goal) = (pose(-half + 2.0, -2.0), pose(2.0, half - 2.0));
    (start, goal, [-half, half, -half, half])
}
