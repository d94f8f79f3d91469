//! HTTP requests of a live mission: a client of the service's API.

use std::{error::Error, time::Duration};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use ureq::http::StatusCode;

mod services;
mod token_file;
mod transport;

use services::Services;
pub use token_file::TokenFile;
pub use transport::{Answer, Answering, Call, Posted, Transport, proxy_of};

/// Time after which a request is repeated with the same key. A plan may be followed for ten
/// seconds: reports must arrive before that.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(4);
/// The same with several services: a dead owner is replaced within 3 s, and two silent services
/// take half of a plan's ten seconds at most.
const ANSWER_TIMEOUT_OF_SEVERAL: Duration = Duration::from_millis(2_500);
/// Longest wait of a request for a newer plan, s: the answer must arrive in time over a slow link.
const WAIT_S: u32 = 2;
const WAIT_S_OF_SEVERAL: u32 = 1;
const MISSIONS: &str = "/v1/missions";
/// Metadata by which a bridge finds its mission: its name, and the digest of the setup.
const NAME: &str = "bridge";
const DIGEST: &str = "bridge_setup";

/// A client of one service, or of several that share their missions.
pub struct MissionClient {
    services: Services,
    token: Option<TokenFile>,
    transport: Transport,
    answer_timeout: Duration,
    wait_s: u32,
}

/// The reason that a request failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum ServiceError {
    /// No connection, no complete answer, or too busy: try again.
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
        /// The fault.
        detail: String,
    },
}

/// The members of a mission that a bridge needs.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct MissionInfo {
    pub(crate) id: String,
    pub(crate) status: String,
    #[serde(default)]
    pub(crate) metadata: Value,
    #[serde(default)]
    pub(crate) setting: Value,
}

#[derive(Debug, Deserialize)]
struct Page {
    missions: Vec<MissionInfo>,
    next: Option<u64>,
}

impl MissionInfo {
    /// `true` if it has ended.
    pub(crate) fn is_over(&self) -> bool {
        matches!(self.status.as_str(), "finished" | "failed")
    }
}

/// The body of one report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Reports {
    /// Fixes, by AUV.
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub(crate) auvs: Map<String, Value>,
    /// States of the surface craft.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) asc: Vec<Value>,
    /// Notes for the mission's log.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) notes: Vec<Value>,
    /// The state of the steering.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) steering: Vec<Value>,
}

impl MissionClient {
    /// A client of the service at `urls`, or of several that share their missions, of which it
    /// leaves silent ones. `token` authorises it; after a rejection the file is read again.
    #[must_use]
    pub fn new(urls: &[String], token: Option<TokenFile>, transport: Transport) -> Self {
        let (answer_timeout, wait_s) = if urls.len() == 1 {
            (ANSWER_TIMEOUT, WAIT_S)
        } else {
            (ANSWER_TIMEOUT_OF_SEVERAL, WAIT_S_OF_SEVERAL)
        };
        Self {
            services: Services::new(urls),
            token,
            transport,
            answer_timeout,
            wait_s,
        }
    }

