//! A flight in stretches between changes of v_L.
//!
//! v_L drops out of the errors as long as all have the same one. When it changes, what is still believed of a neighbour from before the
//! change goes on at a v_L that was not its: by |Δv_L| times the age of the news, until h after the change nothing from before
//! it is used any more. The theorems do not speak of that time. Afterwards they do, and as (4.11) and Definition 4.4
//! are about every window of time, so do their envelopes, from the error that is there then.

/// The errors of one stretch, as (t \[s\], ‖e‖).
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// When v_L changed to what holds in it \[s\]; `None` before the first change.
    pub since: Option<f64>,
    /// The errors. After a change the first is the largest since, at the first instant at which no news from before it are in use: what a
    /// fleet that hears late goes on from is not its present error alone.
    pub errors: Vec<(f64, f64)>,
}

impl Stretch {
    /// Whether there is something to hold against an envelope: of one error alone nothing is promised.
    pub fn can_be_judged(&self) -> bool {
        self.since.is_none() || self.errors.len() > 1
    }
}

/// The stretches of a flight with these errors, in which v_L changed at these instants \[s\], in order; news from before a change are
/// used for up to `late` after it \[s\].
pub fn stretches(errors: &[(f64, f64)], changes: &[f64], late: f64) -> Vec<Stretch> {
    let within = |from: f64, to: f64| errors.iter().copied().filter(move |(t, _)| *t > from && *t <= to);
    let until = |number: usize| changes.get(number).copied().unwrap_or(f64::INFINITY);
    let before = Stretch { since: None, errors: within(f64::NEG_INFINITY, until(0)).collect() };
    let after = changes.iter().enumerate().map(|(number, &since)| {
        let mut errors: Vec<(f64, f64)> = within(since, until(number + 1)).collect();
        let settled = errors.partition_point(|(t, _)| *t < since + late - GRAIN);
        let largest = errors.iter().take(settled + 1).map(|(_, error)| *error).fold(0.0, larger);
        errors.drain(..settled);
        if let Some(first) = errors.first_mut() {
            first.1 = largest;
        }
        Stretch { since: Some(since), errors }
    });
    std::iter::once(before).chain(after).collect()
}

/// Instants are compared up to this \[s\].
const GRAIN: f64 = 1e-9;

/// What is not a number is larger than all numbers.
fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_ends_a_stretch_and_begins_one_when_older_news_are_out_of_use() {
        let errors: Vec<(f64, f64)> = (0..=20).map(|i| (f64::from(i) * 0.5, f64::from(20 - i))).collect();
        let found = stretches(&errors, &[2.0, 5.2], 0.5);
        assert_eq!(found.iter().map(|stretch| stretch.since).collect::<Vec<_>>(), [None, Some(2.0), Some(5.2)]);
        let ends = |stretch: &Stretch| (stretch.errors[0], stretch.errors[stretch.errors.len() - 1]);
        assert_eq!(ends(&found[0]), ((0.0, 20.0), (2.0, 16.0)), "what is seen at the change was before it");
        assert_eq!(ends(&found[1]), ((2.5, 15.0), (5.0, 10.0)));
        // 5.5 s is too early, and its error is the largest since the change.
        assert_eq!(ends(&found[2]), ((6.0, 9.0), (10.0, 0.0)));
        assert_eq!(stretches(&errors, &[], 0.5), [Stretch { since: None, errors }]);
    }

    #[test]
    fn a_stretch_that_is_too_short_cannot_be_judged() {
        let errors: Vec<(f64, f64)> = (0..=10).map(|i| (f64::from(i), 1.0)).collect();
        let found = stretches(&errors, &[0.0, 4.0, 5.5, 9.0], 1.0);
        let judged: Vec<bool> = found.iter().map(Stretch::can_be_judged).collect();
        assert_eq!(judged, [true, true, false, true, false]);
        assert!(found[2].errors == [(5.0, 1.0)] && found[4].errors == [(10.0, 1.0)]);
        assert!(!stretches(&[(0.0, 1.0)], &[3.0], 1.0)[1].can_be_judged());
    }

    #[test]
    fn what_is_not_a_number_stays_so() {
        let first = |errors: [f64; 2]| stretches(&[(1.5, errors[0]), (2.0, errors[1])], &[1.0], 1.0)[1].errors[0].1;
        assert!(first([f64::NAN, 1.0]).is_nan() && first([1.0, f64::NAN]).is_nan() && first([3.0, 1.0]) == 3.0);
    }
}
