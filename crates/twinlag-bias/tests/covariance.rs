//! The covariance of the published estimates against the scatter of many of them.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_bias::{Compensated, Noise, Normalised};
use twinlag_cross_relation::{CostValue, CrossRelation, Readings};
use twinlag_sensor::FirstOrder;

const PERIOD_S: f64 = 0.002;
const TAU_S: [f64; 2] = [0.0238, 0.1168];

/// Newton's method from the truth: the minima lie close to it at this noise.
fn minimum(evaluate: impl Fn(&[f64; 2]) -> CostValue<2>) -> [f64; 2] {
    let mut theta = TAU_S;
    for _ in 0..30 {
        let c = evaluate(&theta);
        let [[a, b], [_, d]] = c.hessian;
        let det = a * d - b * b;
        let step = [(d * c.gradient[0] - b * c.gradient[1]) / det, (a * c.gradient[1] - b * c.gradient[0]) / det];
        theta = [theta[0] - step[0], theta[1] - step[1]];
    }
    theta
}

/// 400 estimates of each kind: the variance of `400` Gaussian values has a relative standard error of `√(2/399) = 7.1 %`, the
/// mean of the stated variances a far smaller one. Four standard errors: 28 %.
#[test]
fn stated_variances_are_those_of_many_estimates() {
    let (n, trials, std_k) = (1500, 400, [0.5, 0.3]);
    let gas: Vec<f64> =
        (0..n).map(|k| 9.0 * (0.11 * f64::from(k)).sin() + 5.0 * (0.031 * f64::from(k)).cos()).collect();
    let clean = TAU_S.map(|tau| FirstOrder::new(tau, PERIOD_S).expect("valid sensor").respond(&gas));
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut estimates: [Vec<[f64; 2]>; 2] = Default::default();
    let mut stated = [[0.0; 2]; 2];
    for _ in 0..trials {
        let [y1, y2] = [0, 1].map(|i| {
            let noise = || -> f64 { StandardNormal.sample(&mut rng) };
            clean[i].iter().zip(std::iter::repeat_with(noise)).map(|(y, e)| y + std_k[i] * e).collect::<Vec<f64>>()
        });
        let readings = Readings::even(&y1, &y2, PERIOD_S).expect("valid channels");
        let plain = || CrossRelation::new(&readings, 400).expect("long enough");
        let compensated = Compensated::new(plain(), std_k.map(|s| Noise::white(s).expect("valid")));
        let normalised = Normalised::with_ratio(plain(), std_k[1] / std_k[0]).expect("valid ratio");
        let minima = [minimum(|t| compensated.evaluate(t)), minimum(|t| normalised.evaluate(t))];
        let covariances = [
            compensated.covariance(&minima[0], &[0, 1], std_k).expect("a minimum"),
            normalised.covariance(&minima[1], &[0, 1], std_k).expect("a minimum"),
        ];
        for kind in 0..2 {
            estimates[kind].push(minima[kind]);
            for i in 0..2 {
                stated[kind][i] += covariances[kind][i][i] / f64::from(trials);
            }
        }
    }
    for (kind, name) in ["compensated", "normalised"].iter().enumerate() {
        for i in 0..2 {
            let mean = estimates[kind].iter().map(|e| e[i]).sum::<f64>() / f64::from(trials);
            let variance = estimates[kind].iter().map(|e| (e[i] - mean).powi(2)).sum::<f64>() / f64::from(trials - 1);
            let ratio = stated[kind][i] / variance;
            assert!((ratio - 1.0).abs() < 0.28, "{name}, sensor {}: stated over observed variance {ratio}", i + 1);
        }
    }
}
