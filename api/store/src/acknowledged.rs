//! The last acknowledged event of each mission, in a file of its own. SQLite cannot tell a cut or
//! missing write-ahead file from one whose last commits never finished, nor an older copy from the
//! store itself. Digests are chained, so the last one stands for all events.
//!
//! ```text
//! number mission sequence digest time_s check
//! ```
//! Each mission has a line of [`LINE`] bytes at the place of its number, written between a commit
//! and its acknowledgement. A deleted mission has the digest `deleted`. `check` reveals damage.
//!
//! Lines survive a kill. The file is synced [`SYNC`] later: a sync before each acknowledgement
//! costs a third to a half of the posts per second, and a power cut spares the write-ahead file.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _};
use std::os::unix::fs::{FileExt as _, OpenOptionsExt as _};
use std::path::Path;
use std::time::{Duration, Instant};

use clock::Clock;
use rusqlite::{Connection, OptionalExtension as _, params};
use wire::sha256;

use super::digest::Head;

pub(super) const LIST_NAME: &str = "missions.heads";

/// The list of earlier versions. Services removed its entries when they stopped.
const OLD_LIST_NAME: &str = "missions.acknowledged";

/// Bytes of a line.
const LINE: usize = 128;

/// Most characters of an id in a line. This program's own have 26.
const ID: usize = 32;

/// Time from a line to its sync.
const SYNC: Duration = Duration::from_millis(200);

/// Hexadecimal digits of a check.
const CHECK: usize = 8;

/// Stands in place of the digest of a deleted mission.
const DELETED: &str = "deleted";

/// The list, open for writing.
#[derive(Debug)]
pub(super) struct Acknowledged {
    clock: Clock,
    file: File,
    /// Time of the next sync; none without unsynced lines.
    sync_at: Option<Instant>,
}

/// The last acknowledged event of a mission, or the acknowledged deletion of the mission.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    at_s: f64,
    number: i64,
    mission: String,
    sequence: i64,
    digest: String,
}

/// A store, compared with the list.
#[derive(Debug, Default)]
pub(super) struct Compared {
    /// A text for each mission with missing events.
    pub(super) lost: Vec<String>,
    /// The entries that the list should have.
    pub(super) outdated: Vec<Entry>,
}

impl Entry {
    pub(super) fn of(at_s: f64, head: Head, mission: &str) -> Self {
        Self {
            at_s,
            number: head.mission,
            mission: mission.to_owned(),
            sequence: head.sequence,
            digest: hex::encode(head.digest),
        }
    }

    pub(super) fn deletion(at_s: f64, number: i64, mission: &str) -> Self {
        Self { digest: DELETED.to_owned(), ..Self::of(at_s, Head::of_new(number), mission) }
    }

    fn line(&self) -> String {
        let (number, mission, sequence) = (self.number, &self.mission, self.sequence);
        let line = format!("{number} {mission:.ID$} {sequence} {} {:.3}", self.digest, self.at_s);
        let line = format!("{line} {}", check(&line));
        format!("{line:<width$}\n", width = LINE - 1)
    }

    /// The entry of a line; none for a damaged or unwritten line.
    fn read(line: &[u8]) -> Option<Self> {
        let line = std::str::from_utf8(line).ok()?.trim_ascii_end();
        let (text, found) = line.rsplit_once(' ')?;
        if check(text) != found {
            return None;
        }
        let words: Vec<&str> = text.split(' ').collect();
        let [number, mission, sequence, digest, at_s] = words[..] else {
            return None;
        };
        Some(Self {
            at_s: at_s.parse().ok()?,
            number: number.parse().ok()?,
            mission: mission.to_owned(),
            sequence: sequence.parse().ok()?,
            digest: digest.to_owned(),
        })
    }

    fn is_deletion(&self) -> bool {
        self.digest == DELETED
    }

