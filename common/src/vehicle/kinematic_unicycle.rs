//! The unicycle of section 1.2: it turns at once and moves at the speed it is told.

use nalgebra::{SVector, Vector2};

/// What drives it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input {
    /// Forward speed v \[m/s\], of either sign.
    pub speed: f64,
    /// Heading ψ \[rad\].
    #[doc(alias = "ψ")]
    pub heading: f64,
}

/// ẋ = v cos ψ, ẏ = v sin ψ (section 1.2). The state is (x, y) \[m\]; there are no parameters.
pub fn model(_t: f64, _x: &SVector<f64, 2>, u: &Input, _params: &()) -> SVector<f64, 2> {
    u.speed * Vector2::new(u.heading.cos(), u.heading.sin())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::{Input, model};
    use crate::vehicle::integrate::advance;

    #[test]
    fn it_goes_where_it_looks() {
        let u = Input { speed: 2.0, heading: 0.5 };
        let end = advance(model, &Vector2::new(1.0, 0.0), &u, &(), 3.0, 4);
        assert!((end - Vector2::new(1.0 + 6.0 * 0.5f64.cos(), 6.0 * 0.5f64.sin())).norm() < 1e-14);
    }

    #[test]
    fn a_negative_speed_goes_backwards() {
        let forward = model(0.0, &Vector2::zeros(), &Input { speed: 1.0, heading: 0.3 }, &());
        let backward = model(0.0, &Vector2::zeros(), &Input { speed: -1.0, heading: 0.3 }, &());
        assert_eq!(forward, -backward);
    }
}
