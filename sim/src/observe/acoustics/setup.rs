//! The acoustic channel's numbers.

use super::super::setup::{InvalidSetup, within};

/// Time slots, sound propagation, measurement errors and losses.
///
/// Every σ is a standard deviation; 0 means without error.
#[derive(Clone, Debug, PartialEq)]
pub struct AcousticsSetup {
    /// Length of a frame, s: each underwater vehicle transmits once in it.
    pub frame: f64,
    /// How long a message sounds, s. Two that sound at the surface craft at the same time destroy each
    /// other. Not longer than the latency: nothing is known before its last sound has arrived.
    pub slot_length: f64,
    /// When each vehicle begins to transmit, s after the frame's start, in the scenario's order. Rounded to
    /// whole inner-loop periods, as is the frame.
    pub slots: Vec<f64>,
    /// Speed of sound, m/s, the same at every depth: rays are straight.
    pub sound_speed: f64,
    /// From the first sound's arrival to the fix being known, s: reception, decoding, position solution.
    pub latency: f64,
    /// σ of a measured position along north and along east, m. Stands for the whole chain of an ultra-short
    /// baseline: bearing, attitude, travel time and the surface craft's own position.
    pub position_sigma: f64,
    /// σ of a vehicle's telemetered depth, m.
    pub depth_sigma: f64,
    /// σ of a vehicle's telemetered course over ground, rad.
    pub course_sigma: f64,
    /// σ of a vehicle's telemetered horizontal speed over ground, m/s.
    pub speed_sigma: f64,
    /// Slant range beyond which nothing is heard, m.
    pub range_max: f64,
    /// Probability that a message from no distance is lost.
    pub loss: f64,
    /// Probability that a message from `range_max` is lost, not less than `loss`. Linear in slant range
    /// between the two: how losses grow is a matter of the site (noise, reflections, layers), and two ends
    /// are what a user can know of a site.
    pub loss_at_range_max: f64,
    /// Share of the messages heard whose position is an outlier: a reflection taken for the direct path.
    pub outlier_share: f64,
    /// σ of an outlier's position along north and along east, m.
    pub outlier_sigma: f64,
}

impl AcousticsSetup {
    /// An ordinary modem with position fixing for `vehicles` vehicles, their slots evenly over the frame.
    #[must_use]
    pub fn for_vehicles(vehicles: usize) -> Self {
        let frame = 10.0;
        #[expect(clippy::cast_precision_loss, reason = "a handful of vehicles")]
        let slots = (0..vehicles)
            .map(|i| frame * i as f64 / vehicles as f64)
            .collect();
        Self {
            // A fix of each vehicle about every 10 s is what cooperative navigation at sea works with.
            frame,
            // Assumption: tens of bytes at some hundred bit/s. Sixteen vehicles still have 0.125 s between
            // two messages, the travel time of 187 m.
            slot_length: 0.5,
            slots,
            // Sea water of 10–15 °C near the surface, to 1 %.
            sound_speed: 1500.0,
            // Assumption: the message itself, the position solution, and two computers.
            latency: 2.0,
            // Assumption: 1° of bearing and attitude at 60 m, and a metre of the craft's own position.
            position_sigma: 1.5,
            // Assumption: a pressure gauge, waves above it, and quantised telemetry.
            depth_sigma: 0.1,
            // Assumption: 3°, a micro-mechanical compass under water and the vehicle's own guess of the drift.
            course_sigma: 0.05,
            // Assumption: Doppler log or thruster model, quantised.
            speed_sigma: 0.02,
            // Assumption: shallow water; data sheets promise a few kilometres.
            range_max: 1000.0,
            // Assumption, as is the next: a good channel close by, every second message far away.
            loss: 0.05,
            loss_at_range_max: 0.5,
            // Assumption, as is the next: few, and far outside 1.5 m.
            outlier_share: 0.02,
            outlier_sigma: 20.0,
        }
    }

    /// Whether every number is in its range, and there is one slot for each of `vehicles` vehicles.
    ///
    /// The ranges also keep every fix inside the range of a snapshot (no error exceeds 8.6 σ), and every
    /// message in the water or in a computer for fewer frames than the queue holds.
    pub fn check(&self, vehicles: usize) -> Result<(), InvalidSetup> {
        within("acoustics/frame_s", self.frame, 1.0..=3600.0)?;
        within("acoustics/sound_speed_mps", self.sound_speed, 1400.0..=1600.0)?;
        // A thousandth of a second and of a metre: positive, and not so small that quotients overflow.
        within("acoustics/latency_s", self.latency, 0.001..=30.0)?;
        let longest = self.latency.min(self.frame);
        within("acoustics/slot_length_s", self.slot_length, 0.001..=longest)?;
        within("acoustics/range_max_m", self.range_max, 0.001..=20_000.0)?;
        within("acoustics/position_sigma_m", self.position_sigma, 0.0..=1000.0)?;
        within("acoustics/depth_sigma_m", self.depth_sigma, 0.0..=1.0)?;
        within("acoustics/course_sigma_rad", self.course_sigma, 0.0..=1.0)?;
        within("acoustics/speed_sigma_mps", self.speed_sigma, 0.0..=0.5)?;
        within("acoustics/loss", self.loss, 0.0..=1.0)?;
        within(
            "acoustics/loss_at_range_max",
            self.loss_at_range_max,
            self.loss..=1.0,
        )?;
        within("acoustics/outlier_share", self.outlier_share, 0.0..=1.0)?;
        within("acoustics/outlier_sigma_m", self.outlier_sigma, 0.0..=10_000.0)?;
        if self.slots.len() != vehicles {
            return Err(InvalidSetup::SlotCount {
                field: "acoustics/slots_s",
                given: self.slots.len(),
                vehicles,
            });
        }
        self.slots
            .iter()
            .enumerate()
            .try_for_each(|(i, start)| within(&format!("acoustics/slots_s/{i}"), *start, 0.0..=self.frame))
    }
}
