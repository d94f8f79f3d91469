//! The claims of every built-in scenario about itself, over its whole length.

use std::f64::consts::PI;

use nalgebra::Vector2;
use pilotfish_sim::{
    guide::{Guidance, Guide, GuideError, LosGuide},
    record::{Record, Row},
};
use planner::angle::{Heading, direction, wrap};
use planner::los::Reference;
use planner::path::Segment;
use planner::snapshot::{Report, Snapshot};

use crate::{craft, flown_by, los, named, near, step_until, world};

/// The mission under the line-of-sight law: AUVs and water do not depend on the law.
fn flown(name: &str, seed: u64) -> Record {
    flown_by(&named(name), &mut los(), seed)
}

/// The line-of-sight law, with a look at every snapshot.
struct Looker<F>(LosGuide, F);

impl<F: FnMut(&Snapshot)> Guide for Looker<F> {
    fn name(&self) -> &'static str {
        "looker"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        (self.1)(snapshot);
        self.0.guide(snapshot)
    }
}

fn watched(name: &str, seconds: f64, seed: u64, look: impl FnMut(&Snapshot)) -> Record {
    flown_by(&named(name).lasting(seconds), &mut Looker(los(), look), seed)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// Distance of an AUV from its recorded path, which has a point every metre.
fn from_path(record: &Record, row: &Row, auv: usize) -> f64 {
    let place = row.auvs[auv].position;
    let distances = record.paths[auv].iter().map(|point| (point - place).norm());
    distances.fold(f64::INFINITY, f64::min)
}

/// Distances of the goal from row to row, m: its mean speeds, m/s.
fn goal_steps(record: &Record) -> Vec<f64> {
    let pairs = record.rows.windows(2);
    pairs.map(|pair| (craft(&pair[1]).goal - craft(&pair[0]).goal).norm()).collect()
}

fn known_age(row: &Row, auv: usize) -> f64 {
    row.auvs[auv].known.as_ref().expect("has a surface craft").age
}

fn share<T>(of: &[T], holds: impl Fn(&T) -> bool) -> f64 {
    of.iter().filter(|item| holds(item)).count() as f64 / of.len() as f64
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Four standard deviations of the share of `n` draws with a property of probability `p`.
fn deviations(p: f64, n: usize) -> f64 {
    4.0 * (p * (1.0 - p) / n as f64).sqrt()
}

#[track_caller]
fn binomial(share: f64, p: f64, n: usize) {
    near(share, p, deviations(p, n));
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
    let current = Vector2::new(0.0, 0.12);
    // The difference of ground and water velocity, m/s: the current, without errors.
    let errors = |name| {
        let mut errors = vec![];
        let record = watched(name, 1800.0, 1, |snapshot| {
            let ground = snapshot.asc.ground_velocity().expect("has GNSS");
            errors.push((ground - snapshot.asc.water_velocity() - current).norm());
        });
        let known = share(&record.rows, |row| craft(row).known.current.is_some());
        (known, root_mean_square(&errors))
    };
    let (known, error) = errors("cross-current");
    assert!(known == 1.0 && error < 1e-12, "{known} {error}");
    // Per axis 0.05 m/s of GNSS and 0.02 m/s of the log: √2 · 0.0539 m/s together. The compass adds
    // 0.01 rad and a bias of 0.02 rad (σ) times the speed, 0.006 m/s at the AUV's 0.25 m/s.
    let (known, error) = errors("cross-current-unknown");
    assert_eq!(known, 0.0);
    near(error / (2_f64.sqrt() * 0.0539), 1.0, 0.1);
}

#[test]
fn about_face_begins_far_ahead_and_faces_backwards() {
    for seed in 0..20 {
        let start = world(&named("about-face"), seed);
        let (craft, auv) = (start.surface_craft.as_ref().expect("has one"), &start.auvs[0]);
        let apart = craft.position() - auv.position();
        assert!(apart.norm() > 40.0 && apart.dot(&direction(auv.heading())) > 30.0);
        // Each heading is drawn from ±0.1 rad.
        near(wrap(craft.state[2] - auv.heading()).abs(), PI, 0.2 + 1e-6);
    }
}

#[test]
fn switching_hands_over_every_240_s_to_a_vehicle_60_m_away() {
    for (name, between) in [("switching", 0.0), ("switching-opposed", PI)] {
        let record = flown(name, 1);
        let steps = record.rows[1..].iter().zip(goal_steps(&record));
        let jumps: Vec<f64> = steps.filter_map(|(row, step)| (step > 50.0).then_some(row.time)).collect();
        assert_eq!(jumps.len(), 7, "{name}");
        for (k, found) in (1..).zip(jumps) {
            near(found, 240.0 * f64::from(k), 0.5);
        }
        // No vehicle turns: only hand-overs remain. Both have reached their lanes after a minute.
        for row in &record.rows[60..] {
            near(wrap(row.auvs[0].heading - row.auvs[1].heading).abs(), between, 0.01);
        }
    }
}

#[test]
fn anti_phase_has_a_goal_that_is_mostly_at_rest() {
    let slow = share(&goal_steps(&flown("anti-phase", 1)), |step| *step < 0.05);
    assert!(slow > 0.5, "{slow}");
}

#[test]
fn silence_hides_a_whole_turn_and_the_path_compensates() {
    let worst = ["silence", "silence-path"].map(|name| {
        let record = flown(name, 1);
        let silent = &record.rows[510..690];
        let oldest = largest(silent.iter().map(|row| known_age(row, 0)));
        assert!(oldest >= 170.0, "{oldest}");
        let turns = silent.windows(2).map(|pair| wrap(pair[1].auvs[0].heading - pair[0].auvs[0].heading));
        near(turns.sum::<f64>().abs(), PI, 0.05);
        largest(silent.iter().map(|row| craft(row).distance()))
    });
    // Straight on from the first lane's end is 20 m off the second lane, and further every second.
    assert!(worst[0] > 20.0 && worst[1] < 5.0, "{worst:?}");
}

#[test]
fn noisy_fixes_have_the_delay_loss_and_errors_of_the_file() {
    let (mut sent, mut components, mut courses) = (0, vec![], vec![]);
    for seed in 1..=3 {
        // The newest report of every look with its time, s.
        let mut heard: Vec<(f64, Report)> = vec![];
        let record = watched("noisy-fixes", 1800.0, seed, |snapshot| {
            let reports = snapshot.auvs[0].reports.as_ref().expect("fixes come as reports");
            heard.push((snapshot.t_s, *reports.last().expect("its launch is known")));
        });
        // Sent at 10, 20, … 1790 s; the last is known 3 s later.
        sent += record.rows.len() / 10 - 1;
        heard.dedup_by_key(|(_, report)| report.t_s);
        for (now, report) in heard.into_iter().filter(|(_, report)| 1.0 < report.t_s) {
            // 2 s of latency and at least 10 ms of travel: known at the third look.
            let age = now - report.t_s;
            assert!(age > 2.0 && age < 4.0, "{age}");
            // The vehicle's slot is the first of every frame of 10 s, so a row has that time.
            let mut rows = record.rows.iter();
            let then = rows.find(|row| (row.time - report.t_s).abs() < 1e-6);
            let then = &then.expect("sent at a whole second").auvs[0];
            components.extend((report.position() - then.position).iter().copied());
            // Still water: the course is the heading.
            let course = report.ground_track().expect("is given").course;
            courses.push(wrap(course.radians() - then.heading));
        }
    }
    let n = courses.len();
    binomial(1.0 - share_of(n, sent), 0.3, sent);
    // Tabulated: 68.27 % within one σ; of the 2 % outliers with σ 20 m, erf(1.5 / 20 / √2) = 6.0 %.
    let found = share(&components, |error| error.abs() < 1.5);
    binomial(found, 0.98 * 0.6827 + 0.02 * 0.060, n);
    binomial(share(&courses, |error| error.abs() < 0.05), 0.6827, n);
    // No regular fix is off by 6 σ; erfc(9 / 20 / √2) = 65 % of an outlier's components are, 9 m.
    let outliers = share(&components, |error| error.abs() > 9.0);
    let most = 0.02 * 0.65 + deviations(0.02, n);
    assert!(0.0 < outliers && outliers < most, "{outliers}");
}

#[test]
fn surveys_report_positions_alone_and_routes_as_corners() {
    for (name, corners) in
        [("survey-lanes", 0), ("survey-declared", 16), ("survey-resumed", 16), ("survey-random", 0)]
    {
        watched(name, 60.0, 1, |snapshot| {
            let auv = &snapshot.auvs[0];
            let mut reports = auv.reports.iter().flatten();
            assert!(auv.reports.is_some(), "fixes come as reports");
            assert!(
                reports.all(|report| { report.ground_track().is_none() && report.turn_rate_radps.is_none() })
            );
            let known = auv.path.iter().flat_map(|path| &path.segments);
            assert_eq!(known.clone().map(Segment::count).sum::<usize>(), corners, "{name}");
            for segment in known {
                let Segment::Waypoints { fillet_m: None, turn_radius_m: None, .. } = segment else {
                    panic!("{segment:?}")
                };
            }
        });
    }
}

#[test]
fn survey_declared_follows_a_navigation_that_is_off_by_20_m_and_drifts() {
    let record = flown("survey-declared", 1);
    let lane = largest(record.rows[60..120].iter().map(|row| from_path(&record, row, 0)));
    // 16.4 of 20 m are across a lane at 37° east of north. 1 % of 0.9 m/s over 120 s are 1.1 m.
    near(lane, 16.4, 1.5);
    let mut world = world(&named("survey-declared"), 1);
    let errors = [60.0, 1499.0].map(|time| {
        step_until(&mut world, time);
        world.auvs[0].position_estimate - world.auvs[0].position()
    });
    // 1 % of 0.9 m/s over 1439 s.
    near((errors[1] - errors[0]).norm(), 12.9, 0.3);
}

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
        let entered = record.rows.iter().find(|row| inside(craft(row).position));
        assert!(entered.is_some_and(|row| craft(row).distance() > disc.radius_m));
        for i in 0..2 {
            assert!(record.rows.iter().any(|row| row.auvs[i].depth < 0.6));
        }
    }
}

