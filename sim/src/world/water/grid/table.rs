//! A grid as a table of comma-separated values: what is accepted, and why the rest is not.

use std::{cmp::Ordering, io::Read};

use csv::{Reader, ReaderBuilder, StringRecord, Trim};
use nalgebra::Vector2;
use planner::snapshot::{COORDINATE_MAX, TIME_MAX};

use super::CurrentGrid;
use crate::world::water::CURRENT_MAX;

/// Columns of the table, in any order in a file, and the largest magnitude of each.
const COLUMNS: [(&str, f64); 5] = [
    ("t_s", TIME_MAX),
    ("north_m", COORDINATE_MAX),
    ("east_m", COORDINATE_MAX),
    ("current_north_mps", CURRENT_MAX),
    ("current_east_mps", CURRENT_MAX),
];

/// Most nodes of a grid: 48 bytes each while they are read, 16 after.
pub const NODES_MAX: usize = 1_000_000;

/// Why a table is no grid.
#[derive(Debug, thiserror::Error)]
pub enum InvalidGrid {
    /// The bytes cannot be read, are not UTF-8, or a line has too many or too few fields.
    #[error("no table of comma-separated values: {0}")]
    NotATable(#[from] csv::Error),
    /// A column that means nothing here.
    #[error("line 1: unknown column {given:?}; known are {}", COLUMNS.map(|(name, _)| name).join(", "))]
    UnknownColumn {
        /// Its name.
        given: String,
    },
    /// A column that stands twice.
    #[error("line 1: column {field} stands twice")]
    RepeatedColumn {
        /// Its name.
        field: &'static str,
    },
    /// A column that is needed and not there.
    #[error("line 1: column {field} is missing")]
    MissingColumn {
        /// Its name.
        field: &'static str,
    },
    /// A field that is not a number.
    #[error("line {line}: {field}: {given:?} is not a number")]
    NotANumber {
        /// The line in the file, from 1.
        line: u64,
        /// The column.
        field: &'static str,
        /// What stands there.
        given: String,
    },
    /// A number that is not finite or outside its range.
    #[error("line {line}: {field}: {given} is not in [-{most}, {most}]")]
    OutOfRange {
        /// The line in the file, from 1.
        line: u64,
        /// The column.
        field: &'static str,
        /// The value.
        given: f64,
        /// Largest magnitude accepted.
        most: f64,
    },
    /// A node that stands twice.
    #[error("line {line}: the node {node} stood on line {first} already")]
    RepeatedNode {
        /// The line of the repetition, from 1.
        line: u64,
        /// The line that gave it first.
        first: u64,
        /// The node.
        node: Node,
    },
    /// A node of the rectangular grid that no line gives.
    #[error("the grid has {given} of its {expected} nodes; the first that is missing is {node}")]
    MissingNode {
        /// The first one missing, in the order of time, north, east.
        node: Node,
        /// Nodes that there are.
        given: usize,
        /// Nodes of a full grid: times × norths × easts.
        expected: usize,
    },
    /// More nodes than are accepted.
    #[error("line {line}: more than {most} nodes")]
    TooManyNodes {
        /// The first line too many, from 1.
        line: u64,
        /// Most accepted.
        most: usize,
    },
    /// No node at all.
    #[error("the table has no nodes")]
    Empty,
}

/// Where a node of the grid stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Time, s.
    pub time: f64,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
}

impl std::fmt::Display for Node {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { time, position } = self;
        write!(f, "t_s {time}, north_m {}, east_m {}", position.x, position.y)
    }
}

pub(super) fn read(reader: impl Read) -> Result<CurrentGrid, InvalidGrid> {
    let mut table = ReaderBuilder::new().trim(Trim::All).from_reader(reader);
    let columns = columns(table.headers()?)?;
    grid(rows(&mut table, columns)?)
}

/// Where in a line each of [`COLUMNS`] stands.
fn columns(header: &StringRecord) -> Result<[usize; 5], InvalidGrid> {
    let mut places = [None; 5];
    for (place, given) in header.iter().enumerate() {
        let Some(column) = COLUMNS.iter().position(|(name, _)| *name == given) else {
            return Err(InvalidGrid::UnknownColumn {
                given: given.to_owned(),
            });
        };
        if places[column].replace(place).is_some() {
            let field = COLUMNS[column].0;
            return Err(InvalidGrid::RepeatedColumn { field });
        }
    }
    let mut found = [0; 5];
    for (column, place) in places.into_iter().enumerate() {
        let field = COLUMNS[column].0;
        found[column] = place.ok_or(InvalidGrid::MissingColumn { field })?;
    }
    Ok(found)
}

