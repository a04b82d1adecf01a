//! One search: from one pose to another, on one lattice, with one inflation.

use super::SearchParameters;
use super::lattice::{Lattice, Node, NodeId};
use super::motion_check::{Motion, word_is_free};
use crate::arc::Arc;
use crate::collision::{CollisionChecker, Placement};
use crate::grid_heuristic::GridHeuristic;
use crate::pose::{Gear, PlanarPose};
use crate::reeds_shepp::{Word, Words, least_cost};

/// How far ahead of a place where something blocks the way the next such place is looked for, m.
const REACH_M: f64 = 3.0;

/// What costs what, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs {
    pub(super) gear_change_m: f64,
    pub(super) reverse_start_m: f64,
    pub(super) reverse_factor: f64,
    /// Factor of the cost to the end of the cheapest word, which knows no obstacles.
    pub(super) weight: f64,
}

impl Costs {
    pub(super) fn of(parameters: &SearchParameters) -> Self {
        Self {
            gear_change_m: parameters.gear_switch_penalty,
            reverse_start_m: parameters.reverse_start_penalty,
            reverse_factor: parameters.back_penalty,
            weight: parameters.heuristic_weight,
        }
    }

    /// Of driving an arc.
    pub(super) fn arc(&self, arc: &Arc) -> f64 {
        if arc.length_m < 0.0 { -arc.length_m * self.reverse_factor } else { arc.length_m }
    }

    /// Of going on in `next` after `last`.
    pub(super) fn change(&self, last: Option<Gear>, next: Gear) -> f64 {
        if last.is_some_and(|last| last != next) { self.gear_change_m } else { 0.0 }
    }

    /// Of driving a word after a motion in `last`.
    pub(super) fn word(&self, word: &Word, mut last: Option<Gear>) -> f64 {
        word.arcs().iter().fold(0.0, |sum, arc| {
            let change = self.change(last, arc.gear());
            last = Some(arc.gear());
            sum + change + self.arc(arc)
        })
    }

    /// Of a whole path.
    pub(super) fn path(&self, arcs: &[Arc]) -> f64 {
        let mut last = None;
        let mut sum = match arcs.first() {
            Some(arc) if arc.gear() == Gear::Reverse => self.reverse_start_m,
            _ => 0.0,
        };
        for arc in arcs {
            sum += self.change(last, arc.gear()) + self.arc(arc);
            last = Some(arc.gear());
        }
        sum
    }
}

/// How one search differs from another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub(super) xy_resolution_m: f64,
    pub(super) yaw_resolution_rad: f64,
    pub(super) arc_length_m: f64,
    pub(super) steerings: usize,
    pub(super) max_curvature: f64,
    pub(super) inflation_m: f64,
    /// Whether places where something blocks the way are nodes of their own.
    pub(super) looks_for_contact: bool,
    /// Whether it goes from the goal to the start, to be driven the other way.
    pub(super) backwards: bool,
}

/// How a search stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// It can go on.
    Open,
    /// It found a path and has looked for a better one long enough.
    Done,
    /// There is no node left to expand.
    Exhausted,
    /// The queue is full.
    QueueFull,
}

/// A path to the end: to a node, then along a word.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    node: NodeId,
    word: Word,
    cost: f64,
}

/// A search that can be stopped and resumed.
#[derive(Debug)]
pub(super) struct Attempt<'a> {
    checker: &'a CollisionChecker,
    /// To the end of this search.
    grid: &'a GridHeuristic,
    plan: Plan,
    costs: Costs,
    end: PlanarPose,
    motions: Vec<Motion>,
    lattice: Lattice,
    best: Option<Candidate>,
    pub(super) expansions: usize,
    /// Expansions that remain once there is a path.
    extra: usize,
    max_queue: usize,
}

impl<'a> Attempt<'a> {
    /// From `start` to `goal`, or the other way if the plan says so. `grid` leads to where it ends.
    pub(super) fn new(
        checker: &'a CollisionChecker,
        grid: &'a GridHeuristic,
        plan: Plan,
        costs: Costs,
        (start, goal): (PlanarPose, PlanarPose),
        (extra, max_queue): (usize, usize),
    ) -> Self {
        let (begin, end) = if plan.backwards { (goal, start) } else { (start, goal) };
        let lattice = Lattice::new(checker.bounds(), plan.xy_resolution_m, plan.yaw_resolution_rad);
        let motions = motions(checker, &plan);
        let mut attempt = Self {
            checker,
            grid,
            plan,
            costs,
            end,
            motions,
            lattice,
            best: None,
            expansions: 0,
            extra,
            max_queue,
        };
        let root = Node {
            pose: begin,
            cost: 0.0,
            parent: 0,
            arc: Arc::new(0.0, 0.0),
            gear: None,
            is_blocked: true,
            to_go: grid.distance_m(begin.point()),
            is_exact: false,
            closed: false,
        };
        // The lattice knows poses within bounds only.
        if checker.is_within_bounds(&begin) {
            let key = attempt.lattice.key(&begin, None, true);
            attempt.lattice.insert(key, root);
        }
        attempt
    }

