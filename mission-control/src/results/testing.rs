//! A plausible fleet for tests and pictures: three vehicles on helices with decaying errors and outages.

use bus::recording::Recording;
use common::mission::Pattern;
use common::record::{
    AchievedRow, ClockRecord, Fate, MessageRow, NoteRow, Record, SpeedRow, StateRow, TicksRow, TopologyRow,
};

use super::{Facts, VehicleFacts};

pub(crate) fn state_row(t_ns: i64, vehicle: &str, xi: f64) -> StateRow {
    StateRow {
        t_ns,
        vehicle: vehicle.into(),
        xi,
        xi_rate: 0.0,
        v_ref: 0.0,
        x_m: 0.0,
        y_m: 0.0,
        z_m: 0.0,
        yaw_rad: 0.0,
        pitch_rad: 0.0,
        roll_rad: 0.0,
        speed_mps: 0.0,
        e_along_m: 0.0,
        e_cross_m: 0.0,
        e_norm_m: 0.0,
        psi_e_rad: 0.0,
        neighbours: 0,
    }
}

/// Links 1 <-> 2 <-> 3.
pub(super) const LINKS: [(&str, &str); 4] = [("v1", "v2"), ("v2", "v1"), ("v2", "v3"), ("v3", "v2")];

pub(super) fn facts(spatial: bool) -> Facts {
    let vehicles = (0..3).map(|index| VehicleFacts {
        id: format!("v{}", index + 1),
        pattern: Pattern::default(),
        path: if spatial { format!("helix-{}", index + 1) } else { format!("circle-{}", index + 1) },
        way: Default::default(),
        message_bytes: (index == 2).then_some(44),
        predicted_along_bias_m: Some(0.0),
        planned: (0..=200).map(|step| path(f64::from(step) * 2.0, index, spatial)).collect(),
    });
    Facts {
        mission: if spatial { "Three helices & a bad network".into() } else { "three-circles".into() },
        description: "Three underwater vehicles climb helices above one another while all links fail 75 % of the time."
            .into(),
        vehicles: vehicles.collect(),
        links: LINKS.iter().map(|(from, to)| ((*from).into(), (*to).into())).collect(),
        message_bytes: 40,
        duration_s: 400.0,
        planned_s: 400.0,
        commanded: Vec::new(),
        control_period_s: 0.1,
        validity_s: Some(1.5),
        link_period_s: Some(10.0),
        guaranteed_rate: Some(0.012),
        least_rate: None,
        guaranteed_factor: Some(1.3),
        predicted_speed: Some(0.5),
        symbol: if spatial { "γ".into() } else { "ξ".into() },
        xi_unit: String::new(),
        spatial,
        formation_speed_at_the_end: Some(0.5),
        missing: Vec::new(),
        aborted: Vec::new(),
        graph: None,
    }
}

fn path(xi: f64, index: usize, spatial: bool) -> [f64; 3] {
    let angle = std::f64::consts::TAU * xi / 400.0 - 2.356;
    let radius = if spatial { 20.0 } else { 20.0 + 5.0 * index as f64 };
    let depth = if spatial { 0.05 * xi - 10.0 + 5.0 * index as f64 } else { 0.0 };
    [radius * angle.cos(), radius * angle.sin(), depth]
}

