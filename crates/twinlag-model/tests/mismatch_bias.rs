//! The bias that gas which both sensors do not share makes of time constants, on rigs of `twinlag-signal`, which share no code with the
//! models.

use std::f64::consts::TAU;

use twinlag_model::{Effort, Fitted, Identifier, Observations, Prepared, Settings, Stretch, candidates, covariance};
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

/// With the true noise both time constants are too short in the mean of many records, and are not any more once the bias is removed.
#[test]
fn time_constants_are_not_too_short_for_gas_that_differs() {
    let settings = Settings { noise_std_k: Some([NOISE_K; 2]), ..Settings::default() };
    for odd in 0..2 {
        let mut mean = [[0.0; 2]; 2];
        for seed in 1..=RECORDS {
            let mut prepared = Prepared::new(&mismatched(seed, odd), &settings).expect("a record");
            let model = prepared.base(&settings).model;
            let [mismatch] = &candidates(&[Identifier::INPUT_MISMATCH], &prepared.context)[..] else {
                panic!("one form")
            };
            let start = [TAU_S[0], TAU_S[1], MISMATCH_K, 1.0 / (TAU * MISMATCH_CORNER_HZ)];
            let model = model.with(mismatch.clone());
            let (observations, everything) = (&prepared.observations, &prepared.everything);
            let biased = model.fit(&start, observations, everything, Effort::Finish);
            let free = biased.clone().without_mismatch_bias(observations, everything);
            assert!(free.is_mismatch_bias_removed);
            for (mean, fitted) in mean.iter_mut().zip([&biased, &free]) {
                let deviations = deviations(fitted, &prepared);
                mean.iter_mut().zip(deviations).for_each(|(mean, d)| *mean += d / RECORDS as f64);
            }
        }
        // Three standard errors of a mean of so many.
        let chance = 3.0 / (RECORDS as f64).sqrt();
        let [biased, free] = mean;
        assert!(biased.iter().all(|mean| *mean < -chance), "sensor {odd}: {biased:?}, chance {chance}");
        assert!(free.iter().all(|mean| mean.abs() < chance), "sensor {odd}: {free:?}, chance {chance}");
    }
}
