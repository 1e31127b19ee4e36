//! The channel, mechanism by mechanism, and all of it together.

use proptest::prelude::*;

use common::wire::state::LARGEST_NUMBER;

use super::*;
use crate::ledger::Ledger;

/// A mission of three vehicles on lines whose network is given.
fn mission(network: &str) -> Arc<Mission> {
    let vehicle = |i: usize| {
        format!(
            "[[vehicles]]\nid = \"v{i}\"\npath = {{ line = {{ start_m = [0.0, {i}.0] }} }}\nstart = {{ x_m = 0.0, y_m = {i}.0 }}\n"
        )
    };
    let text = format!(
        "name = \"t\"\nseed = 5\nduration_s = 100.0\n[formation]\nspeed = 0.5\n\
         [coordination]\nlaw = {{ switching = {{ gain = 0.1 }} }}\n\
         [network]\nlinks = [[\"v1\", \"v2\"], [\"v2\", \"v3\"]]\n{network}\n\
         [fleet]\nmodel = \"kinematic_unicycle\"\nfollowing = {{ line_of_sight = {{ distance_m = 1.0 }} }}\n{}{}{}",
        vehicle(1),
        vehicle(2),
        vehicle(3)
    );
    Arc::new(Mission::parse("t.toml", &text).unwrap_or_else(|faults| panic!("{faults}")))
}

fn state(mission: &Mission, sender: u16, seq: u32) -> Arc<[u8]> {
    state_at(mission, sender, seq, 1.0)
}

fn seconds(t: f64) -> Time {
    Time::from_secs(t)
}

fn drain(emulator: &mut Emulator) -> Vec<Channel> {
    std::iter::from_fn(|| emulator.poll_output()).collect()
}

/// Who got something, and when it was due.
fn deliveries(outputs: &[Channel]) -> Vec<(usize, Time)> {
    let delivery = |output: &Channel| match output {
        Channel::Deliver { to, due, .. } => Some((*to, *due)),
        Channel::Record(_) | Channel::Settled(_) => None,
    };
    outputs.iter().filter_map(delivery).collect()
}

#[test]
fn a_message_reaches_the_neighbours_after_the_delay_and_nobody_else() {
    let mission = mission("delay = { constant = { delay_s = 2.0 } }");
    let mut emulator = Emulator::new(mission.clone(), None);
    emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state(&mission, 0, 0) }));
    emulator.handle(seconds(2.999), None);
    assert_eq!(deliveries(&drain(&mut emulator)), vec![], "never early");
    emulator.handle(seconds(3.0), None);
    assert_eq!(deliveries(&drain(&mut emulator)), vec![(1, seconds(3.0))]);
}

#[test]
fn the_switching_signal_gates_reception_and_not_transmission() {
    // Up in [7.5, 10) of every 10 s, 5 s of delay: what is said at 3 s is heard at 8 s, what is said at 8 s is not.
    let mission = mission(
        "delay = { constant = { delay_s = 5.0 } }\nswitching = { periodic = { period_s = 10.0, up_from_s = 7.5, up_for_s = 2.5 } }",
    );
    let mut emulator = Emulator::new(mission.clone(), None);
    emulator.handle(seconds(3.0), Some(Sent { from: 0, bytes: state(&mission, 0, 0) }));
    emulator.handle(seconds(8.0), Some(Sent { from: 0, bytes: state(&mission, 0, 1) }));
    emulator.handle(seconds(20.0), None);
    assert_eq!(deliveries(&drain(&mut emulator)), vec![(1, seconds(8.0))]);
    let ledger = emulator.ledgers().next().copied().expect("a link");
    assert_eq!((ledger.sent, ledger.delivered(), ledger.of(Fate::LinkDown)), (2, 1, 1));
}

#[test]
fn an_interval_of_up_time_contains_its_begin_and_not_its_end() {
    let mission = mission("switching = { periodic = { period_s = 10.0, up_from_s = 0.0, up_for_s = 2.0 } }");
    for (t, heard) in [(0.0, 1), (1.999, 1), (2.0, 0), (9.999, 0), (10.0, 1)] {
        let mut emulator = Emulator::new(mission.clone(), None);
        emulator.handle(seconds(t), Some(Sent { from: 0, bytes: state(&mission, 0, 0) }));
        emulator.handle(seconds(t), None);
        assert_eq!(deliveries(&drain(&mut emulator)).len(), heard, "at {t} s");
    }
}

