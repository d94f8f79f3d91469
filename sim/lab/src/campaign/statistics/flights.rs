//! The rows by world, and the pairs of two controllers.

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

/// All rows, by world.
#[derive(Clone, Debug)]
pub(crate) struct Flights {
    /// In the order of the runs.
    pub(crate) rows: Rows,
    /// In the order of their first runs.
    pub(crate) groups: Vec<Group>,
    /// Names of the controllers, in the order of their first runs.
    controllers: Vec<String>,
    /// Rows of a group and replicate, each with its controller's number, in the order of the runs.
    worlds: BTreeMap<(usize, u64), Vec<Flown>>,
}

/// A row, and its controller's number.
type Flown = (usize, usize);

/// One world that both flew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    /// Number of its group.
    pub(crate) group: usize,
    /// Which replicate of it.
    pub(crate) replicate: u64,
    /// Places of both rows.
    pub(crate) rows: (usize, usize),
    /// Both values.
    pub(crate) values: (f64, f64),
}

/// The worlds that two controllers both flew.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pairing {
    /// Those with two values.
    pub(crate) pairs: Vec<Pair>,
    /// Worlds in which the first controller's mission failed, and the second's.
    pub(crate) failed: (usize, usize),
    /// Worlds in which neither failed, and a value is missing all the same.
    pub(crate) missing: usize,
}

impl Flights {
    /// Of `rows`, in any order.
    pub(crate) fn of(rows: &Rows) -> Self {
        let rows = rows.sorted();
        let (mut groups, mut controllers): (Vec<Group>, Vec<String>) = (vec![], vec![]);
        let mut worlds: BTreeMap<(usize, u64), Vec<Flown>> = BTreeMap::new();
        let replicates = rows.numbers("replicate").unwrap_or_default();
        for i in 0..rows.len() {
            let group = Group {
                scenario: word(&rows, "scenario", i).to_owned(),
                craft: word(&rows, "craft", i).to_owned(),
            };
            let group = place(&mut groups, group);
            let controller = place(&mut controllers, word(&rows, "controller", i).to_owned());
            let replicate = replicates.get(i).copied().flatten().unwrap_or_default();
            worlds
                .entry((group, whole(replicate)))
                .or_default()
                .push((i, controller));
        }
        Self {
            rows,
            groups,
            controllers,
            worlds,
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
        for (&(group, replicate), rows) in &self.worlds {
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

    /// Rows by which a controller is judged in `metric`, one a world, with their groups; failed ones too.
    pub(crate) fn of_controller(&self, controller: &str, metric: &str) -> Vec<(usize, usize)> {
        let Some(judged) = self.judged(controller, objective(metric)) else {
            return vec![];
        };
        let worlds = self.worlds.iter();
        worlds
            .filter_map(|(&(group, _), rows)| Some((group, judged(rows)?)))
            .collect()
    }

    /// Finds, of a world's rows, the one by which a controller is judged: of a law that flew at several gains the one at gains that
    /// were found for `objective`, else the first. None of a controller that never flew.
    fn judged(&self, controller: &str, objective: &str) -> Option<impl Fn(&[Flown]) -> Option<usize>> {
        let controller = self.controllers.iter().position(|name| name == controller)?;
        let objectives = self.rows.words("objectives").unwrap_or_default();
        let is_own = move |i: &usize| {
            objectives
                .get(*i)
                .is_some_and(|names| names.split(' ').any(|name| name == objective))
        };
        Some(move |rows: &[Flown]| {
            let of_it = || rows.iter().filter(|row| row.1 == controller).map(|row| row.0);
            of_it().find(|i| is_own(i)).or_else(|| of_it().next())
        })
    }

    /// Values by which a controller is judged in `metric` in one scenario: of one craft those of the replicates, of several the means
    /// of each craft's.
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

    /// The value of a row. A craft that never came near was not near for the whole mission, as on the bench.
    pub(crate) fn value(&self, metric: &str, row: usize) -> Option<f64> {
        let cell = |name: &str| {
            self.rows
                .numbers(name)
                .and_then(|cells| cells.get(row).copied().flatten())
        };
        let value = cell(metric).or_else(|| cell("duration_s").filter(|_| metric == "time_to_3_m_s"));
        value.filter(|value| value.is_finite())
    }

    /// A row's words; empty where there is no such column.
    pub(crate) fn word(&self, name: &str, row: usize) -> &str {
        word(&self.rows, name, row)
    }

    /// A row's number as a run.
    pub(crate) fn run(&self, row: usize) -> u64 {
        whole(self.value("run", row).unwrap_or_default())
    }

    /// Names of the columns that hold parameters.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = &str> {
        self.rows.names().filter(|name| name.starts_with(PARAMETER))
    }
}

/// The objective whose gains count in a metric: that of its family.
pub(crate) fn objective(metric: &str) -> &'static str {
    match metric {
        "energy_j" | "energy_violations" => "energy_j",
        "heading_travel_rad" | "heading_reference_travel_rad" | "steep_steps_percent" | "reference_jerk" => {
            "heading_travel_rad"
        }
        _ => "rms_m",
    }
}

/// Where `item` is in `all`; it is put there if it is not.
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
