//! The valid name that a wrong one was probably meant to be.

/// Known names of more letters are found only by shorter ones. Ours have fewer.
const LONGEST: usize = 128;

/// A name that is held against wrong ones.
#[derive(Debug)]
pub(crate) struct Known<'a> {
    name: &'a str,
    letters: Vec<char>,
    counts: LetterCounts,
}

impl<'a> Known<'a> {
    pub(crate) fn new(name: &'a str) -> Self {
        let letters = small_letters(name);
        Self { name, counts: counts(&letters), letters }
    }
}

/// The candidate spelled most alike, none when nothing is similar. A candidate that ends with the wrong name (its
/// group was forgotten) comes first; among equals the first one.
pub(crate) fn nearest<'a>(wrong: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    nearest_known(wrong, &candidates.map(Known::new).collect::<Vec<_>>())
}

/// The same, among candidates that are asked for again and again.
///
/// Names of other nodes may be many and long, so what may be nearest is looked at first, and candidates are given up as
/// soon as they are too far away.
pub(crate) fn nearest_known<'a>(wrong: &str, candidates: &[Known<'a>]) -> Option<&'a str> {
    if wrong.is_empty() {
        return None;
    }
    let limit = (wrong.chars().count() / 3).max(2);
    let letters = small_letters(wrong);
    let counts = counts(&letters);
    let pattern = Pattern::new(&letters);
    let group_forgotten =
        |name: &str| name.strip_suffix(wrong).is_some_and(|rest| rest.ends_with(['.', ':']));
    let mut order: Vec<(usize, usize)> = candidates
        .iter()
        .map(|known| if group_forgotten(known.name) { 0 } else { fewest_edits(&counts, &known.counts) })
        .zip(0..)
        .filter(|(fewest, _)| *fewest <= limit)
        .collect();
    order.sort_unstable();
    // Distance and place; the smaller one is better.
    let mut best: Option<(usize, usize)> = None;
    for (fewest, index) in order {
        let limit = match best {
            None => limit,
            Some(best) if best < (fewest, index) => continue,
            Some((distance, place)) => distance - usize::from(place < index),
        };
        let Known { name, letters: others, .. } = &candidates[index];
        let distance = match &pattern {
            _ if group_forgotten(name) => Some(0),
            Some(pattern) => pattern.edit_distance(others, limit),
            // It is as far to the one as to the other.
            None => Pattern::new(others).and_then(|pattern| pattern.edit_distance(&letters, limit)),
        };
        best = distance.map(|distance| (distance, index)).or(best);
    }
    best.map(|(_, index)| candidates[index].name)
}

fn small_letters(text: &str) -> Vec<char> {
    text.chars().flat_map(char::to_lowercase).collect()
}

/// How often letters are in a text; letters may share a place.
type LetterCounts = [u8; 32];

fn counts(letters: &[char]) -> LetterCounts {
    let mut counts = [0; 32];
    for letter in letters {
        let count: &mut u8 = &mut counts[*letter as usize % 32];
        *count = count.saturating_add(1);
    }
    counts
}

/// A lower bound of the edit distance, at a small part of its cost: an edit takes away one letter, adds one, does both
/// or neither.
fn fewest_edits(from: &LetterCounts, to: &LetterCounts) -> usize {
    let missing = |from: &LetterCounts, to: &LetterCounts| {
        from.iter().zip(to).map(|(from, to)| usize::from(from.saturating_sub(*to))).sum::<usize>()
    };
    missing(from, to).max(missing(to, from))
}

/// A text whose edit distance to others is asked for, column by column of the table of distances: each bit is a row (Hyyrö
/// 2003, "A bit-vector algorithm for computing Levenshtein and Damerau edit distances").
struct Pattern {
    length: usize,
    /// Where in the text a letter is, for the letters that names are made of.
    places: [u128; 128],
    /// And for all others.
    other_places: Vec<(char, u128)>,
}

impl Pattern {
    /// None for a text that is too long: see [`LONGEST`].
    fn new(letters: &[char]) -> Option<Self> {
        if letters.len() > LONGEST {
            return None;
        }
        let mut pattern = Self { length: letters.len(), places: [0; 128], other_places: Vec::new() };
        for (place, letter) in letters.iter().enumerate() {
            *pattern.places_of(*letter) |= 1 << place;
        }
        Some(pattern)
    }

    fn places_of(&mut self, letter: char) -> &mut u128 {
        if letter.is_ascii() {
            return &mut self.places[letter as usize];
        }
        let known = self.other_places.iter().position(|(other, _)| *other == letter);
        let index = known.unwrap_or_else(|| {
            self.other_places.push((letter, 0));
            self.other_places.len() - 1
        });
        &mut self.other_places[index].1
    }

    fn places(&self, letter: char) -> u128 {
        match self.places.get(letter as usize) {
            Some(places) => *places,
            None => {
                self.other_places.iter().find(|(other, _)| *other == letter).map_or(0, |(_, places)| *places)
            }
        }
    }

