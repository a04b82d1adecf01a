//! The files made from the parameter structs are up to date, load without a problem and equal the defaults.
use std::path::{Path, PathBuf};

use selection::parameters::FilterClass;
use trajectory_selector::commands::check;
use trajectory_selector::settings::generate::{generated_files, generated_tables};
use trajectory_selector::settings::{Component, DEFAULT_NODE_NAME, Settings, Source, Warning};

const COMMAND: &str = "cargo run --example generate_config";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn shipped() -> Vec<PathBuf> {
    let with_file = Component::ALL.into_iter().filter(|c| *c != Component::Node);
    with_file.map(|c| root().join(format!("config/{}.param.yaml", c.name()))).collect()
}

#[test]
fn generated_files_are_up_to_date() {
    for file in generated_files() {
        let on_disk = std::fs::read_to_string(root().join(&file.path))
            .unwrap_or_else(|error| panic!("{}: {error}; write it with `{COMMAND}`", file.path));
        assert!(on_disk == file.text, "{} differs from the program; write it with `{COMMAND}`", file.path);
    }
}

#[test]
fn parameter_tables_of_the_filter_pages_are_up_to_date() {
    let tables = generated_tables();
    assert_eq!(tables.len(), FilterClass::ALL.len());
    for table in tables {
        let page = std::fs::read_to_string(root().join(&table.path))
            .unwrap_or_else(|error| panic!("{}: {error}; every filter has a page", table.path));
        let fresh = table.put_into(&page).unwrap_or_else(|| panic!("{}: no place for the table", table.path));
        assert!(
            page == fresh,
            "the parameters in {} differ from the program; write them with `{COMMAND}`",
            table.path
        );
        assert!(table.table.lines().count() > 3, "{}: {}", table.path, table.table);
        assert_eq!(table.put_into("a page without markers"), None);
    }
}

#[test]
fn no_other_file_lies_in_config() {
    let made: Vec<PathBuf> = generated_files().iter().map(|file| root().join(&file.path)).collect();
    for folder in ["config", "config/schema"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            assert!(path.is_dir() || made.contains(&path), "{} is not generated", path.display());
        }
    }
}

#[test]
fn shipped_files_equal_the_defaults() {
    let sources: Vec<Source> = shipped().into_iter().map(Source::File).collect();
    let settings = Settings::load(DEFAULT_NODE_NAME, &sources).unwrap();
    assert_eq!(settings, Settings::default());
    assert_eq!(settings.warnings(), [] as [Warning; 0]);
    assert_eq!(settings.settings_hash(), Settings::default().settings_hash());
}

#[test]
fn shipped_files_pass_the_check_command() {
    let mut paths = shipped();
    paths.push(root().join("config/validator.upstream.param.yaml"));
    let report = check::run(&paths, None, |_| Vec::new());
    assert!(report.ok(), "{report}");
    assert_eq!(report.files.len(), paths.len());
}

#[test]
fn the_upstream_file_enforces_nothing() {
    let file = Source::File(root().join("config/validator.upstream.param.yaml"));
    let filters = Settings::load(DEFAULT_NODE_NAME, &[file]).unwrap().validator.filters();
    assert_eq!(filters.len(), FilterClass::ALL.len());
    assert!(filters.iter().all(|filter| !filter.enforced));
}
