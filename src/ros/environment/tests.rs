use super::*;

fn read(variables: &[(&str, &str)]) -> Result<Environment, EnvironmentError> {
    Environment::read(|asked| {
        variables.iter().find(|(name, _)| *name == asked).map(|(_, value)| OsString::from(value))
    })
}

fn good(variables: &[(&str, &str)]) -> Environment {
    read(variables).unwrap()
}

#[test]
fn an_empty_environment_is_the_default() {
    assert_eq!(good(&[]), Environment::default());
    let all_empty = Environment::read(|_| Some(OsString::new())).unwrap();
    assert_eq!(all_empty, Environment::default());
}

#[test]
fn domains() {
    for (value, expected) in [("0", 0), ("1", 1), ("42", 42), ("007", 7), ("101", 101), ("232", 232)] {
        assert_eq!(good(&[("ROS_DOMAIN_ID", value)]).domain_id, expected, "{value}");
    }
    for value in ["233", "-1", "+1", "1.0", "0x1", "one", " 1", "1 ", "65536", "99999999999999999999", "٣"] {
        let error = read(&[("ROS_DOMAIN_ID", value)]).unwrap_err();
        assert_eq!(error, EnvironmentError::DomainId(value.to_owned()));
        assert!(error.to_string().contains(&format!("`{value}`; it must be a whole number from 0 to 232")));
    }
}

#[test]
fn middlewares() {
    use ServiceMapping::{Cyclone, Enhanced};
    for (value, expected, noted) in [
        ("rmw_cyclonedds_cpp", Cyclone, false),
        ("rmw_fastrtps_cpp", Enhanced, false),
        ("rmw_fastrtps_dynamic_cpp", Enhanced, false),
        ("rmw_zenoh_cpp", Enhanced, true),
        ("rmw_connextdds", Enhanced, true),
        ("RMW_CYCLONEDDS_CPP", Enhanced, true),
    ] {
        let environment = good(&[("RMW_IMPLEMENTATION", value)]);
        assert_eq!(environment.service_mapping, expected, "{value}");
        let notes: Vec<Note> = noted.then(|| Note::UnknownMiddleware(value.to_owned())).into_iter().collect();
        assert_eq!(environment.notes, notes, "{value}");
    }
}

#[test]
fn ranges_of_discovery() {
    use Discovery::{Localhost, Subnet};
    let unknown = |range: &str| Note::UnknownRange(range.to_owned());
    let no_switch = |value: &str| Note::NoSwitch { variable: "ROS_LOCALHOST_ONLY", value: value.to_owned() };
    for (localhost_only, range, expected, notes) in [
        ("", "", Subnet, vec![]),
        ("", "SUBNET", Subnet, vec![]),
        ("", "SYSTEM_DEFAULT", Subnet, vec![]),
        ("", "LOCALHOST", Localhost, vec![]),
        ("", "localhost", Localhost, vec![unknown("localhost")]),
        ("", "WORLD", Localhost, vec![unknown("WORLD")]),
        ("0", "", Subnet, vec![]),
        ("0", "LOCALHOST", Localhost, vec![]),
        ("1", "", Localhost, vec![]),
        ("1", "LOCALHOST", Localhost, vec![]),
        ("1", "SUBNET", Localhost, vec![Note::RangeIgnored]),
        ("1", "OFF", Localhost, vec![Note::RangeIgnored]),
        ("true", "", Subnet, vec![no_switch("true")]),
    ] {
        let environment =
            good(&[("ROS_LOCALHOST_ONLY", localhost_only), ("ROS_AUTOMATIC_DISCOVERY_RANGE", range)]);
        assert_eq!((environment.discovery, environment.notes), (expected, notes), "{localhost_only} {range}");
    }
    let off = read(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")]).unwrap_err();
    assert_eq!(off, EnvironmentError::DiscoveryOff);
    assert!(off.to_string().contains("set it to LOCALHOST"));
}

#[test]
fn what_is_not_read_is_told() {
    let notes = good(&[
        ("ROS_STATIC_PEERS", "192.168.0.1;host"),
        ("CYCLONEDDS_URI", "file:///cyclonedds.xml"),
        ("FASTRTPS_DEFAULT_PROFILES_FILE", "a.xml"),
        ("FASTDDS_DEFAULT_PROFILES_FILE", "b.xml"),
    ])
    .notes;
    let told: Vec<_> = notes.iter().map(|note| (note.severity(), note.to_string())).collect();
    for ((severity, text), (expected, name)) in told.iter().zip([
        (Severity::Warn, "ROS_STATIC_PEERS"),
        (Severity::Info, "CYCLONEDDS_URI"),
        (Severity::Info, "FASTRTPS_DEFAULT_PROFILES_FILE"),
        (Severity::Info, "FASTDDS_DEFAULT_PROFILES_FILE"),
    ]) {
        assert!(*severity == expected && text.starts_with(name), "{text}");
    }
    assert_eq!(told.len(), 4);
}

#[test]
fn releases_with_ids_of_another_length_are_told() {
    for (release, has_long_ids) in [
        ("humble", true),
        ("foxy", true),
        ("iron", false),
        ("jazzy", false),
        ("kilted", false),
        ("rolling", false),
    ] {
        let notes = good(&[("ROS_DISTRO", release)]).notes;
        let told = has_long_ids != cfg!(feature = "humble");
        assert_eq!(notes == [Note::Release(release.to_owned())], told, "{release}");
        assert_eq!(notes.len(), usize::from(told));
    }
}

#[test]
fn the_console() {
    for (variables, coloured, to_stdout, notes) in [
        (&[][..], None, false, 0),
        (&[("RCUTILS_COLORIZED_OUTPUT", "1")], Some(true), false, 0),
        (&[("RCUTILS_COLORIZED_OUTPUT", "0")], Some(false), false, 0),
        (&[("RCUTILS_COLORIZED_OUTPUT", "yes")], None, false, 1),
        (&[("NO_COLOR", "1")], Some(false), false, 0),
        (&[("NO_COLOR", "1"), ("RCUTILS_COLORIZED_OUTPUT", "1")], Some(true), false, 0),
        (&[("RCUTILS_LOGGING_USE_STDOUT", "1")], None, true, 0),
        (&[("RCUTILS_LOGGING_USE_STDOUT", "0")], None, false, 0),
        (&[("RCUTILS_LOGGING_USE_STDOUT", "2")], None, false, 1),
    ] {
        let Environment { console, notes: told, .. } = good(variables);
        let expected = Console { format: None, coloured, to_stdout };
        assert_eq!((console, told.len()), (expected, notes), "{variables:?}");
    }
    let format = good(&[("RCUTILS_CONSOLE_OUTPUT_FORMAT", "{message}")]).console.format;
    assert_eq!(format.as_deref(), Some("{message}"));
}

#[cfg(unix)]
#[test]
fn bytes_that_are_no_text_fit_nothing() {
    use std::os::unix::ffi::OsStringExt as _;
    let error =
        Environment::read(|name| (name == "ROS_DOMAIN_ID").then(|| OsString::from_vec(vec![b'1', 0xff])));
    assert!(matches!(error, Err(EnvironmentError::DomainId(_))));
}
