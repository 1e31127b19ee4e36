//! The gallery file as written: which figures, made by which missions, and the numbers expected of them.

use schemars::JsonSchema;
use serde::Deserialize;

/// A gallery: a page of figures.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct GalleryFile {
    /// Title of the page.
    pub title: String,
    /// What the page shows, in a sentence or two.
    #[serde(default)]
    pub about: String,
    /// The figures, in order.
    pub figures: Vec<FigureSection>,
}

/// One figure.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct FigureSection {
    /// Name of the picture's file: lower-case letters, digits and dashes.
    pub id: String,
    /// What it shows, in a line.
    pub title: String,
    /// Where it comes from: a figure, an equation.
    pub source: String,
    /// What the source says of it.
    pub says: String,
    /// What was chosen where the source is silent, errata.
    #[serde(default)]
    pub note: String,
    /// Names of the missions that make it.
    pub missions: Vec<String>,
    /// What the missions are called in legends, if there are several.
    #[serde(default)]
    pub labels: Vec<String>,
    /// Panels side by side.
    #[serde(default = "two")]
    pub columns: u32,
    /// The panels, row by row.
    pub panels: Vec<PanelSection>,
    /// The numbers expected.
    #[serde(default)]
    pub expect: Vec<Expectation>,
}

/// One panel: either a plane of space or a quantity over time.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default)]
pub struct PanelSection {
    /// Its title; numbered (a), (b), ... by itself.
    pub title: String,
    /// Trajectories seen in this plane.
    pub plane: Option<Plane>,
    /// A quantity over time.
    pub over_time: Option<Quantity>,
    /// Missions drawn; all of the figure if absent.
    pub missions: Option<Vec<String>>,
    /// Vehicles drawn; all if absent.
    pub vehicles: Option<Vec<String>>,
    /// Begin of the time shown (s).
    pub from_s: Option<f64>,
    /// End of the time shown (s).
    pub to_s: Option<f64>,
    /// Lower end of the vertical axis.
    pub low: Option<f64>,
    /// Upper end of the vertical axis.
    pub high: Option<f64>,
    /// A logarithmic vertical axis; magnitudes are drawn.
    pub log: bool,
    /// What values are multiplied with, for another unit; then `label` is needed too.
    pub scale: Option<f64>,
    /// What coordination states are called here, such as s̄, in place of ξ or γ.
    pub symbol: Option<String>,
    /// Label of the vertical axis in place of the quantity's own.
    pub label: Option<String>,
    /// Expected values, drawn as dotted lines.
    pub levels: Vec<f64>,
    /// Whether the time in which every link was down is shaded.
    pub outages: bool,
    /// Instants at which the vehicles and their formation are drawn in a plane (s).
    pub vehicles_at_s: Vec<f64>,
}

/// A plane of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Plane {
    /// From above: x and y.
    Xy,
    /// From the side: x and z.
    Xz,
    /// From above and aside: all of space.
    Space,
}

/// A quantity that a flight has over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Coordination state of each vehicle.
    Xi,
    /// Its rate.
    XiRate,
    /// The rate the coordination law asks for.
    ReferenceRate,
    /// Coordination state of the first vehicle less that of each other.
    XiDifference,
    /// The same with the pattern removed.
    CoordinationError,
    /// Way along its path of the first vehicle since the start, less that of each other.
    LengthDifference,
    /// Greatest difference between any two vehicles, with the pattern removed.
    Disagreement,
    /// Forward speed.
    Speed,
    /// Position, first coordinate.
    X,
    /// Position, second coordinate.
    Y,
    /// Position, third coordinate.
    Z,
    /// Heading.
    Yaw,
    /// Rate of the heading, from the recorded headings.
    YawRate,
    /// Pitch.
    Pitch,
    /// Roll.
    Roll,
    /// Path-following error along the path.
    AlongError,
    /// Path-following error across the path.
    CrossError,
    /// Norm of the path-following error.
    PathError,
    /// Heading relative to the path.
    HeadingError,
    /// Number of neighbours heard.
    Neighbours,
}

/// A number that is expected of a flight: a number of its summary, or of a quantity over time.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Expectation {
    /// What it is, in words.
    pub what: String,
    /// Where it is from: an equation, a theorem, an erratum.
    pub source: String,
    /// Whose flight; needed if the figure has several missions.
    pub mission: Option<String>,
    /// A number of summary.json by its path, such as fleet.steady_speed, or vehicle.along_mean_m for every vehicle.
    pub number: Option<String>,
    /// A quantity over time.
    pub series: Option<Quantity>,
    /// What is taken of the quantity.
    pub take: Option<Take>,
    /// Vehicles of which it is expected; all if absent.
    pub vehicles: Option<Vec<String>>,
    /// The instant (s).
    pub at_s: Option<f64>,
    /// Begin of the time looked at (s).
    pub from_s: Option<f64>,
    /// End of the time looked at (s).
    pub to_s: Option<f64>,
    /// The value expected.
    pub value: Option<f64>,
    /// How far from it the measured one may be.
    pub within: Option<f64>,
    /// The greatest value expected.
    pub at_most: Option<f64>,
    /// The least value expected.
    pub at_least: Option<f64>,
    /// Its unit, for the page.
    pub unit: String,
}

/// What is taken of a quantity between two instants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Take {
    /// The last value.
    Last,
    /// The mean.
    Mean,
    /// The root mean square.
    Rms,
    /// The least value.
    Least,
    /// The greatest value.
    Greatest,
    /// The greatest magnitude.
    Magnitude,
    /// The greatest less the least value.
    Swing,
    /// The rate of exponential decay from the first to the last value.
    Rate,
}

fn two() -> u32 {
    2
}
