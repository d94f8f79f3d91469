//! Headings without the jump at south.

use planner::angle::wrap;

use crate::chart::Line;

/// A line of reference headings and one of what becomes of them, rad, as degrees that can be drawn.
pub(crate) fn unwrap([reference, actual]: &mut [Line; 2]) {
    let values = |line: &Line| line.points.iter().map(|point| point.1).collect::<Vec<_>>();
    let degrees = unwrapped(&values(reference), &values(actual));
    for (line, degrees) in [reference, actual].into_iter().zip(degrees) {
        for (point, degrees) in line.points.iter_mut().zip(degrees) {
            point.1 = degrees;
        }
    }
}

/// `reference` and `actual` headings, rad, as degrees that a line can be drawn through: the actual heading goes on
/// from its own last value, and its reference stays within half a turn of it.
fn unwrapped(reference: &[f64], actual: &[f64]) -> [Vec<f64>; 2] {
    let mut last = actual.first().copied().unwrap_or_default();
    let mut lines = [vec![], vec![]];
    for (wanted, is) in reference.iter().zip(actual) {
        last += wrap(is - last);
        lines[0].push((last + wrap(wanted - last)).to_degrees());
        lines[1].push(last.to_degrees());
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn a_heading_that_passes_south_goes_on_and_takes_its_reference_with_it() {
        let [reference, actual] = unwrapped(&[-PI + 0.1, PI - 0.1], &[PI - 0.1, -PI + 0.1]);
        let near = |values: &[f64], expected: [f64; 2]| {
            let pairs = values.iter().zip(expected);
            pairs
                .into_iter()
                .all(|(value, expected)| (value - expected.to_degrees()).abs() < 1e-9)
        };
        assert!(near(&actual, [PI - 0.1, PI + 0.1]));
        assert!(near(&reference, [PI + 0.1, PI - 0.1]));
    }
}
