//! The numbers of a run that mission and seed determine: `summary.json`.

use std::collections::BTreeMap;

use bus::recording::Recording;
use common::record::{ClockRecord, Record};
use common::time::Time;
use common::wire::vehicle::SpeedCommand;
use network_emulator::hub::ASLEEP;
use serde::Serialize;

use super::Facts;
use super::coordination::CoordinationSummary;
use super::decay::Decay;
use super::links::{LinkSummary, MessageCounts, Said, links, said};
use super::loss::{Loss, losses};
use super::network::{Connectivity, Network};
use super::series::{Coordination, Track, is_early, speeds, tracks};
use super::statistics::{largest, mean};
use super::vehicle::VehicleSummary;

/// Everything that mission and seed determine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this layout.
    pub format: u32,
    /// Name of the mission.
    pub mission: String,
    /// Digest of the mission file.
    pub digest: String,
    /// The seed.
    pub seed: u64,
    /// Length of the mission \[s\].
    pub duration_s: f64,
    /// Whether nothing is missing: the recording reaches its end, all logs were collected, and every vehicle has states.
    pub complete: bool,
    /// The fleet as a whole.
    pub fleet: FleetSummary,
    /// Each vehicle, in the mission's order.
    pub vehicles: Vec<VehicleSummary>,
    /// Each directed link.
    pub links: Vec<LinkSummary>,
    /// What a reader should not overlook.
    pub warnings: Vec<String>,
    /// The report's verdict in sentences, for a terminal. It speaks of the clock too, so it is not in `summary.json`; it is empty until
    /// the report is made.
    #[serde(skip)]
    pub headline: Vec<String>,
}

/// The numbers of the fleet.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FleetSummary {
    /// Coordination errors.
    pub coordination: CoordinationSummary,
    /// Mean rate of the coordination states in the steady part of the run \[units of ξ per s\].
    pub steady_speed: f64,
    /// What theory predicts for it.
    pub predicted_speed: Option<f64>,
    /// The formation speed that was commanded last.
    pub formation_speed: Option<f64>,
    /// The formation speed in force at the end, which the prediction is about.
    pub formation_speed_at_the_end: Option<f64>,
    /// The formation speeds as recorded, planned and commanded, in order of time. They are in the recording, and not in `summary.json`.
    #[serde(skip)]
    pub speeds: Vec<SpeedCommand>,
    /// Largest path-following error of any vehicle at the end \[m\].
    pub path_error_final_m: f64,
    /// When the last vehicle was on its path to stay, within 0.1 m \[s\].
    pub on_path_s: Option<f64>,
    /// Messages on all links.
    pub messages: MessageTotals,
    /// Measured connectivity of the network.
    pub connectivity: Option<Connectivity>,
    /// When vehicles recorded nothing, in order of time.
    pub absences: Vec<Absence>,
    /// The connectivity before the first of these, if there is one.
    pub connectivity_before: Option<Connectivity>,
    /// Vehicles of which nothing is known up to the end, although they did not give up.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<Loss>,
    /// Which vehicles gave up, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub aborted: Vec<String>,
}

/// A time in which a vehicle recorded nothing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absence {
    /// The vehicle.
    pub vehicle: String,
    /// Its last row before; its last word, if there is no log of it \[s\].
    pub from_s: f64,
    /// Its next row, or the end \[s\].
    pub to_s: f64,
}

/// Sums over all links.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MessageTotals {
    /// What became of them.
    #[serde(flatten)]
    pub counts: MessageCounts,
    /// Transmissions: a message to several receivers goes on the air once; one that found no place in its sender's queue never.
    pub transmissions: u64,
    /// Size of one message on the air, as the medium packs it; of the largest, where they differ \[bytes\].
    pub message_bytes: u64,
    /// Transmissions, each times its size.
    pub bytes_on_air: u64,
    /// Whether the ledger of every link is balanced.
    pub balanced: bool,
}

