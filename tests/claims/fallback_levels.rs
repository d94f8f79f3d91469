//! Each fallback level, reached by a forced cause.

use planner::angle::{Course, Heading, wrap};
use planner::los::{AscNow, Reference, saturated_los};
use planner::parameters::Parameters;
use planner::plan::{Degraded, Method, Plan, Programs, plan_with};
use planner::program::Program;
use planner::snapshot::{Hold, Limits, PlanRequest, PreviousCraft, PreviousPlan, Snapshot, TrajectoryPoint};
use planner::solve::{Solution, SolverStatus, Solvers};
use tests::{followed, goals, observation, planned, snapshot, state};

const STATUSES_THAT_PROVE_NOTHING: [SolverStatus; 7] = [
    SolverStatus::Unsolved,
    SolverStatus::PrimalInfeasible,
    SolverStatus::DualInfeasible,
    SolverStatus::AlmostPrimalInfeasible,
    SolverStatus::AlmostDualInfeasible,
    SolverStatus::MaxTime,
    SolverStatus::NumericalError,
];

/// Statuses of an unfinished solver: the certificate decides.
const LESSER_STATUSES: [SolverStatus; 3] =
    [SolverStatus::AlmostSolved, SolverStatus::MaxIterations, SolverStatus::InsufficientProgress];

/// Both AUVs astern: either turn is possible.
fn astern() -> PlanRequest {
    let mut observation = observation(goals()[0].clone());
    observation.asc.heading_rad = (Heading::new(std::f64::consts::PI)).radians();
    observation
}

/// The plan if every solution is changed before its certification.
fn plan_spoiled(snapshot: &Snapshot, spoil: impl Fn(&mut Solution)) -> Plan {
    let mut solvers = Solvers::default();
    plan_by(snapshot, &Parameters::default(), |program| {
        let mut solution = solvers.solve(program);
        spoil(&mut solution);
        solution
    })
}

/// The plan by that solver.
fn plan_by(
    snapshot: &Snapshot,
    parameters: &Parameters,
    mut solve: impl FnMut(&Program) -> Solution,
) -> Plan {
    plan_with(snapshot, parameters, &mut Programs::default(), &mut solve)
}

/// Lets the previous plan have asked for the craft's own motion, by a command with this heading.
fn asked_for_its_motion(request: &mut PlanRequest, command: Heading, memory: Vec<f64>) {
    let (speed, asked) = (request.asc.speed_mps, request.asc.heading());
    let previous = request.previous_plan.as_mut().expect("it has one");
    previous.reference = Some(Reference { speed, heading: command }.into());
    let asked_heading_rad = asked.radians();
    previous.craft_estimate = Some(PreviousCraft { asked_speed_mps: speed, asked_heading_rad, memory });
}

fn how(answer: &Plan) -> (Method, Option<Degraded>) {
    (answer.method, answer.degraded)
}

/// The plan of a solver that solves and reports `status` instead of its own.
fn plan_with_status(snapshot: &Snapshot, status: SolverStatus) -> Plan {
    plan_spoiled(snapshot, |solution| solution.status = status)
}

#[test]
fn every_status_that_proves_nothing_leads_to_the_previous_plan() {
    let snapshot = snapshot(followed(3.0));
    let previous = snapshot.previous_plan.clone().unwrap().trajectory;
    for status in STATUSES_THAT_PROVE_NOTHING {
        let answer = plan_with_status(&snapshot, status);
        let expected = (Method::PreviousPlan, Some(Degraded::Solver(status)));
        assert_eq!(how(&answer), expected);
        // The craft's course lags a reference, which is held for a second.
        let then = snapshot.t_s + snapshot.craft_model().course_lag() + 0.5;
        let after = previous.iter().position(|point| then < point.t_s).unwrap();
        let (before, after) = (previous[after - 1], previous[after]);
        let share = (then - before.t_s) / (after.t_s - before.t_s);
        let (from, to) = (before.heading_rad, after.heading_rad);
        let asked = from + share * wrap(to - from);
        assert!((answer.trajectory[0].position() - previous[3].position()).norm() < 1e-9);
        assert!(wrap(answer.reference.heading.radians() - asked).abs() < 1e-9);
    }
}

