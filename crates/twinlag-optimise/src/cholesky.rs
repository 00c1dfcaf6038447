//! `A x = b` for a small symmetric positive definite `A`, in place and without allocating: fits of
//! two variables take microseconds, in which a heap matrix for each step is felt.

/// Replaces `b` by `A⁻¹ b` (`A`: `[n][n]` in one slice, of which the lower triangle is used and
/// overwritten). `None` if `A` is not positive definite; `b` is then spoilt.
pub(crate) fn solve(a: &mut [f64], b: &mut [f64]) -> Option<()> {
    let n = b.len();
    for j in 0..n {
        for i in j..n {
            let inner: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            a[i * n + j] -= inner;
        }
        let pivot = a[j * n + j];
        if pivot <= 0.0 || pivot.is_nan() {
            return None;
        }
        let root = pivot.sqrt();
        (j..n).for_each(|i| a[i * n + j] /= root);
    }
    for i in 0..n {
        let inner: f64 = (0..i).map(|k| a[i * n + k] * b[k]).sum();
        b[i] = (b[i] - inner) / a[i * n + i];
    }
    for i in (0..n).rev() {
        let inner: f64 = (i + 1..n).map(|k| a[k * n + i] * b[k]).sum();
        b[i] = (b[i] - inner) / a[i * n + i];
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::solve;

    /// `A = M Mᵀ + I` has its smallest eigenvalue above one and its largest below 1 + n², so the
    /// two solutions agree to n³ ε = 1e-13 with room to spare.
    #[test]
    fn the_solution_is_that_of_nalgebra() {
        for n in 1..6 {
            let m = DMatrix::from_fn(n, n, |i, j| ((3 * i + 7 * j * j + 1) as f64).sin());
            let a = &m * m.transpose() + DMatrix::identity(n, n);
            let b = DVector::from_fn(n, |i, _| (i as f64 + 0.5).cos());
            let want = a.clone().cholesky().expect("positive definite").solve(&b);
            let (mut flat, mut got) = (a.as_slice().to_vec(), b.as_slice().to_vec());
            solve(&mut flat, &mut got).expect("positive definite");
            for (got, want) in got.iter().zip(want.iter()) {
                assert!((got - want).abs() < 1e-13, "n = {n}: got {got:e}, want {want:e} ± 1e-13");
            }
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        for mut a in [[1.0, 2.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0], [f64::NAN, 0.0, 0.0, 1.0]] {
            assert_eq!(solve(&mut a, &mut [1.0, 1.0]), None);
        }
    }
}
