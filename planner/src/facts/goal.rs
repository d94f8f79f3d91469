//! Goals of the surface craft, and its offset from the point that it follows.

use std::{borrow::Cow, collections::BTreeMap};

use nalgebra::Vector2;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::facts::{
    angle::direction,
    auv::VehicleId,
    localise::Localise,
    ranges::{GOAL_IN_TURN, GOAL_RANGE, MapNumber, OFFSET_AHEAD, OFFSET_NED, OFFSET_POLAR, Range, WEIGHT},
    tagged::{read, read_tagged, tagged},
    visit::{Visits, map_each},
};

tagged! {
    /// The goal of the surface craft. `kind` determines the other members.
    #[derive(Clone, Debug, PartialEq)]
    pub enum Goal<N> = "Goal", GoalOutside, "kind" {
        /// Stay above one vehicle.
        Track {
            /// The vehicle to follow.
            #[schema(value_type = String)]
            auv: VehicleId,
        },
        /// Follow each vehicle in turn: the k-th from `epoch_s + k·dwell_s`, half-open.
        Intermittent {
            /// The vehicles to follow, in order.
            #[schema(value_type = Vec<String>)]
            auvs: Vec<VehicleId>,
            /// Time with each vehicle, s.
            #[schema(value_type = f64)]
            dwell_s: N,
            /// Start of the first dwell at the first vehicle, s on the craft's clock.
            #[schema(value_type = f64)]
            epoch_s: N,
        },
        /// Stay above the mean of several vehicles.
        Midpoint {
            /// The vehicles in the mean.
            #[schema(value_type = Vec<String>)]
            auvs: Vec<VehicleId>,
        },
        /// Stay above the weighted mean of several vehicles.
        Weighted {
            /// Weight of each vehicle in the mean, by name; only ratios count, and at least one is
            /// above 0.
            #[schema(value_type = BTreeMap<String, f64>, example = json!({ "auv-1": 0.7, "auv-2": 0.3 }))]
            weights: BTreeMap<VehicleId, N>,
        },
        /// Stay within a slant range of all vehicles, where the largest range is least.
        Range {
            /// The vehicles to stay near.
            #[schema(value_type = Vec<String>)]
            auvs: Vec<VehicleId>,
            /// Largest slant range to each vehicle, m.
            #[schema(value_type = f64)]
            range_m: N,
        },
        /// Move so that ranges or fixes between the craft and the vehicles fix them best.
        #[schema(value_type = Localise)]
        Localise(Localise<N>),
        /// Serve several vehicles one after the other, in the order and at the times of least cost.
        #[schema(value_type = Visits)]
        Visit(Visits<N>),
    }
}

impl<N> Goal<N> {
    /// The same goal with other numbers. `number` maps each one, with its place, such as
    /// `visit.cost.data.growth_kbps`, in this order. None if it gives none for a required one.
    pub fn map<M>(&self, number: MapNumber<'_, N, M>) -> Option<Goal<M>> {
        let mut of = |kind: &str, (member, range): &Range, given: &N| {
            number(&format!("{kind}.{member}"), range, Some(given))
        };
        Some(match self {
            Self::Track { auv } => Goal::Track { auv: auv.clone() },
            Self::Intermittent { auvs, dwell_s, epoch_s } => Goal::Intermittent {
                auvs: auvs.clone(),
                dwell_s: of("intermittent", &GOAL_IN_TURN[0], dwell_s)?,
                epoch_s: of("intermittent", &GOAL_IN_TURN[1], epoch_s)?,
            },
            Self::Midpoint { auvs } => Goal::Midpoint { auvs: auvs.clone() },
            Self::Weighted { weights } => {
                Goal::Weighted { weights: map_each("weighted.weights", &WEIGHT, weights, number)? }
            }
            Self::Range { auvs, range_m } => {
                Goal::Range { auvs: auvs.clone(), range_m: of("range", &GOAL_RANGE[0], range_m)? }
            }
            Self::Localise(localise) => Goal::Localise(localise.map(number)?),
            Self::Visit(visits) => Goal::Visit(visits.map(number)?),
        })
    }
}

