//! The emulated network between the vehicles, as a process.

use std::process::ExitCode;

use clap::Parser;
use network_emulator::program::{Args, run};

fn main() -> ExitCode {
    bus::console::init_log();
    run(Args::parse())
}
