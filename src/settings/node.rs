//! Parameters of the node itself.

use schemars::JsonSchema;
use selection::ranker::GeneratorSource;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Parameters that every ROS 2 node has.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NodeParameters {
    /// Take the time from the topic /clock.
    pub use_sim_time: bool,
}

/// Parameters of the selector: triggers, generators and the wire form of candidates.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SelectorParameters {
    /// Time after the last generative message at which a cycle runs without one.
    #[schemars(range(min = 1, max = 3_600_000), extend("x-unit" = "ms"))]
    pub fallback_period_ms: i64,
    /// Time after its start at which a cycle judges no further candidate; those left are not published.
    #[schemars(range(min = 1, max = 3_600_000), extend("x-unit" = "ms"))]
    pub cycle_budget_ms: i64,
    /// Beginnings of generator names that may be ranked; the first that fits a name decides what kind of planner it
    /// is. Known are DiffusionPlanner_, MLPlanner_, MinimumRuleBasedPlanner_Go and MinimumRuleBasedPlanner_Stop; others
    /// are written with their kind, as in MyPlanner_=diffusion_planner (or backup_planner_go, backup_planner_stop).
    pub generator_name_prefixes: Vec<String>,
    /// Release of the message definitions: from "0.53" on candidates carry a turn indicator command.
    #[schemars(extend("x-read-only" = true))]
    pub autoware_interface: AutowareInterface,
}

/// Release of the Autoware message definitions that is spoken on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum AutowareInterface {
    /// Candidates without turn indicator command.
    #[serde(rename = "0.52")]
    V0_52,
    /// Candidates with turn indicator command.
    #[default]
    #[serde(rename = "0.53")]
    V0_53,
}

impl Default for SelectorParameters {
    fn default() -> Self {
        let prefixes = ["DiffusionPlanner_", "MinimumRuleBasedPlanner_Go", "MinimumRuleBasedPlanner_Stop"];
        Self {
            fallback_period_ms: 150,
            cycle_budget_ms: 100,
            generator_name_prefixes: prefixes.map(str::to_owned).to_vec(),
            autoware_interface: AutowareInterface::default(),
        }
    }
}

impl SelectorParameters {
    /// The time that a cycle has.
    #[must_use]
    pub fn cycle_budget(&self) -> Duration {
        Duration::from_millis(u64::try_from(self.cycle_budget_ms).unwrap_or(0))
    }

    /// The table of generators that may be ranked.
    #[must_use]
    pub fn sources(&self) -> Vec<GeneratorSource> {
        GeneratorSource::table(&self.generator_name_prefixes)
    }
}
