//! The underwater vehicles' loops: speed, pitch and yaw rate to force and moments.

use super::{AntiWindup, SurgeGains, SurgeLoop};
use crate::world::hull::{PITCH_MAX, UnderwaterHull, UnderwaterInput, UnderwaterState};

/// References of an underwater vehicle from path follower and dive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderwaterReference {
    /// Speed along the body, through the water, m/s.
    pub surge: f64,
    /// Pitch θ, rad, positive nose-up; the loop clamps it to ±[`PITCH_MAX`].
    pub pitch: f64,
    /// Body yaw rate r, rad/s, positive to starboard. A heading rate ψ̇ requires r = ψ̇ cosθ.
    pub yaw_rate: f64,
}

/// Gains of an underwater vehicle's inner loops. The surge loop has no drag feed-forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderwaterLoops {
    /// Gains of the surge loop.
    pub surge: SurgeGains,
    /// Natural frequency of the pitch loop, rad/s.
    pub pitch_frequency: f64,
    /// Damping ratio of the pitch loop.
    pub pitch_damping: f64,
    /// Bandwidth of the yaw-rate loop, rad/s.
    pub yaw_rate_bandwidth: f64,
}

impl UnderwaterLoops {
    /// The MEDUSA-class AUV's.
    ///
    /// Surge as on the laboratory's surface craft. Pitch: a reversal from −50° to +50° takes 4 s
    /// (docs/rationale.md#sim-pitch-loop). Yaw rate: ten times the bandwidth of the path following
    /// above it, a third of what a loop of ten hertz allows.
    pub const MEDUSA: Self = Self {
        surge: SurgeGains { proportional: 26.0, integral: 3.0, error_max: 0.2, anti_windup: AntiWindup::On },
        pitch_frequency: 1.2,
        pitch_damping: 0.8,
        yaw_rate_bandwidth: 3.0,
    };

    /// The Slocum's: the MEDUSA's, scaled by mass in surge (55 to 50 kg), with a clamp of 0.05 m/s,
    /// because its buoyancy engine can spare 1.4 N. Pitch is as fast as a shifted battery allows;
    /// the yaw-rate loop is mostly at the rudder's limit.
    pub const SLOCUM: Self = Self {
        surge: SurgeGains { proportional: 28.6, integral: 3.3, error_max: 0.05, anti_windup: AntiWindup::On },
        pitch_frequency: 0.4,
        pitch_damping: 0.8,
        yaw_rate_bandwidth: 3.0,
    };

    /// Duration of a reversal, s: from passing the depth that ends a leg to passing it again.
    ///
    /// Inversely proportional to the pitch loop's frequency (docs/rationale.md#sim-dive-reversal).
    pub fn reversal_time(&self) -> f64 {
        const PHASE: f64 = 4.2;
        PHASE / self.pitch_frequency
    }

    /// One period: force and moments, within the actuators' limits.
    ///
    /// Pitch is proportional-derivative with compensated restoring moment; yaw rate is proportional
    /// with the reference's drag fed forward, so a steady turn has no error.
    pub fn command(
        &self,
        hull: &UnderwaterHull,
        surge: &mut SurgeLoop,
        state: &UnderwaterState,
        reference: &UnderwaterReference,
    ) -> UnderwaterInput {
        let (theta, u, q, r) = (state[3], state[5], state[6], state[7]);
        let frequency = self.pitch_frequency;
        let damping = 2.0 * self.pitch_damping * frequency * hull.inertia_pitch - hull.drag_pitch.linear;
        let pitch = reference.pitch.clamp(-PITCH_MAX, PITCH_MAX);
        let wanted = UnderwaterInput {
            surge_force: surge.force(&self.surge, reference.surge, u),
            pitch_moment: hull.inertia_pitch * frequency * frequency * (pitch - theta) - damping * q
                + hull.restoring_moment * theta.sin(),
            yaw_moment: hull.inertia_yaw * self.yaw_rate_bandwidth * (reference.yaw_rate - r)
                + hull.drag_yaw.resistance(reference.yaw_rate),
        };
        let given = hull.saturated(wanted);
        surge.integrate(&self.surge, reference.surge, u, wanted.surge_force, given.surge_force);
        given
    }
}
