use super::*;

fn parse_texts(arguments: &[&str]) -> Result<CommandLine, ArgumentError> {
    parse(arguments.iter().map(Into::into))
}

/// What one block with these arguments says.
fn block(arguments: &[&str]) -> Result<RosArguments, ArgumentError> {
    let line = parse_texts(&[&["program", "--ros-args"], arguments].concat())?;
    assert_eq!(line.program, ["program"]);
    Ok(line.ros.unwrap())
}

fn remap(rule: &str) -> (Option<String>, RemapKind) {
    let RemapRule { node, kind, text } = block(&["-r", rule]).unwrap().remaps.remove(0);
    assert_eq!(text, rule);
    (node, kind)
}

fn name(scope: NameScope, from: &str, to: &str) -> RemapKind {
    RemapKind::Name { scope, from: from.to_owned(), to: to.to_owned() }
}

#[test]
fn blocks_are_taken_out_and_the_rest_is_handed_on() {
    for (arguments, program, remaps) in [
        (&["p"][..], &["p"][..], None),
        (&["p", "--ros-args"], &["p"], Some(0)),
        (&["p", "--ros-args", "--"], &["p"], Some(0)),
        (&["p", "--ros-args", "--ros-args", "-r", "a:=b"], &["p"], Some(1)),
        (&["p", "--ros-args", "-r", "a:=b", "--remap", "c:=/d"], &["p"], Some(2)),
        (&["p", "--ros-args", "-r", "a:=b", "--", "--"], &["p", "--"], Some(1)),
        (&["p", "--", "--ros-args", "-r", "a:=b"], &["p", "--"], Some(1)),
        (
            &["p", "-d", "--ros-args", "-r", "a:=b", "--", "--foo=bar", "x"],
            &["p", "-d", "--foo=bar", "x"],
            Some(1),
        ),
        (
            &[
                "p",
                "--ros-args",
                "-r",
                "a:=b",
                "--",
                "-d",
                "--ros-args",
                "--ros-args",
                "-r",
                "c:=d",
                "--",
                "--",
                "x",
            ],
            &["p", "-d", "--", "x"],
            Some(2),
        ),
        // outside the blocks nothing is a ROS argument
        (&["p", "-r", "a:=b"], &["p", "-r", "a:=b"], None),
        (&["p", "__node:=x", "--log-level", "debug"], &["p", "__node:=x", "--log-level", "debug"], None),
        (&[], &[], None),
    ] {
        let line = parse_texts(arguments).unwrap();
        assert_eq!(line.program, program, "{arguments:?}");
        assert_eq!(line.ros.map(|ros| ros.remaps.len()), remaps, "{arguments:?}");
    }
}

#[test]
fn remap_rules() {
    use NameScope::*;
    let node_name = |name: &str| RemapKind::NodeName(name.to_owned());
    let namespace = |name: &str| RemapKind::Namespace(name.to_owned());
    for (rule, node, kind) in [
        ("__node:=node_name", None, node_name("node_name")),
        ("__name:=node_name", None, node_name("node_name")),
        ("old_name:__node:=nodename123", Some("old_name"), node_name("nodename123")),
        ("__ns:=/foo/bar", None, namespace("/foo/bar")),
        ("__ns:=/", None, namespace("/")),
        ("nodename:__ns:=/foobar", Some("nodename"), namespace("/foobar")),
        ("_:=kq", None, name(All, "_", "kq")),
        ("foo:=bar", None, name(All, "foo", "bar")),
        ("~/foo:=~/bar", None, name(All, "~/foo", "~/bar")),
        ("/foo/bar:=bar", None, name(All, "/foo/bar", "bar")),
        ("foo:=/bar", None, name(All, "foo", "/bar")),
        ("/foo123:=/bar123", None, name(All, "/foo123", "/bar123")),
        ("node:/foo123:=/bar123", Some("node"), name(All, "/foo123", "/bar123")),
        ("node:~/foo:=bar", Some("node"), name(All, "~/foo", "bar")),
        ("rostopic:=/foo/bar", None, name(All, "rostopic", "/foo/bar")),
        ("rosservice:=baz", None, name(All, "rosservice", "baz")),
        ("rostopic:foo:=baz", Some("rostopic"), name(All, "foo", "baz")),
        ("rostopic://rostopic:=rosservice", None, name(Topics, "rostopic", "rosservice")),
        ("rostopic:///rosservice:=rostopic", None, name(Topics, "/rosservice", "rostopic")),
        ("rostopic:///foo/bar:=baz", None, name(Topics, "/foo/bar", "baz")),
        ("rosservice://~/foo:=baz", None, name(Services, "~/foo", "baz")),
        ("node:rosservice://foo:=baz", Some("node"), name(Services, "foo", "baz")),
        ("__nodes:=bar", None, name(All, "__nodes", "bar")),
    ] {
        assert_eq!(remap(rule), (node.map(str::to_owned), kind), "{rule}");
    }
}

