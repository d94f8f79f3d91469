//! `pilotfish simulate`, `compare`, `figures` and `bench`: whole missions on the command line.

mod bench;
mod compare;
mod declared;
mod error;
mod figures;
mod files;
mod progress;
mod simulate;
mod snapshots;

pub(crate) use bench::{Bench, bench};
pub(crate) use compare::{Compare, compare};
pub(crate) use figures::{Figures, figures};
pub(crate) use simulate::{Simulate, simulate};
