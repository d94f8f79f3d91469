//! A mission link with services that reject tokens, lose missions, repeat plans or are silent.

use ::wire::mission::LiveCraft;
use clock::Clock;
use nalgebra::Vector2;
use planner::snapshot::{VehicleId, VesselStatus};
use serde_json::json;

use super::*;
use crate::{
    Origin,
    mission_client::{Answer, Call, Posted, TokenFile, Transport},
    tests::{mission, planned},
};

/// Calls, with their times.
type Calls = Arc<Mutex<Vec<(Duration, Call)>>>;

/// The outcome of a call.
enum Fate {
    Answered(u16, Value),
    Refused,
    Unanswered,
}

/// Time that an answer takes over a slow satellite link.
const LATENCY: Duration = Duration::from_millis(600);

/// Services in the process, and the calls that came to them.
fn services(clock: &Clock, fate: impl FnMut(&Call) -> Fate + Send + 'static) -> (Transport, Calls) {
    let calls = Calls::default();
    let (seen, timer, start) = (Arc::clone(&calls), clock.clone(), clock.now());
    let fate = Mutex::new(fate);
    let transport = Transport::in_process(clock, move |call| {
        let fate = (fate.lock())(&call);
        seen.lock().push((timer.since(start), call));
        let timer = timer.clone();
        Box::pin(async move {
            match fate {
                Fate::Answered(status, body) => {
                    timer.sleep(LATENCY).await;
                    let body = body.to_string().into_bytes();
                    Ok(Answer { status, body })
                }
                Fate::Refused => Err("connection refused".to_owned()),
                Fate::Unanswered => std::future::pending().await,
            }
        })
    });
    (transport, calls)
}

/// One service.
fn service(
    clock: &Clock,
    mut answer: impl FnMut(&Call) -> (u16, Value) + Send + 'static,
) -> (Transport, Calls) {
    services(clock, move |call| {
        let (status, body) = answer(call);
        Fate::Answered(status, body)
    })
}

fn is_report(call: &Call) -> bool {
    call.path.ends_with("/reports")
}

fn is_for_plan(call: &Call) -> bool {
    call.path.contains("/reference?")
}

fn body(call: &Call) -> String {
    let posted = call.posted.as_ref();
    posted.map_or_else(String::new, |posted| String::from_utf8_lossy(&posted.body).into_owned())
}

fn problem(code: &str) -> Value {
    json!({ "code": code, "detail": "", "errors": [] })
}

fn no_plan_yet() -> (u16, Value) {
    (409, problem("no_plan_yet"))
}

/// The answer of a service that repeats its plan.
fn healthy(call: &Call) -> (u16, Value) {
    let is_for_plan = is_for_plan(call);
    (200, if is_for_plan { planned(1) } else { mission("m-1") })
}

const INTERVAL: Duration = Duration::from_millis(50);

fn opened(clock: &Clock, client: MissionClient, choice: MissionChoice) -> MissionLink {
    MissionLink::open(client, choice, INTERVAL, 1.0, BridgeClock::start(clock))
}

/// A link to one service that joins mission `m-1`.
fn joined(clock: &Clock, token: Option<TokenFile>, transport: Transport) -> MissionLink {
    let client = MissionClient::new(&["http://a".to_owned()], token, transport);
    opened(clock, client, MissionChoice::Joined("m-1".to_owned()))
}

/// A link to one service that finds or creates the mission of `craft`.
fn named(clock: &Clock, transport: Transport) -> MissionLink {
    let client = MissionClient::new(&["http://a".to_owned()], None, transport);
    opened(clock, client, MissionChoice::named("craft".to_owned(), json!({})))
}

