//! Other vessels, and what the craft does about them.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::angle::direction;
use crate::facts::auv::VehicleId;

/// Length of a vessel that says none, m: a fishing vessel's.
const LENGTH: f64 = 20.0;

/// Standard deviation of a position that says none, m: AIS with an accurate receiver.
const SIGMA: f64 = 10.0;

/// Distance to keep from other vessels without a setting, m.
pub const VESSEL_SEPARATION_DEFAULT: f64 = 30.0;

/// Another vessel. Members that are left out are not known.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Vessel {
    /// Its identity, such as an MMSI, unique in the request, 1 to 64 bytes.
    #[schema(value_type = String, example = "244123456")]
    pub id: VehicleId,
    /// Its name for people, at most 64 bytes.
    #[schema(example = "MV Example")]
    pub name: Option<String>,
    /// Time of its position, s on the request's clock. Default: now.
    pub t_s: Option<f64>,
    /// Position of its receiver north of the datum, m.
    pub north_m: f64,
    /// Position of its receiver east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north. Needs `origin`, as in other positions.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    pub lon_deg: Option<f64>,
    /// Course over ground, rad, within ±2π.
    pub course_rad: Option<f64>,
    /// Speed over ground, m/s, from 0 to 60.
    pub speed_mps: Option<f64>,
    /// Direction of its bow, rad, within ±2π.
    pub heading_rad: Option<f64>,
    /// Length over all, m, from 1 to 500. Default: 20.
    pub length_m: Option<f64>,
    /// Standard deviation of its position along either axis, m, from 0 to 10 000. Default: 10.
    pub sigma_m: Option<f64>,
    /// Where it will be, if that is known: time, s, position north and east of the datum, m, in
    /// order of time, at most 32. It keeps to this and gives no way; its course and speed are those
    /// of now.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plan: Vec<[f64; 3]>,
    /// What it does. One that is made fast stays where it is, however old its position. Default:
    /// `under_way`.
    #[serde(default)]
    pub status: VesselStatus,
}

/// What a vessel does, as AIS tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum VesselStatus {
    /// Under way, by engine or sail.
    #[default]
    UnderWay,
    /// At anchor.
    AtAnchor,
    /// Moored, or made fast to the shore.
    Moored,
    /// Aground.
    Aground,
    /// Fishing.
    Fishing,
    /// Not under command, or restricted in its ability to manoeuvre: it does not give way.
    Restricted,
}

/// Length of a surface craft of one's own over all, m, and standard deviation of its position, m.
pub(crate) const CRAFT_LENGTH: f64 = 5.0;
pub(crate) const CRAFT_SIGMA: f64 = 3.0;

impl Vessel {
    /// A surface craft that keeps to its `plan`, from its position (north, east), m, and velocity
    /// over ground, m/s, at time `t_s`.
    pub fn of_craft(
        id: VehicleId,
        t_s: f64,
        position: Vector2<f64>,
        velocity: Vector2<f64>,
        plan: Vec<[f64; 3]>,
    ) -> Self {
        Self {
            id,
            name: None,
            t_s: Some(t_s),
            north_m: position.x,
            east_m: position.y,
            lat_deg: None,
            lon_deg: None,
            course_rad: Some(velocity.y.atan2(velocity.x)),
            speed_mps: Some(velocity.norm()),
            heading_rad: None,
            length_m: Some(CRAFT_LENGTH),
            sigma_m: Some(CRAFT_SIGMA),
            plan,
            status: VesselStatus::UnderWay,
        }
    }

