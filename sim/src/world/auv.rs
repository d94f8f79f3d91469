//! A whole AUV: hull, inner loops, path follower, sawtooth, and its estimate of its own position.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};
use planner::{
    angle::{Course, direction, wrap},
    path::{Path, SpeedProfile},
    snapshot::VehicleId,
};

use crate::world::dive::{Dive, Leg};
use crate::world::fault::Behaviour;
use crate::world::hull::{UnderwaterHull, UnderwaterInput, UnderwaterState, heading_rate};
use crate::world::inner_loop::{PERIOD, SurgeLoop, UnderwaterLoops, UnderwaterReference};
use crate::world::integrate::rk4;
use crate::world::path_following::{PathCommand, PathError, PathFollowingGains, follow_path};
use crate::world::recorded_track::RecordedTrack;
use crate::world::underwater_vehicle::Navigation;
use crate::world::water::Oscillation;

/// Largest depth with the GNSS antenna on the tail above water, m. Assumption: half a length.
const ANTENNA_DEPTH: f64 = 1.0;

/// Largest turn rate of a vehicle that leaves its path, rad/s: 10 m at 1.5 m/s. Assumption.
const LEAVING_TURN_RATE: f64 = 0.15;

/// Distance along the path, beyond the distance strayed, within which a vehicle rejoins at the
/// nearest point, m. Assumption: less than the lane spacing of a lawn-mower that it can turn on.
const REJOIN_REACH: f64 = 10.0;

/// Deviations of a vehicle from the path that it follows, beyond those of its navigation.
#[derive(Clone, Debug, Default)]
pub struct TrackingError {
    /// Distance to starboard of its path at which it steers, m.
    pub(crate) weave: Option<Oscillation>,
    /// Share of its speed that it loses nose down.
    pub(crate) slower_diving: f64,
    /// Time since the start, s.
    pub(crate) time: f64,
}

/// An underwater vehicle.
#[derive(Clone, Debug)]
pub struct SimulatedAuv {
    /// Its name.
    pub id: VehicleId,
    /// Its hull.
    pub hull: UnderwaterHull,
    /// Its true state.
    pub state: UnderwaterState,
    /// Gains of its inner loops.
    pub loops: UnderwaterLoops,
    /// State of its surge loop.
    pub surge: SurgeLoop,
    /// Its navigation.
    pub navigation: Navigation,
    /// Error of navigation other than dead reckoning: estimate less position (north, east), m.
    pub navigation_error: Vector2<f64>,
    /// Covariance that its own filter states of that error, m²; none without such a filter.
    pub own_covariance: Option<Matrix2<f64>>,
    /// Growth of that error for each metre through the water (north, east).
    pub navigation_drift: Vector2<f64>,
    /// `true`: a satellite fix at the surface sets that error to zero.
    pub fix_at_surface: bool,
    /// Its estimate of its own position (north, east), m: the input of its path follower.
    pub position_estimate: Vector2<f64>,
    /// Gains of its path follower.
    pub gains: PathFollowingGains,
    /// The path it follows.
    pub path: Arc<Path>,
    /// The path that it declares.
    pub declared: Arc<Path>,
    /// Its deviations from the path that it follows.
    pub tracking_error: TrackingError,
    /// Arc length γ of the point that it follows, m.
    pub gamma: f64,
    /// Speed reference along the body `U_d(γ)`.
    pub speed: SpeedProfile,
    /// Its sawtooth.
    pub dive: Dive,
    /// The leg it is on.
    pub leg: Leg,
    /// Its present behaviour.
    pub behaviour: Behaviour,
    /// The recorded track that it repeats instead of following its path.
    pub track: Option<Arc<RecordedTrack>>,
}

