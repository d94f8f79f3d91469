//! Campaigns over NATS JetStream: `campaign submit`, `watch`, `collect`, and `pilotfish worker`.

use std::{error::Error, num::NonZeroUsize, path::PathBuf, time::Duration};

use clap::Args;
use clock::Clock;
use cluster::{Access, Broker, ClusterError, Progress, Worker, WorkerEvent, collect, progress, submit};
use lab::campaign::{Campaign, jobs};
use tokio::{runtime::Runtime, signal, sync::watch};

use crate::cli::out_file::{print, print_rows, visible};

/// Time between two checks of a campaign's progress.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// The broker, and how to log in.
#[derive(Debug, Args)]
pub(crate) struct BrokerFlags {
    /// Addresses of the broker, separated by commas, such as nats://host:4222 or
    /// tls://user:password@host.
    #[arg(long, value_name = "URL")]
    nats: String,
    /// Credentials file of NATS (.creds).
    #[arg(long, value_name = "FILE")]
    nats_creds: Option<PathBuf>,
    /// Certificates of the authority that signed the broker's certificate, PEM [default: the
    /// system's].
    #[arg(long, value_name = "FILE")]
    nats_ca: Option<PathBuf>,
    /// Certificate of this client, PEM.
    #[arg(long, value_name = "FILE", requires = "nats_key")]
    nats_cert: Option<PathBuf>,
    /// Its key, PEM.
    #[arg(long, value_name = "FILE", requires = "nats_cert")]
    nats_key: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Submit {
    /// The campaign file.
    file: PathBuf,
    #[command(flatten)]
    broker: BrokerFlags,
    /// Keep everything on this many servers of the broker's cluster.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=5))]
    replicas: u8,
}

#[derive(Debug, Args)]
pub(crate) struct Submitted {
    /// The campaign's id, which `campaign submit` printed.
    id: String,
    #[command(flatten)]
    broker: BrokerFlags,
}

#[derive(Debug, Args)]
pub(crate) struct Collect {
    #[command(flatten)]
    campaign: Submitted,
    /// Directory for the rows; created if missing.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct WorkerFlags {
    #[command(flatten)]
    broker: BrokerFlags,
    /// Pieces of work in parallel [default: the number of processors].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Give up work that was started this often without a result.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..))]
    max_tries: u16,
    /// Exit after this many seconds without work [default: never].
    #[arg(long, value_name = "S")]
    idle_s: Option<u32>,
}

impl BrokerFlags {
    fn access(&self) -> Access {
        Access {
            url: self.nats.clone(),
            credentials: self.nats_creds.clone(),
            authority: self.nats_ca.clone(),
            certificate: self.nats_cert.clone().zip(self.nats_key.clone()),
        }
    }

    async fn connect(&self, name: &str) -> Result<Broker, ClusterError> {
        Broker::connect(&self.access(), name, &Clock::machine()).await
    }
}

pub(super) fn send(arguments: &Submit) -> Result<(), Box<dyn Error>> {
    let campaign = Campaign::read(&arguments.file)?;
    let sent = Runtime::new()?.block_on(async {
        let broker = arguments.broker.connect("pilotfish campaign submit").await?;
        submit(&broker, &campaign, usize::from(arguments.replicas)).await
    })?;
    eprintln!("{} pieces of work sent, {} already done", sent.sent, sent.done);
    Ok(print(&format!("{}\n", sent.id))?)
}

pub(super) fn watch_until_over(arguments: &Submitted) -> Result<(), Box<dyn Error>> {
    Runtime::new()?.block_on(async {
        let broker = arguments.broker.connect("pilotfish campaign watch").await?;
        let mut before = Progress::default();
        loop {
            let now = match progress(&broker, &arguments.id).await {
                // A broker that restarts, or elects a leader, answers later.
                Err(error @ ClusterError::Broker(..)) => {
                    eprintln!("trying again: {}", visible(&error.to_string()));
                    Clock::machine().sleep(LOOK_EVERY).await;
                    continue;
                }
                progress => progress?,
            };
            if now != before {
                eprintln!("{}", visible(&in_words(&now)));
            }
            if now.is_over() {
                for parked in &now.parked {
                    eprintln!("given up: {}", visible(parked));
                }
                return if now.parked.is_empty() { Ok(()) } else { Err("work was given up".into()) };
            }
            before = now;
            Clock::machine().sleep(LOOK_EVERY).await;
        }
    })
}

fn in_words(progress: &Progress) -> String {
    let ((tuned, laws), (done, chunks)) = (progress.tuned, progress.chunks);
    let given_up = progress.parked.len();
    format!("gains of {tuned} of {laws} laws, {done} of {chunks} chunks, {given_up} given up")
}

pub(super) fn fetch_all(arguments: &Collect) -> Result<(), Box<dyn Error>> {
    let Submitted { id, broker } = &arguments.campaign;
    let (directory, rows) = Runtime::new()?.block_on(async {
        let broker = broker.connect("pilotfish campaign collect").await?;
        collect(&broker, id, &arguments.out).await
    })?;
    print_rows(directory.path(), rows.len(), &rows.digest())
}

/// Works until Ctrl-C or SIGTERM, then finishes the work that was started.
pub(crate) fn work(arguments: &WorkerFlags) -> Result<(), Box<dyn Error>> {
    let jobs = arguments.jobs.unwrap_or_else(jobs).get();
    Runtime::new()?.block_on(async {
        let notify = |event| eprintln!("{}", visible(&event_in_words(&event)));
        let access = arguments.broker.access();
        let broker =
            Broker::connect_when_ready(&access, "pilotfish worker", &Clock::machine(), &notify).await?;
        let (stop, stopped) = watch::channel(false);
        tokio::spawn(async move {
            asked_to_stop().await;
            eprintln!("stopping after the work under way");
            let _ = stop.send(true);
            std::future::pending::<()>().await;
        });
        let idle = arguments.idle_s.map(|seconds| Duration::from_secs(seconds.into()));
        let worker = Worker::new(broker, jobs, arguments.max_tries.into());
        worker.run(stopped, idle, &notify).await
    })?;
    Ok(())
}

fn event_in_words(event: &WorkerEvent) -> String {
    match event {
        WorkerEvent::Done(campaign, work) => format!("{campaign}: {work}"),
        WorkerEvent::Parked(campaign, work, why) => format!("{campaign}: {work} given up: {why}"),
        WorkerEvent::Refused(why) => format!("refused: {why}"),
        WorkerEvent::Trouble(why) => format!("trying again: {why}"),
    }
}

async fn asked_to_stop() {
    let Ok(mut terminated) = signal::unix::signal(signal::unix::SignalKind::terminate()) else {
        return signal::ctrl_c().await.unwrap_or_default();
    };
    tokio::select! {
        _ = terminated.recv() => {}
        _ = signal::ctrl_c() => {}
    }
}