/// The member of a goal that names vehicles.
pub(crate) enum Names<'a> {
    /// `auv`.
    One(&'a VehicleId),
    /// `auvs`.
    List(&'a [VehicleId]),
    /// `weights`.
    Weights(&'a BTreeMap<VehicleId, f64>),
}

impl Goal {
    pub(crate) fn names(&self) -> Names<'_> {
        match self {
            Self::Track { auv } => Names::One(auv),
            Self::Intermittent { auvs, .. }
            | Self::Midpoint { auvs }
            | Self::Range { auvs, .. }
            | Self::Localise(Localise { auvs, .. })
            | Self::Visit(Visits { auvs, .. }) => Names::List(auvs),
            Self::Weighted { weights } => Names::Weights(weights),
        }
    }

    /// The AUVs that the goal names, in its order.
    pub fn named(&self) -> impl Iterator<Item = &VehicleId> {
        let (listed, weights) = match self.names() {
            Names::One(auv) => (std::slice::from_ref(auv), None),
            Names::List(auvs) => (auvs, None),
            Names::Weights(weights) => ([].as_slice(), Some(weights)),
        };
        listed.iter().chain(weights.into_iter().flat_map(BTreeMap::keys))
    }

    pub(crate) fn weight(&self, id: &VehicleId) -> f64 {
        match self {
            Self::Weighted { weights } => weights[id],
            Self::Localise(localise) => localise.weight(id),
            Self::Visit(visits) => visits.weight(id),
            Self::Track { .. } | Self::Intermittent { .. } | Self::Midpoint { .. } | Self::Range { .. } => {
                1.0
            }
        }
    }

    /// The AUVs that the goal depends on, in its order, without those of weight 0.
    pub fn vehicles(&self) -> impl Iterator<Item = &VehicleId> {
        self.named().filter(|id| 0.0 < self.weight(id))
    }

    /// The goal of a craft that serves only vehicles of which `serves` is true; none without any.
    pub(crate) fn only(&self, serves: impl Fn(&VehicleId) -> bool) -> Option<Self> {
        let keep = |auvs: &mut Vec<VehicleId>| auvs.retain(&serves);
        let keep_each = |numbers: &mut BTreeMap<VehicleId, f64>| numbers.retain(|id, _| serves(id));
        let mut part = self.clone();
        match &mut part {
            Self::Track { .. } => {}
            Self::Intermittent { auvs, .. } | Self::Midpoint { auvs } | Self::Range { auvs, .. } => {
                keep(auvs);
            }
            Self::Weighted { weights } => keep_each(weights),
            Self::Localise(Localise { auvs, weights, costs_now, .. }) => {
                keep(auvs);
                [weights, costs_now].into_iter().for_each(keep_each);
            }
            Self::Visit(visits) => {
                keep(&mut visits.auvs);
                let numbers = [&mut visits.weights, &mut visits.serve_by_s, &mut visits.costs_now];
                numbers.into_iter().for_each(keep_each);
                visits.next = visits.next.take().filter(&serves);
            }
        }
        let is_served = part.vehicles().any(&serves);
        is_served.then_some(part)
    }

    /// `true` if it follows one vehicle at a time, along whose path its offset may be.
    pub fn follows_one(&self) -> bool {
        match self {
            Self::Track { .. } | Self::Intermittent { .. } | Self::Visit(_) => true,
            Self::Midpoint { .. } | Self::Weighted { .. } | Self::Range { .. } | Self::Localise(_) => false,
        }
    }
}

tagged! {
    /// Desired position relative to the followed point: a vehicle, the mean of several, or the
    /// point of least largest range. `frame` determines the other members.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum Offset<N> = "Offset", OffsetOutside, "frame" {
        /// In fixed directions.
        Ned {
            /// Distance north, m.
            #[schema(value_type = f64)]
            north_m: N,
            /// Distance east, m.
            #[schema(value_type = f64)]
            east_m: N,
        },
        /// Along the course over ground of the followed point. The offset turns with the course;
        /// while the point rests, its last course counts.
        Target {
            /// Distance ahead, m.
            #[schema(value_type = f64)]
            ahead_m: N,
            /// Distance to starboard, m.
            #[schema(value_type = f64)]
            starboard_m: N,
        },
        /// Along the path tangent at the vehicle. Needs a goal that follows one vehicle at a time,
        /// and whose path is known.
        Path {
            /// Distance ahead, m.
            #[schema(value_type = f64)]
            ahead_m: N,
            /// Distance to starboard, m.
            #[schema(value_type = f64)]
            starboard_m: N,
        },
        /// In a fixed direction.
        Polar {
            /// Distance, m.
            #[schema(value_type = f64)]
            range_m: N,
            /// Bearing, rad, clockwise from north.
            #[schema(value_type = f64)]
            bearing_rad: N,
        },
    }
}
read_tagged!(Offset<N>, OffsetOutside, "frame");

