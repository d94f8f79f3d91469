//! The decision ladder: one snapshot, one answer, never silence.
//!
//! Solved program → previous plan, followed further → saturated line of sight → hold.

use crate::{
    angle::{Heading, angle_of, wrap},
    answer::{Baseline, Degraded, Method, Plan, SolverReport, TargetForecast},
    craft::CraftEstimate,
    follower::{follow, invert_response, slew_limited, speed_lead, stage_at},
    goal::GoalForecast,
    horizon::{Horizon, SPEED_WITHOUT_DIRECTION, point_at, previous_points},
    los::{AscNow, LosLaw, LosTuning, Reference, TrackingLaw, saturated_los},
    merit::predict,
    optimum::{Optimum, Way},
    passes::{self, Optimiser},
    policy::Policy,
    program::Program,
    refilled::refilled,
    response::{HALF_HOLD, Rollout},
    snapshot::{HoldStyle, Snapshot, TrajectoryPoint},
    solve::Solution,
    stop::Stop,
    ways::Ways,
};

/// Merits that differ by less are as good, m² s: right above its goal a craft's is what the solver's tolerance leaves,
/// 10⁻¹² m² s.
const MERIT_TIE: f64 = 1e-6;

/// How far a slow turn's heading reference leads the craft, rad, starboard.
const SLOW_TURN_LEAD: f64 = 0.2;

/// What one rung offers.
#[derive(Clone, Copy)]
struct Candidate {
    method: Method,
    reference: Reference,
    way: Way,
}

/// What the rungs are worked out on; it serves the next snapshot too.
#[derive(Debug, Default)]
pub(crate) struct Sheets {
    goal: Option<GoalForecast>,
    horizon: Option<Horizon>,
    /// Where line of sight leads.
    los: Rollout,
    pub(crate) passes: passes::Sheets,
}

/// Plans for `snapshot`, in the memory of an earlier plan: of the rungs that hold, the one that is predicted to do
/// best.
pub(crate) fn descend(
    snapshot: &Snapshot,
    policy: &Policy,
    sheets: &mut Sheets,
    stop: &Stop,
    solve: &mut dyn FnMut(&Program, &mut Solution),
    memory: Plan,
) -> Plan {
    let goal = GoalForecast::in_memory(sheets.goal.take(), snapshot);
    let horizon = Horizon::in_memory(sheets.horizon.take(), snapshot, policy, &goal);
    let los_rollout = &mut sheets.los;
    sheets.passes.ways.begin(horizon.times.len());
    horizon.line_of_sight(
        snapshot,
        policy,
        &goal,
        tuning(LosLaw::SaturatedLos, policy),
        los_rollout,
    );
    let law = saturated_los(
        &AscNow::from(snapshot),
        &goal.at(0.0),
        horizon.goal_course,
        policy.los,
        &snapshot.limits,
    );
    let los = Candidate {
        method: Method::SaturatedLos,
        reference: law,
        way: rolled_out(
            &horizon,
            sheets.passes.ways.add(los_rollout.stages.iter().copied()),
            los_rollout,
        ),
    };

    let optimum = if goal
        .needs_now()
        .any(|auv| policy.is_stale(&snapshot.estimates()[auv]))
    {
        Optimum::none(Degraded::StaleReport)
    } else {
        let mut optimiser = Optimiser {
            snapshot,
            policy,
            horizon: &horizon,
            goal: &goal,
            stop,
            solve,
            sheets: &mut sheets.passes,
        };
        optimiser.run(los_rollout, los.way.predicted.merit)
    };
    let passes = &mut sheets.passes;
    let distance = (goal.at(0.0).position - snapshot.asc.position).norm();
    let craft = answered(snapshot, distance);
    let best = if craft.realised.law_steers && optimum.degraded != Some(Degraded::StaleReport) {
        steered(los, snapshot, policy)
    } else {
        best_rung(snapshot, policy, &horizon, &optimum, los, passes)
    };
    let (command, through_water) = commanded(best.reference, snapshot);
    let broken_by_program = (best.method == Method::Mpc).then_some(optimum.violations);
    let ways = &passes.ways;
    let answer = Plan {
        method: best.method,
        current: snapshot.known_current(),
        craft,
        degraded: optimum.degraded,
        reference: command,
        reference_through_water: through_water,
        valid_until: snapshot.time + policy.validity,
        trajectory: refilled(memory.trajectory, horizon.trajectory(&ways[best.way.number])),
        goal: refilled(memory.goal, horizon.times.iter().map(|time| goal.at(*time))),
        goal_course: goal.course(),
        targets: TargetForecast::of_all(snapshot, &horizon.times, goal.auvs(), memory.targets),
        baseline: Baseline {
            reference: snapshot.command(&law),
            trajectory: refilled(
                memory.baseline.trajectory,
                horizon.trajectory(&ways[los.way.number]),
            ),
            predicted: los.way.predicted,
            violations: refilled(
                memory.baseline.violations,
                los.way.violations.into_iter().flatten(),
            ),
        },
        solver: SolverReport {
            deadline_hit: stop.was_due(),
            ..optimum.report
        },
        predicted: best.way.predicted,
        violations: refilled(
            memory.violations,
            best.way
                .violations
                .into_iter()
                .chain(broken_by_program.into_iter().flatten())
                .flatten(),
        ),
        range_unattainable: refilled(
            memory.range_unattainable,
            horizon.surroundings.range_unattainable.iter().copied(),
        ),
    };
    sheets.goal = Some(goal);
    sheets.horizon = Some(horizon);
    answer
}

