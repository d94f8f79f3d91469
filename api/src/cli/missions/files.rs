//! Files that a mission leaves: records and reports.

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
};

use lab::{comparison::Controllers, report::report};
use record::{self, ExportError, Format as RecordFormat};
use sim::{record::Record, scenario::Scenario};

use super::error::MissionError;
use crate::cli::out_file::OutFile;

/// A file for the record.
pub(super) struct RecordFile {
    path: PathBuf,
    file: OutFile,
    format: RecordFormat,
}

pub(super) fn record_file(path: &Path, scenario: &Scenario) -> Result<RecordFile, MissionError> {
    let refused = |source| MissionError::Out {
        path: path.to_owned(),
        source,
    };
    let file = OutFile::new(path).map_err(|source| refused(source.into()))?;
    let format = match RecordFormat::of(path) {
        // Pipes and devices have no ending as a rule, and CSV reads well in any of them.
        Err(_) if file.is_stream() && path.extension().is_none() => RecordFormat::Csv,
        named => named.map_err(refused)?,
    };
    if format == RecordFormat::Geojson && scenario.origin.is_none() {
        return Err(refused(ExportError::NoOrigin));
    }
    Ok(RecordFile {
        path: path.to_owned(),
        file,
        format,
    })
}

/// Files in `directory` for the records of a comparison, in the order of [`Controllers::named`].
pub(super) fn record_files(directory: &Path) -> Result<Vec<RecordFile>, MissionError> {
    let refused = |path: &Path, source| MissionError::Directory {
        path: path.to_owned(),
        source,
    };
    fs::create_dir_all(directory).map_err(|source| refused(directory, source))?;
    let file = |name: &str| {
        let path = directory.join(format!("{name}.parquet"));
        let file = OutFile::new(&path).map_err(|source| refused(&path, source))?;
        Ok(RecordFile {
            path,
            file,
            format: RecordFormat::Parquet,
        })
    };
    Controllers::names().map(file).collect()
}

impl RecordFile {
    pub(super) fn write(&self, record: &Record) -> Result<(), MissionError> {
        let written = self.file.write(|out| record::write(record, self.format, out));
        written.map_err(|source| MissionError::Out {
            path: self.path.clone(),
            source,
        })
    }
}

/// A file for the report, where one is asked for.
pub(super) fn report_file(path: Option<&Path>) -> Result<Option<(PathBuf, OutFile)>, MissionError> {
    let Some(path) = path else { return Ok(None) };
    let path = path.to_owned();
    match OutFile::new(&path) {
        Ok(file) => Ok(Some((path, file))),
        Err(source) => Err(MissionError::Report { path, source }),
    }
}

pub(super) fn write_report(file: Option<(PathBuf, OutFile)>, runs: &[&Record]) -> Result<(), MissionError> {
    let Some((path, file)) = file else { return Ok(()) };
    let written = file.write(|out| out.write_all(report(runs).as_bytes()));
    written.map_err(|source| MissionError::Report { path, source })
}
