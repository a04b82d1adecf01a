//! `top` starts, draws, obeys its keys, and gives the terminal back on every way out; without a terminal it says so.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;
#[path = "program_support/terminal.rs"]
mod terminal;

use program::{run, shared};
use std::process::Command;
use terminal::{Shown, hang_up, in_a_terminal, keys, signal, wait};

const SMALL: [u16; 2] = [80, 24];

fn top(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"));
    command.arg("top").args(arguments);
    command
}

/// Plays a drive until the step, or to its end.
fn play(steps: &[serde_json::Value], arguments: &[&str]) -> Option<Shown> {
    let drive = shared("data/drives/crosswalk.mcap")?;
    let arguments = [&[drive.to_str().unwrap()], arguments].concat();
    in_a_terminal(SMALL, steps, &mut top(&arguments))
}

// Only what changes is drawn, so that only single words are sure to be written in one go.

#[test]
fn a_drive_is_shown_held_and_left() {
    let steps = [wait("DiffusionPlanner"), keys("\t\x1b[B"), keys(" "), wait("HELD"), keys("q")];
    let Some(shown) = play(&steps, &[]) else { return };
    assert_eq!(shown.exit, 0, "{:?}", shown.output);
    shown.assert_given_back();
    for text in ["trajectory-selector", "crosswalk.mcap", "generator", "judged", "warnings", "quit"] {
        assert!(shown.output.contains(text), "{text}");
    }
}

#[test]
fn signals_end_it_in_order() {
    for name in ["SIGTERM", "SIGINT", "SIGHUP"] {
        let Some(shown) = play(&[wait("DiffusionPlanner"), signal(name)], &[]) else { return };
        assert_eq!(shown.exit, 0, "{name}: {:?}", shown.output);
        shown.assert_given_back();
    }
}

#[test]
fn it_ends_with_its_terminal() {
    let Some(shown) = play(&[wait("DiffusionPlanner"), hang_up()], &[]) else { return };
    // Whether the signal comes first, or nothing can be drawn any more: 0 or 1, but not for ever.
    assert!((0..=1).contains(&shown.exit), "{}: {:?}", shown.exit, shown.output);
}

#[test]
fn a_drive_ends_and_what_was_seen_is_told() {
    let steps = [wait("over"), keys("\x03")];
    let Some(shown) = play(&steps, &["--rate", "20", "--json"]) else { return };
    assert_eq!(shown.exit, 0, "{:?}", shown.output);
    shown.assert_given_back();
    let (_, after) = shown.output.rsplit_once("\x1b[?1049l").unwrap();
    let json = &after[after.find('{').unwrap()..=after.rfind('}').unwrap()];
    let json: serde_json::Value = serde_json::from_str(json).unwrap();
    assert_eq!((&json["command"], &json["ok"]), (&"top".into(), &true.into()));
    assert!(json["cycles"]["anchor"].as_u64().unwrap() > 50, "{json}");
}

#[test]
fn without_a_terminal_it_says_so() {
    let refused = run(&["top", "drive.mcap"]);
    assert_eq!((refused.exit_code, &refused.json["errors"][0]["code"]), (2, &"usage".into()));
    assert!(refused.stderr.contains("stdout is none"), "{}", refused.stderr);
}

#[test]
fn what_cannot_be_played_is_an_error_on_a_terminal_that_was_left_alone() {
    let Some(shown) = in_a_terminal(SMALL, &[], &mut top(&["/no/such/drive.mcap"])) else { return };
    assert_eq!(shown.exit, 1, "{:?}", shown.output);
    assert!(shown.output.contains("/no/such/drive.mcap") && !shown.output.contains("\x1b[?1049h"));
    assert!(shown.restored);
    let Some(shown) = in_a_terminal(SMALL, &[], &mut top(&["drive.mcap", "--rate", "max"])) else { return };
    assert_eq!(shown.exit, 2, "{:?}", shown.output);
}
