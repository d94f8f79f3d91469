//! What the surface craft is to do, and where it is to be, seen from what it follows.

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

/// What the surface craft is to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Goal {
    /// Stay above one AUV.
    Track {
        /// The AUV to follow.
        auv: VehicleId,
    },
    /// Follow each AUV in turn for a dwell time: the k-th from `epoch_s + k·dwell_s` on, half-open.
    Intermittent {
        /// The AUVs to follow, in order.
        auvs: Vec<VehicleId>,
        /// Time spent with each, s.
        dwell_s: f64,
        /// When the first dwell of the first AUV began, s on the snapshot's clock.
        epoch_s: f64,
    },
    /// Stay above the mean of several AUVs.
    Midpoint {
        /// The AUVs whose mean to follow.
        auvs: Vec<VehicleId>,
    },
    /// Stay above the weighted mean of several AUVs.
    Weighted {
        /// The AUVs whose mean to follow, and how much each counts, relative to the others; 0 is not at all.
        weights: BTreeMap<VehicleId, f64>,
    },
    /// Stay within a slant range of every one of several AUVs, and where the worst range is least.
    Range {
        /// The AUVs to stay near.
        auvs: Vec<VehicleId>,
        /// The slant range to stay within, m.
        range_m: f64,
    },
    /// Serve several AUVs one after the other, which of them and when as costs them least.
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

    /// The AUVs that the goal depends on, in its order: those of weight 0 left out.
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

/// Where the surface craft is to be, seen from what its goal follows: the AUV or, of several, their mean or the
/// place nearest to all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "frame", rename_all = "snake_case")]
pub enum Offset {
    /// In fixed directions.
    Ned {
        /// How far north, m.
        north_m: f64,
        /// How far east, m.
        east_m: f64,
    },
    /// Along the course over ground of what is followed, held while that rests.
    Target {
        /// How far ahead, m.
        ahead_m: f64,
        /// How far to starboard, m.
        starboard_m: f64,
    },
    /// Along the tangent of the path where the AUV is that is followed.
    Path {
        /// How far ahead, m.
        ahead_m: f64,
        /// How far to starboard, m.
        starboard_m: f64,
    },
    /// In a fixed direction.
    Polar {
        /// How far, m.
        range_m: f64,
        /// In which direction, rad, clockwise from north.
        bearing_rad: f64,
    },
}

impl Offset {
    /// In fixed directions, (north, east), m.
    #[must_use]
    pub fn ned(by: Vector2<f64>) -> Self {
        Self::Ned {
            north_m: by.x,
            east_m: by.y,
        }
    }

    /// Along the course of what is followed, (ahead, starboard), m.
    #[must_use]
    pub fn target(by: Vector2<f64>) -> Self {
        Self::Target {
            ahead_m: by.x,
            starboard_m: by.y,
        }
    }

    /// Along the path of the AUV that is followed, (ahead, starboard), m.
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
    /// Offset from what the goal follows; without it the craft stays right above.
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
    /// What the surface craft is to do. Which members are needed depends on `kind`.
    TaskMembers of Task as "Goal",
    /// Which goal.
    kind: GoalKind,
    /// `track`: the vehicle to follow.
    #[schema(value_type = Option<String>)]
    auv: Option<VehicleId>,
    /// `intermittent`: the vehicles to follow, in order. `midpoint`: those whose mean to follow. `range`: those to stay near.
    /// `visit`: those to serve, in any order.
    #[schema(value_type = Option<Vec<String>>)]
    auvs: Option<Vec<VehicleId>>,
    /// `intermittent`: time spent with each, s.
    dwell_s: Option<f64>,
    /// `intermittent`: when the first dwell of the first vehicle began, s on the request's clock.
    epoch_s: Option<f64>,
    /// `weighted`: how much each vehicle counts in the mean, by name, relative to the others: from 0 to 10⁶,
    /// at least one above 0. `visit`: how much the cost of each counts; 1 of those that are not named.
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-1": 0.7, "auv-2": 0.3 }))]
    weights: Option<BTreeMap<VehicleId, f64>>,
    /// `range`: slant range to stay within of each, m, from 1 to 20,000.
    range_m: Option<f64>,
    /// `visit`: what it costs not to serve a vehicle. Default: its age.
    cost: Option<VisitCost>,
    /// `visit`: horizontal distance within which a vehicle counts as served, m, from 1 to 5000. Default: 20.
    within_m: Option<f64>,
    /// `visit`: least time with a vehicle, s, from 0 to 3600. Default: 0 where the cost is `age`, else 30.
    dwell_min_s: Option<f64>,
    /// `visit`: until when each vehicle must have been served, by name, s on the request's clock. Default: no deadline.
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 1800.0 }))]
    serve_by_s: Option<BTreeMap<VehicleId, f64>>,
    /// `visit`: whether the mean of the costs counts or the largest. Default: `mean`.
    reduce: Option<Reduce>,
    /// `visit`: costs now, by name, in the unit of the cost, from 0 to 10¹²: where they are known, as from a modem that counts what
    /// was uploaded. Default: that of `previous_plan`, carried on, else that of a vehicle that was just served.
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 340.0 }))]
    costs_now: Option<BTreeMap<VehicleId, f64>>,
    /// `visit`: the vehicle to visit next, and to stay with until this is left out. Default: the one that costs least.
    #[schema(value_type = Option<String>)]
    next: Option<VehicleId>,
    /// Any kind: where to be, seen from what the goal follows. Default: right above it.
    offset: Option<Offset>,
}

/// The kinds of goals.
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
    /// Stay within a slant range of every vehicle, and where the worst is least: `auvs`, `range_m`.
    Range,
    /// Serve several vehicles one after the other, in the order and at the times that cost them least: `auvs`, and
    /// optionally `cost`, `weights`, `within_m`, `dwell_min_s`, `serve_by_s`, `reduce`, `costs_now`, `next`.
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
    /// Where to be, seen from what the goal follows: a vehicle or, of several, their mean or the place nearest to all.
    /// Which members are needed depends on `frame`.
    OffsetMembers of Offset as "Offset",
    /// Along which axes.
    frame: OffsetFrame,
    /// `ned`: how far north, m, within ±1000.
    north_m: Option<f64>,
    /// `ned`: how far east, m, within ±1000.
    east_m: Option<f64>,
    /// `target`, `path`: how far ahead, m, within ±1000.
    ahead_m: Option<f64>,
    /// `target`, `path`: how far to starboard, m, within ±1000.
    starboard_m: Option<f64>,
    /// `polar`: how far, m, from 0 to 1000.
    range_m: Option<f64>,
    /// `polar`: in which direction, rad, clockwise from north, within ±2π.
    bearing_rad: Option<f64>,
}

/// The axes that an offset is given in.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum OffsetFrame {
    /// North and east: `north_m`, `east_m`.
    Ned,
    /// Along the course over ground of what the goal follows, held while that rests: `ahead_m`, `starboard_m`. It
    /// turns with it.
    Target,
    /// Along the tangent of the path where the vehicle is on it: `ahead_m`, `starboard_m`. For a goal that follows
    /// one vehicle at a time, whose `path` is given.
    Path,
    /// North and east, given as `range_m` and `bearing_rad`.
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
