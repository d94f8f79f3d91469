//! Where results go: into files, whole or not at all, an earlier one staying until then; and to the reader of the
//! program's output.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, BufWriter, Write as _},
    path::{Path, PathBuf},
};

/// A file that can be written.
#[derive(Debug)]
pub(crate) struct OutFile {
    path: PathBuf,
    /// Written first, beside `path` so that it can take its name; none for a pipe or a device, which
    /// keep their names.
    partial: Option<PathBuf>,
}

impl OutFile {
    /// Fails where [`OutFile::write`] would. Leaves nothing behind, so that a mission can be stopped at
    /// any time.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        // A link stays one: what it leads to is replaced.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
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
        Ok(Self { path, partial })
    }

    /// Whether this is a pipe or a device.
    pub(crate) fn is_stream(&self) -> bool {
        self.partial.is_none()
    }

    /// Writes the whole of it with `write`.
    pub(crate) fn write<E: From<io::Error>>(
        &self,
        write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    ) -> Result<(), E> {
        let to = self.partial.as_ref().unwrap_or(&self.path);
        let written = File::create(to).map_err(E::from).and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            Ok(file.flush()?)
        });
        let Some(partial) = &self.partial else {
            return written;
        };
        let written = written.and_then(|()| Ok(fs::rename(partial, &self.path)?));
        if written.is_err() {
            // The reason is the one to report.
            let _ = fs::remove_file(partial);
        }
        written
    }
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

/// Prints `text`.
pub(crate) fn print(text: &str) -> io::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        // The reader of the output has read enough, as `head` does.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}
