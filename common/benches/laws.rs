//! One control period of each craft: coordination law, path-following law, and the plant integrated in two steps.
//!
//! The allocations that are counted must be none.

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::sync::Arc;

use cpf_common::coordination::auxiliary_4_59::Auxiliary;
use cpf_common::coordination::decentralised_3_92::{Decentralised, Weighing};
use cpf_common::coordination::directed_3_72::Directed;
use cpf_common::coordination::gateway_2_33::Gateway;
use cpf_common::coordination::introduction_1_5::Introduction;
use cpf_common::coordination::leader_1_5::LeaderIntegral;
use cpf_common::coordination::pattern_3_70::MovingPattern;
use cpf_common::coordination::recruiting::Gains as Recruits;
use cpf_common::coordination::solution_1_3_43::SolutionOne;
use cpf_common::coordination::switching_4_21::Switching;
use cpf_common::coordination::weighted_3_62::Weighted;
use cpf_common::coordination::{CoordinationLaw, FleetLaw, Neighbour, Own, SpeedReference};
use cpf_common::craft::Craft;
use cpf_common::craft::kinematic::KinematicCraft;
use cpf_common::craft::robot::{RobotCraft, SpeedLoop};
use cpf_common::craft::trimming::TrimmingCraft;
use cpf_common::following::decoupling_2_14::Decoupling;
use cpf_common::following::h2_figure_2_4::{Controller, Disturbances, design};
use cpf_common::following::line_of_sight::LineOfSight;
use cpf_common::following::output_feedback_2_3::OutputFeedback;
use cpf_common::following::proposition_3_1::{Gains, Proposition31};
use cpf_common::following::state_transformation_2_19::StateTransformation;
use cpf_common::following::trimming::{Derivative, Placement, TrimmingLaw};
use cpf_common::path::circle::{Circle, Turn};
use cpf_common::path::closest::closest_parameter;
use cpf_common::path::line::Line;
use cpf_common::path::sinusoid::Sinusoid;
use cpf_common::vehicle::dynamic_unicycle::{Parameters, State};
use nalgebra::Vector3;

#[global_allocator]
static ALLOCATIONS: divan::AllocProfiler = divan::AllocProfiler::system();

const REFERENCE: SpeedReference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
const NEIGHBOURS: [Neighbour; 2] = [
    Neighbour { vehicle: 1, xi: 0.1, scalar: 0.0, said: 0.1, age: 0.0 },
    Neighbour { vehicle: 1, xi: -0.1, scalar: 0.01, said: -0.1, age: 0.0 },
];

fn main() {
    divan::main();
}

/// One control period of 20 ms of a vehicle whose law has states.
fn period_of_learner(bencher: divan::Bencher, mut craft: impl Craft, law: &dyn FleetLaw) {
    let mut law = law.vehicle(0);
    bencher.bench_local(|| {
        let own = craft.own(REFERENCE);
        craft.command(REFERENCE, law.demand(REFERENCE, &own, black_box(&NEIGHBOURS)));
        craft.advance(0.02, 2);
        law.advance(0.02);
        black_box(craft.observe())
    });
}

/// A robot of chapter 2 on a circle.
fn trimming_robot(law: Box<dyn TrimmingLaw>) -> TrimmingCraft {
    let path = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).expect("a path");
    let parameters = Parameters { mass: 5.0, inertia: 0.4 };
    let state = State { x: 2.0, heading: FRAC_PI_2, speed: 0.2, ..State::default() };
    TrimmingCraft::new(Arc::new(path), law, SpeedLoop::Acceleration, parameters, state, 0.0).expect("a robot")
}

fn gateway() -> Gateway {
    Gateway::new(0, 5.0, Recruits { a: 3.0, b: 3.0, c: 1.0 }).expect("gains")
}

#[divan::bench]
fn decoupling_with_2_33(bencher: divan::Bencher) {
    let placement = Placement::new(1.0, 0.05).expect("gains");
    let law = Decoupling::new(placement, Derivative::Exact).expect("a law");
    period_of_learner(bencher, trimming_robot(Box::new(law)), &gateway());
}

