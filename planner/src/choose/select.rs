//! Fallback levels and their selection: every snapshot has an answer.
//!
//! Solved program → continued previous plan → saturated line of sight → hold.

use crate::{
    choose::answer::{Baseline, GoalPoint, Method, Plan, PlannedTarget},
    craft::{
        estimate::CraftEstimate,
        response::{HALF_HOLD, Rollout, Stage},
    },
    facts::{
        angle::{Course, Heading, angle_of, wrap},
        asc::AscNow,
        options::Hold,
        previous_plan::PreviousPlan,
        reference::Reference,
        schedule::Schedule,
        water::Current,
    },
    los::{
        law::{LosLaw, LosTuning},
        saturated::saturated_los,
        tracking_law::TrackingLaw,
    },
    predict::{
        forecast::AuvForecast,
        goal::{GoalForecast, forecast_all},
    },
    problem::{frame::SPEED_WITHOUT_DIRECTION, horizon::Horizon, parameters::Parameters},
    program::build::Program,
    scp::{
        follower::{follow, invert_response, slew_limited, speed_lead, stage_at},
        iterations::Scp,
        predicted_cost::predict,
        result::{CandidateTrajectory, Degraded, ScpResult, SolverReport},
    },
    snapshot::build::Snapshot,
    solve::{by_shape::ByShape, clarabel::Solution, stop::Stop},
    visit::schedule::Scheduler,
};

/// Difference of equal predicted costs, m² s; the solver's tolerance leaves 10⁻¹² m² s above the
/// goal.
const COST_TIE: f64 = 1e-6;

/// Lead of a slow turn's heading reference, rad, to starboard.
const SLOW_TURN_LEAD: f64 = 0.2;

/// Offer of one fallback level.
#[derive(Clone)]
struct Level {
    method: Method,
    reference: Reference,
    candidate: CandidateTrajectory,
}

/// Plans for `snapshot`: the available fallback level of least predicted cost answers.
pub(crate) fn select_answer(
    snapshot: &Snapshot,
    parameters: &Parameters,
    programs: &mut ByShape<Program>,
    stop: &Stop,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    let parameters = &*parameters.of(snapshot);
    // 1. The problem: goal and craft on the grid.
    let (goal, schedule) = scheduled_goal(snapshot, parameters, remembered_course(snapshot), stop);
    let cut_short = cut_short(snapshot, schedule.as_ref(), stop);
    let horizon = Horizon::new(snapshot, parameters, &goal);
    // 2. The law: baseline, initial guess and fallback.
    let los_rollout = horizon.line_of_sight(snapshot, &goal, tuning(LosLaw::SaturatedLos, parameters));
    let law = saturated_los(
        &AscNow::from(snapshot),
        &goal.at(0.0),
        horizon.goal_course,
        parameters.los,
        snapshot.limits(),
    );
    let los = Level {
        method: Method::SaturatedLos,
        reference: law,
        candidate: rolled_out(&horizon, los_rollout.stages.clone(), &los_rollout),
    };
    // 3. The program, unless the goal depends on a report that is too old.
    let stale = |auv: usize| parameters.is_stale(&snapshot.estimates()[auv]);
    let scp = if goal.needs_now().any(stale) {
        ScpResult::none(Degraded::StaleReport)
    } else if snapshot.cut_short() {
        ScpResult::none(Degraded::Deadline)
    } else {
        let mut scp = Scp {
            snapshot,
            parameters,
            horizon: &horizon,
            goal: &goal,
            stop,
            solve,
            programs,
        };
        scp.run(&los_rollout, los.candidate.predicted.cost)
    };
    // 4. The level that answers.
    let distance = (goal.at(0.0).position - snapshot.asc.position()).norm();
    let craft = answered(snapshot, distance);
    let best = if craft.realised.law_steers && scp.degraded != Some(Degraded::StaleReport) {
        steered(los.clone(), snapshot, parameters, &horizon)
    } else {
        best_level(snapshot, parameters, &horizon, &scp, &los)
    };
    // 5. The answer.
    let (command, through_water) = commanded(best.reference, snapshot);
    let broken_by_program = (best.method == Method::Mpc).then_some(scp.violations);
    let violations = best.candidate.violations.into_iter();
    let times = || horizon.times.iter();
    let covariances = |auv: &AuvForecast| times().map(|time| auv.position_covariance(*time)).collect();
    Plan {
        method: best.method,
        current: snapshot.known_current().map(Current::from),
        craft,
        degraded: scp.degraded,
        reference: command,
        reference_through_water: through_water,
        valid_until: snapshot.t_s + parameters.validity.min(parameters.steps.iter().sum()),
        trajectory: horizon.trajectory(&best.candidate.stages).collect(),
        goal: times()
            .map(|time| GoalPoint::new(snapshot.t_s + time, goal.at(*time)))
            .collect(),
        goal_course: goal.course(),
        targets: PlannedTarget::all(snapshot, &horizon.times, goal.auvs()),
        position_covariances: goal.auvs().iter().map(covariances).collect(),
        baseline: Baseline {
            degraded: cut_short,
            reference: snapshot.command(&law),
            trajectory: horizon.trajectory(&los.candidate.stages).collect(),
            predicted: los.candidate.predicted,
            cost_terms: los.candidate.terms,
            violations: los.candidate.violations.into_iter().flatten().collect(),
        },
        solver: SolverReport {
            deadline_hit: stop.was_due() || snapshot.cut_short(),
            ..scp.report
        },
        predicted: best.candidate.predicted,
        cost_terms: best.candidate.terms,
        violations: violations
            .chain(broken_by_program.into_iter().flatten())
            .flatten()
            .collect(),
        range_unattainable: horizon.constraints.range_unattainable,
        schedule,
    }
}