impl SimulatedAuv {
    /// Horizontal position (north, east), m.
    pub fn position(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    /// Depth, m.
    pub fn depth(&self) -> f64 {
        self.state[2]
    }

    /// Pitch θ, rad.
    pub fn pitch(&self) -> f64 {
        self.state[3]
    }

    /// Heading ψ, rad, not wrapped.
    pub fn heading(&self) -> f64 {
        self.state[4]
    }

    /// Horizontal speed through the water u cosθ, m/s.
    pub fn horizontal_speed(&self) -> f64 {
        self.state[5] * self.pitch().cos()
    }

    /// Heading rate ψ̇ = r / cosθ, rad/s.
    pub fn heading_rate(&self) -> f64 {
        heading_rate(self.pitch(), self.state[7])
    }

    /// Speed reference along the body at arc length `gamma`, m/s; repeated on each lap if closed.
    pub fn speed_at(&self, gamma: f64) -> f64 {
        if self.path.is_closed() {
            self.speed.at(gamma.rem_euclid(self.path.length()))
        } else {
            self.speed.at(gamma)
        }
    }

    /// The point that it follows (north, east), m.
    pub fn path_point(&self) -> Vector2<f64> {
        match &self.track {
            Some(_) => self.position(),
            None => self.path.at(self.gamma).position,
        }
    }

    /// True deviation from the point it follows; zero on a recorded track.
    pub fn path_error(&self) -> PathError {
        if self.track.is_some() {
            return PathError::default();
        }
        PathError::new(&self.position(), self.heading(), &self.path.at(self.gamma))
    }

    /// Velocity over ground (north, east), m/s, at `time` s in a `current`; its turn rate, rad/s.
    ///
    /// ```text
    /// g = u_h [cosψ, sinψ] + v_c        χ̇ = ψ̇ u_h (g · [cosψ, sinψ]) / ‖g‖²
    /// ```
    /// The rate is that of a turn at steady speed, from the gyroscope. A pitch reversal in a
    /// current changes `u_h` and swings the course for seconds; that is no turn.
    pub fn ground_track(&self, time: f64, current: &Vector2<f64>) -> (Vector2<f64>, f64) {
        if let Some(track) = &self.track {
            let motion = track.at(time);
            return (motion.velocity, motion.turn_rate);
        }
        let (bow, u_h) = (direction(self.heading()), self.horizontal_speed());
        let ground = bow * u_h + current;
        let speed = ground.norm();
        // At rest over ground, the course is undefined.
        if speed < f64::EPSILON {
            return (ground, 0.0);
        }
        let turn_rate = self.heading_rate() * u_h * ground.dot(&bow) / (speed * speed);
        (ground, turn_rate)
    }

    /// Heading reference, rad, in (−π, π]: ψ_P + δ on its path, else the heading it takes or has.
    pub fn heading_reference(&self) -> f64 {
        if self.track.is_some() {
            return wrap(self.heading());
        }
        match self.behaviour {
            Behaviour::FollowsPath => {
                let tangent = self.path.at(self.gamma).tangent;
                wrap(tangent + self.gains.approach_angle(self.steered_error().y_1))
            }
            Behaviour::LeavesPath(Some(heading)) => wrap(heading),
            Behaviour::LeavesPath(None) | Behaviour::WaitsAtSurface | Behaviour::Drifts => {
                wrap(self.heading())
            }
        }
    }

    /// Reference for its inner loops; none if it has no power.
    pub fn reference(&self) -> Option<UnderwaterReference> {
        if self.track.is_some() {
            return Some(UnderwaterReference { surge: self.state[5], pitch: self.pitch(), yaw_rate: 0.0 });
        }
        self.reference_for(&self.command())
    }

    /// The path-following law's command at the estimated position, or the fault's.
    fn command(&self) -> PathCommand {
        let heading_rate = match self.behaviour {
            Behaviour::FollowsPath => {
                let curvature = self.path.at(self.gamma).curvature;
                let speed = self.horizontal_speed();
                return follow_path(&self.steered_error(), curvature, speed, &self.gains);
            }
            Behaviour::LeavesPath(Some(heading)) => {
                let rate = self.gains.k_1 * wrap(heading - self.heading());
                rate.clamp(-LEAVING_TURN_RATE, LEAVING_TURN_RATE)
            }
            Behaviour::LeavesPath(None) | Behaviour::WaitsAtSurface | Behaviour::Drifts => 0.0,
        };
        PathCommand { point_speed: 0.0, heading_rate }
    }

    fn reference_for(&self, command: &PathCommand) -> Option<UnderwaterReference> {
        match self.behaviour {
            Behaviour::Drifts => None,
            Behaviour::WaitsAtSurface if self.depth() <= self.dive.depth_min.min(ANTENNA_DEPTH) => {
                Some(UnderwaterReference { surge: 0.0, pitch: 0.0, yaw_rate: 0.0 })
            }
            Behaviour::FollowsPath | Behaviour::LeavesPath(_) | Behaviour::WaitsAtSurface => {
                let lost = match self.leg {
                    Leg::Down => self.tracking_error.slower_diving,
                    Leg::Up => 0.0,
                };
                Some(UnderwaterReference {
                    surge: self.speed_at(self.gamma) * (1.0 - lost),
                    pitch: self.leg.pitch(&self.dive),
                    // Inner loops take the body's yaw rate r = cosθ ψ̇; the law gives ψ̇.
                    yaw_rate: command.heading_rate * self.pitch().cos(),
                })
            }
        }
    }

    /// The deviation that its path follower sees: from where it weaves, by its own navigation.
    fn steered_error(&self) -> PathError {
        let point = self.path.at(self.gamma);
        let error = PathError::new(&self.position_estimate, self.heading(), &point);
        let TrackingError { weave, time, .. } = &self.tracking_error;
        PathError { y_1: error.y_1 - weave.as_ref().map_or(0.0, |weave| weave.at(*time)), ..error }
    }

    /// Sets the state on its track at `time` s in a `current`. `false` without a track.
    pub(crate) fn repeat_track(&mut self, time: f64, current: &Vector2<f64>) -> bool {
        let Some(track) = &self.track else { return false };
        let motion = track.at(time);
        let through_water = motion.velocity - current;
        let u_h = through_water.norm();
        let heading = if u_h < f64::EPSILON { self.heading() } else { Course::of(&through_water).radians() };
        let pitch = -motion.descent.atan2(u_h);
        let surge = u_h.hypot(motion.descent);
        let [[north, east]] = motion.position.data.0;
        self.state = UnderwaterState::from([north, east, motion.depth, pitch, heading, surge, 0.0, 0.0]);
        self.position_estimate = motion.position;
        true
    }

    /// Lets one inner-loop period pass in a current (north, east), m/s.
    pub(crate) fn step(&mut self, behaviour: Behaviour, current: &Vector2<f64>) {
        if behaviour == Behaviour::FollowsPath && self.behaviour != behaviour {
            // After a fault it rejoins its path at the nearest point, except those on another lane.
            let left_at = self.path.at(self.gamma).position;
            let reach = (self.position_estimate - left_at).norm() + REJOIN_REACH;
            self.gamma = self.path.closest_near(&self.position_estimate, self.gamma, reach);
        }
        self.behaviour = behaviour;
        self.leg = match behaviour {
            Behaviour::WaitsAtSurface => Leg::Up,
            Behaviour::FollowsPath | Behaviour::LeavesPath(_) | Behaviour::Drifts => {
                self.leg.next(self.depth(), &self.dive)
            }
        };
        let command = self.command();
        let input = match self.reference_for(&command) {
            Some(reference) => {
                let (loops, surge) = (&self.loops, &mut self.surge);
                loops.command(&self.hull, surge, &self.state, &reference)
            }
            None => UnderwaterInput::default(),
        };
        let through_water = direction(self.heading()) * self.horizontal_speed();
        self.state = rk4(&self.state, PERIOD, |state| self.hull.derivative(state, input, current));
        self.gamma += command.point_speed * PERIOD;
        self.tracking_error.time += PERIOD;
        // A vehicle cannot leave the water.
        self.state[2] = self.state[2].max(0.0);
        self.navigate(&through_water);
    }

    /// Dead reckoning uses heading and speed through the water, without the current.
    fn navigate(&mut self, through_water: &Vector2<f64>) {
        self.navigation_error += self.navigation_drift * (through_water.norm() * PERIOD);
        if self.fix_at_surface && self.depth() <= ANTENNA_DEPTH {
            self.navigation_error = Vector2::zeros();
        }
        self.position_estimate = match self.navigation {
            Navigation::GpsAtSurface if ANTENNA_DEPTH < self.depth() => {
                self.position_estimate + through_water * PERIOD
            }
            Navigation::Exact | Navigation::GpsAtSurface => self.position() + self.navigation_error,
        };
    }
}

#[cfg(test)]
mod forecast_tests;
