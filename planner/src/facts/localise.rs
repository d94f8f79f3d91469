//! Goals that move the craft so that its acoustic measurements fix AUVs, and its figures.

use std::collections::BTreeMap;

use nalgebra::{Rotation2, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::auv::VehicleId;
use crate::facts::ranges::{GOAL_LOCALISE, MapNumber, VISIT_COST, WEIGHT};
use crate::facts::visit::{Fixes, Reduce, VisitCost, Visits, interval, map_each, sigma, sigma_bearing};

/// Vehicles that the surface craft localises; the planner chooses the figure that it sails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields, bound(deserialize = "N: Deserialize<'de> + From<f64>"))]
#[schemars(bound = "N: JsonSchema + From<f64>")]
pub struct Localise<N = f64> {
    /// The vehicles to localise, in any order.
    #[schema(value_type = Vec<String>)]
    pub auvs: Vec<VehicleId>,
    /// Measurement between each vehicle and the craft; `range` if left out.
    #[serde(default)]
    #[schema(value_type = Option<Fixes>)]
    pub fixes: Fixes,
    /// Growth of a vehicle's variance along either axis between measurements, m²/s.
    #[schema(value_type = f64)]
    pub growth_m2ps: N,
    /// Standard deviation of a range, or of a fix at range 0, m; 1.5 if left out.
    #[serde(default = "sigma::<N>")]
    #[schema(value_type = Option<f64>)]
    pub sigma_m: N,
    /// Growth of a fix's `sigma_m` with the slant range, rad; 0.02 if left out. Not for ranges.
    #[serde(default = "sigma_bearing::<N>")]
    #[schema(value_type = Option<f64>)]
    pub sigma_rad: N,
    /// Time between two measurements of a vehicle, s; 10 if left out.
    #[serde(default = "interval::<N>")]
    #[schema(value_type = Option<f64>)]
    pub interval_s: N,
    /// Least horizontal distance to each of the vehicles, m; 0 if left out.
    #[serde(default = "none::<N>")]
    #[schema(value_type = Option<f64>)]
    pub stand_off_m: N,
    /// Relative weight of each vehicle's variance; 1 if left out. 0 excludes a vehicle.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-1": 2.0 }))]
    pub weights: BTreeMap<VehicleId, N>,
    /// The mean of the variances counts, or the largest; `mean` if left out.
    #[serde(default)]
    #[schema(value_type = Option<Reduce>)]
    pub reduce: Reduce,
    /// Known present variances of the vehicles' own navigation, north plus east, by name, m²; the
    /// covariance of the `state`, or of the estimate from `reports`, if left out.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(value_type = Option<BTreeMap<String, f64>>, example = json!({ "auv-2": 34.0 }))]
    pub costs_now: BTreeMap<VehicleId, N>,
}

fn none<N: From<f64>>() -> N {
    0.0.into()
}

impl<N> Localise<N> {
    pub(crate) fn map<M>(&self, number: MapNumber<'_, N, M>) -> Option<Localise<M>> {
        let mut of = |i: usize, given: &N| {
            let (member, range) = &GOAL_LOCALISE[i];
            number(&format!("localise.{member}"), range, Some(given))
        };
        Some(Localise {
            auvs: self.auvs.clone(),
            fixes: self.fixes,
            growth_m2ps: of(0, &self.growth_m2ps)?,
            sigma_m: of(1, &self.sigma_m)?,
            sigma_rad: of(2, &self.sigma_rad)?,
            interval_s: of(3, &self.interval_s)?,
            stand_off_m: of(4, &self.stand_off_m)?,
            weights: map_each("localise.weights", &WEIGHT, &self.weights, number)?,
            reduce: self.reduce,
            costs_now: map_each("localise.costs_now", &VISIT_COST, &self.costs_now, number)?,
        })
    }
}

impl Localise {
    /// The goal of a visit to `auv`, whose variance along either axis is `cost`, m²; none unless it
    /// takes ranges.
    pub(crate) fn of_visit(visits: &Visits, auv: &VehicleId, cost: f64) -> Option<Self> {
        let VisitCost::Uncertainty { fixes: Fixes::Range, growth_m2ps, sigma_m, sigma_rad, interval_s } =
            visits.cost
        else {
            return None;
        };
        Some(Self {
            auvs: vec![auv.clone()],
            fixes: Fixes::Range,
            growth_m2ps,
            sigma_m,
            sigma_rad,
            interval_s,
            stand_off_m: 0.0,
            weights: BTreeMap::new(),
            reduce: Reduce::Mean,
            costs_now: BTreeMap::from([(auv.clone(), 2.0 * cost)]),
        })
    }

    /// Weight of the variance of `id`.
    pub fn weight(&self, id: &VehicleId) -> f64 {
        self.weights.get(id).copied().unwrap_or(1.0)
    }
}

/// The figure that the craft sails for a goal of the kind `localise`: an ellipse about a point that
/// moves with the mean of the vehicles. The next request needs it in `previous_plan`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Figure {
    /// Its shape.
    pub kind: FigureKind,
    /// Present mean of the vehicles, north of the datum, m.
    pub north_m: f64,
    /// Present mean of the vehicles, east of the datum, m.
    pub east_m: f64,
    /// Direction of its axis, rad, clockwise from north.
    pub axis_rad: f64,
    /// Its centre ahead of the vehicles' mean, along the axis, m.
    pub ahead_m: f64,
    /// Its centre to starboard of that axis, m.
    pub starboard_m: f64,
    /// Semi-axis along the axis, m.
    pub semi_ahead_m: f64,
    /// Semi-axis across it, m.
    pub semi_starboard_m: f64,
    /// Rate of the phase, rad/s: positive clockwise, which keeps the vehicles to starboard.
    pub rate_radps: f64,
    /// Present phase of the goal on the ellipse, rad, clockwise from the axis.
    pub phase_rad: f64,
    /// The vehicles.
    pub vehicles: Vec<LocalisedVehicle>,
    /// One sentence that explains the figure to the operator.
    pub sentence: String,
}

