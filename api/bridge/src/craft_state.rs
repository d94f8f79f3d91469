//! The newest trustworthy measurements of the surface craft as one state.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use planner::angle::direction;

use crate::current_observer::CurrentObserver;
use crate::integrity::{Alarm, Integrity, Source};
use crate::recent_positions::moved;
use crate::{CraftMeasurement, Origin};

/// Greatest difference of times within one state, s.
const AGE_MAX_S: f64 = 2.0;

/// Speed below which a missing course means rest, m/s: receivers know courses from 0.1 to 0.5 m/s.
const REST_SPEED: f64 = 0.5;

/// A value and the time of its measurement, s.
type Dated<T> = Option<(f64, T)>;

/// The measurements so far. Times are on one clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct CraftState {
    pub(crate) integrity: Integrity,
    position: Dated<Origin>,
    heading: Dated<f64>,
    yaw_rate: Dated<f64>,
    ground_velocity: Dated<Vector2<f64>>,
    pub(crate) water_velocity: Dated<Vector2<f64>>,
    pub(crate) current: CurrentObserver,
    velocity_bias: VelocityBias,
}

/// The constant error of the velocity over ground, along the craft's axes, from positions.
///
/// ```text
/// ḃ = (v̄ − Δp/Δt − b)/T        v̄: mean velocity of an interval;  Δp: displacement in it
/// ```
/// A filter's velocity may be off by some cm/s on a straight course (ArduPilot's by 0.02 m/s in its
/// simulator). The craft then misses its goal by that error times the guidance's time constant.
/// Positions do not drift.
#[derive(Clone, Debug, Default)]
struct VelocityBias {
    bias: Vector2<f64>,
    start: Option<(f64, Origin)>,
    sum: Vector2<f64>,
    count: f64,
}

/// Length of the intervals over which positions and velocities are compared, s.
const BIAS_INTERVAL_S: f64 = 2.0;
/// Greatest length of an interval without gaps, s.
const BIAS_GAP_MAX_S: f64 = 4.0;
/// T of the equation, s: long compared with the noise of positions, short compared with a leg.
const BIAS_TIME_S: f64 = 20.0;
/// Greatest difference without a jump of the position, m/s.
const BIAS_MAX: f64 = 0.2;

impl VelocityBias {
    /// Takes the velocity `over_ground` (north, east), m/s, measured at `t_s`, s, at `heading`,
    /// rad, and `position`. Returns it without the bias.
    fn corrected(
        &mut self,
        t_s: f64,
        heading: f64,
        position: &Origin,
        over_ground: &Vector2<f64>,
    ) -> Vector2<f64> {
        let (bow, starboard) = (direction(heading), direction(heading + FRAC_PI_2));
        self.sum += over_ground;
        self.count += 1.0;
        let (start_s, from) = *self.start.get_or_insert((t_s, *position));
        let span = t_s - start_s;
        if !(0.0..=BIAS_GAP_MAX_S).contains(&span) {
            self.begin(t_s, position, over_ground);
        } else if span >= BIAS_INTERVAL_S {
            let off = self.sum / self.count - moved(&from, position) / span;
            if off.norm() <= BIAS_MAX {
                let body = Vector2::new(bow.dot(&off), starboard.dot(&off));
                self.bias += (body - self.bias) * (span / BIAS_TIME_S);
            }
            self.begin(t_s, position, over_ground);
        }
        over_ground - bow * self.bias.x - starboard * self.bias.y
    }

    fn begin(&mut self, t_s: f64, position: &Origin, over_ground: &Vector2<f64>) {
        self.start = Some((t_s, *position));
        self.sum = *over_ground;
        self.count = 1.0;
    }
}

/// The state of the craft at one moment, in the service's terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeasuredState {
    pub(crate) t_s: f64,
    pub(crate) position: Origin,
    pub(crate) heading: f64,
    /// Velocity through the water (ahead, to starboard), m/s, measured or estimated.
    pub(crate) water_velocity: Vector2<f64>,
    /// Yaw rate, rad/s, positive clockwise; 0 if it is not measured.
    pub(crate) yaw_rate: f64,
    /// Velocity over ground (north, east), m/s.
    pub(crate) ground_velocity: Option<Vector2<f64>>,
    /// Estimated current (north, east), m/s; none if the velocity through the water is measured.
    pub(crate) current: Option<Vector2<f64>>,
}

impl MeasuredState {
    /// Speed over ground, m/s, or surge through the water if that is unknown.
    pub(crate) fn speed(&self) -> f64 {
        self.ground_velocity.map_or(self.water_velocity.x, |velocity| velocity.norm())
    }
}

