//! Laws that planners of other vessels are compared with: line of sight with a side step. They hear
//! the same vessels, keep the same distance, and average velocities over the same time.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::str::FromStr;

use nalgebra::Vector2;
use planner::AuvState;
use planner::angle::{angle_of, direction, wrap};
use planner::snapshot::Vessel;

use crate::SEPARATION;

/// Rate at which a law closes its distance from the AUV, 1/s.
const PURSUIT: f64 = 0.1;
/// Time over which velocities of vessels are averaged, s.
const MEMORY: f64 = 60.0;
/// The end of a sidelight's sector, from the bow, rad.
const ABAFT_THE_BEAM: f64 = 0.625 * PI;

/// How the craft is steered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Law {
    Planner,
    /// The velocity nearest to the wanted one that meets no vessel within a time, s, and leaves
    /// those from ahead and from starboard to port. Share of the distance by which it passes
    /// farther off.
    VelocityObstacle {
        ahead: f64,
        margin: f64,
    },
    /// The wanted velocity, pushed away from where vessels would be nearest, over a distance, m.
    PotentialField {
        ahead: f64,
        push: f64,
    },
}

impl FromStr for Law {
    type Err = String;

    /// `planner`, `velocity_obstacle:AHEAD:MARGIN` or `potential_field:AHEAD:PUSH`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or("");
        let mut number = |default: f64| parts.next().and_then(|part| part.parse().ok()).unwrap_or(default);
        match name {
            "planner" => Ok(Self::Planner),
            "velocity_obstacle" => Ok(Self::VelocityObstacle { ahead: number(120.0), margin: number(0.3) }),
            "potential_field" => Ok(Self::PotentialField { ahead: number(120.0), push: number(100.0) }),
            _ => Err(format!("no law {name}")),
        }
    }
}

/// A vessel as a law sees it: position and velocity now, and the distance to keep.
#[derive(Clone, Copy, Debug)]
struct Seen {
    place: Vector2<f64>,
    velocity: Vector2<f64>,
    radius: f64,
}

/// Averaged velocities of the vessels, with the time of the last report, s.
#[derive(Default)]
pub(crate) struct Memory(Vec<Option<(f64, Vector2<f64>)>>);

impl Memory {
    fn see(&mut self, heard: &[Option<Vessel>], now: f64) -> Vec<Seen> {
        self.0.resize(heard.len(), None);
        let seen = heard.iter().zip(&mut self.0).filter_map(|(vessel, known)| {
            let vessel = vessel.as_ref()?;
            let (time, speed) = (vessel.t_s?, vessel.speed_mps?);
            let given = direction(vessel.course_rad.unwrap_or(0.0)) * speed;
            let velocity = match *known {
                Some((before, velocity)) => {
                    velocity + (given - velocity) * ((time - before) / MEMORY).min(1.0)
                }
                None => given,
            };
            *known = Some((time, velocity));
            let place = Vector2::new(vessel.north_m, vessel.east_m) + velocity * (now - time);
            Some(Seen { place, velocity, radius: SEPARATION + 0.5 * vessel.length_m.unwrap_or(20.0) })
        });
        seen.collect()
    }
}

impl Law {
    /// Speed and heading of the craft at `position` that follows `auv`, in still water.
    pub(crate) fn steer(
        self,
        memory: &mut Memory,
        heard: &[Option<Vessel>],
        (now, position, velocity): (f64, Vector2<f64>, Vector2<f64>),
        auv: &AuvState,
        speed_max: f64,
    ) -> (f64, f64) {
        let wanted = auv.velocity() + (auv.position() - position) * PURSUIT;
        let wanted = wanted.cap_magnitude(speed_max);
        let seen = memory.see(heard, now);
        let chosen = match self {
            Self::Planner => wanted,
            Self::VelocityObstacle { ahead, margin } => {
                beside(&seen, position, velocity, wanted, ahead, 1.0 + margin, speed_max)
            }
            Self::PotentialField { ahead, push } => {
                let pushes = seen.iter().map(|seen| {
                    let there = position - seen.place;
                    let relative = wanted - seen.velocity;
                    let time = nearest(&there, &relative).clamp(0.0, ahead);
                    let off = there + relative * time;
                    let clearance = (off.norm() - seen.radius).max(0.0);
                    let near = (1.0 - clearance / push).max(0.0) * (1.0 - time / ahead);
                    let away =
                        off.try_normalize(1.0).unwrap_or_else(|| direction(angle_of(&wanted) + FRAC_PI_2));
                    away * 2.0 * speed_max * near
                });
                (wanted + pushes.sum::<Vector2<f64>>()).cap_magnitude(speed_max)
            }
        };
        (chosen.norm(), angle_of(&chosen))
    }
}

/// Time at which a point at `there` is nearest to the origin, s.
fn nearest(there: &Vector2<f64>, relative: &Vector2<f64>) -> f64 {
    -there.dot(relative) / relative.norm_squared().max(1e-9)
}

/// The velocity nearest to `wanted` that keeps clear; if none does, that which does longest.
fn beside(
    seen: &[Seen],
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    wanted: Vector2<f64>,
    ahead: f64,
    wider: f64,
    speed_max: f64,
) -> Vector2<f64> {
    let breaks = |candidate: &Vector2<f64>, seen: &Seen| {
        let (there, relative) = (position - seen.place, candidate - seen.velocity);
        let time = nearest(&there, &relative).clamp(0.0, ahead);
        let is_near = (there + relative * time).norm() < wider * seen.radius;
        // To starboard of the craft's way, or ahead: it is left to port.
        let bearing = wrap(angle_of(&-there) - angle_of(&wanted));
        let gives_way = -0.26 < bearing && bearing < ABAFT_THE_BEAM && seen.velocity.norm() > 0.25;
        let direct = nearest(&there, &(wanted - seen.velocity)).clamp(0.0, ahead);
        let meets = (there + (wanted - seen.velocity) * direct).norm() < wider * seen.radius;
        let wrong = gives_way && meets && 0.0 < time && relative.perp(&there) < 0.0;
        (is_near || wrong).then_some(if is_near { time } else { ahead })
    };
    let courses = (0..48).map(|k| direction(TAU * f64::from(k) / 48.0));
    let grid = courses.flat_map(|course| [0.25, 0.5, 0.75, 1.0].map(|share| course * share * speed_max));
    let cost = |candidate: &Vector2<f64>| {
        let first = seen.iter().filter_map(|seen| breaks(candidate, seen)).fold(f64::INFINITY, f64::min);
        let off = (candidate - wanted).norm() + 0.2 * (candidate - velocity).norm();
        if first.is_finite() { 1e3 - first + 1e-2 * off } else { off }
    };
    let all = grid.chain([wanted, Vector2::zeros()]);
    all.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(wanted)
}
