//! The acoustic channel's numbers.

/// Time slots, sound propagation, measurement errors and losses.
///
/// Every σ is a standard deviation; 0 means without error.
#[derive(Clone, Debug, PartialEq)]
pub struct AcousticsSetup {
    /// Length of a frame, s; each underwater vehicle transmits once in it.
    pub frame: f64,
    /// Length of a message, s, at most the latency: a fix is complete after the last sound. Two
    /// messages that arrive at the same time destroy each other.
    pub slot_length: f64,
    /// Start of each vehicle's transmission, s after the frame's start, in the scenario's order.
    /// Frame and starts are rounded to whole inner-loop periods.
    pub slots: Vec<f64>,
    /// Speed of sound, m/s, the same at every depth: rays are straight.
    pub sound_speed: f64,
    /// Time from the first sound's arrival to the fix, s: reception, decoding, position solution.
    pub latency: f64,
    /// σ of a measured position along north and along east, m. Covers the whole chain of an
    /// ultra-short baseline: bearing, attitude, travel time and the surface craft's own position.
    pub position_sigma: f64,
    /// σ of a vehicle's telemetered depth, m.
    pub depth_sigma: f64,
    /// σ of a vehicle's telemetered course over ground, rad.
    pub course_sigma: f64,
    /// σ of a vehicle's telemetered horizontal speed over ground, m/s.
    pub speed_sigma: f64,
    /// Largest slant range of a message, m.
    pub range_max: f64,
    /// Probability that a message at zero range is lost.
    pub loss: f64,
    /// Probability that a message from `range_max` is lost, at least `loss`; linear in slant range
    /// between the two, of which a user can know the ends.
    pub loss_at_range_max: f64,
    /// Share of received messages with an outlier as position: a reflection, not the direct path.
    pub outlier_share: f64,
    /// σ of an outlier's position along north and along east, m.
    pub outlier_sigma: f64,
}
