//! Whatever the bytes: a map or an error, never a panic, and memory bounded by four times the input plus 64 MB.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/allocations.rs"]
mod allocations;
#[path = "support/fixture.rs"]
mod fixture;
#[path = "support/shared.rs"]
mod shared;

use std::path::PathBuf;

use allocations::peak_of;
use lanelet_map::archive::{decode, decode_with_info, encode};
use lanelet_map::{ArchiveProblem, Layer, Map, MapBuilder, MapError};

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;

/// Decodes and checks the promise about memory.
fn bounded(bytes: &[u8]) -> Result<Map, MapError> {
    let (result, peak) = peak_of(|| decode(bytes));
    assert!(peak <= 4 * bytes.len() + (64 << 20), "{peak} bytes for an input of {}", bytes.len());
    result
}

/// A small reproducible generator (xorshift64*).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(40)).min(bytes.len());
        match random.below(8) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes[at..end].fill(if random.below(2) == 0 { 0 } else { 0xff }),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let copy = bytes[at..end].to_vec();
                let place = random.below(bytes.len());
                bytes.splice(place..place, copy);
            }
            5 => bytes.truncate(at.max(1)),
            6 if at + 8 <= bytes.len() => {
                let left = (bytes.len() - at) as u64;
                let count = [left / 6, left / 7, left / 16, left, u64::MAX, 1 << 60][random.below(6)];
                bytes[at..at + 8].copy_from_slice(&count.to_le_bytes());
            }
            _ if at + 4 <= bytes.len() => {
                let id = random.below(64) as u32;
                bytes[at..at + 4].copy_from_slice(&id.to_le_bytes());
            }
            _ => bytes[at] = 1,
        }
    }
}

/// Mutates one archive `times` times; the number of mutants that were still maps.
fn mutants(original: &[u8], times: usize, random: &mut Random) -> usize {
    let mut maps = 0;
    for _ in 0..times {
        let mut bytes = original.to_vec();
        mutate(&mut bytes, random);
        if let Ok(map) = bounded(&bytes) {
            maps += 1;
            assert!(map.points().all(|point| point.position().iter().all(|v| v.is_finite())));
            if bytes.len() < 20_000 {
                assert!(decode(&encode(&map)).unwrap() == map);
                let _ = lanelet_map::dump::dump(&map);
            }
        }
    }
    maps
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = encode(&fixture::every_kind());
    for length in 0..bytes.len() {
        assert!(bounded(&bytes[..length]).is_err(), "{length} bytes");
    }
    let Some(dir) = shared::shared("every_truncation_is_an_error") else { return };
    let bytes = std::fs::read(dir.join("data/maps/synthetic/tiny.bin")).unwrap();
    for length in 0..bytes.len() {
        let error = bounded(&bytes[..length]).unwrap_err();
        assert!(matches!(error, MapError::Archive { .. }), "{length} bytes: {error}");
    }
}

#[test]
fn mutants_of_a_map_made_in_code() {
    let mut random = Random(7);
    let maps = mutants(&encode(&fixture::every_kind()), 3000, &mut random);
    assert!(maps > 0, "some mutations only change a coordinate or a letter");
}

#[test]
fn ten_thousand_mutants_of_real_archives() {
    let Some(dir) = shared::shared("ten_thousand_mutants_of_real_archives") else { return };
    let mut paths: Vec<PathBuf> = shared::expected_maps(&dir).into_iter().map(|map| map.bin).collect();
    paths.extend(shared::golden_maps(&dir).into_iter().map(|path| path.with_extension("bin")));
    let archives: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    // Every archive a few times, the small ones often.
    let small = archives.iter().filter(|bytes| bytes.len() < 30_000).count();
    let often = (10_000 - 5 * archives.len()).div_ceil(small);
    let mut random = Random(20_260);
    let (mut total, mut maps) = (0, 0);
    for bytes in &archives {
        let times = if bytes.len() < 30_000 { 5 + often } else { 5 };
        maps += mutants(bytes, times, &mut random);
        total += times;
    }
    println!("{maps} of {total} mutants were still maps");
    assert!(total >= 10_000 && maps > 0 && maps < total);
}

