//! That a smoother with a changing intensity is the conditional expectation for it, and that the intensity is found where the gas
//! has one and nowhere else. The first oracle is Gaussian conditioning on dense covariance matrices in closed form; the gases of the
//! others are simulations of another crate.

use nalgebra::{DMatrix, DVector};
use twinlag_compensate::{
    Form, Intensity, Prior, Readings, Rig, Sensor, Term, learn, learn_intensity, reconstruct, reconstruct_with,
};
use twinlag_signal::{Gas, Noise, Plunge, Record, Rig as Simulation, Sensor as Simulated, Signal, Turbulence};

const TAU_S: [f64; 2] = [0.03, 0.11];
const NOISE_K: [f64; 2] = [0.4, 0.2];
const STD_K: f64 = 5.0;
const CORNER_HZ: f64 = 3.0;
const LEVEL_C: f64 = 100.0;

/// Exponentials whose sum is the response of the gas (0) or of a sensor (1, 2) to a blow on the gas: rates and sizes.
fn response(of: usize) -> Vec<[f64; 2]> {
    let a = std::f64::consts::TAU * CORNER_HZ;
    if of == 0 {
        return vec![[a, 1.0]];
    }
    let b = 1.0 / TAU_S[of - 1];
    vec![[a, b / (b - a)], [b, -b / (b - a)]]
}

/// Covariance of `first` at instant `j` and `second` at `l`: `∫ w(u) q h(t_j − u) g(t_l − u) du` over all blows before both, by
/// sums over the steps, in each of which the intensity `w` is constant; before the first instant it is one.
fn covariance(time_s: &[f64], factors: &[f64], [first, j]: [usize; 2], [second, l]: [usize; 2]) -> f64 {
    let q = 2.0 * std::f64::consts::TAU * CORNER_HZ * STD_K * STD_K;
    let mut sum = 0.0;
    for [alpha, h] in response(first) {
        for [beta, g] in response(second) {
            let rate = alpha + beta;
            let until = |t: f64| (rate * t - alpha * time_s[j] - beta * time_s[l]).exp() / rate;
            let steps = 1..=j.min(l);
            let blows =
                until(time_s[0]) + steps.map(|k| factors[k] * (until(time_s[k]) - until(time_s[k - 1]))).sum::<f64>();
            sum += q * h * g * blows;
        }
    }
    sum
}

/// As in `exact.rs` the smoother knows nothing of the bodies before the first reading, the oracle that they were in this gas before:
/// forgotten by 0.7 s. Intensities from 1/400 to 20, in steps and slopes; readings missing, instants uneven.
#[test]
fn the_smoother_is_the_conditional_expectation_for_an_intensity() {
    let n = 200;
    let mut time_s = vec![0.0];
    for k in 1..n {
        time_s.push(time_s[k - 1] + 0.007 + 0.003 * (1.7 * k as f64).sin());
    }
    let factors: Vec<f64> = (0..n)
        .map(|k| if (120..135).contains(&k) { 20.0 } else { (3.0 * (0.05 * k as f64).sin() - 3.0).exp() })
        .collect();
    let reading = |i: usize| -> Vec<f64> {
        time_s.iter().map(|t| LEVEL_C + 4.0 * (17.0 * t - i as f64).sin() + 0.5 * (301.0 * t).cos()).collect()
    };
    let missing: [Vec<bool>; 2] = [0, 1].map(|i| (0..n).map(|k| k % (31 + i) == 7).collect());
    let reading_c = [reading(0), reading(1)];
    let known: Vec<[usize; 2]> = (0..n).flat_map(|j| [[1, j], [2, j]]).filter(|&[i, j]| !missing[i - 1][j]).collect();
    let between = DMatrix::from_fn(known.len(), known.len(), |p, q| {
        let noise = if p == q { NOISE_K[known[p][0] - 1].powi(2) } else { 0.0 };
        covariance(&time_s, &factors, known[p], known[q]) + noise
    });
    let factor = between.cholesky().expect("a covariance");
    let y = DVector::from_iterator(known.len(), known.iter().map(|&[i, j]| reading_c[i - 1][j] - LEVEL_C));

    let readings = Readings::with_missing(time_s.clone(), reading_c, missing).expect("good readings");
    let rig = Rig::new([0, 1].map(|i| Sensor::new(TAU_S[i], NOISE_K[i])));
    let prior = Prior { level_c: LEVEL_C, terms: vec![Term::Rough { std_k: STD_K, corner_hz: CORNER_HZ }] };
    let intensity = Intensity::new(factors.clone()).expect("positive");
    let gas = reconstruct_with(&readings, &rig, &prior, &intensity, Form::Smoother).expect("a good rig");
    for k in (0..n).filter(|&k| time_s[k] > 0.7) {
        let with_gas =
            DVector::from_iterator(known.len(), known.iter().map(|&at| covariance(&time_s, &factors, [0, k], at)));
        let weights = factor.solve(&with_gas);
        let mean = LEVEL_C + weights.dot(&y);
        let std = (covariance(&time_s, &factors, [0, k], [0, k]) - weights.dot(&with_gas)).sqrt();
        assert!((gas.gas_c[k] - mean).abs() < 1e-4, "at {k}: {}, want {mean}", gas.gas_c[k]);
        assert!((gas.std_k[k] - std).abs() < 1e-4, "at {k}: {}, want {std}", gas.std_k[k]);
    }
}

