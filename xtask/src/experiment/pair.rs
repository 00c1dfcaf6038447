//! Two sensors with white noise in one gas, as the experiments of the gas temperature and of changing flow have them.

use serde::{Deserialize, Serialize};
use twinlag::signal::{Gas, Noise, Record as Sampling, Rig, Sensor, Signal};
use twinlag_study::Failure;

/// Mean of the gas, °C.
pub(super) const LEVEL_C: f64 = 300.0;
/// The first record that no trial is of.
pub(super) const OTHERS: u64 = 1 << 40;

/// A gas of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Named {
    pub(super) name: String,
    #[serde(flatten)]
    pub(super) signal: Signal,
}

/// The rig, its gas another one in each trial.
pub(super) fn rig(
    seed: u64,
    sampling: Sampling,
    gas: &Named,
    tau_s: [f64; 2],
    noise_std_k: Option<f64>,
) -> Result<Rig, Failure> {
    let sensors = [0, 1].map(|i| {
        let mut sensor = Sensor::new(["T1", "T2"][i], tau_s[i]);
        sensor.noise = noise_std_k.map(Noise::white);
        sensor
    });
    let mut signal = Gas::new(LEVEL_C, gas.signal.clone());
    signal.per_trial = true;
    Ok(Rig::new(seed, sampling, signal, sensors)?)
}

/// Standard deviation of the gas of `rig`, K, over so many records that no trial is of.
pub(super) fn gas_std_k(rig: &Rig, records: u64) -> Result<f64, Failure> {
    let mut sum = 0.0;
    for record in 0..records {
        let gas_c = rig.simulate_trial(OTHERS + record)?.gas_c;
        sum += gas_c.iter().map(|c| (c - LEVEL_C).powi(2)).sum::<f64>() / gas_c.len() as f64;
    }
    Ok((sum / records as f64).sqrt())
}
