//! HTTP requests of a live mission: a client of the service's API.

use std::error::Error;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use ::wire::FieldError;
use ::wire::mission::{
    Accepted, CurrentReference, LiveCraft, Mission, MissionList, Reports, Run, Setting, Status,
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Value, json};
use ureq::http::StatusCode;

mod token_file;
mod transport;

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

/// A bridge's craft in its mission: as the operator stated it, and completed by the autopilot's
/// parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnPart {
    pub(crate) stated: LiveCraft,
    pub(crate) completed: LiveCraft,
}

/// A client of one service, or of several that share their missions.
pub struct MissionClient {
    urls: Vec<String>,
    current: AtomicUsize,
    token: Option<TokenFile>,
    transport: Transport,
    answer_timeout: Duration,
    wait_s: u32,
    /// The craft of the mission's fleet for which it asks.
    craft: Option<String>,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum ServiceError {
    /// No connection, no complete answer, or too busy: try again.
    #[error("no answer: {0}")]
    Unavailable(String),
    /// The token is not accepted, and its file has no other one.
    #[error("the token is rejected: write a valid one to the file of --token-file")]
    Unauthorised,
    #[error("the service has no such mission")]
    NoMission,
    #[error("rejected ({code}): {detail}")]
    Rejected { code: String, detail: String },
}

/// The members of a problem (RFC 9457) that a bridge reads; answers of others may lack them.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct ProblemBody {
    code: String,
    detail: String,
    errors: Vec<FieldError>,
}

impl MissionClient {
    /// A client of the service at `urls`, or of several that share their missions, of which it
    /// leaves silent ones. `token` authorises it; after a rejection the file is read again.
    ///
    /// # Panics
    /// If `urls` is empty.
    pub fn new(urls: &[String], token: Option<TokenFile>, transport: Transport) -> Self {
        assert!(!urls.is_empty(), "a client needs a service");
        let (answer_timeout, wait_s) = match urls.len() {
            1 => (ANSWER_TIMEOUT, WAIT_S),
            _ => (ANSWER_TIMEOUT_OF_SEVERAL, WAIT_S_OF_SEVERAL),
        };
        let urls = urls.iter().map(|url| url.trim_end_matches('/').to_owned());
        let (urls, current) = (urls.collect(), AtomicUsize::new(0));
        Self { urls, current, token, transport, answer_timeout, wait_s, craft: None }
    }

    /// The client for this craft of a fleet; for the only one of a mission without a name.
    #[must_use]
    pub fn of_craft(self, craft: Option<String>) -> Self {
        Self { craft, ..self }
    }

    pub(crate) fn craft(&self) -> Option<&str> {
        self.craft.as_deref()
    }

    /// The unfinished mission of `name`, or a new one of `body`. Another `digest` of the setup is
    /// an error. Repeated calls with one `key` create one mission at most.
    pub(crate) async fn find_or_create(
        &self,
        name: &str,
        digest: &str,
        body: &Value,
        key: &str,
    ) -> Result<Mission, ServiceError> {
        if let Some(found) = self.find(name, digest).await? {
            return self.run(found).await;
        }
        let mut body = body.clone();
        body["metadata"][NAME] = name.into();
        body["metadata"][DIGEST] = digest.into();
        let made: Mission = self.post("", &body, &format!("bridge-{name}-{key}")).await?;
        // Bridges of one fleet that start together use the mission that was created first.
        let first = self.find(name, digest).await?.filter(|first| first.id != made.id);
        if first.is_some() && made.status == Status::Created {
            let (path, key) = (format!("/{}/finish", made.id), format!("{}-finish", made.id));
            let _: Mission = self.post(&path, &json!({}), &key).await?;
        }
        self.run(first.unwrap_or(made)).await
    }

