//! A current at the nodes of a rectangular grid in time, north and east, read from a table.

use std::io::Read;

use nalgebra::Vector2;

mod table;

pub use table::{InvalidGrid, NODES_MAX};

/// A current (north, east), m/s, over mission time, s, and position (north, east), m.
///
/// Trilinear between the nodes; beyond an edge in time or space, the edge's value holds.
#[derive(Clone, Debug, PartialEq)]
pub struct CurrentGrid {
    /// Coordinates of the nodes in time, north and east, each increasing and not empty.
    axes: [Vec<f64>; 3],
    /// The current at every node; east varies fastest, then north, then time.
    currents: Vec<Vector2<f64>>,
}

impl CurrentGrid {
    /// Reads a CSV table with the header `t_s,north_m,east_m,current_north_mps,current_east_mps`:
    /// every node of a full rectangular grid exactly once. Lines and columns may be in any order.
    pub fn read(reader: impl Read) -> Result<Self, InvalidGrid> {
        let (axes, currents) = table::read(reader)?;
        Ok(Self { axes, currents })
    }

    /// The current (north, east), m/s, at `time` s and `position` (north, east), m.
    pub fn at(&self, time: f64, position: &Vector2<f64>) -> Vector2<f64> {
        let [times, norths, easts] = &self.axes;
        let (t, n, e) = (
            Interpolation::new(times, time),
            Interpolation::new(norths, position.x),
            Interpolation::new(easts, position.y),
        );
        let node = |t, n, e| self.currents[(t * norths.len() + n) * easts.len() + e];
        t.interpolate(|t| n.interpolate(|n| e.interpolate(|e| node(t, n, e))))
    }
}

/// A coordinate between two neighbours of an axis.
#[derive(Clone, Copy)]
struct Interpolation {
    before: usize,
    after: usize,
    /// Share of the distance from `before` to `after`, in [0, 1); 0 if they are the same.
    share: f64,
}

impl Interpolation {
    fn new(axis: &[f64], coordinate: f64) -> Self {
        let before = axis.partition_point(|&place| place <= coordinate).saturating_sub(1);
        let after = (before + 1).min(axis.len() - 1);
        let gap = axis[after] - axis[before];
        // The share would be negative left of the first place: the edge's value holds.
        let share = if gap > 0.0 { ((coordinate - axis[before]) / gap).max(0.0) } else { 0.0 };
        Self { before, after, share }
    }

    fn interpolate(self, value: impl Fn(usize) -> Vector2<f64>) -> Vector2<f64> {
        let before = value(self.before);
        // A node's own value is exact; its neighbours are not read.
        if self.share == 0.0 {
            return before;
        }
        before + self.share * (value(self.after) - before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "t_s,north_m,east_m,current_north_mps,current_east_mps\n";
    const TIMES: [f64; 3] = [0.0, 600.0, 900.0];
    const NORTHS: [f64; 4] = [-50.0, 0.0, 10.0, 200.0];
    const EASTS: [f64; 2] = [-7.0, 60.0];

    fn table(field: impl Fn(f64, f64, f64) -> Vector2<f64>) -> String {
        let line = |(t, n, e)| {
            let v = field(t, n, e);
            format!("{t},{n},{e},{},{}\n", v.x, v.y)
        };
        let lines = places(&TIMES, &NORTHS, &EASTS).into_iter().map(line);
        HEADER.to_owned() + &lines.collect::<String>()
    }

    /// Linear in each coordinate, with every product: trilinear interpolation reproduces it.
    fn products(t: f64, n: f64, e: f64) -> Vector2<f64> {
        let (t, n, e) = (t / 900.0, n / 200.0, e / 60.0);
        Vector2::new((1.0 + t) * (1.0 - 0.3 * n) * (0.5 + 0.5 * e), n * e * t - n * t + e)
    }

    fn read(table: &str) -> Result<CurrentGrid, InvalidGrid> {
        CurrentGrid::read(table.as_bytes())
    }

    #[test]
    fn interpolation_reproduces_products_of_linear_fields_and_nodes_exactly() {
        // Not multilinear: neighbours are unrelated.
        let rough = |t: f64, n: f64, e: f64| Vector2::new((t + 3.0 * n).sin(), (e * n + t).cos());
        let nodes = read(&table(rough)).expect("full");
        let grid = read(&table(products)).expect("full");
        let times = [0.0, 1.0, 333.3, 600.0, 700.0, 899.9, 900.0];
        let norths = [-50.0, -3.0, 0.0, 4.0, 10.0, 11.0, 199.0, 200.0];
        for (t, n, e) in places(&times, &norths, &[-7.0, 0.0, 33.0, 60.0]) {
            // A few roundings of values of order one.
            let off = grid.at(t, &Vector2::new(n, e)) - products(t, n, e);
            assert!(off.amax() < 1e-14, "{t} {n} {e}: {off}");
        }
        for (t, n, e) in places(&TIMES, &NORTHS, &EASTS) {
            assert_eq!(nodes.at(t, &Vector2::new(n, e)), rough(t, n, e));
        }
    }

    fn places(times: &[f64], norths: &[f64], easts: &[f64]) -> Vec<(f64, f64, f64)> {
        let of = |t: f64, n: f64| easts.iter().map(move |e| (t, n, *e));
        let rows = times.iter().flat_map(|t| norths.iter().map(move |n| (*t, *n)));
        rows.flat_map(|(t, n)| of(t, n)).collect()
    }

    #[test]
    fn the_edge_holds_beyond_the_grid() {
        let grid = read(&table(products)).expect("full");
        for (t, n, e) in [
            (-1.0, 5.0, 5.0),
            (1e9, 5.0, 5.0),
            (300.0, -51.0, 5.0),
            (300.0, 1e6, 5.0),
            (300.0, 5.0, -8.0),
            (300.0, 5.0, 1e6),
            (-5.0, -1e6, 1e6),
        ] {
            let inside = Vector2::new(f64::clamp(n, -50.0, 200.0), f64::clamp(e, -7.0, 60.0));
            let inside = grid.at(f64::clamp(t, 0.0, 900.0), &inside);
            assert_eq!(grid.at(t, &Vector2::new(n, e)), inside);
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let held = grid.at(bad, &Vector2::new(bad, bad));
            assert!(held.iter().all(|v| v.is_finite()));
        }
    }

    #[test]
    fn the_order_of_lines_and_columns_does_not_matter() {
        let table = table(products);
        let mut lines: Vec<&str> = table.lines().skip(1).collect();
        lines.reverse();
        lines.swap(3, 17);
        let shuffled = read(&(HEADER.to_owned() + &lines.join("\n")));
        assert_eq!(shuffled.expect("full"), read(&table).expect("full"));

        let columns = "current_east_mps, east_m, t_s, north_m, current_north_mps";
        let grid = read(&format!("\u{feff}{columns}\r\n-0.4, 0, -0.0, 0, 0.3\r\n")).expect("one node");
        // One node is a constant current.
        for t in [-10.0, 0.0, 1e6] {
            assert_eq!(grid.at(t, &Vector2::new(t, -t)), Vector2::new(0.3, -0.4));
        }
    }
}
