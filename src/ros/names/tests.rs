use super::*;
use crate::ros::arguments::parse;

/// The rules of a command line with these `-r` values.
fn rules(rules: &[&str]) -> Vec<RemapRule> {
    let arguments = rules.iter().flat_map(|rule| ["-r", rule]).map(Into::into);
    let line = ["node", "--ros-args"].map(Into::into).into_iter().chain(arguments);
    parse(line).unwrap().ros.unwrap().remaps
}

fn names(texts: &[&str]) -> Names {
    Names::new("selector", "", &rules(texts)).unwrap()
}

#[test]
fn node_name_and_namespace_come_first() {
    for (texts, name, namespace, fully_qualified, logger) in [
        (&[][..], "selector", "/", "/selector", "selector"),
        (&["__node:=other"], "other", "/", "/other", "other"),
        (&["__name:=other"], "other", "/", "/other", "other"),
        (&["__ns:=/a/b"], "selector", "/a/b", "/a/b/selector", "a.b.selector"),
        (&["__ns:=/"], "selector", "/", "/selector", "selector"),
        (&["__ns:=/a", "__node:=other"], "other", "/a", "/a/other", "a.other"),
        // the first rule of a kind wins
        (&["__node:=one", "__node:=two"], "one", "/", "/one", "one"),
        (&["__ns:=/one", "__ns:=/two"], "selector", "/one", "/one/selector", "one.selector"),
        // rules for a node: the old name for renaming, the new name for everything else
        (&["selector:__node:=one"], "one", "/", "/one", "one"),
        (&["another:__node:=one"], "selector", "/", "/selector", "selector"),
        (&["another:__node:=one", "__node:=two"], "two", "/", "/two", "two"),
        (&["selector:__node:=one", "one:__ns:=/x"], "one", "/x", "/x/one", "x.one"),
        (&["selector:__node:=one", "selector:__ns:=/x"], "one", "/", "/one", "one"),
        (&["selector:__ns:=/x"], "selector", "/x", "/x/selector", "x.selector"),
    ] {
        let names = names(texts);
        assert_eq!(
            (names.name(), names.namespace(), names.fully_qualified(), names.logger().as_str()),
            (name, namespace, fully_qualified, logger),
            "{texts:?}"
        );
    }
    let given = Names::new("selector", "/planning", &[]).unwrap();
    assert_eq!(given.fully_qualified(), "/planning/selector");
}

#[test]
fn names_are_expanded() {
    for (namespace, name, expected) in [
        ("/", "/a", "/a"),
        ("/", "a", "/a"),
        ("/", "a/b", "/a/b"),
        ("/", "~/a", "/selector/a"),
        ("/", "~", "/selector"),
        ("/x", "/a", "/a"),
        ("/x", "a", "/x/a"),
        ("/x/y", "~/a/b", "/x/y/selector/a/b"),
        ("/x", "{node}", "/x/selector"),
        ("/x", "a/{node}", "/x/a/selector"),
        ("/x", "/a_{node}_b", "/a_selector_b"),
        ("/x", "{ns}/a", "/x/a"),
        ("/x", "{namespace}/a", "/x/a"),
        ("/x", "~/{node}{ns}", "/x/selector/selector/x"),
        ("/x", "_a1/B2_", "/x/_a1/B2_"),
    ] {
        let names = Names::new("selector", namespace, &[]).unwrap();
        assert_eq!(names.topic(name).unwrap(), expected, "{name} in {namespace}");
        assert_eq!(names.service(name).unwrap(), expected, "{name} in {namespace}");
    }
}

#[test]
fn bad_names_are_refused() {
    use NameFault::*;
    let names = names(&[]);
    for (name, fault) in [
        ("", Empty),
        ("/", TrailingSlash),
        ("a/", TrailingSlash),
        ("~/", TrailingSlash),
        ("a//b", DoubleSlash),
        ("//a", DoubleSlash),
        ("~//a", DoubleSlash),
        ("a b", BadCharacter(' ')),
        ("a-b", BadCharacter('-')),
        ("größe", BadCharacter('ö')),
        ("a.b", BadCharacter('.')),
        ("a}", BadCharacter('}')),
        ("1a", LeadingDigit("1a".to_owned())),
        ("a/2", LeadingDigit("2".to_owned())),
        ("a/~/b", Tilde),
        ("~a", Tilde),
        ("{nod}", Substitution("{nod}".to_owned())),
        ("a{node", Substitution("{node".to_owned())),
        ("{ns}/a", DoubleSlash), // the root namespace is a slash of its own
    ] {
        let error = names.topic(name).unwrap_err();
        assert_eq!((&error.fault, error.rule), (&fault, None), "{name:?}");
    }
    let long = "a".repeat(MAX_NAME_BYTES);
    assert_eq!(names.topic(&long).unwrap_err().fault, TooLong, "with its slash one too long");
    assert!(names.topic(&long[1..]).is_ok());
}

