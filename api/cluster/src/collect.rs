//! Progress of a campaign, and its rows at the end.

use std::path::Path;

use lab::campaign::{Campaign, Directory, Manifest, Work, rows::Rows};

use super::broker::{Broker, ClusterError, PARKED, fetch, names};

/// Progress of a campaign.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Tuned laws, and all laws to tune.
    pub tuned: (usize, usize),
    /// Finished chunks, and all chunks.
    pub chunks: (usize, usize),
    /// Work that was given up, with the reason.
    pub parked: Vec<String>,
    /// Chunks that cannot be done: they, or gains of their case, were given up.
    pub blocked: usize,
}

impl Progress {
    /// `true` if no work is left.
    pub fn is_over(&self) -> bool {
        self.chunks.1 <= self.chunks.0 + self.blocked
    }
}

/// All work of a campaign: gains, chunks.
fn all_work(campaign: &Campaign) -> (Vec<Work>, Vec<Work>) {
    let cases = || 0..campaign.cases.len();
    let gains = cases().flat_map(|case| Work::before(campaign, case));
    let chunks = cases().flat_map(|case| Work::chunks(campaign, case));
    (gains.collect(), chunks.collect())
}

/// Progress of the campaign `id`.
pub async fn progress(broker: &Broker, id: &str) -> Result<Progress, ClusterError> {
    let (_, campaign) = broker.campaign(id).await?;
    let bucket = broker.bucket(id).await?;
    let there = names(&bucket, &broker.clock).await?;
    let (gains, chunks) = all_work(&campaign);
    let is_done = |work: &&Work| there.contains(&work.name());
    let done = |all: &[Work]| (all.iter().filter(is_done).count(), all.len());
    let (mut parked, mut given_up) = (vec![], vec![]);
    for name in there.iter().filter(|name| name.starts_with(PARKED)) {
        let what = name.trim_start_matches(PARKED);
        // Work that was given up but done later is done.
        if there.iter().any(|other| other == what) {
            continue;
        }
        given_up.push(what.to_owned());
        let why = fetch(&bucket, name, &broker.clock).await?.unwrap_or_default();
        parked.push(format!("{what}: {}", String::from_utf8_lossy(&why)));
    }
    let is_given_up = |work: &Work| given_up.iter().any(|name| *name == work.name());
    let is_blocked = |chunk: &&Work| {
        let case = chunk.case(&campaign);
        let before = case.map_or_else(Vec::new, |case| Work::before(&campaign, case));
        !there.contains(&chunk.name()) && (is_given_up(chunk) || before.iter().any(is_given_up))
    };
    Ok(Progress {
        tuned: done(&gains),
        chunks: done(&chunks),
        blocked: chunks.iter().filter(is_blocked).count(),
        parked,
    })
}

/// Collects the rows of a campaign into the directory at `path`. Equal campaigns give equal files.
pub async fn collect(broker: &Broker, id: &str, path: &Path) -> Result<(Directory, Rows), ClusterError> {
    let (manifest, campaign): (Manifest, Campaign) = broker.campaign(id).await?;
    let progress = progress(broker, id).await?;
    if !progress.parked.is_empty() {
        return Err(ClusterError::Parked(progress.parked));
    }
    let (done, of) = progress.chunks;
    if done < of {
        return Err(ClusterError::Unfinished(done, of));
    }
    let bucket = broker.bucket(id).await?;
    let directory = Directory::create(path, manifest)?;
    if !directory.is_collected()? {
        let (gains, chunks) = all_work(&campaign);
        for work in gains.into_iter().chain(chunks) {
            let missing = || ClusterError::Unfinished(of - 1, of);
            let bytes = fetch(&bucket, &work.name(), &broker.clock).await?;
            directory.store_work(work, &bytes.ok_or_else(missing)?)?;
        }
    }
    // Nothing is left to fly: this only joins the chunks.
    let rows = lab::campaign::run(&campaign, &directory, std::num::NonZeroUsize::MIN, &mut |_| {})?;
    Ok((directory, rows))
}
