//! Nothing crosses except through the hub's program: tried with Zenoh clients that know nothing of this project.

use std::sync::mpsc;

use bus::Plane;
use zenoh::Wait;

use crate::support::*;

#[test]
fn a_line_that_subscribes_to_everything_hears_only_its_inbox() {
    let (hub, hub_events) = hub();
    let lobby = plain_client(hub.endpoint().port());
    let port = ask_for_line(&lobby, "nosy", 1).expect("let in");
    let (nosy, accomplice) = (plain_client(port), plain_client(port));
    let (heard, hears) = mpsc::channel();
    hear_everything(&nosy, heard);
    nosy.put("cpf/nosy/up/mission", hello(1)).wait().expect("open");
    let nosy_line = expect_joined(&hub_events, "nosy");
    assert_eq!(next(&hears).0, "cpf/nosy/down/mission", "the welcome");

    let (auv, auv_events, auv_line) = joined(&hub, &hub_events, "auv1");
    for plane in [Plane::State, Plane::Mission] {
        auv.send(plane, b"up").expect("connected");
        assert_eq!(expect_up(&hub_events, auv_line).0, plane);
        hub.send(auv_line, plane, b"down").expect("joined");
        assert_eq!(expect_down(&auv_events).0, plane);
    }
    // Even on its own line, from another client, only what comes from the hub is heard.
    for key in ["cpf/nosy/down/state", "cpf/nosy/down/mission", "cpf/auv1/down/state", "x"] {
        accomplice.put(key, "forged").wait().expect("open");
    }
    accomplice.put("cpf/nosy/up/state", alone(b"fence")).wait().expect("open");
    assert_eq!(expect_up(&hub_events, nosy_line), (Plane::State, b"fence".to_vec()));

    hub.send(nosy_line, Plane::State, b"for nosy").expect("joined");
    assert_eq!(next(&hears), ("cpf/nosy/down/state".into(), alone(b"for nosy")));
    assert!(hears.try_recv().is_err());
}

#[test]
fn what_is_put_on_any_other_key_goes_nowhere() {
    let (hub, hub_events) = hub();
    let (_auv, auv_events, auv_line) = joined(&hub, &hub_events, "auv1");
    let lobby = plain_client(hub.endpoint().port());
    let port = ask_for_line(&lobby, "rogue", 1).expect("let in");
    let rogue = plain_client(port);
    rogue.put("cpf/rogue/up/mission", hello(1)).wait().expect("open");
    let rogue_line = expect_joined(&hub_events, "rogue");

    let others = [
        "cpf/rogue/down/state",
        "cpf/rogue/down/mission",
        "cpf/rogue/up",
        "cpf/rogue/up/state/x",
        "cpf/rogue/up/other",
        "cpf/auv1/up/state",
        "cpf/auv1/up/mission",
        "cpf/auv1/down/state",
        "cpf/auv1/down/mission",
        "cpf/join/rogue",
        "x",
    ];
    for key in others {
        rogue.put(key, "forged").wait().expect("open");
        rogue.delete(key).wait().expect("open");
    }
    rogue.delete("cpf/rogue/up/state").wait().expect("open");
    rogue.put("cpf/rogue/up/state", alone(b"fence")).wait().expect("open");
    assert_eq!(expect_up(&hub_events, rogue_line), (Plane::State, b"fence".to_vec()), "and nothing before it");

    hub.send(auv_line, Plane::State, b"fence").expect("joined");
    assert_eq!(expect_down(&auv_events), (Plane::State, b"fence".to_vec()), "and nothing before it");
}

#[test]
fn clients_in_the_lobby_cannot_hear_or_deceive_each_other() {
    let (hub, _hub_events) = hub();
    let port = hub.endpoint().port();
    let (one, other) = (plain_client(port), plain_client(port));
    let (heard, hears) = mpsc::channel();
    hear_everything(&one, heard.clone());
    // A false hub: this one would answer in the true one's place.
    for key in ["cpf/join/*", "cpf/join/victim", "**"] {
        let heard = heard.clone();
        one.declare_queryable(key)
            .allowed_origin(zenoh::sample::Locality::Remote)
            .callback(move |query| {
                let _ = heard.send((query.key_expr().to_string(), Vec::new()));
            })
            .background()
            .wait()
            .expect("declaring succeeds");
    }
    // An answer to a question of its own comes after everything that the hub had for this client before.
    assert!(ask_for_line(&one, "one", 1).is_ok());
    for key in ["x", "cpf/join/one", "cpf/one/down/state", "cpf/one/up/state"] {
        other.put(key, "forged").wait().expect("open");
    }
    assert!(ask_for_line(&other, "victim", 1).is_ok());
    assert!(ask_for_line(&one, "one", 1).is_ok());
    assert!(hears.try_recv().is_err());
}
