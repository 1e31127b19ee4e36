//! The mission: the file as written ([`mod@file`]), and the checked form that the machines fly.

mod advice;
mod build;
mod check;
mod fault;
pub mod file;
mod link;
mod mend;
mod pattern;
mod read;
mod shape;
mod speed;

use std::sync::Arc;

use nalgebra::Vector3;
use sha2::{Digest, Sha256};

pub use check::FASTEST_FORMATION;
pub use fault::{Collector, Fault, Faults};
pub use link::{Layer, Link};
pub use pattern::{Pattern, PatternMotion, PatternPoint};
pub use read::read;
pub use shape::schema;
pub use speed::SpeedProfile;

use crate::coordination::FleetLaw;
use crate::craft::{Craft, Limits};
use crate::following::theorem_4_7::{Gains, TargetRate, Theorem47};
use crate::graph::Graph;
use crate::graph::switching::Switching;
use crate::network::Medium;
use crate::path::Path;
use crate::talk::belief::Model;
use crate::talk::speaker::acknowledgements;
use crate::talk::trigger::Trigger;
use crate::theory::{PathFollowing, Underactuated};
use crate::time::{Span, Time};
use crate::vehicle::auv::Auv;
use crate::vehicle::environment::{Disturbances, Environment};
use crate::wire::state::{Acknowledgement, CoordinationState, Word};

/// A mission that can be flown: every number is in its range and everything fits together.
#[derive(Clone, Debug)]
pub struct Mission {
    /// The file as written: this is what is uploaded, digested and kept.
    pub text: String,
    /// First eight bytes of the SHA-256 of the text.
    pub digest: u64,
    /// Short name.
    pub name: String,
    /// One sentence for the report.
    pub about: String,
    /// Seed of every random stream.
    pub seed: u64,
    /// When it ends; a whole number of control periods.
    pub end: Time,
    /// The control laws run at this period.
    pub control_period: Span,
    /// Runge-Kutta steps per control period.
    pub substeps: usize,
    /// Control periods between recorded states.
    pub record_ticks: i64,
    /// Control periods between messages.
    pub message_ticks: i64,
    /// Formation speed over time.
    pub speed: SpeedProfile,
    /// The coordination law.
    pub law: Arc<dyn FleetLaw>,
    /// Which law, with its gains, as written.
    pub law_choice: file::LawChoice,
    /// The same for each vehicle, with its own gains if it has some.
    pub law_choices: Vec<file::LawChoice>,
    /// A neighbour leaves N_i after this silence.
    pub validity: Option<Span>,
    /// What stands for a neighbour's state between its messages.
    pub between: file::Between,
    /// When vehicles speak; in every message period without a trigger.
    pub talk: Option<Trigger>,
    /// The vehicles, in the order of the file.
    pub vehicles: Vec<VehiclePlan>,
    /// The directed links, in the order of the file, both directions of a link side by side.
    pub links: Vec<Link>,
    /// Which links are up when.
    pub switching: Switching,
    /// The medium that all vehicles share, if messages take time to send or disturb one another.
    pub medium: Option<Medium>,
}

/// One vehicle of a mission.
#[derive(Clone, Debug)]
pub struct VehiclePlan {
    /// Its name.
    pub id: String,
    /// Its place in the pattern, h_i(t).
    pub pattern: Pattern,
    /// Its path.
    pub path: Arc<dyn Path>,
    /// Where it starts.
    pub start: Start,
    /// Its plant.
    pub model: file::ModelChoice,
    /// Its path-following law.
    pub following: file::FollowingChoice,
    /// What its actuators give at most.
    pub limits: Limits,
    /// What disturbs it.
    pub disturbances: Disturbances,
}

/// Where a vehicle starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Position \[m\].
    pub position: [f64; 3],
    /// Heading \[rad\].
    pub yaw: f64,
    /// Forward speed \[m/s\].
    pub speed: f64,
    /// Path parameter of the virtual target.
    pub xi: f64,
}

/// First eight bytes of the SHA-256 of a mission file.
pub fn digest(text: &str) -> u64 {
    let hash = Sha256::digest(text.as_bytes());
    u64::from_le_bytes(std::array::from_fn(|i| hash[i]))
}

/// A mission in what a machine wants done, which must be comparable: it is the same if its file is.
#[derive(Clone, Debug)]
pub struct SharedMission(pub Arc<Mission>);

impl PartialEq for SharedMission {
    fn eq(&self, other: &Self) -> bool {
        self.0.digest == other.0.digest
    }
}

