//! Campaigns through the API: taken on within limits, flown as the laboratory flies them, shown, stopped and kept.

use std::{fs, num::NonZeroUsize, path::Path, time::Duration};

use axum::{
    Router,
    body::{Body, to_bytes},
    http::{HeaderValue, Method, Request, StatusCode, header},
};
use lab::campaign::{Campaign, Directory, Manifest, ScenarioFiles, Shard, run};
use serde_json::{Value, json};
use service::{
    Settings,
    missions::Missions,
    store::{EventStore, StoreError},
};
use sim::scenario::Scenario;
use tempfile::{TempDir, tempdir};
use tests::client::{Answer, get, post, send_to};
use tokio::time::{Instant, sleep, timeout};
use tower::ServiceExt as _;

/// A wait that takes longer fails the test.
const PATIENCE: Duration = Duration::from_mins(1);

struct Service {
    router: Router,
    missions: Missions,
}

impl Service {
    /// On the store in `data`, as soon as no other service has it.
    async fn start(data: &TempDir) -> Self {
        let store = loop {
            match EventStore::open(data.path()) {
                Err(StoreError::InUse { .. }) => sleep(Duration::from_millis(5)).await,
                opened => break opened.expect("opens"),
            }
        };
        let (router, missions) = service::service(Settings::default(), store)
            .await
            .expect("starts");
        Self { router, missions }
    }

    async fn send(&self, request: Request<Body>) -> Answer {
        send_to(self.router.clone(), request).await
    }

    async fn post(&self, body: &Value) -> Answer {
        self.send(post("/v1/campaigns", body.to_string())).await
    }

    /// Posts a campaign that is taken on, and answers with its path.
    async fn posted(&self, body: &Value) -> String {
        let answer = self.post(body).await;
        assert_eq!(answer.status, StatusCode::ACCEPTED, "{}", answer.text);
        let path = answer.headers["location"].to_str().expect("is text").to_owned();
        assert_eq!(
            path,
            format!("/v1/campaigns/{}", answer.json()["id"].as_str().expect("has one"))
        );
        path
    }

    async fn ask(&self, path: &str) -> Value {
        let answer = self.send(get(path)).await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        answer.json()
    }

    async fn until(&self, path: &str, status: &str) -> Value {
        let end = Instant::now() + PATIENCE;
        loop {
            let seen = self.ask(path).await;
            if seen["status"] == status {
                return seen;
            }
            assert!(Instant::now() < end, "is not {status}: {seen}");
            sleep(Duration::from_millis(10)).await;
        }
    }

    async fn order(&self, method: Method, path: &str) -> Answer {
        let request = Request::builder().method(method).uri(path).body(Body::empty());
        self.send(request.expect("is one")).await
    }

    /// What the stream of events sends until it ends.
    async fn events(&self, path: &str, last: Option<&str>) -> Answer {
        let mut request = get(&format!("{path}/events"));
        if let Some(last) = last {
            let last = HeaderValue::from_str(last).expect("is a number");
            request.headers_mut().insert("last-event-id", last);
        }
        timeout(PATIENCE, self.send(request)).await.expect("ends")
    }

    /// Posts `new`, which is wrong at `pointer` and nowhere else.
    async fn refused(&self, new: &Value, pointer: &str) -> Answer {
        let answer = self.post(new).await;
        assert_eq!(
            answer.status,
            StatusCode::UNPROCESSABLE_ENTITY,
            "{pointer}: {}",
            answer.text
        );
        let faults = answer.faults();
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert_eq!(faults[0].0, pointer, "{}", answer.text);
        answer
    }
}

/// A campaign of a second.
fn small() -> Value {
    json!({ "schema_version": "1", "name": "small", "title": "a small one", "scenarios": ["paper-tracking"], "duration_s": 20,
        "replicates": 15, "tuning": { "replicates": 1 }, "controllers": [
            { "name": "planner", "planner": {} },
            { "name": "line of sight", "law": { "name": "saturated_los" } } ] })
}

/// The same as its file has it.
const SMALL: &str = r#"
schema_version = "1"
name = "small"
title = "a small one"
scenarios = ["paper-tracking"]
duration_s = 20
replicates = 15
[tuning]
replicates = 1
[[controllers]]
name = "planner"
planner = {}
[[controllers]]
name = "line of sight"
law = { name = "saturated_los" }
"#;

