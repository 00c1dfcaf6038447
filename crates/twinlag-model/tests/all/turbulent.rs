//! A record of two fast sensors in turbulence, by `twinlag-signal`, which shares no code with the models.

use twinlag_model::{Observations, Prepared, Settings, Stretch};
use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

pub(crate) const TAU_S: [f64; 2] = [0.012, 0.060];
pub(crate) const NOISE_K: f64 = 0.1;
const PERIOD_S: f64 = 0.001;
const SAMPLES: usize = 2000;

pub(crate) fn record() -> Prepared {
    let sensors = [("T1", TAU_S[0]), ("T2", TAU_S[1])].map(|(name, tau_s)| {
        let mut sensor = Sensor::new(name, tau_s);
        sensor.noise = Some(Noise::white(NOISE_K));
        sensor
    });
    let turbulence = Turbulence { std_k: 20.0, corner_hz: 2.4, cutoff_hz: 200.0 };
    let gas = Gas::new(300.0, Signal::Turbulence(turbulence));
    let rig = Rig::new(4, Record::new(SAMPLES, PERIOD_S), gas, sensors).expect("a rig");
    let simulated = rig.simulate().expect("finite numbers");
    let time_s = (0..SAMPLES).map(|k| k as f64 * PERIOD_S).collect();
    let stretch = Stretch::new(time_s, [simulated.t1_c, simulated.t2_c]);
    let observations = Observations::new(vec![stretch], Some(PERIOD_S)).expect("finite and long");
    Prepared::new(&observations, &Settings::default()).expect("a record")
}
