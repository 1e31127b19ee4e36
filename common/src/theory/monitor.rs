//! The theorem monitor: is this fleet, with the network as it was so far, covered by a theorem, and does it do what that
//! theorem promises?
//!
//! Everything here is a function of what was measured: the switching signal and how messages filled it ([`Seen`]), the
//! conditions of a statement ([`Margin`], [`Premise`]), its envelope ([`Envelope`]) and the errors over time.
//!
//! # What messages in periods may cost
//!
//! The theorems speak of γ_j(t) that is there all the time while a link is up. A fleet has messages: what a vehicle knows of
//! a neighbour is up to some age h old, control period included. Two conditions keep that small ([`Exchange`]): h is at most a
//! quarter of the shortest time that a link is up, and σh < 1, where σ bounds the eigenvalues of KL_p. Then KL_p γ~ as
//! the vehicles compute it differs from the present one by what it changes within h: to first order by the part σh of itself.
//! The fleet acts as one whose gains are smaller by up to that part, and by the part of the up times in which nothing was
//! heard. That is an estimate and no proof, made so that nothing is called a defect for want of messages. So a promised rate r is held against the errors as (1 − σh)(1 − u)r ([`Tolerance::slower`]), from h
//! after the start on, before which nobody need have heard anything ([`Tolerance::late`]). Where old states are not advanced, neighbours seem to be behind by v_L h each; the part of that which differs between vehicles
//! leaves an error of up to v_L h √n D/λ, with D the most neighbours of anybody and λ the connectivity
//! ([`Tolerance::added`]).

use serde::Serialize;

use super::lemma_4_6::Dynamic;
use super::theorem_4_4::Coordination;
use super::{Gains, PathFollowing, theorem_4_5};
use crate::graph::Graph;
use crate::graph::measure::Connectivity;
use crate::graph::spectrum::lambda_2;
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

/// What conditions on messages in periods are filed under.
const IN_PERIODS: &str = "messages in periods";

/// The most that age over shortest up time, and the unheard part, may be.
const SMALL: f64 = 0.25;

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

impl std::fmt::Display for Margin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Margin { statement, quantity, value, limit } = self;
        match value.is_finite() {
            true => write!(f, "{statement}: {quantity} must be below {limit:.4}, and it is {value:.4}")?,
            false => write!(f, "{statement}: {quantity} must be below {limit:.4}, and it is unbounded")?,
        }
        if !self.holds() && value.is_finite() && *value > *limit {
            write!(f, " ({:.4} too much)", -self.left())?;
        }
        Ok(())
    }
}

/// A premise that is not about numbers, and that is not so.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Premise {
    /// What is asked for.
    pub asks: &'static str,
    /// What is the case.
    pub found: String,
}

impl std::fmt::Display for Premise {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "it takes {}, and {}", self.asks, self.found)
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

    /// The mean of that over so much time \[s\].
    pub fn mean(&self, length: f64) -> f64 {
        match self.rate > 0.0 {
            true => self.factor * -(-self.rate * length).exp_m1() / (self.rate * length),
            false => self.factor,
        }
    }
}

/// What messages in periods may cost, see the head of this file.
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
    /// The most that an error may be at `t` seconds after it was `initial`.
    pub fn allowed(&self, envelope: &Envelope, initial: f64, t: f64) -> f64 {
        let decayed = (-envelope.rate * (1.0 - self.slower) * (t - self.late).max(0.0)).exp();
        envelope.factor * decayed * initial * (1.0 + ROUNDING) + self.added
    }
}

/// Whose errors are watched.
#[derive(Clone, Debug, PartialEq)]
pub enum Watched {
    /// (4.21) with these gains k_i and this path following: Theorems 4.4 and 4.5.
    Agreement(Vec<f64>, PathFollowing),
    /// (4.62) with gains a_1, a_2: Lemma 4.7.
    Dynamic(f64, f64),
    /// (4.34) or (4.42): Lemmas 4.4 and 4.5, which promise agreement without a rate, whatever the delay and the gain.
    Delayed,
}

