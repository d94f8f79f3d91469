//! A worker: does the work of any campaign.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_nats::jetstream::consumer::{AckPolicy, Consumer, pull};
use async_nats::jetstream::object_store::ObjectStore;
use async_nats::jetstream::{AckKind, Message};
use clock::Clock;
use futures_util::StreamExt as _;
use lab::campaign::{Campaign, Manifest, Work};
use tokio::sync::watch;

use super::broker::{
    Broker, ClusterError, PARKED, PAUSE, WorkMessage, WorkerEvent, as_token, failed, fetch, names, store,
    subjects_of, version_in,
};
use super::submit::send;

/// Time without a sign of life after which work goes to another worker.
const ACK_WAIT: Duration = Duration::from_secs(20);
/// Time between two signs of life of a worker.
const PROGRESS: Duration = Duration::from_secs(5);
const PULL: Duration = Duration::from_secs(5);
/// Attempts to store a result with a broker that does not answer: a quarter of an hour.
const ATTEMPTS: u32 = 900;

/// A worker.
pub struct Worker {
    broker: Broker,
    jobs: usize,
    /// Starts without a result after which work is given up.
    tries_max: i64,
    campaigns: Mutex<HashMap<String, CachedCampaign>>,
}

type CachedCampaign = Arc<(Manifest, Campaign, ObjectStore)>;

impl Worker {
    /// Does `jobs` pieces of work in parallel, and gives up work started `tries_max` times in vain.
    pub fn new(broker: Broker, jobs: usize, tries_max: i64) -> Self {
        Self { broker, jobs: jobs.max(1), tries_max: tries_max.max(1), campaigns: Mutex::default() }
    }

