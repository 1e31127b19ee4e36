//! The numbers of a run: `summary.json`, a function of mission and seed, and `clock.json`, of the machine too.

use std::collections::BTreeMap;

use bus::recording::Recording;
use common::record::{ClockRecord, Overrun, Record, StateRow};
use common::time::Time;
use serde::Serialize;

use super::Facts;
use super::decay::Decay;
use super::deliveries::{DeliverySummary, LinkDeliveries, deliveries};
use super::network::{Connectivity, LinkSummary, Network, links, transmissions};
use super::punctuality::{ClockVerdict, verdict};
use super::series::{Coordination, Track, speeds, tracks};
use super::statistics::{ExponentialFit, FIT_PART, largest, mean, rms, settling_time, steady_from};

/// A fleet counts as coordinated when its largest difference stays below this \[units of ξ\].
pub(super) const COORDINATION_THRESHOLD: f64 = 1e-2;
/// A vehicle counts as on its path when its path-following error stays below this \[m\].
pub(super) const PATH_THRESHOLD_M: f64 = 0.1;
/// Settling, without an absolute threshold, means to stay below this part of the largest value.
pub(super) const SETTLED_PART: f64 = 0.02;
/// Time series in the summary have at most about this many samples.
const SERIES_SAMPLES: usize = 600;

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
    /// Which vehicles gave up, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub aborted: Vec<String>,
}

/// A time in which a vehicle recorded nothing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absence {
    /// The vehicle.
    pub vehicle: String,
    /// Its last row before \[s\].
    pub from_s: f64,
    /// Its next row, or the end \[s\].
    pub to_s: f64,
}

/// How the fleet agreed. x_i = ξ_i − h_i, the coordination state with the pattern removed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoordinationSummary {
    /// Unit of all values.
    pub unit: String,
    /// max |x_i − x_j| at the first common instant.
    pub initial: f64,
    /// Its largest value.
    pub largest: f64,
    /// Its value at the end, or when the whole fleet was last recorded.
    pub last: f64,
    /// That instant \[s\]; `None` if the fleet never was.
    pub last_s: Option<f64>,
    /// Its root mean square in the steady part.
    pub steady_rms: f64,
    /// From when on it stayed below 2 % of its largest value \[s\].
    pub settled_s: Option<f64>,
    /// From when on it stayed below 0.01 \[s\].
    pub settled_absolute_s: Option<f64>,
    /// The exponential fitted to ‖(I − 11ᵀ/n)x‖.
    pub fit: Option<ExponentialFit>,
    /// The rate that theory guarantees for that norm \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// Whether the fitted rate is at least the guaranteed one, to two parts in a hundred and as far as a law that is held for a control
    /// period reaches it; `None` if one of them is not known, or
    /// vehicles were not on their paths while the error decayed.
    pub at_least_guaranteed: Option<bool>,
    /// The error over time.
    pub series: CoordinationSeries,
}

impl CoordinationSummary {
    /// The instant of the last value, if that is not the end of the run: a vehicle was away from then on.
    pub fn early(&self, duration_s: f64) -> Option<f64> {
        self.last_s.filter(|last_s| is_early(*last_s, duration_s))
    }
}

/// Whether an instant is before the end by more than a row or two.
fn is_early(t_s: f64, duration_s: f64) -> bool {
    duration_s - t_s > (0.01 * duration_s).max(1.0)
}

impl VehicleSummary {
    /// The instant of the last row, if that is not the end of the run.
    pub fn early(&self, duration_s: f64) -> Option<f64> {
        self.last_s.filter(|last_s| is_early(*last_s, duration_s))
    }
}

/// The coordination error over time, thinned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoordinationSeries {
    /// Instants \[s\].
    pub t_s: Vec<f64>,
    /// max |x_i − x_j|.
    pub largest: Vec<f64>,
    /// ‖(I − 11ᵀ/n)x‖.
    pub norm: Vec<f64>,
}

