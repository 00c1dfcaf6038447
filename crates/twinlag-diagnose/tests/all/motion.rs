//! Sensors that move: a speed that goes with the record, made here without a line of the model.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use twinlag_diagnose::{Diagnosis, Found, Identifier, Observations, Settings, Stretch, Verdict, diagnose};

const SAMPLES: u32 = 3000;
const TAU_S: [f64; 2] = [2.0, 6.0];
const NOISE_K: f64 = 0.005;
/// Steps of the integration in a second.
const STEPS: u32 = 100;

/// Down in the first half of the record and up in the second, faster and slower by a half.
fn speed_m_s(time_s: f64) -> f64 {
    let direction = if time_s < 0.5 * f64::from(SAMPLES) { 1.0 } else { -1.0 };
    direction * 0.2 * (1.0 + 0.5 * (TAU * time_s / 400.0).sin())
}

/// Sixty waves from nine seconds to ten minutes, the longer the larger: so many that none is a line.
fn water_c(time_s: f64) -> f64 {
    let wave = |k: i32| {
        let period_s = 600.0 * 0.932_f64.powi(k);
        0.02 * period_s.sqrt() * (TAU * time_s / period_s + f64::from(k * k)).sin()
    };
    10.0 + (0..60).map(wave).sum::<f64>()
}

/// A lag whose time constant changes, in water that is seen later by a delay that changes, read once a second.
fn readings_c(tau_s: impl Fn(f64) -> f64, late_s: impl Fn(f64) -> f64, noise: &mut impl FnMut() -> f64) -> Vec<f64> {
    let step_s = 1.0 / f64::from(STEPS);
    let mut sensor_c = water_c(0.0);
    let mut out = Vec::new();
    for k in 0..SAMPLES * STEPS {
        let time_s = f64::from(k) * step_s;
        if k % STEPS == 0 {
            out.push(sensor_c + NOISE_K * noise());
        }
        // The water in the middle of the step, exactly followed: the rest is of the second order of a hundredth of a second.
        let middle_s = time_s + 0.5 * step_s;
        let keep = (-step_s / tau_s(middle_s)).exp();
        sensor_c = keep * sensor_c + (1.0 - keep) * water_c(middle_s - late_s(middle_s));
    }
    out
}

/// About normal numbers: sums of twelve uniform ones, from a linear congruence.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        let uniform = |_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(uniform).sum::<f64>() - 6.0
    }
}

/// - `tau_2_s`, `late_2_s`: time constant and delay of the second sensor
fn diagnosed(tau_2_s: impl Fn(f64) -> f64, late_2_s: impl Fn(f64) -> f64) -> Diagnosis {
    let mut noise = noise();
    let one_c = readings_c(|_| TAU_S[0], |_| 0.0, &mut noise);
    let two_c = readings_c(tau_2_s, late_2_s, &mut noise);
    // Without the turn, at which nobody knows how fast the water goes past.
    let half = |samples: std::ops::Range<usize>| {
        let time_s: Vec<f64> = samples.clone().map(|k| k as f64).collect();
        let speeds_m_s = time_s.iter().map(|t| speed_m_s(*t)).collect();
        Stretch::new(time_s, [&one_c, &two_c].map(|all| all[samples.clone()].to_vec())).with_motion(speeds_m_s)
    };
    let turn = SAMPLES as usize / 2;
    let stretches = vec![half(0..turn - 20), half(turn + 20..SAMPLES as usize)];
    let observations = Observations::new(stretches, Some(1.0)).expect("a record");
    diagnose(&observations, &Settings::default(), &|_, _, _| ControlFlow::Continue(())).expect("a diagnosis")
}

/// Value and standard error of a parameter.
fn parameter(found: &Found, name: &str) -> (f64, f64) {
    let value = found.parameters.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("{found:?}"));
    (value.value, value.standard_error.expect("fitted"))
}

/// The second sensor is flushed by the motion, and the first by a pump: its time constant goes as the power −0.8 of the speed.
#[test]
fn a_time_constant_that_goes_with_the_speed_is_found_in_its_sensor() {
    let mean_m_s = {
        let logs = (0..SAMPLES).map(|k| speed_m_s(f64::from(k)).abs().ln());
        (logs.sum::<f64>() / f64::from(SAMPLES)).exp()
    };
    let d = diagnosed(|t| TAU_S[1] * (speed_m_s(t).abs() / mean_m_s).powf(-0.8), |_| 0.0);
    assert_eq!(d.verdict, Verdict::Explained, "{:?}", d.effects);
    let found = &d.effects[0];
    assert_eq!((found.effect, found.channel), (Identifier::VARYING_TIME_CONSTANT, Some(1)), "{:?}", d.effects);
    let (exponent, error) = parameter(found, "exponent");
    assert!((exponent + 0.8).abs() < 4.0 * error && error < 0.05, "{exponent} ± {error}");
}

/// The second sensor is 0.1 m behind the first on the way down, and before it on the way up.
#[test]
fn a_distance_along_the_motion_is_found_with_its_sign() {
    let d = diagnosed(|_| TAU_S[1], |t| 0.1 / speed_m_s(t));
    assert_eq!(d.verdict, Verdict::Explained, "{:?}", d.effects);
    assert_eq!(d.effects[0].effect, Identifier::SEPARATION, "{:?}", d.effects);
    let (delay_s, error_s) = parameter(&d.effects[0], "delay_at_mean_flow");
    let speed_m_s = d.effects[0].parameters.iter().find(|p| p.name == "mean_speed").expect("derived").value;
    let (distance_m, error_m) = (delay_s * speed_m_s, error_s * speed_m_s);
    assert!((distance_m - 0.1).abs() < 4.0 * error_m && error_m < 0.01, "{distance_m} ± {error_m} m");
}

/// Nothing goes with the speed: nothing is found.
#[test]
fn a_speed_that_changes_nothing_is_no_effect() {
    let d = diagnosed(|_| TAU_S[1], |_| 0.0);
    assert_eq!(d.verdict, Verdict::Adequate, "{:?}", d.effects);
}
