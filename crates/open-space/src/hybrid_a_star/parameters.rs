//! What can be set about the search.

use super::SearchError;

/// Numbers of the search. Costs are metres of driving, so that they add up with lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchParameters {
    /// Side of a lattice cell of the reference point, m, 0.02 to 2.
    pub xy_resolution_m: f64,
    /// Width of a lattice cell of the heading, rad, 0.005 to 0.5.
    pub yaw_resolution_rad: f64,
    /// Curvatures tried from every node and in each gear, evenly from full right to full left, odd, 3 to 21.
    pub steerings: usize,
    /// Curvature limit of the path over that of the vehicle, 0.1 to 1. Below 1 the smoother has room to steer.
    pub curvature_ratio: f64,
    /// Cost of a change of gear, m, 0 or more.
    pub gear_change_penalty_m: f64,
    /// Cost of beginning in reverse, m, 0 or more.
    pub reverse_start_penalty_m: f64,
    /// Cost of a metre in reverse over that of a metre forward, 1 to 10.
    pub reverse_penalty: f64,
    /// Factor of the heuristic that knows no obstacles, 1 to 5. Above 1 a first path is found sooner, and is a little
    /// dearer.
    pub heuristic_weight: f64,
    /// Lattice of the obstacle heuristic, m, 0.05 to 2.
    pub heuristic_resolution_m: f64,
    /// Distance to obstacles that its ways keep, m, 0 or more. Less than the reference point of a vehicle that touches
    /// something keeps, by a lattice diagonal, or it calls what is possible impossible.
    pub heuristic_radius_m: f64,
    /// Distances that the footprint shall keep, m, largest first, 0 to 5 each, at least one. The ends of the path keep
    /// what room there is.
    pub inflations_m: Vec<f64>,
    /// Expansions after the first path that look for a cheaper one.
    pub extra_expansions: usize,
    /// Expansions in all, over all attempts.
    pub max_expansions: usize,
    /// Entries of the queue of one attempt.
    pub max_queue: usize,
    /// Largest distance between poses of the path that is handed out, m, 0.01 to 1.
    pub pose_spacing_m: f64,
}

impl Default for SearchParameters {
    fn default() -> Self {
        Self {
            xy_resolution_m: 0.3,
            yaw_resolution_rad: 0.1,
            steerings: 5,
            curvature_ratio: 0.9,
            gear_change_penalty_m: 2.0,
            reverse_start_penalty_m: 0.0,
            reverse_penalty: 1.0,
            heuristic_weight: 1.6,
            heuristic_resolution_m: 0.25,
            heuristic_radius_m: 0.5,
            inflations_m: vec![0.1, 0.05, 0.02, 0.005],
            extra_expansions: 300,
            max_expansions: 150_000,
            max_queue: 200_000,
            pose_spacing_m: 0.1,
        }
    }
}

impl SearchParameters {
    /// Tests every number against its range.
    pub(super) fn check(&self) -> Result<(), SearchError> {
        let checks: [(&'static str, f64, f64, f64, &'static str); 10] = [
            ("xy_resolution_m", self.xy_resolution_m, 0.02, 2.0, "0.02 to 2"),
            ("yaw_resolution_rad", self.yaw_resolution_rad, 0.005, 0.5, "0.005 to 0.5"),
            ("curvature_ratio", self.curvature_ratio, 0.1, 1.0, "0.1 to 1"),
            ("gear_change_penalty_m", self.gear_change_penalty_m, 0.0, 1e3, "0 to 1000"),
            ("reverse_start_penalty_m", self.reverse_start_penalty_m, 0.0, 1e3, "0 to 1000"),
            ("reverse_penalty", self.reverse_penalty, 1.0, 10.0, "1 to 10"),
            ("heuristic_weight", self.heuristic_weight, 1.0, 5.0, "1 to 5"),
            ("heuristic_resolution_m", self.heuristic_resolution_m, 0.05, 2.0, "0.05 to 2"),
            ("heuristic_radius_m", self.heuristic_radius_m, 0.0, 10.0, "0 to 10"),
            ("pose_spacing_m", self.pose_spacing_m, 0.01, 1.0, "0.01 to 1"),
        ];
        for (name, value, low, high, allowed) in checks {
            if !(low..=high).contains(&value) {
                return Err(SearchError::Parameter { name, value, allowed });
            }
        }
        let steerings = self.steerings;
        if !(3..=21).contains(&steerings) || steerings.is_multiple_of(2) {
            let value = steerings as f64;
            return Err(SearchError::Parameter {
                name: "steerings",
                value,
                allowed: "an odd number, 3 to 21",
            });
        }
        let name = "inflations_m";
        let mut last = 5.0;
        for &value in &self.inflations_m {
            if !(0.0..=last).contains(&value) {
                return Err(SearchError::Parameter { name, value, allowed: "0 to 5, largest first" });
            }
            last = value;
        }
        if self.inflations_m.is_empty() {
            return Err(SearchError::Parameter { name, value: f64::NAN, allowed: "at least one" });
        }
        Ok(())
    }
}
