//! Many readers of a mission's events, and one that does not read.

use std::{io, net::SocketAddr, time::Duration};

use serde::Deserialize;
use tokio::{
    task::JoinSet,
    time::{Instant, sleep_until, timeout_at},
};

use super::{
    flight::{Sea, make},
    http::{Connection, Lines, Request},
    tally::{Shared, memory, memory_kib},
};

/// Time of reading, and of the slow reader's pause.
const MINUTE: Duration = Duration::from_mins(1);
/// Time between two posts to the mission with many readers.
const CALM: Duration = Duration::from_millis(100);
/// Receive buffer of the slow reader, bytes: the system rounds it up to its own least.
const SMALL_BUFFER: u32 = 4096;
/// Fixes of each vehicle in a post of the flood: the accepted maximum.
const FLOOD_FIXES: u32 = 64;
/// Longest time for the slow reader to reach its gap.
const CATCH_UP: Duration = Duration::from_mins(1);

/// An event of a stream, or the events missed.
#[derive(Debug)]
enum StreamItem {
    Event(u64),
    Gap { from: u64, to: u64 },
}

/// The data of a gap.
#[derive(Debug, Deserialize)]
struct Gap {
    from: u64,
    to: u64,
}

/// A reader of a mission's events, which knows the next number.
#[derive(Debug)]
struct Reader {
    lines: Lines,
    last: u64,
    events: u64,
    gaps: Vec<Gap>,
    /// The expected number and the received one.
    breaks: Vec<(u64, u64)>,
}

impl Reader {
    async fn new(address: SocketAddr, id: &str, last: u64, buffer: Option<u32>) -> io::Result<Self> {
        let get =
            Request::get(&format!("/v1/missions/{id}/events")).header("last-event-id", &last.to_string());
        let mut lines = Lines::of(address, &get, buffer).await?;
        if lines.status != 200 {
            let problem = lines.next().await?.unwrap_or_default();
            return Err(io::Error::other(format!("{}: {problem}", lines.status)));
        }
        Ok(Self {
            lines,
            last,
            events: 0,
            gaps: vec![],
            breaks: vec![],
        })
    }

    /// Reads one event; `true` if there was one.
    async fn step(&mut self) -> io::Result<bool> {
        match next(&mut self.lines).await? {
            None => return Ok(false),
            Some(StreamItem::Event(sequence)) => {
                if sequence != self.last + 1 {
                    self.breaks.push((self.last + 1, sequence));
                }
                self.events += 1;
                self.last = sequence;
            }
            Some(StreamItem::Gap { from, to }) => {
                if from != self.last + 1 {
                    self.breaks.push((self.last + 1, from));
                }
                self.gaps.push(Gap { from, to });
                self.last = to;
            }
        }
        Ok(true)
    }

    async fn read_until(&mut self, end: Instant) -> io::Result<()> {
        while let Ok(read) = timeout_at(end, self.step()).await {
            if !read? {
                return Err(io::Error::other("the stream ended"));
            }
        }
        Ok(())
    }
}

/// The next event.
/// Source: the HTML standard, section 9.2.6, "Interpreting an event stream".
async fn next(lines: &mut Lines) -> io::Result<Option<StreamItem>> {
    let (mut id, mut kind, mut data) = (None, String::new(), String::new());
    while let Some(line) = lines.next().await? {
        match line.split_once(": ").unwrap_or((&line, "")) {
            ("id", value) => id = value.parse().ok(),
            ("event", value) => value.clone_into(&mut kind),
            ("data", value) => data += value,
            // The end of an event, unless it was one of comments alone.
            ("", "") if kind == "gap" => {
                let Gap { from, to } = serde_json::from_str(&data)?;
                return Ok(Some(StreamItem::Gap { from, to }));
            }
            ("", "") => {
                if let Some(sequence) = id {
                    return Ok(Some(StreamItem::Event(sequence)));
                }
            }
            _ => {}
        }
    }
    Ok(None)
}

/// Posts until `end`, after every answer or every `pace`; returns the last acknowledged number.
async fn post(
    address: SocketAddr,
    id: String,
    fixes: u32,
    pace: Duration,
    end: Instant,
) -> io::Result<(u64, u64)> {
    #[derive(Deserialize)]
    struct Accepted {
        sequence: u64,
    }
    let mut connection = Connection::new(address);
    let (mut sea, mut posts, mut last) = (Sea::new(0), 0, 0);
    while Instant::now() < end {
        let due = Instant::now() + pace;
        let heard = sea.reports(fixes).to_string();
        let answer = connection
            .ask(&Request::post(&format!("/v1/missions/{id}/reports"), heard))
            .await?;
        if answer.status == 200 {
            let accepted: Accepted = serde_json::from_slice(&answer.body)?;
            (posts, last) = (posts + 1, accepted.sequence);
        }
        sleep_until(due).await;
    }
    Ok((posts, last))
}