#[test]
fn parameters_and_files_keep_their_order() {
    let file = |path: &str| ParameterArgument::File(path.into());
    let value = |node: Option<&str>, name: &str, value: &str| ParameterArgument::Value {
        node: node.map(str::to_owned),
        name: name.to_owned(),
        value: value.to_owned(),
    };
    let arguments = [
        "-p",
        "a:=1",
        "--params-file",
        "x.yaml",
        "--param",
        "node:a.b.c_1:=[1.0, 2.0]",
        "-p",
        "s:=/bar:=baz",
        "--params-file",
        "--odd name",
        "-p",
        "t:= with blanks ",
        "-p",
        "qos_overrides./topic/a.publisher.depth:=3",
    ];
    assert_eq!(
        block(&arguments).unwrap().parameters,
        [
            value(None, "a", "1"),
            file("x.yaml"),
            value(Some("node"), "a.b.c_1", "[1.0, 2.0]"),
            value(None, "s", "/bar:=baz"),
            file("--odd name"),
            value(None, "t", " with blanks "),
            value(None, "qos_overrides./topic/a.publisher.depth", "3"),
        ]
    );
}

#[test]
fn log_levels() {
    use Severity::*;
    for (argument, logger, level) in [
        ("UNSET", None, None),
        ("DEBUG", None, Some(Debug)),
        ("debug", None, Some(Debug)),
        ("Info", None, Some(Info)),
        ("WARN", None, Some(Warn)),
        ("error", None, Some(Error)),
        ("fatal", None, Some(Fatal)),
        ("rclcpp:=warn", Some("rclcpp"), Some(Warn)),
        ("planning.selector:=Debug", Some("planning.selector"), Some(Debug)),
        ("a.b:=unset", Some("a.b"), None),
    ] {
        let expected = LogLevel { logger: logger.map(str::to_owned), level };
        assert_eq!(block(&["--log-level", argument]).unwrap().log_levels, [expected], "{argument}");
    }
    let several = block(&["--log-level", "info", "--log-level", "a:=debug"]).unwrap().log_levels;
    assert_eq!(several.len(), 2);
}

#[test]
fn switches_of_outputs_and_what_means_nothing_here() {
    let none = block(&[]).unwrap();
    assert_eq!((none.rosout_logs, none.stdout_logs), (None, None));
    let on = block(&["--enable-rosout-logs", "--disable-stdout-logs"]).unwrap();
    assert_eq!((on.rosout_logs, on.stdout_logs), (Some(true), Some(false)));
    let last = block(&["--enable-rosout-logs", "--disable-rosout-logs", "--enable-stdout-logs"]).unwrap();
    assert_eq!((last.rosout_logs, last.stdout_logs), (Some(false), Some(true)));
    let ignored = block(&[
        "--enable-external-lib-logs",
        "--disable-external-lib-logs",
        "--log-config-file",
        "f.config",
        "--log-file-name",
        "prefix",
        "-e",
        "/a",
        "--enclave",
        "/b",
    ]);
    assert_eq!(
        ignored.unwrap().ignored,
        [
            "--enable-external-lib-logs",
            "--disable-external-lib-logs",
            "--log-config-file f.config",
            "--log-file-name prefix",
            "-e /a",
            "--enclave /b",
        ]
    );
}

#[test]
fn what_is_no_ros_argument_is_refused() {
    for argument in [
        "--custom-ros-arg",
        "__node:=node_name",
        "old_name:__node:=node_name",
        "/foo/bar:=bar",
        "foo:=/bar",
        "file_name.yaml",
        "stdout-logs",
        "external-lib-logs",
        "--log",
        "--loglevel",
        "--remap=a:=b",
        "-rfoo:=bar",
        "-R",
        "",
        "--params-files",
        "--json",
    ] {
        let error = block(&[argument]).unwrap_err();
        assert_eq!(error, ArgumentError::Unknown { argument: argument.to_owned() });
        assert!(error.to_string().contains(&format!("`{argument}`")), "{error}");
    }
}

#[test]
fn a_flag_at_the_end_lacks_its_value() {
    for flag in [
        "-r",
        "--remap",
        "-p",
        "--param",
        "--params-file",
        "--log-level",
        "--log-config-file",
        "--log-file-name",
        "-e",
        "--enclave",
    ] {
        let error = block(&["--enable-stdout-logs", flag]).unwrap_err();
        assert!(matches!(error, ArgumentError::MissingValue { flag: named, .. } if named == flag), "{flag}");
        assert!(error.to_string().starts_with(&format!("`{flag}` needs ")), "{error}");
    }
}

