//! Where each AUV will be: closed forms of time, so that any grid may sample them.

mod along_path;
#[cfg(test)]
mod along_path_tests;
mod dive;
#[cfg(test)]
mod dive_tests;
mod doubt;
#[cfg(test)]
mod doubt_tests;
mod drift;
#[cfg(test)]
mod drift_tests;

use along_path::{AlongPath, Stretch};
pub(crate) use along_path::{place_on_path, speed_along};
use dive::DepthForecast;
use nalgebra::{Matrix2, Matrix4, Vector2};

use crate::{
    angle::{angle_of, direction},
    snapshot::{Auv, AuvState, Dive, ForecastChoice, ForecastModel, KnownPath},
};

/// Slower than this over ground, an AUV counts as standing still, m/s.
///
/// A quarter of the slowest horizontal speed of the vehicles at hand (0.193 m/s): under it the
/// course is noise.
pub const SPEED_AT_REST: f64 = 0.05;

/// A course that turns slower than this is forecast as straight by [`ForecastChoice::Auto`], rad/s.
///
/// Over the default horizon of 78 s it amounts to 9°.
const TURN_RATE_STRAIGHT: f64 = 0.002;

/// Farther than this from its path, an AUV is not on it yet, and [`ForecastChoice::Auto`] guesses from its motion
/// alone, m.
///
/// Assumption: ten standard deviations of an acoustic fix (1.5 m); less than any lane is long.
pub(crate) const OFFSET_FROM_PATH_MAX: f64 = 15.0;

/// An AUV that was last heard of longer ago is not forecast: it is held where it was, s. Assumption: in an hour a current
/// that is not known carries it as far as any forecast is long.
pub const FORECAST_AGE_MAX: f64 = 3600.0;

/// An AUV that is no deeper than this is in the way of the surface craft, m.
///
/// Assumption: draught of the craft, height of an AUV, error of its depth, half a metre each, and as much again
/// between them.
pub const SURFACED_DEPTH: f64 = 2.0;

/// Position and velocity over ground at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Velocity over ground (north, east), m/s.
    pub velocity: Vector2<f64>,
}

/// What is known of an AUV's plans.
#[derive(Clone, Copy, Debug, Default)]
pub struct Intent<'a> {
    /// The path that it follows.
    pub path: Option<&'a KnownPath>,
    /// The sawtooth in which it dives.
    pub dive: Option<Dive>,
}

impl<'a> From<&'a Auv> for Intent<'a> {
    fn from(auv: &'a Auv) -> Self {
        Self {
            path: auv.path.as_ref(),
            dive: auv.dive,
        }
    }
}

/// The forecast of one AUV.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvForecast {
    /// The model it uses.
    pub model: ForecastModel,
    /// Age of the report, s.
    age: f64,
    way: Way,
    /// Along its path, in order of time; none of a vehicle that is forecast by its motion alone.
    stretches: Vec<Stretch>,
    depth: DepthForecast,
    /// Covariance of (north, east, north velocity, east velocity) at the report.
    covariance: Matrix4<f64>,
    /// Velocity (north, east) beyond what its model explains, m/s.
    drift: Vector2<f64>,
}

/// How it goes on from the report.
#[derive(Clone, Debug, PartialEq)]
enum Way {
    Turning(Turning),
    AlongPath(AlongPath),
}

/// At constant speed and rate of turn, either of which may be zero.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turning {
    /// Position at the time of the report, m.
    position: Vector2<f64>,
    /// Velocity over ground at the time of the report, m/s.
    velocity: Vector2<f64>,
    /// Rate of turn, rad/s.
    turn_rate: f64,
}

impl AuvForecast {
    /// The forecast of an AUV from its `state`, under the model that `choice` gives, in a `current` (north, east),
    /// m/s.
    #[must_use]
    pub fn new(state: &AuvState, intent: Intent<'_>, choice: ForecastChoice, current: &Vector2<f64>) -> Self {
        Self::in_memory(Vec::new(), state, intent, choice, current)
    }

    /// Forecasts anew, in the memory of the forecast before.
    pub(crate) fn update(
        &mut self,
        state: &AuvState,
        intent: Intent<'_>,
        choice: ForecastChoice,
        current: &Vector2<f64>,
    ) {
        let memory = std::mem::take(&mut self.stretches);
        *self = Self::in_memory(memory, state, intent, choice, current);
    }

