//! The mounting of the transducer on the craft.

use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;

/// Place and rotation of the transducer in the craft's frame (forward, starboard, down).
///
/// The reference point is that of the craft's position, usually the GNSS antenna.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mounting {
    /// Transducer ahead of the reference point, m.
    pub(crate) forward_m: f64,
    /// Transducer to starboard of the reference point, m.
    pub(crate) starboard_m: f64,
    /// Transducer below the reference point, m.
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
        [
            self.roll_offset_rad,
            self.pitch_offset_rad,
            self.heading_offset_rad,
        ]
    }

    /// Turns vectors of the transducer's frame into the craft's.
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

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use nalgebra::Matrix3;
    use proptest::prelude::*;

    use super::*;

    /// The matrix as the book prints it, eq. (2.18).
    fn printed(phi: f64, theta: f64, psi: f64) -> Matrix3<f64> {
        let ((sf, cf), (st, ct), (sp, cp)) = (phi.sin_cos(), theta.sin_cos(), psi.sin_cos());
        Matrix3::new(
            cp * ct,
            -sp * cf + cp * st * sf,
            sp * sf + cp * cf * st,
            sp * ct,
            cp * cf + sf * st * sp,
            -cp * sf + st * sp * cf,
            -st,
            ct * sf,
            ct * cf,
        )
    }

    proptest! {
        #[test]
        fn the_rotation_equals_the_printed_matrix(phi in -PI..PI, theta in -1.5_f64..1.5, psi in -PI..PI) {
            let difference = attitude(phi, theta, psi).matrix() - printed(phi, theta, psi);
            // A product of three sines or cosines, rounded.
            prop_assert!(difference.norm() < 1e-14);
        }

        #[test]
        fn yaw_keeps_the_down_axis_and_every_rotation_keeps_lengths(
            psi in -PI..PI, phi in -PI..PI, x in -1e4..1e4, y in -1e4..1e4, z in -1e4..1e4,
        ) {
            let v = Vector3::new(x, y, z);
            prop_assert!((attitude(0.0, 0.0, psi) * v).z == z);
            prop_assert!(((attitude(phi, 0.3, psi) * v).norm() - v.norm()).abs() < 1e-9);
        }
    }

    #[test]
    fn pitch_raises_the_bow_and_roll_lowers_starboard() {
        let (bow, starboard) = (Vector3::x(), Vector3::y());
        let east = attitude(0.0, 0.0, FRAC_PI_2) * bow;
        assert!(
            (east - Vector3::y()).norm() < 1e-15,
            "a craft on heading 90° points east: {east}"
        );
        let raised = attitude(0.0, 0.1, 0.0) * bow;
        assert!(raised.z < 0.0, "a positive pitch raises the bow: {raised}");
        let lowered = attitude(0.1, 0.0, 0.0) * starboard;
        assert!(lowered.z > 0.0, "a positive roll lowers starboard: {lowered}");
    }
}
