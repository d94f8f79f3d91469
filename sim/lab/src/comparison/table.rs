//! A comparison for people: blocks of columns, and what each controller knew and was tuned to.

use std::fmt;

use super::{Comparison, Controller, Gains};

/// Controllers beside each other: two blocks of the six that there are.
const COLUMNS: usize = 3;

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, seed {}", self.scenario, self.seed)?;
        let named: Vec<_> = self.controllers.named().collect();
        for block in named.chunks(COLUMNS) {
            write_block(f, block)?;
        }
        writeln!(
            f,
            "mpc forecasts with {}; every other controller sees the goal's present motion, tuned over its grid.",
            self.controllers.mpc.information.forecasts.join(" and ")
        )?;
        for (name, controller) in &named {
            if let Some(gains) = &controller.gains {
                let remark = if controller.never_a_winner {
                    "; the law as printed, which runs away: never a winner"
                } else {
                    ""
                };
                writeln!(f, "{name}: {gains}{remark}.")?;
            }
        }
        for note in &self.notes {
            writeln!(f, "Note: {note}")?;
        }
        writeln!(f, "Least rms_m: {}.", self.controllers.nearest())
    }
}

fn write_block(f: &mut fmt::Formatter<'_>, block: &[(&str, &Controller)]) -> fmt::Result {
    let write_row = |f: &mut fmt::Formatter<'_>, name: &str, values: &[&str]| {
        write!(f, "{name:<26}")?;
        for value in values {
            write!(f, "{value:>28}")?;
        }
        writeln!(f)
    };
    let names: Vec<&str> = block.iter().map(|(name, _)| *name).collect();
    write_row(f, "", &names)?;
    let columns: Vec<_> = block
        .iter()
        .map(|(_, controller)| controller.scores.lines())
        .collect();
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
    let known: Vec<&str> = block.iter().map(|(_, controller)| known(controller)).collect();
    write_row(f, "current known", &known)?;
    writeln!(f)
}

impl fmt::Display for Gains {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            look_ahead_m,
            along_track_gain_per_s,
            integral_gain_mps,
        } = self;
        write!(
            f,
            "look-ahead {look_ahead_m} m, along-track gain {along_track_gain_per_s} 1/s"
        )?;
        match integral_gain_mps {
            Some(integral_gain) => write!(f, ", integral gain {integral_gain} m/s"),
            None => Ok(()),
        }
    }
}
