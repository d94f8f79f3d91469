//! The only path from truth to knowledge: measurements of the surface craft and received messages.
//!
//! All guidance laws see the same [`Snapshot`]: errors of sensors and messages have their own
//! random streams, and every step draws the same number from them.

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix4, Vector2};
use planner::{
    angle::Course,
    craft::CraftDescription,
    path::Segment,
    snapshot::{
        Acoustics as AcousticLink, Auv, AuvState, DeclaredPath, Dive, Forecast, Goal, GroundTrack,
        InvalidRequest, LEG_HEIGHT_MIN, Limits, Offset, PlanRequest, REPORT_SIGMA_MAX, REPORT_SIGMA_MIN,
        Report, Snapshot, Task, Tuning,
    },
    tuned::Tuned,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    record::Bounds,
    world::{SurfaceCraft, World, auv::SimulatedAuv, underwater_vehicle::Navigation},
};

mod acoustics;
mod ais;
mod noise;
mod sensors;

pub use acoustics::{Acoustics, AcousticsSetup, Fix, Telemetry};
pub use ais::{Ais, AisSetup};
pub(crate) use noise::normal_pair;
pub use sensors::{SensorSetup, SurfaceSensors};

/// Largest number of reports kept of a vehicle, the newest: five minutes at one every ten seconds.
const REPORTS_KEPT: usize = 32;
/// Largest age of a report relative to the newest, s. Older motion says nothing about the present.
const HISTORY: f64 = 300.0;
/// Standard deviation that the report of an exact position claims, m.
const EXACT_SIGMA: f64 = 0.01;
/// Standard deviation of a launch position along either axis, m. Assumption: that of GNSS.
const LAUNCH_SIGMA: f64 = 1.0;
/// Standard deviation of the speed that an AUV states along either axis, m/s. Assumption.
const OWN_SPEED_SIGMA: f64 = 0.02;

/// Knowledge of the surface craft from the start, without observation.
#[derive(Clone, Debug, PartialEq)]
pub struct Briefing {
    /// Its goal.
    pub goal: Goal,
    /// Offset from the point that the goal follows.
    pub offset: Option<Offset>,
    /// Its limits with its loops closed.
    pub limits: Limits,
    /// The craft description for the planner.
    pub craft: CraftDescription,
    /// The planner's tuning.
    pub tuning: Option<Tuning>,
    /// Numbers of its estimates and forecasts.
    pub tuned: Tuned,
    /// `true`: snapshots contain the current at the craft.
    pub current: bool,
    /// `true`: snapshots contain paths, speeds and dives of the underwater vehicles.
    pub paths: bool,
    /// Forecast of underwater vehicles that snapshots ask for.
    pub forecast: Forecast,
    /// Form of the messages in snapshots.
    pub reported_as: ReportedAs,
    /// `true`: reports have course, speed and rate of turn.
    pub course_and_speed: bool,
    /// Its bounds. Snapshots do not contain the energy.
    pub bounds: Bounds,
}

/// Form of an underwater vehicle's messages in a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportedAs {
    /// `reports`: every message of the last five minutes.
    #[default]
    Reports,
    /// `state`: the newest message, as if it were exact.
    State,
    /// `reports` of slant ranges, by a modem without bearings. The first is measured at the start:
    /// the craft does not know where the vehicle was launched. Outliers are longer, never shorter.
    Ranges,
}

/// The surface craft's sensors and modem, and their data so far.
#[derive(Clone, Debug)]
pub struct Observer {
    /// Knowledge of the surface craft from the start.
    pub briefing: Briefing,
    sensors: SurfaceSensors,
    /// Acoustic channel; without it, every observation contains every vehicle's exact state.
    pub(crate) acoustics: Option<Acoustics>,
    /// Receiver of what other vessels say, if there are any.
    pub ais: Option<Ais>,
    /// The messages of every underwater vehicle, in the world's order.
    received: Vec<Received>,
    /// Error of its last own position estimate (north, east), m, to which fixes are relative.
    own_error: Vector2<f64>,
    /// Buffers of [`Acoustics::step`] and [`Acoustics::receive`]: listening allocates nothing.
    all_telemetry: Vec<Telemetry>,
    silent: Vec<bool>,
    fixes: Vec<Fix>,
}

