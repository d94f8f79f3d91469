//! HTTP/1.1 over a connection that is kept: as much of it as the service answers with.
//! Source: RFC 9112, sections 6 and 7.

use std::{io, net::SocketAddr, time::Duration};

use tokio::{
    io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader},
    net::{TcpSocket, TcpStream},
    time::{Instant, timeout},
};

/// Longer than the service lets anything take but streams and waits for a plan.
const PATIENCE: Duration = Duration::from_secs(30);

/// A connection that was not used for so long is made anew: the service closes them after 10 s.
const IDLE_MAX: Duration = Duration::from_secs(5);

/// A request, of which the rest is always the same.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    head: String,
    body: String,
}

impl Request {
    pub(crate) fn get(path: &str) -> Self {
        Self {
            head: format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n"),
            body: String::new(),
        }
    }

    pub(crate) fn post(path: &str, body: String) -> Self {
        let length = body.len();
        let about =
            format!("host: localhost\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n");
        Self {
            head: format!("POST {path} HTTP/1.1\r\n{about}"),
            body,
        }
    }

    pub(crate) fn header(mut self, name: &str, value: &str) -> Self {
        self.head.extend([name, ": ", value, "\r\n"]);
        self
    }
}

/// An answer, read to its end.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    /// What `Retry-After` says.
    pub(crate) retry_after: Option<String>,
    pub(crate) body: Vec<u8>,
}

/// How the end of a body is known, and what of it is still to come.
#[derive(Clone, Copy, Debug)]
enum Framing {
    Left(usize),
    Chunked,
    Over,
}

#[derive(Debug)]
struct Head {
    status: u16,
    retry_after: Option<String>,
    framing: Framing,
}

/// A connection that is made when it is needed, and made again after it failed.
#[derive(Debug)]
pub(crate) struct Connection {
    address: SocketAddr,
    socket: Option<BufReader<TcpStream>>,
    /// When the newest answer ended.
    used: Instant,
}

impl Connection {
    pub(crate) fn new(address: SocketAddr) -> Self {
        Self {
            address,
            socket: None,
            used: Instant::now(),
        }
    }

    /// The answer to `request`.
    pub(crate) async fn ask(&mut self, request: &Request) -> io::Result<Answer> {
        if IDLE_MAX < self.used.elapsed() {
            self.socket = None;
        }
        let answer = timeout(PATIENCE, self.exchange(request)).await;
        let answer = answer.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()));
        self.used = Instant::now();
        if answer.is_err() {
            self.socket = None;
        }
        answer
    }

    async fn exchange(&mut self, request: &Request) -> io::Result<Answer> {
        if self.socket.is_none() {
            self.socket = Some(open(self.address, None).await?);
        }
        let socket = self.socket.as_mut().expect("is open");
        let mut head = begin(socket, request).await?;
        let mut body = vec![];
        while let Some(piece) = next_piece(socket, &mut head.framing).await? {
            body.extend(piece);
        }
        Ok(Answer {
            status: head.status,
            retry_after: head.retry_after,
            body,
        })
    }
}

/// An answer that is read line by line as it comes.
#[derive(Debug)]
pub(crate) struct Lines {
    pub(crate) status: u16,
    socket: BufReader<TcpStream>,
    framing: Framing,
    piece: Vec<u8>,
    /// Where in the piece the next line begins.
    at: usize,
}

impl Lines {
    /// The answer to `request`, on a connection of its own, which keeps about `buffer` bytes that are not read.
    pub(crate) async fn of(address: SocketAddr, request: &Request, buffer: Option<u32>) -> io::Result<Self> {
        let begun = timeout(PATIENCE, async {
            let mut socket = open(address, buffer).await?;
            let head = begin(&mut socket, request).await?;
            Ok((socket, head))
        });
        let begun: io::Result<_> = begun
            .await
            .unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()));
        let (socket, head) = begun?;
        Ok(Self {
            status: head.status,
            socket,
            framing: head.framing,
            piece: vec![],
            at: 0,
        })
    }

    /// The next line without its end; none at the end of the answer.
    pub(crate) async fn next(&mut self) -> io::Result<Option<String>> {
        let mut line = vec![];
        loop {
            let rest = &self.piece[self.at..];
            if let Some(length) = rest.iter().position(|byte| *byte == b'\n') {
                line.extend_from_slice(&rest[..length]);
                self.at += length + 1;
                break;
            }
            line.extend_from_slice(rest);
            self.at = 0;
            match next_piece(&mut self.socket, &mut self.framing).await? {
                Some(piece) => self.piece = piece,
                None if line.is_empty() => return Ok(None),
                None => {
                    self.piece.clear();
                    break;
                }
            }
        }
        let text = String::from_utf8(line).map_err(|_| malformed("a line that is not UTF-8"))?;
        Ok(Some(text))
    }
}

async fn open(address: SocketAddr, buffer: Option<u32>) -> io::Result<BufReader<TcpStream>> {
    let socket = if address.is_ipv4() {
        TcpSocket::new_v4()?
    } else {
        TcpSocket::new_v6()?
    };
    if let Some(bytes) = buffer {
        socket.set_recv_buffer_size(bytes)?;
    }
    let socket = socket.connect(address).await?;
    socket.set_nodelay(true)?;
    Ok(BufReader::new(socket))
}

async fn begin(socket: &mut BufReader<TcpStream>, request: &Request) -> io::Result<Head> {
    let Request { head, body } = request;
    socket.write_all(format!("{head}\r\n{body}").as_bytes()).await?;
    let first = head_line(socket).await?;
    let status = first.split(' ').nth(1).and_then(|status| status.parse().ok());
    let mut read = Head {
        status: status.ok_or_else(|| malformed("no status"))?,
        retry_after: None,
        framing: Framing::Over,
    };
    loop {
        let line = head_line(socket).await?;
        let Some((name, value)) = line.split_once(':') else {
            return Ok(read);
        };
        let value = value.trim();
        match name.to_ascii_lowercase().as_str() {
            "content-length" => {
                let length = value
                    .parse()
                    .map_err(|_| malformed("a length that is no number"))?;
                read.framing = Framing::Left(length);
            }
            "transfer-encoding" => read.framing = Framing::Chunked,
            "retry-after" => read.retry_after = Some(value.to_owned()),
            _ => {}
        }
    }
}

async fn head_line(socket: &mut BufReader<TcpStream>) -> io::Result<String> {
    let mut line = String::new();
    match socket.read_line(&mut line).await? {
        0 => Err(io::ErrorKind::UnexpectedEof.into()),
        _ => Ok(line.trim_end().to_owned()),
    }
}

/// What of the body came together; none at its end.
async fn next_piece(socket: &mut BufReader<TcpStream>, framing: &mut Framing) -> io::Result<Option<Vec<u8>>> {
    let length = match *framing {
        Framing::Over | Framing::Left(0) => return Ok(None),
        Framing::Left(length) => length,
        Framing::Chunked => {
            let line = head_line(socket).await?;
            usize::from_str_radix(&line, 16).map_err(|_| malformed("a chunk without a length"))?
        }
    };
    let mut piece = vec![0; length];
    socket.read_exact(&mut piece).await?;
    if let Framing::Left(_) = framing {
        *framing = Framing::Over;
        return Ok(Some(piece));
    }
    if !head_line(socket).await?.is_empty() {
        return Err(malformed("a chunk longer than it says"));
    }
    if length == 0 {
        *framing = Framing::Over;
        return Ok(None);
    }
    Ok(Some(piece))
}

fn malformed(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}