/// What the craft is told so that it does what was `asked`, and what that comes to through the water.
fn commanded(asked: Reference, snapshot: &Snapshot) -> (Reference, Reference) {
    let asked = less_offset(asked, snapshot);
    let command = snapshot.calm_command(&asked);
    let held_back = wrap(command.heading.radians() - snapshot.command(&asked).heading.radians());
    let through_water = Reference {
        heading: Heading::new(asked.heading.radians() + held_back),
        ..asked
    };
    (command, through_water)
}

/// The reference that makes the craft turn to that of `asked`: less what its heading stays off its reference.
fn less_offset(asked: Reference, snapshot: &Snapshot) -> Reference {
    Reference {
        heading: Heading::new(asked.heading.radians() - snapshot.craft_model().heading_offset),
        ..asked
    }
}

/// The rung that answers: of those that are as good, the first.
fn best_rung(
    snapshot: &Snapshot,
    policy: &Policy,
    horizon: &Horizon,
    optimum: &Optimum,
    los: Candidate,
    sheets: &mut passes::Sheets,
) -> Candidate {
    if optimum.degraded == Some(Degraded::StaleReport) {
        return hold(snapshot, policy, horizon, sheets);
    }
    let planned = optimum
        .way
        .map(|way| planned(horizon, way, snapshot, policy, &sheets.ways));
    let rungs = [
        planned,
        previous_plan(snapshot, policy, horizon, sheets),
        Some(los),
    ];
    rungs
        .into_iter()
        .flatten()
        .reduce(|best, next| {
            if policy.merit_decides && next.way.predicted.merit + MERIT_TIE < best.way.predicted.merit {
                next
            } else {
                best
            }
        })
        .map_or(los, |best| steered(best, snapshot, policy))
}

/// What is known of the craft, and of who keeps it how near to its goal, `distance` m being how near now.
fn answered(snapshot: &Snapshot, distance: f64) -> CraftEstimate {
    let estimate = *snapshot.craft_estimate();
    let previous = snapshot.previous_plan.as_ref();
    let elapsed = previous
        .and_then(|previous| Some(snapshot.time - previous.trajectory.first()?.time))
        .map_or(0.0, |elapsed| elapsed.clamp(0.0, 10.0));
    CraftEstimate {
        realised: estimate.realised.after(distance, elapsed, estimate.monitor.alarm),
        ..estimate
    }
}

/// A rung as it is steered by where another holds: the law's heading reference turns no faster than the craft, and at
/// speed no faster than a plan's. What it is predicted to lead to stays that of the law itself.
///
/// Asked for a hard turn at full speed, thrusters at their limits give neither, and the heading swings for 10 s.
/// Measured in `silence`, six seeds: 0.88 times the heading travel, and no overshoot of the largest speed beside 2.3 a
/// run (thirty seeds: 0.17 a run); a law that turns calmly from rest too is 6 % farther off.
fn steered(rung: Candidate, snapshot: &Snapshot, policy: &Policy) -> Candidate {
    if rung.method != Method::SaturatedLos {
        return rung;
    }
    let craft = snapshot.craft_model();
    let planned = policy.planned(craft).limits;
    let at_speed = policy.hard_turn_share * planned.speed_max < snapshot.asc.surge;
    let rate = if at_speed {
        planned.turn_rate_max
    } else {
        craft.limits.turn_rate_max
    };
    Candidate {
        reference: slew_limited(rung.reference, snapshot, policy, rate),
        ..rung
    }
}

