//! The stored events of a mission, or some of them.

use std::vec;

use store::{EventReader, StoreError, StoredEvent};

/// Events read at once. With 64 fixes of each of 16 vehicles a page has 13 MB.
const PAGE: usize = 64;

pub(super) const PLANNED: &str = "planned";

/// A selection of a mission's events. Default: all.
#[derive(Clone, Debug, Default)]
pub struct EventFilter {
    /// Only events after the one with this number.
    pub after: u64,
    /// The greatest number of events.
    pub limit: Option<u64>,
    /// Only events of these kinds; every kind if empty.
    pub kinds: Vec<String>,
}

impl EventFilter {
    pub(super) fn has(&self, kind: &str) -> bool {
        self.kinds.is_empty() || self.kinds.iter().any(|wanted| wanted == kind)
    }
}

/// An iterator of stored events, read a page at a time. Each page has its own transaction: a long
/// one would keep the write-ahead log from being truncated.
pub(super) struct StoredEvents<'a> {
    reader: &'a EventReader,
    number: u64,
    /// The sequence of the mission's last event.
    last: u64,
    after: u64,
    /// The number of events that may follow.
    left: u64,
    filter: &'a EventFilter,
    page: vec::IntoIter<StoredEvent>,
    /// The last plan that the filter skipped.
    pub(super) skipped_plan: Option<StoredEvent>,
}

impl<'a> StoredEvents<'a> {
    pub(super) fn of(reader: &'a EventReader, number: u64, last: u64, filter: &'a EventFilter) -> Self {
        Self {
            reader,
            number,
            last,
            after: filter.after.min(last),
            left: filter.limit.unwrap_or(u64::MAX),
            filter,
            page: vec![].into_iter(),
            skipped_plan: None,
        }
    }
}

impl Iterator for StoredEvents<'_> {
    type Item = Result<StoredEvent, StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.any()? {
                Ok(event) if !self.filter.has(&event.kind) => {
                    if event.kind == PLANNED {
                        self.skipped_plan = Some(event);
                    }
                }
                next => {
                    self.left -= 1;
                    return Some(next);
                }
            }
        }
    }
}

impl StoredEvents<'_> {
    /// The next event of any kind.
    fn any(&mut self) -> Option<Result<StoredEvent, StoreError>> {
        let (reader, number, last) = (self.reader, self.number, self.last);
        if self.after == last || self.left == 0 {
            return None;
        }
        if self.page.len() == 0 {
            let left = usize::try_from(last - self.after).unwrap_or(PAGE);
            match reader.events(number, self.after, PAGE.min(left)) {
                Ok(page) => self.page = page.into_iter(),
                Err(error) => {
                    self.after = last;
                    return Some(Err(error));
                }
            }
        }
        let Some(event) = self.page.next() else {
            let missing = reader.damaged(number, &format!("event {} is missing", self.after + 1));
            self.after = last;
            return Some(Err(missing));
        };
        self.after = event.sequence;
        Some(Ok(event))
    }
}
