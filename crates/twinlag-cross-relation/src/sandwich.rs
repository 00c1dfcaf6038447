//! The covariance of the minimum of a noisy cost.

use nalgebra::DMatrix;

/// `A⁻¹ M A⁻¹` over the `free` parameters, zero for the rest.
///
/// - `curvature`: `A`, half the expected Hessian of the cost, `[P][P]`
/// - `score`: `M`, the variance of half its gradient, `[P][P]`
///
/// `None` if `A` over the free parameters is not positive definite, or a variance comes out as
/// none. The parameters may differ by orders of magnitude: singular is judged after scaling to unit
/// diagonal.
///
/// ```
/// use twinlag_cross_relation::sandwich;
///
/// let (curvature, score) = ([[4.0, 2.0], [2.0, 9.0]], [[8.0, 0.0], [0.0, 1.0]]);
/// // With the second parameter held: 8/4². All numbers are exact in binary.
/// assert_eq!(sandwich(&curvature, &score, &[0]), Some([[0.5, 0.0], [0.0, 0.0]]));
/// // Where the cost does not rise there is no covariance.
/// assert_eq!(sandwich(&[[0.0]], &[[1.0]], &[0]), None);
/// ```
pub fn sandwich<const P: usize>(
    curvature: &[[f64; P]; P],
    score: &[[f64; P]; P],
    free: &[usize],
) -> Option<[[f64; P]; P]> {
    let scale: Vec<f64> = free.iter().map(|&i| curvature[i][i].sqrt()).collect();
    if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
        return None;
    }
    let scaled = |m: &[[f64; P]; P]| {
        DMatrix::from_fn(free.len(), free.len(), |p, q| m[free[p]][free[q]] / (scale[p] * scale[q]))
    };
    let inverse = scaled(curvature).cholesky()?.inverse();
    let covariance = &inverse * scaled(score) * &inverse;
    let mut out = [[0.0; P]; P];
    for (p, &i) in free.iter().enumerate() {
        for (q, &j) in free.iter().enumerate() {
            out[i][j] = covariance[(p, q)] / (scale[p] * scale[q]);
        }
    }
    free.iter().all(|&i| out[i][i].is_finite() && out[i][i] > 0.0).then_some(out)
}

/// `A⁻¹` over the `free` parameters, zero for the rest; `None` where [`sandwich`] returns `None`.
pub(crate) fn inverse<const P: usize>(curvature: &[[f64; P]; P], free: &[usize]) -> Option<[[f64; P]; P]> {
    sandwich(curvature, curvature, free)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With `M = A` the sandwich is the inverse: here of `[[4, 1], [1, 2]]`, times 1e6 in one
    /// parameter's units.
    #[test]
    fn with_equal_halves_it_is_the_inverse() {
        let a = [[4.0, 1e3, 7.0], [1e3, 2e6, 7.0], [7.0, 7.0, 7.0]];
        let got = sandwich(&a, &a, &[0, 1]).expect("positive definite");
        let want = [[2.0 / 7.0, -1e-3 / 7.0, 0.0], [-1e-3 / 7.0, 4e-6 / 7.0, 0.0], [0.0; 3]];
        for (got, want) in got.as_flattened().iter().zip(want.as_flattened()) {
            assert!((got - want).abs() <= 1e-14 * want.abs(), "got {got:e}, want {want:e}");
        }
    }

    #[test]
    fn a_saddle_has_no_covariance() {
        assert_eq!(sandwich(&[[1.0, 2.0], [2.0, 1.0]], &[[1.0, 0.0], [0.0, 1.0]], &[0, 1]), None);
        assert_eq!(sandwich(&[[0.0, 0.0], [0.0, 1.0]], &[[1.0, 0.0], [0.0, 1.0]], &[0, 1]), None);
    }
}
