use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use nalgebra::Vector3;
use proptest::prelude::*;

use super::TrimmingCraft;
use crate::coordination::gateway_2_33::Gateway;
use crate::coordination::prescribed_2_6::{Alone, SquareWave};
use crate::coordination::recruiting::Gains;
use crate::coordination::solution_2_3_44::SolutionTwo;
use crate::coordination::{Demand, FleetLaw, Neighbour, SpeedReference, VehicleLaw};
use crate::craft::speed_loop::SpeedLoop;
use crate::craft::{AT_CENTRE, Craft, Limits};
use crate::following::decoupling_2_14::Decoupling;
use crate::following::h2_figure_2_4::Disturbances;
use crate::following::output_feedback_2_3::OutputFeedback;
use crate::following::state_transformation_2_19::StateTransformation;
use crate::following::trimming::{Derivative, Placement, TrimmingLaw};
use crate::path::Path;
use crate::path::chain::{Chain, Segment};
use crate::path::circle::{Circle, Turn};
use crate::path::helix::Helix;
use crate::path::line::Line;
use crate::path::sinusoid::Sinusoid;
use crate::vehicle::dynamic_unicycle::{Parameters, State};
use crate::vehicle::environment::{Conditions, InstrumentErrors};

const REFERENCE: SpeedReference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
const DT: f64 = 0.02;

fn decoupling(lambda_p: f64) -> Box<dyn TrimmingLaw> {
    Box::new(Decoupling::new(Placement::new(lambda_p, 0.05).unwrap(), Derivative::Exact).unwrap())
}

fn transformation(lambda_p: f64) -> Box<dyn TrimmingLaw> {
    Box::new(StateTransformation::new(Placement::new(lambda_p, 0.05).unwrap()))
}

fn filtered(lambda_p: f64) -> Box<dyn TrimmingLaw> {
    let derivative = Derivative::Filtered { tau: 0.05 };
    Box::new(Decoupling::new(Placement::new(lambda_p, 0.05).unwrap(), derivative).unwrap())
}

fn craft(path: impl Path + 'static, law: Box<dyn TrimmingLaw>, [x, y, heading, speed]: [f64; 4]) -> TrimmingCraft {
    let state = State { x, y, heading, speed, turn_rate: 0.0 };
    let parameters = Parameters { mass: 3.0, inertia: 0.5 };
    TrimmingCraft::new(Arc::new(path), law, SpeedLoop::Acceleration, parameters, state, 0.0).unwrap()
}

fn circle(radius: f64, turn: Turn) -> Circle {
    Circle::new(Vector3::zeros(), radius, turn, 0.0, 1.0).unwrap()
}

/// One control period.
fn step(craft: &mut TrimmingCraft, law: &mut dyn VehicleLaw, heard: &[Neighbour]) {
    let own = craft.own(REFERENCE);
    craft.command(REFERENCE, law.demand(REFERENCE, &own, heard));
    craft.advance(DT, 2);
    law.advance(DT);
    assert!(craft.is_sound());
}

fn alone(craft: &mut TrimmingCraft, seconds: f64) {
    let mut law = Alone::new(2.0).unwrap().vehicle(0);
    for _ in 0..(seconds / DT).round() as usize {
        step(craft, law.as_mut(), &[]);
    }
}

fn count(craft: &TrimmingCraft, what: &str) -> u64 {
    craft.warnings().iter().filter(|warning| warning.what == what).map(|warning| warning.count).sum()
}

#[test]
fn a_circle_is_followed_alike_in_either_sense() {
    for law in [decoupling, transformation, filtered] {
        let mut left = craft(circle(2.0, Turn::Left), law(1.0), [2.2, 0.0, FRAC_PI_2 + 0.1, 0.2]);
        let mut right = craft(circle(2.0, Turn::Right), law(1.0), [2.2, 0.0, -FRAC_PI_2 - 0.1, 0.2]);
        for _ in 0..40 {
            alone(&mut left, 1.0);
            alone(&mut right, 1.0);
            let (one, two) = (left.observe(), right.observe());
            assert!(
                (one.e_cross + two.e_cross).abs() < 1e-9 && (one.psi_e + two.psi_e).abs() < 1e-9,
                "{one:?} {two:?}"
            );
            assert!((one.xi - two.xi).abs() < 1e-9 && one.e_along.abs() < 1e-12);
        }
        let seen = left.observe();
        assert!(seen.e_norm < 1e-4 && (seen.xi_rate - 0.1).abs() < 1e-4, "{seen:?}");
    }
}