/// The same in a scenario of its own, which is called `name` there.
fn with_file(name: &str, text: &str) -> Value {
    let mut new = small();
    new["scenarios"] = json!([name]);
    new["scenario_files"] = json!({ name: text });
    new
}

/// A scenario that is not built in.
fn own() -> String {
    let built_in = Scenario::text("cross-current").expect("is built in");
    built_in.replace("\"cross-current\"", "\"mine\"")
}

/// One that takes hours.
fn long() -> Value {
    json!({ "schema_version": "1", "name": "long", "title": "a long one", "scenarios": ["crowded"], "replicates": 4_000,
        "controllers": [{ "name": "planner", "planner": {} }] })
}

/// The digest of `text` as `pilotfish campaign run` gives it.
fn digest_of(text: &str) -> String {
    let folder = tempdir().expect("there is room");
    let campaign = Campaign::parse(text, "test", ScenarioFiles::default()).expect("is a campaign");
    let manifest = Manifest::of(&campaign, Shard::WHOLE);
    let directory = Directory::create(&folder.path().join("out"), manifest).expect("is made");
    run(&campaign, &directory, NonZeroUsize::MIN, &mut |_| {})
        .expect("is flown")
        .digest()
}

fn data() -> TempDir {
    tempdir().expect("there is room")
}

fn n_folders(data: &TempDir) -> usize {
    fs::read_dir(data.path().join("campaigns"))
        .expect("is there")
        .count()
}

/// Kinds and data of the events of a stream.
fn sent_in(events: &Answer) -> Vec<(String, Value)> {
    let blocks = events.text.split("\n\n");
    let sent = blocks.filter_map(|event| {
        let field = |name: &str| event.lines().find_map(|line| line.strip_prefix(name));
        let data = serde_json::from_str(field("data: ")?).expect("is JSON");
        Some((field("event: ")?.to_owned(), data))
    });
    sent.collect()
}

