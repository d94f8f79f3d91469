//! Commands of the writer thread of either store, their order, and their replies.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use clock::Clock;
use tokio::{
    sync::{
        mpsc::{Receiver, error::TryRecvError},
        oneshot,
    },
    task::yield_now,
};

use super::entry::{Append, Appended, AuditEntry};
use super::error::StoreError;
use super::shares::Shares;
use super::trusted_time::TrustedTime;

/// Receives the reply, unless the caller is gone.
pub(super) type Reply<T> = oneshot::Sender<Result<T, StoreError>>;

pub(super) type Waiting = (Append, Reply<Appended>);

/// The reply to `Close`, and its receiver.
type Closed = (Reply<()>, Result<(), StoreError>);

/// Work of a writer other than an append.
type WriterWork = Box<dyn FnOnce(&mut dyn LogWriter) + Send>;

#[expect(clippy::large_enum_variant, reason = "nearly every command appends")]
pub(super) enum WriterCommand {
    Append(Append, Reply<Appended>),
    /// Other work, after all earlier appends.
    Do(WriterWork),
    Close(Reply<()>),
}

/// The only writer of this process.
pub(super) trait LogWriter {
    /// Most appends in one commit: limits the wait of the first.
    fn commit_max(&self) -> usize;
    /// Longest wait for a command before [`Self::upkeep`]; none: no limit.
    fn rest(&self) -> Option<Duration>;
    fn upkeep(&mut self);
    /// Does the due work between two commands.
    fn after_command(&mut self) {}
    /// Reads the stored sums again: the panic may have come between a commit and its count.
    fn recover(&mut self) -> Result<(), StoreError>;
    /// Stores the appends in one commit, and replies to each.
    fn store(&mut self, appends: Vec<Waiting>);
    /// Hides the mission at once and stores the order. Its disk space is freed step by step.
    fn delete(&mut self, id: &str, order: &AuditEntry) -> Result<bool, StoreError>;
    fn keep_time(&mut self, time: TrustedTime) -> Result<(), StoreError>;
    /// As [`Self::keep_time`]; may also set the time back.
    fn set_time(&mut self, time: TrustedTime) -> Result<(), StoreError> {
        self.keep_time(time)
    }
    fn protect(&mut self) -> Result<(), StoreError>;
    /// Fails if the store cannot be written.
    fn probe(&mut self) -> Result<(), StoreError>;
    /// Lets the store grow by at most `_pages` pages; none: no limit.
    fn limit_growth(&mut self, _pages: Option<u32>) -> Result<(), StoreError> {
        Ok(())
    }
    /// Removes the deleted missions and the free space.
    fn vacuum(&mut self) -> Result<(), StoreError>;
    fn close(&mut self) -> Result<(), StoreError> {
        Ok(())
    }
}

/// Writes until all handles of the store are dropped. After a panic, the interrupted commands have
/// no reply and the next ones are carried out.
pub(super) async fn run(mut writer: impl LogWriter, mut commands: Receiver<WriterCommand>, clock: Clock) {
    loop {
        let rest = writer.rest();
        let first = match rest {
            None => Some(commands.recv().await),
            Some(Duration::ZERO) => match commands.try_recv() {
                Ok(command) => Some(Some(command)),
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => None,
            },
            Some(rest) => clock.timeout(rest, commands.recv()).await.ok(),
        };
        let Some(first) = first else {
            if unless_panicked(&mut writer, LogWriter::upkeep).is_err() {
                return;
            }
            if rest == Some(Duration::ZERO) {
                // A simulated machine has one thread for everything.
                yield_now().await;
            }
            continue;
        };
        let Some(first) = first else { return };
        let carried_out = unless_panicked(&mut writer, |writer| {
            let carried_out = carry_out(writer, first, &mut commands);
            writer.after_command();
            carried_out
        });
        match carried_out {
            Ok(Some(ControlFlow::Break((reply, closed)))) => {
                // Later commands find the channel closed.
                drop(commands);
                let _ = reply.send(closed);
                return;
            }
            Ok(Some(ControlFlow::Continue(())) | None) => {}
            Err(()) => return,
        }
    }
}

/// The result of `work`; none if it panicked. Fails if the writer cannot continue.
fn unless_panicked<W: LogWriter, T>(writer: &mut W, work: impl FnOnce(&mut W) -> T) -> Result<Option<T>, ()> {
    match catch_unwind(AssertUnwindSafe(|| work(writer))) {
        Ok(done) => Ok(Some(done)),
        // The panic hook has logged it.
        Err(_) => match writer.recover() {
            Ok(()) => Ok(None),
            Err(error) => {
                tracing::error!(%error, "the mission log ends: it cannot be read after a panic");
                Err(())
            }
        },
    }
}

/// Carries out `first`. Appends that follow an append share its commit. Breaks after `Close`.
fn carry_out(
    writer: &mut impl LogWriter,
    first: WriterCommand,
    commands: &mut Receiver<WriterCommand>,
) -> ControlFlow<Closed> {
    let most = writer.commit_max();
    let mut appends = vec![];
    let mut next = Some(first);
    while let Some(command) = next {
        match command {
            WriterCommand::Append(append, reply) => appends.push((append, reply)),
            WriterCommand::Do(work) => {
                writer.store(std::mem::take(&mut appends));
                work(writer);
            }
            WriterCommand::Close(reply) => {
                writer.store(std::mem::take(&mut appends));
                return ControlFlow::Break((reply, writer.close()));
            }
        }
        next = (appends.len() < most).then(|| commands.try_recv().ok()).flatten();
    }
    writer.store(appends);
    ControlFlow::Continue(())
}

/// Numbers of events and bytes that a commit stored.
pub(super) fn stored(appends: &[&Append], appended: &[Appended]) -> (usize, u64) {
    let each = appends.iter().zip(appended);
    let stored = each.filter(|(_, appended)| matches!(appended, Appended::Stored));
    stored.fold((0, 0), |(n_events, n_bytes), (append, _)| {
        (n_events + append.events.len(), n_bytes + Shares::bytes_of(append))
    })
}

pub(super) fn reply_to_each(
    batch: impl IntoIterator<Item = Waiting>,
    results: impl IntoIterator<Item = Result<Appended, StoreError>>,
) {
    for ((append, reply), result) in batch.into_iter().zip(results) {
        if let Err(error) = &result {
            tracing::error!(%error, mission = append.mission, "cannot store in the mission log");
        }
        let _ = reply.send(result);
    }
}
