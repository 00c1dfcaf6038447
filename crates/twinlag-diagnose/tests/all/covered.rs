//! That intervals cover what a record leaves open beside the effect that is named. The rigs are those of `twinlag-signal`, which share
//! no code with the models that are fitted.

use crate::common::{TAU_S, found, joint, record};
use twinlag_diagnose::{Diagnosis, Grade, Identifier, Observations, Settings, Stretch, Verdict, diagnose};
use twinlag_signal::{Gas, Mismatch, Noise, Record, Rig, Sensor, Signal, SlowMode, Turbulence};

/// Failed: a gain of 1.03 beside an offset of −0.1 K, at 300 °C, was given as 1.0296667 with an interval of seven digits, and so was the
/// share of the crosstalk that would look the same. Of an interval twice as wide the truth is outside once in ten thousand times.
#[test]
fn a_gain_is_right_if_there_is_an_offset_as_well() {
    let [gain, offset_k] = [1.03, -0.1];
    let (mut gains, mut shares_seen) = (0, 0);
    for seed in 1..=4 {
        let diagnosis = found(&record(seed, |sensors| (sensors[1].gain, sensors[1].offset_k) = (gain, offset_k)));
        assert_eq!(diagnosis.verdict, Verdict::Explained);
        let [effect] = &diagnosis.effects[..] else { panic!("{:#?}", diagnosis.effects) };
        let holds = |interval: Option<[f64; 2]>, truth: f64| {
            let [low, high] = interval.expect("it has an interval");
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            assert!((truth - middle).abs() < 2.0 * half, "[{low}, {high}], want {truth}");
            half
        };
        // Whichever of them was taken to be the cause.
        let parameter = effect.parameters.iter().find(|p| ["gain", "share"].contains(&&p.name[..])).expect("a size");
        if effect.effect == Identifier::CALIBRATION {
            // 1 % of a gas at 300 °C is 3 K, which no offset of a tenth of a kelvin hides.
            assert!(holds(parameter.interval_95, gain) < 0.01, "{parameter:?}");
            gains += 1;
        }
        for (i, tau_s) in TAU_S.into_iter().enumerate() {
            holds(diagnosis.last.time_constants[i].interval_95_s, tau_s);
        }
        let shares = effect.exact_twins.iter().filter(|twin| (twin.effect, twin.channel) == (Identifier::CROSSTALK, 1));
        for twin in shares {
            assert!(holds(twin.parameter.interval_95, gain - 1.0) < 0.01, "{twin:?}");
            shares_seen += 1;
        }
    }
    assert!(gains > 0 && shares_seen > 0, "{gains} gains, {shares_seen} shares");
}

/// An offset of 2 K is as well a sensor that radiates, with time constants a little longer: their intervals lie inside those that are
/// given, whichever of them is the cause. Failed: those of two records did not, where the intervals under another cause cover what
/// records differ.
#[test]
fn time_constants_under_another_cause_are_covered() {
    let of = |seed: u64| record(seed, |sensors| sensors[1].offset_k = 2.0);
    let alone = (1..=4).map(|seed| found(&of(seed)));
    let of_two = [41, 11].map(|seed| joint(&[of(seed), of(seed + 1)]).diagnosis);
    let mut seen = [0, 0];
    for (number, diagnosis) in alone.chain(of_two).enumerate() {
        for other in diagnosis.effects.iter().flat_map(|effect| &effect.other_causes) {
            for (value, given) in other.time_constants.iter().zip(&diagnosis.last.time_constants) {
                let [low, high] = value.interval_95.expect("no number without its interval");
                let [from, to] = given.interval_95_s.expect("no number without its interval");
                assert!(low <= value.value && value.value <= high, "{value:?}");
                assert!(from <= low && high <= to, "{other:#?}, given [{from}, {to}]");
            }
            seen[usize::from(number >= 4)] += 1;
        }
    }
    assert!(seen.iter().all(|seen| *seen > 0), "no other cause alone or of two: {seen:?}");
}

