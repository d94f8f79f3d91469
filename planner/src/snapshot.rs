//! What is known now, checked once: everything behind [`Snapshot`] may rely on it.

use std::{collections::BTreeMap, fmt, ops::Deref, sync::Arc};

use nalgebra::Vector2;

use crate::{
    angle::{Course, Heading, ned_from_body, wrap},
    craft::{Craft, CraftDescription, CraftEstimate, CraftModel, Prior},
    estimate::Estimate,
    los::Reference,
    path::Path,
};

mod bounds;
mod check;
mod evidence;

pub use bounds::{
    ACOUSTIC_RANGE, AREA_CORNERS, KEEP_OUT_RADIUS, KEEP_OUTS_MAX, KeepOut, SURFACING_SEPARATION,
    bounds_faults,
};
pub use check::{
    AUVS_MAX, COORDINATE_MAX, CURRENT_MAX, ID_LENGTH_MAX, InvalidObservation, LEG_HEIGHT_MIN, OFFSET_MAX,
    REPORT_AGE_MAX, REPORT_AHEAD_MAX, REPORT_SIGMA_MIN, REPORTS_MAX, TIME_MAX, TRAJECTORY_POINTS_MAX,
};
pub use evidence::{AuvState, Evidence, GroundTrack, Report};

pub use crate::invalid_field::{InvalidField, InvalidReason};

/// How long the current is averaged over, where it is not told, s.
const CURRENT_MEMORY: f64 = 30.0;

/// Age of a previous plan up to which its current and the drift of its AUVs are remembered, s.
const REMEMBERED_AGE_MAX: f64 = 60.0;

/// The name a client gave to a vehicle; unique within a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VehicleId(pub String);

impl fmt::Display for VehicleId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// State of the surface craft.
#[derive(Clone, Debug, PartialEq)]
pub struct AscState {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Heading ψ.
    pub heading: Heading,
    /// Surge speed through the water, m/s, positive ahead.
    pub surge: f64,
    /// Sway speed through the water, m/s, positive to starboard.
    pub sway: f64,
    /// Yaw rate, rad/s, positive clockwise seen from above.
    pub yaw_rate: f64,
    /// Velocity over ground (north, east), m/s, where a GNSS receiver gives it.
    pub ground_velocity: Option<Vector2<f64>>,
}

impl AscState {
    /// Velocity through the water (north, east), m/s.
    #[must_use]
    pub fn water_velocity(&self) -> Vector2<f64> {
        ned_from_body(self.heading.radians()) * Vector2::new(self.surge, self.sway)
    }

    /// Current (north, east), m/s, that velocity over ground less velocity through the water leaves, be it possible
    /// or not.
    #[must_use]
    pub fn apparent_current(&self) -> Option<Vector2<f64>> {
        Some(self.ground_velocity? - self.water_velocity())
    }
}

/// An underwater vehicle as last heard of.
#[derive(Clone, Debug, PartialEq)]
pub struct Auv {
    /// Its name.
    pub id: VehicleId,
    /// What tells where it is.
    pub evidence: Evidence,
    /// The path that it follows, where that is known.
    pub path: Option<KnownPath>,
    /// The sawtooth in which it dives, where that is known.
    pub dive: Option<Dive>,
}

/// A path that an AUV is known to follow.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownPath {
    /// The path.
    pub path: Arc<Path>,
    /// Horizontal speed through the water `u_h`, m/s.
    #[doc(alias = "u_h")]
    pub horizontal_speed: f64,
}

/// A sawtooth in which an AUV is known to dive: down until deep enough, up until shallow enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dive {
    /// Depth at which a climb ends, m, positive down, never negative.
    pub depth_min: f64,
    /// Depth at which a dive ends, m, at least half a metre below `depth_min`.
    pub depth_max: f64,
    /// Pitch of both legs θ, rad, positive, from 0.05 to 1.4.
    #[doc(alias = "theta")]
    pub pitch: f64,
    /// Time that a reversal takes, s: from passing the depth that ends a leg until passing it again.
    pub reversal: f64,
    /// Whether its nose was down and it got deeper at the time of the report, where that is known.
    pub descending: Option<bool>,
}

impl Dive {
    /// Time that a MEDUSA-class vehicle takes to reverse from 50° down to 50° up, or back, s.
    ///
    /// Source: the simulated pitch loop. From 23 m on it takes 3.4 s to be back, from 1 m on 3.5 s, and a cycle
    /// lasts 198.6 s, of which the legs, 22 m each at 0.3 m/s along the body, are 191.5 s.
    pub const REVERSAL_MEDUSA: f64 = 3.6;
}

