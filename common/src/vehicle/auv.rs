//! An underactuated vehicle in space: the rigid body (4.44)–(4.45) with the forces of section 4.6.
//!
//! One force along the body's x-axis and torques about its y- and z-axes; sway, heave and roll are not driven.
//! Units are tonnes, metres, seconds and kilonewtons throughout (erratum 4.13): the law of Theorem 4.7 adds terms
//! of different dimension and is hopelessly stiff in kilograms and newtons.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::attitude::{quaternion_rate, to_inertial, vertical_in_body};

/// The constants of a vehicle; axes of the body, x forward. All matrices are diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuvParameters {
    /// Diagonal of M, rigid body plus added mass \[t\], positive.
    #[doc(alias = "M")]
    pub mass: Vector3<f64>,
    /// Diagonal of J, rigid body plus added inertia \[t m²\], positive.
    #[doc(alias = "J")]
    pub inertia: Vector3<f64>,
    /// Linear drag X_v1, Y_v2, Z_v3 \[kN s/m\], not negative.
    pub linear_drag: Vector3<f64>,
    /// Quadratic drag X_|v1|v1, Y_|v2|v2, Z_|v3|v3 \[kN s²/m²\], not negative.
    pub quadratic_drag: Vector3<f64>,
    /// Linear rotational drag K_ω1, M_ω2, N_ω3 \[kN m s\], not negative.
    pub linear_spin_drag: Vector3<f64>,
    /// Quadratic rotational drag K_|ω1|ω1, M_|ω2|ω2, N_|ω3|ω3 \[kN m s²\], not negative.
    pub quadratic_spin_drag: Vector3<f64>,
    /// Weight W \[kN\]. Nothing produces a heave force: choose W = B (erratum 4.18).
    pub weight: f64,
    /// Buoyancy B \[kN\].
    pub buoyancy: f64,
    /// r_B \[m\] of ḡ₂. The printed ḡ₁ has the z-axis pointing up and the printed ḡ₂ has it pointing down; both are
    /// kept, so that a negative z-component is the righting one (erratum 4.17).
    #[doc(alias = "r_B")]
    pub centre_of_buoyancy: Vector3<f64>,
    /// Largest force that the thrusters give, either way \[kN\]; infinite for none.
    pub thrust_limit: f64,
    /// Largest torque about y and about z, either way \[kN m\]; infinite for none.
    pub torque_limit: f64,
}

/// The state of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuvState {
    /// p, in the inertial frame \[m\].
    pub position: Vector3<f64>,
    /// R, from body to inertial axes.
    pub attitude: UnitQuaternion<f64>,
    /// v, in body axes \[m/s\].
    pub velocity: Vector3<f64>,
    /// ω, in body axes \[rad/s\].
    #[doc(alias = "ω")]
    pub spin: Vector3<f64>,
}

impl AuvState {
    /// At rest at `position` with this attitude.
    pub fn at_rest(position: Vector3<f64>, attitude: UnitQuaternion<f64>) -> AuvState {
        AuvState { position, attitude, velocity: Vector3::zeros(), spin: Vector3::zeros() }
    }
    /// True while every component is finite.
    pub fn is_finite(&self) -> bool {
        let sum = self.position.sum() + self.attitude.as_vector().sum() + self.velocity.sum() + self.spin.sum();
        // A sum of finite numbers may overflow, but a vehicle whose state is that large is lost as well.
        sum.is_finite()
    }
}

/// What the actuators give, held over a control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AuvInput {
    /// u₁ = τ_u, force along the body's x-axis \[kN\].
    #[doc(alias = "u_1")]
    pub thrust: f64,
    /// τ_q, torque about the body's y-axis \[kN m\].
    #[doc(alias = "τ_q")]
    pub pitch_torque: f64,
    /// τ_r, torque about the body's z-axis \[kN m\].
    #[doc(alias = "τ_r")]
    pub yaw_torque: f64,
}

impl AuvInput {
    /// True if every component is finite.
    pub fn is_finite(&self) -> bool {
        self.thrust.is_finite() && self.pitch_torque.is_finite() && self.yaw_torque.is_finite()
    }
}

