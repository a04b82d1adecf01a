//! What can be set about the search. Names are upstream's where upstream has them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of the search. Costs are metres of driving, so that they add up with lengths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SearchParameters {
    /// Side of a lattice cell of the reference point.
    #[schemars(range(min = 0.02, max = 2.0), extend("x-unit" = "m"))]
    pub xy_grid_resolution: f64,
    /// Width of a lattice cell of the heading.
    #[schemars(range(min = 0.005, max = 0.5), extend("x-unit" = "rad"))]
    pub phi_grid_resolution: f64,
    /// Motions tried from every node, half of them forward: steering angles evenly from side to side, an odd number,
    /// so that straight on is one of them.
    #[schemars(range(min = 6, max = 42))]
    pub next_node_num: u32,
    /// Part of the vehicle's curvature limit that the search makes use of at first. Below 1 the smoothing has room to
    /// steer.
    #[schemars(range(min = 0.1, max = 1.0))]
    pub traj_kappa_constraint_ratio: f64,
    /// Cost of a change of gear.
    #[schemars(range(min = 0.0, max = 1000.0), extend("x-unit" = "m"))]
    pub gear_switch_penalty: f64,
    /// Cost of beginning in reverse.
    #[schemars(range(min = 0.0, max = 1000.0), extend("x-unit" = "m"))]
    pub reverse_start_penalty: f64,
    /// Cost of a metre in reverse over that of a metre forward.
    #[schemars(range(min = 1.0, max = 10.0))]
    pub back_penalty: f64,
    /// Factor of the heuristic that knows no obstacles. Above 1 a first path is found sooner, and is a little dearer.
    #[schemars(range(min = 1.0, max = 5.0))]
    pub heuristic_weight: f64,
    /// Lattice of the heuristic that knows obstacles.
    #[schemars(range(min = 0.05, max = 2.0), extend("x-unit" = "m"))]
    pub grid_a_star_xy_resolution: f64,
    /// Distance to obstacles that its ways keep. Less than what the reference point of a vehicle that touches something
    /// keeps, by a lattice diagonal, or it calls what is possible impossible.
    #[schemars(range(min = 0.0, max = 5.0), extend("x-unit" = "m"))]
    pub node_radius: f64,
    /// Distance that the footprint keeps from obstacles; down to a twentieth where the space is too tight for that. The
    /// ends of the path keep what room there is.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "m"))]
    pub clearance: f64,
    /// Expansions after the first path that look for a cheaper one.
    #[schemars(range(min = 0, max = 1_000_000))]
    pub extra_expansions: u32,
    /// Expansions in all, over all attempts.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub max_expansions: u32,
    /// Entries of the queue of one attempt.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub max_queue: u32,
    /// Largest distance between poses of the path that is handed out.
    #[schemars(range(min = 0.01, max = 1.0), extend("x-unit" = "m"))]
    pub pose_spacing: f64,
}

impl Default for SearchParameters {
    fn default() -> Self {
        Self {
            xy_grid_resolution: 0.3,
            phi_grid_resolution: 0.1,
            next_node_num: 10,
            traj_kappa_constraint_ratio: 0.9,
            gear_switch_penalty: 2.0,
            reverse_start_penalty: 0.0,
            back_penalty: 1.0,
            heuristic_weight: 1.6,
            grid_a_star_xy_resolution: 0.25,
            node_radius: 0.5,
            clearance: 0.1,
            extra_expansions: 300,
            max_expansions: 150_000,
            max_queue: 200_000,
            pose_spacing: 0.1,
        }
    }
}

/// What remains of the clearance in ever tighter spaces.
const CLEARANCE_SHARES: [f64; 4] = [1.0, 0.5, 0.2, 0.05];

impl SearchParameters {
    /// Steering angles tried in each gear, odd.
    pub(super) fn steerings(&self) -> usize {
        ((self.next_node_num as usize / 2).saturating_sub(1)) | 1
    }

    /// Distances that the footprint shall keep, m, largest first.
    pub(super) fn inflations_m(&self) -> impl Iterator<Item = f64> {
        let clearance_m = self.clearance;
        CLEARANCE_SHARES.into_iter().map(move |share| share * clearance_m)
    }
}
