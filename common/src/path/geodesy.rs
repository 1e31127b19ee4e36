//! Waypoints on the globe, in the local east-north-up frame of an origin (WGS 84).
//!
//! East and north are those of the plane that touches the ellipsoid's parallel surface at the origin. z is the height over
//! the origin's, not over that plane, which the sea leaves by d²/(2 · 6371 km): 8 cm at a kilometre, 8 m at ten. So a
//! vehicle that keeps its depth has a constant z.

use nalgebra::{Matrix3, Vector3};

/// Semi-major axis of the ellipsoid \[m\].
const A: f64 = 6_378_137.0;
/// Its flattening.
const F: f64 = 1.0 / 298.257_223_563;
/// Its eccentricity squared.
const E2: f64 = F * (2.0 - F);

/// A place on the globe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Longitude \[deg\], −180 to 180, positive to the east.
    pub longitude: f64,
    /// Geodetic latitude \[deg\], −90 to 90, positive to the north.
    pub latitude: f64,
    /// Height over the ellipsoid \[m\], negative for a depth.
    pub height: f64,
}

impl Place {
    /// The place if there is one, otherwise what is wrong with it.
    pub fn checked(self) -> Result<Place, String> {
        let Place { longitude, latitude, height } = self;
        if !(-180.0..=180.0).contains(&longitude) {
            return Err(format!("a longitude lies within -180 to 180 deg, not at {longitude}"));
        }
        if !(-90.0..=90.0).contains(&latitude) {
            return Err(format!(
                "a latitude lies within -90 to 90 deg, not at {latitude}: GeoJSON has longitude first"
            ));
        }
        if !(-12_000.0..=100_000.0).contains(&height) {
            return Err(format!("a height lies within -12000 to 100000 m, not at {height}"));
        }
        Ok(self)
    }

    /// Earth-centred, earth-fixed coordinates \[m\]: (N + h) cos φ cos λ, (N + h) cos φ sin λ, (N(1 − e²) + h) sin φ, with
    /// N = a/√(1 − e² sin² φ).
    pub fn to_ecef(self) -> Vector3<f64> {
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        let (sin_l, cos_l) = self.longitude.to_radians().sin_cos();
        let n = A / (1.0 - E2 * sin * sin).sqrt();
        let h = self.height;
        Vector3::new((n + h) * cos * cos_l, (n + h) * cos * sin_l, (n * (1.0 - E2) + h) * sin)
    }

    /// The matrix with the rows east, north, up of the frame at this place.
    fn frame(self) -> Matrix3<f64> {
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        let (sin_l, cos_l) = self.longitude.to_radians().sin_cos();
        Matrix3::new(-sin_l, cos_l, 0.0, -sin * cos_l, -sin * sin_l, cos, cos * cos_l, cos * sin_l, sin)
    }

