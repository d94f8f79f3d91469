//! What a wire said that was not understood: counted by reason, never guessed at.

use std::{collections::BTreeMap, fmt};

/// How often each reason to refuse something was met.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    counts: BTreeMap<&'static str, u64>,
}

impl Refused {
    /// Counts one more for `reason`.
    pub fn count(&mut self, reason: &'static str) {
        self.add(reason, 1);
    }

    /// Counts `times` more for `reason`.
    pub fn add(&mut self, reason: &'static str, times: u64) {
        if times > 0 {
            *self.counts.entry(reason).or_default() += times;
        }
    }

    /// The reasons met, in alphabetical order, and how often.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.counts.iter().map(|(reason, times)| (*reason, *times))
    }

    /// How much was refused in all.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.values().sum()
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (reason, times)) in self.iter().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{reason}: {times}")?;
        }
        Ok(())
    }
}
