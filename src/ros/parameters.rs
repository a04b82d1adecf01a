//! The parameters of the running node, behind the six parameter services.
//!
//! Names, types, ranges and descriptions come from the table of settings, which is made from the same structs as the
//! JSON schemas. A change is checked as a whole by the settings; what is accepted becomes a new [`Settings`] value
//! that takes effect between two cycles, and what is refused leaves everything as it was. Nothing here waits, sends
//! or reads a clock: requests come in as messages and answers go out as messages.

mod convert;
mod list;

use std::collections::BTreeMap;
use std::sync::Arc;

use messages::builtin_interfaces::Time;
use messages::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, Parameter, ParameterDescriptor, ParameterEvent, ParameterValue,
    SetParametersAtomicallyRequest, SetParametersAtomicallyResponse, SetParametersRequest,
    SetParametersResponse, SetParametersResult,
};

use crate::settings::{ParameterValue as Value, Settings, SettingsError};

/// The parameters of a running node.
#[derive(Clone, Debug)]
pub struct ParameterStore {
    node: String,
    settings: Arc<Settings>,
}

/// What follows from a request that changed something.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The settings from the next cycle on.
    pub settings: Arc<Settings>,
    /// To be published on `/parameter_events`, in this order: one for each change that was accepted.
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

    /// The event that tells of all parameters when the node comes up.
    #[must_use]
    pub fn declared(&self, stamp: Time) -> ParameterEvent {
        let new_parameters = self
            .settings
            .iter()
            .map(|(descriptor, value)| Parameter {
                name: descriptor.name.clone(),
                value: convert::to_wire(descriptor, value),
            })
            .collect();
        ParameterEvent { stamp, node: self.node.clone(), new_parameters, ..ParameterEvent::default() }
    }

    /// `get_parameters`: a value for each name, of type "not set" for a name that is no parameter.
    #[must_use]
    pub fn get(&self, request: &GetParametersRequest) -> GetParametersResponse {
        let value = |name: &String| {
            self.settings.find(name).map_or_else(ParameterValue::default, |(descriptor, value)| {
                convert::to_wire(descriptor, value)
            })
        };
        GetParametersResponse { values: request.names.iter().map(value).collect() }
    }

    /// `get_parameter_types`: a type for each name, "not set" for a name that is no parameter.
    #[must_use]
    pub fn types(&self, request: &GetParameterTypesRequest) -> GetParameterTypesResponse {
        GetParameterTypesResponse {
            types: request.names.iter().map(|name| self.value(name).r#type).collect(),
        }
    }

    fn value(&self, name: &str) -> ParameterValue {
        self.settings
            .find(name)
            .map_or_else(ParameterValue::default, |(descriptor, value)| convert::to_wire(descriptor, value))
    }

    /// `describe_parameters`: a description for each name, with the name alone for one that is no parameter.
    #[must_use]
    pub fn describe(&self, request: &DescribeParametersRequest) -> DescribeParametersResponse {
        let describe = |name: &String| match self.settings.find(name) {
            Some((descriptor, _)) => convert::describe(descriptor),
            None => ParameterDescriptor { name: name.clone(), ..ParameterDescriptor::default() },
        };
        DescribeParametersResponse { descriptors: request.names.iter().map(describe).collect() }
    }

    /// `list_parameters`: sorted names below the prefixes, down to the depth, and the groups that they are in. Values of
    /// classes of objects that say nothing are not listed, as they are not written in files; they can be set all the same.
    #[must_use]
    pub fn list(&self, request: &ListParametersRequest) -> ListParametersResponse {
        let names = self
            .settings
            .iter()
            .filter(|(_, value)| **value != Value::NotSet)
            .map(|(descriptor, _)| descriptor.name.as_str());
        ListParametersResponse { result: list::list(names, &request.prefixes, request.depth) }
    }

    /// `set_parameters`: one by one, each accepted or refused for itself.
    pub fn set(
        &mut self,
        request: &SetParametersRequest,
        stamp: Time,
    ) -> (SetParametersResponse, Option<Change>) {
        let before = self.settings.clone();
        let mut events = Vec::new();
        let results = request
            .parameters
            .iter()
            .map(|parameter| {
                let result = self.change(std::slice::from_ref(parameter), stamp);
                events.extend(result.as_ref().ok().cloned().flatten());
                verdict(result)
            })
            .collect();
        (SetParametersResponse { results }, self.since(&before, events))
    }

    /// `set_parameters_atomically`: all or none. Of a name that is given twice the last value counts.
    pub fn set_atomically(
        &mut self,
        request: &SetParametersAtomicallyRequest,
        stamp: Time,
    ) -> (SetParametersAtomicallyResponse, Option<Change>) {
        let before = self.settings.clone();
        let result = self.change(&request.parameters, stamp);
        let events = result.as_ref().ok().cloned().flatten().into_iter().collect();
        let response = SetParametersAtomicallyResponse { result: verdict(result) };
        (response, self.since(&before, events))
    }

    /// Swaps in the settings with these parameters. The event is `None` when all had their values already.
    fn change(
        &mut self,
        parameters: &[Parameter],
        stamp: Time,
    ) -> Result<Option<ParameterEvent>, Vec<String>> {
        let mut changes = Vec::with_capacity(parameters.len());
        let mut reasons = Vec::new();
        for Parameter { name, value } in parameters {
            match convert::from_wire(name, value) {
                Ok(value) => changes.push((name.clone(), value)),
                Err(reason) => reasons.push(reason),
            }
        }
        if !reasons.is_empty() {
            return Err(reasons);
        }
        let settings = self.settings.with_changes(&changes).map_err(|error| reasons_of(&error))?;
        let changed_parameters = self.changed(&settings, &changes);
        if changed_parameters.is_empty() {
            return Ok(None);
        }
        self.settings = Arc::new(settings);
        let node = self.node.clone();
        Ok(Some(ParameterEvent { stamp, node, changed_parameters, ..ParameterEvent::default() }))
    }

    /// The parameters among the changes whose values differ, each once, by name.
    fn changed(&self, new: &Settings, changes: &[(String, Value)]) -> Vec<Parameter> {
        let found: BTreeMap<&str, Parameter> = changes
            .iter()
            .filter_map(|(name, _)| {
                let (descriptor, value) = new.find(name)?;
                let differs = self.settings.get(name) != Some(value);
                let parameter = || Parameter {
                    name: descriptor.name.clone(),
                    value: convert::to_wire(descriptor, value),
                };
                differs.then(|| (descriptor.name.as_str(), parameter()))
            })
            .collect();
        found.into_values().collect()
    }

    fn since(&self, before: &Settings, events: Vec<ParameterEvent>) -> Option<Change> {
        let (old, new) = (before, &*self.settings);
        let period = new.selector.fallback_period_ms;
        let sim_time = new.node.use_sim_time;
        (!events.is_empty()).then(|| Change {
            settings: self.settings.clone(),
            events,
            fallback_period_ms: (old.selector.fallback_period_ms != period).then_some(period),
            use_sim_time: (old.node.use_sim_time != sim_time).then_some(sim_time),
        })
    }
}

fn verdict(result: Result<Option<ParameterEvent>, Vec<String>>) -> SetParametersResult {
    match result {
        Ok(_) => SetParametersResult { successful: true, reason: String::new() },
        Err(reasons) => SetParametersResult { successful: false, reason: reasons.join("; ") },
    }
}

fn reasons_of(error: &SettingsError) -> Vec<String> {
    error.problems.iter().map(ToString::to_string).collect()
}

#[cfg(test)]
mod tests;
