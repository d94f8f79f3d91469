//! Craft of one service that meet, flown by a toy: each follows an AUV of its own, with an origin
//! of its own.
//!
//! More flights, in a table: `FLEETS=101-140 CRAFT=2-6 SILENT=0.3 cargo test -p tests --test claims
//! -- fleet::flights --nocapture`.

use std::{env, f64::consts::PI, fs, time::Duration};

use nalgebra::Vector2;
use planner::angle::{direction, wrap};
use planner::snapshot::Origin;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use service::{
    Settings,
    access::{NewToken, Role, TokenFile, TokenLimit, Tokens},
};
use tests::client::{Answer, get, post, simulated_machine, with};
use wire::DatumChange;

use super::{Service, id, number};

/// Distance that the missions keep, m, with half of a craft's length.
const KEPT: f64 = 30.0 + 2.5;

/// Time at which the craft would meet, and of a flight, s.
const MEET: f64 = 100.0;
const DURATION: f64 = 250.0;

/// A toy of a craft behind its AUV; the world counts from the first craft's origin.
struct Craft {
    mission: String,
    origin: Origin,
    /// The AUV at the start, its course and its speed, and its turn by an angle at a time.
    auv: (Vector2<f64>, f64, f64),
    turn: (f64, f64),
    position: Vector2<f64>,
    heading: f64,
    speed: f64,
    ordered: [f64; 2],
    silent_after: f64,
}

impl Craft {
    fn auv(&self, time: f64) -> (Vector2<f64>, f64) {
        let ((start, course, speed), (turn, when)) = (self.auv, self.turn);
        let before = time.min(when);
        let place = start + (direction(course) * before + direction(course + turn) * (time - before)) * speed;
        (place, if time < when { course } else { course + turn })
    }

    fn advance(&mut self) {
        for _ in 0..10 {
            let off = wrap(self.ordered[1] - self.heading);
            self.heading = wrap(self.heading + off.clamp(-0.03, 0.03));
            self.speed += (self.ordered[0] - self.speed).clamp(-0.02, 0.02);
            self.position += direction(self.heading) * self.speed * 0.1;
        }
    }

    fn reports(&self, world: Origin, now: f64, time: f64) -> Value {
        let change = DatumChange::new(world, self.origin).expect("are on Earth");
        let (auv, craft) = (change.moved(&self.auv(time).0), change.moved(&self.position));
        let fix = json!({ "t_s": now, "north_m": auv.x, "east_m": auv.y, "sigma_m": 1.0, "depth_m": 9.0 });
        let state = json!({ "north_m": craft.x, "east_m": craft.y, "heading_rad": self.heading, "speed_mps": self.speed });
        json!({ "auvs": { "a": [fix] }, "asc": [{ "t_s": now, "state": state }] })
    }
}

/// What a flight came to.
struct Flown {
    /// Least distance of any two craft, m, and the missions in order of their creation.
    least: f64,
    missions: Vec<String>,
    /// RMS distance of each craft from its AUV in the last minute, m.
    after: Vec<f64>,
}

fn draw(rng: &mut ChaCha8Rng, n: usize, turning: f64, silent: f64) -> Vec<Craft> {
    let (first, silent_one) = (rng.random_range(-PI..PI), rng.random_range(0..n));
    let silent = rng.random_bool(silent).then(|| rng.random_range(40.0..120.0));
    let craft = |i: usize| {
        let course = first + PI * 2.0 * i as f64 / n as f64 + rng.random_range(-1.2..1.2);
        let speed = rng.random_range(0.4..0.9);
        let across = direction(course + PI / 2.0) * rng.random_range(-30.0..30.0);
        let start = across - direction(course) * speed * MEET;
        Craft {
            mission: String::new(),
            origin: Origin { lat_deg: 38.41 + 0.002 * i as f64, lon_deg: -9.12 - 0.003 * i as f64 },
            auv: (start, course, speed),
            turn: if rng.random_bool(turning) {
                (rng.random_range(-1.6..1.6), rng.random_range(40.0..140.0))
            } else {
                (0.0, MEET)
            },
            position: start,
            heading: course,
            speed,
            ordered: [speed, course],
            silent_after: silent.filter(|_| i == silent_one).unwrap_or(f64::INFINITY),
        }
    };
    (0..n).map(craft).collect()
}

