//! Several records of one rig: what they share, what is of each, and what is worth nothing on a record that was left out.

use crate::common::{
    NOISE_K, PERIOD_S, SAMPLES, SEED, TAU_S, even, joint, readings, record, recovers, told, turbulence,
};
use twinlag_diagnose::{
    Contradicted, Grade, Identifier, JointDiagnosis, Move, Observations, OfRecord, OwnValue, Policy, Verdict,
};
use twinlag_signal::{Noise, Sensor, Signal, TemperatureDependence, Tone, Turbulence};

/// Effects with the channels that they are of.
fn named(joint: &JointDiagnosis) -> Vec<(Identifier, Option<usize>)> {
    joint.diagnosis.effects.iter().map(|effect| (effect.effect, effect.channel)).collect()
}

/// Normalised residuals of records that were left out are those of noise: their root mean square over some thousand samples is 1 within
/// two per cent, and noise levels from third differences are as uncertain.
const MAX_NOISE_RMS: f64 = 1.06;

/// The film's temperature is made of the gas of each record: of the record that is left out as well, which had no part in the estimate.
#[test]
fn time_constants_that_follow_the_film_do_so_in_a_record_that_was_left_out() {
    const EXPONENT: f64 = -1.8;
    let of = |seed: u64| {
        let gas = Signal::Turbulence(Turbulence { std_k: 60.0, corner_hz: 2.4, cutoff_hz: 200.0 });
        let film = TemperatureDependence::of_film(EXPONENT, 300.0);
        let follow = |sensors: &mut [Sensor; 2]| sensors.iter_mut().for_each(|s| s.temperature_dependence = Some(film));
        let simulated = readings(seed, gas, follow);
        even(simulated.t1_c, simulated.t2_c).expect("finite and long")
    };
    let joint = joint(&[of(SEED), of(SEED + 1)]);
    let told = told(&joint.diagnosis);
    assert_eq!(named(&joint), [(Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, None)], "{told}");
    let rms = joint.transfer.normalised_rms;
    assert!(rms.before > 1.3 && rms.after < MAX_NOISE_RMS, "{rms:?}: {told}");
}

/// Noise of one record three times that of the others: each has its own levels, residuals are those of noise in each, and none
/// contradicts.
#[test]
fn records_with_noise_of_their_own_agree() {
    let of = |seed: u64, noise_k: f64| {
        record(seed, |sensors| {
            sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(noise_k)));
            sensors[1].second_time_constant_s = Some(0.018);
        })
    };
    let joint = joint(&[of(SEED, NOISE_K), of(SEED + 1, 3.0 * NOISE_K), of(SEED + 2, NOISE_K)]);
    let told = told(&joint.diagnosis);
    assert_eq!(named(&joint), [(Identifier::SECOND_ORDER, Some(1))], "{told}");
    recovers(&joint.diagnosis.last, TAU_S, &told);
    for (record, want_k) in joint.records.iter().zip([NOISE_K, 3.0 * NOISE_K, NOISE_K]) {
        assert!(record.disagreements.is_empty(), "{:?}", record.disagreements);
        assert!(record.left_out.normalised_rms.after < MAX_NOISE_RMS, "{:?}", record.left_out);
        // Those of 3000 samples are known to two and a half per cent: four of these.
        assert!(record.noise_std_k.iter().all(|k| (k / want_k - 1.0).abs() < 0.1), "{:?}", record.noise_std_k);
    }
}

/// A delay of 12 samples in records of 500: one of them by itself reaches over 10 samples, and two together over 20.
#[test]
fn a_long_delay_is_one_of_every_record() {
    const DELAY_S: f64 = 0.012;
    const SHORT: usize = 500;
    let of = |seed: u64| {
        let simulated = readings(seed, turbulence(), |sensors| sensors[1].delay_s = DELAY_S);
        even(simulated.t1_c[..SHORT].to_vec(), simulated.t2_c[..SHORT].to_vec()).expect("finite and long")
    };
    let all: Vec<Observations> = (0..3).map(|k| of(SEED + k)).collect();
    let joint = joint(&all);
    let told = told(&joint.diagnosis);
    assert_eq!(named(&joint), [(Identifier::DELAY, Some(1))], "{told}");
    recovers(&joint.diagnosis.last, TAU_S, &told);
    assert!(joint.records.iter().all(|record| record.agrees == Some(true)), "{told}");
    assert!(joint.transfer.normalised_rms.after < MAX_NOISE_RMS, "{:?}", joint.transfer);
}

