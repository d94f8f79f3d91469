//! Reads a grid from a CSV table, and checks it.

use std::{cmp::Ordering, io::Read};

use csv::{ReaderBuilder, StringRecord, Trim};
use nalgebra::Vector2;
use planner::snapshot::{COORDINATE_MAX, TIME_MAX};
use serde::Deserialize;

use crate::world::water::CURRENT_MAX;

/// Largest number of nodes of a grid: 48 bytes each while reading, 16 afterwards.
pub const NODES_MAX: usize = 1_000_000;

/// A line of the table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    t_s: f64,
    north_m: f64,
    east_m: f64,
    current_north_mps: f64,
    current_east_mps: f64,
}

/// Reason why a table is no grid.
#[derive(Debug, thiserror::Error)]
pub enum InvalidGrid {
    /// The bytes cannot be read or are not UTF-8; a column is missing, unknown or repeated; a line
    /// has too many or too few fields; a field is not a number.
    #[error("not a table with the columns t_s, north_m, east_m, current_north_mps and current_east_mps: {0}")]
    NotATable(#[from] csv::Error),
    /// A number outside its range, or repeated, missing or too many nodes; with lines, from 1.
    #[error("{0}")]
    NotAGrid(String),
}

/// Places of the nodes in time, north and east, and the current at every node.
type Nodes = ([Vec<f64>; 3], Vec<Vector2<f64>>);

pub(super) fn read(reader: impl Read) -> Result<Nodes, InvalidGrid> {
    let mut table = ReaderBuilder::new().trim(Trim::All).from_reader(reader);
    let header = table.headers()?.clone();
    let (mut rows, mut record) = (Vec::new(), StringRecord::new());
    while table.read_record(&mut record)? {
        // The position of a record read from a reader is always known.
        let line = record.position().map_or(0, csv::Position::line);
        if rows.len() == NODES_MAX {
            let says = format!("line {line}: more than {NODES_MAX} nodes");
            return Err(InvalidGrid::NotAGrid(says));
        }
        let read: Line = record.deserialize(Some(&header))?;
        let within = |field, given: f64, most: f64| {
            if -most <= given && given <= most {
                // −0.0 is the same place as 0.0; the sum makes it the same number.
                Ok(given + 0.0)
            } else {
                let says = format!("line {line}: {field}: {given} is outside -{most} to {most}");
                Err(InvalidGrid::NotAGrid(says))
            }
        };
        rows.push(NodeRow {
            line,
            place: [
                within("t_s", read.t_s, TIME_MAX)?,
                within("north_m", read.north_m, COORDINATE_MAX)?,
                within("east_m", read.east_m, COORDINATE_MAX)?,
            ],
            current: Vector2::new(
                within("current_north_mps", read.current_north_mps, CURRENT_MAX)?,
                within("current_east_mps", read.current_east_mps, CURRENT_MAX)?,
            ),
        });
    }
    grid(rows)
}

struct NodeRow {
    line: u64,
    /// Time, north, east.
    place: [f64; 3],
    current: Vector2<f64>,
}

impl NodeRow {
    fn by_node(&self, other: &Self) -> Ordering {
        let [t, n, e] = [0, 1, 2].map(|axis| self.place[axis].total_cmp(&other.place[axis]));
        t.then(n).then(e)
    }
}

fn node([time, north, east]: [f64; 3]) -> String {
    format!("t_s {time}, north_m {north}, east_m {east}")
}

/// Puts the rows in the grid's order.
fn grid(mut rows: Vec<NodeRow>) -> Result<Nodes, InvalidGrid> {
    if rows.is_empty() {
        return Err(InvalidGrid::NotAGrid("the table has no nodes".to_owned()));
    }
    // Stable: of two lines with one node, the earlier in the file stays first.
    rows.sort_by(NodeRow::by_node);
    for pair in rows.windows(2) {
        if pair[0].by_node(&pair[1]) == Ordering::Equal {
            let (line, first, node) = (pair[1].line, pair[0].line, node(pair[1].place));
            let says = format!("line {line}: the node {node} is on line {first} too");
            return Err(InvalidGrid::NotAGrid(says));
        }
    }
    let axes = [0, 1, 2].map(|axis| {
        let mut places: Vec<f64> = rows.iter().map(|row| row.place[axis]).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        places
    });
    let [times, norths, easts] = &axes;
    // Cannot overflow 64 bits: each axis has at most as many places as rows, a million.
    let expected = times.len() * norths.len() * easts.len();
    if rows.len() < expected {
        let nodes = times.iter().flat_map(|&time| {
            norths.iter().flat_map(move |&north| easts.iter().map(move |&east| [time, north, east]))
        });
        // Rows are in the grid's order, each once: a node is missing at the first difference.
        let given = rows.iter().map(|row| Some(row.place)).chain([None]);
        let missing = nodes.zip(given).find(|(node, given)| *given != Some(*node));
        let (place, _) = missing.expect("fewer rows than nodes: the row after the last is no node");
        let (given, node) = (rows.len(), node(place));
        return Err(InvalidGrid::NotAGrid(format!(
            "the grid has {given} of its {expected} nodes; the first missing node is {node}"
        )));
    }
    let currents = rows.iter().map(|row| row.current).collect();
    Ok((axes, currents))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::rows;

    const HEADER: &str = "t_s,north_m,east_m,current_north_mps,current_east_mps\n";

    /// Three times, four norths, two easts.
    fn full_table() -> String {
        let node = |k: usize| {
            let (t, n, e) = ([0, 600, 900][k / 8], [-50, 0, 10, 200][k / 2 % 4], [-7, 60][k % 2]);
            format!("{t},{n},{e},0.1,-0.2\n")
        };
        HEADER.to_owned() + &(0..24).map(node).collect::<String>()
    }

    fn refusal(table: &str) -> String {
        read(table.as_bytes()).expect_err("refused").to_string()
    }

    #[test]
    fn errors_of_a_table_name_line_and_column() {
        assert!(refusal("").contains("has no nodes"));
        for [begin, line, says] in rows(
            r"
            t_s,north_m,east_m,depth_m,current_north_mps,current_east_mps | 0,0,0,0,0,0 | unknown field `depth_m`
            t_s,north_m,current_north_mps,current_east_mps | 0,0,0,0 | missing field `east_m`
            t_s,north_m,t_s,east_m | 0,0,0,0 | duplicate field `t_s`
            HEADER |               | has no nodes
            HEADER | 1,x,0,0,0     | line: 2
            HEADER | 1,0,,0,0      | line: 2
            HEADER | 0,0,0,0       | line: 2
            HEADER | 1,0,0,NaN,0   | line 2: current_north_mps: NaN is outside -3 to 3
            HEADER | 1,0,0,0,-3.5  | line 2: current_east_mps: -3.5 is outside -3 to 3
            HEADER | inf,0,0,0,0   | line 2: t_s: inf is outside -100000000000 to 100000000000
            HEADER | 1,1e7,0,0,0   | line 2: north_m: 10000000 is outside -1000000 to 1000000
            ",
        ) {
            let begin = begin.replace("HEADER", HEADER.trim());
            let refusal = refusal(&format!("{begin}\n{line}\n"));
            assert!(refusal.contains(&says), "{refusal}");
        }
        let bytes = [HEADER.as_bytes(), b"0,0,0,0,\xff\n"].concat();
        assert!(matches!(read(&bytes[..]), Err(InvalidGrid::NotATable(_))));
    }

    #[test]
    fn a_repeated_node_is_named_with_both_lines() {
        for (table, says) in [
            (
                full_table() + "600,10,-7,0,0\n",
                "line 26: the node t_s 600, north_m 10, east_m -7 is on line 14 too",
            ),
            (
                format!("{HEADER}0,0,0,0,0\n0,-0.0,0,0,0\n"),
                "line 3: the node t_s 0, north_m 0, east_m 0 is on line 2 too",
            ),
        ] {
            assert_eq!(refusal(&table), says);
        }
    }

    #[test]
    fn a_missing_node_is_named() {
        let table = full_table();
        for missing in 1..table.lines().count() {
            let mut kept: Vec<&str> = table.lines().collect();
            let node: Vec<_> = kept.remove(missing).split(',').collect();
            let says = format!(
                "the grid has 23 of its 24 nodes; the first missing node is t_s {}, north_m {}, east_m {}",
                node[0], node[1], node[2]
            );
            assert_eq!(refusal(&kept.join("\n")), says);
        }
    }

    #[test]
    fn too_many_nodes_are_refused_before_they_are_stored() {
        let endless = std::iter::repeat_n("0,0,0,0,0\n", NODES_MAX + 1);
        let table: String = std::iter::once(HEADER).chain(endless).collect();
        assert_eq!(refusal(&table), "line 1000002: more than 1000000 nodes");
    }
}
