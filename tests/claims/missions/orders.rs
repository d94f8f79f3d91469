//! Orders with their callers, retention of missions, and each client's share.

use std::{net::Ipv4Addr, time::Duration};

use axum::http::Method;
use serde_json::{Value, json};
use service::{access::Peer, missions::retention::Retention};
use store::EventReader;
use tests::client::{Answer, fault, get, post, simulated_machine, with};
use tower::ServiceExt as _;

use super::{Service, heard, id, live};

/// Largest number of event streams of one client.
const STREAM_SHARE: usize = 128;

impl Service {
    async fn orders(&self, query: &str) -> Vec<Value> {
        let listed = self.ask(&format!("/v1/audit{query}")).await;
        listed["orders"].as_array().expect("is a list").clone()
    }

    /// Applies `retention` for a simulated minute.
    async fn keep_for(&self, retention: Retention) {
        let kept = self.missions.clone().keep_for(retention);
        let kept = self.clock.timeout(Duration::from_mins(1), kept);
        Box::pin(kept).await.expect_err("goes on for ever");
    }
}

fn actions(orders: &[Value]) -> Vec<&str> {
    orders.iter().map(|order| order["action"].as_str().expect("is a word")).collect()
}

#[tokio::test(start_paused = true)]
async fn every_order_is_kept_with_its_caller_even_after_deletion() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let run = format!("{mission}/run");
    let of_the_bridge = with(post(&run, "{}"), "x-request-id", "from-the-bridge");
    service.send(of_the_bridge).await.must_be(200);
    service.hear(&mission).await;
    for action in ["pause", "pause", "finish"] {
        service.order(&mission, action, json!({})).await;
    }
    service.post(&run, &json!({})).await.must_be(409);
    service.delete(&mission).await.must_be(204);
    service.delete(&mission).await.must_be(404);

    // Unchanged state is no order, and reports are in the mission's own log.
    let orders = service.orders("").await;
    assert_eq!(actions(&orders), ["create", "run", "pause", "finish", "delete"]);
    for order in &orders {
        let of = json!([order["mission"], order["caller"]]);
        assert_eq!(of, json!([id(&mission), "this program"]));
    }
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
    let over = service.create(&live()).await;
    let silent = service.create(&live()).await;
    let heard_of = service.create(&live()).await;
    service.order(&over, "finish", json!({})).await;
    service.order(&silent, "run", json!({})).await;
    let keep_for = async |over: Option<Duration>, abandoned: Option<Duration>| {
        Box::pin(service.keep_for(Retention { over, abandoned })).await;
    };
    let status = async |mission: &str| service.ask(mission).await["status"].clone();

    let hour = Some(Duration::from_hours(1));
    keep_for(hour, hour).await;
    assert_eq!(status(&over).await, "finished");
    assert_eq!(status(&silent).await, "running");

    let reader = EventReader::of(service.data.path()).expect("opens");
    let over_for = |hours: f64| {
        let before_s = service.clock.unix_s() - 3_600.0 * hours;
        reader.over_before(before_s).expect("is read")
    };
    assert_eq!(over_for(1.0), [""; 0]);
    assert_eq!(over_for(0.0), [id(&over)]);

    let two_minutes = Some(Duration::from_mins(2));
    keep_for(None, two_minutes).await;
    assert_eq!(status(&silent).await, "running");
    service.hear(&heard_of).await;
    keep_for(None, two_minutes).await;
    assert_eq!(status(&silent).await, "finished");
    assert_eq!(status(&heard_of).await, "created");

    keep_for(Some(Duration::ZERO), None).await;
    for gone in [&over, &silent] {
        service.get(gone).await.must_be(404);
    }
    assert_eq!(status(&heard_of).await, "created");
    let orders = service.orders(&format!("?mission={}", id(&silent))).await;
    assert_eq!(actions(&orders), ["create", "run", "expire", "expire"]);
    assert_eq!(orders[2]["caller"], "the service");
}

#[tokio::test(start_paused = true)]
async fn one_client_leaves_the_others_half_of_the_streams() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let stream_of = async |last: u8| {
        let mut request = get(&format!("{mission}/events"));
        let peer = Peer(Ipv4Addr::new(192, 0, 2, last).into());
        request.extensions_mut().insert(peer);
        let answer = service.router.clone().oneshot(request).await;
        answer.expect("answers")
    };
    let mut open = vec![];
    for _ in 0..STREAM_SHARE {
        let stream = stream_of(1).await;
        assert_eq!(stream.status(), 200);
        open.push(stream);
    }
    let refused = stream_of(1).await;
    assert_eq!(refused.status(), 429);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(stream_of(2).await.status(), 200);
    open.pop();
    assert_eq!(stream_of(1).await.status(), 200);
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
        let body = heard(service.now(&mission).await);
        let answer = service.post(&reports, &body).await;
        if answer.status != 200 {
            break answer;
        }
        accepted += 1;
        assert!(accepted < 100, "never has its share");
    };
    refused.must_refuse(429, "share_used");
    assert!(0 < accepted);
    service.post("/v1/missions", &live()).await.must_be(429);
    // The newest plan uses all earlier reports; so do the next ones, which are stored.
    let newest = service.ask(&format!("{mission}/reference?wait_s=10")).await;
    service.reference_after(&mission, &newest["sequence"]).await;
    service.order(&mission, "finish", json!({})).await;
    service.delete(&mission).await.must_be(204);
    service.create(&live()).await;
}

/// The second of two operators' orders rests on a stale view: it is refused with the change.
#[tokio::test(start_paused = true)]
async fn an_order_by_a_stale_view_is_refused_with_the_change() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let tag = |answer: &Answer| answer.header("etag").to_owned();
    let seen = tag(&service.get(&mission).await);
    let call = async |method: Method, path: &str, body: Value, if_match: &str| {
        let mut request = with(post(path, body.to_string()), "if-match", if_match);
        *request.method_mut() = method;
        service.send(request).await
    };
    let discs = json!({ "keep_outs": [{ "north_m": 5.0, "east_m": 10.0, "radius_m": 4.0 }] });
    let first = call(Method::PATCH, &mission, discs, &seen).await;
    first.must_be(200);
    assert_ne!(tag(&first), seen);
    let finish = format!("{mission}/finish");
    for (method, path, body) in [
        (Method::PATCH, &mission, json!({ "keep_outs": [] })),
        (Method::POST, &finish, json!({})),
        (Method::DELETE, &mission, json!({})),
    ] {
        let second = call(method, path, body, &seen).await;
        second.must_refuse(412, "mission_changed");
        let problem = second.problem();
        let detail = problem["detail"].as_str().expect("is text");
        let is_told = detail.contains(&tag(&first)) && detail.contains("change by");
        assert!(is_told, "{detail}");
    }
    let kept = service.ask(&mission).await;
    assert_eq!(kept["setting"]["keep_outs"][0]["radius_m"], json!(4.0));
    // Reports and plans are no changes of the mission.
    service.hear(&mission).await;
    assert_eq!(tag(&service.get(&mission).await), tag(&first));
    let finish = async |if_match: &str| call(Method::POST, &finish, json!({}), if_match).await;
    assert_eq!(finish("3").await.faults(), fault("", "if_match"));
    finish("*").await.must_be(200);
    let either = format!("\"1\", {}", tag(&service.get(&mission).await));
    let deleted = call(Method::DELETE, &mission, json!({}), &either).await;
    deleted.must_be(204);
}
