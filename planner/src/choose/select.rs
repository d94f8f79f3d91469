//! Fallback levels and their selection: every snapshot has an answer.
//!
//! Solved program → continued previous plan → saturated line of sight → hold.

use crate::{
    avoid::choose::Avoider,
    choose::{
        answer::{Baseline, GoalPoint, Method, Plan, PlannedTarget},
        beside,
        round_land::{clearance, led_round},
    },
    craft::{
        estimate::CraftEstimate,
        monitor::Trial,
        response::{HALF_HOLD, Rollout},
    },
    facts::{
        angle::{Course, Heading, angle_of, wrap},
        asc::AscNow,
        options::Hold,
        path::curve::Side,
        previous_plan::PreviousPlan,
        reference::Reference,
        schedule::Schedule,
        water::Current,
    },
    localise::choose::Localiser,
    los::{
        law::{LosGains, LosLaw, LosTuning},
        saturated::saturated_los,
        tracking_law::TrackingLaw,
    },
    predict::{
        forecast::AuvForecast,
        goal::{GoalForecast, forecast_all},
        motion::Motion,
    },
    problem::{frame::SPEED_WITHOUT_DIRECTION, horizon::Horizon, parameters::Parameters},
    program::build::Program,
    scp::{
        follower::{follow, invert_response, slew_limited, speed_lead, stage_at},
        iterations::Scp,
        predicted_cost::Predicted,
        result::{CandidateTrajectory, Degraded, ScpResult, SolverReport},
    },
    snapshot::build::Snapshot,
    solve::{by_shape::ByShape, clarabel::Solution, stop::Stop},
    visit::schedule::Scheduler,
};

/// Difference of equal predicted costs, m² s; the solver's tolerance leaves 10⁻¹² above the goal.
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
    let (los, los_rollout) = line_of_sight(&horizon, parameters.los);
    // 3. The law that was nearer than the planner, which then plans for its simulated craft.
    let trial = beside::resumed(&horizon);
    let nearer = trial.real().checked_sub(1).map(|k| line_of_sight(&horizon, beside::gains(k, &horizon)).0);
    let nearer = nearer.filter(|law| law.candidate.violations.iter().all(Option::is_none));
    let is_lawful = trial.real() == 0 || nearer.is_some();
    let simulated = nearer.as_ref().map(|_| beside::of_planner(&trial, snapshot));
    let simulated = simulated.as_ref().map(|snapshot| Horizon::new(snapshot, parameters, &goal));
    let simulated = simulated.as_ref().map(|horizon| (horizon, line_of_sight(horizon, parameters.los)));
    let (sailed, (planner_los, guess)) = simulated.unwrap_or((&horizon, (los.clone(), los_rollout)));
    // 4. The program, unless the goal depends on a report that is too old.
    let stale = |auv: usize| parameters.is_stale(&snapshot.estimates()[auv]);
    let mut program = Scp { horizon: sailed, stop, solve, programs };
    let scp = if snapshot.stands_by() {
        ScpResult { degraded: None, ..ScpResult::none(Degraded::Deadline) }
    } else if goal.needs_now().any(stale) {
        ScpResult::none(Degraded::StaleReport)
    } else if snapshot.cut_short() {
        ScpResult::none(Degraded::Deadline)
    } else {
        program.run(&guess, planner_los.candidate.predicted.cost)
    };
    // 5. The level that answers.
    let distance = (goal.at(0.0).position - snapshot.asc.position()).norm();
    let distance = if snapshot.stands_by() { 0.0 } else { distance };
    let mut craft = answered(snapshot, distance);
    let is_held = snapshot.stands_by() || scp.degraded == Some(Degraded::StaleReport);
    let planned = best_level(sailed, &scp, &planner_los);
    let asked_of_planner = planned.reference;
    let best = match nearer {
        _ if is_held => hold(&horizon),
        _ if craft.realised.law_steers => steered(los.clone(), &horizon),
        Some(law) => steered(law, &horizon),
        None => planned,
    };
    // A law that would violate a limit does not steer, and is on trial again.
    let trial = if is_lawful { trial } else { Trial::new(craft.heading.x, craft.surge.x) };
    craft.trial = beside::asked(trial, &horizon, asked_of_planner, best.reference);
    // 6. The answer.
    // A craft that stands by has no goal but where it is.
    let here = |time: f64| Motion {
        position: snapshot.asc.position() + snapshot.current() * time,
        velocity: snapshot.current(),
    };
    let goal_at = |time: f64| if snapshot.stands_by() { here(time) } else { goal.at(time) };
    let (command, through_water) = commanded(best.reference, snapshot);
    let by_program = (best.method == Method::Mpc).then_some(scp.violations);
    let violations = best.candidate.violations.into_iter();
    let violations = violations.chain(by_program.into_iter().flatten()).flatten();
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
        goal: times().map(|time| GoalPoint::new(snapshot.t_s + time, goal_at(*time))).collect(),
        goal_course: goal.course(),
        targets: PlannedTarget::all(snapshot, &horizon.times, goal.auvs()),
        position_covariances: goal.auvs().iter().map(covariances).collect(),
        baseline: baseline(&horizon, &los.reference, &los.candidate, cut_short),
        solver: SolverReport { deadline_hit: stop.was_due() || snapshot.cut_short(), ..scp.report },
        predicted: if snapshot.stands_by() { Predicted::default() } else { best.candidate.predicted },
        cost_terms: best.candidate.terms,
        violations: violations.collect(),
        range_unattainable: horizon.constraints.range_unattainable,
        schedule,
        figure: goal.figure().cloned(),
        avoidance: goal.avoidance().map(|known| if is_held { known.held() } else { known.clone() }),
        goal_in_no_go: snapshot.no_go_at(&goal.wanted(0.0).position),
        goal_is_reachable: goal.is_reachable(),
    }
}

