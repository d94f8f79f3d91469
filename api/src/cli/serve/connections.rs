//! Connections: their number, the time for their requests, and their end.

use std::{io, net::IpAddr, sync::Arc, time::Duration};

use axum::{Router, body::Body, extract::Request};
use clock::Clock;
use hyper::{body::Incoming, server::conn::http1, service::service_fn};
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::graceful::{GracefulShutdown, Watcher},
};
use rustix::net::sockopt;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use service::Connections as Count;
use service::access::Peer;
use service::limits::{
    BACKLOG, CONNECTIONS_MAX, DRAIN_TIME, FILES_RESERVED, HEAD_BYTES_MAX, HEADER_TIME, REFUSAL_TIME,
    REFUSALS_MAX, SEND_BUFFER, UNREAD_TIME,
};
use service::slots::{ConnectionSlot, ConnectionSlots};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tower::ServiceExt as _;

use super::tls::Tls;

/// Pause when no connection can be accepted, for example without a free file descriptor.
const ACCEPT_AGAIN: Duration = Duration::from_millis(100);

/// The answer to a refused client.
const NO_SLOT: &str = r#"{"type":"urn:pilotfish:problem:crowded","title":"The service is at its limit","status":503,"code":"crowded","detail":"the service accepts no more connections; try again after the time in Retry-After"}"#;

pub(super) struct Connections {
    clock: Clock,
    http: http1::Builder,
    router: Router,
    tls: Option<Arc<Tls>>,
    under_way: GracefulShutdown,
    slots: ConnectionSlots,
    refusals: Arc<Semaphore>,
    count: Count,
}

impl Connections {
    pub(super) fn new(router: Router, tls: Option<Arc<Tls>>, count: Count, clock: Clock) -> Self {
        // `axum::serve` has no time limit for a header.
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new()).header_read_timeout(HEADER_TIME).max_buf_size(HEAD_BYTES_MAX);
        Self {
            http,
            router,
            tls,
            under_way: GracefulShutdown::new(),
            slots: ConnectionSlots::new(n_connections_max(), clock.clone()),
            clock,
            refusals: Arc::new(Semaphore::new(REFUSALS_MAX)),
            count,
        }
    }

    /// Waits for a connection, and serves it in a task of its own.
    pub(super) async fn accept(&self, listener: &TcpListener) {
        let (socket, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                tracing::warn!(%error, "cannot accept a connection");
                self.clock.sleep(ACCEPT_AGAIN).await;
                return;
            }
        };
        // The last segment of an answer must not wait for the acknowledgement of the first.
        if let Err(error) = socket.set_nodelay(true) {
            tracing::debug!(%error, "cannot set TCP_NODELAY");
        }
        let peer = peer.ip().to_canonical();
        let Some(slot) = self.slots.acquire(peer) else {
            self.count.turned_away();
            self.turn_away(socket);
            return;
        };
        let (http, router, watcher) = (self.http.clone(), self.router.clone(), self.under_way.watcher());
        let (tls, clock) = (self.tls.clone(), self.clock.clone());
        let counted = self.count.opened();
        tokio::spawn(async move {
            let _counted = counted;
            let client = Client { peer, slot: slot.clone() };
            let served = async {
                match tls {
                    None => serve(http, router, watcher, socket, client).await,
                    Some(tls) => match clock.timeout(HEADER_TIME, tls.accept(socket)).await {
                        Ok(Ok(socket)) => serve(http, router, watcher, socket, client).await,
                        Ok(Err(error)) => tracing::debug!(%error, %peer, "TLS handshake failed"),
                        Err(_) => tracing::debug!(%peer, "TLS handshake timed out"),
                    },
                }
            };
            tokio::select! {
                () = served => {}
                () = slot.revoked() => tracing::debug!(%peer, "a connection gave way to another"),
            }
        });
    }

    /// Answers 503 with `Retry-After`.
    fn turn_away(&self, socket: TcpStream) {
        // A TLS client cannot read a plain answer.
        if self.tls.is_none()
            && let Ok(permit) = Arc::clone(&self.refusals).try_acquire_owned()
        {
            let clock = self.clock.clone();
            tokio::spawn(async move {
                turn_away(socket, &clock).await;
                drop(permit);
            });
        }
    }

    /// Waits for open requests, for a limited time.
    pub(super) async fn drain(self) {
        let ended = self.clock.timeout(DRAIN_TIME, self.under_way.shutdown());
        if ended.await.is_err() {
            tracing::warn!("some requests did not finish in time");
        }
    }
}

