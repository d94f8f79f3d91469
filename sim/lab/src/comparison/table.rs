//! A comparison for people: blocks of columns, and what each controller knew and was tuned to.

use std::fmt::{self, Write as _};

use super::{Comparison, Controller, PLANNER};

/// Controllers beside each other, and widths of the columns: 100 characters in all.
const COLUMNS: usize = 3;
const HEAD_WIDTH: usize = 34;
const WIDTH: usize = 22;
/// From this share of the squared distances on, the approach dominates whole-mission metrics.
const APPROACH_SHARE: f64 = 0.5;

/// Headings of scores, by their names elsewhere, in the table's order. Others follow by name.
const HEADS: [(&str, &str); 26] = [
    ("visits.mean_cost", "mean cost of the AUVs"),
    ("visits.max_cost", "largest cost of an AUV"),
    ("visits.visits", "visits"),
    ("visits.changes", "changes of the next visit"),
    ("visits.deadlines_missed", "missed deadlines"),
    ("rms_m", "distance, RMS, whole mission, m"),
    ("settled_rms_m", "distance, RMS, once settled, m"),
    ("mean_m", "distance, mean, m"),
    ("p95_m", "distance, 95 % of the time, m"),
    ("max_m", "distance, largest, m"),
    ("regret_m", "RMS beyond the bound, m"),
    ("energy_j", "propulsion energy, J"),
    ("heading_travel_rad", "heading travel, rad"),
    ("reference_jerk", "jerk of the references, m/s³"),
    ("solve_ms_p50", "solve time, median, ms"),
    ("solve_ms_p99", "solve time, 99 %, ms"),
    ("answers.mpc", "answers: program"),
    ("answers.previous_plan", "answers: previous plan"),
    ("answers.saturated_los", "answers: line of sight"),
    ("answers.hold", "answers: hold"),
    ("violations.turn_rate_radps", "above the turn rate, rad/s"),
    ("violations.speed_mps", "above the speed, m/s"),
    ("violations.keep_out_m", "inside keep-outs, m"),
    ("violations.area_m", "outside the area, m"),
    ("violations.range_m", "out of acoustic range, m"),
    ("violations.energy_j", "beyond the energy budget, J"),
];

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, seed {}", self.scenario, self.seed)?;
        for block in self.controllers.chunks(COLUMNS) {
            write_block(f, block)?;
        }
        let others = if self.visits() {
            "the rules are followed by the planner or by line of sight,\nat the best times of their grids"
        } else {
            "the laws use the present motion of\nthe goal, at the best gains of their grids"
        };
        let forecasts = self.controllers[0].information.forecasts.join(" and ");
        writeln!(f, "{PLANNER} forecasts with {forecasts}; {others}.")?;
        writeln!(f, "Limits: how often, for how long, and the worst.")?;
        for controller in &self.controllers {
            if let Some(gains) = &controller.gains {
                writeln!(f, "{}: {gains}.", controller.name)?;
            }
            if let Some(dwell) = controller.dwell_s {
                writeln!(f, "{}: {dwell} s.", controller.name)?;
            }
        }
        self.write_least(f)
    }
}

impl Comparison {
    /// Names the controller with the least compared value, and says if the approach decided that.
    fn write_least(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.visits() {
            return writeln!(f, "Least mean cost of the AUVs: {}.", self.best().name);
        }
        let settled = |controller: &Controller| controller.scores.metrics.settled_rms_m;
        let near = &self.least(settled).name;
        let after = self.controllers[0].record.settled_after;
        writeln!(f, "Nearest once settled, after {after} s: {near}.")?;
        writeln!(f, "Nearest over the whole mission: {}.", self.best().name)?;
        let shares = self.controllers.iter().map(approach_share);
        let least = shares.fold(f64::INFINITY, f64::min);
        if least < APPROACH_SHARE {
            return Ok(());
        }
        let percent = 100.0 * least;
        writeln!(
            f,
            "The approach makes at least {percent:.0} % of each sum of squares over the whole mission."
        )
    }
}

/// The share of the approach in the mission's sum of squared distances.
fn approach_share(controller: &Controller) -> f64 {
    let (rows, metrics) = (&controller.record.rows, &controller.scores.metrics);
    let settled = rows
        .iter()
        .filter(|row| controller.record.settled_after <= row.time);
    #[expect(clippy::cast_precision_loss, reason = "thousands")]
    let settled = settled.count() as f64 / rows.len() as f64;
    1.0 - settled * (metrics.settled_rms_m / metrics.rms_m).powi(2)
}

fn write_block(f: &mut fmt::Formatter<'_>, block: &[Controller]) -> fmt::Result {
    let names: Vec<_> = block.iter().map(|controller| halves(&controller.name)).collect();
    write_row(f, "", names.iter().map(|(first, _)| *first))?;
    if names.iter().any(|(_, second)| !second.is_empty()) {
        write_row(f, "", names.iter().map(|(_, second)| *second))?;
    }
    let columns: Vec<_> = block.iter().map(|controller| controller.scores.lines()).collect();
    for (name, head) in rows_of(&columns[0]) {
        let value = |lines: &Vec<(String, String)>| {
            let line = lines.iter().find(|(other, _)| *other == name);
            line.map_or_else(String::new, |(_, value)| value.clone())
        };
        write_row(f, &head, columns.iter().map(value))?;
    }
    let known = |controller: &Controller| {
        if controller.information.current_known {
            "yes"
        } else {
            "no"
        }
    };
    write_row(f, "current known", block.iter().map(known))?;
    writeln!(f)
}

fn write_row<S: AsRef<str>>(
    f: &mut fmt::Formatter<'_>,
    head: &str,
    values: impl Iterator<Item = S>,
) -> fmt::Result {
    let mut line = format!("{head:<HEAD_WIDTH$}");
    for value in values {
        write!(line, "{:>WIDTH$}", value.as_ref())?;
    }
    writeln!(f, "{}", line.trim_end())
}

/// Names of the scores in the order of the table, and what they are called there.
fn rows_of(lines: &[(String, String)]) -> Vec<(String, String)> {
    let has = |name: &str| lines.iter().any(|(other, _)| other == name);
    let known = HEADS.iter().filter(|(name, _)| has(name));
    let known = known.map(|(name, head)| ((*name).to_owned(), (*head).to_owned()));
    let others = lines.iter().map(|(name, _)| name);
    let others = others.filter(|name| HEADS.iter().all(|(known, _)| known != name));
    let others = others.map(|name| {
        let head = match name.strip_prefix("time_in_range_s.") {
            Some(auv) => format!("in contact range of {auv}, s"),
            None => name.clone(),
        };
        (name.clone(), head)
    });
    known.chain(others).collect()
}

/// A name as two lines, if it is too long for one.
fn halves(name: &str) -> (&str, &str) {
    match name.get(..WIDTH - 1).and_then(|begin| begin.rfind('_')) {
        Some(at) if WIDTH <= name.len() => name.split_at(at + 1),
        _ => (name, ""),
    }
}
