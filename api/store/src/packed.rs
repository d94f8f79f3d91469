//! Bodies on the disk. Long JSON is compressed (raw DEFLATE, RFC 1951) with a dictionary of the
//! repeated texts of events, so that mostly numbers remain. Other bodies are stored unchanged.
//!
//! ```text
//! 1, length of the JSON (4 bytes, little-endian), DEFLATE with the dictionary 1
//! ```
//! Digests are of the stored bytes, so that copying does not unpack.

use flate2::{Compress, Compression, Decompress, FlushCompress, FlushDecompress, Status};

use super::error::StoreError;

/// First byte of a packed body. JSON never begins with it.
const MARK: u8 = 1;

/// Bytes of the mark and the length.
const HEAD: usize = 5;

/// A released dictionary never changes. A new one has another mark.
const DICTIONARY: &[u8] = include_bytes!("packed/dictionary-1.txt");

/// Length of the shortest packed body, bytes: shorter ones gain little.
const LENGTH_MIN: usize = 128;

/// Length of the longest body that is unpacked, bytes. Clients can store some MiB.
const LENGTH_MAX: u32 = 64 << 20;

/// Level for events. A higher one saves a percent of the bytes for a third more time.
pub(super) const KEPT: u32 = 6;

/// Level for checkpoints: the next plan overwrites them.
pub(super) const OVERWRITTEN: u32 = 2;

/// The packed body; none for a body that is stored unchanged.
pub(super) fn pack(body: &[u8], level: u32) -> Option<Vec<u8>> {
    if !body.starts_with(b"{") || body.len() < LENGTH_MIN {
        return None;
    }
    let length = u32::try_from(body.len()).ok().filter(|length| *length <= LENGTH_MAX)?;
    // The packed body must not be longer.
    let mut packed = Vec::with_capacity(body.len());
    packed.push(MARK);
    packed.extend(length.to_le_bytes());
    let mut deflate = Compress::new(Compression::new(level), false);
    deflate.set_dictionary(DICTIONARY).ok()?;
    let status = deflate.compress_vec(body, &mut packed, FlushCompress::Finish);
    matches!(status, Ok(Status::StreamEnd)).then_some(packed)
}

/// Reverses [`pack`].
pub(super) fn unpack(stored: Vec<u8>) -> Result<Vec<u8>, StoreError> {
    let Some((&[MARK, ref length @ ..], deflated)) = stored.split_first_chunk::<HEAD>() else {
        return Ok(stored);
    };
    let length = u32::from_le_bytes(*length);
    let damaged = || StoreError::Damaged("a packed body cannot be unpacked".to_owned());
    if LENGTH_MAX < length {
        return Err(damaged());
    }
    let mut body = Vec::with_capacity(length as usize);
    let mut inflate = Decompress::new(false);
    inflate.set_dictionary(DICTIONARY).map_err(|_| damaged())?;
    let status = inflate.decompress_vec(deflated, &mut body, FlushDecompress::Finish);
    let is_whole = status.is_ok_and(|status| status == Status::StreamEnd) && body.len() == length as usize;
    is_whole.then_some(body).ok_or_else(damaged)
}

#[cfg(test)]
mod tests {
    use wire::sha256;

    use super::*;

    #[test]
    fn bodies_are_unpacked_unchanged_and_damage_is_an_error() {
        for body in [&b""[..], b"{}", b"\x01 no JSON", DICTIONARY, "{\"a\":0}".repeat(99).as_bytes()] {
            for level in [KEPT, OVERWRITTEN] {
                let stored = pack(body, level).unwrap_or_else(|| body.to_vec());
                if body.starts_with(b"{") {
                    assert_eq!(unpack(stored), Ok(body.to_vec()));
                }
            }
        }
        let whole = pack("{\"a\":0}".repeat(99).as_bytes(), KEPT).expect("is shorter");
        for end in HEAD..whole.len() {
            assert!(unpack(whole[..end].to_vec()).is_err(), "{end}");
        }
        let mut long = whole;
        long[1..HEAD].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(unpack(long).is_err());
    }

    #[test]
    fn the_dictionary_is_the_released_one() {
        assert_eq!(sha256(DICTIONARY), "6849e4e19262ee468730271ac6a1d094f268ef32dd93e6da12265920d78c99eb");
    }
}
