//! A client of the service over a kept connection.

use std::{io, mem, net::SocketAddr, time::Duration};

use axum::body::{Body, BodyDataStream, Bytes, to_bytes};
use axum::http::{Request, Response, header};
use futures_util::StreamExt as _;
use hyper::client::conn::http1::{Builder, SendRequest};
use hyper_util::rt::TokioIo;
use tests::client::with;
use tokio::net::TcpStream;
use tokio::time::{Instant, timeout};

/// Longer than the service allows for an answer, except streams and waits for a plan.
const PATIENCE: Duration = Duration::from_secs(30);

/// A connection idle for this time is replaced: the service closes it after 10 s.
const IDLE_MAX: Duration = Duration::from_secs(5);

/// The least that hyper takes for its own buffer, bytes.
const BUFFER: usize = 8 << 10;

/// An answer, read to its end.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    /// The answer's `Retry-After`.
    pub(crate) retry_after: Option<String>,
    pub(crate) body: Vec<u8>,
}

/// A connection that is made on demand and again after a failure.
#[derive(Debug)]
pub(crate) struct Connection {
    address: SocketAddr,
    sender: Option<SendRequest<Body>>,
    /// Time at which the newest answer ended.
    used: Instant,
}

impl Connection {
    pub(crate) fn new(address: SocketAddr) -> Self {
        Self { address, sender: None, used: Instant::now() }
    }

    /// The answer to `request`.
    pub(crate) async fn ask(&mut self, request: Request<Body>) -> io::Result<Answer> {
        if IDLE_MAX < self.used.elapsed() {
            self.sender = None;
        }
        let answer = timeout(PATIENCE, self.exchange(request)).await;
        self.used = Instant::now();
        answer.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
    }

    async fn exchange(&mut self, request: Request<Body>) -> io::Result<Answer> {
        let mut sender = match self.sender.take() {
            Some(sender) => sender,
            None => open(self.address).await?,
        };
        let (head, body) = send(&mut sender, request).await?.into_parts();
        let retry_after = head.headers.get(header::RETRY_AFTER);
        let answer = Answer {
            status: head.status.as_u16(),
            retry_after: retry_after.and_then(|value| Some(value.to_str().ok()?.to_owned())),
            body: to_bytes(body, usize::MAX).await.map_err(io::Error::other)?.into(),
        };
        self.sender = Some(sender);
        Ok(answer)
    }
}

/// An answer that is read line by line as it arrives.
#[derive(Debug)]
pub(crate) struct Lines {
    pub(crate) status: u16,
    pieces: BodyDataStream,
    /// The unread rest of the last piece.
    piece: Bytes,
}

impl Lines {
    /// The answer to `request` on its own connection.
    pub(crate) async fn of(address: SocketAddr, request: Request<Body>) -> io::Result<Self> {
        let begun = timeout(PATIENCE, async { send(&mut open(address).await?, request).await });
        let begun = begun.await.map_err(|_| io::ErrorKind::TimedOut)??;
        Ok(Self {
            status: begun.status().as_u16(),
            pieces: begun.into_body().into_data_stream(),
            piece: Bytes::new(),
        })
    }

    /// The next line without its end; none at the end of the answer.
    pub(crate) async fn next(&mut self) -> io::Result<Option<String>> {
        let mut line = vec![];
        loop {
            if let Some(length) = self.piece.iter().position(|byte| *byte == b'\n') {
                line.extend_from_slice(&self.piece.split_to(length + 1)[..length]);
                break;
            }
            line.extend_from_slice(&mem::take(&mut self.piece));
            match self.pieces.next().await.transpose().map_err(io::Error::other)? {
                Some(piece) => self.piece = piece,
                None if line.is_empty() => return Ok(None),
                None => break,
            }
        }
        String::from_utf8(line).map(Some).map_err(io::Error::other)
    }
}

async fn open(address: SocketAddr) -> io::Result<SendRequest<Body>> {
    let socket = TcpStream::connect(address).await?;
    socket.set_nodelay(true)?;
    let begun = Builder::new().max_buf_size(BUFFER).handshake(TokioIo::new(socket));
    let (sender, connection) = begun.await.map_err(io::Error::other)?;
    tokio::spawn(connection);
    Ok(sender)
}

async fn send(sender: &mut SendRequest<Body>, request: Request<Body>) -> io::Result<Response<Body>> {
    sender.ready().await.map_err(io::Error::other)?;
    let answer = sender.send_request(with(request, "host", "localhost"));
    Ok(answer.await.map_err(io::Error::other)?.map(Body::new))
}
