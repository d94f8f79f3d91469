//! A checked observation with the estimates that follow from it.

use std::ops::Deref;

use nalgebra::Vector2;

use crate::{
    craft::{closed_loop::Craft, estimate::CraftEstimate, model::CraftModel, prior::Prior},
    estimate::from_reports::Estimate,
    facts::{
        angle::{Heading, wrap},
        asc::AscNow,
        auv::{Auv, VehicleId},
        bounds::clockwise,
        reference::Reference,
    },
    snapshot::{
        check::{InvalidObservation, faults},
        observation::{Observation, REMEMBERED_AGE_MAX},
    },
};

/// Part of the sway that the yaw rate makes in the one that a plan starts from.
const DRIFT_SHARE: f64 = 0.8;

impl From<&Snapshot> for AscNow {
    fn from(snapshot: &Snapshot) -> Self {
        Self {
            position: snapshot.asc.position,
            heading: snapshot.asc.heading,
            current: snapshot.current(),
        }
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
    /// The command with which the craft moves through the water as `reference` says.
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

    /// [`Snapshot::command`] behind a slew-rate limit: its heading moves from the command before no faster than the craft turns, or
    /// than `reference` itself has moved: what is learnt of the current meanwhile comes in at that rate.
    #[must_use]
    pub(crate) fn slew_limited_command(&self, reference: &Reference) -> Reference {
        let command = self.command(reference);
        let before = self.previous_plan.as_ref().and_then(|previous| {
            let elapsed = self.time - previous.trajectory.first()?.time;
            let young = (0.0..=REMEMBERED_AGE_MAX).contains(&elapsed);
            young.then_some((elapsed, previous.reference?.heading, previous.command?.heading))
        });
        let Some((elapsed, reference_before, command_before)) = before else {
            return command;
        };
        let between = |from: Heading, to: Heading| wrap(to.radians() - from.radians());
        let moved = between(reference_before, reference.heading).abs();
        let most = moved.max(self.craft.limits.turn_rate_max * elapsed);
        let step = between(command_before, command.heading);
        if step.abs() <= most {
            return command;
        }
        Reference {
            heading: Heading::new(command_before.radians() + step.clamp(-most, most)),
            ..command
        }
    }

    /// Velocity through the water (ahead, starboard) that a plan starts from, m/s: the filtered surge, and a sway between
    /// the measured one and what the yaw rate makes of it.
    ///
    /// Waves, a log's noise and the swing of the bow in them are over before a plan could answer them; what a plan made
    /// of them asks for is noise.
    #[must_use]
    pub fn velocity_now(&self, yaw_rate: f64) -> Vector2<f64> {
        let (surge, sway) = (self.craft_estimate.surge.x, self.asc.sway);
        let drift = -self.craft.sway_per_yaw_rate * surge * yaw_rate;
        Vector2::new(surge, sway + DRIFT_SHARE * (drift - sway))
    }

    /// What is declared of the surface craft, and how surely.
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
    pub(crate) fn auv_and_estimate(&self, id: &VehicleId) -> Option<(&Auv, &Estimate)> {
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

impl TryFrom<Observation> for Snapshot {
    type Error = InvalidObservation;

    fn try_from(observation: Observation) -> Result<Self, InvalidObservation> {
        let faults = faults(&observation);
        if !faults.is_empty() {
            return Err(InvalidObservation(faults));
        }
        let observation = Observation {
            area: clockwise(observation.area),
            ..observation
        };
        let current = observation.current();
        let estimate = |auv: &Auv| {
            let remembered = observation.remembered(&auv.id);
            Estimate::new(auv, observation.time, &current, remembered)
        };
        let estimates = observation.auvs.iter().map(estimate).collect();
        let craft_prior = Prior::from(&observation.craft);
        let craft_estimate = CraftEstimate::new(&observation.of_the_craft(), &craft_prior);
        let craft = CraftModel::learnt(&craft_prior, &craft_estimate, &observation.limits, &current);
        Ok(Self {
            observation,
            estimates,
            craft_prior,
            craft_estimate,
            craft,
        })
    }
}
