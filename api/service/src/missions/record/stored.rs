//! The events of a part of a mission, out of the log.

use std::vec;

use super::{MissionEvents, PAGE, PLANNED, Part};
use crate::store::{StoreError, StoredEvent};

/// Events out of the log, a page at a time. No transaction is held open: one that waits for a slow client would keep
/// the log from tidying up.
pub(super) struct Stored<'a> {
    events: &'a MissionEvents<'a>,
    after: u64,
    /// How many more are wanted.
    left: u64,
    part: &'a Part,
    page: vec::IntoIter<StoredEvent>,
    /// The last plan that was passed over, because none is wanted.
    pub(super) passed_plan: Option<StoredEvent>,
}

impl<'a> Stored<'a> {
    /// Those of `part`, in order.
    pub(super) fn of(events: &'a MissionEvents<'a>, part: &'a Part) -> Self {
        Self {
            events,
            after: part.after.min(events.last),
            left: part.limit.unwrap_or(u64::MAX),
            part,
            page: vec![].into_iter(),
            passed_plan: None,
        }
    }
}

impl Iterator for Stored<'_> {
    type Item = Result<StoredEvent, StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.any()? {
                Ok(event) if !self.part.has(&event.kind) => {
                    if event.kind == PLANNED {
                        self.passed_plan = Some(event);
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

impl Stored<'_> {
    /// The next event of any kind.
    fn any(&mut self) -> Option<Result<StoredEvent, StoreError>> {
        let MissionEvents {
            reader, number, last, ..
        } = *self.events;
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
            // What is written is not whole.
            let what = format!("event {} of mission number {number} is not there", self.after + 1);
            let missing = reader.damaged(number, what);
            self.after = last;
            return Some(Err(missing));
        };
        self.after = event.sequence;
        Some(Ok(event))
    }
}