#[test]
fn d_e_is_positive_to_the_left_of_the_motion() {
    // Erratum 2.6: CCW d = R − ρ, CW d = ρ − R, a line to +y d = x_0 − x.
    let start = [2.2, 0.0, FRAC_PI_2, 0.1];
    assert!((craft(circle(2.0, Turn::Left), decoupling(1.0), start).observe().e_cross + 0.2).abs() < 1e-12);
    assert!((craft(circle(2.0, Turn::Right), decoupling(1.0), start).observe().e_cross - 0.2).abs() < 1e-12);
    let up = Line::new(Vector3::new(1.0, 0.0, 0.0), FRAC_PI_2, 1.0).unwrap();
    assert!((craft(up, decoupling(1.0), start).observe().e_cross + 1.2).abs() < 1e-12);
}

#[test]
fn errors_decay_as_four_roots_at_minus_lambda_p() {
    // From rest on N and z = 0 the D-methodology starts with its integral wound such that N = 0; for the state
    // transformation d(t) = d₀ (1 + λt + (λt)²/2 − (λt)³/2) e^(−λt), by d, ḋ = vψ, d̈ = vη and d⃛ = −k₂ v d₀ = −4λ³ d₀.
    let line = Line::new(Vector3::zeros(), 0.0, 2.0).unwrap();
    let (lambda, d_0) = (1.0, 1e-3);
    let mut craft = craft(line, transformation(lambda), [0.0, d_0, 0.0, 0.2]);
    for second in 1..=8 {
        alone(&mut craft, 1.0);
        let t = lambda * f64::from(second);
        let expected = d_0 * (1.0 + t + t * t / 2.0 - t.powi(3) / 2.0) * (-t).exp();
        assert!((craft.observe().e_cross - expected).abs() < 0.05 * d_0, "{t}: {} {expected}", craft.observe().e_cross);
    }
}

#[test]
fn the_output_feedback_comes_to_its_circle_from_rest_in_turning() {
    for v in [0.3, 0.4, 0.5] {
        let rate = v / (2.0 * REFERENCE.v_l);
        let path = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, rate).unwrap();
        let law = OutputFeedback::new(0.4, 0.5, Disturbances::default(), Derivative::Exact).unwrap();
        let mut craft = craft(path, Box::new(law), [2.0, 0.0, FRAC_PI_2, v]);
        alone(&mut craft, 100.0);
        let seen = craft.observe();
        assert!(seen.e_norm < 2e-3 && (seen.speed - v).abs() < 1e-9, "{v}: {seen:?}");
    }
}

#[test]
fn figure_2_6_a_force_disturbs_the_decoupling_method_alone() {
    let worst = |law: Box<dyn TrimmingLaw>| {
        let mut craft = craft(circle(1.0, Turn::Left), law, [1.0, 0.0, FRAC_PI_2, 0.2]);
        craft.state.turn_rate = 0.2;
        let mut force = SquareWave::new(0.05, 8.0).unwrap().vehicle(0);
        let mut worst = 0.0f64;
        for period in 0..4000 {
            step(&mut craft, force.as_mut(), &[]);
            // What the start leaves is not counted.
            if period > 2000 {
                worst = worst.max(craft.observe().e_norm);
            }
        }
        worst
    };
    let (decoupled, transformed) = (worst(decoupling(1.0)), worst(transformation(1.0)));
    assert!(decoupled > 0.01 && transformed < 0.02 * decoupled, "{decoupled} {transformed}");
}

#[test]
fn figure_2_11_a_vehicle_that_faces_backwards_turns_round() {
    for law in [decoupling, transformation] {
        let mut craft = craft(circle(2.0, Turn::Left), law(1.0), [2.0, 0.0, -FRAC_PI_2 + 0.05, 0.2]);
        alone(&mut craft, 150.0);
        let seen = craft.observe();
        assert!(seen.e_norm < 1e-2 && seen.psi_e.abs() < 1e-2 && seen.xi_rate > 0.09, "{seen:?}");
    }
}

