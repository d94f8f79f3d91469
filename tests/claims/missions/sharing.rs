//! Missions of several craft that share the AUVs, flown by a toy: each craft reports for itself
//! and asks for its own reference.
//!
//! More flights, in a table: `SHARED=101-200 cargo test -p tests --test claims --
//! sharing::flights --nocapture`.

use std::collections::BTreeMap;
use std::{env, f64::consts::PI, time::Duration};

use nalgebra::Vector2;
use planner::angle::{direction, wrap};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use service::{
    Settings,
    access::{NewToken, Role, TokenFile, TokenLimit, Tokens},
};
use tests::client::{get, post, simulated_machine, with};

use super::{Service, number};

/// Distance that is kept between craft, m, with half of a craft's length.
const KEPT: f64 = 30.0 + 2.5;

/// A toy of a craft, and the times, s, between which nothing is heard of it and it stands still.
struct Craft {
    id: String,
    position: Vector2<f64>,
    heading: f64,
    speed: f64,
    ordered: [f64; 2],
    lost: [f64; 2],
}

impl Craft {
    fn is_lost(&self, time: f64) -> bool {
        (self.lost[0]..self.lost[1]).contains(&time)
    }

    fn advance(&mut self) {
        for _ in 0..10 {
            let off = wrap(self.ordered[1] - self.heading);
            self.heading = wrap(self.heading + off.clamp(-0.03, 0.03));
            self.speed += (self.ordered[0] - self.speed).clamp(-0.03, 0.03);
            self.position += direction(self.heading) * self.speed * 0.1;
        }
    }

    fn report(&self, now: f64) -> Value {
        let state = json!({ "north_m": self.position.x, "east_m": self.position.y, "heading_rad": self.heading,
            "speed_mps": self.speed });
        json!({ "craft": self.id, "asc": [{ "t_s": now, "state": state }],
            "steering": [{ "t_s": now, "state": "steering" }] })
    }
}

/// An AUV that goes to and fro.
struct Auv {
    start: Vector2<f64>,
    course: f64,
    speed: f64,
}

impl Auv {
    fn at(&self, time: f64) -> Vector2<f64> {
        let leg = 120.0;
        let way = (self.speed * time) % (2.0 * leg);
        self.start + direction(self.course) * way.min(2.0 * leg - way)
    }
}

struct Flight {
    service: Service,
    mission: String,
    craft: Vec<Craft>,
    auvs: Vec<Auv>,
    time: f64,
    /// Least distance of any two craft, m.
    least: f64,
}

