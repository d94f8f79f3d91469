use rand::SeedableRng;

use super::*;
use crate::world::inner_loop::PERIOD;

/// Steps of the usual frame of 10 s.
const FRAME_STEPS: u32 = 100;

/// An ordinary modem with position fixes; the slots are evenly spread over the frame.
fn usual(vehicles: u32) -> AcousticsSetup {
    let frame = 10.0;
    AcousticsSetup {
        frame,
        slot_length: 0.5,
        slots: (0..vehicles)
            .map(|i| frame * f64::from(i) / f64::from(vehicles))
            .collect(),
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
    }
}

/// Everything heard in `steps` steps with the surface craft at the datum, and the message counts.
/// Received once a second, and once more after the last message.
fn listen(
    setup: &AcousticsSetup,
    seed: u64,
    steps: u32,
    all_telemetry: &[Telemetry],
) -> (Vec<Fix>, MessageCounts) {
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
    (heard, channel.counts())
}

/// Four standard deviations of a count of `n` draws with probability `p`.
fn four_sigma(n: f64, p: f64) -> f64 {
    4.0 * (n * p * (1.0 - p)).sqrt()
}

#[expect(clippy::cast_precision_loss, reason = "counts of a test")]
fn count(n: u64) -> f64 {
    n as f64
}

#[test]
fn each_vehicle_is_heard_once_a_frame_with_its_state_in_its_slot() {
    let mut channel = channel(&clear(3), 1);
    let mut heard = vec![];
    for step in 0..50 * FRAME_STEPS {
        // The vehicle moves 1 m a step, so its position gives the time of transmission.
        let north = f64::from(step % 400);
        let all_telemetry = [at(north, 5.0), at(north, 6.0), at(north, 7.0)];
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
            let truth = at(f64::from(step % 400), [5.0, 6.0, 7.0][vehicle]);
            assert_eq!(fix.telemetry, truth);
        }
    }
    let all = MessageCounts {
        sent: 150,
        delivered: 150,
        ..MessageCounts::default()
    };
    assert_eq!(channel.counts(), all);
}

#[test]
fn a_fix_arrives_after_travel_time_and_latency() {
    // 3-4-5: 300 m away and 400 m down is 500 m, a third of a second.
    let mut channel = channel(&clear(1), 1);
    channel.step(0, &Vector2::zeros(), &[at(300.0, 400.0)], &[false]);
    let mut heard = vec![];
    channel.receive(2.333, &mut heard);
    assert_eq!(heard, []);
    channel.receive(2.334, &mut heard);
    assert_eq!(heard.len(), 1);
    assert!((heard[0].heard_at - (2.0 + 1.0 / 3.0)).abs() < 1e-12);
    channel.receive(100.0, &mut heard);
    assert_eq!(heard.len(), 1, "once");
}

#[test]
fn fixes_are_in_the_order_of_arrival() {
    // The first speaks 0.6 s earlier, from 990 m farther (0.66 s). Short messages do not overlap.
    let setup = AcousticsSetup {
        slots: vec![0.0, 0.6],
        slot_length: 0.05,
        ..clear(2)
    };
    let (heard, counts) = listen(&setup, 1, FRAME_STEPS, &[at(995.0, 0.0), at(5.0, 0.0)]);
    let order: Vec<usize> = heard.iter().map(|fix| fix.vehicle).collect();
    assert_eq!((order, counts.delivered), (vec![1, 0], 2));
    assert!(heard[0].heard_at < heard[1].heard_at);
}

#[test]
fn the_share_lost_is_as_set_and_linear_in_slant_range() {
    let setup = AcousticsSetup {
        loss: 0.1,
        loss_at_range_max: 0.7,
        range_max: 200.0,
        ..clear(1)
    };
    let frames = 10_000;
    for (telemetry, expected) in [
        (at(0.0, 0.0), 0.1),
        (at(60.0, 80.0), 0.4),
        (at(0.0, 150.0), 0.55),
        (at(-200.0, 0.0), 0.7),
    ] {
        let (heard, counts) = listen(&setup, 2, frames * FRAME_STEPS, &[telemetry]);
        let n = f64::from(frames);
        assert_eq!(counts.sent, u64::from(frames));
        assert_eq!(counts.delivered, heard.len() as u64);
        assert_eq!(counts.lost + counts.delivered, counts.sent);
        let bound = four_sigma(n, expected);
        assert!((count(counts.lost) - expected * n).abs() < bound, "{counts:?}");
    }
}

