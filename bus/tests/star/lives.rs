//! Duplicates, deaths, freezes and returns.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use crate::support::*;
use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::{Wake, recv_until};
use bus::setup::Endpoint;
use bus::switchboard::{HubEvent, Switchboard, SwitchboardConfig};
use bus::{Error, PROTOCOL_VERSION, Plane, Refusal};

#[test]
#[ignore = "a role: a participant that sends back what it gets"]
fn echoing_participant() {
    let (line, events) = line(&role_endpoint(), "auv1");
    while let Ok(event) = events.recv() {
        if let LineEvent::Packet { plane, bytes, .. } = event {
            let _ = line.send(plane, &bytes);
        }
    }
}

#[test]
#[ignore = "a role: a hub that sends back what it gets"]
fn echoing_hub() {
    let (hub, events) = Switchboard::open(SwitchboardConfig::new(role_endpoint())).expect("the hub opens");
    while let Ok(event) = events.recv() {
        if let HubEvent::Packet { line, plane, bytes, .. } = event {
            let _ = hub.send(line, plane, &bytes);
        }
    }
}

#[test]
fn a_living_participant_keeps_its_identity_for_itself() {
    let (hub, hub_events) = hub();
    let (first, first_events, number) = joined(&hub, &hub_events, "auv1");
    let mut config = LineConfig::new(hub.endpoint().clone(), "auv1");
    config.patience = Some(PATIENCE);
    let error = Line::connect(config.clone()).expect_err("the identity is taken");
    assert_eq!(error, Error::Refused(Refusal::Taken { id: "auv1".into() }));
    assert_eq!(error.to_string(), "auv1 is already connected");

    hub.send(number, Plane::Mission, b"undisturbed").expect("joined");
    assert_eq!(expect_down(&first_events), (Plane::Mission, b"undisturbed".to_vec()));
    first.close();
    assert_eq!(next(&hub_events), HubEvent::Left { line: number });
    let (_second, _events, again) = joined(&hub, &hub_events, "auv1");
    assert_eq!(again, number);
}

#[test]
fn the_hub_says_why_it_lets_somebody_not_in() {
    let mut config = SwitchboardConfig::new(any_port());
    config.max_lines = 1;
    let (hub, hub_events) = Switchboard::open(config).expect("the hub opens");
    let (_auv, _events, _) = joined(&hub, &hub_events, "auv1");
    let connect =
        |id: &str| Line::connect(LineConfig::new(hub.endpoint().clone(), id)).expect_err("refused").to_string();
    assert!(connect("AUV 2").contains("`AUV 2` cannot be an identity"));
    assert_eq!(connect("auv2"), "all 1 lines of the network-emulator are taken");

    // The hub does not trust participants to have checked.
    let lobby = plain_client(hub.endpoint().port());
    assert_eq!(ask_for_line(&lobby, "AUV2", 1), Err("id: AUV2".into()));
    let replies = zenoh::Wait::wait(lobby.get("cpf/join/auv1?version=9;nonce=1")).expect("asking succeeds");
    let refusal = replies.recv().expect("an answer").into_result().expect_err("refused");
    assert_eq!(refusal.payload().try_to_string().expect("text"), format!("version: {PROTOCOL_VERSION} 9"));
}

#[test]
fn who_is_let_in_and_never_comes_gives_its_place_back() {
    let mut config = SwitchboardConfig::new(any_port());
    (config.max_lines, config.absence) = (2, Duration::from_millis(200));
    let (hub, hub_events) = Switchboard::open(config).expect("the hub opens");
    let (auv, _events, number) = joined(&hub, &hub_events, "auv1");
    let lobby = plain_client(hub.endpoint().port());
    ask_for_line(&lobby, "ghost", 1).expect("there is a place");
    let deadline = Instant::now() + PATIENCE;
    let admitted = || match ask_for_line(&lobby, "auv2", 2) {
        Ok(port) => Some(port),
        Err(refusal) => {
            assert_eq!(refusal, "full: 2");
            None
        }
    };
    while admitted().is_none() {
        assert!(Instant::now() < deadline, "the ghost has its place for ever");
    }
    // Who has come has it for good, and the next has the ghost's.
    let client = plain_client(ask_for_line(&lobby, "auv2", 2).expect("let in"));
    let put = client.put("cpf/auv2/up/mission", hello(2)).congestion_control(zenoh::qos::CongestionControl::Block);
    zenoh::Wait::wait(put).expect("open");
    let second = expect_joined(&hub_events, "auv2");
    assert_eq!((number.index(), second.index()), (0, 1));
    assert_eq!(hub.id(second).as_deref(), Some("auv2"));
    auv.close();
    assert_eq!(next(&hub_events), HubEvent::Left { line: number });
    assert_eq!(ask_for_line(&lobby, "ghost", 3), Err("full: 2".into()), "it may come back");
}

