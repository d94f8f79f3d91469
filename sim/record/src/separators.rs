//! CSV tables of other programs.

use std::borrow::Cow;

/// A CSV table with commas between columns and decimal points, byte for byte, if its first line
/// that is no comment has tabs or semicolons; else the table itself.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tables_with_other_separators_change_and_keep_their_length() {
        let plain = b"# a; b\nt,north\n1.5,2;\n";
        assert!(matches!(with_commas(plain), Cow::Borrowed(same) if same == plain));
        for (table, expected) in [
            ("# a, b\n\nt;north\n1,5;2\n", "# a. b\n\nt,north\n1.5,2\n"),
            ("t\tnorth\n1.5\t2\n", "t,north\n1.5,2\n"),
        ] {
            assert_eq!(&*with_commas(table.as_bytes()), expected.as_bytes());
        }
        assert!(with_commas(b"").is_empty());
    }
}
