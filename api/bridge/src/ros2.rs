//! ROS 2 over DDS: odometry of the craft and its AUVs in, the reference out.
//!
//! ```text
//! nav_msgs/Odometry ─ messages ─ frames ─ conversion ─ Measurement
//! Reference, PlannedReference ─ conversion ─ frames ─ messages ─ geometry_msgs/TwistStamped, nav_msgs/Path
//! ```
//!
//! Only [`frames`] knows east-north-up and forward-left-up; everything else is in north-east-down and
//! forward-right-down. Only [`Ros2Wire`] has sockets and threads. Time is an argument throughout.
//!
//! User's page: `docs/ros2.md`.

mod arguments;
mod conversion;
mod error;
pub mod frames;
pub mod messages;
mod node;
mod parameters;
mod settings;

pub use self::{
    arguments::Arguments,
    conversion::{Conversion, HeadingLoop},
    error::Ros2Error,
    node::Ros2Wire,
    settings::{Settings, Topics},
};
