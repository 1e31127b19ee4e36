//! Path following from d_e and r alone, ψ_e not measured: the output feedback of section 2.1.1, Figure 2.3.
//!
//! The controller K(s) of [`h2`](super::h2_figure_2_4) stands between differentiation and integration, as the
//! D-methodology has it: its inputs are ṙ, ḋ_e and d_e, its output is Ṅ. Of these derivatives nothing is needed but their
//! integrals, the rises of r and d_e themselves, so nothing is differentiated in the end, and no value at trimming occurs.

use nalgebra::{SVector, Vector4};

use super::h2_figure_2_4::{Controller, Disturbances, design};
use super::trimming::{Derivative, Deviation, LowPass, TrimmingLaw, Turning};
use crate::vehicle::integrate;

/// Changes of curvature smaller than this are rounding \[1/m\].
const SAME_CURVATURE: f64 = 1e-9;
/// Most Runge-Kutta steps of the controller in one control period.
const MOST_STEPS: f64 = 1000.0;

/// The output feedback, designed for one speed and for the curvature of the path.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputFeedback {
    speed: f64,
    disturbances: Disturbances,
    /// The design and its curvature.
    controller: Controller,
    c_c: f64,
    filters: Option<[LowPass; 2]>,
    /// The controller's state.
    x: Vector4<f64>,
    /// N/I \[rad/s²\].
    turning: f64,
    seen: Deviation,
    /// r and d_e up to which the controller knows.
    known: Option<[f64; 2]>,
}

impl OutputFeedback {
    /// The law at rest. `speed` \[m/s\], positive, is what the controller is designed for whatever the vehicle's speed is
    /// (0.4 in Figure 2.4); `c_c` \[1/m\] the curvature to begin with: at another one it is designed anew.
    pub fn new(
        speed: f64,
        c_c: f64,
        disturbances: Disturbances,
        derivative: Derivative,
    ) -> Result<OutputFeedback, String> {
        let filters = match derivative {
            Derivative::Exact => None,
            Derivative::Filtered { tau } => Some([LowPass::new(tau)?; 2]),
        };
        Ok(OutputFeedback {
            speed,
            disturbances,
            controller: design(c_c, speed, &disturbances)?,
            c_c,
            filters,
            x: Vector4::zeros(),
            turning: 0.0,
            seen: Deviation::default(),
            known: None,
        })
    }

    /// The controller now.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// B (ṙ, ḋ_e) integrated over rises of r and d_e.
    fn risen(&self, rise: [f64; 2]) -> Vector4<f64> {
        self.controller.b.column(0) * rise[0] + self.controller.b.column(1) * rise[1]
    }
}

impl TrimmingLaw for OutputFeedback {
    fn see(&mut self, seen: &Deviation) {
        // Where there is no design (a curvature that is no number) the last one stays.
        if (seen.c_c - self.c_c).abs() > SAME_CURVATURE
            && let Ok(controller) = design(seen.c_c, self.speed, &self.disturbances)
        {
            (self.controller, self.c_c) = (controller, seen.c_c);
        }
        if self.filters.is_none() {
            let [r, d_e] = self.known.replace([seen.r, seen.d_e]).unwrap_or([seen.r, seen.d_e]);
            self.x += self.risen([seen.r - r, seen.d_e - d_e]);
        }
        self.seen = *seen;
    }

    fn advance(&mut self, dt: f64) -> Turning {
        let (from, seen) = (self.turning, self.seen);
        let rates = match &mut self.filters {
            None => [0.0; 2],
            Some([r, d_e]) => [r.rise(seen.r, dt) / dt, d_e.rise(seen.d_e, dt) / dt],
        };
        let forced = self.risen(rates) + self.controller.b.column(2) * seen.d_e;
        // ẋ = A x + B (ṙ, ḋ_e, d_e), Ṅ = C x
        let model = |_: f64, state: &SVector<f64, 5>, k: &Controller, forced: &Vector4<f64>| {
            let x = state.fixed_rows::<4>(0);
            let x_dot = k.a * x + forced;
            SVector::from([x_dot[0], x_dot[1], x_dot[2], x_dot[3], (k.c * x).x])
        };
        let steps = (dt * self.controller.a.norm()).ceil().clamp(1.0, MOST_STEPS);
        let [a, b, c, d] = self.x.into();
        let state = SVector::from([a, b, c, d, from]);
        let [a, b, c, d, to] = integrate::advance(model, &state, &self.controller, &forced, dt, steps as usize).into();
        (self.x, self.turning) = (Vector4::new(a, b, c, d), to);
        Turning { from, to }
    }
}

#[cfg(test)]
mod tests {
    use super::{Derivative, Deviation, Disturbances, OutputFeedback, TrimmingLaw};

    fn law(derivative: Derivative) -> OutputFeedback {
        OutputFeedback::new(0.4, 0.5, Disturbances::default(), derivative).unwrap()
    }

    /// The robot of Figure 2.4 on a circle of 2 m under the law, by Euler steps: (r, d_e, ψ_e) after `seconds`.
    fn drive(mut law: OutputFeedback, v: f64, c_c: f64, start: [f64; 3], seconds: f64) -> [f64; 3] {
        let [mut r, mut d_e, mut psi_e] = start;
        let dt = 5e-3;
        for _ in 0..(seconds / dt) as usize {
            // The heading is not measured: the law gets nonsense for it.
            law.see(&Deviation { r, d_e, psi_e: f64::NAN, c_c, v: f64::NAN, v_dot: f64::NAN });
            let turning = law.advance(dt);
            let true_one = Deviation { r, d_e, psi_e, c_c, v, v_dot: 0.0 };
            (d_e, psi_e) = (d_e + dt * true_one.d_e_dot(), psi_e + dt * true_one.psi_e_dot());
            r += dt * 0.5 * (turning.from + turning.to);
        }
        [r, d_e, psi_e]
    }

    #[test]
    fn the_turning_rate_is_learnt_at_every_speed_of_figure_2_4() {
        for derivative in [Derivative::Exact, Derivative::Filtered { tau: 0.05 }] {
            for (v, c_c) in [(0.3, 0.5), (0.4, 0.5), (0.5, 0.5), (0.4, -0.5)] {
                let [r, d_e, psi_e] = drive(law(derivative), v, c_c, [0.0, 0.0, 0.0], 100.0);
                assert!((r - c_c * v).abs() < 1e-3 && d_e.abs() < 2e-3 && psi_e.abs() < 5e-3, "{v}: {r} {d_e} {psi_e}");
            }
        }
    }

    #[test]
    fn mirrored_it_does_the_same() {
        let one = drive(law(Derivative::Exact), 0.4, 0.5, [0.0, 0.1, 0.2], 5.0);
        let two = drive(law(Derivative::Exact), 0.4, -0.5, [0.0, -0.1, -0.2], 5.0);
        assert!(one.iter().zip(two).all(|(a, b)| (a + b).abs() < 1e-12), "{one:?} {two:?}");
    }

    #[test]
    fn another_curvature_is_another_design() {
        let mut law = law(Derivative::Exact);
        let before = *law.controller();
        law.see(&Deviation { c_c: 0.5, ..Deviation::default() });
        assert_eq!(before, *law.controller());
        law.see(&Deviation { c_c: 0.0, ..Deviation::default() });
        assert_ne!(before, *law.controller());
        let line = *law.controller();
        law.see(&Deviation { c_c: f64::NAN, ..Deviation::default() });
        assert_eq!(line, *law.controller());
        assert!(OutputFeedback::new(0.0, 0.5, Disturbances::default(), Derivative::Exact).is_err());
    }
}
