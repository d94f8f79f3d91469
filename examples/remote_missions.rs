//! Missions of a Pilotfish server, as a client asks for them that outlives the server's restarts.
//!
//! Whatever changes something is asked for under a key, and asked for again under the same key until there is an answer:
//! who was acknowledged without hearing of it gets the same answer again, and nothing happens twice.

use std::{
    io::{self, BufRead, BufReader, Read},
    thread,
    time::{Duration, Instant},
};

use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use ureq::{Body, http::Response};
use wire::mission::{Accepted, CurrentReference, Mission, NewMission, Reports};

/// A server that has not answered by then is taken to be gone.
const ANSWER_TIME: Duration = Duration::from_secs(10);
/// Between two attempts at what must succeed.
const REST: Duration = Duration::from_millis(200);

/// The missions of one server.
#[derive(Debug)]
pub struct RemoteMissions {
    agent: ureq::Agent,
    url: String,
}

/// Why there is no answer. Which of them may pass: [`NoAnswer::may_pass`].
#[derive(Debug, thiserror::Error)]
pub enum NoAnswer {
    /// The server was not reached, or broke off.
    #[error("no answer from {url} ({source}); start the server with `cargo run --release`")]
    Gone {
        /// What was asked.
        url: String,
        /// What went wrong.
        source: ureq::Error,
    },
    /// The server has too much to do, or its disk has.
    #[error("{url} is to be asked again later: {problem}")]
    Later {
        /// What was asked.
        url: String,
        /// The problem document.
        problem: Value,
    },
    /// The server refused; the problem document says why.
    #[error("{url} refused: {problem}")]
    Refused {
        /// What was asked.
        url: String,
        /// The problem document.
        problem: Value,
    },
    /// The answer has another shape than this client knows.
    #[error("{url} answered in a shape that this client does not know: {source}")]
    Unknown {
        /// What was asked.
        url: String,
        /// What went wrong.
        source: ureq::Error,
    },
}

impl NoAnswer {
    /// Whether the same request may have an answer later.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Gone { .. } | Self::Later { .. } => true,
            Self::Refused { .. } | Self::Unknown { .. } => false,
        }
    }

    /// Whether the server says that nothing is planned yet.
    fn is_no_plan_yet(&self) -> bool {
        matches!(self, Self::Refused { problem, .. } if problem["code"] == "no_plan_yet")
    }
}

/// Asks again and again what must be answered, for as long as `patience`.
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
    /// Those of the server at `url`, such as `http://127.0.0.1:8080`.
    #[must_use]
    pub fn new(url: &str) -> Self {
        let config = ureq::Agent::config_builder()
            // A refusal has a body worth reading, so it is an answer and not an error of the transport.
            .http_status_as_error(false)
            .timeout_global(Some(ANSWER_TIME));
        Self {
            agent: config.build().into(),
            url: format!("{}/v1/missions", url.trim_end_matches('/')),
        }
    }

    /// Makes a mission.
    pub fn create(&self, new: &NewMission, key: &str) -> Result<Mission, NoAnswer> {
        self.post("", &json!(new), key)
    }

    /// Begins the mission `id`, as fast as it can if it is simulated.
    pub fn run(&self, id: &str, key: &str) -> Result<Mission, NoAnswer> {
        self.post(&format!("/{id}/run"), &json!({}), key)
    }

    /// Ends it.
    pub fn finish(&self, id: &str, key: &str) -> Result<Mission, NoAnswer> {
        self.post(&format!("/{id}/finish"), &json!({}), key)
    }

    /// Tells what was heard. With the answer, it is on the server's disk.
    pub fn report(&self, id: &str, heard: &Reports, key: &str) -> Result<Accepted, NoAnswer> {
        self.post(&format!("/{id}/reports"), &json!(heard), key)
    }

    /// The mission as it is now.
    pub fn mission(&self, id: &str) -> Result<Mission, NoAnswer> {
        read(self.get(&format!("/{id}"))?)
    }

    /// What to steer now; none before the first plan.
    pub fn reference(&self, id: &str) -> Result<Option<CurrentReference>, NoAnswer> {
        match self.get(&format!("/{id}/reference")) {
            Ok(answer) => read(answer).map(Some),
            Err(error) if error.is_no_plan_yet() => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The record of all events, as `format` has it, to be read to its end.
    pub fn record(&self, id: &str, format: &str) -> Result<impl Read + use<>, NoAnswer> {
        let (_, response) = self.get(&format!("/{id}/record?format={format}"))?;
        Ok(response.into_body().into_reader())
    }

    /// The events after number `after`, and those that follow, until the mission is over.
    pub fn events(&self, id: &str, after: u64) -> Result<Events, NoAnswer> {
        let (_, response) = self.get(&format!("/{id}/events?after={after}"))?;
        Ok(Events(BufReader::new(Box::new(
            response.into_body().into_reader(),
        ))))
    }

    /// Answers to these may take as long as the mission does.
    fn get(&self, path: &str) -> Result<(String, Response<Body>), NoAnswer> {
        let url = format!("{}{path}", self.url);
        let request = self.agent.get(&url).config().timeout_global(None);
        let request = request.timeout_recv_response(Some(ANSWER_TIME)).build();
        answer(url, request.call())
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

/// A mission's events, as they come. The stream may break off at any time: what follows is asked for with the last
/// event's number.
pub struct Events(BufReader<Box<dyn Read + Send>>);

/// An event, or the news that some were missed.
#[derive(Clone, Debug, PartialEq)]
pub struct MissionEvent {
    /// Its number in the mission; a gap has none.
    pub sequence: Option<u64>,
    /// Its kind, such as `planned`, or `gap`.
    pub kind: String,
    /// Its data.
    pub data: Value,
}

impl Iterator for Events {
    type Item = io::Result<MissionEvent>;

    fn next(&mut self) -> Option<Self::Item> {
        let (mut sequence, mut kind, mut data) = (None, String::new(), String::new());
        let mut line = String::new();
        loop {
            line.clear();
            match self.0.read_line(&mut line) {
                // An event that is not whole does not count.
                Ok(0) => return None,
                Err(error) => return Some(Err(error)),
                Ok(_) => {}
            }
            let text = line.trim_end_matches(['\r', '\n']);
            match text.split_once(':') {
                Some((field, value)) => {
                    let value = value.strip_prefix(' ').unwrap_or(value);
                    match field {
                        "id" => sequence = value.parse().ok(),
                        "event" => value.clone_into(&mut kind),
                        "data" => data.push_str(value),
                        // Comments say that the stream lives.
                        _ => {}
                    }
                }
                None if text.is_empty() && !data.is_empty() => {
                    let data = serde_json::from_str(&data).map_err(io::Error::from);
                    return Some(data.map(|data| MissionEvent { sequence, kind, data }));
                }
                None => {}
            }
        }
    }
}
