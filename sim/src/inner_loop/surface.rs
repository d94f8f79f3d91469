//! The surface craft's loops: speed and heading to thrust.

use planner::{angle::wrap, los::Reference};

use super::{DragFeedForward, SurgeGains, SurgeLoop};
use crate::surface_craft::{SurfaceHull, SurfaceInput, SurfaceState, Thrust};

/// Gains of a surface craft's inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAutopilot {
    /// Of the surge loop.
    pub surge: SurgeGains,
    /// Natural frequency of the yaw loop ωn, rad/s.
    pub yaw_frequency: f64,
    /// Damping ratio of the yaw loop ζ.
    pub yaw_damping: f64,
    /// Mode of the surge loop.
    pub feed_forward: DragFeedForward,
}

impl SurfaceAutopilot {
    /// The MEDUSA class's, without drag feed-forward. Source: the laboratory's vehicles (IST Lisbon).
    pub const MEDUSA: Self = Self {
        surge: SurgeGains {
            proportional: 26.0,
            integral: 3.0,
            error_max: 0.2,
        },
        yaw_frequency: 1.6,
        yaw_damping: 0.8,
        feed_forward: DragFeedForward::Off,
    };

    /// The Otter's: the MEDUSA's, scaled.
    ///
    /// Surge gains grow with m_u (85.5 to 50 kg), which keeps k_p/m_u = 0.52 rad/s and k_i/k_p; the error's
    /// clamp doubles as does the top speed, so that 18 of 239 N are left to acceleration where the
    /// MEDUSA has 5 of 72. The yaw loop gives moments as the inertia, so ωn and ζ carry over: the moment
    /// saturates from 40° of error on (74 of 106 N m/rad), the MEDUSA's from 52° on.
    pub const OTTER: Self = Self {
        surge: SurgeGains {
            proportional: 44.5,
            integral: 5.1,
            error_max: 0.4,
        },
        ..Self::MEDUSA
    };

    /// One period: the commands to the thrusters, within their limits.
    ///
    /// Yaw is proportional-derivative on the heading error, the hull's linear yaw drag counted as part
    /// of the damping.
    ///
    /// ```text
    /// τ_u = k_p ε + k_i ∫ε dt (+ D_u(u))      τ_r = m_r ωn² wrap(ψ_ref − ψ) − (2 ζ ωn m_r − d_r) r
    /// ```
    #[must_use]
    pub fn command(
        &self,
        hull: &SurfaceHull,
        surge: &mut SurgeLoop,
        state: &SurfaceState,
        reference: &Reference,
    ) -> Thrust {
        let (psi, u, r) = (state[2], state[3], state[5]);
        let frequency = self.yaw_frequency;
        let damping = 2.0 * self.yaw_damping * frequency * hull.inertia_yaw - hull.drag_yaw.linear;
        let wanted = SurfaceInput {
            surge_force: surge.force(&self.surge, reference.speed, u)
                + self.feed_forward.force(u, &hull.drag_surge),
            yaw_moment: hull.inertia_yaw * frequency * frequency * wrap(reference.heading.radians() - psi)
                - damping * r,
        };
        let command = hull.thrusters.allocate(wanted);
        let given = hull.thrusters.force(command).surge_force;
        surge.integrate(&self.surge, reference.speed, u, wanted.surge_force, given);
        command
    }
}

#[cfg(test)]
mod tests {
    use planner::angle::Heading;

    use super::*;

    #[test]
    fn a_moment_that_leaves_thrust_enough_never_stops_the_surge_loop() {
        // The moment is split over both thrusters and the force added up again: what rounding leaves of it
        // is no saturation.
        let (autopilot, hull) = (SurfaceAutopilot::MEDUSA, SurfaceHull::MEDUSA);
        for k in 0..1000 {
            let mut state = SurfaceState::zeros();
            state[3] = 0.3;
            state[5] = 0.0007 * f64::from(k);
            let reference = Reference {
                speed: 0.3 + 0.0001 * f64::from(k % 7 - 3),
                heading: Heading::new(0.001 * f64::from(k % 100)),
            };
            let settled = SurgeLoop::settled_at(0.3, autopilot.feed_forward, hull.drag_surge);
            let mut surge = settled;
            let _ = autopilot.command(&hull, &mut surge, &state, &reference);
            assert!(reference.speed == 0.3 || surge != settled, "period {k}");
        }
    }
}
