//! From a GeoJSON file to the lines of a mission file: the waypoints of each LineString in metres.

use std::fmt::Write as _;

use common::path::geodesy::Place;
use common::path::geojson::{NamedLine, kinds, lines};
use common::path::spline::Spline;

/// Beyond this distance from the origin \[m\] a plane is no map, and coordinates are rather swapped than meant.
const FARTHEST_M: f64 = 100e3;
/// Lengths of lanes that differ by less than this part are the same.
const SAME_LENGTH: f64 = 1e-3;

/// The paths to paste, with the origin above them; without one, the first position is the origin, at the height zero.
///
/// # Errors
/// What is wrong with the text, or with a line that makes no path.
pub fn section(text: &str, origin: Option<Place>) -> Result<String, String> {
    let lines = lines(text)?;
    let first = lines.iter().flat_map(|line| line.places.first()).next().ok_or_else(|| no_line(text))?;
    let origin = origin.unwrap_or(Place { height: 0.0, ..*first }).checked()?;
    let mut out = format!(
        "# x east, y north, z up from longitude {} deg, latitude {} deg, height {} m (WGS 84)\n",
        origin.longitude, origin.latitude, origin.height
    );
    let mut paths = String::new();
    let mut lengths = Vec::new();
    for line in &lines {
        let name = line.name.as_deref().unwrap_or("a line without a name");
        // A name is text from elsewhere: it must not end the comment.
        let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let points = points(line, origin).map_err(|reason| format!("{name}: {reason}"))?;
        // What is printed is what a mission takes.
        Spline::by_length(points.iter().map(|point| (*point).into()).collect(), 1.0)
            .map_err(|reason| format!("{name}: {reason}"))?;
        lengths.push(points.windows(2).map(|two| distance(two[0], two[1])).sum::<f64>());
        let _ = writeln!(paths, "# {name}\npath = {{ spline = {{ waypoints_m = [");
        for [x, y, z] in points {
            let _ = writeln!(paths, "  [{x:.3}, {y:.3}, {z:.3}],");
        }
        paths.push_str("] } }\n");
    }
    let (shortest, longest) = lengths.iter().fold((f64::INFINITY, 0.0_f64), |(s, l), x| (s.min(*x), l.max(*x)));
    if longest > shortest * (1.0 + SAME_LENGTH) {
        let _ = writeln!(
            out,
            "# The lines are {shortest:.1} to {longest:.1} m long, and xi runs with the length: vehicles whose xi agree are as many metres \
             along\n# their lines, and not abreast. To be abreast at the waypoints, give all of them the same xi = [...], a value for each \
             waypoint."
        );
    }
    out.push_str(&paths);
    Ok(out)
}

/// The waypoints of a line in metres from the origin, to the millimetre.
fn points(line: &NamedLine, origin: Place) -> Result<Vec<[f64; 3]>, String> {
    let local = |place: &Place| {
        let height = if line.has_heights { place.height } else { origin.height };
        let local = origin.local(Place { height, ..*place });
        let far = local.x.hypot(local.y);
        if far > FARTHEST_M {
            return Err(format!(
                "longitude {}, latitude {} is {:.0} km away from the origin, longitude {}, latitude {}; allowed: {:.0} km. The longitude \
                 comes first, in the file and in --origin=LON,LAT",
                place.longitude,
                place.latitude,
                far / 1e3,
                origin.longitude,
                origin.latitude,
                FARTHEST_M / 1e3
            ));
        }
        // A minus before a zero is rounding.
        Ok([local.x, local.y, local.z].map(|x| (x * 1e3).round() / 1e3 + 0.0))
    };
    line.places.iter().map(local).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// That there is no line, and what there is.
fn no_line(text: &str) -> String {
    let kinds = kinds(text);
    let found = match kinds.is_empty() {
        true => "no geometry".to_owned(),
        false => kinds.join(", "),
    };
    format!("no LineString with a position: found {found}; allowed: a LineString, or features with one each")
}

/// A place as it is written on the command line: longitude, latitude and, if given, height, with commas between.
///
/// # Errors
/// What is wrong with it.
pub fn place(text: &str) -> Result<Place, String> {
    let number = |part: &str| part.trim().parse::<f64>().map_err(|_| format!("{part:?} is no number"));
    let numbers = text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?;
    match numbers[..] {
        [longitude, latitude] => Place { longitude, latitude, height: 0.0 }.checked(),
        [longitude, latitude, height] => Place { longitude, latitude, height }.checked(),
        _ => Err("longitude, latitude and, if given, height, with commas between".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = r#"{ "type": "Feature", "properties": { "name": "pier\n[[evil]]" },
        "geometry": { "type": "LineString", "coordinates": [[-9.1, 38.7], [-9.1, 38.701]] } }"#;

    #[test]
    fn the_lines_can_be_pasted() {
        let section = section(LINE, None).expect("a line");
        assert!(section.starts_with("# x east, y north, z up from longitude -9.1 deg, latitude 38.7 deg"), "{section}");
        assert!(section.contains("  [0.000, 0.000, 0.000],\n  [0.000, 111.0"), "{section}");
        let table: toml::Table = section.parse().expect("TOML");
        assert!(table.contains_key("path") && table.len() == 1, "{table}");
    }

    #[test]
    fn the_origin_can_be_given() {
        let origin = Place { longitude: -9.1, latitude: 38.701, height: 2.0 };
        assert!(section(LINE, Some(origin)).expect("a line").contains("  [0.000, -111.0"));
        assert_eq!(place("-9.1, 38.701,2"), Ok(origin));
        assert!(place("1").is_err() && place("1,x").is_err() && place("1,95").is_err());
        assert!(section("{}", None).is_err());
        let point = section(r#"{ "type": "Point", "coordinates": [1, 2] }"#, None).expect_err("no line");
        assert!(point.contains("found Point; allowed: a LineString"), "{point}");
    }

    #[test]
    fn what_makes_no_path_is_refused() {
        let refused = |text: &str, origin| section(text, origin).expect_err("refused");
        let swapped = place("38.7,-9.1").expect("a place");
        let far = refused(LINE, Some(swapped));
        assert!(far.contains("km away from the origin") && far.contains("LON,LAT"), "{far}");
        let one = r#"{ "type": "LineString", "coordinates": [[-9.1, 38.7]] }"#;
        assert!(refused(one, None).contains("waypoints make a path"), "{}", refused(one, None));
        let equal = r#"{ "type": "LineString", "coordinates": [[-9.1, 38.7], [-9.1, 38.7]] }"#;
        assert!(refused(equal, None).contains("are the same"), "{}", refused(equal, None));
    }

    #[test]
    fn lanes_of_unequal_length_are_told_what_makes_them_abreast() {
        let lanes = |north: f64| {
            let line = |east: f64, north: f64| {
                format!(
                    r#"{{ "type": "Feature", "properties": {{}}, "geometry":
                    {{ "type": "LineString", "coordinates": [[{east}, 38.7], [{east}, {north}]] }} }}"#
                )
            };
            let (a, b) = (line(-9.1, 38.71), line(-9.101, north));
            section(&format!(r#"{{ "type": "FeatureCollection", "features": [{a}, {b}] }}"#), None).expect("lanes")
        };
        assert!(lanes(38.72).contains("the same xi = [...]"));
        assert!(!lanes(38.71).contains("xi"));
    }
}
