//! Where a mission's record goes: whole or not at all, and an earlier file stays until then.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

use api::export::{self, ExportError, Format};
use sim::record::Record;

/// A file that can be written.
#[derive(Debug)]
pub(crate) struct OutFile {
    path: PathBuf,
    /// Written first, beside `path` so that it can take its name; none for a pipe or a device, which
    /// keep theirs.
    partial: Option<PathBuf>,
    format: Format,
}

impl OutFile {
    /// Fails where [`OutFile::write`] would. Leaves nothing behind, so that a mission can be stopped at
    /// any time.
    pub(crate) fn new(given: &Path) -> Result<Self, ExportError> {
        // A link stays one: what it leads to is replaced.
        let path = fs::canonicalize(given).unwrap_or_else(|_| given.to_owned());
        let partial = match fs::metadata(&path) {
            Ok(found) if found.is_dir() => return Err(refusal(io::ErrorKind::IsADirectory)),
            Ok(found) if !found.is_file() => None,
            Ok(found) if found.permissions().readonly() => {
                return Err(refusal(io::ErrorKind::PermissionDenied));
            }
            Ok(_) | Err(_) => Some(beside(&path)),
        };
        let format = match Format::of(given) {
            // Pipes and devices have no ending as a rule, and CSV reads well in any of them.
            Err(_) if partial.is_none() && given.extension().is_none() => Format::Csv,
            named => named?,
        };
        if let Some(partial) = &partial {
            File::create(partial)?;
            fs::remove_file(partial)?;
        }
        Ok(Self {
            path,
            partial,
            format,
        })
    }

    pub(crate) fn write(&self, record: &Record) -> Result<(), ExportError> {
        let Some(partial) = &self.partial else {
            return self.write_to(&self.path, record);
        };
        let written = self
            .write_to(partial, record)
            .and_then(|()| Ok(fs::rename(partial, &self.path)?));
        if written.is_err() {
            // The reason is the one to report.
            let _ = fs::remove_file(partial);
        }
        written
    }

    fn write_to(&self, path: &Path, record: &Record) -> Result<(), ExportError> {
        let mut file = BufWriter::new(File::create(path)?);
        export::write(record, self.format, &mut file)
    }
}

fn refusal(kind: io::ErrorKind) -> ExportError {
    ExportError::Write(kind.into())
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}
