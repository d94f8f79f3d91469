//! One mission: two AUVs that dive along lanes, a craft that follows the reference, their posts.

use std::f64::consts::{PI, TAU};
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use serde_json::{Value, json};
use tests::client::{get, post, with};
use tokio::time::{Instant, sleep_until};

use super::{http::Connection, tally::Shared};

/// Horizontal speed of a 50° sawtooth, m/s.
const AUV_SPEED: f64 = 0.193;
/// Between two lanes, m.
const LANE: f64 = 60.0;
/// Standard deviation of a fix along either axis, m.
const SIGMA: f64 = 1.5;
/// The planner's defaults: largest yaw rate of the craft, rad/s, and time constant of surge, s.
const TURN_RATE: f64 = 0.3;
const SURGE_LAG: f64 = 2.5;
/// Other vessels begin at most so far north and east of the lanes, m.
const VESSELS_WITHIN: f64 = 1000.0;
/// Between two posts of a mission.
const PERIOD: Duration = Duration::from_secs(1);

/// The vehicles of a mission and their motion.
#[derive(Debug)]
struct Sea {
    random: ChaCha8Rng,
    /// Distance of the AUVs along their lanes, m.
    along: f64,
    craft: Craft,
    vessels: Vec<Ship>,
}

/// Another vessel, which keeps its course and speed.
#[derive(Debug)]
struct Ship {
    north: f64,
    east: f64,
    course: f64,
    speed: f64,
}

#[derive(Debug, Default)]
struct Craft {
    north: f64,
    east: f64,
    heading: f64,
    speed: f64,
    speed_ordered: f64,
    heading_ordered: f64,
}

impl Sea {
    fn new(seed: u64, vessels: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut within = || random.random_range(-VESSELS_WITHIN..VESSELS_WITHIN);
        let places: Vec<[f64; 2]> = (0..vessels).map(|_| [within(), within()]).collect();
        let ships = places.into_iter().map(|[north, east]| Ship {
            north,
            east,
            course: random.random_range(-PI..PI),
            speed: random.random_range(0.0..5.0),
        });
        let vessels = ships.collect();
        let craft = Craft { east: 0.3 * LANE, ..Craft::default() };
        Self { random, along: 0.0, craft, vessels }
    }

    /// `dt` seconds later.
    fn advance(&mut self, dt: f64) {
        self.along += AUV_SPEED * dt;
        for ship in &mut self.vessels {
            ship.north += ship.speed * ship.course.cos() * dt;
            ship.east += ship.speed * ship.course.sin() * dt;
        }
        let craft = &mut self.craft;
        let turn = (craft.heading_ordered - craft.heading + PI).rem_euclid(TAU) - PI;
        craft.heading += turn.clamp(-TURN_RATE * dt, TURN_RATE * dt);
        craft.heading = (craft.heading + PI).rem_euclid(TAU) - PI;
        craft.speed += (craft.speed_ordered - craft.speed) * (dt / SURGE_LAG).min(1.0);
        craft.north += craft.speed * craft.heading.cos() * dt;
        craft.east += craft.speed * craft.heading.sin() * dt;
    }

    /// Noise with a standard deviation of 1. Uniform: nothing here rests on its tails.
    fn noise(&mut self) -> f64 {
        3_f64.sqrt() * (2.0 * self.random.random::<f64>() - 1.0)
    }

    /// Reports of now.
    fn reports(&mut self) -> Value {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = since.expect("the clock is set").as_secs_f64();
        let mut lane = |east: f64| {
            let (north_m, east_m) = (self.along + SIGMA * self.noise(), east + SIGMA * self.noise());
            json!([{ "t_s": now, "north_m": north_m, "east_m": east_m, "sigma_m": SIGMA, "depth_m": 9.0 }])
        };
        let auvs = json!({ "auv-1": lane(0.0), "auv-2": lane(LANE) });
        let craft = &self.craft;
        let state = json!({
            "north_m": craft.north,
            "east_m": craft.east,
            "heading_rad": craft.heading,
            "speed_mps": craft.speed,
        });
        let mut reports = json!({ "auvs": auvs, "asc": [{ "t_s": now, "state": state }] });
        if !self.vessels.is_empty() {
            let told = |(index, ship): (usize, &Ship)| {
                json!({
                    "id": format!("vessel-{index}"),
                    "t_s": now,
                    "north_m": ship.north,
                    "east_m": ship.east,
                    "course_rad": ship.course,
                    "speed_mps": ship.speed,
                    "length_m": 30.0,
                })
            };
            reports["traffic"] = self.vessels.iter().enumerate().map(told).collect();
        }
        reports
    }
}

