//! Goals of the surface craft, and its offset from the point that it follows.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    angle::direction,
    auv::VehicleId,
    members::{members, needed},
    visit::{Reduce, VisitCost, Visits},
};

/// The goal of the surface craft.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Goal {
    /// Stay above one AUV.
    Track {
        /// The AUV to follow.
        auv: VehicleId,
    },
    /// Follow each AUV in turn for a dwell time: the k-th from `epoch_s + k·dwell_s`, half-open.
    Intermittent {
        /// The AUVs to follow, in order.
        auvs: Vec<VehicleId>,
        /// Time spent with each, s.
        dwell_s: f64,
        /// Start of the first dwell at the first AUV, s on the snapshot's clock.
        epoch_s: f64,
    },
    /// Stay above the mean of several AUVs.
    Midpoint {
        /// The AUVs in the mean.
        auvs: Vec<VehicleId>,
    },
    /// Stay above the weighted mean of several AUVs.
    Weighted {
        /// The AUVs in the mean with their relative weights; 0 excludes an AUV.
        weights: BTreeMap<VehicleId, f64>,
    },
    /// Stay within a slant range of all AUVs, where the largest range is least.
    Range {
        /// The AUVs to stay near.
        auvs: Vec<VehicleId>,
        /// The slant range to stay within, m.
        range_m: f64,
    },
    /// Serve several AUVs one after the other, in the order and at the times of least cost.
    Visit(Visits),
}

impl Goal {
    /// The AUVs that the goal names, in its order.
    pub fn named(&self) -> impl Iterator<Item = &VehicleId> {
        let (listed, weighted) = match self {
            Self::Track { auv } => (std::slice::from_ref(auv), None),
            Self::Intermittent { auvs, .. } | Self::Midpoint { auvs } | Self::Range { auvs, .. } => {
                (auvs.as_slice(), None)
            }
            Self::Weighted { weights } => ([].as_slice(), Some(weights)),
            Self::Visit(visits) => (visits.auvs.as_slice(), None),
        };
        listed.iter().chain(weighted.into_iter().flat_map(BTreeMap::keys))
    }

    /// The AUVs that the goal depends on, in its order, without those of weight 0.
    pub fn vehicles(&self) -> impl Iterator<Item = &VehicleId> {
        self.named().filter(|id| match self {
            Self::Weighted { weights } => 0.0 < weights[*id],
            Self::Visit(visits) => 0.0 < visits.weight(id),
            Self::Track { .. } | Self::Intermittent { .. } | Self::Midpoint { .. } | Self::Range { .. } => {
                true
            }
        })
    }
}

/// Desired position of the surface craft relative to the followed point: one AUV, the mean of
/// several, or the point of least largest range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "frame", rename_all = "snake_case")]
pub enum Offset {
    /// In fixed directions.
    Ned {
        /// Distance north, m.
        north_m: f64,
        /// Distance east, m.
        east_m: f64,
    },
    /// Along the course over ground of the followed point; at rest, its last course.
    Target {
        /// Distance ahead, m.
        ahead_m: f64,
        /// Distance to starboard, m.
        starboard_m: f64,
    },
    /// Along the path tangent at the followed AUV.
    Path {
        /// Distance ahead, m.
        ahead_m: f64,
        /// Distance to starboard, m.
        starboard_m: f64,
    },
    /// In a fixed direction.
    Polar {
        /// Distance, m.
        range_m: f64,
        /// Bearing, rad, clockwise from north.
        bearing_rad: f64,
    },
}

impl Offset {
    /// An offset in fixed directions, (north, east), m.
    #[must_use]
    pub fn ned(by: Vector2<f64>) -> Self {
        Self::Ned {
            north_m: by.x,
            east_m: by.y,
        }
    }

    /// An offset along the course of the followed point, (ahead, starboard), m.
    #[must_use]
    pub fn target(by: Vector2<f64>) -> Self {
        Self::Target {
            ahead_m: by.x,
            starboard_m: by.y,
        }
    }

    /// An offset along the path of the followed AUV, (ahead, starboard), m.
    #[must_use]
    pub fn path(by: Vector2<f64>) -> Self {
        Self::Path {
            ahead_m: by.x,
            starboard_m: by.y,
        }
    }

