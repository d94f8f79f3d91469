//! Where each AUV will be: closed forms of time, so that any grid may sample them.

mod along_path;
#[cfg(test)]
mod along_path_tests;

use along_path::AlongPath;
use nalgebra::Vector2;

use crate::{
    angle::{angle_of, direction},
    snapshot::{AuvState, ForecastChoice, ForecastModel, KnownPath},
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
const OFFSET_FROM_PATH_MAX: f64 = 15.0;

/// Position and velocity over ground at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Velocity over ground (north, east), m/s.
    pub velocity: Vector2<f64>,
}

/// The forecast of one AUV.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvForecast {
    /// The model it uses.
    pub model: ForecastModel,
    /// Age of the report, s.
    age: f64,
    way: Way,
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
    /// m/s. `path`: the one that it follows, where that is known.
    #[must_use]
    pub fn new(
        state: &AuvState,
        path: Option<&KnownPath>,
        choice: ForecastChoice,
        current: &Vector2<f64>,
    ) -> Self {
        let along_path = |known| AlongPath::new(state, known, current);
        let along = match (choice, path) {
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
                way: Way::AlongPath(along_path),
            };
        }
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
        }
    }

    /// Motion `ahead` seconds after the snapshot.
    #[must_use]
    pub fn at(&self, ahead: f64) -> Motion {
        let elapsed = self.age + ahead;
        match &self.way {
            Way::Turning(turning) => turning.at(elapsed),
            Way::AlongPath(along_path) => along_path.at(elapsed),
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
        AuvForecast::new(state, None, choice, &Vector2::zeros())
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
