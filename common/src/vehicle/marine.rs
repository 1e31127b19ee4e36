//! A fully actuated marine vehicle in the horizontal plane: surge and sway forces and a torque about the vertical
//! (3.28), seen in its body or in its flow frame (3.29), (3.30).
//!
//! The flow frame has its x-axis along the velocity: u = v_t cos β, v = v_t sin β (3.25). The forces map as
//!
//! ```text
//! (τ_vt, v_t τ_β) = Rᵀ(β) (τ_u/m_u, τ_v/m_v)
//! ```
//!
//! whose determinant as a map to (τ_vt, τ_β) is 1/(m_u m_v v_t) (erratum 3.5): at v_t = 0 there is no side-slip that
//! could be commanded. The way back, from (τ_vt, τ_β) to (τ_u, τ_v), has no division and no singularity.

use nalgebra::SVector;

use crate::positive::{not_negative, positive};

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
    /// Surge speed u \[m/s\].
    pub surge: f64,
    /// Sway speed v \[m/s\], positive to the left.
    pub sway: f64,
    /// Turning rate r \[rad/s\].
    pub turn_rate: f64,
}

impl State {
    /// As the model wants it: (x, y, ψ, u, v, r).
    pub fn to_vector(self) -> SVector<f64, 6> {
        SVector::from([self.x, self.y, self.heading, self.surge, self.sway, self.turn_rate])
    }

    /// From (x, y, ψ, u, v, r).
    pub fn from_vector(x: SVector<f64, 6>) -> State {
        let [x, y, heading, surge, sway, turn_rate] = x.into();
        State { x, y, heading, surge, sway, turn_rate }
    }
}

/// What drives it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input {
    /// τ_u \[N\], along the body's x-axis.
    #[doc(alias = "τ_u")]
    pub surge: f64,
    /// τ_v \[N\], along the body's y-axis.
    #[doc(alias = "τ_v")]
    pub sway: f64,
    /// τ_r \[N m\], positive to the left.
    #[doc(alias = "τ_r")]
    pub torque: f64,
}

/// What it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// m_u, mass with the water that surges along \[kg\], positive.
    pub m_u: f64,
    /// m_v, mass with the water that sways along \[kg\], positive.
    pub m_v: f64,
    /// m_r, moment of inertia with that of the water \[kg m²\], positive.
    pub m_r: f64,
    /// d_u, surge drag \[kg/s\], not negative.
    pub d_u: f64,
    /// d_v, sway drag \[kg/s\], not negative.
    pub d_v: f64,
    /// d_r, drag on turning \[kg m²/s\], not negative.
    pub d_r: f64,
}

impl Parameters {
    /// The parameters if they are physical, otherwise what is wrong with them.
    pub fn checked(self) -> Result<Parameters, String> {
        for (name, value) in [("m_u", self.m_u), ("m_v", self.m_v), ("m_r", self.m_r)] {
            positive(name, value)?;
        }
        for (name, value) in [("d_u", self.d_u), ("d_v", self.d_v), ("d_r", self.d_r)] {
            not_negative(name, value)?;
        }
        Ok(self)
    }

    /// m_uv = m_u − m_v (erratum 3.4): with it the Coriolis terms of (3.28) do no work.
    pub fn m_uv(&self) -> f64 {
        self.m_u - self.m_v
    }

    /// f_vt of (3.30) \[m/s²\].
    pub fn f_vt(&self, v_t: f64, beta: f64, r: f64) -> f64 {
        let (sin, cos) = beta.sin_cos();
        let Parameters { m_u, m_v, d_u, d_v, .. } = *self;
        (m_v / m_u - m_u / m_v) * v_t * r * sin * cos - (d_u / m_u * cos * cos + d_v / m_v * sin * sin) * v_t
    }

    /// f_β of (3.30) \[rad/s\].
    pub fn f_beta(&self, beta: f64, r: f64) -> f64 {
        let (sin, cos) = beta.sin_cos();
        let Parameters { m_u, m_v, d_u, d_v, .. } = *self;
        -m_v / m_u * r + (m_v / m_u - m_u / m_v) * r * cos * cos + (d_u / m_u - d_v / m_v) * sin * cos
    }

    /// f_r of (3.30), erratum 3.4: −(d_r/m_r) r + (m_uv/m_r) v_t² sin β cos β \[rad/s²\].
    pub fn f_r(&self, v_t: f64, beta: f64, r: f64) -> f64 {
        let (sin, cos) = beta.sin_cos();
        (-self.d_r * r + self.m_uv() * v_t * v_t * sin * cos) / self.m_r
    }

