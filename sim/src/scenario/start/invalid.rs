//! Errors about members of a scenario that do not fit the others.

use std::fmt::Display;

use planner::snapshot::FieldError;

/// A member of a scenario that does not fit the others.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct InvalidScenario {
    /// The member, as `auvs[0].path`.
    pub field: String,
    /// The mistake, with the value and the limit.
    pub reason: String,
}

impl InvalidScenario {
    /// The same in item `i` of the list `table`, of whose items a table of this name is one.
    pub(super) fn of_item(self, table: &str, i: usize) -> Self {
        let field = match self.field.strip_prefix(table) {
            Some(rest) => format!("{table}[{i}]{rest}"),
            None => self.field,
        };
        Self { field, ..self }
    }
}

/// The fault of a snapshot's member, which is at `pointer` in the table `table` of a scenario.
pub(super) fn of_snapshot(table: &str, pointer: &str, fault: &FieldError) -> InvalidScenario {
    let steps = pointer.split('/').skip(1);
    let field = steps.fold(table.to_owned(), |field, step| match step.parse::<usize>() {
        Ok(index) => format!("{field}[{index}]"),
        Err(_) => format!("{field}.{step}"),
    });
    invalid(field, fault.words())
}

/// Refuses the member at `field`.
pub(super) fn refused<T>(field: impl Into<String>, reason: impl Display) -> Result<T, InvalidScenario> {
    Err(invalid(field, reason))
}

pub(super) fn invalid(field: impl Into<String>, reason: impl Display) -> InvalidScenario {
    InvalidScenario { field: field.into(), reason: reason.to_string() }
}