/// The goal of `snapshot`, on a figure or by a schedule; `held` as in [`GoalForecast::holding`].
pub fn scheduled_goal(
    snapshot: &Snapshot,
    parameters: &Parameters,
    held: Option<Course>,
    stop: &Stop,
) -> (GoalForecast, Option<Schedule>) {
    let auvs = forecast_all(snapshot);
    let due = || stop.is_due();
    let planned = parameters.planned(snapshot.craft_model()).limits;
    let scheduled = scheduler(snapshot, parameters, &due).schedule(snapshot, &auvs);
    let turns = scheduled.as_ref().map_or(&[][..], |scheduled| &scheduled.turns);
    let localiser = Localiser {
        speed: planned.speed_max,
        turn_rate: planned.turn_rate_max,
        clearance: clearance(snapshot, parameters),
        fixed: parameters.figure,
        is_stale: &|auv| parameters.is_stale(&snapshot.estimates()[auv]),
        due: &due,
    };
    let visited = scheduled.as_ref().and_then(|scheduled| scheduled.visited(snapshot));
    let figure = localiser.figure(snapshot, &auvs, visited);
    let mut goal = GoalForecast::scheduled(snapshot, auvs, held, turns);
    if let Some((figure, auvs)) = figure {
        goal = goal.on_figure(figure, &auvs);
    }
    let mut goal = led_round(goal, snapshot, parameters, stop);
    let avoider = Avoider { craft: parameters.planned(snapshot.craft_model()), due: &due };
    if let Some(kept) = avoider.avoid(snapshot, &goal) {
        goal = goal.clear_of(kept.vessels, kept.avoidance);
        if let Some(way) = kept.way {
            goal = goal.by_way_of(way);
        }
    }
    (goal, scheduled.map(|scheduled| scheduled.schedule))
}

pub(crate) fn scheduler<'a>(
    snapshot: &Snapshot,
    parameters: &'a Parameters,
    due: &'a dyn Fn() -> bool,
) -> Scheduler<'a> {
    let planned = parameters.planned(snapshot.craft_model()).limits;
    Scheduler {
        parameters: &parameters.scheduling,
        speed: planned.speed_max,
        turn_rate: planned.turn_rate_max,
        report_age_max: parameters.report_age_max,
        clearance: clearance(snapshot, parameters),
        due,
    }
}