#[divan::bench]
fn output_feedback_with_2_33(bencher: divan::Bencher) {
    let law = OutputFeedback::new(0.4, 0.5, Disturbances::default(), Derivative::Exact).expect("a law");
    period_of_learner(bencher, trimming_robot(Box::new(law)), &gateway());
}

#[divan::bench]
fn state_transformation_with_2_33(bencher: divan::Bencher) {
    let law = StateTransformation::new(Placement::new(1.0, 0.05).expect("gains"));
    period_of_learner(bencher, trimming_robot(Box::new(law)), &gateway());
}

/// Done once per change of curvature; this one allocates.
#[divan::bench]
fn h_2_design() -> Controller {
    design(black_box(0.5), 0.4, &Disturbances::default()).expect("a controller")
}

/// One control period of 20 ms.
fn period(bencher: divan::Bencher, mut craft: impl Craft, law: impl CoordinationLaw) {
    bencher.bench_local(|| {
        let own = craft.own(REFERENCE);
        craft.command(REFERENCE, law.demand(REFERENCE, &own, black_box(&NEIGHBOURS)));
        craft.advance(0.02, 2);
        black_box(craft.observe())
    });
}

fn robot(speed_loop: SpeedLoop) -> RobotCraft {
    let path = Sinusoid::new(1.0, 1.0, 4.0, 0.0, 0.0).expect("a path");
    let law = Proposition31::new(Gains::default()).expect("gains");
    let parameters = Parameters { mass: 5.0, inertia: 0.4 };
    RobotCraft::new(Arc::new(path), law, speed_loop, parameters, State::default(), 0.0).expect("a robot")
}

#[divan::bench]
fn kinematic_with_1_5(bencher: divan::Bencher) {
    let path = Line::new(Vector3::zeros(), 0.3, 1.0).expect("a path");
    let sight = LineOfSight::new(1.0).expect("a distance");
    let craft = KinematicCraft::new(Arc::new(path), sight, 0.0, 1.0).expect("a craft");
    period(bencher, craft, Introduction::new(0.2).expect("a gain"));
}

#[divan::bench]
fn robot_with_3_43(bencher: divan::Bencher) {
    period(bencher, robot(SpeedLoop::Acceleration), SolutionOne::new(1.0).expect("a gain"));
}

#[divan::bench]
fn robot_with_4_21(bencher: divan::Bencher) {
    period(bencher, robot(SpeedLoop::Rate { k_0: 2.0 }), Switching::new(0.1).expect("a gain"));
}

/// The laws that differ from vehicle to vehicle or have states: one demand, one period of their own states, one word.
#[divan::bench(args = ["1.5 leader", "3.62", "3.70", "3.72", "3.92", "4.59", "4.62"])]
fn one_row_of(bencher: divan::Bencher, law: &str) {
    let law: Box<dyn FleetLaw> = match law {
        "1.5 leader" => Box::new(LeaderIntegral::new(1, 0.2, 0.04).expect("gains")),
        "3.62" => Box::new(Weighted::new(1.0, 1.0, 2, &[(0, 1, 2.0)]).expect("gains")),
        "3.70" => Box::new(MovingPattern::new(1.0, 0.25, 1.0).expect("gains")),
        "3.72" => Box::new(Directed::new(2.0, 1.0).expect("gains")),
        "3.92" => Box::new(Decentralised::new(0, 1.0, 1.0, Weighing::Normalised).expect("gains")),
        "4.59" => Box::new(Auxiliary::fixed(10.0, 16.0).expect("gains")),
        _ => Box::new(Auxiliary::switching(10.0, 16.0).expect("gains")),
    };
    let mut vehicle = law.vehicle(0);
    let own = Own { xi: 0.3, eta: 0.1, r: 2.0, v: 0.3, h_dot: 0.1, alpha_2: 0.1, ..Own::default() };
    bencher.bench_local(|| {
        let demand = vehicle.demand(REFERENCE, black_box(&own), black_box(&NEIGHBOURS));
        vehicle.advance(0.02);
        black_box((demand, vehicle.says(&own)))
    });
}

#[divan::bench]
fn closest_point_of_a_sinusoid() -> f64 {
    let path = Sinusoid::new(1.0, 1.0, 1.0, 0.0, 0.0).expect("a path");
    closest_parameter(&path, black_box(Vector3::new(0.3, 0.2, 0.0)), true)
}