    /// Works until `stop`, or until no work came for `idle_max`; then finishes the work under way.
    pub async fn run(
        &self,
        stop: watch::Receiver<bool>,
        idle_max: Option<Duration>,
        notify: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<(), ClusterError> {
        // Servers without a leader accept nothing.
        let consumer = loop {
            match self.consumer(notify).await {
                Err(error) if !*stop.borrow() => {
                    notify(WorkerEvent::Trouble(error.to_string()));
                    self.broker.clock.sleep(PAUSE).await;
                }
                outcome => break outcome?,
            }
        };
        let loops = (0..self.jobs).map(|_| self.work(&consumer, stop.clone(), idle_max, notify));
        futures_util::future::join_all(loops).await;
        Ok(())
    }

    /// The queue of work for this version; reports work for other versions.
    async fn consumer(
        &self,
        notify: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<Consumer<pull::Config>, ClusterError> {
        let own = as_token(env!("CARGO_PKG_VERSION"), lab::campaign::rows::SCHEMA_VERSION);
        let mut stream = self.broker.stream(1).await?;
        let waiting = stream.info_with_subjects("pilotfish.work.>").await;
        let waiting = waiting.map_err(failed("look for work"))?.collect::<Vec<_>>().await;
        let mut others = vec![];
        for (subject, _) in waiting.into_iter().flatten() {
            let version = version_in(&subject).filter(|version| *version != own);
            others.extend(version.map(str::to_owned).filter(|version| !others.contains(version)));
        }
        for version in others {
            let why = format!("work waits for version {version}; this is {own}");
            notify(WorkerEvent::Refused(why));
        }
        let name = format!("workers-{own}");
        let config = pull::Config {
            durable_name: Some(name.clone()),
            filter_subject: subjects_of(&own),
            ack_policy: AckPolicy::Explicit,
            ack_wait: ACK_WAIT,
            max_ack_pending: 100_000,
            ..pull::Config::default()
        };
        stream.info().await.map_err(failed("look for work"))?;
        let consumer = stream.get_or_create_consumer(&name, config).await;
        consumer.map_err(failed("make the queue of workers"))
    }

    async fn work(
        &self,
        consumer: &Consumer<pull::Config>,
        stop: watch::Receiver<bool>,
        idle_max: Option<Duration>,
        notify: &(dyn Fn(WorkerEvent) + Sync),
    ) {
        let mut idle = Duration::ZERO;
        while !*stop.borrow() && idle_max.is_none_or(|most| idle < most) {
            let next = match consumer.fetch().max_messages(1).expires(PULL).messages().await {
                Ok(mut messages) => messages.next().await,
                Err(error) => {
                    notify(WorkerEvent::Trouble(error.to_string()));
                    self.broker.clock.sleep(PAUSE).await;
                    continue;
                }
            };
            match next {
                None => idle += PULL,
                Some(Err(error)) => {
                    notify(WorkerEvent::Trouble(error.to_string()));
                    self.broker.clock.sleep(PAUSE).await;
                }
                Some(Ok(message)) => {
                    idle = Duration::ZERO;
                    let taken = Box::pin(self.take(&message, notify));
                    let taken = with_heartbeat(&message, &self.broker.clock, taken).await;
                    if let Err(error) = taken {
                        notify(WorkerEvent::Trouble(error.to_string()));
                        // Another worker may succeed.
                        let _ = message.ack_with(AckKind::Nak(Some(PAUSE))).await;
                    }
                }
            }
        }
    }

    /// Does the work of a message, stores the result, then acknowledges the message.
    async fn take(
        &self,
        message: &Message,
        notify: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<(), ClusterError> {
        let Ok(order) = serde_json::from_slice::<WorkMessage>(&message.payload) else {
            let what = format!("{} is not a piece of work", message.subject);
            notify(WorkerEvent::Trouble(what));
            return acknowledged(message, AckKind::Term).await;
        };
        let WorkMessage { campaign: id, work } = order;
        let known = self.campaign(&id).await?;
        let (_, campaign, bucket) = &*known;
        let tries = message.info().map_or(1, |info| info.delivered);
        if self.tries_max < tries {
            let why = format!("started {} times without a result", tries - 1);
            store(bucket, &format!("{PARKED}{}", work.name()), why.as_bytes()).await?;
            notify(WorkerEvent::Parked(id, work.name(), why));
            return acknowledged(message, AckKind::Term).await;
        }
        let case = work.case(campaign);
        if fetch(bucket, &work.name(), &self.broker.clock).await?.is_none() {
            let mut before = vec![];
            if let (Work::Fly { .. }, Some(case)) = (work, case) {
                for gains in Work::before(campaign, case) {
                    before.extend(fetch(bucket, &gains.name(), &self.broker.clock).await?);
                }
            }
            let (job, name) = (Arc::clone(&known), work.name());
            let done = move || work.done(&job.1, &job.0, &before);
            let done = self.broker.clock.run_blocking(done).await;
            // A panic is our bug: the broker sends the work again until it is given up.
            let bytes = done.map_err(failed(format!("do {name}")))??;
            with_retries(notify, &self.broker.clock, || store(bucket, &name, &bytes)).await?;
        }
        if let (Work::Tune { .. }, Some(case)) = (work, case) {
            self.send_chunks(&known, work, case, notify).await?;
        }
        // A killed broker may have forgotten this delivery: it never confirms, and delivers again.
        acknowledged(message, AckKind::Ack).await?;
        notify(WorkerEvent::Done(id, work.name()));
        Ok(())
    }

    /// Sends the chunks of a case once its gains are complete. The broker drops duplicates.
    async fn send_chunks(
        &self,
        (manifest, campaign, bucket): &(Manifest, Campaign, ObjectStore),
        found: Work,
        case: usize,
        notify: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<(), ClusterError> {
        // A lagging server lists too little. A list with the gains just stored has all earlier
        // ones, so the last worker sees all gains. Otherwise no worker might send the chunks.
        let there = with_retries(notify, &self.broker.clock, || async {
            let there = names(bucket, &self.broker.clock).await?;
            let behind = || std::io::Error::other("a server of the broker is behind the others");
            if there.contains(&found.name()) { Ok(there) } else { Err(failed("list what is done")(behind())) }
        })
        .await?;
        let is_there = |gains: &Work| there.contains(&gains.name());
        if !Work::before(campaign, case).iter().all(is_there) {
            return Ok(());
        }
        for chunk in Work::chunks(campaign, case) {
            if !is_there(&chunk) {
                let send = || send(&self.broker, manifest, chunk, None);
                with_retries(notify, &self.broker.clock, send).await?;
            }
        }
        Ok(())
    }

    async fn campaign(&self, id: &str) -> Result<CachedCampaign, ClusterError> {
        let campaigns = || {
            let campaigns = self.campaigns.lock();
            campaigns.expect("nothing panics while it holds the lock")
        };
        let known = campaigns().get(id).cloned();
        if let Some(known) = known {
            return Ok(known);
        }
        let (manifest, campaign) = self.broker.campaign(id).await?;
        let known = Arc::new((manifest, campaign, self.broker.bucket(id).await?));
        campaigns().insert(id.to_owned(), Arc::clone(&known));
        Ok(known)
    }
}

/// Waits for `doing`, and sends signs of life meanwhile.
async fn with_heartbeat<T>(message: &Message, clock: &Clock, doing: impl Future<Output = T>) -> T {
    tokio::pin!(doing);
    loop {
        tokio::select! {
            biased;
            done = &mut doing => return done,
            () = clock.sleep(PROGRESS) => {
                // A broker that does not answer now may answer the next time.
                let _ = message.ack_with(AckKind::Progress).await;
            }
        }
    }
}

/// Acknowledges a message, and waits for the broker's confirmation.
async fn acknowledged(message: &Message, kind: AckKind) -> Result<(), ClusterError> {
    let confirmed = message.double_ack_with(kind).await;
    confirmed.map_err(failed("acknowledge work"))
}

/// Retries while the broker does not answer, so that no result is lost.
async fn with_retries<T, F: Future<Output = Result<T, ClusterError>>>(
    notify: &(dyn Fn(WorkerEvent) + Sync),
    clock: &Clock,
    attempt: impl Fn() -> F,
) -> Result<T, ClusterError> {
    let mut left = ATTEMPTS;
    loop {
        match attempt().await {
            Err(error) if 0 < left => {
                notify(WorkerEvent::Trouble(error.to_string()));
                left -= 1;
                clock.sleep(PAUSE).await;
            }
            outcome => return outcome,
        }
    }
}