/// The reason, if the deadline cut the estimates or the schedule short, which all laws need.
fn cut_short(snapshot: &Snapshot, schedule: Option<&Schedule>, stop: &Stop) -> Option<Degraded> {
    let is_cut = snapshot.cut_short() || (schedule.is_some() && stop.was_due());
    is_cut.then_some(Degraded::Deadline)
}

fn remembered_course(snapshot: &Snapshot) -> Option<Course> {
    snapshot.previous_plan.as_ref().and_then(PreviousPlan::goal_course)
}

fn commanded(asked: Reference, snapshot: &Snapshot) -> (Reference, Reference) {
    let heading = Heading::new(asked.heading.radians() - snapshot.craft_model().heading_offset);
    let asked = snapshot.within_speed_max(&Reference { heading, ..asked });
    let command = snapshot.slew_limited_command(&asked);
    let held_back = wrap(command.heading.radians() - snapshot.command(&asked).heading.radians());
    let through_water = Reference { heading: Heading::new(asked.heading.radians() + held_back), ..asked };
    (command, through_water)
}

/// The level that answers; the first of equals.
fn best_level(horizon: &Horizon<'_>, scp: &ScpResult, los: &Level) -> Level {
    if horizon.snapshot.stands_by() || scp.degraded == Some(Degraded::StaleReport) {
        return hold(horizon);
    }
    let planned = scp.candidate.clone().map(|candidate| planned(horizon, candidate));
    let [to_port, to_starboard] = turned_slowly(horizon);
    let levels = [planned, previous_plan(horizon), Some(los.clone()), to_port, to_starboard];
    let cost = |level: &Level| level.candidate.predicted.cost;
    let best = levels.into_iter().flatten().reduce(|best, next| {
        if horizon.parameters.cost_decides && cost(&next) + COST_TIE < cost(&best) { next } else { best }
    });
    let best = best.expect("line of sight is always there");
    steered(best, horizon)
}

/// Line of sight after a slow turn to either side, if the law's turn may lead into near land.
fn turned_slowly(horizon: &Horizon<'_>) -> [Option<Level>; 2] {
    let bow = horizon.snapshot.asc.heading().radians();
    Side::BOTH.map(|side| {
        let (reference, rollout) = horizon.is_hemmed_in().then(|| horizon.turning_slowly(side))?;
        Some(Level {
            method: Method::SaturatedLos,
            reference: Reference { heading: Heading::new(bow + reference.heading.radians()), ..reference },
            candidate: rolled_out(horizon, &rollout),
        })
    })
}

/// The estimate of the craft, updated with its present `distance` from the goal, m.
fn answered(snapshot: &Snapshot, distance: f64) -> CraftEstimate {
    let estimate = *snapshot.craft_estimate();
    let previous = snapshot.previous_plan.as_ref();
    let made_at = previous.and_then(PreviousPlan::made_at);
    let elapsed = made_at.map_or(0.0, |made_at| (snapshot.t_s - made_at).clamp(0.0, 10.0));
    let (alarm, tuned) = (estimate.monitor.alarm, &snapshot.tuned().craft);
    CraftEstimate { realised: estimate.realised.after(distance, elapsed, alarm, tuned), ..estimate }
}

/// A level whose heading reference turns no faster than the craft, or at speed than a plan's.
///
/// In a hard turn at full speed, saturated thrusters achieve neither, and the heading swings for 10
/// s. From rest the law may turn as fast as the craft can; see `docs/rationale.md#references`.
fn steered(level: Level, horizon: &Horizon<'_>) -> Level {
    if level.method != Method::SaturatedLos {
        return level;
    }
    let (snapshot, planned) = (horizon.snapshot, &horizon.craft.limits);
    let at_speed = horizon.parameters.hard_turn_share * planned.speed_max < snapshot.asc.speed_mps;
    let rate = if at_speed { planned.turn_rate_max } else { snapshot.craft_model().limits.turn_rate_max };
    Level { reference: slew_limited(level.reference, horizon, rate), ..level }
}