/// Sums over all links.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MessageTotals {
    /// Messages times the links that they were sent on.
    pub sent: u64,
    /// Delivered.
    pub delivered: u64,
    /// Dropped, by cause.
    pub lost: u64,
    /// Dropped because the link was down.
    pub link_down: u64,
    /// Dropped because a queue was full.
    pub queue_full: u64,
    /// Dropped because the receiver was too far away.
    pub out_of_range: u64,
    /// Dropped because the receiver was speaking itself.
    pub half_duplex: u64,
    /// Dropped because another message arrived at the same time.
    pub collision: u64,
    /// Handed over with a flipped bit, and dropped by the receiver.
    pub corrupt: u64,
    /// Dropped because there was no process of the receiver.
    pub receiver_absent: u64,
    /// Under way at the end.
    pub in_flight: u64,
    /// Second copies handed to the receiver; they do not count as sent.
    pub copied: u64,
    /// Second copies that did not get there.
    pub copy_dropped: u64,
    /// Second copies under way when the mission ended.
    pub copy_in_flight: u64,
    /// Transmissions: a message to several receivers goes on the air once; one that found no place in its sender's queue never.
    pub transmissions: u64,
    /// Size of one message on the air, as the medium packs it; of the largest, where they differ \[bytes\].
    pub message_bytes: u64,
    /// Transmissions, each times its size.
    pub bytes_on_air: u64,
    /// Whether the ledger of every link is balanced.
    pub balanced: bool,
}

/// The numbers of one vehicle. "Steady" is the last fifth of its rows, in whole periods of the network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VehicleSummary {
    /// Its name.
    pub id: String,
    /// Its path.
    pub path: String,
    /// Its place in the pattern; its mean, if it moves.
    pub pattern_offset: f64,
    /// Rows of its state.
    pub rows: u64,
    /// Instant of the last of them \[s\].
    pub last_s: Option<f64>,
    /// x_i − x_1 at the end.
    pub coordination_final: f64,
    /// Mean rate of ξ in the steady part \[units of ξ per s\].
    pub steady_speed: f64,
    /// Mean forward speed in the steady part \[m/s\].
    pub steady_speed_mps: f64,
    /// Root mean square of ξ's rate minus its reference, v_r, in the steady part.
    pub speed_error_rms: f64,
    /// Largest magnitude of that in the steady part.
    pub speed_error_max: f64,
    /// Path-following error at the end \[m\].
    pub path_error_final_m: f64,
    /// Largest path-following error \[m\].
    pub path_error_largest_m: f64,
    /// Largest path-following error after settling (in the steady part, if it did not settle) \[m\].
    pub path_error_after_settling_m: f64,
    /// Root mean square of the path-following error in the steady part \[m\].
    pub path_error_rms_m: f64,
    /// From when on it stayed below 2 % of its largest value \[s\].
    pub path_settled_s: Option<f64>,
    /// From when on it stayed below 0.1 m \[s\].
    pub on_path_s: Option<f64>,
    /// Mean along-track error in the steady part \[m\].
    pub along_mean_m: f64,
    /// What theory predicts for it.
    pub predicted_along_bias_m: Option<f64>,
    /// Root mean square of the cross-track error in the steady part \[m\].
    pub cross_rms_m: f64,
    /// Root mean square of the heading error in the steady part \[rad\].
    pub heading_rms_rad: f64,
    /// Part of the rows in which it had no neighbour.
    pub alone_fraction: f64,
    /// Messages that it put on the air, each once, however many hear it.
    pub messages_said: u64,
    /// Their size \[bytes\].
    pub bytes_on_air: u64,
}

/// Everything that depends on the wall clock and the machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClockSummary {
    /// Version of this layout.
    pub format: u32,
    /// Lateness of the deliveries: achieved minus commanded delay.
    pub deliveries: Option<DeliverySummary>,
    /// The same by directed link, for those that delivered something.
    pub links: Vec<LinkDeliveries>,
    /// Deadlines of the control loops.
    pub deadlines: Vec<DeadlineSummary>,
    /// Messages that no model of the network dropped, but a program or session that did not keep up.
    pub overruns: Vec<OverrunSummary>,
    /// Whether the machine kept time; `None` without a real clock.
    pub verdict: Option<ClockVerdict>,
    /// What the programs had to say.
    pub notes: Vec<NoteSummary>,
}

/// Messages dropped for want of time or room.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverrunSummary {
    /// Whose messages, or on the way to whom.
    pub vehicle: String,
    /// Where.
    pub place: Overrun,
    /// How many; the oldest.
    pub count: u64,
}

/// Deadlines of one vehicle's control loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadlineSummary {
    /// The vehicle.
    pub vehicle: String,
    /// Deadlines met.
    pub met: u64,
    /// Deadlines missed.
    pub missed: u64,
    /// Largest lateness of one that was met \[s\].
    pub worst_late_s: f64,
}