/// Which of six records contradict the others, where the last has a rig of its own. What records differ is known from the others alone:
/// of four it takes a hundred standard errors to be sure, of six 15.
fn disagreeing(change_last: impl Fn(&mut [Sensor; 2])) -> (JointDiagnosis, Vec<bool>) {
    let mut all: Vec<Observations> = (0..5).map(|k| record(SEED + k, |_| ())).collect();
    all.push(record(SEED + 5, |sensors| change_last(sensors)));
    let joint = joint(&all);
    let disagreeing: Vec<bool> = joint.records.iter().map(|record| !record.disagreements.is_empty()).collect();
    for (record, disagrees) in joint.records.iter().zip(&disagreeing) {
        assert_eq!(record.agrees == Some(false), *disagrees, "{:?}", record.agrees);
    }
    (joint, disagreeing)
}

/// Two records do not say how much records of the rig differ. They are explained without the one of another sensor, which is explained
/// alone, and with it no two are.
#[test]
fn of_three_records_that_one_is_named_without_which_the_others_are_explained() {
    for factor in [1.15, 1.5] {
        let of_another = record(SEED + 2, |sensors| sensors[1].time_constant_s = factor * TAU_S[1]);
        let joint = joint(&[record(SEED, |_| ()), record(SEED + 1, |_| ()), of_another]);
        let told = told(&joint.diagnosis);
        let agrees: Vec<Option<bool>> = joint.records.iter().map(|record| record.agrees).collect();
        assert_eq!(agrees, [Some(true), Some(true), Some(false)], "{told}");
        let rms = joint.records[2].left_out.normalised_rms.after;
        assert!(rms > 1.0 + Policy::default().left_out_rms_margin, "{rms}");
        // Its time constant and theirs, each within four standard errors.
        let [of_t2] = &joint.records[2].disagreements[..] else { panic!("{:?}", joint.records[2].disagreements) };
        let Contradicted { own, others, others_error, .. } = of_t2.values;
        assert_eq!((of_t2.name.as_str(), own.record), ("T2", 2));
        assert!((own.value - factor * TAU_S[1]).abs() < 4.0 * own.standard_error, "{own:?}");
        assert!((others - TAU_S[1]).abs() < 4.0 * others_error, "{others} ± {others_error} s");
    }
}

/// A sensor of 50 ms among records of one of 45 ms leaves a residual that looks like gas which both sensors do not share. No record left
/// out shows such gas, so it is taken out, and the record is named.
#[test]
fn a_record_of_another_rig_is_no_noise() {
    let of = |seed: u64, second_s: f64| {
        let gas = Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 5.0, cutoff_hz: 200.0 });
        let simulated = readings(seed, gas, |sensors| sensors[1].time_constant_s = second_s);
        even(simulated.t1_c, simulated.t2_c).expect("finite and long")
    };
    let joint = joint(&[of(1, 0.045), of(2, 0.045), of(4, 0.050)]);
    let told = told(&joint.diagnosis);
    assert!(joint.diagnosis.moves.iter().any(|m| matches!(m, Move::Withdraw { .. })), "{told}");
    assert!(joint.diagnosis.effects.iter().all(|found| !found.effect.is_noise()), "{told}");
    let agrees: Vec<Option<bool>> = joint.records.iter().map(|record| record.agrees).collect();
    assert_eq!(agrees, [Some(true), Some(true), Some(false)], "{told}");
}

/// Of two records that differ either may be the odd one.
#[test]
fn of_two_records_none_is_named() {
    for factor in [1.15, 1.5] {
        let of_another = record(SEED + 2, |sensors| sensors[1].time_constant_s = factor * TAU_S[1]);
        let joint = joint(&[record(SEED, |_| ()), of_another]);
        let told = told(&joint.diagnosis);
        assert!(joint.records.iter().all(|record| record.agrees.is_none()), "{told}");
        // Together they look as if the gas were not the same: that is no cause, and nothing is explained by it.
        assert_eq!(joint.diagnosis.verdict, Verdict::Unexplained, "{told}");
        for (record, second_s) in joint.records.iter().zip([TAU_S[1], factor * TAU_S[1]]) {
            let [of_t2] = &record.disagreements[..] else { panic!("{:?}", record.disagreements) };
            let OwnValue { value, standard_error, .. } = of_t2.values.own;
            assert!((value - second_s).abs() < 4.0 * standard_error, "{value} ± {standard_error} s");
        }
    }
}

