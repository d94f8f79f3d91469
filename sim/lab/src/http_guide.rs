//! A control law outside of this program, in any language: it gets each snapshot over HTTP and
//! answers with a reference ([docs/own-law.md](../../../docs/own-law.md)).
//!
//! It needs no memory: `metadata` of its answer returns in the mission's next snapshot, and a whole
//! plan returns as `previous_plan`. So `/v1/plan` can be such a law.

use std::{fmt, io, str::FromStr, time::Duration};

use planner::angle::Heading;
use planner::los::Reference;
use planner::plan::Method;
use planner::snapshot::{Schedule, Snapshot};
use serde::Deserialize as _;
use serde_json::{Map, Value};
use sim::guide::{Guidance, Guide, GuideError, served};
use ureq::{Agent, Error as HttpError, http::Uri};
use wire::METADATA_BYTES_MAX;

/// Longest wait for an answer. A law at sea has a second; this allows for busy machines.
const ANSWER_TIME: Duration = Duration::from_secs(10);
/// Largest answer, bytes: several times a plan for 16 AUVs.
const ANSWER_BYTES_MAX: u64 = 1 << 20;
/// Longest address, bytes.
const URL_BYTES_MAX: usize = 2000;
/// Most characters of an answer in an error.
const QUOTED_MAX: usize = 200;
/// Range of speeds in answers, m/s: that of a plan that comes back as `previous_plan`.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.0..=40.0;
/// Range of headings in answers, rad. Beyond a turn they are rather degrees.
const HEADINGS: std::ops::RangeInclusive<f64> = -std::f64::consts::TAU..=std::f64::consts::TAU;

/// Name of such a law among controllers.
pub const GUIDE: &str = "guide";

/// The address of a law.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuideUrl(String);

/// An address is invalid.
#[derive(Debug, thiserror::Error)]
#[error("{0:?} is no address of a law, such as http://127.0.0.1:8000/")]
pub struct NoGuideUrl(String);

impl FromStr for GuideUrl {
    type Err = NoGuideUrl;

    fn from_str(text: &str) -> Result<Self, NoGuideUrl> {
        let wrong = || NoGuideUrl(text.chars().take(QUOTED_MAX).collect());
        let url: Uri = text.parse().map_err(|_| wrong())?;
        let is_http = matches!(url.scheme_str(), Some("http" | "https"));
        let has_host = url.host().is_some_and(|host| !host.is_empty());
        if is_http && has_host && text.len() <= URL_BYTES_MAX {
            Ok(Self(text.to_owned()))
        } else {
            Err(wrong())
        }
    }
}

impl fmt::Display for GuideUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A law gave no reference at this time of the snapshot, s.
#[derive(Debug, thiserror::Error)]
#[error("the guide {url} gave no reference at {t_s} s: {why}")]
pub struct NoGuidance {
    url: GuideUrl,
    t_s: f64,
    why: AnswerFault,
}

#[derive(Debug, thiserror::Error)]
enum AnswerFault {
    #[error("no answer ({0}): start the law, correct the address, or read what the law wrote when it failed")]
    Away(HttpError),
    #[error(
        "no answer: it closed the connection of its last answer and a fresh one too ({0}): read what the law wrote when it failed"
    )]
    Closed(HttpError),
    #[error("no answer within {} s: answer sooner, or let it serve several missions at once", ANSWER_TIME.as_secs())]
    TooSlow,
    #[error("it answered with more than {ANSWER_BYTES_MAX} bytes: answer with speed_mps and heading_rad")]
    TooLarge,
    #[error("it answered with status {0}, not 200: {1}")]
    Status(u16, String),
    #[error("its answer is not JSON, which has no NaN or Infinity either ({0}): {1}")]
    NotJson(serde_json::Error, String),
    #[error("its answer's {member} {is}: {answer}")]
    Member { member: &'static str, is: String, answer: String },
}

