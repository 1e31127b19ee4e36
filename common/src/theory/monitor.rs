//! The theorem monitor: is this fleet, with the network as it was so far, covered by a theorem, and does it do what that
//! theorem promises?
//!
//! Everything here is a function of what was measured: the switching signal ([`Seen`]), the conditions of a statement
//! ([`Margin`]), its envelope ([`Envelope`]) and the errors over time.

use serde::Serialize;

use super::lemma_4_6::Dynamic;
use super::theorem_4_4::Coordination;
use super::{Gains, theorem_4_5};
use crate::graph::Graph;
use crate::graph::measure::Connectivity;
use crate::time::Span;

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
}

impl Seen {
    /// From a measured signal; `None` before any time has passed.
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
        })
    }
}

/// How far a quantity is from the limit that a statement sets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margin {
    /// The statement.
    pub statement: &'static str,
    /// What is limited.
    pub quantity: &'static str,
    /// Its value.
    pub value: f64,
    /// It must stay below this.
    pub limit: f64,
}

impl Margin {
    /// Limit less value: positive if the condition holds.
    pub fn left(&self) -> f64 {
        self.limit - self.value
    }

    /// Whether the condition holds.
    pub fn holds(&self) -> bool {
        self.value < self.limit
    }
}

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
}

/// Whose errors are watched.
#[derive(Clone, Debug, PartialEq)]
pub enum Watched {
    /// (4.21) with these gains k_i and targets that move as told (type II): Theorems 4.4 and 4.5.
    Agreement(Vec<f64>),
    /// (4.62) with gains a_1, a_2: Lemma 4.7.
    Dynamic(f64, f64),
    /// (4.34) or (4.42): Lemmas 4.4 and 4.5, which promise agreement without a rate.
    Delayed,
}

/// What theory has to say of a network as seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Watch {
    /// The network.
    pub seen: Seen,
    /// Every condition that was looked at.
    pub margins: Vec<Margin>,
    /// The statement that covers the fleet, the one that promises most first.
    pub covered_by: Option<&'static str>,
    /// The best envelope among those promised.
    pub envelope: Option<Envelope>,
}

/// What theory says of a fleet on a network as seen, with the graphs that occurred.
pub fn watch(watched: &Watched, graphs: &[Graph], seen: Seen) -> Watch {
    let mut watch = Watch { seen, margins: Vec::new(), covered_by: None, envelope: None };
    match watched {
        Watched::Agreement(gains) => {
            watch.theorem_4_4(gains, graphs);
            watch.theorem_4_5(gains, graphs);
        }
        Watched::Dynamic(a_1, a_2) => watch.lemma_4_7(*a_1, *a_2, graphs),
        Watched::Delayed => watch.connected_in_mean("Lemmas 4.4 and 4.5"),
    }
    watch
}

impl Watch {
    fn asks(&mut self, statement: &'static str, quantity: &'static str, value: f64, limit: f64) -> bool {
        let margin = Margin { statement, quantity, value, limit };
        let holds = margin.holds();
        self.margins.push(margin);
        holds
    }

    fn promises(&mut self, statement: &'static str, envelope: Option<(f64, f64)>) {
        self.covered_by.get_or_insert(statement);
        let better = |known: &Envelope, rate: f64| known.rate < rate;
        if let Some((rate, factor)) = envelope
            && self.envelope.as_ref().is_none_or(|known| better(known, rate))
        {
            self.envelope = Some(Envelope { statement, factor, rate });
        }
    }

    fn theorem_4_4(&mut self, gains: &[f64], graphs: &[Graph]) {
        const NAME: &str = "Theorem 4.4";
        let Seen { alpha, t_0, .. } = self.seen;
        let coordination = Coordination::new(graphs, gains, alpha);
        if self.asks(NAME, "α", alpha, 1.0)
            && let (Some(coordination), Some(t_0)) = (coordination, t_0)
        {
            self.promises(NAME, Some((coordination.rate_of_agreement(), coordination.overshoot(t_0))));
        }
    }

    fn theorem_4_5(&mut self, gains: &[f64], graphs: &[Graph]) {
        const NAME: &str = "Theorem 4.5";
        self.connected_in_mean(NAME);
        let two_way = graphs.iter().all(Graph::is_undirected);
        let Some((gains, mean)) = Gains::new(gains).zip(self.seen.mean).filter(|_| two_way) else { return };
        if let Some(proven) = theorem_4_5::agreement(gains, mean, self.seen.dwell) {
            self.promises(NAME, Some((proven.rate, proven.overshoot)));
        }
    }

