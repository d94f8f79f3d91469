//! Everything that a client reports, unchecked.

use nalgebra::Vector2;

use crate::{
    craft::{
        description::CraftDescription,
        estimate::CraftEstimate,
        learn_by_ekf::{CraftObservation, PastReference},
    },
    facts::{
        angle::Course,
        asc::{AscState, Limits},
        auv::{Auv, VehicleId},
        bounds::KeepOut,
        goal::{Goal, Offset},
        options::{Fallback, ForecastChoice, HoldStyle},
        ranges::CURRENT_MAX,
        reference::{PreviousTarget, Reference, TrajectoryPoint},
    },
};

/// How long the current is averaged over, where it is not declared, s.
const CURRENT_MEMORY: f64 = 30.0;

/// Age of a previous plan up to which its current and the drift of its AUVs are remembered, s.
pub(crate) const REMEMBERED_AGE_MAX: f64 = 60.0;

/// What an earlier answer leaves to the next request: the planner itself remembers nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviousPlan {
    /// Its trajectory, in order of time.
    pub trajectory: Vec<TrajectoryPoint>,
    /// The course of what the goal follows, its offset apart, when that last moved; held while it stands still.
    pub goal_course: Option<Course>,
    /// Speed through the water and heading that it asked for.
    pub reference: Option<Reference>,
    /// The command that the craft got, whatever its loops hold.
    pub command: Option<Reference>,
    /// What the current (north, east) was taken for, m/s, where it was known.
    pub current: Option<Vector2<f64>>,
    /// What it knew of the craft.
    pub craft: Option<CraftEstimate>,
    /// What it knew of the AUVs.
    pub targets: Vec<PreviousTarget>,
}

/// Everything a client reports, unchecked. Becomes a [`Snapshot`](super::Snapshot) by its `try_from`.
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
    /// What the last fallback level does.
    pub hold: HoldStyle,
    /// The last answer, if there was one.
    pub previous_plan: Option<PreviousPlan>,
}

impl Observation {
    /// What must be stated; the rest may be changed afterwards. Nothing else is known or limited but a small craft's speeds
    /// ([`Limits::ANY`]), the craft answers as the generic one until it is learnt, forecasts are chosen for each AUV, and
    /// without a solved program the fallback levels answer, the last of which is a slow turn.
    #[must_use]
    pub fn new(time: f64, asc: AscState, auvs: Vec<Auv>, goal: Goal) -> Self {
        Self {
            time,
            asc,
            auvs,
            goal,
            offset: None,
            current: None,
            limits: Limits::ANY,
            craft: CraftDescription::default(),
            keep_outs: Vec::new(),
            area: Vec::new(),
            range_max: None,
            surfacing_separation: None,
            forecast: ForecastChoice::Auto,
            fallback: Fallback::Los,
            hold: HoldStyle::SlowTurn,
            previous_plan: None,
        }
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

    /// What the observation says of the craft.
    pub(crate) fn of_the_craft(&self) -> CraftObservation<'_> {
        let previous = || {
            let previous = self.previous_plan.as_ref()?;
            let (reference, command) = (previous.reference?, previous.command?);
            let asked = PastReference {
                heading: reference.heading.radians(),
                speed: reference.speed,
                command: Vector2::new(command.heading.radians(), command.speed),
                elapsed: self.time - previous.trajectory.first()?.time,
            };
            Some((previous.craft?, asked))
        };
        CraftObservation {
            asc: &self.asc,
            limits: &self.limits,
            declared_current: self.current,
            current: self.current(),
            previous: previous(),
        }
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
