//! `pilotfish simulate`, `compare` and `figures`: whole missions on the command line.

mod compare;
mod declared;
mod error;
mod figures;
mod files;
mod progress;
mod simulate;
mod snapshots;

pub(crate) use compare::{Compare, compare};
pub(crate) use figures::{Figures, figures};
pub(crate) use simulate::{Simulate, simulate};
