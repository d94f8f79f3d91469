//! Several craft that share the AUVs: who serves whom, and in what order they give way.
//!
//! ```text
//! minimise over assignments a of AUVs to craft   Σ_k C_k({i : a_i = k}),   or the largest C_k
//! ```
//! `company` and `schedules` tell the cost C_k of a set of AUVs for a craft, by the goal;
//! `assignment` searches; `slots` shares out the acoustic network; `members` is the entry point;
//! `plans` makes a snapshot for each craft, which then plans as if it were alone, among the craft
//! before it in the request as vessels whose plans it knows.

mod assignment;
mod beside;
mod company;
mod member;
mod members;
mod memory;
mod plans;
mod schedules;
mod slots;
#[cfg(test)]
mod tests;

pub use crate::facts::fleet::{Assignment, CraftAssignment, HandOver, SlotUse};
pub use crate::facts::ranges::{CRAFT_MAX, HAND_OVER};
pub use member::Member;
pub use members::Fleet;
