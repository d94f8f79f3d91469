//! The clients' measurements and their report.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::{fmt, fs};

use super::http::Answer;

/// Measured values since the beginning and since the last report.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    values: Vec<f64>,
    /// Number of reported values.
    reported: usize,
}

impl Samples {
    pub(crate) fn add(&mut self, value: f64) {
        self.values.push(value);
    }

    /// Those since the last call.
    fn fresh(&mut self) -> Spread {
        let fresh = Spread::of(&self.values[self.reported..]);
        self.reported = self.values.len();
        fresh
    }

    fn all(&self) -> Spread {
        Spread::of(&self.values)
    }
}

/// Median, 99th percentile and largest of some values.
#[derive(Clone, Copy, Debug)]
struct Spread([f64; 3]);

impl Spread {
    fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        let at = |percent: usize| sorted.get(last * percent / 100).copied().unwrap_or(f64::NAN);
        Self([at(50), at(99), at(100)])
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self([median, high, most]) = self;
        write!(out, "{median:.2}/{high:.2}/{most:.2}")
    }
}

/// The measurements of all clients.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    /// Posts that are on the disk.
    pub(crate) acknowledged: u64,
    /// Requests with an unexpected answer, by status.
    refused: BTreeMap<u16, u64>,
    /// Requests without an answer.
    lost: u64,
    /// Reads of a reference before the first plan.
    pub(crate) no_plan_yet: u64,
    /// Time from a post's due time to its acknowledgement, ms; the wait for earlier ones counts.
    pub(crate) acks: Samples,
    /// Age of the plan that counts, s.
    pub(crate) ages: Samples,
    /// Plans that were due and not made, by mission.
    pub(crate) missed: BTreeMap<usize, u64>,
    /// References whose plan a deadline cut short.
    pub(crate) cut_short: u64,
    /// The first failed request and its failure.
    first_failure: Option<String>,
}

/// Clones share the tally.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shared(Arc<Mutex<Tally>>);

impl Shared {
    pub(crate) fn lock(&self) -> MutexGuard<'_, Tally> {
        self.0.lock().expect("no thread panics while counting")
    }
}

impl Tally {
    pub(crate) fn refuse(&mut self, what: &str, answer: &Answer) {
        *self.refused.entry(answer.status).or_default() += 1;
        self.first_failure.get_or_insert_with(|| {
            let body = String::from_utf8_lossy(&answer.body);
            let retry = answer.retry_after.as_deref().unwrap_or("not given");
            format!("{what}: {}, Retry-After {retry}: {body}", answer.status)
        });
    }

    pub(crate) fn lose(&mut self, what: &str, error: &std::io::Error) {
        self.lost += 1;
        self.first_failure.get_or_insert_with(|| format!("{what}: {error}"));
    }

    /// A sign that the service has too much to do.
    pub(crate) fn sign(&self, age_max: f64) -> Option<String> {
        if let Some(failure) = &self.first_failure {
            return Some(format!("a request failed: {failure}"));
        }
        let missed = self.missed();
        if 0 < missed {
            return Some(format!("{missed} plans were due and not made"));
        }
        if 0 < self.cut_short {
            return Some("a deadline cut a plan short".to_owned());
        }
        let oldest = self.ages.all().0[2];
        (age_max < oldest).then(|| format!("a plan was {oldest:.2} s old"))
    }

    fn missed(&self) -> u64 {
        self.missed.values().sum()
    }

    fn counts(&self) -> String {
        let (acknowledged, refused, lost) = (self.acknowledged, &self.refused, self.lost);
        let missed = self.missed();
        format!("{acknowledged} acknowledged, refused {refused:?}, {lost} lost, {missed} missed")
    }

    /// One line about what came since the last.
    pub(crate) fn progress(&mut self) -> String {
        format!(
            "{}; ack p50/p99/max {} ms; plan age {} s",
            self.counts(),
            self.acks.fresh(),
            self.ages.fresh()
        )
    }

    /// All of it.
    pub(crate) fn table(&self) -> String {
        let rows = [
            ("posts", self.counts()),
            ("ack p50/p99/max, ms", self.acks.all().to_string()),
            ("plan age p50/p99/max, s", self.ages.all().to_string()),
            ("asked before any plan", self.no_plan_yet.to_string()),
        ];
        let failure = self.first_failure.iter();
        let rows = rows.into_iter().chain(failure.map(|failure| ("first failure", failure.clone())));
        let rows = rows.map(|(name, value)| format!("{name:<25}{value}\n"));
        rows.collect::<Vec<_>>().concat()
    }
}

/// Resident memory of a process, as text.
pub(crate) fn memory(pid: Option<u32>) -> String {
    let kib = || -> Option<u64> {
        let status = fs::read_to_string(format!("/proc/{}/status", pid?)).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        line.split_whitespace().next()?.parse().ok()
    };
    kib().map_or("unknown".to_owned(), |kib| format!("{} MiB", kib / 1024))
}
