//! A guide that asks a Pilotfish server, so that any mission of the simulator can be guided over HTTP.

use planner::{angle::Heading, los::Reference, plan, snapshot::Snapshot};
use serde_json::{Value, json};
use sim::guide::{Guidance, Guide, GuideError};
use wire::{Method, PlanRequest, PlanResponse};

/// Posts every snapshot to `/v1/plan`. Remembers the last answer, because the server does not.
#[derive(Debug)]
pub struct RemoteGuide {
    agent: ureq::Agent,
    url: String,
    previous_plan: Value,
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum NoPlan {
    /// The server was not reached, or broke off.
    #[error("no answer from {url} ({source}); start the server with `cargo run --release`")]
    NoAnswer {
        /// What was asked.
        url: String,
        /// What went wrong.
        source: ureq::Error,
    },
    /// The server refused the snapshot; the problem document says which member is wrong.
    #[error("{url} refused the snapshot: {problem}")]
    Refused {
        /// What was asked.
        url: String,
        /// The problem document.
        problem: Value,
    },
    /// The answer has another shape than this client knows.
    #[error("the answer is not a plan")]
    NotAPlan(#[from] serde_json::Error),
}

impl RemoteGuide {
    /// A guide that asks the server at `url`, such as `http://127.0.0.1:8080`.
    #[must_use]
    pub fn new(url: &str) -> Self {
        // A refusal has a body worth reading, so it is an answer and not an error of the transport.
        let config = ureq::Agent::config_builder().http_status_as_error(false);
        Self {
            agent: config.build().into(),
            url: format!("{}/v1/plan", url.trim_end_matches('/')),
            previous_plan: Value::Null,
        }
    }

    fn post(&self, request: &Value) -> Result<Value, NoPlan> {
        let no_answer = |source| NoPlan::NoAnswer {
            url: self.url.clone(),
            source,
        };
        let mut response = self.agent.post(&self.url).send_json(request).map_err(no_answer)?;
        let answer = response.body_mut().read_json().map_err(no_answer)?;
        if response.status().is_success() {
            Ok(answer)
        } else {
            Err(NoPlan::Refused {
                url: self.url.clone(),
                problem: answer,
            })
        }
    }
}

impl Guide for RemoteGuide {
    fn name(&self) -> &'static str {
        "server"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let mut request = json!(PlanRequest::from(snapshot));
        request["previous_plan"] = self.previous_plan.take();
        let answer = self.post(&request)?;
        let plan: PlanResponse = serde_json::from_value(answer.clone()).map_err(NoPlan::from)?;
        // The whole answer goes back with the next snapshot, also what this client does not know.
        self.previous_plan = answer;
        Ok(Guidance {
            reference: Reference {
                speed: plan.reference.speed_mps,
                heading: Heading::new(plan.reference.heading_rad),
            },
            method: match plan.method {
                Method::Mpc => plan::Method::Mpc,
                Method::PreviousPlan => plan::Method::PreviousPlan,
                Method::SaturatedLos => plan::Method::SaturatedLos,
                Method::Hold => plan::Method::Hold,
                Method::SaturatedLosTrackerFrame => plan::Method::SaturatedLosTrackerFrame,
                Method::IntegralLos => plan::Method::IntegralLos,
                Method::WaypointBox => plan::Method::WaypointBox,
                Method::PrintedLos => plan::Method::PrintedLos,
            },
            predicted_rms: Some(plan.predicted.rms_error_m),
            solve_time: None,
        })
    }
}
