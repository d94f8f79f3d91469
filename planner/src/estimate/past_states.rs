//! Past states of a vehicle given as `state`: evidence like reports.

use nalgebra::Vector2;

use crate::{
    facts::{
        angle::Course,
        evidence::{AuvState, GroundTrack, Report},
        ranges::{AUV_SPEED_MAX, FORESEEN, REPORT_SIGMA_MAX, REPORT_SIGMA_MIN, TIME},
    },
    tuned::EstimateNumbers,
};

/// A past state: time, s, place, m, its standard deviation, m, and velocity over ground, m/s.
pub(crate) type PastState = [f64; 6];

/// Most past states, the newest ones: eight minutes. Corners of the track remember older ones.
pub(crate) const PAST_STATES_MAX: usize = 48;

/// Least interval between two, s: closer ones have the same errors, and take time.
const INTERVAL_MIN: f64 = 10.0;

/// Largest error of the distance between two, in standard deviations.
const DEVIATIONS_MAX: f64 = 5.0;

/// The `state` of a vehicle at time `now`, s.
pub(crate) fn past_state(state: &AuvState, now: f64, tuned: &EstimateNumbers) -> PastState {
    let sigma =
        state.covariance().map_or(tuned.state_sigma, |known| (0.5 * (known.m11 + known.m22)).max(0.0).sqrt());
    let velocity = state.velocity();
    [
        now - state.age_s,
        state.north_m,
        state.east_m,
        sigma.clamp(REPORT_SIGMA_MIN, REPORT_SIGMA_MAX),
        velocity.x,
        velocity.y,
    ]
}

/// The newest of the `remembered` states before `until`, s; none if they are no valid list.
pub(crate) fn before(remembered: &[PastState], until: f64) -> &[PastState] {
    let newest = &remembered[remembered.len().saturating_sub(PAST_STATES_MAX)..];
    let is_state = |[time, north, east, sigma, velocity @ ..]: &PastState| {
        TIME.contains(time)
            && [north, east].into_iter().all(|along| FORESEEN.contains(along))
            && (REPORT_SIGMA_MIN..=REPORT_SIGMA_MAX).contains(sigma)
            // The norm of a velocity of the largest speed may be rounded up.
            && Vector2::from(*velocity).norm() <= AUV_SPEED_MAX * (1.0 + 1e-9)
    };
    if newest.iter().all(is_state) && newest.windows(2).all(|pair| pair[0][0] < pair[1][0]) {
        &newest[..newest.partition_point(|past| past[0] < until)]
    } else {
        &[]
    }
}

/// The `past` with its `newest` state, unless they are too close: what the next request needs.
pub(crate) fn kept(past: &[PastState], newest: PastState) -> Vec<PastState> {
    let is_apart = past.last().is_none_or(|last| INTERVAL_MIN <= newest[0] - last[0]);
    let kept = past.iter().copied().chain(is_apart.then_some(newest));
    kept.skip((past.len() + usize::from(is_apart)).saturating_sub(PAST_STATES_MAX)).collect()
}

/// `true` if a vehicle cannot have come there from `last`, even at twice the speed of either.
pub(crate) fn is_jump(last: &PastState, newest: &PastState) -> bool {
    let [from, to] = [last, newest].map(as_report);
    let speed =
        [from, to].iter().filter_map(Report::ground_track).map(|track| track.speed).fold(0.0, f64::max);
    let explained = 2.0 * speed * (to.t_s - from.t_s) + DEVIATIONS_MAX * from.sigma_m.hypot(to.sigma_m);
    explained < (to.position() - from.position()).norm()
}

pub(crate) fn as_report([t_s, north, east, sigma, velocity @ ..]: &PastState) -> Report {
    let velocity = Vector2::from(*velocity);
    Report::new(*t_s, Vector2::new(*north, *east), *sigma)
        .with_ground_track(Some(GroundTrack { course: Course::of(&velocity), speed: velocity.norm() }))
}
