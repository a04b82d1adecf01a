use super::*;
use messages::autoware_internal_debug_msgs::{Float64Stamped, ProcessingTimeNode};
use messages::autoware_trajectory_validator::MetricReport;
use messages::diagnostic_msgs::KeyValue;
use messages::std_msgs::Header;

const S: Duration = Duration::from_secs(1);

fn diagnostics(sec: i32, values: &[(&str, &str)], chosen: Option<&str>) -> Told {
    let value = |(key, value): &(&str, &str)| KeyValue { key: (*key).into(), value: (*value).into() };
    let status = |part: &str, level, message: &str, values| DiagnosticStatus {
        level,
        name: format!("{NODE_NAME}: {part}"),
        message: message.to_owned(),
        hardware_id: NODE_NAME.to_owned(),
        values,
    };
    let ranker = chosen.map_or_else(
        || status("trajectory_ranker", DiagnosticStatus::ERROR, "Nothing to rank", Vec::new()),
        |name| {
            let values = vec![value(&("selected.generator", name))];
            status("trajectory_ranker", DiagnosticStatus::OK, "OK", values)
        },
    );
    let values = values.iter().map(value).collect();
    let validator = status("trajectory_validator", DiagnosticStatus::OK, "OK", values);
    let header = Header { stamp: Time { sec, nanosec: 0 }, ..Header::default() };
    let message = DiagnosticArray { header, status: vec![validator, ranker] };
    Told::Published(OutputTopic::Diagnostics, OutputMessage::Diagnostics(Arc::new(message)))
}

const FILTERS: [(&str, &str); 3] = [
    ("data_validity.shadow", "false"),
    ("crosswalk_filter.shadow", "false"),
    ("out_of_lane_filter.shadow", "true"),
];

/// What was measured: filter, metric, value, risk.
type Measured = (&'static str, &'static str, f64, u8);

/// Of each candidate: generator, and what was measured.
fn reports(candidates: &[(&str, &[Measured])]) -> Told {
    let report = |(name, metrics): &(&str, &[Measured])| ValidationReport {
        generator_name: (*name).to_owned(),
        metrics: metrics
            .iter()
            .map(|(filter, metric, value, level)| MetricReport {
                validator_name: (*filter).into(),
                metric_name: (*metric).into(),
                metric_value: *value,
                risk: RiskLevel { level: *level },
                ..MetricReport::default()
            })
            .collect(),
        ..ValidationReport::default()
    };
    let reports = ValidationReportArray { reports: candidates.iter().map(report).collect() };
    Told::Published(OutputTopic::ValidationReports, OutputMessage::Reports(Arc::new(reports)))
}

const VALID: Measured = ("data_validity", "data_validity", 0.0, RiskLevel::SAFE);
const INVALID: Measured = ("data_validity", "data_validity", 2.0, RiskLevel::DANGER);

fn feasible(filter: &'static str, is: bool) -> Measured {
    (filter, FEASIBILITY_METRIC, f64::from(u8::from(is)), RiskLevel::SAFE)
}

#[test]
fn candidates_count_by_generator_filter_and_reason() {
    let mut board = Board::default();
    let candidates: &[(&str, &[_])] = &[
        ("A", &[VALID, feasible("crosswalk_filter", true), feasible("out_of_lane_filter", true)]),
        // A shadow filter removes nothing.
        (
            "A",
            &[
                VALID,
                feasible("crosswalk_filter", true),
                ("out_of_lane_filter", "check_out_of_lane", 1.0, RiskLevel::DANGER),
                feasible("out_of_lane_filter", false),
            ],
        ),
        // What is beyond a limit although the filter is content is no reason.
        (
            "B",
            &[
                VALID,
                ("crosswalk_filter", "check_a", 1.0, RiskLevel::DANGER),
                ("crosswalk_filter", "check_b", 0.0, RiskLevel::SAFE),
                feasible("crosswalk_filter", false),
                ("out_of_lane_filter", "check_out_of_lane", 0.2, RiskLevel::LOW_CAUTION),
                feasible("out_of_lane_filter", true),
            ],
        ),
        ("B", &[INVALID]),
        // A filter without a number could not judge.
        ("B", &[VALID, feasible("crosswalk_filter", false), feasible("out_of_lane_filter", true)]),
        // One that was not asked says nothing against the candidate.
        ("B", &[INVALID, ("crosswalk_filter", NOT_ASSESSED, 1.0, RiskLevel::SAFE)]),
        // Its turn did not come.
        ("B", &[("data_validity", NOT_JUDGED, 1.0, RiskLevel::FATAL), VALID]),
    ];
    // The reports of the first cycle wait until it is known which filters are enforced.
    board.take(reports(candidates), S);
    assert!(board.rows.is_empty());
    board.take(diagnostics(1, &FILTERS, Some("A")), S);
    let a = &board.rows["A"];
    assert_eq!((a.judged, a.accepted, a.chosen), (2, 2, 1));
    assert_eq!(a.objections, BTreeMap::from([("out_of_lane_filter".into(), 1)]));
    let b = &board.rows["B"];
    assert_eq!((b.judged, b.accepted, b.chosen), (4, 0, 0));
    assert_eq!(b.objections, BTreeMap::from([("crosswalk_filter".into(), 2), ("data_validity".into(), 2)]));
    let reasons: Vec<_> =
        b.reasons.iter().map(|((filter, metric), count)| (&filter[..], &metric[..], *count)).collect();
    assert_eq!(
        reasons,
        [
            ("crosswalk_filter", "check_a", 1),
            ("crosswalk_filter", NOT_ASSESSED, 1),
            ("data_validity", "data_validity", 2)
        ]
    );
    // Later ones are counted at once.
    board.take(reports(&[("A", &[VALID])]), S);
    assert_eq!(board.total().judged, 7);
    let names: Vec<&str> = board.columns_in_order().into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["data_validity", "crosswalk_filter", "out_of_lane_filter"]);
}

