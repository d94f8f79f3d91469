//! Code that the Rust examples share with the tests that run them.

pub mod remote_missions;
pub mod small_world;
