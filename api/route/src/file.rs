//! Decodes bytes to text, and gives the text to the reader of its format.

use std::borrow::Cow;

#[cfg(feature = "xml")]
use crate::xml;
use crate::{
    json,
    progress::{BYTES_MAX, Progress},
    route::{Route, Unread, refused},
    text,
};

/// The routes of a file, each with a point or more. Fails with the first place that cannot be read.
pub fn read(bytes: &[u8]) -> Result<Vec<Route>, Unread> {
    read_until(bytes, &|| false)
}

/// The text of `bytes`, if these are not too many.
pub(crate) fn text_of(bytes: &[u8]) -> Result<Cow<'_, str>, Unread> {
    if BYTES_MAX < bytes.len() {
        return refused("file", format!("has {} bytes, {BYTES_MAX} are read", bytes.len()));
    }
    Ok(decoded(bytes))
}

/// As [`read`]; also fails once it is `due`.
pub fn read_until(bytes: &[u8], due: &dyn Fn() -> bool) -> Result<Vec<Route>, Unread> {
    let progress = Progress::new(due);
    let unpacked;
    let bytes = if bytes.starts_with(b"PK\x03\x04") {
        unpacked = xml::unpacked(bytes, &progress)?;
        &unpacked
    } else {
        bytes
    };
    let text = text_of(bytes)?;
    let routes = match text.trim_start().as_bytes() {
        [] => return refused("file", "is empty"),
        [b'<', ..] => xml::routes(&text, progress)?,
        [b'{' | b'[', ..] => json::routes(&text, progress)?,
        _ => text::routes(&text, progress)?,
    };
    if routes.is_empty() {
        return refused("file", "has no route, track, line or way-points");
    }
    Ok(routes)
}

/// The text without its byte order mark, also from UTF-16. Bytes that are no Unicode are replaced.
fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let utf16 = |of: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| of([pair[0], pair[1]]));
        let chars = char::decode_utf16(units).map(|char| char.unwrap_or(char::REPLACEMENT_CHARACTER));
        Cow::Owned(chars.collect())
    };
    match bytes {
        [0xFF, 0xFE, ..] => utf16(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => utf16(u16::from_be_bytes),
        [0xEF, 0xBB, 0xBF, rest @ ..] => String::from_utf8_lossy(rest),
        _ => String::from_utf8_lossy(bytes),
    }
}

/// Stands for the reader of XML in a program that is built without it.
#[cfg(not(feature = "xml"))]
mod xml {
    use super::{Progress, Route, Unread, refused};

    const LEFT_OUT: &str =
        "this program is built without KML, KMZ, GPX and RTZ: cargo build --release --features xml-routes";

    pub(super) fn unpacked(_bytes: &[u8], _progress: &Progress<'_>) -> Result<Vec<u8>, Unread> {
        refused("file", LEFT_OUT)
    }

    pub(super) fn routes(_text: &str, _progress: Progress<'_>) -> Result<Vec<Route>, Unread> {
        refused("file", LEFT_OUT)
    }
}
