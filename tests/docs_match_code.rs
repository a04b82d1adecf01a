//! What the documents say about the code is true: tests that they name exist, code that they show is the code.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Parts of the text in backticks of the form `path#name`.
fn tests_named_in(text: &str) -> Vec<(&str, &str)> {
    text.split('`').skip(1).step_by(2).filter_map(|quoted| quoted.split_once('#')).collect()
}

#[test]
fn every_deviation_names_a_test_that_exists() {
    let page = read(&root().join("docs/deviations.md"));
    let mut rows = 0;
    let is_row = |line: &&str| {
        line.starts_with("| ") && !line.starts_with("| # |") && !line.starts_with("| upstream |")
    };
    for row in page.lines().filter(is_row) {
        let shown_by = row.trim_end_matches('|').rsplit('|').next().unwrap();
        assert!(!tests_named_in(shown_by).is_empty(), "no test is named: {row}");
        rows += 1;
    }
    assert!(rows > 15, "{rows} rows were found");
    for (path, name) in tests_named_in(&page) {
        let source = read(&root().join(path));
        let function = format!("fn {name}(");
        assert!(source.contains(&function), "docs/deviations.md names `{path}#{name}`, which does not exist");
    }
}

#[test]
fn every_number_of_a_deviation_is_there_once() {
    let page = read(&root().join("docs/deviations.md"));
    let mut numbers: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(' ').next())
        .filter(|n| n.len() <= 3 && n.ends_with(char::is_numeric))
        .collect();
    let found = numbers.len();
    assert!(found > 15);
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), found);
}

#[test]
fn the_filter_in_the_guide_is_the_example() {
    let page = read(&root().join("docs/adding-a-filter.md"));
    let (_, rest) = page.split_once("```rust\n").unwrap();
    let (shown, _) = rest.split_once("```\n").unwrap();
    let example = read(&root().join("crates/selection/examples/own_filter.rs"));
    assert_eq!(shown, example, "copy the example into docs/adding-a-filter.md");
}

#[test]
fn links_between_documents_lead_somewhere() {
    let docs = root().join("docs");
    for name in ["deviations.md", "adding-a-filter.md"] {
        let page = read(&docs.join(name));
        for link in page.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            assert!(docs.join(link).exists(), "{name} links to {link}");
        }
    }
}
