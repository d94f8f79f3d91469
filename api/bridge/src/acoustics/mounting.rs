//! The mounting of the transducer on the craft.

use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;

/// Place and rotation of the transducer in the craft's frame (forward, starboard, down).
///
/// The reference point is that of the craft's position, usually the GNSS antenna.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mounting {
    pub(crate) forward_m: f64,
    pub(crate) starboard_m: f64,
    pub(crate) down_m: f64,
    /// From the bow to the transducer's forward axis, rad, clockwise seen from above.
    pub(crate) heading_offset_rad: f64,
    /// Pitch of the transducer in the craft, rad, positive forward axis up.
    #[serde(default)]
    pub(crate) pitch_offset_rad: f64,
    /// Roll of the transducer in the craft, rad, positive starboard axis down.
    #[serde(default)]
    pub(crate) roll_offset_rad: f64,
    /// Transducer below the water's surface, m, if known: then a fix includes the AUV's depth.
    #[serde(default)]
    pub(crate) depth_m: Option<f64>,
}

impl Mounting {
    /// From the reference point to the transducer, m, in the craft's frame.
    pub(super) fn lever(&self) -> Vector3<f64> {
        Vector3::new(self.forward_m, self.starboard_m, self.down_m)
    }

    /// Roll, pitch and heading of the transducer in the craft, rad.
    pub(super) fn angles(&self) -> [f64; 3] {
        [self.roll_offset_rad, self.pitch_offset_rad, self.heading_offset_rad]
    }

    pub(super) fn craft_from_transducer(&self) -> Rotation3<f64> {
        let [roll, pitch, heading] = self.angles();
        attitude(roll, pitch, heading)
    }
}

/// Turns vectors of a body (forward, starboard, down) into the frame of its attitude, rad.
///
/// ```text
/// R = Rz(ψ) Ry(θ) Rx(φ)
/// ```
///
/// Source: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), (2.18).
pub(super) fn attitude(phi: f64, theta: f64, psi: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(phi, theta, psi)
}