/// Messages of an underwater vehicle as sent, at least one: the truth, if communication is perfect.
#[derive(Clone, Debug)]
struct Received {
    messages: Vec<Message>,
}

/// A vehicle's telemetry, with its position as measured by the surface craft.
#[derive(Clone, Copy, Debug)]
struct Message {
    sent_at: f64,
    telemetry: Telemetry,
    /// Slant range, m, and where the craft measured it.
    range: (f64, Vector2<f64>),
    /// σ of the position along either axis, or of the range, m.
    sigma: f64,
}

impl Observer {
    /// The observer of `world` at its start, with the launch position of every underwater vehicle.
    pub fn new(
        world: &World,
        briefing: Briefing,
        sensors: SurfaceSensors,
        acoustics: Option<Acoustics>,
    ) -> Self {
        let mut observer = Self {
            briefing,
            sensors,
            acoustics,
            ais: None,
            received: Vec::with_capacity(world.auvs.len()),
            own_error: Vector2::zeros(),
            all_telemetry: Vec::with_capacity(world.auvs.len()),
            silent: Vec::with_capacity(world.auvs.len()),
            fixes: Vec::with_capacity(world.auvs.len()),
        };
        let launched = world.auvs.iter().map(|auv| {
            let mut messages = Vec::with_capacity(REPORTS_KEPT);
            let craft = world.surface_craft.as_ref().map_or(Vector2::zeros(), SurfaceCraft::position);
            messages.push(Message {
                sent_at: world.time(),
                telemetry: telemetry_of(auv, world),
                range: ((auv.position() - craft).norm().hypot(auv.depth()).max(LAUNCH_SIGMA), craft),
                sigma: LAUNCH_SIGMA,
            });
            Received { messages }
        });
        observer.received.extend(launched);
        observer
    }

    /// Listens for one inner-loop period.
    pub fn listen(&mut self, world: &World) {
        if let Some(ais) = &mut self.ais {
            ais.listen(world.time(), &world.vessels);
        }
        let (Some(acoustics), Some(craft)) = (&mut self.acoustics, &world.surface_craft) else {
            return;
        };
        let time = world.time();
        self.all_telemetry.clear();
        self.silent.clear();
        for (i, auv) in world.auvs.iter().enumerate() {
            self.all_telemetry.push(telemetry_of(auv, world));
            self.silent.push(world.faults.is_silent(i, time));
        }
        acoustics.step(world.periods(), &craft.position(), &self.all_telemetry, &self.silent);
        self.fixes.clear();
        acoustics.receive(time, &mut self.fixes);
        for fix in &self.fixes {
            let message = Message {
                sent_at: fix.sent_at,
                telemetry: Telemetry {
                    position: fix.telemetry.position + self.own_error,
                    speed: reported_speed(fix.vehicle, fix.telemetry.speed, world, time),
                    ..fix.telemetry
                },
                range: (fix.range, fix.from + self.own_error),
                sigma: fix.sigma.max(EXACT_SIGMA) * world.faults.accuracy_factor(fix.vehicle, time),
            };
            self.received[fix.vehicle].keep(message);
            if world.faults.messages_twice(fix.vehicle, time) {
                self.received[fix.vehicle].keep(message);
            }
        }
    }

    /// The present knowledge, `interval` s after the last. `craft` is the world's surface craft.
    pub fn observe(
        &mut self,
        world: &World,
        craft: &SurfaceCraft,
        interval: f64,
    ) -> Result<Snapshot, InvalidRequest> {
        let request = self.request(world, craft, interval);
        Snapshot::with(request, &self.briefing.tuned, &|| false)
    }

