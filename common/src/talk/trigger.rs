//! When a difference is worth a message.

use crate::positive::{not_negative, positive};
use crate::random::Stream;
use crate::time::{Span, Time};

/// An event trigger: a threshold that may decay, and bounds on the silence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trigger {
    floor: f64,
    start: f64,
    decay: f64,
    least_silence: Span,
    most_silence: Option<Span>,
    jitter: f64,
    patience: Option<Span>,
}

/// What a [`Trigger`] is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// δ: the threshold that remains \[units of ξ\], above 0.
    pub floor: f64,
    /// How much higher it is at the start \[units of ξ\], 0 or more.
    pub start: f64,
    /// Rate at which that decays \[1/s\], 0 or more.
    pub decay: f64,
    /// Nothing is said sooner after the last message.
    pub least_silence: Span,
    /// Something is said at the latest so long after the last message: the heartbeat.
    pub most_silence: Option<Span>,
    /// The part of the longest silence, 0 to below 1, by which it is shortened at random.
    pub jitter: f64,
    /// What is not acknowledged after this long is said again; without it, what was said counts as heard.
    pub patience: Option<Span>,
}

impl Trigger {
    /// A trigger with these settings.
    ///
    /// # Errors
    /// Which of them is out of its range.
    pub fn new(settings: Settings) -> Result<Trigger, String> {
        let span = |name: &str, span: Option<Span>| match span {
            Some(span) if span <= Span::ZERO => Err(format!("{name} must be positive, it is {span}")),
            span => Ok(span),
        };
        if !(0.0..1.0).contains(&settings.jitter) {
            return Err(format!("the jitter must be from 0 to below 1, it is {}", settings.jitter));
        }
        let trigger = Trigger {
            floor: positive("the threshold", settings.floor)?,
            start: not_negative("the start of the threshold", settings.start)?,
            decay: not_negative("the decay of the threshold", settings.decay)?,
            least_silence: settings.least_silence,
            most_silence: span("the longest silence", settings.most_silence)?,
            jitter: settings.jitter,
            patience: span("the patience", settings.patience)?,
        };
        match trigger.most_silence {
            Some(most) if most < trigger.least_silence => {
                Err(format!("the longest silence, {most}, is shorter than the shortest, {}", trigger.least_silence))
            }
            None if trigger.patience.is_none() => {
                let why = "a vehicle whose messages were lost would be silent for ever";
                Err(format!("there must be a longest silence or a patience: {why}"))
            }
            _ => Ok(trigger),
        }
    }

    /// δ(t) = floor + start exp(−decay t) \[units of ξ\].
    pub fn threshold(&self, now: Time) -> f64 {
        self.floor + self.start * (-self.decay * now.secs()).exp()
    }

    /// The threshold that remains \[units of ξ\].
    pub fn floor(&self) -> f64 {
        self.floor
    }

    /// Nothing is said sooner after the last message.
    pub fn least_silence(&self) -> Span {
        self.least_silence
    }

    /// The longest silence there can be.
    pub fn most_silence(&self) -> Option<Span> {
        self.most_silence
    }

    /// How long an acknowledgement may take; `None` if none is waited for.
    pub fn patience(&self) -> Option<Span> {
        self.patience
    }

    /// The longest silence after message number `seq`: a function of the stream and the number alone.
    pub fn heartbeat(&self, stream: &mut Stream, seq: u32) -> Option<Span> {
        let most = self.most_silence?;
        let shortened = self.jitter * stream.unit_at(u64::from(seq), 0);
        Some(Span::from_nanos((most.nanos() as f64 * (1.0 - shortened)) as i64).max(self.least_silence))
    }
}

#[cfg(test)]
mod tests {
    use super::{Settings, Trigger};
    use crate::random::Stream;
    use crate::time::{Span, Time};

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }

    fn settings() -> Settings {
        Settings { floor: 0.1, most_silence: Some(s(10.0)), ..Settings::default() }
    }

    #[test]
    fn the_threshold_decays_to_its_floor() {
        let trigger = Trigger::new(Settings { start: 2.0, decay: 0.5, ..settings() }).expect("sound");
        assert!((trigger.threshold(Time::ZERO) - 2.1).abs() < 1e-12);
        assert!((trigger.threshold(Time::from_secs(2.0)) - (0.1 + 2.0 * (-1.0f64).exp())).abs() < 1e-12);
        assert!((trigger.threshold(Time::from_secs(1e6)) - trigger.floor()).abs() < 1e-12);
    }

    #[test]
    fn a_heartbeat_without_jitter_is_the_longest_silence_and_with_it_is_shorter() {
        let mut stream = Stream::new(1, "talk/a");
        let plain = Trigger::new(settings()).expect("sound");
        let jittered = Trigger::new(Settings { jitter: 0.5, ..settings() }).expect("sound");
        let beats: Vec<Span> = (0..100).filter_map(|seq| jittered.heartbeat(&mut stream, seq)).collect();
        assert!(beats.iter().all(|beat| *beat > s(5.0) && *beat <= s(10.0)));
        assert!(beats.iter().max() > Some(&s(9.5)) && beats.iter().min() < Some(&s(5.5)));
        assert_eq!(plain.heartbeat(&mut stream, 7), Some(s(10.0)));
        assert_eq!(jittered.heartbeat(&mut stream, 7), Some(beats[7]), "a function of the number");
        let held = Trigger::new(Settings { jitter: 0.9, least_silence: s(9.0), ..settings() }).expect("sound");
        assert!((0..100).all(|seq| held.heartbeat(&mut stream, seq).is_some_and(|beat| beat >= s(9.0))));
        assert_eq!((plain.most_silence(), plain.patience()), (Some(s(10.0)), None));
        let patient =
            Trigger::new(Settings { most_silence: None, patience: Some(s(2.0)), ..settings() }).expect("sound");
        assert_eq!((patient.most_silence(), patient.patience()), (None, Some(s(2.0))));
        assert_eq!(patient.heartbeat(&mut stream, 7), None, "who waits for an answer needs none");
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let refused = |settings: Settings| Trigger::new(settings).is_err();
        assert!(!refused(settings()));
        assert!(refused(Settings { floor: 0.0, ..settings() }) && refused(Settings { floor: f64::NAN, ..settings() }));
        assert!(refused(Settings { start: -1.0, ..settings() }) && refused(Settings { decay: -1.0, ..settings() }));
        assert!(
            refused(Settings { jitter: 1.0, ..settings() }) && refused(Settings { jitter: f64::NAN, ..settings() })
        );
        assert!(refused(Settings { least_silence: s(11.0), ..settings() }));
        assert!(refused(Settings { most_silence: Some(s(0.0)), ..settings() }));
        assert!(refused(Settings { most_silence: None, ..settings() }), "silent for ever");
        assert!(!refused(Settings { most_silence: None, patience: Some(s(1.0)), ..settings() }));
    }
}
