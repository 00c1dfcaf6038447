//! What changes nothing in a record changes nothing in a diagnosis, and what changes it in a known way changes the diagnosis so.
//!
//! Fits end where a step would move no parameter by a thousandth of its error; two of them differ by a twentieth of a standard error at
//! most, with room for the levels of noise, which are found anew.

use crate::common::{channels, record};
use twinlag::diagnosis::{Identifier, Verdict};
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::{CompensateOptions, DiagnoseOptions, Diagnosis, compensate, diagnose, diagnose_records};

const SAMPLES: usize = 3000;
const PERIOD_S: f64 = 0.005;
const SAME_ERRORS: f64 = 0.05;
const GAS: &str = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 1.0\ncutoff_hz = 40.0";

/// Two lags alone, and a second lag in T2 with a gain.
fn records() -> [(Record, &'static [Identifier]); 2] {
    let first = "time_constant_s = 0.03\nnoise = { std_k = 0.1 }";
    let second = "time_constant_s = 0.12\nnoise = { std_k = 0.1 }";
    let more = format!("{second}\nsecond_time_constant_s = 0.018");
    [
        (record(11, SAMPLES, PERIOD_S, GAS, [first, second]), &[]),
        (record(12, SAMPLES, PERIOD_S, GAS, [first, &more]), &[Identifier::SECOND_ORDER]),
    ]
}

fn made(channels: Channels) -> Record {
    Record::from_channels(channels, SamplingChoice::Auto).expect("a sound record")
}

/// The diagnosis, which names `effects`.
fn diagnosed(record: &Record, effects: &[Identifier]) -> Diagnosis {
    named(diagnose(record, &DiagnoseOptions::default()).expect("a sound question"), effects)
}

fn named(answer: Diagnosis, effects: &[Identifier]) -> Diagnosis {
    let expected = if effects.is_empty() { Verdict::Adequate } else { Verdict::Explained };
    let found: Vec<Identifier> = answer.effects.iter().map(|found| found.effect).collect();
    assert_eq!((answer.verdict, &found[..]), (expected, effects));
    answer
}

/// Asserts that both time constants of `got`, which are those of the sensors `places` and over `factor`, are those of `want` to so many
/// standard errors.
fn are_the_same(want: &Diagnosis, got: &Diagnosis, places: [usize; 2], factor: f64, errors: f64) {
    for (sensor, place) in want.last.sensors.iter().zip(places) {
        let of = |value: Option<f64>| value.expect("determined");
        let (want_s, error_s) = (of(sensor.time_constant_s), of(sensor.standard_error_s));
        let got_s = of(got.last.sensors[place].time_constant_s) / factor;
        assert!((got_s - want_s).abs() < errors * error_s, "{got_s} s, want {want_s} ± {errors} × {error_s} s");
    }
}

#[test]
fn sensors_that_change_places_change_places_in_the_answer() {
    for (record, effects) in records() {
        let plain = diagnosed(&record, effects);
        let Channels { t1_c, t2_c, .. } = channels(&record);
        let other = diagnosed(&made(Channels { t1_c: t2_c, t2_c: t1_c, ..channels(&record) }), effects);
        are_the_same(&plain, &other, [1, 0], 1.0, SAME_ERRORS);
        let places: Vec<_> = other.effects.iter().map(|found| found.channel.as_deref()).collect();
        assert_eq!(places, vec![Some("T1"); effects.len()]);
    }
}

/// A clock that is eight times as slow: powers of two, so that nothing is rounded otherwise.
#[test]
fn time_constants_go_with_the_clock() {
    for (record, effects) in records() {
        let plain = diagnosed(&record, effects);
        let time_s = record.time_s.iter().map(|t| 8.0 * t).collect();
        let slow = diagnosed(&made(Channels { time_s, ..channels(&record) }), effects);
        are_the_same(&plain, &slow, [0, 1], 8.0, SAME_ERRORS);
    }
}

/// Both channels multiplied, shifted, or turned upside down.
#[test]
fn what_both_sensors_have_alike_changes_nothing() {
    for (record, effects) in records() {
        let plain = diagnosed(&record, effects);
        for [factor, offset_k] in [[1.0, 128.0], [0.5, 0.0], [-1.0, 600.0]] {
            let of = |values: &[f64]| values.iter().map(|c| factor * c + offset_k).collect();
            let (t1_c, t2_c) = (of(&record.t1_c), of(&record.t2_c));
            let other = diagnosed(&made(Channels { t1_c, t2_c, ..channels(&record) }), effects);
            are_the_same(&plain, &other, [0, 1], 1.0, SAME_ERRORS);
        }
    }
}

/// The halves share all numbers but their ends and their noise, so that nearly all of the information is the same: half a standard error.
#[test]
fn two_halves_say_what_the_whole_says() {
    for (record, effects) in records() {
        let plain = diagnosed(&record, effects);
        let half = |range: std::ops::Range<usize>| {
            let Channels { source, names, time_s, t1_c, t2_c, reference_c } = channels(&record);
            let cut = |values: Vec<f64>| values[range.clone()].to_vec();
            made(Channels { source, names, time_s: cut(time_s), t1_c: cut(t1_c), t2_c: cut(t2_c), reference_c })
        };
        let halves = [half(0..SAMPLES / 2), half(SAMPLES / 2..SAMPLES)];
        let both = diagnose_records(&halves, &DiagnoseOptions::default()).expect("a sound question");
        are_the_same(&plain, &named(both, effects), [0, 1], 1.0, 0.5);
    }
}

/// A third column, whatever it holds, is no part of the question: the same to the last bit.
#[test]
fn a_reference_that_is_not_used_changes_nothing() {
    for (record, effects) in records() {
        let plain = diagnosed(&record, effects);
        let reference_c = Some(record.time_s.iter().map(|t| 20.0 + t.sin()).collect());
        let other = diagnosed(&made(Channels { reference_c, ..channels(&record) }), effects);
        assert_eq!(plain.last.sensors, other.last.sensors);
        assert_eq!(plain.effects, other.effects);
    }
}

/// Multiplied, shifted and turned upside down, the gas temperature is so as well, and as certain: to a twentieth of its standard deviation,
/// since the noise and the gas are learned anew.
#[test]
fn the_gas_goes_with_the_readings() {
    let (record, _) = &records()[0];
    let gas = |channels: Channels| compensate(&made(channels), &CompensateOptions::default()).expect("an answer");
    let plain = gas(channels(record));
    assert_eq!(plain.gas_c.len(), SAMPLES);
    for [factor, offset_k] in [[1.0, 128.0], [0.5, 0.0], [-1.0, 600.0]] {
        let of = |values: &[f64]| values.iter().map(|c| factor * c + offset_k).collect();
        let other = gas(Channels { t1_c: of(&record.t1_c), t2_c: of(&record.t2_c), ..channels(record) });
        for k in 0..SAMPLES {
            let (want_c, std_k) = (factor * plain.gas_c[k] + offset_k, factor.abs() * plain.gas_std_k[k]);
            let [off, wider] = [other.gas_c[k] - want_c, other.gas_std_k[k] - std_k];
            assert!(off.abs() < 0.05 * std_k && wider.abs() < 0.05 * std_k, "at {k}: {off} and {wider} K of {std_k} K");
        }
    }
}
