//! Files that a mission leaves: records and reports.

use std::path::Path;

use lab::{
    comparison::Controllers,
    report::{ReportedRun, report},
};
use record::{self, ExportError, Format as RecordFormat};
use sim::{record::Record, scenario::Scenario};

use crate::cli::out_file::{NotWritten, OutFile, directory};

/// What is said of a file in a directory, or of the directory, that is not written.
pub(super) const OTHER_DIRECTORY: &str = "choose another directory with --out";

/// A file for the record.
pub(super) struct RecordFile {
    file: OutFile,
    format: RecordFormat,
}

pub(super) fn record_file(path: &Path, scenario: &Scenario) -> Result<RecordFile, NotWritten> {
    let file = OutFile::new(path, "see --out in `--help` of the command")?;
    let format = match RecordFormat::of(path) {
        // Pipes and devices have no ending as a rule, and CSV reads well in any of them.
        Err(_) if file.is_stream() && path.extension().is_none() => RecordFormat::Csv,
        named => named.map_err(|error| file.refused(error))?,
    };
    if format == RecordFormat::Geojson && scenario.origin.is_none() {
        return Err(file.refused(ExportError::NoOrigin));
    }
    Ok(RecordFile { file, format })
}

/// Files in `directory` for the records of a comparison, in the order of [`Controllers::named`].
pub(super) fn record_files(path: &Path) -> Result<Vec<RecordFile>, NotWritten> {
    directory(path, OTHER_DIRECTORY)?;
    let file = |name: &str| {
        Ok(RecordFile {
            file: OutFile::new(&path.join(format!("{name}.parquet")), OTHER_DIRECTORY)?,
            format: RecordFormat::Parquet,
        })
    };
    Controllers::names().map(file).collect()
}

impl RecordFile {
    pub(super) fn write(&self, record: &Record) -> Result<(), NotWritten> {
        self.file.write(|out| record::write(record, self.format, out))
    }
}

/// A file for the report.
pub(super) fn report_file(path: &Path) -> Result<OutFile, NotWritten> {
    OutFile::new(path, "choose another file with --report")
}

pub(super) fn write_report(file: &OutFile, runs: &[ReportedRun<'_>]) -> Result<(), NotWritten> {
    file.write_text(&report(runs))
}
