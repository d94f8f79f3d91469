//! Streams of a mission's events.

use std::sync::Arc;

use axum::{body::Body, http::Request};
use futures_util::StreamExt as _;
use serde_json::json;
use tests::client::{get, with};
use tower::ServiceExt as _;

use super::{Service, live, short_scenario};

/// A stream of events that is read piece by piece.
struct Stream {
    pieces: axum::body::BodyDataStream,
    text: String,
}

impl Stream {
    async fn of(service: &Service, request: Request<Body>) -> Self {
        let answer = service.router.clone().oneshot(request).await.expect("answers");
        assert_eq!(answer.status(), 200);
        Self { pieces: answer.into_body().into_data_stream(), text: String::new() }
    }

    /// Reads until the event of that number has come, or to the end.
    async fn read_to(&mut self, last: u64) -> &str {
        while !self.text.contains(&format!("id: {last}\n"))
            && let Some(piece) = self.pieces.next().await
        {
            let piece = piece.expect("is whole");
            self.text.push_str(std::str::from_utf8(&piece).expect("is text"));
        }
        &self.text
    }
}

/// The text of the whole stream.
pub(super) async fn read(service: &Service, request: Request<Body>) -> String {
    let mut stream = Stream::of(service, request).await;
    stream.read_to(u64::MAX).await.to_owned()
}

fn ids(text: &str) -> Vec<u64> {
    let ids = text.lines().filter_map(|line| line.strip_prefix("id: "));
    ids.map(|id| id.parse().expect("is a number")).collect()
}

#[tokio::test(start_paused = true)]
async fn a_stream_sends_every_event_once_from_the_reader_s_position_on() {
    let service = Arc::new(Service::start().await);
    let mission = service.create(&short_scenario()).await;
    service.order(&mission, "step", json!({ "ticks": 20 })).await;
    let events = format!("{mission}/events");
    let mut whole = Stream::of(&service, get(&format!("{events}?after=0"))).await;
    assert_eq!(ids(whole.read_to(21).await), (1..=21).collect::<Vec<_>>());

    let resumed = with(get(&events), "last-event-id", "7");
    let shared = Arc::clone(&service);
    let reader = tokio::spawn(async move { read(&shared, resumed).await });
    service.order(&mission, "run", json!({})).await;
    let finished = service.until(&mission, "finished").await;
    let last = finished["sequence"].as_u64().expect("is a number");
    let text = reader.await.expect("does not panic");
    assert_eq!(ids(&text), (8..=last).collect::<Vec<_>>());
    assert!(text.contains("event: finished"));
    // Nothing more comes, which keeps a browser from asking for ever.
    for after in [last, u64::MAX] {
        service.get(&format!("{events}?after={after}")).await.must_be(204);
    }
}

#[tokio::test(start_paused = true)]
async fn a_slow_reader_learns_the_numbers_of_missed_events() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let mut stream = Stream::of(&service, get(&format!("{mission}/events"))).await;
    service.hear(&mission).await;
    stream.read_to(2).await;
    for _ in 0..100 {
        service.hear(&mission).await;
    }
    let text = stream.read_to(102).await;
    assert_eq!(text.matches("event: gap").count(), 1);
    // The last 64 are kept for a client that is behind.
    let gap = r#"data: {"from":3,"kind":"gap","to":38}"#;
    assert!(text.contains(gap), "{text}");
    assert_eq!(ids(text), [2].into_iter().chain(39..=102).collect::<Vec<_>>());
}
