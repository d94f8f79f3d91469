//! Drawn encounters, what the craft hears of them, and whether there is a way.

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use nalgebra::Vector2;
use planner::angle::{Course, direction, wrap};
use planner::snapshot::{Vessel, VesselStatus};
use planner::{AuvState, Limits};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A kinematic craft: a heading that turns at a limited rate after a lag, and a speed likewise.
#[derive(Clone, Copy)]
pub(crate) struct Hull {
    pub(crate) limits: Limits,
    pub(crate) heading_lag: f64,
    pub(crate) speed_lag: f64,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Behaviour {
    /// Keeps its course and speed.
    StandsOn,
    /// Turns by this angle at this time.
    Turns(f64, f64),
}

#[derive(Clone)]
pub(crate) struct Ship {
    pub(crate) start: Vector2<f64>,
    pub(crate) course: f64,
    pub(crate) speed: f64,
    pub(crate) length: f64,
    pub(crate) behaviour: Behaviour,
    /// Time between its reports, s, and their age when they come.
    pub(crate) interval: usize,
    pub(crate) latency: f64,
}

impl Ship {
    pub(crate) fn at(&self, time: f64) -> (Vector2<f64>, f64) {
        let (turn, when) = match self.behaviour {
            Behaviour::StandsOn => (0.0, f64::INFINITY),
            Behaviour::Turns(turn, when) => (turn, when),
        };
        let before = time.min(when);
        let later = direction(self.course + turn) * (time - before);
        let place = self.start + (direction(self.course) * before + later) * self.speed;
        (place, if time < when { self.course } else { self.course + turn })
    }
}

pub(crate) struct Drawn {
    pub(crate) auv: AuvState,
    pub(crate) ships: Vec<Ship>,
    pub(crate) hull: Hull,
}

impl Drawn {
    /// The AUV at a time.
    pub(crate) fn auv_at(&self, time: f64) -> AuvState {
        let position = self.auv.position() + self.auv.velocity() * time;
        AuvState { north_m: position.x, east_m: position.y, ..self.auv }
    }
}

pub(crate) fn draw(seed: u64, n: RangeInclusive<usize>, craft: &str, turning: f64) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let medusa = Hull { limits: Limits::MEDUSA, heading_lag: 1.0, speed_lag: 3.0 };
    let hull = match craft {
        "otter" => Hull {
            limits: Limits {
                speed_max: 3.0,
                turn_rate_max: 0.4,
                acceleration_max: 0.3,
                deceleration_max: 0.3,
                ..Limits::MEDUSA
            },
            ..medusa
        },
        "random" => Hull {
            limits: Limits {
                speed_max: rng.random_range(1.2..5.0),
                turn_rate_max: rng.random_range(0.1..0.6),
                acceleration_max: rng.random_range(0.05..0.6),
                deceleration_max: rng.random_range(0.05..0.6),
                ..Limits::MEDUSA
            },
            heading_lag: rng.random_range(0.3..4.0),
            speed_lag: rng.random_range(0.5..6.0),
        },
        _ => medusa,
    };
    let speed = rng.random_range(0.3..0.6) * hull.limits.speed_max.min(2.5);
    let course = rng.random_range(-3.1..3.1);
    let auv = AuvState::new(Vector2::zeros(), 10.0, Course::new(course), speed);
    let ships = (0..rng.random_range(n)).map(|_| {
        let meets = rng.random_range(150.0..400.0);
        let cpa: f64 = rng.random_range(-100.0..100.0);
        let speed: f64 = if rng.random_bool(0.1) { 0.0 } else { rng.random_range(0.5..15.0) };
        let turn = rng.random_range(-3.1..3.1);
        let ship_course = wrap(course + turn);
        let across = direction(ship_course + FRAC_PI_2);
        let meeting = auv.position() + auv.velocity() * meets + across * cpa;
        Ship {
            start: meeting - direction(ship_course) * speed * meets,
            course: ship_course,
            speed,
            length: if speed < 5.0 { rng.random_range(5.0..30.0) } else { rng.random_range(10.0..120.0) },
            behaviour: if rng.random_bool(turning) {
                Behaviour::Turns(rng.random_range(-0.8..0.8), rng.random_range(30.0..300.0))
            } else {
                Behaviour::StandsOn
            },
            interval: rng.random_range(2..11),
            latency: rng.random_range(0.0..3.0),
        }
    });
    let ships = ships.collect::<Vec<_>>();
    // Nobody is too near at the start.
    let ships = ships.into_iter().filter(|ship| 150.0 + 0.5 * ship.length < ship.at(0.0).0.norm()).collect();
    Drawn { auv, ships, hull }
}

/// What the craft hears of the ships at `now`: AIS with noise, at each ship's interval.
pub(crate) fn hear(drawn: &Drawn, t: usize, rng: &mut ChaCha8Rng, heard: &mut [Option<Vessel>]) {
    let now = t as f64;
    for (i, ship) in drawn.ships.iter().enumerate() {
        let (place, course) = ship.at(now - ship.latency);
        if (t + i).is_multiple_of(ship.interval) {
            let noise = Vector2::new(rng.random_range(-5.0..5.0), rng.random_range(-5.0..5.0));
            let seen = place + noise;
            heard[i] = Some(Vessel {
                id: format!("ship-{i}").as_str().into(),
                name: None,
                t_s: Some(now - ship.latency),
                north_m: seen.x,
                east_m: seen.y,
                lat_deg: None,
                lon_deg: None,
                course_rad: (0.3 < ship.speed).then(|| wrap(course + rng.random_range(-0.03..0.03))),
                speed_mps: Some((ship.speed + rng.random_range(-0.05..0.05)).max(0.0)),
                heading_rad: None,
                length_m: Some(ship.length),
                sigma_m: Some(5.0),
                status: VesselStatus::UnderWay,
                plan: Vec::new(),
            });
        }
    }
}
