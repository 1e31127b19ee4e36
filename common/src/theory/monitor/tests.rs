//! Examples of the thesis, and numbers by hand.

use super::*;
use crate::graph::measure::Connectivity;
use crate::graph::switching::Switching;
use crate::time::Time;

fn s(seconds: f64) -> Span {
    Span::from_secs(seconds)
}

fn agreement(gain: f64) -> Watched {
    Watched::Agreement(vec![gain; 3], PathFollowing::TypeII { lambda_1: 1.0 })
}

/// The row of three of section 4.6, up for `up` of every 10 s.
fn row_of_three(up: f64, end: f64) -> (Vec<Graph>, Seen) {
    let arcs = [(0, 1), (1, 0), (1, 2), (2, 1)];
    let signal = Switching::periodic(4, s(10.0), s(10.0 - up), s(up));
    let measured = Connectivity::planned(signal, 3, &arcs, Time::from_secs(end));
    (vec![Graph::empty(3), Graph::from_arcs(3, &arcs)], Seen::of(&measured).expect("time has passed"))
}

#[test]
fn section_4_6_without_delay_is_covered() {
    let (graphs, seen) = row_of_three(2.5, 100.0);
    assert!((seen.alpha - 0.75).abs() < 1e-12 && seen.t_0 == Some(s(7.5)) && seen.dwell == s(2.5));
    let watch = watch(&agreement(0.1), &graphs, seen, Vec::new());
    assert_eq!(watch.covered_by, Some("Theorem 4.4"));
    let envelope = watch.envelope.expect("a rate");
    assert!((envelope.rate - 0.025).abs() < 1e-12 && envelope.factor > 1.0);
    let a_little = Tolerance { added: 1e-9, ..Tolerance::default() };
    // What the law does: the slowest mode decays at k λ_2 = 0.1 while the links are up.
    let errors: Vec<(f64, f64)> = (0..=1000)
        .map(|i| f64::from(i) * 0.1)
        .map(|t| (t, (-0.1 * ((t / 10.0).floor() * 2.5 + (t % 10.0 - 7.5).max(0.0))).exp()))
        .collect();
    let judged = watch.judge(&errors, a_little);
    assert!(matches!(judged, Judgement::Covered { statement: "Theorem 4.4", closest: Some(part) } if part > 0.9));
    // A fleet that does not decay is a defect, and so is one that is not a number.
    let idle: Vec<(f64, f64)> = errors.iter().map(|&(t, _)| (t, 1.0)).collect();
    assert!(matches!(watch.judge(&idle, a_little), Judgement::Defect { at, .. } if at > 7.0 && at < 9.0));
    assert!(matches!(watch.judge(&[(0.0, 1.0), (1.0, f64::NAN)], a_little), Judgement::Defect { .. }));
    assert!(watch.judge(&idle, a_little).to_string().starts_with("a defect: covered by Theorem 4.4"));
}

#[test]
fn a_fleet_that_is_never_connected_is_not_covered() {
    let (graphs, seen) = row_of_three(0.0, 100.0);
    assert_eq!((seen.alpha, seen.t_0, seen.mean), (1.0, None, None));
    for watched in [agreement(0.1), Watched::Dynamic(1.0, 1.6), Watched::Delayed] {
        let watch = watch(&watched, &graphs[..1], seen, Vec::new());
        assert_eq!((watch.covered_by, watch.envelope), (None, None));
        let judged = watch.judge(&[(0.0, 1.0)], Tolerance::default());
        assert!(matches!(&judged, Judgement::NotCovered { failing, .. } if !failing.is_empty()), "{judged}");
        assert!(judged.to_string().starts_with("not covered: "));
    }
}

