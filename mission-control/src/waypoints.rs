//! From a GeoJSON file to the lines of a mission file: the waypoints of each LineString in metres.

use std::fmt::Write as _;

use common::path::geodesy::Place;
use common::path::geojson::lines;

/// The paths to paste, with the origin above them; without one, the first position is the origin, at the height zero.
///
/// # Errors
/// What is wrong with the text.
pub fn section(text: &str, origin: Option<Place>) -> Result<String, String> {
    let lines = lines(text)?;
    let first = lines.iter().flat_map(|line| line.places.first()).next().ok_or("no LineString with a position")?;
    let origin = origin.unwrap_or(Place { height: 0.0, ..*first }).checked()?;
    let mut out = format!(
        "# x east, y north, z up from longitude {} deg, latitude {} deg, height {} m (WGS 84)\n",
        origin.longitude, origin.latitude, origin.height
    );
    for line in &lines {
        let name = line.name.as_deref().unwrap_or("a line without a name");
        // A name is text from elsewhere: it must not end the comment.
        let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let _ = writeln!(out, "# {name}\npath = {{ spline = {{ waypoints_m = [");
        for place in &line.places {
            let height = if line.has_heights { place.height } else { origin.height };
            let local = origin.local(Place { height, ..*place });
            // Millimetres; a minus before a zero is rounding.
            let [x, y, z] = [local.x, local.y, local.z].map(|x| (x * 1e3).round() / 1e3 + 0.0);
            let _ = writeln!(out, "  [{x:.3}, {y:.3}, {z:.3}],");
        }
        out.push_str("] } }\n");
    }
    Ok(out)
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
        assert!(section(r#"{ "type": "Point", "coordinates": [1, 2] }"#, None).is_err());
    }
}
