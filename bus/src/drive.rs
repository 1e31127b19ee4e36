//! The one loop that all three programs share: wait for a message or for the machine's deadline, let the machine
//! decide, carry out what it wants.
//!
//! It runs on the thread that calls it, with absolute deadlines and a sharpened timer, away from every async runtime.

use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant, SystemTime};

use common::machine::Machine;
use common::time::Time;
use common::wire::vehicle::ClockPlan;

use crate::clock::{RealClock, Wake, recv_until, sharpen_this_thread};

/// How often a program looks after its files and signals even if nothing happens.
const TEND_PERIOD: Duration = Duration::from_millis(100);

/// Mission time as a program sees it.
#[derive(Clone, Copy, Debug, Default)]
pub enum Clock {
    /// No flight with a real clock is under way: time stands, and machines have no deadlines.
    #[default]
    Stopped,
    /// Mission time on the wall clock.
    Real(RealClock),
}

impl Clock {
    /// The clock that others have planned; a stepped run has none.
    pub fn follow(plan: ClockPlan) -> Clock {
        match plan {
            ClockPlan::Stepped => Clock::Stopped,
            ClockPlan::Real { epoch_unix_ns, speed_up } => {
                let epoch = SystemTime::UNIX_EPOCH + Duration::from_nanos(epoch_unix_ns.max(0) as u64);
                Clock::Real(RealClock::new(epoch, speed_up))
            }
        }
    }

    /// A plan whose mission time zero is this long from now.
    pub fn plan(lead: Duration, speed_up: f64) -> ClockPlan {
        let epoch = SystemTime::now() + lead;
        let since = epoch.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        ClockPlan::Real { epoch_unix_ns: i64::try_from(since.as_nanos()).unwrap_or(i64::MAX), speed_up }
    }

    /// A clock that begins now.
    pub fn from_now() -> Clock {
        Clock::Real(RealClock::new(SystemTime::now(), 1.0))
    }

    /// Mission time at this moment; zero while no clock runs.
    pub fn now(&self) -> Time {
        self.time_at(Instant::now())
    }

    /// Mission time at a moment of this process.
    pub fn time_at(&self, instant: Instant) -> Time {
        match self {
            Clock::Stopped => Time::ZERO,
            Clock::Real(clock) => clock.time_at(instant),
        }
    }

    /// The moment of a mission time; none while no clock runs.
    pub fn instant_of(&self, time: Time) -> Option<Instant> {
        match self {
            Clock::Stopped => None,
            Clock::Real(clock) => clock.instant_of(time),
        }
    }
}

/// What a program does around its machine: turns events into inputs and outputs into deeds.
pub trait Port {
    /// The machine that decides.
    type Machine: Machine;
    /// What arrives on the program's queue.
    type Event;
    /// How the program ends.
    type Exit;

    /// What an event means to the machine, and when it happened.
    fn translate(&mut self, event: Self::Event) -> Option<(Option<Instant>, Input<Self>)>;

    /// Does what the machine wants; may answer it at once, or end the program.
    fn perform(&mut self, output: Output<Self>, clock: &mut Clock) -> Next<Self>;

    /// Looks after files and signals; called every 100 ms or more often.
    fn tend(&mut self, machine: &Self::Machine) -> Next<Self>;

    /// The other end of the queue is gone.
    fn closed(&mut self) -> Self::Exit;
}

/// The inputs of a port's machine.
pub type Input<P> = <<P as Port>::Machine as Machine>::Input;
/// The outputs of a port's machine.
pub type Output<P> = <<P as Port>::Machine as Machine>::Output;

/// What follows a deed.
pub enum Next<P: Port + ?Sized> {
    /// The next one.
    Go,
    /// The machine must know this.
    Feed(Input<P>),
    /// The end of the program.
    Exit(P::Exit),
}

/// How long a program that was started for one flight has had nothing to fly: an orphan must not live for ever.
#[derive(Clone, Copy, Debug)]
pub struct Rest(Instant);

impl Default for Rest {
    fn default() -> Rest {
        Rest(Instant::now())
    }
}

impl Rest {
    /// Ten minutes.
    const LIMIT: Duration = Duration::from_secs(600);

    /// How long it has lasted.
    pub fn lasted(&self) -> Duration {
        self.0.elapsed()
    }

    /// Lets time pass before the next attempt at something that only time can change.
    pub fn pause(length: Duration) {
        std::thread::sleep(length);
    }

    /// Whether the rest has lasted too long; flying begins it anew.
    pub fn is_over(&mut self, flying: bool) -> bool {
        if flying {
            *self = Rest::default();
        }
        self.0.elapsed() > Rest::LIMIT
    }
}

/// Runs a program until its port ends it.
pub fn drive<P: Port>(
    machine: &mut P::Machine,
    port: &mut P,
    clock: &mut Clock,
    events: &Receiver<P::Event>,
) -> P::Exit {
    sharpen_this_thread();
    let mut tend_at = Instant::now() + TEND_PERIOD;
    loop {
        if let Some(exit) = carry_out(machine, port, clock) {
            return exit;
        }
        let deadline = machine.poll_timeout().and_then(|time| clock.instant_of(time));
        let wake = deadline.map_or(tend_at, |deadline| deadline.min(tend_at));
        match recv_until(events, Some(wake)) {
            Wake::Closed => return port.closed(),
            Wake::Deadline => {}
            Wake::Message(event) => {
                if let Some((at, input)) = port.translate(event) {
                    let now = at.map_or_else(|| clock.now(), |at| clock.time_at(at));
                    machine.handle(now, Some(input));
                }
            }
        }
        // Also after a message: a flood of them must not starve the machine of its deadlines.
        let moment = Instant::now();
        if deadline.is_some_and(|deadline| deadline <= moment) {
            machine.handle(clock.now(), None);
        }
        if moment >= tend_at {
            tend_at = moment + TEND_PERIOD;
            match port.tend(machine) {
                Next::Go => {}
                Next::Feed(input) => machine.handle(clock.now(), Some(input)),
                Next::Exit(exit) => return exit,
            }
        }
    }
}

/// Carries out everything the machine wants.
fn carry_out<P: Port>(machine: &mut P::Machine, port: &mut P, clock: &mut Clock) -> Option<P::Exit> {
    while let Some(output) = machine.poll_output() {
        match port.perform(output, clock) {
            Next::Go => {}
            Next::Feed(input) => machine.handle(clock.now(), Some(input)),
            Next::Exit(exit) => return Some(exit),
        }
    }
    None
}
