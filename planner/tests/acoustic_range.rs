//! Acoustic ranges that are kept, if all cannot be kept.

use nalgebra::Vector2;
use pilotfish_planner::{
    angle::{Course, Heading},
    craft::{Craft, CraftDescription},
    parameters::Parameters,
    plan::{Plan, SoftLimit, Subject, Workspace, plan},
    snapshot::{Acoustics, Asc, Auv, AuvState, Goal, Limits, PlanRequest, PreviousPlan, Snapshot, VehicleId},
};

const RANGE: f64 = 300.0;
/// Present back-off of a range for a state without covariance, m: 1.73 · √2 · 1.5, doubled.
const BACK_OFF: f64 = 8.0;

fn auv(id: &str, east: f64) -> Auv {
    Auv::new(id, AuvState::new(Vector2::new(0.0, east), 5.0, Course::new(0.0), 0.2))
}

/// A craft that tracks the first AUV, at the datum; the others are at these distances to the east.
fn scene(craft: Vector2<f64>, others: &[f64]) -> PlanRequest {
    let others = ["b", "c", "d"].into_iter().zip(others).map(|(id, east)| auv(id, *east));
    let auvs = std::iter::once(auv("a", 0.0)).chain(others).collect();
    let asc = Asc::new(craft, Heading::new(0.0), 0.3);
    PlanRequest {
        current: Some(Vector2::zeros().into()),
        limits: Some(Limits::MEDUSA.into()),
        craft: Some(CraftDescription::from(&Craft::MEDUSA)),
        acoustics: Some(Acoustics { range_max_m: RANGE }),
        ..PlanRequest::new(0.0, asc, auvs, Goal::Track { auv: "a".into() })
    }
}

fn ids(scene: &PlanRequest) -> Vec<VehicleId> {
    scene.auvs.iter().map(|auv| auv.id.clone()).collect()
}

fn state(scene: &mut PlanRequest, auv: usize) -> &mut AuvState {
    scene.auvs[auv].state.as_mut().expect("is given")
}

fn planned(observation: &PlanRequest) -> Plan {
    let snapshot = Snapshot::try_from(observation.clone()).expect("valid");
    plan(&snapshot, &Parameters::default(), &mut Workspace::default())
}

/// The craft after ten minutes of exactly followed plans, 4 s of each.
fn after_ten_minutes(mut observation: PlanRequest) -> (PlanRequest, Plan) {
    let mut answer = planned(&observation);
    for _ in 0..150 {
        let next = answer.trajectory[4];
        observation.t_s = next.t_s;
        [observation.asc.north_m, observation.asc.east_m] = next.position().into();
        observation.asc.heading_rad = next.heading_rad;
        observation.asc.speed_mps = next.speed_mps;
        for auv in 0..observation.auvs.len() {
            state(&mut observation, auv).north_m = 0.2 * next.t_s;
        }
        // A craft set on its plan responds to no reference: nothing can be learnt.
        observation.previous_plan =
            Some(PreviousPlan { craft_estimate: None, ..PreviousPlan::from(&answer) });
        answer = planned(&observation);
    }
    (observation, answer)
}

/// Distance of the craft from an AUV, m.
fn apart(observation: &PlanRequest, auv: usize) -> f64 {
    let state = observation.auvs[auv].state.as_ref().expect("is given");
    (observation.asc.position() - state.position()).norm()
}

#[test]
fn an_auv_out_of_range_of_the_goal_changes_no_plan_and_is_reported() {
    for craft in [Vector2::new(0.0, 0.0), Vector2::new(-40.0, 200.0)] {
        let alone = planned(&scene(craft, &[]));
        let beside = planned(&scene(craft, &[2.0 * RANGE + 1.0]));
        let found = [alone.range_unattainable, beside.range_unattainable];
        assert_eq!(found, [vec![], vec![1]]);
        for (a, b) in alone.trajectory.iter().zip(&beside.trajectory) {
            // Another shape of the program: the solver's tolerance over 78 s.
            assert!((a.position() - b.position()).norm() < 0.05, "{a:?}, {b:?}");
        }
    }
}

#[test]
fn a_craft_between_two_incompatible_auvs_goes_to_its_goal() {
    let (observation, answer) = after_ten_minutes(scene(Vector2::new(0.0, RANGE), &[2.0 * RANGE]));
    assert_eq!(answer.range_unattainable, [1]);
    assert!(apart(&observation, 0) < 1.0, "{} m", apart(&observation, 0));
    let [broken] = &answer.violations[..] else {
        panic!("{:?}", answer.violations);
    };
    assert_eq!(broken.limit, SoftLimit::AcousticRange);
    assert_eq!(broken.pointer, Some(Subject::Auv(1)));
}

