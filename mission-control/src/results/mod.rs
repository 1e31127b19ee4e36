//! Everything that happens to the rows of a run.
//!
//! | part | what it gives |
//! |---|---|
//! | [`summarise`], [`summarise_clock`] | `summary.json` (a function of mission and seed), `clock.json` (of the machine) |
//! | [`figures()`] | SVG figures in the arrangement of the thesis |
//! | [`Chart`] | a figure of given curves |
//! | [`report()`] | `report.html`, one self-contained file |
//! | [`write_run_folder`] | all of these into a run folder, each file whole or not at all |
//! | [`export_csv`] | `vehicles.csv`, `links.csv`, `topology.csv` |
//! | [`diff()`], [`compare()`] | *equal*, or the first row in which two runs part |

mod chart;
mod decay;
mod deliveries;
mod diff;
pub(crate) mod drawing;
mod export;
mod facts;
mod figures;
mod folder;
mod graph;
mod legend;
pub(crate) mod network;
mod punctuality;
pub(crate) mod report;
mod series;
pub(crate) mod statistics;
mod summary;
#[cfg(test)]
pub(crate) mod testing;
mod trace;

pub use chart::{Chart, Curve};
pub use deliveries::{DeliverySummary, LinkDeliveries};
pub use diff::{Comparison, Outcome, Side, compare, diff, origins_differ};
pub use export::{Exporter, export_csv};
pub use facts::{Facts, VehicleFacts, Way};
pub use figures::{Figure, figures};
pub use folder::{Account, Theory, write_run_folder};
pub use graph::{GraphFacts, SpanningFacts, SplitFacts, TakenFacts};
pub use network::{Connectivity, LinkSummary, Network, Spread};
pub use punctuality::ClockVerdict;
pub use report::{BELOW, Report, TheoryRow, report};
pub use series::{Coordination, Track, tracks};
pub use statistics::{ExponentialFit, FIT_PART, fit_coordination, fit_exponential, settling_time};
pub use summary::{
    Absence, ClockSummary, CoordinationSummary, DeadlineSummary, FleetSummary, MessageTotals, NoteSummary,
    OverrunSummary, Summary, VehicleSummary, summarise, summarise_clock,
};
pub use trace::network_section;
