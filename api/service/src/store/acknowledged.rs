//! The list of what was acknowledged since the write-ahead file was last merged, in a file of its own. SQLite takes a
//! write-ahead file that was cut, damaged or removed for one whose last commits were never finished; the list says what is
//! missing.
//!
//! ```text
//! run time_s number mission sequence digest check
//! ```
//! One line for each event, and one with sequence 0 for each deleted mission, written after the commit and before the
//! acknowledgement. Once everything is merged the list begins again at the start of the file, with another `run`: lines of an
//! earlier run are no longer part of it. The check ends a list whose last line is torn.
//!
//! A kill leaves every line. The file is synced [`SYNC`] later, because a sync before each acknowledgement costs a third to a
//! half of the posts per second; a power cut loses nothing of a write-ahead file, which is synced.

use std::{
    collections::{BTreeMap, HashSet},
    fmt::Write as _,
    fs::{File, OpenOptions},
    io::{self, Read as _},
    os::unix::fs::{FileExt as _, OpenOptionsExt as _},
    path::Path,
    time::{Duration, Instant},
};

use clock::Clock;
use rusqlite::{Connection, OptionalExtension as _, params};
use wire::sha256;

use super::sql::signed;
use crate::request_id::new_id;

/// Name of the list in the data directory.
pub(super) const LIST_NAME: &str = "missions.acknowledged";

/// Size that the file has from the start, bytes: a sync within it writes no metadata.
const ROOM: usize = 256 << 10;

/// Time from a line to its sync.
const SYNC: Duration = Duration::from_millis(200);

/// Hexadecimal digits of a digest or a check: damage is found, not an adversary.
const DIGITS: usize = 16;

/// The list, open for more.
#[derive(Debug)]
pub(super) struct Acknowledged {
    clock: Clock,
    file: File,
    run: String,
    /// Where the next line begins.
    end: u64,
    /// When lines are due to be synced, if there are any.
    sync_at: Option<Instant>,
}

/// An acknowledged event, or the acknowledged deletion of a mission.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    at_s: f64,
    number: i64,
    mission: String,
    /// 0 for the deletion.
    sequence: u64,
    digest: String,
}

impl Entry {
    pub(super) fn event(at_s: f64, number: i64, mission: &str, sequence: u64, body: &[u8]) -> Self {
        Self {
            at_s,
            number,
            mission: mission.to_owned(),
            sequence,
            digest: digest(body),
        }
    }

    pub(super) fn deletion(at_s: f64, number: i64, mission: &str) -> Self {
        Self::event(at_s, number, mission, 0, b"")
    }

    fn line(&self, run: &str) -> String {
        let Self {
            at_s,
            number,
            mission,
            sequence,
            digest,
        } = self;
        let mut line = format!("{run} {at_s:.3} {number} {mission} {sequence} {digest}");
        let check = self::digest(line.as_bytes());
        writeln!(line, " {check}").expect("a string takes all that is written to it");
        line
    }

    /// The run and the entry of a line; none if it is torn.
    fn read(line: &[u8]) -> Option<(&str, Self)> {
        let line = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
        let (text, check) = line.rsplit_once(' ')?;
        if digest(text.as_bytes()) != check {
            return None;
        }
        let mut words = text.split(' ');
        let run = words.next()?;
        let entry = Self {
            at_s: words.next()?.parse().ok()?,
            number: words.next()?.parse().ok()?,
            mission: words.next()?.to_owned(),
            sequence: words.next()?.parse().ok()?,
            digest: words.next()?.to_owned(),
        };
        Some((run, entry))
    }
}

