//! The messages of ROS 2 that the adapter reads and writes, member for member as they are on the wire (CDR).
//!
//! Vectors and points are (x, y, z), quaternions (x, y, z, w): CDR writes an array of doubles as it writes a structure
//! of doubles. Frames are those of ROS: see [`frames`](super::frames).
//!
//! Source: `builtin_interfaces` 2.3, `std_msgs`, `geometry_msgs` and `nav_msgs` 5.5 (ROS 2 Kilted).

use serde::{Deserialize, Serialize};

/// Rows of a covariance: three linear axes, then three angular ones.
pub type Covariance = [[f64; 6]; 6];

/// `builtin_interfaces/Time`, Unix time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// Whole seconds, rounded down.
    pub sec: i32,
    /// Nanoseconds since then, below 10⁹.
    pub nanosec: u32,
}

/// `std_msgs/Header`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// When what follows was so.
    pub stamp: Stamp,
    /// Name of the frame of what follows.
    pub frame_id: String,
}

/// `geometry_msgs/Pose`
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position, m.
    pub position: [f64; 3],
    /// Rotation from the body's frame to the frame of the header.
    pub orientation: [f64; 4],
}

/// `geometry_msgs/PoseWithCovariance`
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The mean.
    pub pose: Pose,
    /// Covariance, m² and rad², of position and of turns about the fixed axes of the header's frame.
    pub covariance: Covariance,
}

/// `geometry_msgs/Twist`
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Velocity, m/s.
    pub linear: [f64; 3],
    /// Angular velocity, rad/s.
    pub angular: [f64; 3],
}

/// `geometry_msgs/TwistWithCovariance`
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The mean.
    pub twist: Twist,
    /// Covariance, m²/s² and rad²/s².
    pub covariance: Covariance,
}

/// `nav_msgs/Odometry`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// When, and the frame of the pose.
    pub header: Header,
    /// The body's frame, which is that of the twist.
    pub child_frame_id: String,
    /// Where the body is.
    pub pose: PoseWithCovariance,
    /// How it moves over ground.
    pub twist: TwistWithCovariance,
}

/// `geometry_msgs/TwistStamped`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistStamped {
    /// When it was sent, and the frame of the twist.
    pub header: Header,
    /// The velocity that is asked for.
    pub twist: Twist,
}

/// `geometry_msgs/PoseStamped`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// When the body is to be there, and the frame of the pose.
    pub header: Header,
    /// Where it is to be.
    pub pose: Pose,
}

/// `nav_msgs/Path`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// When it was planned, and the frame of its poses.
    pub header: Header,
    /// The poses, in the order of their times.
    pub poses: Vec<PoseStamped>,
}

impl Stamp {
    const NANOSECONDS: f64 = 1e9;

    /// Seconds of Unix time. Doubles near today's time are 0.24 µs apart.
    #[must_use]
    pub fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) / Self::NANOSECONDS
    }

    /// The stamp at `t_s` of Unix time; none outside the range of 32-bit seconds (1901 to 2038).
    #[must_use]
    pub fn at(t_s: f64) -> Option<Self> {
        let whole = t_s.floor();
        if !(f64::from(i32::MIN) <= whole && whole <= f64::from(i32::MAX)) {
            return None;
        }
        let nanoseconds = ((t_s - whole) * Self::NANOSECONDS).floor();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the bounds checked above, and in [0, 10^9)"
        )]
        let (sec, nanosec) = (whole as i32, nanoseconds as u32);
        Some(Self { sec, nanosec })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_comes_back_to_a_microsecond() {
        // Spacing of doubles near 2·10⁹.
        const TOLERANCE_S: f64 = 5e-7;
        for t_s in [-1.5, 0.0, 0.25, 1_700_000_000.123_456, 2_147_483_647.75] {
            let stamp = Stamp::at(t_s).expect("can be told");
            assert!((stamp.seconds() - t_s).abs() < TOLERANCE_S, "{t_s}");
            assert!(stamp.nanosec < 1_000_000_000);
        }
    }

    #[test]
    fn a_time_beyond_32_bits_has_no_stamp() {
        for t_s in [f64::NAN, f64::INFINITY, -3e9, 3e9] {
            assert_eq!(Stamp::at(t_s), None);
        }
    }
}
