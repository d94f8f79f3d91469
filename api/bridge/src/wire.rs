//! Sockets and serial ports: bytes in as they arrive, bytes out while the wire is open.
//!
//! Each wire of a bridge is an [`Input`], which receives its bytes, and an [`Output`]. [`open`]
//! makes both for a socket or port; a test makes its own.

#![expect(
    clippy::disallowed_methods,
    reason = "sockets and serial ports block: each has a thread of its own, which does nothing else"
)]

use std::io::{self, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, SocketAddrV4, TcpStream, ToSocketAddrs as _, UdpSocket};
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{fmt, thread};

use clock::Clock;
use parking_lot::Mutex;
use serial2::SerialPort;
use tokio::sync::mpsc::Sender;

mod network;

use self::network::ImcNetwork;

/// Address of a wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// `udp:HOST:PORT`: listens, and answers the last sender.
    Udp(String),
    /// `udpout:HOST:PORT`: sends.
    UdpOut(String),
    /// `tcp:HOST:PORT`: connects, and reconnects.
    Tcp(String),
    /// `imc:ADDRESS:PORT`: a network of IMC, on which this computer has the address, such as
    /// `10.0.2.1:6010`.
    Imc(String),
    /// `serial:DEVICE:BAUD`.
    Serial {
        /// The device, such as `/dev/ttyUSB0`.
        device: String,
        /// Bits per second.
        baud: u32,
    },
}

/// A text that is not an endpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is not a wire: write udp:HOST:PORT to listen, udpout:HOST:PORT, tcp:HOST:PORT, imc:ADDRESS:PORT or serial:DEVICE:BAUD"
)]
pub struct InvalidEndpoint(String);

impl FromStr for Endpoint {
    type Err = InvalidEndpoint;

