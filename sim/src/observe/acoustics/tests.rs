use rand::SeedableRng;

use super::*;
use crate::{
    tests::{binomial, independent_unit_normals, near},
    world::inner_loop::PERIOD,
};

/// Steps of the usual frame of 10 s.
const FRAME_STEPS: u32 = 100;

/// An ordinary modem with position fixes; the slots are evenly spread over the frame.
fn usual(vehicles: u32) -> AcousticsSetup {
    let frame = 10.0;
    AcousticsSetup {
        frame,
        slot_length: 0.5,
        slots: (0..vehicles).map(|i| frame * f64::from(i) / f64::from(vehicles)).collect(),
        sound_speed: 1500.0,
        latency: 2.0,
        position_sigma: 1.5,
        depth_sigma: 0.1,
        course_sigma: 0.05,
        speed_sigma: 0.02,
        range_max: 1000.0,
        loss: 0.05,
        loss_at_range_max: 0.5,
        outlier_share: 0.02,
        outlier_sigma: 20.0,
    }
}

/// [`usual`] without error or loss.
fn clear(vehicles: u32) -> AcousticsSetup {
    AcousticsSetup {
        position_sigma: 0.0,
        depth_sigma: 0.0,
        course_sigma: 0.0,
        speed_sigma: 0.0,
        loss: 0.0,
        loss_at_range_max: 0.0,
        outlier_share: 0.0,
        ..usual(vehicles)
    }
}

/// [`clear`] with another number or two.
fn changed(vehicles: u32, change: impl FnOnce(&mut AcousticsSetup)) -> AcousticsSetup {
    let mut setup = clear(vehicles);
    change(&mut setup);
    setup
}

fn channel(setup: &AcousticsSetup, seed: u64) -> Acoustics {
    Acoustics::new(setup, PERIOD, ChaCha8Rng::seed_from_u64(seed))
}

/// A vehicle `north` m north of the datum at `depth` m.
fn at(north: f64, depth: f64) -> Telemetry {
    Telemetry {
        position: Vector2::new(north, 0.0),
        depth,
        course: Course::new(0.5),
        speed: 0.2,
        turn_rate: 0.01,
        descending: true,
        own: None,
    }
}

/// Everything heard in `steps` steps with the surface craft at the datum. Received once a second,
/// and once more after the last message.
fn listen(setup: &AcousticsSetup, seed: u64, steps: u32, all_telemetry: &[Telemetry]) -> Vec<Fix> {
    let mut channel = channel(setup, seed);
    let silent = vec![false; all_telemetry.len()];
    let mut heard = vec![];
    for step in 0..steps {
        channel.step(step, &Vector2::zeros(), all_telemetry, &silent);
        if step % 10 == 0 {
            channel.receive(f64::from(step) * PERIOD, &mut heard);
        }
    }
    channel.receive(f64::INFINITY, &mut heard);
    heard
}

/// All that is heard at the end.
fn heard_by(channel: &mut Acoustics, now: f64) -> Vec<Fix> {
    let mut heard = vec![];
    channel.receive(now, &mut heard);
    heard
}

#[test]
fn each_vehicle_is_heard_once_a_frame_with_its_state_in_its_slot() {
    let mut channel = channel(&clear(3), 1);
    let mut heard = vec![];
    let depths = [5.0, 6.0, 7.0];
    for step in 0..50 * FRAME_STEPS {
        // The vehicle moves 1 m a step, so its position gives the time of transmission.
        let all_telemetry = depths.map(|depth| at(f64::from(step % 400), depth));
        channel.step(step, &Vector2::zeros(), &all_telemetry, &[false; 3]);
        channel.receive(f64::from(step) * PERIOD, &mut heard);
    }
    channel.receive(f64::INFINITY, &mut heard);
    for (vehicle, slot) in [(0, 0), (1, 33), (2, 67)] {
        let fixes: Vec<&Fix> = heard.iter().filter(|fix| fix.vehicle == vehicle).collect();
        assert_eq!(fixes.len(), 50);
        for (frame, fix) in (0..).zip(&fixes) {
            let step = frame * FRAME_STEPS + slot;
            assert_eq!(fix.sent_at, f64::from(step) * PERIOD);
            assert_eq!(fix.telemetry, at(f64::from(step % 400), depths[vehicle]));
        }
    }
    assert_eq!(heard.len(), 150);
}

