//! What came of holding a fleet's errors against what is promised.

use super::{Envelope, Margin, Premise};

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

impl Judgement {
    /// Of a stretch and of one after it: a defect in either is one.
    pub fn with(self, later: Judgement) -> Judgement {
        match (self, later) {
            (
                Judgement::Covered { statement, closest: Some(before) },
                Judgement::Covered { closest: Some(after), .. },
            ) => Judgement::Covered { statement, closest: Some(before.max(after)) },
            (earlier @ Judgement::Covered { closest: Some(_), .. }, Judgement::Covered { closest: None, .. }) => {
                earlier
            }
            (Judgement::Covered { .. }, later) => later,
            (earlier, _) => earlier,
        }
    }
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
