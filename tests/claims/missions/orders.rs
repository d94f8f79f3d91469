//! Orders with their callers, retention of missions, and each client's share.

use std::{net::Ipv4Addr, time::Duration};

use axum::http::{HeaderValue, Method, StatusCode};
use serde_json::{Value, json};
use service::{access::Peer, missions::retention::Retention};
use store::EventReader;
use tests::client::{Answer, get, post, send_to, simulated_machine};
use tower::ServiceExt as _;

use super::{Service, heard, live};

/// Largest number of event streams of one client.
const STREAM_SHARE: usize = 128;

impl Service {
    async fn delete(&self, mission: &str) -> Answer {
        let mut request = get(mission);
        *request.method_mut() = Method::DELETE;
        send_to(self.router.clone(), request).await
    }

    async fn orders(&self, query: &str) -> Vec<Value> {
        let listed = self.ask(&format!("/v1/audit{query}")).await;
        listed["orders"].as_array().expect("is a list").clone()
    }

    /// Applies `retention` for a simulated minute.
    async fn keep_for(&self, retention: Retention) {
        let minute = Duration::from_mins(1);
        let kept = self
            .clock
            .timeout(minute, self.missions.clone().keep_for(retention));
        Box::pin(kept).await.expect_err("goes on for ever");
    }
}

fn actions(orders: &[Value]) -> Vec<&str> {
    orders
        .iter()
        .map(|order| order["action"].as_str().expect("is a word"))
        .collect()
}

fn id(mission: &str) -> &str {
    mission.rsplit('/').next().expect("is a path")
}

#[tokio::test(start_paused = true)]
async fn every_order_is_kept_with_its_caller_even_after_deletion() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let mut run = post(&format!("{mission}/run"), "{}".to_owned());
    run.headers_mut()
        .insert("x-request-id", HeaderValue::from_static("from-the-bridge"));
    assert_eq!(send_to(service.router.clone(), run).await.status, StatusCode::OK);
    let now = service.mission_now(&service.ask(&mission).await);
    service.order(&mission, "reports", heard(now)).await;
    for action in ["pause", "pause", "finish"] {
        service.order(&mission, action, json!({})).await;
    }
    let refused = service.post(&format!("{mission}/run"), &json!({})).await;
    assert_eq!(refused.status, StatusCode::CONFLICT);
    assert_eq!(service.delete(&mission).await.status, StatusCode::NO_CONTENT);
    assert_eq!(service.delete(&mission).await.status, StatusCode::NOT_FOUND);

    // Unchanged state is no order, and reports are in the mission's own log.
    let orders = service.orders("").await;
    assert_eq!(actions(&orders), ["create", "run", "pause", "finish", "delete"]);
    assert!(
        orders
            .iter()
            .all(|order| order["mission"] == id(&mission) && order["caller"] == "this program")
    );
    assert_eq!(orders[1]["request_id"], "from-the-bridge");

    let other = service.create(&live()).await;
    let of_other = service.orders(&format!("?mission={}", id(&other))).await;
    assert_eq!(actions(&of_other), ["create"]);
    let page = service.ask("/v1/audit?limit=4").await;
    assert_eq!(page["orders"].as_array().expect("is a list").len(), 4);
    let rest = service.orders(&format!("?after={}", page["next"])).await;
    assert_eq!(actions(&rest), ["delete", "create"]);

    let service = service.restart().await;
    assert_eq!(service.orders("").await.len(), 6);
}

#[tokio::test(start_paused = true)]
async fn finished_and_abandoned_missions_are_deleted_when_due() {
    let service = Service::start().await;
    let [over, silent, heard_of] = [
        service.create(&live()).await,
        service.create(&live()).await,
        service.create(&live()).await,
    ];
    service.order(&over, "finish", json!({})).await;
    service.order(&silent, "run", json!({})).await;

    let none_is_due = Retention {
        over: Some(Duration::from_hours(1)),
        abandoned: Some(Duration::from_hours(1)),
    };
    Box::pin(service.keep_for(none_is_due)).await;
    assert_eq!(service.ask(&over).await["status"], "finished");
    assert_eq!(service.ask(&silent).await["status"], "running");

    let reader = EventReader::of(service.data.path()).expect("opens");
    let over_for = |hours: f64| {
        let before_s = service.clock.unix_s() - 3_600.0 * hours;
        reader.over_before(before_s).expect("is read")
    };
    assert_eq!(over_for(1.0), [""; 0]);
    assert_eq!(over_for(0.0), [id(&over)]);

    let abandoned = Retention {
        over: None,
        abandoned: Some(Duration::from_mins(2)),
    };
    Box::pin(service.keep_for(abandoned)).await;
    assert_eq!(service.ask(&silent).await["status"], "running");
    let now = service.mission_now(&service.ask(&heard_of).await);
    service.order(&heard_of, "reports", heard(now)).await;
    Box::pin(service.keep_for(abandoned)).await;
    assert_eq!(service.ask(&silent).await["status"], "finished");
    assert_eq!(service.ask(&heard_of).await["status"], "created");

    let all_over = Retention {
        over: Some(Duration::ZERO),
        abandoned: None,
    };
    Box::pin(service.keep_for(all_over)).await;
    for gone in [&over, &silent] {
        assert_eq!(service.get(gone).await.status, StatusCode::NOT_FOUND);
    }
    assert_eq!(service.ask(&heard_of).await["status"], "created");
    let orders = service.orders(&format!("?mission={}", id(&silent))).await;
    assert_eq!(actions(&orders), ["create", "run", "expire", "expire"]);
    assert_eq!(orders[2]["caller"], "the service");
}

