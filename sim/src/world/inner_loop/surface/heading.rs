//! The heading loops of surface craft.

use planner::angle::{Heading, wrap};

use crate::world::hull::SurfaceHull;
use crate::world::inner_loop::{PERIOD, ROUNDING};

/// Heading errors within which an integral part integrates, rad: no large step winds it up.
const INTEGRAL_ZONE: f64 = 0.35;

/// A heading loop. Gains are per moment of inertia, so that a loop fits any hull.
///
/// `e = wrap(ψ_ref − ψ)`; d_r is the hull's linear yaw drag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeadingLoop {
    /// The hull's linear yaw drag counts as part of the damping.
    ///
    /// ```text
    /// τ_r = m_r ωn² e − (2 ζ ωn m_r − d_r) r
    /// ```
    ProportionalDerivative {
        /// Natural frequency ωn, rad/s.
        frequency: f64,
        /// Damping ratio ζ.
        damping: f64,
    },
    /// Proportional-derivative with an integral part.
    ///
    /// ```text
    /// τ_r = m_r ωn² (e + ∫e dt / T_i) − (2 ζ ωn m_r − d_r) r
    /// ```
    ProportionalIntegralDerivative {
        /// Natural frequency ωn, rad/s.
        frequency: f64,
        /// Damping ratio ζ.
        damping: f64,
        /// Integral time T_i, s.
        integral_time: f64,
    },
    /// A second-order reference model with a rate limit, followed by a loop with an integral part.
    ///
    /// ```text
    /// ṙ_d = ω² wrap(ψ_ref − ψ_d) − 2 ζ ω r_d,   ψ̇_d = r_d,   |r_d| ≤ r_max
    /// τ_r = m_r (ṙ_d + ωn² (e_d + ∫e_d dt / T_i) + 2 ωn (r_d − r)) + d_r r,   e_d = wrap(ψ_d − ψ)
    /// ```
    /// Source: T. I. Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2011),
    /// heading autopilots with reference models.
    ReferenceModel {
        /// Natural frequency of the model ω, rad/s.
        model_frequency: f64,
        /// Damping ratio of the model ζ.
        model_damping: f64,
        /// Fastest turn of the model r_max, rad/s.
        rate_max: f64,
        /// Natural frequency of the loop that follows it, critically damped ωn, rad/s.
        frequency: f64,
        /// Integral time T_i, s.
        integral_time: f64,
    },
    /// Heading error to a limited and slewed yaw-rate reference, and that to a moment.
    ///
    /// ```text
    /// r_ref → clamp(e / T, ±r_max), at most at ṙ_max
    /// τ_r = m_r (e_r + ∫e_r dt / T_i) / T_r + d_r r_ref
    /// ```
    Cascade {
        /// Time constant of the heading loop T, s.
        time_constant: f64,
        /// Fastest turn r_max, rad/s.
        rate_max: f64,
        /// Fastest change of the yaw-rate reference ṙ_max, rad/s².
        rate_slew: f64,
        /// Time constant of the yaw-rate loop T_r, s.
        rate_time_constant: f64,
        /// Integral time of the yaw-rate loop T_i, s.
        integral_time: f64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeadingMemory {
    /// Integral of the error, rad s; in a yaw-rate loop rad.
    integral: f64,
    /// Increment of the integral in this period, unless the thrusters saturate.
    pending: f64,
    /// Heading of the reference model ψ_d, rad.
    heading: f64,
    /// Yaw rate of the reference model r_d, or the yaw-rate reference, rad/s.
    rate: f64,
}

impl HeadingMemory {
    pub(super) fn settled_at(heading: f64) -> Self {
        Self { integral: 0.0, pending: 0.0, heading, rate: 0.0 }
    }

    /// Integrates, unless the thrusters withhold moment in the error's direction.
    pub(super) fn integrate(&mut self, wanted: f64, given: f64) {
        let withheld = wanted - given;
        if withheld.abs() < ROUNDING || withheld * self.pending <= 0.0 {
            self.integral += self.pending;
        }
    }
}

impl HeadingLoop {
    /// The loop with `factor` times the lag of a cascade's outer loop or of the reference model.
    pub(crate) fn slowed(mut self, factor: f64) -> Self {
        match &mut self {
            Self::ProportionalDerivative { frequency, .. }
            | Self::ProportionalIntegralDerivative { frequency, .. } => *frequency /= factor,
            Self::ReferenceModel { model_frequency, .. } => *model_frequency /= factor,
            Self::Cascade { time_constant, .. } => *time_constant *= factor,
        }
        self
    }

    /// The moment wanted, N m, at a held angle `psi`, rad, and a yaw rate `r`, rad/s.
    pub(super) fn moment(
        &self,
        hull: &SurfaceHull,
        memory: &mut HeadingMemory,
        psi: f64,
        r: f64,
        reference: Heading,
    ) -> f64 {
        let (m_r, d_r) = (hull.inertia_yaw, hull.drag_yaw.linear);
        let error = wrap(reference.radians() - psi);
        match *self {
            Self::ProportionalDerivative { frequency, damping } => {
                let damping = 2.0 * damping * frequency * m_r - d_r;
                m_r * frequency * frequency * error - damping * r
            }
            Self::ProportionalIntegralDerivative { frequency, damping, integral_time } => {
                memory.pending = integrand(error);
                let damping = 2.0 * damping * frequency * m_r - d_r;
                m_r * frequency * frequency * (error + memory.integral / integral_time) - damping * r
            }
            Self::ReferenceModel { model_frequency, model_damping, rate_max, frequency, integral_time } => {
                let omega = model_frequency;
                let ahead = wrap(reference.radians() - memory.heading);
                let rate = memory.rate
                    + PERIOD * (omega * omega * ahead - 2.0 * model_damping * omega * memory.rate);
                let rate = rate.clamp(-rate_max, rate_max);
                let acceleration = (rate - memory.rate) / PERIOD;
                memory.rate = rate;
                memory.heading = wrap(memory.heading + PERIOD * rate);
                let error = wrap(memory.heading - psi);
                memory.pending = integrand(error);
                let stiffness = frequency * frequency * (error + memory.integral / integral_time);
                m_r * (acceleration + stiffness + 2.0 * frequency * (rate - r)) + d_r * r
            }
            Self::Cascade { time_constant, rate_max, rate_slew, rate_time_constant, integral_time } => {
                let wanted = (error / time_constant).clamp(-rate_max, rate_max);
                let step = rate_slew * PERIOD;
                memory.rate = wanted.clamp(memory.rate - step, memory.rate + step);
                let error = memory.rate - r;
                memory.pending = error * PERIOD;
                m_r * (error + memory.integral / integral_time) / rate_time_constant + d_r * memory.rate
            }
        }
    }
}

/// Increment of an integral by an error in one period.
fn integrand(error: f64) -> f64 {
    if error.abs() < INTEGRAL_ZONE { error * PERIOD } else { 0.0 }
}
