//! Where the surface craft is to be, seen from what it follows.

use nalgebra::Vector2;

use crate::{
    facts::angle::{Course, ned_from_body, wrap},
    predict::motion::Motion,
};

/// Half the interval over which a course's rate is measured, s. The error, of second order in it, is below
/// 10⁻⁹ rad/s for a vehicle that turns by a radian in a second, and rounding is four digits below that.
const RATE_INTERVAL: f64 = 1e-4;

/// Interval in which the time is looked for when what is followed came to rest, s: a stop and a start between two
/// looks are no rest.
const REST_INTERVAL: f64 = 1.0;

/// Farthest ahead that a rest is looked at, s: ten times a usual horizon.
const REST_AHEAD_MAX: f64 = 780.0;

/// Halvings of that interval: to a microsecond.
const REST_HALVINGS: u32 = 20;

/// Axes that an offset is given in: first ahead, then to starboard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axes {
    /// Direction of the first, rad, clockwise from north.
    pub(crate) angle: f64,
    /// Its rate, rad/s.
    pub(crate) rate: f64,
}

impl Axes {
    /// North and east.
    pub(crate) const NED: Self = Self {
        angle: 0.0,
        rate: 0.0,
    };

    /// Along the course of a `velocity` over time, `ahead` seconds after the snapshot. At rest, that is below `slowest`, m/s,
    /// they stand as they stood when the rest began, where that was after the snapshot, else as `held`.
    pub(crate) fn along_course(
        velocity: impl Fn(f64) -> Vector2<f64>,
        slowest: f64,
        ahead: f64,
        held: Course,
    ) -> Self {
        let course = |time| Course::of(&velocity(time)).radians();
        let moves = |time| slowest <= velocity(time).norm();
        if moves(ahead) {
            let turned = wrap(course(ahead + RATE_INTERVAL) - course(ahead - RATE_INTERVAL));
            return Self {
                angle: course(ahead),
                rate: 0.5 * turned / RATE_INTERVAL,
            };
        }
        let mut resting = ahead.min(REST_AHEAD_MAX);
        while 0.0 < resting {
            let before = (resting - REST_INTERVAL).max(0.0);
            if moves(before) {
                return Self {
                    angle: course(last_moving(moves, before, resting)),
                    rate: 0.0,
                };
            }
            resting = before;
        }
        Self {
            angle: held.radians(),
            rate: 0.0,
        }
    }
}

/// The last time at which it `moves`, between one at which it does and one at which it does not.
fn last_moving(moves: impl Fn(f64) -> bool, mut moving: f64, mut resting: f64) -> f64 {
    for _ in 0..REST_HALVINGS {
        let middle = 0.5 * (moving + resting);
        *(if moves(middle) { &mut moving } else { &mut resting }) = middle;
    }
    moving
}

/// The motion of a place at `by` from one that moves so.
///
/// ```text
/// p = p_d + R(α) o        v = v_d + α̇ × R(α) o
/// ```
pub(crate) fn displaced(followed: &Motion, by: &Vector2<f64>, axes: Axes) -> Motion {
    let arm = ned_from_body(axes.angle) * by;
    Motion {
        position: followed.position + arm,
        velocity: followed.velocity + Vector2::new(-arm.y, arm.x) * axes.rate,
    }
}
