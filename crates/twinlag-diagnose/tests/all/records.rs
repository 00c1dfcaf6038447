//! What a diagnosis makes of records that are bad, hard or merely arranged differently: no panic, no name without cause, and
//! the same answer for the same data.

use crate::common::{
    GAS_K, PERIOD_S, SAMPLES, SEED, TAU_S, estimate, even, found, readings, record, recovers, told, turbulence,
};
use std::ops::ControlFlow;

use twinlag_diagnose::{
    Diagnosis, Grade, Identifier, KnownTimeConstant, ModelError, Observations, Remark, Settings, Stretch, Verdict,
    diagnose, fit_with,
};
use twinlag_signal::{Engine, MultiTone, Noise, Sensor, Signal, Tone, Turbulence};

fn second_order(sensors: &mut [Sensor; 2]) {
    sensors[1].second_time_constant_s = Some(0.018);
}

fn plain() -> [Vec<f64>; 2] {
    let simulated = readings(SEED, turbulence(), |_| ());
    [simulated.t1_c, simulated.t2_c]
}

fn asked(observations: &Observations) -> Result<Diagnosis, ModelError> {
    diagnose(observations, &Settings::default(), &|_, _, _| ControlFlow::Continue(()))
}

/// One tone gives two equations, amplitude ratio and phase, for two time constants: no effect can be told.
#[test]
fn a_single_sine_is_refused_with_a_remark() {
    let tone = Signal::Sine(Tone { amplitude_k: GAS_K, frequency_hz: 5.0, phase_rad: 0.0 });
    let simulated = readings(SEED, tone, second_order);
    let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
    assert_eq!(d.verdict, Verdict::Refused, "{}", told(&d));
    assert!(d.effects.is_empty() && d.unexplained.is_none(), "{}", told(&d));
    assert!(d.remarks.contains(&Remark::SingleTone), "{}", told(&d));
    // Failed: a line break of the source was in it, as thirteen spaces.
    assert!(d.remarks.iter().all(|r| !r.to_string().contains("  ")), "a remark is running text: {:?}", d.remarks);
}

/// Failed: with a last period that is not whole its mean counted as a second tone, and two wrong time constants were `go`.
#[test]
fn a_sine_of_any_number_of_periods_is_refused() {
    for (seed, frequency_hz) in [(SEED, 5.1), (SEED + 1, 7.77)] {
        let tone = Signal::Sine(Tone { amplitude_k: GAS_K, frequency_hz, phase_rad: 1.0 });
        let simulated = readings(seed, tone, |sensors| {
            second_order(sensors);
            sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.02)));
        });
        let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
        assert_eq!(d.verdict, Verdict::Refused, "{frequency_hz} Hz: {}", told(&d));
        assert!(d.judgements.time_constants.iter().all(|j| j.grade == Grade::NoGo), "{:?}", d.judgements);
    }
}

/// The first time constant is known twice as long as it is, within 5 % or exactly: without it, two lags leave only noise, ten and
/// more standard deviations away. Failed: nothing was said, and numbers were given under the condition that it is so.
#[test]
fn a_given_value_that_the_record_contradicts_is_no_condition() {
    let observations = record(SEED, |_| ());
    let given = |value_s: f64, std_s| {
        let known = vec![KnownTimeConstant { sensor: 0, value_s, std_s }];
        diagnose(&observations, &Settings { known, ..Settings::default() }, &|_, _, _| ControlFlow::Continue(()))
            .expect("a record that can be diagnosed")
    };
    for std_s in [Some(0.05 * 2.0 * TAU_S[0]), None] {
        let d = given(2.0 * TAU_S[0], std_s);
        let said = d.remarks.iter().find_map(|r| match r {
            Remark::Contradicted { instead, deviations, .. } => Some((instead.clone(), *deviations)),
            _ => None,
        });
        let (instead, deviations) = said.unwrap_or_else(|| panic!("{}", told(&d)));
        assert!(instead.starts_with("T1 = 0.01"), "{instead}");
        // A standard deviation is 5 % of the double: half of it is ten of them, and the record's own error is small beside that.
        assert!(if std_s.is_some() { (deviations - 10.0).abs() < 1.0 } else { deviations > 20.0 }, "{deviations}");
        assert_eq!(d.judgements.time_constants[1].grade, Grade::NoGo, "{:?}", d.judgements);
        assert!(d.judgements.time_constants[1].because.contains("contradicts T1 = 0.024"), "{:?}", d.judgements);
    }
    let d = given(TAU_S[0], Some(0.05 * TAU_S[0]));
    assert!(!d.remarks.iter().any(|r| matches!(r, Remark::Contradicted { .. })), "{:?}", d.remarks);
    assert_eq!(d.judgements.time_constants[1].grade, Grade::Conditional, "{:?}", d.judgements);
}