#[test]
fn rough_water_rocks_the_craft_and_its_current_varies() {
    // One heading and one speed throughout: only the water turns the craft.
    let ahead = Reference { speed: 0.3, heading: Heading::new(0.0) };
    let [calm, rough] = ["calm", "rough-water"].map(|name| {
        let mut world = world(&named(name), 1);
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
        let swing = largest(currents.iter().map(|current| (current - currents[0]).norm()));
        (root_mean_square(&yaw_rates), swing)
    });
    // 0.04 rad at 2π / 4 s are 0.063 rad/s for a free hull; the autopilot reduces that.
    assert!(calm.0 < 1e-6 && rough.0 > 0.01, "{calm:?} {rough:?}");
    // Four correlation times of gusts of 0.03 m/s.
    assert!(calm.1 == 0.0 && rough.1 > 0.03, "{calm:?} {rough:?}");
}

#[test]
fn faults_make_the_position_drift_until_gnss_returns() {
    let scenario = named("faults").lasting(900.0);
    let returns: Vec<f64> = (1..=6)
        .map(|seed| {
            let record = flown_by(&scenario, &mut los(), seed);
            let error = |at: usize| craft(&record.rows[at]).known.position - craft(&record.rows[at]).position;
            let jump = |at: usize| (error(at) - error(at - 1)).norm();
            // With GNSS the error changes by 0.8 √(1 − e^(−2/60)) = 0.145 m/s (σ, each axis).
            assert!((1..700).all(|at| jump(at) < 1.0));
            jump(880)
        })
        .collect();
    assert!(root_mean_square(&returns) > 2.0, "{returns:?}");
}

#[test]
fn faults_set_the_clock_ahead_lead_one_vehicle_astray_and_kill_the_other() {
    let record = flown("faults", 1);
    for row in &record.rows {
        let ahead = if row.time < 1200.0 { 0.0 } else { 5.0 };
        near(craft(row).known.time, row.time + ahead, 1e-9);
    }

    // Straight on at the end of its lane.
    let off = |row: &Row| from_path(&record, row, 1);
    assert!(record.rows[200..1120].iter().all(|row| off(row) < 1.0));
    assert!(off(&record.rows[1479]) > 20.0);
    assert!(off(&record.rows[1799]) < 20.0);

    let (dying, dead) = (&record.rows[1500], &record.rows[1799]);
    assert!(dying.auvs[0].surge > 0.25 && dead.auvs[0].surge < 0.05);
    // Its last message is from before 1500 s, by a clock that is 5 s ahead.
    near(known_age(dead, 0), 305.0, 1.5);
    assert!(known_age(dead, 1) < 6.0);
}
