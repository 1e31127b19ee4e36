//! The command line of network-emulator. That this file exists makes `cargo test` build the program itself.

use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_network-emulator")).args(arguments).output().expect("the program starts")
}

#[test]
fn help_and_version_are_told() {
    let help = run(&["--help"]);
    assert!(help.status.success());
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(text.contains("Usage: network-emulator") && text.contains("Exit codes"), "{text}");
    let version = run(&["--version"]);
    assert_eq!(String::from_utf8_lossy(&version.stdout), format!("network-emulator {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_wrong_option_is_exit_code_2_and_no_panic() {
    let wrong = run(&["--no-such-option"]);
    assert_eq!(wrong.status.code(), Some(2));
    let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(text.contains("--no-such-option") && !text.contains("panicked"), "{text}");
}
