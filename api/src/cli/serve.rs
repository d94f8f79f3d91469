//! `pilotfish serve`: the service on a socket.

use std::error::Error;
use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::http::{HeaderValue, Uri};
use clock::Clock;
use service::{Hosts, Settings, access::Tokens, examples::EXAMPLES, service};
use store::{EventStore, Member, roots::verified_by};
use tokio::net::TcpListener;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio_rustls::rustls::ClientConfig;

use self::connections::{Connections, prepare};
use self::tls::Tls;
use super::{config::Config, failure::because_of};

mod connections;
mod systemd;
mod tls;

/// Failures with a cause.
const STOPPED: &str = "the service stopped";
const UNUSABLE_LOG: &str = "cannot use the mission log";

/// Serves until Ctrl-C or SIGTERM, then finishes open requests.
pub(crate) fn serve(config: &Config) -> Result<(), Box<dyn Error>> {
    let has_tokens = Tokens::open(&config.tokens(), &Clock::machine())?.are_made();
    serve_and(config, HangUp::Reloads, |address, tls| greet(address, tls, has_tokens))
}

/// The effect of SIGHUP, which also comes when a terminal is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum HangUp {
    /// Reads the certificate again, if there is one.
    Reloads,
    /// Ends the service.
    Stops,
}

/// Serves. Calls `listens` with the address, and `true` with TLS.
pub(crate) fn serve_and(
    config: &Config,
    hang_up: HangUp,
    listens: impl FnOnce(SocketAddr, bool),
) -> Result<(), Box<dyn Error>> {
    let host = config.host.trim_start_matches('[').trim_end_matches(']');
    let addresses = (host, config.port).to_socket_addrs();
    let none = format!("{host} has no address: choose another --host");
    let addresses: Vec<SocketAddr> = addresses.map_err(because_of(none))?.collect();
    let clock = Clock::machine();
    let tokens = Tokens::open(&config.tokens(), &clock)?;
    let tls = Tls::open(config.tls_certificate.as_deref(), config.tls_key.as_deref())?;
    if let Some(address) = addresses.iter().find(|address| !address.ip().is_loopback()) {
        check_exposed(address.ip(), tokens.are_made(), tls.is_some(), config.insecure)?;
    }
    let advertised = config.advertise.as_deref().filter(|_| config.store.is_some());
    let advertised = advertised.map(advertised_name).transpose()?;
    let peers = config.peers.iter().map(|url| {
        let (scheme, name) = advertised_name(url)?;
        Ok::<_, String>(format!("{scheme}://{name}"))
    });
    let framed_by = config.framed_by.iter().map(String::as_str).map(framing);
    let names = [Some(host.to_owned()), advertised.map(|(_, name)| name)];
    let names = names.into_iter().flatten().chain(config.allow_host.iter().cloned());
    let settings = Settings {
        clock,
        deadline: Duration::from_secs_f64(1e-3 * config.deadline_ms),
        hosts: Some(Hosts::new(names)),
        tokens: Some(tokens),
        heartbeat: systemd::heartbeat(),
        log_lines_dropped: crate::log::lines_dropped,
        peers: peers.collect::<Result<_, _>>()?,
        framed_by: framed_by.collect::<Result<_, _>>()?,
        between: config.advertise_ca.as_deref().map(trusting).transpose()?,
        #[cfg(feature = "otlp")]
        trace: crate::otlp::place,
        ..Settings::default()
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let runtime = runtime.map_err(because_of(STOPPED))?;
    runtime.block_on(run(&addresses, settings, tls, (config, hang_up), listens))?;
    // Stops without waiting for busy planners.
    runtime.shutdown_background();
    Ok(())
}

/// Fails if other machines can reach the service without tokens and TLS, unless `insecure`.
fn check_exposed(address: IpAddr, has_tokens: bool, has_tls: bool, insecure: bool) -> Result<(), String> {
    let missing = match (has_tokens, has_tls) {
        (true, true) => return Ok(()),
        (false, true) => "no tokens (pilotfish token add)",
        (true, false) => "no TLS (--tls-certificate, --tls-key)",
        (false, false) => "neither tokens (pilotfish token add) nor TLS (--tls-certificate, --tls-key)",
    };
    if !insecure {
        return Err(format!(
            "other machines can reach {address}, but the service has {missing}: add what is missing, listen on 127.0.0.1, or \
             use ::--insecure in a trusted network"
        ));
    }
    let risk = if has_tokens {
        "tokens can be read on the network and used"
    } else {
        "any client that reaches this address may plan, and change and delete missions"
    };
    tracing::warn!(%address, "{risk} (--insecure): the service has {missing}");
    Ok(())
}

async fn run(
    addresses: &[SocketAddr],
    settings: Settings,
    tls: Option<Tls>,
    (config, hang_up): (&Config, HangUp),
    listens: impl FnOnce(SocketAddr, bool),
) -> Result<(), Box<dyn Error>> {
    let shutdown_delay = Duration::from_secs_f64(config.shutdown_delay_s);
    let listener = match (TcpListener::bind(addresses).await, addresses) {
        (Err(error), [address, ..]) if error.kind() == io::ErrorKind::AddrInUse => {
            let port = address.port();
            return Err(
                format!("port {port} is in use: choose another --port, or --port 0 for a free one").into()
            );
        }
        (bound, _) => bound.map_err(because_of(format!(
            "cannot listen on {addresses:?}: choose another --host or --port"
        )))?,
    };
    prepare(&listener).map_err(because_of(STOPPED))?;
    let address = listener.local_addr().map_err(because_of(STOPPED))?;
    let stopping = Arc::clone(&settings.stopping);
    let counted = settings.connections.clone();
    let clock = settings.clock.clone();
    let store = open_store(config, address, tls.is_some(), &clock)?;
    let (router, missions) = service(settings, store).await.map_err(because_of(UNUSABLE_LOG))?;
    tokio::spawn(missions.clone().keep_for(config.retention()));
    // Signals first: the reader of the URL may send one at once.
    let mut signals = Signals::listen().map_err(because_of(STOPPED))?;
    listens(address, tls.is_some());
    systemd::notify("READY=1");
    let tls = tls.map(Arc::new);
    let connections = Connections::new(router, tls.clone(), counted, clock.clone());
    // Until the first stop signal, and then until the delay ends or the second signal.
    let mut end = None;
    loop {
        tokio::select! {
            () = connections.accept(&listener) => {}
            () = at(end, &clock) => break,
            is_hang_up = signals.next() => {
                if is_hang_up && hang_up == HangUp::Reloads {
                    if let Some(tls) = &tls {
                        tls.reload();
                    }
                } else if !is_hang_up && end.is_none() && !shutdown_delay.is_zero() {
                    stopping.store(true, Ordering::Relaxed);
                    tracing::info!(?shutdown_delay, "no longer ready; the service stops after the delay");
                    end = Some(clock.now() + shutdown_delay);
                } else {
                    break;
                }
            },
        }
    }
    stopping.store(true, Ordering::Relaxed);
    tracing::info!("stopping after the open requests");
    drop(listener);
    // Streams would last as long as their missions.
    missions.stop().await;
    connections.drain().await;
    if let Err(error) = missions.close_store().await {
        tracing::warn!(%error, "the mission log keeps its write-ahead file, which the next start reads");
    }
    Ok(())
}

/// The scheme, and the host with the port if any, of the URL at which a service is reached.
fn advertised_name(url: &str) -> Result<(String, String), String> {
    let uri = url.parse::<Uri>().ok();
    let uri = uri.filter(|uri| matches!(uri.scheme_str(), Some("http" | "https")));
    let parts = uri.and_then(|uri| Some((uri.scheme_str()?.to_owned(), uri.authority()?.to_string())));
    parts.ok_or_else(|| {
        format!(
            "{url} is no URL of a service: give --advertise and --peers http://HOST:PORT or https://HOST:PORT"
        )
    })
}

/// An origin of `--framed-by` as a policy names it: a policy ends at other characters.
fn framing(origin: &str) -> Result<HeaderValue, String> {
    let host = ["http://", "https://"].iter().find_map(|scheme| origin.strip_prefix(scheme));
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-.:[]".contains(c);
    let host = host.filter(|host| !host.is_empty() && host.chars().all(is_plain));
    let wrong = || format!("{origin} is no origin: give --framed-by http://HOST:PORT or https://HOST:PORT");
    host.and_then(|_| HeaderValue::from_str(origin).ok()).ok_or_else(wrong)
}

/// The client configuration for services certified by the authority of the PEM file `path`.
fn trusting(path: &Path) -> Result<ClientConfig, String> {
    verified_by(Some(path)).map_err(|reason| format!("cannot use --advertise-ca: {reason}"))
}

/// The store of the data directory, or the one that this service at `address` shares.
fn open_store(
    config: &Config,
    address: SocketAddr,
    has_tls: bool,
    clock: &Clock,
) -> Result<EventStore, Box<dyn Error>> {
    let Some(store) = &config.store else {
        let store = EventStore::open_with(&config.data, config.disk_share(), clock);
        return Ok(store.map_err(because_of(UNUSABLE_LOG))?);
    };
    let scheme = if has_tls { "https" } else { "http" };
    // Services of other machines do not reach a loopback address.
    let ip = address.ip();
    let is_unreached = ip.is_unspecified() || (ip.is_loopback() && EventStore::is_elsewhere(store));
    let own = (!is_unreached).then(|| format!("{scheme}://{address}"));
    let is_https = |url: &str| url.starts_with("https://");
    // With TLS the service answers HTTPS only; without, a proxy may add it.
    let is_reached = |url: &String| is_https(url) || (url.starts_with("http://") && !has_tls);
    let advertised = config.advertise.clone().or(own).filter(is_reached);
    let Some(url) = advertised else {
        let advice = format!("add --advertise {scheme}://HOST:PORT, where they reach this one");
        return Err(format!("services that share missions call each other: {advice}").into());
    };
    if is_https(&url) && config.advertise_ca.is_none() {
        let advice = "add --advertise-ca FILE, the certificate of their authority (PEM)";
        return Err(format!("the other services' certificates are verified: {advice}").into());
    }
    let lease = Duration::from_secs_f64(config.lease_s);
    let member = Member { url, lease };
    let store = EventStore::open_database(store, Some(member), config.disk_share(), clock);
    Ok(store.map_err(because_of(UNUSABLE_LOG))?)
}

/// Waits until then, or forever.
async fn at(end: Option<std::time::Instant>, clock: &Clock) {
    match end {
        Some(end) => clock.sleep_until(end).await,
        None => std::future::pending().await,
    }
}

/// Prints the URL, and a command that prints a plan.
fn greet(mut address: SocketAddr, tls: bool, has_tokens: bool) {
    let scheme = if tls { "https" } else { "http" };
    let mut everywhere = String::new();
    if address.ip().is_unspecified() {
        everywhere = format!(", and on all addresses of this machine ({address})");
        address.set_ip(match address {
            SocketAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            SocketAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        });
    }
    let example = EXAMPLES[0].name;
    let token = if has_tokens { " -H \"authorization: Bearer $TOKEN\"" } else { "" };
    let greeting = format!(
        "Pilotfish is listening on {scheme}://{address}{everywhere}\n\
         Open it in a browser, or request a plan:\n\n  \
         curl -s{token} {scheme}://{address}/v1/examples/{example} |\n    \
         curl -s{token} -H 'content-type: application/json' --data-binary @- {scheme}://{address}/v1/plan\n\n"
    );
    // The service also runs if its output has no reader.
    if let Err(error) = io::stdout().write_all(greeting.as_bytes()) {
        tracing::debug!(%error, "cannot print the greeting");
    }
}

struct Signals {
    interrupt: Signal,
    terminate: Signal,
    hang_up: Signal,
}

impl Signals {
    fn listen() -> io::Result<Self> {
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
            hang_up: signal(SignalKind::hangup())?,
        })
    }

    /// Waits for a signal; `true` for SIGHUP.
    async fn next(&mut self) -> bool {
        tokio::select! {
            _ = self.interrupt.recv() => false,
            _ = self.terminate.recv() => false,
            _ = self.hang_up.recv() => true,
        }
    }
}
