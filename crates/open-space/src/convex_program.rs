//! Quadratic and second-order cone programs, written down term by term and solved with clarabel.
//!
//! A program here is: least sum of weighted squares of affine terms, plus linear costs, such that affine terms are
//! zero, at least zero, or bound the length of a plane vector. Solving is deterministic.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::interruption::{Watch, is_cancelled};

/// Affine term: coefficients by variable, and a constant.
pub(crate) type Affine<'a> = (&'a [(usize, f64)], f64);

/// Interior-point steps before a solve is given up; easy programs need about ten.
const MAX_ITERATIONS: u32 = 100;
/// Part of the cost by which a solution may be worse than the best: a thousandth of a squared millimetre matters to no
/// vehicle.
const GAP: f64 = 1e-6;

/// A convex program under construction.
#[derive(Debug)]
pub(crate) struct ConvexProgram {
    /// Upper triangle of twice the quadratic cost.
    quadratic: Triplets,
    linear: Vec<f64>,
    constraints: Triplets,
    constants: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl ConvexProgram {
    /// A program without costs and constraints.
    pub(crate) fn new(variables: usize) -> Self {
        Self {
            quadratic: Triplets::default(),
            linear: vec![0.0; variables],
            constraints: Triplets::default(),
            constants: Vec::new(),
            cones: Vec::new(),
        }
    }

    /// Adds `weight * term²` to the cost.
    pub(crate) fn add_square(&mut self, weight: f64, (terms, constant): Affine<'_>) {
        for &(i, a) in terms {
            self.linear[i] += 2.0 * weight * constant * a;
            for &(j, b) in terms.iter().filter(|(j, _)| i <= *j) {
                self.quadratic.push(i, j, 2.0 * weight * a * b);
            }
        }
    }

    /// Adds `cost * variable` to the cost.
    pub(crate) fn add_linear(&mut self, variable: usize, cost: f64) {
        self.linear[variable] += cost;
    }

    /// Demands `term = 0`.
    pub(crate) fn zero(&mut self, term: Affine<'_>) {
        self.push_row(term);
        match self.cones.last_mut() {
            Some(SupportedConeT::ZeroConeT(rows)) => *rows += 1,
            _ => self.cones.push(SupportedConeT::ZeroConeT(1)),
        }
    }

    /// Demands `term >= 0`.
    pub(crate) fn not_negative(&mut self, term: Affine<'_>) {
        self.push_row(term);
        match self.cones.last_mut() {
            Some(SupportedConeT::NonnegativeConeT(rows)) => *rows += 1,
            _ => self.cones.push(SupportedConeT::NonnegativeConeT(1)),
        }
    }

    /// Demands `low <= variable <= high`; an infinite end demands nothing.
    pub(crate) fn within(&mut self, variable: usize, low: f64, high: f64) {
        if low.is_finite() {
            self.not_negative((&[(variable, 1.0)], -low));
        }
        if high.is_finite() {
            self.not_negative((&[(variable, -1.0)], high));
        }
    }

    /// Demands `sqrt(x² + y²) <= bound`.
    pub(crate) fn length_within(&mut self, bound: Affine<'_>, x: Affine<'_>, y: Affine<'_>) {
        for term in [bound, x, y] {
            self.push_row(term);
        }
        self.cones.push(SupportedConeT::SecondOrderConeT(3));
    }

    /// One row of `s = constant + terms`, which is clarabel's `b - A x`.
    fn push_row(&mut self, (terms, constant): Affine<'_>) {
        let row = self.constants.len();
        self.constants.push(constant);
        for &(variable, coefficient) in terms {
            self.constraints.push(row, variable, -coefficient);
        }
    }

    /// The best values of the variables; `None` when there are none (the constraints contradict each other), the solver
    /// did not get there, or `watch`, asked before each of its iterations, has cancelled it.
    ///
    /// Constraints hold to about 1e-8 of the largest number involved, at worst 1e-4: check what you rely on.
    pub(crate) fn solve(self, watch: Option<Watch>) -> Option<Vec<f64>> {
        let variables = self.linear.len();
        let quadratic = self.quadratic.into_matrix(variables, variables);
        let constraints = self.constraints.into_matrix(self.constants.len(), variables);
        let settings = DefaultSettings {
            verbose: false,
            max_iter: MAX_ITERATIONS,
            max_threads: 1,
            tol_gap_abs: GAP,
            tol_gap_rel: GAP,
            ..Default::default()
        };
        let mut solver = DefaultSolver::new(
            &quadratic,
            &self.linear,
            &constraints,
            &self.constants,
            &self.cones,
            settings,
        )
        .ok()?;
        if let Some(watch) = watch {
            solver.set_termination_callback(move |_: &_| is_cancelled(Some(&watch)));
        }
        solver.solve();
        let solution = solver.solution;
        let solved = matches!(
            solution.status,
            SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress
        );
        (solved && solution.x.iter().all(|x| x.is_finite())).then_some(solution.x)
    }
}

/// Entries of a sparse matrix in any order; repeated ones add up.
#[derive(Debug, Default)]
struct Triplets {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Triplets {
    fn push(&mut self, row: usize, column: usize, value: f64) {
        self.rows.push(row);
        self.columns.push(column);
        self.values.push(value);
    }

