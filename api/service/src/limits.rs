//! Every limit on what clients may use: connections, bodies, answers, admission, missions.
//!
//! Ranges of members of requests are the planner's, and those of missions. How much of the disk one
//! client's missions may fill is a setting; [`store::Room`] says for which events it holds.

use std::time::Duration;

// Connections. One address has at most half of them; a newcomer takes the place of an idle one.

/// Most connections at once: a few for each running mission.
pub const CONNECTIONS_MAX: usize = 4_096;
/// Connections that the system completes before they are accepted: as many as the greatest number
/// at once. Linux allows at most `net.core.somaxconn`, by default as many.
pub const BACKLOG: usize = CONNECTIONS_MAX;
/// File descriptors of the service itself: mission log, readers, records, refused connections.
pub const FILES_RESERVED: usize = 256;
/// Connections that are refused at the same time; more are closed without an answer.
pub const REFUSALS_MAX: usize = 64;
/// Time for a refused client to read the answer.
pub const REFUSAL_TIME: Duration = Duration::from_millis(500);
/// Time for a request header, including the wait for the next request of a connection.
pub const HEADER_TIME: Duration = Duration::from_secs(10);
/// Longest head of a request, bytes; hyper itself refuses more than 100 headers. It also bounds
/// hyper's buffers of bodies, at most twice 64 MiB for all connections.
pub const HEAD_BYTES_MAX: usize = 16 << 10;
/// Longest time for which a client may read nothing of an answer.
pub const UNREAD_TIME: Duration = Duration::from_secs(5);
/// Unread bytes of an answer that the system holds for a connection. More would hide slow clients,
/// and costs memory for each connection.
pub const SEND_BUFFER: usize = 64 << 10;
/// Time for open requests after the stop signal: as long as a body may take to arrive.
pub const DRAIN_TIME: Duration = Duration::from_secs(10);
/// A longer request without a token may lose its connection to any newcomer, and the only caller of
/// an address to a newcomer from there: a plan takes less time.
pub(crate) const LONG_REQUEST: Duration = Duration::from_secs(3);
/// Bits of an IPv6 address that name a network: one machine has all addresses of its network.
pub(crate) const IPV6_NETWORK_BITS: u32 = 64;

// Bodies and answers. The number of connections bounds the memory of short ones.

/// Longest body accepted, bytes.
pub const BODY_BYTES_MAX: usize = 1 << 20;
/// Longest body that is parsed where it arrives, in a fraction of a millisecond, bytes. Longer ones
/// are parsed on threads that delay no mission.
pub(crate) const SHORT_BYTES_MAX: usize = 16 << 10;
/// Most pieces of a body, each of which costs microseconds; half packets need a quarter of them.
pub(crate) const PIECES_MAX: usize = 8_192;
/// Memory for bodies that arrive or wait to be read, KiB: half for plans and half for missions, so
/// that neither uses the memory of the other.
pub(crate) const BODIES_KIB_MAX: usize = 256 << 10;
/// Memory for long answers, KiB, of which one caller has at most half.
pub(crate) const ANSWERS_KIB_MAX: usize = 128 << 10;
/// Most snapshots in one request.
pub(crate) const BATCH_MAX: usize = 64;
/// Most field errors in one document: a client corrects the first few and asks again.
pub(crate) const FIELD_ERRORS_MAX: usize = 64;

// Admission.

/// Fixed cost of a request, in bytes of a body.
pub(crate) const REQUEST_COST: f64 = 4096.0;
/// Weight of the newest request in the moving averages.
pub(crate) const NEWEST_WEIGHT: f64 = 0.05;
/// Longest work on one request that counts in the averages, s.
pub(crate) const WORK_MAX: f64 = 1.0;
/// Longest queue that is still a burst; a longer one is standing. Source: Nichols and Jacobson,
/// "Controlling Queue Delay", 2012: the interval of `CoDel`.
pub(crate) const STANDING_QUEUE_TIME: Duration = Duration::from_millis(100);
/// Time without refusals after which a queue that was cut may be long again. If it could grow at
/// once, most requests admitted under lasting overload would wait in it.
pub(crate) const CUT_QUEUE_TIME: Duration = Duration::from_secs(1);
/// Wait of a standing queue, in mean times of work: two threads serve up to sixteen steady clients.
pub(crate) const QUEUE_WAIT_MAX: f64 = 7.0;
/// The same after a cut: admitted requests wait little longer than without overload.
pub(crate) const CUT_QUEUE_WAIT_MAX: f64 = 0.6;
/// Least mean time of work for these waits, s.
pub(crate) const WORK_MIN: f64 = 2e-3;
/// Most bytes of the idle workspaces of requests, and of those of missions.
pub(crate) const IDLE_BYTES_MAX: usize = 32 << 20;

// Missions. One client has at most half of the memory, streams and records.

/// Most active missions: more than two processors can plan for once a second.
pub(crate) const ACTORS_MAX: usize = 1_024;
/// Most unfinished missions of one client.
pub(crate) const OPEN_SHARE: usize = ACTORS_MAX / 2;
/// Most bytes of active live missions in memory, beside workspaces. A body of the greatest length
/// makes one of 5 MiB.
pub(crate) const LIVE_BYTES_MAX: usize = 256 << 20;
/// Requests that may wait for a mission: reports of a few vehicles for some seconds.
pub(crate) const MAILBOX: usize = 32;
/// Longest wait of a client for a mission's reply.
pub(crate) const ANSWER_TIME: Duration = Duration::from_secs(10);
/// Longest wait of a client for the check of a simulation.
pub(crate) const CHECK_TIME: Duration = Duration::from_secs(5);
/// Most readers of event streams.
pub(crate) const STREAMS_MAX: usize = 256;
/// Events that a reader of a stream may be behind before it misses some.
pub(crate) const EVENTS_BEHIND_MAX: usize = 64;
/// Most simultaneous records, each on its own thread and in at most 9 MB.
pub(crate) const RECORDS_MAX: usize = 16;
/// Chunks of a record in transit. With their size they bound the memory for a slow reader.
pub(crate) const CHUNKS: usize = 4;
/// Size of a chunk, bytes.
pub(crate) const CHUNK: usize = 64 << 10;
/// Longest time for which the client of a record may leave a chunk waiting.
pub(crate) const CHUNK_TIME: Duration = Duration::from_secs(10);
/// Longest list of missions, bytes of their stored form, except for a list of one.
pub(crate) const LIST_BYTES_MAX: usize = 64 << 10;
/// Most threads that read the store.
pub(crate) const READERS_MAX: usize = 16;
/// Most threads that look up mission owners.
pub(crate) const OWNING_MAX: usize = 8;
