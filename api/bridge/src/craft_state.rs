//! The newest of everything measured of the surface craft, as one state.

use std::f64::consts::FRAC_PI_2;

use geodesy::direction;
use nalgebra::Vector2;

use crate::{CraftMeasurement, Geographic, current_observer::CurrentObserver, reference::wrapped};

/// Older measurements than this do not make a state with newer ones, s.
const AGE_MAX_S: f64 = 2.0;

/// Mean radius; the 0.3 % by which the ellipsoid differs are nothing over a few metres.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// A value and when it was measured, s.
type Dated<T> = Option<(f64, T)>;

/// What has been measured so far. Times are of one clock.
#[derive(Clone, Debug, Default)]
pub struct CraftState {
    position: Dated<Geographic>,
    heading: Dated<f64>,
    yaw_rate: Dated<f64>,
    ground_velocity: Dated<Vector2<f64>>,
    water_velocity: Dated<Vector2<f64>>,
    current: CurrentObserver,
    velocity_bias: VelocityBias,
}

/// What is constantly wrong with the measured velocity over ground, along the craft's axes, found from positions.
///
/// ```text
/// ḃ = (v̄ − Δp/Δt − b)/T        v̄: mean measured velocity of an interval;  Δp: how far the position moved in it
/// ```
/// A filter's velocity may be off by some cm/s for as long as the craft goes straight (ArduPilot's by 0.02 m/s in its simulator), and
/// a craft that is steered by it passes its goal by that much times the time constant of its guidance. Positions do not drift.
#[derive(Clone, Debug, Default)]
struct VelocityBias {
    bias: Vector2<f64>,
    start: Option<(f64, Geographic)>,
    sum: Vector2<f64>,
    count: f64,
}

/// Length of the intervals over which positions and velocities are compared, s.
const BIAS_INTERVAL_S: f64 = 2.0;
/// Longer ones had gaps.
const BIAS_GAP_MAX_S: f64 = 4.0;
/// T of the equation, s: long beside the noise of positions, short beside a leg.
const BIAS_TIME_S: f64 = 20.0;
/// Positions that moved otherwise by more than this have jumped, m/s.
const BIAS_MAX: f64 = 0.2;

impl VelocityBias {
    /// Takes the velocity `over_ground` (north, east), m/s, at `heading`, rad, as measured at `t_s`, s, at `position`. Answers the
    /// velocity without the bias.
    fn corrected(
        &mut self,
        t_s: f64,
        heading: f64,
        position: &Geographic,
        over_ground: &Vector2<f64>,
    ) -> Vector2<f64> {
        self.sum += over_ground;
        self.count += 1.0;
        let (start_s, from) = *self.start.get_or_insert((t_s, *position));
        let span = t_s - start_s;
        if !(0.0..=BIAS_GAP_MAX_S).contains(&span) {
            self.begin(t_s, position, over_ground);
        } else if span >= BIAS_INTERVAL_S {
            let off = self.sum / self.count - moved(&from, position) / span;
            if off.norm() <= BIAS_MAX {
                let body = Vector2::new(
                    direction(heading).dot(&off),
                    direction(heading + FRAC_PI_2).dot(&off),
                );
                self.bias += (body - self.bias) * (span / BIAS_TIME_S);
            }
            self.begin(t_s, position, over_ground);
        }
        over_ground - direction(heading) * self.bias.x - direction(heading + FRAC_PI_2) * self.bias.y
    }

    fn begin(&mut self, t_s: f64, position: &Geographic, over_ground: &Vector2<f64>) {
        self.start = Some((t_s, *position));
        self.sum = *over_ground;
        self.count = 1.0;
    }
}

/// The craft at one moment, as the service takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateNow {
    /// When it was so, s.
    pub t_s: f64,
    /// Where.
    pub position: Geographic,
    /// Heading, rad, true.
    pub heading: f64,
    /// Velocity through the water (ahead, to starboard), m/s: measured, or what the observer of the current makes of that over ground.
    pub water_velocity: Vector2<f64>,
    /// Yaw rate, rad/s, positive clockwise; 0 where none is measured.
    pub yaw_rate: f64,
    /// Velocity over ground (north, east), m/s.
    pub ground_velocity: Option<Vector2<f64>>,
    /// Current (north, east), m/s, that the observer took for the velocity through the water; none where that is measured.
    pub current: Option<Vector2<f64>>,
}

impl CraftState {
    /// Takes what was measured at `t_s`, s.
    pub fn take(&mut self, t_s: f64, measured: &CraftMeasurement) {
        match *measured {
            CraftMeasurement::Position(position) => self.position = Some((t_s, position)),
            CraftMeasurement::Heading(heading) => self.heading = Some((t_s, heading)),
            CraftMeasurement::YawRate(rate) => self.yaw_rate = Some((t_s, rate)),
            CraftMeasurement::WaterVelocity(velocity) => self.water_velocity = Some((t_s, velocity)),
            CraftMeasurement::GroundVelocity(measured) => {
                let heading = fresh(self.heading, t_s);
                let position = fresh(self.position, t_s);
                let velocity = match heading.zip(position) {
                    Some((heading, position)) => {
                        self.velocity_bias.corrected(t_s, heading, &position, &measured)
                    }
                    None => measured,
                };
                self.ground_velocity = Some((t_s, velocity));
                if let Some(heading) = heading {
                    let yaw_rate = fresh(self.yaw_rate, t_s).unwrap_or(0.0);
                    self.current.update(t_s, heading, yaw_rate, &velocity);
                }
            }
        }
    }

