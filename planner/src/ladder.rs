//! The decision ladder: one snapshot, one answer, never silence.
//!
//! Solved program → previous plan, followed further → saturated line of sight → hold.

use crate::{
    angle::Heading,
    answer::{Baseline, Degraded, Method, Plan, TargetForecast},
    forecast::AuvForecast,
    goal::GoalForecast,
    horizon::{Horizon, point_at, previous_points},
    los::{AscNow, Reference, saturated_los},
    passes::{Optimiser, Optimum, Programs},
    policy::Policy,
    program::Program,
    response::Stage,
    snapshot::{Auv, Goal, HoldStyle, Limits, Snapshot, TrajectoryPoint},
    solve::Solution,
};

/// How far a slow turn's heading reference leads the craft, rad, starboard.
const SLOW_TURN_LEAD: f64 = 0.2;

/// What one rung offers.
struct Candidate {
    method: Method,
    reference: Reference,
    stages: Vec<Stage>,
}

/// Plans for `snapshot` from the highest rung that holds.
pub(crate) fn descend(
    snapshot: &Snapshot,
    policy: &Policy,
    programs: &mut Programs,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    let goal = GoalForecast::new(snapshot);
    let horizon = Horizon::new(snapshot, policy, &goal);
    let los_stages = horizon.los_stages(snapshot, policy, &goal, policy.los);
    let los = Candidate {
        method: Method::SaturatedLos,
        reference: saturated_los(
            &AscNow::from(snapshot),
            &goal.at(0.0),
            horizon.goal_course,
            policy.los,
            &snapshot.limits,
        ),
        stages: los_stages,
    };
    let baseline = Baseline {
        reference: los.reference,
        trajectory: horizon.trajectory(&los.stages),
        predicted: horizon.predict(&los.stages, &policy.weights),
    };

    let mut optimiser = Optimiser {
        snapshot,
        policy,
        horizon: &horizon,
        programs,
        solve,
    };
    let optimum = if goal_is_stale(snapshot, policy) {
        Optimum::none(Degraded::StaleReport)
    } else {
        optimiser.run(&los.stages)
    };
    let candidate = match (&optimum.stages, optimum.degraded) {
        (Some(stages), _) => Candidate {
            method: Method::Mpc,
            reference: reference_of(&horizon, stages, snapshot, policy),
            stages: stages.clone(),
        },
        (None, Some(Degraded::StaleReport)) => hold(snapshot, policy, &horizon),
        (None, _) => previous_plan(snapshot, policy, &horizon).unwrap_or(los),
    };
    Plan {
        method: candidate.method,
        surge: snapshot.asc.surge,
        degraded: optimum.degraded,
        reference: candidate.reference,
        valid_until: snapshot.time + policy.validity,
        trajectory: horizon.trajectory(&candidate.stages),
        goal: horizon.times.iter().map(|time| goal.at(*time)).collect(),
        goal_course: horizon.goal_course,
        targets: targets(snapshot, &horizon),
        baseline,
        solver: optimum.report,
        predicted: horizon.predict(&candidate.stages, &policy.weights),
        violations: optimum.violations,
    }
}

/// Whether the goal rests on a report that is too old to be forecast.
fn goal_is_stale(snapshot: &Snapshot, policy: &Policy) -> bool {
    let named = match &snapshot.goal {
        Goal::Track { auv } => std::slice::from_ref(auv),
        Goal::Intermittent { auvs, .. } | Goal::Midpoint { auvs } => auvs.as_slice(),
    };
    named
        .iter()
        .filter_map(|id| snapshot.auv(id))
        .any(|auv| auv.age > policy.report_age_max)
}

fn targets(snapshot: &Snapshot, horizon: &Horizon) -> Vec<TargetForecast> {
    let current = snapshot.current();
    let target = |auv: &Auv| {
        let forecast = AuvForecast::new(auv, snapshot.forecast, &current);
        TargetForecast {
            id: auv.id.clone(),
            model: forecast.model,
            positions: horizon
                .times
                .iter()
                .map(|time| forecast.at(*time).position)
                .collect(),
        }
    };
    snapshot.auvs.iter().map(target).collect()
}

/// References that the inner loops turn into the first interval of `stages`.
fn reference_of(horizon: &Horizon, stages: &[Stage], snapshot: &Snapshot, policy: &Policy) -> Reference {
    let points = horizon.trajectory(&stages[..2]);
    let bias = horizon.surge_bias[0];
    invert_response(
        snapshot.asc.surge,
        &points[1],
        policy.steps[0],
        bias,
        &snapshot.limits,
    )
}

/// The inverse of the inner loops' response over an interval dt: the heading at its end, because the
/// yaw loop is about one interval late, and the speed that makes a loop of lag τ and bias b, which
/// answers a = (u_ref − u)/τ + b, accelerate as planned.
///
/// ```text
/// u_ref = (u_0 + u_1)/2 + τ ((u_1 − u_0)/dt − b)
/// ```
fn invert_response(speed_now: f64, next: &TrajectoryPoint, dt: f64, bias: f64, limits: &Limits) -> Reference {
    let acceleration = (next.speed - speed_now) / dt;
    // A loop faster than the interval is over before it ends: no lead.
    let lead =
        limits.surge_lag.max(0.5 * dt) * acceleration - 0.5 * dt * acceleration - limits.surge_lag * bias;
    Reference {
        speed: (next.speed + lead).clamp(limits.speed_min, limits.speed_max),
        heading: next.heading,
    }
}

/// The previous plan, followed further: its trajectory from now on, held at its end.
fn previous_plan(snapshot: &Snapshot, policy: &Policy, horizon: &Horizon) -> Option<Candidate> {
    let points = previous_points(snapshot, policy)?;
    let dt = policy.steps[0];
    let (now, next) = (
        point_at(points, snapshot.time),
        point_at(points, snapshot.time + dt),
    );
    let stages = horizon
        .times
        .iter()
        .map(|time| horizon.stage(&point_at(points, snapshot.time + time)));
    Some(Candidate {
        method: Method::PreviousPlan,
        reference: invert_response(now.speed, &next, dt, 0.0, &snapshot.limits),
        stages: stages.collect(),
    })
}

/// Nothing to follow: turn slowly on the spot, or stop, as the client chose.
fn hold(snapshot: &Snapshot, policy: &Policy, horizon: &Horizon) -> Candidate {
    let law = |heading: Heading| match snapshot.hold {
        HoldStyle::Stop => Reference { speed: 0.0, heading },
        HoldStyle::SlowTurn => Reference {
            speed: snapshot.limits.speed_min,
            heading: Heading::new(heading.radians() + SLOW_TURN_LEAD),
        },
    };
    Candidate {
        method: Method::Hold,
        reference: law(snapshot.asc.heading),
        stages: horizon.rollout(snapshot, policy, |_, asc| law(asc.heading)),
    }
}
