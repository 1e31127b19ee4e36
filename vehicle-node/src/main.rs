//! One vehicle of a fleet, as a process.

use std::process::ExitCode;

use clap::Parser;
use vehicle_node::program::{Args, run};

fn main() -> ExitCode {
    let args = Args::parse();
    bus::setup::share_one_runtime();
    bus::console::init_log();
    run(args)
}