impl Watched {
    /// σ: no eigenvalue of KL_p, and of what else passes news on, is larger \[1/s\].
    fn speed(&self, graphs: &[Graph]) -> f64 {
        let degree = most_neighbours(graphs);
        let n = graphs.first().map_or(0, Graph::len);
        let lambda = (2 * degree).min(n) as f64;
        match self {
            Watched::Agreement(gains, _) => gains.iter().copied().fold(0.0, f64::max) * lambda,
            // By way of 1/a_1 at once, and of z in the end.
            Watched::Dynamic(a_1, a_2) => lambda * (1.0 / a_1 + 1.0 / (a_1 + a_2)),
            Watched::Delayed => 0.0,
        }
    }
}

fn most_neighbours(graphs: &[Graph]) -> usize {
    graphs.iter().flat_map(|graph| (0..graph.len()).map(|i| graph.degree(i))).max().unwrap_or(0)
}

/// What theory has to say of a network as seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Watch {
    /// The network.
    pub seen: Seen,
    /// Every condition that was looked at.
    pub margins: Vec<Margin>,
    /// Premises that are not so: then nothing covers the fleet.
    pub broken: Vec<Premise>,
    /// The statement that covers the fleet, the one that promises most first.
    pub covered_by: Option<&'static str>,
    /// The best envelope among those promised.
    pub envelope: Option<Envelope>,
}

