//! What is known now, checked once: everything behind [`Snapshot`] may rely on it.

pub(crate) mod build;
pub(crate) mod check;
pub(crate) mod observation;

pub use build::Snapshot;
pub use check::InvalidObservation;
pub use observation::{Observation, PreviousPlan};

pub use crate::facts::{
    asc::{AscState, Limits},
    auv::{Auv, Dive, VehicleId},
    bounds::{
        ACOUSTIC_RANGE, AREA_CORNERS, KEEP_OUT_RADIUS, KEEP_OUTS_MAX, KeepOut, SURFACING_SEPARATION,
        bounds_faults,
    },
    evidence::{AuvState, Evidence, GroundTrack, Report},
    goal::{Goal, Offset},
    invalid_field::{InvalidField, InvalidReason},
    known_path::KnownPath,
    options::{Fallback, ForecastChoice, ForecastModel, HoldStyle},
    ranges::{
        AUVS_MAX, COORDINATE_MAX, CURRENT_MAX, ID_LENGTH_MAX, LEG_HEIGHT_MIN, OFFSET_MAX, REPORT_AGE_MAX,
        REPORT_AHEAD_MAX, REPORT_SIGMA_MIN, REPORTS_MAX, TIME_MAX, TRAJECTORY_POINTS_MAX,
    },
    reference::{PreviousTarget, TrajectoryPoint},
};