impl<N> Offset<N> {
    /// As [`Goal::map`].
    pub fn map<M>(&self, number: MapNumber<'_, N, M>) -> Option<Offset<M>> {
        let mut of = |frame: &str, (member, range): &Range, given: &N| {
            number(&format!("{frame}.{member}"), range, Some(given))
        };
        Some(match self {
            Self::Ned { north_m, east_m } => Offset::Ned {
                north_m: of("ned", &OFFSET_NED[0], north_m)?,
                east_m: of("ned", &OFFSET_NED[1], east_m)?,
            },
            Self::Target { ahead_m, starboard_m } => Offset::Target {
                ahead_m: of("target", &OFFSET_AHEAD[0], ahead_m)?,
                starboard_m: of("target", &OFFSET_AHEAD[1], starboard_m)?,
            },
            Self::Path { ahead_m, starboard_m } => Offset::Path {
                ahead_m: of("path", &OFFSET_AHEAD[0], ahead_m)?,
                starboard_m: of("path", &OFFSET_AHEAD[1], starboard_m)?,
            },
            Self::Polar { range_m, bearing_rad } => Offset::Polar {
                range_m: of("polar", &OFFSET_POLAR[0], range_m)?,
                bearing_rad: of("polar", &OFFSET_POLAR[1], bearing_rad)?,
            },
        })
    }
}

impl Offset {
    /// An offset in fixed directions, (north, east), m.
    pub fn ned(by: Vector2<f64>) -> Self {
        Self::Ned { north_m: by.x, east_m: by.y }
    }

    /// An offset along the course of the followed point, (ahead, starboard), m.
    pub fn target(by: Vector2<f64>) -> Self {
        Self::Target { ahead_m: by.x, starboard_m: by.y }
    }

    /// An offset along the path of the followed AUV, (ahead, starboard), m.
    pub fn path(by: Vector2<f64>) -> Self {
        Self::Path { ahead_m: by.x, starboard_m: by.y }
    }

    /// The offset in the axes of its frame, m: (north, east), or (ahead, starboard).
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

impl<'de> Deserialize<'de> for Task {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let (mut goal, offset) = read::<GoalOutside, Offset, D>(from, "$tagged kind offset")?;
        if let Goal::Visit(visits) = &mut goal {
            visits.fill_defaults();
        }
        Ok(Self { goal, offset })
    }
}

impl PartialSchema for Task {
    /// Each kind has an `offset` beside its members.
    fn schema() -> RefOr<Schema> {
        <Goal as PartialSchema>::schema()
    }
}

impl ToSchema for Task {
    fn name() -> Cow<'static, str> {
        <Goal as ToSchema>::name()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        <Goal as ToSchema>::schemas(schemas);
        schemas.push((<Offset as ToSchema>::name().into(), <Offset as PartialSchema>::schema()));
    }
}
