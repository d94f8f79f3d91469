//! The rows by condition, and the pairs of two controllers.

use std::collections::BTreeMap;

use super::student::mean;
use crate::campaign::rows::{PARAMETER, Rows};

/// A scenario with a craft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Group {
    /// The scenario's name.
    pub(crate) scenario: String,
    /// The craft's name.
    pub(crate) craft: String,
}

/// The rows of a campaign, by condition.
#[derive(Clone, Debug)]
pub(crate) struct RunTable {
    /// The rows in the order of the runs.
    pub(crate) rows: Rows,
    /// The groups in the order of their first runs.
    pub(crate) groups: Vec<Group>,
    /// Names of the controllers, in the order of their first runs.
    controllers: Vec<String>,
    /// Rows of a group and replicate, each with its controller's number, in the order of the runs.
    conditions: BTreeMap<(usize, u64), Vec<NumberedRow>>,
    /// Numbers of the groups whose replicates are all the same missions: nothing is drawn there. Their first replicate alone counts, as
    /// the others are no further observations.
    pub(crate) repeated: Vec<usize>,
}

/// A row, and its controller's number.
type NumberedRow = (usize, usize);

/// One condition that both flew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    /// Number of its group.
    pub(crate) group: usize,
    /// Which replicate of it.
    pub(crate) replicate: u64,
    /// Indices of both rows.
    pub(crate) rows: (usize, usize),
    /// Both values.
    pub(crate) values: (f64, f64),
}

/// The conditions that two controllers both flew.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pairing {
    /// Those with two values.
    pub(crate) pairs: Vec<Pair>,
    /// Worlds in which the first controller's mission failed, and the second's.
    pub(crate) failed: (usize, usize),
    /// Conditions in which neither failed, but a value is missing.
    pub(crate) missing: usize,
}

impl RunTable {
    /// The table of `rows`, in any order.
    pub(crate) fn of(rows: &Rows) -> Self {
        let rows = rows.sorted();
        let (mut groups, mut controllers): (Vec<Group>, Vec<String>) = (vec![], vec![]);
        let mut conditions: BTreeMap<(usize, u64), Vec<NumberedRow>> = BTreeMap::new();
        let replicates = rows.numbers("replicate").unwrap_or_default();
        for i in 0..rows.len() {
            let group = Group {
                scenario: word(&rows, "scenario", i).to_owned(),
                craft: word(&rows, "craft", i).to_owned(),
            };
            let group = place(&mut groups, group);
            let controller = place(&mut controllers, word(&rows, "controller", i).to_owned());
            let replicate = replicates.get(i).copied().flatten().unwrap_or_default();
            conditions
                .entry((group, whole(replicate)))
                .or_default()
                .push((i, controller));
        }
        let repeated: Vec<usize> = (0..groups.len())
            .filter(|&group| is_repeated(&rows, &conditions, group))
            .collect();
        for &group in &repeated {
            let first = conditions.range((group, 0)..).next().map(|(&key, _)| key);
            conditions.retain(|&key, _| key.0 != group || Some(key) == first);
        }
        Self {
            rows,
            groups,
            controllers,
            conditions,
            repeated,
        }
    }

    /// The pairs of controllers `a` and `b` in `metric`, in one scenario or in all, in the order of groups and replicates.
    pub(crate) fn pairing(&self, both: [&str; 2], metric: &str, scenario: Option<&str>) -> Pairing {
        self.pairing_at(objective(metric), both, metric, scenario)
    }

    /// The same, with laws at the gains that were found for `objective`.
    pub(crate) fn pairing_at(
        &self,
        objective: &str,
        [a, b]: [&str; 2],
        metric: &str,
        scenario: Option<&str>,
    ) -> Pairing {
        let mut pairing = Pairing::default();
        let (Some(a), Some(b)) = (self.judged(a, objective), self.judged(b, objective)) else {
            return pairing;
        };
        for (&(group, replicate), rows) in &self.conditions {
            if scenario.is_some_and(|scenario| self.groups[group].scenario != scenario) {
                continue;
            }
            let (Some(i), Some(k)) = (a(rows), b(rows)) else {
                continue;
            };
            let failed = (self.failed(i), self.failed(k));
            pairing.failed.0 += usize::from(failed.0);
            pairing.failed.1 += usize::from(failed.1);
            if failed.0 || failed.1 {
                continue;
            }
            match (self.value(metric, i), self.value(metric, k)) {
                (Some(a), Some(b)) => pairing.pairs.push(Pair {
                    group,
                    replicate,
                    rows: (i, k),
                    values: (a, b),
                }),
                _ => pairing.missing += 1,
            }
        }
        pairing
    }

