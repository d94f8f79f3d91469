//! The request of a client, unchecked.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::craft::description::{CraftDescription, HeadingLoop, SurgeLoop};
use crate::craft::learn_by_ekf::{CraftObservation, PastReference};
use crate::estimate::from_reports::Before;
use crate::facts::asc::{Asc, DeclaredLimits, Limits};
use crate::facts::auv::{Auv, VehicleId};
use crate::facts::bounds::KeepOut;
use crate::facts::goal::Task;
use crate::facts::no_go::NoGo;
use crate::facts::options::{Fallback, Forecast, Hold};
use crate::facts::origin::Origin;
use crate::facts::previous_plan::{PreviousPlan, PreviousTarget, RememberedTarget};
use crate::facts::ranges::CURRENT_MAX;
use crate::facts::traffic::Vessel;
use crate::facts::tuning::Tuning;
use crate::facts::water::Current;
use crate::tuned::CraftNumbers;

/// Version of these shapes, in requests and answers.
pub const SCHEMA_VERSION: &str = "1.0";

/// Averaging time of an undeclared current, s.
const CURRENT_MEMORY: f64 = 30.0;

/// Largest age of a previous plan whose current and drifts are remembered, s.
pub(crate) const REMEMBERED_AGE_MAX: f64 = 60.0;

/// The facts of one moment, and the goal of the surface craft.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanRequest {
    /// Version of this shape: `"1.0"`.
    #[schema(example = "1.0")]
    pub schema_version: String,
    /// Present time, s, on any clock that all times of the request share.
    pub t_s: f64,
    /// Position of the datum on Earth. With it, any position may be given as `lat_deg` and
    /// `lon_deg` instead of `north_m` and `east_m`, and a point of a list as an object of these
    /// two; answers have both. Headings, courses, velocities and offsets are then relative to true
    /// north at the craft, else to the frame's north. Default: unknown.
    pub origin: Option<Origin>,
    /// The surface craft.
    pub asc: Asc,
    /// The underwater vehicles, 1 to 16, in any order.
    pub auvs: Vec<Auv>,
    /// The goal and its offset.
    pub goal: Task,
    /// Current at the surface. Velocities that differ by more than 3 m/s along an axis are ignored,
    /// with the warning `velocities_contradict`. Default: the surface craft's ground velocity minus
    /// its velocity through the water; without a ground velocity, the estimate from positions and
    /// speed through the water, else the current of `previous_plan`, else 0.
    pub current: Option<Current>,
    /// Limits of the surface craft; without `craft`, they describe it. Default: as in each member.
    pub limits: Option<DeclaredLimits>,
    /// Closed-loop response of the surface craft. Omitted members are the preset's or, without a
    /// preset, a cautious generic craft's, and are learnt. Default: unknown.
    pub craft: Option<CraftDescription>,
    /// Discs to keep out of, at most 32. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_outs: Vec<KeepOut>,
    /// Polygons to keep out of, such as land, at most 256 with 10 000 corners in all. Default:
    /// none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub no_go: Vec<NoGo>,
    /// Corners [north, east] of a convex area to stay in, m: 3 to 64, in order, in either
    /// direction, each once. A corner up to 0.2 m within the sides (rounded degrees) is omitted.
    /// Default: no limit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(example = json!([[-50.0, -50.0], [200.0, -50.0], [200.0, 150.0], [-50.0, 150.0]]))]
    pub area: Vec<[f64; 2]>,
    /// Limits of the acoustic link. Default: none.
    pub acoustics: Option<Acoustics>,
    /// Horizontal distance to keep from each underwater vehicle that may be within 2 m of the
    /// surface, m. Default: no limit.
    #[schema(example = 5.0)]
    pub surfacing_separation_m: Option<f64>,
    /// Other vessels, at most 64, from AIS, radar or whatever tells of them. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traffic: Vec<Vessel>,
    /// Distance to keep from other vessels' sides, m, from 1 to 2000: the craft's own half length
    /// and a margin. Half the vessel's length and its uncertainty add to it. Default: 30.
    #[schema(example = 50.0)]
    pub vessel_separation_m: Option<f64>,
    /// Tuning of the planner: weights, horizon, iterations. Default: as in each member.
    pub tuning: Option<Tuning>,
    /// Forecast of the underwater vehicles. Default: `auto`.
    #[serde(default)]
    pub forecast: Forecast,
    /// Behaviour without a solved program, or if the goal's last report is too old. Default: `los`.
    #[serde(default)]
    pub fallback: Fallback,
    /// The last fallback level. Default: `slow_turn`.
    #[serde(default)]
    pub hold: Hold,
    /// Deadline of the answer, ms after the request's head arrived. Programs solved by then compete
    /// for the answer; if there are none, `fallback` applies. Default and maximum: the service's
    /// deadline, 1000 unless configured.
    pub deadline_ms: Option<f64>,
    /// The last answer, whole. The service does not store it.
    pub previous_plan: Option<PreviousPlan>,
    /// Any object, returned in the answer. At most 4096 bytes.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

