//! Where the vehicles are, as far as their own words tell: p_i(ξ_i) of what they said last. No telemetry is on the air.

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
    newest: Vector3<f64>,
    before: Vector3<f64>,
}

impl Whereabouts {
    /// Every vehicle's path, its place in the pattern and the ξ at which its target starts.
    pub fn new(vehicles: impl Iterator<Item = (Arc<dyn Path>, Pattern, f64)>) -> Whereabouts {
        let place = |(path, pattern, start): (Arc<dyn Path>, Pattern, f64)| {
            let p = path.at(start).p;
            Place { path, pattern, since: Time::from_nanos(i64::MIN), newest: p, before: p }
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
        place.newest = place.path.at(xi + place.pattern.at(made).h).p;
    }

    /// From a vehicle that speaks at `t` to one that listens \[m\]: the speaker by its newest word, the listener by its
    /// newest before `t`. Not a number if one of them is nowhere.
    pub fn distance(&self, speaker: usize, listener: usize, t: Time) -> f64 {
        let listener = &self.0[listener];
        let there = if listener.since < t { listener.newest } else { listener.before };
        (self.0[speaker].newest - there).norm()
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
        places.said(1, t, t, 5.0);
        assert_eq!(places.distance(0, 1, Time::from_secs(1.1)), 9f64.hypot(3.0), "5 + 10 along the second line");
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