/// The other end of a connection, and its slot here.
struct Client {
    peer: IpAddr,
    slot: ConnectionSlot,
}

/// Sets the queue and the limits for clients that do not read, which accepted sockets inherit.
pub(super) fn prepare(listener: &TcpListener) -> io::Result<()> {
    // A second call only changes the length of the queue.
    rustix::net::listen(listener, i32::try_from(BACKLOG).expect("is small"))?;
    sockopt::set_socket_send_buffer_size(listener, SEND_BUFFER)?;
    // The system also ends closed connections with unread last bytes.
    let unread_ms = u32::try_from(UNREAD_TIME.as_millis()).expect("is short");
    Ok(sockopt::set_tcp_user_timeout(listener, unread_ms)?)
}

/// Serves one connection to its end.
async fn serve<S: AsyncRead + AsyncWrite + Unpin + 'static>(
    http: http1::Builder,
    router: Router,
    watcher: Watcher,
    socket: S,
    client: Client,
) {
    let answer = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(Peer(client.peer));
        request.extensions_mut().insert(client.slot.clone());
        let router = router.clone();
        async move { router.oneshot(request.map(Body::new)).await }
    });
    let connection = http.serve_connection(TokioIo::new(socket), answer);
    if let Err(error) = watcher.watch(connection).await {
        tracing::debug!(%error, "a connection ended early");
    }
}

/// Limit of connections: the limit of file descriptors, less those that the service itself needs.
fn n_connections_max() -> usize {
    let mut files = getrlimit(Resource::Nofile);
    // A shell sets a low soft limit, which may be raised to the hard limit.
    let raised = Rlimit { current: files.maximum, ..files };
    if setrlimit(Resource::Nofile, raised).is_ok() {
        files = raised;
    }
    let files =
        files.current.map_or(CONNECTIONS_MAX, |files| usize::try_from(files).unwrap_or(CONNECTIONS_MAX));
    files.saturating_sub(FILES_RESERVED).clamp(1, CONNECTIONS_MAX)
}

async fn turn_away(mut socket: TcpStream, clock: &Clock) {
    let answer = format!(
        "HTTP/1.1 503 Service Unavailable\r\nretry-after: 1\r\nconnection: close\r\n\
         content-type: application/problem+json\r\ncontent-length: {}\r\n\r\n{NO_SLOT}",
        NO_SLOT.len()
    );
    let answered = async {
        socket.write_all(answer.as_bytes()).await?;
        socket.shutdown().await?;
        // Closing a socket with unread input discards the answer.
        tokio::io::copy(&mut socket, &mut tokio::io::sink()).await
    };
    // The client may be gone.
    let _ = clock.timeout(REFUSAL_TIME, answered).await;
}

#[cfg(test)]
mod tests {
    use std::{fs, net::TcpStream};

    use super::*;

    #[tokio::test]
    async fn a_burst_of_connections_waits_instead_of_being_dropped() {
        /// More than the 1024 that Tokio asks for.
        const BURST: usize = 1_500;
        let system = fs::read_to_string("/proc/sys/net/core/somaxconn").expect("is Linux");
        let system: usize = system.trim().parse().expect("is a number");
        let burst = BURST.min(system).min(n_connections_max());
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port is free");
        prepare(&listener).expect("is a socket");
        let address = listener.local_addr().expect("is bound");
        // The system repeats a dropped SYN after 1 s, 3 s, 7 s and 15 s.
        let connect = || TcpStream::connect_timeout(&address, Duration::from_secs(20));
        let waiting: Vec<_> = (0..burst).map_while(|_| connect().ok()).collect();
        assert_eq!(waiting.len(), burst);
    }
}