impl Flight {
    /// A mission of `n` craft with as many AUVs and one more; the first is lost for that time.
    async fn begin(seed: u64, goal: &str, n: usize, lost: [f64; 2]) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut place = |far: f64| Vector2::new(rng.random_range(-far..far), rng.random_range(-far..far));
        let mut places: Vec<Vector2<f64>> = vec![];
        while places.len() < n {
            let next = place(120.0);
            if places.iter().all(|other| 60.0 < (other - next).norm()) {
                places.push(next);
            }
        }
        let starts: Vec<_> = (0..=n).map(|_| place(250.0)).collect();
        let auvs = starts.into_iter().map(|start| Auv {
            start,
            course: rng.random_range(-PI..PI),
            speed: rng.random_range(0.3..0.7),
        });
        let auvs: Vec<_> = auvs.collect();
        let craft = places.into_iter().enumerate().map(|(i, position)| Craft {
            id: format!("asc-{i}"),
            position,
            heading: rng.random_range(-PI..PI),
            speed: 0.0,
            ordered: [0.0, 0.0],
            lost: if i == 0 { lost } else { [f64::INFINITY; 2] },
        });
        let craft: Vec<_> = craft.collect();
        let ids: Vec<_> = (0..auvs.len()).map(|i| format!("auv-{i}")).collect();
        let live = json!({
            "auvs": ids.iter().map(|id| json!({ "id": id })).collect::<Vec<_>>(),
            "surface_craft": craft.iter().map(|one| json!({ "id": one.id, "limits": { "speed_max_mps": 1.5 } })).collect::<Vec<_>>(),
            "goal": { "kind": goal, "auvs": ids },
        });
        let service = Service::start().await;
        let mission = service.create(&json!({ "schema_version": "1.0", "live": live })).await;
        service.order(&mission, "run", json!({})).await;
        Self { service, mission, craft, auvs, time: 0.0, least: f64::INFINITY }
    }

    /// A second: reports, references, motion.
    async fn second(&mut self) {
        let (now, time) = (self.service.clock.unix_s(), self.time);
        let fix = |auv: &Auv| {
            let at = auv.at(time);
            json!([{ "t_s": now, "north_m": at.x, "east_m": at.y, "sigma_m": 1.0, "depth_m": 9.0 }])
        };
        let fixes: BTreeMap<_, _> =
            self.auvs.iter().enumerate().map(|(i, auv)| (format!("auv-{i}"), fix(auv))).collect();
        self.service.order(&self.mission, "reports", json!({ "auvs": fixes })).await;
        for craft in self.craft.iter().filter(|craft| !craft.is_lost(time)) {
            self.service.order(&self.mission, "reports", craft.report(now)).await;
        }
        self.service.clock.sleep(Duration::from_millis(990)).await;
        for craft in &mut self.craft {
            let path = format!("{}/reference?craft={}", self.mission, craft.id);
            let reference = self.service.get(&path).await;
            if craft.is_lost(time) {
                craft.ordered = [0.0, craft.heading];
            } else if reference.status == 200 {
                let reference = reference.json();
                assert_eq!(reference["craft"], json!(craft.id));
                craft.ordered =
                    ["speed_mps", "heading_rad"].map(|of| number(&reference["plan"]["reference"][of]));
            }
        }
        self.service.clock.sleep(Duration::from_millis(10)).await;
        self.craft.iter_mut().for_each(Craft::advance);
        self.time += 1.0;
        for (i, one) in self.craft.iter().enumerate() {
            let distances = self.craft[..i].iter().map(|other| (other.position - one.position).norm());
            self.least = distances.fold(self.least, f64::min);
        }
    }

    async fn until(&mut self, time: f64) {
        while self.time < time {
            self.second().await;
        }
    }

    /// The AUVs of each craft, and why it has none, as clients see the mission.
    async fn parts(&self) -> BTreeMap<String, (Vec<String>, Value)> {
        let mission = self.service.ask(&self.mission).await;
        let craft = mission["surface_craft"].as_array().expect("is a fleet").iter();
        let text = |value: &Value| value.as_str().expect("is a name").to_owned();
        let auvs = |one: &Value| one["auvs"].as_array().expect("is a list").iter().map(text).collect();
        craft.map(|one| (text(&one["id"]), (auvs(one), one["away"].clone()))).collect()
    }

    /// Every AUV has one craft.
    async fn all_are_served(&self) {
        let parts = self.parts().await;
        let mut served: Vec<_> = parts.values().flat_map(|(auvs, _)| auvs.clone()).collect();
        served.sort();
        let all: Vec<_> = (0..self.auvs.len()).map(|i| format!("auv-{i}")).collect();
        assert_eq!(served, all, "{parts:?}");
    }

    /// The changes of who serves whom: time, s since the start, and the event.
    async fn assigned(&self) -> Vec<(f64, Value)> {
        let events = self.service.record(&self.mission, "events_ndjson&kinds=assigned").await;
        let start = number(&self.service.ask(&self.mission).await["started_s"]);
        events.into_iter().map(|event| (number(&event["t_s"]) - start, event)).collect()
    }
}

#[tokio::test(start_paused = true)]
async fn the_auvs_of_a_silent_craft_are_served_by_others_and_it_comes_back_after_half_a_minute() {
    for (seed, goal) in [(1, "visit"), (2, "midpoint")] {
        let mut flight = Flight::begin(seed, goal, 3, [40.0, 100.0]).await;
        flight.until(40.0).await;
        flight.all_are_served().await;
        let before = flight.parts().await;
        flight.until(60.0).await;
        flight.all_are_served().await;
        let during = flight.parts().await;
        assert_eq!(during["asc-0"], (vec![], json!("silent")), "{goal}");
        flight.until(180.0).await;
        flight.all_are_served().await;
        let after = flight.parts().await;
        assert!(!before["asc-0"].0.is_empty() && after["asc-0"].1.is_null(), "{before:?}, {after:?}");
        let assigned = flight.assigned().await;
        let away = |why: &str| {
            let is_so = |event: &Value| event["away"]["asc-0"] == why;
            assigned.iter().find(|(_, event)| is_so(event)).unwrap_or_else(|| panic!("{why}: {assigned:?}")).0
        };
        let (lost, back) = (away("silent"), away("returning"));
        // The last report was of 39 s; a silence of 10 s is one, and plans are made once a second.
        assert!((49.0..51.5).contains(&lost) && (99.5..102.5).contains(&back), "{lost}, {back}");
        let serves_again = |event: &&(f64, Value)| back < event.0 && event.1["away"].get("asc-0").is_none();
        let again = assigned.iter().find(serves_again).expect("comes back").0;
        assert!((29.0..33.0).contains(&(again - back)), "{again}");
        assert!(KEPT < flight.least, "{goal}: {}", flight.least);
        assert!(3 * 100 < flight.service.n_replayed(&flight.mission));
    }
}

