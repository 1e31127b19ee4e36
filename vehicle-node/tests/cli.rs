//! The command line of vehicle-node. That this file exists makes `cargo test` build the program itself.

use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vehicle-node")).args(arguments).output().expect("the program starts")
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