async fn fly(service: &Service, craft: &mut [Craft]) -> Flown {
    let world = craft[0].origin;
    for one in craft.iter_mut() {
        let live =
            json!({ "auvs": [{ "id": "a" }], "goal": { "kind": "track", "auv": "a" }, "origin": one.origin });
        one.mission = service.create(&json!({ "schema_version": "1.0", "live": live })).await;
        service.order(&one.mission, "run", json!({})).await;
    }
    let (mut least, mut after) = (f64::INFINITY, vec![vec![]; craft.len()]);
    let mut time = 0.0;
    while time < DURATION {
        let now = service.clock.unix_s();
        for one in craft.iter().filter(|one| time < one.silent_after) {
            service.order(&one.mission, "reports", one.reports(world, now, time)).await;
        }
        service.clock.sleep(Duration::from_millis(990)).await;
        for one in craft.iter_mut() {
            let reference = service.get(&format!("{}/reference", one.mission)).await;
            if reference.status == 200 && time < one.silent_after {
                let reference = reference.json()["plan"]["reference"].clone();
                one.ordered = ["speed_mps", "heading_rad"].map(|member| number(&reference[member]));
            }
        }
        service.clock.sleep(Duration::from_millis(10)).await;
        craft.iter_mut().for_each(Craft::advance);
        time += 1.0;
        for (i, one) in craft.iter().enumerate() {
            let distances = craft[..i].iter().map(|other| (other.position - one.position).norm());
            least = distances.fold(least, f64::min);
            if DURATION - 60.0 < time {
                after[i].push((one.position - one.auv(time).0).norm_squared());
            }
        }
    }
    let rms = |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let missions = craft.iter().map(|one| one.mission.clone()).collect();
    Flown { least, missions, after: after.into_iter().map(rms).collect() }
}

/// Plans of the mission at which it dodged, changes of the side on which it meant to pass one of
/// the others, and plans, from ten seconds on, that saw others.
async fn dodges(service: &Service, mission: &str) -> [usize; 3] {
    let (mut dodged, mut changes, mut saw) = (0, 0, 0);
    let mut sides = std::collections::BTreeMap::new();
    for event in service.record(mission, "events_ndjson&kinds=planned").await.iter().skip(10) {
        let avoidance = &event["prediction"]["avoidance"];
        dodged += usize::from(avoidance["manoeuvre"].is_object());
        saw += usize::from(event["own_craft"]["vessels"].is_array());
        for met in avoidance["encounters"].as_array().into_iter().flatten() {
            let starboard = number(&met["starboard_m"]);
            if met["acts"] == true && 20.0 < starboard.abs() {
                let before = sides.insert(met["vessel"].to_string(), starboard.signum());
                changes += usize::from(before.is_some_and(|before| before != starboard.signum()));
            }
        }
    }
    [dodged, changes, saw]
}

#[tokio::test(start_paused = true)]
async fn of_two_craft_that_meet_the_one_with_the_later_mission_keeps_clear() {
    let service = Service::start().await;
    let flown = fly(&service, &mut draw(&mut ChaCha8Rng::seed_from_u64(1), 2, 0.0, 0.0)).await;
    assert!(KEPT < flown.least, "{}", flown.least);
    let [earlier, later] =
        [dodges(&service, &flown.missions[0]).await, dodges(&service, &flown.missions[1]).await];
    assert_eq!(earlier, [0; 3]);
    assert!(0 < later[0] && later[1] == 0 && 200 < later[2], "{later:?}");
    // What a mission saw of the other one is in its log.
    for mission in &flown.missions {
        assert!(240 < service.n_replayed(mission));
    }
}

fn given<T: std::str::FromStr>(name: &str) -> Option<T> {
    env::var(name).ok()?.parse().ok()
}

/// The flights of `FLEETS`, a range of seeds; none by default.
#[tokio::test(start_paused = true)]
async fn flights() {
    let range = |text: String| -> Option<(usize, usize)> {
        let (from, to) = text.split_once('-')?;
        Some((from.parse().ok()?, to.parse().ok()?))
    };
    let Some((from, to)) = given("FLEETS").and_then(range) else { return };
    let (fewest, most) = given("CRAFT").and_then(range).unwrap_or((2, 2));
    let [turning, silent] = ["TURNING", "SILENT"].map(|name| given(name).unwrap_or(0.0));
    for seed in from..=to {
        let service = Service::start().await;
        let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
        let n = rng.random_range(fewest..=most);
        let mut craft = draw(&mut rng, n, turning, silent);
        let silent = craft.iter().position(|one| one.silent_after.is_finite());
        let flown = fly(&service, &mut craft).await;
        let mut each = vec![];
        for mission in &flown.missions {
            each.push(dodges(&service, mission).await);
        }
        let after: Vec<String> = flown.after.iter().map(|after| format!("{after:.1}")).collect();
        println!(
            "flight {seed} craft {n} silent {silent:?} least {:.1} dodged, changes, saw {each:?} after {after:?}",
            flown.least
        );
    }
}

/// Two missions whose craft are 100 m apart.
struct Two {
    service: Service,
    tokens: tempfile::TempDir,
    operator: String,
    missions: Vec<String>,
}

