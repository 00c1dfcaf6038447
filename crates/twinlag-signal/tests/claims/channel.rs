//! Noise and ADC.

use twinlag_signal::{Adc, Gas, Noise, Record, Rig, Sensor, Signal, Tone};

use super::{assert_close, lagged, mean_square, rig_with};

fn slow_sine() -> Gas {
    Gas::new(450.0, Signal::Sine(Tone { amplitude_k: 20.0, frequency_hz: 1.0, phase_rad: 0.0 }))
}

fn noisy(samples: usize, noise: Noise, adc: Option<Adc>) -> Rig {
    let mut record = Record::new(samples, 0.002);
    record.oversampling = 1;
    let mut sensor = Sensor::new("T1", 0.0238);
    (sensor.noise, sensor.adc) = (Some(noise), adc);
    rig_with(record, slow_sine(), sensor)
}

fn noise_k(rig: &Rig) -> Vec<f64> {
    let (clean, noisy) = (rig.clean(0).expect("simulates"), rig.simulate().expect("simulates"));
    noisy.t1_c.iter().zip(&clean.readings_c[0]).map(|(y, x)| y - x).collect()
}

/// Bartlett: the mean square of n points of AR(1) has standard error `s² √(2 (1 + ρ²)/((1 − ρ²) n))`, the lag-one
/// autocorrelation `√((1 − ρ²)/n)`. Four of each.
#[test]
fn noise_has_the_given_deviation_and_lag_one_correlation() {
    let n = 200_000;
    for ar1 in [0.0, 0.6, -0.4] {
        let noise_k = noise_k(&noisy(n, Noise { std_k: 0.5, ar1 }, None));
        let variance = mean_square(&noise_k);
        let rel = (2.0 * (1.0 + ar1 * ar1) / ((1.0 - ar1 * ar1) * n as f64)).sqrt();
        assert_close("variance", variance, 0.25, 4.0 * 0.25 * rel);
        let correlation = lagged(&noise_k, 1) / variance;
        assert_close("lag-one correlation", correlation, ar1, 4.0 * ((1.0 - ar1 * ar1) / n as f64).sqrt());
    }
}

/// Started anywhere but in its stationary state, strongly correlated noise would be smaller (or larger) at first. Over
/// n trials the first sample's mean square has standard error `s² √(2/n)`; four of these.
#[test]
fn noise_is_stationary_from_the_first_sample() {
    let (n, rig) = (4000, noisy(2, Noise { std_k: 0.5, ar1: 0.99 }, None));
    let clean = rig.clean(0).expect("simulates");
    let first_k: Vec<f64> =
        (0..n).map(|trial| clean.with_noise(&mut rig.noise_streams(trial)).t1_c[0] - clean.readings_c[0][0]).collect();
    assert_close("variance", mean_square(&first_k), 0.25, 4.0 * 0.25 * (2.0 / n as f64).sqrt());
}

/// The channels' noises are independent: their correlation over n points has standard error `1/√n`. Four of these.
#[test]
fn channels_have_independent_noise() {
    let n = 50_000;
    let mut sensors = [Sensor::new("T1", 0.0238), Sensor::new("T2", 0.1168)];
    for sensor in &mut sensors {
        sensor.noise = Some(Noise::white(1.0));
    }
    let mut record = Record::new(n, 0.002);
    record.oversampling = 1;
    let rig = Rig::new(1, record, slow_sine(), sensors).expect("valid rig");
    let (clean, noisy) = (rig.clean(0).expect("simulates"), rig.simulate().expect("simulates"));
    let product: f64 =
        (0..n).map(|k| (noisy.t1_c[k] - clean.readings_c[0][k]) * (noisy.t2_c[k] - clean.readings_c[1][k])).sum();
    assert_close("correlation", product / n as f64, 0.0, 4.0 / (n as f64).sqrt());
}

/// Noise of two steps makes the rounding error uniform over ±q/2 to exp(−2π² 4) (Widrow): mean square q²/12, mean
/// fourth power q⁴/80, so over n points its standard error is `q²/√(180 n)`. Four of these.
#[test]
fn rounding_error_is_uniform_and_at_most_half_a_step() {
    let (n, step_k) = (100_000, 0.25);
    let noise = Noise::white(2.0 * step_k);
    let smooth = noisy(n, noise, None).simulate().expect("simulates");
    let adc = Adc { step_k: Some(step_k), low_c: None, high_c: None };
    let rounded = noisy(n, noise, Some(adc)).simulate().expect("simulates");
    let error_k: Vec<f64> = rounded.t1_c.iter().zip(&smooth.t1_c).map(|(y, x)| y - x).collect();
    assert!(rounded.t1_c.iter().all(|y| (y / step_k).fract() == 0.0), "readings are multiples of the step");
    assert!(error_k.iter().all(|e| e.abs() <= 0.5 * step_k), "no error above half a step");
    let tol = 4.0 * step_k * step_k / (180.0 * n as f64).sqrt();
    assert_close("mean square error", mean_square(&error_k), step_k * step_k / 12.0, tol);
}

#[test]
fn saturated_readings_stay_at_the_limit_and_others_are_untouched() {
    let free = noisy(2500, Noise::white(0.5), None).simulate().expect("simulates");
    let adc = Adc { step_k: None, low_c: Some(440.0), high_c: Some(460.0) };
    let bound = noisy(2500, Noise::white(0.5), Some(adc)).simulate().expect("simulates");
    let at = |limit: f64| bound.t1_c.iter().filter(|&&y| y == limit).count();
    assert!(at(440.0) > 500 && at(460.0) > 500, "a swing of ±20 K spends a third of its time beyond each limit");
    for (got, want) in bound.t1_c.iter().zip(&free.t1_c) {
        assert_eq!(*got, want.clamp(440.0, 460.0));
    }
}
