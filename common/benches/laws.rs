//! One control period of each craft: coordination law, path-following law, and the plant integrated in two steps.
//!
//! The allocations that are counted must be none.

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::sync::Arc;

use cpf_common::coordination::auxiliary_4_59::Auxiliary;
use cpf_common::coordination::decentralised_3_92::{Decentralised, Weighing};
use cpf_common::coordination::delayed_4_34::Delayed;
use cpf_common::coordination::delayed_4_42::DelayedAlone;
use cpf_common::coordination::delayed_4_42_estimating::Estimating;
use cpf_common::coordination::directed_3_72::Directed;
use cpf_common::coordination::gateway_2_33::Gateway;
use cpf_common::coordination::introduction_1_5::Introduction;
use cpf_common::coordination::known_delay::KnownDelay;
use cpf_common::coordination::leader_1_5::LeaderIntegral;
use cpf_common::coordination::leader_follower_2_30::LeaderFollower;
use cpf_common::coordination::neighbours_2_7::Neighbours;
use cpf_common::coordination::pattern_3_70::MovingPattern;
use cpf_common::coordination::prescribed_2_6::{Alone, SquareWave};
use cpf_common::coordination::recruiting::Gains as Recruits;
use cpf_common::coordination::solution_1_3_43::SolutionOne;
use cpf_common::coordination::solution_2_3_44::SolutionTwo;
use cpf_common::coordination::solution_3_3_45::SolutionThree;
use cpf_common::coordination::switching_4_21::Switching;
use cpf_common::coordination::weighted_3_62::Weighted;
use cpf_common::coordination::{CoordinationLaw, FleetLaw, Neighbour, Own, SpeedReference};
use cpf_common::craft::Craft;
use cpf_common::craft::kinematic::KinematicCraft;
use cpf_common::craft::marine::{MarineCraft, SideSlip};
use cpf_common::craft::robot::RobotCraft;
use cpf_common::craft::speed_loop::SpeedLoop;
use cpf_common::craft::trimming::TrimmingCraft;
use cpf_common::following::decoupling_2_14::Decoupling;
use cpf_common::following::h2_figure_2_4::{Controller, Disturbances as H2Disturbances, design};
use cpf_common::following::line_of_sight::LineOfSight;
use cpf_common::following::output_feedback_2_3::OutputFeedback;
use cpf_common::following::proposition_3_1::{Approach, Bend, Errors, Gains, Motion, Proposition31, Sense, Slip};
use cpf_common::following::proposition_3_2::Proposition32;
use cpf_common::following::proposition_3_3::Proposition33;
use cpf_common::following::state_transformation_2_19::StateTransformation;
use cpf_common::following::trimming::{Derivative, Deviation, Placement, TrimmingLaw};
use cpf_common::path::Path;
use cpf_common::path::circle::{Circle, Turn};
use cpf_common::path::closest::closest_parameter;
use cpf_common::path::line::Line;
use cpf_common::path::sinusoid::Sinusoid;
use cpf_common::path::spline::Spline;
use cpf_common::time::Time;
use cpf_common::vehicle::dynamic_unicycle::{Parameters, State};
use cpf_common::vehicle::environment::{Current, Disturbances, Environment, NoiseLevels};
use cpf_common::vehicle::marine;
use nalgebra::Vector3;

#[global_allocator]
static ALLOCATIONS: divan::AllocProfiler = divan::AllocProfiler::system();

const REFERENCE: SpeedReference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
const NEIGHBOURS: [Neighbour; 2] = [
    Neighbour { vehicle: 1, xi: 0.1, scalar: 0.0, said: 0.1, age: 0.0 },
    Neighbour { vehicle: 2, xi: -0.1, scalar: 0.01, said: -0.1, age: 0.0 },
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
    let law = OutputFeedback::new(0.4, 0.5, H2Disturbances::default(), Derivative::Exact).expect("a law");
    period_of_learner(bencher, trimming_robot(Box::new(law)), &gateway());
}

#[divan::bench]
fn state_transformation_with_2_33(bencher: divan::Bencher) {
    let law = StateTransformation::new(Placement::new(1.0, 0.05).expect("gains"));
    period_of_learner(bencher, trimming_robot(Box::new(law)), &gateway());
}

