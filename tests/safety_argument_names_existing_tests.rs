//! The safety argument has no row without a test, and every test that it names exists.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Parts of the text in backticks of the form `path::name`.
fn tests_named_in(text: &str) -> Vec<(&str, &str)> {
    let quoted = text.split('`').skip(1).step_by(2);
    quoted.filter_map(|quoted| quoted.split_once(".rs::")).collect()
}

/// What stands before the function of this name, back to the end of the item before it; `None` where there is none.
fn attributes_of<'a>(source: &'a str, name: &str) -> Option<&'a str> {
    let start = source.find(&format!("fn {name}("))?;
    let before = &source[..start];
    let from = before.rfind("}\n").map_or(0, |end| end + 2);
    Some(&before[from..])
}

/// Why a row is none of the argument; `None` if it is.
fn objection(row: &str, root: &Path) -> Option<String> {
    let shown_by = row.trim_end().trim_end_matches('|').rsplit('|').next().unwrap_or_default();
    let tests = tests_named_in(shown_by);
    if tests.is_empty() {
        return Some(format!("no test is named: {row}"));
    }
    tests.into_iter().find_map(|(path, name)| {
        let path = format!("{path}.rs");
        let Ok(source) = fs::read_to_string(root.join(&path)) else {
            return Some(format!("`{path}` does not exist"));
        };
        // In a block of `proptest!` the attribute may be followed by others; the macro itself may stand before.
        let is_test = attributes_of(&source, name).is_some_and(|before| before.contains("#[test]"));
        (!is_test).then(|| format!("`{path}::{name}` is no test"))
    })
}

fn rows(page: &str) -> impl Iterator<Item = &str> {
    page.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| way out |"))
}

#[test]
fn every_row_of_the_safety_argument_names_tests_that_exist() {
    let page = fs::read_to_string(root().join("docs/safety.md")).unwrap();
    let objections: Vec<String> = rows(&page).filter_map(|row| objection(row, &root())).collect();
    assert!(objections.is_empty(), "docs/safety.md:\n{}", objections.join("\n"));
    assert!(rows(&page).count() > 25);
    // A row that no longer looks like one would not be looked at.
    let tables = page.lines().filter(|line| line.trim_start().starts_with('|')).count();
    assert_eq!(
        tables,
        rows(&page).count() + 2 * page.matches("| way out |").count(),
        "heads, rules and rows"
    );
}

#[test]
fn rows_without_a_test_or_with_one_that_is_none_are_found() {
    let this = "tests/safety_argument_names_existing_tests.rs";
    let told = |shown_by: &str| objection(&format!("| a way | a mechanism | {shown_by} |"), &root());
    assert_eq!(told(&format!("`{this}::rows_without_a_test_or_with_one_that_is_none_are_found`")), None);
    for bad in ["", "by hand", "`tests/nowhere.rs::a_test`", "`docs/safety.md`"] {
        assert!(told(bad).is_some(), "{bad}");
    }
    for name in ["no_such_test", "root", "rows_without_a_test", "objection"] {
        assert!(told(&format!("`{this}::{name}`")).is_some(), "{name}");
    }
}