impl Two {
    /// An operator may see both and, if there are such, another caller only missions of the craft
    /// `named`.
    async fn with_a_caller_of(named: &[&str]) -> Self {
        let (tokens, settings) = (tempfile::tempdir().expect("is made"), simulated_machine());
        let path = tokens.path().join(TOKENS);
        let token = |name: &str, limit: Option<TokenLimit>| {
            let new = NewToken { name: name.to_owned(), role: Role::Operator, limit, valid: None };
            TokenFile::add(&path, new, &settings.clock).expect("is made")
        };
        let operator = format!("Bearer {}", token("operator", None));
        if !named.is_empty() {
            let craft = named.iter().map(ToString::to_string).collect();
            token("customer", Some(TokenLimit { missions: vec![], craft }));
        }
        let known = Some(Tokens::open(&path, &settings.clock).expect("opens"));
        let service = Service::start_with(Settings { tokens: known, ..settings }).await;
        let mut two = Self { service, tokens, operator, missions: vec![] };
        for name in ["one", "two"] {
            let live = json!({ "auvs": [{ "id": "a" }], "goal": { "kind": "track", "auv": "a" },
                "origin": { "lat_deg": 38.41, "lon_deg": -9.12 } });
            let new = json!({ "schema_version": "1.0", "metadata": { "bridge": name }, "live": live });
            let made = two.post("/v1/missions", new).await;
            two.missions.push(made.header("location").to_owned());
        }
        for mission in &two.missions {
            two.report(mission).await;
            two.post(&format!("{mission}/run"), json!({})).await.must_be(200);
        }
        two
    }

    async fn post(&self, path: &str, body: Value) -> Answer {
        self.service.send(with(post(path, body.to_string()), "authorization", &self.operator)).await
    }

    async fn report(&self, mission: &str) {
        let (now, north) =
            (self.service.clock.unix_s(), if mission == self.missions[0] { 0.0 } else { 100.0 });
        let fix = json!({ "t_s": now, "north_m": north, "east_m": 5.0, "sigma_m": 1.0 });
        let state = json!({ "north_m": north, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.2 });
        let heard = json!({ "auvs": { "a": [fix] }, "asc": [{ "t_s": now, "state": state }] });
        self.post(&format!("{mission}/reports"), heard).await.must_be(200);
    }

    /// The times of the later mission's plans, and whether they saw the earlier one's craft.
    async fn seen(&self) -> Vec<(f64, bool)> {
        let path = format!("{}/record?format=events_ndjson&kinds=planned", self.missions[1]);
        let record = self.service.send(with(get(&path), "authorization", &self.operator)).await;
        record.must_be(200);
        let plans = record.text.lines().map(|line| serde_json::from_str::<Value>(line).expect("is JSON"));
        let is_seen = |plan: &Value| plan["own_craft"]["vessels"][0]["id"] == id(&self.missions[0]);
        plans.map(|plan| (number(&plan["t_s"]), is_seen(&plan))).collect()
    }

    async fn is_seen(&self) -> bool {
        self.seen().await.last().expect("has planned").1
    }

    async fn pass(&self, milliseconds: u64) {
        self.service.clock.sleep(Duration::from_millis(milliseconds)).await;
    }
}

const TOKENS: &str = "tokens.json";

#[tokio::test(start_paused = true)]
async fn missions_that_not_the_same_callers_may_see_do_not_see_each_other() {
    let mut seen = vec![];
    for named in [&[][..], &["one", "two"], &["one"]] {
        let two = Two::with_a_caller_of(named).await;
        two.pass(2_500).await;
        seen.push(two.is_seen().await);
    }
    assert_eq!(seen, [true, true, false]);
}

#[tokio::test(start_paused = true)]
async fn while_the_token_file_is_broken_no_mission_sees_another() {
    let two = Two::with_a_caller_of(&["one", "two"]).await;
    let path = two.tokens.path().join(TOKENS);
    two.pass(2_500).await;
    assert!(two.is_seen().await);
    let whole = fs::read(&path).expect("is there");
    fs::write(&path, &whole[1..]).expect("is written");
    // The service looks at it twice a second.
    two.pass(1_000).await;
    let broken = two.service.clock.unix_s();
    two.pass(4_000).await;
    let mended = two.service.clock.unix_s();
    fs::write(&path, &whole).expect("is written");
    two.pass(3_000).await;
    let (during, others): (Vec<_>, Vec<_>) =
        two.seen().await.into_iter().partition(|(time, _)| broken < *time && *time < mended);
    assert!(3 <= during.len() && during.iter().all(|(_, is_seen)| !is_seen), "{during:?}");
    assert!(others[1].1 && others[others.len() - 1].1, "{others:?}");
}

#[tokio::test(start_paused = true)]
async fn a_craft_whose_mission_is_finished_is_not_seen_any_more() {
    let two = Two::with_a_caller_of(&[]).await;
    two.pass(2_500).await;
    assert!(two.is_seen().await);
    two.post(&format!("{}/finish", two.missions[0]), json!({})).await.must_be(200);
    two.pass(1_500).await;
    assert!(!two.is_seen().await);
}
