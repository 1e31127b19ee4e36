//! Ranges.

use super::super::super::fault::Collector;
use super::super::super::file::RangeChoice;
use crate::network::Range;

pub(super) fn check(faults: &mut Collector<'_>, key: &str, range: &RangeChoice) -> Range {
    match range {
        RangeChoice::Unlimited => Range::Unlimited,
        RangeChoice::Disc(disc) => {
            faults.positive(&format!("{key}.disc.radius_m"), disc.radius_m, "m");
            Range::Disc(disc.radius_m)
        }
        RangeChoice::Curve(curve) => {
            let key = format!("{key}.curve.points");
            if !(1..=1000).contains(&curve.points.len()) {
                faults.fault(&key, format!("{} points", curve.points.len()), "1 to 1000 points");
            }
            let mut before = -1.0;
            for (i, [distance, probability]) in curve.points.iter().enumerate() {
                let key = format!("{key}[{i}]");
                let ok = *distance >= 0.0 && *distance > before;
                faults.number(&key, *distance, ok, "distances (m) of 0 or more, each greater than the one before");
                let ok = (0.0..=1.0).contains(probability);
                faults.number(&key, *probability, ok, "a probability, 0 to 1");
                before = *distance;
            }
            Range::Curve(curve.points.iter().map(|[distance, probability]| (*distance, *probability)).collect())
        }
    }
}
