//! Members of an earlier answer that the next request returns; the planner has no memory.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::angle::{Course, Heading};
use crate::facts::auv::VehicleId;
use crate::facts::localise::Figure;
use crate::facts::options::{Forecast, ForecastModel};
use crate::facts::origin::Origin;
use crate::facts::reference::{Reference, TrajectoryPoint};
use crate::facts::schedule::Schedule;
use crate::facts::traffic::Avoidance;
use crate::facts::water::{Current, Drift};

/// The last answer. The whole answer is accepted; only these members are read.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousPlan {
    /// Position of its datum on Earth; equal to the request's `origin` if both are given.
    pub origin: Option<Origin>,
    /// Its trajectory, in order of time, at most 256 points.
    pub trajectory: Vec<TrajectoryPoint>,
    /// Course of the followed point when it last moved, rad, within ±2π.
    pub goal_course_rad: Option<f64>,
    /// Its estimate of the craft. Without it, learning restarts.
    pub craft_estimate: Option<PreviousCraft>,
    /// Its current. If the request has a ground velocity and no current, the estimate of the
    /// current, averaged over half a minute, starts from this one.
    pub current: Option<Current>,
    /// Its reference.
    pub reference: Option<PreviousReference>,
    /// Its underwater vehicles, at most 16.
    pub targets: Option<Vec<PreviousTarget>>,
    /// Its schedule, for a goal of the kind `visit`. Without it, costs restart.
    pub schedule: Option<Schedule>,
    /// Its figure, for a goal of the kind `localise`. Without it, nothing stabilises the figure.
    pub figure: Option<Figure>,
    /// What it did about other vessels. Without it, encounters begin anew.
    pub avoidance: Option<Avoidance>,
}

impl PreviousPlan {
    /// Time at which it was made, s on the request's clock.
    pub fn made_at(&self) -> Option<f64> {
        Some(self.trajectory.first()?.t_s)
    }

    /// Course of the followed point, without the offset, when it last moved.
    pub fn goal_course(&self) -> Option<Course> {
        self.goal_course_rad.map(Course::new)
    }

    /// The command to the craft, in the kinds of references that its loops hold.
    pub fn command(&self) -> Option<Reference> {
        let given = self.reference?;
        Some(Reference { speed: given.speed_mps, heading: Heading::new(given.heading_rad?) })
    }

    /// Reference as speed through the water and heading; the command, without a craft's estimate.
    pub fn asked(&self) -> Option<Reference> {
        let asked = self.craft_estimate.as_ref().map(|craft| Reference {
            speed: craft.asked_speed_mps,
            heading: Heading::new(craft.asked_heading_rad),
        });
        asked.or_else(|| self.command())
    }
}

/// The craft in the last answer; with the motion since, it shows the response to references.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousCraft {
    /// Requested speed through the water, m/s.
    pub asked_speed_mps: f64,
    /// Requested heading, rad.
    pub asked_heading_rad: f64,
    /// Memory of the filters, unchanged; else it is discarded with the warning `memory_not_used`.
    pub memory: Vec<f64>,
}

/// An underwater vehicle in the last answer. With its present position, these members show its
/// drift; if one is missing, the drift starts at zero.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousTarget {
    /// The vehicle.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// Estimate from which it was forecast.
    pub estimate: Option<PreviousEstimate>,
    /// The forecast model used, never `auto`.
    pub forecast: Option<Forecast>,
    /// Its drift, limited to ±0.5 m/s along each axis.
    pub drift: Option<Drift>,
    /// Corners of its track, in order: time, s, position north and east of the datum, m. The newest
    /// 96 count. Without it, repeats are searched in the reports alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub track: Vec<[f64; 3]>,
    /// Its past states, if it is given as `state`, in order of time: time, s, position north and
    /// east of the datum, m, its standard deviation along either axis, m, and velocity over ground
    /// north and east, m/s. The newest 48 count. Without it, a state is all that is known of the
    /// vehicle.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<[f64; 6]>,
    /// What its reports leave possible, if some are ranges. Without it, all are filtered anew.
    pub ranging: Option<Ranging>,
}

/// A row of [`Ranging::gaussians`].
pub(crate) type GaussianRow = [f64; 23];

/// What reports of which some are ranges leave possible. If it does not fit the reports, or its
/// numbers are none of such an estimate, all reports are filtered anew.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Ranging {
    /// Time of the newest report in it, s.
    pub t_s: f64,
    /// Number made of the newest reports in it, by which the next plan knows them.
    pub fingerprint: f64,
    /// Number of reports in it that were not filtered together with all others.
    pub added: f64,
    /// Standard deviation added to the measurements, m.
    pub inflation_m: f64,
    /// Times of the refused reports, s, at most 64.
    pub refused: Vec<f64>,
    /// Gaussians, at most 4: weight; 1 at the second of two places; 1 in a turn; mean of position
    /// north and east of the datum, m, depth, m, and velocity north and east, m/s; the lower
    /// triangle of a factor L of their covariance L Lᵀ, row by row.
    #[schema(value_type = Vec<Vec<f64>>)]
    pub gaussians: Vec<GaussianRow>,
}

impl PreviousTarget {
    /// Its members, if all are given.
    pub(crate) fn whole(&self) -> Option<RememberedTarget> {
        Some(RememberedTarget {
            model: self.forecast?.model()?,
            estimate: self.estimate?,
            drift: self.drift?.into(),
        })
    }
}

/// The estimate from which the last answer forecast an underwater vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousEstimate {
    /// Age at the time of the answer, s.
    pub age_s: f64,
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Reported northward velocity over ground, m/s.
    pub north_mps: f64,
    /// Reported eastward velocity over ground, m/s.
    pub east_mps: f64,
    /// Rate of turn of the course, rad/s, positive clockwise.
    pub turn_rate_radps: f64,
}

#[cfg(test)]
impl From<&crate::facts::evidence::AuvState> for PreviousEstimate {
    fn from(state: &crate::facts::evidence::AuvState) -> Self {
        let velocity = state.velocity();
        Self {
            age_s: state.age_s,
            north_m: state.north_m,
            east_m: state.east_m,
            depth_m: state.depth_m,
            north_mps: velocity.x,
            east_mps: velocity.y,
            turn_rate_radps: state.turn_rate_radps,
        }
    }
}

impl PreviousEstimate {
    pub(crate) fn position(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }

    pub(crate) fn velocity(&self) -> Vector2<f64> {
        Vector2::new(self.north_mps, self.east_mps)
    }
}

/// A complete [`PreviousTarget`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct RememberedTarget {
    pub(crate) model: ForecastModel,
    pub(crate) estimate: PreviousEstimate,
    /// Velocity over ground (north, east) that model and report do not explain, m/s.
    pub(crate) drift: Vector2<f64>,
}

/// The reference of the last answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousReference {
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Heading, rad, within ±2π. In a second the next one of `mpc` or `previous_plan` differs by at
    /// most 9.7°, or half of the craft's largest turn if that is more, unless a keep-out is ahead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_rad: Option<f64>,
}

impl From<Reference> for PreviousReference {
    fn from(reference: Reference) -> Self {
        Self { speed_mps: reference.speed, heading_rad: Some(reference.heading.radians()) }
    }
}
