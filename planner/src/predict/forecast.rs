//! Forecasts of AUVs in closed form, for any grid of times.

use nalgebra::{Complex, Matrix2, Matrix4, Vector2};

use crate::{
    estimate::PathFit,
    facts::{
        angle::Course,
        auv::Dive,
        evidence::{AuvState, FORECAST_AGE_MAX},
        known_path::{KnownPath, OFFSET_FROM_PATH_MAX},
        options::{Forecast, ForecastModel},
        previous_plan::RememberedTarget,
    },
    predict::{
        along_path::AlongPath,
        covariance::{default_covariance, free},
        dive::DepthForecast,
    },
    tuned::ForecastNumbers,
};

pub use crate::{facts::evidence::SPEED_AT_REST, predict::motion::Motion};

/// Depth at or above which an AUV obstructs the surface craft, m. Assumption: half a metre each for
/// draught, the AUV's height, its depth error, and clearance.
pub const SURFACED_DEPTH: f64 = 2.0;

/// Shortest interval between two reports, s; rounding separates equal times by less.
pub(crate) const BETWEEN_MIN: f64 = 1e-3;

/// Known plans of an AUV.
#[derive(Clone, Copy, Debug, Default)]
pub struct Intent<'a> {
    /// The path that it follows.
    pub path: Option<&'a KnownPath>,
    /// Fit of its reports to the path, if it has any.
    pub fit: Option<&'a PathFit>,
    /// Probability that it does not follow it, but moves as without a path.
    pub doubt: f64,
    /// The sawtooth in which it dives.
    pub dive: Option<Dive>,
    /// Distance over which it forgets its course, m, off its path. `None` if it goes straight on.
    pub forgets_after: Option<f64>,
    /// The numbers of the forecast.
    pub tuned: &'a ForecastNumbers,
}

/// The forecast of one AUV.
#[derive(Clone, Debug, PartialEq)]
pub struct AuvForecast {
    /// The model it uses.
    pub model: ForecastModel,
    age: f64,
    propagation: Propagation,
    /// If its path is doubtful: the probability that it does not follow it, and its motion then.
    otherwise: Option<(f64, Turning)>,
    depth: DepthForecast,
    /// Covariance of (north, east, north velocity, east velocity) at the report.
    covariance: Matrix4<f64>,
    /// Variance of the reported velocity along either axis; 0 if unknown, and along a path.
    pub(crate) velocity_variance: f64,
    /// Velocity (north, east) that its model does not explain, m/s.
    drift: Vector2<f64>,
    tuned: ForecastNumbers,
}

/// Motion after the report.
#[derive(Clone, Debug, PartialEq)]
enum Propagation {
    Turning(Turning),
    AlongPath(AlongPath),
}

/// Constant speed and rate of turn, either of which may be zero, or the mean over turns by chance.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turning {
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    turn_rate: f64,
    /// Rate at which its course is forgotten, 1/s.
    forgetting: f64,
}