/// Has a note to post at each interval, for that long.
async fn noted_for(clock: &Clock, link: &MissionLink, seconds: u64) {
    let end = clock.now() + Duration::from_secs(seconds);
    while clock.now() < end {
        link.note(0.0, "still here");
        clock.sleep(INTERVAL).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_new_token_in_the_file_is_read_after_a_rejection() {
    let file = std::env::temp_dir().join(format!("pilotfish-token-{}", std::process::id()));
    std::fs::write(&file, "old\n").expect("is written");
    let clock = Clock::simulated(0.0);
    let (transport, calls) = service(&clock, |call| {
        if is_report(call) && call.token.as_deref() != Some("new") {
            return (401, problem("unauthenticated"));
        }
        if is_for_plan(call) {
            return no_plan_yet();
        }
        (200, mission("m-1"))
    });
    let token = TokenFile::read(file.clone()).expect("is there");
    let link = joined(&clock, Some(token), transport);
    noted_for(&clock, &link, 5).await;
    let trouble = link.status().trouble.expect("is said");
    assert!(trouble.contains("the token is rejected"), "{trouble}");
    std::fs::write(&file, "new\n").expect("is written");
    noted_for(&clock, &link, 5).await;
    assert_eq!((link.status().trouble, link.status().has_failed), (None, false));
    let calls = calls.lock();
    let reports = calls.iter().filter(|(_, call)| is_report(call));
    let tokens: Vec<_> = reports.map(|(_, call)| call.token.as_deref()).collect();
    let renewed = tokens.iter().position(|token| *token == Some("new"));
    let (before, after) = tokens.split_at(renewed.expect("is read"));
    assert!(1 < before.len() && before.iter().all(|token| *token == Some("old")));
    assert!(1 < after.len() && after.iter().all(|token| *token == Some("new")));
    std::fs::remove_file(&file).expect("is removed");
}

#[tokio::test(start_paused = true)]
async fn a_lost_mission_is_created_again() {
    let clock = Clock::simulated(0.0);
    let mut created = 0;
    let (transport, calls) = service(&clock, move |call| match (call.path.as_str(), &call.posted) {
        ("/v1/missions", Some(_)) => {
            created += 1;
            (201, mission(&format!("m-{created}")))
        }
        (path, None) if path.starts_with("/v1/missions?") => (200, json!({ "missions": [], "next": null })),
        (path, _) if path.contains("m-1/") => (404, problem("no_mission")),
        _ if is_for_plan(call) => no_plan_yet(),
        _ => (200, mission("m-2")),
    });
    let link = named(&clock, transport);
    noted_for(&clock, &link, 10).await;
    assert_eq!(link.status().mission.as_deref(), Some("m-2"));
    assert!(!link.status().has_failed);
    let calls = calls.lock();
    let told = calls.iter().filter(|(_, call)| call.path.contains("m-2/reports"));
    let told: String = told.map(|(_, call)| body(call)).collect();
    assert!(told.contains("the service no longer has mission m-1"), "{told}");
}

#[tokio::test(start_paused = true)]
async fn a_service_without_missions_is_asked_again_each_second() {
    let clock = Clock::simulated(0.0);
    let back = clock.now() + Duration::from_secs(10);
    let timer = clock.clone();
    let (transport, calls) = service(&clock, move |call| match call.path.as_str() {
        path if path.starts_with("/v1/missions?") => (200, json!({ "missions": [], "next": null })),
        _ if timer.now() < back => (404, problem("no_mission")),
        _ if is_for_plan(call) => no_plan_yet(),
        _ => (201, mission("m-1")),
    });
    let link = named(&clock, transport);
    noted_for(&clock, &link, 9).await;
    assert_eq!(link.status().trouble.as_deref(), Some("the service has no such mission"));
    assert!(!link.status().has_failed);
    assert!(calls.lock().len() <= 2 * 9);
    noted_for(&clock, &link, 9).await;
    assert_eq!(link.status().mission.as_deref(), Some("m-1"));
}

#[tokio::test(start_paused = true)]
async fn a_lost_joined_mission_ends_the_bridge_with_the_reason() {
    let clock = Clock::simulated(0.0);
    let mut is_gone = false;
    let (transport, _) = service(&clock, move |call| {
        is_gone |= is_report(call);
        if is_gone {
            (404, problem("no_mission"))
        } else if is_for_plan(call) {
            no_plan_yet()
        } else {
            (200, mission("m-1"))
        }
    });
    let link = joined(&clock, None, transport);
    noted_for(&clock, &link, 10).await;
    assert!(link.status().has_failed);
    let trouble = link.status().trouble.expect("says why");
    assert!(trouble.contains("no such mission"), "{trouble}");
}

#[tokio::test(start_paused = true)]
async fn a_dropped_link_makes_no_calls() {
    let clock = Clock::simulated(0.0);
    let (transport, calls) = service(&clock, healthy);
    let link = joined(&clock, None, transport);
    noted_for(&clock, &link, 5).await;
    drop(link);
    let asked = calls.lock().len();
    clock.sleep(Duration::from_mins(1)).await;
    assert!(2 < asked);
    assert_eq!(calls.lock().len(), asked);
}

fn state() -> MeasuredState {
    MeasuredState {
        t_s: 0.0,
        position: Origin { lat_deg: 38.0, lon_deg: -9.0 },
        heading: 0.0,
        water_velocity: Vector2::zeros(),
        yaw_rate: 0.0,
        ground_velocity: Some(Vector2::zeros()),
        current: Some(Vector2::zeros()),
    }
}

fn fix(auv: &str) -> AuvFix {
    AuvFix::at(auv, 0.0, state().position)
}

#[tokio::test(start_paused = true)]
async fn rejected_reports_are_counted_with_the_last_reason() {
    let clock = Clock::simulated(0.0);
    let (transport, _) = service(&clock, |call| {
        if is_for_plan(call) {
            return no_plan_yet();
        }
        let unlisted = json!({ "pointer": "/auvs/unlisted", "code": "unknown_auv", "detail": "is unknown" });
        match (body(call).contains("unlisted"), body(call).contains(r#""battery":0.5"#)) {
            (true, true) => (200, json!({ "sequence": 1, "rejected": [unlisted] })),
            (true, false) => (422, json!({ "code": "invalid_request", "detail": "", "errors": [unlisted] })),
            (false, _) => (200, mission("m-1")),
        }
    });
    let link = joined(&clock, None, transport);
    let rejected = |count, why: &str| Some((count, why.to_owned()));
    // With an accepted state, and alone.
    link.report_craft(&state(), Some(0.5), false);
    link.report_auv(&fix("unlisted"));
    clock.sleep(Duration::from_secs(5)).await;
    assert_eq!(link.status().rejected, rejected(1, "/auvs/unlisted: is unknown"));
    link.report_auv(&fix("unlisted"));
    clock.sleep(Duration::from_secs(5)).await;
    assert_eq!(link.status().rejected, rejected(2, "rejected (invalid_request): /auvs/unlisted: is unknown"));
}

#[test]
fn values_outside_the_ranges_of_the_api_are_clamped_and_counted() {
    let mut counts = Rejects::default();
    let adrift = MeasuredState {
        water_velocity: Vector2::new(60.0, -7.0),
        ground_velocity: Some(Vector2::new(60.0, 0.0)),
        current: Some(Vector2::new(0.0, 4.0)),
        ..state()
    };
    let report = asc_report(0.0, &adrift, true, &mut counts);
    assert_eq!((report.state.speed_mps, report.state.sway_mps), (20.0, -5.0));
    assert_eq!(report.current.map(|current| current.east_mps), Some(3.0));
    let carried = AuvFix { ground_velocity: Some(Vector2::new(0.0, 12.0)), ..fix("auv-1") };
    assert_eq!(auv_report(&carried, 1.0, &mut counts).speed_mps, Some(10.0));
    // A receiver's accuracy of 5 mm is accepted.
    for (sigma_m, posted) in [(3e-4, 1e-3), (5e-3, 5e-3)] {
        assert_eq!(auv_report(&fix("auv-1"), sigma_m, &mut counts).sigma_m, posted);
    }
    assert_eq!(
        counts.to_string(),
        "AUV's accuracy: 1, AUV's speed: 1, current: 1, ground velocity: 1, speed: 1, sway: 1"
    );
}

#[test]
fn the_service_reads_what_is_posted_as_places_on_earth() {
    let counts = &mut Rejects::default();
    let posted = Reports {
        auvs: [("auv-1".to_owned(), vec![auv_report(&fix("auv-1"), 1.0, counts)])].into(),
        asc: vec![asc_report(0.0, &state(), false, counts)],
        ..Reports::default()
    };
    let body = serde_json::to_vec(&posted).expect("is JSON");
    assert!(!String::from_utf8_lossy(&body).contains("null"));
    let origin = Some(state().position);
    let body = ::wire::Body::parse(&body).expect("is JSON");
    let (read, rejected) = ::wire::read_reports(body, origin, |_| vec![]).expect("is read");
    assert!(rejected.is_empty(), "{rejected:?}");
    let (craft, auv) = (&read.asc[0].state, &read.auvs["auv-1"][0]);
    assert_eq!([craft.north_m, craft.east_m], [0.0; 2]);
    assert_eq!(auv.position(), Vector2::zeros());
    assert!(!read.asc[0].steered);
}

#[test]
fn a_range_is_posted_from_its_transducer_and_without_a_position() {
    let ranged = AuvFix { range_m: Some(31.5), ..fix("auv-1") };
    let report = auv_report(&ranged, 1.0, &mut Rejects::default());
    assert_eq!((report.range_m, report.lat_deg, report.north_m), (Some(31.5), None, None));
    // 0.001° of latitude, by the length of a minute.
    let south = Origin { lat_deg: ranged.position.lat_deg - 0.001, ..ranged.position };
    let [north, east] = from(&south, &ranged).expect("is near");
    assert!((north - 0.06 * 1852.0).abs() < 1.0 && east.abs() < 1e-6, "{north} {east}");
    let body = serde_json::to_value(Report { from: Some([1.0, 2.0]), ..report }).expect("is JSON");
    assert_eq!((&body["from"], body.get("north_m")), (&json!([1.0, 2.0]), None));
}

// Several services that share the mission.

#[tokio::test(start_paused = true)]
async fn a_silent_service_is_left_for_the_next_with_the_same_key() {
    let urls = ["http://without-log", "http://refuses", "http://silent", "http://healthy"].map(str::to_owned);
    let clock = Clock::simulated(0.0);
    let (transport, calls) = services(&clock, |call| {
        let answer = match call.service.as_str() {
            "http://without-log" if is_report(call) => (503, problem("mission_log_unavailable")),
            "http://without-log" if is_for_plan(call) => no_plan_yet(),
            "http://without-log" | "http://healthy" => healthy(call),
            "http://refuses" => return Fate::Refused,
            _ => return Fate::Unanswered,
        };
        Fate::Answered(answer.0, answer.1)
    });
    let client = MissionClient::new(&urls, None, transport);
    let link = opened(&clock, client, MissionChoice::Joined("m-1".to_owned()));
    noted_for(&clock, &link, 20).await;
    let calls = calls.lock();
    let reports: Vec<_> = calls.iter().filter(|(_, call)| is_report(call)).collect();
    let key = |call: &Call| call.posted.as_ref().map(|posted| posted.key.clone());
    let first = reports.iter().filter(|(_, call)| key(call) == key(&reports[0].1));
    let asked: Vec<&String> = first.map(|(_, call)| &call.service).collect();
    // The task that waits for plans also leaves silent services.
    assert!(asked.is_sorted_by_key(|service| urls.iter().position(|url| url == *service)), "{asked:?}");
    assert_eq!((asked.first(), asked.last()), (Some(&&urls[0]), Some(&&urls[3])));
    let found = calls.iter().position(|(_, call)| call.service == urls[3]);
    let rest = &calls[found.expect("is asked")..];
    assert!(3 < rest.len() && rest.iter().all(|(_, call)| call.service == urls[3]));
    // No answer within half of the ten seconds for which a plan is followed.
    assert!(rest[0].0 < Duration::from_secs(5), "{:?}", rest[0].0);
    assert_eq!((link.status().trouble, link.status().has_failed), (None, false));
}

#[tokio::test(start_paused = true)]
async fn the_wait_for_a_single_service_is_four_seconds() {
    let clock = Clock::simulated(0.0);
    let (transport, calls) = services(&clock, |call| {
        if is_report(call) || is_for_plan(call) {
            Fate::Unanswered
        } else {
            Fate::Answered(200, mission("m-1"))
        }
    });
    let link = joined(&clock, None, transport);
    noted_for(&clock, &link, 14).await;
    let trouble = link.status().trouble.expect("is said");
    assert_eq!(trouble, "no answer: nothing within 4s");
    let calls = calls.lock();
    let posted: Vec<Duration> = calls.iter().filter(|(_, call)| is_report(call)).map(|(at, _)| *at).collect();
    let again = Duration::from_secs(4) + RETRY;
    assert!(2 < posted.len() && posted.windows(2).all(|pair| pair[1] == pair[0] + again), "{posted:?}");
}

#[tokio::test(start_paused = true)]
async fn an_older_plan_of_another_service_does_not_replace_a_newer_one() {
    let clock = Clock::simulated(0.0);
    let mut answers = 0;
    let (transport, _) = service(&clock, move |call| {
        if !is_for_plan(call) {
            return (200, mission("m-1"));
        }
        answers += 1;
        (200, planned(if answers == 1 { 7 } else { 5 }))
    });
    let link = joined(&clock, None, transport);
    clock.sleep(Duration::from_secs(10)).await;
    let plan = link.status().plan.expect("is kept for as long as it is valid");
    assert_eq!(plan.answer.sequence, 7);
}

#[tokio::test(start_paused = true)]
async fn a_plan_of_a_newer_service_is_read_without_the_parts_that_no_bridge_uses() {
    let clock = Clock::simulated(0.0);
    let (transport, _) = service(&clock, |call| {
        let mut newer = planned(1);
        newer["plan"]["solver"] = json!({ "status": "of tomorrow" });
        newer["plan"]["violations"] = json!([{ "limit": "of tomorrow" }]);
        newer["plan"]["warnings"] = json!([{ "code": "of_tomorrow", "pointer": "", "detail": "" }]);
        (200, if is_for_plan(call) { newer } else { mission("m-1") })
    });
    let link = joined(&clock, None, transport);
    clock.sleep(Duration::from_secs(2)).await;
    let plan = link.status().plan.expect("is read");
    assert!(plan.warnings().eq(["of_tomorrow"]));
}

#[tokio::test(start_paused = true)]
async fn of_each_vessel_the_newest_position_waits_within_the_ranges_of_the_api() {
    let clock = Clock::simulated(1_000.0);
    let back = clock.now() + Duration::from_secs(10);
    let timer = clock.clone();
    let (transport, calls) = service(&clock, move |call| {
        let is_starting = is_report(call) && timer.now() < back;
        if is_starting { (503, problem("starting")) } else { healthy(call) }
    });
    let link = joined(&clock, None, transport);
    let vessel = |mmsi: u32, t_s: f64| Vessel {
        id: VehicleId(mmsi.to_string()),
        name: None,
        t_s: Some(t_s),
        north_m: IN_DEGREES,
        east_m: IN_DEGREES,
        lat_deg: Some(38.0),
        lon_deg: Some(-9.0),
        course_rad: None,
        speed_mps: Some(70.0),
        heading_rad: None,
        length_m: Some(600.0),
        sigma_m: None,
        plan: Vec::new(),
        status: VesselStatus::AtAnchor,
    };
    link.note(0.0, "the first request is on its way");
    clock.sleep(Duration::from_secs(1)).await;
    link.report_traffic(vec![vessel(1, 1.0), vessel(2, 1.0)]);
    link.report_traffic((0..70).map(|mmsi| vessel(mmsi, 2.0)).collect());
    link.report_traffic(vec![vessel(1, 3.0)]);
    clock.sleep(Duration::from_secs(20)).await;
    let calls = calls.lock();
    let posted: Vec<Value> = calls
        .iter()
        .filter(|(_, call)| is_report(call))
        .filter_map(|(_, call)| serde_json::from_str::<Value>(&body(call)).ok())
        .flat_map(|body| body["traffic"].as_array().cloned().unwrap_or_default())
        .collect();
    // The nearest come first, and more than 64 do not fit into a request.
    let mut ids: Vec<u32> = posted.iter().filter_map(|vessel| vessel["id"].as_str()?.parse().ok()).collect();
    ids.sort_unstable();
    assert!(ids.iter().copied().eq(0..64), "{ids:?}");
    let first = posted.iter().find(|vessel| vessel["id"] == "1").expect("is posted");
    let expected = json!({
        "id": "1", "t_s": 1003.0, "north_m": null, "east_m": null, "lat_deg": 38.0, "lon_deg": -9.0,
        "speed_mps": 60.0, "length_m": 500.0, "status": "at_anchor",
    });
    assert_eq!(first, &expected);
    assert_eq!(link.status().clamped.to_string(), "vessel's length: 73, vessel's speed: 73");
}

#[tokio::test(start_paused = true)]
async fn the_bridge_of_one_craft_of_a_fleet_reports_and_asks_for_that_one() {
    let clock = Clock::simulated(0.0);
    let (transport, calls) = service(&clock, |call| {
        let (status, mut answer) = healthy(call);
        if !is_for_plan(call) {
            let own = json!({ "id": "two & a half", "limits": { "speed_max_mps": 0.7 } });
            answer["setting"]["surface_craft"] = json!([{ "id": "one" }, own]);
        }
        (status, answer)
    });
    let client = MissionClient::new(&["http://a".to_owned()], None, transport);
    let client = client.of_craft(Some("two & a half".to_owned()));
    let link = opened(&clock, client, MissionChoice::Joined("m-1".to_owned()));
    noted_for(&clock, &link, 5).await;
    let limits = link.status().setting.limits.flatten().expect("are those of the craft");
    assert_eq!(limits.speed_max_mps, Some(0.7));
    let calls = calls.lock();
    let reports: Vec<_> =
        calls.iter().filter(|(_, call)| is_report(call)).map(|(_, call)| body(call)).collect();
    assert!(!reports.is_empty() && reports.iter().all(|body| body.contains(r#""craft":"two & a half""#)));
    let mut asked = calls.iter().filter(|(_, call)| is_for_plan(call));
    assert!(asked.all(|(_, call)| call.path.ends_with("&craft=two+%26+a+half")));
}

#[tokio::test(start_paused = true)]
async fn bridges_that_create_their_mission_at_the_same_time_use_the_first() {
    let clock = Clock::simulated(0.0);
    // Between the search and the creation, another bridge has created the same mission.
    let made = Mutex::new(false);
    let setup = MissionChoice::named("craft".to_owned(), json!({}));
    let MissionChoice::Named { digest, .. } = &setup else { panic!("is named") };
    let metadata = json!({ "bridge": "craft", "bridge_setup": digest });
    let (transport, calls) = service(&clock, move |call| {
        let named = |id: &str| {
            let mut mission = mission(id);
            (mission["metadata"], mission["status"]) = (metadata.clone(), json!("created"));
            mission
        };
        let is_creation = call.posted.is_some() && call.path == "/v1/missions";
        *made.lock() |= is_creation;
        let all = if *made.lock() { vec![named("m-1"), named("m-2")] } else { vec![] };
        match call.path.contains("?after=") && !is_for_plan(call) {
            true => (200, json!({ "missions": all })),
            false if is_for_plan(call) => no_plan_yet(),
            false => (200, named(if is_creation { "m-2" } else { "m-1" })),
        }
    });
    let client = MissionClient::new(&["http://a".to_owned()], None, transport);
    let link = opened(&clock, client, setup);
    noted_for(&clock, &link, 5).await;
    assert_eq!(link.status().mission.as_deref(), Some("m-1"));
    let paths: Vec<_> = calls.lock().iter().map(|(_, call)| call.path.clone()).collect();
    assert!(paths.contains(&"/v1/missions/m-2/finish".to_owned()), "{paths:?}");
    assert!(!paths.contains(&"/v1/missions/m-2/run".to_owned()), "{paths:?}");
}

#[tokio::test(start_paused = true)]
async fn the_bridge_of_one_craft_completes_what_the_mission_says_of_it_once() {
    let part = |craft: Value| -> LiveCraft { serde_json::from_value(craft).expect("is a craft") };
    let stated = json!({ "id": "two" });
    let completed = json!({ "id": "two", "limits": { "speed_max_mps": 0.7 } });
    let own = OwnPart { stated: part(stated.clone()), completed: part(completed.clone()) };
    for (known, n_expected) in [(stated, 1), (json!({ "id": "two", "serves": [] }), 0)] {
        let clock = Clock::simulated(0.0);
        let said = Arc::new(Mutex::new(known));
        let named = MissionChoice::named("craft".to_owned(), json!({}));
        let MissionChoice::Named { name, digest, body, .. } = named else { panic!("is named") };
        let metadata = json!({ "bridge": "craft", "bridge_setup": digest });
        let (transport, calls) = service(&clock, move |call| {
            if let Some(Posted { revision: Some(7), body, .. }) = &call.posted {
                let change: Value = serde_json::from_slice(body).expect("is JSON");
                *said.lock() = change["surface_craft"][1].clone();
            }
            let mut mission = mission("m-1");
            (mission["metadata"], mission["revision"]) = (metadata.clone(), json!(7));
            mission["setting"]["surface_craft"] = json!([{ "id": "one" }, *said.lock()]);
            match is_for_plan(call) {
                true => no_plan_yet(),
                false if call.path.contains("?after=") => (200, json!({ "missions": [mission] })),
                false => (200, mission),
            }
        });
        let client = MissionClient::new(&["http://a".to_owned()], None, transport);
        let choice = MissionChoice::Named { name, digest, body, own: Some(Box::new(own.clone())) };
        let link = opened(&clock, client.of_craft(Some("two".to_owned())), choice);
        noted_for(&clock, &link, 5).await;
        let changes = calls
            .lock()
            .iter()
            .filter(|(_, call)| call.posted.as_ref().is_some_and(|posted| posted.revision.is_some()))
            .count();
        assert_eq!(changes, n_expected);
        let limits = link.status().setting.limits.flatten().and_then(|limits| limits.speed_max_mps);
        assert_eq!(limits, if n_expected == 1 { Some(0.7) } else { None });
    }
}
