//! The claims of every built-in scenario about itself, over its whole length.

use std::f64::consts::PI;

use nalgebra::Vector2;
use pilotfish_sim::{
    guide::{Guidance, Guide, GuideError, LosGuide},
    mission::run,
    record::{AuvRow, Record, Row, SurfaceCraftRow},
};
use planner::{
    angle::{Heading, angle_of, direction, wrap},
    los::Reference,
    path::Segment,
    snapshot::{Report, Snapshot},
};

use crate::{los, named};

/// The mission under the line-of-sight law: AUVs and water do not depend on the law.
fn flown(name: &str, seed: u64) -> Record {
    run(&named(name), &mut los(), seed, &mut |_| {}).expect("runs")
}

fn craft(row: &Row) -> &SurfaceCraftRow {
    row.surface_craft.as_ref().expect("has one")
}

/// The rows from `from` on and before `until`, s; one row a second.
fn between(record: &Record, from: usize, until: usize) -> &[Row] {
    &record.rows[from..until]
}

/// Distances of the goal from row to row, m: its mean speeds, m/s.
fn goal_steps(record: &Record) -> Vec<f64> {
    let pairs = record.rows.windows(2);
    pairs
        .map(|pair| (craft(&pair[1]).goal - craft(&pair[0]).goal).norm())
        .collect()
}

/// Error of the craft's own position estimate, m.
fn position_error(row: &Row) -> Vector2<f64> {
    craft(row).known.position - craft(row).position
}

fn known_age(row: &Row, auv: usize) -> f64 {
    row.auvs[auv].known.as_ref().expect("has a surface craft").age
}

#[expect(clippy::cast_precision_loss, reason = "a mission has a few thousand rows")]
fn share<T>(of: &[T], holds: impl Fn(&T) -> bool) -> f64 {
    of.iter().filter(|item| holds(item)).count() as f64 / of.len() as f64
}

#[expect(clippy::cast_precision_loss, reason = "a mission has a few thousand rows")]
fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Four standard deviations of the share of `n` draws with a property of probability `p`.
#[expect(clippy::cast_precision_loss, reason = "a mission has a few hundred messages")]
fn binomial_bound(p: f64, n: usize) -> f64 {
    4.0 * (p * (1.0 - p) / n as f64).sqrt()
}

#[test]
fn calm_begins_and_stays_above_its_vehicle() {
    // Craft and vehicle start within ±1 m of a point along both axes: 2 √2 m apart at most.
    for seed in 0..3 {
        for row in &flown("calm", seed).rows {
            assert!(craft(row).distance() < 2.0 * 2_f64.sqrt(), "{} s", row.time);
        }
    }
}

#[test]
fn cross_current_unknown_can_be_estimated_but_not_read() {
    /// Keeps the difference of ground and water velocity, m/s: the current, without errors.
    struct Reckoner {
        law: LosGuide,
        found: Vec<Vector2<f64>>,
    }
    impl Guide for Reckoner {
        fn name(&self) -> &'static str {
            "reckoner"
        }
        fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
            let ground = snapshot.asc.ground_velocity().expect("has GNSS");
            self.found.push(ground - snapshot.asc.water_velocity());
            self.law.guide(snapshot)
        }
    }
    let current = Vector2::new(0.0, 0.12);
    let errors = |name| {
        let mut guide = Reckoner {
            law: los(),
            found: vec![],
        };
        let record = run(&named(name), &mut guide, 1, &mut |_| {}).expect("runs");
        let known = record
            .rows
            .iter()
            .filter(|row| craft(row).known.current.is_some());
        let known = known.count();
        assert!(known == 0 || known == record.rows.len());
        let errors: Vec<_> = guide.found.iter().map(|found| (found - current).norm()).collect();
        (known > 0, root_mean_square(&errors))
    };
    let (known, error) = errors("cross-current");
    assert!(known && error < 1e-12, "{error}");
    // Per axis 0.05 m/s of GNSS and 0.02 m/s of the log: √2 · 0.0539 m/s together. The compass adds
    // 0.01 rad and a bias of 0.02 rad (σ) times the speed, 0.006 m/s at the AUV's 0.25 m/s.
    let (known, error) = errors("cross-current-unknown");
    let expected = 2_f64.sqrt() * 0.0539;
    assert!(!known && (error / expected - 1.0).abs() < 0.1, "{error}");
}

