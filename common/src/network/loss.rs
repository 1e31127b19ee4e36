//! Which messages are lost on the way.

use std::sync::Arc;

use super::{SharedFades, TwoStates};
use crate::random::{LANES, Stream};

/// Lane of the numbers of a message that decides a plain loss.
const LOSS: usize = 0;

/// A model of losses on one link, or on all of them together.
#[derive(Clone, Debug)]
pub enum Loss {
    /// Each message with the same probability, independently.
    Bernoulli(f64),
    /// In bursts (Gilbert 1960), with a probability in a burst and one in a gap (Elliott 1963).
    Bursts {
        /// When bursts come and go.
        states: TwoStates,
        /// Probability that a message in a burst is lost.
        in_burst: f64,
        /// Probability that a message in a gap is lost.
        in_gap: f64,
    },
    /// Fades that links share.
    SharedFades(SharedFades),
    /// As recorded: message m is lost if `lost[m mod length]`.
    Trace(Arc<[bool]>),
}

impl Loss {
    /// Whether message `number` is lost; `drawn` are its own numbers of `stream`.
    pub fn loses(&mut self, stream: &mut Stream, number: u64, drawn: &[f64; LANES]) -> bool {
        match self {
            Loss::Bernoulli(probability) => drawn[LOSS] < *probability,
            Loss::Bursts { states, in_burst, in_gap } => {
                let probability = if states.in_burst(stream, number, drawn) { *in_burst } else { *in_gap };
                drawn[LOSS] < probability
            }
            Loss::SharedFades(fades) => fades.in_fade(stream, number, drawn),
            Loss::Trace(lost) => !lost.is_empty() && lost[(number % lost.len() as u64) as usize],
        }
    }

    /// The long-run share of messages that is lost.
    pub fn mean(&self) -> f64 {
        match self {
            Loss::Bernoulli(probability) => *probability,
            Loss::Bursts { states, in_burst, in_gap } => states.share() * in_burst + (1.0 - states.share()) * in_gap,
            Loss::SharedFades(fades) => fades.share(),
            Loss::Trace(lost) => lost.iter().filter(|lost| **lost).count() as f64 / lost.len().max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(loss: &Loss, name: &str, n: u64) -> Vec<f64> {
        let (mut loss, mut stream) = (loss.clone(), Stream::new(9, name));
        (0..n)
            .map(|number| {
                let drawn = stream.units_at(number);
                f64::from(u8::from(loss.loses(&mut stream, number, &drawn)))
            })
            .collect()
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn each_model_loses_its_share() {
        let n = 100_000;
        for (loss, share, burst) in [
            (Loss::Bernoulli(0.3), 0.3, 1.0 / 0.7),
            (Loss::Bursts { states: TwoStates::new(5.0, 15.0), in_burst: 0.8, in_gap: 0.1 }, 0.275, 5.0),
            (Loss::SharedFades(SharedFades::new(0.2, 6.0, 0.5, Stream::new(9, "fades"))), 0.2, 6.0),
            (Loss::Trace([true, false, false, false].into()), 0.25, 1.0),
        ] {
            assert!((loss.mean() - share).abs() < 1e-9, "{loss:?}");
            // Bursts make n messages worth about n/(2 burst) independent ones.
            let bound = 5.0 * (share * (1.0 - share) * 2.0 * burst / n as f64).sqrt();
            let found = mean(&lost(&loss, "a", n));
            assert!((found - share).abs() < bound, "{found} for {share} ± {bound}");
        }
    }

    #[test]
    fn a_trace_repeats() {
        let loss = Loss::Trace([false, true, true].into());
        assert_eq!(lost(&loss, "a", 7), [0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
        assert_eq!(lost(&Loss::Trace([].into()), "a", 3), [0.0; 3]);
    }
}
