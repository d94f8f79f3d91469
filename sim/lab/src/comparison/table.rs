//! A comparison for people: blocks of columns, and what each controller knew and was tuned to.

use std::fmt::{self, Write as _};

use planner::FixedFigure;

use super::{ComparedController, Comparison, PLANNER};
use crate::scores::{IN_RANGE, LINES};

/// Controllers beside each other, and widths of the columns: 100 characters in all.
const COLUMNS: usize = 3;
const HEAD_WIDTH: usize = 34;
const WIDTH: usize = 22;
/// From this share of the squared distances on, the approach dominates whole-mission metrics.
const APPROACH_SHARE: f64 = 0.5;

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, seed {}", self.scenario, self.seed)?;
        for block in self.controllers.chunks(COLUMNS) {
            write_block(f, block)?;
        }
        let others = if self.controllers[0].scores.fleet.is_some() {
            "the rules assign AUVs to craft,\nwhich the planner plans for"
        } else if self.localises() {
            "the figures are sailed by the planner,\nat the best sizes and speeds of their grids"
        } else if self.visits() {
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
            if let Some(FixedFigure { radius_m, speed_share, .. }) = controller.figure {
                writeln!(f, "{}: {radius_m} m at {speed_share} of the speed.", controller.name)?;
            }
        }
        self.write_least(f)
    }
}

impl Comparison {
    /// Names the controller with the least compared value, and says if the approach decided that.
    fn write_least(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.localises() {
            return writeln!(f, "Least error of the AUVs' own navigation: {}.", self.best().name);
        }
        if self.visits() {
            return writeln!(f, "Least mean cost of the AUVs: {}.", self.best().name);
        }
        let settled = |controller: &ComparedController| controller.scores.metrics.settled_rms_m;
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
fn approach_share(controller: &ComparedController) -> f64 {
    let (rows, metrics) = (&controller.record.rows, &controller.scores.metrics);
    let settled = controller.record.settled_rows().count() as f64 / rows.len() as f64;
    1.0 - settled * (metrics.settled_rms_m / metrics.rms_m).powi(2)
}

fn write_block(f: &mut fmt::Formatter<'_>, block: &[ComparedController]) -> fmt::Result {
    let names: Vec<_> = block.iter().map(|controller| halves(&controller.name)).collect();
    write_row(f, "", names.iter().map(|(first, _)| *first))?;
    if names.iter().any(|(_, second)| !second.is_empty()) {
        write_row(f, "", names.iter().map(|(_, second)| *second))?;
    }
    let columns: Vec<_> = block.iter().map(|controller| controller.scores.lines()).collect();
    for (name, head) in rows_of(&columns[0]) {
        let value = |lines: &Vec<(String, String)>| {
            let line = lines.iter().find(|(other, _)| other == name);
            line.map_or_else(String::new, |(_, value)| value.clone())
        };
        write_row(f, &head, columns.iter().map(value))?;
    }
    let known = |controller: &ComparedController| {
        if controller.information.current_known { "yes" } else { "no" }
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
fn rows_of(lines: &[(String, String)]) -> Vec<(&str, String)> {
    let mut names: Vec<&str> = lines.iter().map(|(name, _)| name.as_str()).collect();
    let at = |wanted| names.iter().position(|name| *name == wanted);
    // The RMS once settled stands below that of the whole mission.
    if let Some((whole, settled)) = at("rms_m").zip(at("settled_rms_m")) {
        names[whole + 1..=settled].rotate_right(1);
    }
    let head = |name: &str| {
        let line = LINES.iter().find(|(known, ..)| *known == name);
        let in_range = |auv| format!("in contact range of {auv}, s");
        let other = || name.strip_prefix(IN_RANGE).map_or(name.to_owned(), in_range);
        line.map_or_else(other, |line| line.1.to_owned())
    };
    names.into_iter().map(|name| (name, head(name))).collect()
}

/// A name as two lines, if it is too long for one.
fn halves(name: &str) -> (&str, &str) {
    match name.get(..WIDTH - 1).and_then(|begin| begin.rfind('_')) {
        Some(at) if WIDTH <= name.len() => name.split_at(at + 1),
        _ => (name, ""),
    }
}
