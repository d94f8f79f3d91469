//! The follower of a planned trajectory: references for the inner loops, and the resulting rollout.

use crate::craft::model::CraftModel;
use crate::craft::response::{HALF_HOLD, Rollout, Slew, Stage, Surge, limited_heading};
use crate::facts::angle::{Heading, angle_of};
use crate::facts::asc::AscNow;
use crate::facts::reference::Reference;
use crate::problem::frame::SPEED_WITHOUT_DIRECTION;
use crate::problem::horizon::Horizon;
use crate::snapshot::build::Snapshot;

/// Least look-ahead of a follower, s: the time for which a reference is held.
const FOLLOW_LEAD: f64 = 1.0;

/// Least look-ahead of a follower for its speed, s.
const SPEED_LEAD_MIN: f64 = 1.0;

/// Largest look-ahead for the speed, s.
const SPEED_LEAD_MAX: f64 = 6.0;

/// Foresight of keep-outs that justify a hard turn, s; see `docs/rationale.md#references`.
const KEEP_OUT_FORESIGHT: f64 = 10.0;

/// Share of its error that a follower removes per second, 1/s.
const FOLLOW_GAIN: f64 = 0.15;

/// Largest product of that gain and the heading's lag: leaves a phase margin of some 60°.
const FOLLOW_GAIN_LAG: f64 = 0.5;

/// Rounding between the times of stages and rollouts, s.
const TIME_ROUNDING: f64 = 5e-7;

/// A craft that follows `stages` by velocities a second ahead, plus a share of its error.
///
/// ```text
/// v_ref = v(t + 1 s) + k (p(t) − p)
/// ```
/// The second term represents the replanning every second from the craft's position; without it,
/// errors of the first turn would last to the end of the horizon.
pub(crate) fn follow(horizon: &Horizon<'_>, stages: &[Stage]) -> Rollout {
    let mut k = 0;
    let craft = &horizon.craft;
    let heading_lead = craft.heading_lag().max(FOLLOW_LEAD);
    let gain = FOLLOW_GAIN.min(FOLLOW_GAIN_LAG / heading_lead);
    let law = |time, asc: &AscNow, surge: Surge| {
        while k + 2 < horizon.times.len() && horizon.times[k + 1] <= time + TIME_ROUNDING {
            k += 1;
        }
        let here = horizon.between(stages, k, time);
        let back = (here.position - asc.position) * gain;
        let next = stage_at(horizon, stages, k, time + speed_lead(craft));
        let later = stage_at(horizon, stages, k, time + heading_lead).velocity + back;
        let planned = Reference {
            speed: (next.velocity + back).norm(),
            heading: if later.norm() < SPEED_WITHOUT_DIRECTION {
                asc.heading
            } else {
                Heading::new(angle_of(&later))
            },
        };
        invert_response(surge.speed, &planned, surge.bias, craft)
    };
    horizon.roll_out(craft, law)
}

/// `stages` at a time in the interval after stage k or in a later one.
pub(crate) fn stage_at(horizon: &Horizon<'_>, stages: &[Stage], k: usize, time: f64) -> Stage {
    let k =
        (k..horizon.times.len() - 2).find(|k| time < horizon.times[k + 1]).unwrap_or(horizon.times.len() - 2);
    horizon.between(stages, k, time)
}

/// Look-ahead of the planned speed for the requested acceleration, s: the lag of the speed loop.
///
/// The mean acceleration over the lag avoids noise of the speed log in the first second of a plan,
/// to which the loop could not respond anyway.
pub(crate) fn speed_lead(craft: &CraftModel) -> f64 {
    craft.surge_lag().clamp(SPEED_LEAD_MIN, SPEED_LEAD_MAX)
}

/// The inverse of the speed loop's response: the reference that makes a loop with the lag T, delay
/// included, time constant T_u and bias b accelerate as planned, held for one second.
///
/// ```text
/// a = (u(t + lead) − u)/lead        u_ref = u + (T + ½ s) a − T_u b
/// ```
/// The whole lag leads: the delay of a second-order loop is no dead time, and a reference that
/// treats it as one brakes too late, see `docs/rationale.md#references`.
pub(crate) fn invert_response(
    speed_now: f64,
    planned: &Reference,
    bias: f64,
    craft: &CraftModel,
) -> Reference {
    let limits = &craft.limits;
    let acceleration = (planned.speed - speed_now) / speed_lead(craft);
    // A loop faster than the interval settles within it.
    let lead = craft.surge_lag().max(HALF_HOLD) + HALF_HOLD;
    let speed = speed_now + lead * acceleration - craft.surge_time * bias;
    Reference { speed: speed.clamp(limits.speed_min, limits.speed_max), heading: planned.heading }
}

/// The reference behind the slew limiter: its heading turns at most at `rate` from the previous
/// one, rad/s, unless that leads into a keep-out. Successive plans may want opposite turns.
pub(crate) fn slew_limited(asked: Reference, horizon: &Horizon<'_>, rate: f64) -> Reference {
    let snapshot = horizon.snapshot;
    let limited = horizon.followed.map(|followed| {
        let bow = snapshot.asc.heading();
        let slew = Slew::of(&horizon.craft, rate, followed.age);
        limited_heading(asked.heading, followed.heading, bow, slew)
    });
    match limited {
        Some(heading) if !leads_into_a_keep_out(heading, asked.speed, snapshot) => {
            Reference { heading, ..asked }
        }
        Some(_) | None => asked,
    }
}

/// `true` if a craft on `heading` would enter a keep-out within [`KEEP_OUT_FORESIGHT`].
fn leads_into_a_keep_out(heading: Heading, speed: f64, snapshot: &Snapshot) -> bool {
    let velocity = heading.unit() * speed.max(snapshot.asc.speed_mps) + snapshot.current();
    let position = snapshot.asc.position();
    let ahead = position + velocity * KEEP_OUT_FORESIGHT;
    let blocked = || snapshot.land().sides.block(&position, &ahead, 0.0);
    let toward_disc = snapshot.keep_outs.iter().any(|disc| {
        let outward = snapshot.asc.position() - disc.centre();
        let gap = outward.norm() - disc.radius_m;
        let closing = outward.try_normalize(f64::EPSILON).map_or(0.0, |outward| -velocity.dot(&outward));
        gap < closing * KEEP_OUT_FORESIGHT
    });
    toward_disc || blocked()
}
