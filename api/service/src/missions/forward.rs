//! Calls about a mission of another service: that service answers them, through this one.
//!
//! This service answers reads of stored facts. No call is forwarded twice: the client repeats it.
//!
//! A call carries the client's token, and the database says where it goes. Writers of the database
//! must not learn tokens: calls go only to addresses that the operator has named, or whose
//! certificate is from the operator's authority.

use std::{net::IpAddr, time::Duration};

use axum::RequestExt as _;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{MatchedPath, RawPathParams, Request};
use axum::http::{HeaderName, HeaderValue, Method, Response as HttpResponse, Uri, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::stream::{self, Stream, StreamExt as _};
use hyper_rustls::{HttpsConnector, HttpsConnectorBuilder};
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use tokio_rustls::rustls::ClientConfig;

use store::{StoreError, roots::verified_by};

use crate::edge::in_process::{InProcess, MayHaveArrived};
use crate::edge::problem::Problem;
use crate::edge::request_id::{self, RequestId};
use crate::missions::Missions;

const FORWARDED: HeaderName = HeaderName::from_static("pilotfish-forwarded");

const MISSION: &str = "/v1/missions/{id}";

/// Routes whose answer is in the store.
const STORED: [&str; 3] = [MISSION, "/v1/missions/{id}/record", "/v1/missions/{id}/scene"];

/// Headers of the client's connection, and those about pages of other sites, which were checked.
const NOT_FORWARDED: [HeaderName; 8] = [
    header::HOST,
    header::CONNECTION,
    header::TRANSFER_ENCODING,
    header::UPGRADE,
    header::EXPECT,
    header::ORIGIN,
    HeaderName::from_static("sec-fetch-site"),
    HeaderName::from_static("sec-fetch-mode"),
];

/// Headers of an answer that are passed on; this service adds its own.
const PASSED_ON: [HeaderName; 5] = [
    header::CONTENT_TYPE,
    header::CONTENT_LENGTH,
    header::CONTENT_DISPOSITION,
    header::ETAG,
    header::RETRY_AFTER,
];

const CONNECT_TIME: Duration = Duration::from_secs(1);

/// Time for the head of an answer: the longest wait for a reference, 60 s, and a margin.
const HEAD_TIME: Duration = Duration::from_secs(75);

/// Longest complete answer, bytes. It is read whole, since the other service may die meanwhile.
const ANSWER_BYTES_MAX: usize = 16 << 20;

/// Longest silence within an answer: streams have a heartbeat every 15 s, and cuts are silent.
const SILENCE_MAX: Duration = Duration::from_secs(30);

/// Time between two questions whether a silent service still has the mission.
const ASK_AGAIN: Duration = Duration::from_millis(500);

#[derive(Clone)]
pub(crate) struct Forwarding {
    missions: Missions,
    peers: Peers,
    transport: Transport,
}

/// The services to which calls may be forwarded.
#[derive(Clone, Debug, Default)]
struct Peers {
    /// Their addresses, scheme and authority.
    named: Vec<String>,
    /// `true` if an authority of the operator's own certifies services that are called by HTTPS.
    are_certified: bool,
}

impl Peers {
    /// The address for calls to `url`; `None` for strangers. Loopback ones get no tokens.
    fn address(&self, url: &str, has_token: bool) -> Option<String> {
        let uri = url.parse::<Uri>().ok()?;
        let address = format!("{}://{}", uri.scheme_str()?, uri.authority()?);
        let is_certified = self.are_certified && uri.scheme_str() == Some("https");
        let host = uri.host()?.trim_start_matches('[').trim_end_matches(']');
        let is_here = host.parse().is_ok_and(|host: IpAddr| host.is_loopback());
        let may = self.named.contains(&address) || is_certified || (is_here && !has_token);
        may.then_some(address)
    }
}

#[derive(Clone)]
enum Transport {
    Http(Client<HttpsConnector<HttpConnector>, Body>),
    InProcess(InProcess),
}

impl Forwarding {
    /// `None` without other services. `tls` adds calls by HTTPS; `named` are addresses.
    pub(crate) fn of(
        missions: Option<&Missions>,
        tls: Option<ClientConfig>,
        named: Vec<String>,
        in_process: Option<InProcess>,
    ) -> Option<Self> {
        let missions = missions.filter(|missions| missions.are_shared())?.clone();
        let are_certified = tls.is_some();
        let http = || {
            let mut plain = HttpConnector::new();
            plain.set_connect_timeout(Some(CONNECT_TIME));
            plain.set_nodelay(true);
            plain.enforce_http(false);
            let tls = tls.unwrap_or_else(|| verified_by(None).expect("ring has TLS 1.2 and 1.3"));
            let connector = HttpsConnectorBuilder::new().with_tls_config(tls).https_or_http();
            let connector = connector.enable_http1().wrap_connector(plain);
            Transport::Http(Client::builder(TokioExecutor::new()).build(connector))
        };
        Some(Self {
            missions,
            peers: Peers { named, are_certified },
            transport: in_process.map_or_else(http, Transport::InProcess),
        })
    }

    /// Lets the owner of the mission answer the call.
    pub(crate) async fn handle(self, mut request: Request, next: Next) -> Response {
        let Some(id) = mission_of(&mut request).await else {
            return next.run(request).await;
        };
        let is_forwarded = request.headers().contains_key(FORWARDED);
        match self.missions.owner(&id).await {
            Err(Problem::Elsewhere(url)) if !is_forwarded && !self.missions.is_own(&url) => {
                self.forward(&id, &url, request).await
            }
            Err(problem @ Problem::Elsewhere(_)) => problem.into_response(),
            // The handler answers any other problem.
            _ => next.run(request).await,
        }
    }

    async fn forward(self, id: &str, url: &str, request: Request) -> Response {
        let elsewhere = || Problem::Elsewhere(url.to_owned());
        // The other service may have executed a command before it fell silent.
        let reads = request.method() == Method::GET;
        let silent = || if reads { elsewhere() } else { Problem::Unanswered };
        let has_token = request.headers().contains_key(header::AUTHORIZATION);
        let address = match &self.transport {
            Transport::InProcess(_) => Some(url.to_owned()),
            Transport::Http(_) => self.peers.address(url, has_token),
        };
        let Some(request) = address.and_then(|address| to(&address, request)) else {
            tracing::error!(
                url,
                "the database says that a service is at this URL, which is neither in --peers nor certified by --advertise-ca: it is not \
                 called"
            );
            return elsewhere().into_response();
        };
        let answer = tokio::select! {
            biased;
            answer = self.call(url, request) => answer,
            () = moved(&self.missions, id, url, false) => return silent().into_response(),
            () = self.missions.clock().sleep(HEAD_TIME) => return silent().into_response(),
        };
        let answer = match answer {
            Ok(answer) => self.passed_on(id, url, answer).await.map_err(|_| silent()),
            Err(MayHaveArrived(true)) => Err(silent()),
            Err(MayHaveArrived(false)) => Err(elsewhere()),
        };
        answer.unwrap_or_else(Problem::into_response)
    }

    async fn call(&self, url: &str, request: Request) -> Result<Response, MayHaveArrived> {
        match &self.transport {
            Transport::InProcess(others) => others.0(request).await,
            Transport::Http(client) => {
                let answer = client.request(request).await.map_err(|error| {
                    let cause = std::error::Error::source(&error).map(ToString::to_string);
                    tracing::warn!(%error, cause, url, "the other service did not answer");
                    MayHaveArrived(!error.is_connect())
                });
                Ok(answer?.map(Body::new))
            }
        }
    }

    /// The answer with this service's headers: complete, or a stream that ends when the mission
    /// moves. Fails if the other service dies before a complete answer.
    async fn passed_on(
        self,
        id: &str,
        url: &str,
        answer: HttpResponse<Body>,
    ) -> Result<Response, axum::Error> {
        let (head, body) = answer.into_parts();
        if head.status.is_redirection() {
            tracing::error!(url, "the other service redirects, which no service does");
            return Err(axum::Error::new("the other service redirects"));
        }
        let body = if head.headers.contains_key(header::CONTENT_LENGTH) {
            tokio::select! {
            biased;
                whole = to_bytes(body, ANSWER_BYTES_MAX) => whole?.into(),
                () = moved(&self.missions, id, url, false) => return Err(axum::Error::new("the mission has moved")),
                () = self.missions.clock().sleep(SILENCE_MAX) => return Err(axum::Error::new("the other service fell silent")),
            }
        } else {
            Body::from_stream(until_moved(body, self.missions, id.to_owned(), url.to_owned()))
        };
        let mut passed_on = Response::new(body);
        *passed_on.status_mut() = head.status;
        for name in PASSED_ON {
            if let Some(value) = head.headers.get(&name) {
                passed_on.headers_mut().insert(name, value.clone());
            }
        }
        Ok(passed_on)
    }
}

/// The mission of a call that only its owner can answer.
async fn mission_of(request: &mut Request) -> Option<String> {
    let route = request.extensions().get::<MatchedPath>()?.as_str();
    let is_stored = request.method() == Method::GET && STORED.contains(&route);
    if is_stored || !route.starts_with(MISSION) {
        return None;
    }
    let params = request.extract_parts::<RawPathParams>().await.ok()?;
    params.iter().find(|(name, _)| *name == "id").map(|(_, id)| id.to_owned())
}

/// The call for the service at `address`.
fn to(address: &str, mut request: Request) -> Option<Request> {
    let path = request.uri().path_and_query().map_or("/", |path| path.as_str());
    *request.uri_mut() = format!("{address}{path}").parse::<Uri>().ok()?;
    let id = request.extensions().get().map(|RequestId(id)| id.clone());
    let headers = request.headers_mut();
    for name in NOT_FORWARDED {
        headers.remove(name);
    }
    headers.insert(FORWARDED, HeaderValue::from_static("1"));
    if let Some(Ok(id)) = id.map(|id| HeaderValue::from_str(&id)) {
        headers.insert(&request_id::HEADER, id);
    }
    *request.version_mut() = Version::HTTP_11;
    request.extensions_mut().clear();
    Some(request)
}

/// Waits until the service at `url` no longer has the mission.
async fn moved(missions: &Missions, id: &str, url: &str, is_stream: bool) {
    loop {
        missions.clock().sleep(ASK_AGAIN).await;
        match missions.owner(id).await {
            Err(Problem::Elsewhere(now)) if now == url => {}
            // This service stops, and ends its streams; other answers are still awaited.
            Err(Problem::Log(StoreError::Closed)) if is_stream => return,
            // The other service may still have it.
            Err(Problem::Log(_)) => {}
            _ => return,
        }
    }
}

/// The body, cut off when the service at `url` loses the mission; readers then connect again.
fn until_moved(
    body: Body,
    missions: Missions,
    id: String,
    url: String,
) -> impl Stream<Item = Result<Bytes, axum::Error>> {
    let clock = missions.clock().clone();
    let moved = Box::pin(async move { moved(&missions, &id, &url, true).await });
    stream::unfold(Some((body.into_data_stream(), moved, clock)), async |state| {
        let (mut body, mut moved, clock) = state?;
        tokio::select! {
            biased;
            chunk = body.next() => Some((chunk?, Some((body, moved, clock)))),
            () = &mut moved => Some((Err(axum::Error::new("the mission has moved")), None)),
            () = clock.sleep(SILENCE_MAX) => Some((Err(axum::Error::new("the other service fell silent")), None)),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_goes_only_to_named_and_certified_services() {
        let named = vec!["http://ship-a:8080".to_owned()];
        let named = |are_certified| Peers { named: named.clone(), are_certified };
        for (url, certified, has_token, goes) in [
            ("http://ship-a:8080", false, true, true),
            ("http://ship-a:8080/elsewhere", false, true, true),
            ("http://ship-a:8081", false, true, false),
            ("http://stranger@ship-a:8080", false, true, false),
            ("https://ship-a:8080", false, true, false),
            ("https://stranger:8080", true, true, true),
            ("http://stranger:8080", true, false, false),
            ("http://127.0.0.1:9", false, true, false),
            ("http://127.0.0.1:9", false, false, true),
            ("http://[::1]:9", false, false, true),
            ("no URL", true, false, false),
        ] {
            let address = named(certified).address(url, has_token);
            assert_eq!(address.is_some(), goes, "{url}");
            assert!(address.is_none_or(|address| !address.ends_with("elsewhere")));
        }
    }
}