    /// The first unfinished mission of `name`. Another `digest` of the setup is an error.
    async fn find(&self, name: &str, digest: &str) -> Result<Option<Mission>, ServiceError> {
        let mut after = Some(0);
        while let Some(from) = after {
            let page: MissionList = self.get(&format!("?after={from}")).await?;
            let mut missions = page.missions.into_iter();
            match missions.find(|mission| says(mission, NAME, name) && !mission.status.is_over()) {
                Some(found) if says(&found, DIGEST, digest) => return Ok(Some(found)),
                Some(Mission { id, .. }) => {
                    return Err(ServiceError::Rejected {
                        code: "another_setup".to_owned(),
                        detail: format!(
                            "mission {id} has the name {name:?} and another setup: finish it (POST …/finish) or choose another --name"
                        ),
                    });
                }
                None => after = page.next,
            }
        }
        Ok(None)
    }

    pub(crate) async fn run(&self, mission: Mission) -> Result<Mission, ServiceError> {
        if mission.status == Status::Created {
            let (path, key) = (format!("/{}/run", mission.id), format!("{}-run", mission.id));
            let _: Mission = self.post(&path, &Run::default(), &key).await?;
        }
        Ok(mission)
    }

    /// Replaces what the operator `stated` of this craft of the mission's fleet, unless it has been
    /// changed since.
    pub(crate) async fn complete(
        &self,
        mission: Mission,
        OwnPart { stated, completed }: &OwnPart,
    ) -> Result<Mission, ServiceError> {
        let fleet = mission.setting.as_ref().and_then(|setting| setting.surface_craft.clone());
        let mut fleet = fleet.unwrap_or_default();
        let Some(own) = fleet.iter_mut().find(|own| **own == *stated) else { return Ok(mission) };
        own.clone_from(completed);
        let change = Setting { surface_craft: Some(fleet), ..Setting::default() };
        let body = serde_json::to_vec(&change).map_err(unavailable)?;
        let key = format!("{}-own-{}-{}", mission.id, completed.id.0, mission.revision);
        let posted = Posted { key, revision: Some(mission.revision), body };
        match self.answered(&format!("/{}", mission.id), Some(posted)).await {
            Err(ServiceError::Rejected { code, .. }) if code == "mission_forbidden" => {
                tracing::warn!(
                    "the token of one craft may not change its mission: limits and craft are as stated there"
                );
                Ok(mission)
            }
            // Another bridge was faster.
            Err(ServiceError::Rejected { code, detail }) if code == "mission_changed" => {
                Err(ServiceError::Unavailable(detail))
            }
            changed => changed,
        }
    }

    pub(crate) async fn mission(&self, id: &str) -> Result<Mission, ServiceError> {
        self.get(&format!("/{id}")).await
    }

    /// Posts reports. Returns the faults of rejected ones once the others are on the disk.
    pub(crate) async fn report(
        &self,
        id: &str,
        reports: &Reports,
        key: &str,
    ) -> Result<Vec<String>, ServiceError> {
        let answer: Accepted = self.post(&format!("/{id}/reports"), reports, key).await?;
        Ok(faults(&answer.rejected))
    }

    /// The newest plan; waits some seconds for one after event `after`. `None` before the first.
    pub(crate) async fn reference(
        &self,
        id: &str,
        after: u64,
    ) -> Result<Option<CurrentReference>, ServiceError> {
        let query = form_urlencoded::Serializer::new(String::new())
            .extend_pairs(self.craft().map(|craft| ("craft", craft)))
            .finish();
        let path = format!("/{id}/reference?wait_s={}&after={after}&{query}", self.wait_s);
        match self.get(&path).await {
            Err(ServiceError::Rejected { code, .. }) if code == "no_plan_yet" => Ok(None),
            answer => Ok(Some(serde_json::from_value(used(answer?)).map_err(unavailable)?)),
        }
    }

    async fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, ServiceError> {
        self.answered(path, None).await
    }