#[test]
fn cross_current_sheared_is_a_third_and_turned_by_30_degrees_at_full_depth() {
    let record = flown("cross-current-sheared", 1);
    for row in &record.rows {
        let (above, below) = (craft(row).current, row.auvs[0].current);
        let share = (row.auvs[0].depth / 23.0).min(1.0);
        let factor = below.norm() / above.norm();
        assert!((factor - (1.0 - 0.67 * share)).abs() < 1e-9, "{factor}");
        let turn = wrap(angle_of(&below) - angle_of(&above));
        // The file has 30° to six digits.
        assert!((turn - PI / 6.0 * share).abs() < 1e-6, "{turn}");
    }
    let deepest = record
        .rows
        .iter()
        .map(|row| row.auvs[0].depth)
        .fold(0.0, f64::max);
    assert!(deepest > 23.0);
}

#[test]
fn about_face_begins_far_ahead_and_faces_backwards() {
    for seed in 0..20 {
        let start = named("about-face").start(seed).expect("valid").world;
        let craft = start.surface_craft.as_ref().expect("has one");
        let auv = &start.auvs[0];
        let apart = craft.position() - auv.position();
        assert!(apart.norm() > 40.0);
        assert!(apart.dot(&direction(auv.heading())) > 30.0);
        // Each heading is drawn from ±0.1 rad.
        let opposed = wrap(craft.state[2] - auv.heading()).abs();
        assert!(PI - opposed < 0.2 + 1e-6, "{opposed}");
    }
}

#[test]
fn switching_hands_over_every_240_s_to_a_vehicle_60_m_away() {
    for name in ["switching", "switching-opposed"] {
        let record = flown(name, 1);
        let jumps: Vec<f64> = record.rows[1..]
            .iter()
            .zip(goal_steps(&record))
            .filter_map(|(row, step)| (step > 50.0).then_some(row.time))
            .collect();
        let expected: Vec<f64> = (1..8).map(|k| 240.0 * f64::from(k)).collect();
        assert_eq!(jumps.len(), expected.len(), "{name}");
        for (found, expected) in jumps.iter().zip(expected) {
            assert!((found - expected).abs() < 0.5, "{name}: {found}");
        }
        // No vehicle turns: only hand-overs remain. Both have reached their lanes after a minute.
        let opposed = name == "switching-opposed";
        for row in &record.rows[60..] {
            let between = wrap(row.auvs[0].heading - row.auvs[1].heading).abs();
            let expected = if opposed { PI } else { 0.0 };
            assert!(
                (between - expected).abs() < 0.01,
                "{name}, {} s: {between}",
                row.time
            );
        }
    }
}

#[test]
fn anti_phase_has_a_goal_that_is_mostly_at_rest() {
    let slow = share(&goal_steps(&flown("anti-phase", 1)), |step| *step < 0.05);
    assert!(slow > 0.5, "{slow}");
}

#[test]
fn target_stops_at_the_surface_for_almost_600_s() {
    let record = flown("target-stops", 1);
    let pairs: Vec<_> = record.rows.windows(2).collect();
    let waiting = pairs.iter().filter(|pair| {
        let [before, after] = [&pair[0].auvs[0], &pair[1].auvs[0]];
        after.depth < 1.0 && (after.position - before.position).norm() < 0.01
    });
    let waiting = waiting.count();
    // It has up to 23 m to climb, at 0.3 m/s · sin 50°: 100 s.
    assert!((500..=600).contains(&waiting), "{waiting}");
    // Then it continues.
    let moved = record.rows[1799].auvs[0].position - record.rows[1199].auvs[0].position;
    assert!(moved.norm() > 50.0, "{moved}");
}

#[test]
fn silence_hides_a_whole_turn_and_the_path_compensates() {
    let mut worst = vec![];
    for name in ["silence", "silence-path"] {
        let record = flown(name, 1);
        let silent = between(&record, 510, 690);
        let oldest = silent.iter().map(|row| known_age(row, 0)).fold(0.0, f64::max);
        assert!(oldest >= 170.0, "{oldest}");
        let turned: f64 = silent
            .windows(2)
            .map(|pair| wrap(pair[1].auvs[0].heading - pair[0].auvs[0].heading))
            .sum();
        assert!((turned.abs() - PI).abs() < 0.05, "{turned}");
        worst.push(silent.iter().map(|row| craft(row).distance()).fold(0.0, f64::max));
    }
    // Straight on from the first lane's end is 20 m off the second lane, and further every second.
    assert!(worst[0] > 20.0 && worst[1] < 5.0, "{worst:?}");
}

