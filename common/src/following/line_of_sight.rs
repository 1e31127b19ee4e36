//! Line of sight for vehicles that turn at once (section 1.2).

use std::f64::consts::FRAC_2_PI;

use crate::positive::positive;

/// The heading law (1.4) for a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineOfSight {
    lookahead: f64,
}

impl LineOfSight {
    /// `lookahead` Δ > 0 \[m\]: at this distance from the line the vehicle approaches it at 30 degrees; the smaller,
    /// the steeper.
    pub fn new(lookahead: f64) -> Result<LineOfSight, String> {
        Ok(LineOfSight { lookahead: positive("the line-of-sight distance", lookahead)? })
    }

    /// ψ = −sign(v) asin\[(2/π) atan(y/Δ)\] (1.4), with sign(0) = +1 (erratum 1.3).
    ///
    /// `y` is the distance from the line \[m\], positive to its left, `v` the forward speed \[m/s\]; the heading is
    /// relative to the line's \[rad\].
    pub fn heading(&self, y: f64, v: f64) -> f64 {
        let sign = if v < 0.0 { -1.0 } else { 1.0 };
        // The product can exceed one by rounding when y is enormous.
        -sign * (FRAC_2_PI * (y / self.lookahead).atan()).clamp(-1.0, 1.0).asin()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_6};

    use nalgebra::Vector2;
    use proptest::prelude::*;

    use super::LineOfSight;
    use crate::vehicle::integrate::rk4_step;
    use crate::vehicle::kinematic_unicycle::{Input, model};

    #[test]
    fn thirty_degrees_at_the_lookahead_distance() {
        let law = LineOfSight::new(2.0).unwrap();
        assert!((law.heading(2.0, 1.0) + FRAC_PI_6).abs() < 1e-15);
        assert!((law.heading(2.0, -1.0) - FRAC_PI_6).abs() < 1e-15);
    }

    #[test]
    fn a_vehicle_at_rest_counts_as_moving_forward() {
        let law = LineOfSight::new(1.0).unwrap();
        assert_eq!(law.heading(0.7, 0.0), law.heading(0.7, 1.0));
        assert_eq!(law.heading(0.7, -0.0), law.heading(0.7, 1.0));
    }

    #[test]
    fn far_away_it_heads_straight_for_the_line() {
        let law = LineOfSight::new(1e-3).unwrap();
        assert!((law.heading(f64::MAX, 1.0) + FRAC_PI_2).abs() < 1e-6);
        assert!((law.heading(f64::NEG_INFINITY, 1.0) - FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn a_distance_of_zero_or_less_is_refused() {
        assert!(LineOfSight::new(0.0).is_err() && LineOfSight::new(-1.0).is_err());
    }

    proptest! {
        /// ẏ = −(2|v|/π) atan(y/Δ), below (1.4), whichever way the vehicle moves.
        #[test]
        fn the_closed_loop_of_section_1_2(y in -50.0..50.0f64, v in -3.0..3.0f64, lookahead in 0.1..10.0f64) {
            let law = LineOfSight::new(lookahead).unwrap();
            let y_dot = model(0.0, &Vector2::zeros(), &Input { speed: v, heading: law.heading(y, v) }, &()).y;
            prop_assert!((y_dot + FRAC_2_PI * v.abs() * (y / lookahead).atan()).abs() < 1e-12);
        }
    }

    #[test]
    fn the_distance_decays_at_the_rate_of_its_linearisation() {
        // Near the line ẏ = −2|v|/(πΔ) y.
        let law = LineOfSight::new(1.0).unwrap();
        let mut state = Vector2::new(0.0, 1e-3);
        for _ in 0..1000 {
            let u = Input { speed: 0.5, heading: law.heading(state.y, 0.5) };
            state = rk4_step(model, 0.0, &state, &u, &(), 1e-2);
        }
        let expected = 1e-3 * (-FRAC_2_PI * 0.5 * 10.0).exp();
        assert!((state.y - expected).abs() < 0.01 * expected, "{}", state.y);
    }
}
