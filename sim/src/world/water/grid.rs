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
    #[must_use]
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
        let before = axis
            .partition_point(|&place| place <= coordinate)
            .saturating_sub(1);
        let after = (before + 1).min(axis.len() - 1);
        let gap = axis[after] - axis[before];
        // The share would be negative left of the first place: the edge's value holds.
        let share = if gap > 0.0 {
            ((coordinate - axis[before]) / gap).max(0.0)
        } else {
            0.0
        };
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
    use std::fmt::Write;

    use super::*;

    const HEADER: &str = "t_s,north_m,east_m,current_north_mps,current_east_mps\n";
    const TIMES: [f64; 3] = [0.0, 600.0, 900.0];
    const NORTHS: [f64; 4] = [-50.0, 0.0, 10.0, 200.0];
    const EASTS: [f64; 2] = [-7.0, 60.0];

    fn table(field: impl Fn(f64, f64, f64) -> Vector2<f64>) -> String {
        let mut table = HEADER.to_owned();
        for t in TIMES {
            for n in NORTHS {
                for e in EASTS {
                    let v = field(t, n, e);
                    writeln!(table, "{t},{n},{e},{},{}", v.x, v.y).expect("a string takes every line");
                }
            }
        }
        table
    }

    fn affine(t: f64, n: f64, e: f64) -> Vector2<f64> {
        Vector2::new(
            0.1 + 1e-4 * t - 2e-3 * n + 3e-3 * e,
            -0.2 - 2e-4 * t + 1e-3 * n - 1e-3 * e,
        )
    }

    /// Linear in each coordinate, with every product: trilinear interpolation reproduces it.
    fn products(t: f64, n: f64, e: f64) -> Vector2<f64> {
        let (t, n, e) = (t / 900.0, n / 200.0, e / 60.0);
        Vector2::new(
            (1.0 + t) * (1.0 - 0.3 * n) * (0.5 + 0.5 * e),
            n * e * t - n * t + e,
        )
    }

    fn read(table: &str) -> Result<CurrentGrid, InvalidGrid> {
        CurrentGrid::read(table.as_bytes())
    }

    #[test]
    fn interpolation_reproduces_affine_fields_and_products_of_linear_ones() {
        for field in [affine, products] {
            let grid = read(&table(field)).expect("full");
            for t in [0.0, 1.0, 333.3, 600.0, 700.0, 899.9] {
                for n in [-50.0, -3.0, 0.0, 4.0, 10.0, 11.0, 199.0] {
                    for e in [-7.0, 0.0, 33.0, 60.0] {
                        // A few roundings of values of order one.
                        let off = grid.at(t, &Vector2::new(n, e)) - field(t, n, e);
                        assert!(off.amax() < 1e-14, "{t} {n} {e}: {off}");
                    }
                }
            }
        }
    }

    #[test]
    fn nodes_are_exact() {
        // Not multilinear: neighbours are unrelated.
        let rough = |t: f64, n: f64, e: f64| Vector2::new((t + 3.0 * n).sin(), (e * n + t).cos());
        let grid = read(&table(rough)).expect("full");
        for t in TIMES {
            for n in NORTHS {
                for e in EASTS {
                    assert_eq!(grid.at(t, &Vector2::new(n, e)), rough(t, n, e));
                }
            }
        }
    }

    #[test]
    fn the_edge_holds_beyond_the_grid() {
        let grid = read(&table(products)).expect("full");
        let inside = |t: f64, n: f64, e: f64| {
            let position = Vector2::new(n.clamp(-50.0, 200.0), e.clamp(-7.0, 60.0));
            grid.at(t.clamp(0.0, 900.0), &position)
        };
        for (t, n, e) in [
            (-1.0, 5.0, 5.0),
            (1e9, 5.0, 5.0),
            (300.0, -51.0, 5.0),
            (300.0, 1e6, 5.0),
            (300.0, 5.0, -8.0),
            (300.0, 5.0, 1e6),
            (-5.0, -1e6, 1e6),
        ] {
            assert_eq!(grid.at(t, &Vector2::new(n, e)), inside(t, n, e));
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(
                grid.at(bad, &Vector2::new(bad, bad))
                    .iter()
                    .all(|v| v.is_finite())
            );
        }
    }

    #[test]
    fn the_order_of_lines_and_columns_does_not_matter() {
        let table = table(products);
        let mut lines: Vec<&str> = table.lines().skip(1).collect();
        lines.reverse();
        lines.swap(3, 17);
        assert_eq!(
            read(&(HEADER.to_owned() + &lines.join("\n"))).expect("full"),
            read(&table).expect("full")
        );

        let turned =
            "\u{feff}current_east_mps, east_m, t_s, north_m, current_north_mps\r\n0.2, 5, 0, 3, 0.1\r\n";
        let grid = read(turned).expect("one node");
        assert_eq!(grid.at(0.0, &Vector2::zeros()), Vector2::new(0.1, 0.2));
    }

    #[test]
    fn one_node_is_a_constant_current() {
        let grid = read(&(HEADER.to_owned() + "-0.0,0,0,0.3,-0.4\n")).expect("one node");
        for t in [-10.0, 0.0, 1e6] {
            assert_eq!(grid.at(t, &Vector2::new(t, -t)), Vector2::new(0.3, -0.4));
        }
    }
}
