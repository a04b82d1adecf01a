use std::f64::consts::TAU;
use std::path::PathBuf;

use proptest::prelude::*;

use super::*;

/// A pseudo-random sequence (xorshift64*), so that the big loop below needs no framework.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        low + (high - low) * (bits as f64 / (1_u64 << 53) as f64)
    }
}

fn end_error(word: &Word, from: &PlanarPose, to: &PlanarPose) -> f64 {
    let end = word.end(from);
    end.distance_m(to).max(end.yaw_to(to).abs())
}

fn pattern(word: &Word) -> String {
    word.arcs()
        .iter()
        .map(|arc| match arc.curvature {
            k if k > 0.0 => 'L',
            k if k < 0.0 => 'R',
            _ => 'S',
        })
        .collect()
}

#[test]
fn every_word_ends_at_the_goal() {
    let mut random = Random(71);
    let mut seen = [0_usize; MAX_WORDS + 1];
    for _ in 0..100_000 {
        let mut pose = || {
            PlanarPose::new(random.between(-9.0, 9.0), random.between(-9.0, 9.0), random.between(-7.0, 7.0))
        };
        let (from, to) = (pose(), pose());
        let curvature = random.between(0.05, 1.0);
        let words = Words::between(&from, &to, curvature);
        seen[words.as_slice().len()] += 1;
        for word in words.as_slice() {
            let error = end_error(word, &from, &to);
            assert!(error < 1e-6, "{} from {from:?} to {to:?} misses by {error}", pattern(word));
        }
    }
    assert_eq!(seen[0], 0, "there is always a way");
    assert!(seen[8..].iter().sum::<usize>() > 10_000, "{seen:?}");
}

#[test]
fn poses_at_special_angles_have_words_that_end_at_the_goal() {
    for k in 0..8 {
        for l in 0..8 {
            for (x, y) in
                [(0.0, 0.0), (2.0, 0.0), (0.0, 2.0), (4.0, 0.0), (-2.0, 2.0), (0.0, -4.0), (1e-9, 0.0)]
            {
                let from = PlanarPose::new(0.0, 0.0, f64::from(k) * TAU / 8.0);
                let to = PlanarPose::new(x, y, f64::from(l) * TAU / 8.0);
                let words = Words::between(&from, &to, 1.0);
                assert!(words.shortest().is_some());
                for word in words.as_slice() {
                    assert!(end_error(word, &from, &to) < 1e-6, "{} to {to:?}", pattern(word));
                }
            }
        }
    }
}