#[test]
fn cycles_count_by_trigger_and_the_last_one_is_told() {
    let mut board = Board::default();
    let values = |trigger| {
        [
            ("cycle.trigger", trigger),
            ("candidates.accepted", "3"),
            ("candidates.input", "5"),
            ("input.objects.age_s", "0.100"),
            ("input.route.malformed", "2"),
        ]
    };
    board.take(diagnostics(10, &values("anchor"), Some("A")), S);
    board.take(diagnostics(11, &values("timer"), None), 2 * S);
    board.take(diagnostics(12, &values("timer"), None), 3 * S);
    assert_eq!(board.triggers, BTreeMap::from([("anchor".into(), 1), ("timer".into(), 2)]));
    assert_eq!((&board.last, &board.last_trigger[..]), (&(5, 3, None), "timer"));
    assert_eq!(board.cycles(), 3);
    assert!((board.elapsed_s() - 2.0).abs() < 1e-9);
    assert_eq!(board.health["trajectory_ranker"].level, DiagnosticStatus::ERROR);
    let inputs: Vec<_> = board.inputs.iter().map(|(key, value)| (&key[..], &value[..])).collect();
    assert_eq!(inputs, [("input.objects.age_s", "0.100"), ("input.route.malformed", "2")]);
}

#[test]
fn other_nodes_diagnostics_are_not_ours() {
    let mut board = Board::default();
    let status =
        DiagnosticStatus { name: "lidar: trajectory_validator".into(), ..DiagnosticStatus::default() };
    let message = DiagnosticArray { header: Header::default(), status: vec![status] };
    let message = OutputMessage::Diagnostics(Arc::new(message));
    board.take(Told::Published(OutputTopic::Diagnostics, message), S);
    assert!(board.health.is_empty() && board.rate_hz(S) == 0.0);
}

#[test]
fn the_rate_is_that_of_the_last_seconds_and_falls_when_the_node_stops() {
    let mut board = Board::default();
    let at = |tenths: u32| tenths * Duration::from_millis(100);
    for tenth in 0..=100 {
        board.take(diagnostics(1, &[], None), at(tenth));
    }
    assert!((board.rate_hz(at(100)) - 10.0).abs() < 0.3, "{}", board.rate_hz(at(100)));
    assert!(board.rate_hz(at(120)) < 7.0);
    assert!(board.rate_hz(at(151)) == 0.0);
    assert!(board.arrivals.len() <= 51, "what is too old is forgotten");
}

#[test]
fn times_are_those_of_cycles_and_filters() {
    let mut board = Board::default();
    let tree = |name: &str, processing_time| {
        let node = ProcessingTimeNode {
            id: 1,
            name: name.to_owned(),
            processing_time,
            ..ProcessingTimeNode::default()
        };
        let tree = Arc::new(ProcessingTimeTree { nodes: vec![node] });
        Told::Published(OutputTopic::ProcessingTimeTree, OutputMessage::Times(tree))
    };
    let took = |filter, data| {
        let number = Float64Stamped { data, ..Float64Stamped::default() };
        Told::Published(OutputTopic::FilterProcessingTime(filter), OutputMessage::Number(number))
    };
    assert_eq!(board.latency_ms(), None);
    board.take(took("crosswalk_filter", 1.0), S);
    assert!(board.columns.is_empty(), "its place is not known yet");
    board.take(diagnostics(1, &FILTERS, None), S);
    for told in [
        tree("process_trajectories", 2.0),
        tree("map_callback", 900.0),
        tree("process_trajectories", f64::NAN),
        tree("process_trajectories", -1.0),
        took("crosswalk_filter", 0.5),
    ] {
        board.take(told, S);
    }
    let [p50, p99, max] = board.latency_ms().unwrap();
    assert!([p50, p99, max].iter().all(|ms| (ms - 2.0).abs() < 0.01), "{p50} {p99} {max}");
    assert_eq!(board.latency_bars().iter().sum::<u64>(), 1);
    assert!((board.columns["crosswalk_filter"].p99_us().unwrap() - 500.0).abs() < 1.0);
    assert_eq!(board.columns["data_validity"].p99_us(), None);
}

#[test]
fn warnings_count_on_and_the_oldest_go() {
    let mut board = Board::default();
    for number in 0..2 * MAX_WARNINGS {
        board.take(Told::Warning(format!("warning {number}")), S);
    }
    assert_eq!(board.warnings.len(), MAX_WARNINGS);
    board.take(Told::Warning("warning 150".to_owned()), 2 * S);
    let last = board.warnings.back().unwrap();
    assert_eq!((&last.text[..], last.count, last.last), ("warning 150", 2, 2 * S));
    assert_eq!(board.warnings.len(), MAX_WARNINGS);
}

#[test]
fn generators_without_end_are_counted_together() {
    let mut board = Board::default();
    board.take(diagnostics(1, &FILTERS, None), S);
    for number in 0..2 * MAX_GENERATORS {
        board.take(reports(&[(&number.to_string(), &[VALID])]), S);
    }
    assert_eq!(board.rows.len(), MAX_GENERATORS + 1);
    assert_eq!(board.rows[OTHERS].judged, MAX_GENERATORS as u64);
    assert_eq!(board.total().judged, 2 * MAX_GENERATORS as u64);
}
