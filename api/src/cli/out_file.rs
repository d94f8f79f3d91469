//! Where results go: into files, whole or not at all, an earlier one staying until then; and to the reader of the
//! program's output.

use std::{
    error::Error,
    ffi::OsString,
    fs::{self, File},
    io::{self, BufWriter, Write as _},
    path::{Path, PathBuf},
};

/// A file that can be written.
#[derive(Debug)]
pub(crate) struct OutFile {
    /// As the command line names it.
    pub(crate) name: PathBuf,
    path: PathBuf,
    /// Written first, beside `path` so that it can take its name; none for a pipe or a device, which
    /// keep their names.
    partial: Option<PathBuf>,
    advice: &'static str,
}

/// Why a file is not written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {advice}")]
pub(crate) struct NotWritten {
    path: PathBuf,
    advice: &'static str,
    source: Box<dyn Error + Send + Sync>,
}

/// The output has no reader and is not closed.
#[derive(Debug, thiserror::Error)]
#[error("cannot print the result")]
pub(crate) struct NotPrinted(#[from] io::Error);

impl NotWritten {
    fn new(path: &Path, advice: &'static str, source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self {
            path: path.to_owned(),
            advice,
            source: source.into(),
        }
    }
}

impl OutFile {
    /// Fails where [`OutFile::write`] would, with the `advice`. Leaves nothing behind, so that a mission can be stopped at
    /// any time.
    pub(crate) fn new(name: &Path, advice: &'static str) -> Result<Self, NotWritten> {
        let (path, partial) = place(name).map_err(|source| NotWritten::new(name, advice, source))?;
        Ok(Self {
            name: name.to_owned(),
            path,
            partial,
            advice,
        })
    }

    /// Whether this is a pipe or a device.
    pub(crate) fn is_stream(&self) -> bool {
        self.partial.is_none()
    }

    /// Says that this file is not written.
    pub(crate) fn refused(&self, source: impl Into<Box<dyn Error + Send + Sync>>) -> NotWritten {
        NotWritten::new(&self.name, self.advice, source)
    }

    /// Writes the whole of it with `write`.
    pub(crate) fn write<E: From<io::Error> + Into<Box<dyn Error + Send + Sync>>>(
        &self,
        write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    ) -> Result<(), NotWritten> {
        let to = self.partial.as_ref().unwrap_or(&self.path);
        let mut written = File::create(to).map_err(E::from).and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            Ok(file.flush()?)
        });
        if let Some(partial) = &self.partial {
            written = written.and_then(|()| Ok(fs::rename(partial, &self.path)?));
            if written.is_err() {
                // The reason is the one to report.
                let _ = fs::remove_file(partial);
            }
        }
        written.map_err(|error| self.refused(error))
    }

    /// Writes `text`.
    pub(crate) fn write_text(&self, text: &str) -> Result<(), NotWritten> {
        self.write(|out| out.write_all(text.as_bytes()))
    }
}

/// Where the file is, and what is written first.
fn place(name: &Path) -> io::Result<(PathBuf, Option<PathBuf>)> {
    // A link stays one: what it leads to is replaced.
    let path = fs::canonicalize(name).unwrap_or_else(|_| name.to_owned());
    let partial = match fs::metadata(&path) {
        Ok(found) if found.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => None,
        Ok(found) if found.permissions().readonly() => {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        Ok(_) | Err(_) => Some(beside(&path)),
    };
    if let Some(partial) = &partial {
        File::create(partial)?;
        fs::remove_file(partial)?;
    }
    Ok((path, partial))
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

/// Makes the directory, if it is not there.
pub(crate) fn directory(path: &Path, advice: &'static str) -> Result<(), NotWritten> {
    fs::create_dir_all(path).map_err(|error| NotWritten::new(path, advice, error))
}

/// Prints `text`.
pub(crate) fn print(text: &str) -> Result<(), NotPrinted> {
    match io::stdout().write_all(text.as_bytes()) {
        // The reader of the output has read enough, as `head` does.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => Ok(result?),
    }
}
