//! Expected standard errors and deviances against the sums over frequencies that they are in continuous time (docs/src/theory.md).
//!
//! With `H₁`, `H₂` the responses of the sensors, `A` the amplitude of a tone and `N` samples, the disagreement of the inferred inputs has at
//! that tone the variance `S = s₁²/|H₁|² + s₂²/|H₂|²`, and a model with the responses `G₁`, `G₂` leaves the energy
//! `Σ N A²/2 · |H₁/G₁ − H₂/G₂|²/S`.

use num_complex::Complex64;
use twinlag::signal::{Gas, MultiTone, Noise, Record, Rig, Sensor, Signal, Tone};
use twinlag_plan::{Change, Plan, Rehearsal};

const SAMPLES: usize = 2000;
const PERIOD_S: f64 = 0.004;
const NOISE_K: [f64; 2] = [0.05, 0.08];
const TAU_S: [f64; 2] = [0.05, 0.16];
/// Whole periods in the record of 8 s, and in half of it.
const TONES: [(f64, f64); 4] = [(0.5, 6.0), (1.25, 5.0), (2.75, 4.0), (5.0, 3.0)];

/// `1 + j ω τ`.
fn lag(omega: f64, tau_s: f64) -> Complex64 {
    Complex64::new(1.0, omega * tau_s)
}

fn rig(second_lag_s: Option<f64>, samples: usize) -> Rig {
    let mut sensors = [0, 1].map(|i| {
        let mut sensor = Sensor::new(["fine", "coarse"][i], TAU_S[i]);
        sensor.noise = Some(Noise::white(NOISE_K[i]));
        sensor
    });
    sensors[0].second_time_constant_s = second_lag_s;
    let tone = |(place, (frequency_hz, amplitude_k)): (usize, (f64, f64))| Tone {
        amplitude_k,
        frequency_hz,
        phase_rad: 1.3 * place as f64,
    };
    let tones = TONES.into_iter().enumerate().map(tone).collect();
    let gas = Gas::new(300.0, Signal::MultiTone(MultiTone { tones }));
    Rig::new(1, Record::new(samples, PERIOD_S), gas, sensors).expect("a sound rig")
}

