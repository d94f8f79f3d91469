//! All campaigns: those that are kept, in memory as on the disk, and which is flown next.

use std::{
    collections::BTreeMap,
    io,
    path::PathBuf,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{SyncSender, sync_channel},
    },
    time::Duration,
};

use lab::campaign::{Directory, DirectoryError};
use tokio::{
    sync::{Mutex as Turns, OwnedMutexGuard, watch},
    task::spawn_blocking,
    time::timeout,
};
use wire::{
    campaign::{Campaign, CampaignProgress, CampaignStatus},
    sha256,
};

use super::{
    flyer::Flyer,
    kept::{Folder, ID_PREFIX, Kept, Post, not_stored, store_end},
    posted::{NewCampaign, PostedCampaign},
};
use crate::{
    edge::fresh_id,
    metrics::Shed,
    missions::{IdempotencyKey, unix_now},
    planners::Planners,
    problem::Problem,
    slots::{NoSlot, Slots},
    store::{EventStore, StoreError},
};

/// Campaigns that are not over at once.
const OPEN_MAX: usize = 8;
/// Of them those of one client: the others keep room for theirs.
const OPEN_SHARE: usize = OPEN_MAX / 2;
/// Campaigns that are kept, each of some MB.
const KEPT_MAX: usize = 200;
/// Of them those of one client.
const KEPT_SHARE: usize = KEPT_MAX / 2;
/// Readers of event streams at once.
const STREAMS_MAX: usize = 64;
/// Reports and tables sent at once.
const FILES_MAX: usize = 16;
/// Hexadecimal digits of a campaign's id.
const ID_DIGITS: usize = 24;
/// Longest check of a campaign; a client whose campaign takes longer has to come again.
const CHECK_TIME: Duration = Duration::from_secs(5);

/// Every campaign of a data directory. Clones share them.
#[derive(Clone, Debug)]
pub(crate) struct Campaigns {
    registry: Arc<Registry>,
    pub(super) streams: Slots<Arc<str>>,
    pub(super) files: Slots<Arc<str>>,
    pub(super) closing: watch::Receiver<bool>,
    planners: Planners,
}

#[derive(Debug)]
pub(super) struct Registry {
    folder: Folder,
    /// The store's.
    salt: Vec<u8>,
    all: Mutex<All>,
    /// Held while a campaign is stored.
    posting: Arc<Turns<()>>,
    /// Wakes the thread that flies.
    wake: SyncSender<()>,
}

#[derive(Debug, Default)]
struct All {
    /// By number.
    entries: BTreeMap<u64, Arc<Entry>>,
    /// The last number that was given.
    last: u64,
}

/// A campaign.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) post: Post,
    pub(super) directory: Directory,
    /// What clients see.
    pub(super) seen: watch::Sender<Campaign>,
    /// Whether it is over, or forgotten: what the thread that flies asks before every plan.
    over: AtomicBool,
    deleted: AtomicBool,
    /// Held while its end is stored: it has one.
    ending: Mutex<()>,
}

impl Campaigns {
    /// The campaigns beside `store`. Those that are not over go on, until `closing` is true.
    pub(crate) fn resume(
        store: &EventStore,
        planners: Planners,
        closing: watch::Receiver<bool>,
    ) -> Result<Self, StoreError> {
        let path = store.directory();
        let unusable = |error: io::Error| StoreError::Open {
            path: path.join("campaigns"),
            reason: error.to_string(),
        };
        let folder = Folder::open(path).map_err(unusable)?;
        let mut all = All::default();
        for kept in folder.read().map_err(unusable)? {
            let entry = Entry::from(kept);
            all.last = entry.post.number;
            all.entries.insert(all.last, Arc::new(entry));
        }
        let n_open = all.entries.values().filter(|entry| !entry.is_over()).count();
        if 0 < n_open {
            tracing::info!(n_open, "campaigns go on");
        }
        let (wake, wakes) = sync_channel(1);
        let registry = Arc::new(Registry {
            folder,
            salt: store.reader()?.salt()?,
            all: Mutex::new(all),
            posting: Arc::default(),
            wake,
        });
        let flyer = Flyer {
            registry: Arc::downgrade(&registry),
            planners: planners.clone(),
            closing: closing.clone(),
            _store: store.clone(),
        };
        flyer.start(wakes);
        Ok(Self {
            registry,
            streams: Slots::new(STREAMS_MAX),
            files: Slots::new(FILES_MAX),
            closing,
            planners,
        })
    }

