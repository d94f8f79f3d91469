//! The calls of a live mission, as a client of the service makes them. JSON in the service's words, and no code of its own.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use ureq::{
    Body,
    http::Response,
    tls::{Certificate, RootCerts, TlsConfig},
};

/// A call that has no answer by then is made again, under the same key: a plan may be followed for ten seconds, and what the craft
/// reports is to come in before that.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(4);
/// How long the service holds a call for a plan that is not there yet, s.
const WAIT_S: u32 = 2;
/// Members of a mission's metadata by which a bridge finds its own: its name, and the digest of what it was asked for.
const BRIDGE: &str = "bridge";
const WANTED: &str = "bridge_setup";

/// One service.
#[derive(Debug)]
pub struct Missions {
    agent: ureq::Agent,
    url: String,
    token: Option<String>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoAnswer {
    /// Not reached, broken off, or too busy: the same again later.
    #[error("no answer: {0}")]
    Later(String),
    /// Refused, by the service or before it was asked.
    #[error("refused ({code}): {detail}")]
    Refused {
        /// The problem's code.
        code: String,
        /// What is wrong, and what would do.
        detail: String,
    },
}

/// A mission, as far as a bridge cares.
#[derive(Clone, Debug, Deserialize)]
pub struct MissionNow {
    /// Its name.
    pub id: String,
    /// Where it is in its life.
    pub status: String,
    /// What was said of it when it was made.
    #[serde(default)]
    pub metadata: Value,
}

/// Some of the missions.
#[derive(Debug, Deserialize)]
struct Page {
    missions: Vec<MissionNow>,
    next: Option<u64>,
}

impl MissionNow {
    /// Whether it can go on.
    #[must_use]
    pub fn is_over(&self) -> bool {
        matches!(self.status.as_str(), "finished" | "failed")
    }
}

/// What is posted at once.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Reports {
    /// Fixes, by AUV.
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub auvs: Map<String, Value>,
    /// States of the surface craft.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub asc: Vec<Value>,
    /// What the bridge did, for the mission's log.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Value>,
}

impl Missions {
    /// Those of the service at `url`, for which `token` speaks where it wants one. `certificate`, PEM, is what a service with a
    /// certificate of its own is known by; without one, the roots that browsers know count.
    pub fn new(url: &str, token: Option<String>, certificate: Option<&[u8]>) -> Result<Self, ureq::Error> {
        let mut tls = TlsConfig::builder();
        if let Some(pem) = certificate {
            tls = tls.root_certs(RootCerts::from([Certificate::from_pem(pem)?]));
        }
        let config = ureq::Agent::config_builder()
            .tls_config(tls.build())
            // A refusal has a body worth reading.
            .http_status_as_error(false)
            .timeout_global(Some(ANSWER_TIMEOUT));
        Ok(Self {
            agent: config.build().into(),
            url: format!("{}/v1/missions", url.trim_end_matches('/')),
            token,
        })
    }

    /// The mission that goes on under `name`, or a new one of `body`; a bridge that is started again finds its own. `wanted` is what its
    /// operator asked for: a mission of that name with other wishes is not touched.
    pub fn find_or_make(&self, name: &str, wanted: &str, body: &Value) -> Result<MissionNow, NoAnswer> {
        let mut after = 0;
        loop {
            let page: Page = self.get(&format!("?after={after}"))?;
            let is_ours = |mission: &&MissionNow| mission.metadata[BRIDGE] == name && !mission.is_over();
            if let Some(found) = page.missions.iter().find(is_ours) {
                return if found.metadata[WANTED] == wanted {
                    self.begun(found.clone())
                } else {
                    Err(NoAnswer::Refused {
                        code: "another_setup".to_owned(),
                        detail: format!(
                            "mission {} goes on under the name {name:?} with another setup: finish it (POST …/finish), or choose \
                             another --name",
                            found.id
                        ),
                    })
                };
            }
            match page.next {
                Some(next) => after = next,
                None => break,
            }
        }
        let mut body = body.clone();
        body["metadata"][BRIDGE] = name.into();
        body["metadata"][WANTED] = wanted.into();
        let made = self.post("", &body, &format!("bridge-{name}-{}", unix_ns()))?;
        self.begun(serde_json::from_value(made).map_err(|error| NoAnswer::Later(error.to_string()))?)
    }

    /// The mission, which is run if it was only made.
    pub fn begun(&self, mission: MissionNow) -> Result<MissionNow, NoAnswer> {
        if mission.status == "created" {
            let path = format!("/{}/run", mission.id);
            self.post(&path, &json!({}), &format!("{}-run", mission.id))?;
        }
        Ok(mission)
    }

    /// The mission `id`.
    pub fn mission(&self, id: &str) -> Result<MissionNow, NoAnswer> {
        self.get(&format!("/{id}"))
    }

    /// Posts what was heard. With the answer it is on the service's disk.
    pub fn report(&self, id: &str, reports: &Reports, key: &str) -> Result<(), NoAnswer> {
        let body = serde_json::to_value(reports).map_err(|error| NoAnswer::Later(error.to_string()))?;
        self.post(&format!("/{id}/reports"), &body, key).map(drop)
    }

    /// The newest plan after the event `after`, waited for some seconds; none while there is none.
    pub fn reference(&self, id: &str, after: u64) -> Result<Option<Value>, NoAnswer> {
        match self.get(&format!("/{id}/reference?wait_s={WAIT_S}&after={after}")) {
            Err(NoAnswer::Refused { code, .. }) if code == "no_plan_yet" => Ok(None),
            answer => answer.map(Some),
        }
    }

    fn get<T: for<'de> Deserialize<'de>>(&self, path: &str) -> Result<T, NoAnswer> {
        let mut request = self.agent.get(format!("{}{path}", self.url));
        if let Some(token) = &self.token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        read(request.call())
    }

    fn post(&self, path: &str, body: &Value, key: &str) -> Result<Value, NoAnswer> {
        let mut request = self
            .agent
            .post(format!("{}{path}", self.url))
            .header("idempotency-key", key);
        if let Some(token) = &self.token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        read(request.send_json(body))
    }
}

fn read<T: for<'de> Deserialize<'de>>(answer: Result<Response<Body>, ureq::Error>) -> Result<T, NoAnswer> {
    let mut answer = answer.map_err(|error| NoAnswer::Later(error.to_string()))?;
    let status = answer.status();
    if status.is_success() {
        return answer
            .body_mut()
            .read_json()
            .map_err(|error| NoAnswer::Later(error.to_string()));
    }
    let problem: Value = answer.body_mut().read_json().unwrap_or_default();
    let detail = match problem["errors"].as_array() {
        Some(errors) if !errors.is_empty() => errors
            .iter()
            .map(|error| format!("{}: {}", text(error, "pointer"), text(error, "detail")))
            .collect::<Vec<_>>()
            .join("; "),
        _ => text(&problem, "detail"),
    };
    if status.is_server_error() || status.as_u16() == 429 {
        return Err(NoAnswer::Later(format!("{status}: {detail}")));
    }
    Err(NoAnswer::Refused {
        code: text(&problem, "code"),
        detail,
    })
}

/// A key that no other mission was made under.
fn unix_ns() -> u128 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos())
}

fn text(value: &Value, member: &str) -> String {
    value[member].as_str().unwrap_or_default().to_owned()
}