#[test]
fn noisy_fixes_have_the_delay_loss_and_errors_of_the_file() {
    /// Keeps the newest report of every look with its time, s.
    struct Listener {
        law: LosGuide,
        heard: Vec<(f64, Report)>,
    }
    impl Guide for Listener {
        fn name(&self) -> &'static str {
            "listener"
        }
        fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
            let Some(reports) = &snapshot.auvs[0].reports else {
                panic!("fixes come as reports");
            };
            let newest = reports.last().expect("its launch is known");
            self.heard.push((snapshot.t_s, *newest));
            self.law.guide(snapshot)
        }
    }
    let (mut sent, mut components, mut courses) = (0, vec![], vec![]);
    for seed in 1..=3 {
        let mut guide = Listener {
            law: los(),
            heard: vec![],
        };
        let record = run(&named("noisy-fixes"), &mut guide, seed, &mut |_| {}).expect("runs");
        // Sent at 10, 20, … 1790 s; the last is known 3 s later.
        sent += record.rows.len() / 10 - 1;
        let mut last = 0.0;
        for (now, report) in guide.heard {
            let (sent_at, age) = (report.t_s, now - report.t_s);
            if sent_at > last + 1.0 {
                last = sent_at;
                // 2 s of latency and at least 10 ms of travel: known at the third look.
                assert!(age > 2.0 && age < 4.0, "{age}");
                // The vehicle's slot is the first of every frame of 10 s, so a row has that time.
                let then = record.rows.iter().find(|row| (row.time - sent_at).abs() < 1e-6);
                let then = &then.expect("sent at a whole second").auvs[0];
                components.extend((report.position() - then.position).iter().copied());
                // Still water: the course is the heading.
                let course = report.ground_track().expect("is given").course;
                courses.push(wrap(course.radians() - then.heading));
            }
        }
    }
    let heard = components.len() / 2;
    let lost = 1.0 - share_of(heard, sent);
    assert!((lost - 0.3).abs() < binomial_bound(0.3, sent), "{lost} of {sent}");
    // Tabulated: 68.27 % within one σ; of the 2 % outliers with σ 20 m, erf(1.5 / 20 / √2) = 6.0 %.
    let expected = 0.98 * 0.6827 + 0.02 * 0.060;
    let within = share(&components, |error| error.abs() < 1.5);
    assert!(
        (within - expected).abs() < binomial_bound(expected, heard),
        "{within}"
    );
    let within = share(&courses, |error| error.abs() < 0.05);
    assert!(
        (within - 0.6827).abs() < binomial_bound(0.6827, heard),
        "{within}"
    );
    // No regular fix is off by 6 σ; erfc(9 / 20 / √2) = 65 % of an outlier's components are, 9 m.
    let outliers = share(&components, |error| error.abs() > 9.0);
    assert!(
        0.0 < outliers && outliers < 0.02 * 0.65 + binomial_bound(0.02, heard),
        "{outliers}"
    );
}

#[test]
fn surveys_report_positions_alone_and_routes_as_corners() {
    /// Checks every snapshot.
    struct Looker(LosGuide, usize);
    impl Guide for Looker {
        fn name(&self) -> &'static str {
            "looker"
        }
        fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
            let auv = &snapshot.auvs[0];
            let reports = auv.reports.as_ref().expect("fixes come as reports");
            assert!(reports.iter().all(|report| report.ground_track().is_none()));
            assert!(reports.iter().all(|report| report.turn_rate_radps.is_none()));
            let known = auv.path.as_ref().map_or(&[][..], |path| &path.segments);
            self.1 = known.iter().map(Segment::count).sum();
            let bare = |segment: &Segment| {
                matches!(
                    segment,
                    Segment::Waypoints {
                        fillet_m: None,
                        turn_radius_m: None,
                        ..
                    }
                )
            };
            assert!(known.iter().all(bare));
            self.0.guide(snapshot)
        }
    }
    for (name, corners) in [
        ("survey-lanes", 0),
        ("survey-declared", 16),
        ("survey-resumed", 16),
        ("survey-random", 0),
    ] {
        let mut looker = Looker(los(), 0);
        run(&named(name).lasting(60.0), &mut looker, 1, &mut |_| {}).expect("runs");
        assert_eq!(looker.1, corners, "{name}");
    }
}

