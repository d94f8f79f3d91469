//! The table: one row for each observation, one definition of every column for all formats.

use serde::ser::{Serialize, SerializeMap as _, Serializer};

/// A column of the table.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Name, with the unit.
    pub name: &'static str,
    /// Kind of its cells.
    pub kind: Kind,
    /// Unit; empty if there is none.
    pub unit: &'static str,
    /// Its meaning, a sentence without a full stop.
    pub meaning: &'static str,
    /// Its cell of a row.
    pub cell: for<'a> fn(&Row<'a>) -> Cell<'a>,
}

/// Kind of a column's cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers.
    Count,
    /// Numbers, in SI and radians.
    Number,
    /// Words, or sentences.
    Word,
}

/// A cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// Unknown.
    Nothing,
    /// A whole number.
    Count(u64),
    /// A number.
    Number(f64),
    /// A word, or a sentence.
    Word(&'a str),
}

type Count<'a> = u64;
type Number<'a> = f64;
type Word<'a> = &'a str;

/// The row and the columns, each defined once.
macro_rules! columns {
    ($($name:ident: $kind:ident, $unit:literal, $meaning:literal;)*) => {
        /// An observation, a plan or a command. Unknown values are `None`.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Row<'a> {
            $(#[doc = concat!($meaning, ".")] pub $name: Option<$kind<'a>>,)*
        }

        /// The columns, in the order in which files have them.
        pub const COLUMNS: &[Column] = &[$(Column {
            name: stringify!($name),
            kind: Kind::$kind,
            unit: $unit,
            meaning: $meaning,
            cell: |row| row.$name.map_or(Cell::Nothing, Cell::$kind),
        }),*];
    };
}

columns! {
    sequence: Count, "", "Number of the mission's event, if it has events";
    kind: Word, "", "One of the kinds above";
    t_s: Number, "s", "Time of what the row describes: since the start, or Unix time in a live mission";
    received_s: Number, "s", "Time of receipt: of a report by the surface craft, on the same clock; of an order by the service, Unix time";
    vehicle: Word, "", "`asc`, the surface craft, or the id of the AUV or vessel";
    length_m: Number, "m", "Length over all of a `vessel`, if known";
    north_m: Number, "m", "Position north of the datum";
    east_m: Number, "m", "Position east of the datum";
    lat_deg: Number, "°", "Latitude, WGS 84, positive north, if the datum's place on Earth is known";
    lon_deg: Number, "°", "Longitude, WGS 84, positive east";
    depth_m: Number, "m", "Depth, positive down";
    pitch_rad: Number, "rad", "Pitch, positive nose-up";
    heading_rad: Number, "rad", "Heading, 0 at north, clockwise; true north in a live mission with an `origin`";
    course_rad: Number, "rad", "Course over ground, 0 at north, clockwise";
    speed_mps: Number, "m/s", "Surge through the water; in `fix` and `known` rows of an AUV, and of a `vessel`, horizontal speed over ground";
    sway_mps: Number, "m/s", "Sway through the water, positive to starboard";
    yaw_rate_radps: Number, "rad/s", "Yaw rate, positive to starboard; in a `fix`, the rate of turn of the course";
    current_north_mps: Number, "m/s", "Current northward at the vehicle";
    current_east_mps: Number, "m/s", "Current eastward at the vehicle";
    sigma_m: Number, "m", "Standard deviation of the position along each axis, or of a range";
    range_m: Number, "m", "Slant range, measured from the position";
    age_s: Number, "s", "Age of what is `known` of an AUV, by the surface craft's clock, or of the newest fix behind what is `estimated`";
    clock_s: Number, "s", "Reading of the surface craft's own clock";
    thrust_port_n: Number, "N", "Port thrust";
    thrust_starboard_n: Number, "N", "Starboard thrust";
    energy_j: Number, "J", "Propulsion energy since the start";
    heading_travel_rad: Number, "rad", "Sum of the absolute changes of heading since the start";
    goal_north_m: Number, "m", "Goal, north of the datum: true, or in `planned` rows of a live mission estimated";
    goal_east_m: Number, "m", "Goal, east of the datum";
    goal_distance_m: Number, "m", "Horizontal distance from the surface craft to the goal";
    path_north_m: Number, "m", "Reference point on the AUV's path, north of the datum";
    path_east_m: Number, "m", "Reference point on the AUV's path, east of the datum";
    along_track_m: Number, "m", "True along-track error, positive ahead of that point";
    cross_track_m: Number, "m", "True cross-track error, positive to starboard of the path";
    reference_speed_mps: Number, "m/s", "Speed reference from then on: of the surface craft in `planned` rows, else of the AUV along its body";
    reference_heading_rad: Number, "rad", "Heading reference from then on, of the same vehicle";
    reference_pitch_rad: Number, "rad", "Pitch reference of the AUV from then on, positive nose-up";
    outcome: Word, "", "`ok`, or `degraded`";
    method: Word, "", "What produced the plan: `mpc`, `previous_plan`, `saturated_los`, `hold`, another law, or `own_law` (outside of this program)";
    reason: Word, "", "Why the plan is degraded or the mission failed; the text of a `note`";
    predicted_rms_m: Number, "m", "Predicted RMS distance to the goal over the plan's horizon";
    solve_ms: Number, "ms", "Planning time";
    late_s: Number, "s", "Time from when the plan was due until just before it was stored";
}

/// The `vehicle` of rows about the surface craft.
pub const SURFACE_CRAFT: &str = "asc";

/// The `kind` of rows with the surface craft's knowledge.
pub const KNOWN: &str = "known";

/// The `kind` of rows with an AUV's estimated position.
pub const ESTIMATED: &str = "estimated";

/// The `kind` of rows with another vessel, reported or true. A mission meets any number of these, so that
/// formats with a part for each vehicle leave them out.
pub const VESSEL: &str = "vessel";

impl<'a> Row<'a> {
    /// The vehicle and its position (north, east), m, if the row has a measured or true position.
    pub(crate) fn place(&self) -> Option<(&'a str, nalgebra::Vector2<f64>)> {
        let position = nalgebra::Vector2::new(self.north_m?, self.east_m?);
        let is_left_out = matches!(self.kind, Some(KNOWN | ESTIMATED | VESSEL));
        (!is_left_out).then_some((self.vehicle?, position))
    }
}

/// An object without members for unknown values: viewers' schemas have one type a member, not null.
impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut members = serializer.serialize_map(None)?;
        for column in COLUMNS {
            match (column.cell)(self) {
                Cell::Nothing => {}
                Cell::Count(count) => members.serialize_entry(column.name, &count)?,
                Cell::Number(number) => members.serialize_entry(column.name, &number)?,
                Cell::Word(word) => members.serialize_entry(column.name, word)?,
            }
        }
        members.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_table_matches_the_code() {
        let document = include_str!("../../../docs/records.md");
        let lines = document.lines().skip_while(|line| !line.starts_with("| column |"));
        let documented: Vec<String> =
            lines.skip(2).take_while(|line| line.starts_with('|')).map(str::to_owned).collect();
        let row = |column: &Column| format!("| `{}` | {} | {} |", column.name, column.unit, column.meaning);
        let expected: Vec<String> = COLUMNS.iter().map(row).collect();
        assert_eq!(documented, expected);
    }
}