/// The plant: checked parameters with the inverses that the hot path needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Auv {
    parameters: AuvParameters,
    inverse_mass: Vector3<f64>,
    inverse_inertia: Vector3<f64>,
}

impl Auv {
    /// The plant with these parameters, or why there is none.
    pub fn new(parameters: AuvParameters) -> Result<Auv, String> {
        let AuvParameters { mass, inertia, weight, buoyancy, centre_of_buoyancy, .. } = parameters;
        for (name, diagonal) in [("mass", mass), ("inertia", inertia)] {
            if !diagonal.iter().all(|&x| x > 0.0 && x.is_finite()) {
                return Err(format!("{name} must be positive on each axis, not {:?}", diagonal.as_slice()));
            }
        }
        for (name, drag) in [
            ("linear_drag", parameters.linear_drag),
            ("quadratic_drag", parameters.quadratic_drag),
            ("linear_spin_drag", parameters.linear_spin_drag),
            ("quadratic_spin_drag", parameters.quadratic_spin_drag),
        ] {
            if !drag.iter().all(|&x| x >= 0.0 && x.is_finite()) {
                return Err(format!("{name} must not be negative, not {:?}", drag.as_slice()));
            }
        }
        if !(weight.is_finite() && buoyancy.is_finite() && centre_of_buoyancy.iter().all(|x| x.is_finite())) {
            return Err("weight, buoyancy and centre_of_buoyancy must be finite".into());
        }
        if !(parameters.thrust_limit > 0.0 && parameters.torque_limit > 0.0) {
            return Err("thrust_limit and torque_limit must be positive".into());
        }
        Ok(Auv { parameters, inverse_mass: mass.map(f64::recip), inverse_inertia: inertia.map(f64::recip) })
    }
    /// The parameters it was made from.
    pub fn parameters(&self) -> &AuvParameters {
        &self.parameters
    }
    /// Diagonal of M⁻¹ \[1/t\].
    pub fn inverse_mass(&self) -> Vector3<f64> {
        self.inverse_mass
    }
    /// Diagonal of J⁻¹ \[1/(t m²)\].
    pub fn inverse_inertia(&self) -> Vector3<f64> {
        self.inverse_inertia
    }

    /// What the actuators make of this input.
    pub fn saturate(&self, input: &AuvInput) -> AuvInput {
        let AuvParameters { thrust_limit: force, torque_limit: torque, .. } = self.parameters;
        AuvInput {
            thrust: input.thrust.clamp(-force, force),
            pitch_torque: input.pitch_torque.clamp(-torque, torque),
            yaw_torque: input.yaw_torque.clamp(-torque, torque),
        }
    }

