//! Records of rigs, for the tests of the facade.

use twinlag::Characterisation;
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::signal::Rig;

/// The record of two sensors in a gas; `seed` of all random numbers, every `period_s`.
pub(crate) fn record(seed: u64, samples: usize, period_s: f64, gas: &str, sensors: [&str; 2]) -> Record {
    read(&rig(seed, samples, period_s, gas, sensors))
}

/// The rig of [`record`].
pub(crate) fn rig(seed: u64, samples: usize, period_s: f64, gas: &str, sensors: [&str; 2]) -> Rig {
    let [first, second] = sensors;
    let text = format!(
        "seed = {seed}\n[record]\nsamples = {samples}\nsample_period_s = {period_s}\n[gas]\nmean_c = 300.0\n{gas}\n\
         [[sensors]]\nchannel = \"T1\"\n{first}\n[[sensors]]\nchannel = \"T2\"\n{second}\n"
    );
    toml::from_str(&text).expect("a rig")
}

/// What the two sensors of `rig` read.
pub(crate) fn read(rig: &Rig) -> Record {
    let simulated = rig.simulate().expect("a sound rig");
    let channels = Channels {
        source: "a rig".into(),
        names: simulated.channels,
        time_s: simulated.time_s,
        t1_c: simulated.t1_c,
        t2_c: simulated.t2_c,
        reference_c: None,
    };
    Record::from_channels(channels, SamplingChoice::Auto).expect("a sound record")
}

/// The channels of a record, to be changed.
pub(crate) fn channels(record: &Record) -> Channels {
    Channels {
        source: record.source.clone(),
        names: record.channels.clone(),
        time_s: record.time_s.clone(),
        t1_c: record.t1_c.to_vec(),
        t2_c: record.t2_c.to_vec(),
        reference_c: None,
    }
}

/// Asserts that both time constants are within `errors` of their standard errors of `truth_s`.
pub(crate) fn recovers(answer: &Characterisation, truth_s: [f64; 2], errors: f64) {
    for (sensor, truth_s) in answer.sensors.iter().zip(truth_s) {
        let got = sensor.time_constant_s.expect("determined");
        let error = sensor.standard_error_s.expect("determined");
        assert!(
            (got - truth_s).abs() <= errors * error,
            "{}: got {got} s, want {truth_s} s ± {errors} × {error} s",
            sensor.channel
        );
    }
}
