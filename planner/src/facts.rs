//! Facts: measurements, declarations and requests, each with its accepted range.

pub mod angle;
pub(crate) mod asc;
pub(crate) mod auv;
pub(crate) mod bisection;
pub(crate) mod bounds;
pub(crate) mod evidence;
pub(crate) mod field_error;
pub(crate) mod fleet;
pub(crate) mod goal;
pub(crate) mod known_path;
pub(crate) mod localise;
pub(crate) mod no_go;
pub(crate) mod options;
pub(crate) mod origin;
pub mod path;
pub(crate) mod previous_plan;
pub(crate) mod ranges;
pub(crate) mod reference;
pub(crate) mod schedule;
pub(crate) mod tagged;
pub(crate) mod traffic;
pub(crate) mod tuning;
pub(crate) mod visit;
pub(crate) mod water;
