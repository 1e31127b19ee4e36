//! What passes on a line, and what does not.

use std::sync::mpsc;

use bus::switchboard::{HubEvent, Switchboard, SwitchboardConfig};
use bus::{Error, Plane};
use zenoh::Wait;

use crate::support::*;

fn pattern(length: usize) -> Vec<u8> {
    (0..length).map(|i| (i % 251) as u8).collect()
}

#[test]
fn both_planes_pass_both_ways() {
    let (hub, hub_events) = hub();
    let (auv, auv_events, one) = joined(&hub, &hub_events, "auv1");
    let (control, control_events, two) = joined(&hub, &hub_events, "mission-control");
    assert_ne!(one, two);
    assert_eq!((hub.id(one).as_deref(), hub.id(two).as_deref()), (Some("auv1"), Some("mission-control")));

    for plane in [Plane::State, Plane::Mission] {
        auv.send(plane, b"from the vehicle").expect("connected");
        assert_eq!(expect_up(&hub_events, one), (plane, b"from the vehicle".to_vec()));
        control.send(plane, b"from ashore").expect("connected");
        assert_eq!(expect_up(&hub_events, two), (plane, b"from ashore".to_vec()));
        hub.send(one, plane, b"to the vehicle").expect("joined");
        hub.send(two, plane, b"").expect("joined");
        assert_eq!(expect_down(&auv_events), (plane, b"to the vehicle".to_vec()));
        assert_eq!(expect_down(&control_events), (plane, Vec::new()));
    }
    let counts = auv.counts();
    assert_eq!((counts.state_in, counts.mission_in, counts.state_out, counts.mission_out), (1, 1, 1, 1));
    assert_eq!(hub.counts(one).expect("known").garbage, 0);

    auv.close();
    assert_eq!(next(&hub_events), HubEvent::Left { line: one });
    assert_eq!(hub.send(one, Plane::State, b"late"), Err(Error::NotConnected));
}

#[test]
fn large_mission_messages_arrive_whole_and_in_order_with_small_ones() {
    let (hub, hub_events) = hub();
    let (auv, auv_events, number) = joined(&hub, &hub_events, "auv1");
    let messages =
        [pattern(1 << 20), pattern(3), pattern(4 << 20), pattern(32 << 10), pattern((32 << 10) + 1), pattern(0)];
    for message in &messages {
        auv.send(Plane::Mission, message).expect("connected");
        hub.send(number, Plane::Mission, message).expect("joined");
    }
    for message in messages {
        assert!(expect_up(&hub_events, number) == (Plane::Mission, message.clone()), "{} bytes up", message.len());
        assert!(expect_down(&auv_events) == (Plane::Mission, message.clone()), "{} bytes down", message.len());
    }
    let too_large = pattern((4 << 20) + 1);
    assert_eq!(
        auv.send(Plane::Mission, &too_large),
        Err(Error::TooLarge { plane: Plane::Mission, bytes: too_large.len() })
    );
    assert!(matches!(hub.send(number, Plane::State, &pattern(9 << 10)), Err(Error::TooLarge { .. })));
}

/// The stepped clock relies on this: on the mission plane none is lost and none is overtaken, whichever way each took.
#[test]
fn ten_thousand_mission_messages_keep_their_order_both_ways_at_once() {
    const COUNT: u32 = 10_000;
    let (hub, hub_events) = hub();
    let (auv, auv_events, number) = joined(&hub, &hub_events, "auv1");
    // Every hundredth is too large for one frame and takes the slower way.
    let message = |i: u32| {
        let mut bytes = i.to_le_bytes().to_vec();
        bytes.resize(if i % 100 == 99 { 40_000 } else { 60 }, 0);
        bytes
    };
    let serial = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    std::thread::scope(|scope| {
        scope.spawn(|| (0..COUNT).for_each(|i| auv.send(Plane::Mission, &message(i)).expect("connected")));
        scope.spawn(|| (0..COUNT).for_each(|i| hub.send(number, Plane::Mission, &message(i)).expect("joined")));
        for i in 0..COUNT {
            assert_eq!(serial(&expect_up(&hub_events, number).1), i);
            assert_eq!(serial(&expect_down(&auv_events).1), i);
        }
    });
    assert_eq!((auv.counts().mission_in, auv.counts().mission_out), (COUNT.into(), COUNT.into()));
}

#[test]
fn a_burst_of_state_messages_keeps_its_order_and_loses_none_to_a_living_receiver() {
    const COUNT: u32 = 1_000;
    let (hub, hub_events) = hub();
    let (auv, auv_events, number) = joined(&hub, &hub_events, "auv1");
    for i in 0..COUNT {
        hub.send(number, Plane::State, &i.to_le_bytes()).expect("joined");
        auv.send(Plane::State, &i.to_le_bytes()).expect("connected");
    }
    for i in 0..COUNT {
        assert_eq!(expect_down(&auv_events), (Plane::State, i.to_le_bytes().to_vec()));
        assert_eq!(expect_up(&hub_events, number), (Plane::State, i.to_le_bytes().to_vec()));
    }
}

#[test]
fn a_program_that_does_not_listen_loses_the_oldest_messages_and_is_told_how_many() {
    let mut config = SwitchboardConfig::new(any_port());
    config.queue = 4;
    let (hub, hub_events) = Switchboard::open(config).expect("the hub opens");
    let (auv, auv_events, number) = joined(&hub, &hub_events, "auv1");
    for i in 0..10u8 {
        auv.send(Plane::State, &[i]).expect("connected");
    }
    // Leaving waits for what was sent before to arrive.
    auv.close();
    drop(auv_events);
    for i in 6..10u8 {
        assert_eq!(expect_up(&hub_events, number), (Plane::State, vec![i]));
    }
    assert_eq!(next(&hub_events), HubEvent::Left { line: number });
    assert_eq!(hub.counts(number).expect("known").state_dropped, 6);
}

