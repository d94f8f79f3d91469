//! Splits a stream of bytes into lines.

use crate::Parsed;

/// Longest line kept, bytes. The longest here is a SeaTrac response, 600 characters at most.
const LINE_MAX: usize = 1024;

pub(super) const TOO_LONG: &str = "line too long";

/// Splits at CR, LF or both; skips empty lines.
#[derive(Debug, Default)]
pub(super) struct Lines {
    line: Vec<u8>,
    overflows: bool,
}

impl Lines {
    /// The line that `byte` ends, or its error. Invalid UTF-8 is replaced and fails later.
    pub(super) fn push(&mut self, byte: u8) -> Option<Parsed<String>> {
        if byte != b'\r' && byte != b'\n' {
            if self.line.len() < LINE_MAX {
                self.line.push(byte);
            } else {
                self.overflows = true;
            }
            return None;
        }
        let text = String::from_utf8_lossy(&self.line).into_owned();
        self.line.clear();
        if std::mem::take(&mut self.overflows) {
            return Some(Err(TOO_LONG));
        }
        (!text.trim().is_empty()).then_some(Ok(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<Parsed<String>> {
        let mut lines = Lines::default();
        bytes.iter().filter_map(|byte| lines.push(*byte)).collect()
    }

    #[test]
    fn lines_end_with_cr_lf_or_both_and_an_unfinished_line_waits() {
        let expected = ["a", "b", "c"].map(|line| Ok(line.to_owned()));
        assert_eq!(lines(b"a\r\nb\n\n \r\nc\rd"), expected);
    }

    #[test]
    fn a_line_without_an_end_takes_no_memory_and_the_next_one_is_read() {
        let mut stream = vec![b'x'; 10 * LINE_MAX];
        stream.extend(b"\nnext\n");
        assert_eq!(lines(&stream), [Err(TOO_LONG), Ok("next".to_owned())]);
        let mut endless = Lines::default();
        for _ in 0..10 * LINE_MAX {
            assert!(endless.push(b'x').is_none());
        }
        assert!(endless.line.len() <= LINE_MAX);
    }
}
