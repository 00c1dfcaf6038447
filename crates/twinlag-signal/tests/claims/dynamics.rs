//! The sensors' differential equations against their transfer functions.

use std::f64::consts::TAU;
use twinlag_signal::{Broadband, Gas, MultiTone, Record, Rig, Sensor, Series, Signal, SlowMode, Tone, Turbulence};
use twinlag_transform::Complex64;

use super::{assert_close, coarse, held, mean_square, rig, rig_with};

const MEAN_C: f64 = 450.0;

fn pole(frequency_hz: f64, tau_s: f64) -> Complex64 {
    (Complex64::ONE + Complex64::I * TAU * frequency_hz * tau_s).inv()
}

fn tones() -> Vec<Tone> {
    vec![
        Tone { amplitude_k: 20.0, frequency_hz: 1.0, phase_rad: 0.3 },
        Tone { amplitude_k: 15.0, frequency_hz: 5.0, phase_rad: 1.0 },
        Tone { amplitude_k: 10.0, frequency_hz: 15.0, phase_rad: -2.0 },
    ]
}

/// Largest distance of the first channel from `gain · Im Σ A H(f) exp(i(2πft + φ))`, with forty time constants of
/// run-in (4e-18 of the start is left).
fn largest_error_k(tones: &[Tone], sensor: &Sensor, response: impl Fn(f64) -> Complex64) -> f64 {
    let want = |t: f64| -> f64 {
        tones
            .iter()
            .map(|tone| {
                let phase = TAU * tone.frequency_hz * t + tone.phase_rad;
                (tone.amplitude_k * response(tone.frequency_hz) * Complex64::cis(phase)).im
            })
            .sum::<f64>()
    };
    let mut record = Record::new(500, 0.002);
    record.settle_s = Some(40.0 * 0.5);
    let gas = Gas::new(MEAN_C, Signal::MultiTone(MultiTone { tones: tones.to_owned() }));
    let clean = rig_with(record, gas, sensor.clone()).clean(0).expect("simulates");
    clean
        .time_s
        .iter()
        .zip(&clean.readings_c[0])
        .map(|(&t, &y)| (y - sensor.offset_k - sensor.gain * (MEAN_C + want(t))).abs())
        .fold(0.0, f64::max)
}

/// The rule's error in a pole is `(h/τ)⁵/120` per step and accumulates over `τ/h` of them; in the forcing Simpson's
/// `(ωh)⁴/2880`. With the swing `A` and the fastest pole, `A [(h/τ)⁴ + (ωh)⁴]` bounds both; 1e-12 of 450 °C is
/// rounding.
fn tolerance_k(fastest_s: f64) -> f64 {
    let h = 0.002 / 24.0;
    45.0 * ((h / fastest_s).powi(4) + (TAU * 15.0 * h).powi(4)) + 1e-9
}

#[test]
fn sine_through_one_pole_has_the_closed_form_amplitude_and_phase() {
    let tau_s = 0.0238;
    let tone = Tone { amplitude_k: 20.0, frequency_hz: 5.0, phase_rad: 0.5 };
    let clean = rig_with(
        {
            let mut record = Record::new(500, 0.002);
            record.settle_s = Some(40.0 * tau_s);
            record
        },
        Gas::new(MEAN_C, Signal::Sine(tone)),
        Sensor::new("T1", tau_s),
    )
    .clean(0)
    .expect("simulates");
    let omega_tau = TAU * 5.0 * tau_s;
    for (t, y) in clean.time_s.iter().zip(&clean.readings_c[0]) {
        let want = MEAN_C + 20.0 / f64::hypot(1.0, omega_tau) * (TAU * 5.0 * t + 0.5 - omega_tau.atan()).sin();
        assert_close("reading", *y, want, tolerance_k(tau_s));
    }
}

#[test]
fn tones_superpose() {
    let sensor = Sensor::new("T1", 0.0238);
    assert_close("error", largest_error_k(&tones(), &sensor, |f| pole(f, 0.0238)), 0.0, tolerance_k(0.0238));
}

#[test]
fn second_time_constant_is_a_second_pole_in_series() {
    let mut sensor = Sensor::new("T1", 0.0238);
    sensor.second_time_constant_s = Some(0.005);
    let want = |f| pole(f, 0.0238) * pole(f, 0.005);
    assert_close("error", largest_error_k(&tones(), &sensor, want), 0.0, tolerance_k(0.005));
}

#[test]
fn slow_mode_is_a_parallel_path_behind_both_poles_and_keeps_the_static_gain() {
    let mut sensor = Sensor::new("T1", 0.0238);
    sensor.second_time_constant_s = Some(0.005);
    sensor.slow_mode = Some(SlowMode { fraction: 0.1, time_constant_s: 0.5 });
    let want = |f| (0.9 + 0.1 * pole(f, 0.5)) * pole(f, 0.0238) * pole(f, 0.005);
    assert_close("error", largest_error_k(&tones(), &sensor, want), 0.0, tolerance_k(0.005));
}

