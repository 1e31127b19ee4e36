//! One vehicle of a fleet, as a process.

use std::process::ExitCode;

use clap::Parser;
use vehicle_node::program::{Args, run};

fn main() -> ExitCode {
    bus::console::init_log();
    run(Args::parse())
}