#[test]
fn wrong_rules_are_named_with_their_fault() {
    for (flag, argument, reason) in [
        ("-r", ":=", "nothing before `:=`"),
        ("-r", "foo:=", "nothing behind `:=`"),
        ("-r", ":=bar", "nothing before `:=`"),
        ("-r", "foo", "has no `:=`; write `[NODE:]FROM:=TO`"),
        ("-r", "foo=bar", "has no `:=`"),
        ("-r", "--", "has no `:=`"),
        ("-r", "__ns:=", "nothing behind `:=`"),
        ("-r", "__ns:=foo", "`foo` does not begin with a slash"),
        ("-r", "__ns:=/foo/", "`/foo/` ends with a slash"),
        ("-r", "__ns:=/f oo", "has the character ` `"),
        ("-r", "__node:=", "nothing behind `:=`"),
        ("-r", "__node:=/foo/bar", "`/foo/bar` has a slash"),
        ("-r", "__node:=1a", "has the part `1a`"),
        ("-r", ":__node:=nodename", "`` is empty"),
        ("-r", "~:__node:=nodename", "`~` has a `~`"),
        ("-r", "a/b:__node:=nodename", "`a/b` has a slash"),
        ("-r", "}foo:=/bar", "has the character `}`"),
        ("-r", "f oo:=/bar", "has the character ` `"),
        ("-r", "foo:=/b ar", "has the character ` `"),
        ("-r", "f{oo:=/bar", "has the character `{`"),
        ("-r", "foo:=/b}ar", "has the character `}`"),
        ("-r", "foo:=/{node}", "has the character `{`"),
        ("-r", "foo:=bar/", "`bar/` ends with a slash"),
        ("-r", "foo//x:=bar", "`foo//x` has two slashes"),
        ("-r", "~/:=bar", "`~/` ends with a slash"),
        ("-r", "~:=bar", "`~` has a `~`"),
        ("-r", "foo:=~", "`~` has a `~`"),
        ("-r", "foo:=rostopic://bar", "two slashes in a row"),
        ("-r", "rostopic://:=rosservice", "`` is empty"),
        ("-r", "rostopic::=rosservice", "`` is empty"),
        ("-r", "a:b:c:=d", "has the character `:`"),
        ("-r", "foo/*:=bar", "`*` is not supported"),
        ("--remap", "**/foo:=bar", "`*` is not supported"),
        ("-r", "foo:=bar/\\1", "`\\` is not supported"),
        ("-p", ":=", "nothing before `:=`"),
        ("-p", "foo:=", "nothing behind `:=`"),
        ("-p", ":=bar", "nothing before `:=`"),
        ("-p", "foo", "has no `:=`; write `[NODE:]NAME:=VALUE`"),
        ("-p", "}foo:=/bar", "has the character `}`"),
        ("--param", "}foo:=/bar", "has the character `}`"),
        ("-p", "f oo:=/bar", "has the character ` `"),
        ("--param", "f oo:=/bar", "has the character ` `"),
        ("-p", "a..b:=1", "`a..b` has an empty part"),
        ("-p", ".a:=1", "`.a` has an empty part"),
        ("-p", "node::=1", "`` is empty"),
        ("-p", "a.1b:=1", "has the part `1b`"),
        ("-p", "n o:a:=1", "`n o` has the character ` `"),
        ("--log-level", "foo", "`foo` is no level; one of debug, info"),
        ("--log-level", "warning", "`warning` is no level"),
        ("--log-level", "a:=", "nothing behind `:=`"),
        ("--log-level", ":=debug", "nothing before `:=`"),
        ("--log-level", "a:=verbose", "`verbose` is no level"),
        ("--log-level", "", "`` is no level"),
    ] {
        let text = block(&[flag, argument]).unwrap_err().to_string();
        assert!(text.starts_with(&format!("`{flag} {argument}`")), "{argument}: {text}");
        assert!(text.contains(reason), "{argument}: {text}");
    }
}

#[cfg(unix)]
#[test]
fn bytes_that_are_no_text_are_refused_inside_and_handed_on_outside() {
    use std::os::unix::ffi::OsStringExt as _;
    let bytes = || OsString::from_vec(vec![b'a', 0xff]);
    let outside = parse(["p".into(), bytes()]).unwrap();
    assert_eq!(outside.program, ["p".into(), bytes()]);
    let rule = parse(["p".into(), "--ros-args".into(), "-r".into(), bytes()]);
    assert!(matches!(rule, Err(ArgumentError::NotText { flag: "-r", .. })), "{rule:?}");
    let flag = parse(["p".into(), "--ros-args".into(), bytes()]);
    assert!(matches!(flag, Err(ArgumentError::Unknown { .. })), "{flag:?}");
    let file = parse(["p".into(), "--ros-args".into(), "--params-file".into(), bytes()]).unwrap();
    assert_eq!(file.ros.unwrap().parameters, [ParameterArgument::File(bytes().into())]);
}