    /// Section 4.6: f_v = −D_v(v) v − ḡ₁(R), with ḡ₁ = (W − B) Rᵀ e_z. `vertical` is Rᵀ e_z.
    pub fn force(&self, velocity: &Vector3<f64>, vertical: &Vector3<f64>) -> Vector3<f64> {
        let c = &self.parameters;
        -drag(&c.linear_drag, &c.quadratic_drag, velocity) - vertical * (c.weight - c.buoyancy)
    }
    /// The time derivative of [`force`](Auv::force), given v̇ and the rate of Rᵀ e_z.
    pub fn force_rate(
        &self,
        velocity: &Vector3<f64>,
        acceleration: &Vector3<f64>,
        vertical_rate: &Vector3<f64>,
    ) -> Vector3<f64> {
        let c = &self.parameters;
        let slope = c.linear_drag + 2.0 * c.quadratic_drag.component_mul(&velocity.abs());
        -slope.component_mul(acceleration) - vertical_rate * (c.weight - c.buoyancy)
    }
    /// Section 4.6: f_ω = −D_ω(ω) ω − ḡ₂(R) − S(v) M v − S(ω) J ω, with ḡ₂ = S(r_B) B Rᵀ e_z, erratum 4.17.
    pub fn torque(&self, velocity: &Vector3<f64>, spin: &Vector3<f64>, vertical: &Vector3<f64>) -> Vector3<f64> {
        let c = &self.parameters;
        -drag(&c.linear_spin_drag, &c.quadratic_spin_drag, spin)
            - c.centre_of_buoyancy.cross(&(vertical * c.buoyancy))
            - velocity.cross(&c.mass.component_mul(velocity))
            - spin.cross(&c.inertia.component_mul(spin))
    }
    /// (4.45a): M v̇ = −S(ω) M v + f_v + B₁ u₁, with B₁ = (1, 0, 0).
    pub fn acceleration(
        &self,
        velocity: &Vector3<f64>,
        spin: &Vector3<f64>,
        force: &Vector3<f64>,
        thrust: f64,
    ) -> Vector3<f64> {
        let coriolis = self.parameters.mass.component_mul(velocity).cross(spin);
        self.inverse_mass.component_mul(&(coriolis + force + Vector3::new(thrust, 0.0, 0.0)))
    }
    /// (4.45b): J ω̇ = f_ω + B₂ u₂, with the 3×2 matrix B₂ of section 4.6: no torque about x (erratum 4.10).
    pub fn spin_rate(&self, torque: &Vector3<f64>, input: &AuvInput) -> Vector3<f64> {
        self.inverse_inertia.component_mul(&(torque + Vector3::new(0.0, input.pitch_torque, input.yaw_torque)))
    }
    /// Kinetic energy ½ vᵀMv + ½ ωᵀJω of the body and the water that moves with it \[kJ\].
    pub fn kinetic_energy(&self, state: &AuvState) -> f64 {
        let c = &self.parameters;
        0.5 * (c.mass.component_mul(&state.velocity).dot(&state.velocity)
            + c.inertia.component_mul(&state.spin).dot(&state.spin))
    }

    /// The state `dt` seconds later under a held input: one step of RK4, the quaternion renormalised after it.
    pub fn step(&self, state: &AuvState, input: &AuvInput, dt: f64) -> AuvState {
        let x = Flow { p: state.position, q: state.attitude.into_inner(), v: state.velocity, w: state.spin };
        let k1 = self.flow(&x, input);
        let k2 = self.flow(&x.along(&k1, 0.5 * dt), input);
        let k3 = self.flow(&x.along(&k2, 0.5 * dt), input);
        let k4 = self.flow(&x.along(&k3, dt), input);
        let sixth = dt / 6.0;
        let next = x.along(&k1, sixth).along(&k2, 2.0 * sixth).along(&k3, 2.0 * sixth).along(&k4, sixth);
        AuvState { position: next.p, attitude: UnitQuaternion::new_normalize(next.q), velocity: next.v, spin: next.w }
    }

    /// The right-hand side of (4.44)–(4.45).
    fn flow(&self, x: &Flow, input: &AuvInput) -> Flow {
        let vertical = vertical_in_body(&x.q);
        Flow {
            p: to_inertial(&x.q, &x.v),
            q: quaternion_rate(&x.q, &x.w),
            v: self.acceleration(&x.v, &x.w, &self.force(&x.v, &vertical), input.thrust),
            w: self.spin_rate(&self.torque(&x.v, &x.w, &vertical), input),
        }
    }
}

/// D(v) v with D = diag(linear + quadratic |v|).
fn drag(linear: &Vector3<f64>, quadratic: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    (linear + quadratic.component_mul(&v.abs())).component_mul(v)
}

/// A state or its rate, as plain numbers: inside a Runge–Kutta step the quaternion is not of unit norm.
#[derive(Clone, Copy)]
struct Flow {
    p: Vector3<f64>,
    q: Quaternion<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
}