/// Many readers of a mission for a minute, and one that does not read a flooded mission.
pub(crate) async fn run(address: SocketAddr, n_readers: usize, pid: Option<u32>) -> io::Result<()> {
    let mut connection = Connection::new(address);
    let shared = Shared::default();
    let refused = || io::Error::other(shared.lock().table());
    let calm = make(&mut connection, &shared).await?.ok_or_else(refused)?;
    let flooded = make(&mut connection, &shared).await?.ok_or_else(refused)?;
    let before = memory(pid);
    let end = Instant::now() + MINUTE;

    let mut readers = JoinSet::new();
    for _ in 0..n_readers {
        readers.spawn(read_and_come_again(address, calm.clone(), end));
    }
    let prompt = tokio::spawn(read_and_come_again(address, flooded.clone(), end));
    let slow = tokio::spawn(sleep_and_read(address, flooded.clone(), end));
    let calm_posts = tokio::spawn(post(address, calm, 1, CALM, end));
    let flood = tokio::spawn(post(address, flooded, FLOOD_FIXES, Duration::ZERO, end));
    let mut most = memory_kib(pid);
    while Instant::now() < end {
        sleep_until(Instant::now() + Duration::from_secs(1)).await;
        most = most.max(memory_kib(pid));
    }

    let (posts, last) = calm_posts.await.expect("does not panic")?;
    println!("{n_readers} readers of a mission with {posts} posts, the last of them event {last}:");
    let (mut events, mut gaps, mut breaks, mut behind) = (0, 0, 0, 0);
    while let Some(reader) = readers.join_next().await {
        let reader = reader.expect("does not panic")?;
        events += reader.events;
        gaps += reader.gaps.len();
        breaks += reader.breaks.len();
        behind = behind.max(last.saturating_sub(reader.last));
    }
    println!(
        "  {events} events read, {gaps} gaps, {breaks} breaks; at the end at most {behind} events behind"
    );
    let (posts, last) = flood.await.expect("does not panic")?;
    println!(
        "a mission with {posts} posts of {FLOOD_FIXES} fixes of each vehicle, the last of them event {last}:"
    );
    tell("the prompt reader", &prompt.await.expect("does not panic")?);
    tell("the slow reader", &slow.await.expect("does not panic")?);
    let most = most.map_or("unknown".to_owned(), |kib| format!("{} MiB", kib / 1024));
    println!("memory before {before}, at most {most}, now {}", memory(pid));
    Ok(())
}

fn tell(who: &str, reader: &Reader) {
    println!("  {who}: {} events, breaks {:?}", reader.events, reader.breaks);
    for Gap { from, to } in &reader.gaps {
        println!("    a gap from {from} to {to}");
    }
}

/// Reads, disconnects in the middle, and resumes there.
async fn read_and_come_again(address: SocketAddr, id: String, end: Instant) -> io::Result<Reader> {
    let mut first = Reader::new(address, &id, 0, None).await?;
    first.read_until(end - MINUTE / 2).await?;
    let Reader {
        last,
        events,
        gaps,
        breaks,
        ..
    } = first;
    let again = Reader::new(address, &id, last, None).await?;
    let mut again = Reader {
        events,
        gaps,
        breaks,
        ..again
    };
    again.read_until(end).await?;
    Ok(again)
}

/// Reads nothing until `end`, and then until a gap and the event after it.
async fn sleep_and_read(address: SocketAddr, id: String, end: Instant) -> io::Result<Reader> {
    let mut reader = Reader::new(address, &id, 0, Some(SMALL_BUFFER)).await?;
    sleep_until(end).await;
    let patience = end + CATCH_UP;
    while reader.gaps.is_empty() {
        let Ok(read) = timeout_at(patience, reader.step()).await else {
            return Ok(reader);
        };
        if !read? {
            return Ok(reader);
        }
    }
    // The event after the gap: its number checks the gap.
    if let Ok(read) = timeout_at(patience, reader.step()).await {
        read?;
    }
    Ok(reader)
}
