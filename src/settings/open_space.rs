//! Parameters of the open-space trajectory provider and everything below it.

use open_space::OpenSpaceParameters;
use open_space::fallback::FallbackParameters;
use open_space::partition::PartitionParameters;
use open_space::provider::ProviderParameters;
use open_space::region_of_interest::RegionParameters;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of planning in open space, all in one group: their names are too common to stand alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OpenSpaceSettings {
    /// The group.
    pub open_space: OpenSpaceGroup,
}

/// The parts of the open-space trajectory provider.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OpenSpaceGroup {
    /// Let the node plan on its own towards a goal in open space; what it plans is a candidate like any other. To be
    /// driven it needs entries in generator_name_prefixes, too.
    pub enable: bool,
    /// What the vehicle is planned in.
    pub region: RegionParameters,
    /// When a plan is made, kept or given up.
    pub provider: ProviderParameters,
    /// How a plan is made.
    pub planner: OpenSpaceParameters,
    /// How a plan is followed part by part.
    pub partition: PartitionParameters,
    /// When the vehicle brakes for what moves into its way.
    pub fallback: FallbackParameters,
}
