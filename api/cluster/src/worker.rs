//! Does work, whatever campaign it is of.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
    time::Duration,
};

use async_nats::jetstream::{
    AckKind, Message,
    consumer::{AckPolicy, Consumer, pull},
    object_store::ObjectStore,
};
use futures_util::StreamExt as _;
use lab::campaign::{Campaign, Manifest, Work};
use tokio::{sync::watch, task::spawn_blocking, time::sleep};

use super::{
    broker::{
        Broker, ClusterError, Order, PARKED, PAUSE, as_token, failed, fetch, names, store, subjects_of,
        version_in,
    },
    submit::send,
};

/// Work that nothing was heard of for so long is sent to another worker.
const ACK_WAIT: Duration = Duration::from_secs(20);
/// How often a worker says that it is still at it.
const PROGRESS: Duration = Duration::from_secs(5);
/// How long one request for work waits.
const PULL: Duration = Duration::from_secs(5);
/// What was done is offered to a broker that does not answer for so many pauses, which is a quarter of an hour.
const ATTEMPTS: u32 = 900;

/// A worker.
pub struct Worker {
    broker: Broker,
    /// Pieces of work at once.
    jobs: usize,
    /// A piece of work that was begun so often without being done is given up.
    tries_max: i64,
    campaigns: Mutex<HashMap<String, Known>>,
}

type Known = Arc<(Manifest, Campaign, ObjectStore)>;

/// What a worker tells of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorkerEvent {
    /// A piece of work is done: its campaign and name.
    Done(String, String),
    /// A piece of work was given up, and why.
    Parked(String, String, String),
    /// Work that this worker may not do: it is for another version.
    Refused(String),
    /// The broker does not answer, or refuses; the worker goes on trying.
    Trouble(String),
}

impl Worker {
    /// A worker that does so many pieces of work at once, and gives one up that was begun `tries_max` times without being done.
    #[must_use]
    pub fn new(broker: Broker, jobs: usize, tries_max: i64) -> Self {
        Self {
            broker,
            jobs: jobs.max(1),
            tries_max: tries_max.max(1),
            campaigns: Mutex::default(),
        }
    }

