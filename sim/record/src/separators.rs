//! Tables of other programs.

use std::borrow::Cow;

/// A CSV table with commas between its columns and points in its numbers, byte for byte, where its first line that is no comment has
/// tabs or semicolons.
#[must_use]
pub fn with_commas(table: &[u8]) -> Cow<'_, [u8]> {
    let is_head = |line: &&[u8]| !line.trim_ascii().is_empty() && !line.starts_with(b"#");
    let mut lines = table.split(|byte| *byte == b'\n');
    let head = lines.find(is_head).unwrap_or_default();
    let Some(separator) = [b'\t', b';'].into_iter().find(|byte| head.contains(byte)) else {
        return Cow::Borrowed(table);
    };
    let byte = |byte: &u8| match *byte {
        b',' => b'.',
        byte if byte == separator => b',',
        byte => byte,
    };
    Cow::Owned(table.iter().map(byte).collect())
}