/// What the surface craft is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Stay above one AUV.
    Track {
        /// Whom to follow.
        auv: VehicleId,
    },
    /// Follow each AUV in turn for a dwell time: the k-th from `epoch + k·dwell` on, half-open.
    Intermittent {
        /// Whom to follow, in order.
        auvs: Vec<VehicleId>,
        /// Time spent with each, s.
        dwell: f64,
        /// When the first dwell of the first AUV began, s on the snapshot's clock.
        epoch: f64,
    },
    /// Stay above the mean of several AUVs.
    Midpoint {
        /// Whose mean to follow.
        auvs: Vec<VehicleId>,
    },
    /// Stay above the weighted mean of several AUVs.
    Weighted {
        /// Whose mean to follow, and how much each counts, relative to the others; 0 is not at all.
        weights: BTreeMap<VehicleId, f64>,
    },
    /// Stay within a slant range of every one of several AUVs, and where the worst range is least.
    Range {
        /// Whom to stay near.
        auvs: Vec<VehicleId>,
        /// The slant range to stay within, m.
        radius: f64,
    },
}

impl Goal {
    /// The AUVs that the goal depends on, in its order.
    pub fn vehicles(&self) -> impl Iterator<Item = &VehicleId> {
        let (listed, weighted) = match self {
            Self::Track { auv } => (std::slice::from_ref(auv), None),
            Self::Intermittent { auvs, .. } | Self::Midpoint { auvs } | Self::Range { auvs, .. } => {
                (auvs.as_slice(), None)
            }
            Self::Weighted { weights } => ([].as_slice(), Some(weights)),
        };
        let heavy = |(id, weight): (_, &f64)| (0.0 < *weight).then_some(id);
        listed
            .iter()
            .chain(weighted.into_iter().flatten().filter_map(heavy))
    }
}

/// Where the surface craft is to be, seen from what its goal follows: the AUV or, of several, their mean or the
/// place nearest to all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Offset {
    /// Fixed directions: (north, east), m.
    Ned(Vector2<f64>),
    /// Along the course over ground of what is followed, held while that rests: (ahead, starboard), m.
    Target(Vector2<f64>),
    /// Along the tangent of the path where the AUV is that is followed: (ahead, starboard), m.
    Path(Vector2<f64>),
}

/// What the operator allows the surface craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Slowest speed reference through the water, m/s: below it the craft does not steer.
    pub speed_min: f64,
    /// Fastest speed reference through the water, m/s.
    pub speed_max: f64,
    /// Largest yaw rate, rad/s.
    pub turn_rate_max: f64,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max: f64,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max: f64,
}

impl Limits {
    /// No limit but a small craft's speeds: it may turn and gather way as it can.
    pub const ANY: Self = Self {
        speed_min: 0.05,
        speed_max: 1.5,
        turn_rate_max: 3.0,
        acceleration_max: 5.0,
        deceleration_max: 5.0,
    };

    /// What the simulated MEDUSA-class craft is allowed: all that its hull does.
    pub const MEDUSA: Self = Self {
        speed_min: 0.05,
        speed_max: 1.5,
        turn_rate_max: 0.3,
        acceleration_max: 0.09,
        deceleration_max: 0.09,
    };
}

/// How an AUV's future is guessed from its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ForecastModel {
    /// It stays where it is.
    Hold,
    /// It keeps its ground velocity, and its drift.
    ConstantVelocity,
    /// It keeps its speed and its rate of turn, and its drift.
    ConstantTurn,
    /// It follows its path, at its speed through the water, with the offset that it has, which its drift changes for
    /// half a minute.
    Path,
}

impl ForecastModel {
    /// Its name wherever it leaves the program.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::ConstantVelocity => "constant_velocity",
            Self::ConstantTurn => "constant_turn",
            Self::Path => "path",
        }
    }
}

/// Which forecast the client asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForecastChoice {
    /// The planner chooses for each AUV: [`ForecastModel::Hold`] for one at rest; else along its path, where that
    /// is known and no more than 15 m away; else as its rate of turn says.
    Auto,
    /// The same model for every AUV; [`ForecastModel::Path`] for those whose path is known, while the planner
    /// chooses for the others.
    Model(ForecastModel),
}

/// What to do when no program was solved, and for a goal that rests on a report too old to be forecast. Where one was
/// solved, whichever rung is predicted to do best answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fallback {
    /// The better of the previous plan followed further and line of sight answers; hold, where the report is too old.
    Ladder,
    /// Nothing but a solved program will do.
    None,
}

/// What the last rung of the ladder does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoldStyle {
    /// Circle slowly to starboard at the least speed that steers.
    SlowTurn,
    /// Stop the thrusters: speed reference 0 on the present heading.
    Stop,
}

/// One point of a planned trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// Time on the snapshot's clock, s.
    pub time: f64,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Heading ψ.
    pub heading: Heading,
}

