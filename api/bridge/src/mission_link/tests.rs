//! A mission link beside services that reject tokens, lose missions, repeat plans and do not answer.

use std::{
    io::{Read as _, Write as _},
    net::TcpListener,
    sync::mpsc::{Receiver, channel},
};

use nalgebra::Vector2;

use super::*;
use crate::{Geographic, mission_client::TokenFile};

mod services;

/// The machine may be busy.
const PATIENCE: Duration = Duration::from_mins(1);

/// A request as a service sees it: method and path, the token, and the idempotency key.
#[derive(Debug)]
struct Request {
    line: String,
    authorization: String,
    key: String,
    body: String,
}

/// Answers each request, one to a connection, with status and body; returns the address.
fn service(mut answer: impl FnMut(&Request) -> (u16, Value) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("is bound");
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.expect("is accepted");
            let Some(request) = read_request(&mut stream) else {
                continue;
            };
            let (status, body) = answer(&request);
            let body = body.to_string();
            let head = format!(
                "HTTP/1.1 {status} -\r\ncontent-length: {}\r\nconnection: close\r\n\r\n",
                body.len()
            );
            // The client may have given up.
            let _ = stream.write_all((head + &body).as_bytes());
        }
    });
    format!("http://{address}")
}

fn read_request(stream: &mut std::net::TcpStream) -> Option<Request> {
    let (mut bytes, mut buffer) = (vec![], [0; 4096]);
    loop {
        let count = stream.read(&mut buffer).ok().filter(|count| *count > 0)?;
        bytes.extend_from_slice(&buffer[..count]);
        let text = String::from_utf8_lossy(&bytes).to_lowercase();
        let Some((head, body)) = text.split_once("\r\n\r\n") else {
            continue;
        };
        let field = |name: &str| {
            let field = head.lines().find_map(|line| line.strip_prefix(name));
            field.unwrap_or_default().trim().to_owned()
        };
        if body.len() >= field("content-length:").parse().unwrap_or(0) {
            return Some(Request {
                line: head.lines().next().unwrap_or_default().to_owned(),
                authorization: field("authorization:"),
                key: field("idempotency-key:"),
                body: body.to_owned(),
            });
        }
    }
}

fn mission(id: &str) -> Value {
    json!({ "id": id, "status": "running", "metadata": {} })
}

fn problem(code: &str) -> Value {
    json!({ "code": code, "detail": "", "errors": [] })
}

/// A link that joins, or creates, a mission, and has a note to post every 50 ms.
fn link(urls: &[String], token: Option<TokenFile>, choice: MissionChoice) -> MissionLink {
    let client = MissionClient::new(urls, token, None).expect("needs no certificate");
    let link = MissionLink::open(client, choice, Duration::from_millis(50), 1.0, Clock::start());
    let noted = link.clone();
    thread::spawn(move || {
        loop {
            noted.note(0.0, "still here");
            thread::sleep(Duration::from_millis(50));
        }
    });
    link
}

fn waits_for<T>(what: &Receiver<T>) -> T {
    what.recv_timeout(PATIENCE).expect("happens")
}

#[test]
fn a_new_token_in_the_file_is_read_after_a_rejection() {
    let folder = std::env::temp_dir().join(format!("pilotfish-token-{}", std::process::id()));
    std::fs::write(&folder, "old\n").expect("is written");
    let (sender, rejected) = channel();
    let (accepted, posted) = channel();
    let url = service(move |request| {
        if request.line.contains("/reports") {
            let is_valid = request.authorization == "bearer new";
            // The test may have ended.
            let _ = if is_valid { &accepted } else { &sender }.send(());
            if !is_valid {
                return (401, problem("unauthenticated"));
            }
        }
        if request.line.contains("/reference") {
            (409, problem("no_plan_yet"))
        } else {
            (200, mission("m-1"))
        }
    });
    let token = TokenFile::read(folder.clone()).expect("is there");
    let link = link(&[url], Some(token), MissionChoice::Joined("m-1".to_owned()));
    waits_for(&rejected);
    std::fs::write(&folder, "new\n").expect("is written");
    waits_for(&posted);
    assert!(!link.status().has_failed);
    std::fs::remove_file(&folder).expect("is removed");
}

#[test]
fn a_mission_that_the_service_lost_is_created_again() {
    let (sender, posted) = channel();
    let mut created = 0;
    let url = service(move |request| {
        let line = request.line.as_str();
        if line.starts_with("get /v1/missions?") {
            return (200, json!({ "missions": [], "next": null }));
        }
        if line.starts_with("post /v1/missions ") {
            created += 1;
            return (201, mission(&format!("m-{created}")));
        }
        if line.contains("m-1/") {
            return (404, problem("no_mission"));
        }
        if line.contains("m-2/reports") {
            let _ = sender.send(());
        }
        if line.contains("/reference") {
            (409, problem("no_plan_yet"))
        } else {
            (200, mission("m-2"))
        }
    });
    let choice = MissionChoice::named("craft".to_owned(), json!({ "live": {}, "metadata": {} }));
    let link = link(&[url], None, choice);
    waits_for(&posted);
    assert_eq!(link.status().mission.as_deref(), Some("m-2"));
    assert!(!link.status().has_failed);
}