    fn lemma_4_7(&mut self, a_1: f64, a_2: f64, graphs: &[Graph]) {
        const NAME: &str = "Lemma 4.7";
        let Seen { alpha, t_0, .. } = self.seen;
        let best = Dynamic::new(a_1, a_2, graphs).and_then(|fleet| fleet.best(alpha));
        let limit = best.map_or(0.0, |best| best.alpha_limit());
        if self.asks(NAME, "α", alpha, limit)
            && let (Some(best), Some(t_0)) = (best, t_0)
        {
            self.promises(NAME, Some((0.5 * best.rate_of_v(alpha), best.overshoot(alpha, t_0))));
        }
    }

    /// Definition 4.4 within what was seen: T must fit into it.
    fn connected_in_mean(&mut self, statement: &'static str) {
        let waited = self.seen.mean.map_or(f64::INFINITY, Span::secs);
        if self.asks(statement, "T [s]", waited, self.seen.length.secs()) {
            self.promises(statement, None);
        }
    }

    /// The condition that fails by most, if no statement covers the fleet.
    pub fn failing(&self) -> Option<&Margin> {
        let failing = self.margins.iter().filter(|margin| !margin.holds());
        failing.min_by(|a, b| a.left().total_cmp(&b.left())).filter(|_| self.covered_by.is_none())
    }

    /// Judges the errors measured over time, as (t \[s\], ‖e‖), the first one the error at the start. `tolerance` is what
    /// sampling may add to an error.
    pub fn judge(&self, errors: &[(f64, f64)], tolerance: f64) -> Judgement {
        let Some(statement) = self.covered_by else {
            return Judgement::NotCovered { failing: self.failing().cloned() };
        };
        let Some(envelope) = self.envelope else { return Judgement::Covered { statement, closest: None } };
        let Some(&(start, initial)) = errors.first() else { return Judgement::Covered { statement, closest: None } };
        let mut closest = 0.0f64;
        for &(t, error) in errors {
            let allowed = envelope.at(t - start) * initial + tolerance;
            if error > allowed || error.is_nan() {
                return Judgement::Defect { envelope, at: t, found: error, allowed };
            }
            closest = closest.max(if allowed > 0.0 { error / allowed } else { 0.0 });
        }
        Judgement::Covered { statement: envelope.statement, closest: Some(closest) }
    }
}

/// What came of watching a fleet.
#[derive(Clone, Debug, PartialEq)]
pub enum Judgement {
    /// A statement covers the fleet, which does what it promises.
    Covered {
        /// The statement.
        statement: &'static str,
        /// The largest part of the envelope that the errors reached, where there is an envelope.
        closest: Option<f64>,
    },
    /// No statement covers the fleet: nothing is promised, whatever it does.
    NotCovered {
        /// The condition that fails by most.
        failing: Option<Margin>,
    },
    /// Covered, and yet outside the envelope: then a premise is not as assumed, or there is a mistake in the code or the
    /// proof.
    Defect {
        /// What was promised.
        envelope: Envelope,
        /// When it was first broken \[s\].
        at: f64,
        /// The error then.
        found: f64,
        /// What was allowed.
        allowed: f64,
    },
}

