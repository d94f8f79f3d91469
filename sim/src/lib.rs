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
//! In reading order: a [`scenario`] file says who is where, in which water, with what knowledge; [`world`] moves
//! the vehicles with [`surface_craft`], [`underwater_vehicle`], [`inner_loop`] and [`integrate`], the [`diver`]s
//! along their paths with [`path_following`] and [`dive`], in [`water`] that flows, under [`fault`]s; [`observe`]
//! is the only gate from truth to knowledge; a [`guide`] answers; [`mission`] closes the loop; [`record`] and
//! [`metrics`] are what remains; [`datum`] says where on Earth that was; [`tuning`] makes the compared law a
//! strong one, [`regret`] sets any beside the best that its [`plant`] allows, and [`mod@bench`] all beside each other;
//! [`strangers`] are missions for craft that the planner has not met. [`trial`] puts a craft through the manoeuvres that show how it
//! answers, and [`mod@identify`] learns it from the log.

pub mod bench;
pub mod datum;
pub mod dive;
pub mod diver;
pub mod fault;
mod goal;
pub mod guide;
pub mod identify;
pub mod inner_loop;
pub mod integrate;
pub mod metrics;
pub mod mission;
pub mod observe;
pub mod path_following;
pub mod plant;
pub mod record;
pub mod regret;
pub mod scenario;
pub mod strangers;
pub mod surface_craft;
pub mod trial;
pub mod tuning;
pub mod underwater_vehicle;
pub mod water;
pub mod world;
