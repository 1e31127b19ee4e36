//! The coordination law.

use std::sync::Arc;

use super::super::build;
use super::super::fault::Collector;
use super::super::file::{Between, LawChoice, MissionFile};
use crate::coordination::FleetLaw;

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
        let allowed = "hold or advance; align needs a law that is told the delay (delayed, delayed_with_losses)";
        faults.fault("coordination.between", "align", allowed);
    }
    if let LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) = &file.coordination.law {
        let ok = (0.0..=3600.0).contains(&law.delay_s);
        let key = format!("{key}.{}.delay_s", build::law_name(&file.coordination.law));
        faults.number(&key, law.delay_s, ok, "0 to 3600 s");
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
