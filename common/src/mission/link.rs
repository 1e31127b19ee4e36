//! A directed link: what happens to the messages on it.

use crate::network::{Delay, Loss, Range};
use crate::time::{Span, Time};

/// One directed link.
#[derive(Clone, Debug)]
pub struct Link {
    /// Index of the sender.
    pub from: usize,
    /// Index of the receiver.
    pub to: usize,
    /// Its delay and its losses, and further ones on top: delays add up, any loss loses. Never empty.
    pub layers: Vec<Layer>,
    /// Over which distance messages are heard.
    pub range: Range,
    /// Probability that a message arrives twice.
    pub duplicate: f64,
    /// Probability that a message arrives with a flipped bit.
    pub corrupt: f64,
    /// Whether a message that would overtake an earlier one arrives with it.
    pub in_order: bool,
    /// Most messages under way.
    pub queue: usize,
}

/// A delay and a loss with a stream of random numbers of their own.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Name of the stream.
    pub stream: String,
    /// The delay.
    pub delay: Delay,
    /// The loss, if any.
    pub loss: Option<Loss>,
}

impl Link {
    /// No message arrives earlier.
    pub fn least_delay(&self) -> Span {
        self.layers.iter().fold(Span::ZERO, |sum, layer| sum + layer.delay.least())
    }

    /// The delay that every message has, if they all have the same.
    pub fn fixed_delay(&self) -> Option<Span> {
        self.layers.iter().try_fold(Span::ZERO, |sum, layer| Some(sum + layer.delay.fixed()?))
    }

    /// No message arrives later, and none is held back for longer by one before it: that came no later itself.
    pub fn greatest_delay(&self) -> Span {
        self.layers.iter().fold(Span::ZERO, |sum, layer| sum + layer.delay.greatest())
    }

    /// The most places that messages take at once, if one is said every `pause` up to `end`: of those before a message, what is due at
    /// the very instant at which it is sent still has its place.
    pub fn most_under_way(&self, pause: Span, end: Time) -> i64 {
        self.greatest_delay().min(end - Time::ZERO).nanos() / pause.nanos().max(1) + 1
    }

    /// Whether messages can be lost although the link is up and has places for all.
    pub fn loses(&self) -> bool {
        self.corrupt > 0.0
            || self.range.is_limited()
            || self.layers.iter().any(|layer| layer.loss.as_ref().is_some_and(|loss| loss.mean() > 0.0))
    }

    /// Whether anything depends on where the vehicles are.
    pub fn needs_distance(&self) -> bool {
        self.range.is_limited() || self.layers.iter().any(|layer| layer.delay.needs_distance())
    }
}
