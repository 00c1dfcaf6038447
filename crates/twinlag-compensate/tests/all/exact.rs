//! That filter and smoother are the conditional expectation that they claim to be. The oracle is Gaussian conditioning on dense
//! covariance matrices in closed form: no state, no recursion, no series.

use nalgebra::{DMatrix, DVector};
use twinlag_compensate::{Form, Prior, Readings, Rig, Sensor, SensorAt, Term, reconstruct};

const TAU_S: [f64; 2] = [0.03, 0.11];
const NOISE_K: [f64; 2] = [0.4, 0.2];
const STD_K: f64 = 5.0;
const CORNER_HZ: f64 = 3.0;
const LEVEL_C: f64 = 100.0;

/// `E[x(t) y(t + s)]` of first-order noise of rate `a` and variance `v` and what a lag of rate `b` makes of it.
fn gas_and_sensor(v: f64, a: f64, b: f64, s: f64) -> f64 {
    if s <= 0.0 {
        v * b / (a + b) * (a * s).exp()
    } else {
        v * (b / (b - a) * (-a * s).exp() - 2.0 * a * b / (b * b - a * a) * (-b * s).exp())
    }
}

/// `E[y₁(t) y₂(t + s)]` of two lags.
fn sensors(v: f64, a: f64, [b1, b2]: [f64; 2], s: f64) -> f64 {
    if s < 0.0 {
        return sensors(v, a, [b2, b1], -s);
    }
    let with_gas = |b: f64| v * b / (a + b);
    let at_once = (b1 * with_gas(b2) + b2 * with_gas(b1)) / (b1 + b2);
    (-b2 * s).exp() * at_once + b2 * with_gas(b1) * ((-a * s).exp() - (-b2 * s).exp()) / (b2 - a)
}

struct Case {
    time_s: Vec<f64>,
    /// How much later the second channel is, s, and the channel whose clock the gas is wanted by.
    delay_s: f64,
    clock: usize,
    reading_c: [Vec<f64>; 2],
    missing: [Vec<bool>; 2],
}

/// Uneven instants with missing readings; what the readings are does not matter to the comparison.
fn case() -> Case {
    let n = 240;
    let mut time_s = vec![0.0];
    for k in 1..n {
        let step = 0.006 + 0.004 * (1.7 * f64::from(k)).sin() + if k == 150 { 0.1 } else { 0.0 };
        time_s.push(time_s[k as usize - 1] + step);
    }
    let reading = |i: usize| -> Vec<f64> {
        let phase = i as f64;
        time_s.iter().map(|t| LEVEL_C + 4.0 * (17.0 * t - phase).sin() + 0.5 * (301.0 * t + phase).cos()).collect()
    };
    let reading_c = [reading(0), reading(1)];
    let missing = [0, 1].map(|i| (0..n as usize).map(|k| (80..90).contains(&k) && i == 0 || k % 37 == 5).collect());
    Case { time_s, delay_s: 0.0, clock: 0, reading_c, missing }
}

/// Mean and standard deviation of the gas at each instant, given the readings before `allowed` of each instant.
fn conditioned(case: &Case, allowed: impl Fn(usize) -> usize) -> Vec<[f64; 2]> {
    let (v, a) = (STD_K * STD_K, std::f64::consts::TAU * CORNER_HZ);
    // In the time of the gas at the first sensor.
    let at_s = |i: usize, j: usize| case.time_s[j] - if i == 1 { case.delay_s } else { 0.0 };
    let rate = TAU_S.map(|tau| 1.0 / tau);
    (0..case.time_s.len())
        .map(|k| {
            let known: Vec<(usize, usize)> = (0..allowed(k).min(case.time_s.len()))
                .flat_map(|j| (0..2).map(move |i| (i, j)))
                .filter(|&(i, j)| !case.missing[i][j])
                .collect();
            let covariance = DMatrix::from_fn(known.len(), known.len(), |p, q| {
                let ((i, j), (m, l)) = (known[p], known[q]);
                let noise = if p == q { NOISE_K[i] * NOISE_K[i] } else { 0.0 };
                sensors(v, a, [rate[i], rate[m]], at_s(m, l) - at_s(i, j)) + noise
            });
            let with_gas = DVector::from_iterator(
                known.len(),
                known.iter().map(|&(i, j)| gas_and_sensor(v, a, rate[i], at_s(i, j) - at_s(case.clock, k))),
            );
            let y = DVector::from_iterator(known.len(), known.iter().map(|&(i, j)| case.reading_c[i][j] - LEVEL_C));
            let weights = covariance.cholesky().expect("a covariance").solve(&with_gas);
            [LEVEL_C + weights.dot(&y), (v - weights.dot(&with_gas)).sqrt()]
        })
        .collect()
}

