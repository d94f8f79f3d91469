//! What the writer thread of either store does, in which order, and where its replies go.

use std::{
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::mpsc::Receiver,
};

use tokio::sync::oneshot;

use super::{
    entry::{Append, Appended, AuditEntry},
    error::StoreError,
    trusted_time::TrustedTime,
};

/// Receives the reply, unless the caller is gone.
pub(super) type Reply<T> = oneshot::Sender<Result<T, StoreError>>;

/// An append, and where its reply goes.
pub(super) type Waiting = (Append, Reply<Appended>);

/// The result of `Close`, and where it goes.
pub(super) type Closed = (Reply<()>, Result<(), StoreError>);

/// What a writer does besides appends.
type Work = Box<dyn FnOnce(&mut dyn LogWriter) + Send>;

#[expect(clippy::large_enum_variant, reason = "nearly every command appends")]
pub(super) enum Command {
    Append(Append, Reply<Appended>),
    /// Anything else, after the appends before it.
    Do(Work),
    /// Ends the writer.
    Close(Reply<()>),
}

/// The only writer of this process.
pub(super) trait LogWriter {
    /// Writes until `Close`, which it returns with the result, or until every handle is dropped.
    fn work(&mut self, commands: &Receiver<Command>) -> Option<Closed>;
    /// Reads again what is stored, after a panic that may have come between a commit and its count.
    fn recover(&mut self) -> Result<(), StoreError>;
    /// Stores the appends in one commit, and replies to each.
    fn store(&mut self, appends: Vec<Waiting>);
    /// Hides the mission at once, and stores who ordered it; its disk space is freed step by step.
    fn delete(&mut self, id: &str, order: &AuditEntry) -> Result<bool, StoreError>;
    fn keep_time(&mut self, time: TrustedTime) -> Result<(), StoreError>;
    /// As [`Self::keep_time`], also if that sets the time back.
    fn set_time(&mut self, time: TrustedTime) -> Result<(), StoreError>;
    /// Stores that the service has tokens.
    fn protect(&mut self) -> Result<(), StoreError>;
    /// Tests whether the store can be written.
    fn probe(&mut self) -> Result<(), StoreError>;
    /// Removes the deleted missions and the free space.
    fn vacuum(&mut self) -> Result<(), StoreError>;
    /// The last thing before the writer ends.
    fn close(&mut self) -> Result<(), StoreError>;
}

/// Writes until every handle of the store is dropped. After a panic the commands that were being carried out have no reply, and the
/// next ones are carried out.
pub(super) fn run(mut writer: impl LogWriter, commands: Receiver<Command>) {
    loop {
        match catch_unwind(AssertUnwindSafe(|| writer.work(&commands))) {
            Ok(None) => return,
            Ok(Some((reply, closed))) => {
                // Later commands find it closed.
                drop(commands);
                let _ = reply.send(closed);
                return;
            }
            // The program's panic hook has logged it.
            Err(_) => {
                if let Err(error) = writer.recover() {
                    tracing::error!(%error, "the mission log ends: it cannot be read after a panic");
                    return;
                }
            }
        }
    }
}

/// Carries out `first`, and stores the appends that wait behind it, at most `most`, in the same commit. Breaks after `Close`.
pub(super) fn carry_out(
    writer: &mut impl LogWriter,
    most: usize,
    first: Command,
    commands: &Receiver<Command>,
) -> ControlFlow<Closed> {
    let mut appends = vec![];
    let mut next = Some(first);
    while let Some(command) = next {
        match command {
            Command::Append(append, reply) => appends.push((append, reply)),
            Command::Do(work) => {
                writer.store(std::mem::take(&mut appends));
                work(writer);
            }
            Command::Close(reply) => {
                writer.store(std::mem::take(&mut appends));
                return ControlFlow::Break((reply, writer.close()));
            }
        }
        next = (appends.len() < most).then(|| commands.try_recv().ok()).flatten();
    }
    writer.store(appends);
    ControlFlow::Continue(())
}

/// Number of events that a commit stored.
pub(super) fn n_stored(appends: &[&Append], appended: &[Appended]) -> usize {
    let each = appends.iter().zip(appended);
    let stored = each.filter(|(_, appended)| matches!(appended, Appended::Stored));
    stored.map(|(append, _)| append.events.len()).sum()
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