/// Residual of a model with `(τ₁, τ₂)` and a delay of channel 2, two numbers for each tone, whitened.
///
/// - `second_lag_s`: of sensor 1 of the rig
fn residual([tau_1_s, tau_2_s, delay_s]: [f64; 3], second_lag_s: f64) -> Vec<f64> {
    let each = TONES.iter().flat_map(|(hz, amplitude_k)| {
        let omega = std::f64::consts::TAU * hz;
        let first = lag(omega, tau_1_s) / (lag(omega, TAU_S[0]) * lag(omega, second_lag_s));
        let second = lag(omega, tau_2_s) / lag(omega, TAU_S[1]) * Complex64::cis(omega * delay_s);
        let variance =
            NOISE_K[0].powi(2) * lag(omega, tau_1_s).norm_sqr() + NOISE_K[1].powi(2) * lag(omega, tau_2_s).norm_sqr();
        let scale = amplitude_k * (0.5 * SAMPLES as f64 / variance).sqrt();
        let left = scale * (first - second);
        [left.re, left.im]
    });
    each.collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The derivatives of [`residual`] by the first `count` parameters, by central differences.
fn columns(at: [f64; 3], second_lag_s: f64, count: usize) -> Vec<Vec<f64>> {
    let step_s = 1e-6;
    let column = |i: usize| {
        let moved = |by: f64| {
            let mut at = at;
            at[i] += by;
            residual(at, second_lag_s)
        };
        moved(step_s).iter().zip(moved(-step_s)).map(|(a, b)| (a - b) / (2.0 * step_s)).collect()
    };
    (0..count).map(column).collect()
}

/// Between samples the model takes straight lines or a hold, which costs a lag some `(T/τ)²/12`, 0.05 %, and the whitened residual of the
/// fastest tone `(ω T)²/12`, 0.1 %. Two per cent is well beyond both, and a lost factor is not.
const TOLERANCE: f64 = 0.02;

/// Fisher's information on both time constants, from the standard errors that a plan expects of them and of their difference.
fn information(samples: usize) -> [f64; 3] {
    let plan = Plan::of_rig(&rig(None, samples)).expect("a sound rig");
    let [a, c, of_difference] = [0, 1, 2].map(|i| plan.as_it_is.numbers[i].standard_error.expect("determined").powi(2));
    let b = 0.5 * (a + c - of_difference);
    let determinant = a * c - b * b;
    [c / determinant, -b / determinant, a / determinant]
}

/// What a record of unknown start does not determine is lost at its ends, about a time constant of each: so the information that the second
/// half of a record adds is compared, which begins where the first one ends.
#[test]
fn expected_information_is_that_of_the_sum_over_frequencies() {
    let columns = columns([TAU_S[0], TAU_S[1], 0.0], 0.0, 2);
    let want = [(0, 0), (0, 1), (1, 1)].map(|(i, j)| 0.5 * dot(&columns[i], &columns[j]));
    let (whole, half) = (information(SAMPLES), information(SAMPLES / 2));
    for i in 0..3 {
        let got = whole[i] - half[i];
        assert!((got / want[i] - 1.0).abs() < TOLERANCE, "{i}: got {got:e}, want {:e} within {TOLERANCE}", want[i]);
    }
}

/// A second lag that is taken for a delay: the least energy over both time constants and the delay, by Gauss's and Newton's steps.
#[test]
fn the_deviance_of_a_rival_is_its_least_energy_over_all_other_parameters() {
    let second_lag_s = 0.02;
    let mut at = [TAU_S[0], TAU_S[1], -second_lag_s];
    for _ in 0..50 {
        let left = residual(at, second_lag_s);
        let columns = columns(at, second_lag_s, 3);
        let slope: Vec<f64> = columns.iter().map(|column| dot(column, &left)).collect();
        let products: Vec<Vec<f64>> = columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect();
        let step =
            twinlag::model::dense::times(&twinlag::model::dense::inverse(&products).expect("independent"), &slope);
        at.iter_mut().zip(step).for_each(|(x, step)| *x -= step);
    }
    let left = residual(at, second_lag_s);
    let want = dot(&left, &left);
    let rehearsal = Rehearsal::of(&rig(Some(second_lag_s), SAMPLES)).expect("a sound rig");
    let place = rehearsal.rivals().position(|name| name == "delay").expect("a delay looks like a second lag");
    let [fitted, known] = rehearsal.deviances()[place];
    // What straight lines cost is of first order here, since it is no noise: a few per cent of the least energy.
    assert!((known / want - 1.0).abs() < 5.0 * TOLERANCE, "got {known}, want {want}");
    assert!(fitted <= known && fitted > 0.0, "{fitted} with fitted levels, {known} with known ones");
}

/// Four times the length halves the standard errors, and twice the gas halves them and makes deviances four times as large: `TOLERANCE` for what
/// is lost at the ends.
#[test]
fn length_and_excitation_act_as_they_must() {
    let plan = Plan::of_rig(&rig(Some(0.02), SAMPLES)).expect("a sound rig");
    let with = |change: Change| plan.changed.iter().find(|r| r.change == Some(change)).expect("it is tried");
    for change in [Change::Length { factor: 4.0 }, Change::Excitation { factor: 2.0 }] {
        for number in &with(change).numbers {
            let ratio = number.over_now.expect("determined");
            // Longer records have weights of frequencies, which cost a little.
            assert!((ratio - 0.5).abs() < 0.05, "{change:?}, {}: {ratio}", number.name);
        }
    }
    let known = |change: Option<Change>| {
        let record = change.map_or(&plan.as_it_is, with);
        record.rivals.iter().find(|r| r.rival.name() == "delay").expect("it is followed").deviance_at_most
    };
    let ratio = known(Some(Change::Excitation { factor: 2.0 })) / known(None);
    assert!((ratio - 4.0).abs() < 4.0 * TOLERANCE, "{ratio}");
}

/// Failed: crosstalk that adds to a reading is a gain and another time constant in any record, and the plan said that twice the rate, or
/// with an offset the record as it is, distinguishes them. There the rival was crosstalk about another temperature, which no gain equals.
#[test]
fn no_change_distinguishes_a_gain_from_crosstalk() {
    for offset_k in [0.0, -12.0] {
        let plain = rig(None, SAMPLES);
        let mut sensors = plain.sensors().clone();
        (sensors[1].gain, sensors[1].offset_k) = (1.03, offset_k);
        let rig = Rig::new(1, plain.record().clone(), plain.gas().clone(), sensors).expect("a sound rig");
        let plan = Plan::of_rig(&rig).expect("a sound rig");
        let mut seen = 0;
        for record in std::iter::once(&plan.as_it_is).chain(&plan.changed) {
            for rival in record.rivals.iter().filter(|rival| rival.rival.name() == "crosstalk") {
                seen += 1;
                assert!(rival.deviance < TOLERANCE, "{}: {rival:?}", record.description);
            }
        }
        assert_eq!(seen, 2 * (1 + plan.changed.len()), "crosstalk of either channel, in every record");
    }
}