/// A gain of one record is no drift of all of them: the record is named, with what it shows alone.
#[test]
fn what_an_odd_record_shows_alone_is_said() {
    let of_another = record(SEED + 2, |sensors| sensors[1].gain = 1.02);
    let joint = joint(&[record(SEED, |_| ()), record(SEED + 1, |_| ()), of_another]);
    let told = told(&joint.diagnosis);
    let agrees: Vec<Option<bool>> = joint.records.iter().map(|record| record.agrees).collect();
    assert_eq!(agrees, [Some(true), Some(true), Some(false)], "{told}");
    let alone = joint.records[2].found_alone.as_deref().expect("it was looked at");
    assert_eq!(alone, [(Identifier::CALIBRATION, Some(1))], "{told}");
    assert!(
        joint.records[0].found_alone.is_none() && named(&joint).iter().all(|e| e.0 == Identifier::CALIBRATION),
        "{told}"
    );
}

/// Someone exchanged the second sensor before the last record: that one is named, with its time constant and theirs, each within four
/// standard errors. A Newton step from the joint fit was 125 standard errors short of it.
#[test]
fn a_record_of_another_sensor_is_named() {
    let (joint, disagreeing) = disagreeing(|sensors| sensors[1].time_constant_s = 1.3 * TAU_S[1]);
    let told = told(&joint.diagnosis);
    assert_eq!(disagreeing, [false, false, false, false, false, true], "{told}");
    let of_t2 = joint.records[5].disagreements.iter().find(|d| d.name == "T2").expect("T2 is another");
    let Contradicted { own, others, others_error, .. } = of_t2.values;
    assert!((own.value - 1.3 * TAU_S[1]).abs() < 4.0 * own.standard_error, "{own:?}");
    assert!((others - TAU_S[1]).abs() < 4.0 * others_error, "{others} ± {others_error} s");
    assert_ne!(joint.diagnosis.verdict, Verdict::Adequate, "{told}");
}

/// One record has a delay that the others have not: it contradicts them on what is made of it, and they do not contradict each other.
#[test]
fn what_one_record_alone_has_is_told_by_that_record() {
    let (joint, disagreeing) = disagreeing(|sensors| sensors[1].delay_s = 3.0 * PERIOD_S);
    let told = told(&joint.diagnosis);
    assert_ne!(joint.diagnosis.verdict, Verdict::Explained, "{told}");
    assert_eq!(disagreeing, [false, false, false, false, false, true], "{told}");
}

/// The rig has a gain, and each record an offset. Failed: a gain and an offset of all records were found, something stood in for the offsets,
/// and no number was given.
#[test]
fn an_offset_of_each_record_stands_beside_the_gain_of_all() {
    let of = |k: u32| {
        record(SEED + u64::from(k), |sensors| {
            sensors[1].gain = 1.01;
            sensors[1].offset_k = -0.5 - 0.6 * f64::from(k);
        })
    };
    gain_and_drift(&joint(&(0..4).map(of).collect::<Vec<_>>()));
}

/// The rig has a gain, and each record a drift that begins at nothing. Failed: crosstalk was found.
#[test]
fn a_drift_of_each_record_stands_beside_the_gain_of_all() {
    let of = |(k, k_per_s): (u64, f64)| {
        record(SEED + k, |sensors| {
            sensors[1].gain = 1.01;
            sensors[1].drift_k_per_s = k_per_s;
            sensors[1].offset_k = 0.5 * SAMPLES as f64 * PERIOD_S * k_per_s;
        })
    };
    gain_and_drift(&joint(&[(0, 0.3), (1, -0.2), (2, 0.6)].map(of)));
}

/// Asserts that T2 has a gain of 1.01, within four standard errors, no offset that all records share, and a drift in each, and that both
/// time constants are right.
fn gain_and_drift(joint: &JointDiagnosis) {
    let told = told(&joint.diagnosis);
    let mut effects = named(joint);
    effects.sort();
    assert_eq!(effects, [(Identifier::CALIBRATION, Some(1)), (Identifier::DRIFT, Some(1))], "{told}");
    assert_eq!(joint.diagnosis.verdict, Verdict::Explained, "{told}");
    recovers(&joint.diagnosis.last, TAU_S, &told);
    let calibration = joint.diagnosis.effects.iter().find(|e| e.effect == Identifier::CALIBRATION).expect("named");
    let [gain] = &calibration.parameters[..] else { panic!("a gain alone: {told}") };
    let error = gain.standard_error.expect("given");
    assert!(gain.name == "gain" && (gain.value - 1.01).abs() < 4.0 * error && error < 1e-3, "{gain:?}: {told}");
    assert!(joint.transfer.normalised_rms.after < MAX_NOISE_RMS, "{:?}", joint.transfer);
    assert!(joint.records.iter().all(|record| record.agrees == Some(true)), "{told}");
}

