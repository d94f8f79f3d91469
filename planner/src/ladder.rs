//! The decision ladder: one snapshot, one answer, never silence.
//!
//! Solved program → previous plan, followed further → saturated line of sight → hold.

use crate::{
    angle::{Heading, angle_of, wrap},
    answer::{Baseline, Degraded, Method, Plan, SolverReport, TargetForecast},
    estimate::Estimate,
    forecast::AuvForecast,
    goal::GoalForecast,
    horizon::{Horizon, SPEED_WITHOUT_DIRECTION, point_at, previous_points},
    los::{AscNow, LosLaw, LosTuning, Reference, TrackingLaw, saturated_los},
    merit::predict,
    passes::{Optimiser, Optimum, Programs, Way},
    policy::Policy,
    program::Program,
    response::{Rollout, SURGE_BIAS_DECAY, Stage, YAW_LAG},
    snapshot::{Auv, HoldStyle, Limits, Snapshot, TrajectoryPoint},
    solve::Solution,
    stop::Stop,
};

/// How far a slow turn's heading reference leads the craft, rad, starboard.
const SLOW_TURN_LEAD: f64 = 0.2;

/// How far ahead a follower looks on a planned way, s: the yaw loop is about that late.
pub(crate) const FOLLOW_LEAD: f64 = 1.0;

/// Part of its error that a follower takes back in a second, 1/s.
pub(crate) const FOLLOW_GAIN: f64 = 0.15;

/// Stages and rollouts reach the same time by different sums, s.
const HALF_A_MICROSECOND: f64 = 5e-7;

/// What one rung offers.
struct Candidate {
    method: Method,
    reference: Reference,
    way: Way,
}

/// Plans for `snapshot`: of the rungs that hold, the one that is predicted to do best.
pub(crate) fn descend(
    snapshot: &Snapshot,
    policy: &Policy,
    programs: &mut Programs,
    stop: &Stop,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    let goal = GoalForecast::new(snapshot);
    let horizon = Horizon::new(snapshot, policy, &goal);
    let rollout = horizon.line_of_sight(snapshot, policy, &goal, tuning(LosLaw::SaturatedLos, policy));
    let (predicted, violations) = predict(&horizon, &rollout, &policy.weights);
    let los = Candidate {
        method: Method::SaturatedLos,
        reference: saturated_los(
            &AscNow::from(snapshot),
            &goal.at(0.0),
            horizon.goal_course,
            policy.los,
            &snapshot.limits,
        ),
        way: Way {
            stages: rollout.stages.clone(),
            predicted,
            violations,
        },
    };
    let baseline = Baseline {
        reference: los.reference,
        trajectory: horizon.trajectory(&los.way.stages),
        predicted,
        violations: los.way.violations.clone(),
    };

    let mut optimiser = Optimiser {
        snapshot,
        policy,
        horizon: &horizon,
        goal: &goal,
        programs,
        stop,
        solve,
    };
    let optimum = if goal_is_stale(snapshot, policy) {
        Optimum::none(Degraded::StaleReport)
    } else {
        optimiser.run(&rollout, predicted.merit)
    };
    let Optimum {
        way,
        degraded,
        report,
        violations: broken_by_program,
        ..
    } = optimum;
    let mut candidate = if degraded == Some(Degraded::StaleReport) {
        hold(snapshot, policy, &horizon)
    } else {
        let planned = way.map(|way| planned(&horizon, way, snapshot, policy));
        // The first of those that are as good.
        let rungs = [planned, previous_plan(snapshot, policy, &horizon), Some(los)];
        rungs
            .into_iter()
            .flatten()
            .reduce(|best, next| {
                if next.way.predicted.merit < best.way.predicted.merit {
                    next
                } else {
                    best
                }
            })
            .unwrap_or_else(|| hold(snapshot, policy, &horizon))
    };
    if candidate.method == Method::Mpc {
        candidate.way.violations.extend(broken_by_program);
    }
    Plan {
        method: candidate.method,
        surge: snapshot.asc.surge,
        current: snapshot.known_current(),
        degraded,
        reference: candidate.reference,
        valid_until: snapshot.time + policy.validity,
        trajectory: horizon.trajectory(&candidate.way.stages),
        goal: horizon.times.iter().map(|time| goal.at(*time)).collect(),
        goal_course: goal.course(),
        targets: targets(snapshot, &horizon),
        baseline,
        solver: SolverReport {
            deadline_hit: stop.was_due(),
            ..report
        },
        predicted: candidate.way.predicted,
        violations: candidate.way.violations,
    }
}

