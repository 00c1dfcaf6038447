//! What a missing row does to the derivatives of the residual: it takes what it would have said itself, and adds nothing.

use twinlag_model::{Identifier, Model, Observations, Prepared, Settings, Stretch, candidates};
use twinlag_signal::{Gas, Noise, Plunge, Record, Rig, Sensor, Signal};

const TAU_S: [f64; 2] = [0.03, 0.14];
const PERIOD_S: f64 = 0.005;
const SAMPLES: usize = 3000;
const NOISE_K: f64 = 0.3;
/// The row that is missing.
const MISSING: usize = 1500;
/// Rows on either side of it whose residuals it enters, or that are whitened with such residuals: five, of two lags and a delay, and as many.
const BESIDE: usize = 10;

/// Plunges into a hotter gas, as they are and with a row missing.
fn records() -> [Prepared; 2] {
    let sensors = [("T1", TAU_S[0]), ("T2", TAU_S[1])].map(|(name, tau_s)| {
        let mut sensor = Sensor::new(name, tau_s);
        sensor.noise = Some(Noise::white(NOISE_K));
        sensor
    });
    let gas = Gas::new(300.0, Signal::Plunge(Plunge { amplitude_k: 40.0, dwell_s: 1.0, rise_s: 0.005 }));
    let rig = Rig::new(3, Record::new(SAMPLES, PERIOD_S), gas, sensors).expect("a rig");
    let simulated = rig.simulate().expect("finite numbers");
    let time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64 * PERIOD_S).collect();
    [false, true].map(|is_missing| {
        let mut reading_c = [simulated.t1_c.clone(), simulated.t2_c.clone()];
        let mut stretch = Stretch::new(time_s.clone(), reading_c.clone());
        if is_missing {
            reading_c.iter_mut().for_each(|y| y[MISSING] = 0.5 * (y[MISSING - 1] + y[MISSING + 1]));
            let masked: Vec<bool> = (0..SAMPLES).map(|k| k == MISSING).collect();
            stretch = Stretch::new(time_s.clone(), reading_c).with_missing([masked.clone(), masked]);
        }
        let observations = Observations::new(vec![stretch], Some(PERIOD_S)).expect("finite and long");
        Prepared::new(&observations, &Settings::default()).expect("a record")
    })
}

/// Failed: where both readings of a row are missing, with noise that had next to no bound, the products of derivatives by a delay were
/// eleven times too large at -0.05 ms, where these readings enter the residual in nearly the same proportions.
#[test]
fn a_missing_row_adds_nothing_to_what_is_known_of_a_delay_of_next_to_none() {
    let [whole, lacking] = records();
    let mut context = whole.context.clone();
    context.tau_s = TAU_S;
    let delay = candidates(&[Identifier::DELAY], &context).remove(0);
    let model = Model::new(&[], [NOISE_K; 2]).with(delay);
    for hundredths in -4..=4 {
        let theta = [TAU_S[0], TAU_S[1], 0.0025 * f64::from(hundredths) * PERIOD_S];
        let of = |record: &Prepared| {
            let lin = model.linearised(&theta, &record.observations, &record.searched);
            let energy = |from: usize, to: usize| lin.columns[2][from..to].iter().map(|x| x * x).sum::<f64>();
            let place = lin.samples.runs().iter().flat_map(Clone::clone).position(|sample| sample == MISSING);
            let place = place.expect("a residual for each sample");
            (energy(0, lin.residual.len()), energy(place - BESIDE, place + BESIDE))
        };
        let ((of_whole, beside), (of_lacking, _)) = (of(&whole), of(&lacking));
        assert!((of_lacking - of_whole).abs() < beside, "{hundredths}: {of_lacking}, of a whole record {of_whole}");
    }
}
