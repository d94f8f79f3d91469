//! Carries requests to a service and its answers back: over HTTP, or within the process.

use std::{pin::Pin, time::Duration};

use clock::Clock;
use ureq::{
    Agent, RequestBuilder,
    tls::{Certificate, RootCerts, TlsConfig},
};

/// A request to a service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// URL of the service, one of those that the client was made with.
    pub service: String,
    /// Path and query.
    pub path: String,
    /// The token.
    pub token: Option<String>,
    /// Key and body of a POST; none for a GET.
    pub posted: Option<Posted>,
}

/// The body of a POST.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Posted {
    /// The idempotency key.
    pub key: String,
    /// JSON.
    pub body: Vec<u8>,
}

/// The answer of a service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Status code of HTTP.
    pub status: u16,
    /// JSON, for every answer of the API.
    pub body: Vec<u8>,
}

/// An answer on its way, or why there is none.
pub type Answering = Pin<Box<dyn Future<Output = Result<Answer, String>> + Send>>;

/// The way to the services.
pub struct Transport {
    clock: Clock,
    carrier: Carrier,
}

enum Carrier {
    Http(Agent),
    InProcess(Box<dyn Fn(Call) -> Answering + Send + Sync>),
}

impl Transport {
    /// HTTP, where requests block threads of `clock`. `certificate`, PEM, is trusted instead of the usual root certificates.
    pub fn http(clock: &Clock, certificate: Option<&[u8]>) -> Result<Self, ureq::Error> {
        let mut tls = TlsConfig::builder();
        if let Some(pem) = certificate {
            tls = tls.root_certs(RootCerts::from([Certificate::from_pem(pem)?]));
        }
        let config = Agent::config_builder()
            .tls_config(tls.build())
            // The body of an error says what is wrong.
            .http_status_as_error(false);
        Ok(Self {
            clock: clock.clone(),
            carrier: Carrier::Http(config.build().into()),
        })
    }

    /// Services in the same process. Each answer must take some simulated time: a client that asks again at once would never end.
    pub fn in_process(clock: &Clock, services: impl Fn(Call) -> Answering + Send + Sync + 'static) -> Self {
        Self {
            clock: clock.clone(),
            carrier: Carrier::InProcess(Box::new(services)),
        }
    }

    /// The answer to `call`, if it comes within `limit`; else why there is none.
    pub(super) async fn answer(&self, call: Call, limit: Duration) -> Result<Answer, String> {
        match &self.carrier {
            Carrier::Http(agent) => {
                let agent = agent.clone();
                let work = move || over_http(&agent, &call, limit).map_err(|error| error.to_string());
                let answered = self.clock.run_blocking(work).await;
                answered.unwrap_or_else(|_| Err("the client panicked".to_owned()))
            }
            Carrier::InProcess(services) => {
                let answered = self.clock.timeout(limit, services(call)).await;
                answered.unwrap_or_else(|_| Err(format!("nothing within {limit:?}")))
            }
        }
    }
}

fn over_http(agent: &Agent, call: &Call, limit: Duration) -> Result<Answer, ureq::Error> {
    let url = format!("{}{}", call.service, call.path);
    let mut answer = match &call.posted {
        None => prepared(agent.get(url), call, limit).call(),
        Some(Posted { key, body }) => {
            let request = agent.post(url).content_type("application/json");
            prepared(request.header("idempotency-key", key), call, limit).send(body.as_slice())
        }
    }?;
    let status = answer.status();
    let body = match answer.body_mut().read_to_vec() {
        // The status of a refusal says enough.
        Err(_) if !status.is_success() => vec![],
        body => body?,
    };
    Ok(Answer {
        status: status.as_u16(),
        body,
    })
}

fn prepared<T>(request: RequestBuilder<T>, call: &Call, limit: Duration) -> RequestBuilder<T> {
    let request = request.config().timeout_global(Some(limit)).build();
    match &call.token {
        Some(token) => request.header("authorization", format!("Bearer {token}")),
        None => request,
    }
}
