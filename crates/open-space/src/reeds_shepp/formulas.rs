//! The base formulas of the words, for a turning radius of 1. The other words are their images: driven with all
//! lengths negated (time-flip), with left and right exchanged (reflection), both, and from the goal to the start.
//!
//! Signs of the lengths are part of a word's definition (`LRL` turns left forward, right in reverse, left either way)
//! and keep the families apart. They are tested with a slack, because a piece of no length can come out negative.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{MAX_PIECES, Turn, norm};
use crate::pose::PlanarPose;
use Turn::{Left as L, Right as R, Straight as S};

/// Slack of the sign conditions, rad.
const SIGN: f64 = 1e-12;
/// Turns of straight-curve-straight words are larger than this, rad: smaller ones need endless straights.
const SCS_TURN: f64 = 0.1;

type Lengths = [f64; MAX_PIECES];

/// A base formula.
pub(super) struct Formula {
    pub(super) turns: &'static [Turn],
    /// Whether the time-flipped images are other words.
    pub(super) flippable: bool,
    /// Whether the images from the goal to the start are other words.
    pub(super) reversible: bool,
    pub(super) solve: fn(&Goal) -> Option<Lengths>,
}

const fn formula(
    turns: &'static [Turn],
    flippable: bool,
    reversible: bool,
    solve: fn(&Goal) -> Option<Lengths>,
) -> Formula {
    Formula { turns, flippable, reversible, solve }
}

pub(super) const FORMULAS: [Formula; 9] = [
    formula(&[S, L, S], false, false, sls),
    formula(&[L, S, L], true, false, lsl),
    formula(&[L, S, R], true, false, lsr),
    formula(&[L, R, L], true, true, lrl),
    formula(&[L, R, L, R], true, false, lrlr_through),
    formula(&[L, R, L, R], true, false, lrlr_between),
    formula(&[L, R, S, L], true, true, lrsl),
    formula(&[L, R, S, R], true, true, lrsr),
    formula(&[L, R, S, L, R], true, false, lrslr),
];

/// The goal in the frame of the start, lengths in turning radii, with what the formulas share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    x: f64,
    y: f64,
    yaw: f64,
    sin: f64,
    cos: f64,
    /// From the centre of the first left turn to that of a last left turn.
    left_to_left: Polar,
    /// From the centre of the first left turn to that of a last right turn.
    left_to_right: Polar,
}

#[derive(Clone, Copy, Debug)]
struct Polar {
    radius: f64,
    angle: f64,
}

impl Polar {
    fn of(x: f64, y: f64) -> Self {
        Self { radius: (x * x + y * y).sqrt(), angle: y.atan2(x) }
    }

    /// With x negated.
    fn flipped(self) -> Self {
        Self { radius: self.radius, angle: norm(PI - self.angle) }
    }
}

impl Goal {
    pub(super) fn new(from: &PlanarPose, to: &PlanarPose, max_curvature: f64) -> Self {
        let (dx, dy) = ((to.x - from.x) * max_curvature, (to.y - from.y) * max_curvature);
        let (sin, cos) = from.yaw.sin_cos();
        let yaw = from.yaw_to(to);
        let (goal_sin, goal_cos) = yaw.sin_cos();
        Self::at(cos * dx + sin * dy, cos * dy - sin * dx, yaw, goal_sin, goal_cos)
    }

    fn at(x: f64, y: f64, yaw: f64, sin: f64, cos: f64) -> Self {
        let left_to_left = Polar::of(x - sin, y - 1.0 + cos);
        let left_to_right = Polar::of(x + sin, y - 1.0 - cos);
        Self { x, y, yaw, sin, cos, left_to_left, left_to_right }
    }

    /// The goal whose words, with left and right exchanged, lead to this one.
    pub(super) fn reflected(&self) -> Self {
        Self::at(self.x, -self.y, -self.yaw, -self.sin, self.cos)
    }

    /// The goal whose words, with all lengths negated, lead to this one.
    pub(super) fn flipped(&self) -> Self {
        Self {
            x: -self.x,
            y: self.y,
            yaw: -self.yaw,
            sin: -self.sin,
            cos: self.cos,
            left_to_left: self.left_to_left.flipped(),
            left_to_right: self.left_to_right.flipped(),
        }
    }

    /// The goal whose words, read from their ends, lead to this one.
    pub(super) fn seen_backwards(&self) -> Self {
        let (x, y) = (self.x * self.cos + self.y * self.sin, self.x * self.sin - self.y * self.cos);
        Self::at(x, y, self.yaw, self.sin, self.cos)
    }
}

fn not_negative(angle: f64) -> bool {
    angle >= -SIGN
}

fn not_positive(angle: f64) -> bool {
    angle <= SIGN
}

