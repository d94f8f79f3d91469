//! Input that was rejected, counted by reason.

use std::{collections::BTreeMap, fmt};

/// Numbers of rejected inputs, by reason.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rejects {
    counts: BTreeMap<&'static str, u64>,
}

impl Rejects {
    pub(crate) fn count(&mut self, reason: &'static str) {
        self.add(reason, 1);
    }

    pub(crate) fn add(&mut self, reason: &'static str, times: u64) {
        if times > 0 {
            *self.counts.entry(reason).or_default() += times;
        }
    }

    /// Reasons in alphabetical order, with their counts.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.counts.iter().map(|(reason, times)| (*reason, *times))
    }

    pub(crate) fn total(&self) -> u64 {
        self.counts.values().sum()
    }
}

impl fmt::Display for Rejects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self.iter().map(|(reason, times)| format!("{reason}: {times}"));
        f.write_str(&counts.collect::<Vec<_>>().join(", "))
    }
}

pub(crate) type Parsed<T> = Result<T, &'static str>;

pub(crate) fn reject_if(is_rejected: bool, reason: &'static str) -> Parsed<()> {
    if is_rejected { Err(reason) } else { Ok(()) }
}