#[test]
fn survey_declared_follows_a_navigation_that_is_off_by_20_m_and_drifts() {
    let record = flown("survey-declared", 1);
    // The route has a point every metre.
    let off = |row: &Row| {
        let distances = record.paths[0]
            .iter()
            .map(|point| (point - row.auvs[0].position).norm());
        distances.fold(f64::INFINITY, f64::min)
    };
    let lane = between(&record, 60, 120).iter().map(off).fold(0.0, f64::max);
    // 16.4 of 20 m are across a lane at 37° east of north. 1 % of 0.9 m/s over 120 s are 1.1 m.
    assert!((lane - 16.4).abs() < 1.5, "{lane}");
    let errors: Vec<_> = [60.0, 1499.0]
        .iter()
        .map(|time| navigation_error("survey-declared", *time))
        .collect();
    let grown = (errors[1] - errors[0]).norm();
    // 1 % of 0.9 m/s over 1439 s.
    assert!((grown - 12.9).abs() < 0.3, "{grown}");
}

fn navigation_error(name: &str, time: f64) -> Vector2<f64> {
    let mut world = named(name).start(1).expect("valid").world;
    while world.time() < time {
        world.step(None);
    }
    world.auvs[0].position_estimate - world.auvs[0].position()
}

#[test]
fn survey_resumed_leaves_its_lanes_for_150_s_and_returns() {
    for seed in 1..=3 {
        let record = flown("survey-resumed", seed);
        let off = |row: &Row| row.auvs[0].cross_track.abs();
        assert!(
            between(&record, 60, 700).iter().all(|row| off(row) < 1.0),
            "seed {seed}"
        );
        let strayed = between(&record, 700, 850).iter().map(off).fold(0.0, f64::max);
        assert!(50.0 < strayed, "seed {seed}: {strayed}");
        assert!(
            between(&record, 1000, 1450).iter().all(|row| off(row) < 1.0),
            "seed {seed}"
        );
    }
}

#[expect(clippy::cast_precision_loss, reason = "a mission has a few hundred messages")]
fn share_of(some: usize, all: usize) -> f64 {
    some as f64 / all as f64
}

#[test]
fn crowded_has_a_disc_on_the_straight_course_and_never_around_the_goal() {
    for seed in 1..=2 {
        let record = flown("crowded", seed);
        let disc = record.bounds.keep_outs[0];
        let inside = |place: Vector2<f64>| (place - disc.centre()).norm() < disc.radius_m;
        // A vehicle may be followed anywhere: both stay outside, followed or not.
        for row in &record.rows {
            assert!(!inside(craft(row).goal), "{} s", row.time);
            assert!(row.auvs.iter().all(|auv| !inside(auv.position)), "{} s", row.time);
        }
        // A straight course goes through it, to a goal beyond it.
        let entered: Vec<_> = record
            .rows
            .iter()
            .filter(|row| inside(craft(row).position))
            .collect();
        assert!(!entered.is_empty());
        assert!(craft(entered[0]).distance() > disc.radius_m);
        for i in 0..2 {
            let depths = record.rows.iter().map(|row| row.auvs[i].depth);
            assert!(depths.fold(f64::INFINITY, f64::min) < 0.6);
        }
    }
}

#[test]
fn rough_water_rocks_the_craft_and_its_current_varies() {
    // One heading and one speed throughout: only the water turns the craft.
    let ahead = Reference {
        speed: 0.3,
        heading: Heading::new(0.0),
    };
    let held = |name: &str| {
        let mut world = named(name).start(1).expect("valid").world;
        let (mut yaw_rates, mut currents) = (vec![], vec![]);
        for step in 0..12_000 {
            world.step(Some(&ahead));
            // It starts on another heading; a minute is 20 times the time of a quarter turn.
            if step > 600 {
                let craft = world.surface_craft.as_ref().expect("has one");
                yaw_rates.push(craft.state[5]);
                currents.push(world.water.current(&Vector2::zeros(), 0.0));
            }
        }
        let first = currents[0];
        let swing = currents.iter().map(|current| (current - first).norm());
        (root_mean_square(&yaw_rates), swing.fold(0.0, f64::max))
    };
    let (calm, rough) = (held("calm"), held("rough-water"));
    // 0.04 rad at 2π / 4 s are 0.063 rad/s for a free hull; the autopilot reduces that.
    assert!(calm.0 < 1e-6 && rough.0 > 0.01, "{calm:?} {rough:?}");
    // Four correlation times of gusts of 0.03 m/s.
    assert!(calm.1 == 0.0 && rough.1 > 0.03, "{calm:?} {rough:?}");
}

