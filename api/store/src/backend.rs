//! The place of a store: a directory, or a database.

use std::{fmt::Debug, path::Path, sync::Arc};

use super::{error::StoreError, open_files::OpenFiles, ownership::Trouble, reader::EventReader};

/// A directory or a database. Its writer is a [`LogWriter`](super::command::LogWriter).
pub(super) trait Backend: Debug + Send + Sync {
    fn reader(&self) -> Result<EventReader, StoreError>;

    /// The store's file, if it has one.
    fn path(&self) -> Option<&Path> {
        None
    }

    /// Disturbs all connections from now on.
    fn trouble(&self, _: Option<Trouble>) {}
}

impl Backend for Arc<OpenFiles> {
    fn reader(&self) -> Result<EventReader, StoreError> {
        self.check()?;
        EventReader::open((**self).path(), Some(Arc::clone(self)))
    }

    fn path(&self) -> Option<&Path> {
        Some((**self).path())
    }
}