impl AuvForecast {
    /// The forecast of an AUV from its `state` by `choice`, in a `current` (north, east), m/s.
    pub fn new(state: &AuvState, intent: Intent<'_>, choice: Forecast, current: &Vector2<f64>) -> Self {
        let tuned = intent.tuned;
        let along_path = |known| AlongPath::new(state, known, intent.fit, current, tuned);
        let choice = if state.age_s <= FORECAST_AGE_MAX { choice } else { Forecast::Hold };
        let along = match (choice, intent.path) {
            (Forecast::Path, Some(known)) => Some(along_path(known)),
            (Forecast::Auto | Forecast::Declared, Some(known)) if SPEED_AT_REST <= state.speed_mps => {
                Some(along_path(known))
                    .filter(|along| intent.fit.is_some() || along.offset.abs() <= OFFSET_FROM_PATH_MAX)
            }
            _ => None,
        };
        let covariance = state.covariance();
        let (model, propagation, depth, velocity_variance) = if let Some(along_path) = along {
            let depth = DepthForecast::at_speed(state.depth_m, intent.dive, along_path.horizontal_speed);
            (ForecastModel::Path, Propagation::AlongPath(along_path), depth, 0.0)
        } else {
            let model = match choice {
                Forecast::Auto | Forecast::Declared | Forecast::Path => from_motion_alone(state, tuned),
                Forecast::Hold => ForecastModel::Hold,
                Forecast::ConstantVelocity => ForecastModel::ConstantVelocity,
                Forecast::ConstantTurn => ForecastModel::ConstantTurn,
            };
            let (velocity, turn_rate) = match model {
                ForecastModel::Hold => (Vector2::zeros(), 0.0),
                ForecastModel::ConstantTurn => (state.velocity(), state.turn_rate_radps),
                ForecastModel::ConstantVelocity | ForecastModel::Path => (state.velocity(), 0.0),
            };
            let forgetting = match (choice, intent.forgets_after) {
                (Forecast::Auto | Forecast::Declared, Some(length)) => velocity.norm() / length,
                _ => 0.0,
            };
            let turning =
                Propagation::Turning(Turning { position: state.position(), velocity, turn_rate, forgetting });
            let depth = match model {
                ForecastModel::Hold => DepthForecast::Held(state.depth_m),
                ForecastModel::ConstantVelocity | ForecastModel::ConstantTurn | ForecastModel::Path => {
                    let through_water = (state.velocity() - current).norm();
                    DepthForecast::at_speed(state.depth_m, intent.dive, through_water)
                }
            };
            let variance = covariance.map_or(0.0, |known| 0.5 * (known.m33 + known.m44));
            (model, turning, depth, variance)
        };
        // Straight on without end would be no mean to count with.
        let otherwise = intent.forgets_after.filter(|_| 0.0 < intent.doubt).map(|length| {
            let turning = Turning {
                position: state.position(),
                velocity: state.velocity(),
                turn_rate: 0.0,
                forgetting: state.speed_mps / length,
            };
            (intent.doubt, turning)
        });
        Self {
            model,
            age: state.age_s,
            propagation,
            otherwise,
            depth,
            covariance: covariance.unwrap_or_else(|| default_covariance(tuned)),
            velocity_variance,
            drift: Vector2::zeros(),
            tuned: *tuned,
        }
    }

    /// Motion `ahead` seconds after the snapshot.
    ///
    /// Along a path, a diving vehicle surges ahead in the level motion between two legs, and the
    /// drift fades, since a vehicle returns to its path; else the drift is constant.
    ///
    /// ```text
    /// d τ (1 − exp(−t/τ))                     displacement by a fading drift
    /// ```
    pub fn at(&self, ahead: f64) -> Motion {
        let elapsed = self.age + ahead;
        let (modelled, by, rate) = match &self.propagation {
            Propagation::Turning(turning) => (turning.at(elapsed), self.drift * elapsed, self.drift),
            Propagation::AlongPath(along_path) => {
                let memory = self.tuned.drift_memory;
                let left = (-elapsed / memory).exp();
                let mut modelled = along_path.at(elapsed, self.depth.lead(elapsed));
                if let Some((doubt, otherwise)) = &self.otherwise {
                    let other = otherwise.at(elapsed);
                    modelled = Motion {
                        position: modelled.position.lerp(&other.position, *doubt),
                        velocity: modelled.velocity.lerp(&other.velocity, *doubt),
                    };
                }
                (modelled, self.drift * (memory * (1.0 - left)), self.drift * left)
            }
        };
        Motion { position: modelled.position + by, velocity: modelled.velocity + rate }
    }

    /// The same without a doubt about its path: where it is likeliest, in place of a mean.
    pub(crate) fn likeliest(&self) -> Self {
        Self { otherwise: None, ..self.clone() }
    }

    /// `true` if its course is forgotten, so that its motion is a mean over turns.
    pub(crate) fn forgets(&self) -> bool {
        matches!(&self.propagation, Propagation::Turning(turning) if 0.0 < turning.forgetting)
    }

    /// Expected depth `ahead` seconds after the snapshot, m, positive down: along its sawtooth if
    /// known and the vehicle moves (the mean of both directions if that is unknown), else along the
    /// legs of its path, else constant.
    pub fn depth_at(&self, ahead: f64) -> f64 {
        let elapsed = self.age + ahead;
        self.depth.at(elapsed) + self.descent(elapsed)
    }

    /// `true` if its depth is constant, without a dive or legs with depths.
    pub(crate) fn holds_depth(&self) -> bool {
        let has_depth = |along_path: &AlongPath| along_path.leg_depth(0.0).is_some();
        let on_legs =
            matches!(&self.propagation, Propagation::AlongPath(along_path) if has_depth(along_path));
        matches!(self.depth, DepthForecast::Held(_)) && !on_legs
    }