    /// (τ_u, τ_v) that make (τ_vt, τ_β) of (3.30): τ_u = m_u(cos β τ_vt − v_t sin β τ_β),
    /// τ_v = m_v(sin β τ_vt + v_t cos β τ_β).
    pub fn forces(&self, v_t: f64, beta: f64, tau_vt: f64, tau_beta: f64) -> [f64; 2] {
        let (sin, cos) = beta.sin_cos();
        [self.m_u * (cos * tau_vt - v_t * sin * tau_beta), self.m_v * (sin * tau_vt + v_t * cos * tau_beta)]
    }
}

/// ẋ = u cos ψ − v sin ψ, ẏ = u sin ψ + v cos ψ, ψ̇ = r and (3.28).
pub fn model(_t: f64, x: &SVector<f64, 6>, tau: &Input, params: &Parameters) -> SVector<f64, 6> {
    let [_, _, psi, u, v, r] = (*x).into();
    let (sin, cos) = psi.sin_cos();
    let Parameters { m_u, m_v, m_r, d_u, d_v, d_r } = *params;
    SVector::from([
        u * cos - v * sin,
        u * sin + v * cos,
        r,
        (tau.surge + m_v * v * r - d_u * u) / m_u,
        (tau.sway - m_u * u * r - d_v * v) / m_v,
        (tau.torque + params.m_uv() * u * v - d_r * r) / m_r,
    ])
}

/// The velocity in polar form: u = v_t cos β, v = v_t sin β (3.25).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow {
    /// v_t, the total speed \[m/s\]; negative for a vehicle that moves against its flow frame.
    pub v_t: f64,
    /// β = ψ_F − ψ_B (3.27), the side-slip \[rad\].
    pub beta: f64,
    /// Whether the vehicle was too slow to have a side-slip, so that the wanted one stands for it.
    pub is_singular: bool,
}