/// Pulses that hardly differ: two lags alone leave little more than noise of the second lag of T2, with a T1 that is a tenth of what it is.
/// Failed: where T1 was given as it is, the record was said to contradict it by 40 and more standard deviations, though the second lag
/// leaves less than they do, and no number was given. 1.96 standard errors are half an interval; four of these.
#[test]
fn a_given_value_that_an_effect_needs_is_not_contradicted() {
    let pulses = Engine { amplitude_relative_std: 0.2, period_relative_std: 0.03, ..Engine::new(60.0, 8.0) };
    let simulated = readings(SEED, Signal::Engine(pulses), second_order);
    let observations = even(simulated.t1_c, simulated.t2_c).expect("finite and long");
    for std_s in [None, Some(0.05 * TAU_S[0])] {
        let known = vec![KnownTimeConstant { sensor: 0, value_s: TAU_S[0], std_s }];
        let settings = Settings { known, ..Settings::default() };
        let d = diagnose(&observations, &settings, &|_, _, _| ControlFlow::Continue(())).expect("a record");
        assert_eq!(d.verdict, Verdict::Explained, "{}", told(&d));
        assert!(d.effects.iter().any(|e| e.effect == Identifier::SECOND_ORDER), "{}", told(&d));
        let [_, t2] = &d.last.time_constants;
        let [low_s, high_s] = t2.interval_95_s.expect("an interval");
        let value_s = t2.value_s.expect("a value");
        assert!((value_s - TAU_S[1]).abs() < 4.0 / 1.96 * 0.5 * (high_s - low_s), "{value_s} [{low_s}, {high_s}]");
    }
}

/// With a first time constant that is 30 % too long, a slow mode is found that makes up for it, and leaves no more than two lags do
/// without it. Its number needs one more; by Schwarz's criterion neither is preferred clearly, so both are said.
#[test]
fn where_an_effect_or_what_was_given_may_be_wrong_both_are_said() {
    let pulses = Engine { amplitude_relative_std: 0.2, period_relative_std: 0.03, ..Engine::new(60.0, 8.0) };
    let simulated = readings(SEED, Signal::Engine(pulses), |_| ());
    let observations = even(simulated.t1_c, simulated.t2_c).expect("finite and long");
    let known = vec![KnownTimeConstant { sensor: 0, value_s: 1.3 * TAU_S[0], std_s: None }];
    let settings = Settings { known, ..Settings::default() };
    let d = diagnose(&observations, &settings, &|_, _, _| ControlFlow::Continue(())).expect("a record");
    assert_eq!(d.effects.iter().map(|e| e.effect).collect::<Vec<_>>(), [Identifier::SLOW_MODE], "{}", told(&d));
    let said = d.remarks.iter().find_map(|r| match r {
        Remark::EffectsOrGiven { instead, effects, .. } => Some((instead.as_str(), &effects[..])),
        _ => None,
    });
    let (instead, effects) = said.unwrap_or_else(|| panic!("{}", told(&d)));
    assert!(instead.starts_with("T1 = 0.0120"), "{instead}");
    assert_eq!(effects, [Identifier::SLOW_MODE]);
    let grades = d.judgements.time_constants.each_ref().map(|judgement| judgement.grade);
    assert_eq!(grades, [Grade::Conditional; 2], "what may be wrong is no go, though it was given: {:?}", d.judgements);
}

/// Two tones are four equations, two of which the time constants take.
#[test]
fn what_few_tones_can_tell_is_counted() {
    let tones = vec![
        Tone { amplitude_k: GAS_K, frequency_hz: 3.0, phase_rad: 0.0 },
        Tone { amplitude_k: GAS_K, frequency_hz: 17.0, phase_rad: 1.0 },
    ];
    let simulated = readings(SEED, Signal::MultiTone(MultiTone { tones }), |_| ());
    let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
    let counted = |t: &String| t.contains("more than 2 numbers") && t.contains("2 tones") && t.contains("4 equations");
    assert!(d.not_testable.iter().any(counted), "{:?}", d.not_testable);
    let broad = found(&record(SEED, |_| ()));
    assert!(broad.not_testable.iter().all(|t| !t.contains("tones")), "{:?}", broad.not_testable);
}

