//! Output: files that appear complete or not at all, and standard output.

use std::borrow::Cow;
use std::error::Error;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::failure::{Failure, because_of};

#[derive(Debug)]
pub(crate) struct OutFile {
    /// Its name on the command line.
    pub(crate) name: PathBuf,
    path: PathBuf,
    /// Written first, beside `path`, and then renamed; `None` for a pipe or a device.
    partial: Option<PathBuf>,
}

impl OutFile {
    /// Fails early if the file cannot be written. Leaves nothing on the disk.
    pub(crate) fn new(name: &Path) -> Result<Self, Failure> {
        let (path, partial) = place(name).map_err(not_written(name))?;
        Ok(Self { name: name.to_owned(), path, partial })
    }

    /// `true` for a pipe or a device.
    pub(crate) fn is_stream(&self) -> bool {
        self.partial.is_none()
    }

    /// The error that this file was not written.
    pub(crate) fn refused(&self, source: impl Into<Box<dyn Error + Send + Sync>>) -> Failure {
        not_written(&self.name)(source)
    }

    pub(crate) fn write<E: From<io::Error> + Into<Box<dyn Error + Send + Sync>>>(
        &self,
        write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    ) -> Result<(), Failure> {
        let to = self.partial.as_ref().unwrap_or(&self.path);
        let mut written = File::create(to).map_err(E::from).and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            Ok(file.flush()?)
        });
        if let Some(partial) = &self.partial {
            written = written.and_then(|()| Ok(fs::rename(partial, &self.path)?));
            if written.is_err() {
                // The first error is reported.
                let _ = fs::remove_file(partial);
            }
        }
        written.map_err(|error| self.refused(error))
    }

    pub(crate) fn write_text(&self, text: &str) -> Result<(), Failure> {
        self.write(|out| out.write_all(text.as_bytes()))
    }
}

/// The file, and the file that is written first.
fn place(name: &Path) -> io::Result<(PathBuf, Option<PathBuf>)> {
    // A link stays: its target is replaced.
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

/// Creates the directory if it is missing.
pub(crate) fn directory(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(not_written(path))
}

fn not_written<E: Into<Box<dyn Error + Send + Sync>>>(path: &Path) -> impl FnOnce(E) -> Failure {
    because_of(format!("cannot write {}", path.display()))
}

/// `text` with its control characters, except line ends and tabs, escaped as in JSON: names and
/// errors from outside do not control the terminal, and JSON stays JSON.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    let is_hidden = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(is_hidden) {
        return text.into();
    }
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if is_hidden(c) {
            let _ = write!(escaped, "\\u{:04x}", u32::from(c));
        } else {
            escaped.push(c);
        }
    }
    escaped.into()
}

pub(crate) fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().write_all(visible(text).as_bytes()) {
        // The reader has read enough, as `head` does.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result.map_err(because_of("cannot print the result")),
    }
}

pub(crate) fn print_rows(directory: &Path, n_rows: usize, digest: &str) -> Result<(), Box<dyn Error>> {
    let directory = directory.display();
    Ok(print(&format!("{directory}/runs.parquet: {n_rows} rows, digest {digest}\n"))?)
}

pub(crate) fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(value).expect("strings, numbers and lists only");
    print(&(json + "\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_outside_do_not_command_the_terminal() {
        let name = "lane\u{1b}[2J\u{1b}]0;all is well\u{7}\r\u{9b}1A\u{7f}";
        let shown = visible(name);
        assert_eq!(shown, r"lane\u001b[2J\u001b]0;all is well\u0007\u000d\u009b1A\u007f");
        let json = serde_json::to_string(name).expect("is text");
        let read: String = serde_json::from_str(&visible(&json)).expect("is JSON");
        assert_eq!(read, name);
        assert_eq!(visible("a\tb\nφ"), "a\tb\nφ");
    }
}
