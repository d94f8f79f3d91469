//! Desired position of the surface craft relative to the followed point.

use nalgebra::Vector2;

use crate::{
    facts::{
        angle::{Course, ned_from_body, wrap},
        bisection::last_at_which,
    },
    predict::motion::Motion,
};

/// Half interval of a course's difference quotient, s. For a vehicle that turns by a radian per
/// second its error, of second order, is below 10⁻⁹ rad/s, and rounding is four digits smaller.
const RATE_INTERVAL: f64 = 1e-4;

/// Interval of the search for the beginning of a rest, s; shorter rests are missed.
const REST_INTERVAL: f64 = 1.0;

/// Longest search for a rest, s: ten times a usual horizon.
const REST_AHEAD_MAX: f64 = 780.0;

/// Bisections of that interval: to a microsecond.
const REST_HALVINGS: u32 = 20;

/// Axes of an offset: first ahead, then to starboard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axes {
    /// Direction of the first axis, rad, clockwise from north.
    pub(crate) angle: f64,
    /// Its rate, rad/s.
    pub(crate) rate: f64,
}

impl Axes {
    /// North and east.
    pub(crate) const NED: Self = Self { angle: 0.0, rate: 0.0 };

    /// Along the course of a `velocity` over time, `ahead` s from now. At rest, below `slowest`,
    /// the axes are those when the rest began, or `held` if before the snapshot.
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
            return Self { angle: course(ahead), rate: 0.5 * turned / RATE_INTERVAL };
        }
        let mut resting = ahead.min(REST_AHEAD_MAX);
        while 0.0 < resting {
            let before = (resting - REST_INTERVAL).max(0.0);
            if moves(before) {
                let last = last_at_which(moves, [before, resting], REST_HALVINGS);
                return Self { angle: course(last), rate: 0.0 };
            }
            resting = before;
        }
        Self { angle: held.radians(), rate: 0.0 }
    }
}

/// The motion of a point displaced by `by`.
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
