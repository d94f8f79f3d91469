//! A campaign on the disk: the laboratory's directory, and beside its files who posted it and what became of it.
//!
//! ```text
//! DATA/campaigns/ID/campaign.json, gains/, chunks/, runs.parquet    the laboratory's
//!                   posted.json     who posted it; written last of what is written before the client hears of it
//!                   report.*        in the end
//!                   ended.json      what became of it; a campaign without it goes on
//! ```

use std::{
    fs::{self, DirBuilder, File},
    io,
    os::unix::fs::DirBuilderExt as _,
    path::{Path, PathBuf},
};

use lab::campaign::{Directory, DirectoryError, Manifest};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use wire::campaign::Campaign;

use crate::{problem::Problem, store::StoreError};

const FOLDER: &str = "campaigns";
const POSTED: &str = "posted.json";
const ENDED: &str = "ended.json";
/// How names of campaigns begin. What has another name is left alone.
pub(super) const ID_PREFIX: &str = "c-";
/// How names of what was deleted begin, until it is gone.
const DELETED: &str = ".deleted-";

/// What is known of a campaign from its post.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Post {
    /// Its number, by which lists are ordered and continued.
    pub(super) number: u64,
    /// Name of the client's token, or its address.
    pub(super) caller: String,
    /// The client's key of the request, and the request's hash.
    pub(super) key: Option<(String, [u8; 32])>,
    /// What was answered.
    pub(super) answer: Campaign,
}

/// A campaign as it was found on the disk.
#[derive(Debug)]
pub(super) struct Kept {
    pub(super) post: Post,
    pub(super) directory: Directory,
    /// What became of it.
    pub(super) ended: Option<Campaign>,
}

/// The folder of all campaigns of the data directory.
#[derive(Clone, Debug)]
pub(super) struct Folder(PathBuf);

impl Folder {
    /// Makes it where it is not there, for the service's user alone.
    pub(super) fn open(data: &Path) -> io::Result<Self> {
        let path = data.join(FOLDER);
        DirBuilder::new().recursive(true).mode(0o700).create(&path)?;
        File::open(data)?.sync_all()?;
        Ok(Self(path))
    }

    pub(super) fn of(&self, id: &str) -> PathBuf {
        self.0.join(id)
    }

    /// All campaigns, by number. What was never acknowledged, or was deleted, is removed.
    pub(super) fn read(&self) -> io::Result<Vec<Kept>> {
        let mut all = vec![];
        for entry in fs::read_dir(&self.0)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let is_ours = name.starts_with(ID_PREFIX) && path.is_dir();
            if name.starts_with(DELETED) || is_ours && !path.join(POSTED).exists() {
                fs::remove_dir_all(&path)?;
                continue;
            }
            if !is_ours {
                continue;
            }
            let (Some(post), Ok(directory)) = (read_json(&path, POSTED), Directory::open(&path)) else {
                // It stays for people to look at.
                tracing::error!(path = %path.display(), "a campaign is damaged, and is not listed");
                continue;
            };
            all.push(Kept {
                post,
                directory,
                ended: read_json(&path, ENDED),
            });
        }
        all.sort_by_key(|kept| kept.post.number);
        Ok(all)
    }

    /// Stores a new campaign. It is on the disk when this returns.
    pub(super) fn store(&self, post: &Post, manifest: Manifest) -> Result<Directory, DirectoryError> {
        let directory = Directory::create(&self.of(&post.answer.id), manifest)?;
        directory.keep_file(POSTED, &json(post))?;
        self.sync().map_err(|source| DirectoryError::Io {
            path: self.0.display().to_string(),
            source,
        })?;
        Ok(directory)
    }

    /// Forgets the campaign called `id`. The next start does not find it when this returns.
    pub(super) fn delete(&self, id: &str) -> io::Result<()> {
        let gone = self.of(&format!("{DELETED}{id}"));
        fs::rename(self.of(id), &gone)?;
        self.sync()?;
        fs::remove_dir_all(&gone)
    }

    fn sync(&self) -> io::Result<()> {
        File::open(&self.0)?.sync_all()
    }
}

/// Stores what became of a campaign. It is on the disk when this returns.
pub(super) fn store_end(directory: &Directory, ended: &Campaign) -> Result<(), DirectoryError> {
    directory.keep_file(ENDED, &json(ended))
}

fn json(value: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec_pretty(value).expect("names, texts and numbers only")
}

fn read_json<T: DeserializeOwned>(folder: &Path, name: &str) -> Option<T> {
    let text = fs::read(folder.join(name)).ok()?;
    serde_json::from_slice(&text).ok()
}

/// The problem of a campaign that cannot be stored.
pub(super) fn not_stored(error: &DirectoryError) -> Problem {
    match error {
        DirectoryError::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull => {
            Problem::Log(StoreError::Full)
        }
        DirectoryError::Io { path, source } => Problem::NotStored(format!("cannot use {path}: {source}")),
        other => Problem::NotStored(other.to_string()),
    }
}
