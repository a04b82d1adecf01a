//! Listens to what a running node publishes, for people who look on.
//!
//! The node works out debug topics only while somebody listens; that is all that it notices. What comes faster than it
//! is looked at is dropped here, not kept.

use super::graph::{Graph, GraphError, GraphOptions, Reader};
use super::names::Names;
use super::node::ROSOUT_TOPIC;
use super::qos::Qos;
use crate::top::Told;
use crossbeam_channel::Sender;
use futures::{StreamExt, pin_mut};
use messages::autoware_internal_debug_msgs::{Float64Stamped, ProcessingTimeTree};
use messages::autoware_trajectory_validator::ValidationReportArray;
use messages::diagnostic_msgs::DiagnosticArray;
use messages::rcl_interfaces::Log;
use messages::{DecodeError, Interface, Message};
use selection::filters::CLASSES;
use selector_actors::OutputTopic;
use selector_actors::topics::OutputMessage;
use std::sync::Arc;
use tokio::runtime::Handle;
use tokio::task::JoinSet;

/// Messages of a topic that may wait while others are decoded.
const DEPTH: i32 = 16;

/// A place in the graph from which a node is watched; left when it is dropped.
#[derive(Debug)]
pub struct Watcher {
    // Readers go before the graph that they are in.
    _readers: JoinSet<()>,
    _graph: Graph,
}

impl Watcher {
    /// Joins the graph and tells what the node says. Topics are found under the node's own names for them.
    ///
    /// # Errors
    /// The graph cannot be joined.
    pub fn join(
        options: &GraphOptions,
        node: &Names,
        runtime: &Handle,
        told: &Sender<Told>,
    ) -> Result<Self, GraphError> {
        let name = format!("trajectory_selector_top_{}", std::process::id());
        let mut graph = Graph::join(options, "/", &name)?;
        let mut readers = JoinSet::new();
        for topic in topics() {
            let reader =
                graph.subscribe(&node.topic(&topic.ros_name())?, topic.type_name(), Qos::reliable(DEPTH))?;
            let decode =
                move |cdr: &[u8], name: &str| Ok(Some(Told::Published(topic, decode(topic, cdr, name)?)));
            readers.spawn_on(listen(reader, decode, told.clone()), runtime);
        }
        let logger = node.logger();
        let reader = graph.subscribe(ROSOUT_TOPIC, Log::TYPE_NAME, Qos::ROSOUT)?;
        let decode = move |cdr: &[u8], name: &str| {
            Ok(warning(&Log::from_cdr(cdr, Interface::default(), name)?, &logger))
        };
        readers.spawn_on(listen(reader, decode, told.clone()), runtime);
        graph.announce();
        Ok(Self { _readers: readers, _graph: graph })
    }
}

/// What is listened to: all that is counted, of every filter that there is.
fn topics() -> Vec<OutputTopic> {
    let mut topics =
        vec![OutputTopic::Diagnostics, OutputTopic::ValidationReports, OutputTopic::ProcessingTimeTree];
    topics.extend(CLASSES.iter().map(|class| OutputTopic::FilterProcessingTime(class.short_name)));
    topics
}

/// These messages are the same in all interfaces.
fn decode(topic: OutputTopic, cdr: &[u8], name: &str) -> Result<OutputMessage, DecodeError> {
    let interface = Interface::default();
    Ok(match topic {
        OutputTopic::Diagnostics => {
            OutputMessage::Diagnostics(Arc::new(DiagnosticArray::from_cdr(cdr, interface, name)?))
        }
        OutputTopic::ValidationReports => {
            OutputMessage::Reports(Arc::new(ValidationReportArray::from_cdr(cdr, interface, name)?))
        }
        OutputTopic::ProcessingTimeTree => {
            OutputMessage::Times(Arc::new(ProcessingTimeTree::from_cdr(cdr, interface, name)?))
        }
        _ => OutputMessage::Number(Float64Stamped::from_cdr(cdr, interface, name)?),
    })
}

/// Of the node's log what it warns of.
fn warning(line: &Log, logger: &str) -> Option<Told> {
    let is_its_own =
        line.name == logger || line.name.strip_prefix(logger).is_some_and(|rest| rest.starts_with('.'));
    (is_its_own && line.level >= Log::WARN).then(|| Told::Warning(line.msg.clone()))
}

async fn listen(
    reader: Reader,
    decode: impl Fn(&[u8], &str) -> Result<Option<Told>, DecodeError>,
    told: Sender<Told>,
) {
    let name = reader.topic.clone();
    let stream = reader.reader.as_async_stream();
    pin_mut!(stream);
    while let Some(sample) = stream.next().await {
        let heard = match sample {
            Ok(change) => decode(change.into_value().as_bytes(), &name),
            // What cannot be read is for the node's own listeners to complain of.
            Err(_) => continue,
        };
        let heard = heard.unwrap_or_else(|error| Some(Told::Warning(error.to_string())));
        if let Some(heard) = heard {
            let _ = told.try_send(heard);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_counted_is_listened_to() {
        let filters: Vec<_> = CLASSES.iter().map(|class| class.short_name).collect();
        let all = OutputTopic::all(Interface::V0_53, &filters);
        let mut counted: Vec<_> = all.into_iter().filter(|topic| crate::top::is_counted(*topic)).collect();
        let mut heard = topics();
        counted.sort_unstable();
        heard.sort_unstable();
        assert_eq!(heard, counted);
    }

    #[test]
    fn only_the_nodes_own_warnings_are_told() {
        let line =
            |name: &str, level| Log { name: name.to_owned(), level, msg: "x".to_owned(), ..Log::default() };
        let is_told = |name, level| warning(&line(name, level), "planning.selector").is_some();
        assert!(is_told("planning.selector", Log::WARN) && is_told("planning.selector.ranker", Log::ERROR));
        assert!(!is_told("planning.selector", Log::INFO));
        assert!(!is_told("planning.selector_of_others", Log::ERROR));
    }

    #[test]
    fn what_is_no_message_is_an_error_with_its_topic() {
        let error = decode(OutputTopic::Diagnostics, &[0, 1, 0, 0, 7], "/diagnostics").unwrap_err();
        assert!(error.to_string().contains("/diagnostics"), "{error}");
    }
}