    /// Number of insertions, deletions, replacements and swaps of neighbours from one text to the other, none if more
    /// than the limit.
    fn edit_distance(&self, to: &[char], limit: usize) -> Option<usize> {
        // Nobody goes through a megabyte to find that it is too long.
        if self.length.abs_diff(to.len()) > limit {
            return None;
        }
        let Some(last) = self.length.checked_sub(1) else { return Some(to.len()) };
        let mut distance = self.length;
        // Rows where the distance is one more, or one less, than in the row above; where it is that of the row above in the
        // column before; where the letter of the column before is.
        let (mut more, mut less, mut same, mut before) = (u128::MAX, 0, 0, 0);
        for (letter, left) in to.iter().zip((0..to.len()).rev()) {
            let places = self.places(*letter);
            let swapped = ((!same & places) << 1) & before;
            same = ((places & more).wrapping_add(more) ^ more) | places | less | swapped;
            let (rises, falls) = (less | !(same | more), same & more);
            distance = distance + usize::from(rises >> last & 1 != 0) - usize::from(falls >> last & 1 != 0);
            // What is left can take away one for each letter.
            if distance > limit.saturating_add(left) {
                return None;
            }
            let rises = rises << 1 | 1;
            (more, less) = ((falls << 1) | !(same | rises), rises & same);
            before = places;
        }
        (distance <= limit).then_some(distance)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn distance(from: &str, to: &str, limit: usize) -> Option<usize> {
        Pattern::new(&small_letters(from)).unwrap().edit_distance(&small_letters(to), limit)
    }

    /// By the table of the distances of all beginnings.
    fn distance_by_definition(from: &str, to: &str) -> usize {
        let (from, to) = (small_letters(from), small_letters(to));
        let mut table = vec![vec![0; to.len() + 1]; from.len() + 1];
        for i in 0..=from.len() {
            for j in 0..=to.len() {
                let replaced =
                    |i: usize, j: usize| table[i - 1][j - 1] + usize::from(from[i - 1] != to[j - 1]);
                let is_swap = i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1];
                let options = [
                    (i == 0 && j == 0).then_some(0),
                    (i > 0).then(|| table[i - 1][j] + 1),
                    (j > 0).then(|| table[i][j - 1] + 1),
                    (i > 0 && j > 0).then(|| replaced(i, j)),
                    is_swap.then(|| table[i - 2][j - 2] + 1),
                ];
                table[i][j] = options.into_iter().flatten().min().unwrap();
            }
        }
        table[from.len()][to.len()]
    }

    #[test]
    fn distances() {
        for (from, to, expected) in [
            ("", "", 0),
            ("a", "", 1),
            ("kitten", "sitting", 3),
            ("ab", "ba", 1),
            ("abc", "acb", 1),
            ("abcdef", "badcfe", 3),
            ("xxxxyz", "zy", 5),
        ] {
            for limit in 0..8 {
                let expected = (expected <= limit).then_some(expected);
                assert_eq!(distance(from, to, limit), expected, "{from} {to} {limit}");
                assert_eq!(distance(to, from, limit), expected, "{to} {from} {limit}");
            }
        }
    }

    proptest! {
        #[test]
        fn a_limit_only_leaves_out(from in "[abc]{0,9}", to in "[abc]{0,9}", limit in 0_usize..10) {
            let whole = distance(&from, &to, usize::MAX).unwrap();
            prop_assert_eq!(distance(&from, &to, limit), (whole <= limit).then_some(whole));
        }

        #[test]
        fn the_distance_is_that_of_the_definition(
            from in prop_oneof!["[ab]{0,9}", "[a-eé]{0,128}"],
            to in prop_oneof!["[ab]{0,9}", "[a-eé]{0,140}"],
        ) {
            prop_assert_eq!(distance(&from, &to, usize::MAX), Some(distance_by_definition(&from, &to)));
        }

        #[test]
        fn letters_alone_never_tell_more_edits_than_there_are(from in "[a-d]{0,9}", to in "[a-d]{0,9}") {
            let few = fewest_edits(&counts(&small_letters(&from)), &counts(&small_letters(&to)));
            prop_assert!(few <= distance(&from, &to, usize::MAX).unwrap());
        }

        #[test]
        fn the_first_of_the_nearest_is_found(
            wrong in "[abc]{1,6}",
            names in proptest::collection::vec("[abc.]{0,8}", 0..6),
        ) {
            let of = |name: &str| {
                let group_forgotten = name.strip_suffix(wrong.as_str()).is_some_and(|rest| rest.ends_with('.'));
                if group_forgotten { 0 } else { distance(&wrong, name, usize::MAX).unwrap() }
            };
            let near = names.iter().filter(|name| of(name) <= 2);
            let expected = near.min_by_key(|name| of(name)).map(String::as_str);
            prop_assert_eq!(nearest(&wrong, names.iter().map(String::as_str)), expected);
        }
    }

    #[test]
    fn long_names_of_others_are_given_up_at_once() {
        let wrong = "x".repeat(1 << 20);
        assert_eq!(nearest(&wrong, ["safety.scale"].into_iter()), None);
    }

    #[test]
    fn the_longest_of_our_names_is_found_by_a_longer_one() {
        let names = crate::settings::parameter_table().iter().map(|descriptor| descriptor.name.as_str());
        let longest = names.max_by_key(|name| name.chars().count()).unwrap();
        assert!(longest.chars().count() <= LONGEST, "{longest}");
        let wrong = format!("{longest}{}", "x".repeat(longest.len() / 2 - 1));
        assert!(wrong.len() > LONGEST);
        assert_eq!(nearest_known(&wrong, &[Known::new(longest)]), Some(longest));
    }

    #[test]
    fn the_similar_name_or_none() {
        let names = ["fallback_period_ms", "vehicle_constraint.max_speed", "safety.scale"];
        let find = |wrong| nearest(wrong, names.into_iter());
        assert_eq!(find("fallback_period"), Some("fallback_period_ms"));
        assert_eq!(find("max_speed"), Some("vehicle_constraint.max_speed"));
        assert_eq!(find("vehicle_constraint.max_sped"), Some("vehicle_constraint.max_speed"));
        assert_eq!(find("Safety.Scale"), Some("safety.scale"));
        assert_eq!(find("xyzzy"), None);
        assert_eq!(find(""), None);
    }
}
