//! `top` sees only what is published, and counts the same as a replay that sees everything.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use program::{run, shared};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;
use trajectory_selector::drive::Drive;
use trajectory_selector::recorder::Recorder;
use trajectory_selector::report::summary::Input;
use trajectory_selector::session::{Rate, Session};
use trajectory_selector::settings::{DEFAULT_NODE_NAME, Settings};
use trajectory_selector::top::board::Board;

/// Everything that is published over a drive, counted.
fn board_of(drive: &std::path::Path) -> Board {
    let drive = Drive::open(drive, &[], None, true).unwrap();
    let session = Session {
        input: Input { name: "drive".to_owned(), seed: None },
        interface: drive.interface(),
        span: (drive.start(), drive.end()),
        threads: 2,
        rate: Rate::Max,
        output: None,
        map: None,
        watch: None,
        page: false,
        markers: false,
        progress: false,
    };
    let (told, heard) = crossbeam_channel::unbounded();
    let recorder = Recorder::counting();
    recorder.lock().tap = Some(told);
    let settings = Settings::load(DEFAULT_NODE_NAME, &[]).unwrap();
    assert!(session.measure(&recorder, &settings, drive).unwrap().errors.is_empty());
    recorder.lock().tap = None;
    let mut board = Board::default();
    heard.iter().for_each(|told| board.take(told, Duration::ZERO));
    board
}

/// As in the JSON: by filter and metric, filters without any left out.
fn reasons(board: &Board, are_shadow: bool) -> Value {
    let mut by_filter: BTreeMap<String, BTreeMap<String, u64>> = BTreeMap::new();
    for ((filter, metric), count) in board.total().reasons {
        if board.columns[&filter].is_shadow == are_shadow {
            by_filter.entry(filter).or_default().insert(metric, count);
        }
    }
    json!(by_filter)
}

fn without_empty(filters: &Value) -> Value {
    let filters = filters.as_object().unwrap().iter().filter(|(_, metrics)| *metrics != &json!({}));
    filters.map(|(name, metrics)| (name.clone(), metrics.clone())).collect::<serde_json::Map<_, _>>().into()
}

#[test]
fn on_recorded_drives() {
    for name in ["intersection.mcap", "crosswalk.mcap", "stress.mcap"] {
        let Some(drive) = shared(&format!("data/drives/{name}")) else { return };
        let (board, replay) = (board_of(&drive), run(&["replay", drive.to_str().unwrap()]));
        let (json, total) = (&replay.json, board.total());
        for trigger in ["anchor", "timer"] {
            let counted = board.triggers.get(trigger).copied().unwrap_or(0);
            assert_eq!(json["cycles"][trigger], counted, "{name}: {trigger}");
        }
        let candidates = &json["candidates"];
        assert_eq!(
            (&candidates["judged"], &candidates["accepted"]),
            (&json!(total.judged), &json!(total.accepted))
        );
        for (generator, tally) in candidates["by_generator"].as_object().unwrap() {
            let row = board.rows.get(generator).cloned().unwrap_or_default();
            assert_eq!(
                (&tally["judged"], &tally["accepted"]),
                (&json!(row.judged), &json!(row.accepted)),
                "{generator}"
            );
            let chosen = json["selected"].get(generator).and_then(Value::as_u64).unwrap_or(0);
            assert_eq!(row.chosen, chosen, "{name}: {generator}");
        }
        assert_eq!(reasons(&board, false), without_empty(&json["rejections"]), "{name}");
        assert_eq!(reasons(&board, true), without_empty(&json["shadow"]), "{name}");
    }
}
