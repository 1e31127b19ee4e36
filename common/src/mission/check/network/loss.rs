//! Losses of single messages.

use super::super::super::fault::Collector;
use super::super::super::file::LossChoice;
use crate::network::{Loss, SharedFades, TwoStates};
use crate::random::Stream;

/// Longest mean burst or gap, and longest recorded trace \[messages\].
const MOST_MESSAGES: f64 = 1e6;

/// Name of the stream of fades that links share; those of `[[network.also]]` share their own.
pub(super) const FADES: &str = "fades";

/// `fades` names the stream of what links share, should they.
pub(super) fn check(
    faults: &mut Collector<'_>,
    key: &str,
    loss: &LossChoice,
    (seed, fades): (u64, &str),
) -> Option<Loss> {
    let mut probability = |key: &str, value: f64| {
        faults.number(key, value, (0.0..=1.0).contains(&value), "a probability, 0 to 1");
    };
    match loss {
        LossChoice::None => None,
        LossChoice::Bernoulli(b) => {
            probability(&format!("{key}.bernoulli.probability"), b.probability);
            (b.probability > 0.0).then_some(Loss::Bernoulli(b.probability))
        }
        LossChoice::GilbertElliott(g) => {
            let key = format!("{key}.gilbert_elliott");
            probability(&format!("{key}.lost_in_burst"), g.lost_in_burst);
            probability(&format!("{key}.lost_in_gap"), g.lost_in_gap);
            let ok = check_burst(faults, &format!("{key}.mean_burst"), g.mean_burst);
            let least = g.mean_burst / (g.mean_burst - 1.0);
            let gap_ok =
                (1.0..=MOST_MESSAGES).contains(&g.mean_gap) && 1.0 / g.mean_burst + 1.0 / g.mean_gap <= 1.0 + 1e-9;
            let allowed = if least.is_finite() {
                format!("{least} to 1000000 messages: bursts are no shorter than those of independent losses")
            } else {
                "with bursts of one message there is none: use bernoulli".to_string()
            };
            if ok {
                faults.number(&format!("{key}.mean_gap"), g.mean_gap, gap_ok, &allowed);
            }
            let states = TwoStates::new(g.mean_burst, g.mean_gap);
            Some(Loss::Bursts { states, in_burst: g.lost_in_burst, in_gap: g.lost_in_gap })
        }
        LossChoice::SharedFades(f) => {
            let key = format!("{key}.shared_fades");
            probability(&format!("{key}.correlation"), f.correlation);
            let ok = f.probability > 0.0 && f.probability < 1.0;
            faults.number(&format!("{key}.probability"), f.probability, ok, "above 0 and below 1");
            let least = 1.0 / (1.0 - f.probability);
            if ok && check_burst(faults, &format!("{key}.mean_burst"), f.mean_burst) {
                let allowed = format!("{least} messages, as of independent losses, to 1000000");
                let burst_ok = f.mean_burst >= least - 1e-9;
                faults.number(&format!("{key}.mean_burst"), f.mean_burst, burst_ok, &allowed);
            }
            let common = Stream::new(seed, fades);
            Some(Loss::SharedFades(SharedFades::new(f.probability, f.mean_burst, f.correlation, common)))
        }
        LossChoice::Trace(trace) => {
            let key = format!("{key}.trace.runs");
            let total: u64 = trace.runs.iter().map(|run| u64::from(*run)).sum();
            if !(1..=MOST_MESSAGES as u64).contains(&total) {
                faults.fault(&key, format!("{total} messages in all"), "runs of 1 to 1000000 messages in all");
                return None;
            }
            let run = |(i, run): (usize, &u32)| std::iter::repeat_n(i % 2 == 1, *run as usize);
            Some(Loss::Trace(trace.runs.iter().enumerate().flat_map(run).collect()))
        }
    }
}

fn check_burst(faults: &mut Collector<'_>, key: &str, burst: f64) -> bool {
    let ok = (1.0..=MOST_MESSAGES).contains(&burst);
    faults.number(key, burst, ok, "1 to 1000000 messages");
    ok
}
