//! A client of the service over a kept connection.

use std::{io, mem, net::SocketAddr, time::Duration};

use axum::body::{Body, BodyDataStream, Bytes, to_bytes};
use axum::http::{Request, Response, header};
use futures_util::StreamExt as _;
use hyper_util::{
    client::legacy::{Client, connect::HttpConnector},
    rt::TokioExecutor,
};
use tokio::time::timeout;

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
    client: Client<HttpConnector, Body>,
}

impl Connection {
    pub(crate) fn new(address: SocketAddr) -> Self {
        let mut connector = HttpConnector::new();
        connector.set_nodelay(true);
        let mut client = Client::builder(TokioExecutor::new());
        client.pool_idle_timeout(IDLE_MAX).http1_max_buf_size(BUFFER);
        Self { address, client: client.build(connector) }
    }

    /// The answer to `request`.
    pub(crate) async fn ask(&mut self, request: Request<Body>) -> io::Result<Answer> {
        let answer = async {
            let (head, body) = self.send(request).await?.into_parts();
            let retry_after = head.headers.get(header::RETRY_AFTER);
            Ok(Answer {
                status: head.status.as_u16(),
                retry_after: retry_after.and_then(|value| Some(value.to_str().ok()?.to_owned())),
                body: to_bytes(body, usize::MAX).await.map_err(io::Error::other)?.into(),
            })
        };
        timeout(PATIENCE, answer).await?
    }

    async fn send(&self, mut request: Request<Body>) -> io::Result<Response<Body>> {
        let uri = format!("http://{}{}", self.address, request.uri());
        *request.uri_mut() = uri.parse().map_err(io::Error::other)?;
        Ok(self.client.request(request).await.map_err(io::Error::other)?.map(Body::new))
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
        let begun = timeout(PATIENCE, Connection::new(address).send(request)).await??;
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