/// What theory says of a fleet on a network as seen, with the graphs that occurred. `broken` are premises that the caller
/// found not to be so.
pub fn watch(watched: &Watched, graphs: &[Graph], seen: Seen, broken: Vec<Premise>) -> Watch {
    let mut watch = Watch { seen, margins: Vec::new(), broken, covered_by: None, envelope: None };
    if !graphs.iter().all(Graph::is_undirected) {
        watch.broken.push(Premise {
            asks: "two-way links (section 4.1.2, Definition 4.4)",
            found: "one-way links occur (agreement over those is known from the literature, not covered here)".into(),
        });
    }
    match watched {
        Watched::Agreement(gains, following) => {
            watch.theorem_4_4(gains, *following, graphs);
            watch.theorem_4_5(gains, *following);
        }
        Watched::Dynamic(a_1, a_2) => watch.lemma_4_7(*a_1, *a_2, graphs),
        Watched::Delayed => {
            if watch.connected_in_mean("Lemmas 4.4 and 4.5") {
                watch.promises("Lemmas 4.4 and 4.5", None);
            }
        }
    }
    let exchanged = watch.exchange(watched.speed(graphs));
    if !exchanged || !watch.broken.is_empty() {
        (watch.covered_by, watch.envelope) = (None, None);
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

    fn theorem_4_4(&mut self, gains: &[f64], following: PathFollowing, graphs: &[Graph]) {
        const NAME: &str = "Theorem 4.4";
        let Seen { alpha, t_0, .. } = self.seen;
        let coordination = Coordination::new(graphs, gains, alpha);
        let Some((coordination, t_0)) = coordination.zip(t_0) else {
            self.asks(NAME, "α", alpha, 1.0);
            return;
        };
        match following {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => {
                const NAME: &str = "Theorem 4.4 (type I)";
                let coupled = rho_1 / (alpha_1 * lambda_1);
                let weakly = self.asks(NAME, "ρ₁/(α₁λ₁)", coupled, coordination.k_g());
                // Too strong a coupling leaves no loss rate to bear.
                if self.asks(NAME, "α", alpha, coordination.alpha_limit(following)) && weakly {
                    self.promises(NAME, None);
                }
            }
            PathFollowing::TypeII { .. } => {
                if self.asks(NAME, "α", alpha, 1.0) {
                    self.promises(NAME, Some((coordination.rate_of_agreement(), coordination.overshoot(t_0))));
                }
            }
        }
    }

    fn theorem_4_5(&mut self, gains: &[f64], following: PathFollowing) {
        const NAME: &str = "Theorem 4.5";
        let connected = self.connected_in_mean(NAME);
        let proven = Gains::new(gains)
            .zip(self.seen.mean)
            .and_then(|(gains, mean)| Some((gains, theorem_4_5::agreement(gains, mean, self.seen.dwell)?)));
        match following {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => {
                const NAME: &str = "Theorem 4.5 (type I)";
                let gain = proven.map_or(f64::INFINITY, |(gains, proven)| {
                    theorem_4_5::loop_gain(gains, proven, lambda_1, rho_1, alpha_1)
                });
                if self.asks(NAME, "loop gain", gain, 1.0) && connected {
                    self.promises(NAME, None);
                }
            }
            PathFollowing::TypeII { .. } if connected => {
                self.promises(NAME, proven.map(|(_, proven)| (proven.rate, proven.overshoot)));
            }
            PathFollowing::TypeII { .. } => {}
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
    fn connected_in_mean(&mut self, statement: &'static str) -> bool {
        let waited = self.seen.mean.map_or(f64::INFINITY, Span::secs);
        self.asks(statement, "T [s]", waited, self.seen.length.secs())
    }

    /// The conditions on messages in periods that do not hold.
    pub fn too_rare(&self) -> Vec<String> {
        let failing = self.margins.iter().filter(|margin| margin.statement == IN_PERIODS && !margin.holds());
        failing.map(ToString::to_string).collect()
    }

    /// Whether messages in periods are close enough to hearing one another all the time.
    fn exchange(&mut self, speed: f64) -> bool {
        let Some(Exchange { age, shortest_up, unheard }) = self.seen.exchange else { return true };
        let fresh = self.asks(IN_PERIODS, "age of news [s]", age.secs(), SMALL * shortest_up.secs());
        let calm =
            speed == 0.0 || self.asks(IN_PERIODS, "age of news × largest eigenvalue of KL", age.secs() * speed, 1.0);
        let heard = self.asks(IN_PERIODS, "unheard part of a link's up time", unheard, SMALL);
        fresh && calm && heard
    }

    /// The conditions that do not hold, if no statement covers the fleet.
    pub fn failing(&self) -> Vec<Margin> {
        let failing = self.margins.iter().filter(|margin| self.covered_by.is_none() && !margin.holds());
        failing.cloned().collect()
    }

    /// What messages in periods may cost a fleet of this kind; `drift` is how fast a neighbour that is not heard seems to fall behind
    /// \[1/s\]: v_L, or zero if its state is advanced.
    pub fn tolerance(&self, watched: &Watched, graphs: &[Graph], drift: f64) -> Tolerance {
        let Some(Exchange { age, unheard, .. }) = self.seen.exchange else { return Tolerance::default() };
        let slower = 1.0 - (1.0 - age.secs() * watched.speed(graphs)).clamp(0.0, 1.0) * (1.0 - unheard).clamp(0.0, 1.0);
        let connected = graphs.iter().filter(|graph| graph.is_undirected() && graph.is_connected());
        let union = || graphs.iter().skip(1).fold(graphs.first().cloned(), |all, one| Some(all?.union(one)));
        let lambda = connected
            .filter_map(lambda_2)
            .min_by(f64::total_cmp)
            .or_else(|| lambda_2(&union()?))
            .filter(|lambda| *lambda > 0.0);
        let n = graphs.first().map_or(0, Graph::len) as f64;
        let left = lambda.map_or(0.0, |lambda| n.sqrt() * most_neighbours(graphs) as f64 / lambda);
        Tolerance { late: age.secs(), slower, added: drift.abs() * age.secs() * left }
    }

    /// Judges the errors measured over time, as (t \[s\], ‖e‖), the first one the error at the start.
    pub fn judge(&self, errors: &[(f64, f64)], tolerance: Tolerance) -> Judgement {
        let Some(statement) = self.covered_by else {
            return Judgement::NotCovered { failing: self.failing(), broken: self.broken.clone() };
        };
        let Some(envelope) = self.envelope else { return Judgement::Covered { statement, closest: None } };
        let Some(&(start, initial)) = errors.first() else { return Judgement::Covered { statement, closest: None } };
        let mut closest = 0.0f64;
        for &(t, error) in errors {
            let allowed = tolerance.allowed(&envelope, initial, t - start);
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
        /// The conditions that fail.
        failing: Vec<Margin>,
        /// The premises that are not so.
        broken: Vec<Premise>,
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
                write!(f, "covered by {statement}: agreement is promised, without an envelope")
            }
            Judgement::NotCovered { failing, broken } => {
                let words: Vec<String> =
                    broken.iter().map(ToString::to_string).chain(failing.iter().map(ToString::to_string)).collect();
                match words.is_empty() {
                    true => f.write_str("not covered by any statement about this law"),
                    false => write!(f, "not covered: {}", words.join("; ")),
                }
            }
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

    fn agreement(gain: f64) -> Watched {
        Watched::Agreement(vec![gain; 3], PathFollowing::TypeII { lambda_1: 1.0 })
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
        let watch = watch(&agreement(0.1), &graphs, seen, Vec::new());
        assert_eq!(watch.covered_by, Some("Theorem 4.4"));
        let envelope = watch.envelope.expect("a rate");
        assert!((envelope.rate - 0.025).abs() < 1e-12 && envelope.factor > 1.0);
        let a_little = Tolerance { added: 1e-9, ..Tolerance::default() };
        // What the law does: the slowest mode decays at k λ_2 = 0.1 while the links are up.
        let errors: Vec<(f64, f64)> = (0..=1000)
            .map(|i| f64::from(i) * 0.1)
            .map(|t| (t, (-0.1 * ((t / 10.0).floor() * 2.5 + (t % 10.0 - 7.5).max(0.0))).exp()))
            .collect();
        let judged = watch.judge(&errors, a_little);
        assert!(matches!(judged, Judgement::Covered { statement: "Theorem 4.4", closest: Some(part) } if part > 0.9));
        // A fleet that does not decay is a defect, and so is one that is not a number.
        let idle: Vec<(f64, f64)> = errors.iter().map(|&(t, _)| (t, 1.0)).collect();
        assert!(matches!(watch.judge(&idle, a_little), Judgement::Defect { at, .. } if at > 7.0 && at < 9.0));
        assert!(matches!(watch.judge(&[(0.0, 1.0), (1.0, f64::NAN)], a_little), Judgement::Defect { .. }));
        assert!(watch.judge(&idle, a_little).to_string().starts_with("a defect: covered by Theorem 4.4"));
    }

    #[test]
    fn a_fleet_that_is_never_connected_is_not_covered() {
        let (graphs, seen) = row_of_three(0.0, 100.0);
        assert_eq!((seen.alpha, seen.t_0, seen.mean), (1.0, None, None));
        for watched in [agreement(0.1), Watched::Dynamic(1.0, 1.6), Watched::Delayed] {
            let watch = watch(&watched, &graphs[..1], seen, Vec::new());
            assert_eq!((watch.covered_by, watch.envelope), (None, None));
            let judged = watch.judge(&[(0.0, 1.0)], Tolerance::default());
            assert!(matches!(&judged, Judgement::NotCovered { failing, .. } if !failing.is_empty()), "{judged}");
            assert!(judged.to_string().starts_with("not covered: "));
        }
    }

    #[test]
    fn links_by_turns_are_covered_by_theorem_4_5_alone() {
        let arcs = [(0, 1), (1, 0), (1, 2), (2, 1)];
        let signal = Switching::one_at_a_time(4, vec![vec![0, 1], vec![2, 3]], s(5.0));
        let measured = Connectivity::planned(signal, 3, &arcs, Time::from_secs(100.0));
        let graphs = [Graph::from_edges(3, &[(0, 1)]), Graph::from_edges(3, &[(1, 2)])];
        let seen = Seen::of(&measured).expect("time has passed");
        let watch = watch(&agreement(0.5), &graphs, seen, Vec::new());
        assert_eq!(watch.covered_by, Some("Theorem 4.5"));
        assert!(watch.envelope.is_some_and(|envelope| envelope.rate > 0.0 && envelope.statement == "Theorem 4.5"));
        assert!(watch.failing().is_empty(), "it is covered");
        let failing: Vec<_> = watch.margins.iter().filter(|margin| !margin.holds()).collect();
        assert!(failing.len() == 1 && failing[0].statement == "Theorem 4.4" && failing[0].left() == 0.0);
    }

    #[test]
    fn lemma_4_7_has_a_margin_in_alpha() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let covered = watch(&Watched::Dynamic(1.0, 1.6), &graphs, seen, Vec::new());
        assert_eq!(covered.covered_by, Some("Lemma 4.7"));
        assert!(covered.margins[0].left() > 0.0 && covered.envelope.is_some());
        let best = Dynamic::new(1.0, 1.6, &graphs).and_then(|fleet| fleet.best(0.75)).expect("connected at times");
        let envelope =
            Envelope { statement: "Lemma 4.7", factor: best.overshoot(0.75, s(7.5)), rate: 0.5 * best.rate_of_v(0.75) };
        assert_eq!(covered.envelope, Some(envelope), "norms decay at half the rate of V");
        // With the X that is found it bears this loss rate too, where that of (4.66) does not.
        let (graphs, rarely) = row_of_three(0.02, 1000.0);
        let watch = watch(&Watched::Dynamic(1.0, 0.05), &graphs, rarely, Vec::new());
        assert!(watch.margins[0].holds() && watch.margins[0].limit <= 1.0, "{watch:?}");
        assert!(Dynamic::new(1.0, 0.05, &graphs).is_some_and(|fleet| !fleet.printed_holds()));
    }

    #[test]
    fn before_anything_was_seen_nothing_is_said() {
        assert_eq!(Seen::of(&Connectivity::new()), None);
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let delayed = watch(&Watched::Delayed, &graphs, seen, Vec::new());
        let judged = delayed.judge(&[(0.0, 1.0), (9.0, 5.0)], Tolerance::default());
        assert!(judged.to_string().contains("without an envelope"), "{judged}");
        assert!(matches!(
            watch(&agreement(0.1), &graphs, seen, Vec::new()).judge(&[], Tolerance::default()),
            Judgement::Covered { closest: None, .. }
        ));
    }

    /// Every 0.1 s through windows of 2.5 s, unheard for as long.
    const EVERY_TENTH: Exchange =
        Exchange { age: Span::from_nanos(200_000_000), shortest_up: Span::from_nanos(2_500_000_000), unheard: 0.04 };

    #[test]
    fn messages_that_miss_the_windows_cover_nothing() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let judged = |exchange: Exchange| {
            let seen = Seen { exchange: Some(exchange), ..seen };
            watch(&agreement(0.1), &graphs, seen, Vec::new()).judge(&[(0.0, 1.0), (90.0, 1.0)], Tolerance::default())
        };
        assert!(matches!(judged(EVERY_TENTH), Judgement::Defect { .. }), "this fleet is idle");
        // A message every 5 s, of which none falls into a window; and windows that are only half heard.
        let rare = judged(Exchange { age: s(10.0), unheard: 1.0, ..EVERY_TENTH });
        let late = judged(Exchange { unheard: 0.5, ..EVERY_TENTH });
        for (judged, word) in [(rare, "age of news [s] must be below 0.6250"), (late, "it is 0.5000 (0.2500 too much)")]
        {
            assert!(matches!(judged, Judgement::NotCovered { .. }), "{judged}");
            assert!(judged.to_string().contains(word), "{judged}");
        }
        // Windows in which news are a little too old, where all else would do.
        let stale = Seen { exchange: Some(Exchange { age: s(0.63), ..EVERY_TENTH }), ..seen };
        let stale = watch(&agreement(0.1), &graphs, stale, Vec::new());
        assert_eq!((stale.covered_by, stale.too_rare().len()), (None, 1), "{:?}", stale.margins);
        assert!(stale.too_rare()[0].contains("age of news [s]"));
        // What messages have nothing to do with is none of these conditions; nor is what holds.
        let strong = Watched::Agreement(vec![0.1; 3], PathFollowing::TypeI { lambda_1: 1.0, rho_1: 5.0, alpha_1: 0.5 });
        let strong = watch(&strong, &graphs, Seen { exchange: Some(EVERY_TENTH), ..seen }, Vec::new());
        assert!(strong.too_rare().is_empty() && !strong.failing().is_empty());
        // A law without gains is not asked how far it moves.
        let delayed = watch(&Watched::Delayed, &graphs, Seen { exchange: Some(EVERY_TENTH), ..seen }, Vec::new());
        assert!(delayed.margins.iter().all(|margin| !margin.quantity.contains("eigenvalue")), "{:?}", delayed.margins);
        // Gains that move a fleet far between two messages.
        let seen = Seen { exchange: Some(EVERY_TENTH), ..seen };
        assert!(watch(&agreement(1.6), &graphs, seen, Vec::new()).covered_by.is_some());
        assert_eq!(watch(&agreement(1.7), &graphs, seen, Vec::new()).covered_by, None);
    }

    #[test]
    fn what_messages_in_periods_cost_is_allowed_and_no_more() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let (seen, watched) = (Seen { exchange: Some(EVERY_TENTH), ..seen }, agreement(0.1));
        let watch = watch(&watched, &graphs, seen, Vec::new());
        let tolerance = watch.tolerance(&watched, &graphs, 0.5);
        // σ = 0.3, h = 0.2: 6 % and the 4 % unheard; behind by 0.1 each, two neighbours at most, λ₂ = 1.
        assert!((tolerance.slower - (1.0 - 0.94 * 0.96)).abs() < 1e-12);
        assert!((tolerance.added - 0.2 * 3f64.sqrt()).abs() < 1e-12);
        assert_eq!(watch.tolerance(&watched, &graphs, 0.0).added, 0.0);
        let envelope = watch.envelope.expect("a rate");
        let at = |part: f64| [(0.0, 1.0), (50.0, part * tolerance.allowed(&envelope, 1.0, 50.0))];
        assert!(matches!(watch.judge(&at(0.999), tolerance), Judgement::Covered { .. }));
        assert!(matches!(watch.judge(&at(1.001), tolerance), Judgement::Defect { .. }));
    }

    #[test]
    fn one_way_links_and_broken_premises_cover_nothing() {
        let (_, seen) = row_of_three(2.5, 100.0);
        let cycle = [Graph::from_arcs(3, &[(0, 1), (1, 2), (2, 0)])];
        let at_times = [Graph::complete(3), cycle[0].clone()];
        assert_eq!(watch(&agreement(0.1), &at_times, seen, Vec::new()).covered_by, None);
        for watched in [agreement(0.1), Watched::Dynamic(1.0, 1.6), Watched::Delayed] {
            let judged = watch(&watched, &cycle, seen, Vec::new()).judge(&[], Tolerance::default());
            assert!(judged.to_string().starts_with("not covered: it takes two-way links"), "{judged}");
        }
        let premise = Premise { asks: "every vehicle all the time", found: "auv3 is silent from 57 s on".into() };
        let graphs = [Graph::complete(3)];
        let judged = watch(&agreement(0.1), &graphs, seen, vec![premise]).judge(&[], Tolerance::default());
        assert!(judged.to_string().ends_with("and auv3 is silent from 57 s on"), "{judged}");
    }

    #[test]
    fn type_i_has_margins_of_its_own() {
        let (_, seen) = row_of_three(10.0, 100.0);
        let graphs = [Graph::complete(3)];
        // Remark 4.2 with K = I: ρ_1 < 1/18 for λ_1 = 1, α_1 = ½, the least λ_m being that of all graphs.
        let watched =
            |rho_1| Watched::Agreement(vec![1.0; 3], PathFollowing::TypeI { lambda_1: 1.0, rho_1, alpha_1: 0.5 });
        let weak = watch(&watched(0.01), &graphs, seen, Vec::new());
        assert_eq!((weak.covered_by, weak.envelope), (Some("Theorem 4.4 (type I)"), None));
        let strong = watch(&watched(5.0), &graphs, seen, Vec::new());
        let statements: Vec<_> = strong.failing().into_iter().map(|margin| margin.statement).collect();
        assert_eq!(statements, ["Theorem 4.4 (type I)", "Theorem 4.4 (type I)", "Theorem 4.5 (type I)"]);
        assert_eq!(strong.covered_by, None);
    }

    #[test]
    fn the_margins_of_type_i_are_those_of_the_theorem() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let following = PathFollowing::TypeI { lambda_1: 2.0, rho_1: 1e-9, alpha_1: 0.25 };
        let watched = Watched::Agreement(vec![0.5; 3], following);
        let weak = watch(&watched, &graphs, seen, Vec::new());
        // ρ_1/(α_1λ_1) is weak enough, but three quarters of the time are more than the half that type I can bear.
        assert!((weak.margins[0].value - 2e-9).abs() < 1e-18 && weak.margins[0].holds());
        assert!(!weak.margins[1].holds() && weak.margins[1].limit <= 0.5, "{:?}", weak.margins);
        assert_ne!(weak.covered_by, Some("Theorem 4.4 (type I)"));
        let limit =
            |quantity: &str| weak.margins.iter().find(|margin| margin.quantity == quantity).map(|margin| margin.limit);
        assert_eq!((limit("loop gain"), limit("T [s]")), (Some(1.0), Some(100.0)));
        let type_ii = watch(&agreement(0.5), &graphs, seen, Vec::new());
        assert_eq!((type_ii.margins[0].value, type_ii.margins[0].limit), (0.75, 1.0));
    }

    #[test]
    fn envelope_and_allowance_by_hand() {
        let envelope = Envelope { statement: "a statement", factor: 3.0, rate: 0.4 };
        assert!((envelope.at(5.0) - 3.0 * (-2.0f64).exp()).abs() < 1e-12 && envelope.at(0.0) == 3.0);
        // Nothing decays for two seconds, then at three quarters of the rate, and 0.1 stays.
        let tolerance = Tolerance { late: 2.0, slower: 0.25, added: 0.1 };
        let close = |t: f64, by_hand: f64| (tolerance.allowed(&envelope, 5.0, t) - by_hand).abs() < 1e-7;
        assert!(close(0.0, 15.1) && close(2.0, 15.1) && close(7.0, 15.0 * (-1.5f64).exp() + 0.1));
        // Rounding is allowed for, in proportion.
        assert!(Tolerance::default().allowed(&envelope, 5.0, 0.0) > 15.0);
    }

    #[test]
    fn the_mean_of_an_envelope_is_that_of_its_values() {
        let envelope = Envelope { statement: "", factor: 2.0, rate: 0.1 };
        let values = (0..10_000).map(|i| envelope.at(30.0 * (f64::from(i) + 0.5) / 1e4));
        let mean = values.sum::<f64>() / 1e4;
        assert!((envelope.mean(30.0) - mean).abs() < 1e-6);
        assert_eq!(Envelope { rate: 0.0, ..envelope }.mean(30.0), 2.0);
    }

    #[test]
    fn how_fast_news_pass_by_hand() {
        // Twice the most neighbours, but no more than n; the star has 2, the complete graph of 5 has 4.
        let star = [Graph::from_edges(5, &[(0, 1), (0, 2)])];
        let all = [star[0].clone(), Graph::complete(5)];
        let agreement = Watched::Agreement(vec![0.1, 0.3, 0.2, 0.1, 0.1], PathFollowing::TypeII { lambda_1: 1.0 });
        assert!(
            (agreement.speed(&star) - 0.3 * 4.0).abs() < 1e-12 && (agreement.speed(&all) - 0.3 * 5.0).abs() < 1e-12
        );
        let dynamic = Watched::Dynamic(2.0, 3.0);
        assert!((dynamic.speed(&star) - 4.0 * (0.5 + 0.2)).abs() < 1e-12);
        assert_eq!(Watched::Delayed.speed(&all), 0.0);
    }

    #[test]
    fn the_tolerance_by_hand() {
        let (_, seen) = row_of_three(2.5, 100.0);
        let seen = Seen { exchange: Some(EVERY_TENTH), ..seen };
        let of = |graphs: &[Graph], seen: Seen, drift: f64| {
            watch(&agreement(0.1), graphs, seen, Vec::new()).tolerance(&agreement(0.1), graphs, drift)
        };
        // Behind by 0.1 each; two neighbours and λ_2 = 3 in a triangle, whichever way the fleet goes.
        let triangle = [Graph::complete(3)];
        for drift in [0.5, -0.5] {
            assert!((of(&triangle, seen, drift).added - 0.1 * 3f64.sqrt() * 2.0 / 3.0).abs() < 1e-12);
        }
        // Of several connected ones the least counts: a row has λ_2 = 1.
        let mixed = [Graph::complete(3), Graph::from_edges(3, &[(0, 1), (1, 2)])];
        assert!((of(&mixed, seen, 0.5).added - 0.1 * 3f64.sqrt() * 2.0).abs() < 1e-12);
        // Never connected at once: that of the union, a row, with one neighbour at a time; and of what never connects nothing.
        let by_turns = [Graph::from_edges(3, &[(0, 1)]), Graph::from_edges(3, &[(1, 2)])];
        assert!((of(&by_turns, seen, 0.5).added - 0.1 * 3f64.sqrt()).abs() < 1e-12);
        assert_eq!(of(&by_turns[..1], seen, 0.5).added, 0.0);
        // News so old that nothing is left of the rate.
        let old = Seen { exchange: Some(Exchange { age: s(10.0), ..EVERY_TENTH }), ..seen };
        assert_eq!(of(&triangle, old, 0.5).slower, 1.0);
    }

    #[test]
    fn errors_are_judged_from_their_own_beginning() {
        let (graphs, seen) = row_of_three(2.5, 100.0);
        let watch = watch(&agreement(0.1), &graphs, seen, Vec::new());
        let envelope = watch.envelope.expect("a rate");
        // Half of what is allowed five seconds after the first of them, which was seen at 40 s.
        let half = 0.5 * envelope.at(5.0);
        let judged = watch.judge(&[(40.0, 1.0), (45.0, half)], Tolerance::default());
        assert!(matches!(judged, Judgement::Covered { closest: Some(part), .. } if part < 1.0), "{judged:?}");
        let more = watch.judge(&[(40.0, 1.0), (45.0, 1.001 * envelope.at(5.0))], Tolerance::default());
        assert!(matches!(more, Judgement::Defect { at: 45.0, .. }), "{more:?}");
        let part = |errors: &[(f64, f64)]| match watch.judge(errors, Tolerance::default()) {
            Judgement::Covered { closest, .. } => closest,
            other => panic!("{other:?}"),
        };
        assert!(
            part(&[(0.0, 1.0), (5.0, half)]).is_some_and(|part| (part - (1.0 / envelope.factor).max(0.5)).abs() < 1e-6)
        );
        assert_eq!(part(&[(0.0, 0.0), (5.0, 0.0)]), Some(0.0), "who agrees from the start");
    }
}
