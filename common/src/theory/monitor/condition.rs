//! The conditions of statements: numbers with limits, and premises that are not about numbers.

use serde::Serialize;

use super::{AGE, AGE_BY_RATE, UNHEARD};

/// How far a quantity is from the limit that a statement sets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margin {
    /// The statement.
    pub statement: &'static str,
    /// What is limited.
    pub quantity: &'static str,
    /// Its value, in the unit that the quantity names; a number if it names none.
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

    /// Value and limit for who flies the fleet.
    pub fn in_words(&self) -> String {
        let Margin { statement, quantity, value, limit } = self;
        let percent = |part: &f64| 100.0 * part;
        match *quantity {
            AGE => format!(
                "news of a neighbour is at most {value:.3} s old when it is used; less than {limit:.3} s will do"
            ),
            AGE_BY_RATE => {
                format!(
                    "while news is that old, vehicles go at most {value:.3} of the way they have to; less than {limit:.3} will do"
                )
            }
            UNHEARD => format!(
                "{:.1} % of the time in which a link is up goes by unheard; less than {:.1} % will do",
                percent(value),
                percent(limit)
            ),
            _ if value.is_finite() => format!("{statement}: {quantity} is {value:.4}; less than {limit:.4} will do"),
            _ => format!("{statement}: {quantity} is unbounded; less than {limit:.4} will do"),
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_told_to_who_flies() {
        let words = |quantity, value, limit| Margin { statement: "Theorem 4.4", quantity, value, limit }.in_words();
        assert_eq!(
            words(AGE, 0.4, 0.625),
            "news of a neighbour is at most 0.400 s old when it is used; less than 0.625 s will do"
        );
        assert!(words(UNHEARD, 0.02, 0.25).starts_with("2.0 % of the time in which a link is up goes by unheard"));
        assert_eq!(words("α", 0.75, 1.0), "Theorem 4.4: α is 0.7500; less than 1.0000 will do");
        assert!(words("T [s]", f64::INFINITY, 9.0).contains("is unbounded"));
    }
}
