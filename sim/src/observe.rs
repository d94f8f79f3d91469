//! The only gate from truth to knowledge: what the surface craft measures of itself and hears of the others.
//!
//! A guidance law sees a [`Snapshot`] and nothing else, and every law sees the same one: the errors of
//! sensors and messages come from seeds of their own and are drawn in the same number whatever happens.

use nalgebra::Vector2;
use planner::{
    angle::{Course, direction, ned_from_body},
    craft::CraftDescription,
    snapshot::{
        Auv, AuvState, Dive, Evidence, Fallback, ForecastChoice, Goal, GroundTrack, HoldStyle,
        InvalidObservation, KnownPath, LEG_HEIGHT_MIN, Limits, Observation, Offset, REPORT_SIGMA_MIN, Report,
        Snapshot,
    },
};

use crate::{
    record::Bounds,
    world::{SurfaceCraft, World, auv::SimulatedAuv, underwater_vehicle::Navigation},
};

mod acoustics;
mod noise;
mod sensors;
mod setup;

pub use acoustics::{Acoustics, AcousticsSetup, Emission, Fix, Tally};
pub use sensors::{SensorSetup, SurfaceSensors, SurfaceTruth};
pub use setup::InvalidSetup;

/// Most reports of a vehicle that are kept, the newest: five minutes of one every ten seconds.
const REPORTS_KEPT: usize = 32;
/// How much older than the newest a report may be that is kept, s. What a vehicle did before says nothing of now.
const HISTORY: f64 = 300.0;
/// Standard deviation of where a vehicle was launched, m, along either axis. Assumption: a satellite receiver's.
const LAUNCH_SIGMA: f64 = 1.0;

/// What the surface craft knows from the start and does not observe.
#[derive(Clone, Debug, PartialEq)]
pub struct Briefing {
    /// Its task.
    pub goal: Goal,
    /// How far from what the goal follows.
    pub offset: Option<Offset>,
    /// What it can do with its loops closed.
    pub limits: Limits,
    /// The craft description given to the planner.
    pub craft: CraftDescription,
    /// Whether snapshots give the current at the craft.
    pub current: bool,
    /// Whether snapshots give the underwater vehicles' paths and speeds, and how they dive.
    pub paths: bool,
    /// Whether snapshots give only the newest message of an underwater vehicle, as a state.
    pub newest_as_state: bool,
    /// Where it is meant to stay, and how much energy it has; a snapshot has no place for the energy.
    pub bounds: Bounds,
}

/// The surface craft's sensors and modem, and what they gathered.
#[derive(Clone, Debug)]
pub struct Observer {
    briefing: Briefing,
    sensors: SurfaceSensors,
    /// None: every underwater vehicle is known as it is, at every look.
    acoustics: Option<Acoustics>,
    /// What was heard of every underwater vehicle, in the world's order.
    heard: Vec<Heard>,
    /// Error of its own position estimate at its last look (north, east), m: fixes are measured from that estimate.
    own_error: Vector2<f64>,
    /// Room for [`Acoustics::step`] and [`Acoustics::receive`], so that listening allocates nothing.
    emissions: Vec<Emission>,
    silent: Vec<bool>,
    fixes: Vec<Fix>,
}

/// What was heard of an underwater vehicle: messages in the order in which they were sent, at least one. With perfect
/// communication one, which is the truth.
#[derive(Clone, Debug)]
struct Heard {
    messages: Vec<Message>,
}

/// Telemetry of a vehicle, and its position as the surface craft measured it.
#[derive(Clone, Copy, Debug)]
struct Message {
    sent_at: f64,
    emission: Emission,
    /// σ of the position along either axis, m.
    sigma: f64,
}

