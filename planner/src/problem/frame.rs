//! The craft's frame: origin at its position, first axis along its bow, time 0 now.

use nalgebra::{Matrix2, Vector2};

use crate::craft::response::Stage;
use crate::facts::angle::{Heading, angle_of, ned_from_body};
use crate::facts::asc::AscNow;
use crate::facts::reference::TrajectoryPoint;
use crate::predict::motion::Motion;
use crate::snapshot::build::Snapshot;

/// Least speed with a usable direction, m/s.
pub(crate) const SPEED_WITHOUT_DIRECTION: f64 = 0.02;

/// Transforms between north-east and (ahead, starboard) of the craft now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    now: f64,
    origin: Vector2<f64>,
    ned_from_craft: Matrix2<f64>,
    heading: Heading,
}

impl Frame {
    pub(crate) fn of(snapshot: &Snapshot) -> Self {
        Self {
            now: snapshot.t_s,
            origin: snapshot.asc.position(),
            ned_from_craft: ned_from_body(snapshot.asc.heading().radians()),
            heading: snapshot.asc.heading(),
        }
    }

    /// Time on the snapshot's clock, s, `ahead` seconds after the snapshot.
    pub(crate) fn time(&self, ahead: f64) -> f64 {
        self.now + ahead
    }

    /// A NED angle as an angle from the bow, rad, not wrapped.
    pub(crate) fn angle(&self, ned: f64) -> f64 {
        ned - self.heading.radians()
    }

    /// A position (north, east) in the craft's frame, m.
    pub(crate) fn position(&self, ned: &Vector2<f64>) -> Vector2<f64> {
        self.ned_from_craft.transpose() * (ned - self.origin)
    }

    /// A position in the craft's frame as (north, east), m.
    pub(crate) fn ned_position(&self, position: &Vector2<f64>) -> Vector2<f64> {
        self.origin + self.ned_from_craft * position
    }

    /// A vector (north, east) in the craft's frame.
    pub(crate) fn vector(&self, ned: &Vector2<f64>) -> Vector2<f64> {
        self.ned_from_craft.transpose() * ned
    }

    pub(crate) fn motion(&self, ned: &Motion) -> Motion {
        let craft_from_ned = self.ned_from_craft.transpose();
        Motion {
            position: craft_from_ned * (ned.position - self.origin),
            velocity: craft_from_ned * ned.velocity,
        }
    }

    /// The craft of a rollout in NED.
    pub(crate) fn asc_in_ned(&self, asc: &AscNow) -> AscNow {
        AscNow {
            position: self.ned_position(&asc.position),
            heading: Heading::new(self.heading.radians() + asc.heading.radians()),
            current: self.ned_from_craft * asc.current,
        }
    }

    /// A point of a trajectory as a stage in the craft's frame.
    pub(crate) fn stage(&self, point: &TrajectoryPoint) -> Stage {
        let craft_from_ned = self.ned_from_craft.transpose();
        Stage {
            position: craft_from_ned * (point.position() - self.origin),
            velocity: craft_from_ned * point.heading().unit() * point.speed_mps,
        }
    }

    /// `stages` as a trajectory in NED; one too slow for a direction keeps the previous heading.
    pub(crate) fn trajectory(
        &self,
        stages: &[Stage],
        times: &[f64],
    ) -> impl Iterator<Item = TrajectoryPoint> {
        let mut heading = self.heading;
        stages.iter().zip(times).enumerate().map(move |(k, (stage, time))| {
            let velocity = self.ned_from_craft * stage.velocity;
            if k > 0 && velocity.norm() >= SPEED_WITHOUT_DIRECTION {
                heading = Heading::new(angle_of(&velocity));
            }
            let position = self.ned_position(&stage.position);
            TrajectoryPoint::new(self.now + time, position, stage.velocity.norm(), heading)
        })
    }
}