#[test]
fn bernoulli_losses_come_at_their_probability() {
    let mission = mission("loss = { bernoulli = { probability = 0.3 } }");
    let mut emulator = Emulator::new(mission.clone(), None);
    let n = 20_000;
    for seq in 0..n {
        emulator.handle(seconds(f64::from(seq) * 1e-3), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
        emulator.handle(seconds(f64::from(seq) * 1e-3), None);
        drain(&mut emulator);
    }
    let lost = emulator.ledgers().next().map_or(0, |ledger| ledger.of(Fate::Lost)) as f64 / f64::from(n);
    // Five standard deviations of the mean of n draws.
    assert!((lost - 0.3).abs() < 5.0 * (0.3f64 * 0.7 / f64::from(n)).sqrt(), "{lost}");
}

#[test]
fn what_is_decided_about_a_message_does_not_depend_on_the_others() {
    let mission =
        mission("loss = { bernoulli = { probability = 0.5 } }\ndelay = { jittered = { min_s = 0.1, max_s = 3.0 } }");
    let fates = |order: &[(usize, u32)]| {
        let mut emulator = Emulator::new(mission.clone(), None);
        for (from, seq) in order {
            emulator.handle(seconds(1.0), Some(Sent { from: *from, bytes: state(&mission, *from as u16, *seq) }));
        }
        emulator.handle(seconds(50.0), None);
        let mut deliveries = deliveries(&drain(&mut emulator));
        deliveries.sort();
        deliveries
    };
    let alternating: Vec<(usize, u32)> = (0..40).flat_map(|seq| [(0, seq), (1, seq), (2, seq)]).collect();
    let one_by_one: Vec<(usize, u32)> = (0..3).rev().flat_map(|from| (0..40).map(move |seq| (from, seq))).collect();
    assert_eq!(fates(&alternating), fates(&one_by_one));
}

/// Each model takes numbers of its own: what one decides stays as it is when another has other parameters.
#[test]
fn a_model_with_other_parameters_leaves_what_the_others_decide() {
    let network = |[delay, loss, duplicate, corrupt]: [&str; 4]| {
        mission(&format!(
            "delay = {{ {delay} }}\nloss = {{ {loss} }}\nduplicate_probability = {duplicate}\ncorrupt_probability = {corrupt}"
        ))
    };
    // The numbers of the messages that met these fates, and of those that were decided about by the model at all.
    let met = |models: [&str; 4], fate: Fate, among: &BTreeSet<u64>| -> BTreeSet<u64> {
        let words: Vec<(f64, u16, u32)> = (0..400).map(|seq| (f64::from(seq), 0, seq)).collect();
        let (_, outputs) = run(&network(models), &words, 500.0);
        let met = fates(&outputs, "v1", "v2").into_iter().filter(|(_, found)| *found == fate);
        met.map(|(seq, _)| seq).filter(|seq| among.contains(seq)).collect()
    };
    let (constant, jittered) = ("constant = { delay_s = 0.1 }", "jittered = { min_s = 0.1, max_s = 9.0 }");
    let (single, none) = ("bernoulli = { probability = 0.3 }", "bernoulli = { probability = 0.0 }");
    let base = [constant, single, "0.3", "0.2"];
    let all: BTreeSet<u64> = (0..400).collect();
    let lost = met(base, Fate::Lost, &all);
    let arrived: BTreeSet<u64> = all.difference(&lost).copied().collect();
    let corrupt = met(base, Fate::Corrupt, &all);
    let sound: BTreeSet<u64> = arrived.difference(&corrupt).copied().collect();
    let copied = met(base, Fate::Copied, &all);
    assert!([&lost, &corrupt, &copied].iter().all(|numbers| numbers.len() > 30), "each model has something to decide");
    for other in [[jittered, single, "0.3", "0.2"], [constant, single, "0.9", "0.2"], [constant, single, "0.3", "0.7"]]
    {
        assert_eq!(met(other, Fate::Lost, &all), lost, "{other:?}");
    }
    for other in [[jittered, single, "0.3", "0.2"], [constant, none, "0.3", "0.2"], [constant, single, "0.9", "0.2"]] {
        assert_eq!(met(other, Fate::Corrupt, &arrived), corrupt, "{other:?}");
    }
    for other in [[jittered, single, "0.3", "0.2"], [constant, none, "0.3", "0.2"], [constant, single, "0.3", "0.0"]] {
        assert_eq!(met(other, Fate::Copied, &sound), copied, "{other:?}");
    }
}

#[test]
fn garbage_is_counted_and_changes_no_ledger() {
    let mission = mission("");
    let mut emulator = Emulator::new(mission.clone(), None);
    let good = state(&mission, 0, 7);
    let mut other = CoordinationState::decode(&good).expect("sound");
    other.mission ^= 1;
    for (from, bytes, kind) in [
        (0, b"nonsense".to_vec(), Garbage::Foreign),
        (0, good[..20].to_vec(), Garbage::Malformed),
        (0, vec![b'C'; 5000], Garbage::Oversized),
        (0, other.encode(), Garbage::WrongMission),
        (1, good.to_vec(), Garbage::Forged),
    ] {
        emulator.handle(seconds(1.0), Some(Sent { from, bytes: bytes.into() }));
        assert_eq!(emulator.garbage()[from].of(kind), 1, "{kind:?}");
    }
    assert!(emulator.ledgers().all(|ledger| ledger.sent == 0));
    emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: good.clone() }));
    emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: good }));
    assert_eq!(emulator.garbage()[0].of(Garbage::Stale), 1, "said twice");
    assert_eq!(emulator.totals()[0], 1);
}

#[test]
fn a_full_queue_drops_new_messages_with_a_count() {
    let mission = mission("queue = 3\ndelay = { constant = { delay_s = 50.0 } }");
    let mut emulator = Emulator::new(mission.clone(), None);
    for seq in 0..10 {
        emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
    }
    let ledger = emulator.ledgers().next().copied().expect("a link");
    assert_eq!((ledger.sent, ledger.of(Fate::QueueFull), ledger.in_flight), (10, 7, 3));
}

/// A state whose ξ puts the sender that far along its line.
fn state_at(mission: &Mission, sender: u16, seq: u32, xi: f64) -> Arc<[u8]> {
    CoordinationState { mission: mission.digest, sender, seq, made: Time::ZERO, xi, scalar: None }.encode().into()
}

/// The directed links of the mission, in its order.
const LINKS: [(&str, &str); 4] = [("v1", "v2"), ("v2", "v1"), ("v2", "v3"), ("v3", "v2")];

/// What became of the messages on the link between two vehicles, by number.
fn fates(outputs: &[Channel], from: &str, to: &str) -> Vec<(u64, Fate)> {
    let fate = |output: &Channel| match output {
        Channel::Settled(settled) | Channel::Deliver { settled: Some(settled), .. }
            if LINKS[settled.link] == (from, to) =>
        {
            Some((settled.seq, settled.fate))
        }
        _ => None,
    };
    let mut fates: Vec<(u64, Fate)> = outputs.iter().filter_map(fate).collect();
    fates.sort_unstable();
    fates
}

/// Everything that comes of messages (when [s], who, number), each taken at its instant.
fn run(mission: &Arc<Mission>, words: &[(f64, u16, u32)], end: f64) -> (Emulator, Vec<Channel>) {
    let mut emulator = Emulator::new(mission.clone(), None);
    for (at, who, seq) in words {
        emulator.handle(seconds(*at), None);
        emulator.handle(seconds(*at), Some(Sent { from: usize::from(*who), bytes: state(mission, *who, *seq) }));
    }
    emulator.handle(seconds(end), None);
    let outputs = drain(&mut emulator);
    (emulator, outputs)
}

#[test]
fn sound_takes_its_time_from_where_the_sender_is() {
    let mission = mission("delay = { distance = { speed_mps = 1500.0, extra_s = 0.5 } }");
    let mut emulator = Emulator::new(mission.clone(), None);
    // v2 lies still at x = 0; v1 is at x = 3000 m on a line 1 m beside when it speaks.
    emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state_at(&mission, 0, 0, 3000.0) }));
    emulator.handle(seconds(10.0), None);
    let due = seconds(1.5) + Span::from_secs(3000f64.hypot(1.0) / 1500.0);
    assert_eq!(deliveries(&drain(&mut emulator)), vec![(1, due)]);
}

