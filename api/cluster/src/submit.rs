//! Sends a campaign to workers.

use bytes::Bytes;
use lab::campaign::{Campaign, Manifest, Shard, Work};

use super::broker::{
    Broker, ClusterError, MANIFEST, Order, PARKED, as_token, failed, id_of, names, store, subject,
};

/// What was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// What the campaign is called on the broker.
    pub id: String,
    /// Pieces of work that were sent now.
    pub sent: usize,
    /// Those that were done before.
    pub done: usize,
}

/// Sends what is not done yet of `campaign`, with copies on so many servers; what was given up gets its tries again. To send it twice
/// does no harm.
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
    let there = names(&bucket).await?;
    let is_done = |work: &Work| there.contains(&work.name());
    let (mut sent, mut done) = (0, 0);
    for arena in 0..campaign.arenas.len() {
        let before = Work::before(campaign, arena);
        let chunks = Work::chunks(campaign, arena);
        // Gains come first; the worker that finds the last of them sends the chunks.
        let ready = before.iter().all(is_done);
        let next = if ready { chunks } else { before };
        for work in next {
            if is_done(&work) {
                done += 1;
                continue;
            }
            let parked = format!("{PARKED}{}", work.name());
            if there.contains(&parked) {
                // It gets its tries again. Its first message may be minutes old: one of the same name would be taken for it.
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

/// Sends one piece of work; once, however often it is sent within some minutes, but for work that was given up: `parked` names that.
pub(crate) async fn send(
    broker: &Broker,
    manifest: &Manifest,
    work: Work,
    parked: Option<&str>,
) -> Result<(), ClusterError> {
    let id = id_of(manifest);
    let order = Order {
        campaign: id.clone(),
        work,
    };
    let payload = Bytes::from(serde_json::to_vec(&order).expect("names and numbers only"));
    let subject = subject(
        &as_token(&manifest.program, &manifest.schema_version),
        &id,
        &work.name(),
    );
    let mut headers = async_nats::HeaderMap::new();
    headers.insert(
        "Nats-Msg-Id",
        format!("{id} {} {}", work.name(), parked.unwrap_or_default()),
    );
    let sent = broker
        .jetstream
        .publish_with_headers(subject, headers, payload)
        .await;
    sent.map_err(failed("send work"))?
        .await
        .map_err(failed("send work"))?;
    Ok(())
}
