//! Runs a command in a terminal of its own, with keys and signals as a person would give them.
#![allow(dead_code, clippy::unwrap_used, reason = "each test uses some of these; tests fail by panicking")]

use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// What a command left behind in its terminal.
#[derive(Debug)]
pub(crate) struct Shown {
    /// Exit code, or the signal that ended it as a negative number.
    pub(crate) exit: i64,
    /// All that it wrote, control sequences included.
    pub(crate) output: String,
    /// Whether the terminal's settings are what they were.
    pub(crate) restored: bool,
}

/// Waits until the command has written a text.
pub(crate) fn wait(text: &str) -> Value {
    json!({ "wait": text })
}

/// Presses keys.
pub(crate) fn keys(keys: &str) -> Value {
    json!({ "keys": keys })
}

/// Takes the terminal away.
pub(crate) fn hang_up() -> Value {
    json!({ "hang_up": true })
}

/// Sends a signal.
pub(crate) fn signal(name: &str) -> Value {
    json!({ "signal": name })
}

/// Runs the command; a visible line and `None` where there is no Python to make the terminal.
pub(crate) fn in_a_terminal(size: [u16; 2], steps: &[Value], command: &mut Command) -> Option<Shown> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/top/terminal.py");
    let mut python = Command::new("python3");
    python.arg(script).args(size.map(|length| length.to_string()));
    python.arg(Value::from(steps).to_string()).arg("--").arg(command.get_program()).args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => python.env(name, value),
            None => python.env_remove(name),
        };
    }
    let Ok(output) = python.env("TERM", "xterm-256color").output() else {
        assert!(std::env::var_os("SELECTOR_REQUIRE_PEERS").is_none(), "python3 is required here");
        eprintln!("skipped: there is no python3");
        return None;
    };
    let text = String::from_utf8_lossy(&output.stderr);
    let seen: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {text}"));
    let written = seen["output"].as_str().unwrap().to_owned();
    assert!(seen["missing"].is_null(), "{} was never written: {written:?}", seen["missing"]);
    Some(Shown {
        exit: seen["exit"].as_i64().unwrap(),
        output: written,
        restored: seen["restored"].as_bool().unwrap(),
    })
}

impl Shown {
    /// The terminal is as it was: its settings, its own screen, its cursor.
    pub(crate) fn assert_given_back(&self) {
        assert!(self.restored, "raw mode is left on");
        let last = |sequence: &str| self.output.rfind(sequence);
        assert!(last("\x1b[?1049h").is_some(), "it has drawn on a screen of its own");
        assert!(last("\x1b[?1049l") > last("\x1b[?1049h"), "the own screen is left");
        assert!(last("\x1b[?25h") > last("\x1b[?25l"), "the cursor is visible");
    }
}