fn rows(table: &mut Reader<impl Read>, columns: [usize; 5]) -> Result<Vec<Row>, InvalidGrid> {
    let mut rows = Vec::new();
    let mut record = StringRecord::new();
    while table.read_record(&mut record)? {
        // The position of a record read from a reader is always known.
        let line = record.position().map_or(0, csv::Position::line);
        if rows.len() == NODES_MAX {
            let most = NODES_MAX;
            return Err(InvalidGrid::TooManyNodes { line, most });
        }
        let mut numbers = [0.0; 5];
        for ((number, (field, most)), place) in numbers.iter_mut().zip(COLUMNS).zip(columns) {
            *number = parse(&record[place], line, field, most)?;
        }
        let [time, north, east, current_north, current_east] = numbers;
        rows.push(Row {
            line,
            place: [time, north, east],
            current: Vector2::new(current_north, current_east),
        });
    }
    Ok(rows)
}

fn parse(given: &str, line: u64, field: &'static str, most: f64) -> Result<f64, InvalidGrid> {
    let number: f64 = given.parse().map_err(|_| InvalidGrid::NotANumber {
        line,
        field,
        given: given.to_owned(),
    })?;
    if -most <= number && number <= most {
        // −0.0 is the same place as 0.0; the sum makes it the same number.
        return Ok(number + 0.0);
    }
    Err(InvalidGrid::OutOfRange {
        line,
        field,
        given: number,
        most,
    })
}

struct Row {
    line: u64,
    /// Time, north, east.
    place: [f64; 3],
    current: Vector2<f64>,
}

impl Row {
    fn by_node(&self, other: &Self) -> Ordering {
        let [t, n, e] = [0, 1, 2].map(|axis| self.place[axis].total_cmp(&other.place[axis]));
        t.then(n).then(e)
    }

    fn node(&self) -> Node {
        node_at(self.place)
    }
}

fn node_at([time, north, east]: [f64; 3]) -> Node {
    Node {
        time,
        position: Vector2::new(north, east),
    }
}

