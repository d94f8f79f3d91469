//! A comparison for people: blocks of columns, and what each controller knew and was tuned to.

use std::fmt;

use super::{Comparison, Controller, PLANNER};

/// Controllers beside each other.
const COLUMNS: usize = 3;

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, seed {}", self.scenario, self.seed)?;
        for block in self.controllers.chunks(COLUMNS) {
            write_block(f, block)?;
        }
        let (compared, best) = self.best();
        let others = if best.scores.metrics.visits.is_some() {
            "the rules are followed by the planner or by line of sight, at the best times of their grids"
        } else {
            "the laws use the present motion of the goal, at the best gains of their grids"
        };
        let forecasts = self.controllers[0].information.forecasts.join(" and ");
        writeln!(f, "{PLANNER} forecasts with {forecasts}; {others}.")?;
        for controller in &self.controllers {
            if let Some(gains) = &controller.gains {
                writeln!(f, "{}: {gains}.", controller.name)?;
            }
            if let Some(dwell) = controller.dwell_s {
                writeln!(f, "{}: {dwell} s.", controller.name)?;
            }
        }
        writeln!(f, "Least {compared}: {}.", best.name)
    }
}

fn write_block(f: &mut fmt::Formatter<'_>, block: &[Controller]) -> fmt::Result {
    let write_row = |f: &mut fmt::Formatter<'_>, name: &str, values: &[&str]| {
        write!(f, "{name:<26}")?;
        for value in values {
            write!(f, "{value:>28}")?;
        }
        writeln!(f)
    };
    let names: Vec<&str> = block.iter().map(|controller| controller.name).collect();
    write_row(f, "", &names)?;
    let columns: Vec<_> = block.iter().map(|controller| controller.scores.lines()).collect();
    for (i, (name, _)) in columns.first().into_iter().flatten().enumerate() {
        let values: Vec<&str> = columns.iter().map(|lines| lines[i].1.as_str()).collect();
        write_row(f, name, &values)?;
    }
    let known = |controller: &Controller| {
        if controller.information.current_known {
            "yes"
        } else {
            "no"
        }
    };
    let known: Vec<&str> = block.iter().map(known).collect();
    write_row(f, "current known", &known)?;
    writeln!(f)
}
