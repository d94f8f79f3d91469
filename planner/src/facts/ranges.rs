//! Ranges of the facts that are accepted.

/// Most AUVs in one snapshot.
pub const AUVS_MAX: usize = 16;

/// Most points in a previous plan's trajectory.
pub const TRAJECTORY_POINTS_MAX: usize = 256;

/// Largest coordinate, m: one local datum cannot serve a larger area as a plane.
pub const COORDINATE_MAX: f64 = 1.0e6;

/// Largest time, s: past the year 5000 on a Unix clock, and far from losing milliseconds.
pub const TIME_MAX: f64 = 1.0e11;

/// Least height of a leg of a sawtooth, m. Assumption: below it, a depth gauge and a pitch loop make none.
pub const LEG_HEIGHT_MIN: f64 = 0.5;

/// Largest component of an offset, m: from farther away, a craft accompanies no vehicle.
pub const OFFSET_MAX: f64 = 1.0e3;

/// Fastest current along an axis, m/s. Assumption: beyond it are a few tidal races, and no formation of AUVs.
pub const CURRENT_MAX: f64 = 3.0;

/// Longest name of a vehicle, bytes.
pub const ID_LENGTH_MAX: usize = 64;

/// Most reports of one AUV: at one every ten seconds, ten minutes and more.
pub const REPORTS_MAX: usize = 64;

/// Oldest report, s: any that a clock can show. What is too old for the goal or for a forecast is no error.
pub const REPORT_AGE_MAX: f64 = 2.0 * TIME_MAX;

/// Farthest that a report may be from the future, s: what clocks that are set once a mission differ by. It counts
/// as from now.
pub const REPORT_AHEAD_MAX: f64 = 1.0;

/// Smallest standard deviation of a reported position, m: better than anything that measures under water, and far
/// from what would make an estimate's arithmetic stiff.
pub const REPORT_SIGMA_MIN: f64 = 0.01;