impl NoGuidance {
    /// `true` if the law was absent or too slow: it may answer later.
    pub fn may_pass(&self) -> bool {
        matches!(self.why, AnswerFault::Away(_) | AnswerFault::Closed(_) | AnswerFault::TooSlow)
    }
}

/// A law at an address, and its metadata for the next snapshot.
#[derive(Debug)]
pub struct HttpGuide {
    agent: Agent,
    has_answered: bool,
    url: GuideUrl,
    metadata: Map<String, Value>,
    previous_plan: Option<Value>,
}

impl HttpGuide {
    /// The law at `url`, for one mission.
    pub fn new(url: &GuideUrl) -> Self {
        Self::within(url, ANSWER_TIME)
    }

    fn within(url: &GuideUrl, answer_time: Duration) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            // A law is where its caller says, and nowhere else.
            .max_redirects(0)
            .proxy(None)
            .timeout_global(Some(answer_time));
        Self {
            agent: config.build().into(),
            has_answered: false,
            url: url.clone(),
            metadata: Map::new(),
            previous_plan: None,
        }
    }

    /// The request, as `/v1/plan` takes it.
    fn question(&self, snapshot: &Snapshot) -> Value {
        let mut request = serde_json::to_value(&**snapshot).expect("a request is JSON");
        if !self.metadata.is_empty() {
            request["metadata"] = self.metadata.clone().into();
        }
        if let Some(plan) = &self.previous_plan {
            request["previous_plan"] = plan.clone();
        }
        request
    }

    /// Asks again if the last answer's connection was closed: some servers close without notice.
    fn answer(&mut self, question: &Value) -> Result<Value, AnswerFault> {
        let answer = match self.ask(question) {
            Err(AnswerFault::Away(error)) if self.has_answered && is_closed(&error) => {
                self.agent = Agent::new_with_config(self.agent.config().clone());
                self.ask(question).map_err(|why| match why {
                    AnswerFault::Away(error) if is_closed(&error) => AnswerFault::Closed(error),
                    why => why,
                })
            }
            answer => answer,
        };
        self.has_answered |= answer.is_ok();
        answer
    }

    fn ask(&self, question: &Value) -> Result<Value, AnswerFault> {
        let sent = self.agent.post(&self.url.0).send_json(question);
        let mut response = sent.map_err(transport_fault)?;
        let body = response.body_mut().with_config().limit(ANSWER_BYTES_MAX);
        let bytes = body.read_to_vec().map_err(transport_fault)?;
        if response.status() != 200 {
            return Err(AnswerFault::Status(response.status().as_u16(), quoted(&bytes)));
        }
        serde_json::from_slice(&bytes).map_err(|error| AnswerFault::NotJson(error, quoted(&bytes)))
    }

    /// The guidance in `answer`; keeps the parts for the next snapshot.
    fn guidance(&mut self, snapshot: &Snapshot, answer: Value) -> Result<Guidance, AnswerFault> {
        let reference = reference(snapshot, &answer)?;
        let serves = serves(snapshot, &answer)?;
        let predicted_rms = answer.pointer("/predicted/rms_error_m").and_then(Value::as_f64);
        let method = Method::deserialize(&answer["method"]).ok();
        let manoeuvre = answer.pointer("/avoidance/manoeuvre/heading_rad").and_then(Value::as_f64);
        self.metadata = metadata(&answer)?;
        self.previous_plan = answer["trajectory"].is_array().then_some(answer);
        Ok(Guidance { reference, method, predicted_rms, serves, manoeuvre, solve_time: None })
    }
}

impl Guide for HttpGuide {
    fn name(&self) -> &'static str {
        GUIDE
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let answered = self.answer(&self.question(snapshot));
        let guided = answered.and_then(|answer| self.guidance(snapshot, answer));
        guided.map_err(|why| {
            let (url, t_s) = (self.url.clone(), snapshot.t_s);
            NoGuidance { url, t_s, why }.into()
        })
    }
}

