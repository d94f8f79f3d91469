//! What stands at the end of the write-ahead file, looked at before SQLite does.
//!
//! Only this check finds damage to a commit in the write-ahead file that other commits follow, or to the file's header:
//! a commit is on the disk before the next one begins, so those commits were acknowledged. SQLite goes back to the commit
//! before the damage without a word, and what it then shows is whole, so that neither the events' digests nor
//! `PRAGMA integrity_check` find anything wrong (tested). A damaged last commit is passed over with a warning: after a
//! power cut it is one that was acknowledged to no client.
//!
//! Source: the SQLite documentation, "Database File Format", section 4.

use std::{
    fs::{self, File},
    io::{self, BufReader, Read},
    path::{Path, PathBuf},
};

use super::error::StoreError;

const HEADER_BYTES: usize = 32;
const FRAME_HEADER_BYTES: usize = 24;
const MAGIC: u32 = 0x377f_0682;

/// What a write-ahead file holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Tail {
    /// Frames of commits that are whole.
    whole: usize,
    /// Frames of the same writing behind those that are not what was written, if any.
    broken: usize,
    /// Whether a commit ends among those, and another begins.
    followed: bool,
    /// Whether the header, which is on the disk before any frame, is not what was written.
    headless: bool,
    /// Up to where the file is whole, bytes.
    bytes: u64,
}

/// Fails where SQLite would pass over acknowledged commits, and warns where it passes over another.
pub(super) fn check(store: &Path) -> Result<(), StoreError> {
    let mut path = store.as_os_str().to_owned();
    path.push("-wal");
    let path = PathBuf::from(path);
    let tail = match File::open(&path).and_then(|file| read(&mut BufReader::new(file))) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        read => read.map_err(|error| StoreError::open(&path, &error))?,
    };
    let name = path.display();
    let beside_nothing = fs::metadata(store).map_or(0, |file| file.len()) == 0;
    if beside_nothing && 0 < tail.whole {
        return Err(StoreError::Damaged(format!(
            "{} is empty or missing, and {name} belongs to what it was; restore the directory from a copy",
            store.display()
        )));
    }
    if tail.headless {
        return Err(StoreError::Damaged(format!(
            "{name} has no beginning, and what it holds was acknowledged; restore the directory from a copy"
        )));
    }
    if tail.followed {
        return Err(StoreError::Damaged(format!(
            "{name}: a commit after frame {} was acknowledged and cannot be read; restore the directory from a copy, or \
             go on without that commit and those after it: truncate --size {} {name}",
            tail.whole, tail.bytes
        )));
    }
    if 0 < tail.broken {
        tracing::warn!(
            "{name} ends with a commit that is not whole: it was under way when the machine stopped, or its last page \
             is damaged; clients whose requests it held should send it again"
        );
    }
    Ok(())
}

fn read(file: &mut impl Read) -> io::Result<Tail> {
    let mut tail = Tail::default();
    let mut header = [0; HEADER_BYTES];
    if !filled(file, &mut header)? {
        return Ok(tail);
    }
    let magic = word(&header, 0);
    let big_endian = magic & 1 == 1;
    let page = word(&header, 8) as usize;
    let salts = &header[16..24];
    let mut sum = checksum([0, 0], &header[..24], big_endian);
    let intact = sum == [word(&header, 24), word(&header, 28)];
    if !intact || magic & !1 != MAGIC || !(512..=65_536).contains(&page) {
        let mut rest = vec![];
        file.take(FRAME_HEADER_BYTES as u64).read_to_end(&mut rest)?;
        tail.headless = rest.iter().any(|byte| *byte != 0);
        return Ok(tail);
    }
    tail.bytes = HEADER_BYTES as u64;
    let mut frame = vec![0; FRAME_HEADER_BYTES + page];
    let mut frames = 0;
    let mut foreign = 0;
    let mut commit_broken = false;
    while filled(file, &mut frame)? {
        // Frames of an earlier, longer writing have other salts. So have damaged frames, but these salts follow them.
        if &frame[8..16] != salts {
            foreign += 1;
            continue;
        }
        tail.broken += std::mem::take(&mut foreign);
        frames += 1;
        let commit = word(&frame, 4) != 0;
        sum = checksum(
            checksum(sum, &frame[..8], big_endian),
            &frame[FRAME_HEADER_BYTES..],
            big_endian,
        );
        let intact = sum == [word(&frame, 16), word(&frame, 20)];
        // Each checksum continues the stored one of the frame before: a whole frame after a damaged one counts as whole.
        sum = [word(&frame, 16), word(&frame, 20)];
        tail.followed |= commit_broken;
        if !intact {
            tail.broken += 1;
        }
        if commit {
            commit_broken |= 0 < tail.broken;
            if tail.broken == 0 {
                tail.whole = frames;
                tail.bytes = (HEADER_BYTES + frames * frame.len()) as u64;
            }
        }
    }
    Ok(tail)
}

/// Fills `bytes`; whether there was that much.
fn filled(file: &mut impl Read, bytes: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

/// The number at `place`, whose first byte weighs most.
fn word(bytes: &[u8], place: usize) -> u32 {
    u32::from_be_bytes([bytes[place], bytes[place + 1], bytes[place + 2], bytes[place + 3]])
}

fn checksum(mut sum: [u32; 2], bytes: &[u8], big_endian: bool) -> [u32; 2] {
    let number = |bytes| {
        if big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    };
    for pair in bytes.as_chunks().0.chunks_exact(2) {
        sum[0] = sum[0].wrapping_add(number(pair[0])).wrapping_add(sum[1]);
        sum[1] = sum[1].wrapping_add(number(pair[1])).wrapping_add(sum[0]);
    }
    sum
}
