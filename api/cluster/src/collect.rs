//! How far a campaign is, and its rows once they are there.

use std::path::Path;

use lab::campaign::{Campaign, Directory, Manifest, Progress, Work, rows::Rows};

use super::broker::{Broker, ClusterError, PARKED, fetch, names};

/// How far a campaign is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// Laws whose gains are found, and all whose are to be.
    pub tuned: (usize, usize),
    /// Chunks that are done, and all.
    pub chunks: (usize, usize),
    /// Work that was given up: what, and why.
    pub parked: Vec<String>,
    /// Chunks that will not be done: given up themselves, or gains of their arena were.
    pub blocked: usize,
}

impl Standing {
    /// Whether there is nothing left to be done.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.chunks.1 <= self.chunks.0 + self.blocked
    }
}

/// Everything that is to be done of a campaign.
fn all_work(campaign: &Campaign) -> (Vec<Work>, Vec<Work>) {
    let arenas = 0..campaign.arenas.len();
    let gains = arenas
        .clone()
        .flat_map(|arena| Work::before(campaign, arena))
        .collect();
    (
        gains,
        arenas.flat_map(|arena| Work::chunks(campaign, arena)).collect(),
    )
}

/// How far the campaign of that name is.
pub async fn standing(broker: &Broker, id: &str) -> Result<Standing, ClusterError> {
    let (_, campaign) = broker.campaign(id).await?;
    let bucket = broker.bucket(id).await?;
    let there = names(&bucket).await?;
    let (gains, chunks) = all_work(&campaign);
    let done = |all: &[Work]| {
        (
            all.iter().filter(|work| there.contains(&work.name())).count(),
            all.len(),
        )
    };
    let (mut parked, mut given_up) = (vec![], vec![]);
    for name in there.iter().filter(|name| name.starts_with(PARKED)) {
        let what = name.trim_start_matches(PARKED);
        // One that was given up and done all the same is done.
        if there.iter().any(|other| other == what) {
            continue;
        }
        given_up.push(what.to_owned());
        let why = fetch(&bucket, name).await?.unwrap_or_default();
        parked.push(format!("{what}: {}", String::from_utf8_lossy(&why)));
    }
    let is_given_up = |work: &Work| given_up.iter().any(|name| *name == work.name());
    let is_blocked = |chunk: &&Work| {
        let arena = chunk.arena(&campaign);
        let before = arena.map_or_else(Vec::new, |arena| Work::before(&campaign, arena));
        !there.contains(&chunk.name()) && (is_given_up(chunk) || before.iter().any(is_given_up))
    };
    let blocked = if given_up.is_empty() {
        0
    } else {
        chunks.iter().filter(is_blocked).count()
    };
    Ok(Standing {
        tuned: done(&gains),
        chunks: done(&chunks),
        parked,
        blocked,
    })
}

/// Puts the rows of a campaign into the directory at `path`. Equal campaigns give equal files each time.
pub async fn collect(broker: &Broker, id: &str, path: &Path) -> Result<(Directory, Rows), ClusterError> {
    let (manifest, campaign): (Manifest, Campaign) = broker.campaign(id).await?;
    let standing = standing(broker, id).await?;
    if !standing.parked.is_empty() {
        return Err(ClusterError::Parked(standing.parked));
    }
    let (done, of) = standing.chunks;
    if done < of {
        return Err(ClusterError::Unfinished { done, of });
    }
    let bucket = broker.bucket(id).await?;
    let directory = Directory::create(path, manifest)?;
    if !directory.is_collected() {
        let (gains, chunks) = all_work(&campaign);
        for work in gains.into_iter().chain(chunks) {
            let missing = || ClusterError::Unfinished { done: of - 1, of };
            let bytes = fetch(&bucket, &work.name()).await?.ok_or_else(missing)?;
            directory.keep_work(work, &bytes)?;
        }
    }
    // Nothing is left to be flown: this puts together what is there.
    let rows = lab::campaign::run(
        &campaign,
        &directory,
        std::num::NonZeroUsize::MIN,
        &mut |_: Progress| {},
    )?;
    Ok((directory, rows))
}