    /// Names the missing events of the mission, whose last stored event is `stored`.
    fn lost(&self, stored: i64) -> String {
        let (mission, sequence) = (&self.mission, self.sequence);
        let acknowledged = format!("acknowledged at Unix time {:.3} s", self.at_s);
        if self.is_deletion() {
            format!("the deletion of mission {mission}, {acknowledged}")
        } else if sequence <= stored {
            format!("event {sequence} of mission {mission} is not the one {acknowledged}")
        } else {
            let (n, first) = (sequence - stored, stored + 1);
            format!("{n} events of mission {mission} from {first} to {sequence}, the last {acknowledged}")
        }
    }
}

impl Acknowledged {
    /// Opens or creates the list in `directory`. Returns its entries by mission number.
    pub(super) fn open(directory: &Path, clock: &Clock) -> io::Result<(Self, BTreeMap<i64, Entry>)> {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(directory.join(LIST_NAME))?;
        let mut bytes = vec![];
        file.read_to_end(&mut bytes)?;
        if bytes.is_empty() {
            let _ = std::fs::remove_file(directory.join(OLD_LIST_NAME));
            File::open(directory)?.sync_all()?;
        }
        let mut entries = BTreeMap::new();
        for (number, line) in (0..).zip(bytes.chunks(LINE)) {
            match Entry::read(line).filter(|entry| entry.number == number) {
                Some(entry) => drop(entries.insert(number, entry)),
                None if line.iter().all(|&byte| byte == 0) => {}
                None => tracing::warn!(
                    number,
                    "a line of {LIST_NAME} is damaged: losses of that mission are not noticed"
                ),
            }
        }
        let list = Self { clock: clock.clone(), file, sync_at: None };
        Ok((list, entries))
    }

    pub(super) fn add(&mut self, entries: &[Entry]) -> io::Result<()> {
        for entry in entries {
            let place = entry.number.unsigned_abs() * LINE as u64;
            self.file.write_all_at(entry.line().as_bytes(), place)?;
            self.sync_at.get_or_insert_with(|| self.clock.now() + SYNC);
        }
        Ok(())
    }

    /// Time until the next sync; none without unsynced lines.
    pub(super) fn sync_in(&self) -> Option<Duration> {
        let due = self.sync_at?;
        Some(due.saturating_duration_since(self.clock.now()))
    }

    pub(super) fn sync(&mut self) -> io::Result<()> {
        self.sync_at = None;
        self.file.sync_data()
    }
}

/// Compares the store with the list, at the Unix time `now_s`, s.
pub(super) fn compare(
    connection: &Connection,
    mut listed: BTreeMap<i64, Entry>,
    now_s: f64,
) -> rusqlite::Result<Compared> {
    let mut compared = Compared::default();
    let mut event = connection.prepare("SELECT digest FROM events WHERE mission = ?1 AND sequence = ?2")?;
    let mut missions =
        connection.prepare("SELECT number, sequence, head, id, status = 'deleted' FROM missions")?;
    let mut rows = missions.query([])?;
    while let Some(row) = rows.next()? {
        let head = Head { mission: row.get(0)?, sequence: row.get(1)?, digest: row.get(2)? };
        let (id, is_deleted): (String, bool) = (row.get(3)?, row.get(4)?);
        let entry = listed.remove(&head.mission);
        let stored =
            if is_deleted { Entry::deletion(now_s, head.mission, &id) } else { Entry::of(now_s, head, &id) };
        if let Some(entry) = entry {
            if (entry.sequence, &entry.digest) == (stored.sequence, &stored.digest) {
                continue;
            }
            // An unacknowledged commit may be stored.
            let digest: Option<Vec<u8>> =
                event.query_row(params![entry.number, entry.sequence], |row| row.get(0)).optional()?;
            let goes_on = entry.sequence == 0 || digest.map(hex::encode).as_ref() == Some(&entry.digest);
            if !is_deleted && (entry.is_deletion() || !goes_on) {
                compared.lost.push(entry.lost(stored.sequence));
            }
        }
        compared.outdated.push(stored);
    }
    for entry in listed.into_values().filter(|entry| !entry.is_deletion()) {
        compared.lost.push(entry.lost(0));
        compared.outdated.push(Entry::deletion(now_s, entry.number, &entry.mission));
    }
    Ok(compared)
}

fn check(text: &str) -> String {
    let mut check = sha256(text.as_bytes());
    check.truncate(CHECK);
    check
}