#[test]
fn a_message_that_waits_is_sent_from_where_its_sender_is_by_then() {
    let medium = "medium = { rate_bps = 160.0, packet_bytes = 20, queue = 5 }";
    let mission = mission(&format!("delay = {{ distance = {{ speed_mps = 1500.0 }} }}\n{medium}"));
    let mut emulator = Emulator::new(mission.clone(), None);
    // Each takes a second on the air, so the second waits for half a second, at 600 m/s.
    for (seq, made, xi) in [(0, 1.0, 1500.0), (1, 1.5, 1800.0)] {
        let word = CoordinationState { mission: mission.digest, sender: 0, seq, made: seconds(made), xi, scalar: None };
        emulator.handle(seconds(made), Some(Sent { from: 0, bytes: word.encode().into() }));
    }
    emulator.handle(seconds(20.0), None);
    let due = |begun: f64, x: f64| (1, seconds(begun + 1.0) + Span::from_secs(x.hypot(1.0) / 1500.0));
    assert_eq!(deliveries(&drain(&mut emulator)), [due(1.0, 1500.0), due(2.0, 2100.0)]);
}

#[test]
fn a_message_is_heard_within_its_range_and_not_beyond() {
    let mission = mission("range = { disc = { radius_m = 100.0 } }");
    for (xi, fate) in [(99.0, Fate::Delivered), (101.0, Fate::OutOfRange), (LARGEST_NUMBER, Fate::OutOfRange)] {
        let mut emulator = Emulator::new(mission.clone(), None);
        emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state_at(&mission, 0, 0, xi) }));
        emulator.handle(seconds(1.0), None);
        assert_eq!(fates(&drain(&mut emulator), "v1", "v2"), vec![(0, fate)], "at {xi} m");
    }
}

#[test]
fn ranges_may_differ_by_direction() {
    let mission = mission(
        "range = { disc = { radius_m = 10.0 } }\n\
         exceptions = [{ from = \"v1\", to = \"v2\", range = { disc = { radius_m = 1000.0 } } }]",
    );
    let mut emulator = Emulator::new(mission.clone(), None);
    emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state_at(&mission, 0, 0, 500.0) }));
    emulator.handle(seconds(2.0), Some(Sent { from: 1, bytes: state_at(&mission, 1, 0, 0.0) }));
    emulator.handle(seconds(2.0), None);
    let outputs = drain(&mut emulator);
    assert_eq!(fates(&outputs, "v1", "v2"), vec![(0, Fate::Delivered)]);
    assert_eq!(fates(&outputs, "v2", "v1"), vec![(0, Fate::OutOfRange)]);
}

#[test]
fn a_success_curve_thins_messages_out() {
    let mission = mission("range = { curve = { points = [[0.0, 1.0], [1000.0, 0.0]] } }");
    let n = 5000;
    let mut emulator = Emulator::new(mission.clone(), None);
    for seq in 0..n {
        let now = seconds(f64::from(seq) * 1e-2);
        emulator.handle(now, Some(Sent { from: 0, bytes: state_at(&mission, 0, seq, 400.0) }));
        emulator.handle(now, None);
    }
    let ledger = emulator.ledgers().next().copied().expect("a link");
    let heard = ledger.delivered() as f64 / f64::from(n);
    // Probability 0.6 over 400 m; five standard deviations.
    assert!((heard - 0.6).abs() < 5.0 * (0.6f64 * 0.4 / f64::from(n)).sqrt(), "{heard}");
    assert_eq!(ledger.of(Fate::OutOfRange) + ledger.delivered(), u64::from(n));
}

#[test]
fn in_order_no_message_overtakes_an_earlier_one() {
    let jitter = "delay = { jittered = { min_s = 0.0, max_s = 5.0 } }";
    for (order, sorted) in [("free", false), ("in_order", true)] {
        let mission = mission(&format!("{jitter}\norder = \"{order}\"\nduplicate_probability = 0.3"));
        let words: Vec<(f64, u16, u32)> = (0..200).map(|seq| (f64::from(seq) * 0.1, 0, seq)).collect();
        let (_, outputs) = run(&mission, &words, 60.0);
        let arrived = |output: &Channel| match output {
            Channel::Settled(settled) if !settled.fate.is_of_copy() => Some((settled.due_ns, settled.seq)),
            _ => None,
        };
        let arrived: Vec<(i64, u64)> = outputs.iter().filter_map(arrived).collect();
        assert_eq!(arrived.iter().map(|(_, seq)| seq).is_sorted(), sorted, "{order}");
        assert!(arrived.iter().map(|(due, _)| due).is_sorted());
    }
}

#[test]
fn copies_hold_no_original_back_nor_take_its_place() {
    for more in ["order = \"in_order\"", "queue = 5", "order = \"in_order\"\nqueue = 7", "order = \"free\""] {
        let with_copies = |probability: f64| {
            let mission = mission(&format!(
                "delay = {{ jittered = {{ min_s = 0.1, max_s = 2.0 }} }}\n{more}\nduplicate_probability = {probability:?}"
            ));
            let words: Vec<(f64, u16, u32)> = (0..400).map(|seq| (f64::from(seq) * 0.1, 0, seq)).collect();
            let (emulator, outputs) = run(&mission, &words, 60.0);
            let row = |output: &Channel| match output {
                Channel::Settled(settled) => Some((settled.seq, settled.due_ns, settled.fate)),
                _ => None,
            };
            let (copies, originals): (Vec<_>, Vec<_>) =
                outputs.iter().filter_map(row).partition(|(_, _, fate)| fate.is_of_copy());
            (emulator.ledgers().next().map_or(0, |ledger| ledger.copies), copies, originals)
        };
        let ((none, ..), (made, copies, originals)) = (with_copies(0.0), with_copies(0.9));
        assert!(none == 0 && made > 100, "{made}");
        assert!(with_copies(0.0).2 == originals, "the originals fare as without copies, {more}");
        let overtaken = |copy: &(u64, i64, Fate)| originals.iter().any(|other| other.0 > copy.0 && other.1 < copy.1);
        assert!(copies.iter().any(overtaken), "a copy that is late lets others pass");
        let first = |copy: &(u64, i64, Fate)| originals.iter().any(|own| own.0 == copy.0 && own.1 <= copy.1);
        assert!(copies.iter().all(first), "and none comes before its original");
    }
}

