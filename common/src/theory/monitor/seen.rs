//! What was seen of a network: its switching signal, and how messages filled it.

use crate::graph::measure::Connectivity;
use crate::time::Span;

/// How messages filled the times in which links were up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exchange {
    /// h: the greatest age of what a vehicle uses of a neighbour, a delay that its law was told not counted.
    pub age: Span,
    /// The shortest time that a link was up; all the time, if none ever went down.
    pub shortest_up: Span,
    /// u: the part of its up time in which a link was up and not heard, for the link that is worst.
    pub unheard: f64,
}

/// What the switching signal amounts to so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// How long was watched.
    pub length: Span,
    /// α: part of the time without connection.
    pub alpha: f64,
    /// T_0 for that α (4.11), erratum 4.21; `None` if the network was never connected.
    pub t_0: Option<Span>,
    /// τ_D: the shortest time between two changes; the whole time before the second.
    pub dwell: Span,
    /// T of Definition 4.4; `None` if the links seen so far do not connect the fleet.
    pub mean: Option<Span>,
    /// How messages filled it; `None` if neighbours are heard all the time, as in the theorems.
    pub exchange: Option<Exchange>,
}

impl Seen {
    /// From a measured signal, with neighbours heard all the time; `None` before any time has passed.
    pub fn of(measured: &Connectivity) -> Option<Seen> {
        let length = measured.length();
        if length <= Span::ZERO {
            return None;
        }
        let alpha = measured.loss_fraction();
        Some(Seen {
            length,
            alpha,
            t_0: (alpha < 1.0).then(|| measured.t_0(alpha)),
            dwell: measured.dwell().unwrap_or(length),
            mean: measured.connected_in_mean(),
            exchange: None,
        })
    }
}