    /// Position (north, east), m.
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }

    /// Velocity over ground (north, east), m/s: zero if it is made fast, none if not known.
    pub fn velocity(&self) -> Option<Vector2<f64>> {
        if self.is_made_fast() {
            return Some(Vector2::zeros());
        }
        match (self.speed_mps?, self.course_rad.or(self.heading_rad)) {
            (0.0, None) => Some(Vector2::zeros()),
            (speed, course) => Some(direction(course?) * speed),
        }
    }

    /// `true` if it is made fast.
    pub fn is_made_fast(&self) -> bool {
        matches!(self.status, VesselStatus::AtAnchor | VesselStatus::Moored | VesselStatus::Aground)
    }

    /// Its positions (north, east), that of now and those of its plan, m.
    pub fn positions_mut(&mut self) -> impl Iterator<Item = (&mut f64, &mut f64)> {
        let planned = self.plan.iter_mut().map(|[_, north, east]| (north, east));
        [(&mut self.north_m, &mut self.east_m)].into_iter().chain(planned)
    }

    /// Half of its length over all, m.
    pub fn half_length(&self) -> f64 {
        0.5 * self.length_m.unwrap_or(LENGTH)
    }

    pub(crate) fn sigma(&self) -> f64 {
        self.sigma_m.unwrap_or(SIGMA)
    }

    /// Its name, or else its identity.
    pub fn called(&self) -> &str {
        self.name.as_deref().filter(|name| !name.is_empty()).unwrap_or(&self.id.0)
    }
}

/// How the craft meets a vessel, as rules 13 to 15 of the COLREGs tell encounters apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EncounterKind {
    /// On nearly opposite courses: both turn to starboard.
    HeadOn,
    /// It crosses from starboard: the craft gives way, and does not pass ahead.
    CrossingGiveWay,
    /// It crosses from port: the craft stands on until the other's inaction makes it act.
    CrossingStandOn,
    /// The craft comes up from abaft its beam, and keeps clear.
    Overtaking,
    /// It comes up from abaft the craft's beam: the craft stands on in the same way.
    Overtaken,
    /// It does not move, or how it moves is not known: the craft keeps clear.
    KeepClear,
}

impl EncounterKind {
    /// `true` if the other one is to keep clear.
    pub(crate) fn stands_on(self) -> bool {
        matches!(self, Self::CrossingStandOn | Self::Overtaken)
    }
}

/// A vessel that would come too near if the craft went straight for its goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Encounter {
    /// The vessel.
    #[schema(value_type = String)]
    pub vessel: VehicleId,
    /// How the craft meets it; unchanged until it is past and clear.
    pub kind: EncounterKind,
    /// `true` if the craft acts: always where it gives way, late where it stands on.
    pub acts: bool,
    /// Least distance from the vessel if both kept their present velocities, m.
    pub cpa_m: f64,
    /// Time until then, s; 0 if it was the nearest already.
    pub tcpa_s: f64,
    /// Least distance from the vessel on the foreseen way, m.
    pub passes_m: f64,
    /// How far to starboard of the vessel's course the craft is when it passes it, m.
    pub starboard_m: f64,
    /// Distance that is kept from its position now, m.
    pub separation_m: f64,
}

/// A course and speed that the craft takes to keep clear, before it goes on to its goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Manoeuvre {
    /// Heading, rad.
    pub heading_rad: f64,
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Its end, s on the request's clock.
    pub until_s: f64,
}

/// The velocity of a vessel, averaged over its last positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PastVessel {
    /// The vessel.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// Time of its last position, s on the request's clock.
    pub t_s: f64,
    /// Northward velocity over ground, m/s.
    pub north_mps: f64,
    /// Eastward velocity over ground, m/s.
    pub east_mps: f64,
    /// Number of positions that count, at least 1.
    pub count: f64,
}

/// What the craft does about other vessels.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Avoidance {
    /// The vessels that would come too near, from the earliest.
    pub encounters: Vec<Encounter>,
    /// What the craft does; absent while it can go straight for its goal.
    pub manoeuvre: Option<Manoeuvre>,
    /// Velocities of the vessels that may come near; the next request needs them in
    /// `previous_plan`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vessels: Vec<PastVessel>,
    /// The encounters and the manoeuvre in one sentence; empty for a craft that holds.
    pub sentence: String,
}

impl Avoidance {
    /// It for a craft that holds: it makes no manoeuvre, and passes nobody as was foreseen.
    pub(crate) fn held(&self) -> Self {
        Self { encounters: vec![], manoeuvre: None, sentence: String::new(), ..self.clone() }
    }
}
