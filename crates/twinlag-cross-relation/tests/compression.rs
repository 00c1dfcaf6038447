//! The compressed form against the full sum: cost, gradient, matrix, and what is promised of the minimum.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_cross_relation::{Form, Readings, Whitened};
use twinlag_sensor::{Discretisation, FirstOrder};

const PERIOD_S: f64 = 0.002;
const TRUTH: [f64; 2] = [0.0238, 0.1168];

fn readings(n: usize, noise_std: [f64; 2]) -> Readings {
    let mut rng = ChaCha8Rng::seed_from_u64(n as u64);
    let gas: Vec<f64> = (0..n).map(|k| 15.0 * (0.11 * k as f64).sin() + 8.0 * (0.031 * k as f64).cos()).collect();
    let mut channel = |i: usize| -> Vec<f64> {
        let clean = FirstOrder::new(TRUTH[i], PERIOD_S).expect("valid sensor").respond(&gas);
        clean
            .iter()
            .map(|y| {
                let draw: f64 = StandardNormal.sample(&mut rng);
                y + noise_std[i] * draw
            })
            .collect()
    };
    let (y1, y2) = (channel(0), channel(1));
    Readings::even(&y1, &y2, PERIOD_S).expect("valid channels")
}

/// Each term of the sum is off by `1/T₆(3) = 5.1e-5` at most, all terms are positive, and so the sum is too. The gradient's
/// terms carry at most six times the relative error of `λ` more (their interpolants are differentiated); 1e-3 of its size
/// at the start of a fit, where no terms cancel.
#[test]
fn the_compressed_cost_is_within_its_bound_of_the_full_one() {
    for n in [10, 57, 500, 2500, 2503] {
        let noise_std = [0.5, 0.9];
        let readings = readings(n, noise_std);
        let full = Whitened::new(&readings, Discretisation::ZeroOrderHold, noise_std).expect("valid");
        let compressed = full.clone().compressed(true);
        assert_eq!(compressed.form(), Form::Compressed);
        for theta in [[0.0238, 0.1168, 1.0, 0.0], [0.001, 2.0, 1.1, 3.0], [0.3, 0.01, 0.9, -1.0]] {
            let (got, want) = (compressed.evaluate(&theta), full.evaluate(&theta));
            assert!(
                (got.value - want.value).abs() <= 5.1e-5 * want.value,
                "{n}, {theta:?}: {} {}",
                got.value,
                want.value
            );
            for i in 0..4 {
                let size = 2.0 * (0.5 * want.hessian[i][i] * want.value).sqrt();
                let off = (got.gradient[i] - want.gradient[i]).abs();
                assert!(off <= 1e-3 * size, "{n}, {theta:?}, {i}: off by {off:e} of {size:e}");
            }
        }
    }
}

/// Gaps make segments of many lengths, which share the bands of the longest: within the same bounds as those of one segment.
#[test]
fn segments_of_many_lengths_share_bands() {
    let noise_std = [0.5, 0.9];
    let whole = readings(3000, noise_std);
    let segment = &whole.segments()[0];
    let cut = |range: std::ops::Range<usize>| {
        let steps = twinlag_cross_relation::Steps::Even(PERIOD_S);
        twinlag_cross_relation::Segment::new(segment.y1()[range.clone()].to_vec(), segment.y2()[range].to_vec(), steps)
            .expect("valid")
    };
    let of_lengths = |lengths: &[usize]| {
        let mut first = 0;
        let mut segments = Vec::new();
        for length in lengths {
            segments.push(cut(first..first + length));
            first += length + 1;
        }
        Readings::new(segments).expect("valid")
    };
    for lengths in [&[700, 580][..], &[2, 2, 2], &[2, 3, 2, 5], &[50, 7, 2, 120, 3, 50, 31, 1500, 8]] {
        let readings = of_lengths(lengths);
        for hold in [Discretisation::ZeroOrderHold, Discretisation::Bilinear] {
            let full = Whitened::new(&readings, hold, noise_std).expect("valid");
            let compressed = full.clone().compressed(true);
            for theta in [[0.0238, 0.1168, 1.0, 0.0], [0.001, 2.0, 1.1, 3.0], [0.3, 0.01, 0.9, -1.0]] {
                let (got, want) = (compressed.evaluate(&theta), full.evaluate(&theta));
                let off = (got.value / want.value - 1.0).abs();
                assert!(off <= 5.1e-5, "{lengths:?}, {theta:?}: off by {off:e}");
                for i in 0..4 {
                    let size = 2.0 * (0.5 * want.hessian[i][i] * want.value).sqrt();
                    let off = (got.gradient[i] - want.gradient[i]).abs();
                    assert!(off <= 1e-3 * size, "{lengths:?}, {theta:?}, {i}: off by {off:e} of {size:e}");
                }
            }
        }
    }
}

/// Newton's iteration to the minimum of either form: they lie no further apart than the bound says, and the bound is small
/// enough to be of use.
#[test]
fn the_minimum_moves_by_less_than_the_bound() {
    for (n, noise) in [(500, 0.5), (2500, 0.5), (2500, 2.5)] {
        let readings = readings(n, [noise; 2]);
        let full = Whitened::new(&readings, Discretisation::ZeroOrderHold, [noise; 2]).expect("valid");
        let compressed = full.clone().compressed(false);
        let minimum = |cost: &Whitened<'_>| {
            let mut theta = TRUTH;
            for _ in 0..60 {
                let c = cost.evaluate(&theta);
                let [[a, b], [_, d]] = c.hessian;
                let det = a * d - b * b;
                theta[0] -= (d * c.gradient[0] - b * c.gradient[1]) / det;
                theta[1] -= (a * c.gradient[1] - b * c.gradient[0]) / det;
            }
            theta
        };
        let (got, want) = (minimum(&compressed), minimum(&full));
        let bound = compressed.shift_bound(&got, &[0, 1]);
        let covariance = full.cramer_rao(&want, &[0, 1]).expect("determined");
        for i in 0..2 {
            let shift = (got[i] - want[i]).abs() / covariance[i][i].sqrt();
            assert!(shift <= bound[i], "{n}, {noise}: moved {shift:e}, bound {:e}", bound[i]);
            assert!(bound[i] < 1e-2, "{n}, {noise}: bound {:e}", bound[i]);
        }
        assert_eq!(full.shift_bound(&want, &[0, 1]), [0.0; 2]);
    }
}
