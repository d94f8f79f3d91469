//! HTTP requests of a live mission: a client of the service's API.

use std::{
    fs, io,
    path::PathBuf,
    sync::{Mutex, PoisonError},
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use ureq::{
    Body,
    http::Response,
    tls::{Certificate, RootCerts, TlsConfig},
};

/// A request without an answer is repeated after this time, with the same key. A plan may be followed for ten seconds: reports must
/// arrive before that.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(4);
/// How long the service may hold a request until there is a newer plan, s.
const WAIT_S: u32 = 2;
/// Members of a mission's metadata by which a bridge finds its own: its name, and the digest of the setup.
const NAME: &str = "bridge";
const DIGEST: &str = "bridge_setup";

/// A client of one service.
#[derive(Debug)]
pub struct MissionClient {
    agent: ureq::Agent,
    url: String,
    token: Option<TokenFile>,
}

/// A file with a token, and the token as it was read last.
#[derive(Debug)]
pub struct TokenFile {
    path: PathBuf,
    token: Mutex<String>,
}

impl TokenFile {
    /// Reads the token.
    pub fn read(path: PathBuf) -> io::Result<Self> {
        let token = Mutex::new(fs::read_to_string(&path)?.trim().to_owned());
        Ok(Self { path, token })
    }

    fn token(&self) -> String {
        self.token.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The token, if the file has another one than `rejected` now.
    fn another(&self, rejected: &str) -> Option<String> {
        let read = fs::read_to_string(&self.path).ok()?;
        let token = read.trim();
        // A file that is just being written may be empty.
        if token == rejected || token.is_empty() {
            return None;
        }
        token.clone_into(&mut self.token.lock().unwrap_or_else(PoisonError::into_inner));
        Some(token.to_owned())
    }
}

/// Why a request failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ServiceError {
    /// No connection, no whole answer, or too busy: try again.
    #[error("no answer: {0}")]
    Unavailable(String),
    /// The token is not accepted, and its file has no other one.
    #[error("the token is rejected: write a valid one to the file of --token-file")]
    Unauthorised,
    /// The service does not know the mission.
    #[error("the service has no such mission")]
    NoMission,
    /// The request cannot be carried out.
    #[error("rejected ({code}): {detail}")]
    Rejected {
        /// The problem's code.
        code: String,
        /// What is wrong.
        detail: String,
    },
}

/// The members of a mission that a bridge needs.
#[derive(Clone, Debug, Deserialize)]
pub struct MissionInfo {
    /// Its ID.
    pub id: String,
    /// Its status.
    pub status: String,
    /// Its metadata.
    #[serde(default)]
    pub metadata: Value,
    /// Its goal, limits, craft and places.
    #[serde(default)]
    pub setting: Value,
}

/// A page of the list of missions.
#[derive(Debug, Deserialize)]
struct Page {
    missions: Vec<MissionInfo>,
    next: Option<u64>,
}

impl MissionInfo {
    /// Whether it has ended.
    #[must_use]
    pub fn is_over(&self) -> bool {
        matches!(self.status.as_str(), "finished" | "failed")
    }
}

/// The body of one report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Reports {
    /// Fixes, by AUV.
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub auvs: Map<String, Value>,
    /// States of the surface craft.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub asc: Vec<Value>,
    /// Notes for the mission's log.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Value>,
}

impl MissionClient {
    /// A client of the service at `url`. `token` authorises it, if the service requires that. After a
    /// rejection the file is read again. `certificate`, PEM, is trusted instead of
    /// the usual root certificates.
    pub fn new(url: &str, token: Option<TokenFile>, certificate: Option<&[u8]>) -> Result<Self, ureq::Error> {
        let mut tls = TlsConfig::builder();
        if let Some(pem) = certificate {
            tls = tls.root_certs(RootCerts::from([Certificate::from_pem(pem)?]));
        }
        let config = ureq::Agent::config_builder()
            .tls_config(tls.build())
            // The body of an error says what is wrong.
            .http_status_as_error(false)
            .timeout_global(Some(ANSWER_TIMEOUT));
        Ok(Self {
            agent: config.build().into(),
            url: format!("{}/v1/missions", url.trim_end_matches('/')),
            token,
        })
    }

