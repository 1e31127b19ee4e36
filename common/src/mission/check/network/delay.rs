//! Delays.

use super::super::super::fault::Collector;
use super::super::super::file::{DelayChoice, RandomDelay};
use crate::network::Delay;
use crate::network::delay::LONGEST_DELAY;
use crate::time::Span;

/// So many deviations above the mean a random delay must stay within the longest delay: beyond are 3 · 10⁻⁷ of a normal
/// variable, and less than 1 % of any gamma variable.
const TAIL: f64 = 5.0;

pub(super) fn check(faults: &mut Collector<'_>, key: &str, delay: &DelayChoice) -> Delay {
    let within = |value: f64| (0.0..=3600.0).contains(&value);
    match delay {
        DelayChoice::None => Delay::default(),
        DelayChoice::Constant(c) => {
            faults.number(&format!("{key}.constant.delay_s"), c.delay_s, within(c.delay_s), "0 to 3600 s");
            Delay::Constant(Span::from_secs(c.delay_s))
        }
        DelayChoice::Jittered(j) => {
            faults.number(&format!("{key}.jittered.min_s"), j.min_s, within(j.min_s), "0 to 3600 s");
            let ok = within(j.max_s) && j.max_s >= j.min_s;
            faults.number(&format!("{key}.jittered.max_s"), j.max_s, ok, "min_s to 3600 s");
            Delay::Uniform(Span::from_secs(j.min_s), Span::from_secs(j.max_s))
        }
        DelayChoice::Normal(d) => {
            let key = format!("{key}.normal");
            // What is left of it above its mean would have another mean than the mission says.
            let beyond = within(d.mean_s) && d.mean_s >= d.min_s;
            let ok = check_random(faults, &key, d, beyond, "min_s to 3600 s") && check_tail(faults, &key, d);
            if ok { Delay::normal(d.mean_s, d.deviation_s, d.min_s) } else { Delay::default() }
        }
        DelayChoice::Gamma(d) => {
            let beyond = within(d.mean_s) && d.mean_s > d.min_s;
            let key = format!("{key}.gamma");
            let ok = check_random(faults, &key, d, beyond, "above min_s and at most 3600 s");
            // A shape of 10⁻² has nearly all delays at the least; one of 10⁶ is as good as constant.
            let shape = ((d.mean_s - d.min_s) / d.deviation_s).powi(2);
            let fits = (1e-2..=1e6).contains(&shape);
            if ok && !fits {
                let allowed = "between 1/1000 and 10 times mean_s - min_s";
                faults.fault(&format!("{key}.deviation_s"), d.deviation_s, allowed);
            }
            if ok && fits && check_tail(faults, &key, d) {
                Delay::gamma(d.mean_s, d.deviation_s, d.min_s)
            } else {
                Delay::default()
            }
        }
        DelayChoice::Distance(d) => {
            let key = format!("{key}.distance");
            let ok = (1.0..=3e8).contains(&d.speed_mps);
            faults.number(&format!("{key}.speed_mps"), d.speed_mps, ok, "1 to 3e8 m/s");
            faults.number(&format!("{key}.extra_s"), d.extra_s, within(d.extra_s), "0 to 3600 s");
            Delay::Distance { speed: d.speed_mps, extra: Span::from_secs(d.extra_s) }
        }
    }
}

fn check_random(faults: &mut Collector<'_>, key: &str, delay: &RandomDelay, mean_ok: bool, allowed: &str) -> bool {
    let deviation_ok = delay.deviation_s > 0.0 && delay.deviation_s <= 3600.0;
    let min_ok = (0.0..=3600.0).contains(&delay.min_s);
    faults.number(&format!("{key}.mean_s"), delay.mean_s, mean_ok, allowed);
    faults.number(&format!("{key}.deviation_s"), delay.deviation_s, deviation_ok, "above 0 and at most 3600 s");
    faults.number(&format!("{key}.min_s"), delay.min_s, min_ok, "0 to 3600 s");
    mean_ok && deviation_ok && min_ok
}

/// No message is under way for longer than an hour. A distribution with more beyond it than its farthest tail would put that
/// all on the hour, and have neither the mean nor the deviation that it was given.
fn check_tail(faults: &mut Collector<'_>, key: &str, delay: &RandomDelay) -> bool {
    let most = (LONGEST_DELAY.secs() - delay.mean_s) / TAIL;
    let ok = delay.deviation_s <= most;
    let allowed =
        format!("at most {most}: mean_s + {TAIL} deviation_s are within the hour that no message exceeds (3600 s)");
    faults.number(&format!("{key}.deviation_s"), delay.deviation_s, ok, &allowed);
    ok
}
