//! The report page works in a browser: no error on its console, slider and selection do what they say, and it shows the
//! same numbers as the JSON of the run. It loads nothing, and a drive of 20 s stays below 5 MB.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use program::{number, run, shared};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const MAX_PAGE_BYTES: u64 = 5_000_000;
const PROBE: &str = include_str!("report_page/probe.html");

/// The browser, or a visible line and `None` where there is none.
fn browser() -> Option<&'static str> {
    let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| {
        Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        assert!(std::env::var_os("SELECTOR_REQUIRE_PEERS").is_none(), "chromium is required here");
        eprintln!("skipped: there is no chromium");
    }
    found
}

/// What the probe saw on a page, after the page's own script has run.
fn probe(browser: &str, page: &Path) -> Value {
    let probed = page.with_extension("probed.html");
    let text = std::fs::read_to_string(page).unwrap();
    std::fs::write(&probed, text.replace("</body>", PROBE)).unwrap();
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--window-size=1400,900",
            "--enable-logging=stderr",
        ])
        .arg(format!("--user-data-dir={}", page.with_extension("profile").display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", probed.display()))
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stderr);
    let said: Vec<_> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(said.is_empty(), "the console is not silent: {said:?}");
    let dom = String::from_utf8(output.stdout).unwrap();
    let (_, rest) = dom.split_once("<pre id=\"probe\">").unwrap_or_else(|| panic!("no probe in {dom:.200}"));
    let (seen, _) = rest.split_once("</pre>").unwrap();
    let seen = seen.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&seen).unwrap_or_else(|error| panic!("{error}: {seen}; {log}"))
}

fn assert_page_shows(json: &Value, page: &Path) {
    assert!(page.metadata().unwrap().len() < MAX_PAGE_BYTES);
    let Some(browser) = browser() else { return };
    let seen = probe(browser, page);
    let cycles = number(json, &["cycles", "anchor"]) + number(json, &["cycles", "timer"]);
    assert_eq!(number(&seen, &["cycles"]), cycles);
    assert!(seen["title"].as_str().unwrap().starts_with("Cycle 6: "), "{seen}");
    assert!(seen["next_title"].as_str().unwrap().starts_with("Cycle 7: "), "{seen}");
    assert_eq!(seen["selected"], serde_json::json!([seen["wanted"]]));
    assert!(seen["detail"].as_str().unwrap().contains("rejected"), "{seen}");
    assert_eq!(seen["drawn_differently"], true);
    // The page counts its cycles one by one; the run has counted them on its own.
    let counted = |key: &str| seen["counts"][key].as_str().unwrap().parse::<u64>().unwrap();
    for key in ["judged", "accepted"] {
        assert_eq!(counted(key), number(json, &["candidates", key]), "{key}");
    }
}

#[test]
fn of_the_demo() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("demo.html");
    let outcome =
        run(&["demo", "--output", folder.path().to_str().unwrap(), "--report", page.to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    assert_page_shows(&outcome.json, &page);
}

#[test]
fn of_a_recorded_drive() {
    let Some(drive) = shared("data/drives/intersection.mcap") else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("drive.html");
    let outcome = run(&["replay", drive.to_str().unwrap(), "--report", page.to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    assert_page_shows(&outcome.json, &page);
}

#[test]
fn of_a_profile() {
    let Some(drive) = shared("data/drives/crosswalk.mcap") else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("profile.html");
    let profile = ["profile", drive.to_str().unwrap(), "--runs", "2"];
    let outcome = run(&[&profile[..], &["--report", page.to_str().unwrap()]].concat());
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    assert_page_shows(&outcome.json, &page);
    // Gathering a page is the page's own affair: what the node allocates is counted without it.
    let without = run(&profile);
    let per_cycle = |json: &Value| json["allocations"]["per_cycle"].as_f64().unwrap();
    let (with, without) = (per_cycle(&outcome.json), per_cycle(&without.json));
    assert!((with - without).abs() < 0.02 * without, "{with} and {without} allocations per cycle");
}

#[test]
fn of_one_explained_cycle() {
    let Some(drive) = shared("data/drives/crosswalk.mcap") else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("cycle.html");
    let explain = ["explain", drive.to_str().unwrap(), "--cycle", "40"];
    let all = run(&explain);
    let candidates = all.json["candidates"].as_array().unwrap();
    let wanted = candidates.last().unwrap();
    let key = wanted["key"].as_str().unwrap();
    let outcome = run(&[&explain[..], &["--candidate", key, "--report", page.to_str().unwrap()]].concat());
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    assert_eq!(outcome.json["candidates"], serde_json::json!([wanted]), "the page changes no word");
    let Some(browser) = browser() else { return };
    let seen = probe(browser, &page);
    assert_eq!(number(&seen, &["cycles"]), 1);
    assert_eq!(seen["opened"]["title"], format!("Cycle 40: {} candidates", candidates.len()));
    let selected = seen["opened"]["selected"].as_str().unwrap();
    assert!(selected.contains(wanted["generator"].as_str().unwrap()), "{selected}");
    let accepted = candidates.iter().filter(|candidate| candidate["accepted"] == true).count();
    assert_eq!(seen["counts"]["judged"], candidates.len().to_string());
    assert_eq!(seen["counts"]["accepted"], accepted.to_string());
}

#[test]
fn a_page_that_cannot_be_written_is_an_error_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("no such folder/demo.html");
    let outcome =
        run(&["demo", "--output", folder.path().to_str().unwrap(), "--report", page.to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("choose another --report"), "{}", outcome.stderr);
}
