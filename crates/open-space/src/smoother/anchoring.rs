//! The convex program of the smoother: points on a plane curve, straightened within bounds about their places.

use motion::{Point2, Vector2};

use super::SmootherParameters;
use crate::convex_program::ConvexProgram;
use crate::interruption::Watch;

/// Distance of points for which the weights are meant, m.
const WEIGHTED_SPACING_M: f64 = 0.1;
/// Weight of the squared headings (rad²) that the ends miss, in units of the reference weight; what they still miss
/// is made up for when the path is laid through the points.
const HEADING_WEIGHT_M2: f64 = 1e4;
/// Weight of the squared curvature (1/m²) that the start misses, in the same units.
const START_CURVATURE_WEIGHT_M4: f64 = 1e4;
/// Bounds below this (m) hold a point where it is.
const ANCHORED_M: f64 = 1e-6;

/// Points to be straightened.
#[derive(Clone, Copy, Debug)]
pub(super) struct AnchoredPoints<'a> {
    /// Their places, at least four, `spacing_m` apart.
    pub(super) reference: &'a [Point2],
    /// How far each may move along x and y.
    pub(super) bounds_m: &'a [f64],
    pub(super) spacing_m: f64,
    /// Unit vectors along which the curve leaves the first point and reaches the last, in either direction.
    pub(super) headings: Option<[Vector2; 2]>,
    /// Curvature that the curve begins with, as a vehicle along the first heading feels it, 1/m.
    pub(super) start_curvature: Option<f64>,
    /// Beyond it curvature costs extra.
    pub(super) curvature_limit: Option<f64>,
    pub(super) weights: &'a SmootherParameters,
}

impl AnchoredPoints<'_> {
    /// Where the points go, `None` when the solver fails or `watch` breaks it off.
    pub(super) fn solve(&self, watch: Option<Watch>) -> Option<Vec<Point2>> {
        let places = Places::new(self);
        let count = self.reference.len();
        if places.free == 0 {
            return Some(self.reference.to_vec());
        }
        let cones = if self.curvature_limit.is_some() { count - 2 } else { 0 };
        let mut program = ConvexProgram::new(2 * places.free + cones);
        self.add_costs(&mut program, &places);
        self.add_headings(&mut program, &places);
        for (k, bound) in self.bounds_m.iter().enumerate() {
            for variable in places.variables[k].into_iter().flat_map(|first| [first, first + 1]) {
                program.within(variable, -bound, *bound);
            }
        }
        if let Some(limit) = self.curvature_limit {
            self.add_curvature(&mut program, &places, limit);
        }
        let x = program.solve(watch)?;
        let moved = places.variables.iter().zip(self.reference).map(|(variable, place)| match variable {
            Some(first) => place + Vector2::new(x[*first], x[first + 1]),
            None => *place,
        });
        Some(moved.collect())
    }

    /// Weights over that of the reference: the solver likes numbers near one.
    fn weight(&self, weight: f64) -> f64 {
        weight / self.weights.weight_ref_deviation
    }

    fn add_costs(&self, program: &mut ConvexProgram, places: &Places<'_>) {
        let weights = self.weights;
        let ratio = WEIGHTED_SPACING_M / self.spacing_m;
        let costs: [(f64, &[f64]); 3] = [
            (weights.weight_path_length * ratio.powi(2), &[-1.0, 1.0]),
            (weights.weight_fem_pos_deviation * ratio.powi(4), &[1.0, -2.0, 1.0]),
            (weights.weight_curvature_rate * ratio.powi(6), &[-1.0, 3.0, -3.0, 1.0]),
        ];
        for (weight, stencil) in costs.into_iter().filter(|(weight, _)| *weight > 0.0) {
            for first in 0..=self.reference.len() - stencil.len() {
                for axis in [Vector2::x(), Vector2::y()] {
                    let term = places.term(first, stencil, &axis);
                    program.add_square(self.weight(weight), (&term.0, term.1));
                }
            }
        }
        for variable in 0..2 * places.free {
            program.add_square(1.0, (&[(variable, 1.0)], 0.0));
        }
    }

    fn add_headings(&self, program: &mut ConvexProgram, places: &Places<'_>) {
        let Some(headings) = self.headings else { return };
        let last = self.reference.len() - 4;
        // One-sided first derivatives of third order.
        let stencils = [(0, [-11.0, 18.0, -9.0, 2.0]), (last, [-2.0, 9.0, -18.0, 11.0])];
        for (heading, (first, stencil)) in headings.iter().zip(stencils) {
            let stencil = stencil.map(|coefficient| coefficient / (6.0 * self.spacing_m));
            let term = places.term(first, &stencil, &Vector2::new(-heading.y, heading.x));
            program.add_square(HEADING_WEIGHT_M2, (&term.0, term.1));
        }
        if let Some(curvature) = self.start_curvature {
            // A one-sided second derivative of second order; across the heading it is the curvature in both gears.
            let scale = 1.0 / (self.spacing_m * self.spacing_m);
            let stencil = [2.0, -5.0, 4.0, -1.0].map(|coefficient| coefficient * scale);
            let (terms, bend) = places.term(0, &stencil, &Vector2::new(-headings[0].y, headings[0].x));
            program.add_square(START_CURVATURE_WEIGHT_M4, (&terms, bend - curvature));
        }
    }

    fn add_curvature(&self, program: &mut ConvexProgram, places: &Places<'_>, limit: f64) {
        let scale = 1.0 / (self.spacing_m * self.spacing_m);
        let stencil = [scale, -2.0 * scale, scale];
        let price = self.weight(self.weights.weight_curvature_constraint_slack_var);
        for first in 0..self.reference.len() - 2 {
            let slack = 2 * places.free + first;
            program.not_negative((&[(slack, 1.0)], 0.0));
            program.add_linear(slack, price);
        }
        for first in 0..self.reference.len() - 2 {
            let slack = 2 * places.free + first;
            let [x, y] = [Vector2::x(), Vector2::y()].map(|axis| places.term(first, &stencil, &axis));
            program.length_within((&[(slack, 1.0)], limit), (&x.0, x.1), (&y.0, y.1));
        }
    }
}