#[test]
fn links_by_turns_are_covered_by_theorem_4_5_alone() {
    let arcs = [(0, 1), (1, 0), (1, 2), (2, 1)];
    let signal = Switching::one_at_a_time(4, vec![vec![0, 1], vec![2, 3]], s(5.0));
    let measured = Connectivity::planned(signal, 3, &arcs, Time::from_secs(100.0));
    let graphs = [Graph::from_edges(3, &[(0, 1)]), Graph::from_edges(3, &[(1, 2)])];
    let seen = Seen::of(&measured).expect("time has passed");
    let watch = watch(&agreement(0.5), &graphs, seen, Vec::new());
    assert_eq!(watch.covered_by, Some("Theorem 4.5"));
    assert!(watch.envelope.is_some_and(|envelope| envelope.rate > 0.0 && envelope.statement == "Theorem 4.5"));
    assert!(watch.failing().is_empty(), "it is covered");
    let failing: Vec<_> = watch.margins.iter().filter(|margin| !margin.holds()).collect();
    assert!(failing.len() == 1 && failing[0].statement == "Theorem 4.4" && failing[0].left() == 0.0);
}

#[test]
fn lemma_4_7_has_a_margin_in_alpha() {
    let (graphs, seen) = row_of_three(2.5, 100.0);
    let covered = watch(&Watched::Dynamic(1.0, 1.6), &graphs, seen, Vec::new());
    assert_eq!(covered.covered_by, Some("Lemma 4.7"));
    assert!(covered.margins[0].left() > 0.0 && covered.envelope.is_some());
    let best = Dynamic::new(1.0, 1.6, &graphs).and_then(|fleet| fleet.best(0.75)).expect("connected at times");
    let envelope =
        Envelope { statement: "Lemma 4.7", factor: best.overshoot(0.75, s(7.5)), rate: 0.5 * best.rate_of_v(0.75) };
    assert_eq!(covered.envelope, Some(envelope), "norms decay at half the rate of V");
    // With the X that is found it bears this loss rate too, where that of (4.66) does not.
    let (graphs, rarely) = row_of_three(0.02, 1000.0);
    let watch = watch(&Watched::Dynamic(1.0, 0.05), &graphs, rarely, Vec::new());
    assert!(watch.margins[0].holds() && watch.margins[0].limit <= 1.0, "{watch:?}");
    assert!(Dynamic::new(1.0, 0.05, &graphs).is_some_and(|fleet| !fleet.printed_holds()));
}

#[test]
fn before_anything_was_seen_nothing_is_said() {
    assert_eq!(Seen::of(&Connectivity::new()), None);
    let (graphs, seen) = row_of_three(2.5, 100.0);
    let delayed = watch(&Watched::Delayed, &graphs, seen, Vec::new());
    let judged = delayed.judge(&[(0.0, 1.0), (9.0, 5.0)], Tolerance::default());
    assert!(judged.to_string().contains("without an envelope"), "{judged}");
    assert!(matches!(
        watch(&agreement(0.1), &graphs, seen, Vec::new()).judge(&[], Tolerance::default()),
        Judgement::Covered { closest: None, .. }
    ));
}

/// Every 0.1 s through windows of 2.5 s, unheard for as long.
const EVERY_TENTH: Exchange =
    Exchange { age: Span::from_nanos(200_000_000), shortest_up: Span::from_nanos(2_500_000_000), unheard: 0.04 };