/// What `law` would do from a start without memory.
pub(crate) fn baseline(snapshot: &Snapshot, policy: &Policy, law: LosLaw) -> Baseline {
    let goal = GoalForecast::new(snapshot);
    let horizon = Horizon::in_memory(None, snapshot, policy, &goal);
    let tuning = tuning(law, policy);
    let mut rollout = Rollout::default();
    horizon.line_of_sight(snapshot, policy, &goal, tuning, &mut rollout);
    let (predicted, violations) = predict(&horizon, &rollout, &horizon.weights);
    let mut tracking = TrackingLaw::new(tuning, Some(horizon.goal_course));
    Baseline {
        reference: tracking.steer(0.0, &AscNow::from(snapshot), &goal.at(0.0), &snapshot.limits),
        trajectory: horizon.trajectory(&rollout.stages).collect(),
        predicted,
        violations: violations.into_iter().flatten().collect(),
    }
}

fn tuning(law: LosLaw, policy: &Policy) -> LosTuning {
    LosTuning {
        law,
        gains: policy.los,
        integral_gain: policy.integral_gain,
    }
}

/// The program's own rung.
fn planned(horizon: &Horizon, way: Way, snapshot: &Snapshot, policy: &Policy, ways: &Ways) -> Candidate {
    let next = horizon.trajectory(&ways[way.number]).nth(1);
    let next = next.expect("a horizon has an interval");
    let surge = horizon.start.velocity.x;
    let craft = policy.planned(snapshot.craft_model());
    let lead = craft.course_lag() + HALF_HOLD;
    let later = stage_at(horizon, &ways[way.number], 0, lead).velocity;
    let next = TrajectoryPoint {
        heading: if later.norm() < SPEED_WITHOUT_DIRECTION {
            next.heading
        } else {
            Heading::new(snapshot.asc.heading.radians() + angle_of(&later))
        },
        speed: stage_at(horizon, &ways[way.number], 0, speed_lead(&craft))
            .velocity
            .norm(),
        ..next
    };
    let asked = invert_response(surge, &next, craft.surge_bias, &craft);
    Candidate {
        method: Method::Mpc,
        reference: slew_limited(asked, snapshot, policy, craft.limits.turn_rate_max),
        way,
    }
}

/// The previous plan, followed further: its trajectory from now on, held at its end.
fn previous_plan(
    snapshot: &Snapshot,
    policy: &Policy,
    horizon: &Horizon,
    sheets: &mut passes::Sheets,
) -> Option<Candidate> {
    let points = previous_points(snapshot, policy)?;
    let passes::Sheets { ways, rollout, .. } = sheets;
    let way = ways.add(horizon.stages_along(points));
    follow(horizon, &ways[way], snapshot, policy, rollout);
    let craft = policy.planned(snapshot.craft_model());
    let lead = craft.course_lag() + HALF_HOLD;
    let next = TrajectoryPoint {
        heading: point_at(points, snapshot.time + lead).heading,
        ..point_at(points, snapshot.time + speed_lead(&craft))
    };
    let surge = horizon.start.velocity.x;
    let asked = invert_response(surge, &next, craft.surge_bias, &craft);
    Some(Candidate {
        method: Method::PreviousPlan,
        reference: slew_limited(asked, snapshot, policy, craft.limits.turn_rate_max),
        way: rolled_out(horizon, way, rollout),
    })
}

/// The way of that number, `rollout` being what following it leads to.
fn rolled_out(horizon: &Horizon, number: usize, rollout: &Rollout) -> Way {
    let (predicted, violations) = predict(horizon, rollout, &horizon.weights);
    Way {
        number,
        predicted,
        violations,
    }
}

/// Nothing to follow: turn slowly on the spot, or stop, as the client chose.
fn hold(snapshot: &Snapshot, policy: &Policy, horizon: &Horizon, sheets: &mut passes::Sheets) -> Candidate {
    let law = |heading: Heading| match snapshot.hold {
        HoldStyle::Stop => Reference { speed: 0.0, heading },
        HoldStyle::SlowTurn => Reference {
            speed: snapshot.limits.speed_min,
            heading: Heading::new(heading.radians() + SLOW_TURN_LEAD),
        },
    };
    let passes::Sheets { ways, rollout, .. } = sheets;
    horizon.roll_out(
        snapshot.craft_model(),
        policy,
        |_, asc, _| law(asc.heading),
        rollout,
    );
    let way = ways.add(rollout.stages.iter().copied());
    Candidate {
        method: Method::Hold,
        reference: law(snapshot.asc.heading),
        way: rolled_out(horizon, way, rollout),
    }
}