/// The numbers of a run that mission and seed determine.
pub fn summarise(recording: &Recording, facts: &Facts) -> Summary {
    let exact = &recording.exact;
    let tracks = tracks(exact, facts);
    let coordination = Coordination::of(&tracks, facts);
    let network = Network::of(exact, facts);
    let links = links(exact, facts, &network);
    let said = said(exact);
    let vehicles: Vec<VehicleSummary> =
        tracks.iter().map(|track| VehicleSummary::of(track, &tracks, facts, &said)).collect();
    let absences = absences(&tracks, &vehicles, facts);
    let first_absence = absences.first().map(|absence| absence.from_s);
    let present = || vehicles.iter().filter(|vehicle| vehicle.rows > 0);
    let fleet = FleetSummary {
        steady_speed: mean(present().map(|vehicle| vehicle.steady_speed)),
        predicted_speed: facts.predicted_speed,
        formation_speed: speeds(exact).last().map(|row| row.speed),
        formation_speed_at_the_end: facts.formation_speed_at_the_end,
        speeds: speeds(exact)
            .iter()
            .map(|row| SpeedCommand { at: Time::from_nanos(row.t_ns), speed: row.speed })
            .collect(),
        path_error_final_m: largest(present().map(|vehicle| vehicle.path_error_final_m)),
        on_path_s: present()
            .map(|vehicle| vehicle.on_path_s)
            .collect::<Option<Vec<f64>>>()
            .map(largest)
            .filter(|at| at.is_finite()),
        messages: totals(&links, &said, facts),
        connectivity: network.connectivity_heard(exact, facts),
        connectivity_before: first_absence.and_then(|at| network.until(at).connectivity_heard(exact, facts)),
        absences,
        lost: losses(&vehicles, facts),
        aborted: facts.aborted.clone(),
        coordination: CoordinationSummary::of(&coordination, facts, Decay::of(&coordination, exact, facts).fit),
    };
    let complete = recording.complete && facts.missing.is_empty() && vehicles.iter().all(|vehicle| vehicle.rows > 0);
    let mut known = facts.aborted.clone();
    known.extend_from_slice(&facts.missing);
    let end_s = largest(vehicles.iter().filter_map(|vehicle| vehicle.last_s));
    known.extend(warnings(recording, &vehicles, &links, end_s));
    Summary {
        format: 1,
        mission: facts.mission.clone(),
        digest: recording.digest.clone(),
        seed: recording.seed,
        duration_s: facts.duration_s,
        complete,
        fleet,
        vehicles,
        links,
        warnings: known,
        headline: Vec::new(),
    }
}

/// A vehicle that records nothing for this many control periods, or for two and a half times as long as usual, is not there.
const SILENT_PERIODS: f64 = 10.5;

