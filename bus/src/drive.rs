//! The one loop that all three programs share: wait for a message or for the machine's deadline, let the machine
//! decide, carry out what it wants.
//!
//! It runs on the thread that calls it, with absolute deadlines and a sharpened timer, away from every async runtime.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use common::machine::Machine;
use common::time::Time;
use common::wire::vehicle::ClockPlan;

use crate::clock::{RealClock, sharpen_this_thread};
use crate::lead::Lead;
use crate::queue::{Events, Wake};

/// How often a program looks after its files and signals even if nothing happens.
const TEND_PERIOD: Duration = Duration::from_millis(100);

/// How many messages are handled before what they led to is sent.
const HELPING: usize = 256;

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

    /// Whether the loop shall be awake when the machine's deadlines come, so as to meet them to a few microseconds where it can. That costs up to
    /// 100 µs of a processor for each, and an eighth of one in all.
    const PUNCTUAL: bool = false;

    /// What an event means to the machine, and when it happened.
    fn translate(&mut self, event: Self::Event) -> Option<(Option<Instant>, Input<Self>)>;

    /// Does what the machine wants; may answer it at once, or end the program.
    fn perform(&mut self, output: Output<Self>, clock: &mut Clock) -> Next<Self>;

    /// Sends what was kept back to be sent together, or says when to ask again; called before every wait.
    fn flush(&mut self, _now: Instant) -> Option<Instant> {
        None
    }

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

/// A program: its machine, and what carries out what the machine wants.
pub struct Program<P: Port> {
    /// What decides.
    pub machine: P::Machine,
    /// What carries out.
    pub port: P,
    clock: Clock,
    exit: Option<P::Exit>,
    /// When the loop will look again by itself; in the past while it is awake.
    awake_at: Instant,
}

impl<P: Port> Program<P> {
    /// A program that has this clock.
    pub fn new(machine: P::Machine, port: P, clock: Clock) -> Program<P> {
        Program { machine, port, clock, exit: None, awake_at: Instant::now() }
    }

    /// What happened at a moment is decided and carried out, one after the other, and so is what is due by now. True if the
    /// loop sleeps for longer than the machine wants, and must be woken.
    ///
    /// For who holds the program outside its loop: messages that arrive need no thread to be woken for them.
    pub fn at_once(&mut self, at: Instant, inputs: impl Iterator<Item = Input<P>>) -> bool {
        let now = self.clock.time_at(at);
        for input in inputs {
            self.machine.handle(now, Some(input));
            self.carry_out();
            if self.machine.poll_timeout().is_some_and(|time| time <= now) {
                self.machine.handle(now, None);
                self.carry_out();
            }
        }
        self.meet_deadline();
        self.exit.is_some() || self.deadline().is_some_and(|deadline| deadline < self.awake_at)
    }

    fn take(&mut self, event: P::Event) {
        if let Some((at, input)) = self.port.translate(event) {
            let now = at.map_or_else(|| self.clock.now(), |at| self.clock.time_at(at));
            self.machine.handle(now, Some(input));
            self.carry_out();
        }
    }

    /// Calls the machine if it is time.
    fn meet_deadline(&mut self) {
        if let (Clock::Real(clock), Some(time)) = (self.clock, self.machine.poll_timeout()) {
            let now = clock.now();
            if time <= now {
                self.machine.handle(now, None);
                self.carry_out();
            }
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.machine.poll_timeout().and_then(|time| self.clock.instant_of(time))
    }

    /// Carries out everything that the machine wants.
    fn carry_out(&mut self) {
        while self.exit.is_none()
            && let Some(output) = self.machine.poll_output()
        {
            match self.port.perform(output, &mut self.clock) {
                Next::Go => {}
                Next::Feed(input) => self.machine.handle(self.clock.now(), Some(input)),
                Next::Exit(exit) => self.exit = Some(exit),
            }
        }
    }

    /// Looks after files and signals.
    fn tend(&mut self) {
        match self.port.tend(&self.machine) {
            Next::Go => {}
            Next::Feed(input) => {
                self.machine.handle(self.clock.now(), Some(input));
                self.carry_out();
            }
            Next::Exit(exit) => self.exit = Some(exit),
        }
    }
}

/// A program that one thread can hold at a time.
pub struct Shared<P: Port> {
    program: Mutex<Program<P>>,
    /// The loop waits for the program. A lock knows no turns: without this, who takes it again and again would not let the
    /// loop have it.
    wanted: AtomicBool,
}

impl<P: Port> Shared<P> {
    /// A program that nobody holds.
    pub fn new(program: Program<P>) -> Shared<P> {
        Shared { program: Mutex::new(program), wanted: AtomicBool::new(false) }
    }

    /// Waits until nobody else holds it. A thread that panicked with it must not take it along.
    pub fn hold(&self) -> MutexGuard<'_, Program<P>> {
        self.wanted.store(true, Ordering::Relaxed);
        let program = self.program.lock().unwrap_or_else(PoisonError::into_inner);
        self.wanted.store(false, Ordering::Relaxed);
        program
    }

    /// Holds it if that takes no waiting, and nobody waits.
    pub fn try_hold(&self) -> Option<MutexGuard<'_, Program<P>>> {
        if self.is_wanted() { None } else { self.program.try_lock().ok() }
    }

    /// Whether the loop waits for who holds it.
    pub fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// The program's port, when its loop has ended.
    pub fn into_port(self) -> P {
        self.program.into_inner().unwrap_or_else(PoisonError::into_inner).port
    }
}

/// Runs a program until its port ends it. It lets go of the program while it waits.
pub fn drive<P: Port>(program: &Shared<P>, events: &Events<P::Event>) -> P::Exit {
    sharpen_this_thread();
    let mut tend_at = Instant::now() + TEND_PERIOD;
    let mut lead = Lead::new();
    program.hold().carry_out();
    loop {
        let (wake, gathering, punctual) = {
            let mut program = program.hold();
            for _ in 0..HELPING {
                let Some(event) = events.pop() else { break };
                program.take(event);
                // Also after a message: a flood of them must not starve the machine of its deadlines.
                program.meet_deadline();
                if program.exit.is_some() {
                    break;
                }
            }
            program.meet_deadline();
            let moment = Instant::now();
            if moment >= tend_at {
                tend_at = moment + TEND_PERIOD;
                program.tend();
            }
            let send_at = program.port.flush(moment);
            if let Some(exit) = program.exit.take() {
                return exit;
            }
            let deadline = program.deadline();
            let wake = deadline.map_or(tend_at, |deadline| deadline.min(tend_at));
            let wake = send_at.map_or(wake, |send_at| send_at.min(wake));
            program.awake_at = wake;
            // What is gathered to be sent together is not sent to the microsecond.
            let punctual = P::PUNCTUAL && send_at.is_none() && deadline == Some(wake);
            (wake, send_at.is_some(), punctual)
        };
        let end = if punctual { lead.wait(events, wake) } else { events.wait(Some(wake), gathering) };
        if end == Wake::Closed {
            return program.hold().port.closed();
        }
    }
}