#[tokio::test(start_paused = true)]
async fn a_fleet_continues_with_its_assignment_after_a_restart() {
    let mut flight = Flight::begin(3, "visit", 2, [f64::INFINITY; 2]).await;
    flight.until(30.0).await;
    let (before, n) = (flight.parts().await, flight.assigned().await.len());
    flight.service = flight.service.restart().await;
    flight.until(45.0).await;
    assert_eq!(flight.parts().await, before);
    assert_eq!(flight.assigned().await.len(), n);
    flight.service.n_replayed(&flight.mission);
}

#[tokio::test(start_paused = true)]
async fn a_craft_with_little_energy_gives_its_auvs_away_until_it_has_more_and_rested() {
    let mut flight = Flight::begin(6, "midpoint", 2, [f64::INFINITY; 2]).await;
    flight.until(10.0).await;
    // Each share is reported at its time, s; the craft's own reports say nothing of it.
    let (low, rests) = (Some("battery_low"), Some("returning"));
    let until_low = [(0.21, 20.0, None), (0.19, 30.0, low), (0.21, 70.0, low)];
    let after = [(0.3, 90.0, rests), (0.3, 110.0, None), (0.21, 120.0, None)];
    for (share, until, away) in until_low.into_iter().chain(after) {
        let now = flight.service.clock.unix_s();
        let state = json!({ "north_m": 0, "east_m": 0, "heading_deg": 0, "speed_mps": 0 });
        let report = json!({ "t_s": now - 5.0, "state": state, "battery": share });
        let body = json!({ "craft": "asc-1", "asc": [report] });
        flight.service.order(&flight.mission, "reports", body).await;
        flight.until(until).await;
        let parts = flight.parts().await;
        assert_eq!(parts["asc-1"].1, json!(away), "{share}: {parts:?}");
        assert_eq!(parts["asc-1"].0.is_empty(), away.is_some(), "{share}: {parts:?}");
        flight.all_are_served().await;
    }
    assert_eq!(flight.service.ask(&flight.mission).await["surface_craft"][1]["battery"], 0.21);
    // Without another one it serves as long as it can.
    let setting =
        json!({ "surface_craft": [{ "id": "asc-0", "serves": [] }, { "id": "asc-1", "battery_min": 0.5 }] });
    flight.service.change(&flight.mission, setting).await;
    flight.until(125.0).await;
    flight.all_are_served().await;
    flight.service.n_replayed(&flight.mission);
}

#[tokio::test(start_paused = true)]
async fn a_craft_that_a_person_has_serves_nobody_and_stops_for_nobody() {
    let mut flight = Flight::begin(4, "midpoint", 2, [f64::INFINITY; 2]).await;
    flight.until(10.0).await;
    let now = flight.service.clock.unix_s();
    let said = json!({ "craft": "asc-1", "steering": [{ "t_s": now + 0.5, "state": "person", "why": "a swimmer" }] });
    flight.service.order(&flight.mission, "reports", said).await;
    flight.service.clock.sleep(Duration::from_millis(1_500)).await;
    let parts = flight.parts().await;
    assert_eq!(parts["asc-1"], (vec![], json!("person")), "{parts:?}");
    flight.all_are_served().await;
    let path = format!("{}/reference?craft=asc-1", flight.mission);
    let reference = flight.service.ask(&path).await;
    // Without a range of the modems each AUV is called in a slot of its own.
    assert_eq!(reference["slots"].as_array().map(Vec::len), Some(flight.auvs.len()));
    assert_eq!(
        (&reference["method"], number(&reference["plan"]["reference"]["speed_mps"])),
        (&json!("hold"), 0.0)
    );
    // The worst state of all stands for the mission.
    assert_eq!(flight.service.ask(&flight.mission).await["steering"]["state"], "person");
}

