//! The compressed form against the full sum: cost, gradient, matrix, and what is promised of the minimum.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_cross_relation::{Form, Readings, Segment, Steps, Whitened};
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

fn cut(whole: &Readings, lengths: &[usize]) -> Vec<Segment> {
    let segment = &whole.segments()[0];
    let mut first = 0;
    let of_length = |length: &usize| {
        let range = first..first + length;
        first += length;
        let [y1, y2] = [segment.y1(), segment.y2()].map(|y| y[range.clone()].to_vec());
        Segment::new(y1, y2, Steps::Even(PERIOD_S)).expect("valid")
    };
    lengths.iter().map(of_length).collect()
}

/// Gaps make segments of many lengths, which share the bands of the longest: within the same bounds as those of one segment.
#[test]
fn segments_of_many_lengths_share_bands() {
    let noise_std = [0.5, 0.9];
    let whole = readings(3000, noise_std);
    let twice_as_slow = |segment: &Segment| {
        let [y1, y2] = [segment.y1(), segment.y2()].map(<[f64]>::to_vec);
        Segment::new(y1, y2, Steps::Even(2.0 * PERIOD_S)).expect("valid")
    };
    let mut of_two_periods = cut(&whole, &[50, 7, 31]);
    of_two_periods[1] = twice_as_slow(&of_two_periods[1]);
    let of_one = [&[700, 580][..], &[2, 2, 2], &[2, 3, 2, 5], &[50, 7, 2, 120, 3, 50, 31, 1500, 8]];
    for segments in of_one.into_iter().map(|lengths| cut(&whole, lengths)).chain([of_two_periods]) {
        let lengths: Vec<usize> = segments.iter().map(Segment::len).collect();
        let readings = Readings::new(segments).expect("valid");
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

/// Of more than half a million readings no bin is kept. Each cut into pieces of 131 072 samples takes one residual of unit variance
/// away and moves the few beside it: three cuts, ten in a sum of half a million.
#[test]
fn segments_of_long_records_share_bands() {
    let noise_std = [0.5, 0.9];
    let whole = readings(560_000, noise_std);
    for (lengths, off_at_most) in [(vec![2; 270_000], 1e-9), (vec![140_000, 300_000, 90_000, 2], 5.1e-5 + 2e-5)] {
        let readings = Readings::new(cut(&whole, &lengths)).expect("valid");
        let full = Whitened::new(&readings, Discretisation::ZeroOrderHold, noise_std).expect("valid");
        let compressed = full.clone().compressed(false);
        assert_eq!((full.form(), compressed.form()), (Form::Banded, Form::Compressed));
        let (got, want) = (compressed.evaluate(&TRUTH).value, full.evaluate(&TRUTH).value);
        assert!((got / want - 1.0).abs() <= off_at_most, "{} segments: {got} and {want}", lengths.len());
    }
}

/// Newton's iteration to the minimum of either form: they lie no further apart than the bound says, and the bound is small
/// enough to be of use.
#[test]
fn the_minimum_moves_by_less_than_the_bound() {
    let gapped = [300, 41, 2, 900, 41, 7, 1100];
    for (n, noise, lengths) in
        [(500, 0.5, &[500][..]), (2500, 0.5, &[2500]), (2500, 2.5, &[2500]), (2500, 0.5, &gapped), (2500, 2.5, &gapped)]
    {
        let readings = Readings::new(cut(&readings(n, [noise; 2]), lengths)).expect("valid");
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