#[test]
fn such_a_status_without_a_young_plan_leads_to_line_of_sight() {
    for observation in [observation(goals()[0].clone()), followed(10.5)] {
        let snapshot = snapshot(observation);
        let parameters = Parameters::default();
        for status in STATUSES_THAT_PROVE_NOTHING {
            let answer = plan_with_status(&snapshot, status);
            let expected = (Method::SaturatedLos, Some(Degraded::Solver(status)));
            assert_eq!(how(&answer), expected);
            let (asc, target) = (AscNow::from(&snapshot), answer.goal[0].motion());
            let course = Course::of(&target.velocity);
            let law = saturated_los(&asc, &target, course, parameters.los, snapshot.limits());
            assert_eq!(answer.reference, law);
        }
    }
}

#[test]
fn a_law_that_beats_the_previous_plan_at_speed_turns_no_faster_than_a_plan() {
    let parameters = Parameters::default();
    let answer = |surge: f64| {
        let mut observation = followed(1.0);
        observation.asc.speed_mps = surge;
        let memory = observation.previous_plan.as_mut().unwrap();
        // A plan that led away from the goal, with the craft on it.
        let away = Heading::new(observation.asc.heading().radians() + 2.5);
        let velocity = away.unit() * surge.max(0.3);
        observation.asc.heading_rad = (away).radians();
        for point in &mut memory.trajectory {
            let position = observation.asc.position() + velocity * (point.t_s - observation.t_s);
            *point = TrajectoryPoint::new(point.t_s, position, velocity.norm(), away);
        }
        let reference = Reference { speed: velocity.norm(), heading: away };
        memory.reference = Some(reference.into());
        let answer = plan_with_status(&snapshot(observation), SolverStatus::MaxTime);
        assert_eq!(answer.method, Method::SaturatedLos);
        let step = wrap(answer.reference.heading.radians() - away.radians()).abs();
        (step, answer)
    };
    let (slow_step, slow) = answer(0.5);
    assert_eq!(slow.predicted, slow.baseline.predicted);
    assert!((slow_step - Limits::MEDUSA.turn_rate_max).abs() < 1e-9, "{slow_step}");
    let (fast_step, fast) = answer(1.4);
    assert!((fast_step - parameters.heading_rate_max).abs() < 1e-9 && fast_step < slow_step);
    // Its prediction is the law's: no answer is predicted to be worse.
    assert_eq!(fast.predicted, fast.baseline.predicted);
}

#[test]
fn a_program_of_a_lesser_status_counts_only_if_its_certificate_passes() {
    let snapshot = snapshot(observation(goals()[0].clone()));
    for status in LESSER_STATUSES {
        let answer = plan_with_status(&snapshot, status);
        assert_eq!(how(&answer), (Method::Mpc, None));
        assert_eq!(answer.solver.status, status);
        let answer = plan_spoiled(&snapshot, |solution| {
            solution.primal[7] += 0.01;
            solution.status = status;
        });
        assert_eq!(answer.method, Method::SaturatedLos);
        assert!(answer.degraded.is_some());
        assert_ne!(answer.solver.status, SolverStatus::Solved);
    }
}

#[test]
fn a_solution_that_fails_its_certificate_is_not_followed_for_any_status() {
    let snapshot = snapshot(observation(goals()[0].clone()));
    let spoilers: [fn(&mut Solution); 6] = [
        // A primal variable off by 1 %.
        |solution| solution.primal[7] += 0.01,
        |solution| solution.primal[7] = f64::NAN,
        |solution| solution.primal[7] = f64::INFINITY,
        // A certificate that cannot be computed.
        |solution| solution.primal.fill(f64::NAN),
        |solution| solution.dual.fill(f64::NAN),
        |solution| solution.slack[5] = f64::NAN,
    ];
    for (k, spoil) in spoilers.into_iter().enumerate() {
        let answer = plan_spoiled(&snapshot, spoil);
        let expected = (Method::SaturatedLos, Some(Degraded::Certificate));
        assert_eq!(how(&answer), expected, "{k}");
    }
}

#[test]
fn the_first_program_takes_its_directions_from_the_previous_plan() {
    let first_program = |observation: PlanRequest| {
        let (mut solvers, mut first) = (Solvers::default(), None);
        let _ = plan_by(&snapshot(observation), &Parameters::default(), |program| {
            first.get_or_insert_with(|| program.constraints.values.clone());
            solvers.solve(program)
        });
        first.expect("a program was stated")
    };
    let mut with_plan = followed(1.0);
    // The directions alone: the expected places of AUVs count as well.
    with_plan.previous_plan.as_mut().expect("it has one").targets = None;
    let mut without = with_plan.clone();
    without.previous_plan = None;
    let with_points = |change: fn(&mut TrajectoryPoint)| {
        let mut scene = with_plan.clone();
        let previous = scene.previous_plan.as_mut().expect("it has one");
        previous.trajectory.iter_mut().for_each(change);
        scene
    };
    let turned_away = with_points(|point| point.heading_rad = wrap(point.heading_rad + 1.0));
    let of_another_mission = with_points(|point| point.north_m += 100.0);
    assert_ne!(first_program(with_plan.clone()), first_program(without.clone()));
    assert_ne!(first_program(with_plan), first_program(turned_away));
    assert_eq!(first_program(of_another_mission), first_program(without));
}

