//! A craft that follows its reference at once, for tests of the laws.

use nalgebra::Vector2;

use crate::facts::angle::{Heading, direction, ned_from_body};
use crate::facts::asc::{AscNow, Limits};
use crate::los::law::{LosGains, LosLaw, LosTuning};
use crate::los::tracking_law::TrackingLaw;
use crate::predict::motion::Motion;

/// A target on a straight line, and the craft that follows it.
#[derive(Clone, Copy)]
pub(crate) struct Flight {
    /// The target's start (north, east), m.
    pub(crate) datum: Vector2<f64>,
    /// The craft's start relative to the target's (north, east), m.
    pub(crate) start: Vector2<f64>,
    /// The target's course, rad.
    pub(crate) course: f64,
    /// The target's speed, m/s.
    pub(crate) target_speed: f64,
    /// The true current, m/s.
    pub(crate) current: Vector2<f64>,
    /// The law's current, m/s.
    pub(crate) known: Vector2<f64>,
}

impl Default for Flight {
    fn default() -> Self {
        Self {
            datum: Vector2::zeros(),
            start: Vector2::new(-15.0, -8.0),
            course: 0.0,
            // Horizontal speed of a 50° sawtooth at 0.3 m/s.
            target_speed: 0.193,
            current: Vector2::zeros(),
            known: Vector2::zeros(),
        }
    }
}

/// A craft in still water.
pub(crate) fn craft_at(position: Vector2<f64>, heading: f64) -> AscNow {
    AscNow { position, heading: Heading::new(heading), current: Vector2::zeros() }
}

pub(crate) fn tuning(law: LosLaw) -> LosTuning {
    LosTuning { law, gains: LosGains { look_ahead: 5.0, along_track_gain: 0.1 }, integral_gain: 0.05 }
}

/// The craft's position relative to its target after `seconds`, (ahead, starboard), m.
pub(crate) fn miss_after(seconds: u32, tuning: LosTuning, flight: &Flight) -> Vector2<f64> {
    /// Simulation steps in a second.
    const PARTS: u32 = 10;
    let velocity = direction(flight.course) * flight.target_speed;
    let target = |time: f64| Motion { position: flight.datum + velocity * time, velocity };
    let held = crate::facts::angle::Course::new(flight.course);
    let mut tracking = TrackingLaw::new(tuning, Some(held));
    let mut asc = craft_at(flight.datum + flight.start, flight.course);
    asc.current = flight.known;
    for second in 0..seconds {
        let time = f64::from(second);
        let reference = tracking.steer(time, &asc, &target(time), &Limits::MEDUSA);
        asc.heading = reference.heading;
        for _ in 0..PARTS {
            let ground = reference.heading.unit() * reference.speed + flight.current;
            asc.position += ground / f64::from(PARTS);
        }
    }
    let end = target(f64::from(seconds));
    ned_from_body(flight.course).transpose() * (asc.position - end.position)
}
