//! The valid name that a wrong one was probably meant to be.

/// The candidate spelled most alike, none when nothing is similar. A candidate that ends with the wrong name (its
/// group was forgotten) comes first; among equals the first one.
pub(crate) fn nearest<'a>(wrong: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    if wrong.is_empty() {
        return None;
    }
    let limit = (wrong.chars().count() / 3).max(2);
    candidates
        .map(|name| (distance_or_suffix(wrong, name), name))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

fn distance_or_suffix(wrong: &str, name: &str) -> usize {
    let group_forgotten = name.strip_suffix(wrong).is_some_and(|rest| rest.ends_with(['.', ':']));
    if group_forgotten { 0 } else { edit_distance(&wrong.to_lowercase(), &name.to_lowercase()) }
}

/// Number of insertions, deletions, replacements and swaps of neighbours from one text to the other.
fn edit_distance(from: &str, to: &str) -> usize {
    let (from, to): (Vec<char>, Vec<char>) = (from.chars().collect(), to.chars().collect());
    let mut before: Vec<usize> = Vec::new();
    let mut previous: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.iter().enumerate() {
        let mut current = vec![i + 1];
        for (j, b) in to.iter().enumerate() {
            let mut cost = (previous[j] + usize::from(a != b)).min(previous[j + 1] + 1).min(current[j] + 1);
            if i > 0 && j > 0 && *a == to[j - 1] && from[i - 1] == *b {
                cost = cost.min(before[j - 1] + 1);
            }
            current.push(cost);
        }
        before = std::mem::replace(&mut previous, current);
    }
    previous.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        for (from, to, expected) in
            [("", "", 0), ("a", "", 1), ("kitten", "sitting", 3), ("ab", "ba", 1), ("abc", "acb", 1)]
        {
            assert_eq!(edit_distance(from, to), expected, "{from} {to}");
            assert_eq!(edit_distance(to, from), expected, "{to} {from}");
        }
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
