//! The reference as text.

use std::fmt::Write as _;

use super::{Presence, Row};

/// Tables whose members another page describes.
const ELSEWHERE: [&str; 2] = ["surface_craft.craft.", "surface_craft.tuning."];

/// The keys of the file, then those of each of its tables.
pub(super) fn text(rows: &[Row]) -> String {
    let table = |row: &Row| row.key.split_once('.').map_or("", |(table, _)| table).to_owned();
    let mut tables: Vec<String> = rows.iter().map(table).collect();
    tables.sort();
    tables.dedup();
    let mut text = String::new();
    for name in tables {
        if !name.is_empty() {
            writeln!(text, "\n## `{name}`\n").expect("text");
        }
        let is_here =
            |row: &&Row| table(row) == name && !ELSEWHERE.iter().any(|begin| row.key.starts_with(begin));
        let mut rows = rows.iter().filter(is_here);
        while let Some(row) = rows.next() {
            text += &match only_member(row, rows.clone()) {
                Some(member) if row.presence == Presence::Variant => {
                    rows.next();
                    item(member, &format!("{} {}", row.meaning, member.meaning), &name)
                }
                _ => item(row, &row.meaning, &name),
            };
        }
    }
    text
}

/// The only member of a table.
fn only_member<'a>(table: &Row, mut after: impl Iterator<Item = &'a Row>) -> Option<&'a Row> {
    let begin = format!("{}.", table.key);
    let is_inside = |row: &&Row| row.key.starts_with(&begin);
    let member = after.next().filter(is_inside)?;
    let alone = after.next().is_none_or(|row| !row.key.starts_with(&begin));
    alone.then_some(member)
}

/// A line of the reference.
fn item(row: &Row, meaning: &str, table: &str) -> String {
    let key = row.key.strip_prefix(&format!("{table}.")).unwrap_or(&row.key);
    let mut details = vec![row.value.clone()];
    if let Presence::Optional(default) = &row.presence {
        details.push(format!("default: {default}"));
    }
    details.retain(|detail| !detail.is_empty());
    let details = match &*details.join("; ") {
        "" => String::new(),
        details => format!(" ({details})"),
    };
    format!("- `{key}`{details}: {meaning}\n")
}