impl Flow {
    /// That of a velocity. Each velocity has two forms, (v_t, β) and (−v_t, β ± π): the one closer to the side-slip
    /// `wanted` is taken, so that a vehicle that slows down and reverses keeps its side-slip. Below `slowest` \[m/s\]
    /// β says nothing: it is `wanted`, and v_t the speed in that direction.
    pub fn of(surge: f64, sway: f64, wanted: f64, slowest: f64) -> Flow {
        let (sin, cos) = wanted.sin_cos();
        // The velocity in the wanted flow frame.
        let (along, across) = (surge * cos + sway * sin, sway * cos - surge * sin);
        let speed = along.hypot(across);
        if speed < slowest {
            return Flow { v_t: along, beta: wanted, is_singular: true };
        }
        let sense = if along < 0.0 { -1.0 } else { 1.0 };
        Flow { v_t: sense * speed, beta: wanted + (sense * across).atan2(sense * along), is_singular: false }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;
    use crate::vehicle::integrate::advance;

    const PARAMETERS: Parameters =
        Parameters { m_u: 500.0, m_v: 1000.0, m_r: 700.0, d_u: 100.0, d_v: 300.0, d_r: 400.0 };

    proptest! {
        /// (3.28) and (3.29) are the same motion in two frames.
        #[test]
        fn the_flow_frame_agrees_with_the_body(
            v_t in 0.05..2.0f64, beta in -1.5..1.5f64, r in -1.0..1.0f64,
            tau in prop::array::uniform3(-500.0..500.0f64),
        ) {
            let x = State { surge: v_t * beta.cos(), sway: v_t * beta.sin(), turn_rate: r, ..State::default() };
            let input = Input { surge: tau[0], sway: tau[1], torque: tau[2] };
            let [_, _, _, u_dot, v_dot, r_dot] = model(0.0, &x.to_vector(), &input, &PARAMETERS).into();
            let (sin, cos) = beta.sin_cos();
            let tau_vt = cos / 500.0 * tau[0] + sin / 1000.0 * tau[1];
            let tau_beta = (-sin / 500.0 * tau[0] + cos / 1000.0 * tau[1]) / v_t;
            let p = &PARAMETERS;
            prop_assert!((u_dot * cos + v_dot * sin - p.f_vt(v_t, beta, r) - tau_vt).abs() < 1e-12);
            let beta_dot = (v_dot * cos - u_dot * sin) / v_t;
            prop_assert!((beta_dot - p.f_beta(beta, r) - tau_beta).abs() < 1e-10);
            prop_assert!((r_dot - p.f_r(v_t, beta, r) - tau[2] / 700.0).abs() < 1e-12);
            // And back, without a division.
            let [surge, sway] = p.forces(v_t, beta, tau_vt, tau_beta);
            prop_assert!((surge - tau[0]).abs() < 1e-9 && (sway - tau[1]).abs() < 1e-9);
        }

        #[test]
        fn a_velocity_has_the_side_slip_closer_to_the_wanted_one(
            v_t in 0.05..2.0f64, off in -1.5..1.5f64, wanted in -3.0..3.0f64, backwards: bool,
        ) {
            let (v_t, beta) = (if backwards { -v_t } else { v_t }, wanted + off);
            let flow = Flow::of(v_t * beta.cos(), v_t * beta.sin(), wanted, 0.01);
            prop_assert!((flow.v_t - v_t).abs() < 1e-12 && (flow.beta - beta).abs() < 1e-12 && !flow.is_singular);
        }
    }

    #[test]
    fn the_determinant_of_the_map_is_the_inverse_of_m_u_m_v_v_t() {
        // Erratum 3.5, by columns of the inverse map.
        let (v_t, beta) = (0.7, 0.4);
        let [a, b] = [PARAMETERS.forces(v_t, beta, 1.0, 0.0), PARAMETERS.forces(v_t, beta, 0.0, 1.0)];
        assert!((a[0] * b[1] - a[1] * b[0] - 500.0 * 1000.0 * v_t).abs() < 1e-6);
    }

    #[test]
    fn a_vehicle_at_rest_has_no_side_slip_of_its_own() {
        let flow = Flow::of(0.003, -0.002, 0.3, 0.01);
        assert_eq!((flow.beta, flow.is_singular), (0.3, true));
        assert!((flow.v_t - (0.003 * 0.3f64.cos() - 0.002 * 0.3f64.sin())).abs() < 1e-15);
        let forces = PARAMETERS.forces(0.0, 0.0, 0.1, 5.0);
        assert!((forces[0] - 50.0).abs() < 1e-12 && forces[1] == 0.0, "no speed, no side force");
    }

    #[test]
    fn without_drag_and_effort_the_energy_stays() {
        let smooth = Parameters { d_u: 0.0, d_v: 0.0, d_r: 0.0, ..PARAMETERS };
        let energy = |x: &State| 500.0 * x.surge.powi(2) + 1000.0 * x.sway.powi(2) + 700.0 * x.turn_rate.powi(2);
        let start = State { surge: 0.8, sway: -0.3, turn_rate: 0.4, ..State::default() };
        let end = State::from_vector(advance(model, &start.to_vector(), &Input::default(), &smooth, 20.0, 4000));
        assert!((energy(&end) / energy(&start) - 1.0).abs() < 1e-9);
        assert!((end.surge - start.surge).abs() > 0.05, "it does move");
    }

    #[test]
    fn signs_and_the_world_turned() {
        let left = State::from_vector(advance(
            model,
            &State { surge: 1.0, ..State::default() }.to_vector(),
            &Input { torque: 100.0, ..Input::default() },
            &PARAMETERS,
            0.5,
            10,
        ));
        assert!(left.heading > 0.0 && left.sway < 0.0, "a left turn slips to the right");
        let turned = State { heading: PI / 2.0, sway: 1.0, ..State::default() };
        let rate = model(0.0, &turned.to_vector(), &Input::default(), &PARAMETERS);
        assert!((rate[0] + 1.0).abs() < 1e-15 && rate[1].abs() < 1e-15);
    }

    #[test]
    fn a_vehicle_without_mass_is_refused() {
        for wrong in [
            Parameters { m_u: 0.0, ..PARAMETERS },
            Parameters { m_v: 0.0, ..PARAMETERS },
            Parameters { m_r: -1.0, ..PARAMETERS },
            Parameters { d_u: -1.0, ..PARAMETERS },
            Parameters { d_v: -1.0, ..PARAMETERS },
            Parameters { d_r: -1.0, ..PARAMETERS },
        ] {
            assert!(wrong.checked().is_err(), "{wrong:?}");
        }
        assert!(PARAMETERS.checked().is_ok());
    }
}