/// The members of a reference that a client reads.
#[derive(Debug, Deserialize)]
struct Seen {
    age_s: f64,
    missed: u64,
    plan: Plan,
}

#[derive(Debug, Deserialize)]
struct Plan {
    reason: Option<String>,
    reference: Reference,
}

#[derive(Debug, Deserialize)]
struct Reference {
    speed_mps: f64,
    heading_rad: f64,
}

/// The members of a mission that a client reads.
#[derive(Debug, Deserialize)]
struct Made {
    id: String,
}

/// The name of a mission that was made and begun, or how the service refused it.
pub(crate) async fn make(connection: &mut Connection, shared: &Shared) -> io::Result<Option<String>> {
    let live = json!({
        "auvs": [{ "id": "auv-1" }, { "id": "auv-2" }],
        "goal": { "kind": "midpoint", "auvs": ["auv-1", "auv-2"] },
    });
    let new = json!({ "schema_version": "1.0", "title": "load", "live": live });
    let made = connection.ask(post("/v1/missions", new.to_string())).await?;
    if made.status != 201 {
        shared.lock().refuse("a mission to be made", &made);
        return Ok(None);
    }
    let Made { id } = serde_json::from_slice(&made.body)?;
    let run = post(&format!("/v1/missions/{id}/run"), "{}");
    let running = connection.ask(run).await?;
    if running.status != 200 {
        shared.lock().refuse("a mission to be begun", &running);
        return Ok(None);
    }
    Ok(Some(id))
}

/// A mission and its reporters.
#[derive(Debug)]
pub(crate) struct Flight {
    index: usize,
    id: String,
    connection: Connection,
    sea: Sea,
    shared: Shared,
}

impl Flight {
    pub(crate) fn new(address: SocketAddr, index: usize, id: String, vessels: usize, shared: Shared) -> Self {
        let seed = u64::try_from(index).expect("few missions");
        Self { index, id, connection: Connection::new(address), sea: Sea::new(seed, vessels), shared }
    }

    /// Posts once a second at its own times, and reads the reference twice in between.
    pub(crate) async fn fly(mut self, end: Instant) {
        let begin = Instant::now() + PERIOD.mul_f64(self.sea.random.random());
        for second in 0_u32.. {
            let due = begin + PERIOD * second;
            if end <= due {
                return;
            }
            sleep_until(due).await;
            self.sea.advance(PERIOD.as_secs_f64());
            self.report(due, second).await;
            let mut looks = [self.sea.random.random::<f64>(), self.sea.random.random()];
            looks.sort_by(f64::total_cmp);
            for look in looks {
                sleep_until(due + PERIOD.mul_f64(look)).await;
                self.look().await;
            }
        }
    }

    async fn report(&mut self, due: Instant, second: u32) {
        let heard = self.sea.reports().to_string();
        let post = post(&format!("/v1/missions/{}/reports", self.id), heard);
        let keyed = with(post, "idempotency-key", &second.to_string());
        let answer = self.connection.ask(keyed).await;
        let mut tally = self.shared.lock();
        match answer {
            Ok(answer) if answer.status == 200 => {
                tally.acknowledged += 1;
                tally.acks.add(1e3 * due.elapsed().as_secs_f64());
            }
            Ok(answer) => tally.refuse(&format!("a report of mission {}", self.index), &answer),
            Err(error) => tally.lose(&format!("a report of mission {}", self.index), &error),
        }
    }

    async fn look(&mut self) {
        let get = get(&format!("/v1/missions/{}/reference", self.id));
        let answer = self.connection.ask(get).await;
        let mut tally = self.shared.lock();
        let answer = match answer {
            Ok(answer) if answer.status == 200 => answer,
            Ok(answer) if answer.status == 409 => {
                tally.no_plan_yet += 1;
                return;
            }
            Ok(answer) => {
                return tally.refuse(&format!("the reference of mission {}", self.index), &answer);
            }
            Err(error) => return tally.lose(&format!("the reference of mission {}", self.index), &error),
        };
        let seen: Seen = serde_json::from_slice(&answer.body).expect("a reference has these members");
        tally.ages.add(seen.age_s);
        tally.missed.insert(self.index, seen.missed);
        tally.cut_short += u64::from(seen.plan.reason.as_deref() == Some("deadline"));
        self.sea.craft.speed_ordered = seen.plan.reference.speed_mps;
        self.sea.craft.heading_ordered = seen.plan.reference.heading_rad;
    }
}
