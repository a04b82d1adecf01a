//! The nodes of one search: stored flat, found by the cell of their pose, queued by their cost.

use std::collections::hash_map::Entry;
use std::collections::{BinaryHeap, HashMap};
use std::f64::consts::{PI, TAU};
use std::hash::{BuildHasherDefault, Hasher};

use motion::pose::normalize_radian;

use crate::arc::Arc;
use crate::pose::{Gear, PlanarPose};

/// How much finer cells are where something blocks the way.
const BLOCKED_FINER: f64 = 2.0;

/// A node's place in the list of nodes.
pub(super) type NodeId = u32;

/// A pose that the search has a way to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) pose: PlanarPose,
    /// Cost from the root, m.
    pub(super) cost: f64,
    /// Itself at the root.
    pub(super) parent: NodeId,
    /// Leads here from the parent.
    pub(super) arc: Arc,
    /// Gear that it was driven in; none at the root.
    pub(super) gear: Option<Gear>,
    /// Whether the arc ends where something blocks the way.
    pub(super) is_blocked: bool,
    /// Lower bound of the cost to the end, m; exact as far as the heuristic goes once `is_exact`.
    pub(super) to_go: f64,
    pub(super) is_exact: bool,
    pub(super) closed: bool,
}

impl Node {
    /// Least cost of a path through this node, as far as is known, m.
    pub(super) fn total(&self) -> f64 {
        self.cost + self.to_go
    }
}

/// Multiplies and folds: keys are small integers, and nobody attacks the table.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, key: u64) {
        let product = (self.0 ^ key).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = product ^ (product >> 32);
    }
}

/// A queued node; the greatest is the cheapest, among equals the one nearest to the end, then the oldest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Queued {
    total: f64,
    to_go: f64,
    node: NodeId,
}

impl Eq for Queued {}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let key = |q: &Self| (q.total, q.to_go);
        let (ours, theirs) = (key(self), key(other));
        theirs.0.total_cmp(&ours.0).then(theirs.1.total_cmp(&ours.1)).then(other.node.cmp(&self.node))
    }
}

/// The nodes of one search.
#[derive(Debug)]
pub(super) struct Lattice {
    low: (f64, f64),
    xy_resolution_m: f64,
    yaw_cells: f64,
    nodes: Vec<Node>,
    cells: HashMap<u64, NodeId, BuildHasherDefault<KeyHasher>>,
    queue: BinaryHeap<Queued>,
}

impl Lattice {
    pub(super) fn new(bounds: [f64; 4], xy_resolution_m: f64, yaw_resolution_rad: f64) -> Self {
        Self {
            low: (bounds[0], bounds[2]),
            xy_resolution_m,
            yaw_cells: (TAU / yaw_resolution_rad).round().max(1.0),
            nodes: Vec::new(),
            cells: HashMap::default(),
            queue: BinaryHeap::new(),
        }
    }

    pub(super) fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id as usize]
    }

    pub(super) fn queue_len(&self) -> usize {
        self.queue.len()
    }

    /// The cell of a pose within bounds reached in `gear`. Where something blocks the way cells are finer: what is
    /// gained from one change of gear to the next in a tight place is small, and such poses are few.
    pub(super) fn key(&self, pose: &PlanarPose, gear: Option<Gear>, is_blocked: bool) -> u64 {
        let finer = if is_blocked { BLOCKED_FINER } else { 1.0 };
        let cell = |value: f64, low: f64| ((value - low) * finer / self.xy_resolution_m) as u64;
        let turn = (normalize_radian(pose.yaw) + PI) / TAU;
        let yaw_cells = self.yaw_cells * finer;
        // A heading a hair below pi rounds into the cell of -pi.
        let yaw = (turn * yaw_cells) as u64 % yaw_cells as u64;
        let flags = u64::from(gear == Some(Gear::Reverse)) | u64::from(is_blocked) << 1;
        cell(pose.x, self.low.0) << 40 | cell(pose.y, self.low.1) << 16 | yaw << 2 | flags
    }

    /// Whether a node of this cost is better than what is known of its cell.
    #[inline]
    pub(super) fn improves(&self, key: u64, cost: f64) -> bool {
        self.cells.get(&key).is_none_or(|&id| {
            let known = self.node(id);
            !known.closed && cost < known.cost - 1e-9
        })
    }

    /// Puts a node in its cell, in place of what was there, and queues it.
    pub(super) fn insert(&mut self, key: u64, node: Node) {
        let id = self.nodes.len() as NodeId;
        match self.cells.entry(key) {
            Entry::Occupied(mut known) => {
                // Its entry in the queue is stale from now on.
                self.nodes[*known.get() as usize].closed = true;
                known.insert(id);
            }
            Entry::Vacant(cell) => {
                cell.insert(id);
            }
        }
        self.nodes.push(node);
        self.enqueue(id);
    }

    fn enqueue(&mut self, id: NodeId) {
        let &Node { cost, to_go, .. } = self.node(id);
        self.queue.push(Queued { total: cost + to_go, to_go, node: id });
    }

    /// Takes the cheapest open node out of the queue and closes it. `exact` says what the way to the end costs at
    /// least from a node that has only a bound so far; a node that turns out dearer than the next is queued again.
    pub(super) fn pop(&mut self, exact: impl Fn(&Node) -> f64) -> Option<NodeId> {
        loop {
            let Queued { node: id, .. } = self.queue.pop()?;
            if self.node(id).closed {
                continue;
            }
            if !self.node(id).is_exact {
                let to_go = exact(self.node(id));
                let node = &mut self.nodes[id as usize];
                node.is_exact = true;
                if to_go > node.to_go {
                    node.to_go = to_go;
                    if to_go < f64::INFINITY {
                        self.enqueue(id);
                    }
                    continue;
                }
            }
            self.nodes[id as usize].closed = true;
            return Some(id);
        }
    }
}
