//! The point at the surface with the least largest range to several vehicles.

use nalgebra::Vector2;
use smallvec::{SmallVec, smallvec};

use crate::facts::ranges::AUVS_MAX;

/// Relative difference of equal squared distances: fifty roundings, or 10⁻⁷ of the distance.
const SQUARE_TOLERANCE: f64 = 1e-14;

/// Twice the sine of the angle at which three vehicles are collinear: a hundred roundings.
const SINE_IN_LINE: f64 = 1e-12;

/// A vehicle relative to the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Below {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Depth, m.
    pub depth: f64,
}

/// The point with the least largest slant range.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// The point (north, east), m.
    pub position: Vector2<f64>,
    /// Its weights, none negative, with the sum 1: the point is this mean of the vehicles'
    /// positions. At most three are positive, those of equally far vehicles, and none is farther.
    pub weights: SmallVec<[f64; AUVS_MAX]>,
}

/// The point that minimises the largest slant range.
///
/// ```text
/// minimise over c   max_i  ‖c − p_i‖² + z_i²
/// ```
/// At equal depths it is the centre of the smallest circle around the vehicles. Differences of the
/// squares are linear in c, so each step projects a vehicle on the half-planes where it is the
/// farthest: a vehicle farther than the best point for the previous ones belongs to the answer.
///
/// Source: E. Welzl, *Smallest enclosing disks (balls and ellipsoids)*, 1991, for the order of the
/// steps. Departures: the depths, and the given order, which suffices for sixteen.
///
/// # Panics
/// If `vehicles` is empty.
pub fn nearest_to_all(vehicles: &[Below]) -> Nearest {
    // Relative to the first: coordinates of 10⁶ m leave few digits to squares.
    let origin = vehicles[0].position;
    let points: SmallVec<[Lifted; AUVS_MAX]> = vehicles
        .iter()
        .map(|vehicle| Lifted { position: vehicle.position - origin, square: vehicle.depth * vehicle.depth })
        .collect();
    let mut best = Best::above(&points, 0);
    for i in 1..points.len() {
        if best.is_nearer_to(i, best.support[0], &points) {
            continue;
        }
        best = best_with_farthest(i, &points[..=i]);
    }
    Nearest { position: best.position + origin, weights: best.weights(&points) }
}

/// A vehicle with its squared depth.
#[derive(Clone, Copy, Debug)]
struct Lifted {
    position: Vector2<f64>,
    square: f64,
}

impl Lifted {
    fn square_range(&self, place: &Vector2<f64>) -> f64 {
        (place - self.position).norm_squared() + self.square
    }
}

/// A candidate and the vehicles that determine it.
#[derive(Clone, Debug)]
struct Best {
    position: Vector2<f64>,
    support: SmallVec<[usize; 3]>,
}

impl Best {
    fn above(points: &[Lifted], i: usize) -> Self {
        Self { position: points[i].position, support: smallvec![i] }
    }

    /// `true` if `a` is no farther than `b`.
    fn is_nearer_to(&self, a: usize, b: usize, points: &[Lifted]) -> bool {
        let [a, b] = [a, b].map(|i| points[i].square_range(&self.position));
        a <= b + SQUARE_TOLERANCE * a
    }

    /// Barycentric coordinates of the point in its support.
    fn weights(&self, points: &[Lifted]) -> SmallVec<[f64; AUVS_MAX]> {
        let p = |i: usize| points[i].position;
        let mut weights: SmallVec<[f64; AUVS_MAX]> = smallvec![0.0; points.len()];
        match *self.support.as_slice() {
            [i, j] => {
                let side = p(j) - p(i);
                let share = (self.position - p(i)).dot(&side) / side.norm_squared();
                (weights[i], weights[j]) = (1.0 - share, share);
            }
            [i, j, k] => {
                let area = (p(j) - p(i)).perp(&(p(k) - p(i)));
                let share = |a: usize, b: usize| (p(a) - self.position).perp(&(p(b) - self.position)) / area;
                (weights[i], weights[j], weights[k]) = (share(j, k), share(k, i), share(i, j));
            }
            _ => weights[self.support[0]] = 1.0,
        }
        // Inside the support, up to rounding.
        for weight in &mut weights {
            *weight = weight.max(0.0);
        }
        let sum: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / sum).collect()
    }
}

/// The best point among those from which the `i`-th, last, of `points` is farthest.
fn best_with_farthest(i: usize, points: &[Lifted]) -> Best {
    let mut best = Best::above(points, i);
    for j in 0..i {
        if !best.is_nearer_to(j, i, points) {
            best = best_with_equal_ranges(i, j, points).unwrap_or(best);
        }
    }
    best
}

