//! When vehicles speak.

use super::super::fault::Collector;
use super::super::file::{EventTriggered, MissionFile, Talk};
use crate::coordination::FleetLaw;
use crate::talk::trigger::{Settings, Trigger};
use crate::time::Span;

/// The event trigger, if there is one; `None` with a fault noted, or for periodic talk.
pub(super) fn check_talk(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    law: Option<&dyn FleetLaw>,
) -> Option<Trigger> {
    let Talk::EventTriggered(talk) = &file.coordination.talk else { return None };
    let key = "coordination.talk.event_triggered";
    if let Some(says) = law.and_then(|law| (0..file.vehicles.len()).find_map(|i| law.says(i))) {
        let allowed = "periodic, or a law that needs nothing beside xi";
        faults.fault("coordination.talk", format!("event_triggered with a law that sends its {says}"), allowed);
    }
    let silence = |name, span: f64| (name, span, (0.0..=LONGEST_SILENCE_S).contains(&span), "0 to 86400 s");
    let wait = |name, span: Option<f64>| {
        let ok = span.is_none_or(|span| span > 0.0 && span <= LONGEST_SILENCE_S);
        (name, span.unwrap_or(0.0), ok, "above 0, to 86400 s")
    };
    let mut sound = true;
    for (name, value, ok, allowed) in [
        ("threshold", talk.threshold, talk.threshold > 0.0, "above 0"),
        ("start", talk.start, talk.start >= 0.0, "0 or more"),
        ("decay_per_s", talk.decay_per_s, talk.decay_per_s >= 0.0, "0 or more"),
        ("jitter", talk.jitter, (0.0..1.0).contains(&talk.jitter), "0 to below 1"),
        silence("least_silence_s", talk.least_silence_s),
        wait("most_silence_s", talk.most_silence_s),
        wait("patience_s", talk.patience_s),
    ] {
        faults.number(&format!("{key}.{name}"), value, ok, allowed);
        sound &= ok && value.is_finite();
    }
    // Silence is information: a neighbour that is silent because all is as believed must not leave N_i.
    if let Some(validity) = file.coordination.validity_s {
        let allowed = match talk.most_silence_s {
            Some(most) => format!("above most_silence_s, {most} s; leave it out for ever"),
            None => "none without most_silence_s".to_string(),
        };
        let longer = talk.most_silence_s.is_some_and(|most| validity > most);
        faults.number("coordination.validity_s", validity, longer, &allowed);
    }
    if !sound {
        return None;
    }
    match Trigger::new(settings(talk)) {
        Ok(trigger) => Some(trigger),
        Err(reason) => {
            faults.fault(key, reason, "most_silence_s, not below least_silence_s, or patience_s");
            None
        }
    }
}

/// Longest silence and patience \[s\].
const LONGEST_SILENCE_S: f64 = 86_400.0;

fn settings(talk: &EventTriggered) -> Settings {
    Settings {
        floor: talk.threshold,
        start: talk.start,
        decay: talk.decay_per_s,
        least_silence: Span::from_secs(talk.least_silence_s),
        most_silence: talk.most_silence_s.map(Span::from_secs),
        jitter: talk.jitter,
        patience: talk.patience_s.map(Span::from_secs),
    }
}