#[tokio::test(start_paused = true)]
async fn one_client_leaves_the_others_half_of_the_streams() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let stream_of = |last: u8| {
        let mut request = get(&format!("{mission}/events"));
        request
            .extensions_mut()
            .insert(Peer(Ipv4Addr::new(192, 0, 2, last).into()));
        service.router.clone().oneshot(request)
    };
    let mut open = vec![];
    for _ in 0..STREAM_SHARE {
        let stream = stream_of(1).await.expect("answers");
        assert_eq!(stream.status(), StatusCode::OK);
        open.push(stream);
    }
    let refused = stream_of(1).await.expect("answers");
    assert_eq!(refused.status(), StatusCode::TOO_MANY_REQUESTS);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(stream_of(2).await.expect("answers").status(), StatusCode::OK);
    open.pop();
    assert_eq!(stream_of(1).await.expect("answers").status(), StatusCode::OK);
}

#[tokio::test(start_paused = true)]
async fn a_client_without_disk_share_cannot_report_but_its_missions_plan() {
    let data = tempfile::tempdir().expect("is made");
    let service = Service::start_in(simulated_machine(), data, 6_000).await;
    let mission = service.create(&live()).await;
    service.order(&mission, "run", json!({})).await;
    let reports = format!("{mission}/reports");
    let mut accepted = 0;
    let refused = loop {
        let now = service.mission_now(&service.ask(&mission).await);
        let answer = service.post(&reports, &heard(now)).await;
        if answer.status != StatusCode::OK {
            break answer;
        }
        accepted += 1;
        assert!(accepted < 100, "never has its share");
    };
    assert_eq!(refused.status, StatusCode::TOO_MANY_REQUESTS, "{}", refused.text);
    assert_eq!(refused.json()["code"], "share_used");
    assert!(0 < accepted);
    let more = service.post("/v1/missions", &live()).await;
    assert_eq!(more.status, StatusCode::TOO_MANY_REQUESTS, "{}", more.text);
    // The newest plan uses all earlier reports; so do the next ones, which are stored.
    let newest = service.ask(&format!("{mission}/reference?wait_s=10")).await;
    let next = format!("{mission}/reference?wait_s=10&after={}", newest["sequence"]);
    assert!(newest["sequence"].as_u64() < service.ask(&next).await["sequence"].as_u64());
    service.order(&mission, "finish", json!({})).await;
    assert_eq!(service.delete(&mission).await.status, StatusCode::NO_CONTENT);
    service.create(&live()).await;
}

/// The second of two operators' orders rests on a stale view: it is refused with the change.
#[tokio::test(start_paused = true)]
async fn an_order_by_a_stale_view_is_refused_with_the_change() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let tag = |answer: &Answer| answer.headers["etag"].to_str().expect("is text").to_owned();
    let seen = tag(&service.get(&mission).await);
    let call = async |method: &str, path: &str, body: Value, if_match: &str| {
        let mut request = post(path, body.to_string());
        *request.method_mut() = method.parse().expect("is a method");
        let if_match = HeaderValue::from_str(if_match).expect("is a value");
        request.headers_mut().insert("if-match", if_match);
        send_to(service.router.clone(), request).await
    };
    let discs = json!({ "keep_outs": [{ "north_m": 5.0, "east_m": 10.0, "radius_m": 4.0 }] });
    let first = call("PATCH", &mission, discs, &seen).await;
    assert_eq!(first.status, StatusCode::OK, "{}", first.text);
    assert_ne!(tag(&first), seen);
    let finish = format!("{mission}/finish");
    for (method, path, body) in [
        ("PATCH", &mission, json!({ "keep_outs": [] })),
        ("POST", &finish, json!({})),
        ("DELETE", &mission, json!({})),
    ] {
        let second = call(method, path, body, &seen).await;
        assert_eq!(
            second.status,
            StatusCode::PRECONDITION_FAILED,
            "{method}: {}",
            second.text
        );
        let problem = second.problem();
        assert_eq!(problem["code"], "mission_changed");
        let detail = problem["detail"].as_str().expect("is text");
        assert!(
            detail.contains(&tag(&first)) && detail.contains("change by"),
            "{detail}"
        );
    }
    let kept = service.ask(&mission).await;
    assert_eq!(kept["setting"]["keep_outs"][0]["radius_m"], json!(4.0));
    // Reports and plans are no changes of the mission.
    let reports = heard(service.mission_now(&kept));
    assert_eq!(
        service.post(&format!("{mission}/reports"), &reports).await.status,
        StatusCode::OK
    );
    assert_eq!(tag(&service.get(&mission).await), tag(&first));
    let wrong = call("POST", &finish, json!({}), "3").await;
    assert_eq!(wrong.faults(), [(String::new(), "if_match".to_owned())]);
    assert_eq!(call("POST", &finish, json!({}), "*").await.status, StatusCode::OK);
    let now = tag(&service.get(&mission).await);
    let either = format!("\"1\", {now}");
    assert_eq!(
        call("DELETE", &mission, json!({}), &either).await.status,
        StatusCode::NO_CONTENT
    );
}