    /// East and north of `place` seen from here, and how much higher it is \[m\].
    pub fn local(self, place: Place) -> Vector3<f64> {
        // The foot of the place at the height of the origin.
        let foot = Place { height: self.height, ..place };
        let seen = self.frame() * (foot.to_ecef() - self.to_ecef());
        Vector3::new(seen.x, seen.y, place.height - self.height)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LISBON: Place = Place { longitude: -9.1, latitude: 38.7, height: 0.0 };

    #[test]
    fn the_axes_and_the_poles() {
        let at = |longitude, latitude| Place { longitude, latitude, height: 0.0 }.to_ecef();
        assert!((at(0.0, 0.0) - Vector3::new(A, 0.0, 0.0)).norm() < 1e-8);
        assert!((at(90.0, 0.0) - Vector3::new(0.0, A, 0.0)).norm() < 1e-8);
        // The semi-minor axis, 6356752.3142 m.
        assert!((at(0.0, 90.0) - Vector3::new(0.0, 0.0, 6_356_752.314_245)).norm() < 1e-5);
    }

    #[test]
    fn height_is_along_the_normal() {
        // cos φ cos λ, cos φ sin λ, sin φ: that of the ellipsoid, not through its centre. It is also the third row of the frame.
        for (longitude, latitude) in [(-9.1f64, 38.7f64), (120.0, -60.0)] {
            let at = |height| Place { longitude, latitude, height };
            let (sin, cos) = latitude.to_radians().sin_cos();
            let (sin_l, cos_l) = longitude.to_radians().sin_cos();
            let normal = Vector3::new(cos * cos_l, cos * sin_l, sin);
            let up = (at(500.0).to_ecef() - at(0.0).to_ecef()) / 500.0;
            assert!((up - normal).norm() < 1e-9, "{up}");
            let frame = at(0.0).frame();
            assert!(
                (frame * up - Vector3::z()).norm() < 1e-9
                    && (frame * frame.transpose() - Matrix3::identity()).norm() < 1e-12
            );
        }
    }

    #[test]
    fn a_second_of_arc_is_as_long_as_the_radii_of_curvature_say() {
        let arc = 1.0 / 3600.0;
        let phi = LISBON.latitude.to_radians();
        let w = 1.0 - E2 * phi.sin().powi(2);
        let (meridian, parallel) = (A * (1.0 - E2) / w.powf(1.5), A / w.sqrt() * phi.cos());
        let north = LISBON.local(Place { latitude: LISBON.latitude + arc, ..LISBON });
        let east = LISBON.local(Place { longitude: LISBON.longitude + arc, ..LISBON });
        assert!((north.y - meridian * arc.to_radians()).abs() < 1e-3 && north.x.abs() < 1e-6, "{north}");
        assert!((east.x - parallel * arc.to_radians()).abs() < 1e-6 && east.y.abs() < 1e-3, "{east}");
    }

    #[test]
    fn a_vehicle_that_keeps_its_depth_keeps_its_z() {
        let far = Place { longitude: -9.0, latitude: 38.8, height: -30.0 };
        assert_eq!(LISBON.local(far).z, -30.0);
        assert_eq!(Place { height: 20.0, ..LISBON }.local(far).z, -50.0, "against the origin's own height");
        assert_eq!(LISBON.local(LISBON), Vector3::zeros());
    }

    #[test]
    fn places_off_the_globe_are_refused() {
        assert!(Place { longitude: 181.0, ..LISBON }.checked().is_err());
        assert!(Place { latitude: 95.0, ..LISBON }.checked().unwrap_err().contains("longitude first"));
        assert!(Place { height: f64::NAN, ..LISBON }.checked().is_err());
        assert!(Place { longitude: -181.0, ..LISBON }.checked().is_err());
        assert!(Place { height: -12_001.0, ..LISBON }.checked().is_err());
        assert!(Place { height: 100_001.0, ..LISBON }.checked().is_err());
        assert!(LISBON.checked().is_ok());
    }

    proptest! {
        /// From an origin to a place and from there to the origin the horizontal distance is the same to first order.
        #[test]
        fn near_by_the_frames_agree(
            longitude in -179.0..179.0f64, latitude in -80.0..80.0f64, east in -0.01..0.01f64, north in -0.01..0.01f64,
        ) {
            let here = Place { longitude, latitude, height: 0.0 };
            let there = Place { longitude: longitude + east, latitude: latitude + north, height: 0.0 };
            let (go, back) = (here.local(there), there.local(here));
            let scale = go.xy().norm();
            prop_assert!((go.xy().norm() - back.xy().norm()).abs() < 1e-6 * scale.max(1.0));
            prop_assert!(go.x.signum() == east.signum() || scale < 1.0);
            // The chord in space is the horizontal distance but for the curvature.
            prop_assert!(((there.to_ecef() - here.to_ecef()).norm() - scale).abs() < 1e-5 * scale.max(1.0));
        }
    }
}