    pub(super) fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Expands up to `expansions` nodes.
    pub(super) fn run(&mut self, expansions: usize) -> Progress {
        for _ in 0..expansions {
            if self.best.is_some() {
                if self.extra == 0 {
                    return Progress::Done;
                }
                self.extra -= 1;
            }
            let ended = if self.best.is_some() { Progress::Done } else { Progress::Exhausted };
            let (end, curvature, costs) = (self.end, self.plan.max_curvature, self.costs);
            let exact = |node: &Node| {
                least_cost(&node.pose, &end, curvature, |word| costs.word(word, node.gear)) * costs.weight
            };
            let Some(node) = self.lattice.pop(exact) else { return ended };
            if self.best.is_some_and(|best| self.lattice.node(node).total() >= best.cost) {
                return Progress::Done;
            }
            self.expansions += 1;
            self.connect(node);
            self.expand(node);
            if self.lattice.queue_len() > self.max_queue {
                return if self.best.is_some() { Progress::Done } else { Progress::QueueFull };
            }
        }
        Progress::Open
    }

    /// The cheapest path found, in the order it is driven.
    pub(super) fn path(&self) -> Option<Vec<Arc>> {
        let candidate = self.best?;
        let mut arcs = Vec::new();
        let mut at = candidate.node;
        while let Node { parent, arc, gear: Some(_), .. } = *self.lattice.node(at) {
            arcs.push(arc);
            at = parent;
        }
        arcs.reverse();
        arcs.extend_from_slice(candidate.word.arcs());
        if self.plan.backwards {
            arcs.reverse();
            for arc in &mut arcs {
                arc.length_m = -arc.length_m;
            }
        }
        Some(arcs)
    }

    /// Tries to reach the end from a node by a word.
    fn connect(&mut self, id: NodeId) {
        let Node { pose, cost, gear, .. } = *self.lattice.node(id);
        let limit = self.best.map_or(f64::INFINITY, |best| best.cost);
        let costs = self.costs;
        let words = Words::between(&pose, &self.end, self.plan.max_curvature);
        for (word_cost, word) in words.by_cost(|word| costs.word(word, gear)) {
            let cost = cost + word_cost;
            if cost >= limit {
                return;
            }
            if word_is_free(self.checker, &pose, &word, self.plan.inflation_m) {
                self.best = Some(Candidate { node: id, word, cost });
                return;
            }
        }
    }

    fn expand(&mut self, id: NodeId) {
        let parent = *self.lattice.node(id);
        let place = Placement::new(&parent.pose);
        let (checker, inflation_m) = (self.checker, self.plan.inflation_m);
        for at in 0..self.motions.len() {
            let motion = &self.motions[at];
            let arc = motion.step.arc();
            if !self.plan.looks_for_contact {
                if motion.step.is_free(checker, &place, inflation_m) {
                    self.offer(id, &parent, arc, motion.step.end(&parent.pose, &place), false);
                }
                continue;
            }
            // From where something blocks the way it pays to go on until the next such place.
            let straight_or_full = (at % self.plan.steerings).is_multiple_of(self.plan.steerings / 2);
            let steps =
                if parent.is_blocked && straight_or_full { (REACH_M / arc.length_m.abs()) as u32 } else { 1 };
            let blocked_m = motion.until_blocked(checker, &place, inflation_m, steps.max(1));
            if blocked_m.is_none_or(|length_m| length_m.abs() >= arc.length_m.abs()) {
                self.offer(id, &parent, arc, motion.step.end(&parent.pose, &place), false);
            }
            if let Some(length_m) = blocked_m
                && length_m != 0.0
            {
                let arc = Arc::new(arc.curvature, length_m);
                self.offer(id, &parent, arc, arc.end(&parent.pose), true);
            }
        }
    }

    /// Makes a node of where a free arc leads, if that is news.
    fn offer(&mut self, id: NodeId, parent: &Node, arc: Arc, pose: PlanarPose, is_blocked: bool) {
        let gear = Some(arc.gear());
        let step = self.costs.change(parent.gear, arc.gear()) + self.costs.arc(&arc);
        let cost = parent.cost + step;
        let key = self.lattice.key(&pose, gear, is_blocked);
        if !self.lattice.improves(key, cost) {
            return;
        }
        // Going there and on cannot be cheaper than going on from the parent.
        let to_go = self.grid.distance_m(pose.point()).max(parent.to_go - step);
        if to_go == f64::INFINITY || self.best.is_some_and(|best| cost + to_go >= best.cost) {
            return;
        }
        let node =
            Node { pose, cost, parent: id, arc, gear, is_blocked, to_go, is_exact: false, closed: false };
        self.lattice.insert(key, node);
    }
}

/// The motions tried from every node: both gears, steering angles evenly from side to side.
fn motions(checker: &CollisionChecker, plan: &Plan) -> Vec<Motion> {
    let steering = |k: usize| 2.0 * k as f64 / (plan.steerings - 1) as f64 - 1.0;
    [plan.arc_length_m, -plan.arc_length_m]
        .into_iter()
        .flat_map(|length_m| (0..plan.steerings).map(move |k| (length_m, steering(k))))
        .map(|(length_m, ratio)| Motion::new(checker, Arc::new(ratio * plan.max_curvature, length_m)))
        .collect()
}