    /// The current (north, east), m/s, as far as it shows.
    #[must_use]
    pub fn current(&self) -> Vector2<f64> {
        self.current.current()
    }

    /// The state at the newest position; none before position, heading and a velocity have been measured, or while one of them
    /// is missing.
    #[must_use]
    pub fn newest(&self) -> Option<StateNow> {
        let (t_s, position) = self.position?;
        let heading = fresh(self.heading, t_s)?;
        let ground_velocity = fresh(self.ground_velocity, t_s);
        let measured = fresh(self.water_velocity, t_s);
        let inferred = ground_velocity.map(|velocity| self.current.through_water(heading, &velocity));
        Some(StateNow {
            t_s,
            position,
            heading,
            water_velocity: measured.or(inferred)?,
            yaw_rate: fresh(self.yaw_rate, t_s).unwrap_or(0.0),
            ground_velocity,
            current: measured.is_none().then(|| self.current.current()),
        })
    }
}

/// From one position to another one near it (north, east), m.
fn moved(from: &Geographic, to: &Geographic) -> Vector2<f64> {
    let north = (to.lat_deg - from.lat_deg).to_radians();
    // The shorter way, across the antimeridian too.
    let east = wrapped((to.lon_deg - from.lon_deg).to_radians());
    Vector2::new(north, east * from.lat_deg.to_radians().cos()) * EARTH_RADIUS_M
}

/// The value, if it was measured near `t_s`.
fn fresh<T: Copy>(dated: Dated<T>, t_s: f64) -> Option<T> {
    dated
        .filter(|(at, _)| (t_s - at).abs() <= AGE_MAX_S)
        .map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A craft that goes at 1 m/s over ground along `heading` for `seconds`, and whose filter takes that for 1.02 m/s.
    fn sailed(
        state: &mut CraftState,
        start: Geographic,
        start_s: f64,
        heading: f64,
        seconds: u32,
    ) -> Geographic {
        let bow = direction(heading);
        let scale = (1.0 / EARTH_RADIUS_M).to_degrees();
        let mut position = start;
        for tenth in 0..seconds * 10 {
            let t_s = start_s + 0.1 * f64::from(tenth);
            let gone = bow * (0.1 * f64::from(tenth)) * scale;
            position = Geographic {
                lat_deg: start.lat_deg + gone.x,
                lon_deg: start.lon_deg + gone.y / start.lat_deg.to_radians().cos(),
            };
            state.take(t_s, &CraftMeasurement::Heading(heading));
            state.take(t_s, &CraftMeasurement::Position(position));
            state.take(t_s, &CraftMeasurement::GroundVelocity(bow * 1.02));
        }
        position
    }

    #[test]
    fn a_velocity_that_positions_contradict_is_corrected_on_every_heading() {
        for start in [
            Geographic {
                lat_deg: 38.0,
                lon_deg: -9.0,
            },
            Geographic {
                lat_deg: -60.0,
                lon_deg: 179.9999,
            },
        ] {
            let mut state = CraftState::default();
            let there = sailed(&mut state, start, 0.0, 0.5, 100);
            sailed(&mut state, there, 100.0, 2.6, 20);
            let velocity = state
                .newest()
                .and_then(|now| now.ground_velocity)
                .expect("is measured");
            assert!((velocity - direction(2.6)).norm() < 0.002, "{velocity}");
        }
    }

    #[test]
    fn a_position_that_jumps_is_no_velocity() {
        let mut state = CraftState::default();
        let start = Geographic {
            lat_deg: 38.0,
            lon_deg: -9.0,
        };
        let there = sailed(&mut state, start, 0.0, 0.5, 60);
        let far = Geographic {
            lat_deg: there.lat_deg + 0.01,
            ..there
        };
        sailed(&mut state, far, 60.0, 0.5, 4);
        let velocity = state
            .newest()
            .and_then(|now| now.ground_velocity)
            .expect("is measured");
        assert!((velocity - direction(0.5)).norm() < 0.01, "{velocity}");
    }

    #[test]
    fn what_is_too_old_makes_no_state() {
        let mut state = CraftState::default();
        let here = Geographic {
            lat_deg: 1.0,
            lon_deg: 2.0,
        };
        state.take(0.0, &CraftMeasurement::Heading(1.0));
        state.take(0.0, &CraftMeasurement::GroundVelocity(Vector2::zeros()));
        state.take(1.0, &CraftMeasurement::Position(here));
        assert!(state.newest().is_some());
        state.take(3.0, &CraftMeasurement::Position(here));
        assert!(state.newest().is_none());
    }
}
