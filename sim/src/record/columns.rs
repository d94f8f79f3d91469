//! The record as a table: one definition of every column for every format that is a table.

use std::borrow::Cow;

use super::{DiverRow, Record, Row, SurfaceCraftRow, method_name};

/// A column: its name, with the unit, and one value a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name; an underwater vehicle's columns stand behind its own name.
    pub name: String,
    /// Values, as many as there are rows.
    pub values: Values,
}

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers, in the unit that the name says; `None` where there was nothing to tell.
    Numbers(Vec<Option<f64>>),
    /// Words.
    Words(Vec<Cow<'static, str>>),
}

type Number<T> = (&'static str, fn(&T) -> Option<f64>);

const SURFACE_CRAFT: [Number<SurfaceCraftRow>; 26] = [
    ("asc_north_m", |row| Some(row.position.x)),
    ("asc_east_m", |row| Some(row.position.y)),
    ("asc_heading_rad", |row| Some(row.heading)),
    ("asc_surge_mps", |row| Some(row.surge)),
    ("asc_sway_mps", |row| Some(row.sway)),
    ("asc_yaw_rate_radps", |row| Some(row.yaw_rate)),
    ("asc_thrust_port_n", |row| Some(row.thrust_port)),
    ("asc_thrust_starboard_n", |row| Some(row.thrust_starboard)),
    ("asc_current_north_mps", |row| Some(row.current.x)),
    ("asc_current_east_mps", |row| Some(row.current.y)),
    ("goal_north_m", |row| Some(row.goal.x)),
    ("goal_east_m", |row| Some(row.goal.y)),
    ("goal_distance_m", |row| Some(row.distance())),
    ("energy_j", |row| Some(row.energy)),
    ("heading_travel_rad", |row| Some(row.heading_travel)),
    ("known_t_s", |row| Some(row.known.time)),
    ("known_asc_north_m", |row| Some(row.known.position.x)),
    ("known_asc_east_m", |row| Some(row.known.position.y)),
    ("known_asc_heading_rad", |row| Some(row.known.heading.radians())),
    ("known_asc_surge_mps", |row| Some(row.known.surge)),
    ("known_current_north_mps", |row| {
        row.known.current.map(|current| current.x)
    }),
    ("known_current_east_mps", |row| {
        row.known.current.map(|current| current.y)
    }),
    ("reference_speed_mps", |row| Some(row.reference.speed)),
    ("reference_heading_rad", |row| {
        Some(row.reference.heading.radians())
    }),
    ("predicted_rms_m", |row| row.predicted_rms),
    ("solve_ms", |row| row.solve_ms),
];

const DIVER: [Number<DiverRow>; 21] = [
    ("north_m", |row| Some(row.position.x)),
    ("east_m", |row| Some(row.position.y)),
    ("depth_m", |row| Some(row.depth)),
    ("pitch_rad", |row| Some(row.pitch)),
    ("heading_rad", |row| Some(row.heading)),
    ("surge_mps", |row| Some(row.surge)),
    ("current_north_mps", |row| Some(row.current.x)),
    ("current_east_mps", |row| Some(row.current.y)),
    ("reference_surge_mps", |row| Some(row.reference.surge)),
    ("reference_pitch_rad", |row| Some(row.reference.pitch)),
    ("reference_heading_rad", |row| Some(row.reference.heading)),
    ("path_north_m", |row| Some(row.path_point.x)),
    ("path_east_m", |row| Some(row.path_point.y)),
    ("along_track_m", |row| Some(row.along_track)),
    ("cross_track_m", |row| Some(row.cross_track)),
    ("known_north_m", |row| row.known.map(|known| known.position.x)),
    ("known_east_m", |row| row.known.map(|known| known.position.y)),
    ("known_depth_m", |row| row.known.map(|known| known.depth)),
    ("known_course_rad", |row| row.known.map(|known| known.course)),
    ("known_speed_mps", |row| row.known.map(|known| known.speed)),
    ("known_age_s", |row| row.known.map(|known| known.age)),
];

impl Record {
    /// Every column, in a fixed order: time, surface craft with knowledge, references and outcome, and the
    /// underwater vehicles one after the other. Without a surface craft, its columns are not there.
    #[must_use]
    pub fn columns(&self) -> Vec<Column> {
        let mut columns = vec![numbers("t_s".to_owned(), &self.rows, |row| Some(row.time))];
        if self.limits.is_some() {
            for (name, value) in SURFACE_CRAFT {
                columns.push(numbers(name.to_owned(), &self.rows, |row| {
                    row.surface_craft.as_ref().and_then(value)
                }));
            }
            columns.push(Column {
                name: "method".to_owned(),
                values: Values::Words(self.rows.iter().map(|row| Cow::Borrowed(method(row))).collect()),
            });
        }
        for (i, id) in self.diver_ids.iter().enumerate() {
            for (name, value) in DIVER {
                columns.push(numbers(diver_column(id, name), &self.rows, |row| {
                    row.divers.get(i).and_then(value)
                }));
            }
        }
        columns
    }
}

/// A column name that a record of a surface craft and vehicles of these names would have twice, if there is one.
#[must_use]
pub fn column_named_twice(diver_ids: &[&str]) -> Option<String> {
    let craft = SURFACE_CRAFT.iter().map(|(name, _)| (*name).to_owned());
    let divers = diver_ids
        .iter()
        .flat_map(|id| DIVER.map(|(name, _)| diver_column(id, name)));
    let others = ["t_s", "method"].map(str::to_owned);
    let mut names: Vec<String> = craft.chain(divers).chain(others).collect();
    names.sort();
    names
        .windows(2)
        .find(|pair| pair[0] == pair[1])
        .map(|pair| pair[0].clone())
}

fn diver_column(id: &str, name: &str) -> String {
    format!("{}_{name}", id.replace('-', "_"))
}

fn numbers(name: String, rows: &[Row], value: impl Fn(&Row) -> Option<f64>) -> Column {
    Column {
        name,
        values: Values::Numbers(rows.iter().map(value).collect()),
    }
}

fn method(row: &Row) -> &'static str {
    row.surface_craft
        .as_ref()
        .map_or("", |craft| method_name(craft.method))
}
