//! Noise levels from the inferred inputs, on records whose signal moves from sample to sample as noise would.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_bias::{NoiseMoments, estimate_noise};
use twinlag_cross_relation::{Readings, inferred_inputs};
use twinlag_sensor::{Discretisation, FirstOrder};

const PERIOD_S: f64 = 0.002;
const TRUTH: [f64; 2] = [0.0238, 0.1168];

/// First-order random gas of standard deviation 11.7 K with a correlation time of 16 ms, and autoregressive noise.
fn record(rng: &mut ChaCha8Rng, noise_std: [f64; 2], ar1: f64) -> Readings {
    let mut draw = || -> f64 { StandardNormal.sample(rng) };
    let kept = (-PERIOD_S / 0.016_f64).exp();
    let mut gas = vec![11.7 * draw()];
    for k in 1..2500 {
        gas.push(kept * gas[k - 1] + 11.7 * (1.0 - kept * kept).sqrt() * draw());
    }
    let mut channel = |i: usize| -> Vec<f64> {
        let mut noise = noise_std[i] * draw();
        let fresh = noise_std[i] * (1.0 - ar1 * ar1).sqrt();
        let clean = FirstOrder::new(TRUTH[i], PERIOD_S).expect("valid sensor").respond(&gas);
        clean
            .iter()
            .map(|y| {
                let now = noise;
                noise = ar1 * noise + fresh * draw();
                y + now
            })
            .collect()
    };
    let (y1, y2) = (channel(0), channel(1));
    Readings::even(&y1, &y2, PERIOD_S).expect("valid channels")
}

fn moments(readings: &Readings) -> NoiseMoments {
    let inputs = inferred_inputs(readings, Discretisation::ZeroOrderHold, &TRUTH).expect("even sampling");
    NoiseMoments::new(&inputs).expect("long enough")
}

/// Over 200 records: the mean of the variances lies within 4 of its own standard errors of the truth, plus the 2 % by which
/// weights that know the moments they weigh pull; the scatter is that which is stated, to 4 times `√(2/200)/2` = 20 %.
/// Third differences of the fast channel are half too large here.
#[test]
fn levels_and_their_errors_are_right_where_third_differences_are_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let noise = [0.12, 0.12];
    let (mut sum, mut square, mut stated) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let records = 200;
    for _ in 0..records {
        let readings = record(&mut rng, noise, 0.0);
        let third = estimate_noise(&readings).expect("long enough");
        assert!(third[0].std_k > 1.4 * noise[0], "third differences give {}", third[0].std_k);
        let found = moments(&readings).levels(third.map(|l| l.std_k), [0.0; 2]).expect("a solution");
        for i in 0..2 {
            let variance = found.std_k[i] * found.std_k[i];
            sum[i] += variance / f64::from(records);
            square[i] += variance * variance / f64::from(records);
            stated[i] += found.covariance_k4[i][i].sqrt() / f64::from(records);
        }
    }
    for i in 0..2 {
        let (truth, scatter) = (noise[i] * noise[i], (square[i] - sum[i] * sum[i]).sqrt());
        let tol = 4.0 * scatter / f64::from(records).sqrt() + 0.02 * truth;
        assert!((sum[i] - truth).abs() < tol, "{i}: mean {} of {truth} ± {tol}", sum[i]);
        assert!((stated[i] / scatter - 1.0).abs() < 0.2, "{i}: scatter {scatter}, stated {}", stated[i]);
    }
}

/// The coefficient at which the misfit is least: the slow channel's, which the moments know to some 0.03.
#[test]
fn the_misfit_tells_the_colour() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let readings = record(&mut rng, [0.6, 0.6], 0.5);
    let moments = moments(&readings);
    let at = moments.levels([0.6, 0.6], [0.5, 0.5]).expect("a solution");
    let misfit = |phi: f64| moments.levels_weighed(at.std_k, [0.5, 0.5], [0.5, phi]).expect("a solution").misfit;
    let best = (0..39).map(|k| -0.95 + 0.05 * f64::from(k)).min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)));
    let best = best.expect("a grid");
    assert!((best - 0.5).abs() < 0.13, "least misfit at {best}");
    assert!(misfit(0.0) > misfit(0.5) + 50.0, "white noise fits as well: {} and {}", misfit(0.0), misfit(0.5));
}

#[test]
fn short_stretches_have_no_moments() {
    let y: Vec<f64> = (0..40).map(|k| f64::from(k % 7)).collect();
    let readings = Readings::even(&y, &y, PERIOD_S).expect("valid");
    let inputs = inferred_inputs(&readings, Discretisation::ZeroOrderHold, &TRUTH).expect("even sampling");
    assert!(NoiseMoments::new(&inputs).is_none());
}
