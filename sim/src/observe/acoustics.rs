//! What the surface craft hears of the underwater vehicles: each speaks in its slot, sound takes its time,
//! and some of it never arrives.
//!
//! ```text
//! slot begins → travels range / c → first sound arrives → latency → known
//!               range > range_max: never heard; two at once: both destroyed; chance: lost
//! ```
//! The position in a fix is where the vehicle was when it spoke, as the surface craft measured it; depth,
//! course, speed, rate of turn and which way it dives are what the vehicle says of itself.

use nalgebra::Vector2;
use planner::angle::Course;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::{disturbed, disturbed_vector, normal_pair};

mod setup;

pub use setup::AcousticsSetup;

/// Most messages of a vehicle that are on their way or not yet collected. No valid setup has more than 46
/// in the water and in the computer (a frame of 1 s, 20 km at 1400 m/s, a latency of 30 s).
const QUEUE_PER_VEHICLE: usize = 64;

/// An underwater vehicle as it is when it may speak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
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
    /// Whether its nose is down.
    pub descending: bool,
}

/// A message that arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Whose it is, in the scenario's order.
    pub vehicle: usize,
    /// When it was sent and what it says was so, s.
    pub sent_at: f64,
    /// When it became known, s. Less `sent_at` and the latency: the travel time, and so the slant range.
    pub heard_at: f64,
    /// Measured position (north, east) at `sent_at`, m.
    pub position: Vector2<f64>,
    /// Telemetered depth, m, positive down.
    pub depth: f64,
    /// Telemetered course over ground χ.
    pub course: Course,
    /// Telemetered horizontal speed over ground, m/s, never negative.
    pub speed: f64,
    /// Telemetered rate of turn of the course, rad/s: the gyroscope's, without error.
    pub turn_rate: f64,
    /// Whether it says that its nose is down.
    pub descending: bool,
    /// What the surface craft takes for the σ of `position` along either axis, m. It does not know outliers.
    pub sigma: f64,
}

/// What became of the messages. Every one sent is counted once more, when its fate is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Transmitted; a silent vehicle transmits nothing.
    pub sent: u64,
    /// Never heard because too far away.
    pub beyond_range: u64,
    /// Lost by chance, whether or not something else sounded at the same time.
    pub lost: u64,
    /// Destroyed by another message, and not lost by chance.
    pub collided: u64,
    /// Known to the surface craft.
    pub delivered: u64,
    /// Discarded, oldest first, because the caller did not collect them.
    pub uncollected: u64,
}

/// The acoustic channel between all underwater vehicles and the surface craft.
#[derive(Clone, Debug)]
pub struct Acoustics {
    setup: AcousticsSetup,
    rng: ChaCha8Rng,
    /// Length of a step, s.
    period: f64,
    /// Steps of a frame.
    frame_steps: u32,
    /// Step of the frame at which each vehicle transmits.
    slot_steps: Vec<u32>,
    /// Messages on their way, in order of arrival.
    pending: Vec<Message>,
    tally: Tally,
}

#[derive(Clone, Copy, Debug)]
struct Message {
    fix: Fix,
    /// When its first sound arrives, s.
    arrival: f64,
    fate: Fate,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Heard,
    Lost,
    Collided,
}

/// The random numbers of one slot, of which every slot takes the same count.
struct SlotNoise {
    position: Vector2<f64>,
    depth: f64,
    course: f64,
    speed: f64,
    /// Uniform in [0, 1): below the share of outliers it is one.
    outlier: f64,
    /// Uniform in [0, 1): below the probability of loss it is lost.
    loss: f64,
}

impl SlotNoise {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let (position, telemetry) = (normal_pair(rng), normal_pair(rng));
        Self {
            position,
            depth: telemetry.x,
            course: telemetry.y,
            speed: normal_pair(rng).x,
            outlier: rng.random(),
            loss: rng.random(),
        }
    }
}

