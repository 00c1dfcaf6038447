//! The covariance of the published estimates against the scatter of many of them.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_bias::{Compensated, Hybrid, Noise, Normalised};
use twinlag_cross_relation::{CostValue, CrossRelation, Readings};
use twinlag_sensor::{Discretisation, FirstOrder, Lag, SecondOrder};

const PERIOD_S: f64 = 0.002;
const TAU_S: [f64; 2] = [0.0238, 0.1168];

/// Newton's method from the truth, over the `free` parameters: the minima lie close to it at this noise.
fn minimum<const P: usize>(truth: [f64; P], free: &[usize], evaluate: impl Fn(&[f64; P]) -> CostValue<P>) -> [f64; P] {
    let mut theta = truth;
    for _ in 0..30 {
        let c = evaluate(&theta);
        let hessian = DMatrix::from_fn(free.len(), free.len(), |p, q| c.hessian[free[p]][free[q]]);
        let gradient = DVector::from_fn(free.len(), |p, _| c.gradient[free[p]]);
        let step = hessian.lu().solve(&gradient).expect("regular");
        free.iter().zip(step.iter()).for_each(|(&i, s)| theta[i] -= s);
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
    let mut estimates: [Vec<[f64; 2]>; 3] = Default::default();
    let mut stated = [[0.0; 2]; 3];
    for _ in 0..trials {
        let [y1, y2] = [0, 1].map(|i| {
            let noise = || -> f64 { StandardNormal.sample(&mut rng) };
            clean[i].iter().zip(std::iter::repeat_with(noise)).map(|(y, e)| y + std_k[i] * e).collect::<Vec<f64>>()
        });
        let readings = Readings::even(&y1, &y2, PERIOD_S).expect("valid channels");
        let plain = || CrossRelation::new(&readings, 400).expect("long enough");
        let noise = || std_k.map(|s| Noise::white(s).expect("valid"));
        let compensated = Compensated::new(plain(), noise());
        let hybrid = Hybrid::new(plain(), noise()).expect("valid");
        let normalised = Normalised::with_ratio(plain(), std_k[1] / std_k[0]).expect("valid ratio");
        let minima = [
            minimum(TAU_S, &[0, 1], |t| compensated.evaluate(t)),
            minimum(TAU_S, &[0, 1], |t| normalised.evaluate(t)),
            minimum(TAU_S, &[0, 1], |t| hybrid.evaluate(t)),
        ];
        let covariances = [
            compensated.covariance(&minima[0], &[0, 1], std_k).expect("a minimum"),
            normalised.covariance(&minima[1], &[0, 1], std_k).expect("a minimum"),
            hybrid.covariance(&minima[2], &[0, 1], std_k).expect("a minimum"),
        ];
        for kind in 0..3 {
            estimates[kind].push(minima[kind]);
            for i in 0..2 {
                stated[kind][i] += covariances[kind][i][i] / f64::from(trials);
            }
        }
    }
    for (kind, name) in ["compensated", "normalised", "hybrid"].iter().enumerate() {
        for i in 0..2 {
            let mean = estimates[kind].iter().map(|e| e[i]).sum::<f64>() / f64::from(trials);
            let variance = estimates[kind].iter().map(|e| (e[i] - mean).powi(2)).sum::<f64>() / f64::from(trials - 1);
            let ratio = stated[kind][i] / variance;
            assert!((ratio - 1.0).abs() < 0.28, "{name}, sensor {}: stated over observed variance {ratio}", i + 1);
        }
    }
}

/// As above with sensors of second order, both time constants and the second one of sensor 2 free, the gas broad enough to
/// tell them apart. Same count, same tolerance.
#[test]
fn stated_variances_hold_for_sensors_of_second_order() {
    let (n, trials, std_k, free) = (1500, 400, [0.2, 0.15], [0, 1, 5]);
    let truth = [TAU_S[0], TAU_S[1], 1.0, 0.0, 0.004, 0.015];
    let tones = [(0.031, 5.0), (0.083, 6.0), (0.11, 9.0), (0.19, 8.0), (0.37, 9.0)];
    let gas: Vec<f64> = (0..n).map(|k| tones.iter().map(|(w, size)| size * (w * f64::from(k)).sin()).sum()).collect();
    let clean = [0, 1].map(|i| {
        let sensor = SecondOrder::new(truth[i], truth[4 + i], PERIOD_S).expect("valid sensor");
        sensor.difference_equation(Discretisation::ZeroOrderHold).expect("exists").respond(&gas)
    });
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut estimates: [Vec<[f64; 6]>; 2] = Default::default();
    let mut stated = [[0.0; 6]; 2];
    for _ in 0..trials {
        let [y1, y2] = [0, 1].map(|i| {
            let noise = || -> f64 { StandardNormal.sample(&mut rng) };
            clean[i].iter().zip(std::iter::repeat_with(noise)).map(|(y, e)| y + std_k[i] * e).collect::<Vec<f64>>()
        });
        let readings = Readings::even(&y1, &y2, PERIOD_S).expect("valid channels");
        let plain = || CrossRelation::new(&readings, 400).expect("long enough");
        let noise = || std_k.map(|s| Noise::white(s).expect("valid"));
        let compensated = Compensated::new(plain(), noise());
        let hybrid = Hybrid::new(plain(), noise()).expect("valid");
        let minima =
            [minimum(truth, &free, |t| compensated.evaluate(t)), minimum(truth, &free, |t| hybrid.evaluate(t))];
        let covariances = [
            compensated.covariance(&minima[0], &free, std_k).expect("a minimum"),
            hybrid.covariance(&minima[1], &free, std_k).expect("a minimum"),
        ];
        for kind in 0..2 {
            estimates[kind].push(minima[kind]);
            for i in free {
                stated[kind][i] += covariances[kind][i][i] / f64::from(trials);
            }
        }
    }
    for (kind, name) in ["compensated", "hybrid"].iter().enumerate() {
        for i in free {
            let mean = estimates[kind].iter().map(|e| e[i]).sum::<f64>() / f64::from(trials);
            let variance = estimates[kind].iter().map(|e| (e[i] - mean).powi(2)).sum::<f64>() / f64::from(trials - 1);
            let ratio = stated[kind][i] / variance;
            assert!((ratio - 1.0).abs() < 0.28, "{name}, parameter {i}: stated over observed variance {ratio}");
        }
    }
}
