//! One control step of an underactuated vehicle: the law with its exact derivative, one step of RK4, the path once.

use std::f64::consts::{FRAC_PI_4, TAU};
use std::sync::Arc;

use cpf_common::coordination::{Demand, SpeedReference};
use cpf_common::craft::Craft;
use cpf_common::craft::auv::AuvCraft;
use cpf_common::following::theorem_4_7::{Gains, TargetMotion, TargetRate, Theorem47};
use cpf_common::path::{Path, PathPoint};
use cpf_common::vehicle::auv::{AuvInput, AuvState};
use cpf_common::vehicle::sirene::sirene;
use divan::{Bencher, black_box};
use nalgebra::{UnitQuaternion, Vector3};

const STEPS: u32 = 1000;
const V_L: f64 = 0.5;

/// The path of the first vehicle of section 4.6.
#[derive(Debug)]
struct Helix;

impl Path for Helix {
    fn at(&self, xi: f64) -> PathPoint {
        let k = TAU / 400.0;
        let (s, c) = (k * xi - 3.0 * FRAC_PI_4).sin_cos();
        PathPoint {
            p: Vector3::new(20.0 * c, 20.0 * s, 0.05 * xi - 10.0),
            d1: Vector3::new(-20.0 * k * s, 20.0 * k * c, 0.05),
            d2: Vector3::new(-20.0 * k * k * c, -20.0 * k * k * s, 0.0),
            d3: Vector3::new(20.0 * k * k * k * s, -20.0 * k * k * k * c, 0.0),
        }
    }
    fn search_range(&self) -> (f64, f64) {
        (0.0, 400.0)
    }
}

fn start() -> AuvState {
    AuvState::at_rest(Vector3::new(5.0, -10.0, -5.0), UnitQuaternion::identity())
}

fn law() -> Theorem47 {
    Theorem47::new(Gains::default(), sirene()).expect("the default gains are valid")
}

fn main() {
    divan::main();
}

/// `command` and `advance`, a thousand control steps of 50 ms: read microseconds as nanoseconds per step.
#[divan::bench(args = [TargetMotion::TypeI, TargetMotion::TypeII])]
fn thousand_control_steps(bencher: Bencher, motion: TargetMotion) {
    bencher.with_inputs(|| AuvCraft::new(law(), motion, 1.0, Arc::new(Helix), start(), 79.517)).bench_refs(|craft| {
        for _ in 0..STEPS {
            craft.command(SpeedReference { v_l: V_L, v_l_dot: 0.0 }, Demand::Rate(black_box(V_L)));
            craft.advance(black_box(0.05), 1);
        }
    });
}

/// The law alone, a thousand times.
#[divan::bench]
fn thousand_evaluations(bencher: Bencher) {
    let (law, state, point) = (law(), start(), Helix.at(79.517));
    let rate = TargetRate { nominal: V_L, nominal_dot: 0.0, actual: V_L };
    bencher.bench(|| {
        for _ in 0..STEPS {
            black_box(law.evaluate(black_box(&state), black_box(&point), rate));
        }
    });
}

/// The plant alone, a thousand steps of RK4.
#[divan::bench]
fn thousand_plant_steps(bencher: Bencher) {
    let (auv, input) = (sirene(), AuvInput { thrust: 0.4, pitch_torque: -0.1, yaw_torque: 0.2 });
    bencher.with_inputs(start).bench_refs(|state| {
        for _ in 0..STEPS {
            *state = auv.step(state, &input, black_box(0.05));
        }
    });
}
