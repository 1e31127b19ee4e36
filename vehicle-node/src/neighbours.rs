//! What a vehicle knows of the others: the newest state of each, and whether it still counts.

use common::coordination::Neighbour;
use common::mission::Mission;
use common::mission::file::Between;
use common::time::{Span, Time};
use common::wire::state::CoordinationState;
use common::wire::{Garbage, GarbageCount};

/// How far the clocks of two hosts may be apart before a message counts as made in the future.
const CLOCK_SKEW: Span = Span::from_nanos(1_000_000_000);

/// The newest that is known of every vehicle.
#[derive(Debug)]
pub struct Neighbours {
    /// Index of this vehicle.
    me: usize,
    mission: u64,
    validity: Option<Span>,
    between: Between,
    /// Delay the law was told \[s\].
    law_delay: f64,
    /// v_L* / v_L.
    nominal_factor: f64,
    /// Per sender, what was heard last.
    heard: Vec<Option<Heard>>,
    /// Whether this vehicle listens to that sender.
    listens: Vec<bool>,
    /// What was not a message, by kind.
    pub garbage: GarbageCount,
    /// N_i as handed to the law; kept to spare the allocation.
    present: Vec<Neighbour>,
}

#[derive(Clone, Copy, Debug)]
struct Heard {
    state: CoordinationState,
    /// When it arrived: silence is counted from here, for the delay is not known to the vehicle.
    arrived: Time,
}

impl Neighbours {
    /// Of vehicle `me`, who has heard nothing yet.
    pub fn new(mission: &Mission, me: usize) -> Neighbours {
        let n = mission.vehicles.len();
        let mut listens = vec![false; n];
        for link in mission.links.iter().filter(|link| link.to == me) {
            listens[link.from] = true;
        }
        Neighbours {
            me,
            mission: mission.digest,
            validity: mission.validity,
            between: mission.between,
            law_delay: mission.law_delay().unwrap_or(0.0),
            nominal_factor: mission.nominal_factor(),
            heard: vec![None; n],
            listens,
            garbage: GarbageCount::default(),
            present: Vec::with_capacity(n),
        }
    }

    /// Takes bytes from the air, or says why not; keeps the newest and counts the rest.
    ///
    /// # Errors
    /// The kind of garbage they are.
    pub fn hear(&mut self, now: Time, bytes: &[u8]) -> Result<(), Garbage> {
        let result = self.take(now, bytes);
        if let Err(kind) = result {
            self.garbage.count(kind);
        }
        result
    }

    fn take(&mut self, now: Time, bytes: &[u8]) -> Result<(), Garbage> {
        let state = CoordinationState::decode(bytes)?;
        if state.mission != self.mission {
            return Err(Garbage::WrongMission);
        }
        let sender = state.sender as usize;
        if sender == self.me || !self.listens.get(sender).copied().unwrap_or(false) {
            return Err(Garbage::Forged);
        }
        if state.made > now + CLOCK_SKEW {
            return Err(Garbage::FromTheFuture);
        }
        let slot = &mut self.heard[sender];
        if slot.is_some_and(|heard| (heard.state.made, heard.state.seq) >= (state.made, state.seq)) {
            return Err(Garbage::Stale);
        }
        *slot = Some(Heard { state, arrived: now });
        Ok(())
    }

    /// N_i at this instant, with what stands for each neighbour's state.
    pub fn present(&mut self, now: Time, v_l: f64) -> &[Neighbour] {
        self.present.clear();
        for heard in self.heard.iter().flatten() {
            if self.validity.is_some_and(|validity| now - heard.arrived > validity) {
                continue;
            }
            let age = (now - heard.state.made).secs();
            let xi = match self.between {
                Between::Hold => heard.state.xi,
                Between::Advance => heard.state.xi + v_l * age,
                Between::Align => heard.state.xi + self.nominal_factor * v_l * (age - self.law_delay),
            };
            self.present.push(Neighbour { xi, eta_over_r: heard.state.eta_over_r.unwrap_or(0.0) });
        }
        &self.present
    }

    /// The neighbours' mean coordination state advanced to now at the speed the fleet travels at, if any was heard.
    pub fn formation_xi(&self, now: Time, v_l: f64) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0u32);
        for heard in self.heard.iter().flatten() {
            sum += heard.state.xi + self.nominal_factor * v_l * (now - heard.state.made).secs();
            count += 1;
        }
        (count > 0).then(|| sum / f64::from(count))
    }
}