/// `shared/` beside the workspace, or where `SELECTOR_SHARED` says.
fn shared(file: &str) -> Option<PathBuf> {
    let root = std::env::var_os("SELECTOR_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join(file);
    if path.exists() {
        Some(path)
    } else {
        eprintln!("skipped: {} is absent", path.display());
        None
    }
}

#[test]
fn the_shortest_word_is_as_short_as_known() {
    let Some(path) = shared("data/parking/reeds_shepp_lengths.csv") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let mut pairs = 0;
    for line in text.lines().skip(1) {
        let [x, y, yaw, length] = line.split(',').map(|n| n.parse().unwrap()).collect::<Vec<f64>>()[..]
        else {
            panic!("four numbers in {line}")
        };
        let words = Words::between(&PlanarPose::default(), &PlanarPose::new(x, y, yaw), 1.0);
        let ours = words.shortest().unwrap().length_m();
        assert!(ours <= length + 1e-9, "{line}: {ours}");
        assert!(ours >= length - 1e-6, "{line}: {ours} cannot be");
        pairs += 1;
    }
    assert_eq!(pairs, 2000);
}

/// The five pairs of poses of the planner's own tests, with the shortest words of the corrected table.
#[test]
fn known_shortest_words() {
    let pose = |x: f64, y: f64, deg: f64| PlanarPose::new(x, y, deg.to_radians());
    let max_curvature = 0.197_868_502_256_586;
    let pairs = [
        (pose(0.0, 0.0, 10.0), pose(7.0, -8.0, 50.0)),
        (pose(0.0, 0.0, 10.0), pose(7.0, -8.0, -50.0)),
        (pose(0.0, 10.0, -10.0), pose(-7.0, -8.0, -50.0)),
        (pose(0.0, 10.0, -10.0), pose(-7.0, -8.0, 150.0)),
        (pose(0.0, 10.0, -10.0), pose(7.0, 8.0, 150.0)),
    ];
    let full: [(&str, &[f64]); 5] = [
        ("RLR", &[6.863_973, 6.299_270, -4.092_963]),
        ("LRSL", &[-0.099_332, 7.938_587, 1.316_763, 2.745_527]),
        ("LRSL", &[-2.788_836, 7.938_587, 7.301_972, 7.199_162]),
        ("RSR", &[-6.828_962, -9.363_935, -7.284_081]),
        ("RLR", &[-0.545_385, 6.892_350, -6.675_309]),
    ];
    for ((from, to), (name, lengths)) in pairs.iter().zip(full) {
        let words = Words::between(from, to, max_curvature);
        let same = |word: &&Word| {
            word.arcs().len() == lengths.len()
                && word.arcs().iter().zip(lengths).all(|(arc, length)| (arc.length_m - length).abs() < 1e-5)
        };
        assert_eq!(words.as_slice().iter().find(same).map(pattern).as_deref(), Some(name));
        assert_shortest(&words, lengths.iter().map(|l| l.abs()).sum());
    }
    // with seven tenths of the steering angle
    let reduced = (0.7 * 0.512_690_467_773_f64).tan() / 2.8448;
    let known = [21.159_701, 13.888_328, 29.143_103, 25.569_454, 21.177_224];
    for ((from, to), length) in pairs.iter().zip(known) {
        assert_shortest(&Words::between(from, to, reduced), length);
    }
}

/// The known figures are without the words of four turns whose middle two are driven in one gear: one of those may
/// be shorter.
fn assert_shortest(words: &Words, length_m: f64) {
    let between = |word: &Word| matches!(word.arcs(), [_, a, b, _] if a.curvature == -b.curvature && a.gear() == b.gear());
    let without = words.as_slice().iter().filter(|word| !between(word));
    let word = without.min_by(|a, b| a.length_m().total_cmp(&b.length_m())).unwrap();
    assert!(
        (word.length_m() - length_m).abs() < 1e-5,
        "{} is {} long, not {length_m}",
        pattern(word),
        word.length_m()
    );
    let shortest = words.shortest().unwrap();
    assert!(shortest == word || between(shortest) && shortest.length_m() < word.length_m());
}

#[test]
fn equal_poses_need_no_pieces_and_bad_numbers_have_no_words() {
    let pose = PlanarPose::new(3.0, 4.0, 5.0);
    let shortest = *Words::between(&pose, &pose, 0.2).shortest().unwrap();
    assert_eq!((shortest.arcs().len(), shortest.gears()), (0, None));
    let turned = PlanarPose::new(3.0, 4.0, 5.0 + TAU);
    assert!(Words::between(&pose, &turned, 0.2).shortest().unwrap().length_m() < 1e-6);
    for (bad, curvature) in [
        (PlanarPose::new(f64::NAN, 0.0, 0.0), 0.2),
        (PlanarPose::new(0.0, 0.0, f64::INFINITY), 0.2),
        (pose, 0.0),
        (pose, f64::NAN),
    ] {
        assert!(Words::between(&pose, &bad, curvature).as_slice().is_empty());
        assert!(Words::between(&bad, &pose, curvature).as_slice().is_empty());
    }
}

#[test]
fn gears_and_changes_are_counted() {
    let word = |lengths: &[f64]| {
        let mut word = Word { count: lengths.len() as u8, ..Word::EMPTY };
        for (arc, &length) in word.arcs.iter_mut().zip(lengths) {
            *arc = Arc::new(0.1, length);
        }
        word
    };
    let cases: [(&[f64], usize, (Gear, Gear)); 3] = [
        (&[1.0, 2.0, 3.0], 0, (Gear::Forward, Gear::Forward)),
        (&[1.0, -2.0, 3.0, 1.0], 2, (Gear::Forward, Gear::Forward)),
        (&[-1.0, -2.0, 3.0], 1, (Gear::Reverse, Gear::Forward)),
    ];
    for (lengths, changes, gears) in cases {
        assert_eq!(word(lengths).gear_changes(), changes);
        assert_eq!(word(lengths).gears(), Some(gears));
    }
}

proptest! {
    #[test]
    fn costs_ascend_and_every_word_comes_once(
        x in -9.0..9.0_f64, y in -9.0..9.0_f64, yaw in -4.0..4.0_f64, penalty in 0.0..5.0_f64,
    ) {
        let words = Words::between(&PlanarPose::default(), &PlanarPose::new(x, y, yaw), 0.3);
        let cost = |word: &Word| word.length_m() + penalty * word.gear_changes() as f64;
        let count = words.as_slice().len();
        let sorted: Vec<_> = words.clone().by_cost(cost).collect();
        prop_assert_eq!(sorted.len(), count);
        prop_assert!(sorted.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        prop_assert!(sorted.iter().all(|(c, word)| *c == cost(word) && words.as_slice().contains(word)));
        let forward_only = words.by_cost(|word| if word.gear_changes() > 0 { f64::INFINITY } else { word.length_m() });
        prop_assert!(forward_only.into_iter().all(|(_, word)| word.gear_changes() == 0));
    }

    /// Driving the other way along the shortest word is a shortest word back; no path is shorter than the line.
    #[test]
    fn lengths_are_a_distance(
        x in -9.0..9.0_f64, y in -9.0..9.0_f64, yaw in -4.0..4.0_f64, curvature in 0.1..0.5_f64,
    ) {
        let (from, to) = (PlanarPose::new(1.0, 2.0, 3.0), PlanarPose::new(x, y, yaw));
        let there = Words::between(&from, &to, curvature).shortest().unwrap().length_m();
        let back = Words::between(&to, &from, curvature).shortest().unwrap().length_m();
        prop_assert!((there - back).abs() < 1e-7, "{there} there, {back} back");
        prop_assert!(there >= from.distance_m(&to) - 1e-9);
    }
}
