//! Second lags: found where there are any, denied where there are none.

use crate::common::{record, recovers};
use twinlag::record::Record;
use twinlag::{Characterisation, Known, Options, Status, characterise};

/// 30 s of turbulence for sensors of 0.12 s and 0.45 s, `second` in the place of the first one's second lag.
fn rig(seed: u64, second: &str, further: &str) -> Record {
    let gas = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 0.5\ncutoff_hz = 20.0";
    let first = format!("time_constant_s = 0.12\n{second}\nnoise = {{ std_k = 0.1 }}");
    let other = format!("time_constant_s = 0.45\n{further}\nnoise = {{ std_k = 0.1 }}");
    record(seed, 3000, 0.01, gas, [&first, &other])
}

fn ask(record: &Record, options: &Options) -> Characterisation {
    characterise(record, options).expect("a sound question")
}

/// Four standard errors each: by chance once in 16 000.
#[test]
fn a_second_lag_is_recovered_with_and_without_calibration_by_every_estimator_that_takes_one() {
    let record = rig(3, "second_time_constant_s = 0.04", "gain = 1.01\noffset_k = -0.8");
    let plain = rig(3, "second_time_constant_s = 0.04", "");
    let second = Options { second_order: [true, false], ..Options::default() };
    let calibrated = Options { free_gain: true, free_offset: true, ..second.clone() };
    assert_eq!(ask(&plain, &Options::default()).status, Status::ModelRejected);
    let mut asked = vec![(&record, calibrated)];
    for estimator in ["whitened", "bias-compensated", "normalised", "hybrid"] {
        asked.push((&plain, Options { estimator: estimator.parse().expect("a name"), ..second.clone() }));
    }
    for (record, options) in asked {
        let answer = ask(record, &options);
        assert_eq!(answer.status, Status::Ok, "{:?}: {:?}", options.estimator, answer.warnings);
        recovers(&answer, [0.12, 0.45], 4.0);
        let [first, other] = &answer.sensors;
        let lag = first.second_time_constant_s.clone().expect("asked for");
        let (got, error) = (lag.value.expect("determined"), lag.standard_error.expect("determined"));
        assert!((got - 0.04).abs() < 4.0 * error, "{:?}: {got} s ± {error} s, want 0.04 s", options.estimator);
        let [low, high] = lag.interval_95.expect("determined");
        assert!(low < got && got < high);
        assert_eq!((other.second_time_constant_s.clone(), answer.not_identifiable.len()), (None, 0));
    }
}

/// Failed: two lags alone end with T2 on its bound, and from there no fit came back. Four standard errors each: by chance once in 16 000.
#[test]
fn a_second_lag_is_found_where_two_lags_alone_end_far_from_it() {
    let gas = "kind = \"broadband\"\nstd_k = 17.0\ncorner_hz = 1.0";
    let first = "time_constant_s = 0.09\nsecond_time_constant_s = 0.05\nnoise = { std_k = 0.17 }";
    let record = record(1, 3000, 0.005, gas, [first, "time_constant_s = 0.15\nnoise = { std_k = 0.17 }"]);
    let answer = ask(&record, &Options { second_order: [true, false], ..Options::default() });
    assert_eq!(answer.status, Status::Ok, "{:?}", answer.warnings);
    recovers(&answer, [0.09, 0.15], 4.0);
    let lag = answer.sensors[0].second_time_constant_s.clone().expect("asked for");
    let (got, error) = (lag.value.expect("determined"), lag.standard_error.expect("determined"));
    assert!((got - 0.05).abs() < 4.0 * error, "{got} s ± {error} s, want 0.05 s");
}

