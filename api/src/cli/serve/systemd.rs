//! Notes to systemd (`sd_notify(3)`): the service listens, and its planners work.

use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;
use std::{env, io};

/// The watchdog time of systemd and the function that sends a heartbeat; `None` without it.
pub(super) fn heartbeat() -> Option<(Duration, fn())> {
    let of_this_process = env::var("WATCHDOG_PID").map_or(true, |pid| pid == std::process::id().to_string());
    let microseconds = env::var("WATCHDOG_USEC").ok()?.parse().ok()?;
    let heartbeat = || notify("WATCHDOG=1");
    of_this_process.then_some((Duration::from_micros(microseconds), heartbeat))
}

/// Sends a note; no effect without systemd.
pub(super) fn notify(note: &str) {
    let Ok(socket) = env::var("NOTIFY_SOCKET") else {
        return;
    };
    if let Err(error) = send(&socket, note) {
        tracing::warn!(%error, note, "cannot notify systemd");
    }
}

fn send(socket: &str, note: &str) -> io::Result<()> {
    let address = match socket.strip_prefix('@') {
        Some(name) => SocketAddr::from_abstract_name(name)?,
        None => SocketAddr::from_pathname(socket)?,
    };
    let sender = UnixDatagram::unbound()?;
    sender.set_nonblocking(true)?;
    sender.send_to_addr(note.as_bytes(), &address).map(drop)
}
