//! Names of a program's columns and rows, for readers of its bare numbers: the [`Layout`] function,
//! the stage, and the index. Stages count from 1; edges, discs and AUVs from 0.

use std::fmt;

use serde::Serialize as _;

use crate::program::layout::{Layout, Slack};

const AXES: [&str; 2] = ["ahead", "starboard"];
const CONE: [&str; 3] = ["bound", "ahead", "starboard"];
const CONE_WITH_DEPTH: [&str; 4] = ["bound", "ahead", "starboard", "depth"];

/// Its name in JSON.
impl fmt::Display for Slack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Names by index.
struct Names(Vec<String>);

impl Names {
    fn put(&mut self, place: usize, name: String) {
        debug_assert!(self.0[place].is_empty(), "{name} and {} share a place", self.0[place]);
        self.0[place] = name;
    }

    /// Names consecutive indices from `first`: `block` with each of `parts`.
    fn put_each(&mut self, first: usize, block: &str, parts: &[&str]) {
        for (i, part) in parts.iter().enumerate() {
            self.put(first + i, format!("{block}.{part}"));
        }
    }
}

impl Layout {
    /// The names of the columns, in order: `deviation[1].ahead`, `slack[1].motion`.
    pub fn column_names(&self) -> Vec<String> {
        let mut names = Names(vec![String::new(); self.n_variables()]);
        for k in 1..=self.n_stages {
            names.put_each(self.deviation(k), &format!("deviation[{k}]"), &AXES);
            names.put_each(self.velocity(k), &format!("velocity[{k}]"), &AXES);
            for slack in self.slacks() {
                names.put(self.slack(k, slack), format!("slack[{k}].{slack}"));
            }
            if self.n_minimax > 0 {
                names.put(self.minimax(k), format!("minimax[{k}]"));
            }
            if self.energy {
                let of = ["speed", "square", "cube"];
                names.put_each(self.energy(k), &format!("energy[{k}]"), &of);
            }
        }
        names.0
    }

    /// The names of the rows, in order: `dynamics[1].ahead`, `area[1].edge[0]`.
    pub fn row_names(&self) -> Vec<String> {
        let mut names = Names(vec![String::new(); self.n_rows()]);
        for k in 1..=self.n_stages {
            self.name_motion(k, &mut names);
            for edge in 0..self.n_edges {
                names.put(self.area(k, edge), format!("area[{k}].edge[{edge}]"));
            }
            for disc in 0..self.n_discs {
                names.put(self.disc_at_end(k, disc), format!("disc_at_end[{k}].disc[{disc}]"));
                if k > 1 {
                    names.put(self.disc_at_start(k, disc), format!("disc_at_start[{k}].disc[{disc}]"));
                }
            }
            for auv in 0..self.n_ranges {
                let block = format!("range_cone[{k}].auv[{auv}]");
                names.put_each(self.range_cone(k, auv), &block, &CONE);
            }
            for auv in 0..self.n_minimax {
                let block = format!("minimax_cone[{k}].auv[{auv}]");
                names.put_each(self.minimax_cone(k, auv), &block, &CONE_WITH_DEPTH);
            }
        }
        names.0
    }

    fn name_motion(&self, k: usize, names: &mut Names) {
        names.put_each(self.dynamics(k), &format!("dynamics[{k}]"), &AXES);
        names.put_each(self.acceleration(k), &format!("acceleration[{k}]"), &["most", "least"]);
        names.put(self.forward_speed(k), format!("forward_speed[{k}]"));
        names.put_each(self.turn_rate(k), &format!("turn_rate[{k}]"), &["starboard", "port"]);
        for slack in self.slacks() {
            names.put(self.slack_sign(k, slack), format!("slack_sign[{k}].{slack}"));
        }
        names.put_each(self.speed_cone(k), &format!("speed_cone[{k}]"), &CONE);
        if self.energy {
            names.put(self.top_speed(k), format!("top_speed[{k}]"));
            let rows = self.energy_cones(k);
            let of = |power: &str| format!("energy_cones[{k}].{power}");
            names.put_each(rows, &of("square"), &["sum", "root", "difference"]);
            names.put_each(rows + 3, &of("cube"), &["sum", "root", "difference"]);
        }
    }
}