/// Sampled every second of the fast sensor's time constant and nearly free of noise: third differences are the gas's. What is left
/// over says so, and its level has a standard error of `1/√(2n)` = 1.4 % of both channels together.
#[test]
fn noise_below_the_changes_of_the_gas_is_found() {
    let quiet_k = 0.01;
    let signal = Signal::Turbulence(Turbulence { std_k: GAS_K, corner_hz: 20.0, cutoff_hz: 400.0 });
    let simulated = readings(SEED, signal, |sensors| {
        for (sensor, (name, tau_s)) in sensors.iter_mut().zip([("T1", 0.003), ("T2", 0.015)]) {
            *sensor = Sensor::new(name, tau_s);
            sensor.noise = Some(Noise::white(quiet_k));
        }
    });
    let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
    assert!(d.remarks.contains(&Remark::NoiseLowered), "{}", told(&d));
    for (time_constant, want) in d.last.time_constants.iter().zip([0.003, 0.015]) {
        let (got, error) = estimate(time_constant);
        assert!((got - want).abs() <= 4.0 * error, "got {got}, want {want} ± 4 × {error}: {}", told(&d));
    }
}

/// Bit by bit, while another diagnosis competes for the processors: no number may depend on which thread is first. (The same
/// on one processor: `the_answer_does_not_depend_on_the_number_of_processors` of `twinlag-cli`.)
#[test]
fn the_same_record_has_the_same_diagnosis() {
    let observations = record(SEED, second_order);
    let (first, second) = std::thread::scope(|scope| {
        let other = scope.spawn(|| found(&observations));
        (found(&observations), other.join().expect("no panic"))
    });
    // `Debug` holds every number to the last digit, and NaN is equal to itself in it.
    assert!(format!("{first:?}") == format!("{second:?}"), "{}\n{}", told(&first), told(&second));
}

/// Which sensor is called the first is nobody's business: the residual changes sign, and where it is whitened from. Fits stop
/// where a step is small against the standard error: a tenth of that is far beyond.
#[test]
fn the_order_of_the_channels_does_not_matter() {
    let simulated = readings(SEED, turbulence(), second_order);
    let one = found(&even(simulated.t1_c.clone(), simulated.t2_c.clone()).expect("finite and long"));
    let other = found(&even(simulated.t2_c, simulated.t1_c).expect("finite and long"));
    assert_eq!(one.verdict, other.verdict, "{}\n{}", told(&one), told(&other));
    let names = |flip: usize, d: &Diagnosis| -> Vec<(Identifier, Option<usize>)> {
        d.effects.iter().map(|f| (f.effect, f.channel.map(|c| c ^ flip))).collect()
    };
    assert_eq!(names(0, &one), names(1, &other), "{}\n{}", told(&one), told(&other));
    for i in 0..2 {
        let ((a, error), (b, _)) = (estimate(&one.last.time_constants[i]), estimate(&other.last.time_constants[1 - i]));
        assert!((a - b).abs() < 0.1 * error, "got {a} and {b}, which differ by more than 0.1 × {error}");
    }
}

/// 60 samples are what the documentation asks for.
#[test]
fn a_record_that_is_too_short_is_refused() {
    let [t1_c, t2_c] = plain();
    let part = |n: usize| even(t1_c[..n].to_vec(), t2_c[..n].to_vec());
    assert_eq!(part(59), Err(ModelError::TooShort { samples: 59, needed: 60 }));
    assert_eq!(part(0), Err(ModelError::TooShort { samples: 0, needed: 60 }));
    // Enough to try: whatever comes is no panic, and no confident name for 60 samples of two lags.
    if let Ok(d) = asked(&part(60).expect("as many as are needed")) {
        assert!(d.verdict != Verdict::Explained, "{}", told(&d));
    }
}

/// Stretches of fewer than 8 samples are left out, so that these are none at all.
#[test]
fn stretches_that_are_too_short_do_not_add_up() {
    let [t1_c, t2_c] = plain();
    let stretches = (0..100)
        .map(|i| {
            let range = 10 * i..10 * i + 7;
            let time_s = range.clone().map(|k| k as f64 * PERIOD_S).collect();
            Stretch::new(time_s, [t1_c[range.clone()].to_vec(), t2_c[range].to_vec()])
        })
        .collect();
    let got = Observations::new(stretches, Some(PERIOD_S));
    assert_eq!(got, Err(ModelError::TooShort { samples: 0, needed: 60 }));
}

#[test]
fn a_reading_that_is_no_number_is_refused() {
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for channel in 0..2 {
            let mut readings = plain();
            readings[channel][SAMPLES / 2] = wrong;
            let [t1_c, t2_c] = readings;
            assert_eq!(even(t1_c, t2_c), Err(ModelError::NotFinite), "{wrong} in channel {channel}");
        }
    }
}

#[test]
fn a_time_that_is_no_number_is_refused() {
    let mut time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64 * PERIOD_S).collect();
    time_s[SAMPLES / 2] = f64::NAN;
    let got = Observations::new(vec![Stretch::new(time_s, plain())], None);
    assert_eq!(got, Err(ModelError::NotFinite));
}

