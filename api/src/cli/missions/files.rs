//! Output files of missions: records and reports.

use std::path::Path;

use lab::{
    comparison,
    http_guide::GuideUrl,
    report::{ReportedRun, report},
};
use record::{self, ExportError, Format as RecordFormat};
use sim::{record::Record, scenario::Scenario};

use crate::cli::out_file::{NotWritten, OutFile, directory};

/// A file for the record.
pub(super) struct RecordFile {
    file: OutFile,
    format: RecordFormat,
}

pub(super) fn record_file(path: &Path, scenario: &Scenario) -> Result<RecordFile, NotWritten> {
    let file = OutFile::new(path)?;
    let format = match RecordFormat::of(path) {
        // Pipes and devices seldom have a suffix.
        Err(_) if file.is_stream() && path.extension().is_none() => RecordFormat::Csv,
        named => named.map_err(|error| file.refused(error))?,
    };
    if format == RecordFormat::Geojson && scenario.origin.is_none() {
        return Err(file.refused(ExportError::NoOrigin));
    }
    Ok(RecordFile { file, format })
}

/// Files in `directory` for the records of a comparison, in the order of [`comparison::names`].
pub(super) fn record_files(
    path: &Path,
    scenario: &Scenario,
    guide: Option<&GuideUrl>,
) -> Result<Vec<RecordFile>, NotWritten> {
    directory(path)?;
    let file = |name: &str| {
        Ok(RecordFile {
            file: OutFile::new(&path.join(format!("{name}.parquet")))?,
            format: RecordFormat::Parquet,
        })
    };
    comparison::names(scenario, guide)
        .iter()
        .map(|name| file(name))
        .collect()
}

impl RecordFile {
    pub(super) fn write(&self, record: &Record) -> Result<(), NotWritten> {
        self.file.write(|out| record::write(record, self.format, out))
    }
}

pub(super) fn write_report(file: &OutFile, runs: &[ReportedRun<'_>]) -> Result<(), NotWritten> {
    file.write_text(&report(runs))
}