    /// The rows that count for a controller in `metric`, one for each condition, with their groups; failed ones too.
    pub(crate) fn of_controller(&self, controller: &str, metric: &str) -> Vec<(usize, usize)> {
        let Some(judged) = self.judged(controller, objective(metric)) else {
            return vec![];
        };
        let conditions = self.conditions.iter();
        conditions
            .filter_map(|(&(group, _), rows)| Some((group, judged(rows)?)))
            .collect()
    }

    /// A function that finds, among the rows of a condition, the one that counts for a controller: for a law with several gains the row
    /// at the gains tuned for `objective`, else the first. None for a controller that never flew.
    fn judged(&self, controller: &str, objective: &str) -> Option<impl Fn(&[NumberedRow]) -> Option<usize>> {
        let controller = self.controllers.iter().position(|name| name == controller)?;
        let objectives = self.rows.words("objectives").unwrap_or_default();
        let is_own = move |i: &usize| {
            objectives
                .get(*i)
                .is_some_and(|names| names.split(' ').any(|name| name == objective))
        };
        Some(move |rows: &[NumberedRow]| {
            let of_it = || rows.iter().filter(|row| row.1 == controller).map(|row| row.0);
            of_it().find(|i| is_own(i)).or_else(|| of_it().next())
        })
    }

    /// Observations of a controller in `metric` in one scenario: the replicates of one craft, or the means of several craft.
    pub(crate) fn observations(&self, controller: &str, metric: &str, scenario: &str) -> Vec<f64> {
        let mut crafts: Vec<(usize, Vec<f64>)> = vec![];
        for (group, row) in self.of_controller(controller, metric) {
            let Some(value) = self.value(metric, row) else {
                continue;
            };
            if self.groups[group].scenario != scenario {
                continue;
            }
            match crafts.iter_mut().find(|(known, _)| *known == group) {
                Some((_, values)) => values.push(value),
                None => crafts.push((group, vec![value])),
            }
        }
        match &crafts[..] {
            [(_, values)] => values.clone(),
            several => several.iter().map(|(_, values)| mean(values).centre).collect(),
        }
    }

    /// Whether the mission of a row failed.
    pub(crate) fn failed(&self, row: usize) -> bool {
        !word(&self.rows, "failure", row).is_empty()
    }

    /// The value of a row. If the craft never came near, its time to come near is the whole mission.
    pub(crate) fn value(&self, metric: &str, row: usize) -> Option<f64> {
        let cell = |name: &str| {
            self.rows
                .numbers(name)
                .and_then(|cells| cells.get(row).copied().flatten())
        };
        let value = cell(metric).or_else(|| cell("duration_s").filter(|_| metric == "time_to_3_m_s"));
        value.filter(|value| value.is_finite())
    }

    /// The text of a row; empty if there is no such column.
    pub(crate) fn word(&self, name: &str, row: usize) -> &str {
        word(&self.rows, name, row)
    }

    /// The run number of a row.
    pub(crate) fn run(&self, row: usize) -> u64 {
        whole(self.value("run", row).unwrap_or_default())
    }

    /// Names of the columns that hold parameters.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = &str> {
        self.rows.names().filter(|name| name.starts_with(PARAMETER))
    }
}

/// The objective whose gains count for a metric.
pub(crate) fn objective(metric: &str) -> &'static str {
    match metric {
        "energy_j" | "energy_violations" => "energy_j",
        "heading_travel_rad" | "heading_reference_travel_rad" | "steep_steps_percent" | "reference_jerk" => {
            "heading_travel_rad"
        }
        _ => "rms_m",
    }
}

/// Whether a group has several replicates, all the same.
fn is_repeated(rows: &Rows, conditions: &BTreeMap<(usize, u64), Vec<NumberedRow>>, group: usize) -> bool {
    let mut replicates = conditions
        .range((group, 0)..=(group, u64::MAX))
        .map(|(_, runs)| runs);
    let Some(first) = replicates.next() else {
        return false;
    };
    let is_same = |runs: &Vec<NumberedRow>| {
        let mut both = runs.iter().zip(first);
        runs.len() == first.len()
            && both.all(|(one, other)| one.1 == other.1 && rows.are_same(one.0, other.0))
    };
    let mut others = replicates.peekable();
    others.peek().is_some() && others.all(is_same)
}

/// The index of `item` in `all`; it is appended if missing.
fn place<T: PartialEq>(all: &mut Vec<T>, item: T) -> usize {
    all.iter().position(|known| *known == item).unwrap_or_else(|| {
        all.push(item);
        all.len() - 1
    })
}

fn word<'a>(rows: &'a Rows, name: &str, row: usize) -> &'a str {
    rows.words(name)
        .and_then(|words| words.get(row))
        .map_or("", |word| word.as_ref())
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "numbers of runs and replicates, from 0 to 2⁵³"
)]
fn whole(number: f64) -> u64 {
    number as u64
}
