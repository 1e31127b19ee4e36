//! Mission control, as a process.

use std::process::ExitCode;

use clap::Parser;
use mission_control::cli::{Cli, main as run};

fn main() -> ExitCode {
    bus::console::init_log();
    run(Cli::parse())
}
