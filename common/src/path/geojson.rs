//! Waypoints from GeoJSON (RFC 7946): the lines of a text, with their names.

use geojson::{Feature, GeoJson, Geometry, Value};

use super::geodesy::Place;

/// A LineString.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedLine {
    /// The property `name` of its feature.
    pub name: Option<String>,
    /// Its positions; a position without a height is at the height zero.
    pub places: Vec<Place>,
    /// Whether every position has a height.
    pub has_heights: bool,
}

/// All LineStrings of a GeoJSON text, in order.
///
/// # Errors
/// What is wrong with the text, or with a position.
pub fn lines(text: &str) -> Result<Vec<NamedLine>, String> {
    let parsed: GeoJson = text.parse().map_err(|error| format!("not GeoJSON: {error}"))?;
    let mut found = Vec::new();
    match parsed {
        GeoJson::Geometry(geometry) => of_geometry(&geometry, None, &mut found)?,
        GeoJson::Feature(feature) => of_feature(&feature, &mut found)?,
        GeoJson::FeatureCollection(collection) => {
            collection.features.iter().try_for_each(|feature| of_feature(feature, &mut found))?;
        }
    }
    Ok(found)
}

/// What the geometries of a GeoJSON text are, in order, each kind once: `Point`, `LineString`, ...
pub fn kinds(text: &str) -> Vec<&'static str> {
    let geometries: Vec<Geometry> = match text.parse() {
        Ok(GeoJson::Geometry(geometry)) => vec![geometry],
        Ok(GeoJson::Feature(feature)) => feature.geometry.into_iter().collect(),
        Ok(GeoJson::FeatureCollection(all)) => all.features.into_iter().filter_map(|f| f.geometry).collect(),
        Err(_) => Vec::new(),
    };
    let mut kinds: Vec<&str> = Vec::new();
    for geometry in &geometries {
        let kind = geometry.value.type_name();
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    kinds
}

/// The line of this name, or the only one.
///
/// # Errors
/// What is wrong with the text, or which lines there are.
pub fn line(text: &str, name: Option<&str>) -> Result<NamedLine, String> {
    let mut found = lines(text)?;
    let names = || {
        let names: Vec<String> = lines(text).unwrap_or_default().into_iter().filter_map(|line| line.name).collect();
        names.join(", ")
    };
    if let Some(name) = name {
        found.retain(|line| line.name.as_deref() == Some(name));
    }
    match (found.pop(), found.is_empty()) {
        (Some(line), true) => Ok(line),
        (Some(_), false) => Err(format!("more than one LineString: choose by its property name ({})", names())),
        (None, _) => Err(match name {
            Some(name) => format!("no LineString whose property name is {name:?} ({})", names()),
            None => "no LineString".to_owned(),
        }),
    }
}

fn of_feature(feature: &Feature, found: &mut Vec<NamedLine>) -> Result<(), String> {
    let name = feature.property("name").and_then(|name| name.as_str());
    feature.geometry.iter().try_for_each(|geometry| of_geometry(geometry, name, found))
}

fn of_geometry(geometry: &Geometry, name: Option<&str>, found: &mut Vec<NamedLine>) -> Result<(), String> {
    let Value::LineString(positions) = &geometry.value else { return Ok(()) };
    let place = |position: &Vec<f64>| match position[..] {
        [longitude, latitude] => Place { longitude, latitude, height: 0.0 }.checked(),
        [longitude, latitude, height, ..] => Place { longitude, latitude, height }.checked(),
        _ => Err("a position has a longitude and a latitude".to_owned()),
    };
    let places = positions.iter().map(place).collect::<Result<Vec<_>, String>>()?;
    let has_heights = positions.iter().all(|position| position.len() > 2);
    found.push(NamedLine { name: name.map(str::to_owned), places, has_heights });
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TWO: &str = r#"{ "type": "FeatureCollection", "features": [
        { "type": "Feature", "properties": { "name": "pier" },
          "geometry": { "type": "LineString", "coordinates": [[-9.1, 38.7], [-9.09, 38.71]] } },
        { "type": "Feature", "properties": { "name": "buoy" }, "geometry": { "type": "Point", "coordinates": [0, 0] } },
        { "type": "Feature", "properties": { "name": "basin" },
          "geometry": { "type": "LineString", "coordinates": [[-9.1, 38.7, -4], [-9.09, 38.71, -5.5]] } } ] }"#;

    #[test]
    fn lines_have_names_and_depths() {
        let lines = lines(TWO).unwrap();
        assert_eq!(lines.len(), 2);
        assert_eq!((lines[0].name.as_deref(), lines[0].has_heights), (Some("pier"), false));
        assert_eq!((lines[1].places[1].height, lines[1].places[1].latitude), (-5.5, 38.71));
    }

    #[test]
    fn the_kinds_of_geometries_are_told() {
        assert_eq!(kinds(TWO), ["LineString", "Point"]);
        assert_eq!(kinds("{"), Vec::<&str>::new());
    }

    #[test]
    fn one_of_several_is_chosen_by_its_name() {
        assert_eq!(line(TWO, Some("basin")).unwrap().places.len(), 2);
        assert!(line(TWO, None).unwrap_err().contains("pier, basin"));
        assert!(line(TWO, Some("quay")).unwrap_err().contains("\"quay\" (pier, basin)"));
        let bare = r#"{ "type": "LineString", "coordinates": [[1, 2], [1, 3]] }"#;
        assert_eq!(line(bare, None).unwrap().places[1].latitude, 3.0);
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert!(line("{", None).unwrap_err().starts_with("not GeoJSON"));
        let swapped = r#"{ "type": "LineString", "coordinates": [[38.7, -99.1], [38.7, 3]] }"#;
        assert!(line(swapped, None).unwrap_err().contains("longitude first"));
        assert_eq!(line(r#"{ "type": "Point", "coordinates": [1, 2] }"#, None).unwrap_err(), "no LineString");
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in ".{0,80}", longitude in -1e3..1e3f64) {
            let _ = line(&text, None);
            let _ = line(&format!(r#"{{ "type": "LineString", "coordinates": [[{longitude}], []] }}"#), None);
        }
    }
}
