//! Angles without the jump at south.

use planner::angle::wrap;

use crate::chart::Line;

/// Angles without jumps: each within half a turn of the one before it.
pub(crate) fn continuous(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last = None;
    angles
        .map(|angle| {
            let next = last.map_or(angle, |last: f64| last + wrap(angle - last));
            last = Some(next);
            next
        })
        .collect()
}

/// A line of reference headings and one of the headings that follow, rad, as degrees that a line can be drawn through: the
/// reference stays within half a turn of the heading.
pub(crate) fn unwrap([reference, actual]: &mut [Line; 2]) {
    let headings = continuous(actual.points.iter().map(|point| point.1));
    for (heading, (wanted, is)) in headings
        .iter()
        .zip(reference.points.iter_mut().zip(&mut actual.points))
    {
        wanted.1 = (heading + wrap(wanted.1 - heading)).to_degrees();
        is.1 = heading.to_degrees();
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::chart::{BLUE, Stroke};

    #[test]
    fn a_heading_that_passes_south_goes_on_and_takes_its_reference_with_it() {
        let line = |headings: [f64; 2]| Line {
            name: String::new(),
            colour: BLUE,
            stroke: Stroke::Solid,
            points: headings.map(|heading| (0.0, heading)).to_vec(),
        };
        let mut lines = [line([-PI + 0.1, PI - 0.1]), line([PI - 0.1, -PI + 0.1])];
        unwrap(&mut lines);
        for (line, expected) in lines.iter().zip([[PI + 0.1, PI - 0.1], [PI - 0.1, PI + 0.1]]) {
            for (point, expected) in line.points.iter().zip(expected) {
                assert!((point.1 - expected.to_degrees()).abs() < 1e-9);
            }
        }
    }
}