/// What an earlier answer leaves to the next request: the planner itself remembers nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviousPlan {
    /// Its trajectory, in order of time.
    pub trajectory: Vec<TrajectoryPoint>,
    /// The course of what the goal follows, its offset apart, when that last moved; held while it stands still.
    pub goal_course: Option<Course>,
    /// Speed through the water and heading that it asked for.
    pub reference: Option<Reference>,
    /// The same as the craft was told, whatever its loops hold.
    pub told: Option<Reference>,
    /// What the current (north, east) was taken for, m/s, where anything told it.
    pub current: Option<Vector2<f64>>,
    /// What it knew of the craft.
    pub craft: Option<CraftEstimate>,
    /// What it knew of the AUVs.
    pub targets: Vec<PreviousTarget>,
}

/// What an earlier answer knew of an AUV, and how it had found it to drift.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviousTarget {
    /// The AUV.
    pub id: VehicleId,
    /// The model that it was forecast by.
    pub model: ForecastModel,
    /// Age of the report then, s.
    pub report_age: f64,
    /// Position (north, east) at the report, m.
    pub position: Vector2<f64>,
    /// Depth at the report, m, positive down.
    pub depth: f64,
    /// Velocity over ground (north, east) at the report, as it was told, m/s.
    pub velocity: Vector2<f64>,
    /// Rate of turn of the course at the report, rad/s, positive clockwise.
    pub turn_rate: f64,
    /// Velocity over ground (north, east) beyond what the model and the report explained, m/s, within 0.5 m/s along
    /// either axis; what is faster counts as that fast.
    pub drift: Vector2<f64>,
}

/// Everything a client reports, unchecked. Becomes a [`Snapshot`] by [`Snapshot::try_from`].
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Now, s, on any clock that all times in the observation share.
    pub time: f64,
    /// The surface craft.
    pub asc: AscState,
    /// The underwater vehicles, in any order.
    pub auvs: Vec<Auv>,
    /// What to do.
    pub goal: Goal,
    /// How far from what the goal follows; none is right above it.
    pub offset: Option<Offset>,
    /// Current at the surface (north, east), m/s, where known.
    pub current: Option<Vector2<f64>>,
    /// What the surface craft is allowed.
    pub limits: Limits,
    /// What is said of how the surface craft answers its references.
    pub craft: CraftDescription,
    /// Discs to keep out of.
    pub keep_outs: Vec<KeepOut>,
    /// Corners (north, east) of the convex area to stay in, m, in order either way round; empty for no limit. A
    /// snapshot's go clockwise seen from above, the first of them as given.
    pub area: Vec<Vector2<f64>>,
    /// Slant range to every AUV to keep within, m.
    pub range_max: Option<f64>,
    /// Distance to keep from every AUV that may be at the surface, m.
    pub surfacing_separation: Option<f64>,
    /// How to guess the AUVs' future.
    pub forecast: ForecastChoice,
    /// What to do without a solved program.
    pub fallback: Fallback,
    /// What the last rung does.
    pub hold: HoldStyle,
    /// The last answer, if there was one.
    pub previous_plan: Option<PreviousPlan>,
}

impl Observation {
    /// Current (north, east), m/s, zero where nothing tells it.
    #[must_use]
    pub fn current(&self) -> Vector2<f64> {
        self.known_current().unwrap_or_else(Vector2::zeros)
    }

    /// Current (north, east), m/s: the one given; else what ground velocity less velocity through the water tell,
    /// smoothed with what the previous plan took it for; without a ground velocity, what positions and speed through the
    /// water told until then, else what the previous plan took it for.
    #[must_use]
    pub fn known_current(&self) -> Option<Vector2<f64>> {
        let previous = self.previous_plan.as_ref();
        let unmeasured = self.current.is_none() && self.asc.ground_velocity.is_none();
        let then = previous.and_then(|previous| Some(previous.trajectory.first()?.time));
        let learnt = || {
            let age = self.time - then?;
            let young = (0.0..=REMEMBERED_AGE_MAX).contains(&age);
            previous?.craft.filter(|_| young)?.current_from_positions()
        };
        let remembered = || Some((then?, previous?.current?));
        let positions = if unmeasured { learnt() } else { None };
        positions
            .or_else(|| self.current_after(remembered()))
            .or_else(learnt)
    }