    /// The unfinished mission of `name`, or a new one of `body`: a bridge that restarts continues its mission. A mission of that name with
    /// another `digest` of the setup is an error.
    pub fn find_or_create(
        &self,
        name: &str,
        digest: &str,
        body: &Value,
    ) -> Result<MissionInfo, ServiceError> {
        let mut after = 0;
        loop {
            let page: Page = self.get(&format!("?after={after}"))?;
            let is_ours = |mission: &&MissionInfo| mission.metadata[NAME] == name && !mission.is_over();
            if let Some(found) = page.missions.iter().find(is_ours) {
                return if found.metadata[DIGEST] == digest {
                    self.run(found.clone())
                } else {
                    Err(ServiceError::Rejected {
                        code: "another_setup".to_owned(),
                        detail: format!(
                            "mission {} has the name {name:?} and another setup: finish it (POST …/finish) or choose another --name",
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
        body["metadata"][NAME] = name.into();
        body["metadata"][DIGEST] = digest.into();
        let made = self.post("", &body, &format!("bridge-{name}-{}", unix_ns()))?;
        self.run(serde_json::from_value(made).map_err(|error| ServiceError::Unavailable(error.to_string()))?)
    }

    /// Runs the mission if it is new.
    pub fn run(&self, mission: MissionInfo) -> Result<MissionInfo, ServiceError> {
        if mission.status == "created" {
            let path = format!("/{}/run", mission.id);
            self.post(&path, &json!({}), &format!("{}-run", mission.id))?;
        }
        Ok(mission)
    }

    /// The mission `id`.
    pub fn mission(&self, id: &str) -> Result<MissionInfo, ServiceError> {
        self.get(&format!("/{id}"))
    }

    /// Posts reports; returns when they are on the service's disk, with what is wrong with those that it rejected.
    pub fn report(&self, id: &str, reports: &Reports, key: &str) -> Result<Vec<String>, ServiceError> {
        let body =
            serde_json::to_value(reports).map_err(|error| ServiceError::Unavailable(error.to_string()))?;
        let answer = self.post(&format!("/{id}/reports"), &body, key)?;
        Ok(faults(&answer["rejected"]))
    }

    /// The newest plan; waits some seconds for one after the event `after`. None before the first plan.
    pub fn reference(&self, id: &str, after: u64) -> Result<Option<Value>, ServiceError> {
        match self.get(&format!("/{id}/reference?wait_s={WAIT_S}&after={after}")) {
            Err(ServiceError::Rejected { code, .. }) if code == "no_plan_yet" => Ok(None),
            answer => answer.map(Some),
        }
    }

    fn get<T: for<'de> Deserialize<'de>>(&self, path: &str) -> Result<T, ServiceError> {
        self.authorised(|authorisation| {
            let mut request = self.agent.get(format!("{}{path}", self.url));
            if let Some(bearer) = authorisation {
                request = request.header("authorization", bearer);
            }
            read(request.call())
        })
    }

    fn post(&self, path: &str, body: &Value, key: &str) -> Result<Value, ServiceError> {
        self.authorised(|authorisation| {
            let mut request = self
                .agent
                .post(format!("{}{path}", self.url))
                .header("idempotency-key", key);
            if let Some(bearer) = authorisation {
                request = request.header("authorization", bearer);
            }
            read(request.send_json(body))
        })
    }

    /// Calls with the token; once more if it is rejected and its file has another one.
    fn authorised<T>(
        &self,
        call: impl Fn(Option<String>) -> Result<T, ServiceError>,
    ) -> Result<T, ServiceError> {
        let Some(file) = &self.token else {
            return call(None);
        };
        let bearer = |token: &str| Some(format!("Bearer {token}"));
        let token = file.token();
        match call(bearer(&token)) {
            Err(ServiceError::Unauthorised) => match file.another(&token) {
                Some(other) => call(bearer(&other)),
                None => Err(ServiceError::Unauthorised),
            },
            answer => answer,
        }
    }
}

fn read<T: for<'de> Deserialize<'de>>(
    answer: Result<Response<Body>, ureq::Error>,
) -> Result<T, ServiceError> {
    let mut answer = answer.map_err(|error| ServiceError::Unavailable(error.to_string()))?;
    let status = answer.status();
    if status.is_success() {
        return answer
            .body_mut()
            .read_json()
            .map_err(|error| ServiceError::Unavailable(error.to_string()));
    }
    let problem: Value = answer.body_mut().read_json().unwrap_or_default();
    match (status.as_u16(), problem["code"].as_str()) {
        (401, _) => return Err(ServiceError::Unauthorised),
        // Another 404 comes from an address that is no service.
        (404, Some("no_mission")) => return Err(ServiceError::NoMission),
        _ => {}
    }
    let faults = faults(&problem["errors"]);
    let detail = if faults.is_empty() {
        text(&problem, "detail")
    } else {
        faults.join("; ")
    };
    if status.is_server_error() || status.as_u16() == 429 {
        return Err(ServiceError::Unavailable(format!("{status}: {detail}")));
    }
    Err(ServiceError::Rejected {
        code: text(&problem, "code"),
        detail,
    })
}

/// Each with its place in the request.
fn faults(errors: &Value) -> Vec<String> {
    let errors = errors.as_array().into_iter().flatten();
    errors
        .map(|error| format!("{}: {}", text(error, "pointer"), text(error, "detail")))
        .collect()
}

/// Makes the key of a new mission unique.
fn unix_ns() -> u128 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos())
}

fn text(value: &Value, member: &str) -> String {
    value[member].as_str().unwrap_or_default().to_owned()
}
