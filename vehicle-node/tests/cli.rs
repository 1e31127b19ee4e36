//! The command line of vehicle-node. That this file exists makes `cargo test` build the program itself.

use std::process::{Command, Output, Stdio};

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vehicle-node"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

#[test]
fn help_and_version_are_told() {
    let help = run(&["--help"]);
    assert!(help.status.success());
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(text.contains("Usage: vehicle-node") && text.contains("Exit codes"), "{text}");
    let version = run(&["--version"]);
    assert_eq!(String::from_utf8_lossy(&version.stdout), format!("vehicle-node {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_wrong_option_is_exit_code_2_and_no_panic() {
    let wrong = run(&["--no-such-option"]);
    assert_eq!(wrong.status.code(), Some(2));
    let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(text.contains("--no-such-option") && !text.contains("panicked"), "{text}");
}

#[test]
fn a_patience_that_is_none_is_exit_code_2_and_no_panic() {
    for patience in ["nan", "inf", "-1", "1e300", "soon"] {
        let flag = format!("--patience={patience}");
        let wrong = run(&[&["--id", "a"][..], &[&flag]].concat());
        let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
        assert_eq!(wrong.status.code(), Some(2), "{text}");
        assert!(text.contains("allowed: 0 to 1e9 s") && !text.contains("panicked"), "{text}");
    }
}

/// Also while it looks for a network-emulator that will never come: the patience only keeps the test from waiting for ever.
#[test]
fn who_was_started_for_a_run_ends_when_its_starter_is_gone() {
    let logs = format!("{}/orphan-logs", env!("CARGO_TARGET_TMPDIR"));
    let nobody = ["--connect", "tcp/127.0.0.1:1", "--patience", "60", "--logs", &logs];
    let ended = run(&[&["--id", "a", "--end-with-stdin"][..], &nobody].concat());
    let text = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(0), "{text}");
    assert!(text.contains("mission-control is gone"), "{text}");
}
