//! A campaign on disk: its manifest, gains, chunks of rows, and finally one table.
//!
//! ```text
//! DIR/campaign.json      the manifest; written first, never changed
//!     gains/A-C.json     the best gains of the law of controller C in case A
//!     chunks/N.parquet   rows of a chunk: written under a temporary name, synced, and renamed
//!     runs.parquet       all rows in the order of the runs; the chunks are deleted afterwards
//! ```
//! A killed process loses only the chunks under way.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::{fmt, fs};

use serde::{Deserialize, Serialize};

use super::design::{Campaign, Chunk, ScenarioFiles};
use super::file::CampaignError;
use super::rows::{Rows, RowsError, SCHEMA_VERSION};
use super::tune::Tuned;
use crate::http_guide::NoGuidance;

const MANIFEST: &str = "campaign.json";
const RUNS: &str = "runs.parquet";

/// A part of a campaign: the `index`-th of `of`, from 1 on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Its number, from 1 on.
    pub index: u64,
    /// Number of parts.
    pub of: u64,
}

impl Shard {
    /// The whole campaign.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Its chunks, adjacent, so that few shards tune the same laws.
    pub(super) fn chunks(self, all: &[Chunk]) -> &[Chunk] {
        let n = all.len() as u64;
        #[expect(clippy::cast_possible_truncation, reason = "no more than there are chunks")]
        let at = |index: u64| (n * index / self.of) as usize;
        &all[at(self.index - 1)..at(self.index)]
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || format!("{text:?} is not a shard: write 1/3 for the first of three");
        let (index, of) = text.split_once('/').ok_or_else(wrong)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| wrong());
        let (index, of) = (number(index)?, number(of)?);
        let is_part = (1..=of).contains(&index) && of <= 1_000_000;
        is_part.then_some(Self { index, of }).ok_or_else(wrong)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// The contents of a directory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the tables.
    pub schema_version: String,
    /// The campaign's name.
    pub name: String,
    /// Version of the program.
    pub program: String,
    /// SHA-256 of campaign file, scenarios with their files, and program version.
    pub digest: String,
    /// The part in this directory.
    pub shard: Shard,
    /// The campaign file's text.
    pub text: String,
    /// The scenario files that it names, as they were at its start.
    #[serde(default)]
    pub scenario_files: ScenarioFiles,
    /// The campaign's outline for reports: `Campaign::outline`.
    #[serde(default)]
    pub design: serde_json::Value,
}

impl Manifest {
    /// The manifest of `campaign`.
    pub fn of(campaign: &Campaign, shard: Shard) -> Self {
        let program = env!("CARGO_PKG_VERSION").to_owned();
        let mut parts = vec![SCHEMA_VERSION.to_owned(), program.clone(), campaign.text.clone()];
        let cases = campaign.cases.iter();
        parts.extend(cases.map(|case| format!("{}\0{}", case.craft, case.scenario.source.text)));
        parts.extend(campaign.scenario_files.parts());
        Self {
            schema_version: SCHEMA_VERSION.to_owned(),
            name: campaign.file.name.clone(),
            digest: wire::sha256(parts.join("\0").as_bytes()),
            program,
            shard,
            text: campaign.text.clone(),
            scenario_files: campaign.scenario_files.clone(),
            design: campaign.outline(),
        }
    }

    /// The campaign; errors name `file`. Fails if this version of the program refuses it.
    pub fn campaign(&self, file: &str) -> Result<Campaign, CampaignError> {
        Campaign::parse(&self.text, file, self.scenario_files.clone())
    }

    pub(super) fn about(&self) -> Vec<(&'static str, String)> {
        vec![
            ("schema_version", self.schema_version.clone()),
            ("campaign", self.name.clone()),
            ("program", self.program.clone()),
            ("digest", self.digest.clone()),
            ("measured_columns", super::rows::MEASURED.join(" ")),
        ]
    }
}