    /// Takes on a campaign.
    pub(super) async fn create(
        &self,
        posted: PostedCampaign,
        caller: Arc<str>,
        key: Option<IdempotencyKey>,
    ) -> Result<Campaign, Problem> {
        if let Some(before) = self.registry.answered(key.as_ref())? {
            return Ok(before);
        }
        self.registry
            .check_room(&caller)
            .inspect_err(|_| self.planners.metrics().shed(Shed::Places))?;
        let checked = timeout(CHECK_TIME, self.planners.simulate(|| posted.read())).await;
        let new = checked.map_err(|_| self.planners.too_late())???;
        let turn = Arc::clone(&self.registry.posting).lock_owned().await;
        let registry = Arc::clone(&self.registry);
        // A client that goes away does not stop it half way.
        let stored = spawn_blocking(move || registry.store(new, &caller, key, turn));
        stored.await.map_err(|_| Problem::Panicked)?
    }

    /// At most `most` campaigns after the one numbered `after`, and its number with each.
    pub(super) fn list(&self, after: u64, most: usize) -> Vec<(u64, Campaign)> {
        let Some(first) = after.checked_add(1) else {
            return vec![];
        };
        let all = self.registry.all();
        let listed = all.entries.range(first..).take(most);
        listed
            .map(|(number, entry)| (*number, entry.seen.borrow().clone()))
            .collect()
    }

    /// The campaign called `id`.
    pub(super) fn find(&self, id: &str) -> Result<Arc<Entry>, Problem> {
        let all = self.registry.all();
        let mut entries = all.entries.values();
        entries
            .find(|entry| entry.post.answer.id == id)
            .cloned()
            .ok_or(Problem::NoCampaign)
    }

    /// Stops the campaign called `id`. It stays stopped.
    pub(super) async fn cancel(&self, id: &str) -> Result<Campaign, Problem> {
        let entry = self.find(id)?;
        let ended = spawn_blocking(move || {
            let ended = entry.end(CampaignStatus::Cancelled, |_| {});
            ended.map(|()| entry.seen.borrow().clone())
        });
        let seen = ended.await.map_err(|_| Problem::Panicked)?;
        let seen = seen.map_err(|error| not_stored(&error))?;
        match seen.status {
            CampaignStatus::Cancelled => Ok(seen),
            other => Err(Problem::CampaignConflict(format!(
                "it is {}, and cannot be cancelled any more",
                other.name()
            ))),
        }
    }

    /// Stops the campaign called `id`, and forgets it.
    pub(super) async fn delete(&self, id: &str) -> Result<(), Problem> {
        let entry = self.find(id)?;
        let registry = Arc::clone(&self.registry);
        let deleted = spawn_blocking(move || registry.delete(&entry));
        deleted.await.map_err(|_| Problem::Panicked)?
    }

    /// Why there is no slot for `what`.
    pub(super) fn no_slot(&self, no_slot: NoSlot, what: &'static str) -> Problem {
        self.planners.metrics().shed(Shed::Places);
        match no_slot {
            NoSlot::OfAll(limit) => Problem::Crowded { what, limit },
            NoSlot::OfClient(limit) => Problem::Share { what, limit },
        }
    }
}

impl Registry {
    /// The first campaign that is not over.
    pub(super) fn next(&self) -> Option<Arc<Entry>> {
        let all = self.all();
        all.entries.values().find(|entry| !entry.is_over()).cloned()
    }

    /// What `key` was answered with before.
    fn answered(&self, key: Option<&IdempotencyKey>) -> Result<Option<Campaign>, Problem> {
        let Some(key) = key else { return Ok(None) };
        let all = self.all();
        let with_key = all.entries.values().find_map(|entry| {
            let (name, request) = entry.post.key.as_ref()?;
            (*name == key.key).then_some((entry, request))
        });
        match with_key {
            None => Ok(None),
            Some((entry, request)) if *request == key.request => Ok(Some(entry.post.answer.clone())),
            Some(_) => Err(Problem::KeyTaken),
        }
    }

    /// Fails if `caller` may not post another one now.
    fn check_room(&self, caller: &str) -> Result<(), Problem> {
        let all = self.all();
        let count = |of: &dyn Fn(&Entry) -> bool| all.entries.values().filter(|entry| of(entry)).count();
        let is_own = |entry: &Entry| entry.post.caller == caller;
        if OPEN_MAX <= count(&|entry| !entry.is_over()) {
            return Err(Problem::Crowded {
                what: "campaigns that are not over",
                limit: OPEN_MAX,
            });
        }
        if OPEN_SHARE <= count(&|entry| is_own(entry) && !entry.is_over()) {
            return Err(Problem::Share {
                what: "campaigns that are not over",
                limit: OPEN_SHARE,
            });
        }
        if KEPT_MAX <= all.entries.len() {
            return Err(Problem::CampaignsKept(KEPT_MAX));
        }
        if KEPT_SHARE <= count(&is_own) {
            return Err(Problem::Share {
                what: "campaigns that are kept",
                limit: KEPT_SHARE,
            });
        }
        Ok(())
    }

