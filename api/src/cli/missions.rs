//! `pilotfish simulate` and `compare`: whole missions on the command line.

mod compare;
mod rehearse;
mod run;
mod simulate;
mod snapshots;

pub(crate) use compare::{Compare, compare};
pub(crate) use simulate::{Simulate, simulate};
