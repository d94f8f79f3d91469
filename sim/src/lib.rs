//! The truth that guidance laws are tried on: vehicles, water, and missions from start to end.
//!
//! One frame throughout: local north-east-down, depth positive down; heading 0 at north, positive
//! clockwise; SI and radians. Time is a count of steps, randomness a seed: the same scenario, guide and
//! seed give the same record, to the byte.
//!
//! ```text
//! scenario → world → observe → guide → reference → inner loops → hulls → world → … → record → metrics
//! ```
//!
//! In reading order: [`scenario`] says who is where; [`world`] moves them with [`surface_craft`],
//! [`underwater_vehicle`], [`inner_loop`], [`integrate`], and along [`planner::path`]s with [`path_following`] and
//! [`dive`]; [`water`] is what flows and waves around them; [`observe`] is the only gate from truth to
//! knowledge; a [`guide`] answers; [`mission`] closes the loop; [`record`] and [`metrics`] are what remains,
//! and [`datum`] says where on Earth; [`tuning`] makes the compared law a strong one.

pub mod datum;
pub mod dive;
pub mod guide;
pub mod inner_loop;
pub mod integrate;
pub mod metrics;
pub mod mission;
pub mod observe;
pub mod path_following;
pub mod record;
pub mod scenario;
pub mod surface_craft;
pub mod tuning;
pub mod underwater_vehicle;
pub mod water;
pub mod world;