#[test]
fn a_fix_arrives_after_travel_time_and_latency() {
    // 3-4-5: 300 m away and 400 m down is 500 m, a third of a second.
    let mut channel = channel(&clear(1), 1);
    channel.step(0, &Vector2::zeros(), &[at(300.0, 400.0)], &[false]);
    assert_eq!(heard_by(&mut channel, 2.333), []);
    let heard = heard_by(&mut channel, 2.334);
    assert_eq!(heard.len(), 1);
    near(heard[0].heard_at, 2.0 + 1.0 / 3.0, 1e-12);
    assert_eq!(heard_by(&mut channel, 100.0), [], "once");
}

#[test]
fn fixes_are_in_the_order_of_arrival() {
    // The first speaks 0.6 s earlier, from 990 m farther (0.66 s). Short messages do not overlap.
    let setup = changed(2, |setup| {
        (setup.slots, setup.slot_length) = (vec![0.0, 0.6], 0.05);
    });
    let heard = listen(&setup, 1, FRAME_STEPS, &[at(995.0, 0.0), at(5.0, 0.0)]);
    assert!(heard.iter().map(|fix| fix.vehicle).eq([1, 0]));
    assert!(heard[0].heard_at < heard[1].heard_at);
}

#[test]
fn the_share_lost_is_as_set_and_linear_in_slant_range() {
    let setup = changed(1, |setup| {
        (setup.loss, setup.loss_at_range_max, setup.range_max) = (0.1, 0.7, 200.0);
    });
    let frames = 10_000_u32;
    for (telemetry, expected) in
        [(at(0.0, 0.0), 0.1), (at(60.0, 80.0), 0.4), (at(0.0, 150.0), 0.55), (at(-200.0, 0.0), 0.7)]
    {
        let heard = listen(&setup, 2, frames * FRAME_STEPS, &[telemetry]);
        binomial(f64::from(frames) - heard.len() as f64, f64::from(frames), expected);
    }
}

#[test]
fn two_messages_at_one_time_destroy_each_other_unless_one_is_out_of_range() {
    let [shared, apart] =
        [[3.0, 3.0], [0.0, 0.6]].map(|slots| changed(2, |setup| setup.slots = slots.to_vec()));
    let (mut lossy, mut short) = (shared.clone(), shared.clone());
    (lossy.range_max, lossy.loss_at_range_max, short.range_max) = (100.0, 1.0, 500.0);
    let here = [at(50.0, 5.0), at(-60.0, 20.0)];
    // How many of twenty messages of each are heard.
    for (setup, all_telemetry, expected) in [
        (shared, here, [0, 0]),
        (clear(2), here, [20, 20]),
        // Slots 0.6 s apart, messages of 0.5 s: no overlap if the first is at most 0.1 s, or 150 m,
        // farther away than the second.
        (apart.clone(), [at(150.0, 0.0), at(10.0, 0.0)], [20, 20]),
        (apart, [at(170.0, 0.0), at(10.0, 0.0)], [0, 0]),
        // The farther one is always lost by chance, the nearer never: a lost one is as loud.
        (lossy, [at(100.0, 0.0), at(0.0, 0.0)], [0, 0]),
        // 300 and 400.1 m make 500.08 m; 300 and 400 make 500.
        (short, [at(300.0, 400.1), at(300.0, 400.0)], [0, 20]),
    ] {
        let heard = listen(&setup, 1, 20 * FRAME_STEPS, &all_telemetry);
        let found = [0, 1].map(|vehicle| heard.iter().filter(|fix| fix.vehicle == vehicle).count());
        assert_eq!(found, expected, "{all_telemetry:?}");
    }
}