/// A law of chapter 2 alone: what it sees, and one period of its own states.
#[divan::bench(args = ["decoupling", "decoupling, filtered", "output feedback", "state transformation"])]
fn one_period_of(bencher: divan::Bencher, law: &str) {
    let placement = Placement::new(1.0, 0.05).expect("gains");
    let filtered = Derivative::Filtered { tau: 0.05 };
    let mut law: Box<dyn TrimmingLaw> = match law {
        "decoupling" => Box::new(Decoupling::new(placement, Derivative::Exact).expect("a law")),
        "decoupling, filtered" => Box::new(Decoupling::new(placement, filtered).expect("a law")),
        "output feedback" => {
            Box::new(OutputFeedback::new(0.4, 0.5, H2Disturbances::default(), Derivative::Exact).expect("a law"))
        }
        _ => Box::new(StateTransformation::new(placement)),
    };
    let seen = Deviation { d_e: 0.1, psi_e: 0.2, c_c: 0.5, v: 0.4, v_dot: 0.01, r: 0.2 };
    bencher.bench_local(|| {
        law.see(black_box(&seen));
        law.advance(0.02)
    });
}

/// Propositions 3.1 to 3.3 alone.
#[divan::bench(args = ["3.1", "3.1 with Appendix 6.1", "3.2", "3.3"])]
fn one_steering_of(bencher: divan::Bencher, law: &str) {
    let e = Errors { x_e: 0.1, y_e: -0.3, psi_e: 0.2 };
    let slip = Slip { beta_dot: 0.01, beta_ddot: 0.001 };
    let (motion, bend) = (Motion { v: 0.4, v_dot: 0.01, r: 0.2, slip }, Bend { c_c: 0.5, dc_ds: 0.1 });
    let of_6_1 = Gains { approach: Approach::Arctangent { psi_a: 1.0, length: 1.0 }, ..Gains::default() };
    match law {
        "3.2" => {
            let law = Proposition32::new(Gains::default()).expect("gains");
            bencher.bench_local(|| law.steer(black_box(&e), &motion, &bend, Sense::Forward));
        }
        "3.3" => {
            let law = Proposition33::new(Gains::default(), 1.0).expect("gains");
            bencher.bench_local(|| law.steer(black_box(&e), &motion, &bend, Sense::Forward));
        }
        name => {
            let gains = if name == "3.1" { Gains::default() } else { of_6_1 };
            let law = Proposition31::new(gains).expect("gains");
            bencher.bench_local(|| law.steer(black_box(&e), &motion, &bend, Sense::Forward));
        }
    }
}

/// The line of sight of section 1.2 alone.
#[divan::bench]
fn one_heading_of_1_4(bencher: divan::Bencher) {
    let law = LineOfSight::new(1.0).expect("a distance");
    bencher.bench_local(|| law.heading(black_box(0.3), 0.5));
}