impl CraftState {
    /// Takes the measurement of `source` at `t_s`, s, unless it is contradicted.
    pub(crate) fn take(&mut self, t_s: f64, source: Source, measured: &CraftMeasurement) {
        if !self.integrity.admits(t_s, source, measured) {
            return;
        }
        match *measured {
            CraftMeasurement::Position(position) => self.position = Some((t_s, position)),
            CraftMeasurement::Heading(heading) => self.heading = Some((t_s, heading)),
            CraftMeasurement::YawRate(rate) => self.yaw_rate = Some((t_s, rate)),
            CraftMeasurement::WaterVelocity(velocity) => self.water_velocity = Some((t_s, velocity)),
            CraftMeasurement::GroundVelocity(velocity) => self.take_ground_velocity(t_s, &velocity),
            CraftMeasurement::GroundSpeed(speed) => {
                let is_at_rest = speed < REST_SPEED;
                let ahead = || fresh(self.heading, t_s).map(direction);
                let moving = self.integrity.recent.velocity();
                let course = match moving.and_then(|moved| moved.try_normalize(REST_SPEED)) {
                    _ if is_at_rest => Some(Vector2::zeros()),
                    moving => moving.or_else(ahead),
                };
                if let Some(course) = course {
                    self.take_ground_velocity(t_s, &(course * speed));
                }
                if is_at_rest {
                    // A guess contradicts nothing.
                    self.integrity.recent.travel_unmeasured();
                }
            }
        }
    }

    fn take_ground_velocity(&mut self, t_s: f64, measured: &Vector2<f64>) {
        if !self.integrity.admits_velocity(t_s, *measured) {
            return;
        }
        let (heading, position) = (fresh(self.heading, t_s), fresh(self.position, t_s));
        let velocity = match heading.zip(position) {
            Some((heading, position)) => self.velocity_bias.corrected(t_s, heading, &position, measured),
            None => *measured,
        };
        self.ground_velocity = Some((t_s, velocity));
        if let Some(heading) = heading {
            let yaw_rate = fresh(self.yaw_rate, t_s).unwrap_or(0.0);
            self.current.update(t_s, heading, yaw_rate, &velocity);
        }
    }

    /// The state at the newest position; `None` without position, heading or velocity, or during an
    /// alarm that stops. Without a measured velocity it has that of the positions.
    pub(crate) fn newest(&self) -> Option<MeasuredState> {
        if self.distrusted().is_some() {
            return None;
        }
        let (t_s, position) = self.position?;
        let heading = fresh(self.heading, t_s)?;
        let ground_velocity = fresh(self.ground_velocity, t_s).or_else(|| self.integrity.recent.velocity());
        let measured = fresh(self.water_velocity, t_s);
        let inferred = ground_velocity.map(|velocity| self.current.through_water(heading, &velocity));
        Some(MeasuredState {
            t_s,
            position,
            heading,
            water_velocity: measured.or(inferred)?,
            yaw_rate: fresh(self.yaw_rate, t_s).unwrap_or(0.0),
            ground_velocity,
            current: measured.is_none().then_some(self.current.current),
        })
    }

    /// The alarm that makes the state untrustworthy.
    pub(crate) fn distrusted(&self) -> Option<Alarm> {
        self.integrity.alarms().find(|alarm| alarm.stops())
    }

    pub(crate) fn missing(&self, now_s: f64) -> impl Iterator<Item = &'static str> {
        let position = fresh(self.position, now_s);
        let has_velocity = fresh(self.ground_velocity, now_s).is_some()
            || fresh(self.water_velocity, now_s).is_some()
            || position.is_some() && self.integrity.recent.velocity().is_some();
        let parts = [
            ("no position", position.is_some()),
            ("no heading", fresh(self.heading, now_s).is_some()),
            ("no velocity", has_velocity),
        ];
        parts.into_iter().filter(|(_, is_known)| !is_known).map(|(name, _)| name)
    }
}

/// The value, if it was measured near `t_s`.
fn fresh<T: Copy>(dated: Dated<T>, t_s: f64) -> Option<T> {
    let (at, value) = dated?;
    ((t_s - at).abs() <= AGE_MAX_S).then_some(value)
}

#[cfg(test)]
mod fault_tests;
#[cfg(test)]
mod tests {
    use super::CraftMeasurement::{GroundSpeed, GroundVelocity, Heading, Position};
    use super::*;
    use crate::on_earth;

    const HERE: Origin = Origin { lat_deg: 38.0, lon_deg: -9.0 };

    fn take(state: &mut CraftState, t_s: f64, measured: CraftMeasurement) {
        state.take(t_s, Source::default(), &measured);
    }

    fn ground_velocity(state: &CraftState) -> Vector2<f64> {
        state.newest().and_then(|now| now.ground_velocity).expect("is measured")
    }

