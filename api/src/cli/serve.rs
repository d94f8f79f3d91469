//! `pilotfish serve`: the service on a socket.

use std::{
    io::{self, Write},
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs as _},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use axum::serve::{Listener, ListenerExt};
use clap::{Args, builder::BoolishValueParser};
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::graceful::GracefulShutdown,
    service::TowerToHyperService,
};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use service::{
    Hosts, Settings,
    examples::EXAMPLES,
    service,
    store::{EventStore, StoreError},
};
use tokio::{
    io::AsyncWriteExt as _,
    net::{TcpListener, TcpStream},
    sync::Semaphore,
};
use wire::DEADLINE_MS;

/// How long requests under way may take to finish after the order to stop: as long as a body may take to arrive.
const DRAIN: Duration = Duration::from_secs(10);

/// How long a connection may take to say what it wants, the wait for its next request included.
const HEADER_TIME: Duration = Duration::from_secs(10);

/// Most connections at once: a few for every mission that may be under way.
const CONNECTIONS_MAX: usize = 4_096;

/// Files that the service itself needs: the mission log and its readers, records, and connections that are turned away.
const FILES_OF_OUR_OWN: usize = 256;

/// Connections that are being turned away; more are closed without a word.
const TURNED_AWAY_MAX: usize = 64;

/// How long one may take to hear that it is turned away.
const TURN_AWAY_TIME: Duration = Duration::from_millis(500);

/// What one is told.
const NO_PLACE: &str = r#"{"type":"urn:pilotfish:problem:crowded","title":"The service has taken on all it can","status":503,"code":"crowded","detail":"there are too many connections; try again after the time in Retry-After"}"#;

#[derive(Clone, Debug, Args)]
pub(crate) struct Serve {
    /// Address to listen on, or a name that stands for one.
    #[arg(long, env = "PILOTFISH_HOST", default_value = "127.0.0.1")]
    host: String,
    /// Another name under which clients may call the service, as of a proxy before it; may be given several times.
    // The environment lists them with commas.
    #[arg(
        long,
        env = "PILOTFISH_ALLOW_HOST",
        value_name = "NAME",
        value_delimiter = ','
    )]
    allow_host: Vec<String>,
    /// Port to listen on; 0 takes a free one.
    #[arg(long, env = "PILOTFISH_PORT", default_value_t = 8080)]
    port: u16,
    /// Listen beyond this machine, though anyone who reaches the port may then use it.
    // The environment says 1, true, yes or on.
    #[arg(long, env = "PILOTFISH_INSECURE", value_parser = BoolishValueParser::new())]
    insecure: bool,
    /// Longest time for an answer, ms, from 0.05 to 60000; a request may ask for a shorter one.
    #[arg(long, env = "PILOTFISH_DEADLINE_MS", default_value_t = 1000.0, value_parser = deadline_ms)]
    deadline_ms: f64,
    /// Directory for the log of missions, made if it is not there.
    #[arg(long, env = "PILOTFISH_DATA", default_value = "pilotfish-data")]
    data: PathBuf,
}

