//! The Maritime Robotics Otter, a catamaran of 2.0 m by 1.08 m, from its published model.

use super::{CoriolisMasses, SurfaceHull, Thrusters};
use crate::world::hull::Drag;

/// Acceleration of gravity as the published model has it, m/s².
const GRAVITY: f64 = 9.81;
/// Mass of the hull, kg.
const HULL_MASS: f64 = 55.0;
/// Mass of the payload, kg, in the published simulator; the craft takes up to 45 kg.
const PAYLOAD: f64 = 25.0;
/// Dry mass, kg.
const MASS: f64 = HULL_MASS + PAYLOAD;
/// Centre of gravity of hull and payload ahead of midships, m: the hull's 0.2 m, the payload's 0.
const GRAVITY_AHEAD: f64 = HULL_MASS * 0.2 / MASS;
/// Radius of gyration of the hull in yaw, m: a quarter of the length.
const GYRATION: f64 = 0.25 * 2.0;
/// Moment of inertia I_z of the published model, the basis of the added inertia, kg m² (14.8).
const INERTIA: f64 = HULL_MASS * (GYRATION * GYRATION + GRAVITY_AHEAD * GRAVITY_AHEAD);
/// Moment of inertia in yaw about midships with 1.7 I_z of added inertia, kg m² (41.4).
const INERTIA_YAW: f64 = INERTIA + MASS * GRAVITY_AHEAD * GRAVITY_AHEAD + 1.7 * INERTIA;
/// Mass with added mass in sway, 1.5 times the hull's, kg (162.5).
const MASS_SWAY: f64 = MASS + 1.5 * HULL_MASS;
/// Time constant of sway, s.
const SWAY_TIME: f64 = 1.0;
/// Time constant of slow yaw, s.
const YAW_TIME: f64 = 1.0;
/// Bollard pull ahead of both thrusters together, N.
const PULL_AHEAD: f64 = 24.4 * GRAVITY;
/// Bollard pull astern of both thrusters together, N.
const PULL_ASTERN: f64 = 13.6 * GRAVITY;
/// Top speed, m/s: 6 knots.
const SPEED_MAX: f64 = 6.0 * 0.5144;
/// Cross-flow drag of a strip of hull, ½ ρ T C_d, N/(m/s)² per m.
///
/// T = 80 kg / (1025 kg/m³ · 2 pontoons · block coefficient 0.4 · 0.25 m · 2.0 m) = 0.195 m, the
/// draught; Hoerner's curve gives C_d = 1.0 at beam / 2T = 0.25 / 0.39.
const CROSS_FLOW: f64 = 0.5 * 1025.0 * 0.195 * 1.0;
/// Length, m.
const LENGTH: f64 = 2.0;

impl SurfaceHull {
    /// The Maritime Robotics Otter with 25 kg of payload, 80 kg in all: top speed 3.09 m/s.
    ///
    /// Source: `otter.m` of T. I. Fossen's Marine Systems Simulator and `otter.py` of his Python
    /// Vehicle Simulator (MIT licence), with six degrees of freedom: masses, added masses, bollard
    /// pull, arms, linear drags by speed and time constants, the yaw drag's factor 1 + 10 |r|.
    /// Departures: surge, sway and yaw alone, without their coupling by the centre of gravity,
    /// 0.14 m ahead. Cross-flow drag, there a sum over strips of |v + x r| (v + x r), is that of
    /// pure sway, ½ρT C_d L |v| v, and of pure yaw, ½ρT C_d L⁴/32 |r| r.
    ///
    /// The Coriolis terms have the dry mass: the Munk moment of added masses makes the open loop
    /// unstable above 1.0 m/s, which the published code names, and cancels in the same way.
    ///
    /// Thrust follows its command with 0.1 s; versions of `otter.py` have 0.1 and 1 s for the
    /// shaft. The dead zone is an assumption for want of a public value: 1 N, at 9.5 rad/s of the
    /// shaft.
    pub const OTTER: Self = Self {
        mass_surge: MASS + 0.1 * HULL_MASS,
        mass_sway: MASS_SWAY,
        inertia_yaw: INERTIA_YAW,
        coriolis: CoriolisMasses { surge: MASS, sway: MASS },
        drag_surge: Drag { linear: PULL_AHEAD / SPEED_MAX, quadratic: 0.0 },
        drag_sway: Drag { linear: MASS_SWAY / SWAY_TIME, quadratic: CROSS_FLOW * LENGTH },
        drag_yaw: Drag {
            linear: INERTIA_YAW / YAW_TIME,
            quadratic: 10.0 * INERTIA_YAW / YAW_TIME + CROSS_FLOW * LENGTH * LENGTH * LENGTH * LENGTH / 32.0,
        },
        thrusters: Thrusters {
            ahead_max: 0.5 * PULL_AHEAD,
            astern_max: 0.5 * PULL_ASTERN,
            arm: 0.395,
            dead_zone: 1.0,
            lag: 0.1,
        },
    };
}
