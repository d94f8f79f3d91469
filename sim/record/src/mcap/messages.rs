//! Vehicles as messages: from north-east-down to the viewers' east-north-up.

use std::f64::consts::FRAC_PI_2;

use geodesy::Datum;
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use serde_json::{Value, json};

use crate::table::Row;

/// The fixed frame.
pub(super) const WORLD: &str = "world";

/// The type of an unknown covariance.
const UNKNOWN: u8 = 0;
const COVARIANCE: [f64; 9] = [0.0; 9];

/// A time since the mission's start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time(u64);

impl Time {
    const PER_SECOND: u64 = 1_000_000_000;

    /// Rounded to the nearest nanosecond; 0 before the start.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "missions last days, not the 584 years that fit, and the cast saturates"
    )]
    pub(super) fn of_seconds(seconds: f64) -> Self {
        Self((seconds * Self::PER_SECOND as f64).round() as u64)
    }

    pub(super) fn nanoseconds(self) -> u64 {
        self.0
    }

    pub(super) fn json(self) -> Value {
        json!({"sec": self.0 / Self::PER_SECOND, "nsec": self.0 % Self::PER_SECOND})
    }
}

/// Position and attitude of a vehicle, north-east-down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vehicle {
    /// (north, east), m.
    pub(super) position: Vector2<f64>,
    /// m, positive down.
    pub(super) depth: f64,
    /// rad.
    pub(super) heading: f64,
    /// rad, positive bow up.
    pub(super) pitch: f64,
}

impl Vehicle {
    /// The vehicle of a row with a position. Unknown values are 0; a course replaces a heading.
    pub(super) fn of<'a>(row: &Row<'a>) -> Option<(&'a str, Self)> {
        let (id, position) = row.place()?;
        let vehicle = Self {
            position,
            depth: row.depth_m.unwrap_or(0.0),
            heading: row.heading_rad.or(row.course_rad).unwrap_or(0.0),
            pitch: row.pitch_rad.unwrap_or(0.0),
        };
        Some((id, vehicle))
    }

    /// Rotation from forward-port-up to east-north-up.
    ///
    /// ```text
    /// R = R_z(π/2 − ψ) R_y(−θ)
    /// ```
    ///
    /// z is up: positive turns are counter-clockwise, from the east. y is to port: positive turns
    /// about it are nose-down.
    fn orientation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2 - self.heading)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -self.pitch)
    }

    fn pose(&self) -> [Value; 2] {
        let q = self.orientation();
        let orientation = json!({"x": q.i, "y": q.j, "z": q.k, "w": q.w});
        [point(&self.position, self.depth), orientation]
    }
}

/// x, y, z in `world` of a position (north, east) at a depth, m.
pub(super) fn point(position: &Vector2<f64>, depth: f64) -> Value {
    // A difference: the sea surface is at 0, not at −0.
    json!({"x": position.y, "y": position.x, "z": 0.0 - depth})
}

pub(super) fn frame_transforms(id: &str, vehicle: &Vehicle, time: Time) -> Value {
    let [translation, rotation] = vehicle.pose();
    json!({"transforms": [{
        "timestamp": time.json(),
        "parent_frame_id": WORLD,
        "child_frame_id": id,
        "translation": translation,
        "rotation": rotation,
    }]})
}

pub(super) fn pose_in_frame(vehicle: &Vehicle, time: Time) -> Value {
    let [position, orientation] = vehicle.pose();
    json!({
        "timestamp": time.json(),
        "frame_id": WORLD,
        "pose": {"position": position, "orientation": orientation},
    })
}

pub(super) fn location_fix(id: &str, vehicle: &Vehicle, datum: &Datum, time: Time) -> Value {
    let place = datum.from_local(&vehicle.position);
    json!({
        "timestamp": time.json(),
        "frame_id": id,
        "latitude": place.latitude.to_degrees(),
        "longitude": place.longitude.to_degrees(),
        "altitude": 0.0 - vehicle.depth,
        "position_covariance": COVARIANCE,
        "position_covariance_type": UNKNOWN,
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::{Matrix3, Rotation3};

    use super::*;

    fn lying(heading: f64, pitch: f64) -> Vehicle {
        Vehicle { position: Vector2::new(3.0, 4.0), depth: 5.0, heading, pitch }
    }

    #[test]
    fn the_quaternion_matches_the_north_east_down_rotation() {
        // North, east, down → east, north, up; and forward, port, up → forward, starboard, down.
        let enu_from_ned = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        let starboard_down_from_port_up = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        for heading in [-PI, -2.0, -0.3, 0.0, 0.5, FRAC_PI_2, 3.0] {
            for pitch in [-0.873, 0.0, 0.4, 0.873] {
                let ned_from_body = Rotation3::from_euler_angles(0.0, pitch, heading);
                let expected = enu_from_ned * ned_from_body.matrix() * starboard_down_from_port_up;
                let rotation = lying(heading, pitch).orientation().to_rotation_matrix();
                // A few roundings of numbers below 1.
                assert!((rotation.matrix() - expected).norm() < 1e-14, "{heading} {pitch}");
            }
        }
    }

    #[test]
    fn a_time_is_rounded_once_and_never_negative() {
        assert_eq!(Time::of_seconds(1919.1).json(), json!({"sec": 1919, "nsec": 100_000_000}));
        assert_eq!(Time::of_seconds(-1.0).nanoseconds(), 0);
        assert_eq!(Time::of_seconds(f64::NAN).nanoseconds(), 0);
    }
}
