//! What is no ROS argument is told of and starts nothing.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::Command;

#[test]
fn a_wrong_ros_argument_is_exit_code_2_with_its_name() {
    for (arguments, told) in [
        (&["--bogus"][..], "--bogus"),
        (&["-r", "no_rule"], "no_rule"),
        (&["-p"], "-p"),
        (&["-p", "fallback_period_ms:=often"], "fallback_period_ms"),
        (&["-p", "fallback_period_ms:=0"], "fallback_period_ms"),
        (&["--params-file", "/no/such/file.yaml"], "/no/such/file.yaml"),
        (&["--log-level", "loud"], "loud"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"))
            .args(["node", "--ros-args"])
            .args(arguments)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(told), "{arguments:?}: {said}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
}