#[test]
fn messages_that_miss_the_windows_cover_nothing() {
    let (graphs, seen) = row_of_three(2.5, 100.0);
    let judged = |exchange: Exchange| {
        let seen = Seen { exchange: Some(exchange), ..seen };
        watch(&agreement(0.1), &graphs, seen, Vec::new()).judge(&[(0.0, 1.0), (90.0, 1.0)], Tolerance::default())
    };
    assert!(matches!(judged(EVERY_TENTH), Judgement::Defect { .. }), "this fleet is idle");
    // A message every 5 s, of which none falls into a window; and windows that are only half heard.
    let rare = judged(Exchange { age: s(10.0), unheard: 1.0, ..EVERY_TENTH });
    let late = judged(Exchange { unheard: 0.5, ..EVERY_TENTH });
    for (judged, word) in [(rare, "age of news [s] must be below 0.6250"), (late, "it is 0.5000 (0.2500 too much)")] {
        assert!(matches!(judged, Judgement::NotCovered { .. }), "{judged}");
        assert!(judged.to_string().contains(word), "{judged}");
    }
    // Windows in which news are a little too old, where all else would do.
    let stale = Seen { exchange: Some(Exchange { age: s(0.63), ..EVERY_TENTH }), ..seen };
    let stale = watch(&agreement(0.1), &graphs, stale, Vec::new());
    assert_eq!((stale.covered_by, stale.too_rare().len()), (None, 1), "{:?}", stale.margins);
    assert!(stale.too_rare()[0].contains("age of news [s]"));
    // What messages have nothing to do with is none of these conditions; nor is what holds.
    let strong = Watched::Agreement(vec![0.1; 3], PathFollowing::TypeI { lambda_1: 1.0, rho_1: 5.0, alpha_1: 0.5 });
    let strong = watch(&strong, &graphs, Seen { exchange: Some(EVERY_TENTH), ..seen }, Vec::new());
    assert!(strong.too_rare().is_empty() && !strong.failing().is_empty());
    // A law without gains is not asked how far it moves.
    let delayed = watch(&Watched::Delayed, &graphs, Seen { exchange: Some(EVERY_TENTH), ..seen }, Vec::new());
    assert!(delayed.margins.iter().all(|margin| !margin.quantity.contains("eigenvalue")), "{:?}", delayed.margins);
    // Gains that move a fleet far between two messages.
    let seen = Seen { exchange: Some(EVERY_TENTH), ..seen };
    assert!(watch(&agreement(1.6), &graphs, seen, Vec::new()).covered_by.is_some());
    assert_eq!(watch(&agreement(1.7), &graphs, seen, Vec::new()).covered_by, None);
}

#[test]
fn what_messages_in_periods_cost_is_allowed_and_no_more() {
    let (graphs, seen) = row_of_three(2.5, 100.0);
    let (seen, watched) = (Seen { exchange: Some(EVERY_TENTH), ..seen }, agreement(0.1));
    let watch = watch(&watched, &graphs, seen, Vec::new());
    let tolerance = watch.tolerance(&watched, &graphs, 0.5);
    // σ = 0.3, h = 0.2: 6 % and the 4 % unheard; behind by 0.1 each, two neighbours at most, λ₂ = 1.
    assert!((tolerance.slower - (1.0 - 0.94 * 0.96)).abs() < 1e-12);
    assert!((tolerance.added - 0.2 * 3f64.sqrt()).abs() < 1e-12);
    assert_eq!(watch.tolerance(&watched, &graphs, 0.0).added, 0.0);
    let envelope = watch.envelope.expect("a rate");
    let at = |part: f64| [(0.0, 1.0), (50.0, part * tolerance.allowed(&envelope, 1.0, 50.0))];
    assert!(matches!(watch.judge(&at(0.999), tolerance), Judgement::Covered { .. }));
    assert!(matches!(watch.judge(&at(1.001), tolerance), Judgement::Defect { .. }));
}

#[test]
fn one_way_links_and_broken_premises_cover_nothing() {
    let (_, seen) = row_of_three(2.5, 100.0);
    let cycle = [Graph::from_arcs(3, &[(0, 1), (1, 2), (2, 0)])];
    let at_times = [Graph::complete(3), cycle[0].clone()];
    assert_eq!(watch(&agreement(0.1), &at_times, seen, Vec::new()).covered_by, None);
    for watched in [agreement(0.1), Watched::Dynamic(1.0, 1.6), Watched::Delayed] {
        let judged = watch(&watched, &cycle, seen, Vec::new()).judge(&[], Tolerance::default());
        assert!(judged.to_string().starts_with("not covered: it takes two-way links"), "{judged}");
    }
    let premise = Premise { asks: "every vehicle all the time", found: "auv3 is silent from 57 s on".into() };
    let graphs = [Graph::complete(3)];
    let judged = watch(&agreement(0.1), &graphs, seen, vec![premise]).judge(&[], Tolerance::default());
    assert!(judged.to_string().ends_with("and auv3 is silent from 57 s on"), "{judged}");
}

