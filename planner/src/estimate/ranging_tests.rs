//! Estimates from ranges, on tracks of which the answer is known by geometry.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use crate::{
    estimate::{
        from_reports::{Before, Estimate, Estimator},
        ranging::Places,
    },
    facts::{angle::ned_from_body, auv::Auv, evidence::Report, previous_plan::Ranging},
    tuned::EstimateNumbers,
};

const SIGMA: f64 = 1.5;
const DEPTH: f64 = 20.0;

fn estimate(reports: &[Report]) -> Estimate {
    estimate_after(reports, None)
}

/// The estimate after a plan that left this memory.
fn estimate_after(reports: &[Report], ranging: Option<&Ranging>) -> Estimate {
    let now = reports.iter().map(|report| report.t_s).fold(f64::NEG_INFINITY, f64::max);
    let tuned = &EstimateNumbers { particles_most: 3000.0, ..EstimateNumbers::DEFAULT };
    let estimator = Estimator { now, current: Vector2::zeros(), tuned, due: &|| false };
    estimator.estimate(&Auv::reported("a", reports.to_vec()), None, Before { ranging, ..Before::default() })
}

/// An AUV that goes east at 0.4 m/s, at time `t`, s.
fn auv(t: f64) -> Vector2<f64> {
    Vector2::new(60.0, 0.4 * t)
}

/// An error of standard deviation `sigma`, m: incommensurable waves.
fn error(k: f64, sigma: f64) -> f64 {
    sigma * ((1.7 * k).sin() + (2.9 * k + 1.0).sin())
}

/// Ranges to the AUV from a craft on a track, each 10 s.
fn ranges(n: u32, craft: impl Fn(f64) -> Vector2<f64>) -> Vec<Report> {
    let ranged = |k: u32| {
        let (t, from) = (10.0 * f64::from(k), craft(10.0 * f64::from(k)));
        let range = (auv(t) - from).norm().hypot(DEPTH) + error(f64::from(k), SIGMA);
        Report { depth_m: Some(DEPTH), ..Report::ranged(t, range, Some(from), SIGMA) }
    };
    (0..n).map(ranged).collect()
}

/// A craft that circles the AUV at 30 m.
fn circling(t: f64) -> Vector2<f64> {
    let angle = TAU * t / 160.0;
    auv(t) + Vector2::new(angle.cos(), angle.sin()) * 30.0
}

/// A craft that goes east beside the AUV, faster.
fn passing(t: f64) -> Vector2<f64> {
    Vector2::new(20.0, t - 150.0)
}

fn off(estimate: &Estimate, t: f64) -> f64 {
    (estimate.state.position() - auv(t)).norm()
}

#[test]
fn ranges_from_a_circle_fix_an_auv_of_which_nothing_was_known() {
    let reports = ranges(30, circling);
    let found = estimate(&reports);
    assert!(off(&found, 290.0) < 4.0, "{}", off(&found, 290.0));
    assert!((found.state.velocity() - Vector2::new(0.0, 0.4)).norm() < 0.1);
    assert_eq!((found.places, found.inflation, found.state.depth_m), (None, 0.0, DEPTH));
}

#[test]
fn one_range_leaves_a_ring_about_the_craft() {
    let found = estimate(&ranges(1, circling));
    let covariance = found.state.covariance().expect("is from reports");
    // A ring of radius R has the variance R²/2 along either axis.
    let expected = 0.5 * (30.0_f64.hypot(DEPTH) + error(0.0, SIGMA)).powi(2) - 0.5 * DEPTH * DEPTH;
    assert!((found.state.position() - circling(0.0)).norm() < 2.0);
    for axis in 0..2 {
        assert!((covariance[(axis, axis)] / expected - 1.0).abs() < 0.1, "{covariance}");
    }
}

#[test]
fn a_craft_on_a_straight_line_cannot_tell_on_which_side_the_auv_is() {
    let found = estimate(&ranges(30, passing));
    let Places { likelier, other, probability } = found.places.expect("are two");
    let mirrored = |position: Vector2<f64>| Vector2::new(40.0 - position.x, position.y);
    let (truth, image) = (auv(290.0), mirrored(auv(290.0)));
    let [near, far] = if likelier.x > 20.0 { [likelier, other] } else { [other, likelier] };
    // The mean of an arc is within it.
    assert!((near - truth).norm() < 20.0 && (far - image).norm() < 20.0, "{near} {far}");
    assert!((0.5..0.8).contains(&probability), "{probability}");
    // A fix of poor accuracy tells the sides apart.
    let mut told = ranges(30, passing);
    told.push(Report::new(290.0, truth + Vector2::new(8.0, -6.0), 10.0));
    let told = estimate(&told);
    assert!(told.places.is_none() && off(&told, 290.0) < 8.0, "{}", off(&told, 290.0));
}

