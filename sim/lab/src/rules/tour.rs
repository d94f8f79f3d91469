//! The order in which the clock goes round.

use nalgebra::Vector2;

/// A closed tour from the place nearest to `here` that no exchange of two legs shortens.
pub(super) fn short_tour(here: &Vector2<f64>, places: &[Vector2<f64>]) -> Vec<usize> {
    let mut tour: Vec<usize> = (0..places.len()).collect();
    let length = |tour: &[usize]| -> f64 {
        let legs = tour.iter().zip(tour.iter().cycle().skip(1));
        legs.map(|(from, to)| (places[*to] - places[*from]).norm()).sum()
    };
    let mut shortest = length(&tour);
    let mut shorter = true;
    while shorter {
        shorter = false;
        for first in 0..tour.len() {
            for last in first + 1..tour.len() {
                tour[first..=last].reverse();
                let new = length(&tour);
                // A millimetre: rounding is no improvement.
                if new < shortest - 1e-3 {
                    (shortest, shorter) = (new, true);
                } else {
                    tour[first..=last].reverse();
                }
            }
        }
    }
    let distance = |place: &usize| (places[tour[*place]] - here).norm();
    let nearest = (0..tour.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    tour.rotate_left(nearest.unwrap_or(0));
    tour
}