/// Why the service does not run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ServeError {
    #[error(
        "{0} can be reached from other machines, and the service knows no passwords: listen on 127.0.0.1, \
         or add --insecure if the network is trusted"
    )]
    Exposed(IpAddr),
    #[error("port {0} is taken: choose another with --port, or --port 0 for any free one")]
    PortTaken(u16),
    #[error("cannot listen on {addresses:?}: choose another with --host and --port")]
    Listen {
        addresses: Vec<SocketAddr>,
        source: io::Error,
    },
    #[error("{0} stands for no address: choose another with --host")]
    UnknownHost(String, #[source] io::Error),
    #[error("missions cannot be kept in the directory; --data names another")]
    Log(#[from] StoreError),
    #[error("the service stopped")]
    Stopped(#[from] io::Error),
}

/// Serves until ctrl-c or SIGTERM, then lets requests under way finish.
pub(crate) fn serve(arguments: &Serve) -> Result<(), ServeError> {
    let host = arguments.host.trim_start_matches('[').trim_end_matches(']');
    let addresses: Vec<SocketAddr> = (host, arguments.port)
        .to_socket_addrs()
        .map_err(|source| ServeError::UnknownHost(host.to_owned(), source))?
        .collect();
    let exposed = addresses.iter().find(|address| !address.ip().is_loopback());
    if let Some(address) = exposed {
        if !arguments.insecure {
            return Err(ServeError::Exposed(address.ip()));
        }
        tracing::warn!(
            address = %address.ip(),
            "every client that reaches this address may plan, and change and delete missions (--insecure)"
        );
    }
    let names = [host.to_owned()]
        .into_iter()
        .chain(arguments.allow_host.iter().cloned());
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let settings = Settings {
        deadline: Duration::from_secs_f64(1e-3 * arguments.deadline_ms),
        hosts: Some(Hosts::new(names)),
        ..Settings::default()
    };
    runtime.block_on(run(&addresses, settings, &arguments.data))?;
    // A planner that outlives the drain is not waited for.
    runtime.shutdown_background();
    Ok(())
}

fn deadline_ms(text: &str) -> Result<f64, String> {
    let given: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if DEADLINE_MS.contains(&given) {
        return Ok(given);
    }
    let (least, most) = DEADLINE_MS.into_inner();
    Err(format!("not from {least} to {most} ms"))
}

async fn run(addresses: &[SocketAddr], settings: Settings, data: &Path) -> Result<(), ServeError> {
    let listener = TcpListener::bind(addresses)
        .await
        .map_err(|source| match (source.kind(), addresses) {
            (io::ErrorKind::AddrInUse, [address, ..]) => ServeError::PortTaken(address.port()),
            _ => ServeError::Listen {
                addresses: addresses.to_vec(),
                source,
            },
        })?;
    let (router, missions) = service(settings, EventStore::open(data)?).await?;
    // Before the URL is printed: its reader may send the signal at once.
    let signal = Signals::listen()?;
    greet(listener.local_addr()?);
    // An answer's last segment should not wait for the client's acknowledgement of the first.
    let mut listener = listener.tap_io(|socket| {
        if let Err(error) = socket.set_nodelay(true) {
            tracing::debug!(%error, "a connection stays without TCP_NODELAY");
        }
    });

    // `axum::serve` waits for a header as long as the client likes.
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEADER_TIME);
    let router = TowerToHyperService::new(router);
    let connections = GracefulShutdown::new();
    let places = Arc::new(Semaphore::new(places_for_connections()));
    let at_the_door = Arc::new(Semaphore::new(TURNED_AWAY_MAX));
    let mut stop = std::pin::pin!(signal.any());
    loop {
        let socket = tokio::select! {
            (socket, _) = Listener::accept(&mut listener) => socket,
            () = &mut stop => break,
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            if let Ok(place) = Arc::clone(&at_the_door).try_acquire_owned() {
                tokio::spawn(async {
                    turn_away(socket).await;
                    drop(place);
                });
            }
            continue;
        };
        let connection = http.serve_connection(TokioIo::new(socket), router.clone());
        let connection = connections.watch(connection);
        tokio::spawn(async {
            let _place = place;
            if let Err(error) = connection.await {
                tracing::debug!(%error, "a connection ended early");
            }
        });
    }
    tracing::info!("stopping: requests under way may finish");
    drop(listener);
    // Streams would go on for as long as their missions.
    missions.close();
    if tokio::time::timeout(DRAIN, connections.shutdown()).await.is_err() {
        tracing::warn!("gave up on requests that did not finish");
    }
    if let Err(error) = missions.close_store().await {
        tracing::warn!(%error, "the mission log keeps its write-ahead file; the next start reads it");
    }
    Ok(())
}

/// How many connections there may be: as many as the system gives files for, but for those that the service itself needs.
fn places_for_connections() -> usize {
    let mut files = getrlimit(Resource::Nofile);
    // The service starts with the modest limit of a shell; it may raise that as far as the administrator allows.
    let raised = Rlimit {
        current: files.maximum,
        ..files
    };
    if setrlimit(Resource::Nofile, raised).is_ok() {
        files = raised;
    }
    let files = files.current.map_or(CONNECTIONS_MAX, |files| {
        usize::try_from(files).unwrap_or(CONNECTIONS_MAX)
    });
    files.saturating_sub(FILES_OF_OUR_OWN).clamp(1, CONNECTIONS_MAX)
}

/// Tells a client for which there is no place to come again, whatever it wants.
async fn turn_away(mut socket: TcpStream) {
    let answer = format!(
        "HTTP/1.1 503 Service Unavailable\r\nretry-after: 1\r\nconnection: close\r\n\
         content-type: application/problem+json\r\ncontent-length: {}\r\n\r\n{NO_PLACE}",
        NO_PLACE.len()
    );
    let told = async {
        socket.write_all(answer.as_bytes()).await?;
        socket.shutdown().await?;
        // A socket that is closed with something unread takes its answer back.
        tokio::io::copy(&mut socket, &mut tokio::io::sink()).await
    };
    // The client may be gone, or not listen.
    let _ = tokio::time::timeout(TURN_AWAY_TIME, told).await;
}

/// The URL, and a command that shows a plan when pasted into a shell.
fn greet(mut address: SocketAddr) {
    let mut everywhere = String::new();
    if address.ip().is_unspecified() {
        everywhere = format!(", as on every address of this machine ({address})");
        address.set_ip(match address {
            SocketAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            SocketAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        });
    }
    let example = EXAMPLES[0].name;
    let greeting = format!(
        "Pilotfish is listening on http://{address}{everywhere}\n\
         Open that in a browser, or ask for a plan:\n\n  \
         curl -s http://{address}/v1/examples/{example} |\n    \
         curl -s -H 'content-type: application/json' --data-binary @- http://{address}/v1/plan\n\n"
    );
    // A service goes on without a reader of what it prints.
    if let Err(error) = io::stdout().write_all(greeting.as_bytes()) {
        tracing::debug!(%error, "the greeting has no reader");
    }
}

struct Signals {
    interrupt: tokio::signal::unix::Signal,
    terminate: tokio::signal::unix::Signal,
}

impl Signals {
    fn listen() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
        })
    }

    async fn any(mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }
}