#[test]
fn a_wide_cloud_beside_a_straight_track_is_two_places_at_its_sides() {
    // Far past the AUV the ranges leave more along the track than the image is across it.
    let found = estimate(&ranges(64, passing));
    let Places { likelier, other, probability } = found.places.expect("are two");
    assert!(30.0 < found.state.position_sigma().expect("is from reports"));
    assert!((likelier.x - 20.0) * (other.x - 20.0) < 0.0 && probability < 0.8, "{:?}", found.places);
    let mean = likelier * probability + other * (1.0 - probability);
    assert!((mean - found.state.position()).norm() < 1e-6);
}

#[test]
fn ranges_that_went_a_longer_way_are_refused() {
    let mut reports = ranges(30, circling);
    let direct = estimate(&reports);
    for k in [7, 15, 22, 28] {
        reports[k].range_m = reports[k].range_m.map(|range| range + 25.0);
    }
    let found = estimate(&reports);
    assert_eq!(found.rejected, [7, 15, 22, 28]);
    assert!(off(&found, 290.0) < off(&direct, 290.0) + 2.0);
}

#[test]
fn too_small_claims_are_widened() {
    let mut reports = ranges(40, circling);
    for (report, k) in reports.iter_mut().zip(0..) {
        report.range_m = report.range_m.map(|range| range + error(f64::from(k) + 0.5, 5.0));
        report.sigma_m = 0.3;
    }
    let found = estimate(&reports);
    assert!((1.0..20.0).contains(&found.inflation), "{}", found.inflation);
    let sigma = found.state.position_sigma().expect("is from reports");
    assert!(off(&found, 390.0) < 4.0 * sigma, "{} {sigma}", off(&found, 390.0));
}

#[test]
fn the_order_of_ranges_and_their_repetition_change_nothing() {
    let reports = ranges(20, circling);
    let once = estimate(&reports);
    let reversed: Vec<_> = reports.iter().rev().copied().collect();
    assert_eq!(estimate(&reversed).state, once.state);
    let twice = estimate(&[&reports[..], &reports[..]].concat());
    assert_eq!(twice.state, once.state);
    assert_eq!(twice.rejected, (0..20).collect::<Vec<_>>());
}

#[test]
fn turned_ranges_turn_the_estimate() {
    let reports = ranges(30, circling);
    let turn = ned_from_body(1.0);
    let turned: Vec<_> = reports
        .iter()
        .map(|report| {
            let mut turned = *report;
            turned.move_position(|position| turn * position);
            turned
        })
        .collect();
    let (here, there) = (estimate(&reports), estimate(&turned));
    // But for the sampling, of a tenth of the standard deviation.
    let sigma = here.state.position_sigma().expect("is from reports");
    assert!((turn * here.state.position() - there.state.position()).norm() < 0.3 * sigma);
}

#[test]
fn telemetry_and_an_unknown_depth_are_used() {
    let mut reports = ranges(30, circling);
    for report in &mut reports {
        (report.course_rad, report.speed_mps, report.depth_m) = (Some(TAU / 4.0), Some(0.4), None);
    }
    let found = estimate(&reports);
    assert!(off(&found, 290.0) < 6.0, "{}", off(&found, 290.0));
    assert!((found.state.depth_m - DEPTH).abs() < 8.0, "{}", found.state.depth_m);
}

#[test]
fn later_plans_add_ranges_to_what_is_known_with_the_same_outcome() {
    let reports = ranges(60, circling);
    let (mut memory, mut added) = (None, 0);
    for n in 20..=60 {
        let found = estimate_after(&reports[..n], memory.as_ref());
        let anew = estimate(&reports[..n]);
        let sigma = anew.state.position_sigma().expect("is from reports");
        let apart = (found.state.position() - anew.state.position()).norm();
        assert!(apart < 0.5 * sigma && found.places.is_none(), "{n}: {apart} {sigma}");
        let known = found.state.position_sigma().expect("is from reports");
        assert!((0.7..1.4).contains(&(known / sigma)), "{n}: {known} {sigma}");
        // Without a new report nothing changes.
        let again = estimate_after(&reports[..n], found.ranging.as_ref());
        assert_eq!(again, found);
        added += usize::from(found.ranging.as_ref().is_some_and(|memory| 0.0 < memory.added));
        memory = found.ranging;
    }
    assert!(30 <= added, "{added}");
}

