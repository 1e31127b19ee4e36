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
mod clock;
mod coordination;
mod decay;
mod deliveries;
mod diff;
pub(crate) mod drawing;
mod export;
mod facts;
mod figures;
mod folder;
mod graph;
pub(crate) mod html;
mod legend;
mod links;
mod loss;
pub(crate) mod network;
mod punctuality;
mod report;
mod series;
mod signal;
pub(crate) mod statistics;
mod summary;
#[cfg(test)]
pub(crate) mod testing;
mod trace;
mod vehicle;
mod verdict;

pub use chart::{Chart, Curve};
pub use clock::{ClockSummary, DeadlineSummary, NoteSummary, OverrunSummary, summarise_clock};
pub use coordination::CoordinationSummary;
pub use deliveries::{DeliverySummary, LinkDeliveries};
pub use diff::{Comparison, Outcome, Side, compare, diff, origins_differ};
pub use export::{Exporter, export_csv};
pub use facts::{Facts, VehicleFacts, Way};
pub use figures::{Figure, figures};
pub use folder::{Account, Theory, write_run_folder};
pub use graph::{GraphFacts, SpanningFacts, SplitFacts, TakenFacts};
pub use links::{LinkSummary, MessageCounts, Spread};
pub use loss::Loss;
pub use network::{Connectivity, Network};
pub use punctuality::ClockVerdict;
pub use report::{BELOW, Report, TheoryRow, report};
pub use series::{Coordination, Track, tracks};
pub use statistics::{ExponentialFit, FIT_PART, fit_coordination, fit_exponential, settling_time};
pub use summary::{Absence, FleetSummary, MessageTotals, Summary, summarise};
pub use trace::network_section;
pub use vehicle::VehicleSummary;