/// An offset of each record, and a second lag of the rig.
#[test]
fn an_offset_of_each_record_stands_beside_a_second_lag() {
    let of = |(k, offset_k): (u64, f64)| {
        record(SEED + k, |sensors| {
            sensors[0].second_time_constant_s = Some(0.004);
            sensors[1].offset_k = offset_k;
        })
    };
    let joint = joint(&[(0, 0.8), (1, -0.5), (2, 0.3), (3, -1.1)].map(of));
    let told = told(&joint.diagnosis);
    let mut effects = named(&joint);
    effects.sort();
    assert_eq!(effects, [(Identifier::SECOND_ORDER, Some(0)), (Identifier::DRIFT, Some(1))], "{told}");
    recovers(&joint.diagnosis.last, TAU_S, &told);
}

/// Noise that is correlated over ten samples, in one channel of every record: a model without it leaves such noise in each record left out,
/// whatever else is in the model. Failed: the records were said to refute the model, and no number was given.
#[test]
fn a_noise_that_every_record_has_refutes_nothing() {
    let of = |seed: u64| record(seed, |sensors| sensors[1].noise = Some(Noise { std_k: 3.0 * NOISE_K, ar1: 0.9 }));
    let joint = joint(&[of(SEED), of(SEED + 1), of(SEED + 2)]);
    let told = told(&joint.diagnosis);
    assert_eq!(named(&joint), [(Identifier::COLOURED_NOISE, Some(1))], "{told}");
    recovers(&joint.diagnosis.last, TAU_S, &told);
    let judgements = &joint.diagnosis.judgements.time_constants;
    assert!(judgements.iter().all(|judgement| judgement.grade != Grade::NoGo), "{told}");
    let of_itself = |r: &OfRecord| r.left_out.normalised_rms_by_itself.is_some_and(|rms| rms > MAX_NOISE_RMS);
    assert!(joint.records.iter().all(of_itself), "{told}");
}

/// The same noise, and a second sensor that is 15 % slower in the last of four records: no number holds for all of them.
#[test]
fn a_noise_that_every_record_has_makes_no_rig_of_two() {
    let of = |(seed, slower): (u64, f64)| {
        record(seed, |sensors| {
            sensors[1].noise = Some(Noise { std_k: 3.0 * NOISE_K, ar1: 0.9 });
            sensors[1].time_constant_s *= slower;
        })
    };
    let joint = joint(&[(SEED, 1.0), (SEED + 1, 1.0), (SEED + 2, 1.0), (SEED + 3, 1.15)].map(of));
    let told = told(&joint.diagnosis);
    assert!(joint.diagnosis.judgements.time_constants.iter().all(|judgement| judgement.grade == Grade::NoGo), "{told}");
}

/// A delay of all records may reach over more samples than the last has, which is of another rig. Failed: it ended in a panic where that
/// record was looked at alone.
#[test]
fn a_record_of_a_hundred_samples_goes_with_long_ones() {
    let of_another = |sensors: &mut [Sensor; 2]| sensors[1].time_constant_s *= 0.5;
    let simulated = readings(SEED + 2, turbulence(), of_another);
    let short = even(simulated.t1_c[..100].to_vec(), simulated.t2_c[..100].to_vec()).expect("finite and long");
    let joint = joint(&[record(SEED, |_| ()), record(SEED + 1, |_| ()), short]);
    let told = told(&joint.diagnosis);
    assert!(joint.records[2].left_out.normalised_rms.after > 1.0 + Policy::default().left_out_rms_margin, "{told}");
    assert_eq!(joint.records[2].agrees, Some(false), "{told}");
}

/// A gas of one tone in one record, and of many in the others: two equations more.
#[test]
fn one_record_of_a_single_tone_refuses_no_others() {
    let tone = Signal::Sine(Tone { amplitude_k: 20.0, frequency_hz: 4.0, phase_rad: 0.3 });
    let simulated = readings(SEED, tone, |_| {});
    let tone = even(simulated.t1_c, simulated.t2_c).expect("finite and long");
    let others = [SEED + 1, SEED + 2].map(|seed| record(seed, |_| {}));
    let [one, two] = others;
    let joint = joint(&[one, two, tone]);
    let told = told(&joint.diagnosis);
    assert_eq!(joint.diagnosis.verdict, Verdict::Adequate, "{told}");
    recovers(&joint.diagnosis.last, TAU_S, &told);
}