/// A line for people.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NoteSummary {
    /// When, in mission time \[s\].
    pub t_s: f64,
    /// Who says it.
    pub source: String,
    /// What.
    pub text: String,
    /// How often.
    pub count: u64,
}

/// The numbers of a run that mission and seed determine.
pub fn summarise(recording: &Recording, facts: &Facts) -> Summary {
    let exact = &recording.exact;
    let tracks = tracks(exact, facts);
    let coordination = Coordination::of(&tracks, facts);
    let network = Network::of(exact, facts);
    let links = links(exact, facts, &network);
    let said = transmissions(exact);
    let vehicles: Vec<VehicleSummary> = tracks.iter().map(|track| vehicle(track, &tracks, facts, &said)).collect();
    let absences = absences(&tracks, facts);
    let first_absence = absences.first().map(|absence| absence.from_s);
    let present = || vehicles.iter().filter(|vehicle| vehicle.rows > 0);
    let fleet = FleetSummary {
        steady_speed: mean(present().map(|vehicle| vehicle.steady_speed)),
        predicted_speed: facts.predicted_speed,
        formation_speed: speeds(exact).last().map(|row| row.speed),
        formation_speed_at_the_end: facts.formation_speed_at_the_end,
        path_error_final_m: largest(present().map(|vehicle| vehicle.path_error_final_m)),
        on_path_s: present().map(|vehicle| vehicle.on_path_s).collect::<Option<Vec<f64>>>().map(largest),
        messages: totals(&links, &said, facts),
        connectivity: network.connectivity_heard(exact, facts),
        connectivity_before: first_absence.and_then(|at| network.until(at).connectivity_heard(exact, facts)),
        absences,
        aborted: facts.aborted.clone(),
        coordination: coordination_summary(&coordination, facts, Decay::of(&coordination, exact, facts).fit),
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
    }
}

/// The numbers of a run that depend on the wall clock.
pub fn summarise_clock(recording: &Recording) -> ClockSummary {
    let mut overruns: BTreeMap<(&str, Overrun), u64> = BTreeMap::new();
    let (deliveries, links) = deliveries(&recording.clock);
    let mut summary = ClockSummary { format: 1, deliveries, links, ..ClockSummary::default() };
    for record in &recording.clock {
        match record {
            ClockRecord::Achieved(_) => {}
            ClockRecord::Ticks(row) => {
                let worst_late_s = row.worst_late_ns as f64 / 1e9;
                match summary.deadlines.iter_mut().find(|deadlines| *deadlines.vehicle == *row.vehicle) {
                    Some(deadlines) => {
                        deadlines.met += row.met;
                        deadlines.missed += row.missed;
                        deadlines.worst_late_s = deadlines.worst_late_s.max(worst_late_s);
                    }
                    None => summary.deadlines.push(DeadlineSummary {
                        vehicle: row.vehicle.to_string(),
                        met: row.met,
                        missed: row.missed,
                        worst_late_s,
                    }),
                }
            }
            ClockRecord::Overrun(row) => *overruns.entry((row.vehicle.as_ref(), row.place)).or_default() += row.count,
            ClockRecord::Note(row) => summary.notes.push(NoteSummary {
                t_s: row.t_ns as f64 / 1e9,
                source: row.source.clone(),
                text: row.text.clone(),
                count: row.count,
            }),
        }
    }
    summary.deadlines.sort_by(|a, b| a.vehicle.cmp(&b.vehicle));
    let overrun = |((vehicle, place), count): ((&str, Overrun), u64)| {
        let vehicle = vehicle.to_owned();
        OverrunSummary { vehicle, place, count }
    };
    summary.overruns = overruns.into_iter().map(overrun).collect();
    summary.verdict = verdict(&summary);
    summary
}

/// A vehicle that records nothing for this many control periods, or for two and a half times as long as usual, is not there.
const SILENT_PERIODS: f64 = 10.5;

