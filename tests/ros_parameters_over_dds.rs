//! The parameters of a running node are read and changed over the six services, in the form of either middleware, under
//! remapped names; what is refused changes nothing, what is accepted is announced and takes effect.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;

use lab::{Lab, PATIENCE, Peer, isolated};
use messages::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, Parameter, ParameterEvent, ParameterType, ParameterValue,
    SetParametersAtomicallyRequest, SetParametersAtomicallyResponse, SetParametersRequest,
    SetParametersResponse,
};
use messages::{Interface, Message};
use serde_json::json;
use std::time::Duration;

const NODE: &str = "/planning/selector";

/// A client of one service: the ends of its two topics, and the form in which it speaks.
struct Client {
    request: u64,
    reply: u64,
    is_cyclone: bool,
    number: i64,
}

/// What stands in front of a request in the form of `rmw_cyclonedds`: the client's half of an identity, and a number.
const CLIENT: [u8; 8] = [0xd1, 2, 3, 4, 5, 6, 7, 0xf8];

impl Client {
    fn open(peer: &mut Peer, service: &str, type_name: &str, is_cyclone: bool) -> Self {
        let form = if is_cyclone { "_cyclone" } else { "" };
        let many = json!({"depth": 100});
        let request = peer.open_raw(
            "write",
            &format!("rq{NODE}/{service}Request"),
            &format!("rcl_interfaces/srv/{type_name}_Request{form}"),
            &many,
        );
        let reply = peer.open_raw(
            "read",
            &format!("rr{NODE}/{service}Reply"),
            &format!("rcl_interfaces/srv/{type_name}_Response{form}"),
            &many,
        );
        peer.wait_for_peers(request, 1);
        peer.wait_for_peers(reply, 1);
        Self { request, reply, is_cyclone, number: 1 << 40 }
    }

    fn call<Q: Message, A: Message>(&mut self, peer: &mut Peer, request: &Q) -> A {
        let cdr = request.to_cdr(Interface::default());
        self.number += 1;
        let header = [CLIENT, self.number.to_le_bytes()].concat();
        if !self.is_cyclone {
            peer.send(self.request, &cdr);
            return decode(&peer.take_one(self.reply));
        }
        peer.send(self.request, &[&cdr[..4], &header, &cdr[4..]].concat());
        let reply = peer.take_one(self.reply);
        assert_eq!(reply[4..20], header[..], "client and number come back");
        decode(&[&reply[..4], &reply[20..]].concat())
    }
}

fn decode<M: Message>(cdr: &[u8]) -> M {
    M::from_cdr(cdr, Interface::default(), "").unwrap()
}

