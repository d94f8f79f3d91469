//! Sparse matrices with a fixed pattern, whose values are rewritten in place.

/// A matrix in compressed sparse column form; only its first filling from triplets sorts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sparse {
    /// Number of rows.
    pub n_rows: usize,
    /// Number of columns.
    pub n_cols: usize,
    /// Start of each column in `row_indices`; `n_cols + 1` entries.
    pub column_starts: Vec<usize>,
    /// Row of each stored entry, increasing within a column.
    pub row_indices: Vec<usize>,
    /// Stored values with explicit zeros, so that the pattern is independent of the data.
    pub values: Vec<f64>,
    /// Position in `values` of each triplet, in the order of filling.
    slots: Vec<usize>,
}

/// Row, column, value. Triplets at one place are added.
pub(crate) type Triplet = (usize, usize, f64);

impl Sparse {
    /// The matrix of the given shape from `triplets`.
    pub(crate) fn new(n_rows: usize, n_cols: usize, triplets: &[Triplet]) -> Self {
        let mut order: Vec<usize> = (0..triplets.len()).collect();
        order.sort_by_key(|&i| (triplets[i].1, triplets[i].0));
        let mut matrix = Self {
            n_rows,
            n_cols,
            column_starts: vec![0; n_cols + 1],
            slots: vec![0; triplets.len()],
            ..Self::default()
        };
        let mut last = None;
        for i in order {
            let (row, column, _) = triplets[i];
            if last != Some((row, column)) {
                last = Some((row, column));
                matrix.row_indices.push(row);
                matrix.column_starts[column + 1] += 1;
            }
            matrix.slots[i] = matrix.row_indices.len() - 1;
        }
        for column in 0..n_cols {
            matrix.column_starts[column + 1] += matrix.column_starts[column];
        }
        matrix.values = vec![0.0; matrix.row_indices.len()];
        matrix.fill(triplets);
        matrix
    }

    pub(crate) fn bytes(&self) -> usize {
        let indices = self.column_starts.capacity() + self.row_indices.capacity() + self.slots.capacity();
        size_of::<usize>() * indices + size_of::<f64>() * self.values.capacity()
    }

    /// Rewrites the values from triplets in the same order as at construction.
    pub(crate) fn fill(&mut self, triplets: &[Triplet]) {
        debug_assert_eq!(triplets.len(), self.slots.len(), "a program's pattern depends on its shape only");
        self.values.fill(0.0);
        for (&(row, _, value), &slot) in triplets.iter().zip(&self.slots) {
            debug_assert_eq!(row, self.row_indices[slot]);
            self.values[slot] += value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triplets_land_in_their_column_and_add_up() {
        let triplets = [(1, 0, 2.0), (0, 1, 3.0), (1, 0, 0.5), (0, 0, 0.0)];
        let mut matrix = Sparse::new(2, 2, &triplets);
        assert_eq!(matrix.column_starts, [0, 2, 3]);
        assert_eq!(matrix.row_indices, [0, 1, 0]);
        assert_eq!(matrix.values, [0.0, 2.5, 3.0]);
        matrix.fill(&[(1, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (0, 0, 4.0)]);
        assert_eq!(matrix.values, [4.0, 2.0, 1.0]);
    }
}