#[test]
fn two_messages_at_one_time_destroy_each_other_unless_one_is_out_of_range() {
    let slots = |slots: [f64; 2]| AcousticsSetup {
        slots: slots.to_vec(),
        ..clear(2)
    };
    let (shared, apart) = (slots([3.0, 3.0]), slots([0.0, 0.6]));
    let frames = 20;
    let none = MessageCounts {
        sent: 40,
        ..MessageCounts::default()
    };
    let delivered = MessageCounts {
        delivered: 40,
        ..none
    };
    let collided = MessageCounts { collided: 40, ..none };
    for (setup, all_telemetry, expected) in [
        (shared.clone(), [at(50.0, 5.0), at(-60.0, 20.0)], collided),
        (clear(2), [at(50.0, 5.0), at(-60.0, 20.0)], delivered),
        // Slots 0.6 s apart, messages of 0.5 s: no overlap if the first is at most 0.1 s, or 150 m,
        // farther away than the second.
        (apart.clone(), [at(150.0, 0.0), at(10.0, 0.0)], delivered),
        (apart, [at(170.0, 0.0), at(10.0, 0.0)], collided),
        // The farther one is always lost by chance, the nearer never: a lost one is as loud.
        (
            AcousticsSetup {
                range_max: 100.0,
                loss_at_range_max: 1.0,
                ..shared.clone()
            },
            [at(100.0, 0.0), at(0.0, 0.0)],
            MessageCounts {
                lost: 20,
                collided: 20,
                ..none
            },
        ),
        // 300 and 400.1 m make 500.08 m; 300 and 400 make 500.
        (
            AcousticsSetup {
                range_max: 500.0,
                ..shared
            },
            [at(300.0, 400.1), at(300.0, 400.0)],
            MessageCounts {
                beyond_range: 20,
                delivered: 20,
                ..none
            },
        ),
    ] {
        let (heard, counts) = listen(&setup, 1, frames * FRAME_STEPS, &all_telemetry);
        assert_eq!(counts, expected, "{all_telemetry:?}");
        assert_eq!(heard.len() as u64, counts.delivered);
    }
}

#[test]
fn a_silent_vehicle_collides_with_no_message_and_is_not_heard() {
    let shared = AcousticsSetup {
        slots: vec![3.0, 3.0],
        ..clear(2)
    };
    let mut channel = channel(&shared, 1);
    let mut heard = vec![];
    for step in 0..20 * FRAME_STEPS {
        channel.step(
            step,
            &Vector2::zeros(),
            &[at(5.0, 5.0), at(6.0, 6.0)],
            &[true, false],
        );
    }
    channel.receive(f64::INFINITY, &mut heard);
    assert_eq!(heard.len(), 20);
    assert!(heard.iter().all(|fix| fix.vehicle == 1));
    assert_eq!(channel.counts().sent, 20);
}

#[test]
fn errors_have_their_sigma_no_mean_and_no_correlation() {
    let setup = AcousticsSetup {
        position_sigma: 1.5,
        depth_sigma: 0.2,
        course_sigma: 0.05,
        speed_sigma: 0.01,
        ..clear(1)
    };
    let truth = at(40.0, 10.0);
    let frames = 10_000;
    let (heard, _) = listen(&setup, 3, frames * FRAME_STEPS, &[truth]);
    let mut sum = nalgebra::SVector::<f64, 5>::zeros();
    let mut products = nalgebra::SMatrix::<f64, 5, 5>::zeros();
    for fix in &heard {
        let off = fix.telemetry.position - truth.position;
        let errors = nalgebra::SVector::from([
            off.x / 1.5,
            off.y / 1.5,
            (fix.telemetry.depth - truth.depth) / 0.2,
            (fix.telemetry.course.radians() - truth.course.radians()) / 0.05,
            (fix.telemetry.speed - truth.speed) / 0.01,
        ]);
        sum += errors;
        products += errors * errors.transpose();
    }
    // Variances: n of a sum of n unit normals and of their products, 2n of their squares.
    let n = f64::from(frames);
    assert!(sum.amax() < 4.0 * n.sqrt(), "{sum}");
    for i in 0..5 {
        assert!(
            (products[(i, i)] - n).abs() < 4.0 * (2.0 * n).sqrt(),
            "{products}"
        );
        for j in 0..i {
            assert!(products[(i, j)].abs() < 4.0 * n.sqrt(), "{products}");
        }
    }
    assert!(heard.iter().all(|fix| fix.sigma == 1.5));
}

