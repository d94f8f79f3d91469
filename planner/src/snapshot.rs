//! The facts of one moment, checked once: users of [`Snapshot`] rely on it.

pub(crate) mod build;
pub(crate) mod check;
pub(crate) mod request;

pub use build::Snapshot;
pub use check::InvalidRequest;
pub use request::{Acoustics, PlanRequest, SCHEMA_VERSION};

pub use crate::facts::{
    asc::{Asc, DeclaredLimits, Limits},
    auv::{Auv, Dive, VehicleId},
    bounds::{KeepOut, bounds_faults, clockwise},
    evidence::{AuvState, GroundTrack, Report},
    field_error::{FieldError, pointer_token, shortened},
    goal::{Goal, Offset, Task},
    known_path::{DeclaredPath, KnownPath},
    localise::{Figure, FigureKind, Localise, LocalisedVehicle},
    options::{Fallback, Forecast, ForecastModel, Hold},
    origin::Origin,
    previous_plan::{
        PreviousCraft, PreviousEstimate, PreviousPlan, PreviousReference, PreviousTarget, Ranging,
    },
    ranges::{
        ACOUSTIC_RANGE, ANGLE, AREA_CORNERS, AUVS_MAX, COORDINATE_MAX, COVARIANCE, CURRENT_MAX, DIRECTIONS,
        ID_LENGTH_MAX, INTEGRAL_TIME, KEEP_OUT_RADIUS, KEEP_OUTS_MAX, LEG_HEIGHT_MIN, LIMITS_ALONE,
        MapNumber, OFFSET_MAX, RANGE_FROM_WITHIN, REPORT_AGE_MAX, REPORT_AHEAD_MAX, REPORT_SIGMA_MAX,
        REPORT_SIGMA_MIN, REPORTS_MAX, Range, SPEED_MAX_MOST, STEP, STEPS_COUNT, SURFACING_SEPARATION, TIME,
        TIME_CONSTANT, TIME_MAX, TRAJECTORY_POINTS_MAX, VISIT_COST, VISITS_MAX, WEIGHT, ranges_by_shape,
    },
    reference::TrajectoryPoint,
    schedule::{Alternative, CostUnit, LeftOut, Schedule, ServedVehicle, Visit},
    tagged::TAGGED,
    tuning::Tuning,
    visit::{Fixes, Reduce, VisitCost, Visits},
    water::{Current, Drift},
};
