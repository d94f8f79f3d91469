//! A small world to rehearse a live mission in: two AUVs on lawn-mower paths, and a surface craft
//! with acoustic fixes of them: inaccurate, late, reordered, and some twice.
//!
//! The AUVs stay on their paths and are slower than planned. The craft is a simple model with the
//! planner's limits; only the simulator (`sim/`) tests the planner.

use std::{f64::consts::TAU, ops::Range};

use planner::angle::wrap;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use wire::{
    Asc, DeclaredPath, Report, Segment,
    mission::{AscReport, LiveAuv, Reports},
};

/// Steps of the world in a second.
const STEPS_PER_S: u32 = 10;
/// s.
const STEP: f64 = 0.1;

/// The AUVs' names.
pub const AUV_IDS: [&str; 2] = ["auv-1", "auv-2"];
/// Index of the AUV that falls silent.
const SILENT: usize = 1;
/// Start of the AUVs' paths, east, m.
const START_EAST: [f64; 2] = [0.0, 60.0];
/// Length of a lane, and spacing of lanes, m.
const LANE: [f64; 2] = [60.0, 20.0];
/// Radius of the corners of the planned path, m. The AUVs turn on the spot.
const FILLET: f64 = 1.0;
/// Horizontal speed of the AUVs in their plan, m/s.
const SPEED_PLANNED: f64 = 0.40;
/// Their true horizontal speed, m/s.
const SPEED: f64 = 0.38;
/// m.
const DEPTH: f64 = 10.0;

/// Steps between two fixes of the same AUV: 5 s, the AUVs by turns.
const FIX_STEPS: u32 = 5 * STEPS_PER_S;
/// Standard deviation of a fix along either axis, m.
const FIX_SIGMA: f64 = 1.0;
/// Longest delay of a fix, s.
const DELAY_MAX: f64 = 8.0;
/// Share of the fixes that arrive twice.
const TWICE: f64 = 0.1;

/// Time constant of speed, s, largest acceleration, m/s², and yaw rate, rad/s: `wire`'s defaults.
const SURGE_LAG: f64 = 2.5;
const ACCELERATION_MAX: f64 = 0.09;
const TURN_RATE_MAX: f64 = 0.3;
/// Time constant of its heading, s.
const HEADING_LAG: f64 = 1.0;

/// The true state, and the fixes under way to the surface craft.
#[derive(Debug)]
pub struct World {
    /// Mission time of the start, s.
    start: f64,
    /// Steps since the start.
    steps: u32,
    /// Corners of each AUV's path (north, east), m.
    paths: [Vec<[f64; 2]>; 2],
    craft: Craft,
    /// Time without fixes of one AUV, s since the start.
    silence: Range<f64>,
    on_their_way: Vec<OnItsWay>,
    rng: ChaCha8Rng,
}

/// A speed through the water, m/s, and a heading, rad, to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steer {
    /// m/s.
    pub speed: f64,
    /// rad.
    pub heading: f64,
}

#[derive(Clone, Copy, Debug)]
struct Craft {
    position: [f64; 2],
    heading: f64,
    speed: f64,
    yaw_rate: f64,
}

#[derive(Clone, Copy, Debug)]
struct OnItsWay {
    auv: usize,
    /// s since the start.
    arrives: f64,
    fix: Report,
}

/// The AUVs of a mission that lasts `duration` s.
#[must_use]
pub fn auvs(duration: f64) -> Vec<LiveAuv> {
    let auv = |(id, points): (&str, Vec<[f64; 2]>)| LiveAuv {
        id: id.to_owned(),
        path: Some(DeclaredPath {
            segments: vec![Segment::Waypoints {
                points,
                fillet_m: Some(FILLET),
                turn_radius_m: None,
                legs: vec![],
            }],
            closed: false,
            speed_mps: SPEED_PLANNED,
        }),
        dive: None,
    };
    AUV_IDS.into_iter().zip(paths(duration)).map(auv).collect()
}

impl World {
    /// A world of `duration` s from the mission time `start`. One AUV is silent during `silence`.
    #[must_use]
    pub fn new(start: f64, duration: f64, silence: Range<f64>, seed: u64) -> Self {
        Self {
            start,
            steps: 0,
            paths: paths(duration),
            craft: Craft {
                position: [-10.0, 30.0],
                heading: 0.0,
                speed: 0.0,
                yaw_rate: 0.0,
            },
            silence,
            on_their_way: vec![],
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Time since the start, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        f64::from(self.steps) / f64::from(STEPS_PER_S)
    }

    /// `true` at a whole second.
    #[must_use]
    pub fn is_at_a_whole_second(&self) -> bool {
        self.steps.is_multiple_of(STEPS_PER_S)
    }

    /// Mission time, s.
    #[must_use]
    pub fn clock(&self) -> f64 {
        self.start + self.time()
    }

    /// Advances by 0.1 s. Without a reference the craft keeps its heading and stops.
    pub fn step(&mut self, steer: Option<Steer>) {
        self.craft.step(steer.unwrap_or(Steer {
            speed: 0.0,
            heading: self.craft.heading,
        }));
        self.steps += 1;
        for auv in 0..AUV_IDS.len() {
            let turn = if auv == SILENT { FIX_STEPS / 2 } else { 0 };
            if self.steps % FIX_STEPS == turn {
                self.send(auv);
            }
        }
    }

    /// `true` while one AUV sends no fixes.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.silence.contains(&self.time())
    }