#[test]
fn the_fleet_of_section_2_5_3_on_its_circles() {
    // Section 2.5.3, with robots: vehicle 2 stuck at 0.25 m/s settles (2.43) behind.
    let gains = Gains { a: 3.0, b: 3.0, c: 1.0 };
    let law = Gateway::new(0, 5.0, gains).unwrap();
    let mut fleet: Vec<TrimmingCraft> = [2.0, 3.0, 4.0]
        .map(|radius| craft(circle(radius, Turn::Left), decoupling(2.0), [radius, 0.0, FRAC_PI_2, 0.1 * radius]))
        .into();
    let mut laws: Vec<Box<dyn VehicleLaw>> = (0..3).map(|i| law.vehicle(i)).collect();
    let hears: [&[usize]; 3] = [&[1, 2], &[0], &[0]];
    for period in 0..6000 {
        let stuck_speed = (period > 500).then_some(0.25);
        fleet[1].expose(&Conditions { stuck_speed, ..Conditions::default() });
        let xi: Vec<f64> = fleet.iter().map(|craft| craft.own(REFERENCE).xi).collect();
        for i in 0..3 {
            let heard: Vec<Neighbour> =
                hears[i].iter().map(|&j| Neighbour { vehicle: j, xi: xi[j], ..Neighbour::default() }).collect();
            step(&mut fleet[i], laws[i].as_mut(), &heard);
        }
    }
    let seen: Vec<_> = fleet.iter().map(|craft| craft.observe()).collect();
    assert!((seen[0].xi - seen[1].xi - 1.0 / 12.0).abs() < 1e-4, "{} {}", seen[0].xi, seen[1].xi);
    assert!((seen[0].xi - seen[2].xi).abs() < 1e-4);
    assert!(seen.iter().all(|seen| seen.e_norm < 1e-3), "{seen:?}");
    assert!(fleet.iter().all(|craft| craft.warnings().iter().all(|warning| warning.count == 0)));
}

#[test]
fn lines_and_arcs_are_followed_through_their_joints() {
    let arc = |sweep| Segment::Arc { radius: 2.0, sweep, xi_length: PI };
    let line = Segment::Line { length: 3.0, xi_length: 1.5 };
    let path = Chain::new(Vector3::zeros(), 0.0, &[line, arc(PI), line, arc(-PI), line]).unwrap();
    for law in [decoupling, transformation] {
        let mut craft = craft(path.clone(), law(2.0), [0.0, 0.0, 0.0, 0.2]);
        let mut worst = 0.0f64;
        for _ in 0..100 {
            alone(&mut craft, 1.0);
            worst = worst.max(craft.observe().e_norm);
        }
        assert!(worst < 0.1 && craft.observe().xi > 9.0 && count(&craft, AT_CENTRE) == 0, "{worst}");
    }
}

#[test]
fn across_the_centre_the_foot_jumps_and_is_counted() {
    let mut craft = craft(circle(1.0, Turn::Left), decoupling(0.5), [0.1, 0.0, PI, 0.5]);
    alone(&mut craft, 1.0);
    assert!(count(&craft, AT_CENTRE) > 0 && craft.is_sound());
    alone(&mut craft, 60.0);
    assert!(craft.is_sound() && craft.observe().e_norm.is_finite());
}

#[test]
fn a_rate_or_an_acceleration_of_chapter_3_will_do_too() {
    let law = SolutionTwo::new(1.0, 1.0).unwrap();
    let mut one = craft(circle(2.0, Turn::Left), decoupling(1.0), [2.0, 0.0, FRAC_PI_2, 0.0]);
    let mut stateless = FleetLaw::vehicle(&law, 0);
    for _ in 0..2000 {
        step(&mut one, stateless.as_mut(), &[]);
    }
    assert!((one.observe().xi_rate - 0.1).abs() < 1e-6);
    let mut two = craft(circle(2.0, Turn::Left), decoupling(1.0), [2.0, 0.0, FRAC_PI_2, 0.0]);
    two.speed_loop = SpeedLoop::Rate { k_0: 2.0 };
    for _ in 0..2000 {
        two.command(REFERENCE, Demand::Rate(0.15));
        two.advance(DT, 1);
    }
    assert!((two.observe().xi_rate - 0.15).abs() < 1e-6);
    let before = two.observe();
    two.command(REFERENCE, Demand::Acceleration(1.0));
    two.command(REFERENCE, Demand::Rate(f64::NAN));
    assert_eq!((two.observe(), count(&two, super::REFUSED)), (before, 2));
}

