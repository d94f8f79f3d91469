//! The vehicles' inner loops: from references to forces and moments, ten times a second.

use crate::world::hull::Drag;

mod surface;
mod underwater;

pub use surface::{AutopilotMemory, DELAY_PERIODS_MAX, HeadingLoop, SpeedSlew, SurfaceAutopilot};
pub use underwater::{UnderwaterLoops, UnderwaterReference};

/// Period of every inner loop, s. Also the integration step: inputs are held for exactly one step.
pub const PERIOD: f64 = 0.1;

/// Addition of the drag at the measured speed to the surge loop's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DragFeedForward {
    /// PI control alone, as on the laboratory's vehicles: large steps need the integral part.
    Off,
    /// Drag is compensated at once; the loop controls a free mass.
    On,
}

impl DragFeedForward {
    /// The added force at a measured `speed`, m/s: N.
    fn force(self, speed: f64, drag: &Drag) -> f64 {
        match self {
            Self::Off => 0.0,
            Self::On => drag.resistance(speed),
        }
    }
}

/// Largest difference between wanted and given force that counts as rounding, N: sums of two
/// thrusts up to 200 N are exact to fourteen digits.
const ROUNDING: f64 = 1e-9;

/// Gains of a surge loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurgeGains {
    /// Proportional gain k_p, N/(m/s).
    pub proportional: f64,
    /// Integral gain k_i, N/m; 0 in a proportional loop.
    pub integral: f64,
    /// Largest speed error that the loop acts on ε_max, m/s.
    pub error_max: f64,
    /// Behaviour of its integral part while the actuators saturate.
    pub anti_windup: AntiWindup,
}

/// Behaviour of an integral part while the actuators saturate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AntiWindup {
    /// It continues to integrate, and winds up.
    Off,
    /// It stops.
    On,
}

impl SurgeGains {
    fn error(&self, reference: f64, measured: f64) -> f64 {
        (reference - measured).clamp(-self.error_max, self.error_max)
    }
}

/// A surge loop's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurgeLoop {
    /// Integral part, N.
    integral: f64,
}

impl SurgeLoop {
    /// A loop in steady state at `speed`, m/s, on a hull with this drag.
    pub fn settled_at(speed: f64, feed_forward: DragFeedForward, hull_drag: Drag) -> Self {
        let integral = match feed_forward {
            DragFeedForward::Off => hull_drag.resistance(speed),
            DragFeedForward::On => 0.0,
        };
        Self { integral }
    }

    /// Force wanted, N, for a speed reference and a measured speed, m/s, before drag feed-forward.
    ///
    /// ```text
    /// ε = clamp(u_ref − u, ±ε_max)      τ_u = k_p ε + k_i ∫ε dt
    /// ```
    fn force(self, gains: &SurgeGains, reference: f64, measured: f64) -> f64 {
        gains.proportional * gains.error(reference, measured) + self.integral
    }

    /// Integrates the error, unless the actuators withhold force in its direction (anti-windup).
    ///
    /// `given` is the force after saturation, by a limit of thrust or a moment's priority. A dead
    /// zone is no saturation: integrating leads out of it, and the integral stays below its width.
    fn integrate(&mut self, gains: &SurgeGains, reference: f64, measured: f64, wanted: f64, given: f64) {
        let error = gains.error(reference, measured);
        let withheld = wanted - given;
        let free = withheld.abs() < ROUNDING || withheld * error <= 0.0;
        if free || gains.anti_windup == AntiWindup::Off {
            self.integral += gains.integral * error * PERIOD;
        }
    }
}