impl Flow {
    fn along(&self, rate: &Flow, dt: f64) -> Flow {
        Flow { p: self.p + rate.p * dt, q: self.q + rate.q * dt, v: self.v + rate.v * dt, w: self.w + rate.w * dt }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::attitude::{from_yaw_pitch_roll, yaw_pitch_roll};
    use crate::vehicle::sirene::sirene;
    use proptest::prelude::*;

    fn moving(pitch: f64, roll: f64) -> AuvState {
        AuvState {
            position: Vector3::new(3.0, -2.0, 1.0),
            attitude: from_yaw_pitch_roll(0.4, pitch, roll),
            velocity: Vector3::new(0.6, -0.3, 0.2),
            spin: Vector3::new(0.3, -0.4, 0.5),
        }
    }

    fn frictionless() -> Auv {
        let none = Vector3::zeros();
        Auv::new(AuvParameters {
            linear_drag: none,
            quadratic_drag: none,
            linear_spin_drag: none,
            quadratic_spin_drag: none,
            centre_of_buoyancy: none,
            ..*sirene().parameters()
        })
        .expect("positive masses")
    }

    fn run(auv: &Auv, mut state: AuvState, input: &AuvInput, dt: f64, steps: usize) -> AuvState {
        for _ in 0..steps {
            state = auv.step(&state, input, dt);
        }
        state
    }

    #[test]
    fn without_drag_and_input_kinetic_energy_and_momentum_are_kept() {
        let auv = frictionless();
        let start = moving(0.2, -0.7);
        let end = run(&auv, start, &AuvInput::default(), 0.005, 4000);
        // ½(4.7·0.36 + 7.6·0.09 + 6.4·0.04) + ½(2.2·0.09 + 7.5·0.16 + 7.7·0.25).
        assert!((auv.kinetic_energy(&start) - 0.5 * (2.632 + 3.323)).abs() < 1e-12);
        let momentum = |s: &AuvState| s.attitude * auv.parameters().mass.component_mul(&s.velocity);
        let energy = auv.kinetic_energy(&start);
        assert!((auv.kinetic_energy(&end) / energy - 1.0).abs() < 1e-9);
        assert!((momentum(&end) - momentum(&start)).norm() < 1e-8);
        // It did move: the energy went back and forth between translation and rotation.
        assert!((end.spin - start.spin).norm() > 0.05);
    }

    #[test]
    fn the_step_is_of_fourth_order() {
        // Without quadratic drag, whose second derivative jumps where a velocity changes sign.
        let none = Vector3::zeros();
        let smooth = AuvParameters { quadratic_drag: none, quadratic_spin_drag: none, ..*sirene().parameters() };
        let auv = Auv::new(smooth).expect("valid");
        let input = AuvInput { thrust: 0.4, pitch_torque: -0.3, yaw_torque: 0.5 };
        let after = |steps: usize| run(&auv, moving(0.2, 0.6), &input, 1.0 / steps as f64, steps);
        let exact = after(2000);
        let error = |steps: usize| {
            let s = after(steps);
            let turn = (s.attitude.as_vector() - exact.attitude.as_vector()).norm();
            (s.position - exact.position).norm() + turn + (s.spin - exact.spin).norm()
        };
        // Halving the step divides the error by 16.
        assert!((12.0..20.0).contains(&(error(20) / error(40))), "{}", error(20) / error(40));
    }

    #[test]
    fn the_terminal_speed_balances_thrust_and_drag() {
        let auv = sirene();
        // 0.15 v + 1.45 v² at 0.8 m/s.
        let input = AuvInput { thrust: 0.15 * 0.8 + 1.45 * 0.64, ..AuvInput::default() };
        let start = AuvState::at_rest(Vector3::zeros(), UnitQuaternion::identity());
        let end = run(&auv, start, &input, 0.05, 4000);
        assert!((end.velocity - Vector3::new(0.8, 0.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn roll_is_righting_and_capsizes_with_the_other_sign() {
        let heeled = AuvState::at_rest(Vector3::zeros(), from_yaw_pitch_roll(0.0, 0.0, 0.5));
        let up = run(&sirene(), heeled, &AuvInput::default(), 0.05, 2000);
        assert!(yaw_pitch_roll(&up.attitude)[2].abs() < 1e-3);
        let parameters = AuvParameters { centre_of_buoyancy: Vector3::new(0.0, 0.0, 0.36), ..*sirene().parameters() };
        let over = run(&Auv::new(parameters).expect("valid"), heeled, &AuvInput::default(), 0.05, 2000);
        assert!(yaw_pitch_roll(&over.attitude)[2].abs() > 3.1);
    }

    #[test]
    fn torques_by_hand() {
        // One at a time: drag; buoyancy at an arm, r_B × B e_z; S(v)Mv, which turns a hull that drifts sideways (Munk); S(ω)Jω.
        let (auv, none, up) = (sirene(), Vector3::zeros(), Vector3::z());
        let drag = auv.torque(&none, &Vector3::new(0.0, -0.5, 0.0), &none);
        assert!((drag - Vector3::new(0.0, 0.8 * 0.5 + 7.2 * 0.25, 0.0)).norm() < 1e-12, "{drag}");
        let arm = AuvParameters { centre_of_buoyancy: Vector3::new(0.1, 0.2, -0.3), weight: 41.0, ..*auv.parameters() };
        let righting = Auv::new(arm).expect("valid").torque(&none, &none, &up);
        assert!((righting - Vector3::new(-0.2 * 39.24, 0.1 * 39.24, 0.0)).norm() < 1e-12, "{righting}");
        let munk = auv.torque(&Vector3::new(0.5, 0.2, 0.0), &none, &none);
        assert!((munk - Vector3::new(0.0, 0.0, -0.5 * 0.2 * (7.6 - 4.7))).norm() < 1e-12, "{munk}");
        let gyroscopic = frictionless().torque(&none, &Vector3::new(0.3, 0.4, 0.0), &none);
        assert!((gyroscopic - Vector3::new(0.0, 0.0, -0.3 * 0.4 * (7.5 - 2.2))).norm() < 1e-12, "{gyroscopic}");
    }

    #[test]
    fn one_number_that_is_none_is_told_of() {
        let sound = moving(0.1, 0.2);
        assert!(sound.is_finite());
        let nan = Vector3::new(0.0, f64::NAN, 0.0);
        let lost = UnitQuaternion::new_unchecked(Quaternion::new(1.0, f64::NAN, 0.0, 0.0));
        for state in [
            AuvState { position: nan, ..sound },
            AuvState { attitude: lost, ..sound },
            AuvState { velocity: nan, ..sound },
            AuvState { spin: nan, ..sound },
        ] {
            assert!(!state.is_finite(), "{state:?}");
        }
        let input = AuvInput { thrust: 1.0, pitch_torque: 2.0, yaw_torque: 3.0 };
        assert!(input.is_finite());
        for input in [
            AuvInput { thrust: f64::NAN, ..input },
            AuvInput { pitch_torque: f64::INFINITY, ..input },
            AuvInput { yaw_torque: f64::NAN, ..input },
        ] {
            assert!(!input.is_finite(), "{input:?}");
        }
    }

    #[test]
    fn excess_weight_sinks_along_minus_z() {
        let heavy = Auv::new(AuvParameters { weight: 39.44, ..*sirene().parameters() }).expect("valid");
        let start = AuvState::at_rest(Vector3::zeros(), UnitQuaternion::identity());
        let end = run(&heavy, start, &AuvInput::default(), 0.05, 2000);
        // 0.36 v + 3.6 v² = 0.2 kN.
        let terminal = (-0.36 + (0.36f64.powi(2) + 4.0 * 3.6 * 0.2).sqrt()) / 7.2;
        assert!((end.velocity.z + terminal).abs() < 1e-6);
    }

    #[test]
    fn the_force_rate_is_the_derivative_of_the_force() {
        let auv = Auv::new(AuvParameters { weight: 41.0, ..*sirene().parameters() }).expect("valid");
        let (v, a) = (Vector3::new(0.6, -0.3, 0.2), Vector3::new(0.1, 0.5, -0.7));
        let (up, up_rate) = (Vector3::new(0.1, -0.2, 0.9), Vector3::new(-0.3, 0.2, 0.05));
        let h = 1e-4;
        let at = |h: f64| auv.force(&(v + a * h), &(up + up_rate * h));
        assert!(((at(h) - at(-h)) / (2.0 * h) - auv.force_rate(&v, &a, &up_rate)).norm() < 1e-9);
    }

    #[test]
    fn actuators_saturate_each_on_its_own() {
        let weak = AuvParameters { thrust_limit: 0.5, torque_limit: 0.2, ..*sirene().parameters() };
        let auv = Auv::new(weak).expect("valid");
        let given = auv.saturate(&AuvInput { thrust: 0.4, pitch_torque: -3.0, yaw_torque: 0.3 });
        assert_eq!(given, AuvInput { thrust: 0.4, pitch_torque: -0.2, yaw_torque: 0.2 });
        let given = auv.saturate(&AuvInput { thrust: -0.6, pitch_torque: 0.1, yaw_torque: -0.3 });
        assert_eq!(given, AuvInput { thrust: -0.5, pitch_torque: 0.1, yaw_torque: -0.2 });
    }

    #[test]
    fn impossible_parameters_are_refused() {
        let good = *sirene().parameters();
        let bad = [
            AuvParameters { mass: Vector3::new(0.0, 1.0, 1.0), ..good },
            AuvParameters { inertia: Vector3::new(1.0, f64::NAN, 1.0), ..good },
            AuvParameters { quadratic_drag: Vector3::new(-1.0, 0.0, 0.0), ..good },
            AuvParameters { weight: f64::INFINITY, ..good },
            AuvParameters { torque_limit: f64::NAN, ..good },
            AuvParameters { torque_limit: 0.0, ..good },
            AuvParameters { thrust_limit: 0.0, ..good },
            AuvParameters { thrust_limit: -1.0, ..good },
            AuvParameters { mass: Vector3::new(1.0, f64::INFINITY, 1.0), ..good },
            AuvParameters { linear_drag: Vector3::new(0.0, 0.0, f64::INFINITY), ..good },
            AuvParameters { buoyancy: f64::NAN, ..good },
            AuvParameters { centre_of_buoyancy: Vector3::new(0.0, f64::NAN, 0.0), ..good },
        ];
        // Without limits, and of less than one tonne.
        let light = AuvParameters {
            mass: Vector3::repeat(0.5),
            thrust_limit: f64::INFINITY,
            torque_limit: f64::INFINITY,
            ..good
        };
        assert!(Auv::new(light).is_ok());
        for parameters in bad {
            assert!(Auv::new(parameters).is_err());
        }
    }

    proptest! {
        #[test]
        fn the_world_may_be_turned_about_the_vertical_and_shifted(
            turn in -3.0..3.0f64, shift in prop::array::uniform3(-50.0..50.0f64), roll in -1.0..1.0f64,
        ) {
            let auv = sirene();
            let (turn, shift) = (from_yaw_pitch_roll(turn, 0.0, 0.0), Vector3::from(shift));
            let input = AuvInput { thrust: 0.4, pitch_torque: -0.3, yaw_torque: 0.5 };
            let start = moving(-0.3, roll);
            let there =
                AuvState { position: turn * start.position + shift, attitude: turn * start.attitude, ..start };
            let (end, end_there) = (run(&auv, start, &input, 0.05, 60), run(&auv, there, &input, 0.05, 60));
            prop_assert!((end_there.position - (turn * end.position + shift)).norm() < 1e-11);
            prop_assert!(end_there.attitude.angle_to(&(turn * end.attitude)) < 1e-7);
            prop_assert!((end_there.spin - end.spin).norm() < 1e-12);
        }

        #[test]
        fn drag_takes_energy_away(v in prop::array::uniform3(-2.0..2.0f64), w in prop::array::uniform3(-1.0..1.0f64)) {
            let neutral = AuvParameters { centre_of_buoyancy: Vector3::zeros(), ..*sirene().parameters() };
            let auv = Auv::new(neutral).expect("valid");
            let start = AuvState { velocity: v.into(), spin: w.into(), ..moving(0.1, 0.2) };
            let end = run(&auv, start, &AuvInput::default(), 0.01, 100);
            prop_assert!(auv.kinetic_energy(&end) <= auv.kinetic_energy(&start));
        }
    }
}
