//! stub
use super::{ClockSummary, Facts, Figure, Summary};
/// A row.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct TheoryRow {
    /// a
    pub name: String,
}
/// r
pub struct Report<'a> {
    /// f
    pub facts: &'a Facts,
    /// s
    pub summary: &'a Summary,
    /// c
    pub clock: &'a ClockSummary,
    /// f
    pub figures: &'a [Figure],
}
/// x
pub fn report(_report: &Report<'_>) -> String {
    String::new()
}