    /// Change of depth along the legs of its path since its report, m.
    fn descent(&self, elapsed: f64) -> f64 {
        match (&self.propagation, &self.depth) {
            (Propagation::AlongPath(along_path), DepthForecast::Held(depth)) => {
                let [before, then] = [0.0, elapsed].map(|elapsed| along_path.leg_depth(elapsed));
                then.map_or(0.0, |then| then - before.unwrap_or(*depth))
            }
            _ => 0.0,
        }
    }

    /// `true` if the surface craft must keep clear of it `ahead` seconds after the snapshot: it may
    /// be as shallow as [`SURFACED_DEPTH`] in one of the possible directions.
    pub fn surfaced(&self, ahead: f64) -> bool {
        let elapsed = self.age + ahead;
        self.depth.shallowest(elapsed) + self.descent(elapsed) <= SURFACED_DEPTH
    }

    /// Covariance of the position (north, east) `ahead` seconds after the snapshot, m².
    ///
    /// Off a path its trace never decreases. Along a path it grows with the variance of the speed,
    /// and across it to a bound. Of a doubtful path it is that of both possibilities about their
    /// mean.
    ///
    /// ```text
    /// (1 − q) P + q P' + q (1 − q) d dᵀ         for the doubt q and the distance d between the two
    /// ```
    pub fn position_covariance(&self, ahead: f64) -> Matrix2<f64> {
        let elapsed = self.age + ahead;
        match &self.propagation {
            Propagation::Turning(turning) => {
                let (speed, turned) = (turning.velocity.norm(), turning.turn_rate * elapsed);
                free(&self.covariance, elapsed, speed, turned, &self.tuned)
            }
            Propagation::AlongPath(along_path) => {
                let lead = self.depth.lead(elapsed);
                let along = along_path.position_covariance(&self.covariance, elapsed, lead, &self.tuned);
                let Some((doubt, otherwise)) = &self.otherwise else {
                    return along;
                };
                let between = otherwise.at(elapsed).position - along_path.at(elapsed, lead).position;
                let other = free(&self.covariance, elapsed, otherwise.velocity.norm(), 0.0, &self.tuned);
                along * (1.0 - doubt)
                    + other * *doubt
                    + between * between.transpose() * (doubt * (1.0 - doubt))
            }
        }
    }

    /// Trace of [`AuvForecast::position_covariance`], m²: the mean square error of the position.
    pub fn position_variance(&self, ahead: f64) -> f64 {
        self.position_covariance(ahead).trace()
    }

    /// Tangent angle ψ_P of the path, rad, and its rate, rad/s, at the AUV `ahead` seconds after
    /// the snapshot; `None` if its forecast is not along a path.
    pub fn tangent(&self, ahead: f64) -> Option<(f64, f64)> {
        match &self.propagation {
            Propagation::Turning(_) => None,
            Propagation::AlongPath(along_path) => Some({
                let elapsed = self.age + ahead;
                along_path.tangent(elapsed, self.depth.lead(elapsed))
            }),
        }
    }
}

/// The model of [`Forecast::Auto`] for an AUV without a path.
fn from_motion_alone(state: &AuvState, tuned: &ForecastNumbers) -> ForecastModel {
    if state.speed_mps < SPEED_AT_REST {
        ForecastModel::Hold
    } else if state.turn_rate_radps.abs() < tuned.turn_rate_straight {
        ForecastModel::ConstantVelocity
    } else {
        ForecastModel::ConstantTurn
    }
}

impl Turning {
    /// Expected motion `elapsed` seconds after the report.
    ///
    /// ```text
    /// v(t) = v exp(−z t)    p(t) = p + v (1 − exp(−z t)) / z    z = a − i ω
    /// ```
    /// with north + i east as complex numbers, the rate of turn ω, and the rate a at which turns
    /// that nobody announced make the course forgotten: the mean over them.
    fn at(&self, elapsed: f64) -> Motion {
        let z = Complex::new(self.forgetting, -self.turn_rate) * elapsed;
        let velocity = Complex::new(self.velocity.x, self.velocity.y);
        let kept = (-z).exp();
        // The next term of the series is z³/24, below the rounding of 1.
        let mean =
            if z.norm_sqr() < 1e-10 { z * z / 6.0 - z * 0.5 + 1.0 } else { (Complex::from(1.0) - kept) / z };
        let (travelled, then) = (velocity * mean * elapsed, velocity * kept);
        Motion {
            position: self.position + Vector2::new(travelled.re, travelled.im),
            velocity: Vector2::new(then.re, then.im),
        }
    }
}