#[tokio::test(start_paused = true)]
async fn calls_about_a_fleet_name_their_craft_and_its_faults_their_field() {
    let mut flight = Flight::begin(5, "visit", 2, [f64::INFINITY; 2]).await;
    flight.until(3.0).await;
    let (service, mission) = (&flight.service, &flight.mission);
    for (path, code) in [("reference", "missing"), ("reference?craft=nobody", "unknown_craft")] {
        let answer = service.get(&format!("{mission}/{path}")).await;
        answer.must_be(422);
        answer.must_say(code);
        answer.must_say("asc-0, asc-1");
    }
    let now = service.clock.unix_s();
    let state = json!([{ "t_s": now, "state": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.0 } }]);
    for (craft, code) in [(Value::Null, "missing"), (json!("nobody"), "unknown_craft")] {
        let answer =
            service.post(&format!("{mission}/reports"), &json!({ "craft": craft, "asc": state })).await;
        answer.must_be(422);
        answer.must_say("\"/craft\"");
        answer.must_say(code);
    }
    // A note may be anybody's.
    let note = json!({ "notes": [{ "t_s": now, "text": "seals" }] });
    service.order(mission, "reports", note).await;
    for (change, fault) in [
        (json!({ "surface_craft": [] }), "/surface_craft contradicts"),
        (json!({ "surface_craft": [{ "id": "a" }, { "id": "a" }] }), "/surface_craft/1/id duplicate"),
        (json!({ "surface_craft": [{ "id": "auv-0" }] }), "/surface_craft/0/id duplicate"),
        (json!({ "surface_craft": [{ "id": "a", "serves": ["auv-0"] }] }), "/goal unserved"),
        (json!({ "surface_craft": vec![json!({ "id": "a" }); 7] }), "/surface_craft length"),
        (json!({ "limits": { "speed_max_mps": 1.0 } }), "/limits contradicts"),
        (
            json!({ "surface_craft": [{ "id": "a", "limits": { "speed_max_mps": -1.0 } }] }),
            "/surface_craft/0/limits/speed_max_mps out_of_range",
        ),
    ] {
        let answer = service.patch(mission, &change).await;
        answer.must_be(422);
        let wrong = &answer.json()["errors"][0];
        let found = ["pointer", "code"].map(|member| wrong[member].as_str().unwrap_or_default().to_owned());
        assert_eq!(found.join(" "), fault, "{change}");
    }
    let mut alone =
        json!({ "auvs": [{ "id": "a" }], "goal": { "kind": "track", "auv": "a" }, "hand_over_s": 30 });
    for fault in ["/live/hand_over_s", "out_of_range"] {
        let answer = service.post("/v1/missions", &json!({ "schema_version": "1.0", "live": alone })).await;
        answer.must_be(422);
        answer.must_say(fault);
        (alone["surface_craft"], alone["hand_over_s"]) = (json!([{ "id": "b" }]), json!(601));
    }
    // A third craft joins, and one leaves.
    let craft = json!([{ "id": "asc-1", "limits": { "speed_max_mps": 1.5 } }, { "id": "asc-2" }]);
    service.change(mission, json!({ "surface_craft": craft })).await;
    let parts = flight.parts().await;
    assert_eq!(parts.keys().collect::<Vec<_>>(), ["asc-1", "asc-2"]);
    assert_eq!(parts["asc-2"].1, "silent");
    flight.craft.remove(0);
    flight.until(6.0).await;
    flight.all_are_served().await;
    flight.service.n_replayed(&flight.mission);
}

#[tokio::test(start_paused = true)]
async fn a_token_of_one_craft_reports_for_that_one_and_orders_nothing() {
    let (directory, settings) = (tempfile::tempdir().expect("is made"), simulated_machine());
    let path = directory.path().join("tokens.json");
    let token = |name: &str, craft: &[&str]| {
        let craft: Vec<_> = craft.iter().map(ToString::to_string).collect();
        let limit = (!craft.is_empty()).then(|| TokenLimit { missions: vec![], craft });
        let new = NewToken { name: name.to_owned(), role: Role::Operator, limit, valid: None };
        format!("Bearer {}", TokenFile::add(&path, new, &settings.clock).expect("is made"))
    };
    let [all, own, other] = [token("all", &[]), token("own", &["asc-0"]), token("other", &["asc-9"])];
    let known = Some(Tokens::open(&path, &settings.clock).expect("opens"));
    let service = Service::start_with(Settings { tokens: known, ..settings }).await;
    let live = json!({ "auvs": [{ "id": "a" }], "surface_craft": [{ "id": "asc-0" }, { "id": "asc-1" }],
        "goal": { "kind": "track", "auv": "a" } });
    let new = post("/v1/missions", json!({ "schema_version": "1.0", "live": live }).to_string());
    let mission = service.send(with(new, "authorization", &all)).await.header("location").to_owned();
    let now = service.clock.unix_s();
    let state = json!([{ "t_s": now, "state": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.0 } }]);
    let report = |craft: &str| json!({ "craft": craft, "asc": state }).to_string();
    let note = json!({ "notes": [{ "t_s": now, "text": "x" }] }).to_string();
    for (body, path, expected) in [
        (report("asc-0"), "reports", [200, 200, 403]),
        (report("asc-1"), "reports", [200, 403, 403]),
        (note, "reports", [200, 403, 403]),
        ("{}".to_owned(), "run", [200, 403, 403]),
        ("{}".to_owned(), "pause", [200, 403, 403]),
    ] {
        for (token, expected) in [&all, &own, &other].into_iter().zip(expected) {
            let call = post(&format!("{mission}/{path}"), body.clone());
            let answer = service.send(with(call, "authorization", token)).await;
            assert_eq!(answer.status, expected, "{path} {body}: {}", answer.text);
        }
    }
    for (token, expected, n) in [(&all, 200, 1), (&own, 200, 1), (&other, 403, 0)] {
        let answer = service.send(with(get(&mission), "authorization", token)).await;
        assert_eq!(answer.status, expected);
        let listed = service.send(with(get("/v1/missions"), "authorization", token)).await.json();
        assert_eq!(listed["missions"].as_array().map(Vec::len), Some(n));
    }
}

