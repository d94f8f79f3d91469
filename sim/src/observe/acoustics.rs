//! Acoustic messages: each vehicle transmits in its slot, sound takes time, some are lost.
//!
//! ```text
//! slot begins → travels range / c → first sound arrives → latency → fix
//!               range > range_max: does not arrive; two at once: both destroyed; by chance: lost
//! ```
//! The position in a fix is the vehicle's position at transmission as measured by the surface
//! craft. Depth, course, speed, rate of turn and direction of the dive are telemetry.

use nalgebra::{Matrix2, Vector2};
use planner::angle::Course;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::{disturbed, disturbed_vector, normal_pair};

mod setup;

pub use setup::AcousticsSetup;

/// Largest number of a vehicle's messages under way or not yet received. A valid setup has at most
/// 46 (a frame of 1 s, 20 km at 1400 m/s, a latency of 30 s).
const QUEUE_PER_VEHICLE: usize = 64;

/// Least range that a modem measures, m.
const RANGE_MIN: f64 = 0.1;

/// The state of an underwater vehicle at transmission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Telemetry {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Depth, m, positive down.
    pub depth: f64,
    /// Course over ground χ.
    pub course: Course,
    /// Horizontal speed over ground, m/s.
    pub speed: f64,
    /// Rate of turn of the course, rad/s, positive clockwise.
    pub turn_rate: f64,
    /// `true` while its nose is down.
    pub descending: bool,
    /// Error of its own position estimate, m, and the covariance that its filter states, m².
    pub own: Option<(Vector2<f64>, Matrix2<f64>)>,
}

/// A message that arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Index of the vehicle in the scenario's order.
    pub vehicle: usize,
    /// Time of transmission, to which its content refers, s.
    pub sent_at: f64,
    /// Time of the fix, s; less `sent_at` and the latency, the travel time of the slant range.
    pub heard_at: f64,
    /// State at `sent_at`: position, depth, course and speed as measured, the rest exact.
    pub telemetry: Telemetry,
    /// Slant range as measured, m, and the craft's position at transmission.
    pub range: f64,
    /// See `range`.
    pub from: Vector2<f64>,
    /// Assumed σ of the position along either axis, or of the range, m, without outliers.
    pub sigma: f64,
}

/// The acoustic channel between all underwater vehicles and the surface craft.
#[derive(Clone, Debug)]
pub struct Acoustics {
    setup: AcousticsSetup,
    rng: ChaCha8Rng,
    /// Length of a step, s.
    period: f64,
    frame_steps: u32,
    /// Step of the frame at which each vehicle transmits.
    slot_steps: Vec<u32>,
    /// `true` for vehicles that send only when they are called, and are not.
    uncalled: Vec<bool>,
    /// Messages under way, in the order of their fixes.
    pending: Vec<Message>,
}

#[derive(Clone, Copy, Debug)]
struct Message {
    fix: Fix,
    /// Arrival of its first sound, s.
    arrival: f64,
    /// `true` if it is lost by chance, or by another message at the same time.
    is_lost: bool,
}

/// The random numbers of one slot; every slot draws the same number.
struct SlotNoise {
    position: Vector2<f64>,
    depth: f64,
    course: f64,
    speed: f64,
    /// Uniform in [0, 1): an outlier below the share of outliers.
    outlier: f64,
    /// Uniform in [0, 1): lost below the probability of loss.
    loss: f64,
}

impl SlotNoise {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let (position, reported) = (normal_pair(rng), normal_pair(rng));
        Self {
            position,
            depth: reported.x,
            course: reported.y,
            speed: normal_pair(rng).x,
            outlier: rng.random(),
            loss: rng.random(),
        }
    }
}

impl Acoustics {
    /// A channel without messages. `period` is the length of a step, s, at most a frame.
    pub fn new(setup: &AcousticsSetup, period: f64, rng: ChaCha8Rng) -> Self {
        let frame_steps = whole_steps(setup.frame, period).max(1);
        let slot_steps = setup
            .slots
            .iter()
            // A slot that rounds to the frame's end is the next frame's beginning.
            .map(|start| whole_steps(*start, period) % frame_steps)
            .collect();
        Self {
            rng,
            period,
            frame_steps,
            slot_steps,
            uncalled: vec![false; setup.slots.len()],
            pending: Vec::with_capacity(QUEUE_PER_VEHICLE * setup.slots.len()),
            setup: setup.clone(),
        }
    }

    /// Largest slant range of a message, m.
    pub(crate) fn range_max(&self) -> f64 {
        self.setup.range_max
    }

