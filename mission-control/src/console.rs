//! Progress for whoever waits: a bar on a terminal, a plain line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use common::time::Time;
use indicatif::{ProgressBar, ProgressStyle};

/// Between two plain lines.
const PLAIN_PERIOD: Duration = Duration::from_secs(5);

/// Progress through mission time.
pub struct Progress {
    bar: Option<ProgressBar>,
    end: Time,
    last_line: Instant,
    last_step: String,
}

impl Progress {
    /// Progress towards `end`.
    pub fn new(end: Time) -> Progress {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(end.nanos().max(1) as u64);
            let style = ProgressStyle::with_template("{prefix:>10} [{bar:40}] {percent:>3}% {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar
        });
        Progress { bar, end, last_line: Instant::now(), last_step: String::new() }
    }

    /// Mission time `now` is reached.
    pub fn reached(&mut self, step: &str, now: Time, message: &str) {
        let nanos = now.nanos().clamp(0, self.end.nanos()) as u64;
        match &self.bar {
            Some(bar) => {
                bar.set_prefix(step.to_string());
                bar.set_position(nanos);
                bar.set_message(format!("{:.0} / {:.0} s  {message}", now.secs().max(0.0), self.end.secs()));
            }
            None => {
                if self.last_step != step || self.last_line.elapsed() >= PLAIN_PERIOD {
                    bus::remark!("{step}: {:.0} of {:.0} s  {message}", now.secs().max(0.0), self.end.secs());
                    self.last_line = Instant::now();
                    self.last_step = step.to_string();
                }
            }
        }
    }

    /// `done` of `all` pieces of work are done.
    pub fn counted(&mut self, step: &str, done: usize, all: usize) {
        match &self.bar {
            Some(bar) => {
                bar.set_length(all as u64);
                bar.set_prefix(step.to_string());
                bar.set_position(done as u64);
                bar.set_message(format!("{done} / {all}"));
            }
            None => {
                if self.last_step != step || self.last_line.elapsed() >= PLAIN_PERIOD {
                    bus::remark!("{step}: {done} of {all}");
                    self.last_line = Instant::now();
                    self.last_step = step.to_string();
                }
            }
        }
    }

    /// A line that stays.
    pub fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => bus::remark!("{text}"),
        }
    }

    /// No more progress.
    pub fn done(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Progress through a number of things.
pub struct Count {
    bar: Option<ProgressBar>,
    step: String,
    reached: usize,
    of: usize,
    last_line: Instant,
}

impl Count {
    /// Progress towards `of` things.
    pub fn new(step: &str, of: usize) -> Count {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(of.max(1) as u64);
            let style = ProgressStyle::with_template("{prefix:>10} [{bar:40}] {pos}/{len} {eta} {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar.set_prefix(step.to_string());
            bar
        });
        Count { bar, step: step.to_string(), reached: 0, of, last_line: Instant::now() }
    }

    /// One more is done.
    pub fn one_more(&mut self, message: &str) {
        self.reach(self.reached + 1, message);
    }

    /// So many are done.
    pub fn reach(&mut self, count: usize, message: &str) {
        self.reached = count;
        match &self.bar {
            Some(bar) => {
                bar.set_position(self.reached as u64);
                bar.set_message(message.to_string());
            }
            None if self.last_line.elapsed() >= PLAIN_PERIOD => {
                bus::remark!("{}: {} of {}  {message}", self.step, self.reached, self.of);
                self.last_line = Instant::now();
            }
            None => {}
        }
    }

    /// No more progress.
    pub fn done(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