    /// The offset in the axes of its frame, m: (north, east), or (ahead, starboard).
    #[must_use]
    pub fn vector(&self) -> Vector2<f64> {
        match *self {
            Self::Ned { north_m, east_m } => Vector2::new(north_m, east_m),
            Self::Target { ahead_m, starboard_m } | Self::Path { ahead_m, starboard_m } => {
                Vector2::new(ahead_m, starboard_m)
            }
            Self::Polar { range_m, bearing_rad } => direction(bearing_rad) * range_m,
        }
    }
}

/// A goal with its offset, one object in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Task {
    /// The goal.
    #[serde(flatten)]
    pub goal: Goal,
    /// Offset from the followed point; without it the craft stays right above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<Offset>,
}

impl From<Goal> for Task {
    fn from(goal: Goal) -> Self {
        let offset = None;
        Self { goal, offset }
    }
}

members! {
    /// The goal of the surface craft. `kind` determines the other members.
    TaskMembers of Task as "Goal",
    /// Kind of goal.
    kind: GoalKind,
    /// `track`: the vehicle to follow.
    #[schema(value_type = Option<String>)]
    auv: Option<VehicleId>,
    /// `intermittent`: the vehicles to follow, in order. `midpoint`: those in the mean. `range`:
    /// those to stay near. `visit`: those to serve, in any order.
    #[schema(value_type = Option<Vec<String>>)]
    auvs: Option<Vec<VehicleId>>,
    /// `intermittent`: time with each vehicle, s.
    dwell_s: Option<f64>,
    /// `intermittent`: start of the first dwell at the first vehicle, s on the request's clock.
    epoch_s: Option<f64>,
    /// `weighted`: weight of each vehicle in the mean, by name, from 0 to 10⁶; only ratios count,
    /// and at least one is above 0. `visit`: weight of each vehicle's cost; default: 1.
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-1": 0.7, "auv-2": 0.3 }))]
    weights: Option<BTreeMap<VehicleId, f64>>,
    /// `range`: largest slant range to each vehicle, m, from 1 to 20,000.
    range_m: Option<f64>,
    /// `visit`: cost of an unserved vehicle. Default: its age.
    cost: Option<VisitCost>,
    /// `visit`: largest horizontal distance of service, m, from 1 to 5000. Default: 20.
    within_m: Option<f64>,
    /// `visit`: least time with a vehicle, s, from 0 to 3600. Default: 0 for `age`, else 30.
    dwell_min_s: Option<f64>,
    /// `visit`: deadlines of service by name, s on the request's clock. Default: none.
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 1800.0 }))]
    serve_by_s: Option<BTreeMap<VehicleId, f64>>,
    /// `visit`: the mean of the costs counts, or the largest. Default: `mean`.
    reduce: Option<Reduce>,
    /// `visit`: known present costs, by name, in the unit of the cost, from 0 to 10¹²; for example,
    /// from a modem that counts uploaded data. Default: the cost in `previous_plan`, advanced to
    /// now, else that of a vehicle just served.
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 340.0 }))]
    costs_now: Option<BTreeMap<VehicleId, f64>>,
    /// `visit`: the vehicle to visit next, until that visit is over. Default: that of least cost.
    #[schema(value_type = Option<String>)]
    next: Option<VehicleId>,
    /// Any kind: desired position relative to the followed point. Default: right above it.
    offset: Option<Offset>,
}

/// Kinds of goals.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum GoalKind {
    /// Stay above one vehicle: `auv`.
    Track,
    /// Follow each vehicle in turn: `auvs`, `dwell_s`, `epoch_s`.
    Intermittent,
    /// Stay above the mean of several vehicles: `auvs`.
    Midpoint,
    /// Stay above the weighted mean of several vehicles: `weights`.
    Weighted,
    /// Stay within a slant range of all vehicles, at the least largest range: `auvs`, `range_m`.
    Range,
    /// Serve several vehicles one after the other, in the order and at the times of least cost:
    /// `auvs`, and optionally `cost`, `weights`, `within_m`, `dwell_min_s`, `serve_by_s`, `reduce`,
    /// `costs_now`, `next`.
    Visit,
}