/// The goal of `snapshot`, and its schedule if it visits AUVs; `held` as in
/// [`GoalForecast::holding`].
#[must_use]
pub fn scheduled_goal(
    snapshot: &Snapshot,
    parameters: &Parameters,
    held: Option<Course>,
    stop: &Stop,
) -> (GoalForecast, Option<Schedule>) {
    let auvs = forecast_all(snapshot);
    let planned = parameters.planned(snapshot.craft_model()).limits;
    let scheduler = Scheduler {
        parameters: &parameters.scheduling,
        speed: planned.speed_max,
        turn_rate: planned.turn_rate_max,
        report_age_max: parameters.report_age_max,
        due: &|| stop.is_due(),
    };
    let scheduled = scheduler.schedule(snapshot, &auvs);
    let turns = scheduled.as_ref().map_or(&[][..], |scheduled| &scheduled.turns);
    let goal = GoalForecast::scheduled(snapshot, auvs, held, turns);
    (goal, scheduled.map(|scheduled| scheduled.schedule))
}

/// The reason, if the deadline cut the estimates or the schedule short, which all laws need.
fn cut_short(snapshot: &Snapshot, schedule: Option<&Schedule>, stop: &Stop) -> Option<Degraded> {
    let is_cut = snapshot.cut_short() || (schedule.is_some() && stop.was_due());
    is_cut.then_some(Degraded::Deadline)
}

fn remembered_course(snapshot: &Snapshot) -> Option<Course> {
    snapshot
        .previous_plan
        .as_ref()
        .and_then(PreviousPlan::goal_course)
}

/// The command for `asked`, and its effect through the water.
fn commanded(asked: Reference, snapshot: &Snapshot) -> (Reference, Reference) {
    let asked = snapshot.within_speed_max(&without_heading_offset(asked, snapshot));
    let command = snapshot.slew_limited_command(&asked);
    let held_back = wrap(command.heading.radians() - snapshot.command(&asked).heading.radians());
    let through_water = Reference {
        heading: Heading::new(asked.heading.radians() + held_back),
        ..asked
    };
    (command, through_water)
}

/// The reference corrected by the craft's heading offset.
fn without_heading_offset(asked: Reference, snapshot: &Snapshot) -> Reference {
    Reference {
        heading: Heading::new(asked.heading.radians() - snapshot.craft_model().heading_offset),
        ..asked
    }
}