#[test]
fn a_silent_vehicle_collides_with_no_message_and_is_not_heard() {
    let shared = changed(2, |setup| setup.slots = vec![3.0, 3.0]);
    let mut channel = channel(&shared, 1);
    let all_telemetry = [at(5.0, 5.0), at(6.0, 6.0)];
    for step in 0..20 * FRAME_STEPS {
        channel.step(step, &Vector2::zeros(), &all_telemetry, &[true, false]);
    }
    let heard = heard_by(&mut channel, f64::INFINITY);
    assert!(heard.iter().all(|fix| fix.vehicle == 1));
    assert_eq!(heard.len(), 20);
}

#[test]
fn errors_have_their_sigma_no_mean_and_no_correlation() {
    let setup = changed(1, |setup| {
        (setup.position_sigma, setup.depth_sigma) = (1.5, 0.2);
        (setup.course_sigma, setup.speed_sigma) = (0.05, 0.01);
    });
    let truth = at(40.0, 10.0);
    let heard = listen(&setup, 3, 10_000 * FRAME_STEPS, &[truth]);
    assert!(heard.iter().all(|fix| fix.sigma == 1.5) && heard.len() == 10_000);
    independent_unit_normals(heard.iter().map(|Fix { telemetry, .. }| {
        let off = (telemetry.position - truth.position) / 1.5;
        [
            off.x,
            off.y,
            (telemetry.depth - truth.depth) / 0.2,
            (telemetry.course.radians() - truth.course.radians()) / 0.05,
            (telemetry.speed - truth.speed) / 0.01,
        ]
    }));
}

#[test]
fn the_share_of_outliers_is_as_set_and_their_fixes_look_ordinary() {
    let setup = changed(1, |setup| {
        (setup.position_sigma, setup.outlier_share, setup.outlier_sigma) = (0.5, 0.02, 500.0);
        // Losses apply to outliers and other fixes alike.
        (setup.loss, setup.loss_at_range_max) = (0.3, 0.3);
    });
    let truth = at(40.0, 10.0);
    let heard = listen(&setup, 4, 20_000 * FRAME_STEPS, &[truth]);
    // Rayleigh: no ordinary fix is farther than 8.6 √2 σ = 6.1 m; an outlier is nearer than that
    // with probability 1 − exp(−(6.1/500)²/2) < 0.0001.
    let (mut outliers, mut squares) = (0.0, 0.0);
    for fix in &heard {
        assert_eq!((fix.sigma, fix.telemetry.depth), (0.5, truth.depth));
        let off = (fix.telemetry.position - truth.position).norm();
        if 6.1 < off {
            outliers += 1.0;
            squares += (off / 500.0).powi(2);
        }
    }
    binomial(outliers, heard.len() as f64, 0.02);
    // Each is χ² with two degrees of freedom.
    near(squares, 2.0 * outliers, 4.0 * f64::sqrt(4.0 * outliers));
}