    /// The same, before anything is checked and estimated.
    pub fn request(&mut self, world: &World, craft: &SurfaceCraft, interval: f64) -> PlanRequest {
        let time = world.time();
        if self.acoustics.is_none() {
            self.receive_every_state(world);
        }
        let current = world.water.current(&craft.position(), 0.0);
        let asc = self.sensors.measure(craft, &current, world.faults.gnss_works(time), interval);
        self.own_error = asc.position() - craft.position();
        let clock = time + world.faults.clock_offset(time);
        let briefing = &self.briefing;
        let as_state = self.acoustics.is_none() || briefing.reported_as == ReportedAs::State;
        let auv = |(received, auv): (&Received, &SimulatedAuv)| {
            let known = if as_state {
                Auv::new(auv.id.clone(), received.state(clock))
            } else {
                Auv::reported(auv.id.clone(), received.reports(clock, briefing))
            };
            let declares_none = auv.track.is_some() && Arc::ptr_eq(&auv.declared, &auv.path);
            if !briefing.paths || declares_none {
                return known;
            }
            // The planned speed at the last known position: the present position is unknown.
            let last_known = auv.path.closest(&received.newest().telemetry.position);
            let speed = auv.speed_at(last_known) * auv.dive.pitch.cos();
            Auv {
                path: Some(known_path(auv, speed)),
                dive: known_dive(auv, received.newest().telemetry.descending),
                ..known
            }
        };
        let auvs = self.received.iter().zip(&world.auvs).map(auv).collect();
        let range_max_m = briefing.bounds.range_max;
        PlanRequest {
            current: briefing.current.then_some(current.into()),
            limits: Some(briefing.limits.into()),
            craft: Some(briefing.craft.clone()),
            tuning: briefing.tuning.clone(),
            keep_outs: briefing.bounds.keep_outs.clone(),
            no_go: briefing.bounds.no_go.clone(),
            area: briefing.bounds.area.iter().copied().map(Into::into).collect(),
            forecast: briefing.forecast,
            traffic: self.ais.as_ref().map_or_else(Vec::new, |ais| ais.known(&world.vessels)),
            vessel_separation_m: briefing.bounds.vessel_separation,
            acoustics: range_max_m.map(|range_max_m| AcousticLink { range_max_m }),
            ..PlanRequest::new(
                clock,
                asc,
                auvs,
                Task { goal: briefing.goal.clone(), offset: briefing.offset },
            )
        }
    }

    /// Perfect communication, except with silent vehicles.
    fn receive_every_state(&mut self, world: &World) {
        let time = world.time();
        for (i, (received, auv)) in self.received.iter_mut().zip(&world.auvs).enumerate() {
            if !world.faults.is_silent(i, time) {
                let auv_telemetry = telemetry_of(auv, world);
                received.messages.clear();
                received.messages.push(Message {
                    sent_at: time,
                    telemetry: Telemetry {
                        speed: reported_speed(i, auv_telemetry.speed, world, time),
                        ..auv_telemetry
                    },
                    range: (0.0, Vector2::zeros()),
                    sigma: EXACT_SIGMA,
                });
            }
        }
    }
}

impl Received {
    fn newest(&self) -> &Message {
        self.messages.last().expect("the launch is the first message")
    }

    /// Adds a message, and removes the oldest beyond [`REPORTS_KEPT`] and those beyond [`HISTORY`].
    fn keep(&mut self, message: Message) {
        let messages = &mut self.messages;
        if messages.len() == REPORTS_KEPT {
            messages.remove(0);
        }
        let after = messages.partition_point(|earlier| earlier.sent_at <= message.sent_at);
        messages.insert(after, message);
        let newest = self.newest().sent_at;
        self.messages.retain(|message| newest - message.sent_at <= HISTORY);
    }

    /// The newest message as a state, at time `clock` of the surface craft.
    fn state(&self, clock: f64) -> AuvState {
        let Message { sent_at, telemetry, .. } = self.newest();
        // An AUV that is localised says where it believes to be, and how sure it is.
        let error = telemetry.own.map_or(Vector2::zeros(), |(error, _)| error);
        AuvState {
            turn_rate_radps: telemetry.turn_rate,
            // A slow clock can date a message in the future, which then counts as new.
            age_s: (clock - sent_at).max(0.0),
            covariance: telemetry.own.map(|(_, covariance)| state_covariance(&covariance)),
            ..AuvState::new(telemetry.position + error, telemetry.depth, telemetry.course, telemetry.speed)
        }
    }

    /// All messages as reports, at time `clock` of the surface craft.
    fn reports(&self, clock: f64, briefing: &Briefing) -> Vec<Report> {
        let measured = |message: &Message| {
            let (at, (range, from)) = (message.sent_at.min(clock), message.range);
            let sigma = message.sigma.clamp(REPORT_SIGMA_MIN, REPORT_SIGMA_MAX);
            match briefing.reported_as {
                ReportedAs::Ranges => Report::ranged(at, range, Some(from), sigma),
                ReportedAs::Reports | ReportedAs::State => Report::new(at, message.telemetry.position, sigma),
            }
        };
        let report = |message: &Message| {
            let Telemetry { depth, course, speed, turn_rate, .. } = message.telemetry;
            let track = briefing.course_and_speed.then_some(GroundTrack { course, speed });
            Report {
                depth_m: Some(depth),
                turn_rate_radps: track.map(|_| turn_rate),
                ..measured(message).with_ground_track(track)
            }
        };
        self.messages.iter().map(report).collect()
    }
}

