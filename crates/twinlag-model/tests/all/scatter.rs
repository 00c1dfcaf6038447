//! What records of one rig differ where what the model leaves is not white, on rigs of `twinlag-signal`, which share no code with the
//! models.

use twinlag_model::{Observations, Settings, Stretch, fit_with};
use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

const TAU_S: [f64; 2] = [0.1, 0.4];
const PERIOD_S: f64 = 0.02;
const RECORDS: u64 = 40;

/// A record of the rig with noise of both sensors that remembers itself for ten samples, of which no effect is in the model.
fn coloured(seed: u64) -> Observations {
    let sensors = TAU_S.map(|tau_s| {
        let mut sensor = Sensor::new(format!("{tau_s}"), tau_s);
        sensor.noise = Some(Noise { std_k: 0.05, ar1: 0.9 });
        sensor
    });
    let gas = Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 0.4, cutoff_hz: 8.0 });
    let rig = Rig::new(seed, Record::new(1500, PERIOD_S), Gas::new(300.0, gas), sensors).expect("a rig");
    let record = rig.simulate().expect("a record");
    Observations::new(vec![Stretch::new(record.time_s, [record.t1_c, record.t2_c])], Some(PERIOD_S)).expect("a record")
}

/// Records of one rig scatter by their standard errors: the root mean square of `n − 1` deviations is 1 within `1/√(2(n−1))`, of which it
/// may be four off. Failed: standard errors of records were those of white noise where that of the joint estimate was not.
#[test]
fn records_with_coloured_noise_scatter_by_their_standard_errors() {
    let records: Vec<Observations> = (1..=RECORDS).map(coloured).collect();
    let together = Observations::joined(&records).expect("records of one rig");
    let fit = fit_with(&together, &Settings::default(), &[]).expect("both are determined").fit;
    assert!(fit.is_weighted_by_residual, "{:?}", fit.tests);
    let between = fit.between.expect("several records");
    let chance = 4.0 / (2.0 * (RECORDS - 1) as f64).sqrt();
    for (parameter, tau_s) in between.parameters[..2].iter().zip(TAU_S) {
        let parameter = parameter.as_ref().expect("every record determines it");
        println!(
            "{tau_s} s: {:.5} ± {:.5} s, scatter {:.2} standard errors",
            parameter.mean, parameter.standard_error, parameter.ratio
        );
        assert!((parameter.ratio - 1.0).abs() < chance, "{tau_s} s: {}, chance {chance}", parameter.ratio);
    }
}