impl std::fmt::Display for Judgement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Judgement::Covered { statement, closest: Some(part) } => {
                write!(f, "covered by {statement}; the error reached at most {:.0} % of its envelope", 100.0 * part)
            }
            Judgement::Covered { statement, closest: None } => {
                write!(f, "covered by {statement}, which promises agreement without an envelope")
            }
            Judgement::NotCovered { failing: Some(margin) } => {
                let Margin { statement, quantity, value, limit } = margin;
                match value.is_finite() {
                    true => {
                        write!(f, "not covered: {statement} asks for {quantity} < {limit:.4}, and it is {value:.4}")
                    }
                    false => {
                        write!(f, "not covered: {statement} asks for {quantity} < {limit:.4}, and it is unbounded")
                    }
                }
            }
            Judgement::NotCovered { failing: None } => f.write_str("not covered by any statement about this law"),
            Judgement::Defect { envelope, at, found, allowed } => write!(
                f,
                "a defect: covered by {}, and yet the error at {at:.2} s is {found:.3e}, and {allowed:.3e} is the most",
                envelope.statement
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::switching::Switching;
    use crate::time::Time;

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }

    /// The row of three of section 4.6, up for `up` of every 10 s.
    fn row_of_three(up: f64, end: f64) -> (Vec<Graph>, Seen) {
        let arcs = [(0, 1), (1, 0), (1, 2), (2, 1)];
        let signal = Switching::periodic(4, s(10.0), s(10.0 - up), s(up));
        let measured = Connectivity::planned(signal, 3, &arcs, Time::from_secs(end));
        (vec![Graph::empty(3), Graph::from_arcs(3, &arcs)], Seen::of(&measured).expect("time has passed"))
    }

    #[test]
    fn section_4_6_without_delay_is_covered() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        assert!((seen.alpha - 0.75).abs() < 1e-12 && seen.t_0 == Some(s(7.5)) && seen.dwell == s(2.5));
        let watch = watch(&Watched::Agreement(vec![0.1; 3]), &graphs, seen);
        assert_eq!(watch.covered_by, Some("Theorem 4.4"));
        let envelope = watch.envelope.expect("a rate");
        assert!((envelope.rate - 0.025).abs() < 1e-12 && envelope.factor > 1.0);
        // What the law does: the slowest mode decays at k λ_2 = 0.1 while the links are up.
        let errors: Vec<(f64, f64)> = (0..=1000)
            .map(|i| f64::from(i) * 0.1)
            .map(|t| (t, (-0.1 * ((t / 10.0).floor() * 2.5 + (t % 10.0 - 7.5).max(0.0))).exp()))
            .collect();
        let judged = watch.judge(&errors, 1e-9);
        assert!(matches!(judged, Judgement::Covered { statement: "Theorem 4.4", closest: Some(part) } if part > 0.9));
        // A fleet that does not decay is a defect, and so is one that is not a number.
        let idle: Vec<(f64, f64)> = errors.iter().map(|&(t, _)| (t, 1.0)).collect();
        assert!(matches!(watch.judge(&idle, 1e-9), Judgement::Defect { at, .. } if at > 7.0 && at < 9.0));
        assert!(matches!(watch.judge(&[(0.0, 1.0), (1.0, f64::NAN)], 1.0), Judgement::Defect { .. }));
        assert!(watch.judge(&idle, 1e-9).to_string().starts_with("a defect: covered by Theorem 4.4"));
    }

    #[test]
    fn a_fleet_that_is_never_connected_is_not_covered() {
        let (graphs, seen) = row_of_three(0.0, 100.0);
        assert_eq!((seen.alpha, seen.t_0, seen.mean), (1.0, None, None));
        for watched in [Watched::Agreement(vec![0.1; 3]), Watched::Dynamic(1.0, 1.6), Watched::Delayed] {
            let watch = watch(&watched, &graphs[..1], seen);
            assert_eq!((watch.covered_by, watch.envelope), (None, None));
            let judged = watch.judge(&[(0.0, 1.0)], 0.0);
            assert!(matches!(judged, Judgement::NotCovered { failing: Some(_) }), "{judged}");
            assert!(judged.to_string().starts_with("not covered: "));
        }
    }

    #[test]
    fn links_by_turns_are_covered_by_theorem_4_5_alone() {
        let arcs = [(0, 1), (1, 0), (1, 2), (2, 1)];
        let signal = Switching::one_at_a_time(4, vec![vec![0, 1], vec![2, 3]], s(5.0));
        let measured = Connectivity::planned(signal, 3, &arcs, Time::from_secs(100.0));
        let graphs = [Graph::from_edges(3, &[(0, 1)]), Graph::from_edges(3, &[(1, 2)])];
        let watch = watch(&Watched::Agreement(vec![0.5; 3]), &graphs, Seen::of(&measured).expect("time has passed"));
        assert_eq!(watch.covered_by, Some("Theorem 4.5"));
        assert!(watch.envelope.is_some_and(|envelope| envelope.rate > 0.0 && envelope.statement == "Theorem 4.5"));
        let failing: Vec<_> = watch.margins.iter().filter(|margin| !margin.holds()).collect();
        assert!(failing.len() == 1 && failing[0].statement == "Theorem 4.4" && failing[0].left() == 0.0);
    }

    #[test]
    fn lemma_4_7_has_a_margin_in_alpha() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let covered = watch(&Watched::Dynamic(1.0, 1.6), &graphs, seen);
        assert_eq!(covered.covered_by, Some("Lemma 4.7"));
        assert!(covered.margins[0].left() > 0.0 && covered.envelope.is_some());
        // With the X that is found it bears this loss rate too, where that of (4.66) does not.
        let (graphs, rarely) = row_of_three(0.02, 1000.0);
        let watch = watch(&Watched::Dynamic(1.0, 0.05), &graphs, rarely);
        assert!(watch.margins[0].holds() && watch.margins[0].limit <= 1.0, "{watch:?}");
        assert!(Dynamic::new(1.0, 0.05, &graphs).is_some_and(|fleet| !fleet.printed_holds()));
    }

    #[test]
    fn before_anything_was_seen_nothing_is_said() {
        assert_eq!(Seen::of(&Connectivity::new()), None);
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let delayed = watch(&Watched::Delayed, &graphs, seen);
        let judged = delayed.judge(&[(0.0, 1.0), (9.0, 5.0)], 0.0);
        assert!(judged.to_string().contains("without an envelope"), "{judged}");
        assert!(matches!(
            watch(&Watched::Agreement(vec![0.1; 3]), &graphs, seen).judge(&[], 0.0),
            Judgement::Covered { closest: None, .. }
        ));
    }
}