#[test]
fn type_i_has_margins_of_its_own() {
    let (_, seen) = row_of_three(10.0, 100.0);
    let graphs = [Graph::complete(3)];
    // Remark 4.2 with K = I: ρ_1 < 1/18 for λ_1 = 1, α_1 = ½, the least λ_m being that of all graphs.
    let watched = |rho_1| Watched::Agreement(vec![1.0; 3], PathFollowing::TypeI { lambda_1: 1.0, rho_1, alpha_1: 0.5 });
    let weak = watch(&watched(0.01), &graphs, seen, Vec::new());
    assert_eq!((weak.covered_by, weak.envelope), (Some("Theorem 4.4 (type I)"), None));
    let strong = watch(&watched(5.0), &graphs, seen, Vec::new());
    let statements: Vec<_> = strong.failing().into_iter().map(|margin| margin.statement).collect();
    assert_eq!(statements, ["Theorem 4.4 (type I)", "Theorem 4.4 (type I)", "Theorem 4.5 (type I)"]);
    assert_eq!(strong.covered_by, None);
}

#[test]
fn the_margins_of_type_i_are_those_of_the_theorem() {
    let (graphs, seen) = row_of_three(2.5, 100.0);
    let following = PathFollowing::TypeI { lambda_1: 2.0, rho_1: 1e-9, alpha_1: 0.25 };
    let watched = Watched::Agreement(vec![0.5; 3], following);
    let weak = watch(&watched, &graphs, seen, Vec::new());
    // ρ_1/(α_1λ_1) is weak enough, but three quarters of the time are more than the half that type I can bear.
    assert!((weak.margins[0].value - 2e-9).abs() < 1e-18 && weak.margins[0].holds());
    assert!(!weak.margins[1].holds() && weak.margins[1].limit <= 0.5, "{:?}", weak.margins);
    assert_ne!(weak.covered_by, Some("Theorem 4.4 (type I)"));
    let limit =
        |quantity: &str| weak.margins.iter().find(|margin| margin.quantity == quantity).map(|margin| margin.limit);
    assert_eq!((limit("loop gain"), limit("T [s]")), (Some(1.0), Some(100.0)));
    let type_ii = watch(&agreement(0.5), &graphs, seen, Vec::new());
    assert_eq!((type_ii.margins[0].value, type_ii.margins[0].limit), (0.75, 1.0));
}

/// What an envelope allows, with something to spare, from this error at this time on.
fn decaying(envelope: &Envelope, from: f64, to: f64, first: f64) -> Vec<(f64, f64)> {
    let at = |i: u32| from + (to - from) * f64::from(i) / 50.0;
    (0..=50).map(|i| (at(i), 0.9 * first * (-envelope.rate * (at(i) - from)).exp())).collect()
}

