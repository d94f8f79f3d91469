//! Following a planned trajectory: what the inner loops are asked for, and where that leads.

use crate::{
    craft::{
        model::CraftModel,
        response::{HALF_HOLD, Rollout, Stage, Surge, limited_heading},
    },
    facts::{
        angle::{Heading, angle_of},
        asc::AscNow,
        reference::Reference,
    },
    problem::{frame::SPEED_WITHOUT_DIRECTION, horizon::Horizon, parameters::Parameters},
    snapshot::build::Snapshot,
};

/// Nearest that a follower looks ahead, s: the time for which a reference is held.
const FOLLOW_LEAD: f64 = 1.0;

/// Nearest and farthest that a follower looks ahead for its speed, s.
const SPEED_LEAD_MIN: f64 = 1.0;

/// As above.
const SPEED_LEAD_MAX: f64 = 6.0;

/// A keep-out that is nearer than this on a heading is worth a hard turn, s; see `docs/rationale.md#references`.
const KEEP_OUT_FORESIGHT: f64 = 10.0;

/// Part of its error that a follower takes back in a second, 1/s.
const FOLLOW_GAIN: f64 = 0.15;

/// Largest product of that part and the heading's lag: a loop that is closed about a lag keeps a phase margin of some 60°.
const FOLLOW_GAIN_LAG: f64 = 0.5;

/// Stages and rollouts reach the same time by different sums, s.
const HALF_A_MICROSECOND: f64 = 5e-7;

/// A craft that follows `stages`, rolled out on the response model: the planned velocity a second ahead, and a part
/// of its error of position.
///
/// ```text
/// v_ref = v(t + 1 s) + k (p(t) − p)
/// ```
/// A plan is made anew every second from where the craft is, which the second term stands for: without it, errors
/// of the first turn would be carried to the end of the horizon.
pub(crate) fn follow(
    horizon: &Horizon<'_>,
    stages: &[Stage],
    snapshot: &Snapshot,
    parameters: &Parameters,
) -> Rollout {
    let mut k = 0;
    let craft = parameters.planned(snapshot.craft_model());
    let heading_lead = craft.heading_lag().max(FOLLOW_LEAD);
    let gain = FOLLOW_GAIN.min(FOLLOW_GAIN_LAG / heading_lead);
    let law = |time, asc: &AscNow, surge: Surge| {
        while k + 2 < horizon.times.len() && horizon.times[k + 1] <= time + HALF_A_MICROSECOND {
            k += 1;
        }
        let here = horizon.between(stages, k, time);
        let back = (here.position - asc.position) * gain;
        let next = stage_at(horizon, stages, k, time + speed_lead(&craft));
        let later = stage_at(horizon, stages, k, time + heading_lead).velocity + back;
        let planned = Reference {
            speed: (next.velocity + back).norm(),
            heading: if later.norm() < SPEED_WITHOUT_DIRECTION {
                asc.heading
            } else {
                Heading::new(angle_of(&later))
            },
        };
        invert_response(surge.speed, &planned, surge.bias, &craft)
    };
    horizon.roll_out(&craft, law)
}

/// `stages` at a time in the interval that begins with stage k or in a later one.
pub(crate) fn stage_at(horizon: &Horizon<'_>, stages: &[Stage], k: usize, time: f64) -> Stage {
    let k = (k..horizon.times.len() - 2)
        .find(|k| time < horizon.times[k + 1])
        .unwrap_or(horizon.times.len() - 2);
    horizon.between(stages, k, time)
}

/// How far ahead the planned speed is looked at for the acceleration that is asked for, s: the lag of the speed loop.
///
/// The mean acceleration over the lag, not the one of the next second: what noise of a speed log makes of the first second
/// of a plan is over by then, and the loop would answer it no sooner.
pub(crate) fn speed_lead(craft: &CraftModel) -> f64 {
    craft.surge_lag().clamp(SPEED_LEAD_MIN, SPEED_LEAD_MAX)
}

/// The inverse of the speed loop's response: the reference that makes a loop of lag T, delay included, and of time constant
/// T_u and bias b accelerate as planned, held for one second.
///
/// ```text
/// a = (u(t + lead) − u)/lead        u_ref = u + (T + ½ s) a − T_u b
/// ```
/// The whole lag leads, as the delay of a second-order loop is no dead time: a reference that foresees it as one brakes
/// too late, see `docs/rationale.md#references`.
pub(crate) fn invert_response(
    speed_now: f64,
    planned: &Reference,
    bias: f64,
    craft: &CraftModel,
) -> Reference {
    let limits = &craft.limits;
    let acceleration = (planned.speed - speed_now) / speed_lead(craft);
    // A loop faster than the interval is over before it ends.
    let lead = craft.surge_lag().max(HALF_HOLD) + HALF_HOLD;
    let speed = speed_now + lead * acceleration - craft.surge_time * bias;
    Reference {
        speed: speed.clamp(limits.speed_min, limits.speed_max),
        heading: planned.heading,
    }
}

/// The reference behind the slew limiter: its heading turns no faster than `rate` from the reference before, rad/s, unless
/// that leads into a keep-out. Plans made anew every second may want another turn every second.
pub(crate) fn slew_limited(
    asked: Reference,
    snapshot: &Snapshot,
    horizon: &Horizon<'_>,
    rate: f64,
) -> Reference {
    match limited(&asked, snapshot, horizon, rate) {
        Some(heading) if !leads_into_a_keep_out(heading, asked.speed, snapshot) => {
            Reference { heading, ..asked }
        }
        Some(_) | None => asked,
    }
}

/// The heading of a reference, no farther from that of the plan before than `rate` allows; none where there is no such
/// plan.
fn limited(asked: &Reference, snapshot: &Snapshot, horizon: &Horizon<'_>, rate: f64) -> Option<Heading> {
    let followed = horizon.followed?;
    let (before, bow) = (followed.heading, snapshot.asc.heading());
    Some(limited_heading(asked.heading, before, bow, rate * followed.age))
}

/// Whether a craft on `heading` would be in a keep-out within [`KEEP_OUT_FORESIGHT`].
fn leads_into_a_keep_out(heading: Heading, speed: f64, snapshot: &Snapshot) -> bool {
    let velocity = heading.unit() * speed.max(snapshot.asc.speed_mps) + snapshot.current();
    snapshot.keep_outs.iter().any(|disc| {
        let outward = snapshot.asc.position() - disc.centre();
        let gap = outward.norm() - disc.radius_m;
        let closing = outward
            .try_normalize(f64::EPSILON)
            .map_or(0.0, |outward| -velocity.dot(&outward));
        gap < closing * KEEP_OUT_FORESIGHT
    })
}
