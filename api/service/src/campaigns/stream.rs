//! Answers about a campaign that take their time: how far it is, as it changes, and its files.

use std::{
    fs::File,
    io::{self, Read as _},
    path::PathBuf,
    sync::Arc,
};

use axum::{
    body::{Body, Bytes},
    http::StatusCode,
    response::{IntoResponse, Response, sse::Event as Sent},
};
use futures_util::stream;
use tokio::{sync::watch, task::spawn_blocking};
use wire::campaign::Campaign;

use super::registry::{Campaigns, Entry};
use crate::{
    missions::stream::{RETRY, sent_to},
    problem::Problem,
    slots::Slot,
};

/// Size of a piece of a file, bytes.
const PIECE: usize = 64 << 10;

/// A client that reads how far a campaign is.
struct Subscription {
    seen: watch::Receiver<Campaign>,
    closing: watch::Receiver<bool>,
    _slot: Slot<Arc<str>>,
}

/// How far the campaign of `entry` is, now and with every change, until it is over. A client that reads slowly misses some
/// changes, and never the last one.
pub(super) fn events(
    campaigns: &Campaigns,
    entry: &Entry,
    caller: Arc<str>,
    last: Option<u64>,
) -> Result<Response, Problem> {
    let slot = campaigns.streams.take(caller);
    let slot = slot.map_err(|none| campaigns.no_slot(none, "event streams"))?;
    let mut seen = entry.seen.subscribe();
    {
        let now = seen.borrow_and_update();
        if now.status.is_over() && last.is_some_and(|last| number(&now) <= last) {
            return Ok(StatusCode::NO_CONTENT.into_response());
        }
    }
    seen.mark_changed();
    let subscription = Subscription {
        seen,
        closing: campaigns.closing.clone(),
        _slot: slot,
    };
    let events = stream::unfold(Some(subscription), async |subscription| {
        let mut subscription = subscription?;
        let (event, is_last) = subscription.next().await?;
        Some((Ok::<_, io::Error>(event), (!is_last).then_some(subscription)))
    });
    Ok(sent_to(events))
}

impl Subscription {
    /// The next event, and whether it is the last one. None once the campaign is deleted, or the service stops.
    async fn next(&mut self) -> Option<(Sent, bool)> {
        tokio::select! {
            changed = self.seen.changed() => changed.ok()?,
            _ = self.closing.wait_for(|closing| *closing) => return None,
        }
        let campaign = self.seen.borrow_and_update().clone();
        let is_over = campaign.status.is_over();
        let kind = if is_over {
            campaign.status.name()
        } else {
            "progress"
        };
        let event = Sent::default().id(number(&campaign).to_string()).event(kind);
        let text = serde_json::to_string(&campaign).expect("names, texts and numbers only");
        Some((event.retry(RETRY).data(text), is_over))
    }
}

/// The number of the event that shows `campaign`. That of its end is above all others, whatever was flown again after a kill.
fn number(campaign: &Campaign) -> u64 {
    let progress = &campaign.progress;
    if campaign.status.is_over() {
        progress.runs + 1
    } else {
        progress.runs_done
    }
}

/// The file at `path`, piece by piece, each read when the connection has room for it.
pub(super) async fn file(path: PathBuf, slot: Slot<Arc<str>>) -> Result<(u64, Body), Problem> {
    let open = move || {
        let file = File::open(&path)?;
        Ok((file.metadata()?.len(), file))
    };
    let opened: io::Result<_> = spawn_blocking(open).await.map_err(|_| Problem::Panicked)?;
    // It may have been deleted just now.
    let (length, file) = opened.map_err(|_| Problem::NoCampaign)?;
    let pieces = stream::unfold(Some((file, slot)), async |left| {
        let (mut file, slot) = left?;
        let read = spawn_blocking(move || {
            let mut piece = vec![0; PIECE];
            let n = file.read(&mut piece)?;
            piece.truncate(n);
            Ok((Bytes::from(piece), file))
        });
        match read.await.unwrap_or_else(|error| Err(io::Error::other(error))) {
            Ok((piece, _)) if piece.is_empty() => None,
            Ok((piece, file)) => Some((Ok(piece), Some((file, slot)))),
            Err(error) => Some((Err::<Bytes, io::Error>(error), None)),
        }
    });
    Ok((length, Body::from_stream(pieces)))
}

#[cfg(test)]
mod tests {
    use wire::campaign::{CampaignProgress, CampaignStatus};

    use super::*;

    #[test]
    fn the_end_is_above_every_number_before_it_though_a_kill_had_laws_and_runs_counted_anew() {
        let campaign = |status, laws_tuned, runs_done| Campaign {
            id: String::new(),
            name: String::new(),
            title: String::new(),
            status,
            created_s: 0.0,
            started_s: None,
            finished_s: None,
            progress: CampaignProgress {
                laws_tuned,
                runs: 100,
                runs_done,
                ..CampaignProgress::default()
            },
            rows: None,
            digest: None,
            reason: None,
        };
        let before = number(&campaign(CampaignStatus::Running, 20, 99));
        for (status, runs_done) in [(CampaignStatus::Done, 100), (CampaignStatus::Cancelled, 90)] {
            assert!(before < number(&campaign(status, 0, runs_done)), "{status:?}");
        }
    }
}