/// The directory of a campaign.
#[derive(Clone, Debug)]
pub struct Directory {
    path: PathBuf,
    /// Its manifest.
    pub manifest: Manifest,
}

/// A directory cannot be used.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum DirectoryError {
    #[error("cannot use {0}")]
    Io(String, #[source] io::Error),
    #[error("{0} holds no campaign: it has no readable campaign.json")]
    NotOne(String),
    #[error("{0}")]
    Other(String),
    #[error("{0} is damaged: delete it, and run the campaign again")]
    Damaged(String, #[source] RowsError),
    #[error("{0}. Finished runs are kept: run it again to continue")]
    Guide(#[from] NoGuidance),
    #[error("the campaign in {0} is not finished: run it again to continue")]
    Unfinished(String),
}

impl Directory {
    /// The directory at `path` for `manifest`: created, or opened if it holds that campaign.
    pub fn create(path: &Path, manifest: Manifest) -> Result<Self, DirectoryError> {
        fs::create_dir_all(path).map_err(|source| io_error(path, source))?;
        let file = path.join(MANIFEST);
        if is_there(&file)? {
            let found = Self::open(path)?;
            if (&found.manifest.digest, found.manifest.shard) != (&manifest.digest, manifest.shard) {
                let brief = |of: &Manifest| {
                    let digest = &of.digest[..8.min(of.digest.len())];
                    format!("{} {digest}, shard {}", of.name, of.shard)
                };
                let (there, program) = (brief(&found.manifest), &found.manifest.program);
                let (path, this) = (path.display(), brief(&manifest));
                return Err(DirectoryError::Other(format!(
                    "{path} holds another campaign ({there}, program {program}), not this one ({this}): give another --out, or delete it"
                )));
            }
            return Ok(found);
        }
        let json = serde_json::to_vec_pretty(&manifest).expect("texts and numbers only");
        write_whole(&file, &json).map_err(|source| io_error(&file, source))?;
        Ok(Self { path: path.to_owned(), manifest })
    }

    /// The directory at `path`, which holds a campaign.
    pub fn open(path: &Path) -> Result<Self, DirectoryError> {
        let text = fs::read(path.join(MANIFEST)).ok();
        let manifest = text.and_then(|text| serde_json::from_slice(&text).ok());
        let manifest = manifest.ok_or_else(|| DirectoryError::NotOne(path.display().to_string()))?;
        Ok(Self { path: path.to_owned(), manifest })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// `true` if all rows are in one table.
    pub fn is_collected(&self) -> Result<bool, DirectoryError> {
        is_there(&self.path.join(RUNS))
    }

    /// All rows, in the order of the runs.
    pub fn rows(&self) -> Result<Rows, DirectoryError> {
        if self.is_collected()? {
            return read(&self.path.join(RUNS));
        }
        Err(DirectoryError::Unfinished(self.path.display().to_string()))
    }

    pub(super) fn gains(&self, case: usize, controller: usize) -> Option<Tuned> {
        let file = self.path.join(format!("gains/{case}-{controller}.json"));
        serde_json::from_slice(&fs::read(file).ok()?).ok()
    }

    /// Numbers of the stored chunks.
    pub(super) fn chunks_done(&self) -> Result<Vec<u64>, DirectoryError> {
        let folder = self.path.join("chunks");
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(vec![]),
            Err(source) => return Err(io_error(&folder, source)),
        };
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let done = names.filter_map(|name| name.strip_suffix(".parquet")?.parse().ok());
        let mut done: Vec<u64> = done.collect();
        done.sort_unstable();
        Ok(done)
    }

    /// Stores the result of a piece of work; `name` has no ending.
    pub(super) fn store_bytes(&self, name: &str, bytes: &[u8]) -> Result<(), DirectoryError> {
        let is_chunk = name.starts_with("chunks/");
        let ending = if is_chunk { "parquet" } else { "json" };
        let file = self.path.join(format!("{name}.{ending}"));
        write_whole(&file, bytes).map_err(|source| io_error(&file, source))
    }

    pub(super) fn store_chunk(&self, number: u64, rows: &Rows) -> Result<(), DirectoryError> {
        self.write(&self.chunk_file(number), rows)
    }

    fn chunk_file(&self, number: u64) -> PathBuf {
        self.path.join("chunks").join(format!("{number}.parquet"))
    }

    /// Appends the rows of `chunks` to `all`, stores them as one table, and deletes the chunks.
    pub(super) fn collect(&self, chunks: &[Chunk], mut all: Rows) -> Result<Rows, DirectoryError> {
        let done = self.chunks_done()?;
        if chunks.iter().any(|chunk| !done.contains(&chunk.number)) {
            return Err(DirectoryError::Unfinished(self.path.display().to_string()));
        }
        for chunk in chunks {
            let file = self.chunk_file(chunk.number);
            let rows = read(&file)?;
            all.append(rows).map_err(|source| damaged(&file, source))?;
        }
        self.write(&self.path.join(RUNS), &all)?;
        let folder = self.path.join("chunks");
        match fs::remove_dir_all(&folder) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => Err(io_error(&folder, source)),
            _ => Ok(all),
        }
    }

    /// Merges the shards in `parts` at `path`.
    pub fn merge(path: &Path, parts: &[Self]) -> Result<(Self, Rows), DirectoryError> {
        let Some(first) = parts.first() else {
            return Err(DirectoryError::Other("there is nothing to merge".to_owned()));
        };
        let of = first.manifest.shard.of;
        let mut shards: Vec<u64> = parts.iter().map(|part| part.manifest.shard.index).collect();
        let is_other =
            |part: &&Self| (&part.manifest.digest, part.manifest.shard.of) != (&first.manifest.digest, of);
        if let Some(other) = parts.iter().find(is_other) {
            return Err(DirectoryError::Other(format!(
                "{} and {} are not shards of one campaign",
                first.path.display(),
                other.path.display()
            )));
        }
        shards.sort_unstable();
        if !shards.iter().copied().eq(1..=of) {
            let names: Vec<String> = shards.iter().map(|index| format!("{index}/{of}")).collect();
            return Err(DirectoryError::Other(format!(
                "these are the shards {}: each is needed once",
                names.join(", ")
            )));
        }
        let mut all = Rows::default();
        for part in parts {
            let appended = all.append(part.rows()?);
            appended.map_err(|source| damaged(&part.path, source))?;
        }
        let manifest = Manifest { shard: Shard::WHOLE, ..first.manifest.clone() };
        let whole = Self::create(path, manifest)?;
        whole.write(&whole.path.join(RUNS), &all)?;
        Ok((whole, all))
    }

    fn write(&self, file: &Path, rows: &Rows) -> Result<(), DirectoryError> {
        let mut bytes = vec![];
        rows.write(&self.manifest.about(), &mut bytes)
            .map_err(|error| io_error(file, io::Error::other(error)))?;
        write_whole(file, &bytes).map_err(|source| io_error(file, source))
    }
}

fn read(file: &Path) -> Result<Rows, DirectoryError> {
    let bytes = fs::read(file).map_err(|source| io_error(file, source))?;
    Rows::read(bytes).map_err(|source| damaged(file, source))
}

fn io_error(path: &Path, source: io::Error) -> DirectoryError {
    DirectoryError::Io(path.display().to_string(), source)
}

fn damaged(path: &Path, source: RowsError) -> DirectoryError {
    DirectoryError::Damaged(path.display().to_string(), source)
}

/// `true` if the file exists. An error if that is unknown: it must not be overwritten.
fn is_there(path: &Path) -> Result<bool, DirectoryError> {
    path.try_exists().map_err(|source| io_error(path, source))
}

/// Writes a file whole or not at all, and syncs it.
fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let partial = folder.join(format!(".{name}.{}.part", std::process::id()));
    let mut file = File::create(&partial)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(&partial, path)?;
    // The new name is in the folder, which must be synced too.
    File::open(folder)?.sync_all()
}
