//! Unsafe code is only where it is named here, every package keeps the workspace's lints, and every dependency comes
//! from the public registry with a checksum.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

use std::fs;
use std::path::{Path, PathBuf};

/// Where unsafe code is allowed, and why.
const UNSAFE: [(&str, &str); 4] = [
    (
        "src/ros/waits.rs",
        "stands in for a function of the C library that the middleware cannot bear to be interrupted",
    ),
    ("src/allocations.rs", "counts heap allocations: an allocator cannot be written without"),
    ("crates/lanelet-map/tests/support/allocations.rs", "the same, for tests"),
    ("actors/tests/faults_of_memory.rs", "the same, for tests"),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files of this name or ending in the source folders, with their paths from the root.
fn sources(is_wanted: &dyn Fn(&str) -> bool) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders: Vec<PathBuf> = ["src", "actors", "crates", "tests", "benches", "examples", "fuzz"]
        .map(|folder| root().join(folder))
        .into();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().map(Result::unwrap) {
            let path = entry.path();
            if path.is_dir() && !path.ends_with("target") {
                folders.push(path);
            } else if path.file_name().is_some_and(|name| is_wanted(&name.to_string_lossy())) {
                let name = path.strip_prefix(root()).unwrap().to_string_lossy().into_owned();
                found.push((name, read(&path)));
            }
        }
    }
    found
}

/// True where the text has unsafe code, or allows some; comments and texts do not count.
fn is_unsafe(source: &str) -> bool {
    let code = source.lines().map(|line| line.split("//").next().unwrap_or_default());
    let mut words =
        code.flat_map(|line| line.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '"')));
    words.any(|word| word == "unsafe" || word == "unsafe_code")
}

#[test]
fn unsafe_code_is_only_where_it_is_named() {
    let files = sources(&|name| name.ends_with(".rs"));
    assert!(files.len() > 200, "{} files", files.len());
    let mut found: Vec<&str> =
        files.iter().filter(|(_, source)| is_unsafe(source)).map(|(name, _)| &name[..]).collect();
    found.retain(|name| *name != "tests/the_supply_chain_is_as_declared.rs");
    found.sort_unstable();
    let mut named: Vec<&str> = UNSAFE.iter().map(|(name, _)| *name).collect();
    named.sort_unstable();
    assert_eq!(found, named);
}

#[test]
fn unsafe_code_is_found() {
    for code in
        ["unsafe { x() }", "    unsafe impl A for B {}", "#![allow(unsafe_code)]", "pub unsafe fn f() {}"]
    {
        assert!(is_unsafe(code), "{code}");
    }
    for code in ["// unsafe { x() }", "let unsafe_side = 3;", "let text = \"unsafe\";"] {
        assert!(!is_unsafe(code), "{code}");
    }
}

#[test]
fn every_package_keeps_the_lints_of_the_workspace() {
    let workspace = read(&root().join("Cargo.toml"));
    assert!(workspace.contains("\nunsafe_code = \"deny\"\n"));
    let mut packages = sources(&|name| name == "Cargo.toml");
    packages.push(("Cargo.toml".to_owned(), workspace));
    assert!(packages.len() > 5);
    for (name, manifest) in packages {
        assert!(manifest.contains("[lints]\nworkspace = true\n"), "{name}");
    }
}

#[test]
fn every_dependency_comes_from_the_registry_with_its_checksum() {
    let lock = read(&root().join("Cargo.lock"));
    let packages = lock.split("[[package]]").skip(1);
    let (mut own, mut foreign) = (0, 0);
    for package in packages {
        match package.lines().find_map(|line| line.strip_prefix("source = ")) {
            None => own += 1,
            Some(source) => {
                foreign += 1;
                assert_eq!(source, "\"registry+https://github.com/rust-lang/crates.io-index\"", "{package}");
                assert!(package.contains("\nchecksum = \""), "{package}");
            }
        }
    }
    assert!(own >= 7, "the packages of the workspace");
    assert!(foreign > 100);
}
