//! What clients post: everything that they know and want, unchecked.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use crate::{
    craft::{
        description::{CraftDescription, HeadingLoop, SurgeLoop},
        learn_by_ekf::{CraftObservation, PastReference},
    },
    estimate::legs::TrackPoint,
    facts::{
        asc::{Asc, DeclaredLimits, Limits},
        auv::{Auv, VehicleId},
        bounds::KeepOut,
        goal::Task,
        options::{Fallback, Forecast, Hold},
        origin::Origin,
        previous_plan::{PreviousPlan, PreviousTarget, RememberedTarget},
        ranges::CURRENT_MAX,
        tuning::Tuning,
        water::Current,
    },
};

/// The version of these shapes that requests must name and answers carry.
pub const SCHEMA_VERSION: &str = "1.0";

/// How long the current is averaged over, where it is not declared, s.
const CURRENT_MEMORY: f64 = 30.0;

/// Age of a previous plan up to which its current and the drift of its AUVs are remembered, s.
pub(crate) const REMEMBERED_AGE_MAX: f64 = 60.0;

/// A snapshot of what is known now, and what the surface craft is to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanRequest {
    /// Version of this shape: `"1.0"`.
    #[schema(example = "1.0")]
    pub schema_version: String,
    /// Now, s, on any clock that all times of the request share.
    pub t_s: f64,
    /// Where the datum of all positions lies on Earth. With it, any position may be given as `lat_deg` and `lon_deg`
    /// instead of `north_m` and `east_m`, and a point of a list as an object of these two; answers have both. Headings, courses,
    /// velocities and offsets are then from true north at the craft, else from the frame's north. Default: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// The surface craft.
    pub asc: Asc,
    /// The underwater vehicles, 1 to 16, in any order.
    pub auvs: Vec<Auv>,
    /// What to do.
    pub goal: Task,
    /// Current at the surface. Default: the surface craft's ground velocity less its velocity through the water; without a
    /// ground velocity, the estimate from its positions and its speed through the water, else the current of
    /// `previous_plan`, else still water. Velocities that differ by more than 3 m/s along an axis are ignored, with the
    /// warning `velocities_contradict`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// What the operator allows the surface craft. Default: as in each member. Without `craft`, `limits` also describe the
    /// craft.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<DeclaredLimits>,
    /// Closed-loop response of the surface craft. A member that is left out has the preset's value or, without a preset, a
    /// cautious generic craft's, and is learnt from the motion. Default: unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<CraftDescription>,
    /// Discs to keep out of, at most 32. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_outs: Vec<KeepOut>,
    /// Corners [north, east] of a convex area to stay in, m: 3 to 64, in order, either way round, every corner
    /// once. A corner up to 0.2 m within its sides, where rounded degrees put it, is left out. Default: no limit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(example = json!([[-50.0, -50.0], [200.0, -50.0], [200.0, 150.0], [-50.0, 150.0]]))]
    pub area: Vec<[f64; 2]>,
    /// What the acoustic link needs. Default: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acoustics: Option<Acoustics>,
    /// Horizontal distance to keep from every underwater vehicle while it may be within 2 m of the surface, m, from
    /// 0.5 to 100. Default: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 5.0)]
    pub surfacing_separation_m: Option<f64>,
    /// The planner's levers: weights, horizon, iterations. Default: as in each member.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tuning: Option<Tuning>,
    /// How to guess the underwater vehicles' future. Default: `auto`.
    #[serde(default)]
    pub forecast: Forecast,
    /// What to do when no program was solved, and for a goal of which the last report is too old. Default: `los`.
    #[serde(default)]
    pub fallback: Fallback,
    /// What the last fallback level does. Default: `slow_turn`.
    #[serde(default)]
    pub hold: Hold,
    /// Deadline of the answer, ms after the request's head arrived, from 0.05 to 60 000. If it comes before all programs
    /// are solved, the solved ones compete for the answer; if none is solved, `fallback` applies. Default and maximum: the
    /// service's deadline, 1000 unless configured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_ms: Option<f64>,
    /// The last answer, whole. The service keeps none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub previous_plan: Option<PreviousPlan>,
    /// Anything; comes back in the answer. At most 4096 bytes.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

/// What the acoustic link needs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Acoustics {
    /// Largest slant range to every underwater vehicle, m, from 1 to 20 000. The planner keeps 1.73 times the vehicle's
    /// `position_sigma_m` less in the horizontal, so that the range holds for nearly all positions where the vehicle may be.
    pub range_max_m: f64,
}