    fn in_memory(
        mut stretches: Vec<Stretch>,
        state: &AuvState,
        intent: Intent<'_>,
        choice: ForecastChoice,
        current: &Vector2<f64>,
    ) -> Self {
        let mut along_path = |known| AlongPath::new(state, known, current, &mut stretches);
        let choice = if state.age <= FORECAST_AGE_MAX {
            choice
        } else {
            ForecastChoice::Model(ForecastModel::Hold)
        };
        let along = match (choice, intent.path) {
            (ForecastChoice::Model(ForecastModel::Path), Some(known)) => Some(along_path(known)),
            (ForecastChoice::Auto, Some(known)) if SPEED_AT_REST <= state.speed => {
                Some(along_path(known)).filter(|along| along.offset().abs() <= OFFSET_FROM_PATH_MAX)
            }
            _ => None,
        };
        if let Some(along_path) = along {
            return Self {
                model: ForecastModel::Path,
                age: state.age,
                depth: DepthForecast::at_speed(state.depth, intent.dive, along_path.horizontal_speed()),
                way: Way::AlongPath(along_path),
                stretches,
                covariance: state.covariance.unwrap_or_else(doubt::covariance_unless_told),
                drift: Vector2::zeros(),
            };
        }
        stretches.clear();
        let model = match choice {
            ForecastChoice::Auto | ForecastChoice::Model(ForecastModel::Path) => from_motion_alone(state),
            ForecastChoice::Model(model) => model,
        };
        let (velocity, turn_rate) = match model {
            ForecastModel::Hold => (Vector2::zeros(), 0.0),
            ForecastModel::ConstantTurn => (state.velocity(), state.turn_rate),
            ForecastModel::ConstantVelocity | ForecastModel::Path => (state.velocity(), 0.0),
        };
        Self {
            model,
            age: state.age,
            way: Way::Turning(Turning {
                position: state.position,
                velocity,
                turn_rate,
            }),
            stretches,
            depth: match model {
                ForecastModel::Hold => DepthForecast::Held(state.depth),
                ForecastModel::ConstantVelocity | ForecastModel::ConstantTurn | ForecastModel::Path => {
                    DepthForecast::from_motion(state, intent.dive, current)
                }
            },
            covariance: state.covariance.unwrap_or_else(doubt::covariance_unless_told),
            drift: Vector2::zeros(),
        }
    }

    /// Motion `ahead` seconds after the snapshot.
    ///
    /// Along a path, a vehicle that dives is forecast to surge ahead where it goes level between two legs.
    #[must_use]
    pub fn at(&self, ahead: f64) -> Motion {
        let elapsed = self.age + ahead;
        match &self.way {
            Way::Turning(turning) => drift::for_ever(self.drift, elapsed).beyond(turning.at(elapsed)),
            Way::AlongPath(along_path) => {
                let lead = self.depth.lead(elapsed);
                drift::fading(self.drift, elapsed).beyond(along_path.at(elapsed, lead, &self.stretches))
            }
        }
    }

    /// Expected depth `ahead` seconds after the snapshot, m, positive down: along its sawtooth, where that is known
    /// and the vehicle does not rest, else what it was. Where the report does not say whether the vehicle goes
    /// down or up, the mean of both.
    #[must_use]
    pub fn depth_at(&self, ahead: f64) -> f64 {
        self.depth.at(self.age + ahead)
    }

    /// Whether the surface craft must keep clear of it `ahead` seconds after the snapshot: whether it may be as
    /// shallow as [`SURFACED_DEPTH`], going down or up where the report does not say which.
    #[must_use]
    pub fn surfaced(&self, ahead: f64) -> bool {
        self.depth.shallowest(self.age + ahead) <= SURFACED_DEPTH
    }

    /// Covariance of the position (north, east) `ahead` seconds after the snapshot, m².
    ///
    /// Its trace never decreases. Along a path it grows with the doubt of speed along it, and across it only up to
    /// what a follower strays; else with the doubt of velocity and with accelerations that are not foreseen.
    #[must_use]
    pub fn position_covariance(&self, ahead: f64) -> Matrix2<f64> {
        let elapsed = self.age + ahead;
        match &self.way {
            Way::Turning(turning) => {
                let course = doubt::Free {
                    speed: turning.velocity.norm(),
                    turned: turning.turn_rate * elapsed,
                };
                doubt::free(&self.covariance, elapsed, &course)
            }
            Way::AlongPath(along_path) => {
                let on_path = along_path.on_path(elapsed, self.depth.lead(elapsed), &self.stretches);
                doubt::along_path(&self.covariance, elapsed, &on_path)
            }
        }
    }

    /// Trace of [`AuvForecast::position_covariance`], m²: the mean square of the distance between where the vehicle
    /// is and where it is forecast.
    #[must_use]
    pub fn position_variance(&self, ahead: f64) -> f64 {
        self.position_covariance(ahead).trace()
    }

