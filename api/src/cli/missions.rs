//! `pilotfish simulate` and `compare`: whole missions on the command line.

mod arguments;
mod compare;
mod error;
mod files;
mod simulate;
mod snapshots;

pub(crate) use compare::{Compare, compare};
pub(crate) use simulate::{Simulate, simulate};