/// The answers of all line-of-sight laws for `snapshot` with the gains in `parameters`:
/// [`Plan::baseline`] for each of [`LosLaw::ALL`]. If `stop` cuts their schedule short,
/// [`Baseline::degraded`] says so. All have the same goal: a schedule is expensive.
///
/// The laws start without memory: an integral at zero, a box from one fix.
pub fn baselines(snapshot: &Snapshot, parameters: &Parameters, stop: &Stop) -> [Baseline; LosLaw::ALL.len()] {
    let parameters = &*parameters.of(snapshot);
    let (goal, schedule) = scheduled_goal(snapshot, parameters, remembered_course(snapshot), stop);
    let degraded = cut_short(snapshot, schedule.as_ref(), stop);
    let horizon = Horizon::new(snapshot, parameters, &goal);
    LosLaw::ALL.map(|law| {
        let tuning = tuning(law, parameters);
        let candidate = rolled_out(&horizon, &horizon.line_of_sight(tuning));
        let mut tracking = TrackingLaw::new(tuning, Some(horizon.goal_course));
        let through_water = tracking.steer(0.0, &AscNow::from(snapshot), &goal.at(0.0), snapshot.limits());
        baseline(&horizon, &through_water, &candidate, degraded)
    })
}

/// The baseline of a running law, with its gains and its memory of earlier positions and times.
pub fn baseline_from(
    snapshot: &Snapshot,
    parameters: &Parameters,
    law: &TrackingLaw,
    stop: &Stop,
) -> Baseline {
    let parameters = &*parameters.of(snapshot);
    let (goal, _) = scheduled_goal(snapshot, parameters, remembered_course(snapshot), stop);
    let horizon = Horizon::new(snapshot, parameters, &goal);
    let rollout = horizon.line_of_sight_with_memory(law.clone());
    let asc = AscNow::from(snapshot);
    let through_water = law.clone().steer(snapshot.t_s, &asc, &goal.at(0.0), snapshot.limits());
    baseline(&horizon, &through_water, &rolled_out(&horizon, &rollout), None)
}

/// The answer of a law with its reference through the water and its `candidate`.
fn baseline(
    horizon: &Horizon<'_>,
    through_water: &Reference,
    candidate: &CandidateTrajectory,
    degraded: Option<Degraded>,
) -> Baseline {
    Baseline {
        degraded,
        reference: horizon.snapshot.command(through_water),
        trajectory: horizon.trajectory(&candidate.stages).collect(),
        predicted: candidate.predicted,
        cost_terms: candidate.terms,
        violations: candidate.violations.into_iter().flatten().collect(),
    }
}

fn tuning(law: LosLaw, parameters: &Parameters) -> LosTuning {
    LosTuning { law, gains: parameters.los, integral_gain: parameters.integral_gain }
}

/// The law's level, and its rollout, which is also an initial guess.
fn line_of_sight(horizon: &Horizon<'_>, gains: LosGains) -> (Level, Rollout) {
    let (snapshot, parameters) = (horizon.snapshot, horizon.parameters);
    let rollout = horizon.line_of_sight(LosTuning { gains, ..tuning(LosLaw::SaturatedLos, parameters) });
    let (asc, goal) = (AscNow::from(snapshot), horizon.forecast.at(0.0));
    let level = Level {
        method: Method::SaturatedLos,
        reference: saturated_los(&asc, &goal, horizon.goal_course, gains, snapshot.limits()),
        candidate: rolled_out(horizon, &rollout),
    };
    (level, rollout)
}

fn planned(horizon: &Horizon<'_>, candidate: CandidateTrajectory) -> Level {
    let next = horizon.trajectory(&candidate.stages).nth(1);
    let next = next.expect("a horizon has an interval");
    let velocity_at = |lead| stage_at(horizon, &candidate.stages, 0, lead).velocity;
    let later = velocity_at(horizon.craft.course_lag() + HALF_HOLD);
    let next = Reference {
        heading: if later.norm() < SPEED_WITHOUT_DIRECTION {
            next.heading()
        } else {
            Heading::new(horizon.snapshot.asc.heading().radians() + angle_of(&later))
        },
        speed: velocity_at(speed_lead(&horizon.craft)).norm(),
    };
    Level { method: Method::Mpc, reference: towards(&next, horizon), candidate }
}