fn is_closed(error: &HttpError) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof};
    matches!(error, HttpError::Io(error)
        if matches!(error.kind(), BrokenPipe | ConnectionAborted | ConnectionReset | UnexpectedEof))
}

fn transport_fault(error: HttpError) -> AnswerFault {
    match error {
        HttpError::Timeout(_) => AnswerFault::TooSlow,
        HttpError::BodyExceedsLimit(_) => AnswerFault::TooLarge,
        away => AnswerFault::Away(away),
    }
}

/// The reference in `answer`: a member `reference`, as in a plan, or the answer itself. A speed
/// above the craft's largest is clipped, as its autopilot would.
fn reference(snapshot: &Snapshot, answer: &Value) -> Result<Reference, AnswerFault> {
    let of = answer.get("reference").unwrap_or(answer);
    let number = |member| of[member].as_f64();
    let wrong = |member, is| wrong(answer, member, is);
    let speed = number("speed_mps").ok_or_else(|| wrong("speed_mps", "is no number".to_owned()))?;
    if !SPEEDS.contains(&speed) {
        let (least, most) = (SPEEDS.start(), SPEEDS.end());
        let is = format!("is {speed}, outside {least} to {most} m/s");
        return Err(wrong("speed_mps", is));
    }
    let heading = match (number("heading_rad"), number("heading_deg")) {
        // An answer of the planner's own has both.
        (Some(heading), _) if HEADINGS.contains(&heading) => heading,
        (Some(heading), _) => {
            let is = format!("is {heading}, more than a turn of 2π rad: degrees are heading_deg");
            return Err(wrong("heading_rad", is));
        }
        (None, Some(degrees)) if HEADINGS.contains(&degrees.to_radians()) => degrees.to_radians(),
        (None, Some(degrees)) => {
            return Err(wrong("heading_deg", format!("is {degrees}, more than a turn")));
        }
        (None, None) => return Err(wrong("heading_rad", "is no number".to_owned())),
    };
    Ok(Reference { speed: speed.min(snapshot.limits().speed_max), heading: Heading::new(heading) })
}

/// Index of the AUV that `answer` serves: the next of its schedule, or the one in `serves`.
fn serves(snapshot: &Snapshot, answer: &Value) -> Result<Option<usize>, AnswerFault> {
    if let Ok(schedule) = Schedule::deserialize(&answer["schedule"]) {
        return Ok(served(snapshot, Some(&schedule)));
    }
    let Some(id) = answer.get("serves") else { return Ok(None) };
    let place = snapshot.auvs.iter().position(|auv| *id == auv.id.0);
    let unknown = || wrong(answer, "serves", format!("is {id}, and no AUV has that id"));
    place.map(Some).ok_or_else(unknown)
}

/// The metadata for the next snapshot.
fn metadata(answer: &Value) -> Result<Map<String, Value>, AnswerFault> {
    let metadata = match answer.get("metadata") {
        None => return Ok(Map::new()),
        Some(Value::Object(metadata)) => metadata.clone(),
        Some(_) => return Err(wrong(answer, "metadata", "is no object".to_owned())),
    };
    let bytes = serde_json::to_vec(&metadata).map_or(0, |text| text.len());
    if METADATA_BYTES_MAX < bytes {
        let is = format!("has {bytes} bytes, more than {METADATA_BYTES_MAX}");
        return Err(wrong(answer, "metadata", is));
    }
    Ok(metadata)
}

fn wrong(answer: &Value, member: &'static str, is: String) -> AnswerFault {
    let answer = quoted(answer.to_string().as_bytes());
    AnswerFault::Member { member, is, answer }
}

/// The beginning of a text, on one line, without control characters.
fn quoted(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * QUOTED_MAX)]).into_owned();
    let words: Vec<&str> = text.split_whitespace().collect();
    let visible = |c: char| {
        if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }
    };
    words.join(" ").chars().map(visible).take(QUOTED_MAX).collect()
}

#[cfg(test)]
mod tests;
