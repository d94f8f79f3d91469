//! Costs against numerical integration, in parts, over long times and from large values.

use nalgebra::Matrix2;

use super::*;
use crate::facts::angle::direction;
use crate::tests::near;

const ALL: [VisitCost; 4] = [
    Age,
    Uncertainty { fixes: Fixes::Usbl, growth_m2ps: 0.05, sigma_m: 1.5, sigma_rad: 0.02, interval_s: 10.0 },
    Data { growth_kbps: 0.4, upload_kbps: 3.0, range_max_m: 250.0 },
    Uncertainty { fixes: Fixes::Range, growth_m2ps: 0.05, sigma_m: 1.5, sigma_rad: 0.02, interval_s: 10.0 },
];

/// Right above an AUV at this depth, or 30 m beside it for ranges.
fn at(law: &VisitCost, depth: f64) -> ServicePlace {
    ServicePlace { distance: if law.takes_ranges() { 30.0 } else { 0.0 }, depth }
}

/// The differential equation of each closed form.
fn rate(law: &VisitCost, cost: f64, range: f64) -> f64 {
    match *law {
        Age => 0.0,
        Uncertainty { fixes, growth_m2ps, sigma_m, sigma_rad, interval_s } => {
            let noise = match fixes {
                Fixes::Usbl => (sigma_m.powi(2) + (sigma_rad * range).powi(2)) * interval_s,
                // From 30 m beside it.
                Fixes::Range => 2.0 * sigma_m.powi(2) * interval_s * (1.0 + (range / 30.0).powi(2)),
            };
            growth_m2ps - cost * cost / noise
        }
        Data { growth_kbps, upload_kbps, range_max_m } => {
            let rate = growth_kbps - upload_kbps * (1.0 - range / range_max_m).max(0.0);
            if cost <= 0.0 { rate.max(0.0) } else { rate }
        }
    }
}

/// The cost and its integral by the midpoint rule in 400,000 steps.
fn integrated(law: &VisitCost, from: f64, elapsed: f64, range: f64) -> Later {
    let n = 400_000;
    let dt = elapsed / f64::from(n);
    let (mut cost, mut integral) = (from, 0.0);
    for _ in 0..n {
        let half = (cost + 0.5 * dt * rate(law, cost, range)).max(0.0);
        integral += half * dt;
        cost = (cost + dt * rate(law, half, range)).max(0.0);
    }
    Later { cost, integral }
}

#[test]
fn served_costs_agree_with_numerical_integration() {
    for law in &ALL[1..] {
        for (from, elapsed, range) in [
            (0.0, 300.0, 40.0),
            (90.0, 35.0, 0.0),
            (400.0, 500.0, 120.0),
            (3.0, 2000.0, 249.0),
            (30.0, 60.0, 1000.0),
        ] {
            let exact = law.served(from, elapsed, at(law, range));
            let expected = integrated(law, from, elapsed, range);
            // The midpoint rule errs when a backlog empties, by a step of 5 ms at the fastest rate.
            near(exact.cost, expected.cost, 0.03);
            near(exact.integral, expected.integral, 1e-5 * (1.0 + expected.integral) + 0.05);
        }
    }
}

#[test]
fn unserved_costs_grow_linearly_and_their_integral_is_a_trapezium() {
    for (law, growth) in ALL.iter().zip([1.0, 0.05, 0.4, 0.05]) {
        let later = law.unserved(7.0, 90.0);
        near(later.cost, 7.0 + growth * 90.0, 1e-12);
        near(later.integral, 0.5 * (7.0 + later.cost) * 90.0, 1e-9);
    }
}

#[test]
fn two_intervals_equal_their_union_with_and_without_service() {
    for law in &ALL {
        let served = |cost, elapsed| law.served(cost, elapsed, at(law, 60.0));
        let unserved = |cost, elapsed| law.unserved(cost, elapsed);
        for (first, second) in [(0.0, 50.0), (12.0, 200.0), (700.0, 0.5)] {
            for step in [&served as &dyn Fn(f64, f64) -> Later, &unserved] {
                let half = step(25.0, first);
                let (whole, rest) = (step(25.0, first + second), step(half.cost, second));
                near(whole.cost, rest.cost, 1e-9);
                let expected = half.integral + rest.integral;
                near(whole.integral, expected, 1e-9 * (1.0 + whole.integral));
            }
        }
    }
}

#[test]
fn variances_converge_to_the_filter_s_steady_state_from_any_value() {
    let law = &ALL[1];
    // √(q R T) with R = 1.5² + (0.02 · 100)².
    let steady = (0.05_f64 * (2.25 + 4.0) * 10.0).sqrt();
    for from in [0.0, steady, 1e12] {
        let later = law.served(from, 1e9, at(law, 100.0));
        near(later.cost, steady, 1e-9 * steady);
        assert!(later.integral.is_finite());
    }
    near(law.fresh(), (0.05_f64 * 22.5).sqrt(), 1e-12);
}

#[test]
fn nothing_is_uploaded_beyond_the_range() {
    let law = &ALL[2];
    for range in [250.0, 4000.0] {
        assert!(!law.reaches(range));
        assert_eq!(law.served(5.0, 70.0, at(law, range)), law.unserved(5.0, 70.0));
    }
    assert!(law.reaches(249.9));
}

#[test]
fn times_of_service_respect_the_least_time_and_empty_a_backlog() {
    for law in &ALL {
        for (cost, range, least) in [(0.0, 0.0, 30.0), (900.0, 50.0, 30.0), (1e9, 240.0, 600.0)] {
            let dwells = law.dwells(cost, at(law, range), least, &VisitNumbers::DEFAULT);
            assert!((dwells[0] - least).abs() < 1e-12 && dwells.is_sorted());
            assert!(dwells.iter().all(|dwell| *dwell <= VisitNumbers::DEFAULT.dwell_max.max(least)));
        }
    }
    let longest = ALL[2].dwells(100.0, at(&ALL[2], 0.0), 10.0, &VisitNumbers::DEFAULT);
    let longest = longest.last().expect("there is one");
    assert!(ALL[2].served(100.0, *longest, at(&ALL[2], 0.0)).cost < 1e-9);
}

#[test]
fn ranges_on_an_arc_are_worth_what_the_matrix_equation_says_and_nothing_from_above() {
    let (law, place) = (&ALL[3], ServicePlace { distance: 32.0, depth: 20.0 });
    let (variance, interval) = (2.25, 10.0);
    // Ṗ = q I − P h hᵀ P / (σ² T), h turning with the craft at 1.2 m/s on its arc.
    let mut covariance = Matrix2::identity() * 40.0;
    let (step, mut mean) = (0.01, 0.0);
    for k in 0..18_000 {
        let slope = direction(1.2 / place.distance * step * f64::from(k)) * (place.distance / place.range());
        let seen = covariance * slope;
        covariance += (Matrix2::identity() * 0.05 - seen * seen.transpose() / (variance * interval)) * step;
        mean += 0.5 * covariance.trace() / 18_000.0;
    }
    let later = law.served(40.0, 180.0, place);
    // The closed form takes both axes at once: a sixth of the variance at the end, more before.
    near(later.cost, 0.5 * covariance.trace(), 0.2 * later.cost);
    assert!(later.integral / 180.0 < mean && mean < 2.0 * later.integral / 180.0, "{mean}");
    let above = law.served(40.0, 180.0, ServicePlace { distance: 0.0, depth: 20.0 });
    near(above.cost, law.unserved(40.0, 180.0).cost, 0.5 * above.cost);
}
