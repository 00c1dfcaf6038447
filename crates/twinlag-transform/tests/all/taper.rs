//! Tapers.

use twinlag_transform::{Tapered, hann, hann_between};

/// The closed forms: `Σ w = n/2` and `Σ w² = 3n/8`; between the zeros, of `n + 1`. Each of `n`
/// additions to a sum of up to `n/2` rounds by `ε/2` of it, and each term by a few `ε`.
#[test]
fn hann_has_the_mean_and_the_energy_of_its_closed_form() {
    for n in [5, 8, 257] {
        let tol = (0.25 * n as f64 + 4.0) * n as f64 * f64::EPSILON;
        for (window, length) in [(hann(n), n), (hann_between(n), n + 1)] {
            let (sum, length) = (window.iter().sum::<f64>(), length as f64);
            assert!((sum - 0.5 * length).abs() < tol, "{n}: sum {sum}");
            let energy = Tapered::new(window).energy();
            assert!((energy - 0.375 * length).abs() < tol, "{n}: energy {energy}");
        }
    }
}

#[test]
fn pieces_overlap_by_half() {
    let tapered = Tapered::new(hann(4));
    let values = [0, 1, 2, 3, 4, 5, 6, 7, 8];
    let pieces: Vec<&[i32]> = tapered.halves(&values).collect();
    assert_eq!(pieces, [&[0, 1, 2, 3][..], &[2, 3, 4, 5], &[4, 5, 6, 7]]);
}

/// A constant under Hann's taper: half the length at zero frequency, a quarter beside it, nothing
/// beyond.
#[test]
fn a_constant_leaks_into_the_next_bin_alone() {
    let n = 16;
    let spectrum = Tapered::new(hann(n)).transform(std::iter::repeat_n(1.0, n));
    let power: Vec<f64> = spectrum.iter().map(|x| x.norm()).collect();
    let tol = n as f64 * f64::EPSILON;
    assert!((power[0] - 8.0).abs() < tol && (power[1] - 4.0).abs() < tol, "{power:?}");
    assert!(power[2..].iter().all(|p| *p < tol), "{power:?}");
}