/// The level that answers; the first of equals.
fn best_level(
    snapshot: &Snapshot,
    parameters: &Parameters,
    horizon: &Horizon<'_>,
    scp: &ScpResult,
    los: &Level,
) -> Level {
    if scp.degraded == Some(Degraded::StaleReport) {
        return hold(snapshot, horizon);
    }
    let planned = scp
        .candidate
        .as_ref()
        .map(|candidate| planned(horizon, candidate.clone(), snapshot, parameters));
    let levels = [
        planned,
        previous_plan(snapshot, parameters, horizon),
        Some(los.clone()),
    ];
    let cost = |level: &Level| level.candidate.predicted.cost;
    let best = levels.into_iter().flatten().reduce(|best, next| {
        if parameters.cost_decides && cost(&next) + COST_TIE < cost(&best) {
            next
        } else {
            best
        }
    });
    let best = best.expect("line of sight is always there");
    steered(best, snapshot, parameters, horizon)
}

/// The estimate of the craft, updated with its present `distance` from the goal, m.
fn answered(snapshot: &Snapshot, distance: f64) -> CraftEstimate {
    let estimate = *snapshot.craft_estimate();
    let previous = snapshot.previous_plan.as_ref();
    let elapsed = previous
        .and_then(|previous| Some(snapshot.t_s - previous.trajectory.first()?.t_s))
        .map_or(0.0, |elapsed| elapsed.clamp(0.0, 10.0));
    CraftEstimate {
        realised: estimate.realised.after(distance, elapsed, estimate.monitor.alarm),
        ..estimate
    }
}

/// A level with its heading reference limited: the law's turns no faster than the craft, and at
/// speed no faster than a plan's. Its prediction stays the law's.
///
/// In a hard turn at full speed, saturated thrusters achieve neither, and the heading swings for 10
/// s. From rest the law may turn as fast as the craft can; see `docs/rationale.md#references`.
fn steered(level: Level, snapshot: &Snapshot, parameters: &Parameters, horizon: &Horizon<'_>) -> Level {
    if level.method != Method::SaturatedLos {
        return level;
    }
    let craft = snapshot.craft_model();
    let planned = parameters.planned(craft).limits;
    let at_speed = parameters.hard_turn_share * planned.speed_max < snapshot.asc.speed_mps;
    let rate = if at_speed {
        planned.turn_rate_max
    } else {
        craft.limits.turn_rate_max
    };
    Level {
        reference: slew_limited(level.reference, snapshot, horizon, rate),
        ..level
    }
}

/// Answers of all laws without memory. All have the same goal: a schedule is expensive.
pub(crate) fn baselines_of_all(
    snapshot: &Snapshot,
    parameters: &Parameters,
    stop: &Stop,
) -> [Baseline; LosLaw::ALL.len()] {
    let parameters = &*parameters.of(snapshot);
    let (goal, schedule) = scheduled_goal(snapshot, parameters, remembered_course(snapshot), stop);
    let degraded = cut_short(snapshot, schedule.as_ref(), stop);
    let horizon = Horizon::new(snapshot, parameters, &goal);
    LosLaw::ALL.map(|law| {
        let tuning = tuning(law, parameters);
        let rollout = horizon.line_of_sight(snapshot, &goal, tuning);
        let mut tracking = TrackingLaw::new(tuning, Some(horizon.goal_course));
        let through_water = tracking.steer(0.0, &AscNow::from(snapshot), &goal.at(0.0), snapshot.limits());
        Baseline {
            degraded,
            ..rolled_out_baseline(snapshot, &horizon, &rollout, &through_water)
        }
    })
}

/// The answer of `law` with its memory.
pub(crate) fn baseline_from_memory(
    snapshot: &Snapshot,
    parameters: &Parameters,
    law: &TrackingLaw,
    stop: &Stop,
) -> Baseline {
    let parameters = &*parameters.of(snapshot);
    let (goal, _) = scheduled_goal(snapshot, parameters, remembered_course(snapshot), stop);
    let horizon = Horizon::new(snapshot, parameters, &goal);
    let rollout = horizon.line_of_sight_with_memory(snapshot, &goal, law.clone());
    let asc = AscNow::from(snapshot);
    let through_water = law
        .clone()
        .steer(snapshot.t_s, &asc, &goal.at(0.0), snapshot.limits());
    rolled_out_baseline(snapshot, &horizon, &rollout, &through_water)
}

