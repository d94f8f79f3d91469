//! The one thread that flies campaigns, in the order in which they were posted, and steps aside for live work.

use std::{
    fs,
    num::NonZeroUsize,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Weak, mpsc::Receiver},
    thread,
    time::{Duration, Instant},
};

use lab::campaign::{
    CampaignReport, Directory, DirectoryError, Manifest, Progress, Shard, Unflown, Watch, report::report,
    rows::Rows, run_watched,
};
use tokio::sync::watch;
use wire::campaign::{CampaignProgress, CampaignStatus};

use super::registry::{Entry, Registry};
use crate::{missions::unix_now, planners::Planners, store::EventStore};

/// The thread's name, as the system shows it.
const NAME: &str = "campaigns";
/// The lowest priority that there is, in steps of `nice`: beside any other thread it gets a hundredth of a processor.
const NICE: i32 = 19;
/// Between two looks whether live work still waits.
const ASIDE: Duration = Duration::from_millis(2);
/// When to try again what the disk did not take.
const PATIENCE: Duration = Duration::from_secs(10);

/// What a file of a report holds.
type Written = fn(&CampaignReport) -> String;

/// Names of a report's files, and what they hold.
const REPORTS: [(&str, Written); 3] = [
    ("report.html", CampaignReport::html),
    ("report.md", CampaignReport::markdown),
    ("report.json", CampaignReport::json),
];

/// What the thread has of the service.
pub(super) struct Flyer {
    pub(super) registry: Weak<Registry>,
    pub(super) planners: Planners,
    /// True, or without a sender, once the service stops.
    pub(super) closing: watch::Receiver<bool>,
    /// Keeps other services out of the directory for as long as this one may write there.
    pub(super) _store: EventStore,
}

/// Why a campaign is not done.
enum Undone {
    Stopped,
    /// The disk does not take it now.
    Disk(String),
    /// It never will be.
    Never(String),
}

impl Flyer {
    /// Starts the thread. `wakes` says that there may be something to fly, and has no sender once the service is gone.
    pub(super) fn start(self, wakes: Receiver<()>) {
        let thread = thread::Builder::new().name(NAME.to_owned());
        let started = thread.spawn(move || self.fly_all(&wakes));
        started.expect("a service starts before it runs out of threads");
    }

    fn fly_all(&self, wakes: &Receiver<()>) {
        // On Linux the priority is the thread's own, and that of the threads that it starts.
        if let Err(error) = rustix::process::nice(NICE) {
            tracing::warn!(%error, "campaigns share the processors with missions as equals");
        }
        loop {
            let Some(registry) = self.registry.upgrade() else {
                return;
            };
            let next = registry.next();
            drop(registry);
            if self.is_closing() {
                return;
            }
            match next {
                Some(entry) => self.fly(&entry),
                None if wakes.recv().is_err() => return,
                None => {}
            }
        }
    }

    fn fly(&self, entry: &Entry) {
        let id = &entry.post.answer.id;
        tracing::info!(campaign = id, change = "running", "a campaign changed");
        let done = catch_unwind(AssertUnwindSafe(|| self.flown(entry)));
        let ended = match done {
            Ok(Ok(rows)) => entry.end(CampaignStatus::Done, |campaign| {
                campaign.rows = Some(rows.len() as u64);
                campaign.digest = Some(rows.digest());
                campaign.progress.runs_done = campaign.progress.runs;
            }),
            Ok(Err(Undone::Never(reason))) => {
                entry.end(CampaignStatus::Failed, |campaign| campaign.reason = Some(reason))
            }
            Ok(Err(Undone::Disk(reason))) => {
                tracing::warn!(campaign = id, reason, "a campaign waits for the disk");
                self.wait(entry, PATIENCE);
                return;
            }
            Ok(Err(Undone::Stopped)) => {
                if entry.is_deleted() {
                    // What was written after its folder was taken away.
                    let _ = fs::remove_dir_all(entry.directory.path());
                }
                return;
            }
            // The panic hook has logged it.
            Err(_) => entry.end(CampaignStatus::Failed, |campaign| {
                campaign.reason = Some("the service has a bug: its log says where".to_owned());
            }),
        };
        if let Err(error) = ended {
            tracing::warn!(campaign = id, %error, "what became of a campaign cannot be stored yet");
            self.wait(entry, PATIENCE);
        }
    }

    fn flown(&self, entry: &Entry) -> Result<Rows, Undone> {
        let path = entry.directory.path();
        let manifest = &entry.directory.manifest;
        let never = |error: &dyn std::error::Error| Undone::Never(error.to_string());
        let campaign = manifest.campaign("campaign").map_err(|e| never(&e))?;
        // Refuses what another version of the program began.
        let directory = Directory::create(path, Manifest::of(&campaign, Shard::WHOLE))?;
        entry.change(|seen| {
            seen.status = CampaignStatus::Running;
            seen.started_s = Some(unix_now());
        });
        let mut flying_since = None;
        let mut progress = |progress: Progress| {
            let is_flying = progress.tuned.0 == progress.tuned.1;
            let since = is_flying.then(|| flying_since.get_or_insert_with(Instant::now).elapsed());
            entry.change(|seen| note(&mut seen.progress, progress, since));
        };
        let watch = Watch {
            progress: &mut progress,
            go_on: &|| self.go_on(entry),
        };
        let rows = run_watched(&campaign, &directory, NonZeroUsize::MIN, watch)?;
        let report = report(&campaign, &rows);
        for (name, of) in REPORTS {
            directory.keep_file(name, of(&report).as_bytes())?;
        }
        Ok(rows)
    }

    /// Whether to go on, once no live work waits.
    fn go_on(&self, entry: &Entry) -> ControlFlow<()> {
        loop {
            if entry.is_over() || self.is_closing() {
                return ControlFlow::Break(());
            }
            if !self.planners.has_work_waiting() {
                return ControlFlow::Continue(());
            }
            thread::sleep(ASIDE);
        }
    }

    fn wait(&self, entry: &Entry, time: Duration) {
        let until = Instant::now() + time;
        while Instant::now() < until && !entry.is_over() && !self.is_closing() {
            thread::sleep(Duration::from_millis(50));
        }
    }

    fn is_closing(&self) -> bool {
        *self.closing.borrow() || self.closing.has_changed().is_err()
    }
}

impl From<Unflown> for Undone {
    fn from(unflown: Unflown) -> Self {
        match unflown {
            Unflown::Stopped => Self::Stopped,
            Unflown::Directory(error) => error.into(),
        }
    }
}

impl From<DirectoryError> for Undone {
    fn from(error: DirectoryError) -> Self {
        match error {
            DirectoryError::Io { path, source } => Self::Disk(format!("cannot use {path}: {source}")),
            other => Self::Never(other.to_string()),
        }
    }
}

fn note(seen: &mut CampaignProgress, progress: Progress, since: Option<Duration>) {
    seen.laws_tuned = progress.tuned.0;
    seen.laws = progress.tuned.1;
    seen.runs_done = progress.runs.0;
    seen.runs = progress.runs.1;
    seen.runs_failed = progress.failed;
    #[expect(clippy::cast_precision_loss, reason = "far fewer runs than 2⁵³")]
    let rate = since.map(|since| progress.flown as f64 / since.as_secs_f64());
    seen.runs_per_s = rate.filter(|rate| rate.is_finite() && 0.0 < *rate);
}
