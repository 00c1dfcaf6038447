//! The sine transform.

use twinlag_transform::sine_transform;

/// `n` products, each rounded with its angle.
#[test]
fn sine_transform_is_the_sum_that_defines_it_and_its_own_inverse() {
    for n in [1, 2, 3, 10, 33] {
        let x: Vec<f64> = (0..n).map(|k| (1.7 * k as f64).cos()).collect();
        let got = sine_transform(&x);
        let tol = 4.0 * (n + 1) as f64 * f64::EPSILON;
        for (j, got) in got.iter().enumerate() {
            let angle = |k: usize| std::f64::consts::PI * ((j + 1) * (k + 1)) as f64 / (n + 1) as f64;
            let want: f64 = (0..n).map(|k| x[k] * angle(k).sin()).sum();
            // The angle is up to `n π`, its sine so much less exact.
            assert!((got - want).abs() < n as f64 * tol, "{n}, {j}: got {got}, want {want} ± {tol:e}");
        }
        for (got, want) in sine_transform(&got).iter().zip(&x) {
            let got = got * 2.0 / (n + 1) as f64;
            assert!((got - want).abs() < tol, "{n}: got {got}, want {want} ± {tol:e}");
        }
    }
}

#[test]
fn sine_transform_of_nothing_is_nothing() {
    assert!(sine_transform(&[]).is_empty());
}