#[test]
fn a_failed_second_iteration_leaves_the_answer_of_the_first() {
    let snapshot = snapshot(observation(goals()[0].clone()));
    let only_the_first_is_solved = |scp_iterations| {
        let (mut solvers, mut calls) = (Solvers::default(), 0);
        let parameters = Parameters { scp_iterations, ..Parameters::default() };
        plan_by(&snapshot, &parameters, |program| {
            calls += 1;
            if calls == 1 { solvers.solve(program) } else { Solution::none(SolverStatus::MaxIterations) }
        })
    };
    let (answer, one_iteration) = (only_the_first_is_solved(2), only_the_first_is_solved(1));
    assert_eq!(how(&answer), (Method::Mpc, None));
    assert_eq!(answer.reference, one_iteration.reference);
}

#[test]
fn a_deadline_before_any_solved_program_is_the_reason() {
    let snapshot = snapshot(astern());
    for failure in STATUSES_THAT_PROVE_NOTHING {
        for n_failed in [0, 1] {
            let mut calls = 0;
            let answer = plan_by(&snapshot, &Parameters::default(), |_| {
                calls += 1;
                let over = SolverStatus::CallbackTerminated;
                Solution::none(if n_failed < calls { over } else { failure })
            });
            assert!(n_failed < calls, "a second way was begun");
            let expected = (Method::SaturatedLos, Some(Degraded::Deadline));
            assert_eq!(how(&answer), expected, "{n_failed} failed: {failure:?}");
        }
    }
}

#[test]
fn a_goal_with_a_stale_report_is_held_by_the_client_s_choice() {
    let mut stale = observation(goals()[0].clone());
    state(&mut stale, 0).age_s = 901.0;
    for (hold, speed, turn) in [(Hold::Stop, 0.0, 0.0), (Hold::SlowTurn, 0.05, 0.2)] {
        let answer = planned(PlanRequest { hold, ..stale.clone() });
        assert_eq!(how(&answer), (Method::Hold, Some(Degraded::StaleReport)));
        assert_eq!(answer.reference.speed, speed);
        assert_eq!(answer.reference.heading, Heading::new(0.3 + turn));
        // The trajectory follows the reference from the craft's speed.
        let last = answer.trajectory.last().expect("a trajectory has points");
        assert!((last.speed_mps - speed).abs() < 1e-3, "{}", last.speed_mps);
    }
}

#[test]
fn the_heading_offset_of_a_craft_is_taken_from_its_command() {
    let mut stale = followed(1.0);
    let mut craft = plan_with_status(&snapshot(stale.clone()), SolverStatus::Solved).craft;
    craft.heading.z = 0.1;
    let heading = stale.asc.heading();
    asked_for_its_motion(&mut stale, heading, craft.memory().to_vec());
    state(&mut stale, 0).age_s = 901.0;
    stale.hold = Hold::Stop;
    let snapshot = snapshot(stale);
    let offset = snapshot.craft_model().heading_offset;
    assert!(0.02 < offset, "{offset}");
    let answer = plan_with_status(&snapshot, SolverStatus::Solved);
    assert_eq!(how(&answer), (Method::Hold, Some(Degraded::StaleReport)));
    let command = answer.reference.heading.radians();
    assert!(wrap(command - (heading.radians() - offset)).abs() < 1e-9);
}

#[test]
fn a_stale_report_of_an_auv_outside_the_goal_changes_nothing() {
    let mut stale = observation(goals()[0].clone());
    state(&mut stale, 1).age_s = 3600.0;
    assert_eq!(plan_with_status(&snapshot(stale), SolverStatus::Solved).method, Method::Mpc);
}