impl TaskMembers {
    /// The members of a goal of the kind `visit`, with their defaults.
    fn visits(&mut self, auvs: Vec<VehicleId>) -> Visits {
        let default = Visits::new(auvs);
        let cost = self.cost.take().unwrap_or(default.cost);
        Visits {
            cost,
            weights: self.weights.take().unwrap_or_default(),
            within_m: self.within_m.take().unwrap_or(default.within_m),
            dwell_min_s: self.dwell_min_s.take().unwrap_or(cost.dwell_min()),
            serve_by_s: self.serve_by_s.take().unwrap_or_default(),
            reduce: self.reduce.take().unwrap_or_default(),
            costs_now: self.costs_now.take().unwrap_or_default(),
            next: self.next.take(),
            ..default
        }
    }
}

impl<'de> Deserialize<'de> for Task {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut given = TaskMembers::deserialize(deserializer)?;
        let goal = match given.kind {
            GoalKind::Track => Goal::Track {
                auv: needed(&mut given.auv, "auv")?,
            },
            GoalKind::Intermittent => Goal::Intermittent {
                auvs: needed(&mut given.auvs, "auvs")?,
                dwell_s: needed(&mut given.dwell_s, "dwell_s")?,
                epoch_s: needed(&mut given.epoch_s, "epoch_s")?,
            },
            GoalKind::Midpoint => Goal::Midpoint {
                auvs: needed(&mut given.auvs, "auvs")?,
            },
            GoalKind::Weighted => Goal::Weighted {
                weights: needed(&mut given.weights, "weights")?,
            },
            GoalKind::Range => Goal::Range {
                auvs: needed(&mut given.auvs, "auvs")?,
                range_m: needed(&mut given.range_m, "range_m")?,
            },
            GoalKind::Visit => {
                let auvs = needed(&mut given.auvs, "auvs")?;
                Goal::Visit(given.visits(auvs))
            }
        };
        let offset = given.offset.take();
        given.none_left()?;
        Ok(Self { goal, offset })
    }
}

members! {
    /// Desired position relative to the followed point: a vehicle, the mean of several, or the
    /// point of least largest range. `frame` determines the other members.
    OffsetMembers of Offset as "Offset",
    /// Axes of the offset.
    frame: OffsetFrame,
    /// `ned`: distance north, m, within ±1000.
    north_m: Option<f64>,
    /// `ned`: distance east, m, within ±1000.
    east_m: Option<f64>,
    /// `target`, `path`: distance ahead, m, within ±1000.
    ahead_m: Option<f64>,
    /// `target`, `path`: distance to starboard, m, within ±1000.
    starboard_m: Option<f64>,
    /// `polar`: distance, m, from 0 to 1000.
    range_m: Option<f64>,
    /// `polar`: bearing, rad, clockwise from north, within ±2π.
    bearing_rad: Option<f64>,
}

/// Axes of an offset.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum OffsetFrame {
    /// North and east: `north_m`, `east_m`.
    Ned,
    /// Along the course over ground of the followed point: `ahead_m`, `starboard_m`. The offset
    /// turns with the course; while the point rests, its last course counts.
    Target,
    /// Along the path tangent at the vehicle: `ahead_m`, `starboard_m`. Needs a goal that follows
    /// one vehicle at a time, with a declared `path`.
    Path,
    /// North and east, as `range_m` and `bearing_rad`.
    Polar,
}

impl<'de> Deserialize<'de> for Offset {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut given = OffsetMembers::deserialize(deserializer)?;
        let offset = match given.frame {
            OffsetFrame::Ned => Self::Ned {
                north_m: needed(&mut given.north_m, "north_m")?,
                east_m: needed(&mut given.east_m, "east_m")?,
            },
            OffsetFrame::Target => Self::Target {
                ahead_m: needed(&mut given.ahead_m, "ahead_m")?,
                starboard_m: needed(&mut given.starboard_m, "starboard_m")?,
            },
            OffsetFrame::Path => Self::Path {
                ahead_m: needed(&mut given.ahead_m, "ahead_m")?,
                starboard_m: needed(&mut given.starboard_m, "starboard_m")?,
            },
            OffsetFrame::Polar => Self::Polar {
                range_m: needed(&mut given.range_m, "range_m")?,
                bearing_rad: needed(&mut given.bearing_rad, "bearing_rad")?,
            },
        };
        given.none_left()?;
        Ok(offset)
    }
}