    fn into_matrix(self, rows: usize, columns: usize) -> CscMatrix<f64> {
        CscMatrix::new_from_triplets(rows, columns, self.rows, self.columns, self.values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_each_kind_of_constraint() {
        // Nearest to (3, 4, 5): x = y, z at most 2.
        let mut program = ConvexProgram::new(3);
        for (variable, target) in [(0, 3.0), (1, 4.0), (2, 5.0)] {
            program.add_square(1.0, (&[(variable, 1.0)], -target));
        }
        program.zero((&[(0, 1.0), (1, -1.0)], 0.0));
        program.within(2, f64::NEG_INFINITY, 2.0);
        let x = program.solve(None).unwrap();
        for (value, expected) in x.iter().zip([3.5, 3.5, 2.0]) {
            assert!((value - expected).abs() < 1e-6, "{x:?}");
        }
        // Furthest in direction (1, 1) on the disc of radius 2.
        let mut program = ConvexProgram::new(2);
        program.add_linear(0, -1.0);
        program.add_linear(1, -1.0);
        program.length_within((&[], 2.0), (&[(0, 1.0)], 0.0), (&[(1, 1.0)], 0.0));
        let x = program.solve(None).unwrap();
        assert!(x.iter().all(|value| (value - 2_f64.sqrt()).abs() < 1e-6), "{x:?}");
    }

    #[test]
    fn cross_terms_of_a_square_count() {
        // (x + y - 2)² + (x - y)² is least at (1, 1).
        let mut program = ConvexProgram::new(2);
        program.add_square(1.0, (&[(0, 1.0), (1, 1.0)], -2.0));
        program.add_square(1.0, (&[(1, -1.0), (0, 1.0)], 0.0));
        program.within(0, -10.0, 10.0);
        let x = program.solve(None).unwrap();
        assert!(x.iter().all(|value| (value - 1.0).abs() < 1e-6), "{x:?}");
    }

    #[test]
    fn a_solve_is_broken_off_between_its_iterations_and_else_not_touched() {
        use std::sync::Arc;
        use std::sync::atomic::{AtomicU32, Ordering};

        use crate::interruption::Interruption;

        let program = || {
            let mut program = ConvexProgram::new(40);
            for variable in 0..40 {
                program.add_square(1.0 + variable as f64, (&[(variable, 1.0)], -3.0));
                program.within(variable, -1.0, 2.0);
            }
            program
        };
        let interrupting = |from: u32, cause| {
            let asked = Arc::new(AtomicU32::new(0));
            let count = asked.clone();
            let watch: Watch =
                Arc::new(move || (count.fetch_add(1, Ordering::Relaxed) >= from).then_some(cause));
            (program().solve(Some(watch)), asked.load(Ordering::Relaxed))
        };
        let undisturbed = program().solve(None);
        let (watched, questions) = interrupting(u32::MAX, Interruption::Cancelled);
        assert!(questions > 3 && watched.is_some());
        assert_eq!(watched, undisturbed, "bit for bit");
        for from in 0..questions {
            assert_eq!(interrupting(from, Interruption::Cancelled), (None, from + 1));
        }
        assert_eq!(interrupting(0, Interruption::OutOfTime).0, undisturbed, "what is late is finished");
    }

    #[test]
    fn contradictions_have_no_solution() {
        let mut program = ConvexProgram::new(1);
        program.add_square(1.0, (&[(0, 1.0)], 0.0));
        program.within(0, 2.0, 1.0);
        assert_eq!(program.solve(None), None);
    }
}