    /// Stores a campaign, and has it flown in its turn.
    fn store(
        &self,
        new: NewCampaign,
        caller: &str,
        key: Option<IdempotencyKey>,
        turn: OwnedMutexGuard<()>,
    ) -> Result<Campaign, Problem> {
        // Another post may have been faster.
        if let Some(before) = self.answered(key.as_ref())? {
            return Ok(before);
        }
        self.check_room(caller)?;
        let created_s = unix_now();
        let text = format!("campaign {} {created_s}", fresh_id());
        let number = self.all().last + 1;
        let post = Post {
            number,
            caller: caller.to_owned(),
            key: key.map(|key| (key.key, key.request)),
            answer: Campaign {
                id: format!(
                    "{ID_PREFIX}{}",
                    &sha256(&[&*self.salt, text.as_bytes()].concat())[..ID_DIGITS]
                ),
                name: new.campaign.file.name.clone(),
                title: new.campaign.file.title.clone(),
                status: CampaignStatus::Queued,
                created_s,
                started_s: None,
                finished_s: None,
                progress: CampaignProgress {
                    runs: new.campaign.n_runs(),
                    ..CampaignProgress::default()
                },
                rows: None,
                digest: None,
                reason: None,
            },
        };
        let directory = self
            .folder
            .store(&post, new.manifest)
            .map_err(|error| not_stored(&error))?;
        let answer = post.answer.clone();
        tracing::info!(
            campaign = answer.id,
            caller,
            change = "posted",
            "a campaign changed"
        );
        let entry = Entry::from(Kept {
            post,
            directory,
            ended: None,
        });
        let mut all = self.all();
        all.last = number;
        all.entries.insert(number, Arc::new(entry));
        drop((all, turn));
        // A full channel wakes it as well.
        let _ = self.wake.try_send(());
        Ok(answer)
    }

    fn delete(&self, entry: &Entry) -> Result<(), Problem> {
        let ending = entry.ending();
        if entry.deleted.swap(true, Ordering::Relaxed) {
            return Err(Problem::NoCampaign);
        }
        let was_over = entry.over.swap(true, Ordering::Relaxed);
        let id = &entry.post.answer.id;
        if let Err(error) = self.folder.delete(id)
            && entry.directory.path().exists()
        {
            // It is as it was.
            entry.deleted.store(false, Ordering::Relaxed);
            entry.over.store(was_over, Ordering::Relaxed);
            let _ = self.wake.try_send(());
            return Err(Problem::NotStored(format!(
                "the campaign cannot be deleted: {error}"
            )));
        }
        self.all().entries.remove(&entry.post.number);
        drop(ending);
        tracing::info!(campaign = id, change = "deleted", "a campaign changed");
        Ok(())
    }

    fn all(&self) -> MutexGuard<'_, All> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl From<Kept> for Entry {
    fn from(
        Kept {
            post,
            directory,
            ended,
        }: Kept,
    ) -> Self {
        Self {
            over: AtomicBool::new(ended.is_some()),
            deleted: AtomicBool::new(false),
            seen: watch::Sender::new(ended.unwrap_or_else(|| post.answer.clone())),
            ending: Mutex::default(),
            post,
            directory,
        }
    }
}

impl Entry {
    pub(super) fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    pub(super) fn is_deleted(&self) -> bool {
        self.deleted.load(Ordering::Relaxed)
    }

    /// A file of its directory.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Changes what clients see of it, as long as it is not over.
    pub(super) fn change(&self, change: impl FnOnce(&mut Campaign)) {
        self.seen.send_if_modified(|seen| {
            let goes_on = !seen.status.is_over();
            if goes_on {
                change(seen);
            }
            goes_on
        });
    }

    /// Ends it so, unless it is over. What clients see then is on the disk.
    pub(super) fn end(
        &self,
        status: CampaignStatus,
        change: impl FnOnce(&mut Campaign),
    ) -> Result<(), DirectoryError> {
        let _ending = self.ending();
        if self.is_over() {
            return Ok(());
        }
        let mut ended = self.seen.borrow().clone();
        ended.status = status;
        ended.finished_s = Some(unix_now());
        change(&mut ended);
        store_end(&self.directory, &ended)?;
        self.over.store(true, Ordering::Relaxed);
        tracing::info!(campaign = ended.id, change = status.name(), "a campaign changed");
        self.seen.send_replace(ended);
        Ok(())
    }

    fn ending(&self) -> MutexGuard<'_, ()> {
        self.ending.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