impl Acoustics {
    /// A quiet channel. `setup` has passed its check; `period` is the length of a step, s, not longer than
    /// a frame.
    #[must_use]
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
            pending: Vec::with_capacity(QUEUE_PER_VEHICLE * setup.slots.len()),
            tally: Tally::default(),
            setup: setup.clone(),
        }
    }

    /// Lets each vehicle transmit whose slot begins at step number `step`, at time `step · period`. To be called
    /// once for each step, in order; `emissions` and `silent` are in the scenario's order.
    ///
    /// The slant range to the surface craft is taken when the message leaves: before it arrives, two vehicles
    /// of 1.5 m/s change the range by 0.2 % at most.
    ///
    /// A slot takes as many random numbers as every other, used, silent or out of range, so that two runs
    /// from one seed have the same noise, although their surface craft move differently.
    pub fn step(&mut self, step: u32, asc_position: &Vector2<f64>, emissions: &[Emission], silent: &[bool]) {
        debug_assert_eq!(emissions.len(), self.slot_steps.len(), "one emission a slot");
        debug_assert_eq!(silent.len(), self.slot_steps.len(), "one flag a slot");
        let step_of_frame = step % self.frame_steps;
        let sent_at = f64::from(step) * self.period;
        for (vehicle, (emission, silent)) in emissions.iter().zip(silent).enumerate() {
            if self.slot_steps[vehicle] == step_of_frame {
                let noise = SlotNoise::draw(&mut self.rng);
                if !silent {
                    let range = (emission.position - asc_position).norm().hypot(emission.depth);
                    self.transmit(self.fix(vehicle, sent_at, range, emission, &noise), range, &noise);
                }
            }
        }
    }

    /// Appends to `heard` what became known up to `now`, s, in the order in which it did.
    pub fn receive(&mut self, now: f64, heard: &mut Vec<Fix>) {
        let due = self
            .pending
            .partition_point(|message| message.fix.heard_at <= now);
        for message in self.pending.drain(..due) {
            match message.fate {
                Fate::Heard => {
                    self.tally.delivered += 1;
                    heard.push(message.fix);
                }
                Fate::Lost => self.tally.lost += 1,
                Fate::Collided => self.tally.collided += 1,
            }
        }
    }

    /// What became of the messages so far.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// What the surface craft will know if the message comes through.
    fn fix(&self, vehicle: usize, sent_at: f64, range: f64, emission: &Emission, noise: &SlotNoise) -> Fix {
        let setup = &self.setup;
        let spread = if noise.outlier < setup.outlier_share {
            setup.outlier_sigma
        } else {
            setup.position_sigma
        };
        Fix {
            vehicle,
            sent_at,
            heard_at: sent_at + range / setup.sound_speed + setup.latency,
            position: disturbed_vector(&emission.position, &(noise.position * spread)),
            depth: disturbed(emission.depth, setup.depth_sigma * noise.depth),
            course: Course::new(disturbed(
                emission.course.radians(),
                setup.course_sigma * noise.course,
            )),
            speed: disturbed(emission.speed, setup.speed_sigma * noise.speed).max(0.0),
            turn_rate: emission.turn_rate,
            descending: emission.descending,
            sigma: setup.position_sigma,
        }
    }

    /// Sends a message over `range` m, and lets it collide with those on their way.
    fn transmit(&mut self, fix: Fix, range: f64, noise: &SlotNoise) {
        let setup = &self.setup;
        self.tally.sent += 1;
        if range > setup.range_max {
            self.tally.beyond_range += 1;
            return;
        }
        let loss = setup.loss + (setup.loss_at_range_max - setup.loss) * (range / setup.range_max);
        let mut message = Message {
            fix,
            arrival: fix.sent_at + range / setup.sound_speed,
            fate: if noise.loss < loss {
                Fate::Lost
            } else {
                Fate::Heard
            },
        };
        // Every message that this one can collide with is still pending: it is not collected before its last sound
        // arrives, which is after this one left. A lost message was not decoded, but it is as loud.
        for other in &mut self.pending {
            if (other.arrival - message.arrival).abs() < setup.slot_length {
                other.collide();
                message.collide();
            }
        }
        if self.pending.len() == QUEUE_PER_VEHICLE * self.slot_steps.len() {
            self.pending.remove(0);
            self.tally.uncollected += 1;
        }
        let after = self
            .pending
            .partition_point(|other| other.fix.heard_at <= fix.heard_at);
        self.pending.insert(after, message);
    }
}

impl Message {
    fn collide(&mut self) {
        if self.fate == Fate::Heard {
            self.fate = Fate::Collided;
        }
    }
}

/// The nearest whole number of steps to `duration`: 10 s are 100 steps of 0.1 s, though 0.1 is no binary
/// fraction.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a frame is an hour at most, and the cast saturates"
)]
fn whole_steps(duration: f64, period: f64) -> u32 {
    (duration / period).round() as u32
}

#[cfg(test)]
mod tests;