impl Observer {
    /// Of `world` at its start, when every underwater vehicle was just launched: where each is then is known.
    #[must_use]
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
            heard: Vec::with_capacity(world.auvs.len()),
            own_error: Vector2::zeros(),
            emissions: Vec::with_capacity(world.auvs.len()),
            silent: Vec::with_capacity(world.auvs.len()),
            fixes: Vec::with_capacity(world.auvs.len()),
        };
        let launched = world.auvs.iter().map(|auv| {
            let mut messages = Vec::with_capacity(REPORTS_KEPT);
            messages.push(Message {
                sent_at: world.time(),
                emission: emission(auv, world),
                sigma: LAUNCH_SIGMA,
            });
            Heard { messages }
        });
        observer.heard.extend(launched);
        observer
    }

    /// What the craft's guide knows from the start.
    pub fn briefing_mut(&mut self) -> &mut Briefing {
        &mut self.briefing
    }

    /// Listens for one inner-loop period.
    pub fn listen(&mut self, world: &World) {
        let (Some(acoustics), Some(craft)) = (&mut self.acoustics, &world.surface_craft) else {
            return;
        };
        let time = world.time();
        self.emissions.clear();
        self.silent.clear();
        for (i, auv) in world.auvs.iter().enumerate() {
            self.emissions.push(emission(auv, world));
            self.silent.push(world.faults.is_silent(i, time));
        }
        acoustics.step(world.periods(), &craft.position(), &self.emissions, &self.silent);
        self.fixes.clear();
        acoustics.receive(time, &mut self.fixes);
        for fix in &self.fixes {
            let said = Emission {
                position: fix.position + self.own_error,
                depth: fix.depth,
                course: fix.course,
                speed: fix.speed,
                turn_rate: fix.turn_rate,
                descending: fix.descending,
            };
            self.heard[fix.vehicle].keep(Message {
                sent_at: fix.sent_at,
                emission: said,
                sigma: fix.sigma,
            });
        }
    }

    /// What is known now, `interval` s after the look before. `craft` is the world's surface craft.
    pub fn look(
        &mut self,
        world: &World,
        craft: &SurfaceCraft,
        interval: f64,
    ) -> Result<Snapshot, InvalidObservation> {
        let time = world.time();
        if self.acoustics.is_none() {
            self.receive_every_state(world);
        }
        let current = world.water.current(&craft.position(), 0.0);
        let truth = SurfaceTruth {
            position: craft.position(),
            heading: craft.state[2],
            surge: craft.state[3],
            sway: craft.state[4],
            yaw_rate: craft.state[5],
            ground_velocity: ned_from_body(craft.state[2]) * Vector2::new(craft.state[3], craft.state[4])
                + current,
        };
        let asc = self
            .sensors
            .measure(&truth, world.faults.gnss_works(time), interval);
        self.own_error = asc.position - craft.position();
        let clock = time + world.faults.clock_offset(time);
        let briefing = &self.briefing;
        let as_state = self.acoustics.is_none() || briefing.newest_as_state;
        let auv = |(heard, auv): (&Heard, &SimulatedAuv)| Auv {
            id: auv.id.clone(),
            evidence: if as_state {
                heard.state(clock)
            } else {
                heard.reports(clock)
            },
            path: briefing.paths.then(|| KnownPath {
                path: auv.path.clone(),
                // As planned for where it was heard: where it is now is not known.
                horizontal_speed: auv.speed_at(auv.path.closest(&heard.newest().emission.position))
                    * auv.dive.pitch.cos(),
            }),
            dive: known_dive(auv, heard.newest().emission.descending).filter(|_| briefing.paths),
        };
        Snapshot::try_from(Observation {
            time: clock,
            asc,
            auvs: self.heard.iter().zip(&world.auvs).map(auv).collect(),
            goal: briefing.goal.clone(),
            offset: briefing.offset,
            current: briefing.current.then_some(current),
            limits: briefing.limits,
            craft: briefing.craft,
            keep_outs: briefing.bounds.keep_outs.clone(),
            area: briefing.bounds.area.clone(),
            range_max: briefing.bounds.range_max,
            surfacing_separation: None,
            forecast: ForecastChoice::Auto,
            fallback: Fallback::Los,
            hold: HoldStyle::SlowTurn,
            previous_plan: None,
        })
    }

    /// What became of the messages, where they go through the water.
    #[must_use]
    pub fn tally(&self) -> Option<Tally> {
        self.acoustics.as_ref().map(Acoustics::tally)
    }

    /// Perfect communication, except with silent vehicles.
    fn receive_every_state(&mut self, world: &World) {
        let time = world.time();
        for (i, (heard, auv)) in self.heard.iter_mut().zip(&world.auvs).enumerate() {
            if !world.faults.is_silent(i, time) {
                heard.messages.clear();
                heard.messages.push(Message {
                    sent_at: time,
                    emission: emission(auv, world),
                    sigma: 0.0,
                });
            }
        }
    }
}

impl Heard {
    fn newest(&self) -> &Message {
        self.messages
            .last()
            .expect("a vehicle is known from its launch on")
    }

    /// Keeps one more message, and drops those that are too old.
    fn keep(&mut self, message: Message) {
        let messages = &mut self.messages;
        if messages.len() == REPORTS_KEPT {
            messages.remove(0);
        }
        let after = messages.partition_point(|earlier| earlier.sent_at <= message.sent_at);
        messages.insert(after, message);
        let newest = self.newest().sent_at;
        self.messages
            .retain(|message| newest - message.sent_at <= HISTORY);
    }