/// What `law` would do from a start without memory.
pub(crate) fn baseline(snapshot: &Snapshot, policy: &Policy, law: LosLaw) -> Baseline {
    let goal = GoalForecast::new(snapshot);
    let horizon = Horizon::new(snapshot, policy, &goal);
    let tuning = tuning(law, policy);
    let rollout = horizon.line_of_sight(snapshot, policy, &goal, tuning);
    let (predicted, violations) = predict(&horizon, &rollout, &policy.weights);
    let mut tracking = TrackingLaw::new(tuning, Some(horizon.goal_course));
    Baseline {
        reference: tracking.steer(0.0, &AscNow::from(snapshot), &goal.at(0.0), &snapshot.limits),
        trajectory: horizon.trajectory(&rollout.stages),
        predicted,
        violations,
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

fn targets(snapshot: &Snapshot, horizon: &Horizon) -> Vec<TargetForecast> {
    let current = snapshot.current();
    let target = |(auv, estimate): (&Auv, &Estimate)| {
        let forecast = AuvForecast::new(&estimate.state, auv.into(), snapshot.forecast, &current);
        let times = || horizon.times.iter();
        TargetForecast {
            id: auv.id.clone(),
            estimate: estimate.clone(),
            model: forecast.model,
            positions: times().map(|time| forecast.at(*time).position).collect(),
            depths: times().map(|time| forecast.depth_at(*time)).collect(),
            position_sigmas: times()
                .map(|time| forecast.position_variance(*time).sqrt())
                .collect(),
        }
    };
    snapshot
        .auvs
        .iter()
        .zip(snapshot.estimates())
        .map(target)
        .collect()
}

/// The program's own rung.
fn planned(horizon: &Horizon, way: Way, snapshot: &Snapshot, policy: &Policy) -> Candidate {
    let points = horizon.trajectory(&way.stages[..2]);
    let bias = horizon.surge_bias[0];
    let surge = snapshot.asc.surge;
    let asked = invert_response(surge, &points[1], policy.steps[0], bias, &snapshot.limits);
    Candidate {
        method: Method::Mpc,
        reference: within_reach(asked, snapshot),
        way,
    }
}

/// The reference with a heading that the craft can turn to within the lag of its yaw loop: a loop that is asked for
/// more turns faster than the limit, and near rest the direction of a planned velocity is worth little.
fn within_reach(asked: Reference, snapshot: &Snapshot) -> Reference {
    let psi = snapshot.asc.heading.radians();
    let most = snapshot.limits.turn_rate_max * YAW_LAG;
    let turn = wrap(asked.heading.radians() - psi).clamp(-most, most);
    Reference {
        heading: Heading::new(psi + turn),
        ..asked
    }
}

/// A craft that follows `stages`, rolled out on the response model: the planned velocity a second ahead, and a part
/// of what it is off its way.
///
/// ```text
/// v_ref = v(t + 1 s) + k (p(t) − p)
/// ```
/// A plan is made anew every second from where the craft is, which the second term stands for: without it, errors
/// of the first turn would be carried to the end of the horizon.
pub(crate) fn follow(horizon: &Horizon, stages: &[Stage], snapshot: &Snapshot, policy: &Policy) -> Rollout {
    let mut k = 0;
    horizon.rollout(snapshot, policy, |time, asc, speed| {
        while k + 2 < horizon.times.len() && horizon.times[k + 1] <= time + HALF_A_MICROSECOND {
            k += 1;
        }
        let here = horizon.between(stages, k, time);
        let ahead = (k..horizon.times.len() - 2)
            .find(|k| time + FOLLOW_LEAD < horizon.times[k + 1])
            .unwrap_or(horizon.times.len() - 2);
        let next = horizon.between(stages, ahead, time + FOLLOW_LEAD);
        let velocity = next.velocity + (here.position - asc.position) * FOLLOW_GAIN;
        let point = TrajectoryPoint {
            time,
            position: next.position,
            speed: velocity.norm(),
            heading: if velocity.norm() < SPEED_WITHOUT_DIRECTION {
                asc.heading
            } else {
                Heading::new(angle_of(&velocity))
            },
        };
        let bias = horizon.surge_bias[0] * (-time / SURGE_BIAS_DECAY).exp();
        invert_response(speed, &point, FOLLOW_LEAD, bias, &snapshot.limits)
    })
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
    let stages = horizon.stages_along(points);
    let rollout = follow(horizon, &stages, snapshot, policy);
    let next = point_at(points, snapshot.time + FOLLOW_LEAD);
    let (surge, bias) = (snapshot.asc.surge, horizon.surge_bias[0]);
    let asked = invert_response(surge, &next, FOLLOW_LEAD, bias, &snapshot.limits);
    Some(Candidate {
        method: Method::PreviousPlan,
        reference: within_reach(asked, snapshot),
        way: rolled_out(horizon, policy, stages, &rollout),
    })
}

fn rolled_out(horizon: &Horizon, policy: &Policy, stages: Vec<Stage>, rollout: &Rollout) -> Way {
    let (predicted, violations) = predict(horizon, rollout, &policy.weights);
    Way {
        stages,
        predicted,
        violations,
    }
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
    let rollout = horizon.rollout(snapshot, policy, |_, asc, _| law(asc.heading));
    Candidate {
        method: Method::Hold,
        reference: law(snapshot.asc.heading),
        way: rolled_out(horizon, policy, rollout.stages.clone(), &rollout),
    }
}
