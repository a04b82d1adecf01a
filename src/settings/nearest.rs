//! The valid name that a wrong one was probably meant to be.

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
        let distance = if group_forgotten(name) { Some(0) } else { edit_distance(&letters, others, limit) };
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

/// Number of insertions, deletions, replacements and swaps of neighbours from one text to the other, none if more
/// than the limit.
fn edit_distance(from: &[char], to: &[char], limit: usize) -> Option<usize> {
    if from.len().abs_diff(to.len()) > limit {
        return None;
    }
    let limit = limit.min(from.len().max(to.len()));
    let too_far = limit + 1;
    let mut before = vec![too_far; to.len() + 1];
    let mut previous: Vec<usize> = (0..=to.len()).collect();
    let mut current = before.clone();
    let mut least_of_previous = 0;
    for (i, a) in from.iter().enumerate() {
        current.fill(too_far);
        current[0] = i + 1;
        let mut least = i + 1;
        // Farther from the diagonal everything is too far.
        for j in i.saturating_sub(limit)..(i + 1 + limit).min(to.len()) {
            let b = to[j];
            let mut cost = (previous[j] + usize::from(*a != b)).min(previous[j + 1] + 1).min(current[j] + 1);
            if i > 0 && j > 0 && *a == to[j - 1] && from[i - 1] == b {
                cost = cost.min(before[j - 1] + 1);
            }
            current[j + 1] = cost;
            least = least.min(cost);
        }
        // Costs come from the last two rows and never fall.
        if least.min(least_of_previous) > limit {
            return None;
        }
        least_of_previous = least;
        std::mem::swap(&mut before, &mut previous);
        std::mem::swap(&mut previous, &mut current);
    }
    previous.last().copied().filter(|distance| *distance <= limit)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn distance(from: &str, to: &str, limit: usize) -> Option<usize> {
        edit_distance(&small_letters(from), &small_letters(to), limit)
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