/// The times in which vehicles recorded nothing.
fn absences(tracks: &[Track<'_>], facts: &Facts) -> Vec<Absence> {
    let mut absences = Vec::new();
    for track in tracks {
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

fn coordination_summary(
    coordination: &Coordination,
    facts: &Facts,
    fit: Option<ExponentialFit>,
) -> CoordinationSummary {
    let (t_s, spread, norm) = (&coordination.t_s, coordination.spread(), coordination.norm());
    let peak = largest(spread.iter().copied());
    let kept = thinned(t_s.len(), SERIES_SAMPLES);
    let pick = |values: &[f64]| kept.iter().map(|index| values[*index]).collect();
    let steady = steady_part(t_s, facts);
    let mut summary = CoordinationSummary {
        unit: facts.xi_unit.clone(),
        initial: spread.first().copied().unwrap_or(0.0),
        largest: peak,
        last: spread.last().copied().unwrap_or(0.0),
        last_s: t_s.last().copied(),
        steady_rms: rms(spread[steady..].iter().copied()),
        settled_s: settling_time(t_s, &spread, SETTLED_PART * peak),
        settled_absolute_s: settling_time(t_s, &spread, COORDINATION_THRESHOLD),
        fit,
        guaranteed_rate: None,
        at_least_guaranteed: None,
        series: CoordinationSeries { t_s: pick(t_s), largest: pick(&spread), norm: pick(&norm) },
    };
    summary.hold_against(facts.guaranteed_rate, facts.least_rate);
    summary
}

impl CoordinationSummary {
    /// Takes this as the rate that theory guarantees, and this as what a flight can show of it, where that is less.
    pub(super) fn hold_against(&mut self, guaranteed_rate: Option<f64>, least_rate: Option<f64>) {
        self.guaranteed_rate = guaranteed_rate;
        let comparable = self.fit.filter(|fit| fit.on_paths).zip(guaranteed_rate);
        let least = |guaranteed: f64| least_rate.map_or(guaranteed, |least| least.min(guaranteed));
        self.at_least_guaranteed = comparable.map(|(fit, guaranteed)| fit.rate >= (1.0 - FIT_PART) * least(guaranteed));
    }
}

fn vehicle(track: &Track<'_>, all: &[Track<'_>], facts: &Facts, said: &BTreeMap<&str, u64>) -> VehicleSummary {
    let rows = &track.rows;
    let t_s: Vec<f64> = rows.iter().map(|row| row.t_ns as f64 / 1e9).collect();
    let errors: Vec<f64> = rows.iter().map(|row| row.e_norm_m).collect();
    let steady_index = steady_part(&t_s, facts);
    let steady = &rows[steady_index..];
    let peak = largest(errors.iter().copied());
    let path_settled_s = settling_time(&t_s, &errors, SETTLED_PART * peak);
    let settled_index = path_settled_s.map_or(steady_index, |settled| t_s.partition_point(|time| *time < settled));
    let h = |track: &Track<'_>, row: &StateRow| track.pattern.at(Time::from_nanos(row.t_ns)).h;
    let removed = |track: &Track<'_>| track.rows.last().map(|row| row.xi - h(track, row));
    let first = all.iter().find_map(removed);
    let messages_said = said.get(track.id).copied().unwrap_or(0);
    let planned = facts.vehicles.iter().find(|vehicle| vehicle.id == track.id);
    VehicleSummary {
        id: track.id.to_owned(),
        path: planned.map(|vehicle| vehicle.path.clone()).unwrap_or_default(),
        pattern_offset: track.pattern.constant,
        rows: rows.len() as u64,
        last_s: t_s.last().copied(),
        coordination_final: removed(track).zip(first).map_or(0.0, |(own, first)| own - first),
        steady_speed: match (steady.first(), steady.last()) {
            // The mean rate of ξ − h exactly, not the mean of samples of the rate.
            (Some(a), Some(b)) if b.t_ns > a.t_ns => {
                (b.xi - a.xi - (h(track, b) - h(track, a))) / ((b.t_ns - a.t_ns) as f64 / 1e9)
            }
            _ => rows.last().map_or(0.0, |row| row.xi_rate),
        },
        steady_speed_mps: mean(steady.iter().map(|row| row.speed_mps)),
        speed_error_rms: rms(steady.iter().map(|row| row.xi_rate - row.v_ref)),
        speed_error_max: largest(steady.iter().map(|row| (row.xi_rate - row.v_ref).abs())),
        path_error_final_m: errors.last().copied().unwrap_or(0.0),
        path_error_largest_m: peak,
        path_error_after_settling_m: largest(errors[settled_index..].iter().copied()),
        path_error_rms_m: rms(errors[steady_index..].iter().copied()),
        path_settled_s,
        on_path_s: settling_time(&t_s, &errors, PATH_THRESHOLD_M),
        along_mean_m: mean(steady.iter().map(|row| row.e_along_m)),
        predicted_along_bias_m: planned.and_then(|vehicle| vehicle.predicted_along_bias_m),
        cross_rms_m: rms(steady.iter().map(|row| row.e_cross_m)),
        heading_rms_rad: rms(steady.iter().map(|row| row.psi_e_rad)),
        alone_fraction: mean(rows.iter().map(|row| f64::from(u8::from(row.neighbours == 0)))),
        messages_said,
        bytes_on_air: messages_said * facts.bytes_of(track.id),
    }
}

/// The index at which the steady part begins.
fn steady_part(t_s: &[f64], facts: &Facts) -> usize {
    let (Some(first), Some(last)) = (t_s.first(), t_s.last()) else { return 0 };
    let from = steady_from(*last, *first, facts.link_period_s);
    t_s.partition_point(|time| *time < from - 1e-9)
}

fn totals(links: &[LinkSummary], said: &BTreeMap<&str, u64>, facts: &Facts) -> MessageTotals {
    let sum = |value: fn(&LinkSummary) -> u64| links.iter().map(value).sum();
    MessageTotals {
        sent: sum(|link| link.sent),
        delivered: sum(|link| link.delivered),
        lost: sum(|link| link.lost),
        link_down: sum(|link| link.link_down),
        queue_full: sum(|link| link.queue_full),
        in_flight: sum(|link| link.in_flight),
        out_of_range: sum(|link| link.out_of_range),
        half_duplex: sum(|link| link.half_duplex),
        collision: sum(|link| link.collision),
        corrupt: sum(|link| link.corrupt),
        receiver_absent: sum(|link| link.receiver_absent),
        copied: sum(|link| link.copied),
        copy_dropped: sum(|link| link.copy_dropped),
        copy_in_flight: sum(|link| link.copy_in_flight),
        transmissions: said.values().sum(),
        message_bytes: facts.message_bytes,
        bytes_on_air: said.iter().map(|(id, said)| said * facts.bytes_of(id)).sum(),
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
    warnings
}

/// Indices of about `samples` evenly spaced entries of `count`, first and last included.
pub(super) fn thinned(count: usize, samples: usize) -> Vec<usize> {
    if count <= samples {
        return (0..count).collect();
    }
    (0..samples).map(|step| step * (count - 1) / (samples - 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::testing::{facts, fleet};
    use common::record::NoteRow;

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
        assert_eq!(totals.sent, 4 * 801);
        // v2 speaks to both neighbours at once.
        assert_eq!(totals.transmissions, 3 * 801);
        assert_eq!(totals.bytes_on_air, 801 * (40 + 40 + 44));
        assert_eq!((vehicle.messages_said, vehicle.bytes_on_air), (801, 801 * 44));
        assert!((summary.links[0].up_fraction - 0.25).abs() < 1e-9);
        assert!((summary.fleet.connectivity.expect("three vehicles").alpha - 0.75).abs() < 1e-9);
    }

    #[test]
    fn the_clock_stays_out_of_the_summary() {
        let (with_clock, mut without) = (fleet(true), fleet(true));
        without.clock.clear();
        assert_eq!(summarise(&with_clock, &facts(true)), summarise(&without, &facts(true)));
        let clock = summarise_clock(&with_clock);
        let late = clock.deliveries.expect("deliveries").late_s;
        assert_eq!((late.median, late.max), (60e-6, 2e-3));
        assert_eq!(clock.deadlines.iter().map(|deadlines| deadlines.missed).sum::<u64>(), 6);
        assert_eq!(clock.notes.len(), 1);
        assert!(clock.verdict.is_some_and(|verdict| !verdict.kept_time));
        assert_eq!(summarise_clock(&without), ClockSummary { format: 1, ..ClockSummary::default() });
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
        assert!(serde_json::to_string(&summary).expect("serialises").contains("\"steady_speed\":0.0"));
        let mut lacking = fleet(true);
        lacking.exact.retain(|record| !matches!(record, Record::Message(row) if row.seq == 7 && *row.to == *"v2"));
        let summary = summarise(&lacking, &facts(true));
        assert!(!summary.fleet.messages.balanced);
        assert_eq!(summary.warnings.len(), 2, "{:?}", summary.warnings);
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