    /// Lets each vehicle send in the slot of a frame of equal ones in which it is called, if it is.
    pub(crate) fn call(&mut self, slots: &[Option<usize>]) {
        let n = slots.len();
        for (vehicle, slot) in slots.iter().enumerate() {
            self.uncalled[vehicle] = slot.is_none();
            let start = slot.map(|slot| self.setup.frame * slot as f64 / n.max(1) as f64);
            let step = start.map(|start| whole_steps(start, self.period) % self.frame_steps);
            self.slot_steps[vehicle] = step.unwrap_or(self.slot_steps[vehicle]);
        }
    }

    /// Transmits the messages of the vehicles whose slot begins at `step`, at time `step · period`.
    /// Call it for each step in order; `all_telemetry` and `silent` are in the scenario's order.
    ///
    /// The slant range is that at transmission: before the sound arrives, two vehicles of 1.5 m/s
    /// change it by 0.2 % at most.
    ///
    /// Every slot draws the same random numbers, even if silent or out of range: two runs with one
    /// seed have the same noise, although their surface craft move differently.
    pub fn step(
        &mut self,
        step: u32,
        asc_position: &Vector2<f64>,
        all_telemetry: &[Telemetry],
        silent: &[bool],
    ) {
        debug_assert_eq!(all_telemetry.len(), self.slot_steps.len(), "one telemetry a slot");
        debug_assert_eq!(silent.len(), self.slot_steps.len(), "one flag a slot");
        let step_of_frame = step % self.frame_steps;
        let sent_at = f64::from(step) * self.period;
        for (vehicle, (telemetry, silent)) in all_telemetry.iter().zip(silent).enumerate() {
            if self.slot_steps[vehicle] == step_of_frame {
                let noise = SlotNoise::draw(&mut self.rng);
                if !silent && !self.uncalled[vehicle] {
                    let range = (telemetry.position - asc_position).norm().hypot(telemetry.depth);
                    let fix =
                        Fix { from: *asc_position, ..self.fix(vehicle, sent_at, range, telemetry, &noise) };
                    self.transmit(fix, range, &noise);
                }
            }
        }
    }

    /// Appends the fixes up to `now`, s, to `heard`, in the order of arrival.
    pub fn receive(&mut self, now: f64, heard: &mut Vec<Fix>) {
        let due = self.pending.partition_point(|message| message.fix.heard_at <= now);
        let received = self.pending.drain(..due).filter(|message| !message.is_lost);
        heard.extend(received.map(|message| message.fix));
    }

    /// The fix that the surface craft gets if it receives the message.
    fn fix(&self, vehicle: usize, sent_at: f64, range: f64, telemetry: &Telemetry, noise: &SlotNoise) -> Fix {
        let setup = &self.setup;
        let is_outlier = noise.outlier < setup.outlier_share;
        let spread = if is_outlier { setup.outlier_sigma } else { setup.position_sigma };
        let detour = if is_outlier { noise.position.y.abs() * setup.outlier_sigma } else { 0.0 };
        Fix {
            vehicle,
            sent_at,
            heard_at: sent_at + range / setup.sound_speed + setup.latency,
            telemetry: Telemetry {
                position: disturbed_vector(&telemetry.position, &(noise.position * spread)),
                depth: disturbed(telemetry.depth, setup.depth_sigma * noise.depth),
                course: Course::new(disturbed(telemetry.course.radians(), setup.course_sigma * noise.course)),
                speed: disturbed(telemetry.speed, setup.speed_sigma * noise.speed).max(0.0),
                ..*telemetry
            },
            range: disturbed(range + detour, setup.position_sigma * noise.position.x).max(RANGE_MIN),
            from: Vector2::zeros(),
            sigma: setup.position_sigma,
        }
    }

    /// Sends a message over `range` m, which may collide with those under way.
    fn transmit(&mut self, fix: Fix, range: f64, noise: &SlotNoise) {
        let setup = &self.setup;
        if range > setup.range_max {
            return;
        }
        let loss = setup.loss + (setup.loss_at_range_max - setup.loss) * (range / setup.range_max);
        let mut message =
            Message { fix, arrival: fix.sent_at + range / setup.sound_speed, is_lost: noise.loss < loss };
        // Every message that this one can collide with is still pending: it is received after its
        // last sound, hence after this transmission. A lost message is not decoded, but as loud.
        for other in &mut self.pending {
            if (other.arrival - message.arrival).abs() < setup.slot_length {
                (other.is_lost, message.is_lost) = (true, true);
            }
        }
        if self.pending.len() == QUEUE_PER_VEHICLE * self.slot_steps.len() {
            self.pending.remove(0);
        }
        let after = self.pending.partition_point(|other| other.fix.heard_at <= fix.heard_at);
        self.pending.insert(after, message);
    }
}

/// Number of steps nearest to `duration`: 10 s are 100 steps, although 0.1 is no binary fraction.
#[expect(clippy::cast_possible_truncation, reason = "a frame is an hour at most, and the cast saturates")]
fn whole_steps(duration: f64, period: f64) -> u32 {
    (duration / period).round() as u32
}

#[cfg(test)]
mod tests;