fn integer(name: &str, value: i64) -> Parameter {
    let value =
        ParameterValue { r#type: ParameterType::INTEGER, integer_value: value, ..ParameterValue::default() };
    Parameter { name: name.to_owned(), value }
}

fn double(name: &str, value: f64) -> Parameter {
    let value =
        ParameterValue { r#type: ParameterType::DOUBLE, double_value: value, ..ParameterValue::default() };
    Parameter { name: name.to_owned(), value }
}

fn string(name: &str, value: &str) -> Parameter {
    let value = ParameterValue {
        r#type: ParameterType::STRING,
        string_value: value.to_owned(),
        ..ParameterValue::default()
    };
    Parameter { name: name.to_owned(), value }
}

/// Most cycles in a while with the slow period of the test, 220 ms.
const MOST_SLOW: usize = 11;

/// Cycles in a while.
fn cycles(peer: &mut Peer, diagnostics: u64) -> usize {
    peer.take(diagnostics, 1000, Duration::ZERO);
    peer.take(diagnostics, 1000, Duration::from_millis(2200)).len()
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// The same conversation in either form.
fn converse(lab: &Lab, is_cyclone: bool) {
    let middleware = if is_cyclone { "rmw_cyclonedds_cpp" } else { "rmw_fastrtps_cpp" };
    let renamed = ["-r", "__node:=selector", "-r", "__ns:=/planning", "-p", "duration_time:=0.3"];
    let node = lab.node_with(&[], &renamed, &[("RMW_IMPLEMENTATION", middleware)]);
    let mut peer = lab.peer();
    let events =
        peer.open("read", "/parameter_events", "rcl_interfaces/msg/ParameterEvent", &json!({"depth": 100}));
    peer.wait_for_peers(events, 1);
    let mut client = |service, type_name| Client::open(&mut peer, service, type_name, is_cyclone);
    let mut get = client("get_parameters", "GetParameters");
    let mut types = client("get_parameter_types", "GetParameterTypes");
    let mut set = client("set_parameters", "SetParameters");
    let mut set_atomically = client("set_parameters_atomically", "SetParametersAtomically");
    let mut describe = client("describe_parameters", "DescribeParameters");
    let mut list = client("list_parameters", "ListParameters");
    // Declared at start; whoever came in time has heard of it.
    peer.take(events, 10, Duration::from_millis(100));

    let asked = names(&["fallback_period_ms", "duration_time", "no_such_parameter"]);
    let got: GetParametersResponse = get.call(&mut peer, &GetParametersRequest { names: asked.clone() });
    assert_eq!(got.values[0].integer_value, 150);
    assert_eq!(got.values[1].double_value.to_bits(), 0.3_f64.to_bits());
    assert_eq!(got.values[2].r#type, ParameterType::NOT_SET);
    let got: GetParameterTypesResponse =
        types.call(&mut peer, &GetParameterTypesRequest { names: asked.clone() });
    assert_eq!(got.types, [ParameterType::INTEGER, ParameterType::DOUBLE, ParameterType::NOT_SET]);
    let got: DescribeParametersResponse =
        describe.call(&mut peer, &DescribeParametersRequest { names: asked });
    assert_eq!(got.descriptors.len(), 3);
    assert_eq!(got.descriptors[0].integer_range.unwrap().from_value, 1);
    assert!(!got.descriptors[1].description.is_empty());
    let all = ListParametersRequest { prefixes: Vec::new(), depth: 0 };
    let got: ListParametersResponse = list.call(&mut peer, &all);
    assert!(got.result.names.len() > 100, "{} names", got.result.names.len());
    assert!(got.result.names.contains(&"vehicle_constraint.max_speed".to_owned()));

    // One good, one out of range, one fixed at start: each stands for itself.
    let changes = vec![
        integer("fallback_period_ms", 220),
        integer("fallback_period_ms", 0),
        string("autoware_interface", "0.52"),
    ];
    let got: SetParametersResponse = set.call(&mut peer, &SetParametersRequest { parameters: changes });
    assert!(got.results[0].successful, "{}", got.results[0].reason);
    assert!(!got.results[1].successful && got.results[1].reason.contains("1"), "{}", got.results[1].reason);
    assert!(
        !got.results[2].successful && got.results[2].reason.contains("read-only"),
        "{}",
        got.results[2].reason
    );
    let event: ParameterEvent = decode(&peer.take_one(events));
    assert_eq!(event.node, NODE);
    assert_eq!(event.changed_parameters, [integer("fallback_period_ms", 220)]);
    node.wait_for_line(&["New concatenate_and_validate timer callback created with period 220."]);

    // The timer does as it is told.
    let diagnostics =
        peer.open("read", "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", &json!({"depth": 1000}));
    peer.wait_for_peers(diagnostics, 1);
    let slow = cycles(&mut peer, diagnostics);
    let changes = vec![integer("fallback_period_ms", 20)];
    let got: SetParametersResponse = set.call(&mut peer, &SetParametersRequest { parameters: changes });
    assert!(got.results[0].successful, "{}", got.results[0].reason);
    // More than the slow period allows; a machine that is held up may need to be asked again.
    let fast = (0..5).map(|_| cycles(&mut peer, diagnostics)).find(|&fast| fast > 2 * MOST_SLOW);
    assert!((1..=MOST_SLOW).contains(&slow) && fast.is_some(), "{slow} cycles, then {fast:?}");
    peer.take_one(events);

    // All or nothing.
    let half = vec![double("duration_time", 0.4), integer("vehicle_constraint.max_speed", 3)];
    let request = SetParametersAtomicallyRequest { parameters: half };
    let got: SetParametersAtomicallyResponse = set_atomically.call(&mut peer, &request);
    assert!(!got.result.successful);
    assert!(got.result.reason.contains("vehicle_constraint.max_speed"), "{}", got.result.reason);
    let both = vec![double("duration_time", 0.5), double("vehicle_constraint.max_speed", 3.0)];
    let request = SetParametersAtomicallyRequest { parameters: both.clone() };
    let got: SetParametersAtomicallyResponse = set_atomically.call(&mut peer, &request);
    assert!(got.result.successful, "{}", got.result.reason);
    let event: ParameterEvent = decode(&peer.take_one(events));
    assert_eq!(event.changed_parameters, both, "one event for both, none for what was refused");

    let asked = names(&["fallback_period_ms", "duration_time", "vehicle_constraint.max_speed"]);
    let got: GetParametersResponse = get.call(&mut peer, &GetParametersRequest { names: asked });
    assert_eq!(got.values[0].integer_value, 20);
    assert_eq!(got.values[1].double_value.to_bits(), 0.5_f64.to_bits());
    assert_eq!(got.values[2].double_value.to_bits(), 3.0_f64.to_bits());
    assert_eq!(node.stop("TERM").status.code(), Some(0));
}

#[test]
fn a_client_of_cyclone_reads_and_changes_parameters() {
    isolated("a_client_of_cyclone_reads_and_changes_parameters", |lab| converse(lab, true));
}

#[test]
fn a_client_of_the_plain_form_reads_and_changes_parameters() {
    isolated("a_client_of_the_plain_form_reads_and_changes_parameters", |lab| converse(lab, false));
}

/// A client that speaks the other form gets no answer; the node says why and lives on.
#[test]
fn a_client_of_the_wrong_form_is_told_of_in_the_log() {
    isolated("a_client_of_the_wrong_form_is_told_of_in_the_log", |lab| {
        let renamed = ["-r", "__node:=selector", "-r", "__ns:=/planning"];
        let node = lab.node_with(&["--service-mapping", "cyclone"], &renamed, &[]);
        let mut peer = lab.peer();
        let plain = Client::open(&mut peer, "get_parameters", "GetParameters", false);
        let request = GetParametersRequest { names: names(&["x"]) };
        peer.send(plain.request, &request.to_cdr(Interface::default()));
        node.wait_for_line(&["get_parameters", "rmw_cyclonedds_cpp"]);
        let mut right = Client::open(&mut peer, "list_parameters", "ListParameters", true);
        let all = ListParametersRequest { prefixes: Vec::new(), depth: 0 };
        let got: ListParametersResponse = right.call(&mut peer, &all);
        assert!(!got.result.names.is_empty());
        assert!(peer.take(plain.reply, 1, Duration::ZERO).is_empty());
        assert!(node.stop("INT").took < PATIENCE);
    });
}
