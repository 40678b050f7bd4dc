use rayon::prelude::*;

/// A sparse matrix by rows; columns rise within a row.
#[derive(Clone, Debug)]
pub(crate) struct Sparse {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    n_columns: usize,
}

/// An entry of a matrix: row, column, value.
pub(crate) type Entry = (u32, u32, f64);

/// Rows that one thread takes at a time: fewer cost more than they save.
const CHUNK: usize = 4096;

impl Sparse {
    /// Sums up entries of the same place, in their order.
    pub(crate) fn of_entries(n_rows: usize, n_columns: usize, entries: &[Entry]) -> Self {
        let mut starts = vec![0; n_rows + 1];
        for &(row, ..) in entries {
            starts[row as usize + 1] += 1;
        }
        for row in 0..n_rows {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut sorted = vec![(0u32, 0.0); entries.len()];
        for &(row, column, value) in entries {
            sorted[next[row as usize]] = (column, value);
            next[row as usize] += 1;
        }
        let rows = (0..n_rows).map(|row| {
            let mut row = sorted[starts[row]..starts[row + 1]].to_vec();
            row.sort_by_key(|e| e.0);
            row.dedup_by(|later, first| {
                let same = later.0 == first.0;
                if same {
                    first.1 += later.1;
                }
                same
            });
            row
        });
        Self::of_rows(n_columns, rows)
    }

    fn of_rows(n_columns: usize, rows: impl Iterator<Item = Vec<(u32, f64)>>) -> Self {
        let mut this = Self { starts: vec![0], columns: Vec::new(), values: Vec::new(), n_columns };
        for row in rows {
            for (column, value) in row {
                this.columns.push(column);
                this.values.push(value);
            }
            this.starts.push(this.columns.len());
        }
        this
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns and values of a row.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let range = self.starts[row]..self.starts[row + 1];
        self.columns[range.clone()].iter().map(|&c| c as usize).zip(self.values[range].iter().copied())
    }

    /// The entries on the diagonal; 0 where there is none.
    pub(crate) fn diagonal(&self) -> Vec<f64> {
        (0..self.n_rows()).map(|r| self.row(r).find(|e| e.0 == r).map_or(0.0, |e| e.1)).collect()
    }

    /// Product of a row with a vector.
    pub(crate) fn row_times(&self, row: usize, x: &[f64]) -> f64 {
        self.row(row).fold(0.0, |sum, (column, value)| sum + value * x[column])
    }

    /// Product with a vector; the same with any number of threads.
    pub(crate) fn times(&self, x: &[f64]) -> Vec<f64> {
        (0..self.n_rows()).into_par_iter().with_min_len(CHUNK).map(|row| self.row_times(row, x)).collect()
    }

    pub(crate) fn transposed(&self) -> Self {
        let entries: Vec<Entry> = (0..self.n_rows())
            .flat_map(|row| self.row(row).map(move |(column, value)| (column as u32, row as u32, value)))
            .collect();
        Self::of_entries(self.n_columns, self.n_rows(), &entries)
    }

    /// Product of two matrices.
    pub(crate) fn product(&self, other: &Self) -> Self {
        // Where each column of the row at hand is in the list of its entries.
        let mut at = vec![u32::MAX; other.n_columns];
        let rows = (0..self.n_rows()).map(|row| {
            let mut entries: Vec<(u32, f64)> = Vec::new();
            for (middle, a) in self.row(row) {
                for (column, b) in other.row(middle) {
                    match at[column] {
                        u32::MAX => {
                            at[column] = entries.len() as u32;
                            entries.push((column as u32, a * b));
                        }
                        k => entries[k as usize].1 += a * b,
                    }
                }
            }
            entries.iter().for_each(|e| at[e.0 as usize] = u32::MAX);
            entries.sort_by_key(|e| e.0);
            entries
        });
        Self::of_rows(other.n_columns, rows)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/harmonic/sparse.rs"]
mod tests;
