//! The wheeled robot of section 3.2.1, in chapter 2 (2.1), (2.2): a unicycle driven by a force and a torque.

use nalgebra::SVector;

use crate::positive::positive;

/// Where it is and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Position \[m\].
    pub x: f64,
    /// Position \[m\].
    pub y: f64,
    /// Heading ψ_B \[rad\].
    #[doc(alias = "ψ_B")]
    pub heading: f64,
    /// Forward speed v \[m/s\].
    pub speed: f64,
    /// Turning rate r \[rad/s\].
    pub turn_rate: f64,
}

impl State {
    /// As the model wants it: (x, y, ψ, v, r).
    pub fn to_vector(self) -> SVector<f64, 5> {
        SVector::from([self.x, self.y, self.heading, self.speed, self.turn_rate])
    }

    /// From (x, y, ψ, v, r).
    pub fn from_vector(x: SVector<f64, 5>) -> State {
        let [x, y, heading, speed, turn_rate] = x.into();
        State { x, y, heading, speed, turn_rate }
    }
}

/// What drives it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input {
    /// F \[N\], along the heading.
    pub force: f64,
    /// N \[N m\], positive to the left.
    pub torque: f64,
}

/// What it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// m \[kg\], positive; 1 in the thesis.
    pub mass: f64,
    /// I, the moment of inertia about the vertical \[kg m²\], positive; 1 in the thesis.
    pub inertia: f64,
}

impl Parameters {
    /// The parameters if they are physical, otherwise what is wrong with them.
    pub fn checked(self) -> Result<Parameters, String> {
        positive("a robot's mass", self.mass)?;
        positive("a robot's moment of inertia", self.inertia)?;
        Ok(self)
    }
}

/// ẋ = v cos ψ, ẏ = v sin ψ, ψ̇ = r, v̇ = F/m, ṙ = N/I, the last two being (3.12).
pub fn model(_t: f64, x: &SVector<f64, 5>, u: &Input, params: &Parameters) -> SVector<f64, 5> {
    let [_, _, psi, v, r] = (*x).into();
    SVector::from([v * psi.cos(), v * psi.sin(), r, u.force / params.mass, u.torque / params.inertia])
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;

    use super::{Input, Parameters, State, model};
    use crate::vehicle::integrate::advance;

    const PARAMETERS: Parameters = Parameters { mass: 4.0, inertia: 0.5 };

    #[test]
    fn a_constant_force_gives_the_parabola_of_free_fall() {
        let u = Input { force: 6.0, torque: 0.0 };
        let end = State::from_vector(advance(model, &SVector::zeros(), &u, &PARAMETERS, 2.0, 1));
        assert!((end.x - 3.0).abs() < 1e-14 && (end.speed - 3.0).abs() < 1e-14 && end.y == 0.0);
    }

    #[test]
    fn without_effort_it_drives_a_circle() {
        let start = State { speed: 2.0, turn_rate: 0.5, ..State::default() };
        let end = advance(model, &start.to_vector(), &Input::default(), &PARAMETERS, 3.0, 100);
        let end = State::from_vector(end);
        // The radius is v/r = 4 m and the centre is to the left.
        assert!((end.x - 4.0 * 1.5f64.sin()).abs() < 1e-9 && (end.y - 4.0 * (1.0 - 1.5f64.cos())).abs() < 1e-9);
    }

    #[test]
    fn a_positive_torque_turns_left() {
        let u = Input { force: 0.0, torque: 1.0 };
        let end = State::from_vector(advance(model, &SVector::zeros(), &u, &PARAMETERS, 1.0, 1));
        assert!((end.heading - 1.0).abs() < 1e-14 && (end.turn_rate - 2.0).abs() < 1e-14);
    }

    #[test]
    fn a_robot_without_mass_is_refused() {
        assert!(Parameters { mass: 0.0, inertia: 1.0 }.checked().is_err());
        assert!(Parameters { mass: 1.0, inertia: f64::NAN }.checked().is_err());
    }
}