/// The times in which vehicles recorded nothing. Of one without a log it is known when it was last heard, if it ever was.
fn absences(tracks: &[Track<'_>], vehicles: &[VehicleSummary], facts: &Facts) -> Vec<Absence> {
    let mut absences = Vec::new();
    for (track, vehicle) in tracks.iter().zip(vehicles) {
        if track.rows.is_empty() {
            let last_s = vehicle.last_heard_s.filter(|last_s| is_early(*last_s, facts.duration_s));
            let silent = |from_s| Absence { vehicle: track.id.to_owned(), from_s, to_s: facts.duration_s };
            absences.extend(last_s.map(silent));
            continue;
        }
        let times: Vec<f64> = track.rows.iter().map(|row| row.t_ns as f64 / 1e9).collect();
        let mut usual: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        usual.sort_by(f64::total_cmp);
        let usual = usual.get(usual.len() / 2).copied().unwrap_or(0.0);
        let longest = (2.5 * usual).max(SILENT_PERIODS * facts.control_period_s);
        let known = [0.0].into_iter().chain(times).chain([facts.duration_s]).collect::<Vec<f64>>();
        let gaps = known.windows(2).filter(|pair| pair[1] - pair[0] > longest);
        absences.extend(gaps.map(|pair| Absence { vehicle: track.id.to_owned(), from_s: pair[0], to_s: pair[1] }));
    }
    absences.sort_by(|a, b| a.from_s.total_cmp(&b.from_s).then_with(|| a.vehicle.cmp(&b.vehicle)));
    absences
}

fn totals(links: &[LinkSummary], said: &BTreeMap<&str, Said>, facts: &Facts) -> MessageTotals {
    MessageTotals {
        counts: MessageCounts::over(links),
        transmissions: said.values().map(|said| said.transmissions).sum(),
        message_bytes: facts.message_bytes,
        bytes_on_air: said.iter().map(|(id, said)| said.transmissions * facts.bytes_of(id)).sum(),
        balanced: links.iter().all(|link| link.balanced),
    }
}

fn warnings(recording: &Recording, vehicles: &[VehicleSummary], links: &[LinkSummary], end_s: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    if !recording.complete {
        let how = recording.damage.as_ref().map_or(String::new(), |damage| format!(" ({damage})"));
        warnings.push(format!("The recording ends before its end{how}: what follows is about the part that was kept."));
    }
    for vehicle in vehicles.iter().filter(|vehicle| vehicle.rows == 0) {
        warnings.push(format!("{} has no rows: it is not part of the fleet's numbers.", vehicle.id));
    }
    for (vehicle, at) in vehicles.iter().filter_map(|vehicle| Some((vehicle, vehicle.early(end_s)?))) {
        warnings
            .push(format!("{} recorded nothing after {at} s: its numbers at the end are of that instant.", vehicle.id));
    }
    for link in links.iter().filter(|link| !link.balanced) {
        warnings.push(format!(
            "The ledger of {} → {} is not balanced: {} messages without a fate, {} with more than one.",
            link.from, link.to, link.missing, link.repeated
        ));
    }
    let told = recording.exact.iter().filter_map(|record| match record {
        Record::Warning(row) => Some(row),
        _ => None,
    });
    let mut told: Vec<_> = told.collect();
    told.sort_by_key(|row| (row.t_ns, &row.source, &row.text));
    for row in told {
        let periods = if row.count == 1 { "period" } else { "periods" };
        warnings.push(format!("{}: {}, in {} control {periods}.", row.source, row.text, row.count));
    }
    // What the network was not: the numbers are of a fleet that nobody meant.
    let asleep = recording.clock.iter().filter_map(|record| match record {
        ClockRecord::Note(row) if row.text.starts_with(ASLEEP) || row.text.starts_with("clock of ") => {
            Some(format!("{}.", row.text))
        }
        _ => None,
    });
    warnings.extend(asleep);
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::testing::{facts, fleet};
    use common::record::{NoteRow, StateRow};

    #[test]
    fn the_fleet_is_summarised() {
        let summary = summarise(&fleet(true), &facts(true));
        let coordination = &summary.fleet.coordination;
        assert!((coordination.initial - 21.6).abs() < 0.01, "{}", coordination.initial);
        assert!((coordination.fit.expect("decays").rate - 0.025).abs() < 0.002, "{:?}", coordination.fit);
        assert_eq!(coordination.at_least_guaranteed, Some(true));
        // 2 % of the start is reached after ln 50 / 0.025 s.
        let settled = coordination.settled_s.expect("settles");
        assert!((settled - 156.5).abs() < 11.0, "{settled}");
        assert!((summary.fleet.steady_speed - 0.5).abs() < 1e-3);
        assert_eq!(summary.fleet.formation_speed, Some(0.5));
        assert_eq!(coordination.series.t_s.len(), 600);
        assert_eq!(coordination.series.t_s.last(), Some(&400.0));
    }

    #[test]
    fn vehicles_and_links_are_summarised() {
        let summary = summarise(&fleet(true), &facts(true));
        let vehicle = &summary.vehicles[2];
        assert_eq!((vehicle.id.as_str(), vehicle.rows), ("v3", 4001));
        assert!((vehicle.path_error_largest_m - 9.01).abs() < 1e-9);
        // 9·exp(−0.06 t) + 0.01 = 0.1
        assert!((vehicle.on_path_s.expect("settles") - 100.0_f64.ln() / 0.06).abs() < 0.1);
        assert!((vehicle.path_error_rms_m - 0.01).abs() < 1e-6);
        assert!((vehicle.alone_fraction - 0.75).abs() < 1e-3);
        let totals = &summary.fleet.messages;
        assert!(totals.balanced && summary.warnings.is_empty(), "{:?}", summary.warnings);
        assert_eq!(totals.counts.sent, 4 * 801);
        // v2 speaks to both neighbours at once.
        assert_eq!(totals.transmissions, 3 * 801);
        assert_eq!(totals.bytes_on_air, 801 * (40 + 40 + 44));
        assert_eq!((vehicle.messages_said, vehicle.bytes_on_air), (801, 801 * 44));
        assert!((summary.links[0].up_fraction - 0.25).abs() < 1e-9);
        assert!((summary.fleet.connectivity.expect("three vehicles").alpha - 0.75).abs() < 1e-9);
    }

    #[test]
    fn warnings_of_the_vehicles_reach_the_summary() {
        let mut recording = fleet(false);
        let row = |count| NoteRow { t_ns: 9, source: "v2".into(), text: "an actuator was at its limit".into(), count };
        recording.exact.extend([Record::Warning(row(1)), Record::Warning(row(40))]);
        let warnings = summarise(&recording, &facts(false)).warnings;
        let expected =
            ["1 control period.", "40 control periods."].map(|n| format!("v2: an actuator was at its limit, in {n}"));
        assert_eq!(warnings, expected);
    }

    #[test]
    fn a_network_that_was_not_there_and_a_clock_that_is_off_are_warned_of() {
        let mut recording = fleet(false);
        let text = format!("{ASLEEP} from 5.000 s to 38.000 s; every link was down meanwhile");
        let row = NoteRow { t_ns: 9, source: "network-emulator".into(), text: text.clone(), count: 1 };
        recording.clock.push(ClockRecord::Note(row));
        let off = "clock of v2 seems 3.0 s ahead of the network-emulator's".to_string();
        let row = NoteRow { t_ns: 0, source: "v2".into(), text: off.clone(), count: 1 };
        recording.clock.push(ClockRecord::Note(row));
        assert_eq!(summarise(&recording, &facts(false)).warnings, [text + ".", off + "."]);
    }

    #[test]
    fn who_gave_up_and_what_is_missing_is_told() {
        let whole = summarise(&fleet(false), &facts(false));
        assert!(whole.complete && whole.warnings.is_empty(), "{:?}", whole.warnings);
        let gave_up = Facts { aborted: vec!["v2 aborted".into()], ..facts(false) };
        let summary = summarise(&fleet(false), &gave_up);
        assert!(summary.complete && summary.warnings == gave_up.aborted, "{:?}", summary.warnings);
        let lacking = Facts { missing: vec!["log of v2: lost".into()], ..facts(false) };
        let summary = summarise(&fleet(false), &lacking);
        assert!(!summary.complete && summary.warnings == lacking.missing, "{:?}", summary.warnings);
        let mut without = fleet(false);
        without.exact.retain(|record| !matches!(record, Record::State(row) if *row.vehicle == *"v2"));
        assert!(!summarise(&without, &facts(false)).complete);
    }

    #[test]
    fn the_order_of_rows_does_not_matter() {
        let mut shuffled = fleet(false);
        shuffled.exact.reverse();
        assert_eq!(summarise(&shuffled, &facts(false)), summarise(&fleet(false), &facts(false)));
    }

    #[test]
    fn an_empty_or_cut_recording_is_summarised_with_a_warning() {
        let summary = summarise(&Recording::default(), &facts(true));
        assert_eq!(summary.warnings.len(), 4, "{:?}", summary.warnings);
        assert!(serde_json::to_string(&summary).expect("serialises").contains("\"steady_speed\":null"));
        let mut lacking = fleet(true);
        lacking.exact.retain(|record| !matches!(record, Record::Message(row) if row.seq == 7 && *row.to == *"v2"));
        let summary = summarise(&lacking, &facts(true));
        assert!(!summary.fleet.messages.balanced);
        assert_eq!(summary.warnings.len(), 2, "{:?}", summary.warnings);
    }

    #[test]
    fn no_number_is_made_of_no_rows() {
        let mut recording = fleet(true);
        let is_gone = |record: &Record| match record {
            Record::State(row) => *row.vehicle == *"v3",
            Record::Message(row) => *row.from == *"v3" && row.sent_ns > 200_000_000_000,
            _ => false,
        };
        recording.exact.retain(|record| !is_gone(record));
        let summary = summarise(&recording, &facts(true));
        let json = serde_json::to_value(&summary).expect("serialises");
        let counted = ["id", "path", "pattern_offset", "rows", "last_heard_s", "predicted_along_bias_m"];
        for (name, value) in json["vehicles"][2].as_object().expect("numbers") {
            let is_known = counted.contains(&name.as_str()) || name == "messages_said" || name == "bytes_on_air";
            assert_eq!(value.is_null(), !is_known, "{name}: {value}");
        }
        assert_eq!(summary.vehicles[2].last_heard_s, Some(200.0));
        // What is known of when it fell silent, in place of the whole flight.
        let silent = Absence { vehicle: "v3".into(), from_s: 200.0, to_s: 400.0 };
        assert_eq!(summary.fleet.absences, [silent]);
        let lost = Loss { vehicle: "v3".into(), recorded_until_s: None, heard_until_s: Some(200.0) };
        assert_eq!(summary.fleet.lost, [lost]);
        assert!((summary.fleet.steady_speed - 0.5).abs() < 1e-3, "of the others");
        // Of a vehicle that was never heard either, nobody knows since when.
        recording.exact.retain(|record| !matches!(record, Record::Message(row) if *row.from == *"v3"));
        assert_eq!(summarise(&recording, &facts(true)).fleet.absences, []);
    }

    #[test]
    fn who_hears_of_a_stop_before_the_others_is_not_lost() {
        let until = |last_s: i64, planned_s: f64| {
            let mut recording = fleet(true);
            let late = |record: &Record| match record {
                Record::State(row) => *row.vehicle == *"v2" && row.t_ns > last_s * 1_000_000_000,
                Record::Message(row) => *row.from == *"v2" && row.sent_ns > last_s * 1_000_000_000,
                _ => false,
            };
            recording.exact.retain(|record| !late(record));
            summarise(&recording, &Facts { planned_s, ..facts(true) }).fleet.lost.len()
        };
        assert_eq!((until(390, 800.0), until(390, 400.0)), (0, 1));
        assert_eq!(until(300, 800.0), 1);
    }

    #[test]
    fn a_vehicle_that_falls_silent_is_absent() {
        let mut recording = fleet(true);
        assert_eq!(summarise(&recording, &facts(true)).fleet.absences, []);
        let silent = |row: &StateRow| &*row.vehicle == "v3" && (57_000_000_000..90_000_000_000).contains(&row.t_ns);
        let late = |row: &StateRow| &*row.vehicle == "v2" && row.t_ns > 300_000_000_000;
        recording.exact.retain(|record| !matches!(record, Record::State(row) if silent(row) || late(row)));
        let fleet = summarise(&recording, &facts(true)).fleet;
        let absence = |vehicle: &str, from_s, to_s| Absence { vehicle: vehicle.into(), from_s, to_s };
        assert_eq!(fleet.absences, [absence("v3", 56.9, 90.0), absence("v2", 300.0, 400.0)]);
        assert_eq!(fleet.connectivity_before.map(|before| before.length_s), Some(56.9));
    }
}
