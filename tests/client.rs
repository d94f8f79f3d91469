//! Asks the service without a socket.

use axum::body::{Body, to_bytes};
use axum::http::{HeaderMap, HeaderValue, Request, StatusCode};
use clock::Clock;
use serde_json::Value;
use service::{Settings, app};
use tower::ServiceExt;

/// Longest answer read, bytes.
const ANSWER_BYTES_MAX: usize = 32 << 20;

/// Unix time at the start of a simulated machine, s.
pub const START_S: f64 = 1.8e9;

/// A service on a simulated machine: the same answers on any processor if Tokio's time is paused.
pub fn simulated_machine() -> Settings {
    Settings { clock: Clock::simulated(START_S), planners: 2, ..Settings::default() }
}

/// An answer, read to its end.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Status.
    pub status: StatusCode,
    /// Headers.
    pub headers: HeaderMap,
    /// Body.
    pub text: String,
}

impl Answer {
    /// The body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.text).expect("the answer is JSON")
    }

    /// Asserts the status.
    pub fn must_be(&self, status: u16) {
        assert_eq!(self.status.as_u16(), status, "{}", self.text);
    }

    /// Asserts status and code of a refusal.
    pub fn must_refuse(&self, status: u16, code: &str) {
        self.must_be(status);
        assert_eq!(self.problem()["code"], code, "{}", self.text);
    }

    /// Asserts that the text is in the answer.
    pub fn must_say(&self, text: &str) {
        assert!(self.text.contains(text), "{text} is not in {}", self.text);
    }

    /// The body as JSON, of an answer that must have that status.
    pub fn expected(&self, status: u16) -> Value {
        self.must_be(status);
        self.json()
    }

    /// The header, as text; empty without one.
    pub fn header(&self, name: &str) -> &str {
        let value = self.headers.get(name);
        value.map_or("", |value| value.to_str().unwrap_or_default())
    }

    /// The content type.
    pub fn content_type(&self) -> &str {
        self.header("content-type")
    }

    /// The problem document, after checking what every one has.
    pub fn problem(&self) -> Value {
        assert_eq!(self.content_type(), "application/problem+json", "{}", self.text);
        let document = self.json();
        for member in ["type", "title", "detail", "instance", "code", "request_id"] {
            let text = document[member].as_str().unwrap_or_default();
            assert!(!text.is_empty(), "{member} is empty: {document}");
        }
        assert_eq!(document["status"], self.status.as_u16());
        assert!(document["errors"].is_array());
        document
    }

    /// Pointer and code of each field error.
    pub fn faults(&self) -> Vec<(String, String)> {
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let document = self.problem();
        let errors = document["errors"].as_array().into_iter().flatten();
        let faults = errors.map(|error| (text(&error["pointer"]), text(&error["code"])));
        faults.collect()
    }
}

/// The list of that one fault.
pub fn fault(pointer: &str, code: &str) -> Vec<(String, String)> {
    vec![(pointer.to_owned(), code.to_owned())]
}

/// Sends `request` to a service built with `settings`.
pub async fn send(settings: Settings, request: Request<Body>) -> Answer {
    send_to(app(settings), request).await
}

/// The JSON of `path`, which is there, on a simulated machine.
pub async fn served(path: &str) -> Value {
    send(simulated_machine(), get(path)).await.expected(200)
}

/// The JSON of the answer to `body`, posted to `path` and accepted, on a simulated machine.
pub async fn answered(path: &str, body: impl Into<Body>) -> Value {
    send(simulated_machine(), post(path, body)).await.expected(200)
}

/// Sends `request` to `service`.
pub async fn send_to(service: axum::Router, request: Request<Body>) -> Answer {
    let response = service.oneshot(request).await.expect("a router always answers");
    let (parts, body) = response.into_parts();
    let bytes = to_bytes(body, ANSWER_BYTES_MAX).await.expect("the body ends");
    let text = String::from_utf8(bytes.to_vec()).expect("answers are UTF-8");
    Answer { status: parts.status, headers: parts.headers, text }
}

/// A request without a body.
pub fn call(method: &str, path: &str) -> Request<Body> {
    let request = Request::builder().method(method).uri(path);
    request.body(Body::empty()).expect("the test gives a path")
}

/// A GET request.
pub fn get(path: &str) -> Request<Body> {
    call("GET", path)
}

/// A POST request with a JSON body.
pub fn post(path: &str, body: impl Into<Body>) -> Request<Body> {
    let mut request = with(call("POST", path), "content-type", "application/json");
    *request.body_mut() = body.into();
    request
}

/// The request with that header.
pub fn with(mut request: Request<Body>, name: &'static str, value: &str) -> Request<Body> {
    let value = HeaderValue::from_bytes(value.as_bytes()).expect("the test gives a value");
    request.headers_mut().insert(name, value);
    request
}

/// The body of an example.
pub fn example(name: &str) -> Value {
    let example = service::examples::EXAMPLES.iter().find(|example| example.name == name);
    serde_json::from_str(example.expect("the test names an example").body).expect("examples are JSON")
}
