//! Several searches of one problem that take turns until one has a path.

use super::attempt::{Attempt, Costs, Plan, Progress};
use super::{SearchError, SearchParameters, go_on};
use crate::arc::Arc;
use crate::collision::CollisionChecker;
use crate::grid_heuristic::GridHeuristic;
use crate::interruption::Interruption;
use crate::problem::Problem;

/// The first level is the plain lattice; the next ones look for contact as well, each twice as fine as the one before.
const LEVELS: usize = 5;
/// Round in which searches with less inflation join in.
const LESS_ROUND: usize = 1;
/// Their inflation, as an index.
const LESS_MARGIN: usize = 2;
/// Round in which searches that look for contact join in, if they did not before.
const CONTACT_ROUND: usize = 5;
/// A path with the next smaller inflation is taken when it is cheaper by this, m.
const MARGIN_WORTH_M: f64 = 0.5;
/// Expansions of the first turn of every search; later turns double.
const FIRST_TURN: usize = 100;
/// Expansions between two questions whether to go on.
const BETWEEN_QUESTIONS: usize = 50;
/// The ends must keep this share of their own clearance at most: they cannot move.
const END_SHARE: f64 = 0.9;

/// A path that a search found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) arcs: Vec<Arc>,
    pub(super) inflation_m: f64,
    pub(super) max_curvature: f64,
}

/// One search and what it is.
#[derive(Debug)]
struct Member<'a> {
    attempt: Attempt<'a>,
    level: usize,
    /// Index of the inflation.
    margin: usize,
    progress: Progress,
}

/// The searches of one problem.
#[derive(Debug)]
pub(super) struct Portfolio<'a> {
    problem: &'a Problem,
    checker: &'a CollisionChecker,
    /// To the goal, and to the start.
    grids: (&'a GridHeuristic, &'a GridHeuristic),
    parameters: &'a SearchParameters,
    inflations_m: Vec<f64>,
    members: Vec<Member<'a>>,
}

impl<'a> Portfolio<'a> {
    pub(super) fn new(
        problem: &'a Problem,
        checker: &'a CollisionChecker,
        grids: (&'a GridHeuristic, &'a GridHeuristic),
        parameters: &'a SearchParameters,
    ) -> Self {
        let room = checker.clearance_m(&problem.start).min(checker.clearance_m(&problem.goal)) * END_SHARE;
        let mut inflations_m: Vec<f64> = parameters.inflations_m().map(|m| m.min(room)).collect();
        inflations_m.dedup();
        Self { problem, checker, grids, parameters, inflations_m, members: Vec::new() }
    }

    /// Nodes expanded by all searches together.
    pub(super) fn expansions(&self) -> usize {
        self.members.iter().map(|member| member.attempt.expansions).sum()
    }

    /// Lets the searches take turns until one has a path, then lets all look for a cheaper one.
    pub(super) fn run(
        &mut self,
        interruption: &mut dyn FnMut() -> Option<Interruption>,
    ) -> Result<Found, SearchError> {
        let mut turn = FIRST_TURN;
        for round in 0.. {
            // What resists gets less inflation to try, then eyes for where something blocks the way.
            match round {
                0 => self.add(0, 0),
                LESS_ROUND => self.add(0, self.less_margin()),
                CONTACT_ROUND => self.add(1, self.less_margin()),
                _ => {}
            }
            let mut at = 0;
            while at < self.members.len() {
                if self.members[at].progress == Progress::Open {
                    self.advance(at, turn, interruption)?;
                    if self.members[at].attempt.path().is_some() {
                        self.improve(interruption);
                        return self.cheapest();
                    }
                    self.refine(at);
                }
                at += 1;
            }
            if round >= CONTACT_ROUND && self.members.iter().all(|member| member.progress != Progress::Open) {
                return Err(SearchError::Exhausted { expansions: self.expansions() });
            }
            turn *= 2;
        }
        Err(SearchError::Exhausted { expansions: self.expansions() })
    }

    fn less_margin(&self) -> usize {
        LESS_MARGIN.min(self.inflations_m.len() - 1)
    }

    /// What searches with less inflation keep, m.
    pub(super) fn less_inflation_m(&self) -> f64 {
        self.inflations_m[self.less_margin()]
    }

