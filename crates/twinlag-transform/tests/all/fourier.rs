//! Both directions of the Fourier transform.

use twinlag_transform::{Complex64, Forward, Inverse};

fn series(n: usize) -> Vec<f64> {
    (0..n).map(|k| (1.3 * k as f64).sin() + 0.2 * (0.7 * (k * k) as f64).cos()).collect()
}

/// Lengths even, odd, prime and composite, against the sum itself; `n` terms of at most 1.2, each
/// to `n` roundings of the angle.
#[test]
fn spectrum_is_the_sum_that_defines_it() {
    for n in [0, 1, 2, 3, 4, 7, 12, 97, 100, 256, 1031] {
        let x = series(n);
        let got = Forward::of(n).transform(&x);
        assert_eq!(got.len(), n / 2 + 1);
        for (j, got) in got.iter().enumerate() {
            let term = |k: usize| x[k] * Complex64::cis(-std::f64::consts::TAU * ((j * k) % n) as f64 / n as f64);
            let want: Complex64 = (0..n).map(term).sum();
            let tol = 4.0 * n as f64 * f64::EPSILON;
            assert!((got - want).norm() <= tol, "{n}, bin {j}: got {got}, want {want} ± {tol:e}");
        }
    }
}

#[test]
fn there_and_back_multiplies_by_the_length() {
    for n in [1, 2, 5, 64, 105] {
        let x = series(n);
        let back = Inverse::of(n).transform(Forward::of(n).transform(&x));
        for (got, want) in back.iter().zip(&x) {
            let tol = 4.0 * (n as f64) * f64::EPSILON;
            assert!((got / n as f64 - want).abs() < tol, "{n}: got {}, want {want} ± {tol:e}", got / n as f64);
        }
    }
}

#[test]
fn what_no_real_series_has_is_left_out() {
    let with_imaginary_ends = vec![Complex64::new(1.0, 9.0), Complex64::new(0.5, 0.5), Complex64::new(2.0, -9.0)];
    let without = vec![Complex64::new(1.0, 0.0), Complex64::new(0.5, 0.5), Complex64::new(2.0, 0.0)];
    let inverse = Inverse::of(4);
    assert_eq!(inverse.transform(with_imaginary_ends), inverse.transform(without));
}

/// Short of the length, and into buffers of the caller's: to the bit what the plain call gives.
#[test]
fn missing_values_are_zeros_and_buffers_may_be_used_again() {
    let plan = Forward::of(10);
    let mut padded = series(7);
    padded.resize(10, 0.0);
    let want = plan.transform(&padded);
    assert_eq!(plan.transform(&series(7)), want);
    let (mut spectrum, mut scratch) = (vec![Complex64::ZERO; plan.bins()], Vec::new());
    for _ in 0..2 {
        plan.transform_into(&mut padded.clone(), &mut spectrum, &mut scratch);
        assert_eq!(spectrum, want);
    }
}
