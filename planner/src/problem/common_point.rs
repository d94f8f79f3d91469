//! Test for a common point of discs: a position in range of several AUVs.

use nalgebra::Vector2;

/// Rounding, m.
const ROUNDING: f64 = 1.0e-6;

/// Centre and radius, m, of a disc that includes its edge.
pub(crate) type Circle = (Vector2<f64>, f64);

/// `true` if some point is in all of `discs`.
///
/// A non-empty intersection of discs is convex. Its edge is either a whole circle, that of a disc
/// inside all others, whose centre is then in all; or it has a corner, where two circles cross.
pub(crate) fn have_a_common_point(discs: &[Circle]) -> bool {
    let in_all = |point: &Vector2<f64>| {
        discs.iter().all(|(centre, radius)| (point - centre).norm() <= radius + ROUNDING)
    };
    let pairs = || discs.iter().enumerate().flat_map(|(i, a)| discs[i + 1..].iter().map(move |b| (a, b)));
    discs.is_empty()
        || discs.iter().any(|(centre, _)| in_all(centre))
        || pairs().flat_map(|(a, b)| crossings(a, b)).any(|point| in_all(&point))
}

/// Crossings of two circles; twice the same if they touch, far away if they do not meet.
fn crossings((a, ra): &Circle, (b, rb): &Circle) -> [Vector2<f64>; 2] {
    let apart = b - a;
    let distance = apart.norm().max(f64::MIN_POSITIVE);
    let along = (distance * distance + ra * ra - rb * rb) / (2.0 * distance);
    let across = (ra * ra - along * along).max(0.0).sqrt();
    let axis = apart / distance;
    let foot = a + axis * along;
    let off = Vector2::new(-axis.y, axis.x) * across;
    [foot + off, foot - off]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::facts::angle::direction;

    fn circle(north: f64, east: f64, radius: f64) -> Circle {
        (Vector2::new(north, east), radius)
    }

    #[test]
    fn touching_discs_have_a_common_point_and_separate_ones_have_none() {
        let first = circle(0.0, 0.0, 300.0);
        // An equilateral triangle of sides 2: its centre is 2/√3 = 1.1547 from the corners.
        let triangle = |radius: f64| {
            [0.0, 1.0, 2.0].map(|i: f64| {
                let corner = direction(i * std::f64::consts::TAU / 3.0) * (2.0 / 3.0_f64.sqrt());
                (corner, radius)
            })
        };
        for (discs, expected) in [
            (&[][..], true),
            (&[circle(0.0, 0.0, 0.0)], true),
            (&[first, circle(600.0, 0.0, 300.0)], true),
            (&[first, circle(600.1, 0.0, 300.0)], false),
            // One inside another, and two at one place.
            (&[circle(0.0, 0.0, 50.0), circle(1.0, 2.0, 3.0)], true),
            (&[circle(1.0, 2.0, 5.0), circle(1.0, 2.0, 3.0)], true),
            // Discs that meet in pairs need not have a common point.
            (&triangle(1.15), false),
            (&triangle(1.16), true),
        ] {
            assert_eq!(have_a_common_point(discs), expected, "{discs:?}");
        }
    }

    proptest! {
        /// Second route: subgradient steps to the minimum of the convex largest excess.
        #[test]
        fn a_common_point_exists_if_the_minimal_excess_is_not_positive(
            discs in proptest::collection::vec(
                (-100.0..100.0_f64, -100.0..100.0_f64, 0.0..150.0_f64).prop_map(|(n, e, r)| circle(n, e, r)),
                1..6,
            ),
        ) {
            let worst = |point: &Vector2<f64>| {
                discs
                    .iter()
                    .map(|(centre, radius)| ((point - centre).norm() - radius, *centre))
                    .fold((f64::NEG_INFINITY, *point), |a, b| if a.0 < b.0 { b } else { a })
            };
            let mut point = Vector2::zeros();
            let mut least = f64::INFINITY;
            let mut step = 100.0;
            for _ in 0..4000 {
                let (excess, centre) = worst(&point);
                least = least.min(excess);
                point += (centre - point).cap_magnitude(step);
                step *= 0.997;
            }
            // The steps end below a millimetre; a smaller excess is undecided.
            if least.abs() > 0.05 {
                prop_assert_eq!(have_a_common_point(&discs), least < 0.0, "{}", least);
            }
        }
    }
}
