//! Records of flow that changes, for tests.

use std::f64::consts::TAU;

use crate::fit::Fitted;
use crate::known::{Known, KnownNumbers};
use crate::observations::{Observations, Stretch};
use crate::prepare::Prepared;
use crate::selection::Selection;
use crate::settings::Settings;
use crate::track::Tracker;

/// Time constants, s; samples are 1 s apart.
pub(crate) const TAU_S: [f64; 2] = [1.5, 4.0];
const NOISE_K: f64 = 0.05;
const STEPS_PER_SAMPLE: usize = 16;

/// Tones of up to a fifth of the sampling rate through both lags, whose time constants have `factor` of time, integrated in steps in
/// which it hardly changes, and noise of `noise_k`.
pub(crate) fn observations(samples: usize, noise_k: f64, factor: impl Fn(f64) -> f64) -> Observations {
    let tones: Vec<(f64, f64)> =
        (0..30).map(|k| (0.2 * (f64::from(k) + 0.5) / 30.0, 2.399 * f64::from(k * k))).collect();
    let gas_k = |t: f64| tones.iter().map(|(hz, phase)| (TAU * hz * t + phase).sin()).sum::<f64>();
    let mut state = 1_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut at_k = [0.0; 2];
    let mut reading_c = [Vec::new(), Vec::new()];
    for k in 0..samples {
        for i in 0..2 {
            // Twelve uniform numbers have unit variance together, and are normal enough.
            let noise: f64 = (0..12).map(|_| uniform()).sum();
            reading_c[i].push(300.0 + at_k[i] + noise_k * noise);
        }
        for step in 0..STEPS_PER_SAMPLE {
            let t = k as f64 + (step as f64 + 0.5) / STEPS_PER_SAMPLE as f64;
            for i in 0..2 {
                let share = -(-1.0 / (STEPS_PER_SAMPLE as f64 * TAU_S[i] * factor(t))).exp_m1();
                at_k[i] += share * (gas_k(t) - at_k[i]);
            }
        }
    }
    let time_s = (0..samples).map(|k| k as f64).collect();
    Observations::new(vec![Stretch::new(time_s, reading_c)], Some(1.0)).expect("a sound record")
}

/// Everything that a tracker needs of a record.
pub(super) struct Fixture {
    prepared: Prepared,
    selection: Selection,
    time_s: Vec<f64>,
    /// The fit of two lags that do not change.
    pub(super) constant: Fitted,
}

impl Fixture {
    pub(super) fn of(samples: usize, factor: impl Fn(f64) -> f64) -> Self {
        let observations = observations(samples, NOISE_K, factor);
        let settings = Settings { noise_std_k: Some([NOISE_K; 2]), ..Settings::default() };
        let Known { prepared, fitted, .. } =
            Known::of(&observations, &settings, &[], KnownNumbers::Held).expect("a sound record");
        let selection = prepared.everything.clone();
        let time_s = observations.stretches[0].time_s.iter().collect();
        Self { prepared, selection, time_s, constant: fitted }
    }

    pub(super) fn tracker(&self) -> Tracker<'_> {
        Tracker { prepared: &self.prepared, selection: &self.selection, time_s: &self.time_s }
    }
}