    /// Tangent angle ψ_P of the path, rad, and its rate, rad/s, where the AUV is `ahead` seconds after the
    /// snapshot; none of one that is not forecast along a path.
    #[must_use]
    pub fn tangent(&self, ahead: f64) -> Option<(f64, f64)> {
        match &self.way {
            Way::Turning(_) => None,
            Way::AlongPath(along_path) => Some({
                let elapsed = self.age + ahead;
                along_path.tangent(elapsed, self.depth.lead(elapsed), &self.stretches)
            }),
        }
    }
}

/// What [`ForecastChoice::Auto`] uses for an AUV whose path is not known.
fn from_motion_alone(state: &AuvState) -> ForecastModel {
    if state.speed < SPEED_AT_REST {
        ForecastModel::Hold
    } else if state.turn_rate.abs() < TURN_RATE_STRAIGHT {
        ForecastModel::ConstantVelocity
    } else {
        ForecastModel::ConstantTurn
    }
}

impl Turning {
    /// Motion `elapsed` seconds after the report.
    ///
    /// ```text
    /// p(t) = p + ‖v‖ t sinc(ω t / 2) [cos(χ + ω t / 2), sin(χ + ω t / 2)]
    /// ```
    /// The chord of an arc: exact, and regular where the rate of turn ω vanishes.
    fn at(&self, elapsed: f64) -> Motion {
        let (speed, course) = (self.velocity.norm(), angle_of(&self.velocity));
        let half_turn = 0.5 * self.turn_rate * elapsed;
        Motion {
            position: self.position + direction(course + half_turn) * (speed * elapsed * sinc(half_turn)),
            velocity: direction(course + 2.0 * half_turn) * speed,
        }
    }
}

/// sin x / x, and its limit 1 at 0.
#[must_use]
pub fn sinc(x: f64) -> f64 {
    // The series' next term, x⁴/120, is below the rounding of 1 here.
    if x.abs() < 1e-4 {
        1.0 - x * x / 6.0
    } else {
        x.sin() / x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Course;

    fn state(turn_rate: f64, age: f64) -> AuvState {
        AuvState {
            position: Vector2::new(3.0, -4.0),
            depth: 5.0,
            course: Course::new(0.7),
            speed: 0.193,
            turn_rate,
            age,
            covariance: None,
        }
    }

    fn forecast(state: &AuvState, choice: ForecastChoice) -> AuvForecast {
        AuvForecast::new(state, Intent::default(), choice, &Vector2::zeros())
    }

    #[test]
    fn a_constant_turn_integrates_its_own_velocity() {
        let forecast = forecast(&state(0.02, 1.5), ForecastChoice::Auto);
        assert_eq!(forecast.model, ForecastModel::ConstantTurn);
        for ahead in [0.0, 10.0, 78.0] {
            let h = 1e-3;
            let slope = (forecast.at(ahead + h).position - forecast.at(ahead - h).position) / (2.0 * h);
            // Central difference: error h²/6 · ‖v‖ ω², far below the tolerance.
            assert!((slope - forecast.at(ahead).velocity).norm() < 1e-9);
        }
    }

    #[test]
    fn a_constant_turn_closes_its_circle() {
        let forecast = forecast(
            &state(0.05, 0.0),
            ForecastChoice::Model(ForecastModel::ConstantTurn),
        );
        let period = std::f64::consts::TAU / 0.05;
        assert!((forecast.at(period).position - forecast.at(0.0).position).norm() < 1e-12);
    }

    #[test]
    fn no_turn_is_the_limit_of_a_slow_turn() {
        let straight = forecast(
            &state(0.0, 2.0),
            ForecastChoice::Model(ForecastModel::ConstantVelocity),
        );
        let slow = forecast(
            &state(1e-9, 2.0),
            ForecastChoice::Model(ForecastModel::ConstantTurn),
        );
        assert!((straight.at(78.0).position - slow.at(78.0).position).norm() < 1e-6);
    }

    #[test]
    fn an_old_report_is_carried_to_now() {
        let forecast = forecast(&state(0.0, 10.0), ForecastChoice::Auto);
        let moved = forecast.at(0.0).position - Vector2::new(3.0, -4.0);
        assert!((moved.norm() - 1.93).abs() < 1e-12);
    }

    #[test]
    fn a_slow_auv_is_held() {
        let slow = AuvState {
            speed: 0.049,
            ..state(0.1, 0.0)
        };
        let forecast = forecast(&slow, ForecastChoice::Auto);
        assert_eq!(forecast.model, ForecastModel::Hold);
        assert_eq!(forecast.at(60.0).position, slow.position);
    }
}