    fn from_str(text: &str) -> Result<Self, InvalidEndpoint> {
        let invalid = || InvalidEndpoint(text.to_owned());
        let (kind, rest) = text.split_once(':').ok_or_else(invalid)?;
        let (name, number) = rest.rsplit_once(':').ok_or_else(invalid)?;
        let number: u32 = number.parse().map_err(|_| invalid())?;
        let address = || match u16::try_from(number) {
            Ok(_) if !name.is_empty() => Ok(rest.to_owned()),
            _ => Err(invalid()),
        };
        match kind {
            "udp" => address().map(Self::Udp),
            "udpout" => address().map(Self::UdpOut),
            "tcp" => address().map(Self::Tcp),
            "imc" => {
                let is_own = |address: &SocketAddrV4| !address.ip().is_unspecified();
                let address = rest.parse().ok().filter(is_own).ok_or_else(invalid)?;
                Ok(Self::Imc(address.to_string()))
            }
            "serial" if !name.is_empty() && number > 0 => {
                Ok(Self::Serial { device: name.to_owned(), baud: number })
            }
            _ => Err(invalid()),
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Udp(address) => write!(f, "udp:{address}"),
            Self::UdpOut(address) => write!(f, "udpout:{address}"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Imc(address) => write!(f, "imc:{address}"),
            Self::Serial { device, baud } => write!(f, "serial:{device}:{baud}"),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Received {
    pub(crate) wire: usize,
    /// Its bytes; none of a stream that has just been opened.
    pub(crate) bytes: Vec<u8>,
    /// `true` for a datagram, `false` for a piece of a stream.
    pub(crate) is_datagram: bool,
    pub(crate) at: Instant,
}

/// Receives the bytes of one wire.
#[derive(Clone, Debug)]
pub struct Input {
    pub(crate) wire: usize,
    pub(crate) received: Sender<Received>,
    pub(crate) clock: Clock,
}

impl Input {
    /// Passes on a datagram, or a piece of a stream, that arrives now. Waits while the bridge's
    /// queue is full. Returns `false` once the bridge is gone.
    pub async fn arrived(&self, bytes: Vec<u8>, is_datagram: bool) -> bool {
        let piece = self.piece(bytes, is_datagram);
        self.received.send(piece).await.is_ok()
    }

    /// Tells that a stream was opened. Returns `false` once the bridge is gone.
    fn opened(&self) -> bool {
        self.received.blocking_send(self.piece(vec![], false)).is_ok()
    }

    pub(crate) fn piece(&self, bytes: Vec<u8>, is_datagram: bool) -> Received {
        Received { wire: self.wire, bytes, is_datagram, at: self.clock.now() }
    }
}

/// Takes the bytes for one wire. A failure is only logged: the next message follows soon. No bytes
/// ask to close a connection, which is then opened again.
pub type Output = Box<dyn FnMut(&[u8]) + Send>;

/// Time between two attempts to open.
const RETRY: Duration = Duration::from_secs(1);
/// Longest wait of a read, after which a closed line is noticed.
const READ_TIMEOUT: Duration = Duration::from_millis(500);
/// Longest write, which a newer reference would replace: they come ten times a second.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
/// Longest read: a datagram, or the bytes since the last read.
const READ_BYTES: usize = 4096;

/// Opens `endpoint` on its own thread, and again after failures, until the bridge is gone.
pub fn open(endpoint: &Endpoint, input: Input) -> Output {
    let line = Arc::new(Mutex::new(None::<OpenWire>));
    let (kept, endpoint) = (Arc::clone(&line), endpoint.clone());
    thread::spawn(move || keep_open(&endpoint, &kept, &input));
    Box::new(move |bytes| {
        if let Some(open) = line.lock().as_mut()
            && let Err(error) = open.write(bytes)
        {
            tracing::debug!(%error, "not sent");
        }
    })
}

/// Opens, reads until it breaks, and repeats.
fn keep_open(endpoint: &Endpoint, kept: &Mutex<Option<OpenWire>>, input: &Input) {
    let keep = |line| *kept.lock() = line;
    let mut was_open = true;
    loop {
        match OpenWire::open(endpoint) {
            Ok(line) => {
                tracing::info!(%endpoint, "open");
                was_open = true;
                let again = line.clone();
                keep(Some(line));
                if matches!(again, OpenWire::Tcp(_)) && !input.opened() {
                    return;
                }
                let broken = read(again, kept, input);
                keep(None);
                match broken {
                    Some(error) => tracing::warn!(%endpoint, %error, "connection lost: it is opened again"),
                    None => return,
                }
            }
            Err(error) if was_open => {
                was_open = false;
                tracing::warn!(%endpoint, %error, "cannot open; retrying every {} s", RETRY.as_secs());
            }
            Err(_) => {}
        }
        thread::sleep(RETRY);
    }
}

/// Forwards bytes until the wire breaks (then it returns the reason) or the receiver is gone.
fn read(mut line: OpenWire, kept: &Mutex<Option<OpenWire>>, input: &Input) -> Option<io::Error> {
    let mut buffer = [0; READ_BYTES];
    loop {
        match line.read(&mut buffer, kept) {
            Ok(0) => return Some(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                let piece = input
                    .piece(buffer[..count].to_vec(), matches!(line, OpenWire::Udp { .. } | OpenWire::Imc(_)));
                input.received.blocking_send(piece).ok()?;
            }
            Err(error) if is_pause(&error) => {}
            Err(error) => return Some(error),
        }
    }
}

/// `true` if nothing arrived in time, or a datagram had no listener.
fn is_pause(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock
            | io::ErrorKind::TimedOut
            | io::ErrorKind::Interrupted
            | io::ErrorKind::ConnectionRefused
    )
}

#[derive(Clone, Debug)]
enum OpenWire {
    Udp {
        socket: Arc<UdpSocket>,
        /// All addresses of a name, until one of them answers.
        peers: Vec<SocketAddr>,
    },
    Tcp(Arc<TcpStream>),
    Imc(Arc<ImcNetwork>),
    Serial(Arc<SerialPort>),
}

impl OpenWire {
    fn open(endpoint: &Endpoint) -> io::Result<Self> {
        match endpoint {
            Endpoint::Udp(address) => Self::udp(UdpSocket::bind(address.as_str())?, vec![]),
            Endpoint::UdpOut(address) => {
                let addresses: Vec<SocketAddr> = address.to_socket_addrs()?.collect();
                let (socket, peers) = socket_to(&addresses)?;
                Self::udp(socket, peers)
            }
            Endpoint::Tcp(address) => {
                let stream = connected(address.to_socket_addrs()?)?;
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(READ_TIMEOUT))?;
                stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
                Ok(Self::Tcp(Arc::new(stream)))
            }
            Endpoint::Imc(address) => Ok(Self::Imc(Arc::new(ImcNetwork::open(address, WRITE_TIMEOUT)?))),
            Endpoint::Serial { device, baud } => {
                let mut port = SerialPort::open(device, *baud)?;
                port.set_read_timeout(READ_TIMEOUT)?;
                port.set_write_timeout(WRITE_TIMEOUT)?;
                Ok(Self::Serial(Arc::new(port)))
            }
        }
    }

    fn udp(socket: UdpSocket, peers: Vec<SocketAddr>) -> io::Result<Self> {
        socket.set_read_timeout(Some(READ_TIMEOUT))?;
        socket.set_write_timeout(Some(WRITE_TIMEOUT))?;
        Ok(Self::Udp { socket: Arc::new(socket), peers })
    }

    /// Reads; the sender of a datagram becomes the one peer in `kept`.
    fn read(&mut self, into: &mut [u8], kept: &Mutex<Option<Self>>) -> io::Result<usize> {
        match self {
            Self::Udp { socket, peers } => {
                let (count, sender) = socket.recv_from(into)?;
                if *peers != [sender] {
                    *peers = vec![sender];
                    *kept.lock() = Some(self.clone());
                }
                // An empty datagram is not the end of a stream.
                if count == 0 {
                    return Err(io::ErrorKind::Interrupted.into());
                }
                Ok(count)
            }
            Self::Tcp(stream) => stream.as_ref().read(into),
            Self::Imc(network) => network.receive(into),
            Self::Serial(port) => port.read(into),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Udp { socket, peers } => {
                // One family of a name's addresses may have no route.
                let sent = peers.iter().map(|peer| socket.send_to(bytes, peer).map(drop));
                sent.reduce(Result::or).unwrap_or(Ok(()))
            }
            Self::Tcp(stream) if bytes.is_empty() => stream.shutdown(Shutdown::Both),
            // After a part of a packet the other side would misread all that follows.
            Self::Tcp(stream) => stream.as_ref().write_all(bytes).inspect_err(|_| {
                let _ = stream.shutdown(Shutdown::Both);
            }),
            Self::Imc(network) => network.send(bytes),
            Self::Serial(port) => port.write_all(bytes),
        }
    }
}

/// A connection to the first of a name's addresses that accepts one; IPv6 may have no listener.
fn connected(addresses: impl Iterator<Item = SocketAddr>) -> io::Result<TcpStream> {
    let tried = addresses.map(|address| TcpStream::connect_timeout(&address, CONNECT_TIMEOUT));
    let mut failed = io::ErrorKind::AddrNotAvailable.into();
    for result in tried {
        match result {
            Ok(stream) => return Ok(stream),
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

/// A socket for `addresses`, in its notation; without IPv6, for those of IPv4.
fn socket_to(addresses: &[SocketAddr]) -> io::Result<(UdpSocket, Vec<SocketAddr>)> {
    if addresses.iter().any(SocketAddr::is_ipv6)
        && let Ok(socket) = UdpSocket::bind(SocketAddr::from(([0_u16; 8], 0)))
    {
        let mapped = |address: &SocketAddr| match address {
            SocketAddr::V4(v4) => (v4.ip().to_ipv6_mapped(), v4.port()).into(),
            SocketAddr::V6(_) => *address,
        };
        return Ok((socket, addresses.iter().map(mapped).collect()));
    }
    let peers: Vec<SocketAddr> = addresses.iter().copied().filter(SocketAddr::is_ipv4).collect();
    if peers.is_empty() {
        return Err(io::ErrorKind::AddrNotAvailable.into());
    }
    Ok((UdpSocket::bind(SocketAddr::from(([0, 0, 0, 0], 0)))?, peers))
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use tokio::sync::mpsc::{Receiver, channel};

    use super::*;

    #[test]
    fn endpoints_are_read_and_other_texts_rejected_with_the_syntax() {
        let good = "udp:0.0.0.0:14550 udpout:localhost:14551 tcp:[::1]:5760 serial:/dev/ttyUSB0:57600 \
                    imc:10.0.2.1:6010";
        for text in good.split(' ') {
            let endpoint: Endpoint = text.parse().expect("an endpoint");
            assert_eq!(endpoint.to_string(), text);
        }
        let wrong =
            "tcp tcp: tcp::5760 tcp:localhost:70000 serial:/dev/ttyUSB0:0 i2c:a:1 imc:0.0.0.0:1 imc:host:1";
        for text in wrong.split(' ').chain([""]) {
            let error = text.parse::<Endpoint>().expect_err("no endpoint");
            assert!(error.to_string().contains("tcp:HOST:PORT"), "{error}");
        }
    }

    /// An input, number 3, and its receiver.
    fn input() -> (Input, Receiver<Received>) {
        let (received, pieces) = channel(8);
        let clock = Clock::machine();
        let input = Input { wire: 3, received, clock };
        (input, pieces)
    }

    #[test]
    fn a_listening_wire_answers_its_last_sender() {
        let line = OpenWire::open(&Endpoint::Udp("127.0.0.1:0".to_owned())).expect("a free port");
        let OpenWire::Udp { socket, .. } = &line else { panic!("{line:?}") };
        let address = socket.local_addr().expect("is bound");
        let kept = Arc::new(Mutex::new(Some(line.clone())));
        let (input, mut pieces) = input();
        let reader = Arc::clone(&kept);
        thread::spawn(move || read(line, &reader, &input));
        for said in [b"hello", b"again"] {
            let craft = UdpSocket::bind("127.0.0.1:0").expect("a free port");
            craft.send_to(said, address).expect("is sent");
            let heard = pieces.blocking_recv().expect("is read");
            assert_eq!((heard.wire, heard.bytes.as_slice(), heard.is_datagram), (3, &said[..], true));
            let mut open = kept.lock();
            open.as_mut().expect("is open").write(b"aye").expect("is sent");
            let mut answer = [0; 8];
            let count = craft.recv(&mut answer).expect("is answered");
            assert_eq!(&answer[..count], b"aye");
        }
    }

    #[test]
    fn all_addresses_of_a_name_are_tried() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let here = listener.local_addr().expect("is bound");
        // Nothing listens there.
        let nowhere = SocketAddr::from(([0, 0, 0, 0, 0, 0, 0, 1], here.port()));
        let stream = connected([nowhere, here].into_iter()).expect("the second accepts");
        assert_eq!(stream.peer_addr().expect("is connected"), here);
        assert!(connected([nowhere].into_iter()).is_err());

        let craft = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        let here = craft.local_addr().expect("is bound");
        let nowhere = SocketAddr::from(([0, 0, 0, 0, 0, 0, 0, 1], here.port()));
        let (socket, peers) = socket_to(&[nowhere, here]).expect("a socket");
        let mut line = OpenWire::udp(socket, peers).expect("is open");
        line.write(b"hello").expect("is sent");
        let mut heard = [0; 8];
        let (count, bridge) = craft.recv_from(&mut heard).expect("is heard");
        assert_eq!(&heard[..count], b"hello");
        craft.send_to(b"aye", bridge).expect("is answered");
        line.read(&mut heard, &Mutex::new(None)).expect("is heard");
        let OpenWire::Udp { peers, .. } = line else {
            unreachable!("is UDP");
        };
        assert_eq!(peers.iter().map(|peer| peer.ip().to_canonical()).collect::<Vec<_>>(), [here.ip()]);
    }

    #[test]
    fn a_connecting_wire_carries_bytes_both_ways_and_closes_when_asked_to() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("is bound");
        let (input, mut pieces) = input();
        let mut send = open(&Endpoint::Tcp(address.to_string()), input);
        let (mut craft, _) = listener.accept().expect("connects");
        craft.write_all(b"hello").expect("is sent");
        // It tells that it is open.
        for expected in [&b""[..], b"hello"] {
            let heard = pieces.blocking_recv().expect("is read");
            assert_eq!((heard.wire, heard.bytes.as_slice(), heard.is_datagram), (3, expected, false));
        }
        send(b"aye");
        // It is asked to close.
        send(b"");
        let mut answer = vec![];
        craft.read_to_end(&mut answer).expect("is answered");
        assert_eq!(answer, b"aye");
    }
}