    /// The unfinished mission of `name`, or a new one of `body`. Another `digest` of the setup is
    /// an error. Repeated calls with one `key` create one mission at most.
    pub(crate) async fn find_or_create(
        &self,
        name: &str,
        digest: &str,
        body: &Value,
        key: &str,
    ) -> Result<MissionInfo, ServiceError> {
        let mut after = 0;
        loop {
            let page: Page = self.get(&format!("?after={after}")).await?;
            let is_ours = |mission: &&MissionInfo| mission.metadata[NAME] == name && !mission.is_over();
            if let Some(found) = page.missions.iter().find(is_ours) {
                return if found.metadata[DIGEST] == digest {
                    self.run(found.clone()).await
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
        let made: MissionInfo = self.post("", &body, &format!("bridge-{name}-{key}")).await?;
        self.run(made).await
    }

    pub(crate) async fn run(&self, mission: MissionInfo) -> Result<MissionInfo, ServiceError> {
        if mission.status == "created" {
            let path = format!("/{}/run", mission.id);
            let _: Value = self
                .post(&path, &json!({}), &format!("{}-run", mission.id))
                .await?;
        }
        Ok(mission)
    }

    pub(crate) async fn mission(&self, id: &str) -> Result<MissionInfo, ServiceError> {
        self.get(&format!("/{id}")).await
    }

    /// Posts reports. Returns the faults of rejected ones once the others are on the disk.
    pub(crate) async fn report(
        &self,
        id: &str,
        reports: &Reports,
        key: &str,
    ) -> Result<Vec<String>, ServiceError> {
        let body =
            serde_json::to_value(reports).map_err(|error| ServiceError::Unavailable(error.to_string()))?;
        let answer: Value = self.post(&format!("/{id}/reports"), &body, key).await?;
        Ok(faults(&answer["rejected"]))
    }

    /// The newest plan; waits some seconds for one after event `after`. `None` before the first.
    pub(crate) async fn reference(&self, id: &str, after: u64) -> Result<Option<Value>, ServiceError> {
        let wait_s = self.wait_s;
        match self
            .get(&format!("/{id}/reference?wait_s={wait_s}&after={after}"))
            .await
        {
            Err(ServiceError::Rejected { code, .. }) if code == "no_plan_yet" => Ok(None),
            answer => answer.map(Some),
        }
    }

    async fn get<T: for<'de> Deserialize<'de>>(&self, path: &str) -> Result<T, ServiceError> {
        self.answered(path, None).await
    }

    async fn post<T: for<'de> Deserialize<'de>>(
        &self,
        path: &str,
        body: &Value,
        key: &str,
    ) -> Result<T, ServiceError> {
        let (key, body) = (key.to_owned(), body.to_string().into_bytes());
        self.answered(path, Some(Posted { key, body })).await
    }

    /// The answer to a GET, or to a POST of `posted`, at this path of the missions. After silence
    /// of a service, the next call goes to the next one.
    async fn answered<T: for<'de> Deserialize<'de>>(
        &self,
        path: &str,
        posted: Option<Posted>,
    ) -> Result<T, ServiceError> {
        let (asked, service) = self.services.asked();
        let answer = self.authorised(Call {
            service: service.to_owned(),
            path: format!("{MISSIONS}{path}"),
            token: self.token.as_ref().map(TokenFile::token),
            posted,
        });
        let answer = answer.await;
        if let Err(ServiceError::Unavailable(_)) = answer {
            self.services.leave(asked);
        }
        answer
    }

    /// The answer to `call`, repeated with a new token of the file if its own is rejected.
    async fn authorised<T: for<'de> Deserialize<'de>>(&self, mut call: Call) -> Result<T, ServiceError> {
        match (self.ask(call.clone()).await, &self.token, &call.token) {
            (Err(ServiceError::Unauthorised), Some(file), Some(token)) => {
                call.token = Some(file.another(token).ok_or(ServiceError::Unauthorised)?);
                self.ask(call).await
            }
            (answer, ..) => answer,
        }
    }

    async fn ask<T: for<'de> Deserialize<'de>>(&self, call: Call) -> Result<T, ServiceError> {
        let answer = self.transport.answer(call, self.answer_timeout).await;
        read(&answer.map_err(ServiceError::Unavailable)?)
    }
}

fn read<T: for<'de> Deserialize<'de>>(answer: &Answer) -> Result<T, ServiceError> {
    let unavailable = |error: &dyn Error| ServiceError::Unavailable(error.to_string());
    let status = StatusCode::from_u16(answer.status).map_err(|error| unavailable(&error))?;
    if status.is_success() {
        return serde_json::from_slice(&answer.body).map_err(|error| unavailable(&error));
    }
    let problem: Value = serde_json::from_slice(&answer.body).unwrap_or_default();
    match (status.as_u16(), problem["code"].as_str()) {
        (401, _) => return Err(ServiceError::Unauthorised),
        // Any other 404 comes from an address without a service.
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

/// The faults with their places in the request.
fn faults(errors: &Value) -> Vec<String> {
    let errors = errors.as_array().into_iter().flatten();
    errors
        .map(|error| format!("{}: {}", text(error, "pointer"), text(error, "detail")))
        .collect()
}

fn text(value: &Value, member: &str) -> String {
    value[member].as_str().unwrap_or_default().to_owned()
}