/// A rig of which one sensor sees gas that differs by 3 % of what it moves.
fn mismatched(seed: u64, channel: &str) -> Observations {
    let sensors = [0.1, 0.4].map(|tau_s| {
        let mut sensor = Sensor::new(format!("{tau_s}"), tau_s);
        sensor.noise = Some(Noise::white(0.05));
        sensor
    });
    let gas = Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 0.4, cutoff_hz: 8.0 });
    let rig = Rig::new(seed, Record::new(4000, 0.02), Gas::new(300.0, gas), sensors).expect("a rig");
    let mut mismatch = Mismatch::new(0.5, 0.8);
    mismatch.channel = Some(channel.to_owned());
    let record = rig.with_mismatch(mismatch).expect("a rig").simulate().expect("a record");
    let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
    Observations::new(vec![stretch], Some(0.02)).expect("a record")
}

/// Where the loop finds the mismatch and its size by itself, time constants are as far from the truth as their standard errors say. How
/// large the bias would be is known of many records (tests of `twinlag-model`).
#[test]
fn a_mismatch_of_the_gas_leaves_no_bias() {
    let watch = |_: &str, _, _| std::ops::ControlFlow::Continue(());
    let diagnosed = |observations: &Observations| -> Diagnosis {
        diagnose(observations, &Settings::default(), &watch).expect("a record that can be diagnosed")
    };
    for channel in ["0.1", "0.4"] {
        let mut deviations = [0.0; 2];
        let mut count = 0.0;
        for seed in 1..=8 {
            let diagnosis = diagnosed(&mismatched(seed, channel));
            let is_of_noise = diagnosis.effects.iter().all(|found| found.effect.about().is_noise);
            if diagnosis.verdict != Verdict::Explained || !is_of_noise || diagnosis.effects[0].fitted_in.is_some() {
                continue;
            }
            count += 1.0;
            // 0.5 K, and 1/(2π · 0.8 Hz); four standard errors, none of which is a quarter of its number.
            for (parameter, truth) in diagnosis.effects[0].parameters.iter().zip([0.5, 0.199]) {
                let error = parameter.standard_error.expect("it has an interval") / parameter.value;
                assert!(
                    (parameter.value / truth).ln().abs() < 4.0 * error && error < 0.25,
                    "{parameter:?}, want {truth}"
                );
            }
            for (i, truth_s) in [0.1, 0.4].into_iter().enumerate() {
                let tau = &diagnosis.last.time_constants[i];
                let (value_s, error_s) = (tau.value_s.expect("given"), tau.standard_error_s.expect("given"));
                deviations[i] += (value_s - truth_s) / error_s;
            }
        }
        assert!(count >= 5.0, "{count} of 8 records name the mismatch");
        for sum in deviations {
            let mean: f64 = sum / count;
            assert!(mean.abs() < 3.0 / f64::sqrt(count), "{channel}: {mean} standard errors in {count} records");
        }
    }
}

/// Failed: each sensor has a slow mode, of which one accounts for the residual of both; its share and the
/// time constants, eighteen standard errors off, were go, since the search names each effect once.
#[test]
fn a_slow_mode_is_right_if_the_other_sensor_has_none() {
    let modes = [(0.02, 0.5), (0.05, 5.0)].map(|(fraction, time_constant_s)| SlowMode { fraction, time_constant_s });
    for seed in 1..=2 {
        let mut sensors = [Sensor::new("T1", 0.08), Sensor::new("T2", 0.35)];
        for (sensor, mode) in sensors.iter_mut().zip(modes) {
            (sensor.noise, sensor.slow_mode) = (Some(Noise::white(0.1)), Some(mode));
        }
        let gas = Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 1.0, cutoff_hz: 15.0 });
        let rig = Rig::new(seed, Record::new(3000, 0.01), Gas::new(400.0, gas), sensors).expect("a rig");
        let simulated = rig.simulate().expect("a record");
        let stretch = Stretch::new(simulated.time_s, [simulated.t1_c, simulated.t2_c]);
        let diagnosis = found(&Observations::new(vec![stretch], Some(0.01)).expect("a record"));
        let [effect] = &diagnosis.effects[..] else { panic!("{:#?}", diagnosis.effects) };
        assert_eq!(effect.effect, Identifier::SLOW_MODE);
        let share = &effect.judgements[0];
        assert_eq!(share.grade, Grade::Conditional, "{share:?}");
        assert!(share.because.contains("slow-mode in the other sensor"), "{share:?}");
    }
}