impl Acknowledged {
    /// The list in `directory`, created if missing, and its entries.
    pub(super) fn open(directory: &Path, clock: &Clock) -> io::Result<(Self, Vec<Entry>)> {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(directory.join(LIST_NAME))?;
        let mut bytes = vec![];
        file.read_to_end(&mut bytes)?;
        let mut list = Self {
            clock: clock.clone(),
            file,
            run: new_id(),
            end: 0,
            sync_at: None,
        };
        let mut entries = vec![];
        for line in bytes.split_inclusive(|&byte| byte == b'\n') {
            match Entry::read(line) {
                Some((run, entry)) if entries.is_empty() || run == list.run => {
                    run.clone_into(&mut list.run);
                    list.end += line.len() as u64;
                    entries.push(entry);
                }
                _ => break,
            }
        }
        if let Some(missing @ 1..) = ROOM.checked_sub(bytes.len()) {
            list.file.write_all_at(&vec![0; missing], bytes.len() as u64)?;
            list.file.sync_all()?;
            File::open(directory)?.sync_all()?;
        }
        Ok((list, entries))
    }

    pub(super) fn add(&mut self, entries: &[Entry]) -> io::Result<()> {
        if entries.is_empty() {
            return Ok(());
        }
        let lines: String = entries.iter().map(|entry| entry.line(&self.run)).collect();
        self.file.write_all_at(lines.as_bytes(), self.end)?;
        self.end += lines.len() as u64;
        self.sync_at.get_or_insert_with(|| self.clock.now() + SYNC);
        Ok(())
    }

    /// Time until lines are due to be synced, if there are any.
    pub(super) fn sync_in(&self) -> Option<Duration> {
        let due = self.sync_at?;
        Some(due.saturating_duration_since(self.clock.now()))
    }

    /// Syncs all lines.
    pub(super) fn sync(&mut self) -> io::Result<()> {
        self.sync_at = None;
        self.file.sync_data()
    }

    /// Begins again, once everything listed is merged. The old list must not come back when its missions are deleted.
    pub(super) fn restart(&mut self) -> io::Result<()> {
        self.run = new_id();
        self.end = 0;
        self.file.write_all_at(b"\n", 0)?;
        self.sync()
    }
}

/// What `entries` list and the store does not hold, a line for each mission; none if nothing is missing.
pub(super) fn missing(connection: &Connection, entries: &[Entry]) -> rusqlite::Result<Option<String>> {
    let is_deletion = |entry: &&Entry| entry.sequence == 0;
    let deleted: HashSet<i64> = entries
        .iter()
        .filter(is_deletion)
        .map(|entry| entry.number)
        .collect();
    // A deletion that was not acknowledged may be stored.
    let mut hidden = connection.prepare("SELECT status = 'deleted' FROM missions WHERE number = ?1")?;
    let mut stored = connection.prepare("SELECT body FROM events WHERE mission = ?1 AND sequence = ?2")?;
    let mut lost: BTreeMap<i64, Vec<&Entry>> = BTreeMap::new();
    for entry in entries {
        let is_hidden: Option<bool> = hidden.query_row([entry.number], |row| row.get(0)).optional()?;
        let is_lost = if entry.sequence == 0 {
            is_hidden == Some(false)
        } else if deleted.contains(&entry.number) || is_hidden == Some(true) {
            false
        } else {
            let body: Option<Vec<u8>> = stored
                .query_row(params![entry.number, signed(entry.sequence)], |row| row.get(0))
                .optional()?;
            body.is_none_or(|body| digest(&body) != entry.digest)
        };
        if is_lost {
            lost.entry(entry.number).or_default().push(entry);
        }
    }
    let lines = lost.into_values().map(|entries| {
        let (first, last) = (entries[0], entries[entries.len() - 1]);
        let (mission, since) = (&first.mission, first.at_s);
        match first.sequence {
            0 => format!("the deletion of mission {mission}, acknowledged at Unix time {since:.3} s"),
            from => format!(
                "{} events of mission {mission} from {from} to {}, acknowledged from Unix time {since:.3} s to {:.3} s",
                entries.len(),
                last.sequence,
                last.at_s
            ),
        }
    });
    let lines: Vec<String> = lines.collect();
    Ok((!lines.is_empty()).then(|| lines.join("\n")))
}

fn digest(bytes: &[u8]) -> String {
    let mut digest = sha256(bytes);
    digest.truncate(DIGITS);
    digest
}
