//! The parameters of the running node, behind the six parameter services.
//!
//! A change is checked as a whole; what is accepted becomes a new [`Settings`] value that takes effect between two
//! cycles. Nothing here waits, sends or reads a clock.

use std::sync::Arc;

use messages::builtin_interfaces::Time;
use messages::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, ParameterEvent, SetParametersAtomicallyRequest, SetParametersAtomicallyResponse,
    SetParametersRequest, SetParametersResponse,
};

use crate::settings::Settings;

/// The parameters of a running node.
#[derive(Clone, Debug)]
pub struct ParameterStore {
    node: String,
    settings: Arc<Settings>,
}

/// What follows from a change that was accepted.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The settings from the next cycle on.
    pub settings: Arc<Settings>,
    /// To be published on `/parameter_events`, in this order.
    pub events: Vec<ParameterEvent>,
    /// The new fallback period when it has another value than before: the timer starts anew.
    pub fallback_period_ms: Option<i64>,
    /// The new value when it has changed: the clock changes its source.
    pub use_sim_time: Option<bool>,
}

impl ParameterStore {
    /// With the settings at start; `node` is the fully qualified name.
    #[must_use]
    pub fn new(node: &str, settings: Arc<Settings>) -> Self {
        Self { node: node.to_owned(), settings }
    }

    /// The settings as they are now.
    #[must_use]
    pub fn settings(&self) -> &Arc<Settings> {
        &self.settings
    }

    /// What a node publishes once when its parameters come into being.
    #[must_use]
    pub fn declared(&self, stamp: Time) -> ParameterEvent {
        ParameterEvent { stamp, node: self.node.clone(), ..ParameterEvent::default() }
    }

    /// `get_parameters`
    #[must_use]
    pub fn get(&self, _request: &GetParametersRequest) -> GetParametersResponse {
        GetParametersResponse::default()
    }

    /// `get_parameter_types`
    #[must_use]
    pub fn types(&self, _request: &GetParameterTypesRequest) -> GetParameterTypesResponse {
        GetParameterTypesResponse::default()
    }

    /// `describe_parameters`
    #[must_use]
    pub fn describe(&self, _request: &DescribeParametersRequest) -> DescribeParametersResponse {
        DescribeParametersResponse::default()
    }

    /// `list_parameters`
    #[must_use]
    pub fn list(&self, _request: &ListParametersRequest) -> ListParametersResponse {
        ListParametersResponse::default()
    }

    /// `set_parameters`: one by one, each accepted or refused for itself.
    pub fn set(
        &mut self,
        _request: &SetParametersRequest,
        _stamp: Time,
    ) -> (SetParametersResponse, Option<Change>) {
        (SetParametersResponse::default(), None)
    }

    /// `set_parameters_atomically`: all or none.
    pub fn set_atomically(
        &mut self,
        _request: &SetParametersAtomicallyRequest,
        _stamp: Time,
    ) -> (SetParametersAtomicallyResponse, Option<Change>) {
        (SetParametersAtomicallyResponse::default(), None)
    }
}