/// Limits of the acoustic link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Acoustics {
    /// Largest slant range to each underwater vehicle, m. Horizontally the planner subtracts 1.73
    /// times the vehicle's `position_sigma_m`, so that the range holds for nearly all its possible
    /// positions.
    pub range_max_m: f64,
}

impl PlanRequest {
    /// A request with these members; the others may be set afterwards. By default the limits are
    /// [`Limits::ANY`](super::Limits::ANY), the craft is generic until it is learnt, forecasts are
    /// chosen for each AUV, and the last fallback level is a slow turn.
    pub fn new(t_s: f64, asc: Asc, auvs: Vec<Auv>, goal: impl Into<Task>) -> Self {
        Self {
            schema_version: SCHEMA_VERSION.to_owned(),
            t_s,
            origin: None,
            asc,
            auvs,
            goal: goal.into(),
            current: None,
            limits: None,
            craft: None,
            keep_outs: Vec::new(),
            no_go: Vec::new(),
            area: Vec::new(),
            acoustics: None,
            surfacing_separation_m: None,
            traffic: Vec::new(),
            vessel_separation_m: None,
            tuning: None,
            forecast: Forecast::Auto,
            fallback: Fallback::Los,
            hold: Hold::SlowTurn,
            deadline_ms: None,
            previous_plan: None,
            metadata: Map::new(),
        }
    }

    /// Largest slant range to every AUV, m.
    pub fn range_max(&self) -> Option<f64> {
        self.acoustics.map(|acoustics| acoustics.range_max_m)
    }

    pub(crate) fn limits(&self) -> Limits {
        self.limits.as_ref().map_or(Limits::ANY, Limits::from)
    }

    /// The declared craft. Without `craft`, `limits` also describe the craft.
    pub(crate) fn craft(&self) -> CraftDescription {
        let limits = self.limits.unwrap_or_default();
        let mut craft = self.craft.clone().unwrap_or_else(|| CraftDescription {
            heading_loop: HeadingLoop {
                rate_max_radps: limits.turn_rate_max_radps,
                ..HeadingLoop::default()
            },
            surge_loop: SurgeLoop {
                acceleration_max_mps2: limits.acceleration_max_mps2,
                deceleration_max_mps2: limits.deceleration_max_mps2,
                ..SurgeLoop::default()
            },
            ..CraftDescription::default()
        });
        let lag = &mut craft.surge_loop.time_constant_s;
        *lag = lag.or(limits.surge_lag_s);
        craft
    }

    /// Current (north, east), m/s; zero if unknown.
    pub fn current(&self) -> Vector2<f64> {
        self.known_current().unwrap_or_else(Vector2::zeros)
    }

    /// Current (north, east), m/s: the declared one; else ground velocity minus velocity through
    /// the water, smoothed with the previous plan's current; without a ground velocity, the
    /// estimate from positions and speed through the water, else the previous plan's.
    pub fn known_current(&self) -> Option<Vector2<f64>> {
        let previous = self.previous_plan.as_ref();
        let unmeasured = self.current.is_none() && self.asc.ground_velocity().is_none();
        let then = previous.and_then(PreviousPlan::made_at);
        let learnt = || {
            let age = self.t_s - then?;
            let young = (0.0..=REMEMBERED_AGE_MAX).contains(&age);
            previous?.craft().filter(|_| young)?.current_from_positions()
        };
        let remembered = || Some((then?, previous?.current?.into()));
        let positions = if unmeasured { learnt() } else { None };
        positions.or_else(|| self.current_after(remembered())).or_else(learnt)
    }