#[test]
fn each_stretch_between_changes_of_v_l_is_judged_by_its_own_beginning() {
    let (graphs, seen) = row_of_three(2.5, 600.0);
    let watched = agreement(0.1);
    let watch = watch(&watched, &graphs, seen, Vec::new());
    let envelope = watch.envelope.expect("a rate");
    let tolerance = Tolerance { late: 0.4, slower: 0.0, added: 1e-9 };
    // A long decay, a step that leaves far more than is left of the start, and a decay from there.
    let before = decaying(&envelope, 0.0, 300.0, 1.0);
    let after = decaying(&envelope, 300.5, 600.0, 0.5);
    let flight = |parts: [&[(f64, f64)]; 2]| parts.concat();
    let judged = |errors: &[(f64, f64)], changes: &[f64]| watch.judge_between(&watched, errors, changes, tolerance);
    let sound = flight([&before, &after]);
    assert!(matches!(judged(&sound, &[]).0, Judgement::Defect { at: 300.5, .. }), "v_L was constant");
    let (covered, left) = judged(&sound, &[300.0]);
    assert!(matches!(covered, Judgement::Covered { closest: Some(part), .. } if part < 1.0), "{covered}");
    assert!(left.is_empty());
    // Idle after the step, or before it, however well the other stretch goes.
    let idle = |errors: &[(f64, f64)]| errors.iter().map(|(t, _)| (*t, errors[0].1)).collect::<Vec<_>>();
    let (idle_after, idle_before) = (flight([&before, &idle(&after)]), flight([&idle(&before), &after]));
    assert!(matches!(judged(&idle_after, &[300.0]).0, Judgement::Defect { at, .. } if at > 300.5), "after");
    assert!(matches!(judged(&idle_before, &[300.0]).0, Judgement::Defect { at, .. } if at < 300.0), "before");
    // A change shortly before the end leaves a stretch that cannot be judged, and hides nothing that was before it.
    let (covered, left) = judged(&before, &[299.9]);
    assert!(matches!(covered, Judgement::Covered { .. }) && left[0].since == Some(299.9), "{covered}");
    assert!(matches!(judged(&idle(&before), &[299.9]).0, Judgement::Defect { .. }));
    // What the law with a state of its own begins with later is not known.
    let dynamic = Watched::Dynamic(1.0, 1.6);
    let watch = super::watch(&dynamic, &graphs, seen, Vec::new());
    let (_, left) = watch.judge_between(&dynamic, &sound, &[300.0], tolerance);
    assert_eq!(left.len(), 1);
    // Where there is no envelope, there are no stretches; where nothing covers, nothing is judged.
    let delayed = super::watch(&Watched::Delayed, &graphs, seen, Vec::new());
    let judged = delayed.judge_between(&Watched::Delayed, &sound, &[300.0], tolerance);
    assert!(matches!(judged, (Judgement::Covered { closest: None, .. }, left) if left.is_empty()));
}

#[test]
fn judgements_of_stretches_are_put_together() {
    let covered = |closest| Judgement::Covered { statement: "a statement", closest };
    let envelope = Envelope { statement: "a statement", factor: 1.0, rate: 1.0 };
    let defect = |at| Judgement::Defect { envelope, at, found: 2.0, allowed: 1.0 };
    for (one, other, both) in [
        (covered(Some(0.5)), covered(Some(0.2)), covered(Some(0.5))),
        (covered(Some(0.2)), covered(Some(0.5)), covered(Some(0.5))),
        (covered(Some(0.2)), covered(None), covered(Some(0.2))),
        (covered(None), covered(Some(0.2)), covered(Some(0.2))),
        (covered(Some(0.2)), defect(5.0), defect(5.0)),
        (defect(5.0), covered(Some(0.2)), defect(5.0)),
        (defect(5.0), defect(9.0), defect(5.0)),
    ] {
        assert_eq!(one.with(other), both);
    }
}

#[test]
fn envelope_and_allowance_by_hand() {
    let envelope = Envelope { statement: "a statement", factor: 3.0, rate: 0.4 };
    assert!((envelope.at(5.0) - 3.0 * (-2.0f64).exp()).abs() < 1e-12 && envelope.at(0.0) == 3.0);
    // Nothing decays for two seconds, then at three quarters of the rate, and 0.1 stays.
    let tolerance = Tolerance { late: 2.0, slower: 0.25, added: 0.1 };
    let close = |t: f64, by_hand: f64| (tolerance.allowed(&envelope, 5.0, t) - by_hand).abs() < 1e-7;
    assert!(close(0.0, 15.1) && close(2.0, 15.1) && close(7.0, 15.0 * (-1.5f64).exp() + 0.1));
    // Rounding is allowed for, in proportion.
    assert!(Tolerance::default().allowed(&envelope, 5.0, 0.0) > 15.0);
}

#[test]
fn the_mean_of_an_envelope_is_that_of_its_values() {
    let envelope = Envelope { statement: "", factor: 2.0, rate: 0.1 };
    let values = (0..10_000).map(|i| envelope.at(30.0 * (f64::from(i) + 0.5) / 1e4));
    let mean = values.sum::<f64>() / 1e4;
    assert!((envelope.mean(30.0) - mean).abs() < 1e-6);
    assert_eq!(Envelope { rate: 0.0, ..envelope }.mean(30.0), 2.0);
}