#[test]
fn a_deep_chain_needs_no_deep_stack() {
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(|| {
        let map = fixture::chain(20_000);
        let bytes = encode(&map);
        let (decoded, info) = decode_with_info(&bytes).unwrap();
        assert!(info.max_depth >= 39_999, "depth {}", info.max_depth);
        assert_eq!(decoded.lanelets().len(), 20_000);
        assert!(encode(&decoded) == bytes);
        bounded(&bytes).map(drop)
    });
    thread.unwrap().join().unwrap().unwrap();
}

#[test]
fn nested_counts_cannot_promise_the_same_bytes_twice() {
    let original = encode(&fixture::chain(2_000));
    for share in [1, 2, 10, 500] {
        let mut bytes = original.clone();
        for rule in 0..1_999_i64 {
            let mut pattern = 1_u64.to_le_bytes().to_vec();
            pattern.extend((fixture::CHAIN_RULE + rule).to_le_bytes());
            let Some(at) = bytes.windows(16).position(|window| window == pattern) else { continue };
            let count = (bytes.len() - at - 16) / 8 / share;
            bytes[at..at + 8].copy_from_slice(&(count as u64).to_le_bytes());
        }
        let (result, peak) = peak_of(|| decode(&bytes));
        assert!(matches!(result, Err(MapError::Archive { .. })), "share 1/{share}");
        assert!(peak < 4 * bytes.len(), "{peak} bytes for an input of {}", bytes.len());
    }
}

/// Bytes after the line string layer of a map with nothing but points and line strings.
const TAIL: usize = 4 * 8 + 8;

#[test]
fn a_layer_of_references_stays_within_the_bound() {
    let points = |lines: &[i64]| {
        let mut b = MapBuilder::new();
        b.point(1, [0.0; 3], &[]).unwrap();
        b.point(2, [1.0; 3], &[]).unwrap();
        for line in lines {
            b.line_string(*line, &[1, 2], &[]).unwrap();
        }
        encode(&b.build().unwrap())
    };
    let without = points(&[]);
    let mut bytes = points(&[5]);
    let count_at = without.len() - TAIL - 8;
    let references: u64 = 10_000_000;
    bytes[count_at..count_at + 8].copy_from_slice(&(references + 1).to_le_bytes());
    let tail = bytes.split_off(bytes.len() - TAIL);
    // Flag, class id and object id as the first mention has them: flag and shared_ptr preamble, then the pointer.
    let class_id = bytes[count_at + 8 + 5 + 1 + 5..][..2].to_vec();
    let object_id = 2_u32.to_le_bytes();
    let reference = [&[0], class_id.as_slice(), &object_id].concat();
    for _ in 0..references {
        bytes.extend(&reference);
    }
    bytes.extend(tail);
    let error = bounded(&bytes).unwrap_err();
    assert!(matches!(error, MapError::DuplicateId { layer: Layer::LineStrings, id: 5 }), "{error}");
}

#[test]
fn a_point_with_millions_of_attributes_stays_within_the_bound() {
    let mut b = MapBuilder::new();
    b.point(1, [0.0; 3], &[("", "")]).unwrap();
    let mut bytes = encode(&b.build().unwrap());
    let tail = bytes.split_off(bytes.len() - (24 + 8 + TAIL));
    let count_at = bytes.len() - (5 + 8 + 5 + 8) - 12;
    let more: u64 = 3_000_000;
    bytes[count_at..count_at + 8].copy_from_slice(&(more + 1).to_le_bytes());
    bytes.resize(bytes.len() + 16 * more as usize, 0);
    bytes.extend(tail);
    let map = bounded(&bytes).unwrap();
    assert_eq!(map.point(1).unwrap().attributes().len(), 1);
}

