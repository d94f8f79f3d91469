//! Rows of either store. One query text, with `?1` as in SQLite, serves both.

use std::{borrow::Cow, fmt::Debug};

use rusqlite::{
    Connection, ToSql,
    types::{FromSql, ValueRef},
};

use super::{
    digest::{digest, summary_of},
    entry::StoredMission,
    error::StoreError,
    sql::unsigned,
};

/// A value for each store of this program.
#[cfg(feature = "postgres")]
pub(super) trait Param: ToSql + tokio_postgres::types::ToSql + Sync {}
#[cfg(feature = "postgres")]
impl<T: ToSql + tokio_postgres::types::ToSql + Sync> Param for T {}
#[cfg(not(feature = "postgres"))]
pub(super) trait Param: ToSql {}
#[cfg(not(feature = "postgres"))]
impl<T: ToSql> Param for T {}

/// A row of a result.
pub(super) trait Row {
    /// The value in a column, from 0.
    fn value(&self, column: usize) -> Result<ValueRef<'_>, StoreError>;
}

impl dyn Row + '_ {
    pub(super) fn get<T: FromSql>(&self, column: usize) -> Result<T, StoreError> {
        let value = T::column_result(self.value(column)?);
        Ok(value.map_err(rusqlite::Error::from)?)
    }
}

impl Row for rusqlite::Row<'_> {
    fn value(&self, column: usize) -> Result<ValueRef<'_>, StoreError> {
        Ok(self.get_ref(column)?)
    }
}

/// A connection that reads.
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
        take: &mut dyn FnMut(&dyn Row) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError>;
}

impl dyn Rows + '_ {
    /// All rows.
    pub(super) fn all<T, A: FromIterator<T>>(
        &self,
        query: &str,
        params: &[&dyn Param],
        read: impl Fn(&dyn Row) -> Result<T, StoreError>,
    ) -> Result<A, StoreError> {
        let mut all = vec![];
        self.each(query, params, &mut |row| {
            all.push(read(row)?);
            Ok(true)
        })?;
        Ok(all.into_iter().collect())
    }

    /// The first row, if there is one.
    pub(super) fn first<T>(
        &self,
        query: &str,
        params: &[&dyn Param],
        read: impl Fn(&dyn Row) -> Result<T, StoreError>,
    ) -> Result<Option<T>, StoreError> {
        let mut first = None;
        self.each(query, params, &mut |row| {
            first = Some(read(row)?);
            Ok(false)
        })?;
        Ok(first)
    }

    /// The only row.
    pub(super) fn one<T>(
        &self,
        query: &str,
        read: impl Fn(&dyn Row) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let row = self.first(query, &[], read)?;
        row.ok_or_else(|| StoreError::Damaged(format!("{query}: a row is missing")))
    }
}

impl Rows for Connection {
    fn text<'a>(&self, text: &'a str) -> Cow<'a, str> {
        text.into()
    }

    fn file(&self) -> Option<&Connection> {
        Some(self)
    }

    fn each(
        &self,
        query: &str,
        params: &[&dyn Param],
        take: &mut dyn FnMut(&dyn Row) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        let mut statement = self.prepare_cached(query)?;
        for (place, param) in (1..).zip(params) {
            statement.raw_bind_parameter(place, *param as &dyn ToSql)?;
        }
        let mut rows = statement.raw_query();
        while let Some(row) = rows.next()? {
            if !take(row)? {
                break;
            }
        }
        Ok(())
    }
}

/// The columns that [`stored_mission`] reads.
pub(super) const MISSION: &str = "number, id, summary, status, sequence, head, digest, owner";

/// Reads the columns [`MISSION`].
pub(super) fn stored_mission(row: &dyn Row) -> Result<StoredMission, StoreError> {
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
