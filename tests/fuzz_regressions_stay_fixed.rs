//! What the fuzzer once found, and the inputs that together reach what it reached, go through the same targets without a
//! panic, on any toolchain; and so do mutants of our own data, which need no fuzzer.
//!
//! `SELECTOR_MUTANTS` says how many of them for each target, `SELECTOR_TARGET` for which one alone.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

#[path = "fuzz_support/seeds.rs"]
mod seeds;
#[allow(unreachable_pub, dead_code, reason = "the targets are a library of their own")]
#[path = "../fuzz/src/lib.rs"]
mod targets;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz")
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn every_input_of_every_target_passes() {
    let mut failed = Vec::new();
    for (name, target) in targets::TARGETS {
        let inputs = folder().join("regressions").join(name);
        let files = names_in(&inputs);
        assert!(!files.is_empty(), "{name} has no inputs");
        for file in files {
            let bytes = fs::read(inputs.join(&file)).unwrap();
            if catch_unwind(AssertUnwindSafe(|| target(&bytes))).is_err() {
                failed.push(format!("{name}/{file}"));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn every_target_has_its_program_its_length_and_its_inputs() {
    let mut names: Vec<&str> = targets::TARGETS.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    let programs = names_in(&folder().join("targets"));
    let programs: Vec<&str> = programs.iter().filter_map(|file| file.strip_suffix(".rs")).collect();
    assert_eq!(programs, names);
    assert_eq!(names_in(&folder().join("regressions")), names);
    let lengths = fs::read_to_string(folder().join("lengths")).unwrap();
    let lengths: Vec<&str> =
        lengths.lines().filter_map(|line| line.split_once(' ')).map(|(name, _)| name).collect();
    assert_eq!(lengths, names);
    let manifest = fs::read_to_string(folder().join("Cargo.toml")).unwrap();
    assert!(names.iter().all(|name| manifest.contains(&format!("path = \"targets/{name}.rs\""))));
}

#[test]
fn every_message_is_fuzzed() {
    let sources = folder().join("../crates/messages/src");
    let declared: usize = names_in(&sources)
        .iter()
        .filter(|name| name.ends_with(".rs"))
        .map(|name| fs::read_to_string(sources.join(name)).unwrap())
        .map(|source| source.lines().filter(|line| is_declaration(line)).count())
        .sum();
    assert_eq!(targets::KINDS.len(), declared);
}

/// Numbers that look random, the same each time.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % bound.max(1)
    }

    /// Some edits, most of them small.
    fn mutate(&mut self, bytes: &mut Vec<u8>, other: &[u8]) {
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len() + 1);
            let length = self.below(9).min(bytes.len() - at);
            match self.below(7) {
                0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
                1 if at < bytes.len() => bytes[at] = self.below(256) as u8,
                2 => drop(bytes.drain(at..at + length)),
                3 => {
                    let piece = bytes[at..at + length].to_vec();
                    let to = self.below(bytes.len() + 1);
                    bytes.splice(to..to, piece);
                }
                4 => {
                    let edge: [&[u8]; 5] =
                        [&[0; 4], &[0xff; 4], &[0xff, 0xff, 0xff, 0x7f], &[0; 8], b"1e308"];
                    let edge = edge[self.below(edge.len())];
                    let end = (at + edge.len()).min(bytes.len());
                    bytes.splice(at..end, edge.iter().copied());
                }
                5 => {
                    let from = self.below(other.len());
                    let until = (from + self.below(200)).min(other.len());
                    bytes.splice(at..at + length, other[from..until].iter().copied());
                }
                _ => bytes.truncate(at.max(bytes.len() / 2)),
            }
        }
    }
}

#[test]
fn mutants_of_our_own_data_pass() {
    let number = |name: &str| std::env::var(name).ok().and_then(|number| number.parse::<usize>().ok());
    let only = std::env::var("SELECTOR_TARGET").ok();
    let seeds = tempfile::tempdir().unwrap();
    seeds::write_all(seeds.path()).unwrap();
    for (name, target) in targets::TARGETS {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        // Logic takes longer than parsing.
        let usual = if ["cycle", "open_space"].contains(&name) { 20 } else { 400 };
        let inputs = seeds.path().join(name);
        let files = names_in(&inputs);
        assert!(!files.is_empty(), "{name} has no seeds");
        let originals: Vec<Vec<u8>> = files.iter().map(|file| fs::read(inputs.join(file)).unwrap()).collect();
        let mut random = Random(0x2545_f491_4f6c_dd1d);
        for number in 0..number("SELECTOR_MUTANTS").unwrap_or(usual) {
            let mut bytes = originals[random.below(originals.len())].clone();
            let other = &originals[random.below(originals.len())];
            random.mutate(&mut bytes, other);
            if catch_unwind(AssertUnwindSafe(|| target(&bytes))).is_err() {
                let kept = std::env::temp_dir().join(format!("mutant_of_{name}_{number}"));
                fs::write(&kept, &bytes).unwrap();
                panic!("{name}: {}", kept.display());
            }
        }
    }
}

#[test]
#[ignore = "writes the corpora that fuzz/run starts from"]
fn write_seed_corpora() {
    seeds::write_all(&folder().join("seeds")).unwrap();
}

/// `Name = "package/msg/Name" {`
fn is_declaration(line: &str) -> bool {
    let Some((name, rest)) = line.split_once(" = \"") else { return false };
    name.trim().chars().all(char::is_alphanumeric) && (rest.contains("/msg/") || rest.contains("/srv/"))
}
