//! Snapshots that the tests start from, and the service without a socket and with one.

pub mod autopilot;
pub mod broken;
pub mod client;
pub mod random;
pub mod server;

use nalgebra::Vector2;
use planner::{
    angle::{Course, Heading},
    craft::{CraftDescription, Preset},
    plan::{Workspace, plan},
    policy::Policy,
    snapshot::{
        AscState, Auv, AuvState, Evidence, Fallback, ForecastChoice, Goal, HoldStyle, Limits, Observation,
        Offset, PreviousPlan, Snapshot, VehicleId,
    },
};

/// An AUV at (north, east) metres on a course, at the horizontal speed of a 50° sawtooth, 0.193 m/s.
#[must_use]
pub fn auv(id: &str, north: f64, east: f64, course: f64) -> Auv {
    Auv {
        id: VehicleId(id.into()),
        evidence: Evidence::State(AuvState {
            position: Vector2::new(north, east),
            depth: 5.0,
            course: Course::new(course),
            speed: 0.193,
            turn_rate: 0.0,
            age: 0.4,
            covariance: None,
        }),
        path: None,
        dive: None,
    }
}

/// The state of AUV number `i`, to be changed.
///
/// # Panics
/// Where it is known by reports: a test's own mistake.
#[must_use]
pub fn state(observation: &mut Observation, i: usize) -> &mut AuvState {
    let evidence = &mut observation.auvs[i].evidence;
    evidence.state_mut().expect("the test's AUVs have states")
}

/// The names of the two AUVs of [`observation`].
#[must_use]
pub fn both() -> Vec<VehicleId> {
    vec![VehicleId("auv-1".into()), VehicleId("auv-2".into())]
}

/// The craft that the tests' limits are of, described by its name.
#[must_use]
pub fn medusa() -> CraftDescription {
    CraftDescription {
        preset: Preset::named("medusa"),
        ..CraftDescription::default()
    }
}

/// A craft at the datum with two AUVs ahead, on parallel northward lanes 60 m apart.
#[must_use]
pub fn observation(goal: Goal) -> Observation {
    Observation {
        time: 200.0,
        asc: AscState {
            position: Vector2::zeros(),
            heading: Heading::new(0.3),
            surge: 0.3,
            sway: 0.01,
            yaw_rate: 0.0,
            ground_velocity: None,
        },
        auvs: vec![auv("auv-1", 12.0, -3.0, 0.02), auv("auv-2", 10.0, 57.0, 0.0)],
        goal,
        offset: None,
        current: Some(Vector2::new(0.02, 0.05)),
        limits: Limits::MEDUSA,
        craft: medusa(),
        keep_outs: vec![],
        area: vec![],
        range_max: None,
        surfacing_separation: None,
        forecast: ForecastChoice::Auto,
        fallback: Fallback::Los,
        hold: HoldStyle::SlowTurn,
        previous_plan: None,
    }
}

/// The goals that the planner knows, each with the AUVs of [`observation`].
#[must_use]
pub fn goals() -> [Goal; 5] {
    [
        Goal::Track {
            auv: VehicleId("auv-1".into()),
        },
        Goal::Intermittent {
            auvs: both(),
            dwell: 240.0,
            epoch: 0.0,
        },
        Goal::Midpoint { auvs: both() },
        Goal::Weighted {
            weights: both().into_iter().zip([0.7, 0.3]).collect(),
        },
        Goal::Range {
            auvs: both(),
            radius: 60.0,
        },
    ]
}

/// The offsets that do not need a path, to starboard and a little astern.
#[must_use]
pub fn offsets() -> [Offset; 2] {
    let by = Vector2::new(-5.0, 15.0);
    [Offset::Ned(by), Offset::Target(by)]
}

/// The observation as a snapshot.
///
/// # Panics
/// Where the observation is not a valid one: a test's own mistake.
#[must_use]
pub fn snapshot(observation: Observation) -> Snapshot {
    Snapshot::try_from(observation).expect("the test starts from a valid observation")
}

/// The first goal, and a craft that has followed the plan made `age` seconds ago and hands it back.
///
/// # Panics
/// Never: the plan begins before now.
#[must_use]
pub fn followed(age: f64) -> Observation {
    let mut observation = observation(goals()[0].clone());
    let before = snapshot(Observation {
        time: observation.time - age,
        ..observation.clone()
    });
    let answer = plan(&before, &Policy::default(), &mut Workspace::default());
    let now = answer
        .trajectory
        .iter()
        .rfind(|point| point.time <= observation.time)
        .expect("the plan was made before");
    observation.asc.position = now.position;
    observation.asc.heading = now.heading;
    (observation.asc.surge, observation.asc.sway) = (now.speed, 0.0);
    let moved = state(&mut observation, 0).velocity() * age;
    state(&mut observation, 0).position += moved;
    observation.previous_plan = Some(PreviousPlan {
        reference: None,
        command: None,
        craft: None,
        ..PreviousPlan::from(&answer)
    });
    observation
}