fn is_constant(level_c: f64, channel: usize) {
    let mut readings = plain();
    readings[channel - 1].fill(level_c);
    let [t1_c, t2_c] = readings;
    let observations = even(t1_c, t2_c).expect("finite and long");
    let got = asked(&observations).map(|d| told(&d));
    assert_eq!(got, Err(ModelError::Constant { channel }), "{level_c} °C in channel {channel}");
}

#[test]
fn a_channel_that_never_changes_is_refused_by_its_number() {
    is_constant(300.0, 1);
    is_constant(300.0, 2);
}

/// Failed: the mean of 3000 times 300.1 is not quite 300.1, and "6000 readings at an end of the range" were found in 3000.
#[test]
fn a_channel_that_never_changes_is_refused_at_any_level() {
    is_constant(300.1, 1);
    is_constant(300.1, 2);
}

/// Failed: squares of a change of 1e-298 K are zero, and so were bounds of the noise, which ended in a panic.
#[test]
fn a_change_too_small_to_square_is_none() {
    let [t1_c, t2_c] = plain().map(|values| values.into_iter().map(|c| 1e-300 * c).collect());
    let got = asked(&even(t1_c, t2_c).expect("finite and long")).map(|d| told(&d));
    assert_eq!(got, Err(ModelError::Constant { channel: 1 }));
}

#[test]
fn a_channel_that_never_changes_is_refused_with_known_effects_too() {
    let [t1_c, _] = plain();
    let got = fit_with(&even(t1_c, vec![300.0; SAMPLES]).expect("finite and long"), &Settings::default(), &[]);
    assert_eq!(got, Err(ModelError::Constant { channel: 2 }));
}

/// The same readings twice agree with any two time constants that are equal: there is no telling which, nor is there an effect.
#[test]
fn equal_channels_tell_no_time_constant_and_no_effect() {
    let [t1_c, _] = plain();
    let d = asked(&even(t1_c.clone(), t1_c).expect("finite and long")).expect("readings that change");
    assert!(d.effects.is_empty() && d.verdict != Verdict::Explained, "{}", told(&d));
    assert!(d.last.time_constants.iter().all(|t| t.value_s.is_none()), "{}", told(&d));
}

/// A record in two files is the record: the gap costs some samples, the answer stays what it was, which is nothing missing.
#[test]
fn a_gap_is_no_effect() {
    let [t1_c, t2_c] = plain();
    let stretch = |range: std::ops::Range<usize>| {
        let time_s = range.clone().map(|k| k as f64 * PERIOD_S).collect();
        Stretch::new(time_s, [t1_c[range.clone()].to_vec(), t2_c[range].to_vec()])
    };
    let stretches = vec![stretch(0..SAMPLES / 2), stretch(SAMPLES / 2 + 100..SAMPLES)];
    let d =
        asked(&Observations::new(stretches, Some(PERIOD_S)).expect("finite and long")).expect("readings that change");
    assert_eq!(d.verdict, Verdict::Adequate, "{}", told(&d));
    recovers(&d.last, TAU_S, &told(&d));
}

/// Time has no origin.
#[test]
fn the_start_of_time_does_not_matter() {
    let readings = plain();
    let at = |start_s: f64| {
        let time_s = (0..SAMPLES).map(|k| start_s + k as f64 * PERIOD_S).collect();
        let stretch = Stretch::new(time_s, readings.clone());
        found(&Observations::new(vec![stretch], Some(PERIOD_S)).expect("finite and long"))
    };
    let (early, late) = (at(0.0), at(1e6));
    assert_eq!(early.verdict, late.verdict, "{}\n{}", told(&early), told(&late));
    for (a, b) in early.last.time_constants.iter().zip(&late.last.time_constants) {
        let ((a, error), (b, _)) = (estimate(a), estimate(b));
        assert!((a - b).abs() < 0.1 * error, "got {a} and {b}, which differ by more than 0.1 × {error}");
    }
}

/// An exponential in one reading is annihilated by the factor of any lag of its time constant, and so by a slow mode of
/// no share. Failed: "explained: slow-mode" with a share of 0.000 ± 0.001.
#[test]
fn an_amplifier_that_warms_up_is_no_slow_mode() {
    let mut simulated = readings(SEED, turbulence(), |_| ());
    for (y, t) in simulated.t2_c.iter_mut().zip(&simulated.time_s) {
        *y += 4.0 * (-t / 0.8).exp();
    }
    let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
    let told = told(&d);
    assert!(d.effects.iter().all(|f| f.effect != Identifier::SLOW_MODE), "{told}");
}
