//! Products with a matrix most of whose entries are zero.

use nalgebra::{SMatrix, SVector};

/// The entries of a matrix that are not zero.
#[derive(Clone, Debug)]
pub(crate) struct Sparse {
    /// Row, column and value.
    entries: Vec<(usize, usize, f64)>,
}

impl Sparse {
    pub(crate) fn of<const D: usize>(matrix: &SMatrix<f64, D, D>) -> Self {
        let places = (0..D).flat_map(|row| (0..D).map(move |column| (row, column)));
        let entries = places.map(|(row, column)| (row, column, matrix[(row, column)]));
        Self { entries: entries.filter(|(_, _, value)| *value != 0.0).collect() }
    }

    /// `a x`.
    pub(crate) fn times<const D: usize>(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        let mut out = SVector::zeros();
        for &(row, column, value) in &self.entries {
            out[row] += value * x[column];
        }
        out
    }

    /// `a b aᵀ` of a symmetric `b`.
    pub(crate) fn around<const D: usize>(&self, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        // (b aᵀ)ᵀ aᵀ, column by column.
        self.transposed_after(&self.transposed_after(b).transpose())
    }

    /// `b aᵀ`.
    #[inline(never)]
    fn transposed_after<const D: usize>(&self, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let mut out = SMatrix::<f64, D, D>::zeros();
        for &(row, column, value) in &self.entries {
            let sums = &mut out.as_mut_slice()[row * D..][..D];
            for (sum, x) in sums.iter_mut().zip(&b.as_slice()[column * D..][..D]) {
                *sum += value * x;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products of small whole numbers are exact.
    #[test]
    fn products_are_those_of_the_dense_matrices() {
        let a =
            SMatrix::<f64, 4, 4>::new(2.0, 0.0, 0.0, -1.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0, 7.0, 1.0);
        let b = SMatrix::<f64, 4, 4>::from_fn(|i, j| (1 + i * j + i + j) as f64);
        let x = SVector::<f64, 4>::new(1.0, -2.0, 3.0, 4.0);
        let sparse = Sparse::of(&a);
        assert_eq!(sparse.around(&b), a * b * a.transpose());
        assert_eq!(sparse.times(&x), a * x);
        assert_eq!(Sparse::of(&a.transpose()).times(&x), a.transpose() * x);
    }
}
