//! Checks that the craft does as it is told. Unconfirmed references are sent and not called good.
//!
//! ```text
//! position   at most T old, and moved by d within T, if the craft makes way or should
//! heading    within e of the reference, or turned to it by max(Δ, share of the error) within T
//! ```
//! T is 1.5 s: the end of a motion is not confirmed 2 s later, and told within 3 s. Unrequested
//! turns neither confirm nor contradict: a rudder that sticks on a straight course is seen at the
//! first turn. A turn towards the reference confirms, whatever its cause.

use planner::angle::wrap;

use crate::{MeasuredState, Origin, recent_positions::moved, reference::Reference};

/// T, s: receivers and compasses send once a second, and a craft starts turning within a second.
const WITHIN_S: f64 = 1.5;
/// d, m: as for frozen positions (`integrity.rs`).
const MOVED_M: f64 = 0.1;
/// Speed of a craft that makes way, or should, m/s. Receivers report up to 0.2 m/s at rest.
const WAY: f64 = 0.3;
/// e, rad: lag, waves and crab of a craft that holds its heading.
const ON_HEADING: f64 = 0.2;
/// Δ, rad: ten standard deviations of a compass of 0.6°, smoothed.
const TURNED: f64 = 0.03;
/// Share of the error that a turn removes within T: that of a lag of 15 s.
const TURNED_SHARE: f64 = 0.1;
/// Time over which the heading is smoothed, s.
const SMOOTHED_S: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Confirmation {
    taken_s: f64,
    state_s: f64,
    /// Time of the last motion of the position, s, and the position then.
    moved_s: f64,
    place: Option<Origin>,
    /// Time when the heading was last right, s, and the smoothed heading then, rad.
    turned_s: f64,
    turned: f64,
    heading: f64,
}

impl Confirmation {
    /// Begins at `now`, s, with the first reference.
    pub(crate) fn begin(now: f64, state: &MeasuredState) -> Self {
        Self {
            taken_s: now,
            state_s: now,
            moved_s: now,
            place: None,
            turned_s: now,
            turned: state.heading,
            heading: state.heading,
        }
    }

    /// Takes the state at `now`, s, of a craft that was told `sent`.
    pub(crate) fn take(&mut self, now: f64, state: &MeasuredState, sent: &Reference) {
        let share = 1.0 - (-(now - self.taken_s) / SMOOTHED_S).exp();
        (self.taken_s, self.state_s) = (now, state.t_s);
        let speed = state.speed().abs();
        let has_moved = |place: Origin| moved(&place, &state.position).norm() > MOVED_M;
        let has_moved = self.place.is_none_or(has_moved);
        if has_moved || speed.max(sent.speed) < WAY {
            (self.moved_s, self.place) = (now, Some(state.position));
        }
        let error = wrap(sent.heading - state.heading);
        self.heading += share * wrap(state.heading - self.heading);
        let turned = wrap(self.heading - self.turned);
        if error.abs() <= ON_HEADING || turned * error.signum() >= TURNED.max(TURNED_SHARE * error.abs()) {
            (self.turned_s, self.turned) = (now, self.heading);
        } else if turned * error < 0.0 {
            self.turned = self.heading;
        }
    }

    /// The unconfirmed parts at `now`, s, in words.
    pub(crate) fn missing(&self, now: f64) -> impl Iterator<Item = &'static str> {
        let is_old = |at_s: f64| now - at_s > WITHIN_S;
        let is_silent = is_old(self.state_s);
        let (is_still, is_off) = (is_old(self.moved_s), is_old(self.turned_s));
        let parts = [
            ("no new position", is_silent),
            ("the position does not move", !is_silent && is_still),
            ("the heading does not turn as told", !is_silent && is_off),
        ];
        parts.into_iter().filter(|(_, is_missing)| *is_missing).map(|(words, _)| words)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Vector2;

    use super::*;

    /// The unconfirmed parts after `tenths` of a second at `at(t_s)`: m to the north, heading, age.
    fn unconfirmed(
        tenths: u32,
        sent: impl Fn(f64) -> Reference,
        at: impl Fn(f64) -> (f64, f64, f64),
    ) -> Vec<&'static str> {
        let state = |t_s: f64| {
            let (north_m, heading, age_s) = at(t_s);
            MeasuredState {
                t_s: t_s - age_s,
                position: Origin { lat_deg: 38.0 + north_m / 111_195.0, lon_deg: -9.0 },
                heading,
                water_velocity: Vector2::zeros(),
                yaw_rate: 0.0,
                ground_velocity: None,
                current: None,
            }
        };
        let mut confirmation = Confirmation::begin(0.0, &state(0.0));
        let mut t_s = 0.0;
        for tenth in 1..=tenths {
            t_s = 0.1 * f64::from(tenth);
            confirmation.take(t_s, &state(t_s), &sent(t_s));
        }
        confirmation.missing(t_s).collect()
    }

    fn north(speed: f64) -> impl Fn(f64) -> Reference {
        move |_| Reference { speed, heading: 0.0 }
    }

    #[test]
    fn motion_not_seen_for_two_seconds_is_not_confirmed() {
        assert_eq!(unconfirmed(20, north(1.0), |t_s| (0.0, 0.0, t_s)), ["no new position"]);
        assert_eq!(unconfirmed(20, north(1.0), |_| (0.0, 0.0, 0.0)), ["the position does not move"]);
        for stuck in [0.0, -0.1] {
            let east = |_: f64| Reference { speed: 1.0, heading: 0.5 };
            assert_eq!(
                unconfirmed(20, east, |t_s| (t_s, stuck * t_s, 0.0)),
                ["the heading does not turn as told"]
            );
        }
    }

    #[test]
    fn a_craft_at_rest_or_turning_late_or_yawing_in_waves_is_confirmed() {
        assert_eq!(unconfirmed(50, north(0.1), |_| (0.0, 0.0, 0.0)), [""; 0]);
        // A lag of 6 s, half a radian behind, and a sweep of 0.1 rad/s; ±4° of waves.
        let lag = |t_s: f64| (t_s, 0.5 - 0.5 * (-t_s / 6.0).exp(), 0.0);
        let east = |_: f64| Reference { speed: 1.0, heading: 0.5 };
        let sweep = |t_s: f64| Reference { speed: 1.0, heading: 0.6 + 0.1 * t_s };
        for tenths in 1..100 {
            assert_eq!(unconfirmed(tenths, east, lag), [""; 0]);
            assert_eq!(unconfirmed(tenths, sweep, |t_s| (t_s, 0.1 * t_s, 0.0)), [""; 0]);
            let waves = |t_s: f64| (t_s, 0.07 * (TAU * t_s / 6.0).sin(), 0.0);
            assert_eq!(unconfirmed(tenths, north(1.0), waves), [""; 0]);
        }
    }
}