#[tokio::test(start_paused = true)]
async fn what_one_craft_reports_stops_no_plan_of_another() {
    let service = Service::start().await;
    let live = json!({ "auvs": [{ "id": "a" }, { "id": "on-deck" }],
        "surface_craft": [{ "id": "asc-0" }, { "id": "asc-1", "serves": ["a", "on-deck"] }],
        "goal": { "kind": "track", "auv": "a" } });
    let mission = service.create(&json!({ "schema_version": "1.0", "live": live })).await;
    service.order(&mission, "run", json!({})).await;
    // Before anybody is steered, nobody is assigned; that is stored, too.
    let now = service.clock.unix_s();
    let state = |east: f64| json!({ "north_m": 0.0, "east_m": east, "heading_rad": 0.0, "speed_mps": 0.0 });
    let said = |state: &str| json!([{ "t_s": now, "state": state }]);
    for (craft, east) in [("asc-0", 0.0), ("asc-1", 90.0)] {
        let heard = json!({ "craft": craft, "asc": [{ "t_s": now, "state": state(east) }],
            "steering": said("person"), "auvs": { "a": [{ "t_s": now, "north_m": 9.0, "east_m": 9.0, "sigma_m": 1.0 }] } });
        service.order(&mission, "reports", heard).await;
    }
    service.clock.sleep(Duration::from_millis(1_500)).await;
    // A vessel with the name of a craft, and an AUV of `serves` that was never heard.
    let vessel = json!({ "craft": "asc-0", "steering": said("steering"),
        "traffic": [{ "id": "asc-1", "north_m": 500.0, "east_m": 0.0, "course_rad": 0.0, "speed_mps": 1.0 }] });
    service.order(&mission, "reports", vessel).await;
    let service = service.restart().await;
    service.clock.sleep(Duration::from_millis(2_500)).await;
    let seen = service.ask(&mission).await;
    assert_eq!(seen["plan"]["outcome"], "ok", "{seen}");
    assert!(3 <= service.n_replayed(&mission));
}

/// The flights of `SHARED`, a range of seeds; none by default. A craft is lost at a drawn time, for
/// good or for a while.
#[tokio::test(start_paused = true)]
async fn flights() {
    let range = env::var("SHARED").ok().and_then(|text| {
        let (from, to) = text.split_once('-')?;
        Some((from.parse::<u64>().ok()?, to.parse::<u64>().ok()?))
    });
    let Some((from, to)) = range else { return };
    for seed in from..=to {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (n, begins) = (rng.random_range(2..=4), f64::from(rng.random_range(20..140_u8)));
        let ends = if rng.random_bool(0.5) { f64::INFINITY } else { begins + rng.random_range(15.0..60.0) };
        let goal = ["visit", "midpoint"][usize::from(rng.random_bool(0.5))];
        let mut flight = Flight::begin(seed, goal, n, [begins, ends]).await;
        flight.until(240.0).await;
        flight.all_are_served().await;
        let assigned = flight.assigned().await;
        let lost =
            assigned.iter().find(|(_, event)| event["away"]["asc-0"] == "silent").map(|(at, _)| at - begins);
        let replayed = flight.service.n_replayed(&flight.mission);
        println!(
            "flight {seed} {goal} craft {n} least {:.1} lost {begins} to {ends}: assigned anew {lost:.1?} s later; {} changes, {replayed} plans equal",
            flight.least,
            assigned.len()
        );
    }
}
