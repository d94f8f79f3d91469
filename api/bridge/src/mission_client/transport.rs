//! Carries requests to a service and its answers back: over HTTP, or within the process.

use std::{net::IpAddr, pin::Pin, time::Duration};

use clock::Clock;
use ureq::{
    Agent, Proxy, RequestBuilder,
    http::{Uri, header::LOCATION},
    tls::{Certificate, RootCerts, TlsConfig},
};

/// A request to a service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// URL of the service, one of the client's.
    pub service: String,
    /// Path and query.
    pub path: String,
    /// The token.
    pub token: Option<String>,
    /// Key and body of a POST; none for a GET.
    pub posted: Option<Posted>,
}

/// The body of a POST, or of a PATCH.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Posted {
    /// The idempotency key.
    pub key: String,
    /// The revision of the mission that is changed (PATCH); none for a POST.
    pub revision: Option<u64>,
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

/// An answer on its way, or the reason that there is none.
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
    /// HTTP, which blocks threads of `clock`. `certificate`, PEM, replaces the root certificates.
    pub fn http(clock: &Clock, certificate: Option<&[u8]>) -> Result<Self, ureq::Error> {
        let mut tls = TlsConfig::builder();
        if let Some(pem) = certificate {
            tls = tls.root_certs(RootCerts::from([Certificate::from_pem(pem)?]));
        }
        let config = Agent::config_builder()
            .tls_config(tls.build())
            // A service is at its URL. A token goes nowhere else.
            .max_redirects(0)
            // The body of an error has the details.
            .http_status_as_error(false);
        Ok(Self { clock: clock.clone(), carrier: Carrier::Http(config.build().into()) })
    }

    /// Services in the process. Answers must take simulated time, or repeated requests never end.
    pub fn in_process(clock: &Clock, services: impl Fn(Call) -> Answering + Send + Sync + 'static) -> Self {
        Self { clock: clock.clone(), carrier: Carrier::InProcess(Box::new(services)) }
    }

    /// The answer to `call` within `limit`, or the reason that there is none.
    pub(super) async fn answer(&self, call: Call, limit: Duration) -> Result<Answer, String> {
        match &self.carrier {
            Carrier::Http(agent) => {
                let agent = agent.clone();
                let work = move || over_http(&agent, &call, limit);
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

/// The environment's proxy (`ALL_PROXY`, `HTTPS_PROXY`, `HTTP_PROXY`; `NO_PROXY`) for requests to
/// `url`: only for HTTPS, since a proxy reads tokens otherwise, and never for this machine.
pub fn proxy_of(url: &str) -> Option<Proxy> {
    proxied(url, Proxy::try_from_env())
}

fn proxied(url: &str, proxy: Option<Proxy>) -> Option<Proxy> {
    let url: Uri = url.parse().ok()?;
    let is_used = url.scheme_str() == Some("https") && !url.host().is_some_and(is_this_machine);
    proxy.filter(|proxy| is_used && !proxy.is_no_proxy(&url))
}

fn is_this_machine(host: &str) -> bool {
    let host = host.trim_matches(['[', ']']).to_ascii_lowercase();
    match host.parse::<IpAddr>() {
        Ok(address) => address.to_canonical().is_loopback() || address.is_unspecified(),
        Err(_) => host == "localhost" || host.ends_with(".localhost"),
    }
}

fn over_http(agent: &Agent, call: &Call, limit: Duration) -> Result<Answer, String> {
    let environment = Proxy::try_from_env();
    let proxy = proxied(&call.service, environment.clone());
    // A network's proxy is easily forgotten: operators then search for the fault in the service.
    let route = match (&proxy, environment) {
        (Some(proxy), _) => {
            let (host, port) = (proxy.host(), proxy.port());
            format!(" (through the environment's proxy {host}:{port})")
        }
        (None, Some(_)) => " (reached without the environment's proxy)".to_owned(),
        (None, None) => String::new(),
    };
    request(agent, call, limit, proxy).map_err(|why| format!("{why}{route}"))
}

fn request(agent: &Agent, call: &Call, limit: Duration, proxy: Option<Proxy>) -> Result<Answer, String> {
    let why = |error: ureq::Error| error.to_string();
    let url = format!("{}{}", call.service, call.path);
    let answer = match &call.posted {
        None => with_options(agent.get(url), call, limit, proxy).call(),
        Some(Posted { key, revision, body }) => {
            let request = match revision {
                None => agent.post(url),
                Some(revision) => agent.patch(url).header("if-match", format!("\"{revision}\"")),
            };
            let request = request.content_type("application/json");
            with_options(request.header("idempotency-key", key), call, limit, proxy).send(body.as_slice())
        }
    };
    let mut answer = answer.map_err(why)?;
    let status = answer.status();
    if status.is_redirection() {
        let to = answer.headers().get(LOCATION);
        let to = to.map(|to| format!(" to {}", String::from_utf8_lossy(to.as_bytes())));
        let to = to.unwrap_or_default();
        let service = &call.service;
        return Err(format!("{service} redirects{to}: give the service's own URL"));
    }
    let body = match answer.body_mut().read_to_vec() {
        // The status of a refusal suffices.
        Err(_) if !status.is_success() => vec![],
        body => body.map_err(why)?,
    };
    Ok(Answer { status: status.as_u16(), body })
}

fn with_options<T>(
    request: RequestBuilder<T>,
    call: &Call,
    limit: Duration,
    proxy: Option<Proxy>,
) -> RequestBuilder<T> {
    let request = request.config().proxy(proxy).timeout_global(Some(limit)).build();
    match &call.token {
        Some(token) => request.header("authorization", format!("Bearer {token}")),
        None => request,
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn a_proxy_carries_https_to_other_machines_only() {
        let proxy = || Some(Proxy::new("http://proxy.ship:3128").expect("a proxy"));
        for direct in [
            "http://127.0.0.1:8080",
            "http://plans.ship:8080",
            "https://127.8.0.1",
            "https://[::1]:8443",
            "https://[::ffff:127.0.0.1]",
            "https://0.0.0.0:8443",
            "https://LocalHost:8443",
            "https://plans.localhost",
        ] {
            assert_eq!(proxied(direct, proxy()), None, "{direct}");
        }
        for url in ["https://plans.ship", "https://localhost.ship", "https://10.0.0.1"] {
            assert_eq!(proxied(url, proxy()), proxy(), "{url}");
            assert_eq!(proxied(url, None), None, "{url}");
        }
        let spared =
            Proxy::builder(ureq::ProxyProtocol::Http).host("proxy.ship").no_proxy("plans.ship").build();
        assert_eq!(proxied("https://plans.ship", spared.ok()), None);
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "a server at a real socket")]
    fn a_redirect_is_named_and_not_followed() {
        let server = TcpListener::bind("127.0.0.1:0").expect("a port");
        let service = format!("http://{}", server.local_addr().expect("an address"));
        let answers = std::thread::spawn(move || {
            let (mut socket, _) = server.accept().expect("a call");
            let mut head = [0; 4096];
            assert!(socket.read(&mut head).expect("a head") > 0);
            let answer = "HTTP/1.1 302 Found\r\nlocation: http://127.0.0.1:9/\r\ncontent-length: 0\r\n\r\n";
            socket.write_all(answer.as_bytes()).expect("is read");
        });
        let transport = Transport::http(&Clock::machine(), None).expect("no certificate");
        let Carrier::Http(agent) = transport.carrier else {
            unreachable!("is HTTP");
        };
        let call = Call {
            service: service.clone(),
            path: "/v1/missions".to_owned(),
            token: Some("secret".to_owned()),
            posted: None,
        };
        let answer = request(&agent, &call, Duration::from_secs(5), None);
        answers.join().expect("answered");
        let why = answer.expect_err("is no answer");
        assert_eq!(why, format!("{service} redirects to http://127.0.0.1:9/: give the service's own URL"));
    }
}