/// The previous plan, continued: its trajectory from now, held at its end.
fn previous_plan(horizon: &Horizon<'_>) -> Option<Level> {
    let previous = horizon.previous.as_ref()?;
    let stages = horizon.stages_along(previous);
    let rollout = follow(horizon, &stages);
    let (now, craft) = (horizon.snapshot.t_s, &horizon.craft);
    let next = Reference {
        heading: previous.at(now + (craft.course_lag() + HALF_HOLD)).heading(),
        speed: previous.at(now + speed_lead(craft)).speed_mps,
    };
    Some(Level {
        method: Method::PreviousPlan,
        reference: towards(&next, horizon),
        candidate: CandidateTrajectory::new(horizon, stages, &rollout),
    })
}

/// The reference by which the craft moves as `next`.
fn towards(next: &Reference, horizon: &Horizon<'_>) -> Reference {
    let craft = &horizon.craft;
    let asked = invert_response(horizon.start.velocity.x, next, craft.surge_disturbance, craft);
    slew_limited(asked, horizon, craft.limits.turn_rate_max)
}

fn rolled_out(horizon: &Horizon<'_>, rollout: &Rollout) -> CandidateTrajectory {
    CandidateTrajectory::new(horizon, rollout.stages.clone(), rollout)
}

/// The last level: a slow turn or a stop, as the client chose.
fn hold(horizon: &Horizon<'_>) -> Level {
    let snapshot = horizon.snapshot;
    let law = |heading: Heading| match snapshot.hold {
        _ if snapshot.stands_by() => Reference { speed: 0.0, heading },
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
        candidate: rolled_out(horizon, &rollout),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::prelude::*;

    /// Tests with a craft under way to an AUV.
    fn with_horizon(test: impl FnOnce(&Horizon<'_>, Level)) {
        let asc = Asc::new(Vector2::zeros(), Heading::new(0.3), 0.3);
        let auv = Auv::new("auv", moving(30.0, 5.0, 5.0, 0.0, 0.2));
        let goal = Goal::Track { auv: auv.id.clone() };
        let request = PlanRequest::new(200.0, asc, vec![auv], goal);
        let snapshot = Snapshot::try_from(request).expect("is valid");
        let parameters = Parameters::default();
        let (goal, _) = scheduled_goal(&snapshot, &parameters, None, &Stop::never());
        let horizon = Horizon::new(&snapshot, &parameters, &goal);
        let (los, _) = line_of_sight(&horizon, parameters.los);
        test(&horizon, los);
    }

    #[test]
    fn the_first_of_levels_with_equal_costs_answers() {
        with_horizon(|horizon, los| {
            let method = |planned: f64, law: f64| {
                let [mut of_program, mut los] = [los.clone(), los.clone()];
                of_program.candidate.predicted.cost = planned;
                los.candidate.predicted.cost = law;
                let scp = ScpResult {
                    candidate: Some(of_program.candidate),
                    degraded: None,
                    ..ScpResult::none(Degraded::Deadline)
                };
                best_level(horizon, &scp, &los).method
            };
            assert_eq!(method(1.0, 1.0), Method::Mpc);
            assert_eq!(method(COST_TIE, 0.0), Method::Mpc);
            assert_eq!(method(2.0 * COST_TIE, 0.0), Method::SaturatedLos);
        });
    }

    #[test]
    fn a_plan_too_slow_for_a_direction_keeps_the_heading() {
        with_horizon(|horizon, los| {
            let mut candidate = los.candidate;
            for stage in &mut candidate.stages {
                stage.velocity = Vector2::new(-0.5 * SPEED_WITHOUT_DIRECTION, 0.0);
            }
            let (asked, heading) = (planned(horizon, candidate).reference, Heading::new(0.3));
            assert!(wrap(asked.heading.radians() - heading.radians()).abs() < 1e-12);
        });
    }
}
