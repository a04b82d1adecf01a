use super::*;
use crate::top::Told;
use messages::autoware_internal_debug_msgs::{Float64Stamped, ProcessingTimeNode, ProcessingTimeTree};
use messages::autoware_trajectory_validator::{
    MetricReport, RiskLevel, ValidationReport, ValidationReportArray,
};
use messages::builtin_interfaces::Time;
use messages::diagnostic_msgs::{DiagnosticArray, KeyValue};
use messages::std_msgs::Header;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use selection::data_validity;
use selection::filters::CLASSES;
use selection::report::FEASIBILITY_METRIC;
use selector_actors::OutputTopic;
use selector_actors::topics::{NODE_NAME, OutputMessage};
use std::sync::Arc;

const SHADOW: [&str; 2] = ["collision_check_filter", "out_of_lane_filter"];

fn filters() -> impl Iterator<Item = &'static str> {
    std::iter::once(data_validity::NAME).chain(CLASSES.iter().map(|class| class.short_name))
}

fn diagnostics(cycle: i32, trigger: &str) -> DiagnosticArray {
    let status = |part: &str, level, message: &str, values: &[(String, String)]| DiagnosticStatus {
        level,
        name: format!("{NODE_NAME}: {part}"),
        message: message.to_owned(),
        hardware_id: NODE_NAME.to_owned(),
        values: values
            .iter()
            .map(|(key, value)| KeyValue { key: key.clone(), value: value.clone() })
            .collect(),
    };
    let mut values: Vec<(String, String)> =
        filters().map(|name| (format!("{name}.shadow"), SHADOW.contains(&name).to_string())).collect();
    for (key, value) in [
        ("cycle.trigger", trigger),
        ("candidates.input", "40"),
        ("candidates.accepted", "23"),
        ("input.odometry.age_s", "0.004"),
        ("input.objects.age_s", "0.104"),
        ("input.traffic_signals.age_s", "never received"),
        ("input.objects.lost", "3"),
    ] {
        values.push((key.to_owned(), value.to_owned()));
    }
    let infeasible = "At least one trajectory is infeasible";
    let chosen = [("selected.generator".to_owned(), "DiffusionPlanner_0".to_owned())];
    DiagnosticArray {
        header: Header { stamp: Time { sec: cycle, nanosec: 0 }, ..Header::default() },
        status: vec![
            status("trajectory_validator", DiagnosticStatus::WARN, infeasible, &values),
            status("trajectory_ranker", DiagnosticStatus::OK, "OK", &chosen),
        ],
    }
}

/// A candidate; every filter whose place is divided by its number without rest objects to it.
fn report(generator: &str, number: usize) -> ValidationReport {
    let metrics = filters().enumerate().flat_map(|(place, filter)| {
        let objects = place > 0 && number % (7 * place) == 6;
        let metric = |name: &'static str, metric_value, level| MetricReport {
            validator_name: filter.into(),
            metric_name: name.into(),
            metric_value,
            risk: RiskLevel { level },
            ..MetricReport::default()
        };
        let level = if objects { RiskLevel::DANGER } else { RiskLevel::SAFE };
        let verdict = metric(FEASIBILITY_METRIC, f64::from(u8::from(!objects)), level);
        [metric("check_something", 1.0, level), verdict]
    });
    ValidationReport {
        generator_name: generator.to_owned(),
        metrics: metrics.collect(),
        ..ValidationReport::default()
    }
}

/// Half a minute of a node that is well, mostly.
fn board() -> Board {
    let mut board = Board::default();
    let mut tell = |topic, message, at| board.take(Told::Published(topic, message), at);
    for cycle in 0..30 {
        let at = Duration::from_millis(27_100 + 100 * cycle);
        let second = i32::try_from(cycle).unwrap();
        let trigger = if cycle % 10 == 9 { "timer" } else { "anchor" };
        let told = OutputMessage::Diagnostics(Arc::new(diagnostics(second, trigger)));
        tell(OutputTopic::Diagnostics, told, at);
        let generators = [
            "DiffusionPlanner_0",
            "DiffusionPlanner_1",
            "MinimumRuleBasedPlanner_Stop",
            "Frenet_0",
            "Park_0",
            "Park_1",
        ];
        let reports = (0..40).map(|number| report(generators[number % 6], number + cycle as usize));
        let told = OutputMessage::Reports(Arc::new(ValidationReportArray { reports: reports.collect() }));
        tell(OutputTopic::ValidationReports, told, at);
        for (place, filter) in filters().enumerate().skip(1) {
            let took = Float64Stamped { data: 0.05 * place as f64, ..Float64Stamped::default() };
            tell(OutputTopic::FilterProcessingTime(filter), OutputMessage::Number(took), at);
        }
        let root = ProcessingTimeNode {
            name: "process_trajectories".to_owned(),
            processing_time: 0.3 * (1.0 + cycle as f64),
            ..ProcessingTimeNode::default()
        };
        let tree = Arc::new(ProcessingTimeTree { nodes: vec![root] });
        tell(OutputTopic::ProcessingTimeTree, OutputMessage::Times(tree), at);
    }
    board.take(
        Told::Warning("[crosswalk_filter] Found failed metrics (6 of 40 candidates)".to_owned()),
        Duration::from_secs(20),
    );
    for second in [22, 25] {
        board.take(Told::Warning("objects are old".to_owned()), Duration::from_secs(second));
    }
    board
}

