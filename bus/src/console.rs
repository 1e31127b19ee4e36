//! What a program says to the person at its terminal, and what that person can say to it with a signal.

use std::fmt;
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use tracing_subscriber::EnvFilter;

/// What is logged unless `RUST_LOG` says otherwise. Zenoh's own lines are left out: what fails comes back to the program as an
/// error, which says it in the user's words, and what is left is how its sessions part, such as an `ERROR` about a message
/// that was under way when the other end closed.
const USUAL: &str = "info,zenoh=off";

/// Log lines go to stderr, `info` and above (`RUST_LOG` changes that), with colour on a terminal only.
pub fn init_log() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(USUAL));
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_target(false)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr)
        .log_internal_errors(false)
        .try_init();
}

/// How long to wait, as given on a command line \[s\].
///
/// # Errors
/// It is no number from 0 to 1e9.
pub fn patience(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=1e9).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "allowed: 0 to 1e9 s".to_string())
}

/// Whether something that was to be read from stdout got lost.
static LOST: AtomicBool = AtomicBool::new(false);

/// Writes to stdout. That it cannot be written is no reason to fall over; [`lost`] tells.
pub fn write_out(text: fmt::Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    // A reader that has read enough and closed its pipe has lost nothing.
    let written = out.write_fmt(text).and_then(|()| out.flush());
    if written.is_err_and(|error| error.kind() != std::io::ErrorKind::BrokenPipe) {
        LOST.store(true, Ordering::Relaxed);
    }
}

/// Whether something that was to be read from stdout got lost, on a full disk for instance.
pub fn lost() -> bool {
    LOST.load(Ordering::Relaxed)
}

/// Writes to stderr, likewise.
pub fn write_err(text: fmt::Arguments<'_>) {
    let _ = std::io::stderr().lock().write_fmt(text);
}

/// A line for whoever asked: `println!` that survives a closed pipe.
#[macro_export]
macro_rules! tell {
    ($($text:tt)*) => {
        $crate::console::write_out(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// A line for the person at the terminal: `eprintln!` that survives a closed pipe.
#[macro_export]
macro_rules! remark {
    ($($text:tt)*) => {
        $crate::console::write_err(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// Whether the process was asked to end.
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// A flag for SIGINT, SIGTERM and SIGHUP, which end the process at once until [`arm`](StopFlag::arm) is called. (The first
    /// process of a container has no default for them.)
    pub fn on_signals() -> StopFlag {
        let flag = StopFlag(Arc::new(AtomicBool::new(true)));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            // In this order: the second signal finds the flag raised by the first.
            let exit = signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&flag.0));
            if let Err(error) = exit.and_then(|_| signal_hook::flag::register(signal, Arc::clone(&flag.0))) {
                tracing::debug!("signal {signal} keeps its default: {error}");
            }
        }
        flag
    }

    /// From now on the first signal raises the flag, and only a second one ends the process at once.
    pub fn arm(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether it was raised.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Whether the process that holds the other end of standard input is gone.
#[derive(Clone, Debug, Default)]
pub struct Parent(Arc<AtomicBool>);

impl Parent {
    /// Watches standard input, on a thread that ends with it.
    pub fn at_stdin() -> Parent {
        let gone = Arc::<AtomicBool>::default();
        let tell = Arc::clone(&gone);
        let watch = move || {
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            tell.store(true, Ordering::Relaxed);
        };
        if let Err(error) = std::thread::Builder::new().name("parent".into()).spawn(watch) {
            tracing::debug!("the parent is not watched: {error}");
        }
        Parent(gone)
    }

    /// Whether it is gone.
    pub fn is_gone(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The operating system and its release.
pub fn system() -> String {
    let uname = rustix::system::uname();
    let parts = [uname.sysname(), uname.release(), uname.machine()].map(|part| part.to_string_lossy().into_owned());
    parts.join(" ")
}

/// The host's name as a vehicle's name: lower case, and a dash for what may not be in one.
pub fn host_name() -> String {
    let uname = rustix::system::uname();
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c.to_ascii_lowercase() } else { '-' };
    uname.nodename().to_string_lossy().chars().map(plain).take(32).collect()
}

#[cfg(test)]
mod tests {
    use std::str::FromStr;

    use tracing_subscriber::filter::{Directive, LevelFilter};

    use super::*;

    #[test]
    fn zenoh_is_silent_and_the_programs_are_not() {
        let filter = EnvFilter::new(USUAL).to_string();
        assert!(filter.contains("zenoh=off") && filter.contains("info"), "{filter}");
        assert_eq!(EnvFilter::new(USUAL).max_level_hint(), Some(LevelFilter::INFO));
        assert!(Directive::from_str("zenoh=off").is_ok());
    }
}
