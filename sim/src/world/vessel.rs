//! Other vessels: points with a course and a speed, which behave well or badly.

use nalgebra::Vector2;
use planner::angle::{direction, wrap};
use planner::snapshot::VesselStatus;
use schemars::JsonSchema;
use serde::Deserialize;

use super::inner_loop::PERIOD;

/// Rate at which a vessel turns, rad/s: 1°/s.
const TURN_RATE: f64 = 0.0175;
/// Time ahead for which one that gives way looks out, s, the distance that it keeps beside its half
/// length, m, and the angle by which it turns, rad.
const LOOKS_OUT: f64 = 180.0;
const KEEPS: f64 = 60.0;
const GIVES_WAY_BY: f64 = 0.6;
/// Time between two turns of one that fishes, s.
const FISHES_FOR: f64 = 90.0;

/// What a vessel does about the surface craft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Behaviour {
    /// It keeps its course and speed, whatever comes.
    #[default]
    StandsOn,
    /// It turns to starboard for the craft, and back when that is past.
    GivesWay,
    /// It turns once, by `turn_rad` at `turns_at_s`.
    Turns,
    /// It turns by `turn_rad` to and fro.
    Fishes,
}

/// Another vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedVessel {
    /// Its identity.
    pub id: String,
    /// Length over all, m.
    pub length: f64,
    /// The status that it reports.
    pub status: VesselStatus,
    /// What it does.
    pub behaviour: Behaviour,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Course over ground, rad.
    pub course: f64,
    /// Speed over ground, m/s.
    pub speed: f64,
    /// Course that it keeps while nothing is to be done, rad.
    pub intended: f64,
    /// Time of its turn, s, and the angle, rad.
    pub turn: (f64, f64),
}

impl SimulatedVessel {
    /// Advances by a period from `time`, among the craft with this position and velocity.
    pub(super) fn step(&mut self, time: f64, craft: Option<(Vector2<f64>, Vector2<f64>)>) {
        let (at, angle) = self.turn;
        let wanted = match self.behaviour {
            Behaviour::GivesWay if craft.is_some_and(|craft| self.is_in_the_way(craft)) => {
                self.intended + GIVES_WAY_BY
            }
            Behaviour::StandsOn | Behaviour::GivesWay => self.intended,
            Behaviour::Turns if time < at => self.intended,
            Behaviour::Turns => self.intended + angle,
            Behaviour::Fishes if (time / FISHES_FOR) % 2.0 < 1.0 => self.intended + angle,
            Behaviour::Fishes => self.intended - angle,
        };
        let most = TURN_RATE * PERIOD;
        self.course = wrap(self.course + wrap(wanted - self.course).clamp(-most, most));
        self.position += self.velocity() * PERIOD;
    }

    /// Velocity over ground (north, east), m/s.
    pub fn velocity(&self) -> Vector2<f64> {
        direction(self.course) * self.speed
    }

    /// `true` if it would come too near on its intended course.
    fn is_in_the_way(&self, (position, velocity): (Vector2<f64>, Vector2<f64>)) -> bool {
        let there = position - self.position;
        let relative = velocity - direction(self.intended) * self.speed;
        let time = -there.dot(&relative) / relative.norm_squared().max(f64::MIN_POSITIVE);
        let passes = (there + relative * time.max(0.0)).norm();
        (0.0..LOOKS_OUT).contains(&time) && passes < KEEPS + 0.5 * self.length
    }
}