#[test]
fn a_killed_participant_leaves_and_its_successor_gets_the_same_line() {
    let (hub, hub_events) = hub();
    let mut lines = Vec::new();
    for life in 0..3u8 {
        let actor = Actor::start("lives::echoing_participant", hub.endpoint());
        let number = expect_joined(&hub_events, "auv1");
        hub.send(number, Plane::Mission, &[life]).expect("joined");
        assert_eq!(expect_up(&hub_events, number), (Plane::Mission, vec![life]));
        actor.kill();
        assert_eq!(next(&hub_events), HubEvent::Left { line: number });
        assert_eq!(hub.send(number, Plane::Mission, b"to the dead"), Err(Error::NotConnected));
        lines.push(number);
    }
    assert!(lines.iter().all(|line| *line == lines[0]), "{lines:?}");
}

#[test]
fn a_line_outlives_its_hub() {
    let endpoint = free_endpoint();
    let mut actor = Actor::start("lives::echoing_hub", &endpoint);
    let (line, events) = line(&endpoint, "auv1");
    for life in 0..2u8 {
        for plane in [Plane::State, Plane::Mission] {
            line.send(plane, &[life]).expect("connected");
            assert_eq!(expect_down(&events), (plane, vec![life]));
        }
        actor.kill();
        assert_eq!(next(&events), LineEvent::Lost);
        assert_eq!(line.send(Plane::Mission, b"to nobody"), Err(Error::NotConnected));
        actor = Actor::start("lives::echoing_hub", &endpoint);
        assert_eq!(next(&events), LineEvent::Connected);
    }
    line.send(Plane::Mission, b"again").expect("who hears Connected may send at once");
    assert_eq!(expect_down(&events), (Plane::Mission, b"again".to_vec()));
}

#[test]
fn a_hub_that_closes_says_good_bye_after_its_last_word() {
    let (mut hub, hub_events) = hub();
    let (line, events, number) = joined(&hub, &hub_events, "auv1");
    let last_word = vec![7; 3 << 20];
    hub.send(number, Plane::Mission, &last_word).expect("joined");
    hub.close();
    assert!(expect_down(&events) == (Plane::Mission, last_word));
    assert_eq!(next(&events), LineEvent::Lost);
    assert_eq!(next(&hub_events), HubEvent::Left { line: number });
    assert_eq!(recv_until(&hub_events, Some(Instant::now() + PATIENCE)), Wake::Closed);
    drop(line);
}

#[test]
fn a_hub_that_ends_on_the_last_word_is_not_missed() {
    let (mut hub, hub_events) = hub();
    let (line, events, number) = joined(&hub, &hub_events, "auv1");
    let hub = std::thread::spawn(move || {
        assert_eq!(expect_up(&hub_events, number), (Plane::Mission, b"that is all".to_vec()));
        hub.close();
    });
    line.close_with(Plane::Mission, b"that is all").expect("connected");
    hub.join().expect("it heard it");
    assert_eq!(recv_until(&events, Some(Instant::now() + PATIENCE)), Wake::Closed, "not Lost before it");
}