#[test]
fn limits_are_kept_and_counted() {
    let limits = Limits { force: 0.01, torque: 1e-3, ..Limits::NONE };
    let mut craft = craft(circle(2.0, Turn::Left), decoupling(1.0), [2.2, 0.0, FRAC_PI_2, 0.0]).limited(limits);
    alone(&mut craft, 1.0);
    assert!(count(&craft, super::SATURATED) > 0);
    assert!(craft.observe().speed <= 0.01 / 3.0 + 1e-12 && craft.state.turn_rate.abs() <= 1e-3 / 0.5 + 1e-12);
}

#[test]
fn a_place_for_the_target_chooses_the_lap_alone() {
    let mut craft = craft(circle(2.0, Turn::Left), decoupling(1.0), [2.2, 0.0, FRAC_PI_2, 0.0]);
    craft.place_target(13.0);
    assert!((craft.observe().xi - 4.0 * PI).abs() < 1e-9);
    craft.place_target(f64::NAN);
    assert!((craft.observe().xi - 4.0 * PI).abs() < 1e-9);
}

#[test]
fn what_is_no_path_for_it_is_refused() {
    let refused = |path: Arc<dyn Path>, parameters: Parameters, x: f64| {
        let state = State { x, ..State::default() };
        TrimmingCraft::new(path, decoupling(1.0), SpeedLoop::Acceleration, parameters, state, 0.0).is_err()
    };
    let sound = Parameters { mass: 1.0, inertia: 1.0 };
    assert!(refused(Arc::new(Helix::new(2.0, 1.0, 0.0, 0.5, 0.0).unwrap()), sound, 0.0));
    assert!(refused(Arc::new(circle(2.0, Turn::Left)), Parameters { mass: 0.0, ..sound }, 0.0));
    assert!(refused(Arc::new(circle(2.0, Turn::Left)), sound, f64::NAN));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn turning_and_moving_the_world_changes_nothing(turn in -PI..PI, east in -20.0..20.0f64, north in -20.0..20.0f64,
                                                    transformed: bool) {
        let law = if transformed { transformation } else { decoupling };
        let arc = Segment::Arc { radius: 2.0, sweep: 2.0, xi_length: 2.0 };
        let line = Segment::Line { length: 0.5, xi_length: 0.5 };
        let path = |start, heading| Chain::new(start, heading, &[line, arc]).unwrap();
        let mut here = craft(path(Vector3::zeros(), 0.0), law(1.0), [0.0, 0.1, 0.2, 0.2]);
        let (sin, cos) = turn.sin_cos();
        let there = [east - 0.1 * sin, north + 0.1 * cos, 0.2 + turn, 0.2];
        let mut there = craft(path(Vector3::new(east, north, 0.0), turn), law(1.0), there);
        alone(&mut here, 6.0);
        alone(&mut there, 6.0);
        let (one, two) = (here.observe(), there.observe());
        prop_assert!((one.xi - two.xi).abs() < 1e-8 && (one.e_cross - two.e_cross).abs() < 1e-8);
        prop_assert!((one.psi_e - two.psi_e).abs() < 1e-8);
    }
}

#[test]
fn what_is_measured_is_the_state_with_every_error() {
    let mut craft = craft(circle(2.0, Turn::Left), decoupling(1.0), [2.5, 0.0, 1.6, 0.4]);
    craft.state.turn_rate = 0.5;
    let errors = InstrumentErrors {
        position: Vector3::new(0.125, 0.25, 9.0),
        heading: 0.0625,
        velocity: Vector3::new(0.5, 9.0, 9.0),
        spin: Vector3::new(9.0, 9.0, 0.75),
    };
    let foot = craft.observe().xi;
    craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
    let wanted = State { x: 2.625, y: 0.25, heading: 1.6625, speed: 0.9, turn_rate: 1.25 };
    assert!((craft.measured().to_vector() - wanted.to_vector()).norm() < 1e-15);
    // So it believes itself further along its path, in what it tells of itself and not in the record.
    let own = craft.own(REFERENCE);
    assert!((own.xi - 0.25f64.atan2(2.625)).abs() < 1e-12 && own.v == 0.9 && (own.eta - 0.7).abs() < 1e-12, "{own:?}");
    assert_eq!(craft.observe().xi, foot);
    craft.expose(&Conditions::default());
    assert_eq!(craft.own(REFERENCE).xi, foot);
}

