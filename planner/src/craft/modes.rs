//! Modes of the loops: heading or course, speed through the water or over ground.

use nalgebra::Vector2;

use crate::craft::closed_loop::{HeadingReference, SpeedReference};
use crate::craft::estimate::{CraftEstimate, EVIDENCE_MAX};
use crate::craft::learn_by_ekf::{Step, behind};
use crate::craft::prior::Prior;
use crate::facts::angle::{angle_of, wrap};

/// Log-likelihood ratio at which a mode is assumed: odds of 55 to 1.
const EVIDENCE_ENOUGH: f64 = 4.0;

impl CraftEstimate {
    /// The loops' modes: declared, else by the evidence.
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

    /// Updates the evidence of undeclared modes by the distance of heading, course and both speeds
    /// from the command. In still water the modes are equivalent.
    pub(super) fn update_mode_evidence(&mut self, step: &Step<'_>) {
        let Step { asc, prior, craft, asked, tuned, .. } = *step;
        self.followed_command.x +=
            behind(craft.heading_lag(), asked.elapsed) * wrap(asked.command.x - self.followed_command.x);
        self.followed_command.x = wrap(self.followed_command.x);
        self.followed_command.y +=
            behind(craft.surge_lag(), asked.elapsed) * (asked.command.y - self.followed_command.y);
        let drifting = || {
            let current = step.observation.declared_current.or_else(|| self.current_from_positions())?;
            Some(asc.water_velocity() + current)
        };
        let ground = asc.ground_velocity().or_else(drifting);
        let Some(ground) = ground.filter(|ground| ground.norm() > tuned.speed_with_drift) else {
            return;
        };
        let heading = wrap(self.followed_command.x - asc.heading().radians());
        let course = wrap(self.followed_command.x - angle_of(&ground));
        let speed = self.followed_command.y - asc.speed_mps;
        let over_ground = self.followed_command.y - ground.dot(&asc.heading().unit());
        let before = self.modes(prior);
        let gain = Vector2::new(
            (heading * heading - course * course)
                / (2.0 * tuned.mode_heading_sigma * tuned.mode_heading_sigma),
            (speed * speed - over_ground * over_ground)
                / (2.0 * tuned.mode_speed_sigma * tuned.mode_speed_sigma),
        );
        // Errors last for several seconds: each counts in part.
        let gain = gain.map(|gain| gain.clamp(-1.0, 1.0) * tuned.mode_share * asked.elapsed);
        self.evidence = (self.evidence + gain).map(|evidence| evidence.clamp(-EVIDENCE_MAX, EVIDENCE_MAX));
        let after = self.modes(prior);
        if after.0 != before.0 {
            self.heading.z = 0.0;
            self.heading_covariance.m33 = tuned.offset_sigma * tuned.offset_sigma;
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
