//! The numbers of a path. A path may still refuse what is in range here, such as waypoints that coincide.

use super::super::fault::Collector;
use super::super::file::{PathChoice, SegmentChoice};
use super::{FARTHEST, LARGEST_ANGLE, LARGEST_XI};

/// Smallest radius, length and wavelength \[m\].
const SMALLEST: f64 = 1e-2;
/// Metres per unit of ξ, at least and at most.
const RATES: (f64, f64) = (1e-6, 1e7);

/// Whether every number of a path is in range.
pub(super) fn check_path(faults: &mut Collector<'_>, key: &str, path: &PathChoice) -> bool {
    let before = faults.count();
    let mut sense = Sense { faults, key };
    match path {
        PathChoice::Line(line) => {
            sense.places("start_m", &line.start_m);
            sense.angle("heading_deg", line.heading_deg);
            sense.rate("rate_m", line.rate_m);
        }
        PathChoice::Circle(circle) => {
            sense.places("centre_m", &circle.centre_m);
            sense.length("radius_m", circle.radius_m);
            sense.angle("start_deg", circle.start_deg);
            sense.between("rate_rad", circle.rate_rad, 1e-9, 1e3, "rad per unit of xi");
        }
        PathChoice::Sinusoid(sinusoid) => {
            sense.place("amplitude_m", sinusoid.amplitude_m);
            sense.length("wavelength_m", sinusoid.wavelength_m);
            sense.place("offset_m", sinusoid.offset_m);
            sense.angle("phase_deg", sinusoid.phase_deg);
        }
        PathChoice::Helix(helix) => {
            sense.length("radius_m", helix.radius_m);
            sense.between("lap", helix.lap, 1e-3, LARGEST_XI, "units of xi");
            sense.faults.magnitude(&format!("{key}.climb_m"), helix.climb_m, 1e6, "m per unit of xi");
            sense.angle("phase_deg", helix.phase_deg);
            sense.place("z0_m", helix.z0_m);
        }
        PathChoice::Chain(chain) => {
            sense.places("start_m", &chain.start_m);
            sense.angle("heading_deg", chain.heading_deg);
            for (i, segment) in chain.segments.iter().enumerate() {
                sense.segment(i, segment);
            }
        }
        PathChoice::Spline(spline) => {
            for (i, point) in spline.waypoints_m.iter().enumerate() {
                sense.places(&format!("waypoints_m[{i}]"), point);
            }
            sense.run(spline.rate_m, spline.xi.as_deref());
        }
        PathChoice::Geojson(geojson) => sense.run(geojson.rate_m, geojson.xi.as_deref()),
    }
    faults.count() == before
}

/// Notes what is out of range.
struct Sense<'a, 't> {
    faults: &'a mut Collector<'t>,
    key: &'a str,
}

impl Sense<'_, '_> {
    fn place(&mut self, name: &str, value: f64) {
        self.faults.magnitude(&format!("{}.{name}", self.key), value, FARTHEST, "m");
    }

    fn places(&mut self, name: &str, values: &[f64]) {
        for (i, value) in values.iter().enumerate() {
            self.place(&format!("{name}[{i}]"), *value);
        }
    }

    fn angle(&mut self, name: &str, value: f64) {
        self.faults.magnitude(&format!("{}.{name}", self.key), value, LARGEST_ANGLE, "deg");
    }

    fn length(&mut self, name: &str, value: f64) {
        self.between(name, value, SMALLEST, FARTHEST, "m");
    }

    fn rate(&mut self, name: &str, value: f64) {
        self.between(name, value, RATES.0, RATES.1, "m per unit of xi");
    }

    fn between(&mut self, name: &str, value: f64, least: f64, most: f64, unit: &str) {
        self.faults.between(&format!("{}.{name}", self.key), value, least, most, unit);
    }

    fn run(&mut self, rate: Option<f64>, xi: Option<&[f64]>) {
        if let Some(rate) = rate {
            self.rate("rate_m", rate);
        }
        for (i, value) in xi.unwrap_or_default().iter().enumerate() {
            self.faults.magnitude(&format!("{}.xi[{i}]", self.key), *value, LARGEST_XI, "units of xi");
        }
    }

    fn segment(&mut self, index: usize, segment: &SegmentChoice) {
        match segment {
            SegmentChoice::Line(line) => {
                self.length(&format!("segments[{index}].line.length_m"), line.length_m);
                self.rate(&format!("segments[{index}].line.rate_m"), line.rate_m);
            }
            SegmentChoice::Arc(arc) => {
                self.length(&format!("segments[{index}].arc.radius_m"), arc.radius_m);
                self.angle(&format!("segments[{index}].arc.sweep_deg"), arc.sweep_deg);
                if let Some(rate) = arc.rate_m {
                    self.rate(&format!("segments[{index}].arc.rate_m"), rate);
                }
            }
            SegmentChoice::Corner(corner) => {
                self.angle(&format!("segments[{index}].corner.turn_deg"), corner.turn_deg);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::Mission;

    const HELIX: &str = include_str!("../../../../missions/auv-helix.toml");
    const CHAIN: &str = include_str!("../../../../missions/thesis/fig-3-7.toml");

    fn faults_with(text: &str, old: &str, new: &str) -> String {
        assert!(text.contains(old), "{old:?} is not in the mission");
        Mission::parse("m.toml", &text.replacen(old, new, 1))
            .map_or_else(|faults| faults.to_string(), |_| String::new())
    }

    #[test]
    fn numbers_beyond_sense_are_refused_with_their_range_and_in_few_digits() {
        for (text, old, new, expected) in [
            (HELIX, "x_m = 5.0", "x_m = 5e200", "vehicles[0].start.x_m: found 5e200; allowed: -10000000 to 10000000 m"),
            (HELIX, "z_m = -5.0", "z_m = -5.0, xi = 1e300", "vehicles[0].start.xi: found 1e300; allowed: "),
            (HELIX, "z_m = -5.0", "z_m = -5.0, speed_mps = 1e200", "vehicles[0].start.speed_mps: found 1e200"),
            (
                HELIX,
                "radius_m = 20.0",
                "radius_m = 0.0001",
                "vehicles[0].path.helix.radius_m: found 0.0001; allowed: 0.01",
            ),
            (HELIX, "radius_m = 20.0", "radius_m = -20.0", "vehicles[0].path.helix.radius_m: found -20"),
            (HELIX, "lap = 400.0", "lap = 1e-300", "vehicles[0].path.helix.lap: found 1e-300"),
            (
                CHAIN,
                "length_m = 3.0",
                "length_m = 1e9",
                "vehicles[0].path.chain.segments[1].line.length_m: found 1000000000",
            ),
        ] {
            let said = faults_with(text, old, new);
            assert!(said.contains(expected) && said.lines().count() == 1, "{new}: {said}");
        }
    }

    #[test]
    fn a_path_out_of_range_does_not_hide_what_else_is_wrong_with_its_vehicle() {
        let text = HELIX.replacen("radius_m = 20.0", "radius_m = -20.0", 1);
        let said = faults_with(&text, "{ underactuated_auv = \"sirene\" }", "\"kinematic_unicycle\"");
        assert!(said.contains("radius_m: found -20") && said.contains("theorem47 with kinematic_unicycle"), "{said}");
    }
}