#[test]
fn a_participant_that_takes_nothing_costs_the_oldest_states_with_a_count_and_gets_the_newest_when_it_does() {
    const COUNT: u32 = 40_000;
    /// Bundles on their way at most, what each is reckoned to cost, and how many messages of these 6 bytes are put together.
    const ON_THEIR_WAY: u64 = 32;
    const COST: u64 = 16 << 10;
    const MESSAGES_TOGETHER: u64 = (2 << 10) / 6;
    let (hub, hub_events) = hub();
    let lobby = plain_client(hub.endpoint().port());
    let client = plain_client(ask_for_line(&lobby, "idler", 7).expect("let in"));
    let (heard, hears) = mpsc::channel();
    hear_everything(&client, heard);
    let put = |bytes: Vec<u8>| {
        let congestion = zenoh::qos::CongestionControl::Block;
        client.put("cpf/idler/up/mission", bytes).congestion_control(congestion).wait().expect("open");
    };
    put(hello(7));
    let number = expect_joined(&hub_events, "idler");
    // What was never sent cannot have arrived.
    put([&[0x14][..], &u64::MAX.to_le_bytes()].concat());
    put([&[0x12][..], &u64::MAX.to_le_bytes()].concat());
    put([&[0x01][..], b"fence"].concat());
    assert_eq!(expect_up(&hub_events, number), (Plane::Mission, b"fence".to_vec()));
    assert_eq!(hub.counts(number).expect("known").garbage, 2);
    // It never says that anything has arrived, as one that is frozen.
    (0..COUNT).for_each(|i| hub.send(number, Plane::State, &i.to_le_bytes()).expect("joined"));
    let counts = hub.counts(number).expect("known");
    let waiting = u64::from(COUNT) - counts.state_out - counts.state_unsent;
    assert!(counts.state_unsent > u64::from(COUNT) / 2, "{counts:?}");
    // As many bundles as may be are on their way, each with the first message that came for it, and the newest wait.
    assert_eq!(counts.state_out, ON_THEIR_WAY, "{counts:?}");
    assert!(waiting * 6 <= 64 << 10 && waiting * 6 > 60 << 10, "{counts:?}, {waiting} wait");

    // Once it has taken all, what waits goes out: the newest, in order, and many together.
    let mut taken = vec![0x14];
    taken.extend((ON_THEIR_WAY * COST).to_le_bytes());
    put(taken);
    let (mut received, mut bundles) = (Vec::new(), 0);
    for (_, bundle) in hears.iter().filter(|(key, _)| key.ends_with("/state")) {
        for message in bundle.chunks(6) {
            let number: [u8; 4] = message[2..].try_into().expect("of four bytes each");
            received.push(u64::from(u32::from_le_bytes(number)));
        }
        bundles += 1;
        if bundles == ON_THEIR_WAY + waiting.div_ceil(MESSAGES_TOGETHER).min(ON_THEIR_WAY) {
            break;
        }
    }
    let all: Vec<u64> = (0..ON_THEIR_WAY).chain(u64::from(COUNT) - waiting..u64::from(COUNT)).collect();
    assert!(received.len() as u64 > 10 * bundles);
    assert_eq!(received, all[..received.len()]);
}

#[test]
fn oversized_and_meaningless_frames_are_counted_and_do_no_harm() {
    let (hub, hub_events) = hub();
    let lobby = plain_client(hub.endpoint().port());
    let port = ask_for_line(&lobby, "rogue", 7).expect("let in");
    let client = plain_client(port);
    let (heard, hears) = mpsc::channel();
    hear_everything(&client, heard);
    let put = |plane: &str, bytes: Vec<u8>| {
        let congestion = zenoh::qos::CongestionControl::Block;
        client.put(format!("cpf/rogue/up/{plane}"), bytes).congestion_control(congestion).wait().expect("open");
    };
    put("mission", hello(8)); // of another admission
    put("mission", hello(7));
    let number = expect_joined(&hub_events, "rogue");
    assert_eq!(next(&hears).0, "cpf/rogue/down/mission");

    put("mission", vec![]);
    put("mission", vec![0xff, 1, 2, 3]);
    put("mission", vec![0x02, 1]);
    put("mission", [&[0x02, 1, 0, 0, 0, 5, 0, 9, 0][..], &[0; 100]].concat()); // the sixth part of nothing
    put("mission", [&[0x02, 1, 0, 0, 0, 0, 0, 0xff, 0xff][..], &[0; 32 << 10]].concat()); // 2 GiB announced
    put("mission", [&[0x02, 1, 0, 0, 0, 0, 0, 2, 0][..], &[0; 32 << 10]].concat()); // begun, and interrupted
    put("state", alone(&pattern(9 << 10)));
    put("state", vec![9, 0, 1]);
    put("state", pattern(41 << 10));
    put("state", pattern(200 << 10)); // the transport itself throws this one away
    put("mission", [&[0x01][..], b"fence"].concat());

    assert_eq!(expect_up(&hub_events, number), (Plane::Mission, b"fence".to_vec()));
    let counts = hub.counts(number).expect("known");
    assert_eq!((counts.garbage, counts.oversized, counts.mission_in, counts.state_in), (8, 1, 1, 0));
}