#[test]
fn how_fast_news_pass_by_hand() {
    // Twice the most neighbours, but no more than n; the star has 2, the complete graph of 5 has 4.
    let star = [Graph::from_edges(5, &[(0, 1), (0, 2)])];
    let all = [star[0].clone(), Graph::complete(5)];
    let agreement = Watched::Agreement(vec![0.1, 0.3, 0.2, 0.1, 0.1], PathFollowing::TypeII { lambda_1: 1.0 });
    assert!((agreement.speed(&star) - 0.3 * 4.0).abs() < 1e-12 && (agreement.speed(&all) - 0.3 * 5.0).abs() < 1e-12);
    let dynamic = Watched::Dynamic(2.0, 3.0);
    assert!((dynamic.speed(&star) - 4.0 * (0.5 + 0.2)).abs() < 1e-12);
    assert_eq!(Watched::Delayed.speed(&all), 0.0);
}

#[test]
fn the_tolerance_by_hand() {
    let (_, seen) = row_of_three(2.5, 100.0);
    let seen = Seen { exchange: Some(EVERY_TENTH), ..seen };
    let of = |graphs: &[Graph], seen: Seen, drift: f64| {
        watch(&agreement(0.1), graphs, seen, Vec::new()).tolerance(&agreement(0.1), graphs, drift)
    };
    // Behind by 0.1 each; two neighbours and λ_2 = 3 in a triangle, whichever way the fleet goes.
    let triangle = [Graph::complete(3)];
    for drift in [0.5, -0.5] {
        assert!((of(&triangle, seen, drift).added - 0.1 * 3f64.sqrt() * 2.0 / 3.0).abs() < 1e-12);
    }
    // Of several connected ones the least counts: a row has λ_2 = 1.
    let mixed = [Graph::complete(3), Graph::from_edges(3, &[(0, 1), (1, 2)])];
    assert!((of(&mixed, seen, 0.5).added - 0.1 * 3f64.sqrt() * 2.0).abs() < 1e-12);
    // Never connected at once: that of the union, a row, with one neighbour at a time; and of what never connects nothing.
    let by_turns = [Graph::from_edges(3, &[(0, 1)]), Graph::from_edges(3, &[(1, 2)])];
    assert!((of(&by_turns, seen, 0.5).added - 0.1 * 3f64.sqrt()).abs() < 1e-12);
    assert_eq!(of(&by_turns[..1], seen, 0.5).added, 0.0);
    // News so old that nothing is left of the rate.
    let old = Seen { exchange: Some(Exchange { age: s(10.0), ..EVERY_TENTH }), ..seen };
    assert_eq!(of(&triangle, old, 0.5).slower, 1.0);
}

#[test]
fn errors_are_judged_from_their_own_beginning() {
    let (graphs, seen) = row_of_three(2.5, 100.0);
    let watch = watch(&agreement(0.1), &graphs, seen, Vec::new());
    let envelope = watch.envelope.expect("a rate");
    // Half of what is allowed five seconds after the first of them, which was seen at 40 s.
    let half = 0.5 * envelope.at(5.0);
    let judged = watch.judge(&[(40.0, 1.0), (45.0, half)], Tolerance::default());
    assert!(matches!(judged, Judgement::Covered { closest: Some(part), .. } if part < 1.0), "{judged:?}");
    let more = watch.judge(&[(40.0, 1.0), (45.0, 1.001 * envelope.at(5.0))], Tolerance::default());
    assert!(matches!(more, Judgement::Defect { at: 45.0, .. }), "{more:?}");
    let part = |errors: &[(f64, f64)]| match watch.judge(errors, Tolerance::default()) {
        Judgement::Covered { closest, .. } => closest,
        other => panic!("{other:?}"),
    };
    assert!(
        part(&[(0.0, 1.0), (5.0, half)]).is_some_and(|part| (part - (1.0 / envelope.factor).max(0.5)).abs() < 1e-6)
    );
    assert_eq!(part(&[(0.0, 0.0), (5.0, 0.0)]), Some(0.0), "who agrees from the start");
}
