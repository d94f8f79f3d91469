//! Names of columns and rows against their numbers.

use std::collections::{HashMap, HashSet};

use super::*;

/// Prefixes of columns in the rows of each prefix; `k` is the row's stage, `j` the previous one.
const TOUCHES: [(&str, &str); 14] = [
    ("dynamics[k]", "deviation[k] deviation[j] velocity[k] velocity[j]"),
    ("acceleration[k]", "velocity[k] velocity[j]"),
    ("forward_speed[k]", "velocity[k] slack[k].motion"),
    ("turn_rate[k]", "velocity[k] velocity[j] velocity[i] slack[k].motion"),
    ("slack_sign[k]", "slack[k]"),
    ("area[k]", "deviation[k] slack[k].area"),
    ("disc_at_end[k]", "deviation[k] slack[k].keep_out"),
    ("disc_at_start[k]", "deviation[j] slack[k].keep_out"),
    ("top_speed[k]", "energy[k].speed"),
    ("speed_cone[k]", "velocity[k] energy[k].speed"),
    ("range_cone[k].auv[0]", "deviation[k] slack[k].acoustic_range"),
    ("range_cone[k].auv[1]", "deviation[k] slack[k].other_range"),
    ("minimax_cone[k]", "deviation[k] minimax[k]"),
    ("energy_cones[k]", "energy[k]."),
];

#[test]
fn names_are_unique_and_rows_have_the_columns_of_their_names() {
    let (scene, plain) = (Scene::bounded(), Scene::new());
    for subproblem in [scene.subproblem(), plain.subproblem()] {
        let program = Program::new(&subproblem);
        let (columns, rows) = (program.layout.column_names(), program.layout.row_names());
        assert_eq!(columns.len(), program.linear.len());
        assert_eq!(rows.len(), program.bounds.len());
        for names in [&columns, &rows] {
            assert!(names.iter().all(|name| !name.is_empty()), "{names:?}");
            assert_eq!(names.iter().collect::<HashSet<_>>().len(), names.len());
        }
        let mut touched: HashMap<&str, Vec<&str>> = HashMap::new();
        for (row, column, _) in entries(&program.constraints) {
            touched.entry(&rows[row]).or_default().push(&columns[column]);
        }
        for row in &rows {
            let Some(touched) = touched.get(row.as_str()) else {
                // Rows without variables: depths, and the largest speed without a price of energy.
                let is_a_speed = row.starts_with("speed_cone") && row.ends_with("].bound");
                assert!(row.ends_with("].depth") || is_a_speed, "{row} touches nothing");
                continue;
            };
            let (_, rest) = row.split_once('[').expect("a stage");
            let stage: usize = rest[..rest.find(']').expect("a stage")].parse().expect("a number");
            let at = |name: &str| {
                let stages = [('k', stage), ('j', stage - 1), ('i', stage.saturating_sub(2))];
                let named = |text: String, (letter, stage): (char, usize)| {
                    text.replace(&format!("[{letter}]"), &format!("[{stage}]"))
                };
                stages.into_iter().fold(name.to_owned(), named)
            };
            let allowed = TOUCHES.iter().find(|(name, _)| row.starts_with(&at(name)));
            let (_, allowed) = allowed.unwrap_or_else(|| panic!("{row} is in the table"));
            let allowed: Vec<String> = allowed.split(' ').map(at).collect();
            for column in touched {
                let is_allowed = allowed.iter().any(|name| column.starts_with(name));
                assert!(is_allowed, "{row} touches {column}");
                // A row of one axis has no column of the other.
                for (axis, other) in [(".ahead", ".starboard"), (".starboard", ".ahead")] {
                    let is_of_an_axis = row.ends_with(axis) && !row.starts_with("turn_rate");
                    assert!(!is_of_an_axis || !column.ends_with(other), "{row} touches {column}");
                }
            }
        }
    }
}

#[test]
fn rows_of_an_interval_are_in_the_order_of_their_names() {
    let scene = Scene::bounded();
    let subproblem = scene.subproblem();
    let program = Program::new(&subproblem);
    let rows = program.layout.row_names();
    let (x, _, v) = variables(&subproblem, 1.3);
    let s = row_slacks(&program, &x);
    let slack = |name: &str| s[rows.iter().position(|row| row == name).expect(name)];
    // The two limits of a number sum to their interval; the smaller is approached.
    let acceleration = (v[2] - v[1]) / subproblem.steps[1];
    let mean = (subproblem.directions[1] + subproblem.directions[2]).normalize();
    let (most, least) = (subproblem.limits.acceleration_max, subproblem.limits.deceleration_max);
    let [above, below] = ["most", "least"].map(|limit| slack(&format!("acceleration[2].{limit}")));
    near(above + below, most + least, 1e-12);
    let middle = f64::midpoint(most, -least) + subproblem.surge_disturbance[1];
    let expected = mean.dot(&acceleration) - middle;
    near(f64::midpoint(below, -above), expected, 1e-12);
}