/// The rows of the fleet. Coordination errors decay at 0.025 per second on average, in steps of 10 s.
pub(super) fn fleet(spatial: bool) -> Recording {
    let mut exact = vec![Record::Speed(SpeedRow { t_ns: 0, speed: 0.5 })];
    let connected = |t: f64| (t / 10.0).floor() * 2.5 + (t % 10.0).min(2.5);
    for step in 0..=4000_i64 {
        let t = step as f64 * 0.1;
        let t_ns = step * 100_000_000;
        let (up, was_up) = (t % 10.0 < 2.5 - 1e-9, (t - 0.1).max(0.0) % 10.0 < 2.5 - 1e-9);
        if step == 0 || up != was_up {
            for (from, to) in LINKS {
                exact.push(Record::Topology(TopologyRow { t_ns, from: from.into(), to: to.into(), up }));
            }
        }
        for index in 0..3 {
            let sign = [1.0, -0.2, -0.8][index];
            let disagreement = sign * 12.0 * (-0.1 * connected(t)).exp() + 2e-3 * (0.7 * t + index as f64).sin();
            let xi = 0.5 * t + disagreement;
            let error = [3.0, 6.0, 9.0][index] * (-0.06 * t).exp() + 0.01;
            let cross = error * (0.25 * t + index as f64).cos();
            let on_path = path(xi, index, spatial);
            let angle = std::f64::consts::TAU * xi / 400.0 - 2.356;
            let rate = 0.5 - if up { sign * 1.2 * (-0.1 * connected(t)).exp() } else { 0.0 };
            exact.push(Record::State(StateRow {
                xi,
                xi_rate: rate,
                v_ref: 0.5,
                x_m: on_path[0] + cross * angle.cos(),
                y_m: on_path[1] + cross * angle.sin(),
                z_m: on_path[2] + if spatial { 0.4 * error * (0.2 * t).sin() } else { 0.0 },
                yaw_rad: angle + std::f64::consts::FRAC_PI_2,
                speed_mps: rate * on_path[0].hypot(on_path[1]) * std::f64::consts::TAU / 400.0,
                e_along_m: 0.3 * error,
                e_cross_m: cross,
                e_norm_m: error,
                psi_e_rad: 0.2 * (-0.05 * t).exp(),
                neighbours: u16::from(up) * if index == 1 { 2 } else { 1 },
                ..state_row(t_ns, &format!("v{}", index + 1), xi)
            }));
        }
        if step % 5 == 0 {
            for (link, (from, to)) in LINKS.into_iter().enumerate() {
                let (seq, due_ns) = (step.unsigned_abs() / 5, t_ns + 5_000_000_000);
                let fate =
                    match (due_ns > 400_000_000_000, (t + 5.0) % 10.0 < 2.5, (seq + link as u64).is_multiple_of(17)) {
                        (true, _, _) => Fate::InFlight,
                        (_, false, _) => Fate::LinkDown,
                        (_, _, true) => Fate::Lost,
                        _ => Fate::Delivered,
                    };
                // What is under way at the end is recorded then.
                let decided_ns = due_ns.min(400_000_000_000);
                let row =
                    MessageRow { t_ns: decided_ns, from: from.into(), to: to.into(), seq, sent_ns: t_ns, due_ns, fate };
                exact.push(Record::Message(row));
            }
        }
    }
    let late = [40_000, 60_000, 90_000, 2_000_000];
    let achieved = (0..).zip(late).map(|(seq, late_ns)| {
        let (from, to) = ("v1".into(), "v2".into());
        ClockRecord::Achieved(AchievedRow { t_ns: 0, from, to, seq, commanded_ns: 5_000_000_000, late_ns })
    });
    let ticks = (1..=3).map(|index| {
        let vehicle = format!("v{index}").into();
        ClockRecord::Ticks(TicksRow { t_ns: 0, vehicle, met: 4000 - index, missed: index, worst_late_ns: 3_100_000 })
    });
    let text = "rejoined at <ξ = 12.5> after 3.2 s".into();
    let note = ClockRecord::Note(NoteRow { t_ns: 42_000_000_000, source: "v2".into(), text, count: 1 });
    Recording {
        mission_toml: "name = \"three-helices\"\n\n[network]\nloss = 0.06   # <5 % & more\n".into(),
        digest: "3f1c9a77d0e2b4f6".into(),
        seed: 42,
        start_unix_ns: None,
        exact,
        clock: achieved.chain(ticks).chain([note]).collect(),
        complete: true,
        damage: None,
    }
}
