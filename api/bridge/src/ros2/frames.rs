//! ENU and FLU, the frames of ROS, into NED and FRD, those of Pilotfish, and back.
//!
//! ```text
//! map:        (x, y, z) = (east, north, up)        ↔ (north, east, down)
//! base_link:  (x, y, z) = (forward, left, up)      ↔ (forward, right, down)
//!
//! p_ned = T p_enu     v_frd = D v_flu     R_ned_frd = T R_enu_flu D     P_ned = J P_enu Jᵀ,  J = diag(T, T)
//! ```
//!
//! T and D are rotations and their own inverses. A turn about an axis changes as a vector does, so that J turns the
//! angular part of a covariance as well. Headings are rad, clockwise from north; a yaw of ROS is counter-clockwise from
//! east.
//!
//! Source: ROS REP 103 (units and axes), REP 105 (frames), `nav_msgs/Odometry`, `geometry_msgs/PoseWithCovariance`.

use nalgebra::{Matrix3, Matrix6, Quaternion, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::messages::{Covariance, Odometry, Pose, Twist};

/// Pose and motion of a body in NED and FRD.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Position (north, east, down), m from the origin of the map.
    pub position: Vector3<f64>,
    /// Turns FRD into NED.
    pub attitude: Rotation3<f64>,
    /// Covariance of (north, east, down, turns about these axes), m² and rad², if the message states it.
    pub pose_covariance: Option<Matrix6<f64>>,
    /// Velocities, if the message states them.
    pub twist: Option<BodyTwist>,
}

/// Velocities of a body in its own frame (FRD), over ground.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTwist {
    /// Velocity (surge ahead, sway to starboard, heave down), m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity (roll rate, pitch rate, yaw rate), rad/s, the last positive to starboard.
    pub rates: Vector3<f64>,
    /// Covariance of (velocity, rates), m²/s² and rad²/s², if the message states it.
    pub covariance: Option<Matrix6<f64>>,
}

/// What of an odometry message cannot be true.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.reason())]
pub enum NotMotion {
    /// A position that is no number.
    Position,
    /// A quaternion of another length than one, such as the zeros of a message that was not filled in.
    Orientation,
    /// A velocity that is no number.
    Twist,
    /// A pose's covariance that is none, or certain of the horizontal position.
    PoseCovariance,
    /// A twist's covariance that is none.
    TwistCovariance,
}

impl NotMotion {
    /// The reason, to count it by.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Self::Position => "odometry: position is not finite",
            Self::Orientation => "odometry: orientation is no unit quaternion",
            Self::Twist => "odometry: twist is not finite",
            Self::PoseCovariance => "odometry: pose covariance is not positive",
            Self::TwistCovariance => "odometry: twist covariance is not positive",
        }
    }
}

/// T: NED from ENU, and ENU from NED.
const NED_FROM_ENU: Matrix3<f64> = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);

/// D: FRD from FLU, and FLU from FRD.
const FRD_FROM_FLU: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);

/// How far the square of a quaternion's length may be from one.
///
/// Source: `QUATERNION_NORMALIZATION_TOLERANCE` of `tf2`, above which ROS itself refuses a transform.
const QUATERNION_TOLERANCE: f64 = 10e-3;

/// By how much a correlation may be off: covariances are often kept in single precision (2⁻²⁴) and turned a few times.
const CORRELATION_TOLERANCE: f64 = 1e-6;

impl Motion {
    /// The motion that `odometry` states. A covariance of zeros states nothing, nor does a twist of zeros whose covariance
    /// is zero as well: many publishers leave these members empty.
    pub fn from_odometry(odometry: &Odometry) -> Result<Self, NotMotion> {
        let Pose {
            position,
            orientation,
        } = odometry.pose.pose;
        let pose_covariance = covariance(
            &odometry.pose.covariance,
            &NED_FROM_ENU,
            NotMotion::PoseCovariance,
        )?;
        if pose_covariance.is_some_and(|p| !(p.m11 > 0.0 && p.m22 > 0.0)) {
            return Err(NotMotion::PoseCovariance);
        }
        Ok(Self {
            position: finite(position, &NED_FROM_ENU).ok_or(NotMotion::Position)?,
            attitude: attitude(orientation).ok_or(NotMotion::Orientation)?,
            pose_covariance,
            twist: BodyTwist::from_odometry(odometry)?,
        })
    }

    /// Heading, rad, in [−π, π]: where the forward axis points, seen from above.
    #[must_use]
    pub fn heading(&self) -> f64 {
        let forward = self.forward();
        forward.y.atan2(forward.x)
    }

    /// Pitch, rad, bow up positive, in [−π/2, π/2].
    #[must_use]
    pub fn pitch(&self) -> f64 {
        (-self.forward().z).clamp(-1.0, 1.0).asin()
    }

    /// Roll, rad, starboard down positive, in [−π, π].
    #[must_use]
    pub fn roll(&self) -> f64 {
        let r = self.attitude.matrix();
        r.m32.atan2(r.m33)
    }

    /// Velocity over ground (north, east), m/s, if the message states it.
    #[must_use]
    pub fn ground_velocity(&self) -> Option<Vector2<f64>> {
        let twist = self.twist.as_ref()?;
        Some((self.attitude * twist.velocity).xy())
    }

