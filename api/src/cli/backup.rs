//! `pilotfish backup`: copies the mission log while a service writes to it.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use service::access::TokenFile;
use store::{EventReader, StoreError};

use crate::cli::{config::TOKENS, out_file::print, progress::with_spinner};

#[derive(Debug, Args)]
pub(crate) struct Backup {
    /// Directory for the copy, created if missing. `pilotfish serve --data` can use it as it is.
    to: PathBuf,
}

/// Copies everything acknowledged until now, and the `tokens`, and checks the copy.
pub(crate) fn back_up(arguments: &Backup, data: &Path, tokens: &Path) -> Result<(), Box<dyn Error>> {
    let Backup { to } = arguments;
    let reader = EventReader::of(data)?;
    if reader.is_protected()? && TokenFile::read(tokens)?.is_none() {
        return Err(StoreError::Unprotected(tokens.to_owned()).into());
    }
    let damage = with_spinner("copying the mission log", || reader.back_up(to))?;
    // Without its tokens, a service that had some does not start.
    let has_tokens = TokenFile::back_up(tokens, &to.join(TOKENS))?;
    let to = to.display();
    if !damage.is_empty() {
        let damage = damage.join("\n");
        return Err(format!("{damage}\nwhat is whole was copied to {to}").into());
    }
    let (from, tokens) = (data.display(), if has_tokens { " and the tokens" } else { "" });
    Ok(print(&format!(
        "copied {from}{tokens} to {to} and checked the copy; to serve it: pilotfish serve --data {to}\n"
    ))?)
}