impl AuvForecast {
    /// Velocity over ground (north, east) that model and report do not explain, m/s.
    pub fn drift(&self) -> Vector2<f64> {
        self.drift
    }

    /// The forecast from `state` with the drift of an answer from a report `between` s before.
    ///
    /// ```text
    /// d = d⁻ + (p − p⁻) / max(τ, Δ)          τ = 30 s
    /// ```
    /// with the newest report's position p, its forecast p⁻ from the previous report with the drift
    /// d⁻, and the time Δ between the two. The drift is unchanged if the newest report is no newer,
    /// Δ exceeds a minute, or p − p⁻ is a jump. Position noise mostly cancels.
    ///
    /// Along paths a drift must fade, see [`ForecastNumbers::drift_memory`].
    pub(crate) fn after(
        earlier: &RememberedTarget,
        between: f64,
        state: &AuvState,
        (intent, choice, current): (Intent<'_>, Forecast, &Vector2<f64>),
    ) -> Self {
        let tuned = intent.tuned;
        let bounded = |drift: Vector2<f64>| drift.map(|along| along.clamp(-tuned.drift_max, tuned.drift_max));
        let drift = bounded(earlier.drift);
        let tells = earlier.model != ForecastModel::Hold
            && (BETWEEN_MIN..=tuned.drift_between_max).contains(&between);
        let expected = tells.then(|| {
            let known = &earlier.estimate;
            let (course, speed) = (Course::of(&known.velocity()), known.velocity().norm());
            let before = AuvState {
                turn_rate_radps: known.turn_rate_radps,
                ..AuvState::new(known.position(), known.depth_m, course, speed)
            };
            let choice = Forecast::from(earlier.model);
            let forecast = Self::new(&before, intent, choice, current);
            Self { drift, ..forecast }.at(between).position
        });
        let mut forecast = Self::new(state, intent, choice, current);
        // Drift along a path says nothing about other motion, nor the reverse.
        let along_path = |model| model == ForecastModel::Path;
        if forecast.model == ForecastModel::Hold || along_path(forecast.model) != along_path(earlier.model) {
            return forecast;
        }
        forecast.drift = drift;
        let off = expected.map_or_else(Vector2::zeros, |expected| state.position() - expected);
        if off.norm() <= tuned.drift_jump.max(tuned.drift_usual * between) {
            forecast.drift = bounded(drift + off / between.max(tuned.drift_memory));
        }
        forecast
    }
}

/// An AUV of the tests.
#[cfg(test)]
#[derive(Clone)]
struct Known {
    state: AuvState,
    path: Option<KnownPath>,
    dive: Option<Dive>,
}

#[cfg(test)]
impl Known {
    fn forecast(&self, choice: Forecast, current: &Vector2<f64>) -> AuvForecast {
        let intent = Intent { path: self.path.as_ref(), dive: self.dive, ..Intent::default() };
        AuvForecast::new(&self.state, intent, choice, current)
    }
}

#[cfg(test)]
mod along_path_tests;
#[cfg(test)]
mod covariance_tests;
#[cfg(test)]
mod dive_tests;
#[cfg(test)]
mod drift_tests;

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        facts::path::curve::Path,
        tests::{moving, near, near_to, slope},
    };

    fn state(turn_rate: f64, age: f64) -> AuvState {
        AuvState { turn_rate_radps: turn_rate, age_s: age, ..moving(3.0, -4.0, 5.0, 0.7, 0.193) }
    }

    fn forecast(state: &AuvState, choice: Forecast) -> AuvForecast {
        AuvForecast::new(state, Intent::default(), choice, &Vector2::zeros())
    }

    #[test]
    fn a_constant_turn_integrates_its_own_velocity_and_closes_its_circle() {
        let forecast = forecast(&state(0.02, 1.5), Forecast::Auto);
        assert_eq!(forecast.model, ForecastModel::ConstantTurn);
        for ahead in [0.0, 10.0, 78.0] {
            // Central difference: error h²/6 · ‖v‖ ω², far below the tolerance.
            let moves = slope(|time| forecast.at(time).position, ahead, 1e-3);
            near_to(moves, forecast.at(ahead).velocity, 1e-9);
        }
        let lap = forecast.at(std::f64::consts::TAU / 0.02);
        near_to(lap.position, forecast.at(0.0).position, 1e-12);
    }

    #[test]
    fn a_forgotten_course_is_the_mean_of_legs_that_end_at_random() {
        let intent = Intent { forgets_after: Some(60.0), ..Intent::default() };
        let state = moving(0.0, 0.0, 8.0, 0.0, 0.5);
        let ahead = |choice| AuvForecast::new(&state, intent, choice, &Vector2::zeros());
        let far = ahead(Forecast::Auto).at(1e9).position;
        near_to(far, Vector2::new(60.0, 0.0), 1e-9);
        for until in [10, 120, 1700] {
            // Each second a leg ends with a probability of 1/120; all directions are then alike.
            let each = (0..until).map(|t| 0.5 * (1.0_f64 - 1.0 / 120.0).powf(f64::from(t)));
            let motion = ahead(Forecast::Auto).at(f64::from(until));
            near_to(motion.position, Vector2::new(each.sum(), 0.0), 0.5);
        }
        let moves = slope(|time| ahead(Forecast::Auto).at(time).position, 50.0, 1e-3);
        near_to(moves, ahead(Forecast::Auto).at(50.0).velocity, 1e-9);
        // Who asks for a constant velocity gets it.
        let straight = ahead(Forecast::ConstantVelocity).at(1700.0).position;
        near_to(straight, Vector2::new(850.0, 0.0), 1e-9);
    }

    #[test]
    fn of_a_doubtful_path_the_forecast_is_the_mean_of_following_and_leaving_it() {
        // Due north for 30 m, then back.
        let path = KnownPath {
            path: Arc::new(Path::lawn_mower(Vector2::zeros(), 0.0, 30.0, 20.0, 4)),
            horizontal_speed: 0.5,
        };
        let state = moving(0.0, 0.0, 8.0, 0.0, 0.5);
        let with = |path: Option<&KnownPath>, doubt: f64| {
            let intent = Intent { path, doubt, forgets_after: Some(60.0), ..Intent::default() };
            AuvForecast::new(&state, intent, Forecast::Auto, &Vector2::zeros())
        };
        let [sure, doubtful] = [0.0, 0.25].map(|doubt| with(Some(&path), doubt));
        let free = with(None, 0.0);
        let [followed, mean, left] = [&sure, &doubtful, &free].map(|auv| auv.at(120.0));
        near_to(mean.position, followed.position * 0.75 + left.position * 0.25, 1e-9);
        near_to(mean.velocity, followed.velocity * 0.75 + left.velocity * 0.25, 1e-9);
        let apart = (followed.position - left.position).norm_squared();
        let [certain, either, alone] = [&sure, &doubtful, &free].map(|auv| auv.position_variance(120.0));
        near(either, 0.75 * certain + 0.25 * alone + 0.1875 * apart, 1e-9);
        assert_eq!(doubtful.likeliest(), sure);
    }

    #[test]
    fn a_straight_course_is_the_limit_of_a_slow_turn() {
        let straight = forecast(&state(0.0, 2.0), Forecast::ConstantVelocity);
        let slow = forecast(&state(1e-9, 2.0), Forecast::ConstantTurn);
        near_to(straight.at(78.0).position, slow.at(78.0).position, 1e-6);
    }

    #[test]
    fn an_old_report_is_predicted_to_now() {
        let forecast = forecast(&state(0.0, 10.0), Forecast::Auto);
        let moved = forecast.at(0.0).position - Vector2::new(3.0, -4.0);
        near(moved.norm(), 1.93, 1e-12);
    }

    #[test]
    fn a_slow_auv_is_held() {
        let slow = AuvState { speed_mps: 0.049, ..state(0.1, 0.0) };
        let forecast = forecast(&slow, Forecast::Auto);
        assert_eq!(forecast.model, ForecastModel::Hold);
        assert_eq!(forecast.at(60.0).position, slow.position());
    }
}
