//! The coordination law.

use std::sync::Arc;

use super::super::build;
use super::super::fault::Collector;
use super::super::file::{Between, EventTriggered, LawChoice, MissionFile, Talk};
use crate::coordination::FleetLaw;
use crate::coordination::known_delay::MOST_REMEMBERED;
use crate::talk::trigger::{Settings, Trigger};
use crate::time::Span;

pub(super) fn check_law(faults: &mut Collector<'_>, file: &MissionFile) -> Option<Arc<dyn FleetLaw>> {
    let key = "coordination.law";
    if let LawChoice::Introduction(_) = file.coordination.law
        && file.vehicles.len() != 2
    {
        faults.fault(key, format!("introduction with {} vehicles", file.vehicles.len()), "two vehicles, as in (1.5)");
    }
    if file.coordination.between == Between::Align
        && !matches!(file.coordination.law, LawChoice::Delayed(_) | LawChoice::DelayedWithLosses(_))
    {
        let allowed =
            "hold, advance or estimate; align needs a law that is told the delay (delayed, delayed_with_losses)";
        faults.fault("coordination.between", "align", allowed);
    }
    if let LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) = &file.coordination.law {
        let ok = (0.0..=3600.0).contains(&law.delay_s);
        let key = format!("{key}.{}.delay_s", build::law_name(&file.coordination.law));
        faults.number(&key, law.delay_s, ok, "0 to 3600 s");
    }
    if let LawChoice::KnownDelay(law) = &file.coordination.law {
        let most = MOST_REMEMBERED as f64 * file.clock.control_period_s;
        let allowed = format!("above 0 and at most {MOST_REMEMBERED} control periods, {most} s");
        faults.number("coordination.law.known_delay.longest_s", law.longest_s, law.longest_s <= most, &allowed);
    }
    match build::law(&file.coordination.law) {
        Ok(law) => Some(law),
        Err(reason) => {
            let name = build::law_name(&file.coordination.law);
            faults.fault(&format!("{key}.{name}"), reason, "gains above 0");
            None
        }
    }
}

/// The event trigger, if there is one; `None` with a fault noted, or for periodic talk.
pub(super) fn check_talk(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    law: Option<&dyn FleetLaw>,
) -> Option<Trigger> {
    let Talk::EventTriggered(talk) = &file.coordination.talk else { return None };
    let key = "coordination.talk.event_triggered";
    if let Some(says) = law.and_then(FleetLaw::says) {
        let allowed = "periodic, or a law that needs nothing beside xi";
        faults.fault("coordination.talk", format!("event_triggered with a law that sends its {says}"), allowed);
    }
    for (name, span) in [
        ("least_silence_s", Some(talk.least_silence_s)),
        ("most_silence_s", talk.most_silence_s),
        ("patience_s", talk.patience_s),
    ] {
        let span = span.unwrap_or(0.0);
        faults.number(&format!("{key}.{name}"), span, (0.0..=LONGEST_SILENCE_S).contains(&span), "0 to 86400 s");
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
    match Trigger::new(settings(talk)) {
        Ok(trigger) => Some(trigger),
        Err(reason) => {
            faults.fault(key, reason, "a threshold above 0, and a longest silence or a patience");
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