    /// New fixes, and the craft's state.
    pub fn heard(&mut self) -> Reports {
        let now = self.time();
        let mut heard = Reports {
            received_s: Some(self.clock()),
            asc: vec![self.craft.report(self.clock())],
            ..Reports::default()
        };
        for arrived in self.on_their_way.extract_if(.., |fix| fix.arrives <= now) {
            let id = AUV_IDS[arrived.auv].to_owned();
            heard.auvs.entry(id).or_default().push(arrived.fix);
        }
        heard
    }

    /// Distance of the craft from the midpoint of the AUVs, m.
    #[must_use]
    pub fn distance(&self) -> f64 {
        let [a, b] = [0, 1].map(|auv| self.auv(auv));
        let [north, east] = self.craft.position;
        (f64::midpoint(a[0], b[0]) - north).hypot(f64::midpoint(a[1], b[1]) - east)
    }

    /// An AUV's position (north, east), m.
    fn auv(&self, auv: usize) -> [f64; 2] {
        along(&self.paths[auv], SPEED * self.time())
    }

    fn send(&mut self, auv: usize) {
        let [north, east] = self.auv(auv);
        let error = normal_pair(&mut self.rng).map(|z| FIX_SIGMA * z);
        let delay = self.rng.random_range(0.0..DELAY_MAX);
        let again = DELAY_MAX * self.rng.random::<f64>();
        let twice = self.rng.random_bool(TWICE);
        // A silence consumes as many random numbers, so that the same seed gives the same errors.
        if auv == SILENT && self.is_silent() {
            return;
        }
        let fix = Report {
            t_s: self.clock(),
            north_m: north + error[0],
            east_m: east + error[1],
            lat_deg: None,
            lon_deg: None,
            sigma_m: FIX_SIGMA,
            depth_m: Some(DEPTH),
            course_rad: None,
            speed_mps: None,
            turn_rate_radps: None,
        };
        let arrives = self.time() + delay;
        self.on_their_way.push(OnItsWay { auv, arrives, fix });
        if twice {
            let arrives = arrives + again;
            self.on_their_way.push(OnItsWay { auv, arrives, fix });
        }
    }
}

impl Craft {
    fn step(&mut self, steer: Steer) {
        let acceleration = (steer.speed - self.speed) / SURGE_LAG;
        self.speed += STEP * acceleration.clamp(-ACCELERATION_MAX, ACCELERATION_MAX);
        let turn_rate = wrap(steer.heading - self.heading) / HEADING_LAG;
        self.yaw_rate = turn_rate.clamp(-TURN_RATE_MAX, TURN_RATE_MAX);
        self.heading = wrap(self.heading + STEP * self.yaw_rate);
        let (sin, cos) = self.heading.sin_cos();
        self.position[0] += STEP * self.speed * cos;
        self.position[1] += STEP * self.speed * sin;
    }

    fn report(&self, t_s: f64) -> AscReport {
        AscReport {
            t_s,
            state: Asc {
                north_m: self.position[0],
                east_m: self.position[1],
                lat_deg: None,
                lon_deg: None,
                heading_rad: self.heading,
                speed_mps: self.speed,
                sway_mps: 0.0,
                yaw_rate_radps: self.yaw_rate,
                ground_north_mps: None,
                ground_east_mps: None,
            },
            current: None,
            steered: true,
        }
    }
}

/// Corners of the lanes that the AUVs travel in `duration` s, and of one more.
fn paths(duration: f64) -> [Vec<[f64; 2]>; 2] {
    let [length, apart] = LANE;
    START_EAST.map(|start_east| {
        let mut points = vec![[0.0, start_east]];
        let (mut east, mut travelled) = (start_east, -length);
        while travelled < SPEED_PLANNED * duration {
            let [north, _] = points[points.len() - 1];
            let end = if north == 0.0 { length } else { 0.0 };
            points.push([end, east]);
            east += apart;
            points.push([end, east]);
            travelled += length + apart;
        }
        points
    })
}

/// The point `distance` m along the straight legs between `points`.
fn along(points: &[[f64; 2]], mut distance: f64) -> [f64; 2] {
    for leg in points.windows(2) {
        let ahead = [leg[1][0] - leg[0][0], leg[1][1] - leg[0][1]];
        let length = ahead[0].hypot(ahead[1]);
        if distance < length {
            return [0, 1].map(|axis| leg[0][axis] + ahead[axis] * distance / length);
        }
        distance -= length;
    }
    *points.last().expect("a path has points")
}

/// Two independent standard normal numbers (Box–Muller).
fn normal_pair(rng: &mut ChaCha8Rng) -> [f64; 2] {
    // Uniform numbers are in [0, 1); the logarithm needs (0, 1].
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    [radius * cos, radius * sin]
}
