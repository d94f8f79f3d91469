//! Names of columns and rows against their numbers.

use std::collections::{HashMap, HashSet};

use super::*;

/// Prefixes of columns in the rows of each prefix; `k` is the row's stage, `j` the previous one.
const TOUCHES: [(&str, &[&str]); 13] = [
    (
        "dynamics[k]",
        &["deviation[k]", "deviation[j]", "velocity[k]", "velocity[j]"],
    ),
    ("acceleration[k]", &["velocity[k]", "velocity[j]"]),
    ("forward_speed[k]", &["velocity[k]", "slack[k].motion"]),
    (
        "turn_rate[k]",
        &["velocity[k]", "velocity[j]", "velocity[i]", "slack[k].motion"],
    ),
    ("slack_sign[k]", &["slack[k]"]),
    ("area[k]", &["deviation[k]", "slack[k].area"]),
    ("disc_at_end[k]", &["deviation[k]", "slack[k].keep_out"]),
    ("disc_at_start[k]", &["deviation[j]", "slack[k].keep_out"]),
    ("top_speed[k]", &["energy[k].speed"]),
    ("speed_cone[k]", &["velocity[k]", "energy[k].speed"]),
    (
        "range_cone[k].auv[0]",
        &["deviation[k]", "slack[k].acoustic_range"],
    ),
    ("range_cone[k].auv[1]", &["deviation[k]", "slack[k].other_range"]),
    ("minimax_cone[k]", &["deviation[k]", "minimax[k]"]),
];

#[test]
fn names_are_unique_and_rows_have_the_columns_of_their_names() {
    let (scene, plain) = (Scene::bounded(), Scene::new());
    for subproblem in [scene.subproblem(), plain.subproblem()] {
        let program = Program::new(&subproblem);
        let (columns, rows) = (program.layout.column_names(), program.layout.row_names());
        assert_eq!(
            (columns.len(), rows.len()),
            (program.linear.len(), program.bounds.len())
        );
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
            if row.starts_with("energy_cones") {
                let stage = &row["energy_cones".len()..=row.find(']').expect("a stage")];
                let own = format!("energy{stage}.");
                assert!(
                    touched.iter().all(|column| column.starts_with(&own)),
                    "{row}: {touched:?}"
                );
                continue;
            }
            let stage: usize = row[row.find('[').expect("a stage") + 1..row.find(']').expect("a stage")]
                .parse()
                .expect("a number");
            let at = |name: &str| {
                name.replace("[k]", &format!("[{stage}]"))
                    .replace("[j]", &format!("[{}]", stage - 1))
                    .replace("[i]", &format!("[{}]", stage.saturating_sub(2)))
            };
            let (_, allowed) = TOUCHES
                .iter()
                .find(|(name, _)| row.starts_with(&at(name)))
                .unwrap_or_else(|| panic!("{row} is in the table"));
            for column in touched {
                assert!(
                    allowed.iter().any(|name| column.starts_with(&at(name))),
                    "{row} touches {column}"
                );
            }
            // A row of one axis has no column of the other.
            for (axis, other) in [(".ahead", ".starboard"), (".starboard", ".ahead")] {
                let is_of_an_axis = row.ends_with(axis) && !row.starts_with("turn_rate");
                assert!(
                    !is_of_an_axis || touched.iter().all(|column| !column.ends_with(other)),
                    "{row}: {touched:?}"
                );
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
    let ahead = (subproblem.directions[1] + subproblem.directions[2])
        .normalize()
        .dot(&acceleration);
    let half = f64::midpoint(
        subproblem.limits.acceleration_max,
        subproblem.limits.deceleration_max,
    );
    let sum = slack("acceleration[2].most") + slack("acceleration[2].least");
    assert!((sum - 2.0 * half).abs() < 1e-12);
    let middle = f64::midpoint(
        subproblem.limits.acceleration_max,
        -subproblem.limits.deceleration_max,
    ) + subproblem.surge_disturbance[1];
    let off = f64::midpoint(slack("acceleration[2].least"), -slack("acceleration[2].most"));
    assert!((off - (ahead - middle)).abs() < 1e-12);
}
