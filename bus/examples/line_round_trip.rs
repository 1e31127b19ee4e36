//! How long a small mission-plane message takes from the hub to a participant in another process and back.
//!
//! `cargo run --release -p cpf-bus --example line_round_trip -- [COUNT] [PARTICIPANTS]`
//!
//! Three measurements, one after the other: one participant at a time; the stepped clock's pattern, in which the hub
//! sends to all participants and waits for all answers; and a plain TCP socket pair in the same processes' stead, for
//! comparison on a noisy machine.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command};

use std::time::{Duration, Instant};

use bus::Plane;
use bus::clock::sharpen_this_thread;
use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::Events;
use bus::setup::{Endpoint, share_one_runtime};
use bus::switchboard::{HubEvent, LineId, Switchboard, SwitchboardConfig};

type Outcome = Result<(), Box<dyn std::error::Error>>;

const MESSAGE: [u8; 64] = [7; 64];

fn main() -> Outcome {
    // `ZENOH_RUNTIME='()'` in the environment measures without it.
    share_one_runtime();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    sharpen_this_thread();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["echo", endpoint, id] => echo(endpoint.parse()?, id),
        ["echo-tcp", address] => echo_tcp(address),
        ref numbers => {
            let number = |index: usize, default| numbers.get(index).map_or(Ok(default), |text| text.parse());
            measure(number(0, 5_000)?, number(1, 10)?)
        }
    }
}

fn echo(endpoint: Endpoint, id: &str) -> Outcome {
    let (line, events) = Line::connect(LineConfig::new(endpoint, id))?;
    for event in events {
        match event {
            LineEvent::Packet { plane, bytes, .. } => line.send(plane, &bytes)?,
            LineEvent::Connected => {}
            LineEvent::Lost | LineEvent::Refused(_) => break,
        }
    }
    Ok(())
}

fn echo_tcp(address: &str) -> Outcome {
    let mut stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let mut message = MESSAGE;
    while stream.read_exact(&mut message).is_ok() {
        stream.write_all(&message)?;
    }
    Ok(())
}

fn child(arguments: &[&str]) -> std::io::Result<Child> {
    Command::new(std::env::current_exe()?).args(arguments).spawn()
}

fn measure(count: usize, participants: usize) -> Outcome {
    let (mut hub, events) = Switchboard::open(SwitchboardConfig::new(Endpoint::local().with_port(0)))?;
    let endpoint = hub.endpoint().to_string();
    let mut children = Vec::new();
    let mut lines = Vec::new();
    for index in 0..participants.max(1) {
        children.push(child(&["echo", &endpoint, &format!("auv{index}")])?);
        match events.recv()? {
            HubEvent::Joined { line, .. } => lines.push(line),
            other => return Err(format!("{other:?} came before a participant had joined").into()),
        }
    }
    for plane in [Plane::Mission, Plane::State] {
        report(&format!("{plane} plane, one participant"), timed(count, || round(&hub, &events, plane, &lines[..1])));
    }
    let all = format!("mission plane, {} participants at once", lines.len());
    report(&all, timed(count / lines.len(), || round(&hub, &events, Plane::Mission, &lines)));
    hub.close();
    for mut child in children {
        child.wait()?;
    }

    let listener = TcpListener::bind("127.0.0.1:0")?;
    let mut plain = child(&["echo-tcp", &listener.local_addr()?.to_string()])?;
    let (mut stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    report(
        "a bare TCP socket",
        timed(count, || {
            let mut answer = MESSAGE;
            stream.write_all(&MESSAGE)?;
            stream.read_exact(&mut answer)?;
            Ok(())
        }),
    );
    drop(stream);
    plain.wait()?;
    Ok(())
}

/// Sends to every line, and waits until every line has answered.
fn round(hub: &Switchboard, events: &Events<HubEvent>, plane: Plane, lines: &[LineId]) -> Outcome {
    for &line in lines {
        hub.send(line, plane, &MESSAGE)?;
    }
    let mut answers = 0;
    while answers < lines.len() {
        match events.recv_timeout(Duration::from_secs(10))? {
            HubEvent::Packet { .. } => answers += 1,
            other => return Err(format!("{other:?}").into()),
        }
    }
    Ok(())
}

fn timed(count: usize, mut round: impl FnMut() -> Outcome) -> Result<Vec<Duration>, Box<dyn std::error::Error>> {
    for _ in 0..count / 10 {
        round()?;
    }
    (0..count)
        .map(|_| {
            let begun = Instant::now();
            round()?;
            Ok(begun.elapsed())
        })
        .collect()
}

fn report(what: &str, times: Result<Vec<Duration>, Box<dyn std::error::Error>>) {
    match times {
        Ok(mut times) if !times.is_empty() => {
            times.sort();
            let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_micros();
            println!("{what}: p50 {} us, p90 {} us, p99 {} us, p99.9 {} us", at(0.5), at(0.9), at(0.99), at(0.999));
        }
        Ok(_) => println!("{what}: nothing measured"),
        Err(error) => println!("{what}: {error}"),
    }
}
