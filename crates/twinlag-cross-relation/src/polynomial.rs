//! Short filters as polynomials on the stack.

use num_dual::DualNum;

/// Coefficients that the longest filter has: two second-order sensors under the first-order hold,
/// second-order noise on both channels.
pub(crate) const MAX_COEFFICIENTS: usize = 9;

/// A filter of at most [`MAX_COEFFICIENTS`] coefficients, oldest sample first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polynomial<D> {
    coefficients: [D; MAX_COEFFICIENTS],
    len: usize,
}

impl<D: DualNum<Primitive = f64> + Copy> Polynomial<D> {
    /// From coefficients of `x[k], x[k−1], …`.
    pub(crate) fn oldest_first(newest_first: impl IntoIterator<Item = D>) -> Self {
        let mut out = Self { coefficients: [D::from(0.0); MAX_COEFFICIENTS], len: 0 };
        for c in newest_first {
            out.coefficients[out.len] = c;
            out.len += 1;
        }
        out.coefficients[..out.len].reverse();
        out
    }

    pub(crate) fn as_slice(&self) -> &[D] {
        &self.coefficients[..self.len]
    }

    pub(crate) fn sum(&self) -> D {
        self.as_slice().iter().fold(D::from(0.0), |sum, &c| sum + c)
    }

    pub(crate) fn scaled(mut self, by: D) -> Self {
        self.coefficients[..self.len].iter_mut().for_each(|c| *c *= by);
        self
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut out = Self { coefficients: [D::from(0.0); MAX_COEFFICIENTS], len: self.len + other.len - 1 };
        for (i, &a) in self.as_slice().iter().enumerate() {
            for (j, &b) in other.as_slice().iter().enumerate() {
                out.coefficients[i + j] += a * b;
            }
        }
        out
    }

    /// `g (1 + z⁻¹)ᵐ` with `count` factors taken out, for `m` up to 1.
    pub(crate) fn without_sums(self, count: usize) -> Self {
        if count == 0 { self } else { Self { len: self.len - count, ..self } }
    }
}