fn rolled_out_baseline(
    snapshot: &Snapshot,
    horizon: &Horizon<'_>,
    rollout: &Rollout,
    through_water: &Reference,
) -> Baseline {
    let (predicted, cost_terms, violations) = predict(horizon, rollout, &horizon.weights);
    Baseline {
        degraded: None,
        reference: snapshot.command(through_water),
        trajectory: horizon.trajectory(&rollout.stages).collect(),
        predicted,
        cost_terms,
        violations: violations.into_iter().flatten().collect(),
    }
}

fn tuning(law: LosLaw, parameters: &Parameters) -> LosTuning {
    LosTuning {
        law,
        gains: parameters.los,
        integral_gain: parameters.integral_gain,
    }
}

/// The program's level.
fn planned(
    horizon: &Horizon<'_>,
    candidate: CandidateTrajectory,
    snapshot: &Snapshot,
    parameters: &Parameters,
) -> Level {
    let next = horizon.trajectory(&candidate.stages).nth(1);
    let next = next.expect("a horizon has an interval");
    let surge = horizon.start.velocity.x;
    let craft = parameters.planned(snapshot.craft_model());
    let lead = craft.course_lag() + HALF_HOLD;
    let later = stage_at(horizon, &candidate.stages, 0, lead).velocity;
    let next = Reference {
        heading: if later.norm() < SPEED_WITHOUT_DIRECTION {
            next.heading()
        } else {
            Heading::new(snapshot.asc.heading().radians() + angle_of(&later))
        },
        speed: stage_at(horizon, &candidate.stages, 0, speed_lead(&craft))
            .velocity
            .norm(),
    };
    let asked = invert_response(surge, &next, craft.surge_disturbance, &craft);
    Level {
        method: Method::Mpc,
        reference: slew_limited(asked, snapshot, horizon, craft.limits.turn_rate_max),
        candidate,
    }
}

/// The previous plan, continued: its trajectory from now, held at its end.
fn previous_plan(snapshot: &Snapshot, parameters: &Parameters, horizon: &Horizon<'_>) -> Option<Level> {
    let previous = horizon.previous.as_ref()?;
    let stages = horizon.stages_along(previous);
    let rollout = follow(horizon, &stages, snapshot, parameters);
    let craft = parameters.planned(snapshot.craft_model());
    let lead = craft.course_lag() + HALF_HOLD;
    let next = Reference {
        heading: previous.at(snapshot.t_s + lead).heading(),
        speed: previous.at(snapshot.t_s + speed_lead(&craft)).speed_mps,
    };
    let surge = horizon.start.velocity.x;
    let asked = invert_response(surge, &next, craft.surge_disturbance, &craft);
    Some(Level {
        method: Method::PreviousPlan,
        reference: slew_limited(asked, snapshot, horizon, craft.limits.turn_rate_max),
        candidate: rolled_out(horizon, stages, &rollout),
    })
}

/// The candidate of `stages` with the prediction of `rollout`.
fn rolled_out(horizon: &Horizon<'_>, stages: Vec<Stage>, rollout: &Rollout) -> CandidateTrajectory {
    let (predicted, terms, violations) = predict(horizon, rollout, &horizon.weights);
    CandidateTrajectory {
        stages,
        predicted,
        terms,
        violations,
    }
}

/// The last level: a slow turn or a stop, as the client chose.
fn hold(snapshot: &Snapshot, horizon: &Horizon<'_>) -> Level {
    let law = |heading: Heading| match snapshot.hold {
        Hold::Stop => Reference { speed: 0.0, heading },
        Hold::SlowTurn => Reference {
            speed: snapshot.limits().speed_min,
            heading: Heading::new(heading.radians() + SLOW_TURN_LEAD),
        },
    };
    let rollout = horizon.roll_out(snapshot.craft_model(), |_, asc, _| law(asc.heading));
    Level {
        method: Method::Hold,
        reference: law(snapshot.asc.heading()),
        candidate: rolled_out(horizon, rollout.stages.clone(), &rollout),
    }
}
