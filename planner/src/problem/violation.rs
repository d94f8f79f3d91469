//! Soft limits that a plan violates.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A soft limit that a plan violates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Violation {
    /// `forward_speed`, `turn_rate`, `acoustic_range` (minus the back-off for the vehicle's
    /// position uncertainty), `area`, `keep_out`, `surfacing_separation`, `vessel_separation` or
    /// `no_go`.
    #[schema(value_type = String)]
    pub limit: SoftLimit,
    /// Worst violator as a JSON pointer into the request: a keep-out (`/keep_outs/0`), a no-go area
    /// (`/no_go/0`), an underwater vehicle (`/auvs/1`), a vessel (`/traffic/2`) or the `/area`.
    /// Absent for limits of the craft's own motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<String>)]
    pub pointer: Option<Subject>,
    /// Time of the worst violation, s on the request's clock.
    pub t_s: f64,
    /// Amount of the worst violation, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    #[schema(value_type = String)]
    pub unit: Unit,
}

/// Subject of a limit, written as a JSON pointer into the request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Subject {
    /// A keep-out, by its index in [`keep_outs`](crate::snapshot::PlanRequest::keep_outs).
    KeepOut(usize),
    /// A no-go area, by its index in [`no_go`](crate::snapshot::PlanRequest::no_go).
    NoGo(usize),
    /// An AUV, by its index in [`auvs`](crate::snapshot::PlanRequest::auvs).
    Auv(usize),
    /// A vessel, by its index in [`traffic`](crate::snapshot::PlanRequest::traffic).
    Vessel(usize),
    /// The area to stay in.
    Area,
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::KeepOut(i) => write!(f, "/keep_outs/{i}"),
            Self::NoGo(i) => write!(f, "/no_go/{i}"),
            Self::Auv(i) => write!(f, "/auvs/{i}"),
            Self::Vessel(i) => write!(f, "/traffic/{i}"),
            Self::Area => f.write_str("/area"),
        }
    }
}

impl From<Subject> for String {
    fn from(subject: Subject) -> Self {
        subject.to_string()
    }
}

impl TryFrom<String> for Subject {
    type Error = String;

    /// Fails for pointers that no violation has.
    fn try_from(pointer: String) -> Result<Self, String> {
        let place = |list: &str| pointer.strip_prefix(list)?.parse().ok();
        let area = (pointer == "/area").then_some(Self::Area);
        let disc = || place("/keep_outs/").map(Self::KeepOut);
        let auv = || place("/auvs/").map(Self::Auv);
        let vessel = || place("/traffic/").map(Self::Vessel);
        let no_go = || place("/no_go/").map(Self::NoGo);
        area.or_else(disc).or_else(no_go).or_else(auv).or_else(vessel).ok_or(pointer)
    }
}

/// Limits that may be violated at a price.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SoftLimit {
    /// Least forward speed, m/s.
    ForwardSpeed,
    /// Turn rate, as lateral acceleration beyond speed × rate, m/s².
    TurnRate,
    /// Acoustic range, minus depth and back-off, m.
    AcousticRange,
    /// Area to stay in, m.
    Area,
    /// Disc to keep out of, m.
    KeepOut,
    /// Distance to an AUV at the surface, m, priced as a keep-out.
    SurfacingSeparation,
    /// Distance to another vessel, m, priced as a keep-out.
    VesselSeparation,
    /// No-go area, m, priced as a keep-out.
    NoGo,
}

impl SoftLimit {
    pub(crate) fn unit(self) -> Unit {
        match self {
            Self::ForwardSpeed => Unit::MetresPerSecond,
            Self::TurnRate => Unit::MetresPerSecondSquared,
            Self::AcousticRange
            | Self::Area
            | Self::KeepOut
            | Self::SurfacingSeparation
            | Self::VesselSeparation
            | Self::NoGo => Unit::Metres,
        }
    }
}

/// Unit of a violation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// m.
    #[serde(rename = "m")]
    Metres,
    /// m/s.
    #[serde(rename = "m/s")]
    MetresPerSecond,
    /// m/s².
    #[serde(rename = "m/s²")]
    MetresPerSecondSquared,
    /// m/s of forward speed and m/s² of the turn rate, which share a slack.
    #[serde(rename = "m/s or m/s²")]
    OfMotion,
}
