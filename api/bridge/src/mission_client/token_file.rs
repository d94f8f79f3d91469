//! A token that is replaced while the bridge runs.

use std::{
    fs, io,
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

/// A file with a token, and the token as it was read last.
#[derive(Debug)]
pub struct TokenFile {
    path: PathBuf,
    token: Mutex<String>,
}

impl TokenFile {
    /// Reads the token.
    pub fn read(path: PathBuf) -> io::Result<Self> {
        let token = Mutex::new(fs::read_to_string(&path)?.trim().to_owned());
        Ok(Self { path, token })
    }

    pub(super) fn token(&self) -> String {
        self.token.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn another(&self, rejected: &str) -> Option<String> {
        let read = fs::read_to_string(&self.path).ok()?;
        let token = read.trim();
        // A file that is just being written may be empty.
        if token == rejected || token.is_empty() {
            return None;
        }
        token.clone_into(&mut self.token.lock().unwrap_or_else(PoisonError::into_inner));
        Some(token.to_owned())
    }
}
