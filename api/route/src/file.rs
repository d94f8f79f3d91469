//! Bytes to text, and the text to the reader of its format.

use std::io::{Cursor, Read as _};

use crate::{
    json,
    route::{POINTS_MAX, Route, Unread},
    text, xml,
};

/// Largest file, also when it is unpacked, bytes: a recorded track of a day. In memory it is some twenty times as large.
pub const BYTES_MAX: usize = 8 << 20;

/// The routes of a file with at least one point each.
///
/// # Errors
/// The first place that cannot be read, and what to do about it.
pub fn read(bytes: &[u8]) -> Result<Vec<Route>, Unread> {
    if BYTES_MAX < bytes.len() {
        let fault = format!("has {} bytes, {BYTES_MAX} are read", bytes.len());
        return Err(Unread::new("file", fault));
    }
    let unpacked;
    let bytes = if bytes.starts_with(b"PK\x03\x04") {
        unpacked = kml_of(bytes)?;
        &unpacked
    } else {
        bytes
    };
    let text = decoded(bytes);
    let mut routes = match text.trim_start().as_bytes() {
        [] => return Err(Unread::new("file", "is empty")),
        [b'<', ..] => xml::routes(&text)?,
        [b'{' | b'[', ..] => json::routes(&text)?,
        _ => text::routes(&text)?,
    };
    routes.retain(|route| !route.points.is_empty());
    if routes.is_empty() {
        return Err(Unread::new("file", "has no route, track, line or way-points"));
    }
    if POINTS_MAX < routes.iter().map(|route| route.points.len()).sum() {
        return Err(Unread::new(
            "file",
            format!("has more than {POINTS_MAX} points; thin it out"),
        ));
    }
    Ok(routes)
}

/// The KML file in a KMZ file.
fn kml_of(bytes: &[u8]) -> Result<Vec<u8>, Unread> {
    let broken = |error: &dyn std::fmt::Display| Unread::new("ZIP archive", error.to_string());
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| broken(&error))?;
    let names: Vec<String> = archive
        .file_names()
        .filter_map(|name| name.ok().map(std::borrow::Cow::into_owned))
        .collect();
    let main = names.iter().find(|name| *name == "doc.kml");
    let kml = || {
        names
            .iter()
            .find(|name| name.to_ascii_lowercase().ends_with(".kml"))
    };
    let name = main
        .or_else(kml)
        .ok_or_else(|| Unread::new("ZIP archive", "has no .kml file"))?
        .clone();
    let file = archive.by_name(&name).map_err(|error| broken(&error))?;
    let mut unpacked = Vec::new();
    // What the archive says of its size is a claim.
    let limit = u64::try_from(BYTES_MAX).expect("8 MiB fit") + 1;
    file.take(limit)
        .read_to_end(&mut unpacked)
        .map_err(|error| broken(&error))?;
    if BYTES_MAX < unpacked.len() {
        return Err(Unread::new(
            name,
            format!("is larger than {BYTES_MAX} bytes when unpacked"),
        ));
    }
    Ok(unpacked)
}

/// The text without its byte order mark, of UTF-16 too. What is no Unicode becomes a replacement character.
fn decoded(bytes: &[u8]) -> String {
    let utf16 = |of: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| of([pair[0], pair[1]]));
        String::from_utf16_lossy(&units.collect::<Vec<_>>())
    };
    match bytes {
        [0xFF, 0xFE, ..] => utf16(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => utf16(u16::from_be_bytes),
        [0xEF, 0xBB, 0xBF, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => String::from_utf8_lossy(bytes).into_owned(),
    }
}