/// Which points move, as which variables: two each, displacements along x and y.
#[derive(Debug)]
struct Places<'a> {
    reference: &'a [Point2],
    variables: Vec<Option<usize>>,
    free: usize,
}

impl<'a> Places<'a> {
    fn new(points: &AnchoredPoints<'a>) -> Self {
        let mut free = 0;
        let variables = points
            .bounds_m
            .iter()
            .map(|bound| {
                (*bound > ANCHORED_M).then(|| {
                    free += 1;
                    2 * (free - 1)
                })
            })
            .collect();
        Self { reference: points.reference, variables, free }
    }

    /// The sum of points from `first` on, weighted by `stencil` (whose sum is zero), along `axis`.
    fn term(&self, first: usize, stencil: &[f64], axis: &Vector2) -> (Vec<(usize, f64)>, f64) {
        let origin = self.reference[first];
        let mut terms = Vec::with_capacity(2 * stencil.len());
        let mut constant = 0.0;
        for (k, coefficient) in (first..).zip(stencil) {
            constant += coefficient * (self.reference[k] - origin).dot(axis);
            for (offset, part) in [axis.x, axis.y].into_iter().enumerate().filter(|(_, part)| *part != 0.0) {
                terms.extend(self.variables[k].map(|variable| (variable + offset, coefficient * part)));
            }
        }
        (terms, constant)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn upstream(weight_fem_pos_deviation: f64) -> SmootherParameters {
        SmootherParameters {
            weight_fem_pos_deviation,
            weight_curvature_rate: 0.0,
            weight_path_length: 1.0,
            weight_ref_deviation: 1e3,
            ..SmootherParameters::default()
        }
    }

    #[test]
    fn check_vector_of_the_quadratic_program() {
        let at = |i: u32| Point2::new(0.1 * f64::from(i), 0.05 * (TAU * f64::from(i) / 10.0).sin());
        let reference: Vec<Point2> = (0..=10).map(at).collect();
        let mut bounds = [2.0; 11];
        for k in [0, 1, 2, 9, 10] {
            bounds[k] = 0.0;
        }
        let moved = AnchoredPoints {
            reference: &reference,
            bounds_m: &bounds,
            spacing_m: 0.1,
            headings: None,
            start_curvature: None,
            curvature_limit: None,
            weights: &upstream(1e8),
        }
        .solve(None)
        .unwrap();
        let expected = [
            0.0, 0.029389, 0.047553, 0.046838, 0.033039, 0.011952, -0.010629, -0.028910, -0.037094,
            -0.029389, 0.0,
        ];
        for (point, y) in moved.iter().zip(expected) {
            assert!((point.y - y).abs() < 1e-6, "{} instead of {y}", point.y);
        }
    }

    /// A quarter circle of 2 m between two straight lines of 3 m.
    fn corner() -> Vec<Point2> {
        let (radius, step) = (2.0, 0.1);
        let arc = radius * TAU / 4.0;
        let at = |s: f64| {
            if s < 3.0 {
                Point2::new(s, 0.0)
            } else if s < 3.0 + arc {
                let angle = (s - 3.0) / radius;
                Point2::new(3.0 + radius * angle.sin(), radius * (1.0 - angle.cos()))
            } else {
                Point2::new(3.0 + radius, radius + s - 3.0 - arc)
            }
        };
        (0..91).map(|k| at(step * f64::from(k))).collect()
    }

    fn sharpest(points: &[Point2], spacing_m: f64) -> f64 {
        points.windows(3).fold(0.0, |most, p| {
            let bend: Vector2 = p[0].coords - 2.0 * p[1].coords + p[2].coords;
            most.max(bend.norm() / (spacing_m * spacing_m))
        })
    }

    #[test]
    fn curvature_stays_within_its_limit_and_ends_keep_their_headings() {
        let reference = corner();
        let mut bounds = vec![2.0; reference.len()];
        bounds[0] = 0.0;
        *bounds.last_mut().unwrap() = 0.0;
        let solve = |curvature_limit| {
            AnchoredPoints {
                reference: &reference,
                bounds_m: &bounds,
                spacing_m: 0.1,
                headings: Some([Vector2::x(), Vector2::y()]),
                start_curvature: None,
                curvature_limit,
                weights: &upstream(1e5),
            }
            .solve(None)
            .unwrap()
        };
        assert!(sharpest(&reference, 0.1) > 0.49);
        assert!(sharpest(&solve(None), 0.1) > 0.45, "without a limit it stays as sharp as the corner");
        let moved = solve(Some(0.4));
        assert!(sharpest(&moved, 0.1) < 0.4 + 1e-5, "{}", sharpest(&moved, 0.1));
        assert_eq!((moved[0], moved[90]), (reference[0], reference[90]));
        let (first, last) = (moved[1] - moved[0], moved[90] - moved[89]);
        assert!(first.y.abs() < 1e-3 && last.x.abs() < 1e-3, "{first} {last}");
    }

    #[test]
    fn anchored_points_do_not_move() {
        let reference = corner();
        let moved = AnchoredPoints {
            reference: &reference,
            bounds_m: &vec![0.0; reference.len()],
            spacing_m: 0.1,
            headings: None,
            start_curvature: None,
            curvature_limit: Some(0.3),
            weights: &upstream(1e8),
        }
        .solve(None)
        .unwrap();
        assert_eq!(moved, reference);
    }
}
