//! Following a planned way: what the inner loops are asked for, and where that leads.

use crate::{
    angle::{Heading, angle_of, wrap},
    horizon::{Horizon, SPEED_WITHOUT_DIRECTION, previous_points},
    los::{AscNow, Reference},
    policy::Policy,
    response::{HEADING_LAG, Rollout, Stage, Surge},
    snapshot::{Limits, Snapshot, TrajectoryPoint},
};

/// How far ahead a follower looks on a planned way, s: the yaw loop is about that late.
pub(crate) const FOLLOW_LEAD: f64 = 1.0;

/// A keep-out that is nearer than this on a heading is worth a hard turn, s. Measured in `crowded`, told the paths, five
/// seeds: with 3, 6 and 10 s the craft is inside 1.0, 0.4 and 0 times a run, and 0.07, 0.3 and 0.5 % of the headings step
/// by more than 10°.
const KEEP_OUT_FORESIGHT: f64 = 10.0;

/// Part of its error that a follower takes back in a second, 1/s.
const FOLLOW_GAIN: f64 = 0.15;

/// Stages and rollouts reach the same time by different sums, s.
const HALF_A_MICROSECOND: f64 = 5e-7;

/// A craft that follows `stages`, rolled out on the response model: the planned velocity a second ahead, and a part
/// of what it is off its way.
///
/// ```text
/// v_ref = v(t + 1 s) + k (p(t) − p)
/// ```
/// A plan is made anew every second from where the craft is, which the second term stands for: without it, errors
/// of the first turn would be carried to the end of the horizon.
pub(crate) fn follow(
    horizon: &Horizon,
    stages: &[Stage],
    snapshot: &Snapshot,
    policy: &Policy,
    rollout: &mut Rollout,
) {
    let mut k = 0;
    let limits = policy.planned_limits(&snapshot.limits);
    let law = |time, asc: &AscNow, surge: Surge| {
        while k + 2 < horizon.times.len() && horizon.times[k + 1] <= time + HALF_A_MICROSECOND {
            k += 1;
        }
        let here = horizon.between(stages, k, time);
        let next = stage_at(horizon, stages, k, time + FOLLOW_LEAD);
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
        invert_response(surge.speed, &point, FOLLOW_LEAD, surge.bias, &limits)
    };
    horizon.roll_out(snapshot, policy, law, rollout);
}

/// `stages` at a time in the interval that begins with stage k or in a later one.
pub(crate) fn stage_at(horizon: &Horizon, stages: &[Stage], k: usize, time: f64) -> Stage {
    let k = (k..horizon.times.len() - 2)
        .find(|k| time < horizon.times[k + 1])
        .unwrap_or(horizon.times.len() - 2);
    horizon.between(stages, k, time)
}

/// The inverse of the inner loops' response over an interval dt: the heading, which leads already, and the speed that
/// makes a loop of lag τ and bias b, which answers a = (u_ref − u)/τ + b, accelerate as planned.
///
/// ```text
/// u_ref = (u_0 + u_1)/2 + τ ((u_1 − u_0)/dt − b)
/// ```
pub(crate) fn invert_response(
    speed_now: f64,
    next: &TrajectoryPoint,
    dt: f64,
    bias: f64,
    limits: &Limits,
) -> Reference {
    let acceleration = (next.speed - speed_now) / dt;
    // A loop faster than the interval is over before it ends: no lead.
    let lead =
        limits.surge_lag.max(0.5 * dt) * acceleration - 0.5 * dt * acceleration - limits.surge_lag * bias;
    Reference {
        speed: (next.speed + lead).clamp(limits.speed_min, limits.speed_max),
        heading: next.heading,
    }
}

/// The reference with a heading that the craft can turn to within the lag of its yaw loop: a loop that is asked for
/// more turns faster than the limit, and near rest the direction of a planned velocity is worth little.
pub(crate) fn within_reach(asked: Reference, snapshot: &Snapshot) -> Reference {
    Reference {
        heading: reachable_heading(asked.heading, snapshot),
        ..asked
    }
}

fn reachable_heading(heading: Heading, snapshot: &Snapshot) -> Heading {
    let psi = snapshot.asc.heading.radians();
    let most = snapshot.limits.turn_rate_max * HEADING_LAG;
    Heading::new(psi + wrap(heading.radians() - psi).clamp(-most, most))
}

/// The reference with a heading that turns no faster than the policy wants, unless that leads into a keep-out. Plans made
/// anew every second may want another turn every second.
pub(crate) fn calmed(asked: Reference, snapshot: &Snapshot, policy: &Policy) -> Reference {
    match calm_heading(&asked, snapshot, policy) {
        Some(heading) if !leads_into_a_keep_out(heading, asked.speed, snapshot) => {
            Reference { heading, ..asked }
        }
        Some(_) | None => asked,
    }
}

/// The heading of a reference, no farther from that of the plan before than the policy's rate allows; none where there
/// is no such plan.
fn calm_heading(reference: &Reference, snapshot: &Snapshot, policy: &Policy) -> Option<Heading> {
    let points = previous_points(snapshot, policy)?;
    let before = snapshot.previous_plan.as_ref()?.heading_reference?;
    // A law may have asked for more than the craft can turn to: from there, the shorter way may be the wrong one.
    let before = reachable_heading(before, snapshot).radians();
    let most = policy.heading_rate_max * (snapshot.time - points[0].time);
    let step = wrap(reference.heading.radians() - before);
    Some(Heading::new(before + step.clamp(-most, most)))
}

/// Whether a craft on `heading` would be in a keep-out within [`KEEP_OUT_FORESIGHT`].
fn leads_into_a_keep_out(heading: Heading, speed: f64, snapshot: &Snapshot) -> bool {
    let velocity = heading.unit() * speed.max(snapshot.asc.surge) + snapshot.current();
    snapshot.keep_outs.iter().any(|disc| {
        let outward = snapshot.asc.position - disc.centre;
        let gap = outward.norm() - disc.radius;
        let closing = outward
            .try_normalize(f64::EPSILON)
            .map_or(0.0, |outward| -velocity.dot(&outward));
        gap < closing * KEEP_OUT_FORESIGHT
    })
}