    /// The newest, taken for the truth, at time `clock` of the surface craft.
    fn state(&self, clock: f64) -> Evidence {
        let Message {
            sent_at, emission, ..
        } = self.newest();
        Evidence::State(AuvState {
            position: emission.position,
            depth: emission.depth,
            course: emission.course,
            speed: emission.speed,
            turn_rate: emission.turn_rate,
            // A clock that is behind dates a message into the future: it can only be taken for new.
            age: (clock - sent_at).max(0.0),
            covariance: None,
        })
    }

    /// All of it, as a snapshot takes it at time `clock` of the surface craft.
    fn reports(&self, clock: f64) -> Evidence {
        let report = |message: &Message| Report {
            // As above.
            time: message.sent_at.min(clock),
            position: message.emission.position,
            sigma: message.sigma.max(REPORT_SIGMA_MIN),
            depth: Some(message.emission.depth),
            ground_track: Some(GroundTrack {
                course: message.emission.course,
                speed: message.emission.speed,
            }),
            turn_rate: Some(message.emission.turn_rate),
        };
        Evidence::Reports(self.messages.iter().map(report).collect())
    }
}

/// An AUV as it is: its ground track, and the course's rate of turn. One that does not know its place does not
/// know the current either: it reports its heading, and its speed and rate of turn through the water.
///
/// ```text
/// g = u_h [cosψ, sinψ] + v_c        χ̇ = ψ̇ u_h (g · [cosψ, sinψ]) / ‖g‖²
/// ```
/// The rate is that of a turn at steady speed, from the gyroscope: in a current the course also swings
/// for a few seconds whenever a pitch reversal changes `u_h`, which is no turn and is not reported as one.
fn emission(auv: &SimulatedAuv, world: &World) -> Emission {
    let current = world.water.current(&auv.position(), auv.depth());
    let bow = direction(auv.heading());
    let u_h = auv.horizontal_speed();
    let ground = match auv.navigation {
        Navigation::Exact => bow * u_h + current,
        Navigation::GpsAtSurface => bow * u_h,
    };
    let speed = ground.norm();
    // Standing still over ground there is no course to turn.
    let turn_rate = if speed < f64::EPSILON {
        0.0
    } else {
        auv.heading_rate() * u_h * ground.dot(&bow) / (speed * speed)
    };
    Emission {
        position: auv.position(),
        depth: auv.depth(),
        course: Course::of(&ground),
        speed,
        // The snapshot accepts ±1 rad/s; almost at rest over ground the quotient has no bound.
        turn_rate: turn_rate.clamp(-1.0, 1.0),
        descending: auv.pitch() < 0.0,
    }
}

/// The sawtooth of an AUV as its mission plan has it; none where it is too shallow for one.
fn known_dive(auv: &SimulatedAuv, descending: bool) -> Option<Dive> {
    let dive = &auv.dive;
    (dive.depth_min + LEG_HEIGHT_MIN <= dive.depth_max).then(|| Dive {
        depth_min: dive.depth_min,
        depth_max: dive.depth_max,
        pitch: dive.pitch,
        reversal: auv.loops.reversal_time(),
        descending: Some(descending),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;
    use crate::world::inner_loop::PERIOD;

    #[test]
    fn the_reported_course_and_turn_rate_are_those_of_the_ground_track() {
        let scenario = Scenario::named("cross-current").expect("exists");
        let mut world = scenario.start(1).expect("valid").world;
        let mut turning = 0;
        for _ in 0..6_000 {
            let start = world.auvs[0].clone();
            let before = emission(&start, &world);
            world.step(None);
            let auv = &world.auvs[0];
            let moved = (auv.position() - start.position()) / PERIOD;
            assert!((moved - before.course.unit() * before.speed).norm() < 0.02);
            let after = emission(auv, &world);
            let steady = (auv.horizontal_speed() - start.horizontal_speed()).abs() < 1e-5;
            if steady && before.turn_rate.abs() > 0.005 {
                turning += 1;
                let turned = planner::angle::wrap(after.course.radians() - before.course.radians());
                // The mean of both ends: the trapezium's error is of second order in the period.
                let mean_rate = 0.5 * (before.turn_rate + after.turn_rate);
                assert!((turned / PERIOD - mean_rate).abs() < 1e-3, "{turned}");
            }
        }
        assert!(turning > 100, "{turning}");
    }
}
