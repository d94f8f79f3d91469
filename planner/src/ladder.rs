//! The decision ladder: one snapshot, one answer, never silence.
//!
//! Solved program → previous plan, followed further → saturated line of sight → hold.

use crate::{
    angle::{Heading, angle_of},
    answer::{Baseline, Degraded, Method, Plan, SolverReport, TargetForecast},
    follower::{FOLLOW_LEAD, calmed, follow, invert_response, stage_at, within_reach},
    goal::GoalForecast,
    horizon::{Horizon, SPEED_WITHOUT_DIRECTION, point_at, previous_points},
    los::{AscNow, LosLaw, LosTuning, Reference, TrackingLaw, saturated_los},
    merit::predict,
    optimum::{Optimum, Way},
    passes::{self, Optimiser},
    policy::Policy,
    program::Program,
    refilled::refilled,
    response::{COURSE_LAG, Rollout},
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

    let optimum = if goal_is_stale(snapshot, policy) {
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
    let best = best_rung(snapshot, policy, &horizon, &optimum, los, passes);
    let broken_by_program = (best.method == Method::Mpc).then_some(optimum.violations);
    let ways = &passes.ways;
    let answer = Plan {
        method: best.method,
        surge: snapshot.asc.surge,
        surge_bias: horizon.surge_bias,
        current: snapshot.known_current(),
        degraded: optimum.degraded,
        reference: best.reference,
        valid_until: snapshot.time + policy.validity,
        trajectory: refilled(memory.trajectory, horizon.trajectory(&ways[best.way.number])),
        goal: refilled(memory.goal, horizon.times.iter().map(|time| goal.at(*time))),
        goal_course: goal.course(),
        targets: TargetForecast::of_all(snapshot, &horizon.times, goal.auvs(), memory.targets),
        baseline: Baseline {
            reference: law,
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
    };
    sheets.goal = Some(goal);
    sheets.horizon = Some(horizon);
    answer
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
                steered(next, snapshot, policy)
            } else {
                best
            }
        })
        .unwrap_or(los)
}

/// A rung as it is steered by where another holds: the law, at speed, turns as calmly as a plan. What it is predicted to
/// lead to stays that of the law itself, as a plan's leaves out that it is calmed.
///
/// Asked for a hard turn at full speed, thrusters at their limits give neither, and the heading swings for 10 s.
/// Measured in `silence`, six seeds: 0.88 times the heading travel, and no overshoot of the largest speed beside 2.3 a
/// run (thirty seeds: 0.17 a run); a law that turns calmly from rest too is 6 % farther off.
fn steered(rung: Candidate, snapshot: &Snapshot, policy: &Policy) -> Candidate {
    let at_speed = policy.hard_turn_share * policy.planned_limits(&snapshot.limits).speed_max;
    if rung.method != Method::SaturatedLos || snapshot.asc.surge <= at_speed {
        return rung;
    }
    Candidate {
        reference: calmed(within_reach(rung.reference, snapshot), snapshot, policy),
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

/// Whether the goal rests on a report that is too old to be forecast.
fn goal_is_stale(snapshot: &Snapshot, policy: &Policy) -> bool {
    let named = snapshot.goal.vehicles();
    named
        .filter_map(|id| snapshot.auv_and_estimate(id))
        .any(|(_, estimate)| estimate.state.age > policy.report_age_max)
}

/// The program's own rung.
fn planned(horizon: &Horizon, way: Way, snapshot: &Snapshot, policy: &Policy, ways: &Ways) -> Candidate {
    let next = horizon.trajectory(&ways[way.number]).nth(1);
    let next = next.expect("a horizon has an interval");
    let bias = horizon.surge_bias;
    let surge = horizon.start.velocity.x;
    let later = stage_at(horizon, &ways[way.number], 0, COURSE_LAG).velocity;
    let next = TrajectoryPoint {
        heading: if later.norm() < SPEED_WITHOUT_DIRECTION {
            next.heading
        } else {
            Heading::new(snapshot.asc.heading.radians() + angle_of(&later))
        },
        ..next
    };
    let limits = policy.planned_limits(&snapshot.limits);
    let asked = invert_response(surge, &next, policy.steps[0], bias, &limits);
    Candidate {
        method: Method::Mpc,
        reference: calmed(within_reach(asked, snapshot), snapshot, policy),
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
    let next = TrajectoryPoint {
        heading: point_at(points, snapshot.time + COURSE_LAG).heading,
        ..point_at(points, snapshot.time + FOLLOW_LEAD)
    };
    let (surge, bias) = (horizon.start.velocity.x, horizon.surge_bias);
    let limits = policy.planned_limits(&snapshot.limits);
    let asked = invert_response(surge, &next, FOLLOW_LEAD, bias, &limits);
    Some(Candidate {
        method: Method::PreviousPlan,
        reference: calmed(within_reach(asked, snapshot), snapshot, policy),
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
    horizon.roll_out(snapshot, policy, |_, asc, _| law(asc.heading), rollout);
    let way = ways.add(rollout.stages.iter().copied());
    Candidate {
        method: Method::Hold,
        reference: law(snapshot.asc.heading),
        way: rolled_out(horizon, way, rollout),
    }
}