const LOOK: Look<'static> =
    Look { source: "drive.mcap", selected: 1, is_paused: false, now: Duration::from_secs(30) };

fn drawn(board: &Board, look: Look<'_>, [width, height]: [u16; 2]) -> Terminal<TestBackend> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(frame, board, look)).unwrap();
    terminal
}

/// The characters on the screen, without what is blank at the ends of lines.
fn text(terminal: &Terminal<TestBackend>) -> String {
    let buffer = terminal.backend().buffer();
    let lines = buffer.content().chunks(usize::from(buffer.area().width)).map(|cells| {
        let line: String = cells.iter().map(ratatui::buffer::Cell::symbol).collect();
        format!("{}\n", line.trim_end())
    });
    lines.collect()
}

fn assert_drawn([width, height]: [u16; 2]) {
    let snapshot = format!("{}/src/top/view/snapshots/{width}x{height}.txt", env!("CARGO_MANIFEST_DIR"));
    let expected = std::fs::read_to_string(snapshot).unwrap();
    let found = text(&drawn(&board(), LOOK, [width, height]));
    assert!(
        found == expected,
        "the screen has changed; if that is meant, the snapshot becomes\n{found}<end>"
    );
}

#[test]
fn of_80_columns() {
    assert_drawn([80, 24]);
}

#[test]
fn of_140_columns() {
    assert_drawn([140, 45]);
}

#[test]
fn before_the_first_cycle_and_after_the_last_it_says_so() {
    let mut board = Board::default();
    let empty = text(&drawn(&board, LOOK, [80, 24]));
    assert!(empty.contains("waiting for the first cycle") && empty.contains("no warnings"), "{empty}");
    board.take(Told::Ended("the drive is over".to_owned()), Duration::ZERO);
    let look = Look { is_paused: true, ..LOOK };
    let over = text(&drawn(&board, look, [80, 24]));
    let title = over.lines().next().unwrap();
    assert!(title.contains("the drive is over") && title.contains("HELD"), "{title}");
}

#[test]
fn the_selected_generator_stands_out_and_scrolls_into_view() {
    let board = board();
    for (selected, name) in board.rows.keys().enumerate() {
        let terminal = drawn(&board, Look { selected, ..LOOK }, [80, 24]);
        let shown = text(&terminal);
        let is_marked =
            |line: &u16| terminal.backend().buffer()[(0, *line)].modifier.contains(Modifier::REVERSED);
        let marked: Vec<u16> = (1..24).filter(is_marked).collect();
        assert_eq!(marked.len(), 1, "{shown}");
        let line = shown.lines().nth(usize::from(marked[0])).unwrap();
        assert!(line.starts_with(&name[..6]) && line.contains(&name[name.len() - 5..]), "{name}: {line}");
        assert!(shown.contains(&format!("why not {name}")), "{shown}");
    }
}

#[test]
fn no_size_is_too_small_and_no_count_is_cut() {
    let mut board = board();
    for width in [1, 2, 10, 40, 79, 200] {
        for height in [1, 2, 5, 10, 24, 60] {
            drawn(&board, LOOK, [width, height]);
        }
    }
    let row = board.rows.values_mut().next().unwrap();
    row.judged = 123_456_789;
    row.objections.insert("crosswalk_filter".to_owned(), 12_345_678);
    let shown = text(&drawn(&board, LOOK, [80, 24]));
    assert!(shown.contains(" 123M ") && shown.contains(" 12M "), "{shown}");
    assert_eq!([9_999, 10_000, 999_999, 1_000_000].map(short), ["9999", "10k", "999k", "1M"]);
}
