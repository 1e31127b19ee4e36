//! One vehicle's decisions: speak now or not, ask, acknowledge.

use std::collections::VecDeque;

use super::belief::{Belief, Model};
use super::trigger::Trigger;
use crate::mission::Mission;
use crate::random::Stream;
use crate::time::{Span, Time};
use crate::wire::state::{Acknowledgement, CoordinationState, MOST_HEARD, Word};

/// Messages of its own that a vehicle remembers, to know what an acknowledgement is about.
const REMEMBERED: usize = 256;

/// What decides when a vehicle speaks, and what it adds to its coordination state.
#[derive(Debug)]
pub struct Speaker {
    me: u16,
    /// Without a trigger it speaks whenever it is asked whether it wants to: the periodic policy.
    trigger: Option<Trigger>,
    model: Model,
    stream: Stream,
    /// What it said, the newest last.
    said: VecDeque<Said>,
    /// What others believe of it if they heard everything.
    as_said: Belief,
    heartbeat: Option<Span>,
    /// Those with whom it has a link in both directions; nobody else can acknowledge.
    partners: Vec<Partner>,
    /// Where the round of acknowledgements goes on.
    turn: usize,
}

#[derive(Clone, Copy, Debug)]
struct Said {
    seq: u32,
    made: Time,
    xi: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Partner {
    vehicle: u16,
    /// What it believes of this vehicle, by what it acknowledged.
    belief: Belief,
    acknowledged: Option<u32>,
    /// Its newest message.
    heard: Option<u32>,
    /// It asked for an answer.
    asked: bool,
}

impl Partner {
    /// Whether it has not acknowledged message number `seq`, or a newer one.
    fn lacks(&self, seq: u32) -> bool {
        self.acknowledged.is_none_or(|acknowledged| acknowledged < seq)
    }
}

impl Speaker {
    /// Of vehicle `me` in a mission, who has said nothing yet.
    pub fn new(mission: &Mission, me: usize) -> Speaker {
        Speaker {
            me: me as u16,
            trigger: mission.talk,
            model: mission.belief(),
            stream: Stream::new(mission.seed, &format!("talk/{}", mission.vehicles[me].id)),
            said: VecDeque::new(),
            as_said: Belief::default(),
            heartbeat: None,
            partners: partners(mission, me).map(|vehicle| Partner { vehicle, ..Partner::default() }).collect(),
            turn: 0,
        }
    }

    /// Takes what a neighbour added to its state. Words of one neighbour come in the order in which they were made.
    pub fn hear(&mut self, word: &Word) {
        let Some(partner) = self.partners.iter_mut().find(|partner| partner.vehicle == word.state.sender) else {
            return;
        };
        partner.heard = Some(word.state.seq);
        partner.asked |= word.asks;
        let Some(mine) = word.heard().iter().find(|heard| heard.vehicle == self.me) else { return };
        match mine.seq {
            // It was started again and knows nothing.
            None => *partner = Partner { belief: Belief::default(), acknowledged: None, ..*partner },
            Some(seq) if partner.acknowledged != Some(seq) => {
                if let Some(said) = self.said.iter().rev().find(|said| said.seq == seq) {
                    partner.belief.hear(said.made, said.xi);
                    partner.acknowledged = Some(seq);
                }
            }
            Some(_) => {}
        }
    }

    /// Whether it speaks at this instant, at `xi` and with this formation speed.
    pub fn wants(&self, now: Time, xi: f64, v_l: f64) -> bool {
        let (Some(trigger), Some(last)) = (&self.trigger, self.said.back()) else { return true };
        let silence = now - last.made;
        if silence < trigger.least_silence() {
            return false;
        }
        self.partners.iter().any(|partner| partner.asked)
            || self.heartbeat.is_some_and(|heartbeat| silence >= heartbeat)
            || self.is_off(&self.as_said, trigger, now, xi, v_l)
            || trigger.patience().is_some_and(|patience| silence >= patience && self.misses_someone(now, xi, v_l))
    }

    /// Speaks: what goes on the air for this state.
    pub fn say(&mut self, state: CoordinationState, v_l: f64) -> Word {
        let mut word = Word::from(state);
        let Some(trigger) = self.trigger else { return word };
        if trigger.patience().is_some() {
            word.asks = self.misses_someone(state.made, state.xi, v_l);
            self.acknowledge(&mut word);
        }
        self.partners.iter_mut().for_each(|partner| partner.asked = false);
        if self.said.len() >= REMEMBERED {
            self.said.pop_front();
        }
        self.said.push_back(Said { seq: state.seq, made: state.made, xi: state.xi });
        self.as_said.hear(state.made, state.xi);
        self.heartbeat = trigger.heartbeat(&mut self.stream, state.seq);
        word
    }

    /// Whether a belief is wrong by more than the threshold; one that is no number is.
    fn is_off(&self, belief: &Belief, trigger: &Trigger, now: Time, xi: f64, v_l: f64) -> bool {
        let error = belief.error(&self.model, now, v_l, xi);
        error.is_nan() || error > trigger.threshold(now)
    }

    /// Whether somebody has not acknowledged in time and, for all that is known, believes something wrong.
    fn misses_someone(&self, now: Time, xi: f64, v_l: f64) -> bool {
        let Some(trigger) = &self.trigger else { return false };
        let Some(patience) = trigger.patience() else { return false };
        let Some(due) = self.said.iter().rev().find(|said| now - said.made >= patience) else { return false };
        self.partners
            .iter()
            .any(|partner| partner.lacks(due.seq) && self.is_off(&partner.belief, trigger, now, xi, v_l))
    }

    /// Tells what was heard: first to those who asked, then to the others in turn.
    fn acknowledge(&mut self, word: &mut Word) {
        let count = self.partners.len();
        let turn = self.turn;
        let in_turn = move |step: usize| (turn + step) % count;
        for asked in [true, false] {
            for index in (0..count).map(in_turn) {
                let partner = &self.partners[index];
                if partner.asked == asked {
                    word.acknowledge(Acknowledgement { vehicle: partner.vehicle, seq: partner.heard });
                }
            }
        }
        if count > 0 {
            self.turn = (self.turn + MOST_HEARD) % count;
        }
    }
}

/// The vehicles with which `me` has links in both directions, in the order of the mission.
fn partners(mission: &Mission, me: usize) -> impl Iterator<Item = u16> {
    let linked = |from: usize, to: usize| mission.links.iter().any(|link| link.from == from && link.to == to);
    (0..mission.vehicles.len()).filter(move |&other| linked(me, other) && linked(other, me)).map(|other| other as u16)
}

/// Acknowledgements in every message of vehicle `me`.
pub(crate) fn acknowledgements(mission: &Mission, me: usize) -> usize {
    match mission.talk.and_then(|trigger| trigger.patience()) {
        Some(_) => partners(mission, me).count().min(MOST_HEARD),
        None => 0,
    }
}
