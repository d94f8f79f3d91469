//! `pilotfish simulate`, `compare` and `figures`: whole missions on the command line.

mod arguments;
mod compare;
mod error;
mod figures;
mod files;
mod simulate;
mod snapshots;

pub(crate) use compare::{Compare, compare};
pub(crate) use figures::{Figures, figures};
pub(crate) use simulate::{Simulate, simulate};