#[test]
fn a_memory_that_does_not_fit_changes_nothing() {
    let reports = ranges(30, circling);
    let anew = estimate(&reports);
    let good = estimate(&reports[..29]).ranging.expect("has ranges");
    let spoilt: [fn(&mut Ranging); 9] = [
        |memory| memory.t_s += 5.0,
        |memory| memory.fingerprint += 1.0,
        |memory| memory.added = -1.0,
        |memory| memory.added = 1e9,
        |memory| memory.inflation_m = -1.0,
        |memory| memory.refused = vec![0.0; 65],
        |memory| memory.gaussians.clear(),
        |memory| memory.gaussians[0][3] = 1e9,
        |memory| memory.gaussians[0][0] = -0.5,
    ];
    for spoil in spoilt {
        let mut memory = good.clone();
        spoil(&mut memory);
        assert_eq!(estimate_after(&reports, Some(&memory)), anew, "{memory:?}");
    }
    // Neither does one of other reports.
    assert_eq!(estimate_after(&ranges(30, |t| circling(t + 3.0)), Some(&good)).places, None);
    // Widths that no filter left are only wide.
    let mut wide = good;
    wide.gaussians.iter_mut().flat_map(|row| &mut row[8..]).for_each(|number| *number = -4.0e6);
    let found = estimate_after(&reports[..29], Some(&wide));
    assert!(found.state.covariance().is_some_and(|known| known.iter().all(|number| number.is_finite())));
}

#[test]
fn a_range_that_went_a_longer_way_is_refused_beside_a_memory() {
    let mut reports = ranges(40, circling);
    reports[35].range_m = reports[35].range_m.map(|range| range + 25.0);
    let mut memory = None;
    for n in 30..=40 {
        let found = estimate_after(&reports[..n], memory.as_ref());
        assert_eq!(found.rejected, if n <= 35 { vec![] } else { vec![35] }, "{n}");
        memory = found.ranging;
    }
}

#[test]
fn mirrored_ranges_mirror_the_estimate_port_and_starboard_alike() {
    for craft in [circling, passing] {
        let reports = ranges(30, craft);
        let mut mirrored = reports.clone();
        for report in &mut mirrored {
            report.move_position(|at| Vector2::new(at.x, -at.y));
        }
        let (here, there) = (estimate(&reports), estimate(&mirrored));
        let mirror = |at: Vector2<f64>| Vector2::new(at.x, -at.y);
        // But for the sampling, as in a turned scene.
        let sigma = here.state.position_sigma().expect("is from reports");
        assert!((mirror(here.state.position()) - there.state.position()).norm() < 0.3 * sigma);
        assert_eq!(here.places.is_some(), there.places.is_some());
        for (one, other) in here.places.into_iter().zip(there.places) {
            assert!((mirror(one.likelier) - other.likelier).norm() < 0.5 * sigma);
            assert!((mirror(one.other) - other.other).norm() < 0.5 * sigma);
            assert!((one.probability - other.probability).abs() < 0.1);
        }
    }
}

#[test]
fn a_shift_of_time_changes_no_bit_of_an_estimate_or_of_what_is_added_to_it() {
    // Times that are exact before and after the shift.
    let shifted = |mut reports: Vec<Report>| {
        for report in &mut reports {
            report.t_s += 4096.0;
        }
        reports
    };
    let (reports, later) = (ranges(30, circling), shifted(ranges(30, circling)));
    let (first, first_later) = (estimate(&reports[..29]), estimate(&later[..29]));
    assert_eq!(first.state, first_later.state);
    let [here, there] = [(&reports, &first), (&later, &first_later)]
        .map(|(reports, first)| estimate_after(reports, first.ranging.as_ref()));
    assert_eq!(here.state, there.state);
    assert_eq!(here.ranging.map(|memory| memory.added), Some(1.0));
}