#[test]
fn a_bad_node_name_or_namespace_is_refused() {
    use NameFault::*;
    for (name, namespace, fault) in [
        ("", "/", Empty),
        ("a/b", "/", Slash),
        ("1a", "/", LeadingDigit("1a".to_owned())),
        ("a b", "/", BadCharacter(' ')),
        ("a", "b", NotAbsolute),
        ("a", "/b/", TrailingSlash),
        ("a", "/b//c", DoubleSlash),
        ("a", "/1b", LeadingDigit("1b".to_owned())),
    ] {
        assert_eq!(Names::new(name, namespace, &[]).unwrap_err().fault, fault, "{name} {namespace}");
    }
}

#[test]
fn the_first_rule_that_matches_replaces_a_name_once() {
    for (texts, name, expected) in [
        (&["a:=b"][..], "a", "/x/b"),
        (&["a:=b"], "/x/a", "/x/b"),
        (&["a:=b"], "/a", "/a"),
        (&["/x/a:=/b"], "a", "/b"),
        (&["~/input/a:=/abs/topic"], "~/input/a", "/abs/topic"),
        (&["~/input/a:=/abs/topic"], "/x/selector/input/a", "/abs/topic"),
        (&["selector/a:=b"], "~/a", "/x/b"),
        (&["a:=~/b"], "a", "/x/selector/b"),
        // order of the command line
        (&["a:=one", "a:=two"], "a", "/x/one"),
        (&["/x/a:=one", "a:=two"], "a", "/x/one"),
        // no chains, no swaps undone
        (&["a:=b", "b:=c"], "a", "/x/b"),
        (&["a:=b", "b:=a"], "a", "/x/b"),
        (&["a:=b", "b:=a"], "b", "/x/a"),
        // rules of other nodes
        (&["selector:a:=b"], "a", "/x/b"),
        (&["another:a:=b"], "a", "/x/a"),
        (&["another:a:=b", "a:=c"], "a", "/x/c"),
        // only whole names
        (&["a:=b"], "a/c", "/x/a/c"),
        (&["_:=kq"], "_", "/x/kq"),
    ] {
        let mut texts = texts.to_vec();
        texts.push("__ns:=/x");
        assert_eq!(names(&texts).topic(name).unwrap(), expected, "{texts:?} {name}");
        assert_eq!(names(&texts).service(name).unwrap(), expected, "{texts:?} {name}");
    }
}

#[test]
fn a_scheme_restricts_a_rule() {
    for (text, topic, service) in [
        ("a:=b", "/b", "/b"),
        ("rostopic://a:=b", "/b", "/a"),
        ("rosservice://a:=b", "/a", "/b"),
        ("rostopic:///a:=b", "/b", "/a"),
        ("rosservice://~/a:=b", "/a", "/a"),
        ("selector:rostopic://a:=b", "/b", "/a"),
        ("another:rostopic://a:=b", "/a", "/a"),
    ] {
        let names = names(&[text]);
        assert_eq!(names.topic("a").unwrap(), topic, "{text}");
        assert_eq!(names.service("a").unwrap(), service, "{text}");
    }
    assert_eq!(
        names(&["rosservice://~/get_parameters:=/p"]).service("~/get_parameters").unwrap(),
        "/p",
        "parameter services can be remapped"
    );
}

/// The rule is fine in itself; what it makes of the name is not.
#[test]
fn a_rule_that_makes_a_bad_name_is_named() {
    let long = format!("a:=/{}", "b".repeat(MAX_NAME_BYTES));
    let error = Names::new("selector", "", &rules(&[&long])).unwrap_err();
    assert_eq!((error.fault.clone(), error.rule.as_deref()), (NameFault::TooLong, Some(long.as_str())));
    assert!(error.to_string().contains("(remap rule `a:=/bbb"), "{error}");
}
