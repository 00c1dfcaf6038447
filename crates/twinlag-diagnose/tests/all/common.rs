//! A rig that is quick to simulate and to diagnose, and what its truth is compared with.

use std::ops::ControlFlow;

use twinlag_diagnose::{
    Diagnosis, Identifier, JointDiagnosis, ModelError, ModelFit, Observations, Settings, Stretch, TimeConstant,
    diagnose, diagnose_records,
};
use twinlag_signal::{Adc, Gas, Noise, Record, Rig, Sensor, Series, Signal, Simulated, Turbulence};

pub(crate) const SAMPLES: usize = 3000;
pub(crate) const PERIOD_S: f64 = 0.001;
/// 12 and 60 samples.
pub(crate) const TAU_S: [f64; 2] = [0.012, 0.060];
/// Standard deviation of the gas, K.
pub(crate) const GAS_K: f64 = 20.0;
/// White noise of each channel: 0.5 % of the gas.
pub(crate) const NOISE_K: f64 = 0.1;
pub(crate) const SEED: u64 = 20;

/// Turbulence about 300 °C with a corner at 2.4 Hz, which excites both sensors (13 Hz and 2.7 Hz) over the 3 s of the record.
pub(crate) fn turbulence() -> Signal {
    Signal::Turbulence(Turbulence { std_k: GAS_K, corner_hz: 2.4, cutoff_hz: 200.0 })
}

/// Straight lines between temperatures that multiples of the golden ratio give, 57 or 93 K apart: a gas whose spectrum falls as `f⁻⁴`,
/// below the noise from some 10 Hz on, of the 500 Hz that are sampled.
pub(crate) fn ramps(seed: u64) -> Signal {
    let values_c = (0..11).map(|k| 150.0 * ((11 * seed + k) as f64 * 0.618_034).fract()).collect();
    Signal::Series(Series::Inline { values_c, period_s: 0.1 * SAMPLES as f64 * PERIOD_S })
}

/// The readings of the rig with whatever `change` does to its sensors.
pub(crate) fn readings(seed: u64, signal: Signal, change: impl FnOnce(&mut [Sensor; 2])) -> Simulated {
    let mut sensors = [Sensor::new("T1", TAU_S[0]), Sensor::new("T2", TAU_S[1])];
    for sensor in &mut sensors {
        sensor.noise = Some(Noise::white(NOISE_K));
    }
    change(&mut sensors);
    let rig = Rig::new(seed, Record::new(SAMPLES, PERIOD_S), Gas::new(300.0, signal), sensors).expect("a valid rig");
    rig.simulate().expect("a rig of finite numbers")
}

/// An unbroken record of evenly spaced samples.
pub(crate) fn even(t1_c: Vec<f64>, t2_c: Vec<f64>) -> Result<Observations, ModelError> {
    let time_s = (0..t1_c.len()).map(|k| k as f64 * PERIOD_S).collect();
    Observations::new(vec![Stretch::new(time_s, [t1_c, t2_c])], Some(PERIOD_S))
}

/// A record of the rig with whatever `change` does to its sensors, in turbulence.
pub(crate) fn record(seed: u64, change: impl FnOnce(&mut [Sensor; 2])) -> Observations {
    let simulated = readings(seed, turbulence(), change);
    even(simulated.t1_c, simulated.t2_c).expect("finite and long")
}

/// The diagnosis with nothing known.
pub(crate) fn found(observations: &Observations) -> Diagnosis {
    diagnose(observations, &Settings::default(), &|_, _, _| ControlFlow::Continue(()))
        .expect("a record that can be diagnosed")
}

/// The joint diagnosis of records of one rig, with nothing known.
pub(crate) fn joint(records: &[Observations]) -> JointDiagnosis {
    diagnose_records(records, &Settings::default(), &|_, _, _| ControlFlow::Continue(())).expect("records of one rig")
}

/// The diagnosis by someone who has never heard of `effect`.
pub(crate) fn found_without(observations: &Observations, effect: Identifier) -> Diagnosis {
    let effects = Identifier::ALL.into_iter().filter(|e| *e != effect).collect();
    let settings = Settings { effects, ..Settings::default() };
    diagnose(observations, &settings, &|_, _, _| ControlFlow::Continue(())).expect("a record that can be diagnosed")
}

/// What a failure prints: a diagnosis has thousands of numbers.
pub(crate) fn told(d: &Diagnosis) -> String {
    let tests: Vec<String> = d.last.tests.iter().map(|t| format!("{} p {:.1e}", t.test, t.p_value)).collect();
    format!(
        "{:?}\neffects {:#?}\nbase {:?}\nlast {:?}\nerror {:?}\ntests {tests:?}\nunexplained {:?}\nremarks {:?}",
        d.verdict, d.effects, d.base.time_constants, d.last.time_constants, d.error, d.unexplained, d.remarks
    )
}

/// Value and standard error, s.
pub(crate) fn estimate(time_constant: &TimeConstant) -> (f64, f64) {
    let value_s = time_constant.value_s.expect("this record determines both time constants");
    (value_s, time_constant.standard_error_s.expect("a fitted number has one"))
}

/// Asserts that both time constants are within four standard errors of the truth, beyond which normal estimates are once in
/// 16 000, and that these are of use: below 5 %.
pub(crate) fn recovers(fit: &ModelFit, truth_s: [f64; 2], told: &str) {
    for (time_constant, want) in fit.time_constants.iter().zip(truth_s) {
        let (got, error) = estimate(time_constant);
        assert!((got - want).abs() <= 4.0 * error, "got {got}, want {want} ± 4 × {error}: {told}");
        assert!(error > 0.0 && error < 0.05 * want, "standard error {error} of {want}: {told}");
    }
}

/// A converter of channel `i` that ends where a twentieth of its readings without the converter are above.
pub(crate) fn limited(seed: u64, i: usize) -> impl FnOnce(&mut [Sensor; 2]) {
    let free = readings(seed, turbulence(), |_| ());
    let mut sorted = [free.t1_c, free.t2_c][i].clone();
    sorted.sort_by(f64::total_cmp);
    let adc = Adc { high_c: Some(sorted[SAMPLES - SAMPLES / 20]), ..Adc::default() };
    move |sensors| sensors[i].adc = Some(adc)
}
