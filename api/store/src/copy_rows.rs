//! The tables that both stores have, and copies of their rows.

use rusqlite::types::ValueRef;

use super::error::StoreError;
use super::rows::{Param, Rows, SqlRow};

/// The copied columns of each table, in the order of their references.
pub(super) const TABLES: [(&str, &str); 7] = [
    ("missions", "number, id, status, summary, owner, bytes, over_s, sequence, head, digest"),
    ("events", "mission, sequence, kind, body, digest"),
    ("snapshots", "mission, sequence, body, digest"),
    ("answered", "mission, key, request, answer"),
    ("orders", "number, at_s, caller, request, mission, action"),
    ("salts", "salt"),
    ("guards", "protected, trusted_s, agreed_s, clock_s, up_s"),
];

/// The column of a text that may have a NUL.
const KEY: &str = "key";

/// Copies the rows of a table that meet `condition`. Returns their number.
pub(super) fn copy_rows(
    from: &dyn Rows,
    to: &dyn Rows,
    table: &str,
    condition: &str,
    params: &[&dyn Param],
) -> Result<u64, StoreError> {
    let listed = TABLES.iter().find(|(name, _)| *name == table);
    let (_, columns) = listed.expect("both stores have it");
    let names: Vec<&str> = columns.split(", ").collect();
    let places: Vec<String> = (1..=names.len()).map(|place| format!("?{place}")).collect();
    let insert = format!("INSERT INTO {table} ({columns}) VALUES ({})", places.join(", "));
    let mut n = 0;
    from.each(&format!("SELECT {columns} FROM {table} {condition}"), params, &mut |row| {
        let values = names.iter().enumerate();
        let values = values.map(|(column, name)| value(row, column, *name == KEY, to));
        let values = values.collect::<Result<Vec<_>, _>>()?;
        to.change(&insert, &values.iter().map(|value| &**value).collect::<Vec<_>>())?;
        n += 1;
        Ok(true)
    })?;
    Ok(n)
}

fn value(row: &dyn SqlRow, column: usize, is_key: bool, to: &dyn Rows) -> Result<Box<dyn Param>, StoreError> {
    Ok(match row.value(column)? {
        // Only times are optional.
        ValueRef::Null => Box::new(None::<f64>),
        ValueRef::Integer(number) => Box::new(number),
        ValueRef::Real(number) => Box::new(number),
        ValueRef::Text(_) if is_key => Box::new(to.text(&row.get::<String>(column)?).into_owned()),
        ValueRef::Text(_) => Box::new(row.get::<String>(column)?),
        ValueRef::Blob(bytes) => Box::new(bytes.to_vec()),
    })
}