/// Checks that the report is there in every format, by name and by what is accepted.
async fn check_reports(service: &Service, path: &str) {
    for (query, accept, begin, media_type) in [
        ("", "*/*", "{", "application/json"),
        (
            "",
            "text/html,*/*;q=0.8",
            "<!DOCTYPE html>",
            "text/html; charset=utf-8",
        ),
        (
            "?format=markdown",
            "text/html",
            "# ",
            "text/markdown; charset=utf-8",
        ),
    ] {
        let mut request = get(&format!("{path}/report{query}"));
        let headers = request.headers_mut();
        headers.insert(header::ACCEPT, HeaderValue::from_static(accept));
        let report = service.send(request).await;
        assert_eq!(
            (report.status, report.content_type()),
            (StatusCode::OK, media_type)
        );
        assert!(report.text.starts_with(begin), "{:.80}", report.text);
        assert!(report.text.contains("line of sight"), "{begin}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_campaign_is_flown_told_of_and_reported_as_the_laboratory_does_it() {
    let data = data();
    let service = Service::start(&data).await;
    let path = service.posted(&small()).await;
    let stored = data
        .path()
        .join("campaigns")
        .join(path.rsplit('/').next().expect("has a name"));
    assert!(stored.join("campaign.json").exists() && stored.join("posted.json").exists());
    let early = service.send(get(&format!("{path}/report"))).await;
    assert_eq!(early.status, StatusCode::CONFLICT, "{}", early.text);
    assert!(
        early.problem()["detail"]
            .as_str()
            .is_some_and(|detail| detail.contains("wait for"))
    );

    let events = service.events(&path, None).await;
    assert_eq!(events.content_type(), "text/event-stream");
    let sent = sent_in(&events);
    let (last, data_of_last) = sent.last().expect("there are events");
    assert_eq!((last.as_str(), &data_of_last["status"]), ("done", &json!("done")));
    let runs: Vec<u64> = sent
        .iter()
        .map(|(_, campaign)| campaign["progress"]["runs_done"].as_u64().expect("is counted"))
        .collect();
    assert!(
        runs.is_sorted() && 2 < sent.len() && runs.last() == Some(&30),
        "{runs:?}"
    );
    assert!(sent[..sent.len() - 1].iter().all(|(kind, _)| kind == "progress"));

    let done = service.ask(&path).await;
    assert_eq!(done, *data_of_last);
    assert_eq!(
        (&done["rows"], &done["progress"]["laws_tuned"]),
        (&json!(30), &json!(1))
    );
    assert_eq!(done["digest"], digest_of(SMALL));
    check_reports(&service, &path).await;
    let runs = service
        .router
        .clone()
        .oneshot(get(&format!("{path}/runs")))
        .await
        .expect("answers");
    assert_eq!(
        runs.headers()[header::CONTENT_TYPE],
        "application/vnd.apache.parquet"
    );
    let runs = to_bytes(runs.into_body(), 1 << 20).await.expect("ends");
    assert_eq!(runs, fs::read(stored.join("runs.parquet")).expect("is there"));

    // Browsers stop asking.
    let last = events
        .text
        .rsplit("id: ")
        .next()
        .and_then(|event| event.lines().next());
    let last: u64 = last.and_then(|id| id.parse().ok()).expect("is a number");
    let after = async |last: u64| service.events(&path, Some(&last.to_string())).await;
    assert_eq!(after(last).await.status, StatusCode::NO_CONTENT);
    assert!(after(last - 1).await.text.contains("event: done"));
    let cancelled = service.order(Method::POST, &format!("{path}/cancel")).await;
    assert_eq!(cancelled.status, StatusCode::CONFLICT, "{}", cancelled.text);

    // The same file as TOML, after a restart; what is done is still there.
    service.missions.close();
    drop(service);
    let service = Service::start(&data).await;
    assert_eq!(service.ask(&path).await, done);
    let toml = Request::post("/v1/campaigns").header(header::CONTENT_TYPE, "application/toml");
    let again = service.send(toml.body(Body::from(SMALL)).expect("is one")).await;
    assert_eq!(again.status, StatusCode::ACCEPTED, "{}", again.text);
    let again = again.headers["location"].to_str().expect("is text").to_owned();
    assert_eq!(service.until(&again, "done").await["digest"], done["digest"]);
    let listed = service.ask("/v1/campaigns?limit=1").await;
    assert_eq!(listed["campaigns"], json!([done]));
    let rest = service
        .ask(&format!("/v1/campaigns?after={}", listed["next"]))
        .await;
    assert_eq!(
        (&rest["campaigns"][0]["status"], &rest["next"]),
        (&json!("done"), &Value::Null)
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_campaign_that_is_cancelled_or_deleted_stops_at_once_and_stays_so() {
    let data = data();
    let service = Service::start(&data).await;
    let (first, second) = (service.posted(&long()).await, service.posted(&long()).await);
    service.until(&first, "running").await;
    assert_eq!(service.ask(&second).await["status"], "queued");
    let begun = Instant::now();
    let cancelled = service.order(Method::POST, &format!("{first}/cancel")).await;
    assert_eq!(cancelled.status, StatusCode::OK, "{}", cancelled.text);
    assert_eq!(cancelled.json()["status"], "cancelled");
    service.until(&second, "running").await;
    // A mission of this scenario takes longer.
    assert!(begun.elapsed() < Duration::from_secs(2), "{:?}", begun.elapsed());
    let again = service.order(Method::POST, &format!("{first}/cancel")).await;
    assert_eq!(again.json(), cancelled.json());
    let report = service.send(get(&format!("{first}/report"))).await;
    assert_eq!(report.status, StatusCode::CONFLICT);

    let deleted = service.order(Method::DELETE, &second).await;
    assert_eq!(deleted.status, StatusCode::NO_CONTENT, "{}", deleted.text);
    let gone = service.send(get(&second)).await;
    assert_eq!(
        (gone.status, &gone.problem()["code"]),
        (StatusCode::NOT_FOUND, &json!("no_campaign"))
    );
    let last = service.posted(&small()).await;
    service.until(&last, "done").await;
    assert_eq!(n_folders(&data), 2);

    service.missions.close();
    drop(service);
    let service = Service::start(&data).await;
    assert_eq!(service.ask(&first).await, cancelled.json());
    assert_eq!(service.send(get(&second)).await.status, StatusCode::NOT_FOUND);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_campaign_goes_on_after_a_restart_to_the_same_rows() {
    let data = data();
    let mut new = small();
    new["replicates"] = json!(120);
    let mut service = Service::start(&data).await;
    let path = service.posted(&new).await;
    // In the middle, twice.
    for runs in [1, 60] {
        let end = Instant::now() + PATIENCE;
        while service.ask(&path).await["progress"]["runs_done"].as_u64() < Some(runs) {
            assert!(Instant::now() < end, "comes to no {runs} runs");
            sleep(Duration::from_millis(2)).await;
        }
        let seen = service.ask(&path).await;
        assert_eq!(
            seen["status"], "running",
            "it has to be stopped to show anything: {seen}"
        );
        service.missions.close();
        drop(service);
        service = Service::start(&data).await;
    }
    let done = service.until(&path, "done").await;
    assert_eq!(
        done["digest"],
        digest_of(&SMALL.replace("replicates = 15", "replicates = 120"))
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_campaign_brings_its_scenario_along() {
    let data = data();
    let service = Service::start(&data).await;
    let path = service.posted(&with_file("mine.toml", &own())).await;
    let done = service.until(&path, "done").await;
    let text = SMALL.replace("paper-tracking", "mine.toml");
    let text = format!("{text}\n[scenario_files]\n\"mine.toml\" = '''{}'''\n", own());
    assert_eq!(done["digest"], digest_of(&text));
    assert_ne!(done["digest"], digest_of(SMALL));
}

#[tokio::test]
async fn what_is_wrong_with_a_scenario_of_its_own_is_named_and_no_file_is_read() {
    let data = data();
    let service = Service::start(&data).await;
    let secret = data.path().join("secret.csv");
    fs::write(&secret, "SECRET").expect("is written");
    let water = "north_mps = 0\neast_mps = 0.12";
    let secret_grid = format!("file = {:?}", secret.display().to_string());
    let grid = with_file(
        "mine.toml",
        &own().replace("constant", "grid").replace(water, &secret_grid),
    );
    for (new, pointer) in [
        (with_file("a/b.toml", ""), "/scenario_files/a~1b.toml"),
        (with_file("crowded", &own()), "/scenario_files/crowded"),
        (grid.clone(), "/scenario_files/mine.toml"),
        (
            with_file("mine.toml", &own().replace("lanes = 4", "lanes = 0")),
            "/scenario_files/mine.toml",
        ),
    ] {
        let answer = service.refused(&new, pointer).await;
        assert!(!answer.text.contains("SECRET"));
    }
    let refused = service.refused(&grid, "/scenario_files/mine.toml").await.text;
    assert!(refused.contains("cannot be found"), "{refused}");
}

#[tokio::test]
async fn what_is_wrong_is_named_and_nothing_is_stored() {
    let data = data();
    let service = Service::start(&data).await;
    let secret = data.path().join("mine.toml");
    fs::write(&secret, "SECRET").expect("is written");
    let with = |place: &str, value: Value| {
        let mut new = small();
        *new.pointer_mut(place).expect("is there") = value;
        new
    };
    for (new, pointer) in [
        (
            with("/scenarios", json!(["paper-tracking", "./mine.toml"])),
            "/scenarios/1",
        ),
        (
            with("/scenarios", json!([secret.display().to_string()])),
            "/scenarios/0",
        ),
        (with("/scenarios", json!(["../../etc/passwd"])), "/scenarios/0"),
        (with("/replicates", json!(5_001)), "/replicates"),
        (with("/replicates", json!(-1)), "/replicates"),
        (with("/replicates", json!(0)), "/replicates"),
        (with("/name", json!("A b")), "/name"),
        (with("/duration_s", json!(0.5)), "/duration_s"),
        (
            with("/controllers/1/law/name", json!("none")),
            "/controllers/1/law/name",
        ),
        (
            with("/controllers/1", json!({ "name": "x", "low": {} })),
            "/controllers/1/low",
        ),
        (with("/tuning", Value::Null), "/controllers/1/law/gains"),
        (with("/tuning/replicates", json!(1_000_000)), "/tuning/replicates"),
        (with("/schema_version", json!("2")), "/schema_version"),
    ] {
        let answer = service.refused(&new, pointer).await;
        assert!(!answer.text.contains("SECRET"));
    }
    let runs = service.post(&with("/replicates", json!(5_001))).await;
    let error = &runs.problem()["errors"][0];
    assert_eq!(
        (&error["given"], &error["limit"]["most"]),
        (&json!(10_002), &json!(10_000))
    );
    assert!(
        error["detail"]
            .as_str()
            .is_some_and(|detail| detail.contains("pilotfish campaign run"))
    );

    for (content_type, body, status) in [
        ("application/toml", "name = ", StatusCode::UNPROCESSABLE_ENTITY),
        ("application/json", "{", StatusCode::BAD_REQUEST),
        ("text/plain", SMALL, StatusCode::UNSUPPORTED_MEDIA_TYPE),
        (
            "application/toml; charset=latin1",
            SMALL,
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
        ),
    ] {
        let request = Request::post("/v1/campaigns").header(header::CONTENT_TYPE, content_type);
        let answer = service
            .send(request.body(Body::from(body)).expect("is one"))
            .await;
        assert_eq!(answer.status, status, "{content_type}: {}", answer.text);
        assert!(answer.problem()["detail"].is_string());
    }
    let long = format!("{SMALL}{}", "#".repeat(64 << 10));
    let request = Request::post("/v1/campaigns").header(header::CONTENT_TYPE, "application/toml");
    let answer = service
        .send(request.body(Body::from(long)).expect("is one"))
        .await;
    assert_eq!(answer.faults(), [(String::new(), "too_long".to_owned())]);
    for path in [
        "/v1/campaigns/none",
        "/v1/campaigns/../x/report",
        "/v1/campaigns/%2e%2e/runs",
    ] {
        assert_eq!(
            service.send(get(path)).await.status,
            StatusCode::NOT_FOUND,
            "{path}"
        );
    }
    assert_eq!(service.ask("/v1/campaigns").await, json!({ "campaigns": [] }));
    assert_eq!(n_folders(&data), 0);
}

#[tokio::test]
async fn one_client_has_a_few_campaigns_under_way_and_a_key_stands_for_one() {
    let data = data();
    let service = Service::start(&data).await;
    let keyed = async |body: &Value| {
        let mut request = post("/v1/campaigns", body.to_string());
        let headers = request.headers_mut();
        headers.insert("idempotency-key", HeaderValue::from_static("key-1"));
        service.send(request).await
    };
    let first = keyed(&long()).await;
    assert_eq!(first.status, StatusCode::ACCEPTED, "{}", first.text);
    for _ in 0..3 {
        service.posted(&long()).await;
    }
    let more = service.post(&small()).await;
    assert_eq!(more.status, StatusCode::TOO_MANY_REQUESTS, "{}", more.text);
    assert_eq!(more.problem()["code"], "share_used");
    assert!(more.headers.contains_key("retry-after"));
    let again = keyed(&long()).await;
    assert_eq!((again.status, again.json()), (StatusCode::ACCEPTED, first.json()));
    let taken = keyed(&small()).await;
    assert_eq!(taken.problem()["code"], "idempotency_key_taken");
    let listed = service.ask("/v1/campaigns").await;
    assert_eq!(listed["campaigns"].as_array().map(Vec::len), Some(4));
}

/// The threads of this process that fly campaigns, and their `nice` values.
#[cfg(target_os = "linux")]
fn flyers() -> Vec<i32> {
    let tasks = fs::read_dir("/proc/self/task").expect("is Linux");
    let nice = |task: &Path| {
        let stat = fs::read_to_string(task.join("stat")).ok()?;
        // The name, which may hold spaces, stands in parentheses; nice is the 19th field, counted from 1.
        let (name, rest) = stat.split_once('(')?.1.rsplit_once(") ")?;
        (name == "campaigns").then(|| rest.split(' ').nth(16)?.parse().ok())?
    };
    tasks.filter_map(|task| nice(&task.ok()?.path())).collect()
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn whatever_flies_has_the_lowest_priority() {
    let data = data();
    let service = Service::start(&data).await;
    let path = service.posted(&long()).await;
    service.until(&path, "running").await;
    let end = Instant::now() + PATIENCE;
    // The thread that waits, and the one that it has started.
    while flyers().len() < 2 {
        assert!(Instant::now() < end, "{:?}", flyers());
        sleep(Duration::from_millis(1)).await;
    }
    assert!(flyers().iter().all(|nice| *nice == 19), "{:?}", flyers());
}