#[test]
fn text_that_is_not_utf_8_stays_readable_and_small() {
    let letters = "x".repeat(20_000_000);
    let mut b = MapBuilder::new();
    b.point(1, [0.0; 3], &[("name", &letters)]).unwrap();
    let mut bytes = encode(&b.build().unwrap());
    for byte in &mut bytes {
        if *byte == b'x' {
            *byte = 0xff;
        }
    }
    let map = bounded(&bytes).unwrap();
    let name = map.point(1).unwrap().attribute("name").unwrap();
    assert_eq!(name.len(), letters.len());
    assert!(name.bytes().all(|byte| byte == b'?'));
}

fn problem_of(bytes: &[u8]) -> (usize, ArchiveProblem) {
    match bounded(bytes) {
        Err(MapError::Archive { offset, problem }) => (offset, problem),
        other => panic!("expected a damaged archive, got {other:?}"),
    }
}

#[test]
fn the_header_is_checked() {
    let good = encode(&fixture::every_kind());
    let patched = |at: usize, value: u8| {
        let mut bytes = good.clone();
        bytes[at] = value;
        bytes
    };
    assert_eq!(problem_of(b"<?xml version='1.0'?><osm></osm> "), (0, ArchiveProblem::NotAnArchive));
    assert_eq!(problem_of(&patched(10, b'x')), (0, ArchiveProblem::NotAnArchive));
    assert_eq!(problem_of(&patched(30, 7)), (30, ArchiveProblem::UnsupportedVersion { found: 7 }));
    for version in [8, 15, 17, 18, 19, 20, 255] {
        assert_eq!(decode_with_info(&patched(30, version)).unwrap().1.library_version, u16::from(version));
    }
    assert_eq!(problem_of(&patched(33, 4)).1, ArchiveProblem::ForeignLayout);
    assert_eq!(problem_of(&patched(36, 0)).1, ArchiveProblem::ForeignLayout);
    let mut longer = good.clone();
    longer.push(0);
    assert_eq!(problem_of(&longer), (good.len(), ArchiveProblem::TrailingBytes { count: 1 }));
}

#[test]
fn the_worked_example_with_one_wrong_place() {
    let Some(dir) = shared::shared("the_worked_example_with_one_wrong_place") else { return };
    let good = std::fs::read(dir.join("data/maps/synthetic/tiny.bin")).unwrap();
    // Offsets and meanings are those of the annotated walk over this archive.
    let cases: [(usize, &[u8], ArchiveProblem); 9] = [
        (0x2d, &[0xff; 8], ArchiveProblem::CountTooLarge { count: u64::MAX }),
        (0x35, &[2], ArchiveProblem::BadFlag { found: 2 }),
        (0x3f, &[0xff, 0xff], ArchiveProblem::NullPointer { expected: "point" }),
        (0x46, &[9], ArchiveProblem::ObjectId { found: 9, next: 0 }),
        (0xba, &[8], ArchiveProblem::ClassId { found: 8, known: 3, expected: "point" }),
        (0x33c, &[0], ArchiveProblem::WrongKind { id: 0, expected: "line string" }),
        (0x409, &[5], ArchiveProblem::ParameterKind { found: 5 }),
        (0x410, &[1], ArchiveProblem::WrongKind { id: 1, expected: "line string" }),
        (0x354, &[32], ArchiveProblem::RegulatoryId { outer: 32, inner: 31 }),
    ];
    for (at, patch, problem) in cases {
        let mut bytes = good.clone();
        bytes[at..at + patch.len()].copy_from_slice(patch);
        assert_eq!(problem_of(&bytes).1, problem, "offset {at:#x}");
    }
}

#[test]
fn coordinates_that_are_not_finite_name_their_point() {
    let mut b = MapBuilder::new();
    b.point(77, [0.0, 1234.5, 0.0], &[]).unwrap();
    let good = encode(&b.build().unwrap());
    let at = good.windows(8).position(|window| window == 1234.5_f64.to_le_bytes()).unwrap();
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bytes = good.clone();
        bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        assert!(matches!(bounded(&bytes), Err(MapError::NonFinitePoint { point: 77 })));
    }
}