#[test]
fn there_are_no_more_copies_under_way_than_places_in_the_queue() {
    let mission =
        mission("delay = { jittered = { min_s = 1.0, max_s = 60.0 } }\nqueue = 3\nduplicate_probability = 1.0");
    let words: Vec<(f64, u16, u32)> = (0..900).map(|seq| (f64::from(seq) * 0.1, 0, seq)).collect();
    let mut emulator = Emulator::new(mission.clone(), None);
    for (at, _, seq) in words {
        emulator.handle(seconds(at), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
        emulator.handle(seconds(at), None);
        assert!(emulator.ledgers().all(|ledger| ledger.in_flight <= 3 && ledger.copies_in_flight <= 3));
    }
    assert!(emulator.ledgers().next().is_some_and(|ledger| ledger.copies > 3));
}

#[test]
fn losses_in_bursts_come_at_their_share() {
    let mission = mission("loss = { gilbert_elliott = { mean_burst = 5.0, mean_gap = 15.0 } }");
    let n = 20_000;
    let words: Vec<(f64, u16, u32)> = (0..n).map(|seq| (f64::from(seq) * 1e-3, 0, seq)).collect();
    let (emulator, _) = run(&mission, &words, 30.0);
    let lost = emulator.ledgers().next().map_or(0, |ledger| ledger.of(Fate::Lost)) as f64 / f64::from(n);
    // Bursts of five make about n/10 independent messages of n.
    assert!((lost - 0.25).abs() < 5.0 * (0.25f64 * 0.75 * 10.0 / f64::from(n)).sqrt(), "{lost}");
}

#[test]
fn a_common_fade_takes_the_same_messages_from_all_links() {
    let mission = mission("loss = { shared_fades = { probability = 0.4, mean_burst = 4.0 } }");
    let words: Vec<(f64, u16, u32)> =
        (0..300).flat_map(|seq| (0..3).map(move |who| (f64::from(seq) * 0.1, who, seq))).collect();
    let (_, outputs) = run(&mission, &words, 60.0);
    let one = fates(&outputs, "v1", "v2");
    assert!(one.iter().any(|(_, fate)| *fate == Fate::Lost) && one.iter().any(|(_, fate)| *fate == Fate::Delivered));
    assert_eq!(one, fates(&outputs, "v2", "v1"));
    assert_eq!(one, fates(&outputs, "v3", "v2"));
}

#[test]
fn further_models_come_on_top() {
    let mission = mission(
        "delay = { constant = { delay_s = 1.0 } }\nloss = { trace = { runs = [1, 1] } }\n\
         also = [{ links = [[\"v1\", \"v2\"]], delay = { constant = { delay_s = 0.5 } }, loss = { trace = { runs = [2, 1] } } }]",
    );
    let words: Vec<(f64, u16, u32)> = (0..6).map(|seq| (f64::from(seq), 0, seq)).collect();
    let (_, outputs) = run(&mission, &words, 60.0);
    let delivered: Vec<u64> =
        fates(&outputs, "v1", "v2").iter().filter(|f| f.1 == Fate::Delivered).map(|f| f.0).collect();
    // Odd messages are lost by the first trace, the third of every three by the second.
    assert_eq!(delivered, [0, 4]);
    assert_eq!(deliveries(&outputs), vec![(1, seconds(1.5)), (1, seconds(5.5))]);
}

#[test]
fn a_second_copy_is_delivered_and_has_a_ledger_of_its_own() {
    let mission = mission("delay = { jittered = { min_s = 0.1, max_s = 0.3 } }\nduplicate_probability = 0.25");
    let n = 4000;
    let words: Vec<(f64, u16, u32)> = (0..n).map(|seq| (f64::from(seq) * 0.01, 0, seq)).collect();
    let (emulator, outputs) = run(&mission, &words, 90.0);
    let ledger = emulator.ledgers().next().copied().expect("a link");
    assert_eq!(
        (ledger.sent, ledger.delivered()),
        (u64::from(n), u64::from(n)),
        "copies change nothing about what was sent"
    );
    assert_eq!((ledger.copies, ledger.copies), (ledger.of(Fate::Copied), ledger.copies));
    assert_eq!(deliveries(&outputs).len() as u64, ledger.sent + ledger.copies);
    let share = ledger.copies as f64 / f64::from(n);
    assert!((share - 0.25).abs() < 5.0 * (0.25f64 * 0.75 / f64::from(n)).sqrt(), "{share}");
}

/// Every copy that was heard, and every original; by link and number.
fn heard(outputs: &[Channel]) -> [BTreeSet<(usize, u64)>; 2] {
    [Fate::Copied, Fate::Delivered].map(|wanted| {
        let heard = |output: &Channel| match output {
            Channel::Settled(settled) => (settled.fate == wanted).then_some((settled.link, settled.seq)),
            _ => None,
        };
        outputs.iter().filter_map(heard).collect()
    })
}

#[test]
fn what_is_spoilt_on_the_air_has_no_copy_that_is_heard() {
    // All speak at once, at every multiple of half a second: everybody is deaf, or v2 hears two at a time.
    let words: Vec<(f64, u16, u32)> =
        (0..150).flat_map(|seq| (0..3).map(move |who| (0.5 * f64::from(seq), who, seq))).collect();
    for (more, cause, spoilt) in [
        ("half_duplex = true, collisions = true", Fate::HalfDuplex, [true; 4]),
        ("collisions = true", Fate::Collision, [true, false, false, true]),
    ] {
        let mission = mission(&format!("duplicate_probability = 0.5\nmedium = {{ rate_bps = 2000.0, {more} }}"));
        let (emulator, outputs) = run(&mission, &words, 90.0);
        for (ledger, spoilt) in emulator.ledgers().zip(spoilt) {
            assert!(ledger.copies > 30, "{ledger:?}");
            let fate = if spoilt { Fate::CopyDropped } else { Fate::Copied };
            assert_eq!(
                (ledger.of(cause), ledger.of(fate)),
                (if spoilt { 150 } else { 0 }, ledger.copies),
                "{ledger:?}"
            );
        }
        let [copies, originals] = heard(&outputs);
        assert!(copies.is_subset(&originals));
    }
}

#[test]
fn a_copy_is_made_of_what_arrives_and_then_meets_the_link_as_it_is() {
    // Originals take 1 s, copies 1 s or, as late as they please, up to 3 s; the link is up in [0, 2) of every 4 s.
    let mission = mission(
        "delay = { jittered = { min_s = 1.0, max_s = 3.0 } }\nduplicate_probability = 1.0\n\
         switching = { periodic = { period_s = 4.0, up_from_s = 0.0, up_for_s = 2.0 } }",
    );
    let words: Vec<(f64, u16, u32)> = (0..900).map(|seq| (0.1 * f64::from(seq), 0, seq)).collect();
    let (emulator, outputs) = run(&mission, &words, 99.0);
    let ledger = emulator.ledgers().next().copied().expect("a link");
    assert_eq!((ledger.copies, ledger.copies_in_flight), (900, 0));
    let [copies, originals] = heard(&outputs);
    assert!(copies.is_subset(&originals) && copies.len() < originals.len(), "some come when the link is down");
    assert!(copies.len() as u64 == ledger.of(Fate::Copied) && ledger.of(Fate::Copied) > 100, "{ledger:?}");
    // What becomes of a copy whose original does not arrive is decided with it.
    let decided = |fate: Fate| -> BTreeSet<(u64, i64)> {
        let row = |output: &Channel| match output {
            Channel::Settled(settled) => (settled.fate == fate).then_some((settled.seq, settled.t_ns)),
            _ => None,
        };
        outputs.iter().filter_map(row).collect()
    };
    assert!(decided(Fate::LinkDown).is_subset(&decided(Fate::CopyDropped)));
}

#[test]
fn at_the_end_a_message_under_way_and_its_copy_are_both_in_flight() {
    let mission = mission("delay = { constant = { delay_s = 2.0 } }\nduplicate_probability = 1.0");
    let (mut emulator, _) = run(&mission, &[(1.0, 0, 0)], 2.0);
    emulator.finish(seconds(2.0));
    assert_eq!(fates(&drain(&mut emulator), "v1", "v2"), [(0, Fate::InFlight), (0, Fate::CopyInFlight)]);
}

#[test]
fn a_corrupt_message_is_handed_over_with_one_bit_flipped_and_counts_as_dropped() {
    let mission = mission("corrupt_probability = 0.5");
    let mut emulator = Emulator::new(mission.clone(), None);
    let (n, mut flipped, mut hits) = (20_000, 0, vec![0u32; 8 * state(&mission, 0, 0).len()]);
    for seq in 0..n {
        let now = seconds(f64::from(seq) * 0.01);
        let good = state(&mission, 0, seq);
        emulator.handle(now, Some(Sent { from: 0, bytes: good.clone() }));
        emulator.handle(now, None);
        for output in drain(&mut emulator) {
            let Channel::Deliver { bytes, .. } = output else { continue };
            let different: Vec<usize> =
                (0..8 * good.len()).filter(|bit| (bytes[bit / 8] ^ good[bit / 8]) >> (bit % 8) & 1 == 1).collect();
            assert!(different.len() <= 1 && bytes.len() == good.len());
            if !different.is_empty() {
                assert!(CoordinationState::decode(&bytes).is_err(), "the receiver notices bit {different:?}");
            }
            flipped += different.len() as u64;
            different.into_iter().for_each(|bit| hits[bit] += 1);
        }
    }
    let ledger = emulator.ledgers().next().copied().expect("a link");
    assert_eq!((ledger.of(Fate::Corrupt), ledger.dropped()), (flipped, flipped));
    assert!((flipped as f64 / f64::from(n) - 0.5).abs() < 5.0 * 0.5 / f64::from(n).sqrt(), "{flipped} of {n}");
    // Every bit alike: χ² over B bits has mean B − 1 and variance 2(B − 1).
    let (each, freedom) = (flipped as f64 / hits.len() as f64, hits.len() as f64 - 1.0);
    let chi_squared: f64 = hits.iter().map(|&count| (f64::from(count) - each).powi(2) / each).sum();
    assert!((chi_squared - freedom).abs() < 5.0 * (2.0 * freedom).sqrt(), "{chi_squared} for {freedom}");
}

/// v1, v2 and v3 in a row over a shared medium where a message takes 1 s on the air.
fn shared(more: &str) -> Arc<Mission> {
    mission(&format!(
        "delay = {{ constant = {{ delay_s = 0.25 }} }}\nmedium = {{ rate_bps = 160.0, packet_bytes = 20, {more} }}"
    ))
}

#[test]
fn a_message_takes_its_time_on_the_air_and_the_next_one_waits() {
    let mission = shared("queue = 2");
    let (_, outputs) = run(&mission, &[(1.0, 0, 0), (1.5, 0, 1), (1.6, 0, 2), (1.7, 0, 3)], 20.0);
    assert_eq!(deliveries(&outputs), [2.25, 3.25, 4.25].map(|due| (1, seconds(due))));
    assert_eq!(fates(&outputs, "v1", "v2")[3], (3, Fate::QueueFull), "one speaks, two wait");
}

#[test]
fn a_full_sender_may_drop_what_has_waited_longest() {
    let mission = shared("queue = 1, when_full = \"drop_old\"");
    let (emulator, outputs) = run(&mission, &[(1.0, 0, 0), (1.2, 0, 1), (1.4, 0, 2), (1.6, 0, 3)], 20.0);
    let wanted = [Fate::Delivered, Fate::QueueFull, Fate::QueueFull, Fate::Delivered];
    assert_eq!(fates(&outputs, "v1", "v2"), (0..).zip(wanted).collect::<Vec<_>>());
    assert!(emulator.ledgers().all(Ledger::balances));
}

#[test]
fn it_makes_no_difference_when_one_looks() {
    // The first word goes out at 1 s. Whether that is looked at then or only when the third comes, it is gone.
    let mission = shared("queue = 1, when_full = \"drop_old\"");
    let mut emulator = Emulator::new(mission.clone(), None);
    for (at, seq) in [(1.0, 0), (1.2, 1), (1.4, 2)] {
        emulator.handle(seconds(at), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
    }
    emulator.handle(seconds(20.0), None);
    let wanted = [Fate::Delivered, Fate::QueueFull, Fate::Delivered];
    assert_eq!(fates(&drain(&mut emulator), "v1", "v2"), (0..).zip(wanted).collect::<Vec<_>>());
}

#[test]
fn messages_that_overlap_at_a_receiver_destroy_one_another_there_only() {
    let mission = shared("collisions = true");
    // v1 and v3 overlap at v2; v2's word is alone at v1 and at v3.
    let words = [(1.0, 0, 0), (1.9, 2, 0), (5.0, 0, 1), (6.0, 2, 1), (10.0, 1, 0)];
    let (_, outputs) = run(&mission, &words, 20.0);
    assert_eq!(fates(&outputs, "v1", "v2"), [(0, Fate::Collision), (1, Fate::Delivered)]);
    assert_eq!(fates(&outputs, "v3", "v2"), [(0, Fate::Collision), (1, Fate::Delivered)], "end to begin is no overlap");
    assert_eq!(fates(&outputs, "v2", "v1"), [(0, Fate::Delivered)]);
    assert_eq!(fates(&outputs, "v2", "v3"), [(0, Fate::Delivered)]);
}

#[test]
fn who_speaks_hears_nothing_meanwhile() {
    for (own, fate) in
        [(1.0, Fate::HalfDuplex), (2.2, Fate::HalfDuplex), (2.25, Fate::Delivered), (0.2, Fate::Delivered)]
    {
        let mission = shared("half_duplex = true, collisions = true");
        // v1's word arrives at v2 during [1.25, 2.25).
        let mut words = [(1.0, 0, 0), (own, 1, 0)];
        words.sort_by(|a: &(f64, u16, u32), b| a.0.total_cmp(&b.0));
        let (_, outputs) = run(&mission, &words, 20.0);
        assert_eq!(fates(&outputs, "v1", "v2"), [(0, fate)], "v2 speaks at {own} s");
    }
}

#[test]
fn in_slots_nobody_disturbs_anybody() {
    let slots = "queue = 5, half_duplex = true, collisions = true, slots = { slot_s = 2.0, guard_s = 0.5 }";
    let mission = shared(slots);
    let words: Vec<(f64, u16, u32)> =
        (0..4).flat_map(|seq| (0..3).map(move |who| (f64::from(seq) * 6.0, who, seq))).collect();
    let (emulator, outputs) = run(&mission, &words, 60.0);
    assert!(emulator.ledgers().all(|ledger| ledger.delivered() == 4 && ledger.dropped() == 0));
    // Slots of v1, v2, v3 begin at 0, 2 and 4 s of every 6 s; 1 s on the air, 0.25 s under way.
    let first: Vec<(usize, Time)> = deliveries(&outputs).into_iter().take(4).collect();
    assert_eq!(first, [(1, 1.25), (0, 3.25), (2, 3.25), (1, 5.25)].map(|(to, due)| (to, seconds(due))));
}

#[test]
fn a_sender_that_comes_nearer_does_not_drown_its_own_words_and_the_guard_time_keeps_others_apart() {
    // 1 s on the air, up to 5.05 s under way, slots of 10 s of which 6 s stay silent.
    let mission = mission(
        "delay = { distance = { speed_mps = 20.0 } }\n\
         medium = { rate_bps = 160.0, packet_bytes = 20, queue = 5, half_duplex = true, collisions = true, \
         slots = { slot_s = 10.0, guard_s = 6.0 } }",
    );
    let mut emulator = Emulator::new(mission.clone(), None);
    for round in 0..3u32 {
        let begin = f64::from(round) * 30.0;
        // v1 comes 10 m nearer between two words that go out one behind the other in its slot: the second begins to arrive
        // half a second before the first has ended.
        for (at, who, seq, xi) in [
            (0.0, 0, 2 * round, 100.0),
            (0.0, 1, 2 * round, 0.0),
            (0.0, 2, 2 * round, 0.0),
            (0.1, 0, 2 * round + 1, 90.0),
            (0.1, 1, 2 * round + 1, 0.0),
        ] {
            let bytes = state_at(&mission, who, seq, xi);
            emulator.handle(seconds(begin + at), Some(Sent { from: usize::from(who), bytes }));
        }
        emulator.handle(seconds(begin + 29.9), None);
    }
    let outputs = drain(&mut emulator);
    let of_v1: Vec<i64> = outputs
        .iter()
        .filter_map(|output| match output {
            Channel::Settled(settled) if settled.link == 0 => Some(settled.due_ns),
            _ => None,
        })
        .collect();
    assert_eq!(of_v1.len(), 6);
    assert!(of_v1[1] - of_v1[0] < 600_000_000, "they overlap for half a second: {of_v1:?}");
    assert!(emulator.ledgers().all(|ledger| ledger.delivered() == ledger.sent), "{:?}", emulator.totals());
}

#[test]
fn words_of_one_sender_that_overlap_are_still_spoilt_by_anothers() {
    let mission = mission(
        "delay = { distance = { speed_mps = 20.0 } }\nmedium = { rate_bps = 160.0, packet_bytes = 20, queue = 5, collisions = true }",
    );
    let mut emulator = Emulator::new(mission.clone(), None);
    // v1's words arrive at v2 during [6.0, 7.0) and [6.5, 7.5), v3's during [6.2, 7.2).
    for (at, who, seq, xi) in [(1.0, 0, 0, 100.0), (1.1, 0, 1, 90.0), (6.15, 2, 0, 0.0)] {
        emulator.handle(seconds(at), Some(Sent { from: usize::from(who), bytes: state_at(&mission, who, seq, xi) }));
    }
    emulator.handle(seconds(20.0), None);
    let outputs = drain(&mut emulator);
    assert_eq!(fates(&outputs, "v1", "v2"), [(0, Fate::Collision), (1, Fate::Collision)]);
    assert_eq!(fates(&outputs, "v3", "v2"), [(0, Fate::Collision)]);
}

#[test]
fn who_is_absent_hears_nothing_and_its_links_are_down_until_it_is_back() {
    let mission = mission("delay = { constant = { delay_s = 1.0 } }");
    let mut emulator = Emulator::new(mission.clone(), Some(1.0));
    drain(&mut emulator);
    let say = |emulator: &mut Emulator, at: f64, from: usize, seq: u32| {
        emulator.handle(seconds(at), Some(Sent { from, bytes: state(&mission, from as u16, seq) }));
    };
    say(&mut emulator, 1.0, 1, 0); // there when it arrives
    say(&mut emulator, 2.5, 0, 0); // under way when its sender dies
    say(&mut emulator, 2.6, 2, 0); // under way to v2, who stays
    emulator.presence(seconds(3.0), 0, false);
    emulator.presence(seconds(3.0), 0, false);
    say(&mut emulator, 4.0, 1, 1); // nobody there
    emulator.handle(seconds(5.5), None);
    say(&mut emulator, 5.8, 1, 2); // back when it arrives
    emulator.presence(seconds(6.0), 0, true);
    emulator.handle(seconds(9.0), None);
    let outputs = drain(&mut emulator);
    assert_eq!(fates(&outputs, "v2", "v1"), [(0, Fate::Delivered), (1, Fate::ReceiverAbsent), (2, Fate::Delivered)]);
    assert_eq!(fates(&outputs, "v1", "v2"), [(0, Fate::Delivered)]);
    assert_eq!(fates(&outputs, "v2", "v3").iter().filter(|fate| fate.1 == Fate::Delivered).count(), 3);
    let changes: Vec<(f64, String, bool)> = outputs
        .iter()
        .filter_map(|output| match output {
            Channel::Record(Row::Exact(Record::Topology(row))) => {
                Some((row.t_ns as f64 / 1e9, format!("{}->{}", row.from, row.to), row.up))
            }
            _ => None,
        })
        .collect();
    let both = |at, up| [(at, "v1->v2".to_string(), up), (at, "v2->v1".to_string(), up)];
    assert_eq!(changes, [both(3.0, false), both(6.0, true)].concat());
    let ledger = emulator.ledgers().nth(1).copied().expect("v2->v1");
    assert_eq!((ledger.of(Fate::ReceiverAbsent), ledger.dropped(), ledger.balances()), (1, 1, true));
}

#[test]
fn who_is_absent_when_a_message_arrives_gets_no_copy_of_it_either() {
    let mission = mission("delay = { jittered = { min_s = 1.0, max_s = 60.0 } }\nduplicate_probability = 1.0");
    let mut emulator = Emulator::new(mission.clone(), Some(1.0));
    emulator.presence(seconds(0.0), 1, false);
    for seq in 0..50 {
        emulator.handle(seconds(0.5), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
    }
    // Back halfway: of what arrives from now on there are copies, of what came before there are none.
    emulator.presence(seconds(30.0), 1, true);
    emulator.handle(seconds(99.0), None);
    let ledger = emulator.ledgers().next().copied().expect("v1->v2");
    let (absent, delivered) = (ledger.of(Fate::ReceiverAbsent), ledger.delivered());
    assert!(absent > 10 && delivered > 10 && absent + delivered == 50, "{ledger:?}");
    assert_eq!((ledger.of(Fate::CopyDropped), ledger.of(Fate::Copied)), (absent, delivered));
}

#[test]
fn a_link_may_have_an_order_and_a_queue_of_its_own() {
    let exceptions = "[[network.exceptions]]\nfrom = \"v1\"\nto = \"v2\"\nqueue = 2\n\
                      [[network.exceptions]]\nfrom = \"v3\"\nto = \"v2\"\norder = \"free\"";
    let network =
        format!("order = \"in_order\"\ndelay = {{ jittered = {{ min_s = 1.0, max_s = 5.0 }} }}\n{exceptions}");
    let mission = mission(&network);
    let words: Vec<(f64, u16, u32)> =
        (0..30).flat_map(|seq| [0, 1, 2].map(move |who| (1.0 + 0.01 * f64::from(seq), who, seq))).collect();
    let (emulator, outputs) = run(&mission, &words, 60.0);
    let ledgers: Vec<_> = emulator.ledgers().map(|ledger| ledger.of(Fate::QueueFull)).collect();
    assert_eq!(ledgers, [28, 0, 0, 0]);
    let in_order = |link: usize| {
        let number = |output: &Channel| match output {
            Channel::Settled(settled) if settled.link == link => Some(settled.seq),
            _ => None,
        };
        outputs.iter().filter_map(number).is_sorted()
    };
    assert_eq!([1, 2, 3].map(in_order), [true, true, false]);
}

#[test]
fn without_slots_those_who_speak_together_collide_unless_they_wait_at_random() {
    let words: Vec<(f64, u16, u32)> =
        (0..1000).flat_map(|seq| [0, 2].map(move |who| (f64::from(seq) * 10.0, who, seq))).collect();
    let collided = |more: &str| {
        let (emulator, _) = run(&shared(&format!("collisions = true, {more}")), &words, 10_100.0);
        emulator.ledgers().map(|ledger| ledger.of(Fate::Collision)).sum::<u64>()
    };
    assert_eq!(collided("backoff_s = 0.0"), 2000);
    // Two uniform waits within 8 s overlap within 1 s with probability 1 − (7/8)² = 0.234; five standard deviations.
    let share = collided("backoff_s = 8.0") as f64 / 2000.0;
    assert!((share - 0.234).abs() < 5.0 * (0.234f64 * 0.766 / 1000.0).sqrt(), "{share}");
}

#[test]
fn a_duty_cycle_keeps_a_sender_silent() {
    let mission = shared("queue = 10, duty_cycle = 0.1");
    let (_, outputs) = run(&mission, &[(1.0, 0, 0), (1.0, 0, 1), (1.0, 0, 2)], 60.0);
    assert_eq!(deliveries(&outputs), [2.25, 12.25, 22.25].map(|due| (1, seconds(due))));
}

#[test]
fn what_waits_at_the_end_is_in_flight() {
    let mission = shared("queue = 10");
    let (mut emulator, _) = run(&mission, &[(1.0, 0, 0), (1.0, 0, 1), (1.0, 0, 2)], 2.5);
    emulator.finish(seconds(2.5));
    assert_eq!(fates(&drain(&mut emulator), "v1", "v2"), [(1, Fate::InFlight), (2, Fate::InFlight)]);
    assert_eq!(emulator.totals(), [3, 1, 0, 2]);
}

/// Networks of every kind, at random.
fn any_network() -> impl Strategy<Value = String> {
    let delay = prop_oneof![
        Just("\"none\""),
        Just("{ constant = { delay_s = 0.7 } }"),
        Just("{ jittered = { min_s = 0.2, max_s = 2.0 } }"),
        Just("{ normal = { mean_s = 1.0, deviation_s = 0.5, min_s = 0.3 } }"),
        Just("{ gamma = { mean_s = 1.0, deviation_s = 0.5, min_s = 0.1 } }"),
        Just("{ distance = { speed_mps = 20.0, extra_s = 0.2 } }"),
    ];
    let loss = prop_oneof![
        Just("\"none\""),
        Just("{ bernoulli = { probability = 0.3 } }"),
        Just("{ gilbert_elliott = { mean_burst = 3.0, mean_gap = 5.0, lost_in_burst = 0.9, lost_in_gap = 0.1 } }"),
        Just("{ shared_fades = { probability = 0.3, mean_burst = 2.0, correlation = 0.7 } }"),
        Just("{ trace = { runs = [3, 1, 2, 2] } }"),
    ];
    let range = prop_oneof![
        Just("\"unlimited\""),
        Just("{ disc = { radius_m = 25.0 } }"),
        Just("{ curve = { points = [[0.0, 1.0], [40.0, 0.2]] } }"),
    ];
    let switching = prop_oneof![
        Just("\"always\""),
        Just("{ periodic = { period_s = 3.0, up_from_s = 1.0, up_for_s = 2.0 } }"),
        Just("{ random = { alpha = 0.5, t_0_s = 2.0, dwell_s = 0.5 } }"),
        Just("{ markov = { mean_up_s = 2.0, mean_down_s = 1.0 } }"),
        Just("{ connected_in_mean = { window_s = 8.0, dwell_s = 0.5 } }"),
        Just("{ one_at_a_time = { dwell_s = 1.5 } }"),
    ];
    let medium = prop_oneof![
        2 => Just(""),
        1 => Just("medium = { rate_bps = 800.0, packet_bytes = 20, collisions = true, half_duplex = true, backoff_s = 0.4 }"),
        1 => Just("medium = { rate_bps = 800.0, queue = 2, when_full = \"drop_old\", half_duplex = true, duty_cycle = 0.5 }"),
        1 => Just("medium = { rate_bps = 2000.0, collisions = true, slots = { slot_s = 0.7, guard_s = 0.1 }, queue = 3 }"),
    ];
    let more = prop_oneof![
        Just(""),
        Just("order = \"in_order\""),
        Just("duplicate_probability = 0.3\ncorrupt_probability = 0.2"),
        Just(
            "also = [{ links = [[\"v1\", \"v2\"]], delay = { jittered = { min_s = 0.1, max_s = 0.5 } }, switching = { markov = { mean_up_s = 3.0, mean_down_s = 1.0 } } }]"
        ),
    ];
    (delay, loss, range, switching, medium, more, 1u32..30).prop_map(
        |(delay, loss, range, switching, medium, more, queue)| {
            format!(
                "delay = {delay}\nloss = {loss}\nrange = {range}\nswitching = {switching}\nqueue = {queue}\n{medium}\n{more}"
            )
        },
    )
}

/// Words at multiples of 100 ms, each by some vehicles that move as they speak.
fn say(mission: &Mission, step: u32, vehicles: &[bool]) -> Vec<(Time, Sent)> {
    let at = Time::from_nanos(i64::from(step) * 100_000_000);
    let who = (0..3u16).filter(|who| vehicles[usize::from(*who)]);
    who.map(|who| {
        let bytes = state_at(mission, who, step, f64::from(step) * (f64::from(who) - 1.0));
        (at, Sent { from: usize::from(who), bytes })
    })
    .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Whatever happens, every ledger balances, nothing is early, and nothing overtakes its instant.
    #[test]
    fn ledgers_balance_at_every_instant(
        network in any_network(), steps in proptest::collection::vec((0usize..4, 0u32..500), 1..200),
    ) {
        let mission = mission(&network);
        let mut emulator = Emulator::new(mission.clone(), None);
        let mut now = Time::ZERO;
        let mut seq = [0; 3];
        let (mut delivered, mut made) = (0, 0);
        let (mut copies, mut originals) = (BTreeSet::new(), BTreeSet::new());
        for (who, wait_ms) in steps {
            now += Span::from_nanos(i64::from(wait_ms) * 1_000_000);
            if who < 3 {
                let bytes = state_at(&mission, who as u16, seq[who], f64::from(seq[who]));
                emulator.handle(now, Some(Sent { from: who, bytes }));
                seq[who] += 1;
                made += mission.links.iter().filter(|link| link.from == who).count() as u64;
            } else {
                emulator.handle(now, None);
            }
            let outputs = drain(&mut emulator);
            prop_assert!(deliveries(&outputs).iter().all(|(_, due)| *due <= now));
            prop_assert!(deliveries(&outputs).is_sorted_by_key(|(_, due)| *due));
            prop_assert!(emulator.ledgers().all(Ledger::balances));
            let [heard_again, heard] = heard(&outputs);
            copies.extend(heard_again);
            originals.extend(heard);
            prop_assert!(copies.is_subset(&originals), "a copy is made of what was heard");
            delivered += deliveries(&outputs).len() as u64;
            let [sent, ..] = emulator.totals();
            prop_assert_eq!(sent, made, "every message is taken for every link, once");
        }
        let handed_over = [Fate::Delivered, Fate::Corrupt, Fate::Copied];
        let told: u64 = emulator.ledgers().map(|l| handed_over.iter().map(|fate| l.of(*fate)).sum::<u64>()).sum();
        prop_assert_eq!(delivered, told);
        emulator.finish(now);
        let under_way: u64 = emulator.ledgers().map(|ledger| ledger.in_flight + ledger.copies_in_flight).sum();
        let is_under_way = |o: &&Channel| matches!(
            o, Channel::Settled(settled) if [Fate::InFlight, Fate::CopyInFlight].contains(&settled.fate)
        );
        prop_assert_eq!(under_way, drain(&mut emulator).iter().filter(is_under_way).count() as u64);
    }

    /// What the stepped clock does: settle what is due up to the next word plus the least delay, and only then take what
    /// was said meanwhile. Row by row, it is what comes of taking each word at its instant.
    #[test]
    fn settling_as_far_ahead_as_allowed_changes_nothing(
        network in any_network(), said in proptest::collection::vec(proptest::array::uniform3(any::<bool>()), 20..80),
        window in 1u32..100,
    ) {
        let mission = mission(&network);
        let words = |step: u32| said.get(step as usize).map_or(Vec::new(), |who| say(&mission, step, who));
        let (steps, at) = (said.len() as u32, |step: u32| Time::from_nanos(i64::from(step) * 100_000_000));
        let mut one_by_one = Emulator::new(mission.clone(), None);
        for step in 0..steps {
            one_by_one.handle(at(step) - Span::from_nanos(1), None);
            words(step).into_iter().for_each(|(at, sent)| one_by_one.handle(at, Some(sent)));
        }
        one_by_one.handle(seconds(60.0), None);

        let mut ahead = Emulator::new(mission.clone(), None);
        let mut next = 0;
        while next < steps {
            let horizon = at(next) + mission.least_delay();
            while let Some(due) = ahead.poll_timeout().filter(|due| *due < horizon) {
                ahead.handle(due, None);
            }
            // Everyone speaks until the horizon, or until the window ends.
            let first = next;
            while next < steps && next < first + window && (next == first || at(next) <= horizon) {
                words(next).into_iter().for_each(|(at, sent)| ahead.handle(at, Some(sent)));
                next += 1;
            }
        }
        ahead.handle(seconds(60.0), None);

        let rows = |emulator: &mut Emulator| {
            let mut rows: Vec<String> = drain(emulator).iter().map(|output| format!("{output:?}")).collect();
            rows.sort();
            rows
        };
        prop_assert_eq!(rows(&mut one_by_one), rows(&mut ahead));
    }
}
