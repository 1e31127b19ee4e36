//! Mission control, as a process.

use std::process::ExitCode;

use clap::Parser;
use mission_control::cli::{Cli, main as run};

fn main() -> ExitCode {
    let cli = Cli::parse();
    bus::setup::share_one_runtime();
    bus::console::init_log();
    run(cli)
}