#[test]
fn the_share_of_outliers_is_as_set_and_their_fixes_look_ordinary() {
    let setup = AcousticsSetup {
        position_sigma: 0.5,
        outlier_share: 0.02,
        outlier_sigma: 500.0,
        // Losses apply to outliers and other fixes alike.
        loss: 0.3,
        loss_at_range_max: 0.3,
        ..clear(1)
    };
    let truth = at(40.0, 10.0);
    let frames = 20_000;
    let (heard, _) = listen(&setup, 4, frames * FRAME_STEPS, &[truth]);
    // Rayleigh: no ordinary fix is farther than 8.6 √2 σ = 6.1 m; an outlier is nearer than that
    // with probability 1 − exp(−(6.1/500)²/2) < 0.0001.
    let far = heard
        .iter()
        .filter(|fix| (fix.telemetry.position - truth.position).norm() > 6.1);
    let n = count(heard.len() as u64);
    let outliers = count(far.clone().count() as u64);
    assert!((outliers - 0.02 * n).abs() < four_sigma(n, 0.02), "{outliers}");
    let squares: f64 = far
        .map(|fix| {
            assert_eq!((fix.sigma, fix.telemetry.depth), (0.5, truth.depth));
            (fix.telemetry.position - truth.position).norm_squared() / (500.0 * 500.0)
        })
        .sum();
    // Each is χ² with two degrees of freedom.
    assert!((squares - 2.0 * outliers).abs() < 4.0 * (4.0 * outliers).sqrt());
}

#[test]
fn noise_does_not_depend_on_the_surface_craft_or_on_silent_vehicles() {
    let setup = AcousticsSetup {
        loss: 0.3,
        loss_at_range_max: 0.3,
        ..usual(2)
    };
    let all_telemetry = [at(50.0, 5.0), at(80.0, 10.0)];
    let run = |asc: Vector2<f64>, quiet: std::ops::Range<u32>| {
        let mut channel = channel(&setup, 5);
        let mut heard = vec![];
        for step in 0..300 * FRAME_STEPS {
            let silent = [quiet.contains(&step), false];
            // Also out of range for a while.
            let away = if quiet.contains(&step) { 5000.0 } else { 0.0 };
            let asc = asc + Vector2::new(away, 0.0);
            channel.step(step, &asc, &all_telemetry, &silent);
            channel.receive(f64::from(step) * PERIOD, &mut heard);
        }
        channel.receive(f64::INFINITY, &mut heard);
        heard
            .into_iter()
            .map(|fix| Fix { heard_at: 0.0, ..fix })
            .collect::<Vec<_>>()
    };
    let here = run(Vector2::zeros(), 0..0);
    assert_eq!(here, run(Vector2::new(-300.0, 200.0), 0..0));
    let later = |fixes: Vec<Fix>| -> Vec<Fix> {
        fixes
            .into_iter()
            .filter(|fix| fix.sent_at >= 2000.0 - 0.5 * PERIOD)
            .collect()
    };
    let interrupted = later(run(Vector2::zeros(), 5_000..20_000));
    assert!(interrupted.len() > 100);
    assert_eq!(interrupted, later(here));
}

#[test]
fn equal_seeds_give_equal_fixes_and_other_seeds_others() {
    let setup = usual(2);
    let all_telemetry = [at(50.0, 5.0), at(80.0, 10.0)];
    let run = |seed| listen(&setup, seed, 100 * FRAME_STEPS, &all_telemetry);
    assert_eq!(run(6), run(6));
    assert_ne!(run(6).0, run(7).0);
}

#[test]
fn slots_do_not_drift_over_a_day_or_suffer_from_rounding() {
    // A day of 0.1 s steps, and 0.7 / 0.1 = 6.999…
    let setup = AcousticsSetup {
        slots: vec![0.7],
        ..clear(1)
    };
    let steps = 864_000;
    let (heard, counts) = listen(&setup, 1, steps, &[at(1.0, 0.0)]);
    assert_eq!(counts.sent, u64::from(steps / FRAME_STEPS));
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
    let mut heard = vec![];
    channel.receive(f64::INFINITY, &mut heard);
    assert_eq!(heard.len(), QUEUE_PER_VEHICLE);
    assert_eq!(channel.counts().uncollected, 36);
    assert_eq!(heard[0].sent_at, 360.0);
}

#[test]
fn a_telemetered_speed_is_never_negative() {
    let setup = AcousticsSetup {
        speed_sigma: 0.5,
        ..clear(1)
    };
    let (heard, _) = listen(&setup, 8, 100 * FRAME_STEPS, &[at(5.0, 5.0)]);
    assert!(heard.iter().all(|fix| fix.telemetry.speed >= 0.0));
    assert!(heard.iter().any(|fix| fix.telemetry.speed == 0.0));
}