/// If a send to the frozen one waited for it, the hub would be held up until it is held for dead, and its `Left` would
/// come before the living one's answers.
#[test]
fn a_frozen_participant_holds_up_nobody_and_comes_back() {
    let (hub, hub_events) = hub();
    let actor = Actor::start("lives::echoing_participant", hub.endpoint());
    let frozen = expect_joined(&hub_events, "auv1");
    let (living, living_events, number) = joined(&hub, &hub_events, "auv2");
    actor.freeze();

    // More than the transport, the sockets and the backlog can hold.
    for i in 0..20u8 {
        for _ in 0..100 {
            hub.send(frozen, Plane::State, &[i; 8 << 10]).expect("joined");
        }
        match hub.send(frozen, Plane::Mission, &vec![i; 4 << 20]) {
            Ok(()) | Err(Error::Backlogged) => {}
            Err(other) => panic!("{other}"),
        }
        for plane in [Plane::State, Plane::Mission] {
            hub.send(number, plane, &[i]).expect("joined");
            assert_eq!(expect_down(&living_events), (plane, vec![i]));
            living.send(plane, &[i]).expect("connected");
            assert_eq!(expect_up(&hub_events, number), (plane, vec![i]));
        }
    }
    assert_eq!(hub.counts(frozen).expect("known").backlogged, 4, "of 80 MiB, 64 are kept");
    assert_eq!(next(&hub_events), HubEvent::Left { line: frozen }, "the lease has ended");

    actor.thaw();
    // And nothing before it: what the ghost had still to say is not heard.
    let back = expect_joined(&hub_events, "auv1");
    assert_eq!(back, frozen);
    hub.send(frozen, Plane::Mission, b"welcome back").expect("joined");
    assert_eq!(expect_up(&hub_events, frozen), (Plane::Mission, b"welcome back".to_vec()));
}

#[test]
fn a_frozen_hub_is_lost_and_found_again() {
    let endpoint = free_endpoint();
    let actor = Actor::start("lives::echoing_hub", &endpoint);
    let (line, events) = line(&endpoint, "auv1");
    actor.freeze();
    assert_eq!(next(&events), LineEvent::Lost);
    actor.thaw();
    assert_eq!(next(&events), LineEvent::Connected);
    line.send(Plane::Mission, b"again").expect("connected");
    assert_eq!(expect_down(&events), (Plane::Mission, b"again".to_vec()));
}

#[test]
fn a_line_that_the_next_hub_refuses_says_so_and_ends() {
    let (mut first, _first_events) = hub();
    let endpoint = first.endpoint().clone();
    let (line, events) = line(&endpoint, "auv1");
    first.close();
    assert_eq!(next(&events), LineEvent::Lost);
    let mut config = SwitchboardConfig::new(endpoint);
    config.max_lines = 0;
    let (_second, _second_events) = Switchboard::open(config).expect("the port is free again");
    assert_eq!(next(&events), LineEvent::Refused(Refusal::Full { lines: 0 }));
    assert_eq!(recv_until(&events, Some(Instant::now() + PATIENCE)), Wake::Closed);
    assert_eq!(line.send(Plane::State, b"x"), Err(Error::NotConnected));
}

#[test]
fn a_port_in_use_is_one_clear_error() {
    let holder = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let endpoint = Endpoint::local().with_port(holder.local_addr().expect("bound").port());
    let error = Switchboard::open(SwitchboardConfig::new(endpoint.clone())).expect_err("in use");
    assert_eq!(error, Error::PortInUse(endpoint.clone()));
    assert!(error.to_string().contains(&format!("{endpoint} is already in use")), "{error}");
    assert!(error.to_string().contains("another port with --listen"), "{error}");
    let (hub, _events) = hub();
    let second = Switchboard::open(SwitchboardConfig::new(hub.endpoint().clone())).expect_err("in use");
    assert_eq!(second, Error::PortInUse(hub.endpoint().clone()));
}

#[test]
fn patience_ends_where_there_is_no_hub() {
    let endpoint = free_endpoint();
    let mut config = LineConfig::new(endpoint.clone(), "auv1");
    config.patience = Some(Duration::from_millis(300));
    let begun = Instant::now();
    let error = Line::connect(config).expect_err("nobody is there");
    assert!(begun.elapsed() >= Duration::from_millis(300));
    assert!(error.to_string().contains(&endpoint.to_string()), "{error}");
    assert!(matches!(error, Error::NoHub { .. }));
}

/// A vehicle whose starter is gone must not look for a hub that will never come.
#[test]
fn waiting_ends_when_it_is_in_vain() {
    let mut asked = 0;
    let mut in_vain = || {
        asked += 1;
        (asked == 3).then(|| "mission-control is gone".to_string())
    };
    let error =
        Line::connect_unless(LineConfig::new(free_endpoint(), "auv1"), &mut in_vain).expect_err("nobody is there");
    assert_eq!(error, Error::InVain("mission-control is gone".to_string()));
    assert_eq!(asked, 3);
}