/// The covariance of a state whose position has this one, row by row.
fn state_covariance(position: &Matrix2<f64>) -> [[f64; 4]; 4] {
    let mut whole = Matrix4::from_diagonal_element(OWN_SPEED_SIGMA.powi(2));
    whole.fixed_view_mut::<2, 2>(0, 0).copy_from(position);
    let row = |row: usize| std::array::from_fn(|column| whole[(row, column)]);
    std::array::from_fn(row)
}

/// The speed that AUV number `auv` reports instead of its `speed`, m/s.
fn reported_speed(auv: usize, speed: f64, world: &World, time: f64) -> f64 {
    if world.faults.reports_speed_zero(auv, time) { 0.0 } else { speed }
}

/// Telemetry of an AUV: its true ground track and rate of turn. An AUV without its position does
/// not know the current either: it reports its motion through the water.
fn telemetry_of(auv: &SimulatedAuv, world: &World) -> Telemetry {
    let current = match auv.navigation {
        Navigation::Exact => world.water.current(&auv.position(), auv.depth()),
        Navigation::GpsAtSurface => Vector2::zeros(),
    };
    let (ground, turn_rate) = auv.ground_track(world.time(), &current);
    Telemetry {
        position: auv.position(),
        depth: auv.depth(),
        course: Course::of(&ground),
        speed: ground.norm(),
        // The snapshot accepts ±1 rad/s; the quotient has no bound near rest over ground.
        turn_rate: turn_rate.clamp(-1.0, 1.0),
        descending: auv.pitch() < 0.0,
        own: auv.own_covariance.map(|covariance| (auv.navigation_error, covariance)),
    }
}

/// The path that an AUV declares at a horizontal `speed`, m/s, without its turning radius.
fn known_path(auv: &SimulatedAuv, speed: f64) -> DeclaredPath {
    let mut path = DeclaredPath::new(&auv.declared, speed);
    for segment in &mut path.segments {
        if let Segment::Waypoints { turn_radius_m, .. } = segment {
            *turn_radius_m = None;
        }
    }
    path
}

/// The sawtooth of an AUV's mission plan, unless it is too shallow.
fn known_dive(auv: &SimulatedAuv, descending: bool) -> Option<Dive> {
    let dive = &auv.dive;
    (dive.depth_min + LEG_HEIGHT_MIN <= dive.depth_max).then(|| Dive {
        depth_min_m: dive.depth_min,
        depth_max_m: dive.depth_max,
        pitch_rad: dive.pitch,
        reversal_s: Some(auv.loops.reversal_time()),
        descending: Some(descending),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;
    use crate::world::inner_loop::PERIOD;

    #[test]
    fn reported_course_and_turn_rate_match_the_ground_track() {
        let scenario = Scenario::named("cross-current").expect("exists");
        let mut world = scenario.start(1).expect("valid").world;
        let mut turning = 0;
        for _ in 0..6_000 {
            let start = world.auvs[0].clone();
            let before = telemetry_of(&start, &world);
            world.step(None);
            let auv = &world.auvs[0];
            let moved = (auv.position() - start.position()) / PERIOD;
            assert!((moved - before.course.unit() * before.speed).norm() < 0.02);
            let after = telemetry_of(auv, &world);
            let steady = (auv.horizontal_speed() - start.horizontal_speed()).abs() < 1e-5;
            if steady && before.turn_rate.abs() > 0.005 {
                turning += 1;
                let turned = planner::angle::wrap(after.course.radians() - before.course.radians());
                // The mean of both ends: the trapezoidal rule errs in second order of the period.
                let mean_rate = 0.5 * (before.turn_rate + after.turn_rate);
                assert!((turned / PERIOD - mean_rate).abs() < 1e-3, "{turned}");
            }
        }
        assert!(turning > 100, "{turning}");
    }
}