/// What is asked of both sensors is found of the one that has it and denied of the other.
#[test]
fn a_second_lag_that_is_not_there_is_denied_with_a_limit() {
    let options = Options { second_order: [true, true], ..Options::default() };
    let answer = ask(&rig(3, "second_time_constant_s = 0.04", ""), &options);
    assert_eq!(answer.status, Status::Ok, "{:?}", answer.warnings);
    assert_eq!(answer.not_identifiable, ["T2.second_time_constant_s"]);
    assert!(answer.sensors[0].second_time_constant_s.clone().is_some_and(|lag| lag.value.is_some()));
    let denied = answer.sensors[1].second_time_constant_s.clone().expect("asked for");
    let [low, high] = denied.interval_95.expect("bounded");
    assert!(denied.value.is_none() && low == 0.0 && high > 0.0 && high < 0.02, "{denied:?}");
    assert!(answer.warnings.iter().any(|w| w.contains("no second lag is detected")), "{:?}", answer.warnings);
    // None at all: the answer is that at first order, with intervals that are no narrower.
    for second_order in [[true, false], [false, true], [true, true]] {
        let record = rig(5, "", "");
        let first = ask(&record, &Options::default());
        let answer = ask(&record, &Options { second_order, ..Options::default() });
        assert_eq!(answer.status, Status::Ok, "{:?}", answer.warnings);
        assert!(!answer.not_identifiable.is_empty());
        for (a, b) in answer.sensors.iter().zip(&first.sensors) {
            // Both fits stop at steps of 1e-9; errors are 1e-3.
            let (a_s, b_s) = (a.time_constant_s.expect("determined"), b.time_constant_s.expect("determined"));
            assert!((a_s / b_s - 1.0).abs() < 1e-6, "{a_s} s, at first order {b_s} s");
            let (a, b) = (a.interval_95_s.expect("determined"), b.interval_95_s.expect("determined"));
            assert!(a[0] <= b[0] * (1.0 + 1e-6) && a[1] >= b[1] * (1.0 - 1e-6), "{a:?}, at first order {b:?}");
        }
    }
}

/// The limit is one-sided at 95 %: of 20 records with a lag of 4 ms it lies below that in one on average, in five or more by
/// chance once in 400. Where the lag is seen its interval is asked, two-sided.
#[test]
fn limits_hold_a_small_second_lag() {
    let missed = (0..20).filter(|&seed| {
        let record = rig(seed, "second_time_constant_s = 0.004", "");
        let answer = ask(&record, &Options { second_order: [true, false], ..Options::default() });
        let lag = answer.sensors[0].second_time_constant_s.clone().expect("asked for");
        lag.interval_95.is_some_and(|[low, high]| !(low..=high).contains(&0.004))
    });
    let missed = missed.count();
    assert!(missed < 5, "{missed} of 20 intervals miss the second lag");
}

/// Two sensors alike do not tell their time constants, and no second lag makes them.
#[test]
fn a_second_lag_makes_no_answer_of_sensors_that_are_alike() {
    let gas = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 0.5\ncutoff_hz = 20.0";
    let sensor = "time_constant_s = 0.3\nnoise = { std_k = 0.1 }";
    for seed in 0..4 {
        let record = record(seed, 2000, 0.01, gas, [sensor, sensor]);
        let answer = ask(&record, &Options { second_order: [true, false], ..Options::default() });
        assert_ne!(answer.status, Status::Ok, "seed {seed}: {:?}", answer.sensors);
    }
}

#[test]
fn a_known_second_lag_is_held_or_weighed() {
    let record = rig(3, "second_time_constant_s = 0.04", "");
    let known = |text: &str| Options { known: vec![text.parse::<Known>().expect("well formed")], ..Options::default() };
    let held = ask(&record, &known("T1.second_time_constant_s=0.04"));
    let lag = held.sensors[0].second_time_constant_s.clone().expect("known");
    assert!(lag.known && lag.value == Some(0.04) && lag.standard_error.is_none(), "{lag:?}");
    recovers(&held, [0.12, 0.45], 4.0);
    let weighed = ask(&record, &known("T1.second_time_constant_s=0.04+-0.001"));
    recovers(&weighed, [0.12, 0.45], 4.0);
    let free = ask(&record, &Options { second_order: [true, false], ..Options::default() });
    let error = |answer: &Characterisation| answer.sensors[0].standard_error_s.expect("determined");
    assert!(error(&held) < error(&weighed) && error(&weighed) < error(&free));
}
