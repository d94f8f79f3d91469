//! The facts of one moment, checked once: users of [`Snapshot`] rely on it.

pub(crate) mod build;
pub(crate) mod check;
pub(crate) mod request;

pub use crate::coast::land::no_go_depths;
pub use build::Snapshot;
pub use check::{InvalidRequest, no_go_faults};
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
    no_go::NoGo,
    options::{Fallback, Forecast, ForecastModel, Hold},
    origin::Origin,
    previous_plan::{
        PreviousCraft, PreviousEstimate, PreviousPlan, PreviousReference, PreviousTarget, Ranging,
    },
    ranges::{
        ACOUSTIC_RANGE, ANGLE, AREA_CORNERS, AUVS_MAX, COORDINATE_MAX, COVARIANCE, CURRENT_MAX, DIRECTIONS,
        FIGURE_ROWS_MAX, ID_LENGTH_MAX, INTEGRAL_TIME, KEEP_OUT_RADIUS, KEEP_OUTS_MAX, LEG_HEIGHT_MIN,
        LIMITS_ALONE, MapNumber, NO_GO_CORNERS_MAX, NO_GO_MAX, OFFSET_MAX, RANGE_FROM_WITHIN, REPORT_AGE_MAX,
        REPORT_AHEAD_MAX, REPORT_SIGMA_MAX, REPORT_SIGMA_MIN, REPORTS_MAX, Range, SPEED_MAX_MOST, STEP,
        STEPS_COUNT, SURFACING_SEPARATION, TIME, TIME_CONSTANT, TIME_MAX, TRAJECTORY_POINTS_MAX,
        VESSEL_PLAN_LENGTH, VESSEL_SEPARATION, VESSELS_MAX, VISIT_COST, VISITS_MAX, WEIGHT, ranges_by_shape,
    },
    reference::TrajectoryPoint,
    schedule::{Alternative, CostUnit, LeftOut, Schedule, ServedVehicle, Visit},
    tagged::TAGGED,
    traffic::{
        Avoidance, Encounter, EncounterKind, Manoeuvre, PastVessel, VESSEL_SEPARATION_DEFAULT, Vessel,
        VesselStatus,
    },
    tuning::Tuning,
    visit::{Fixes, Reduce, VisitCost, Visits},
    water::{Current, Drift},
};
