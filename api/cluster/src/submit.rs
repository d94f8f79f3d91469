//! Sends a campaign to workers.

use bytes::Bytes;
use lab::campaign::{Campaign, Manifest, Shard, Work};

use super::broker::{
    Broker, ClusterError, MANIFEST, PARKED, WorkMessage, as_token, failed, id_of, names, store, subject,
};

/// A submitted campaign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// Its id on the broker.
    pub id: String,
    /// Pieces of work sent now.
    pub sent: usize,
    /// Pieces of work done before.
    pub done: usize,
}

/// Sends the unfinished work of `campaign`, also work that was given up; again is harmless.
pub async fn submit(
    broker: &Broker,
    campaign: &Campaign,
    replicas: usize,
) -> Result<Submitted, ClusterError> {
    let manifest = Manifest::of(campaign, Shard::WHOLE);
    let id = id_of(&manifest);
    broker.stream(replicas).await?;
    let bucket = broker.new_bucket(&id, replicas).await?;
    let json = serde_json::to_vec(&manifest).expect("texts and numbers only");
    store(&bucket, MANIFEST, &json).await?;
    let there = names(&bucket, &broker.clock).await?;
    let is_done = |work: &Work| there.contains(&work.name());
    let (mut sent, mut done) = (0, 0);
    for case in 0..campaign.cases.len() {
        let before = Work::before(campaign, case);
        let chunks = Work::chunks(campaign, case);
        // Gains first; the worker that finds the last ones sends the chunks.
        let ready = before.iter().all(is_done);
        let next = if ready { chunks } else { before };
        for work in next {
            if is_done(&work) {
                done += 1;
                continue;
            }
            let parked = format!("{PARKED}{}", work.name());
            if there.contains(&parked) {
                // The retry needs another name: the broker drops names of the last minutes.
                let mark = bucket.info(&parked).await.map_err(failed("look for work"))?;
                send(broker, &manifest, work, Some(&mark.nuid)).await?;
                bucket.delete(&parked).await.map_err(failed("send work"))?;
            } else {
                send(broker, &manifest, work, None).await?;
            }
            sent += 1;
        }
    }
    Ok(Submitted { id, sent, done })
}

/// Sends a piece of work. The broker drops duplicates for minutes; `parked` marks a retry.
pub(crate) async fn send(
    broker: &Broker,
    manifest: &Manifest,
    work: Work,
    parked: Option<&str>,
) -> Result<(), ClusterError> {
    let id = id_of(manifest);
    let order = WorkMessage { campaign: id.clone(), work };
    let payload = Bytes::from(serde_json::to_vec(&order).expect("names and numbers only"));
    let version = as_token(&manifest.program, &manifest.schema_version);
    let subject = subject(&version, &id, &work.name());
    let message = format!("{id} {} {}", work.name(), parked.unwrap_or_default());
    let mut headers = async_nats::HeaderMap::new();
    headers.insert("Nats-Msg-Id", message);
    let jetstream = &broker.jetstream;
    let sent = jetstream.publish_with_headers(subject, headers, payload).await;
    let stored = sent.map_err(failed("send work"))?.await;
    stored.map(drop).map_err(failed("send work"))
}