fn sls(goal: &Goal) -> Option<Lengths> {
    let turn = norm(goal.yaw);
    if turn <= SCS_TURN || PI - turn <= SIGN {
        return None;
    }
    let last = goal.y / goal.sin - (0.5 * turn).tan();
    let first = goal.x - goal.sin - last * goal.cos;
    Some([first, turn, last, 0.0, 0.0])
}

fn lsl(goal: &Goal) -> Option<Lengths> {
    let Polar { radius: u, angle: t } = goal.left_to_left;
    let v = norm(goal.yaw - t);
    (not_negative(t) && not_negative(v)).then_some([t, u, v, 0.0, 0.0])
}

fn lsr(goal: &Goal) -> Option<Lengths> {
    let Polar { radius: distance, angle: direction } = goal.left_to_right;
    if distance < 2.0 {
        return None;
    }
    let u = (distance * distance - 4.0).sqrt();
    let t = norm(direction + 2.0_f64.atan2(u));
    let v = norm(t - goal.yaw);
    (not_negative(t) && not_negative(v)).then_some([t, u, v, 0.0, 0.0])
}

fn lrl(goal: &Goal) -> Option<Lengths> {
    let Polar { radius: distance, angle: direction } = goal.left_to_left;
    if distance > 4.0 {
        return None;
    }
    let u = -2.0 * (0.25 * distance).asin();
    let t = norm(direction + 0.5 * u + PI);
    let v = norm(goal.yaw - t + u);
    not_negative(t).then_some([t, u, v, 0.0, 0.0])
}

/// First and last turn of a word of four turns whose middle ones are `u` and `v`.
fn outer_turns(u: f64, v: f64, goal: &Goal) -> (f64, f64) {
    let delta = norm(u - v);
    let a = u.sin() - delta.sin();
    let b = u.cos() - delta.cos() - 1.0;
    let direction = norm(goal.left_to_right.angle - b.atan2(a));
    let side = 2.0 * (delta.cos() - v.cos() - u.cos()) + 3.0;
    let first = norm(if side < 0.0 { direction + PI } else { direction });
    (first, norm(first - u + v - goal.yaw))
}

/// Forward through the first cusp: the middle turns have opposite signs.
fn lrlr_through(goal: &Goal) -> Option<Lengths> {
    let distance = goal.left_to_right.radius;
    let rho = 0.25 * (2.0 + distance);
    if rho > 1.0 {
        return None;
    }
    let u = rho.acos();
    let (t, v) = outer_turns(u, -u, goal);
    (not_negative(t) && not_positive(v)).then_some([t, u, -u, v, 0.0])
}

/// The middle turns lie between the cusps: both in reverse.
fn lrlr_between(goal: &Goal) -> Option<Lengths> {
    let distance = goal.left_to_right.radius;
    let rho = (20.0 - distance * distance) / 16.0;
    if !(0.0..=1.0).contains(&rho) {
        return None;
    }
    // rho >= 0 is the condition that this is a quarter turn at most
    let u = -rho.acos();
    let (t, v) = outer_turns(u, u, goal);
    (not_negative(t) && not_negative(v)).then_some([t, u, u, v, 0.0])
}

fn lrsl(goal: &Goal) -> Option<Lengths> {
    let Polar { radius: distance, angle: direction } = goal.left_to_left;
    if distance < 2.0 {
        return None;
    }
    let r = (distance * distance - 4.0).sqrt();
    let u = 2.0 - r;
    let t = norm(direction + r.atan2(-2.0));
    let v = norm(goal.yaw - FRAC_PI_2 - t);
    (not_negative(t) && not_positive(u) && not_positive(v)).then_some([t, -FRAC_PI_2, u, v, 0.0])
}

fn lrsr(goal: &Goal) -> Option<Lengths> {
    let Polar { radius: distance, angle: direction } = goal.left_to_right;
    if distance < 2.0 {
        return None;
    }
    let t = norm(direction + FRAC_PI_2);
    let u = 2.0 - distance;
    let v = norm(t + FRAC_PI_2 - goal.yaw);
    (not_negative(t) && not_positive(u) && not_positive(v)).then_some([t, -FRAC_PI_2, u, v, 0.0])
}

fn lrslr(goal: &Goal) -> Option<Lengths> {
    let Polar { radius: distance, angle: direction } = goal.left_to_right;
    if distance < 2.0 {
        return None;
    }
    let u = 4.0 - (distance * distance - 4.0).sqrt();
    if !not_positive(u) {
        return None;
    }
    // The centres and the straight line's ends make a right-angled triangle with a leg of 2.
    let t = norm(direction + (4.0 - u).atan2(-2.0));
    let v = norm(t - goal.yaw);
    (not_negative(t) && not_negative(v)).then_some([t, -FRAC_PI_2, u, -FRAC_PI_2, v])
}
