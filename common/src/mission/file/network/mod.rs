//! The section `[network]`: links, and how badly messages travel on them.

mod delay;
mod loss;
mod medium;
mod range;
mod switching;

pub use delay::*;
pub use loss::*;
pub use medium::*;
pub use range::*;
pub use switching::*;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How badly messages travel.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct NetworkSection {
    /// A known kind of network, for everything that is not said here.
    pub preset: Option<Preset>,
    /// Links in both directions: pairs of vehicle ids.
    #[serde(default)]
    pub links: Vec<[String; 2]>,
    /// Links in one direction: from and to.
    #[serde(default)]
    pub one_way: Vec<[String; 2]>,
    /// Delay of every message; none if absent.
    pub delay: Option<DelayChoice>,
    /// Whether messages may overtake one another on a link; they may if absent.
    pub order: Option<OrderChoice>,
    /// Loss of single messages; none if absent.
    pub loss: Option<LossChoice>,
    /// Over which distance messages are heard; over any if absent.
    pub range: Option<RangeChoice>,
    /// Probability that a message arrives twice, 0 to 1; 0 if absent.
    pub duplicate_probability: Option<f64>,
    /// Probability that a message arrives with a flipped bit, 0 to 1; 0 if absent.
    pub corrupt_probability: Option<f64>,
    /// The medium that all vehicles share; without it messages take no time to send and do not disturb one another.
    pub medium: Option<MediumSection>,
    /// Links that come and go. A message is received if its link is up when it arrives.
    #[serde(default)]
    pub switching: SwitchingChoice,
    /// Most messages under way on one directed link; beyond it new ones are dropped.
    #[serde(default = "default_queue")]
    pub queue: u32,
    /// Exceptions for single directed links, instead of what holds for the others.
    #[serde(default)]
    pub exceptions: Vec<LinkException>,
    /// Further models on top of what holds already, on some links or on all.
    #[serde(default)]
    pub also: Vec<FurtherModels>,
}

/// A known kind of network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Everything arrives at once.
    Perfect,
    /// An acoustic modem over kilometres: 80 bit/s, packets of 17 bytes, slots of 15 s.
    AcousticLongRange,
    /// A small acoustic modem over hundreds of metres: 640 bit/s, no slots.
    AcousticShortRange,
    /// Short messages over a satellite: 5 to 20 s late, in order, 1 % lost.
    RadioOverTheHorizon,
    /// WiFi between hulls in a harbour: milliseconds, 1.4 % lost.
    WifiHarbour,
}

/// Whether messages may overtake one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrderChoice {
    /// Each message takes its own delay.
    Free,
    /// A message that would overtake an earlier one of its link arrives with it.
    InOrder,
}

/// An exception for one directed link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LinkException {
    /// Sender.
    pub from: String,
    /// Receiver.
    pub to: String,
    /// Its delay, if other than the network's.
    pub delay: Option<DelayChoice>,
    /// Its loss, if other than the network's.
    pub loss: Option<LossChoice>,
    /// Its range, if other than the network's.
    pub range: Option<RangeChoice>,
    /// Its probability of arriving twice, if other than the network's.
    pub duplicate_probability: Option<f64>,
    /// Its probability of a flipped bit, if other than the network's.
    pub corrupt_probability: Option<f64>,
    /// Whether messages may overtake one another on it, if other than the network's.
    pub order: Option<OrderChoice>,
    /// Most messages under way on it, 1 to 1000000, if other than the network's.
    pub queue: Option<u32>,
}

impl LinkException {
    /// Whether it makes no exception.
    pub fn says_nothing(&self) -> bool {
        let LinkException {
            from: _,
            to: _,
            delay,
            loss,
            range,
            duplicate_probability,
            corrupt_probability,
            order,
            queue,
        } = self;
        let models = delay.is_none() && loss.is_none() && range.is_none() && order.is_none() && queue.is_none();
        models && duplicate_probability.is_none() && corrupt_probability.is_none()
    }
}

/// Further models: delays add up, a message is lost if any model loses it, a link is up while all signals have it up.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct FurtherModels {
    /// Directed links from and to; all of them if absent.
    pub links: Option<Vec<[String; 2]>>,
    /// A further delay.
    pub delay: Option<DelayChoice>,
    /// A further cause of loss.
    pub loss: Option<LossChoice>,
    /// A further switching signal.
    pub switching: Option<SwitchingChoice>,
}

fn default_queue() -> u32 {
    10_000
}