/// Done once per change of curvature; this one allocates.
#[divan::bench]
fn h_2_design() -> Controller {
    design(black_box(0.5), 0.4, &H2Disturbances::default()).expect("a controller")
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

/// Every coordination law, of a vehicle with two neighbours: one demand, one period of its own states, one word.
#[divan::bench(args = [
    "1.5", "1.5 leader", "2.30 leader", "2.31 follower", "2.33 gateway", "2.34 other", "2.5.3 gateway", "2.5.3 other",
    "2.7-3 in a row", "2.30 alone", "2.6 square wave", "3.43", "3.44", "3.45", "3.62", "3.70", "3.72", "3.92 told",
    "3.92 other", "4.21", "4.34", "4.42", "4.42 estimating", "known delay", "4.59", "4.62",
])]
fn one_row_of(bencher: divan::Bencher, law: &str) {
    let recruits = Recruits { a: 3.0, b: 3.0, c: 1.0 };
    let more = Recruits { a: 4.0, b: 6.0, c: 4.0 };
    let law: Box<dyn FleetLaw> = match law {
        "1.5" => Box::new(Introduction::new(0.2).expect("a gain")),
        "1.5 leader" => Box::new(LeaderIntegral::new(1, 0.2, 0.04).expect("gains")),
        "2.30 leader" => Box::new(LeaderFollower::new(0, 1.0, recruits).expect("gains")),
        "2.31 follower" => Box::new(LeaderFollower::new(1, 1.0, recruits).expect("gains")),
        "2.33 gateway" => Box::new(gateway()),
        "2.34 other" => Box::new(Gateway::new(1, 5.0, recruits).expect("gains")),
        "2.5.3 gateway" => Box::new(Gateway::with_integral(0, 5.0, more, 1.0).expect("gains")),
        "2.5.3 other" => Box::new(Gateway::with_integral(1, 5.0, more, 1.0).expect("gains")),
        "2.7-3 in a row" => Box::new(Neighbours::new(1, 5.0, recruits).expect("gains")),
        "2.30 alone" => Box::new(Alone::new(1.0).expect("a gain")),
        "2.6 square wave" => Box::new(SquareWave::new(0.1, 10.0).expect("a wave")),
        "3.43" => Box::new(SolutionOne::new(1.0).expect("a gain")),
        "3.44" => Box::new(SolutionTwo::new(1.0, 1.0).expect("gains")),
        "3.45" => Box::new(SolutionThree::new(1.0, 0.25, 1.0).expect("gains")),
        "4.21" => Box::new(Switching::new(0.1).expect("a gain")),
        "4.34" => Box::new(Delayed::new(0.1).expect("a gain")),
        "4.42" => Box::new(DelayedAlone::new(0.1, 5.0).expect("gains")),
        "4.42 estimating" => Box::new(Estimating::new(0.1, 10.0).expect("gains")),
        "known delay" => Box::new(KnownDelay::new(0.1, 10.0).expect("gains")),
        "3.62" => Box::new(Weighted::new(1.0, 1.0, 3, &[(0, 1, 2.0)]).expect("gains")),
        "3.70" => Box::new(MovingPattern::new(1.0, 0.25, 1.0).expect("gains")),
        "3.72" => Box::new(Directed::new(2.0, 1.0).expect("gains")),
        "3.92 told" => Box::new(Decentralised::new(0, 1.0, 1.0, Weighing::Normalised).expect("gains")),
        "3.92 other" => Box::new(Decentralised::new(1, 1.0, 1.0, Weighing::Normalised).expect("gains")),
        "4.59" => Box::new(Auxiliary::fixed(10.0, 16.0).expect("gains")),
        "4.62" => Box::new(Auxiliary::switching(10.0, 16.0).expect("gains")),
        _ => return,
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
fn robot_of_proposition_3_2_with_3_43(bencher: divan::Bencher) {
    let path = Sinusoid::new(1.0, 1.0, 4.0, 0.0, 0.0).expect("a path");
    let law = Proposition32::new(Gains::default()).expect("gains");
    let parameters = Parameters { mass: 5.0, inertia: 0.4 };
    let robot = RobotCraft::new(Arc::new(path), law, SpeedLoop::Acceleration, parameters, State::default(), 0.0);
    period(bencher, robot.expect("a robot"), SolutionOne::new(1.0).expect("a gain"));
}

#[divan::bench]
fn marine_vehicle_of_proposition_3_3_with_4_21(bencher: divan::Bencher) {
    let path = Sinusoid::new(1.0, 1.0, 40.0, 0.0, 0.0).expect("a path");
    let law = Proposition33::new(Gains::default(), 1.0).expect("gains");
    let parameters = marine::Parameters { m_u: 500.0, m_v: 1000.0, m_r: 700.0, d_u: 100.0, d_v: 300.0, d_r: 400.0 };
    let speed_loop = SpeedLoop::Rate { k_0: 2.0 };
    let state = marine::State::default();
    let craft = MarineCraft::new(Arc::new(path), law, speed_loop, SideSlip::NONE, parameters, state, 0.0);
    period(bencher, craft.expect("a vehicle"), Switching::new(0.1).expect("a gain"));
}

#[divan::bench]
fn point_of_a_spline(bencher: divan::Bencher) {
    let points = (0..200).map(|i| Vector3::new(f64::from(i), f64::from(i * i % 7), 0.0)).collect();
    let path = Spline::by_length(points, 1.0).expect("a path");
    bencher.bench_local(|| path.at(black_box(123.4)));
}

#[divan::bench]
fn conditions_with_a_current_and_noise(bencher: divan::Bencher) {
    let noise = NoiseLevels { position: 0.1, heading: 0.01, speed: 0.01, turn_rate: 0.01 };
    let current = Current { mean: Vector3::x(), tide: None };
    let disturbances = Disturbances { noise: Some(noise), current: Some(current), stuck: None };
    let mut environment = Environment::new(disturbances, 1, "v1").expect("disturbed");
    bencher.bench_local(|| environment.conditions(Time::ZERO, black_box(7)));
}

#[divan::bench]
fn closest_point_of_a_sinusoid() -> f64 {
    let path = Sinusoid::new(1.0, 1.0, 1.0, 0.0, 0.0).expect("a path");
    closest_parameter(&path, black_box(Vector3::new(0.3, 0.2, 0.0)), true)
}