/// The start is not the same: the smoother knows nothing of the bodies before the first reading, the oracle that they were in this
/// gas before. That is forgotten as `exp(−t/τ)` and by what is read since; instants from 0.7 s on, over six of the longer time
/// constants, are compared.
fn agrees(case: &Case, form: Form, allowed: impl Fn(usize) -> usize) {
    let sensors = [0, 1].map(|i| Sensor::new(TAU_S[i], NOISE_K[i]));
    let rig = Rig { delay_s: case.delay_s, clock: case.clock, ..Rig::new(sensors) };
    let prior = Prior { level_c: LEVEL_C, terms: vec![Term::Rough { std_k: STD_K, corner_hz: CORNER_HZ }] };
    let readings = Readings::with_missing(case.time_s.clone(), case.reading_c.clone(), case.missing.clone())
        .expect("good readings");
    let gas = reconstruct(&readings, &rig, &prior, form).expect("a good rig");
    let want = conditioned(case, allowed);
    for k in (0..case.time_s.len()).filter(|&k| case.time_s[k] > 0.7) {
        let [mean, std] = want[k];
        assert!((gas.gas_c[k] - mean).abs() < 1e-4, "{form:?} at {k}: {} , want {mean}", gas.gas_c[k]);
        assert!((gas.std_k[k] - std).abs() < 1e-4, "{form:?} at {k}: {} , want {std}", gas.std_k[k]);
    }
}

#[test]
fn the_smoother_is_the_conditional_expectation() {
    agrees(&case(), Form::Smoother, |_| usize::MAX);
}

#[test]
fn the_filter_is_the_conditional_expectation_of_what_was_read() {
    agrees(&case(), Form::Filter, |k| k + 1);
}

#[test]
fn a_fixed_lag_is_the_conditional_expectation_of_what_was_read_by_then() {
    agrees(&case(), Form::FixedLag(5), |k| k + 6);
}

/// Either channel's clock, and either channel the later one.
#[test]
fn a_delay_is_undone() {
    for (delay_s, clock) in [(0.013, 0), (0.013, 1), (-0.02, 0), (-0.02, 1)] {
        agrees(&Case { delay_s, clock, ..case() }, Form::Smoother, |_| usize::MAX);
    }
}

/// A sensor whose time constant is always twice what it is called, and one that loses a fixed part of what it is above the level: these
/// are a sensor of another time constant, and one of another time constant and gain, `τ/(1 + k)` and `1/(1 + k)`.
#[test]
fn what_a_sensor_does_along_the_record_is_what_it_would_do_anyway() {
    let case = case();
    let (factor, slope) = (2.0, 0.25);
    let prior = Prior { level_c: LEVEL_C, terms: vec![Term::Rough { std_k: STD_K, corner_hz: CORNER_HZ }] };
    let local = |tau_factor: f64, slope: f64, reading_c: &[f64]| -> Vec<SensorAt> {
        let each = reading_c.iter().map(|c| SensorAt { tau_factor, loss_k: slope * (c - LEVEL_C), loss_slope: slope });
        each.collect()
    };
    let locals = [local(factor, 0.0, &case.reading_c[0]), local(1.0, slope, &case.reading_c[1])];
    let readings = |reading_c: [Vec<f64>; 2]| Readings::new(case.time_s.clone(), reading_c).expect("good readings");
    let with = readings(case.reading_c.clone()).with_locals(locals).expect("one for each instant");
    let rig = Rig::new([0, 1].map(|i| Sensor::new(TAU_S[i], NOISE_K[i])));
    let got = reconstruct(&with, &rig, &prior, Form::Smoother).expect("a good rig");
    // The same gas seen by plain sensors: the second one's readings about the level are a fifth less, and so is its noise.
    let second = case.reading_c[1].iter().map(|c| LEVEL_C + (1.0 + slope) * (c - LEVEL_C)).collect();
    let plain = Rig::new([
        Sensor::new(factor * TAU_S[0], NOISE_K[0]),
        Sensor::new(TAU_S[1] / (1.0 + slope), NOISE_K[1] * (1.0 + slope)),
    ]);
    let want = reconstruct(&readings([case.reading_c[0].clone(), second]), &plain, &prior, Form::Smoother);
    let want = want.expect("a good rig");
    // Where the bodies were at first is not the same in both.
    for k in (0..case.time_s.len()).filter(|&k| case.time_s[k] > 0.9) {
        assert!((got.gas_c[k] - want.gas_c[k]).abs() < 1e-4, "at {k}: {}, want {}", got.gas_c[k], want.gas_c[k]);
        assert!((got.std_k[k] - want.std_k[k]).abs() < 1e-4, "at {k}: {}, want {}", got.std_k[k], want.std_k[k]);
    }
}
