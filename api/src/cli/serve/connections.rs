//! Connections: how many, how long each may take to say what it wants, and how they end.

use std::{net::IpAddr, sync::Arc, time::Duration};

use axum::{Router, body::Body, extract::Request};
use hyper::{body::Incoming, server::conn::http1, service::service_fn};
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::graceful::{GracefulShutdown, Watcher},
};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use service::{Connections as Count, access::Peer, slots::Slots};
use tokio::{
    io::{AsyncRead, AsyncWrite, AsyncWriteExt as _},
    net::{TcpListener, TcpStream},
    sync::Semaphore,
    time::timeout,
};
use tower::ServiceExt as _;

use super::tls::Tls;

/// How long requests under way may take to finish after the order to stop: as long as a body may take to arrive.
const DRAIN: Duration = Duration::from_secs(10);

/// How long a connection may take to say what it wants, the wait for its next request included.
const HEADER_TIME: Duration = Duration::from_secs(10);

/// How long to wait where no connection can be accepted, as without a free file.
const ACCEPT_AGAIN: Duration = Duration::from_millis(100);

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

/// What serves connections.
pub(super) struct Connections {
    http: http1::Builder,
    router: Router,
    tls: Option<Arc<Tls>>,
    under_way: GracefulShutdown,
    places: Slots<IpAddr>,
    at_the_door: Arc<Semaphore>,
    count: Count,
}

impl Connections {
    pub(super) fn new(router: Router, tls: Option<Arc<Tls>>, count: Count) -> Self {
        // `axum::serve` waits for a header as long as the client likes.
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new()).header_read_timeout(HEADER_TIME);
        Self {
            http,
            router,
            tls,
            under_way: GracefulShutdown::new(),
            places: Slots::new(places()),
            at_the_door: Arc::new(Semaphore::new(TURNED_AWAY_MAX)),
            count,
        }
    }

    /// Waits for a connection, and serves it beside the others.
    pub(super) async fn accept(&self, listener: &TcpListener) {
        let (socket, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                tracing::warn!(%error, "a connection is not accepted");
                tokio::time::sleep(ACCEPT_AGAIN).await;
                return;
            }
        };
        // An answer's last segment should not wait for the client's acknowledgement of the first.
        if let Err(error) = socket.set_nodelay(true) {
            tracing::debug!(%error, "a connection stays without TCP_NODELAY");
        }
        let peer = peer.ip().to_canonical();
        let Ok(place) = self.places.take(peer) else {
            self.count.turned_away();
            self.turn_away(socket);
            return;
        };
        let (http, router, watcher) = (self.http.clone(), self.router.clone(), self.under_way.watcher());
        let tls = self.tls.clone();
        let held = (place, self.count.opened());
        tokio::spawn(async move {
            let _held = held;
            match tls {
                None => serve(http, router, watcher, socket, peer).await,
                Some(tls) => match timeout(HEADER_TIME, tls.accept(socket)).await {
                    Ok(Ok(socket)) => serve(http, router, watcher, socket, peer).await,
                    Ok(Err(error)) => tracing::debug!(%error, %peer, "no TLS connection came about"),
                    Err(_) => tracing::debug!(%peer, "no TLS connection came about in time"),
                },
            }
        });
    }

    /// Tells a client for which there is no place to come again.
    fn turn_away(&self, socket: TcpStream) {
        // In the clear a client that speaks TLS would not understand it.
        if self.tls.is_none()
            && let Ok(place) = Arc::clone(&self.at_the_door).try_acquire_owned()
        {
            tokio::spawn(async {
                turn_away(socket).await;
                drop(place);
            });
        }
    }

    /// Lets requests under way finish, for some time.
    pub(super) async fn drain(self) {
        if timeout(DRAIN, self.under_way.shutdown()).await.is_err() {
            tracing::warn!("gave up on requests that did not finish");
        }
    }
}

/// Serves one connection to its end.
async fn serve<S: AsyncRead + AsyncWrite + Unpin + 'static>(
    http: http1::Builder,
    router: Router,
    watcher: Watcher,
    socket: S,
    peer: IpAddr,
) {
    let peer = Peer(peer);
    let answer = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(peer);
        let router = router.clone();
        async move { router.oneshot(request.map(Body::new)).await }
    });
    let connection = http.serve_connection(TokioIo::new(socket), answer);
    if let Err(error) = watcher.watch(connection).await {
        tracing::debug!(%error, "a connection ended early");
    }
}

/// How many connections there may be: as many as the system gives files for, but for those that the service itself needs.
fn places() -> usize {
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
    let _ = timeout(TURN_AWAY_TIME, told).await;
}