/// A constant intensity of one changes nothing; of another value it is another standard deviation of the prior.
#[test]
fn a_constant_intensity_is_another_prior() {
    let time_s: Vec<f64> = (0..300).map(|k| 0.005 * f64::from(k)).collect();
    let wave = |lag_s: f64| time_s.iter().map(|t| LEVEL_C + 4.0 * (17.0 * (t - lag_s)).sin()).collect::<Vec<f64>>();
    let readings = Readings::new(time_s.clone(), [wave(0.03), wave(0.1)]).expect("good readings");
    let rig = Rig::new([0, 1].map(|i| Sensor::new(TAU_S[i], NOISE_K[i])));
    let prior = |std_k| Prior { level_c: LEVEL_C, terms: vec![Term::Rough { std_k, corner_hz: CORNER_HZ }] };
    let of = |std_k: f64, factor: f64| {
        let intensity = Intensity::new(vec![factor; 300]).expect("positive");
        reconstruct_with(&readings, &rig, &prior(std_k), &intensity, Form::Smoother).expect("a good rig")
    };
    let plain = reconstruct(&readings, &rig, &prior(STD_K), Form::Smoother).expect("a good rig");
    let (same, other) = (of(STD_K, 1.0), of(0.5 * STD_K, 4.0));
    // Rounding; the state before the first reading is the prior's, and forgotten.
    for k in 150..300 {
        assert!((plain.gas_c[k] - same.gas_c[k]).abs() < 1e-9 && (plain.std_k[k] - same.std_k[k]).abs() < 1e-9);
        assert!((plain.gas_c[k] - other.gas_c[k]).abs() < 1e-3 && (plain.std_k[k] - other.std_k[k]).abs() < 1e-3);
    }
}

struct Case {
    readings: Readings,
    rig: Rig,
    gas_c: Vec<f64>,
}

fn case(signal: Signal, seed: u64) -> Case {
    const NOISE_K: f64 = 0.2;
    let tau_s = [0.0238, 0.1168];
    let sensors = [0, 1].map(|i| {
        let mut sensor = Simulated::new(["T1", "T2"][i], tau_s[i]);
        sensor.noise = Some(Noise::white(NOISE_K));
        sensor
    });
    let sampling = Record::new(2000, 0.002);
    let record = Simulation::new(seed, sampling, Gas::new(300.0, signal), sensors).expect("a valid rig").simulate();
    let record = record.expect("finite numbers");
    let readings = Readings::new(record.time_s, [record.t1_c, record.t2_c]).expect("good readings");
    Case { readings, rig: Rig::new(tau_s.map(|tau_s| Sensor::new(tau_s, NOISE_K))), gas_c: record.gas_c }
}

/// Between plunges the gas rests: with the intensity of rest its error is smaller than with a constant one, and more of the jumps lie
/// inside their bands.
#[test]
fn a_gas_that_rests_and_jumps_has_an_intensity() {
    let case = case(Signal::Plunge(Plunge { amplitude_k: 17.0, dwell_s: 0.3, rise_s: 0.02 }), 4);
    let prior = learn(&case.readings, &case.rig).expect("long enough").prior;
    let intensity = learn_intensity(&case.readings, &case.rig, &prior).expect("a good rig").expect("it changes");
    let steady = reconstruct(&case.readings, &case.rig, &prior, Form::Smoother).expect("a good rig");
    let gas = reconstruct_with(&case.readings, &case.rig, &prior, &intensity, Form::Smoother).expect("a good rig");
    let rms = |gas_c: &[f64]| {
        let sum: f64 = gas_c.iter().zip(&case.gas_c).map(|(a, b)| (a - b) * (a - b)).sum();
        (sum / gas_c.len() as f64).sqrt()
    };
    // Of a gas that is driven a twentieth of the time, rest has a twentieth of the mean drive or less: with the error as the
    // 3/8th power of the drive (`S ∝ 1/f²`, noise `∝ f²`), a third of it, for most of the record. A tenth less in all is certain.
    assert!(rms(&gas.gas_c) < 0.9 * rms(&steady.gas_c), "{} of {}", rms(&gas.gas_c), rms(&steady.gas_c));
    let jumps = |k: &usize| (case.gas_c[(k + 1).min(1999)] - case.gas_c[k.saturating_sub(1)]).abs() > 1.0;
    let inside = |gas: &twinlag_compensate::Gas| {
        let at: Vec<usize> = (0..2000).filter(jumps).collect();
        let held = at.iter().filter(|&&k| (gas.gas_c[k] - case.gas_c[k]).abs() < 1.96 * gas.std_k[k]).count();
        held as f64 / at.len() as f64
    };
    // There are some ten jumps, within each of which errors go together: of ten with 95 % each inside the share scatters by
    // √(0.95 × 0.05/10) = 7 %, and is not three times that below.
    assert!(inside(&gas) > 0.74 && inside(&gas) > inside(&steady), "{} after {}", inside(&gas), inside(&steady));
}

/// A Gaussian gas has none: at odds of twenty to one, three of three.
#[test]
fn a_gaussian_gas_has_a_constant_intensity() {
    for seed in 1..4 {
        let case = case(Signal::Turbulence(Turbulence { std_k: 10.0, corner_hz: 3.0, cutoff_hz: 240.0 }), seed);
        let prior = learn(&case.readings, &case.rig).expect("long enough").prior;
        let intensity = learn_intensity(&case.readings, &case.rig, &prior).expect("a good rig");
        assert_eq!(intensity, None, "seed {seed}");
    }
}