    /// [`PlanRequest::known_current`] with `memory`: a time, s, and its current.
    ///
    /// ```text
    /// c = c⁻ + (1 − exp(−Δ/τ)) (v_ground − v_water − c⁻)
    /// ```
    /// Without the memory, sensor noise steers the craft.
    ///
    /// Velocities that leave more than [`CURRENT_MAX`] along an axis contradict each other and are
    /// ignored: an unsettled speed log or compass must not spoil plans, nor the memory.
    pub fn current_after(&self, memory: Option<(f64, Vector2<f64>)>) -> Option<Vector2<f64>> {
        let measured = || {
            let apparent = self.asc.apparent_current();
            apparent.filter(|current| current.amax() <= CURRENT_MAX)
        };
        let remembered = memory
            .map(|(then, current)| (self.t_s - then, current))
            .filter(|(elapsed, _)| (0.0..=REMEMBERED_AGE_MAX).contains(elapsed));
        self.current.map(Vector2::from).or_else(|| match (measured(), remembered) {
            (Some(measured), Some((elapsed, before))) => {
                let share = 1.0 - (-elapsed / CURRENT_MEMORY).exp();
                Some(before + (measured - before) * share)
            }
            (measured, remembered) => measured.or(remembered.map(|(_, current)| current)),
        })
    }

    /// The request's observation of the craft, which has these `limits`.
    pub(crate) fn craft_observation<'a>(&'a self, limits: &'a Limits) -> CraftObservation<'a> {
        let previous = || {
            let previous = self.previous_plan.as_ref()?;
            let (reference, command) = (previous.asked()?, previous.command()?);
            let asked = PastReference {
                heading: reference.heading.radians(),
                speed: reference.speed,
                command: Vector2::new(command.heading.radians(), command.speed),
                elapsed: self.t_s - previous.made_at()?,
            };
            Some((previous.craft()?, asked))
        };
        CraftObservation {
            asc: &self.asc,
            limits,
            declared_current: self.current.map(Vector2::from),
            current: self.current(),
            previous: previous(),
            tuned: &CraftNumbers::DEFAULT,
        }
    }

    /// The AUV `id` in the previous plan, and the time of its report, s on the snapshot's clock.
    pub(crate) fn remembered(&self, id: &VehicleId) -> Option<(RememberedTarget, f64)> {
        let previous = self.previous_plan.as_ref()?;
        let then = previous.made_at()?;
        let target = |known: &PreviousTarget| (known.id == *id).then(|| known.whole()).flatten();
        let target = previous.targets.iter().flatten().find_map(target)?;
        let young = (0.0..=REMEMBERED_AGE_MAX).contains(&(self.t_s - then));
        young.then_some((target, then - target.estimate.age_s))
    }

    /// The AUV `id` in the previous plan.
    pub(crate) fn before(&self, id: &VehicleId) -> Before<'_> {
        let mut targets = self.previous_plan.iter().flat_map(|plan| &plan.targets).flatten();
        let target = targets.find(|target| target.id == *id);
        let track = target.map_or_else(Default::default, |target| target.track.as_slice());
        Before {
            target: self.remembered(id),
            track: (self.forecast == Forecast::Auto).then_some(track),
            states: target.map_or_else(Default::default, |target| target.states.as_slice()),
            ranging: target.and_then(|target| target.ranging.as_ref()),
        }
    }

    /// Age of a vessel's position, s.
    pub fn vessel_age(&self, vessel: &Vessel) -> f64 {
        vessel.t_s.map_or(0.0, |then| (self.t_s - then).max(0.0))
    }

    /// Makes ranges of travel times, and says of each recent range without `from` where the craft
    /// was then.
    pub(crate) fn place_ranges(&mut self) {
        let water = || self.asc.water_velocity() + self.current();
        let velocity = self.asc.ground_velocity().unwrap_or_else(water);
        let (now, position) = (self.t_s, self.asc.position());
        let reports = self.auvs.iter_mut().filter_map(|auv| auv.reports.as_mut()).flatten();
        for report in reports.filter(|report| report.is_range()) {
            report.measure();
            report.from.get_or_insert_with(|| (position + velocity * (report.t_s.min(now) - now)).into());
        }
    }

    /// The AUV `id`.
    pub fn auv(&self, id: &VehicleId) -> Option<&Auv> {
        self.auvs.iter().find(|auv| auv.id == *id)
    }
}