impl Mission {
    /// Reads and checks a mission file; `name` is what the faults call it.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn parse(name: &str, text: &str) -> Result<Mission, Faults> {
        check::check(name, text)
    }

    /// Index of a vehicle by its id.
    pub fn index_of(&self, id: &str) -> Option<usize> {
        self.vehicles.iter().position(|vehicle| vehicle.id == id)
    }

    /// The period at which vehicles speak, or look whether they should.
    pub fn message_period(&self) -> Span {
        self.control_period * self.message_ticks
    }

    /// The graph of all links: who can ever hear whom.
    pub fn graph(&self) -> Graph {
        let arcs: Vec<(usize, usize)> = self.links.iter().map(|link| (link.to, link.from)).collect();
        Graph::from_arcs(self.vehicles.len(), &arcs)
    }

    /// How far the channel can be decided ahead: nothing said now makes a difference to any arrival earlier than this.
    ///
    /// The least delay of any link; nothing at all if vehicles share a medium, for who speaks now may drown or replace
    /// what is about to arrive or to go out.
    pub fn least_delay(&self) -> Span {
        if self.medium.is_some() {
            return Span::ZERO;
        }
        self.links.iter().map(Link::least_delay).min().unwrap_or(Span::ZERO)
    }

    /// Whether every message on every link takes exactly this long.
    pub fn every_message_takes(&self, delay: Span) -> bool {
        self.medium.is_none() && self.links.iter().all(|link| link.fixed_delay() == Some(delay))
    }

    /// Whether messages are lost by the switching of links only.
    pub fn loses_by_switching_only(&self) -> bool {
        self.medium.is_none() && !self.links.iter().any(|link| link.loses() || self.can_fill(link))
    }

    /// No vehicle speaks again sooner: the message period or, by event, the first at which the shortest silence is over.
    pub fn shortest_pause(&self) -> Span {
        let period = self.message_period();
        let silence = self.talk.map_or(Span::ZERO, |trigger| trigger.least_silence());
        period * ((silence.nanos() - 1).max(0) / period.nanos().max(1) + 1)
    }

    /// The most places of its queue that a link can need.
    pub fn most_under_way(&self, link: &Link) -> i64 {
        link.most_under_way(self.shortest_pause(), self.end)
    }

    /// Whether the queue of a link can be full when a message comes.
    pub fn can_fill(&self, link: &Link) -> bool {
        usize::try_from(self.most_under_way(link)).map_or(true, |most| most > link.queue)
    }

    /// The gain of this name (`gain`, `a` or `b`) of each vehicle, if the law is one under which vehicles may have their
    /// own; else nothing.
    pub fn gains(&self, name: &str) -> Vec<f64> {
        let of_one = |choice: &file::LawChoice| {
            let mut choice = choice.clone();
            let gains = build::gains_by_vehicle(&mut choice);
            gains.iter().find(|(known, _)| *known == name).map(|(_, gain)| **gain)
        };
        self.law_choices.iter().filter_map(of_one).collect()
    }

    /// Whether no vehicle has other gains than the rest.
    pub fn has_equal_gains(&self) -> bool {
        let equal = |gains: Vec<f64>| gains.windows(2).all(|pair| pair[0] == pair[1]);
        ["gain", "a", "b"].iter().all(|name| equal(self.gains(name)))
    }

    /// The delay τ that the law was told, if it takes one \[s\].
    pub fn law_delay(&self) -> Option<f64> {
        match &self.law_choice {
            file::LawChoice::Delayed(law) | file::LawChoice::DelayedWithLosses(law) => Some(law.delay_s),
            _ => None,
        }
    }

    /// v_L* / v_L = 1 / (1 + k τ), the speed at which delayed laws let the fleet travel (after Lemma 4.4); else 1.
    pub fn nominal_factor(&self) -> f64 {
        build::nominal_factor(&self.law_choice)
    }

    /// The gains and the vehicle of Theorem 4.7, for a vehicle under that law.
    pub fn theorem_47(&self, vehicle: usize) -> Option<(Gains, Auv)> {
        let plan = self.vehicles.get(vehicle)?;
        match (&plan.model, &plan.following) {
            (file::ModelChoice::UnderactuatedAuv(model), file::FollowingChoice::Theorem47(gains)) => {
                Some((build::auv_gains(gains), build::auv(model).ok()?))
            }
            _ => None,
        }
    }

    /// W_3 of (4.49) of a vehicle at the start, for targets that are to go at the mission's first v_n; `None` under other path-following
    /// laws than that of Theorem 4.7.
    #[doc(alias = "W_3")]
    pub fn lyapunov_at_start(&self, vehicle: usize) -> Option<f64> {
        let (gains, auv) = self.theorem_47(vehicle)?;
        let VehiclePlan { path, start, .. } = self.vehicles.get(vehicle)?;
        let law = Theorem47::new(gains, auv).ok()?;
        let v_n = self.nominal_factor() * self.speed.at(Time::ZERO).v_l;
        let rate = TargetRate { nominal: v_n, nominal_dot: 0.0, actual: v_n };
        Some(law.lyapunov(&law.evaluate(&build::auv_state(start), &path.at(start.xi), rate)))
    }

    /// Whether a vehicle starts on the tangent of its path where its target is, and points along it: to a micrometre and a microradian.
    pub fn starts_along_its_path(&self, vehicle: usize) -> bool {
        const SAME: f64 = 1e-6;
        let Some(VehiclePlan { path, start, .. }) = self.vehicles.get(vehicle) else { return false };
        let point = path.at(start.xi);
        let Some(tangent) = point.d1.try_normalize(0.0) else { return false };
        let error = Vector3::from(start.position) - point.p;
        let heading = Vector3::new(start.yaw.cos(), start.yaw.sin(), 0.0);
        (error - tangent * error.dot(&tangent)).norm() <= SAME && (heading - tangent).norm() <= SAME
    }

    /// What theory needs to know of a vehicle under Theorem 4.7 and of its path; `None` under other path-following laws. |p'| and |p''| are
    /// the largest at 201 points of the path that is to be flown.
    pub fn underactuated(&self, vehicle: usize) -> Option<Underactuated> {
        const STEPS: u32 = 200;
        let (gains, auv) = self.theorem_47(vehicle)?;
        let (plan, parameters) = (self.vehicles.get(vehicle)?, auv.parameters());
        let way = self.nominal_factor() * self.speed.distance(self.end);
        let points = (0..=STEPS).map(|step| plan.path.at(plan.start.xi + way * f64::from(step) / f64::from(STEPS)));
        let (stretch, bend) =
            points.fold((0.0f64, 0.0f64), |(d1, d2), point| (d1.max(point.d1.norm()), d2.max(point.d2.norm())));
        Some(Underactuated {
            mass: (parameters.mass.min(), parameters.mass.max()),
            inertia: (parameters.inertia.min(), parameters.inertia.max()),
            gains: [gains.k_e, gains.k_phi, gains.k_z, gains.k_eta],
            fastest: self.speed.fastest(),
            stretch,
            bend,
        })
    }

    /// The constants of Assumption 4.1 that a vehicle has with Theorem 4.7 and (4.53), which do for type II too; `None` under other
    /// path-following laws.
    pub fn path_following_of_type_1(&self, vehicle: usize) -> Option<PathFollowing> {
        self.underactuated(vehicle)?.type_1()
    }

    /// |δ_1| of a vehicle under Theorem 4.7, and what it must exceed so that the matrix keeps its rank at every nominal speed of
    /// the mission (erratum 4.11) \[m/s\].
    pub fn rank_margin(&self, vehicle: usize) -> Option<(f64, f64)> {
        let (gains, auv) = self.theorem_47(vehicle)?;
        let fastest = self.speed.fastest() * self.nominal_factor();
        let stretch = build::largest_stretch(self.vehicles.get(vehicle)?.path.as_ref());
        Some((gains.delta1.abs(), Gains::smallest_delta1(&auv, fastest, stretch)))
    }

    /// Whether every vehicle can fly at this formation speed.
    ///
    /// # Errors
    /// Which one cannot, and why.
    pub fn fits_speed(&self, speed: f64) -> Result<(), String> {
        let fastest = self.speed.fastest().max(speed.abs());
        for plan in &self.vehicles {
            build::craft(plan, plan.start, self.nominal_factor(), fastest, self.law.kind())
                .map_err(|reason| format!("{}: {reason}", plan.id))?;
        }
        Ok(())
    }

    /// What stands for a vehicle's state between its messages.
    pub fn belief(&self) -> Model {
        let law_delay = self.law_delay().unwrap_or(0.0);
        Model { between: self.between, nominal_factor: self.nominal_factor(), law_delay }
    }

    /// Size of one coordination message of a vehicle \[bytes\].
    pub fn message_bytes(&self, vehicle: usize) -> usize {
        let state = CoordinationState {
            mission: self.digest,
            sender: 0,
            seq: 0,
            made: Time::ZERO,
            xi: 0.0,
            scalar: self.law.says(vehicle).map(|_| 0.0),
        };
        let mut word = Word::from(state);
        for _ in 0..acknowledgements(self, vehicle) {
            word.acknowledge(Acknowledgement::default());
        }
        word.encode().len()
    }

    /// What surrounds a vehicle during its flight; `None` where nothing disturbs it.
    pub fn environment(&self, vehicle: usize) -> Option<Environment> {
        let plan = &self.vehicles[vehicle];
        Environment::new(plan.disturbances, self.seed, &plan.id)
    }

    /// The vehicle with its plant and its path-following law, where the mission starts it or at another place.
    ///
    /// # Errors
    /// Why the vehicle cannot be built; the check has excluded it for the mission's own start.
    pub fn craft(&self, vehicle: usize, start: Start) -> Result<Box<dyn Craft>, String> {
        build::craft(&self.vehicles[vehicle], start, self.nominal_factor(), self.speed.fastest(), self.law.kind())
    }
}