#[test]
fn a_previous_plan_from_the_future_is_not_followed() {
    let mut odd = followed(3.0);
    let point = |t_s| TrajectoryPoint { t_s, ..odd.previous_plan.clone().unwrap().trajectory[0] };
    let trajectory = vec![point(300.0), point(301.0)];
    odd.previous_plan = Some(PreviousPlan { trajectory, ..PreviousPlan::default() });
    assert_eq!(plan_with_status(&snapshot(odd), SolverStatus::MaxTime).method, Method::SaturatedLos);
}

#[test]
fn a_plan_begins_at_its_snapshot_and_is_valid_for_ten_seconds() {
    for goal in goals() {
        let snapshot = snapshot(observation(goal));
        let answer = plan_with_status(&snapshot, SolverStatus::Solved);
        let trajectory: Vec<f64> = answer.trajectory.iter().map(|point| point.t_s).collect();
        let goal: Vec<f64> = answer.goal.iter().map(|point| point.t_s).collect();
        assert_eq!((trajectory[0], &trajectory), (200.0, &goal));
        assert_eq!(answer.valid_until, 210.0);
        // This craft's loops hold heading and speed through the water.
        let (command, asked) = (answer.reference, answer.reference_through_water);
        assert!(wrap(command.heading.radians() - asked.heading.radians()).abs() < 1e-9);
    }
}

#[test]
fn the_distance_from_the_goal_counts_as_the_planner_s() {
    let answer = plan_with_status(&snapshot(followed(1.0)), SolverStatus::Solved);
    let goal = answer.goal[0].motion().position;
    let square = (goal - answer.trajectory[0].position()).norm_squared();
    // A first-order mean over half a minute, after a second.
    let mean = (1.0 - (-1.0_f64 / 30.0).exp()) * square;
    assert!((answer.craft.realised.planner - mean).abs() < 1e-9 * mean);
}

#[test]
fn the_law_steers_while_it_is_on_trial_and_does_not_for_a_stale_report() {
    let mut on_trial = followed(1.0);
    let mut craft = plan_with_status(&snapshot(on_trial.clone()), SolverStatus::Solved).craft;
    (craft.monitor.alarm, craft.monitor.statistic) = (true, 100.0);
    craft.realised.law_steers = true;
    let heading = on_trial.asc.heading();
    asked_for_its_motion(&mut on_trial, heading, craft.memory().to_vec());
    let answer = plan_with_status(&snapshot(on_trial.clone()), SolverStatus::Solved);
    assert_eq!(how(&answer), (Method::SaturatedLos, None));
    state(&mut on_trial, 0).age_s = 901.0;
    let answer = planned(on_trial);
    assert_eq!(how(&answer), (Method::Hold, Some(Degraded::StaleReport)));
}

#[test]
fn a_goal_at_rest_keeps_its_last_course() {
    let mut at_rest = followed(1.0);
    state(&mut at_rest, 0).speed_mps = 0.0;
    for course in [2.0, -1.0] {
        let previous = at_rest.previous_plan.as_mut().expect("it has one");
        previous.goal_course_rad = Some(course);
        let answer = planned(at_rest.clone());
        assert!(wrap(answer.goal_course.radians() - course).abs() < 1e-9);
    }
}

#[test]
fn a_command_that_is_held_back_is_the_same_through_the_water() {
    let mut observation = followed(1.0);
    let heading = observation.asc.heading();
    asked_for_its_motion(&mut observation, Heading::new(heading.radians() + 1.0), vec![]);
    let answer = plan_with_status(&snapshot(observation), SolverStatus::Solved);
    let (command, asked) = (answer.reference.heading, answer.reference_through_water.heading);
    assert!(0.5 < wrap(command.radians() - heading.radians()));
    assert!(wrap(command.radians() - asked.radians()).abs() < 1e-9);
}

#[test]
fn a_continued_plan_asks_for_its_speed_of_the_next_seconds() {
    let answer = |faster_at: fn(f64) -> f64| {
        let mut observation = followed(3.0);
        let now = observation.t_s;
        let previous = observation.previous_plan.as_mut().expect("it has one");
        for point in &mut previous.trajectory {
            point.speed_mps += faster_at(point.t_s - now);
        }
        let answer = plan_with_status(&snapshot(observation), SolverStatus::MaxTime);
        assert_eq!(answer.method, Method::PreviousPlan);
        answer.reference.speed
    };
    let of_then = answer(|_| 0.0);
    assert_eq!(answer(|later| if later < 0.5 { -0.01 } else { 0.0 }), of_then);
    assert_eq!(answer(|later| if 10.5 < later { 0.01 } else { 0.0 }), of_then);
    assert!(of_then < answer(|_| 0.01));
}
