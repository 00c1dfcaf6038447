//! Power at twice the frequencies, against a series with zeros after it.

use twinlag_transform::{Complex64, Forward, doubled_power};

/// Rounding of a transform is that of the sum of magnitudes times the depth of its recursion: 1e-12 of the energy is beyond it.
#[test]
fn the_frequencies_are_those_of_the_series_with_zeros_after_it() {
    for n in [2, 4, 6, 10, 64, 90, 1000] {
        let values: Vec<f64> = (0..n).map(|k| (f64::from(k * k) * 0.37).sin() + 0.2).collect();
        let padded = [&values[..], &vec![0.0; values.len()]].concat();
        let want: Vec<f64> = Forward::of(padded.len()).transform(&padded).iter().map(Complex64::norm_sqr).collect();
        let energy: f64 = values.iter().map(|v| v * v).sum::<f64>() * f64::from(n);
        let got = doubled_power(&values);
        assert_eq!(got.len(), want.len());
        for (j, (got, want)) in got.iter().zip(&want).enumerate() {
            assert!((got - want).abs() <= 1e-12 * energy, "{n} values, frequency {j}: got {got}, want {want}");
        }
    }
}
