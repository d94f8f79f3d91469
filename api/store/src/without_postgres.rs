//! Stand-ins of a program without the feature `postgres`: a refusal, and types without values.

use std::{fmt::Debug, path::Path, time::Duration};

use super::{
    error::StoreError,
    ownership::{Acquired, Trouble, Turn},
};

fn left_out<T>() -> Result<T, StoreError> {
    let reason = "this program is built without PostgreSQL: cargo build --release --features postgres";
    Err(StoreError::open(Path::new("of --store"), &reason))
}

pub(super) fn open(_url: &str) -> Result<Database, StoreError> {
    left_out()
}

pub(super) fn reading(_url: &str) -> Result<Pooled, StoreError> {
    left_out()
}

pub(super) fn is_elsewhere(_url: &str) -> bool {
    false
}

#[derive(Clone, Debug)]
pub(super) enum Database {}

impl Database {
    pub(super) fn reading(&self) -> Result<Pooled, StoreError> {
        match *self {}
    }

    pub(super) fn trouble(&self, _: Option<Trouble>) {
        match *self {}
    }
}

#[derive(Debug)]
pub(super) enum Pooled {}

impl Pooled {
    pub(super) fn each(
        &self,
        _query: &str,
        _params: &[&(dyn types::ToSql + Sync)],
        _take: &mut dyn FnMut(&Row) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        match *self {}
    }
}

pub(super) enum Row {}

impl Row {
    pub(super) fn try_get<T>(&self, _column: usize) -> Result<T, StoreError> {
        match *self {}
    }
}

/// A lease that no service has.
#[derive(Clone, Debug)]
pub struct Lease(Database);

#[expect(missing_docs, reason = "cannot be called")]
impl Lease {
    pub fn incarnation(&self) -> Result<u64, StoreError> {
        match self.0 {}
    }

    #[must_use]
    pub fn url(&self) -> &str {
        match self.0 {}
    }

    #[must_use]
    pub fn turn_time(&self) -> Duration {
        match self.0 {}
    }

    pub fn acquire(&self, _id: &str) -> Result<Acquired, StoreError> {
        match self.0 {}
    }

    pub fn take_turn(&self, _most: usize) -> Result<Turn, StoreError> {
        match self.0 {}
    }

    pub fn leave(&self) -> Result<(), StoreError> {
        match self.0 {}
    }
}

/// Every type is a type of column.
pub(super) mod types {
    pub(crate) trait ToSql {}
    impl<T: ?Sized> ToSql for T {}
    pub(crate) trait FromSql<'a> {}
    impl<T> FromSql<'_> for T {}
}