impl PlanRequest {
    /// What must be stated; the rest may be changed afterwards. Nothing else is known or limited but a small craft's speeds
    /// ([`Limits::ANY`](super::Limits::ANY)), the craft answers as the generic one until it is learnt, forecasts are chosen for
    /// each AUV, and without a solved program the fallback levels answer, the last of which is a slow turn.
    #[must_use]
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
            area: Vec::new(),
            acoustics: None,
            surfacing_separation_m: None,
            tuning: None,
            forecast: Forecast::Auto,
            fallback: Fallback::Los,
            hold: Hold::SlowTurn,
            deadline_ms: None,
            previous_plan: None,
            metadata: Map::new(),
        }
    }

    /// Slant range to every AUV to keep within, m.
    #[must_use]
    pub fn range_max(&self) -> Option<f64> {
        self.acoustics.map(|acoustics| acoustics.range_max_m)
    }

    /// What the surface craft may do.
    #[must_use]
    pub(crate) fn limits(&self) -> Limits {
        self.limits.as_ref().map_or(Limits::ANY, Limits::from)
    }

    /// The declared craft. Without `craft`, `limits` also describe the craft.
    #[must_use]
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

    /// Current (north, east), m/s, zero where it is not known.
    #[must_use]
    pub fn current(&self) -> Vector2<f64> {
        self.known_current().unwrap_or_else(Vector2::zeros)
    }

    /// Current (north, east), m/s: the one given; else what ground velocity less velocity through the water give,
    /// smoothed with what the previous plan took it for; without a ground velocity, what positions and speed through the
    /// water gave until then, else what the previous plan took it for.
    #[must_use]
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
        positions
            .or_else(|| self.current_after(remembered()))
            .or_else(learnt)
    }

    /// [`PlanRequest::known_current`], the memory being a time on the snapshot's clock, s, and the current then.
    ///
    /// ```text
    /// c = c⁻ + (1 − exp(−Δ/τ)) (v_ground − v_water − c⁻)
    /// ```
    /// Without the memory, noise of the sensors steers the craft.
    ///
    /// Velocities that leave more than [`CURRENT_MAX`] along an axis contradict each other and say nothing: a speed
    /// log that has not locked on yet, or a compass that has not settled, must cost the craft neither its plan nor,
    /// clamped and remembered, a minute's worth of wrong ones.
    #[must_use]
    pub fn current_after(&self, memory: Option<(f64, Vector2<f64>)>) -> Option<Vector2<f64>> {
        let measured = || {
            let apparent = self.asc.apparent_current();
            apparent.filter(|current| current.amax() <= CURRENT_MAX)
        };
        let remembered = memory
            .map(|(then, current)| (self.t_s - then, current))
            .filter(|(elapsed, _)| (0.0..=REMEMBERED_AGE_MAX).contains(elapsed));
        self.current
            .map(Vector2::from)
            .or_else(|| match (measured(), remembered) {
                (Some(measured), Some((elapsed, before))) => {
                    let share = 1.0 - (-elapsed / CURRENT_MEMORY).exp();
                    Some(before + (measured - before) * share)
                }
                (measured, remembered) => measured.or(remembered.map(|(_, current)| current)),
            })
    }

    /// What the request says of the craft, which may do what `limits` say.
    pub(crate) fn of_the_craft<'a>(&'a self, limits: &'a Limits) -> CraftObservation<'a> {
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
        }
    }

    /// What the previous plan knew of the AUV called `id`, and the time of the report that it knew it from, s on the
    /// snapshot's clock.
    pub(crate) fn remembered(&self, id: &VehicleId) -> Option<(RememberedTarget, f64)> {
        let previous = self.previous_plan.as_ref()?;
        let then = previous.made_at()?;
        let target = |known: &PreviousTarget| (known.id == *id).then(|| known.whole()).flatten();
        let target = previous.targets.iter().flatten().find_map(target)?;
        let young = (0.0..=REMEMBERED_AGE_MAX).contains(&(self.t_s - then));
        young.then_some((target, then - target.estimate.age_s))
    }

    /// Where the AUV called `id` was, as the previous plan has it; none if nothing is inferred from tracks.
    pub(crate) fn remembered_track(&self, id: &VehicleId) -> Option<&[TrackPoint]> {
        let previous = self.previous_plan.as_ref();
        let mut targets = previous
            .and_then(|plan| plan.targets.as_deref())
            .into_iter()
            .flatten();
        let track = targets
            .find(|target| target.id == *id)
            .map(|target| target.track.as_slice());
        (self.forecast == Forecast::Auto).then_some(track.unwrap_or_default())
    }

    /// The AUV called `id`.
    #[must_use]
    pub fn auv(&self, id: &VehicleId) -> Option<&Auv> {
        self.auvs.iter().find(|auv| auv.id == *id)
    }
}
