//! Routes from the files of planning tools: bytes in, named routes out.
//!
//! ```text
//! bytes → text (ZIP, UTF-16 and byte order marks taken off) → xml (KML, GPX, RTZ) ─┐
//!                                                           → json (GeoJSON, .plan)─┼→ routes
//!                                                           → text (WPL, MOOS, CSV)─┘
//! ```
//! The format is told by the content. Points stay as in the file: on Earth in degrees (WGS 84), or
//! north and east of a datum in metres. Lines of several parts are one route, in order. Time and
//! memory grow no faster than the file's bytes, even if it is damaged on purpose.

mod areas;
mod file;
mod json;
mod lawnmower;
mod mission;
mod progress;
mod route;
#[cfg(test)]
mod tests;
mod text;
#[cfg(feature = "xml")]
mod xml;

pub use areas::{Area, areas};
pub use file::{read, read_until};
pub use lawnmower::{LawnMower, NoLanes, lanes_over};
pub use progress::BYTES_MAX;
pub use route::{POINTS_MAX, Place, Route, RoutePoint, Unread, select};
