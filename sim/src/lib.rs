//! Truth.
pub mod dive;
pub mod inner_loop;
pub mod integrate;
pub mod path;
pub mod path_following;
pub mod surface_craft;
pub mod underwater_vehicle;
