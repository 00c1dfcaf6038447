//! Gas that both sensors do not share: its size, and the bias of time constants that it makes, on rigs of `twinlag-signal`, which share
//! no code with the models.

use std::f64::consts::TAU;

use twinlag_model::{
    Bands, Effort, Fitted, Identifier, Observations, Place, Prepared, Settings, Stretch, candidates, covariance,
    fit_noise_again, noise_log_variances,
};
use twinlag_signal::{Gas, Mismatch, Noise, Record, Rig, Sensor, Signal, Turbulence};

const TAU_S: [f64; 2] = [0.1, 0.4];
const PERIOD_S: f64 = 0.02;
const NOISE_K: f64 = 0.05;
/// 5 % of what the gas moves.
const MISMATCH_K: f64 = 0.75;
const MISMATCH_CORNER_HZ: f64 = 0.8;
const RECORDS: u64 = 48;

/// A record whose sensor `odd` sees gas that the other does not.
fn mismatched(seed: u64, odd: usize) -> Observations {
    let sensors = TAU_S.map(|tau_s| {
        let mut sensor = Sensor::new(format!("{tau_s}"), tau_s);
        sensor.noise = Some(Noise::white(NOISE_K));
        sensor
    });
    let channel = sensors[odd].channel.clone();
    let gas = Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 0.4, cutoff_hz: 8.0 });
    let rig = Rig::new(seed, Record::new(2000, PERIOD_S), Gas::new(300.0, gas), sensors).expect("a rig");
    let mut mismatch = Mismatch::new(MISMATCH_K, MISMATCH_CORNER_HZ);
    mismatch.channel = Some(channel);
    let record = rig.with_mismatch(mismatch).expect("a rig").simulate().expect("a record");
    Observations::new(vec![Stretch::new(record.time_s, [record.t1_c, record.t2_c])], Some(PERIOD_S)).expect("a record")
}

/// Deviations of both time constants from the truth, in standard errors.
fn deviations(fitted: &Fitted, prepared: &Prepared) -> [f64; 2] {
    let covariance =
        covariance(fitted, &prepared.observations, &prepared.everything, false).expect("both are determined");
    [0, 1].map(|i| (fitted.theta[i] - TAU_S[i]) / covariance[i][i].sqrt())
}

/// What is known of the mismatch: its size, K, and its correlation time, s.
const NOISE: [f64; 2] = [MISMATCH_K, 1.0 / (TAU * MISMATCH_CORNER_HZ)];

/// A record whose sensor `odd` sees other gas, with levels that are known.
fn prepared(seed: u64, odd: usize) -> Prepared {
    let settings = Settings { noise_std_k: Some([NOISE_K; 2]), ..Settings::default() };
    Prepared::new(&mismatched(seed, odd), &settings).expect("a record")
}

/// Time constants fitted under the true noise.
fn with_true_noise(prepared: &mut Prepared) -> Fitted {
    let model = prepared.base(&Settings::default()).model;
    let [mismatch] = &candidates(&[Identifier::INPUT_MISMATCH], &prepared.context)[..] else { panic!("one form") };
    let start = [TAU_S[0], TAU_S[1], NOISE[0], NOISE[1]];
    model.with(mismatch.clone()).fit(&start, &prepared.observations, &prepared.everything, Effort::Finish)
}

/// With the true noise both time constants are too short in the mean of many records, and are not any more once the bias is removed.
#[test]
fn time_constants_are_not_too_short_for_gas_that_differs() {
    for odd in 0..2 {
        let mut mean = [[0.0; 2]; 2];
        for seed in 1..=RECORDS {
            let mut prepared = prepared(seed, odd);
            let biased = with_true_noise(&mut prepared);
            let free = biased.clone().without_mismatch_bias(&prepared.observations, &prepared.everything);
            assert!(free.is_mismatch_bias_removed);
            for (mean, fitted) in mean.iter_mut().zip([&biased, &free]) {
                let deviations = deviations(fitted, &prepared);
                mean.iter_mut().zip(deviations).for_each(|(mean, d)| *mean += d / RECORDS as f64);
            }
        }
        // Three standard errors of a mean of so many.
        let chance = 3.0 / (RECORDS as f64).sqrt();
        let [biased, free] = mean;
        println!(
            "gas of sensor {}, mean deviations: {biased:.2?} before and {free:.2?} standard errors after",
            odd + 1
        );
        assert!(biased.iter().all(|mean| *mean < -chance), "sensor {odd}: {biased:?}, chance {chance}");
        assert!(free.iter().all(|mean| mean.abs() < chance), "sensor {odd}: {free:?}, chance {chance}");
    }
}

/// The size and the correlation time of the mismatch, fitted to the residual, are as far from the truth as their errors say: the root
/// mean square of so many deviations is 1 within `1/√(2n)`, of which it may be four off.
#[test]
fn the_size_of_a_mismatch_is_as_certain_as_it_says() {
    let mut squares = [0.0; 2];
    for seed in 1..=RECORDS {
        let mut prepared = prepared(seed, 1);
        let fitted = with_true_noise(&mut prepared);
        let Prepared { observations, everything, levels, .. } = &prepared;
        let plant = fitted.model.plant(&fitted.theta, observations);
        let runs = fitted.model.residual_runs(&fitted.theta, observations, |sample| everything.holds(sample));
        let (bands, is_coarse) = (Bands::of(&runs), [false; 2]);
        let (_, extra) = fit_noise_again(&plant, Place::Gas, levels.std_k, observations, &bands, is_coarse)
            .expect("the model has a mismatch");
        let variances =
            noise_log_variances(&plant, Place::Gas, observations, &bands, is_coarse).expect("it is determined");
        let deviations = [extra.std_k, extra.correlation_s].map(f64::ln);
        for (i, square) in squares.iter_mut().enumerate() {
            *square += (deviations[i] - NOISE[i].ln()).powi(2) / variances[i] / RECORDS as f64;
        }
    }
    let rms = squares.map(f64::sqrt);
    println!("root mean square of deviations over their standard errors: {rms:.2?}");
    let chance = 4.0 / (2.0 * RECORDS as f64).sqrt();
    assert!(rms.iter().all(|rms| (rms - 1.0).abs() < chance), "{rms:?}, chance {chance}");
}
