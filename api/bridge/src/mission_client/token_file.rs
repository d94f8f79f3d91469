//! A token that is replaced while the bridge runs.

use std::path::PathBuf;
use std::{fs, io};

use parking_lot::Mutex;

/// A file with a token, and its last content.
#[derive(Debug)]
pub struct TokenFile {
    path: PathBuf,
    token: Mutex<String>,
}

impl TokenFile {
    /// Reads the token.
    pub fn read(path: PathBuf) -> io::Result<Self> {
        let token = Mutex::new(token_in(&fs::read(&path)?)?);
        Ok(Self { path, token })
    }

    pub(super) fn token(&self) -> String {
        self.token.lock().clone()
    }

    pub(super) fn another(&self, rejected: &str) -> Option<String> {
        // A file that is being written may be empty.
        let token = token_in(&fs::read(&self.path).ok()?).ok()?;
        if token == rejected {
            return None;
        }
        token.clone_into(&mut self.token.lock());
        Some(token)
    }
}

/// The token in a file's content, without an editor's byte order mark and line ends.
fn token_in(content: &[u8]) -> io::Result<String> {
    let text = content.strip_prefix("\u{feff}".as_bytes()).unwrap_or(content);
    let token = text.trim_ascii();
    if token.is_empty() || !token.iter().all(u8::is_ascii_graphic) {
        let wanted = "it must hold a token alone, as UTF-8 without quotes or \"Bearer\"";
        return Err(io::Error::new(io::ErrorKind::InvalidData, wanted));
    }
    Ok(String::from_utf8_lossy(token).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_read_as_editors_save_them_and_other_content_is_refused() {
        for saved in ["pf_1", "pf_1\n", "pf_1\r\n", "\u{feff}pf_1\r\n"] {
            assert_eq!(token_in(saved.as_bytes()).expect("a token"), "pf_1");
        }
        let utf_16: Vec<u8> = "\u{feff}pf_1".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for other in [utf_16.as_slice(), b"", b"\n", b"Bearer pf_1", b"pf_1\npf_2", b"pf_\x1b1"] {
            let error = token_in(other).expect_err("is no token").to_string();
            assert!(error.contains("a token alone"), "{error}");
        }
    }
}
