//! Rows of either store. One query text, with `?1` as in SQLite, serves both.

use std::borrow::Cow;

use rusqlite::Connection;
#[cfg(feature = "postgres")]
use tokio_postgres::{self as database, types::ToSql};

#[cfg(feature = "postgres")]
use super::postgres::link::Pooled;
#[cfg(not(feature = "postgres"))]
use super::without_postgres::{self as database, Pooled, types::ToSql};
use super::{error::StoreError, sql::without_nul};

/// A type of column of both stores.
pub(super) trait Column: rusqlite::types::FromSql + for<'a> database::types::FromSql<'a> {}
impl<T: rusqlite::types::FromSql + for<'a> database::types::FromSql<'a>> Column for T {}

/// A value for both stores.
pub(super) trait Param: rusqlite::types::ToSql + database::types::ToSql + Sync {}
impl<T: rusqlite::types::ToSql + database::types::ToSql + Sync> Param for T {}

/// A row of a result.
pub(super) enum Row<'a> {
    Sqlite(&'a rusqlite::Row<'a>),
    Postgres(&'a database::Row),
}

impl Row<'_> {
    /// The value in a column, from 0.
    pub(super) fn get<T: Column>(&self, column: usize) -> Result<T, StoreError> {
        match self {
            Self::Sqlite(row) => Ok(row.get(column)?),
            Self::Postgres(row) => Ok(row.try_get(column)?),
        }
    }
}

/// A reading connection.
#[derive(Debug)]
pub(super) enum Rows {
    Sqlite(Connection),
    Postgres(Pooled),
}

impl Rows {
    /// The text in this store's form.
    pub(super) fn text<'a>(&self, text: &'a str) -> Cow<'a, str> {
        match self {
            Self::Sqlite(_) => text.into(),
            Self::Postgres(_) => without_nul(text),
        }
    }

    /// Calls `take` with each row, until it returns `false`.
    pub(super) fn each(
        &self,
        query: &str,
        params: &[&dyn Param],
        take: &mut dyn FnMut(&Row<'_>) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        match self {
            Self::Sqlite(connection) => {
                let mut statement = connection.prepare_cached(query)?;
                for (place, param) in (1..).zip(params) {
                    statement.raw_bind_parameter(place, *param as &dyn rusqlite::types::ToSql)?;
                }
                let mut rows = statement.raw_query();
                while let Some(row) = rows.next()? {
                    if !take(&Row::Sqlite(row))? {
                        break;
                    }
                }
                Ok(())
            }
            Self::Postgres(link) => {
                let params: Vec<_> = params.iter().map(|param| *param as &(dyn ToSql + Sync)).collect();
                link.each(query, &params, &mut |row| take(&Row::Postgres(row)))
            }
        }
    }

    /// All rows.
    pub(super) fn all<T>(
        &self,
        query: &str,
        params: &[&dyn Param],
        read: impl Fn(&Row<'_>) -> Result<T, StoreError>,
    ) -> Result<Vec<T>, StoreError> {
        let mut all = vec![];
        self.each(query, params, &mut |row| {
            all.push(read(row)?);
            Ok(true)
        })?;
        Ok(all)
    }

    /// The first row, if there is one.
    pub(super) fn first<T>(
        &self,
        query: &str,
        params: &[&dyn Param],
        read: impl Fn(&Row<'_>) -> Result<T, StoreError>,
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
        read: impl Fn(&Row<'_>) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let row = self.first(query, &[], read)?;
        row.ok_or_else(|| StoreError::Damaged(format!("{query}: a row is missing")))
    }
}
