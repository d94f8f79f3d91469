//! Modes of the loops: heading or course, speed through the water or over ground.

use nalgebra::Vector2;

use crate::{
    craft::{
        closed_loop::{HeadingReference, SpeedReference},
        estimate::{CraftEstimate, EVIDENCE_MAX},
        learn_by_ekf::{CraftObservation, OFFSET_SIGMA, PastReference, SPEED_WITH_DRIFT, behind},
        model::CraftModel,
        prior::Prior,
    },
    facts::angle::{angle_of, wrap},
};

/// Standard deviation of a heading or course from the reference of its loop, rad.
const MODE_HEADING_SIGMA: f64 = 0.25;
/// Standard deviation of a speed from the reference of its loop, m/s.
const MODE_SPEED_SIGMA: f64 = 0.08;
/// Weight of a log-likelihood: errors last for several seconds.
const MODE_SHARE: f64 = 0.2;
/// Log-likelihood ratio at which a mode is assumed: odds of 55 to 1.
const EVIDENCE_ENOUGH: f64 = 4.0;

impl CraftEstimate {
    /// The loops' modes: declared, else by the evidence.
    #[must_use]
    pub fn modes(&self, prior: &Prior) -> (HeadingReference, SpeedReference) {
        let heading = match prior.heading_held {
            Some(held) => held,
            None if EVIDENCE_ENOUGH < self.evidence.x => HeadingReference::Course,
            None => HeadingReference::Heading,
        };
        let speed = match prior.speed_held {
            Some(held) => held,
            None if EVIDENCE_ENOUGH < self.evidence.y => SpeedReference::OverGround,
            None => SpeedReference::ThroughWater,
        };
        (heading, speed)
    }

    /// Updates the evidence of undeclared modes: heading or course, and speed through the water or
    /// over ground along the bow, by the distance from the command. In still water they are
    /// indistinguishable and equivalent.
    pub(super) fn update_mode_evidence(
        &mut self,
        observation: &CraftObservation<'_>,
        prior: &Prior,
        craft: &CraftModel,
        asked: PastReference,
    ) {
        let asc = observation.asc;
        self.followed_command.x +=
            behind(craft.heading_lag(), asked.elapsed) * wrap(asked.command.x - self.followed_command.x);
        self.followed_command.x = wrap(self.followed_command.x);
        self.followed_command.y +=
            behind(craft.surge_lag(), asked.elapsed) * (asked.command.y - self.followed_command.y);
        let drifting = || {
            let current = observation
                .declared_current
                .or_else(|| self.current_from_positions())?;
            Some(asc.water_velocity() + current)
        };
        let ground = asc.ground_velocity().or_else(drifting);
        let Some(ground) = ground.filter(|ground| ground.norm() > SPEED_WITH_DRIFT) else {
            return;
        };
        let heading = wrap(self.followed_command.x - asc.heading().radians());
        let course = wrap(self.followed_command.x - angle_of(&ground));
        let speed = self.followed_command.y - asc.speed_mps;
        let over_ground = self.followed_command.y - ground.dot(&asc.heading().unit());
        let before = self.modes(prior);
        let gain = Vector2::new(
            (heading * heading - course * course) / (2.0 * MODE_HEADING_SIGMA * MODE_HEADING_SIGMA),
            (speed * speed - over_ground * over_ground) / (2.0 * MODE_SPEED_SIGMA * MODE_SPEED_SIGMA),
        );
        // Errors last for several seconds: each counts in part.
        let gain = gain.map(|gain| gain.clamp(-1.0, 1.0) * MODE_SHARE * asked.elapsed);
        self.evidence = (self.evidence + gain).map(|evidence| evidence.clamp(-EVIDENCE_MAX, EVIDENCE_MAX));
        let after = self.modes(prior);
        if after.0 != before.0 {
            self.heading.z = 0.0;
            self.heading_covariance.m33 = OFFSET_SIGMA * OFFSET_SIGMA;
            self.heading_covariance.m13 = 0.0;
            self.heading_covariance.m31 = 0.0;
            self.heading_covariance.m23 = 0.0;
            self.heading_covariance.m32 = 0.0;
            self.heading.y = prior.heading_lag.mean;
        }
        if after.1 != before.1 {
            self.surge.z = 0.0;
        }
    }
}