/// Shape of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FigureKind {
    /// A point, at the vehicles' mean.
    Above,
    /// About the mean.
    Circle,
    /// About the mean, along the line of the vehicles.
    Ellipse,
    /// From side to side behind the mean.
    ZigzagAstern,
    /// Forward and back beside the mean.
    ZigzagAbeam,
}

/// Expected uncertainty of a vehicle's own navigation, or of its estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LocalisedVehicle {
    /// The vehicle.
    #[schema(value_type = String)]
    pub auv: VehicleId,
    /// Root-mean-square horizontal error now, m. Absent if unknown; 20 m along either axis is then
    /// assumed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_now_m: Option<f64>,
    /// The same over the coming minutes, on the figure.
    pub sigma_m: f64,
    /// The same if the craft stayed above the mean of the vehicles.
    pub sigma_above_m: f64,
    /// The same over time, at most 21 rows, the first for now: time from now, s, error on the
    /// figure, and if the craft stayed above, m. What a request sends back is not used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub over_time: Vec<[f64; 3]>,
}

impl Figure {
    /// Its larger semi-axis, m.
    pub(crate) fn size(&self) -> f64 {
        self.semi_ahead_m.max(self.semi_starboard_m)
    }

    /// The figure in another size, sailed at the same speed.
    pub(crate) fn scaled(self, ratio: f64) -> Self {
        Self {
            ahead_m: self.ahead_m * ratio,
            starboard_m: self.starboard_m * ratio,
            semi_ahead_m: self.semi_ahead_m * ratio,
            semi_starboard_m: self.semi_starboard_m * ratio,
            rate_radps: self.rate_radps / ratio,
            ..self
        }
    }

    /// The craft's place relative to the vehicles' mean, m, and its velocity relative to that, m/s,
    /// (north, east), `ahead` seconds after the plan.
    pub(crate) fn at(&self, ahead: f64) -> (Vector2<f64>, Vector2<f64>) {
        let (sin, cos) = (self.phase_rad + self.rate_radps * ahead).sin_cos();
        let ned = Rotation2::new(self.axis_rad);
        let semi = Vector2::new(self.semi_ahead_m, self.semi_starboard_m);
        let place =
            Vector2::new(self.ahead_m, self.starboard_m) + semi.component_mul(&Vector2::new(cos, sin));
        let velocity = semi.component_mul(&Vector2::new(-sin, cos)) * self.rate_radps;
        (ned * place, ned * velocity)
    }
}