#[test]
fn own_rate_of_r_is_that_of_the_foot() {
    let path = Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap();
    let mut craft = craft(path, decoupling(1.0), [0.3, 0.3, 0.5, 0.4]);
    let own = craft.own(REFERENCE);
    craft.command(REFERENCE, Demand::Acceleration(0.0));
    craft.advance(1e-6, 1);
    let rate = (craft.own(REFERENCE).r - own.r) / 1e-6;
    assert!((rate - own.r_dot).abs() < 1e-5 && own.r_dot.abs() > 0.05, "{rate} {own:?}");
}

#[test]
fn the_torque_goes_evenly_from_where_the_law_was_to_where_it_comes() {
    let mut craft = craft(circle(2.0, Turn::Left), decoupling(1.0), [2.5, 0.0, 1.6, 0.4]);
    for _ in 0..3 {
        craft.command(REFERENCE, Demand::Acceleration(0.0));
        let before = craft.state.turn_rate;
        craft.advance(0.2, 2);
        let mean = 0.5 * (craft.turning.from + craft.turning.to);
        assert!((craft.state.turn_rate - before - 0.2 * mean).abs() < 1e-12 && craft.turning.from != craft.turning.to);
    }
    assert!(craft.warnings()[2].count == 0 && craft.observe().attitude == [craft.state.heading, 0.0, 0.0]);
    // A torque at its limit is counted, at either end of the period.
    craft.limits.torque = 1e-9;
    craft.command(REFERENCE, Demand::Acceleration(0.0));
    craft.advance(0.2, 2);
    assert_eq!((craft.warnings()[2].count, craft.refused()), (1, 0));
    // From rest the law begins with none, so that only its end is.
    let mut fresh = self::craft(circle(2.0, Turn::Left), decoupling(1.0), [2.5, 0.0, 1.6, 0.4]);
    fresh.limits.torque = 1e-9;
    fresh.command(REFERENCE, Demand::Acceleration(0.0));
    fresh.advance(0.2, 2);
    assert!(fresh.turning.from == 0.0 && fresh.warnings()[2].count == 1);
}

#[test]
fn at_the_limit_of_its_force_the_law_knows_what_becomes_of_the_speed() {
    // Asked for more than it has, it turns as one that was asked for what it has; and stuck, as one that was asked for nothing.
    let turning = |demand: f64, force: f64, stuck_speed: Option<f64>| {
        let mut craft = craft(circle(2.0, Turn::Left), transformation(1.0), [2.3, 0.0, 1.7, 0.4]);
        craft.limits.force = force;
        craft.expose(&Conditions { stuck_speed, ..Conditions::default() });
        craft.command(REFERENCE, Demand::Forward(demand));
        craft.advance(0.2, 2);
        craft.turning.to
    };
    let free = f64::INFINITY;
    assert!((turning(5.0, 0.6, None) - turning(0.2, free, None)).abs() < 1e-12);
    assert!((turning(5.0, free, Some(0.4)) - turning(0.0, free, None)).abs() < 1e-12);
    assert!((turning(0.2, free, None) - turning(0.0, free, None)).abs() > 1e-6, "else nothing is tested");
}

#[test]
fn a_current_carries_it_and_a_state_that_is_no_number_is_told_of() {
    let sound = || craft(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), decoupling(1.0), [0.0, 0.0, 0.0, 0.4]);
    let mut adrift = sound();
    adrift.expose(&Conditions { current: Some(Vector3::new(-0.5, 0.3, 0.0)), ..Conditions::default() });
    adrift.command(REFERENCE, Demand::Forward(0.0));
    adrift.advance(0.02, 1);
    let [x, y, _] = adrift.observe().position;
    assert!((x + 0.1 * 0.02).abs() < 1e-9 && (y - 0.3 * 0.02).abs() < 1e-9, "{x} {y}");
    let mut stuck = sound();
    stuck.expose(&Conditions { stuck_speed: Some(f64::NAN), ..Conditions::default() });
    let mut forced = sound();
    forced.force = f64::INFINITY;
    assert!(sound().is_sound() && !stuck.is_sound() && !forced.is_sound());
    let mut refusing = sound();
    refusing.command(REFERENCE, Demand::Forward(f64::NAN));
    assert_eq!((refusing.refused(), refusing.is_sound()), (1, true));
}
