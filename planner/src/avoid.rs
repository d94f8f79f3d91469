//! Keeping clear of other vessels, as rules 8 and 13 to 17 of the COLREGs ask a craft under power.
//!
//! ```text
//! minimise  depth + side + change + mean distance from the goal
//! ```
//! over courses and speeds that are held for some time before the craft goes on to its goal, each
//! sailed by a rolled-out craft among the forecast vessels. Minutes ahead of an encounter the
//! chosen way replaces the goal; the program follows it, and keeps the distances in its horizon.
//! Source of the idea: T. A. Johansen, T. Perez, A. Cristofaro, *Ship collision avoidance and
//! COLREGS compliance using simulation-based control behavior selection*, IEEE T-ITS 17 (12), 2016.
//! Here a course ends before the look-ahead does, so that the way back counts.
//!
//! `scene` samples the situation, `trial` sails a manoeuvre, `encounter` tells encounters apart,
//! `search` tries manoeuvres, `choose` selects, and `sentence` describes.

pub(crate) mod choose;
pub(crate) mod encounter;
pub(crate) mod scene;
pub(crate) mod search;
pub(crate) mod sentence;
#[cfg(test)]
mod tests;
pub(crate) mod trial;