/// The best point on the line from which `i` and `j` are equally far, among those from which none
/// of the vehicles before `j` is farther; `None` if `i` and `j` are above each other.
///
/// With q = p − p_i, the foot m of the line from p_i, and e along it:
/// ```text
/// c = p_i + m + τ e                   m = q_j (½ + (z_j² − z_i²) / 2‖q_j‖²)
/// 2 e·q_k τ ≥ ‖q_k‖² + z_k² − z_i² − 2 m·q_k
/// ```
fn best_with_equal_ranges(i: usize, j: usize, points: &[Lifted]) -> Option<Best> {
    let from_i = |k: usize| points[k].position - points[i].position;
    let higher = |k: usize| points[k].square - points[i].square;
    let q_j = from_i(j);
    let length_square = q_j.norm_squared();
    if length_square <= f64::MIN_POSITIVE {
        return None;
    }
    let m = q_j * (0.5 + 0.5 * higher(j) / length_square);
    let along = Vector2::new(-q_j.y, q_j.x) / length_square.sqrt();
    let (mut low, mut high) = ((f64::NEG_INFINITY, None), (f64::INFINITY, None));
    for k in 0..j {
        let q_k = from_i(k);
        let slope = 2.0 * along.dot(&q_k);
        // Collinear with the other two, it allows all points of the line or none.
        if slope.abs() <= SINE_IN_LINE * q_k.norm() {
            continue;
        }
        let bound = (q_k.norm_squared() + higher(k) - 2.0 * m.dot(&q_k)) / slope;
        if slope > 0.0 && low.0 < bound {
            low = (bound, Some(k));
        } else if slope < 0.0 && bound < high.0 {
            high = (bound, Some(k));
        }
    }
    let (tau, third) = match (low, high) {
        (low, _) if 0.0 < low.0 => low,
        (_, high) if high.0 < 0.0 => high,
        _ => (0.0, None),
    };
    Some(Best {
        position: points[i].position + m + along * tau,
        support: [i, j].into_iter().chain(third).collect(),
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{facts::angle::direction, tests::near};

    fn below(north: f64, east: f64, depth: f64) -> Below {
        Below { position: Vector2::new(north, east), depth }
    }

    fn range(place: &Vector2<f64>, vehicle: &Below) -> f64 {
        (place - vehicle.position).norm().hypot(vehicle.depth)
    }

    fn worst(place: &Vector2<f64>, vehicles: &[Below]) -> f64 {
        let ranges = vehicles.iter().map(|vehicle| range(place, vehicle));
        ranges.fold(0.0, f64::max)
    }

    /// Asserts a convex minimax's optimality condition: a mean of the active gradients vanishes.
    fn assert_least(vehicles: &[Below], size: f64) {
        let found = nearest_to_all(vehicles);
        let (place, worst) = (found.position, worst(&found.position, vehicles));
        assert!(found.weights.iter().all(|weight| 0.0 <= *weight), "{found:?}");
        near(found.weights.iter().sum(), 1.0, 1e-12);
        let pairs = || found.weights.iter().zip(vehicles);
        let mean: Vector2<f64> = pairs().map(|(weight, vehicle)| vehicle.position * *weight).sum();
        assert!((mean - place).norm() <= 1e-7 * size, "{found:?} of {vehicles:?}");
        for (weight, vehicle) in pairs() {
            // Squared ranges are equal within 1e-14 of themselves, and a coordinate has 16 digits.
            let short = weight * (worst - range(&place, vehicle));
            assert!(short <= 1e-9 * size, "{short} at {vehicle:?} of {vehicles:?}");
        }
    }

    #[test]
    fn the_best_point_is_above_one_vehicle_and_nearer_to_the_deeper_of_two() {
        let found = nearest_to_all(&[below(3.0, -4.0, 9.0)]);
        assert_eq!(found.position, Vector2::new(3.0, -4.0));
        assert_eq!(&found.weights[..], &[1.0][..]);
        // The squared ranges x² and (60 − x)² + depth² are equal at x = 60 `share`.
        let with = |depth| nearest_to_all(&[below(0.0, 0.0, 0.0), below(60.0, 0.0, depth)]);
        let share = 0.5 + 40.0 * 40.0 / (2.0 * 60.0 * 60.0);
        near(with(40.0).position.x, 60.0 * share, 1e-12);
        near(with(40.0).weights[1], share, 1e-12);
        let found = with(60.5);
        assert_eq!((found.position.x, &found.weights[..]), (60.0, &[0.0, 1.0][..]));
    }

    #[test]
    fn nearly_coincident_and_cocircular_vehicles_have_one_best_point() {
        let circle = |n: u32| {
            let places = (0..n).map(|k| direction(f64::from(k) * 0.7) * 50.0);
            places.map(|p| below(p.x, p.y, 3.0)).collect::<Vec<_>>()
        };
        let mut nearly_twins = vec![below(1.0, 2.0, 3.0); 16];
        for (k, twin) in (0..).zip(&mut nearly_twins) {
            twin.position += Vector2::new(f64::from(k * 7 % 16), f64::from(k * 3 % 16)) * 1e-9;
        }
        nearly_twins.push(below(40.0, 60.0, 3.0));
        for vehicles in [circle(3), circle(9), circle(16), nearly_twins] {
            assert_least(&vehicles, 100.0);
        }
        assert!(nearest_to_all(&circle(16)).position.norm() < 1e-9);
    }

    fn any_vehicles() -> impl Strategy<Value = Vec<Below>> {
        // A coarse grid has ties, coincidences and lines.
        let fine = (-200.0..200.0, -200.0..200.0, 0.0..200.0);
        let coarse = (-3_i32..4, -3_i32..4, 0_i32..3)
            .prop_map(|(n, e, d)| (20.0 * f64::from(n), 20.0 * f64::from(e), 30.0 * f64::from(d)));
        let vehicle = |(north, east, depth)| below(north, east, depth);
        prop_oneof![
            prop::collection::vec(fine.prop_map(vehicle), 1..=16),
            prop::collection::vec(coarse.prop_map(vehicle), 1..=16),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_point_is_better_than_the_one_found(
            vehicles in any_vehicles(),
            steps in prop::collection::vec((-1.0..1.0, -1.0..1.0, -6_i32..3), 50),
        ) {
            assert_least(&vehicles, 400.0);
            let place = nearest_to_all(&vehicles).position;
            let least = worst(&place, &vehicles);
            for (north, east, power) in steps {
                let other = place + Vector2::new(north, east) * 10_f64.powi(power);
                prop_assert!(least <= worst(&other, &vehicles) + 1e-9);
            }
        }
    }
}