#[test]
fn noise_does_not_depend_on_the_surface_craft_or_on_silent_vehicles() {
    let setup = AcousticsSetup { loss: 0.3, loss_at_range_max: 0.3, ..usual(2) };
    let all_telemetry = [at(50.0, 5.0), at(80.0, 10.0)];
    let run = |asc: Vector2<f64>, quiet: std::ops::Range<u32>| {
        let mut channel = channel(&setup, 5);
        let mut heard = vec![];
        for step in 0..300 * FRAME_STEPS {
            let is_quiet = quiet.contains(&step);
            // Also out of range for a while.
            let away = if is_quiet { 5000.0 } else { 0.0 };
            let asc = asc + Vector2::new(away, 0.0);
            channel.step(step, &asc, &all_telemetry, &[is_quiet, false]);
            channel.receive(f64::from(step) * PERIOD, &mut heard);
        }
        channel.receive(f64::INFINITY, &mut heard);
        for fix in &mut heard {
            // These depend on where the craft is; the noise of a range is what is left.
            let way = (all_telemetry[fix.vehicle].position - fix.from).norm();
            fix.range = 1e-6 * (1e6 * (fix.range - way.hypot(all_telemetry[fix.vehicle].depth))).round();
            (fix.heard_at, fix.from) = (0.0, Vector2::zeros());
        }
        heard
    };
    let mut here = run(Vector2::zeros(), 0..0);
    assert_eq!(here, run(Vector2::new(-300.0, 200.0), 0..0));
    let mut interrupted = run(Vector2::zeros(), 5_000..20_000);
    for fixes in [&mut here, &mut interrupted] {
        fixes.retain(|fix| fix.sent_at >= 2000.0 - 0.5 * PERIOD);
    }
    assert!(interrupted.len() > 100);
    assert_eq!(interrupted, here);
}

#[test]
fn slots_do_not_drift_over_a_day_or_suffer_from_rounding() {
    // A day of 0.1 s steps, and 0.7 / 0.1 = 6.999…
    let setup = changed(1, |setup| setup.slots = vec![0.7]);
    let steps = 864_000;
    let heard = listen(&setup, 1, steps, &[at(1.0, 0.0)]);
    assert_eq!(heard.len() as u64, u64::from(steps / FRAME_STEPS));
    for (frame, fix) in (0..).zip(&heard) {
        assert_eq!(fix.sent_at, f64::from(frame * FRAME_STEPS + 7) * PERIOD);
    }
}

#[test]
fn uncollected_fixes_are_discarded_oldest_first() {
    let mut channel = channel(&clear(1), 1);
    for step in 0..100 * FRAME_STEPS {
        channel.step(step, &Vector2::zeros(), &[at(5.0, 5.0)], &[false]);
    }
    let heard = heard_by(&mut channel, f64::INFINITY);
    assert_eq!((heard.len(), heard[0].sent_at), (QUEUE_PER_VEHICLE, 360.0));
}

#[test]
fn a_telemetered_speed_is_never_negative() {
    let setup = changed(1, |setup| setup.speed_sigma = 0.5);
    let heard = listen(&setup, 8, 100 * FRAME_STEPS, &[at(5.0, 5.0)]);
    assert!(heard.iter().all(|fix| fix.telemetry.speed >= 0.0));
    assert!(heard.iter().any(|fix| fix.telemetry.speed == 0.0));
}

#[test]
fn a_range_has_its_noise_and_an_outlier_is_longer_than_the_way() {
    let clear = listen(&clear(1), 1, 2000, &[at(30.0, 40.0)]);
    assert!(!clear.is_empty() && clear.iter().all(|fix| fix.range == 50.0 && fix.from == Vector2::zeros()));
    let noisy = changed(1, |setup| setup.position_sigma = 1.5);
    let heard = listen(&noisy, 2, 100 * FRAME_STEPS, &[at(30.0, 40.0)]);
    let n = heard.len() as f64;
    let square: f64 = heard.iter().map(|fix| (fix.range - 50.0).powi(2)).sum();
    // 100 squares of a normal number: the standard deviation of their root mean square is 7 %.
    near((square / n).sqrt(), 1.5, 4.0 * 0.07 * 1.5);
    let detours = changed(1, |setup| (setup.outlier_share, setup.outlier_sigma) = (0.5, 20.0));
    let heard = listen(&detours, 3, 100 * FRAME_STEPS, &[at(30.0, 40.0)]);
    let long = heard.iter().filter(|fix| 50.0 < fix.range).count();
    assert!(heard.iter().all(|fix| 50.0 <= fix.range) && (25..=75).contains(&long), "{long}");
}
