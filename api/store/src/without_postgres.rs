//! Stands for PostgreSQL in a program without the feature `postgres`: a refusal, and no lease.

use std::{path::Path, time::Duration};

use clock::Clock;

use super::EventStore;
use super::error::StoreError;
use super::ownership::{Acquired, Member, Turn};
use super::reader::EventReader;

fn left_out<T>() -> Result<T, StoreError> {
    let reason = "this program is built without PostgreSQL: cargo build --release --features postgres";
    Err(StoreError::open(Path::new("of --store"), &reason))
}

#[expect(missing_docs, reason = "documented where they do something")]
impl EventStore {
    pub fn open_database(_: &str, _: Option<Member>, _: u64, _: &Clock) -> Result<Self, StoreError> {
        left_out()
    }

    pub fn is_elsewhere(_: &str) -> bool {
        false
    }
}

#[expect(missing_docs, reason = "documented where it does something")]
impl EventReader {
    pub fn of_database(_: &str) -> Result<Self, StoreError> {
        left_out()
    }
}

/// A lease that no service has.
#[derive(Clone, Debug)]
pub enum Lease {}

#[expect(missing_docs, reason = "cannot be called")]
impl Lease {
    pub fn incarnation(&self) -> Result<u64, StoreError> {
        match *self {}
    }

    pub fn url(&self) -> &str {
        match *self {}
    }

    pub fn turn_time(&self) -> Duration {
        match *self {}
    }

    pub fn acquire(&self, _: &str) -> Result<Acquired, StoreError> {
        match *self {}
    }

    pub fn take_turn(&self, _: usize) -> Result<Turn, StoreError> {
        match *self {}
    }

    pub fn leave(&self) -> Result<(), StoreError> {
        match *self {}
    }
}