#[test]
fn faults_weaken_a_thruster_for_300_s() {
    // 60 % of 36 N, but for the lag of 0.1 s: a second is ten of those.
    let limit = 0.6 * 36.0 * (1.0 + (-10_f64).exp());
    let (mut weak, mut sound) = (0.0_f64, 0.0_f64);
    for seed in 1..=3 {
        for row in &flown("faults", seed).rows {
            let most = if (301.0..600.0).contains(&row.time) {
                &mut weak
            } else {
                &mut sound
            };
            *most = most.max(craft(row).thrust_port);
        }
    }
    assert!(weak < limit && limit < sound, "{weak} {sound}");
}

#[test]
fn faults_make_the_position_drift_until_gnss_returns() {
    let scenario = named("faults").lasting(900.0);
    let mut returns = vec![];
    for seed in 1..=6 {
        let record = run(&scenario, &mut los(), seed, &mut |_| {}).expect("runs");
        let jump =
            |at: usize| (position_error(&record.rows[at]) - position_error(&record.rows[at - 1])).norm();
        // With GNSS the error changes by 0.8 √(1 − e^(−2/60)) = 0.145 m a second (σ, each axis).
        assert!((1..700).all(|at| jump(at) < 1.0));
        returns.push(jump(880));
    }
    assert!(root_mean_square(&returns) > 2.0, "{returns:?}");
}

#[test]
fn faults_set_the_clock_ahead_lead_one_vehicle_astray_and_kill_the_other() {
    let record = flown("faults", 1);
    for row in &record.rows {
        let ahead = if row.time < 1200.0 { 0.0 } else { 5.0 };
        assert!((craft(row).known.time - row.time - ahead).abs() < 1e-9);
    }

    // Straight on at the end of its lane.
    let from_path = |row: &Row| {
        let place = row.auvs[1].position;
        let distances = record.paths[1].iter().map(|point| (point - place).norm());
        distances.fold(f64::INFINITY, f64::min)
    };
    // The path has a point every metre.
    assert!(between(&record, 200, 1120).iter().all(|row| from_path(row) < 1.0));
    assert!(from_path(&record.rows[1479]) > 20.0);
    assert!(from_path(&record.rows[1799]) < 20.0);

    let (dying, dead) = (&record.rows[1500], &record.rows[1799]);
    assert!(dying.auvs[0].surge > 0.25 && dead.auvs[0].surge < 0.05);
    // Its last message is from before 1500 s, by a clock that is 5 s ahead.
    assert!((known_age(dead, 0) - 305.0).abs() < 1.5, "{}", known_age(dead, 0));
    assert!(known_age(dead, 1) < 6.0);
}

#[test]
fn otter_is_faster_than_a_medusa_can_be() {
    let record = flown("otter", 1);
    let fastest = record.rows.iter().map(|row| craft(row).surge).fold(0.0, f64::max);
    assert!(fastest > 1.6, "{fastest}");
}

#[test]
fn slocums_drift_off_their_paths_under_water_and_correct_at_the_surface() {
    let record = flown("slocum", 1);
    for i in 0..2 {
        let auv = |row: &Row| -> AuvRow { row.auvs[i] };
        let under: Vec<bool> = record.rows.iter().map(|row| auv(row).depth > 1.0).collect();
        let surfaced: Vec<usize> = (1..under.len()).filter(|k| under[k - 1] && !under[*k]).collect();
        assert!(surfaced.len() >= 4, "{surfaced:?}");
        // It steers by its estimated position, from which the current of 0.05 m/s carries it away.
        let first = &record.rows[surfaced[0]];
        let drift = auv(first).cross_track.abs();
        assert!(
            (drift - 0.05 * first.time).abs() < 0.5,
            "{drift} at {} s",
            first.time
        );
        assert!(drift > 1.0);
        // Then it has a fix, and comes nearer.
        let knowing = auv(&record.rows[surfaced[0] + 10]).cross_track.abs();
        assert!(knowing < drift, "{knowing}");
    }
}
