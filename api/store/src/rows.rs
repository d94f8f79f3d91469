//! Rows of either store. One query text, with `?1` as in SQLite, serves both.

use std::{borrow::Cow, fmt::Debug};

use rusqlite::types::{FromSql, ValueRef};
use rusqlite::{Connection, Params, ToSql, params_from_iter};

use super::digest::{digest, summary_of};
use super::entry::{AuditEntry, StoredMission};
use super::error::StoreError;
use super::sql::{ORDER, PURGE, PURGE_EVENTS, PURGE_MISSION, unsigned, with_nul};

/// A value for each store of this program.
#[cfg(feature = "postgres")]
pub(super) trait Param: ToSql + tokio_postgres::types::ToSql + Sync {}
#[cfg(feature = "postgres")]
impl<T: ToSql + tokio_postgres::types::ToSql + Sync> Param for T {}
#[cfg(not(feature = "postgres"))]
pub(super) trait Param: ToSql {}
#[cfg(not(feature = "postgres"))]
impl<T: ToSql> Param for T {}

pub(super) trait SqlRow {
    fn value(&self, column: usize) -> Result<ValueRef<'_>, StoreError>;
}

impl dyn SqlRow + '_ {
    pub(super) fn get<T: FromSql>(&self, column: usize) -> Result<T, StoreError> {
        let value = T::column_result(self.value(column)?);
        Ok(value.map_err(rusqlite::Error::from)?)
    }
}

impl SqlRow for rusqlite::Row<'_> {
    fn value(&self, column: usize) -> Result<ValueRef<'_>, StoreError> {
        Ok(self.get_ref(column)?)
    }
}

/// A connection.
pub(super) trait Rows: Debug + Send {
    /// The text in this store's form.
    fn text<'a>(&self, text: &'a str) -> Cow<'a, str>;

    /// The connection to a file. Only files are copied and inspected page by page.
    fn file(&self) -> Option<&Connection> {
        None
    }

    /// Calls `take` with each row, until it returns `false`.
    fn each(
        &self,
        query: &str,
        params: &[&dyn Param],
        take: &mut dyn FnMut(&dyn SqlRow) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError>;

    /// Executes a statement. Returns the number of changed rows.
    fn change(&self, statement: &str, params: &[&dyn Param]) -> Result<u64, StoreError>;
}

impl dyn Rows + '_ {
    pub(super) fn all<T, A: FromIterator<T>>(
        &self,
        query: &str,
        params: &[&dyn Param],
        read: impl Fn(&dyn SqlRow) -> Result<T, StoreError>,
    ) -> Result<A, StoreError> {
        let mut all = vec![];
        self.each(query, params, &mut |row| {
            all.push(read(row)?);
            Ok(true)
        })?;
        Ok(all.into_iter().collect())
    }

    pub(super) fn first<T>(
        &self,
        query: &str,
        params: &[&dyn Param],
        read: impl Fn(&dyn SqlRow) -> Result<T, StoreError>,
    ) -> Result<Option<T>, StoreError> {
        let mut first = None;
        self.each(query, params, &mut |row| {
            first = Some(read(row)?);
            Ok(false)
        })?;
        Ok(first)
    }

    pub(super) fn one<T>(
        &self,
        query: &str,
        read: impl Fn(&dyn SqlRow) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let row = self.first(query, &[], read)?;
        row.ok_or_else(|| StoreError::Damaged(format!("{query}: a row is missing")))
    }

    pub(super) fn keep_order(&self, mission: &str, order: &AuditEntry) -> Result<(), StoreError> {
        let (caller, request, action) = (&order.caller, &order.request, &order.action);
        let params: [&dyn Param; 5] = [&order.at_s, caller, request, &mission, action];
        self.change(ORDER, &params).map(drop)
    }

    /// Removes some events of a deleted mission, at last the mission; `true` if that is gone.
    pub(super) fn purge(&self, number: i64) -> Result<bool, StoreError> {
        if 0 < self.change(PURGE_EVENTS, &[&number, &PURGE])? {
            return Ok(false);
        }
        self.change(PURGE_MISSION, &[&number]).map(|_| true)
    }
}

impl Rows for Connection {
    fn text<'a>(&self, text: &'a str) -> Cow<'a, str> {
        with_nul(text).into()
    }

    fn file(&self) -> Option<&Connection> {
        Some(self)
    }

    fn each(
        &self,
        query: &str,
        params: &[&dyn Param],
        take: &mut dyn FnMut(&dyn SqlRow) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        let mut statement = self.prepare_cached(query)?;
        let mut rows = statement.query(of_sqlite(params))?;
        while let Some(row) = rows.next()? {
            if !take(row)? {
                break;
            }
        }
        Ok(())
    }

    fn change(&self, statement: &str, params: &[&dyn Param]) -> Result<u64, StoreError> {
        let n = self.prepare_cached(statement)?.execute(of_sqlite(params))?;
        Ok(n as u64)
    }
}

fn of_sqlite(params: &[&dyn Param]) -> impl Params {
    params_from_iter(params.iter().map(|param| *param as &dyn ToSql))
}

/// The columns that [`stored_mission`] reads.
pub(super) const MISSION: &str = "number, id, summary, status, sequence, head, digest, owner";

pub(super) fn stored_mission(row: &dyn SqlRow) -> Result<StoredMission, StoreError> {
    let (number, id, summary): (_, String, Vec<u8>) = (row.get(0)?, row.get(1)?, row.get(2)?);
    let (status, head, stored): (String, Vec<u8>, Vec<u8>) = (row.get(3)?, row.get(5)?, row.get(6)?);
    let expected = digest(number, row.get(4)?, &summary_of(&status, &id), &head, &summary);
    Ok(StoredMission {
        number: unsigned(number),
        id,
        owner: row.get(7)?,
        summary,
        is_whole: stored == expected,
    })
}
