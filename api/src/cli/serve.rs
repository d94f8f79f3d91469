//! `pilotfish serve`: the service on a socket.

use std::{
    io::{self, Write},
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    path::{Path, PathBuf},
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
use service::{
    Settings,
    examples::EXAMPLES,
    service,
    store::{EventStore, StoreError},
};
use tokio::net::TcpListener;
use wire::DEADLINE_MS;

/// How long requests under way may take to finish after the order to stop: as long as a body may take to arrive.
const DRAIN: Duration = Duration::from_secs(10);

/// How long a connection may take to say what it wants, the wait for its next request included.
const HEADER_TIME: Duration = Duration::from_secs(10);

#[derive(Clone, Debug, Args)]
pub(crate) struct Serve {
    /// Address to listen on.
    #[arg(long, env = "PILOTFISH_HOST", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
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
    #[error("cannot listen on {address}: choose another with --host and --port")]
    Listen { address: SocketAddr, source: io::Error },
    #[error("missions cannot be kept in the directory; --data names another")]
    Log(#[from] StoreError),
    #[error("the service stopped")]
    Stopped(#[from] io::Error),
}

/// Serves until ctrl-c or SIGTERM, then lets requests under way finish.
pub(crate) fn serve(arguments: &Serve) -> Result<(), ServeError> {
    if !arguments.host.is_loopback() && !arguments.insecure {
        return Err(ServeError::Exposed(arguments.host));
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let settings = Settings {
        deadline: Duration::from_secs_f64(1e-3 * arguments.deadline_ms),
        ..Settings::default()
    };
    let address = SocketAddr::new(arguments.host, arguments.port);
    runtime.block_on(run(address, settings, &arguments.data))?;
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

async fn run(address: SocketAddr, settings: Settings, data: &Path) -> Result<(), ServeError> {
    let listener = TcpListener::bind(address)
        .await
        .map_err(|source| match source.kind() {
            io::ErrorKind::AddrInUse => ServeError::PortTaken(address.port()),
            _ => ServeError::Listen { address, source },
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
    let mut stop = std::pin::pin!(signal.any());
    loop {
        let socket = tokio::select! {
            (socket, _) = Listener::accept(&mut listener) => socket,
            () = &mut stop => break,
        };
        let connection = http.serve_connection(TokioIo::new(socket), router.clone());
        let connection = connections.watch(connection);
        tokio::spawn(async {
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
    Ok(())
}

/// The URL, and a command that shows a plan when pasted into a shell.
fn greet(mut address: SocketAddr) {
    if address.ip().is_unspecified() {
        address.set_ip(match address {
            SocketAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            SocketAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        });
    }
    let example = EXAMPLES[0].name;
    let greeting = format!(
        "Pilotfish is listening on http://{address}\n\
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