#[test]
fn a_range_compatible_with_the_goal_is_kept() {
    let (observation, answer) = after_ten_minutes(scene(Vector2::zeros(), &[1.5 * RANGE]));
    assert_eq!(answer.range_unattainable, [0; 0]);
    let (to_goal, to_other) = (apart(&observation, 0), apart(&observation, 1));
    assert!((0.0..4.0 * BACK_OFF).contains(&(to_goal - 0.5 * RANGE)), "{to_goal} m");
    assert!(to_other < RANGE, "{to_other} m");
}

#[test]
fn the_nearer_to_the_goal_of_two_incompatible_auvs_is_kept() {
    let (observation, answer) = after_ten_minutes(scene(Vector2::zeros(), &[1.3 * RANGE, -1.2 * RANGE]));
    assert_eq!(answer.range_unattainable, [1]);
    assert!(apart(&observation, 2) < RANGE && apart(&observation, 0) < RANGE);
}

#[test]
fn no_other_range_is_kept_at_the_goal_s_expense() {
    // From out of range of both, nearer to the other AUV than to the goal's.
    for craft in [Vector2::new(420.0, 260.0), Vector2::new(0.0, 800.0)] {
        let misses = |others: &[f64]| {
            let answer = planned(&scene(craft, others));
            let pairs = answer.trajectory.iter().zip(&answer.goal);
            let misses = pairs.map(|(at, goal)| (at.position() - goal.motion().position).norm());
            misses.collect::<Vec<_>>()
        };
        for (alone, beside) in misses(&[]).iter().zip(misses(&[1.9 * RANGE])) {
            // Both move at the craft's limit; unequal corners make up to a metre.
            assert!(beside < RANGE.max(alone + 1.0), "{beside} m, alone {alone} m");
        }
    }
}

#[test]
fn equally_named_auvs_share_the_violation() {
    let mut both = scene(Vector2::new(0.0, 200.0), &[2.2 * RANGE]);
    both.goal.goal = Goal::Midpoint { auvs: ids(&both) };
    let (observation, answer) = after_ten_minutes(both);
    assert_eq!(answer.range_unattainable, [0, 1]);
    assert!((apart(&observation, 0) - apart(&observation, 1)).abs() < 2.0);
    let mut broken = answer.violations.iter();
    assert!(broken.any(|broken| broken.limit == SoftLimit::AcousticRange));
}

#[test]
fn an_auv_silent_for_an_hour_binds_nothing_unless_the_goal_needs_it() {
    let mut scene = scene(Vector2::new(0.0, 100.0), &[1.5 * RANGE]);
    assert!(planned(&scene).degraded.is_none());
    let mut alone = scene.clone();
    alone.auvs.truncate(1);
    let alone = planned(&alone);
    for age in [901.0, 3_600.0, 1.0e6, 1.0e11] {
        state(&mut scene, 1).age_s = age;
        let answer = planned(&scene);
        assert_eq!((answer.degraded, &answer.range_unattainable[..]), (None, &[][..]));
        assert_eq!(answer.trajectory, alone.trajectory);
        let mut sigmas = answer.targets[1].position_sigma_m.iter();
        assert!(sigmas.all(|sigma| sigma.is_finite()));
        // The answer is accepted as a previous plan.
        let mut next = scene.clone();
        next.previous_plan = Some(PreviousPlan::from(&answer));
        assert!(Snapshot::try_from(next).is_ok());
    }
    scene.goal.goal = Goal::Track { auv: "b".into() };
    assert!(planned(&scene).degraded.is_some());
}

#[test]
fn a_silent_auv_in_turn_is_held_in_its_turn_alone() {
    let mut scene = scene(Vector2::new(0.0, 100.0), &[30.0]);
    scene.goal.goal = Goal::Intermittent { auvs: ids(&scene), dwell_s: 240.0, epoch_s: 0.0 };
    state(&mut scene, 1).age_s = 5.0e3;
    for (time, held) in [(0.0, false), (200.0, false), (240.0, true), (480.0, false)] {
        scene.t_s = time;
        assert_eq!(planned(&scene).degraded.is_some(), held, "{time} s");
    }
}