    /// Adds the searches from both ends on the lattices of `level`.
    fn add(&mut self, level: usize, margin: usize) {
        // Where one end does not get out, the other does not get in.
        if self
            .members
            .iter()
            .any(|m| m.level == level && m.margin == margin && m.progress == Progress::Exhausted)
        {
            return;
        }
        for backwards in [true, false] {
            if !self.exists(level, margin, backwards) {
                self.add_one(level, margin, backwards);
            }
        }
    }

    fn add_one(&mut self, level: usize, margin: usize, backwards: bool) {
        let parameters = self.parameters;
        let finer = f64::from(1_u32 << level.saturating_sub(1));
        let ratio = if margin == 0 { parameters.traj_kappa_constraint_ratio } else { 1.0 };
        let xy_resolution_m = parameters.xy_grid_resolution / finer;
        let plan = Plan {
            xy_resolution_m,
            yaw_resolution_rad: parameters.phi_grid_resolution / finer,
            arc_length_m: std::f64::consts::SQRT_2 * xy_resolution_m,
            steerings: parameters.steerings(),
            max_curvature: self.problem.vehicle.max_curvature() * ratio,
            inflation_m: self.inflations_m[margin],
            looks_for_contact: level > 0,
            backwards,
        };
        let grid = if backwards { self.grids.1 } else { self.grids.0 };
        let ends = (self.problem.start, self.problem.goal);
        let limits = (parameters.extra_expansions as usize, parameters.max_queue as usize);
        let attempt = Attempt::new(self.checker, grid, plan, Costs::of(parameters), ends, limits);
        self.members.push(Member { attempt, level, margin, progress: Progress::Open });
    }

    /// A search that ran dry is followed by a finer one, and by one with less inflation.
    fn refine(&mut self, at: usize) {
        let Member { level, margin, progress, .. } = self.members[at];
        if progress != Progress::Exhausted {
            return;
        }
        let backwards = self.members[at].attempt.plan().backwards;
        // Nor will the search from the other end get in where this one does not get out.
        for member in &mut self.members {
            if member.level == level && member.margin == margin {
                member.progress = Progress::Exhausted;
            }
        }
        // Less inflation first: it costs little to see that it does not help either.
        let margins = self.inflations_m.len();
        let next = (level * margins + margin + 1..LEVELS * margins)
            .map(|k| (k / margins, k % margins))
            .find(|&(level, margin)| !self.exists(level, margin, backwards));
        if let Some((level, margin)) = next {
            self.add_one(level, margin, backwards);
        }
    }

    fn exists(&self, level: usize, margin: usize, backwards: bool) -> bool {
        self.members
            .iter()
            .any(|m| m.level == level && m.margin == margin && m.attempt.plan().backwards == backwards)
    }

    fn advance(
        &mut self,
        at: usize,
        expansions: usize,
        interruption: &mut dyn FnMut() -> Option<Interruption>,
    ) -> Result<(), SearchError> {
        let mut rest = expansions;
        while rest > 0 && self.members[at].progress == Progress::Open {
            let expansions = self.expansions();
            go_on(interruption, expansions)?;
            let left = (self.parameters.max_expansions as usize).saturating_sub(expansions);
            if left == 0 {
                return Err(SearchError::OutOfExpansions { expansions });
            }
            let now = rest.min(BETWEEN_QUESTIONS).min(left);
            let member = &mut self.members[at];
            member.progress = member.attempt.run(now);
            rest -= now;
        }
        Ok(())
    }

    /// Gives every search with a path what it may still expand.
    fn improve(&mut self, interruption: &mut dyn FnMut() -> Option<Interruption>) {
        for at in 0..self.members.len() {
            let _ = self.advance(at, self.parameters.extra_expansions as usize, interruption);
        }
    }

    fn cheapest(&self) -> Result<Found, SearchError> {
        let costs = Costs::of(self.parameters);
        let found = self.members.iter().filter_map(|member| {
            let plan = member.attempt.plan();
            let arcs = member.attempt.path()?;
            let cost = costs.path(&arcs) + MARGIN_WORTH_M * member.margin as f64;
            Some((cost, Found { arcs, inflation_m: plan.inflation_m, max_curvature: plan.max_curvature }))
        });
        found
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, found)| found)
            .ok_or(SearchError::Exhausted { expansions: self.expansions() })
    }
}