    async fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl Serialize,
        key: &str,
    ) -> Result<T, ServiceError> {
        let body = serde_json::to_vec(body).map_err(unavailable)?;
        let (key, revision) = (key.to_owned(), None);
        self.answered(path, Some(Posted { key, revision, body })).await
    }

    /// The answer to a GET, or to a POST of `posted`, at this path of the missions. After silence
    /// of a service, the next call goes to the next one.
    async fn answered<T: DeserializeOwned>(
        &self,
        path: &str,
        posted: Option<Posted>,
    ) -> Result<T, ServiceError> {
        let number = self.current.load(Ordering::Relaxed);
        let answer = self.authorised(Call {
            service: self.urls[number].clone(),
            path: format!("{MISSIONS}{path}"),
            token: self.token.as_ref().map(TokenFile::token),
            posted,
        });
        let answer = answer.await;
        if let Err(ServiceError::Unavailable(_)) = answer {
            self.leave(number);
        }
        answer
    }

    /// Leaves the `silent` service for the next one, unless another task has done so.
    fn leave(&self, silent: usize) {
        let (next, order) = ((silent + 1) % self.urls.len(), Ordering::Relaxed);
        let left = self.current.compare_exchange(silent, next, order, order);
        if left.is_ok() && next != silent {
            // The status line tells it; several absent services would fill the log.
            let [from, to] = [silent, next].map(|service| &*self.urls[service]);
            tracing::debug!(from, to, "asks the next service");
        }
    }

    /// The answer to `call`, repeated with a new token of the file if its own is rejected.
    async fn authorised<T: DeserializeOwned>(&self, mut call: Call) -> Result<T, ServiceError> {
        match (self.ask(call.clone()).await, &self.token, &call.token) {
            (Err(ServiceError::Unauthorised), Some(file), Some(token)) => {
                call.token = Some(file.another(token).ok_or(ServiceError::Unauthorised)?);
                self.ask(call).await
            }
            (answer, ..) => answer,
        }
    }

    async fn ask<T: DeserializeOwned>(&self, call: Call) -> Result<T, ServiceError> {
        let answer = self.transport.answer(call, self.answer_timeout).await;
        read(&answer.map_err(|error| ServiceError::Unavailable(with_remedy(error)))?)
    }
}

fn says(mission: &Mission, member: &str, value: &str) -> bool {
    mission.metadata.get(member).and_then(Value::as_str) == Some(value)
}

fn read<T: DeserializeOwned>(answer: &Answer) -> Result<T, ServiceError> {
    let status = StatusCode::from_u16(answer.status).map_err(unavailable)?;
    if status.is_success() {
        return serde_json::from_slice(&answer.body).map_err(unavailable);
    }
    let problem: ProblemBody = serde_json::from_slice(&answer.body).unwrap_or_default();
    let detail = match &*problem.errors {
        [] => problem.detail,
        errors => faults(errors).join("; "),
    };
    Err(match (status.as_u16(), problem.code) {
        (401, _) => ServiceError::Unauthorised,
        // Any other 404 comes from an address without a service.
        (404, code) if code == "no_mission" => ServiceError::NoMission,
        (429 | 500.., _) => ServiceError::Unavailable(format!("{status}: {detail}")),
        (_, code) => ServiceError::Rejected { code, detail },
    })
}

/// An answer without the members of its plan that no bridge uses: a newer service may state in them
/// what this program cannot read.
fn used(mut answer: Value) -> Value {
    if let Some(plan) = answer.get_mut("plan").and_then(Value::as_object_mut) {
        plan.retain(|member, _| !["schedule", "solver"].contains(&&**member));
        plan.extend(["targets", "violations"].map(|member| (member.to_owned(), json!([]))));
    }
    answer
}

/// The transport's error, with what the operator can do.
fn with_remedy(error: String) -> String {
    if error.contains("UnknownIssuer") {
        return format!("{error}: name the service's certificate, or its authority's, with --certificate");
    }
    error
}

fn unavailable(error: impl Error) -> ServiceError {
    ServiceError::Unavailable(error.to_string())
}

/// The faults with their places in the request.
fn faults(errors: &[FieldError]) -> Vec<String> {
    let fault = |error: &FieldError| format!("{}: {}", error.pointer, error.detail);
    errors.iter().map(fault).collect()
}
