//! How values depend on the readings of a channel: weights of a few neighbouring samples for each value.

use crate::number::Real;

/// The derivatives of each value with respect to the readings: row `k` belongs to the samples `start + k …`.
#[derive(Clone, Debug)]
pub(crate) struct Rows<T> {
    /// Weights in a row.
    pub(crate) width: usize,
    /// The sample that the first weight of row 0 belongs to.
    pub(crate) start: usize,
    /// One row if all are the same, otherwise all of them.
    weights: Vec<T>,
    is_same: bool,
    /// Memory that the next rows are written to.
    spare: Vec<T>,
}

impl<T: Real> Rows<T> {
    /// Of readings as they are.
    pub(crate) fn identity() -> Self {
        Self { width: 1, start: 0, weights: vec![T::from(1.0)], is_same: true, spare: Vec::new() }
    }

    /// Begins again with readings as they are.
    pub(crate) fn begin(&mut self) {
        (self.width, self.start, self.is_same) = (1, 0, true);
        self.weights.clear();
        self.weights.push(T::from(1.0));
    }

    /// Becomes a copy of `other`, in its own memory.
    pub(crate) fn copy(&mut self, other: &Self) {
        (self.width, self.start, self.is_same) = (other.width, other.start, other.is_same);
        self.weights.clear();
        self.weights.extend_from_slice(&other.weights);
    }

    /// Row `k`.
    pub(crate) fn at(&self, k: usize) -> &[T] {
        let from = if self.is_same { 0 } else { k * self.width };
        &self.weights[from..from + self.width]
    }

    /// Whether all rows are the same.
    pub(crate) fn is_same(&self) -> bool {
        self.is_same
    }

    /// Whether no weight has a derivative.
    pub(crate) fn is_constant(&self) -> bool {
        self.weights.iter().all(|w| w.number().eps == 0.0)
    }

    /// Each row times its own factor.
    pub(crate) fn scale_each(&mut self, factors: &[T]) {
        self.spare.clear();
        for (k, factor) in factors.iter().enumerate() {
            let from = if self.is_same { 0 } else { k * self.width };
            self.spare.extend(self.weights[from..from + self.width].iter().map(|w| *w * *factor));
        }
        std::mem::swap(&mut self.weights, &mut self.spare);
        self.is_same = false;
    }

    /// All rows times one factor.
    pub(crate) fn scale(&mut self, factor: T) {
        self.weights.iter_mut().for_each(|w| *w *= factor);
    }

    /// Becomes `a + factor · b` for `values` values, in its own memory.
    pub(crate) fn sum(&mut self, a: &Self, b: &Self, factor: T, values: usize) {
        self.start = a.start.min(b.start);
        self.width = (a.start + a.width).max(b.start + b.width) - self.start;
        self.is_same = a.is_same && b.is_same;
        let count = if self.is_same { 1 } else { values };
        self.weights.clear();
        self.weights.resize(count * self.width, T::from(0.0));
        for (k, row) in self.weights.chunks_exact_mut(self.width).enumerate() {
            for (w, more) in row[a.start - self.start..].iter_mut().zip(a.at(k)) {
                *w += *more;
            }
            for (w, more) in row[b.start - self.start..].iter_mut().zip(b.at(k)) {
                *w += *more * factor;
            }
        }
    }

    /// Of `Σ_j taps[j] · v[k + j]`, which has `values` values.
    pub(crate) fn combine_values(&mut self, values: usize, taps: &[T]) {
        let count = if self.is_same { 1 } else { values };
        self.combine(count, taps.len(), |_, j| taps[j]);
    }

    /// Of `Σ_j taps[j] · v[k + j]` where all rows are the same, and of three taps.
    pub(crate) fn combine_same(&mut self, taps: &[T; 3]) {
        // As many values as there are rows, less two.
        let values = if self.is_same { 1 } else { self.weights.len() / self.width - 2 };
        self.combine_values(values, taps);
    }

    /// Of `Σ_j taps[k][j] · v[k + j]`, `length` taps for each of `values` values.
    pub(crate) fn combine_each(&mut self, values: usize, length: usize, taps: &[T]) {
        self.combine(values, length, |k, j| taps[k * length + j]);
        self.is_same = false;
    }

    fn combine(&mut self, count: usize, length: usize, tap: impl Fn(usize, usize) -> T) {
        // A factor has two taps on uneven samples and three on even ones.
        match (self.width, length) {
            (1, 2) => self.combine_known::<1, 2>(count, tap),
            (2, 2) => self.combine_known::<2, 2>(count, tap),
            (3, 2) => self.combine_known::<3, 2>(count, tap),
            (4, 2) => self.combine_known::<4, 2>(count, tap),
            (5, 2) => self.combine_known::<5, 2>(count, tap),
            (6, 2) => self.combine_known::<6, 2>(count, tap),
            (1, 3) => self.combine_known::<1, 3>(count, tap),
            (3, 3) => self.combine_known::<3, 3>(count, tap),
            (4, 3) => self.combine_known::<4, 3>(count, tap),
            (5, 3) => self.combine_known::<5, 3>(count, tap),
            (6, 3) => self.combine_known::<6, 3>(count, tap),
            _ => self.combine_any(count, length, tap),
        }
    }

    /// Of rows of `W` weights and `L` taps, at most as many together as are kept in registers.
    fn combine_known<const W: usize, const L: usize>(&mut self, count: usize, tap: impl Fn(usize, usize) -> T) {
        const MOST: usize = 8;
        let step = if self.is_same { 0 } else { W };
        self.spare.clear();
        self.spare.reserve(count * (W + L - 1));
        for k in 0..count {
            let mut sums = [T::from(0.0); MOST];
            for j in 0..L {
                let tap = tap(k, j);
                let old: &[T; W] = self.weights[(k + j) * step..].first_chunk().expect("a row for each tap");
                for (new, old) in sums[j..].iter_mut().zip(old) {
                    *new += tap * *old;
                }
            }
            self.spare.extend_from_slice(&sums[..W + L - 1]);
        }
        std::mem::swap(&mut self.weights, &mut self.spare);
        self.width = W + L - 1;
    }

    fn combine_any(&mut self, count: usize, length: usize, tap: impl Fn(usize, usize) -> T) {
        let width = self.width + length - 1;
        self.spare.clear();
        self.spare.resize(count * width, T::from(0.0));
        for (k, row) in self.spare.chunks_exact_mut(width).enumerate() {
            for j in 0..length {
                let tap = tap(k, j);
                let from = if self.is_same { 0 } else { (k + j) * self.width };
                for (new, old) in row[j..].iter_mut().zip(&self.weights[from..from + self.width]) {
                    *new += tap * *old;
                }
            }
        }
        std::mem::swap(&mut self.weights, &mut self.spare);
        self.width = width;
    }

    /// Leaves the first `values` out: row 0 is then that of value `values`.
    pub(crate) fn skip(&mut self, values: usize) {
        if !self.is_same {
            self.weights.drain(..values * self.width);
        }
        self.start += values;
    }

    /// Of `v[k+1] − ρ v[k]`, which has `values` values.
    pub(crate) fn difference(&mut self, rho: f64, values: usize) {
        self.combine_values(values, &[T::from(-rho), T::from(1.0)]);
    }
}
