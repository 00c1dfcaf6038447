//! What the crate promises, each claim with its oracle outside the code.

mod channel;
mod dynamics;
mod effects;
mod gas;
mod reproducible;
mod rig_file;
mod undeclared;

use twinlag_signal::{Gas, Record, Rig, Sensor, Signal};

/// A rig with the sensors of the reference record, 24 steps per sample.
fn rig(samples: usize, sample_period_s: f64, gas: Gas) -> Rig {
    rig_with(Record::new(samples, sample_period_s), gas, Sensor::new("T1", 0.0238))
}

/// The same with a first sensor to choose; the second is 0.1168 s.
fn rig_with(record: Record, gas: Gas, first: Sensor) -> Rig {
    Rig::new(1, record, gas, [first, Sensor::new("T2", 0.1168)]).expect("valid rig")
}

/// A record with no run-in and one step per sample: enough where the gas alone is looked at, or held.
fn coarse(samples: usize, sample_period_s: f64) -> Record {
    let mut record = Record::new(samples, sample_period_s);
    record.oversampling = 1;
    record.settle_s = Some(0.0);
    record
}

fn held(mean_c: f64, signal: Signal) -> Gas {
    let mut gas = Gas::new(mean_c, signal);
    gas.hold = twinlag_signal::Hold::ZeroOrder;
    gas
}

fn assert_close(what: &str, got: f64, want: f64, tol: f64) {
    assert!((got - want).abs() <= tol, "{what}: got {got:e}, want {want:e} ± {tol:e}");
}

fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64
}

/// Mean of `x[k] x[k + lag]`.
fn lagged(x: &[f64], lag: usize) -> f64 {
    let n = x.len() - lag;
    x[..n].iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / n as f64
}