    /// Standard deviation of the horizontal position, m, in the direction in which it is largest.
    ///
    /// ```text
    /// σ² = (P_nn + P_ee)/2 + √( ((P_nn − P_ee)/2)² + P_ne² )
    /// ```
    ///
    /// The larger eigenvalue: the circle of this radius has to cover the ellipse.
    #[must_use]
    pub fn sigma(&self) -> Option<f64> {
        let p = self.pose_covariance?;
        let mean = 0.5 * (p.m11 + p.m22);
        let half_difference = 0.5 * (p.m11 - p.m22);
        Some((mean + half_difference.hypot(p.m12)).sqrt())
    }

    fn forward(&self) -> Vector3<f64> {
        self.attitude.matrix().column(0).into()
    }
}

impl BodyTwist {
    fn from_odometry(odometry: &Odometry) -> Result<Option<Self>, NotMotion> {
        let Twist { linear, angular } = odometry.twist.twist;
        let velocity = finite(linear, &FRD_FROM_FLU).ok_or(NotMotion::Twist)?;
        let rates = finite(angular, &FRD_FROM_FLU).ok_or(NotMotion::Twist)?;
        let covariance = covariance(
            &odometry.twist.covariance,
            &FRD_FROM_FLU,
            NotMotion::TwistCovariance,
        )?;
        let is_empty = covariance.is_none() && velocity == Vector3::zeros() && rates == Vector3::zeros();
        Ok((!is_empty).then_some(Self {
            velocity,
            rates,
            covariance,
        }))
    }
}

/// The pose in the map's frame (ENU) of a level body at `position` (north, east), m, and sea level, on `heading`, rad.
#[must_use]
pub fn level_pose(position: &Vector2<f64>, heading: f64) -> Pose {
    let level = Rotation3::from_axis_angle(&Vector3::z_axis(), heading);
    let enu_from_flu = NED_FROM_ENU * level.matrix() * FRD_FROM_FLU;
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(enu_from_flu));
    Pose {
        position: (NED_FROM_ENU * Vector3::new(position.x, position.y, 0.0)).into(),
        orientation: q.coords.into(),
    }
}

/// The twist in the body's frame (FLU) of `surge`, m/s ahead, and `yaw_rate`, rad/s, positive to starboard.
#[must_use]
pub fn level_twist(surge: f64, yaw_rate: f64) -> Twist {
    Twist {
        linear: (FRD_FROM_FLU * Vector3::new(surge, 0.0, 0.0)).into(),
        angular: (FRD_FROM_FLU * Vector3::new(0.0, 0.0, yaw_rate)).into(),
    }
}

fn finite(xyz: [f64; 3], turn: &Matrix3<f64>) -> Option<Vector3<f64>> {
    xyz.iter()
        .all(|value| value.is_finite())
        .then(|| turn * Vector3::from(xyz))
}

/// NED from FRD, of the quaternion that turns FLU into ENU.
fn attitude(xyzw: [f64; 4]) -> Option<Rotation3<f64>> {
    let q = Quaternion::from(xyzw);
    let error = (q.norm_squared() - 1.0).abs();
    if error.is_nan() || error > QUATERNION_TOLERANCE {
        return None;
    }
    let enu_from_flu = UnitQuaternion::from_quaternion(q).to_rotation_matrix();
    let ned_from_frd = NED_FROM_ENU * enu_from_flu.matrix() * FRD_FROM_FLU;
    Some(Rotation3::from_matrix_unchecked(ned_from_frd))
}

/// J P Jᵀ with `turn` on the diagonal of J; none if P is all zeros, `refusal` if it is no covariance.
///
/// P is one if its correlations C have a Cholesky factor. C, not P: a variance of 10⁹ for an axis that is unknown would
/// hide an error in the others.
fn covariance(
    rows: &Covariance,
    turn: &Matrix3<f64>,
    refusal: NotMotion,
) -> Result<Option<Matrix6<f64>>, NotMotion> {
    let p = Matrix6::from_fn(|i, j| rows[i][j]);
    if p == Matrix6::zeros() {
        return Ok(None);
    }
    // Of a variance below zero this is NaN.
    let deviations = p.diagonal().map(f64::sqrt);
    if !deviations.iter().all(|deviation| deviation.is_finite()) {
        return Err(refusal);
    }
    let correlations = Matrix6::from_fn(|i, j| {
        if i == j {
            1.0 + CORRELATION_TOLERANCE
        } else if p[(i, j)] == 0.0 {
            0.0
        } else {
            p[(i, j)] / (deviations[i] * deviations[j])
        }
    });
    let is_symmetric = (correlations - correlations.transpose())
        .iter()
        .all(|difference| difference.abs() <= CORRELATION_TOLERANCE);
    if !is_symmetric || correlations.cholesky().is_none() {
        return Err(refusal);
    }
    let mut j = Matrix6::zeros();
    j.fixed_view_mut::<3, 3>(0, 0).copy_from(turn);
    j.fixed_view_mut::<3, 3>(3, 3).copy_from(turn);
    Ok(Some(j * p * j.transpose()))
}

#[cfg(test)]
mod tests;