    /// Goes at 1 m/s over ground along `heading` for `seconds`; the filter reports 1.02 m/s.
    fn goes(state: &mut CraftState, start: Origin, start_s: f64, heading: f64, seconds: u32) -> Origin {
        let bow = direction(heading);
        let scale = (1.0 / 6_371_000.0_f64).to_degrees();
        let mut position = start;
        for tenth in 0..seconds * 10 {
            let t_s = start_s + 0.1 * f64::from(tenth);
            let gone = bow * (0.1 * f64::from(tenth)) * scale;
            position = Origin {
                lat_deg: start.lat_deg + gone.x,
                lon_deg: start.lon_deg + gone.y / start.lat_deg.to_radians().cos(),
            };
            take(state, t_s, Heading(heading));
            take(state, t_s, Position(position));
            take(state, t_s, GroundVelocity(bow * 1.02));
        }
        position
    }

    #[test]
    fn a_velocity_that_positions_contradict_is_corrected_on_every_heading() {
        for start in [(38.0, -9.0), (-60.0, 179.9999)] {
            let start = on_earth(start.0, start.1).expect("is on Earth");
            let mut state = CraftState::default();
            let there = goes(&mut state, start, 0.0, 0.5, 100);
            goes(&mut state, there, 100.0, 2.6, 20);
            let velocity = ground_velocity(&state);
            assert!((velocity - direction(2.6)).norm() < 0.002, "{velocity}");
        }
    }

    #[test]
    fn a_jump_of_the_position_is_no_velocity() {
        let mut state = CraftState::default();
        let there = goes(&mut state, HERE, 0.0, 0.5, 60);
        let far = Origin { lat_deg: there.lat_deg + 0.01, ..there };
        goes(&mut state, far, 60.0, 0.5, 4);
        let velocity = ground_velocity(&state);
        assert!((velocity - direction(0.5)).norm() < 0.01, "{velocity}");
    }

    #[test]
    fn a_craft_at_rest_has_a_state_if_its_receiver_omits_the_course() {
        let mut state = CraftState::default();
        // A minute at rest, then one without any velocity: receivers differ.
        for second in 0..120_u8 {
            let t_s = f64::from(second);
            take(&mut state, t_s, Position(HERE));
            take(&mut state, t_s, Heading(1.0));
            if second < 60 {
                take(&mut state, t_s, GroundSpeed(0.1));
            }
            let now = state.newest().expect("position, heading and a speed near zero are a state");
            assert_eq!((now.t_s, now.heading), (t_s, 1.0));
            assert_eq!(now.ground_velocity, Some(Vector2::zeros()));
            assert_eq!(now.water_velocity, Vector2::zeros());
        }
    }

    #[test]
    fn a_speed_without_a_course_has_the_direction_of_positions_or_of_the_bow() {
        let mut state = CraftState::default();
        take(&mut state, 0.0, Position(HERE));
        take(&mut state, 0.0, Heading(0.3));
        take(&mut state, 0.0, GroundSpeed(1.0));
        let ahead = ground_velocity(&state);
        assert!((ahead - direction(0.3)).norm() < 1e-12, "{ahead}");
        for second in 1..8_u8 {
            let t_s = f64::from(second);
            let north = Origin { lat_deg: HERE.lat_deg + (t_s / 6_371_000.0).to_degrees(), ..HERE };
            take(&mut state, t_s, Position(north));
            take(&mut state, t_s, Heading(0.3));
            take(&mut state, t_s, GroundSpeed(1.0));
        }
        let moved = ground_velocity(&state);
        // Two guesses along the heading count as a bias for a while.
        assert!((moved - Vector2::new(1.0, 0.0)).norm() < 0.03, "{moved}");
    }

    #[test]
    fn missing_measurements_are_named() {
        let mut state = CraftState::default();
        let missing = |state: &CraftState| state.missing(1.0).collect::<Vec<_>>();
        assert_eq!(missing(&state), ["no position", "no heading", "no velocity"]);
        take(&mut state, 0.0, Heading(1.0));
        take(&mut state, 0.0, Position(HERE));
        assert_eq!(missing(&state), ["no velocity"]);
        take(&mut state, 0.0, GroundSpeed(0.0));
        assert_eq!(missing(&state), Vec::<&str>::new());
    }

    #[test]
    fn measurements_that_are_too_old_make_no_state() {
        let mut state = CraftState::default();
        take(&mut state, 0.0, Heading(1.0));
        take(&mut state, 0.0, GroundVelocity(Vector2::zeros()));
        take(&mut state, 1.0, Position(HERE));
        assert!(state.newest().is_some());
        take(&mut state, 3.0, Position(HERE));
        assert!(state.newest().is_none());
    }
}
