//! Small dense linear algebra, by faer.

use faer::prelude::Solve;
use faer::{Mat, Side};

/// `Σ a b`, in four sums side by side.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 4;
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let done = n - n % LANES;
    let rest: f64 = a[done..].iter().zip(&b[done..]).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Products of columns with each other, `CᵀC`; an empty column has none.
pub fn gram(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = columns.len();
    let mut out = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            out[i][j] = dot(&columns[i], &columns[j]);
            out[j][i] = out[i][j];
        }
    }
    out
}

/// Inverse of a symmetric matrix that should be positive definite, scaled to unit diagonal first; rows and columns without
/// any weight stay zero. `None` where it is not positive definite.
///
/// ```
/// use twinlag_model::dense::{inverse, product};
///
/// // Scales may be far apart: it is the shape that decides.
/// let matrix = vec![vec![4e12, 1e6], vec![1e6, 1.0]];
/// let back = product(&matrix, &inverse(&matrix).expect("positive definite"));
/// // The unit matrix, each row in its own units: rounding only.
/// assert!((back[0][0] - 1.0).abs() < 1e-12 && (back[1][1] - 1.0).abs() < 1e-12);
/// assert_eq!(inverse(&[vec![1.0, 1.0], vec![1.0, 1.0]]), None);
/// assert_eq!(inverse(&[vec![1.0, 0.0], vec![0.0, -1.0]]), None);
/// ```
pub fn inverse(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = matrix.len();
    if (0..n).any(|i| matrix[i][i] < 0.0) {
        return None;
    }
    let used: Vec<usize> = (0..n).filter(|&i| matrix[i][i] > 0.0).collect();
    let scale: Vec<f64> = used.iter().map(|&i| matrix[i][i].sqrt()).collect();
    let scaled = Mat::from_fn(used.len(), used.len(), |p, q| matrix[used[p]][used[q]] / (scale[p] * scale[q]));
    let factor = scaled.llt(Side::Lower).ok()?;
    let identity = Mat::<f64>::identity(used.len(), used.len());
    let solved = factor.solve(&identity);
    let mut out = vec![vec![0.0; n]; n];
    for (p, &i) in used.iter().enumerate() {
        for (q, &j) in used.iter().enumerate() {
            out[i][j] = solved[(p, q)] / (scale[p] * scale[q]);
            // A diagonal this large after scaling is a direction that the data do not see.
            if !out[i][j].is_finite() || (p == q && solved[(p, q)] > 1e12) {
                return None;
            }
        }
    }
    Some(out)
}

/// Logarithm of the determinant of a positive definite matrix; `None` for another.
pub fn log_determinant(matrix: &[Vec<f64>]) -> Option<f64> {
    let n = matrix.len();
    let factor = Mat::from_fn(n, n, |p, q| matrix[p][q]).llt(Side::Lower).ok()?;
    Some((0..n).map(|i| 2.0 * factor.L()[(i, i)].ln()).sum())
}

/// Adds a matrix to another.
pub fn add(to: &mut [Vec<f64>], other: &[Vec<f64>]) {
    for (row, other) in to.iter_mut().zip(other) {
        row.iter_mut().zip(other).for_each(|(a, b)| *a += b);
    }
}

/// Product of a matrix with a vector.
pub fn times(matrix: &[Vec<f64>], vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, vector)).collect()
}

/// Product of two square matrices.
pub fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    (0..a.len()).map(|i| (0..b.len()).map(|j| (0..b.len()).map(|k| a[i][k] * b[k][j]).sum()).collect()).collect()
}
