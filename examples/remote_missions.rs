//! A client of the missions of a Pilotfish server that survives restarts of the server.
//!
//! Requests that change something have an idempotency key and are repeated under it until an
//! answer. A repeated request gets its first answer again and has no second effect.

use std::{
    thread,
    time::{Duration, Instant},
};

use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use ureq::{Body, http::Response};
use wire::mission::{Accepted, CurrentReference, Mission, NewMission, Reports};

/// Longest wait for an answer.
const ANSWER_TIME: Duration = Duration::from_secs(10);
/// Pause between two attempts.
const REST: Duration = Duration::from_millis(200);

/// The missions of one server.
#[derive(Debug)]
pub struct RemoteMissions {
    agent: ureq::Agent,
    url: String,
}

/// A failed request. [`NoAnswer::may_pass`] is `true` if a retry makes sense.
#[derive(Debug, thiserror::Error)]
pub enum NoAnswer {
    /// The server was not reached, or closed the connection.
    #[error("no answer from {url} ({source}); start the server with `cargo run --release`")]
    Gone {
        /// The request's URL.
        url: String,
        /// The cause.
        source: ureq::Error,
    },
    /// The server or its disk is overloaded.
    #[error("{url} is overloaded, try again later: {problem}")]
    Later {
        /// The request's URL.
        url: String,
        /// The problem document.
        problem: Value,
    },
    /// The server refused; the problem document says why.
    #[error("{url} refused: {problem}")]
    Refused {
        /// The request's URL.
        url: String,
        /// The problem document.
        problem: Value,
    },
    /// This client does not know the shape of the answer.
    #[error("this client cannot read the answer of {url}: {source}")]
    Unknown {
        /// The request's URL.
        url: String,
        /// The cause.
        source: ureq::Error,
    },
}

impl NoAnswer {
    /// `true` if the same request may succeed later.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Gone { .. } | Self::Later { .. } => true,
            Self::Refused { .. } | Self::Unknown { .. } => false,
        }
    }

    /// `true` if the mission has no plan yet.
    fn is_no_plan_yet(&self) -> bool {
        matches!(self, Self::Refused { problem, .. } if problem["code"] == "no_plan_yet")
    }
}

/// Repeats a request until it is answered, for at most `patience`.
pub fn insist<T>(patience: Duration, mut ask: impl FnMut() -> Result<T, NoAnswer>) -> Result<T, NoAnswer> {
    let end = Instant::now() + patience;
    loop {
        match ask() {
            Err(error) if error.may_pass() && Instant::now() < end => thread::sleep(REST),
            answer => return answer,
        }
    }
}

impl RemoteMissions {
    /// The missions of the server at `url`, such as `http://127.0.0.1:8080`.
    #[must_use]
    pub fn new(url: &str) -> Self {
        let config = ureq::Agent::config_builder()
            // A refusal has a problem document as its body.
            .http_status_as_error(false)
            .proxy(None)
            .timeout_global(Some(ANSWER_TIME));
        Self {
            agent: config.build().into(),
            url: format!("{}/v1/missions", url.trim_end_matches('/')),
        }
    }

    /// Creates a mission.
    pub fn create(&self, new: &NewMission, key: &str) -> Result<Mission, NoAnswer> {
        self.post("", &json!(new), key)
    }

    /// Starts the mission `id`.
    pub fn run(&self, id: &str, key: &str) -> Result<Mission, NoAnswer> {
        self.post(&format!("/{id}/run"), &json!({}), key)
    }

    /// Ends the mission `id`.
    pub fn finish(&self, id: &str, key: &str) -> Result<Mission, NoAnswer> {
        self.post(&format!("/{id}/finish"), &json!({}), key)
    }

    /// Posts reports. Once answered, they are on the server's disk.
    pub fn report(&self, id: &str, heard: &Reports, key: &str) -> Result<Accepted, NoAnswer> {
        self.post(&format!("/{id}/reports"), &json!(heard), key)
    }

    /// The current reference; none before the first plan.
    pub fn reference(&self, id: &str) -> Result<Option<CurrentReference>, NoAnswer> {
        let url = format!("{}/{id}/reference", self.url);
        let asked = self.agent.get(&url).call();
        match answer(url, asked) {
            Ok(answer) => read(answer).map(Some),
            Err(error) if error.is_no_plan_yet() => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn post<T: DeserializeOwned>(&self, path: &str, body: &Value, key: &str) -> Result<T, NoAnswer> {
        let url = format!("{}{path}", self.url);
        let request = self.agent.post(&url).header("Idempotency-Key", key);
        read(answer(url, request.send_json(body))?)
    }
}

fn read<T: DeserializeOwned>((url, mut response): (String, Response<Body>)) -> Result<T, NoAnswer> {
    response.body_mut().read_json().map_err(|source| match source {
        ureq::Error::Json(_) => NoAnswer::Unknown { url, source },
        _ => NoAnswer::Gone { url, source },
    })
}

fn answer(
    url: String,
    asked: Result<Response<Body>, ureq::Error>,
) -> Result<(String, Response<Body>), NoAnswer> {
    let mut response = match asked {
        Ok(response) => response,
        Err(source) => return Err(NoAnswer::Gone { url, source }),
    };
    let status = response.status();
    if status.is_success() {
        return Ok((url, response));
    }
    // A proxy may answer in another format.
    let problem = response.body_mut().read_json().unwrap_or(Value::Null);
    Err(match status.as_u16() {
        429 | 502..=504 => NoAnswer::Later { url, problem },
        _ => NoAnswer::Refused { url, problem },
    })
}
