//! Where the vehicles are, as far as their own words tell: p_i(ξ_i), with ξ_i moved on from what they said last at the rate
//! between their last two words. No telemetry is on the air.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::mission::Pattern;
use crate::path::Path;
use crate::time::Time;

/// Positions by vehicle.
#[derive(Clone, Debug)]
pub struct Whereabouts(Vec<Place>);

#[derive(Clone, Debug)]
struct Place {
    path: Arc<dyn Path>,
    /// h_i(t), which messages leave out.
    pattern: Pattern,
    /// The newest word and what held before it, so that the order of words of one instant does not matter.
    since: Time,
    newest: Word,
    before: Word,
}

/// What a vehicle said, and how fast it went.
#[derive(Clone, Copy, Debug)]
struct Word {
    made: Time,
    /// ξ without the pattern.
    xi: f64,
    /// Since the word before \[1/s\].
    rate: f64,
}

impl Word {
    fn after(self, made: Time, xi: f64) -> Word {
        let passed = (made - self.made).secs();
        let rate = if passed > 0.0 { (xi - self.xi) / passed } else { self.rate };
        Word { made, xi, rate }
    }

    fn at(self, t: Time) -> f64 {
        self.xi + self.rate * (t - self.made).secs()
    }
}

impl Place {
    fn position(&self, word: Word, t: Time) -> Vector3<f64> {
        self.path.at(word.at(t) + self.pattern.at(t).h).p
    }
}

impl Whereabouts {
    /// Every vehicle's path, its place in the pattern and the ξ at which its target starts.
    pub fn new(vehicles: impl Iterator<Item = (Arc<dyn Path>, Pattern, f64)>) -> Whereabouts {
        let place = |(path, pattern, start): (Arc<dyn Path>, Pattern, f64)| {
            let word = Word { made: Time::ZERO, xi: start - pattern.at(Time::ZERO).h, rate: 0.0 };
            Place { path, pattern, since: Time::from_nanos(i64::MIN), newest: word, before: word }
        };
        Whereabouts(vehicles.map(place).collect())
    }

    /// At `t` a vehicle said that its coordination state was `xi` at `made`, with the pattern of then removed.
    pub fn said(&mut self, vehicle: usize, t: Time, made: Time, xi: f64) {
        let place = &mut self.0[vehicle];
        if t > place.since {
            place.before = place.newest;
            place.since = t;
        }
        place.newest = place.before.after(made, xi);
    }

    /// From a vehicle that speaks at `t` to one that listens \[m\], both as they are at `t`: the speaker by its newest word, the
    /// listener by its newest before `t`. Not a number if one of them is nowhere.
    pub fn distance(&self, speaker: usize, listener: usize, t: Time) -> f64 {
        let (speaker, listener) = (&self.0[speaker], &self.0[listener]);
        let heard = if listener.since < t { listener.newest } else { listener.before };
        (speaker.position(speaker.newest, t) - listener.position(heard, t)).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::line::Line;

    fn two() -> Whereabouts {
        let line = |y| -> Arc<dyn Path> { Arc::new(Line::new(Vector3::new(0.0, y, 0.0), 0.0, 1.0).expect("a line")) };
        Whereabouts::new([(line(0.0), Pattern::default(), 0.0), (line(3.0), Pattern::constant(10.0), 10.0)].into_iter())
    }

    #[test]
    fn the_pattern_is_added_back() {
        let mut places = two();
        let t = Time::from_secs(1.0);
        assert_eq!(places.distance(0, 1, t), 10f64.hypot(3.0), "from where they start");
        places.said(0, t, t, 6.0);
        assert_eq!(places.distance(0, 1, t), 5.0);
        places.said(1, t, t, 1.0);
        assert_eq!(
            places.distance(1, 0, t),
            11f64.hypot(3.0),
            "1 + 10 along the second line; the first said 6 at this instant"
        );
    }

    #[test]
    fn a_word_that_waits_is_sent_from_where_the_speaker_is_by_then() {
        let mut places = two();
        let second = Time::from_secs(1.0);
        places.said(0, second, second, 2.0);
        // 2 m/s since the start; the listener said nothing and is taken to stand.
        assert_eq!(places.distance(0, 1, Time::from_secs(3.0)), 4f64.hypot(3.0));
        // 1 m/s since the word before, and moved on from when it was made, not from when it was heard of.
        places.said(0, Time::from_secs(2.5), Time::from_secs(2.0), 3.0);
        assert_eq!(places.distance(0, 1, Time::from_secs(5.0)), 4f64.hypot(3.0));
        // The listener is where it has got to, too.
        places.said(1, Time::from_secs(4.0), Time::from_secs(4.0), 2.0);
        assert_eq!(places.distance(0, 1, Time::from_secs(6.0)), 6f64.hypot(3.0), "13 and 7");
    }

    #[test]
    fn words_of_the_same_instant_and_of_the_past_keep_the_rate() {
        let mut places = two();
        let at = Time::from_secs;
        places.said(0, at(1.0), at(1.0), 2.0);
        places.said(0, at(2.0), at(1.0), 3.0);
        assert_eq!(places.distance(0, 1, at(2.0)), 5f64.hypot(3.0), "3 and a second at 2 m/s");
    }

    #[test]
    fn the_order_of_words_of_one_instant_does_not_matter() {
        let (t, mut one, mut other) = (Time::from_secs(1.0), two(), two());
        one.said(0, t, t, 6.0);
        let before = one.distance(0, 1, t);
        one.said(1, t, t, 6.0);
        other.said(1, t, t, 6.0);
        other.said(0, t, t, 6.0);
        assert_eq!([one.distance(0, 1, t), other.distance(0, 1, t)], [before; 2]);
    }

    #[test]
    fn a_word_that_leads_nowhere_gives_no_finite_distance() {
        let mut places = two();
        places.said(0, Time::ZERO, Time::ZERO, f64::MAX);
        assert!(!places.distance(0, 1, Time::ZERO).is_finite());
    }
}
