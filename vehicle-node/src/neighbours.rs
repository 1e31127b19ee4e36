//! What a vehicle knows of the others: the newest state of each, and whether it still counts.

use common::coordination::Neighbour;
use common::mission::Mission;
use common::talk::belief::{Belief, Model};
use common::time::{Span, Time};
use common::wire::state::{CoordinationState, Word};
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
    model: Model,
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
    belief: Belief,
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
            model: mission.belief(),
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
    pub fn hear(&mut self, now: Time, bytes: &[u8]) -> Result<Word, Garbage> {
        let result = self.take(now, bytes);
        if let Err(kind) = result {
            self.garbage.count(kind);
        }
        result
    }

    fn take(&mut self, now: Time, bytes: &[u8]) -> Result<Word, Garbage> {
        let word = Word::decode(bytes)?;
        let state = word.state;
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
        let mut belief = slot.map_or_else(Belief::default, |heard| heard.belief);
        belief.hear(state.made, state.xi);
        *slot = Some(Heard { state, arrived: now, belief });
        Ok(word)
    }

    /// N_i at this instant, with what stands for each neighbour's state. `rate` is that at which a neighbour is taken to
    /// have moved on, by the scalar that it sent: v_L, if the vehicle is told.
    pub fn present(&mut self, now: Time, rate: impl Fn(f64) -> f64) -> &[Neighbour] {
        self.present.clear();
        for (vehicle, heard) in self.heard.iter().enumerate() {
            let Some(heard) = heard else { continue };
            if self.validity.is_some_and(|validity| now - heard.arrived > validity) {
                continue;
            }
            let age = (now - heard.state.made).secs();
            let scalar = heard.state.scalar.unwrap_or(0.0);
            let Some(xi) = heard.belief.for_law(&self.model, now, rate(scalar)) else { continue };
            self.present.push(Neighbour { vehicle, xi, scalar, said: heard.state.xi, age });
        }
        &self.present
    }

    /// The neighbours' mean coordination state advanced to now at the speed the fleet travels at, if any was heard; `rate`
    /// as for [`Neighbours::present`].
    pub fn formation_xi(&self, now: Time, rate: impl Fn(f64) -> f64) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0u32);
        for heard in self.heard.iter().flatten() {
            let rate = self.model.nominal_factor * rate(heard.state.scalar.unwrap_or(0.0));
            sum += heard.state.xi + rate * (now - heard.state.made).secs();
            count += 1;
        }
        (count > 0).then(|| sum / f64::from(count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HELIX: &str = include_str!("../../missions/auv-helix.toml");

    fn mission(between: &str) -> Mission {
        let text = HELIX.replace("between = \"align\"", &format!("between = \"{between}\""));
        Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}"))
    }

    fn said(mission: &Mission, sender: u16, made_s: f64, xi: f64) -> Vec<u8> {
        let made = Time::from_secs(made_s);
        let seq = (made_s * 10.0) as u32;
        CoordinationState { mission: mission.digest, sender, seq, made, xi, scalar: None }.encode()
    }

    fn v_l(_: f64) -> f64 {
        0.5
    }

    /// What stands at 21.05 s for a neighbour that said 10 at 16 s, heard at 21 s.
    fn stands_for(between: &str) -> f64 {
        let mission = mission(between);
        let mut neighbours = Neighbours::new(&mission, 1);
        neighbours.hear(Time::from_secs(21.0), &said(&mission, 0, 16.0, 10.0)).expect("sound");
        neighbours.present(Time::from_secs(21.05), v_l)[0].xi
    }

    #[test]
    fn hold_advance_and_align_are_what_they_say() {
        assert_eq!(stands_for("hold"), 10.0);
        // 5.05 s at v_L = 0.5.
        assert!((stands_for("advance") - 12.525).abs() < 1e-12);
        // To t − τ = 16.05 s, 0.05 s at v_L* = 1/3.
        assert!((stands_for("align") - (10.0 + 0.05 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn who_is_not_told_v_l_advances_at_what_the_neighbour_says() {
        let mission = mission("advance");
        let mut neighbours = Neighbours::new(&mission, 1);
        let made = Time::from_secs(16.0);
        let state =
            CoordinationState { mission: mission.digest, sender: 0, seq: 1, made, xi: 10.0, scalar: Some(0.125) };
        neighbours.hear(Time::from_secs(24.0), &state.encode()).expect("sound");
        let now = Time::from_secs(24.0);
        assert_eq!(neighbours.present(now, |scalar| scalar)[0].xi, 11.0);
        assert_eq!(neighbours.present(now, |scalar| scalar)[0].said, 10.0);
    }

    #[test]
    fn a_neighbour_leaves_when_nothing_was_heard_of_it_for_the_validity() {
        let mission = mission("hold");
        let mut neighbours = Neighbours::new(&mission, 1);
        neighbours.hear(Time::from_secs(21.0), &said(&mission, 0, 16.0, 10.0)).expect("sound");
        assert_eq!(neighbours.present(Time::from_secs(21.3), v_l).len(), 1);
        assert_eq!(neighbours.present(Time::from_secs(21.301), v_l).len(), 0);
    }

    #[test]
    fn the_newest_counts_whatever_the_order_of_arrival() {
        let mission = mission("hold");
        let mut neighbours = Neighbours::new(&mission, 1);
        let now = Time::from_secs(30.0);
        neighbours.hear(now, &said(&mission, 0, 20.0, 2.0)).expect("sound");
        assert_eq!(neighbours.hear(now, &said(&mission, 0, 19.0, 1.0)), Err(Garbage::Stale), "overtaken");
        assert_eq!(neighbours.hear(now, &said(&mission, 0, 20.0, 2.0)), Err(Garbage::Stale), "said twice");
        assert_eq!(neighbours.present(now, v_l)[0].xi, 2.0);
        assert_eq!(neighbours.garbage.of(Garbage::Stale), 2);
    }

    #[test]
    fn only_neighbours_of_this_mission_and_of_the_past_are_heard() {
        let mission = mission("hold");
        let mut neighbours = Neighbours::new(&mission, 0);
        let now = Time::from_secs(10.0);
        // Vehicle 0 hears vehicle 1 only.
        assert_eq!(neighbours.hear(now, &said(&mission, 2, 9.0, 0.0)), Err(Garbage::Forged));
        assert_eq!(neighbours.hear(now, &said(&mission, 0, 9.0, 0.0)), Err(Garbage::Forged), "its own voice");
        assert_eq!(neighbours.hear(now, &said(&mission, 77, 9.0, 0.0)), Err(Garbage::Forged));
        assert_eq!(neighbours.hear(now, &said(&mission, 1, 12.0, 0.0)), Err(Garbage::FromTheFuture));
        let other = Mission { digest: mission.digest ^ 1, ..mission.clone() };
        assert_eq!(neighbours.hear(now, &said(&other, 1, 9.0, 0.0)), Err(Garbage::WrongMission));
        assert!(neighbours.present(now, v_l).is_empty());
        assert_eq!(neighbours.formation_xi(now, v_l), None);
    }
}
