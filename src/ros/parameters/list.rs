//! Which parameters `list_parameters` names, by the rules of rclcpp.

use std::collections::BTreeSet;

use messages::rcl_interfaces::{ListParametersRequest, ListParametersResult};

/// Separates groups in names.
const SEPARATOR: char = '.';

/// The names at most `depth` levels below one of the prefixes (or below the root, if there are none), a name equal to
/// a prefix included; and the innermost groups of those names. Both sorted.
pub(super) fn list<'a>(
    names: impl Iterator<Item = &'a str>,
    prefixes: &[String],
    depth: u64,
) -> ListParametersResult {
    let listed: BTreeSet<&str> = names.filter(|name| is_listed(name, prefixes, depth)).collect();
    let groups: BTreeSet<&str> =
        listed.iter().filter_map(|name| Some(name.rsplit_once(SEPARATOR)?.0)).collect();
    let owned = |set: BTreeSet<&str>| set.into_iter().map(str::to_owned).collect();
    ListParametersResult { names: owned(listed), prefixes: owned(groups) }
}

fn is_listed(name: &str, prefixes: &[String], depth: u64) -> bool {
    let within = |name: &str| {
        depth == ListParametersRequest::DEPTH_RECURSIVE || (name.matches(SEPARATOR).count() as u64) < depth
    };
    if prefixes.is_empty() {
        return within(name);
    }
    prefixes.iter().any(|prefix| {
        name.strip_prefix(prefix.as_str())
            .is_some_and(|rest| rest.is_empty() || rest.strip_prefix(SEPARATOR).is_some_and(within))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_and_depths() {
        let names = ["foo", "bar", "foo.first", "foo.second", "foo.deep.third", "foobar.x"];
        for (prefixes, depth, expected) in [
            (&[][..], 0, &["bar", "foo", "foo.deep.third", "foo.first", "foo.second", "foobar.x"][..]),
            (&[], 1, &["bar", "foo"]),
            (&[], 2, &["bar", "foo", "foo.first", "foo.second", "foobar.x"]),
            (&[], 3, &["bar", "foo", "foo.deep.third", "foo.first", "foo.second", "foobar.x"]),
            (&["foo"], 0, &["foo", "foo.deep.third", "foo.first", "foo.second"]),
            (&["foo"], 1, &["foo", "foo.first", "foo.second"]),
            (&["foo"], 2, &["foo", "foo.deep.third", "foo.first", "foo.second"]),
            (&["foo.deep"], 1, &["foo.deep.third"]),
            (&["bar", "foobar"], 10, &["bar", "foobar.x"]),
            (&["fo"], 0, &[]),
            (&["foo."], 0, &[]),
            (&[""], 0, &[]),
            (&["none"], 0, &[]),
        ] {
            let prefixes: Vec<String> = prefixes.iter().map(|p: &&str| (*p).to_owned()).collect();
            let result = list(names.into_iter(), &prefixes, depth);
            assert_eq!(result.names, expected, "{prefixes:?} {depth}");
        }
        let result = list(names.into_iter(), &[], 0);
        assert_eq!(result.prefixes, ["foo", "foo.deep", "foobar"]);
        assert_eq!(list(names.into_iter(), &[], 1).prefixes, <[&str; 0]>::default());
    }
}
