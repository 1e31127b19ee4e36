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
    begun: Instant,
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
        Progress { bar, end, begun: Instant::now(), last_line: Instant::now(), last_step: String::new() }
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
                    let line = format!("{step}: {:.0} of {:.0} s  {message}", now.secs().max(0.0), self.end.secs());
                    bus::remark!("{}", line.trim_end());
                    self.last_line = Instant::now();
                    self.last_step = step.to_string();
                }
            }
        }
    }

    /// `done` of `all` pieces of work are done.
    pub fn counted(&mut self, step: &str, done: usize, all: usize) {
        let left = left(self.begun.elapsed(), done, all.saturating_sub(done));
        match &self.bar {
            Some(bar) => {
                bar.set_length(all as u64);
                bar.set_prefix(step.to_string());
                bar.set_position(done as u64);
                bar.set_message(format!("{done} / {all}{left}"));
            }
            None => {
                if self.last_step != step || self.last_line.elapsed() >= PLAIN_PERIOD {
                    bus::remark!("{step}: {done} of {all}{left}");
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

/// A number as a person at a terminal reads it: four digits, and a power of ten only where it is short for many zeros.
pub fn short(value: f64) -> String {
    let magnitude = value.abs();
    if !value.is_finite() {
        return "–".to_string();
    }
    if magnitude != 0.0 && !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let digits = if magnitude == 0.0 { 0.0 } else { (3.0 - magnitude.log10().floor()).clamp(0.0, 6.0) } as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

/// The error of a fleet in its two norms, which are not the same number: ‖e‖ = ‖(I − 11ᵀ/n)x‖ is what theorems bound, the largest
/// difference what one sees.
pub fn error_in_words(norm: f64, largest: f64) -> String {
    format!("‖e‖ = {}, max |x_i − x_j| = {}", short(norm), short(largest))
}

/// How long the rest will take if it goes on as it went; empty as long as nothing is known.
fn left(elapsed: Duration, done: usize, rest: usize) -> String {
    if done == 0 || rest == 0 {
        return String::new();
    }
    let seconds = (elapsed.as_secs_f64() * rest as f64 / done as f64).ceil();
    let (hours, minutes) = ((seconds / 3600.0).floor(), (seconds / 60.0).ceil());
    match seconds {
        ..120.0 => format!(", about {seconds} s left"),
        ..7200.0 => format!(", about {minutes} min left"),
        _ => format!(", about {hours} h {} min left", ((seconds - 3600.0 * hours) / 60.0).floor()),
    }
}

/// Progress through a number of things.
pub struct Count {
    bar: Option<ProgressBar>,
    step: String,
    begun: Instant,
    /// How many were done at first: these took no time.
    found: Option<usize>,
    reached: usize,
    of: usize,
    last_line: Instant,
}

impl Count {
    /// Progress towards `of` things.
    pub fn new(step: &str, of: usize) -> Count {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(of.max(1) as u64);
            let style = ProgressStyle::with_template("{prefix:>10} [{bar:40}] {percent:>3}% {pos}/{len}{msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar.set_prefix(step.to_string());
            bar
        });
        let now = Instant::now();
        Count { bar, step: step.to_string(), begun: now, found: None, reached: 0, of, last_line: now }
    }

    /// One more is done.
    pub fn one_more(&mut self, message: &str) {
        self.found.get_or_insert(0);
        self.reach(self.reached + 1, message);
    }

    /// So many are done; the first time, so many were done before.
    pub fn reach(&mut self, count: usize, message: &str) {
        self.reached = count;
        let done = count - (*self.found.get_or_insert(count)).min(count);
        let left = left(self.begun.elapsed(), done, self.of.saturating_sub(count));
        match &self.bar {
            Some(bar) => {
                bar.set_position(self.reached as u64);
                bar.set_message(format!("{left} {message}"));
            }
            None if self.last_line.elapsed() >= PLAIN_PERIOD => {
                let line = format!("{}: {} of {}{left} {message}", self.step, self.reached, self.of);
                bus::remark!("{}", line.trim_end());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_takes_as_long_as_what_is_done() {
        let after = |seconds: u64, done: usize, rest: usize| left(Duration::from_secs(seconds), done, rest);
        assert_eq!(after(10, 100, 500), ", about 50 s left");
        assert_eq!(after(60, 10, 55), ", about 6 min left");
        assert_eq!(after(600, 1, 13), ", about 2 h 10 min left");
        assert_eq!((after(5, 0, 10), after(5, 10, 0)), (String::new(), String::new()));
    }

    #[test]
    fn numbers_at_a_terminal_are_short() {
        let written = [0.0, 2.1666, -13.9, 123_456.7, 0.0123, 5.04e-9, 2e7, f64::NAN].map(short);
        assert_eq!(written, ["0", "2.167", "-13.9", "123457", "0.0123", "5.04e-9", "2.00e7", "–"]);
        assert_eq!(error_in_words(1.5366, 2.1666), "‖e‖ = 1.537, max |x_i − x_j| = 2.167");
    }

    #[test]
    fn what_was_there_before_took_no_time() {
        let mut count = Count::new("sweeping", 600);
        count.reach(500, "");
        count.reach(520, "");
        assert_eq!((count.found, count.reached), (Some(500), 520));
    }
}
