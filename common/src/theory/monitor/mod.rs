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
//! heard. That is an estimate and no proof, made so that nothing is called a defect for want of messages.
//!
//! So a promised rate r is held against the errors as (1 − σh)(1 − u)r ([`Tolerance::slower`]), from h after the start on,
//! before which nobody need have heard anything ([`Tolerance::late`]). Where old states are not advanced, neighbours seem
//! to be behind by v_L h each; the part of that which differs between vehicles leaves an error of up to v_L h √n D/λ, with
//! D the most neighbours of anybody and λ the connectivity ([`Tolerance::added`]).
//!
//! [`watch`] asks which statement covers the fleet, and [`Watch::judge`] holds the errors against it; those of a flight in which
//! v_L changed [stretch by stretch](Watch::judge_between).

mod condition;
mod envelope;
mod judgement;
mod seen;
mod stretches;
#[cfg(test)]
mod tests;

pub use condition::{Margin, Premise};
pub use envelope::{Envelope, Tolerance};
pub use judgement::Judgement;
pub use seen::{Exchange, Seen};
pub use stretches::{Stretch, stretches};

use super::lemma_4_6::Dynamic;
use super::theorem_4_4::Coordination;
use super::{Gains, PathFollowing, theorem_4_5};
use crate::graph::Graph;
use crate::graph::spectrum::lambda_2;
use crate::time::Span;

/// What conditions on messages in periods are filed under.
const IN_PERIODS: &str = "messages in periods";
const AGE: &str = "age of news [s]";
const AGE_BY_RATE: &str = "age of news × largest eigenvalue of KL";
const UNHEARD: &str = "unheard part of a link's up time";

/// The most that age over shortest up time, and the unheard part, may be.
const SMALL: f64 = 0.25;

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
    /// Whether the envelope may begin at any instant with the error that is there then. That of Lemma 4.7 bounds ‖(θ, z)‖ by what it was at the
    /// start, where z = 0; what z is later is not seen.
    pub fn begins_anew(&self) -> bool {
        !matches!(self, Watched::Dynamic(..))
    }

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
        let fresh = self.asks(IN_PERIODS, AGE, age.secs(), SMALL * shortest_up.secs());
        let calm = speed == 0.0 || self.asks(IN_PERIODS, AGE_BY_RATE, age.secs() * speed, 1.0);
        let heard = self.asks(IN_PERIODS, UNHEARD, unheard, SMALL);
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

    /// Judges the errors of a flight in which v_L changed, stretch by stretch, each from its own beginning; with those that cannot be judged.
    ///
    /// The first defect counts, wherever it is; without one, what came closest to its envelope.
    pub fn judge_between(
        &self,
        watched: &Watched,
        errors: &[(f64, f64)],
        changes: &[f64],
        tolerance: Tolerance,
    ) -> (Judgement, Vec<Stretch>) {
        if self.envelope.is_none() {
            return (self.judge(errors, tolerance), Vec::new());
        }
        let (judged, left): (Vec<Stretch>, Vec<Stretch>) = stretches(errors, changes, tolerance.late)
            .into_iter()
            .partition(|stretch| stretch.since.is_none() || (watched.begins_anew() && stretch.can_be_judged()));
        let judgements = judged.iter().map(|stretch| self.judge(&stretch.errors, tolerance));
        let whole = judgements.reduce(Judgement::with).unwrap_or_else(|| self.judge(errors, tolerance));
        (whole, left)
    }

    /// Judges the errors measured over time while v_L is constant, as (t \[s\], ‖e‖), the first one the error at the start.
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
