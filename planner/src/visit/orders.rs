//! Tours of a schedule by the clock.

use crate::visit::fleet::Fleet;

/// Most candidates with all tours: 24 that begin with one of five.
const ALL_TOURS_MAX: usize = 5;

impl Fleet {
    /// Tours of all candidates from `first` on: all for few, else that to nearest neighbours.
    pub(crate) fn tours(&self, first: usize) -> Vec<Vec<usize>> {
        let others: Vec<_> = (0..self.candidates.len()).filter(|other| *other != first).collect();
        if self.candidates.len() <= ALL_TOURS_MAX {
            let mut tours = vec![vec![first]];
            for other in &others {
                let places = |tour: &Vec<usize>| 1..=tour.len();
                let with =
                    |tour: &Vec<usize>, place: usize| [&tour[..place], &[*other], &tour[place..]].concat();
                tours = tours
                    .iter()
                    .flat_map(|tour| places(tour).map(|place| with(tour, place)).collect::<Vec<_>>())
                    .collect();
            }
            return tours;
        }
        let (mut tour, mut left) = (vec![first], others);
        while !left.is_empty() {
            let from = self.candidates[tour[tour.len() - 1]].track.at(0.0);
            let distance = |to: &usize| (self.candidates[*to].track.at(0.0) - from).norm();
            let nearest = (0..left.len()).min_by(|a, b| distance(&left[*a]).total_cmp(&distance(&left[*b])));
            tour.push(left.remove(nearest.unwrap_or(0)));
        }
        vec![tour]
    }
}
