//! What a statement promises of an error over time, and what may be added to it.

use serde::Serialize;

/// ‖e(t)‖ ≤ factor · e^{−rate t} ‖e(0)‖.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Envelope {
    /// The statement that promises it.
    pub statement: &'static str,
    /// By how much the error may exceed its decay.
    pub factor: f64,
    /// Rate of the norm \[1/s\].
    pub rate: f64,
}

impl Envelope {
    /// What may be left of an error of one after this time \[s\].
    pub fn at(&self, t: f64) -> f64 {
        self.factor * (-self.rate * t).exp()
    }

    /// The mean of that over so much time \[s\].
    pub fn mean(&self, length: f64) -> f64 {
        match self.rate > 0.0 {
            true => self.factor * -(-self.rate * length).exp_m1() / (self.rate * length),
            false => self.factor,
        }
    }
}

/// What messages in periods may cost, see [`monitor`](super).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tolerance {
    /// How much later the decay may begin \[s\].
    pub late: f64,
    /// The part by which a rate may be smaller, in \[0, 1).
    pub slower: f64,
    /// What may be added to an error.
    pub added: f64,
}

/// What rounding may add to an error, as a part of it.
const ROUNDING: f64 = 1e-9;

impl Tolerance {
    /// What is tolerated but for what may be added: an envelope that from `late` on is what the first is `late` earlier, decaying
    /// more slowly; before, it is larger.
    pub fn of_decay(&self, envelope: &Envelope) -> Envelope {
        let rate = envelope.rate * (1.0 - self.slower);
        Envelope { rate, factor: envelope.factor * (rate * self.late).exp(), ..*envelope }
    }

    /// The most that an error may be at `t` seconds after it was `initial`.
    pub fn allowed(&self, envelope: &Envelope, initial: f64, t: f64) -> f64 {
        self.of_decay(envelope).at(t.max(self.late)) * initial * (1.0 + ROUNDING) + self.added
    }
}
