//! The conditions of statements: numbers with limits, and premises that are not about numbers.

use serde::Serialize;

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