#[test]
fn a_joined_mission_that_is_gone_ends_the_bridge_with_the_reason() {
    let mut is_gone = false;
    let url = service(move |request| {
        if request.line.contains("/reports") {
            is_gone = true;
        }
        if is_gone {
            (404, problem("no_mission"))
        } else if request.line.contains("/reference") {
            (409, problem("no_plan_yet"))
        } else {
            (200, mission("m-1"))
        }
    });
    let link = link(&[url], None, MissionChoice::Joined("m-1".to_owned()));
    let end = Instant::now() + PATIENCE;
    while !link.status().has_failed {
        assert!(Instant::now() < end, "{:?}", link.status());
        thread::sleep(Duration::from_millis(20));
    }
    let trouble = link.status().trouble.expect("says why");
    assert!(trouble.contains("no such mission"), "{trouble}");
}

fn state() -> MeasuredState {
    MeasuredState {
        t_s: 0.0,
        position: Geographic {
            lat_deg: 38.0,
            lon_deg: -9.0,
        },
        heading: 0.0,
        water_velocity: Vector2::zeros(),
        yaw_rate: 0.0,
        ground_velocity: Some(Vector2::zeros()),
        current: Some(Vector2::zeros()),
    }
}

fn fix(auv: &str) -> AuvFix {
    AuvFix {
        auv: auv.to_owned(),
        t_s: 0.0,
        position: state().position,
        sigma_m: None,
        depth_m: None,
        ground_velocity: None,
    }
}

#[test]
fn reports_that_the_service_rejects_are_counted_with_the_last_reason() {
    let url = service(move |request| {
        if request.line.contains("/reference") {
            return (409, problem("no_plan_yet"));
        }
        let unlisted = json!({ "pointer": "/auvs/unlisted", "code": "unknown_auv", "detail": "is unknown" });
        if request.body.contains("unlisted") && request.body.contains("asc") {
            return (200, json!({ "rejected": [unlisted] }));
        }
        if request.body.contains("unlisted") {
            return (
                422,
                json!({ "code": "invalid_request", "detail": "", "errors": [unlisted] }),
            );
        }
        (200, mission("m-1"))
    });
    let choice = MissionChoice::Joined("m-1".to_owned());
    let client = MissionClient::new(&[url], None, None).expect("needs no certificate");
    let link = MissionLink::open(client, choice, Duration::from_millis(50), 1.0, Clock::start());
    let end = Instant::now() + PATIENCE;
    let waits_for_rejects = |count| {
        while link
            .status()
            .rejected
            .as_ref()
            .is_none_or(|(found, _)| *found < count)
        {
            assert!(Instant::now() < end, "{:?}", link.status());
            thread::sleep(Duration::from_millis(20));
        }
        link.status().rejected.map(|(_, why)| why)
    };
    // With a state, which is accepted, and alone.
    link.report_craft(&state(), false);
    link.report_auv(&fix("unlisted"));
    let why = waits_for_rejects(1);
    assert_eq!(why.as_deref(), Some("/auvs/unlisted: is unknown"));
    link.report_auv(&fix("unlisted"));
    let why = waits_for_rejects(2);
    assert_eq!(
        why.as_deref(),
        Some("rejected (invalid_request): /auvs/unlisted: is unknown")
    );
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
    assert_eq!(report["state"]["speed_mps"], 20.0);
    assert_eq!(report["state"]["sway_mps"], -5.0);
    assert_eq!(report["current"]["east_mps"], 3.0);
    let carried = AuvFix {
        sigma_m: Some(3e-3),
        ground_velocity: Some(Vector2::new(0.0, 12.0)),
        ..fix("auv-1")
    };
    let report = auv_report(&carried, 1.0, &mut counts);
    assert_eq!(
        (report["speed_mps"].as_f64(), report["sigma_m"].as_f64()),
        (Some(10.0), Some(0.01))
    );
    assert_eq!(
        counts.to_string(),
        "AUV's accuracy: 1, AUV's speed: 1, current: 1, ground velocity: 1, speed: 1, sway: 1"
    );
}

/// Answer of `…/reference` with a plan of this number.
fn planned(sequence: u64) -> Value {
    let reference = json!({ "speed_mps": 1.0, "heading_rad": 0.0, "valid_until_s": 1e9 });
    let point = json!({ "t_s": 0.0, "north_m": 0.0, "east_m": 0.0, "speed_mps": 1.0, "heading_rad": 0.0 });
    let plan = json!({
        "method": format!("mpc-{sequence}"), "outcome": "ok",
        "reference": reference, "baseline": reference, "trajectory": [point], "goal": { "trajectory": [point] },
    });
    json!({ "t_s": 0.0, "age_s": 0.0, "sequence": sequence, "status": "running", "plan": plan })
}

#[test]
fn a_plan_that_the_service_repeats_keeps_the_time_of_its_arrival() {
    let (sender, repeated) = channel();
    let url = service(move |request| {
        if !request.line.contains("/reference") {
            return (200, mission("m-1"));
        }
        let _ = sender.send(());
        (200, planned(7))
    });
    let link = link(&[url], None, MissionChoice::Joined("m-1".to_owned()));
    let arrived = |link: &MissionLink| link.status().plan.map(|plan| plan.arrived_s);
    let end = Instant::now() + PATIENCE;
    while arrived(&link).is_none() {
        assert!(Instant::now() < end, "no plan");
        thread::sleep(Duration::from_millis(20));
    }
    let first = arrived(&link);
    // Of three more requests, two answers at least have been read.
    repeated.try_iter().for_each(drop);
    for _ in 0..3 {
        waits_for(&repeated);
    }
    assert_eq!(arrived(&link), first);
}