/// Puts the rows in the grid's order.
fn grid(mut rows: Vec<Row>) -> Result<CurrentGrid, InvalidGrid> {
    if rows.is_empty() {
        return Err(InvalidGrid::Empty);
    }
    // Stable: of two lines that give one node, the earlier in the file stays first.
    rows.sort_by(Row::by_node);
    for pair in rows.windows(2) {
        if pair[0].by_node(&pair[1]) == Ordering::Equal {
            return Err(InvalidGrid::RepeatedNode {
                line: pair[1].line,
                first: pair[0].line,
                node: pair[1].node(),
            });
        }
    }
    let axes = [0, 1, 2].map(|axis| {
        let mut places: Vec<f64> = rows.iter().map(|row| row.place[axis]).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        places
    });
    let [times, norths, easts] = &axes;
    // Cannot overflow 64 bits: each axis has at most as many places as there are rows, a million.
    let expected = times.len() * norths.len() * easts.len();
    if rows.len() < expected {
        let nodes = times.iter().flat_map(|&time| {
            norths
                .iter()
                .flat_map(move |&north| easts.iter().map(move |&east| [time, north, east]))
        });
        // Rows are in the grid's order without repetition: where the two first part, a node is missing.
        let given = rows.iter().map(|row| Some(row.place)).chain([None]);
        let missing = nodes.zip(given).find(|(node, given)| *given != Some(*node));
        let (place, _) = missing.expect("fewer rows than nodes: the row after the last is no node");
        return Err(InvalidGrid::MissingNode {
            node: node_at(place),
            given: rows.len(),
            expected,
        });
    }
    let currents = rows.iter().map(|row| row.current).collect();
    Ok(CurrentGrid { axes, currents })
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use super::*;

    const HEADER: &str = "t_s,north_m,east_m,current_north_mps,current_east_mps\n";

    /// Three times, four norths, two easts.
    fn full_table() -> String {
        let mut table = HEADER.to_owned();
        for t in [0, 600, 900] {
            for n in [-50, 0, 10, 200] {
                for e in [-7, 60] {
                    writeln!(table, "{t},{n},{e},0.1,-0.2").expect("a string takes every line");
                }
            }
        }
        table
    }

    fn refusal(table: &str) -> InvalidGrid {
        read(table.as_bytes()).expect_err("refused")
    }

    #[test]
    fn a_header_is_refused_by_the_column() {
        let unknown = refusal("t_s,north_m,east_m,depth_m,current_north_mps,current_east_mps\n");
        assert!(matches!(unknown, InvalidGrid::UnknownColumn { given } if given == "depth_m"));
        let missing = refusal("t_s,north_m,current_north_mps,current_east_mps\n");
        assert!(matches!(missing, InvalidGrid::MissingColumn { field: "east_m" }));
        let repeated = refusal("t_s,north_m,t_s,east_m,current_north_mps,current_east_mps\n");
        assert!(matches!(repeated, InvalidGrid::RepeatedColumn { field: "t_s" }));
        assert!(matches!(refusal(""), InvalidGrid::MissingColumn { field: "t_s" }));
        assert!(matches!(refusal(HEADER), InvalidGrid::Empty));
    }

    #[test]
    fn a_bad_number_is_named_with_line_field_value_and_limit() {
        let line = |row: &str| refusal(&format!("{HEADER}0,0,0,0,0\n{row}\n")).to_string();
        assert_eq!(line("1,x,0,0,0"), "line 3: north_m: \"x\" is not a number");
        assert_eq!(line("1,0,,0,0"), "line 3: east_m: \"\" is not a number");
        assert_eq!(
            line("1,0,0,NaN,0"),
            "line 3: current_north_mps: NaN is not in [-3, 3]"
        );
        assert_eq!(
            line("1,0,0,0,-3.5"),
            "line 3: current_east_mps: -3.5 is not in [-3, 3]"
        );
        assert_eq!(
            line("inf,0,0,0,0"),
            "line 3: t_s: inf is not in [-100000000000, 100000000000]"
        );
        assert_eq!(
            line("1,1e7,0,0,0"),
            "line 3: north_m: 10000000 is not in [-1000000, 1000000]"
        );
    }

    #[test]
    fn a_line_with_a_field_too_few_and_bytes_that_are_no_text_are_refused() {
        let short = refusal(&format!("{HEADER}0,0,0,0\n"));
        assert!(matches!(short, InvalidGrid::NotATable(_)));
        assert!(short.to_string().contains("line: 2"), "{short}");
        let bytes = [HEADER.as_bytes(), b"0,0,0,0,\xff\n"].concat();
        assert!(matches!(read(&bytes[..]), Err(InvalidGrid::NotATable(_))));
    }

    #[test]
    fn a_node_that_stands_twice_is_named_with_both_lines() {
        let mut table = full_table();
        table.push_str("600,10,-7,0,0\n");
        assert_eq!(
            refusal(&table).to_string(),
            "line 26: the node t_s 600, north_m 10, east_m -7 stood on line 14 already"
        );
        let zeros = refusal(&format!("{HEADER}0,0,0,0,0\n0,-0.0,0,0,0\n"));
        assert!(matches!(
            zeros,
            InvalidGrid::RepeatedNode {
                line: 3,
                first: 2,
                ..
            }
        ));
    }

    #[test]
    fn every_node_that_is_missing_is_named() {
        let table = full_table();
        for missing in 1..table.lines().count() {
            let kept: Vec<&str> = table
                .lines()
                .enumerate()
                .filter(|(line, _)| *line != missing)
                .map(|(_, line)| line)
                .collect();
            let node = table.lines().nth(missing).expect("counted").split(',');
            let node: Vec<f64> = node.take(3).map(|x| x.parse().expect("written so")).collect();
            let InvalidGrid::MissingNode {
                node: named,
                given: 23,
                expected: 24,
            } = refusal(&kept.join("\n"))
            else {
                panic!("line {missing}");
            };
            assert_eq!(vec![named.time, named.position.x, named.position.y], node);
        }
    }

    #[test]
    fn more_nodes_than_accepted_are_refused_before_they_are_kept() {
        let endless = std::iter::repeat_n("0,0,0,0,0\n", NODES_MAX + 1);
        let table: String = std::iter::once(HEADER).chain(endless).collect();
        let error = refusal(&table);
        assert!(matches!(
            error,
            InvalidGrid::TooManyNodes {
                line: 1_000_002,
                most: NODES_MAX
            }
        ));
    }
}
