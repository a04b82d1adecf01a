//! Nested times of a cycle, as Autoware's processing-time visualiser reads them.

use messages::autoware_internal_debug_msgs::{ProcessingTimeNode, ProcessingTimeTree};
use std::time::Duration;

/// Builds the tree: scopes in depth-first order, identified from 1; a repeated scope is a node of its own.
#[derive(Debug, Default)]
pub struct TimeTree {
    nodes: Vec<ProcessingTimeNode>,
}

/// A scope in the tree; children name it as their parent.
#[derive(Debug, Clone, Copy)]
pub struct Scope(i32);

/// The scope around a root.
pub const ROOT: Scope = Scope(0);

impl TimeTree {
    /// Adds a scope below `parent`. Children are to be added before the parent's next sibling.
    pub fn add(&mut self, parent: Scope, name: &str, took: Duration) -> Scope {
        // A cycle has a handful of scopes.
        let id = i32::try_from(self.nodes.len() + 1).unwrap_or(i32::MAX);
        self.nodes.push(ProcessingTimeNode {
            id,
            name: name.to_owned(),
            processing_time: milliseconds(took),
            parent_id: parent.0,
            comment: String::new(),
        });
        Scope(id)
    }

    /// The message.
    #[must_use]
    pub fn into_message(self) -> ProcessingTimeTree {
        ProcessingTimeTree { nodes: self.nodes }
    }
}

/// Milliseconds with upstream's resolution of whole microseconds, truncated.
#[must_use]
pub fn milliseconds(took: Duration) -> f64 {
    took.as_micros() as f64 / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_depth_first_and_parents_are_named() {
        let mut tree = TimeTree::default();
        let cycle = tree.add(ROOT, "process_trajectories", Duration::from_nanos(2_500_999));
        let validate = tree.add(cycle, "validate_trajectories", Duration::from_millis(1));
        tree.add(validate, "publish_debug", Duration::ZERO);
        let nodes = tree.into_message().nodes;
        assert_eq!(
            nodes.iter().map(|node| (node.id, node.parent_id)).collect::<Vec<_>>(),
            [(1, 0), (2, 1), (3, 2)]
        );
        assert_eq!(nodes[0].processing_time.to_bits(), 2.5_f64.to_bits(), "whole microseconds");
    }
}