    /// Works until `stop` says so, or, where `idle_max` is given, until nothing came for that long. What is being done then is done to
    /// its end.
    pub async fn run(
        &self,
        stop: watch::Receiver<bool>,
        idle_max: Option<Duration>,
        tell: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<(), ClusterError> {
        // Servers that have not met yet, or have just lost one of them, keep nothing.
        let consumer = loop {
            match self.consumer(tell).await {
                Err(error) if !*stop.borrow() => {
                    tell(WorkerEvent::Trouble(error.to_string()));
                    sleep(PAUSE).await;
                }
                outcome => break outcome?,
            }
        };
        let loops = (0..self.jobs).map(|_| self.work(&consumer, stop.clone(), idle_max, tell));
        futures_util::future::join_all(loops).await;
        Ok(())
    }

    /// The queue of all work for this version; says what there is for others.
    async fn consumer(
        &self,
        tell: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<Consumer<pull::Config>, ClusterError> {
        let own = as_token(env!("CARGO_PKG_VERSION"), lab::campaign::rows::SCHEMA_VERSION);
        let mut stream = self.broker.stream(1).await?;
        let waiting = stream
            .info_with_subjects("pilotfish.work.>")
            .await
            .map_err(failed("look for work"))?;
        let mut others: Vec<String> = vec![];
        for (subject, _) in waiting.collect::<Vec<_>>().await.into_iter().flatten() {
            match version_in(&subject) {
                Some(version) if version != own && !others.iter().any(|other| other == version) => {
                    others.push(version.to_owned());
                }
                _ => {}
            }
        }
        for version in others {
            tell(WorkerEvent::Refused(format!(
                "there is work for version {version}, and this is {own}"
            )));
        }
        let config = pull::Config {
            durable_name: Some(format!("workers-{own}")),
            filter_subject: subjects_of(&own),
            ack_policy: AckPolicy::Explicit,
            ack_wait: ACK_WAIT,
            max_ack_pending: 100_000,
            ..pull::Config::default()
        };
        let name = format!("workers-{own}");
        stream.info().await.map_err(failed("look for work"))?;
        stream
            .get_or_create_consumer(&name, config)
            .await
            .map_err(failed("make the queue of workers"))
    }

    async fn work(
        &self,
        consumer: &Consumer<pull::Config>,
        stop: watch::Receiver<bool>,
        idle_max: Option<Duration>,
        tell: &(dyn Fn(WorkerEvent) + Sync),
    ) {
        let mut idle = Duration::ZERO;
        while !*stop.borrow() && idle_max.is_none_or(|most| idle < most) {
            let next = match consumer.fetch().max_messages(1).expires(PULL).messages().await {
                Ok(mut messages) => messages.next().await,
                Err(error) => {
                    tell(WorkerEvent::Trouble(error.to_string()));
                    sleep(PAUSE).await;
                    continue;
                }
            };
            match next {
                None => idle += PULL,
                Some(Err(error)) => {
                    tell(WorkerEvent::Trouble(error.to_string()));
                    sleep(PAUSE).await;
                }
                Some(Ok(message)) => {
                    idle = Duration::ZERO;
                    if let Err(error) = busy(&message, self.take(&message, tell)).await {
                        tell(WorkerEvent::Trouble(error.to_string()));
                        // Another worker may be able to.
                        let _ = message.ack_with(AckKind::Nak(Some(PAUSE))).await;
                    }
                }
            }
        }
    }

    /// Does what a message says, stores what it came to, and acknowledges the message after that.
    async fn take(&self, message: &Message, tell: &(dyn Fn(WorkerEvent) + Sync)) -> Result<(), ClusterError> {
        let Ok(order) = serde_json::from_slice::<Order>(&message.payload) else {
            tell(WorkerEvent::Trouble(format!("{} is no work", message.subject)));
            return acknowledged(message, AckKind::Term).await;
        };
        let Order { campaign: id, work } = order;
        let known = self.known(&id).await?;
        let (_, campaign, bucket) = &*known;
        let tries = message.info().map_or(1, |info| info.delivered);
        if self.tries_max < tries {
            let why = format!("begun {} times and never done", tries - 1);
            store(bucket, &format!("{PARKED}{}", work.name()), why.as_bytes()).await?;
            tell(WorkerEvent::Parked(id, work.name(), why));
            return acknowledged(message, AckKind::Term).await;
        }
        let arena = work.arena(campaign);
        if fetch(bucket, &work.name()).await?.is_none() {
            let mut before = vec![];
            if let (Work::Fly { .. }, Some(arena)) = (work, arena) {
                for gains in Work::before(campaign, arena) {
                    before.extend(fetch(bucket, &gains.name()).await?);
                }
            }
            let job = Arc::clone(&known);
            let bytes = match spawn_blocking(move || work.done(&job.1, &job.0, &before)).await {
                Ok(bytes) => bytes?,
                // A panic of ours: the broker sends it again, and in the end it is given up by name.
                Err(error) => return Err(failed(format!("do {}", work.name()))(error)),
            };
            let name = work.name();
            persistently(tell, || store(bucket, &name, &bytes)).await?;
        }
        if let (Work::Tune { .. }, Some(arena)) = (work, arena) {
            self.send_chunks(&known, work, arena, tell).await?;
        }
        persistently(tell, || acknowledged(message, AckKind::Ack)).await?;
        tell(WorkerEvent::Done(id, work.name()));
        Ok(())
    }

    /// Sends the chunks of an arena, if all of its gains are found. Two workers may both do so: the broker takes the second for the first.
    async fn send_chunks(
        &self,
        (manifest, campaign, bucket): &(Manifest, Campaign, ObjectStore),
        found: Work,
        arena: usize,
        tell: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<(), ClusterError> {
        // A server that is behind the others lists less than there is. Who sees the gains that were just stored sees all that were
        // stored before, so that the last to find gains sees them all; without that, each might leave the chunks to another.
        let there = persistently(tell, || async {
            let there = names(bucket).await?;
            let behind = || std::io::Error::other("a server of the broker is behind the others");
            if there.contains(&found.name()) {
                Ok(there)
            } else {
                Err(failed("list what is done")(behind()))
            }
        })
        .await?;
        if !Work::before(campaign, arena)
            .iter()
            .all(|gains| there.contains(&gains.name()))
        {
            return Ok(());
        }
        for chunk in Work::chunks(campaign, arena) {
            if !there.contains(&chunk.name()) {
                persistently(tell, || send(&self.broker, manifest, chunk, None)).await?;
            }
        }
        Ok(())
    }

    async fn known(&self, id: &str) -> Result<Known, ClusterError> {
        if let Some(known) = self
            .campaigns
            .lock()
            .expect("nothing panics while it holds the lock")
            .get(id)
        {
            return Ok(Arc::clone(known));
        }
        let (manifest, campaign) = self.broker.campaign(id).await?;
        let known = Arc::new((manifest, campaign, self.broker.bucket(id).await?));
        let mut campaigns = self
            .campaigns
            .lock()
            .expect("nothing panics while it holds the lock");
        campaigns.insert(id.to_owned(), Arc::clone(&known));
        Ok(known)
    }
}

/// Waits for `doing`, and says meanwhile that it goes on.
async fn busy<T>(message: &Message, doing: impl Future<Output = T>) -> T {
    tokio::pin!(doing);
    loop {
        tokio::select! {
            done = &mut doing => return done,
            () = sleep(PROGRESS) => {
                // A broker that does not answer now may answer the next time.
                let _ = message.ack_with(AckKind::Progress).await;
            }
        }
    }
}

/// Answers a message, and waits until the broker has the answer.
async fn acknowledged(message: &Message, kind: AckKind) -> Result<(), ClusterError> {
    message
        .double_ack_with(kind)
        .await
        .map_err(failed("acknowledge work"))
}

/// Tries again while the broker does not answer: what was done should not be lost for that.
async fn persistently<T, F: Future<Output = Result<T, ClusterError>>>(
    tell: &(dyn Fn(WorkerEvent) + Sync),
    attempt: impl Fn() -> F,
) -> Result<T, ClusterError> {
    let mut left = ATTEMPTS;
    loop {
        match attempt().await {
            Err(error) if 0 < left => {
                tell(WorkerEvent::Trouble(error.to_string()));
                left -= 1;
                sleep(PAUSE).await;
            }
            outcome => return outcome,
        }
    }
}