    /// [`Observation::known_current`], the memory being a time on the snapshot's clock, s, and the current then.
    ///
    /// ```text
    /// c = c⁻ + (1 − exp(−Δ/τ)) (v_ground − v_water − c⁻)
    /// ```
    /// Without the memory, noise of the sensors steers the craft.
    ///
    /// Velocities that leave more than [`CURRENT_MAX`] along an axis contradict each other and tell nothing: a speed
    /// log that has not locked on yet, or a compass that has not settled, must cost the craft neither its plan nor,
    /// clamped and remembered, a minute's worth of wrong ones.
    #[must_use]
    pub fn current_after(&self, memory: Option<(f64, Vector2<f64>)>) -> Option<Vector2<f64>> {
        let measured = || {
            let apparent = self.asc.apparent_current();
            apparent.filter(|current| current.amax() <= CURRENT_MAX)
        };
        let remembered = memory
            .map(|(then, current)| (self.time - then, current))
            .filter(|(elapsed, _)| (0.0..=REMEMBERED_AGE_MAX).contains(elapsed));
        self.current.or_else(|| match (measured(), remembered) {
            (Some(measured), Some((elapsed, before))) => {
                let share = 1.0 - (-elapsed / CURRENT_MEMORY).exp();
                Some(before + (measured - before) * share)
            }
            (measured, remembered) => measured.or(remembered.map(|(_, current)| current)),
        })
    }

    /// What the previous plan knew of the AUV called `id`, and the time of the report that it knew it from, s on the
    /// snapshot's clock.
    pub(crate) fn remembered(&self, id: &VehicleId) -> Option<(&PreviousTarget, f64)> {
        let previous = self.previous_plan.as_ref()?;
        let then = previous.trajectory.first()?.time;
        let target = previous.targets.iter().find(|target| target.id == *id)?;
        let young = (0.0..=REMEMBERED_AGE_MAX).contains(&(self.time - then));
        young.then_some((target, then - target.report_age))
    }

    /// The AUV called `id`.
    #[must_use]
    pub fn auv(&self, id: &VehicleId) -> Option<&Auv> {
        self.auvs.iter().find(|auv| auv.id == *id)
    }
}

/// An [`Observation`] whose every number is finite and inside its range, whose names are unique,
/// and whose goal names vehicles that are there; with the estimates that it leads to.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    observation: Observation,
    /// In the order of the observation's AUVs.
    estimates: Vec<Estimate>,
    craft_prior: Prior,
    craft_estimate: CraftEstimate,
    craft: CraftModel,
}

impl Snapshot {
    /// What the craft's loops are to be told so that it moves through the water as `reference` says.
    #[must_use]
    pub fn command(&self, reference: &Reference) -> Reference {
        let (heading_held, speed_held) = self.craft_estimate.modes(&self.craft_prior);
        let craft = Craft {
            speed_held,
            heading_held,
            ..self.craft_prior.craft
        };
        craft.command(reference, &self.current())
    }

    /// [`Snapshot::command`], whose heading moves from what the craft was told before no faster than the craft turns, or
    /// than `reference` itself has moved: what is learnt of the current meanwhile comes in at that rate.
    #[must_use]
    pub fn calm_command(&self, reference: &Reference) -> Reference {
        let command = self.command(reference);
        let before = self.previous_plan.as_ref().and_then(|previous| {
            let elapsed = self.time - previous.trajectory.first()?.time;
            let young = (0.0..=REMEMBERED_AGE_MAX).contains(&elapsed);
            young.then_some((elapsed, previous.reference?.heading, previous.told?.heading))
        });
        let Some((elapsed, reference_before, told)) = before else {
            return command;
        };
        let between = |from: Heading, to: Heading| wrap(to.radians() - from.radians());
        let moved = between(reference_before, reference.heading).abs();
        let most = moved.max(self.craft.limits.turn_rate_max * elapsed);
        let step = between(told, command.heading);
        if step.abs() <= most {
            return command;
        }
        Reference {
            heading: Heading::new(told.radians() + step.clamp(-most, most)),
            ..command
        }
    }

    /// What was told of the surface craft.
    #[must_use]
    pub fn craft_prior(&self) -> &Prior {
        &self.craft_prior
    }

    /// What is known of the surface craft by how it answered.
    #[must_use]
    pub fn craft_estimate(&self) -> &CraftEstimate {
        &self.craft_estimate
    }

    /// What the surface craft is taken for.
    #[must_use]
    pub fn craft_model(&self) -> &CraftModel {
        &self.craft
    }

    /// Where every AUV is taken to be, in the observation's order.
    #[must_use]
    pub fn estimates(&self) -> &[Estimate] {
        &self.estimates
    }

    /// The AUV called `id`, and where it is taken to be.
    #[must_use]
    pub fn auv_and_estimate(&self, id: &VehicleId) -> Option<(&Auv, &Estimate)> {
        self.auvs
            .iter()
            .zip(&self.estimates)
            .find(|(auv, _)| auv.id == *id)
    }
}

impl Deref for Snapshot {
    type Target = Observation;

    fn deref(&self) -> &Observation {
        &self.observation
    }
}