#[test]
fn gain_and_offset_act_on_the_reading_in_celsius() {
    let mut sensor = Sensor::new("T1", 0.0238);
    (sensor.gain, sensor.offset_k) = (1.02, -3.0);
    assert_close("error", largest_error_k(&tones(), &sensor, |f| pole(f, 0.0238)), 0.0, 1.02 * tolerance_k(0.0238));
}

/// Halving the step divides the error by 2⁴, times 1 + O(h/τ) where `h/τ` is 0.1 to 0.2: within a fifth.
#[test]
fn integration_error_falls_with_the_fourth_power_of_the_step() {
    let error_k = |oversampling| {
        let tone = Tone { amplitude_k: 20.0, frequency_hz: 10.0, phase_rad: 0.5 };
        let mut record = Record::new(200, 0.004);
        (record.oversampling, record.settle_s) = (oversampling, Some(0.8));
        let clean = rig_with(record, Gas::new(0.0, Signal::Sine(tone)), Sensor::new("T1", 0.02)).clean(0).unwrap();
        let response = 20.0 * pole(10.0, 0.02);
        let want = |t: f64| (response * Complex64::cis(TAU * 10.0 * t + 0.5)).im;
        clean.time_s.iter().zip(&clean.readings_c[0]).map(|(&t, y)| (y - want(t)).abs()).fold(0.0, f64::max)
    };
    assert_close("ratio", error_k(1) / error_k(2), 16.0, 16.0 / 5.0);
}

/// A step at sample 1: `y = 100 (1 − exp(−(k − 1) Ts/τ))`. The rule's error `(h/τ)⁴/120` of 100 K is 1e-10.
#[test]
fn step_response_is_exponential() {
    let mut values_c = vec![100.0; 200];
    values_c[0] = 0.0;
    let rig = rig(200, 0.002, held(0.0, Signal::Series(Series::Inline { values_c, period_s: 0.002 })));
    let clean = rig.clean(0).expect("simulates");
    for (y, tau_s) in clean.readings_c.iter().zip([0.0238, 0.1168]) {
        assert_eq!(y[0], 0.0);
        for (k, y) in y.iter().enumerate().skip(1) {
            assert_close("reading", *y, -100.0 * (-(k as f64 - 1.0) * 0.002 / tau_s).exp_m1(), 1e-9);
        }
    }
}

fn assert_recursion_is_exact(rig: &Rig) {
    let clean = rig.clean(0).expect("simulates");
    for (y, sensor) in clean.readings_c.iter().zip(rig.sensors()) {
        let a = (-rig.record().sample_period_s / sensor.time_constant_s).exp();
        for k in 0..y.len() - 1 {
            assert_close("next reading", y[k + 1], a * y[k] + (1.0 - a) * clean.gas_c[k], 1e-9);
        }
    }
}

/// Within a sample period the rule multiplies by the exponential's Taylor sum: relative error `(h/τ)⁴/120 · Ts/τ`,
/// 1e-13 of a swing of some 100 K; rounding of 450 °C over 24 steps is 1e-12. Both are far below the 1e-9 that is
/// promised.
#[test]
fn held_gas_obeys_the_zero_order_hold_recursion() {
    let random = Signal::Broadband(Broadband { std_k: 20.0, corner_hz: 100.0 });
    assert_recursion_is_exact(&rig(2500, 0.002, held(MEAN_C, random)));
    let random = Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 5.0, cutoff_hz: 400.0 });
    assert_recursion_is_exact(&rig(2500, 0.002, held(MEAN_C, random)));
}

#[test]
fn run_in_starts_in_equilibrium_with_the_gas_of_that_moment() {
    let tone = Tone { amplitude_k: 20.0, frequency_hz: 5.0, phase_rad: 0.5 };
    let clean = rig_with(coarse(10, 0.002), Gas::new(MEAN_C, Signal::Sine(tone)), Sensor::new("T1", 0.0238))
        .clean(0)
        .expect("simulates");
    let start_c = MEAN_C + 20.0 * 0.5_f64.sin();
    assert_close("gas", clean.gas_c[0], start_c, 1e-9);
    assert_eq!(clean.readings_c.each_ref().map(|y| y[0]), [clean.gas_c[0]; 2]);
}

/// Noise of correlation time θ through a pole: variance `s² θ/(θ + τ)`, autocorrelation positive with integral
/// `2 (τ + θ)`, so the mean square over a time T has a standard deviation of at most `2 √((τ + θ)/T)` of itself.
/// Four of these; the integration's own error is of order h/θ/10 here, half a percent.
#[test]
fn broadband_gas_through_a_pole_keeps_the_closed_form_variance() {
    let (tau_s, corner_hz) = (0.0238, 5.0);
    let theta_s = 1.0 / (TAU * corner_hz);
    let mut record = Record::new(100_000, 0.01);
    record.oversampling = 10;
    let gas = Gas::new(0.0, Signal::Broadband(Broadband { std_k: 20.0, corner_hz }));
    let clean = rig_with(record, gas, Sensor::new("T1", tau_s)).clean(0).expect("simulates");
    let want = 400.0 * theta_s / (theta_s + tau_s);
    let tol = want * (8.0 * ((tau_s + theta_s) / 1000.0).sqrt() + 0.005);
    assert_close("variance", mean_square(&clean.readings_c[0]), want, tol);
}
