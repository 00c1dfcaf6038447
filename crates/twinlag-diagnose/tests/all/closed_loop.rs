//! That a diagnosis names the effect that was put into a simulated rig, that both time constants are right once it is in the
//! model, and that someone who does not know of the effect is told of no other. The oracle is the rig: `twinlag-signal`
//! integrates it in continuous time and shares no code with the models that are fitted.

use crate::common::{
    GAS_K, NOISE_K, PERIOD_S, SEED, TAU_S, even, found, found_without, limited, ramps, readings, record, recovers,
    told, turbulence,
};
use twinlag_diagnose::{
    Diagnosis, Found, Grade, Identifier, KnownEffect, Observations, Settings, Stretch, Verdict, fit_with,
};
use twinlag_signal::{
    Broadband, ColouredNoise, Engine, Gas, Noise, Record, Rig, Sensor, Signal, Simulated, Spikes,
    TemperatureDependence, Turbulence,
};

/// Offset of T2, K. In white noise its standard error is `σ √2/√n` = 0.0026 K.
const OFFSET_K: f64 = 2.0;
/// Delay of T1: a fifth of its time constant.
const DELAY_S: f64 = 0.0024;
/// Second time constant of T2: three tenths of the first.
const SECOND_S: f64 = 0.018;
/// Drift of T2: 3 K over the record.
const DRIFT_K_PER_S: f64 = 1.0;

fn offset(sensors: &mut [Sensor; 2]) {
    sensors[1].offset_k = OFFSET_K;
}

fn delay(sensors: &mut [Sensor; 2]) {
    sensors[0].delay_s = DELAY_S;
}

fn second_order(sensors: &mut [Sensor; 2]) {
    sensors[1].second_time_constant_s = Some(SECOND_S);
}

fn drift(sensors: &mut [Sensor; 2]) {
    sensors[1].drift_k_per_s = DRIFT_K_PER_S;
}

/// In the slow channel, whose noise is what a cross-relation hears of high frequencies.
fn spikes(sensors: &mut [Sensor; 2]) {
    sensors[1].spikes = Some(Spikes::new(0.005, 30.0 * NOISE_K));
}

fn coloured_noise(sensors: &mut [Sensor; 2]) {
    sensors[1].coloured_noise = Some(ColouredNoise::new(2.0 * NOISE_K, 15.0 * PERIOD_S));
}

/// Asserts that `effect` comes first, explains the record, and leaves both time constants right; and that the held-out residual
/// is noise. On the `n` = 375 samples that judge, the root mean square of noise of known level is 1 ± 1/√(2n), 3.7 %; the level
/// itself is found to 2 %: 1.1 is beyond twice the two together.
fn is_explained_by(d: &Diagnosis, effect: Identifier) -> &Found {
    let told = told(d);
    assert_eq!(d.verdict, Verdict::Explained, "{told}");
    assert_eq!(d.effects[0].effect, effect, "{told}");
    assert!(d.unexplained.is_none(), "{told}");
    recovers(&d.last, TAU_S, &told);
    let rms = d.error.held_out_normalised_rms;
    assert!(rms.after <= 1.1, "{told}");
    &d.effects[0]
}

/// The same for an effect that is inferred, so that there is a fit without it to compare with.
fn is_inferred(d: &Diagnosis, effect: Identifier) -> &Found {
    let rms = d.error.held_out_normalised_rms;
    assert!(rms.after < rms.before, "{}", told(d));
    let evidence = d.effects[0].evidence.expect("inferred");
    assert!(evidence.p_value < 1e-4 && evidence.held_out_gain_nats > 0.0, "{}", told(d));
    is_explained_by(d, effect)
}

/// The parameter is `want` within four of its standard errors.
fn is_sized(found: &Found, parameter: &str, want: f64) {
    let value = found.parameters.iter().find(|p| p.name == parameter).unwrap_or_else(|| panic!("{found:#?}"));
    let error = value.standard_error.expect("a fitted number has one");
    let got = value.value;
    assert!((got - want).abs() <= 4.0 * error, "{parameter}: got {got}, want {want} ± 4 × {error}");
}

/// Asserts that someone who does not know `effect` is not told confidently of something else: the record is not explained, or
/// by effects alone that `effect` is documented to look like.
fn is_not_misnamed(observations: &Observations, effect: Identifier) {
    let d = found_without(observations, effect);
    let told = told(&d);
    assert!(d.effects.iter().all(|f| f.effect != effect && !f.alternatives.contains(&effect)), "{told}");
    assert_ne!(d.verdict, Verdict::Adequate, "{told}");
    if d.verdict == Verdict::Explained {
        let look_alikes: Vec<Identifier> = effect.imitates().collect();
        assert!(d.effects.iter().all(|f| look_alikes.contains(&f.effect)), "{told}");
    }
}

#[test]
fn two_lags_in_white_noise_are_adequate() {
    let d = found(&record(SEED, |_| ()));
    let told = told(&d);
    assert_eq!(d.verdict, Verdict::Adequate, "{told}");
    assert!(d.effects.is_empty() && d.unexplained.is_none(), "{told}");
    recovers(&d.last, TAU_S, &told);
    assert_eq!(d.base.time_constants, d.last.time_constants, "nothing was added: {told}");
    assert!(
        !d.limits.is_empty() && !d.not_testable.is_empty(),
        "what was looked for in vain, and what cannot be: {told}"
    );
}

/// Where the gas has no power, noise of both channels happens to cancel at some angle, which a delay or a second lag can turn to: at
/// most one alarm in a thousand is asked for, and none in eight is what that gives.
#[test]
fn chance_alignments_of_noise_are_no_delay() {
    for seed in 0..8 {
        let simulated = readings(SEED + seed, ramps(SEED + seed), |_| ());
        let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
        assert_eq!(d.verdict, Verdict::Adequate, "seed {seed}: {}", told(&d));
    }
}

/// In the same gas a delay that is there is found.
#[test]
fn a_delay_in_ramps_is_found() {
    let simulated = readings(SEED, ramps(SEED), |sensors| sensors[0].delay_s = 5.0 * DELAY_S);
    let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
    assert_eq!(d.effects[0].effect, Identifier::DELAY, "{}", told(&d));
}

/// Both time constants follow the temperature halfway between sensor and gas, as conductivity and viscosity of the gas do. The
/// sensor's own temperature is another effect: the gas is up to 60 K from it.
#[test]
fn time_constants_that_follow_the_film_are_found() {
    const EXPONENT: f64 = -1.8;
    let gas = Signal::Turbulence(Turbulence { std_k: 3.0 * GAS_K, corner_hz: 2.4, cutoff_hz: 200.0 });
    let follow = |sensors: &mut [Sensor; 2]| {
        let film = TemperatureDependence::of_film(EXPONENT, 300.0);
        sensors.iter_mut().for_each(|sensor| sensor.temperature_dependence = Some(film));
    };
    let simulated = readings(SEED, gas, follow);
    let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
    let told = told(&d);
    assert_eq!(d.verdict, Verdict::Explained, "{told}");
    let effect = &d.effects[0];
    let seat = (effect.effect, effect.channel);
    assert_eq!(seat, (Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, None), "{told}");
    is_sized(effect, "exponent", EXPONENT);
    // Time constants are those at the mean of the record, and not at 300 °C.
    let mean_c = effect.parameters.iter().find(|p| p.name == "mean_temperature").expect("derived").value;
    let factor = ((mean_c + 273.15) / 573.15).powf(EXPONENT);
    recovers(&d.last, TAU_S.map(|tau_s| factor * tau_s), &told);
}

#[test]
fn an_offset_is_found() {
    let d = found(&record(SEED, offset));
    is_sized(is_inferred(&d, Identifier::CALIBRATION), "offset", OFFSET_K);
}

#[test]
fn an_unknown_offset_is_not_misnamed() {
    is_not_misnamed(&record(SEED, offset), Identifier::CALIBRATION);
}

/// Only the difference of both delays is seen: T1 late is T2 early.
#[test]
fn a_delay_is_found() {
    let d = found(&record(SEED, delay));
    let effect = is_inferred(&d, Identifier::DELAY);
    let sign = if effect.channel == Some(0) { 1.0 } else { -1.0 };
    is_sized(effect, "delay", sign * DELAY_S);
    // The gas does not repeat itself, so that no other delay fits as well.
    assert!(!effect.judgements[0].because.contains("repeats itself"), "{:?}", effect.judgements);
}

#[test]
fn an_unknown_delay_is_not_misnamed() {
    is_not_misnamed(&record(SEED, delay), Identifier::DELAY);
}

#[test]
fn a_second_lag_is_found() {
    let d = found(&record(SEED, second_order));
    let effect = is_inferred(&d, Identifier::SECOND_ORDER);
    assert_eq!(effect.channel, Some(1), "{}", told(&d));
    is_sized(effect, "second_time_constant", SECOND_S);
}

#[test]
fn an_unknown_second_lag_is_not_misnamed() {
    is_not_misnamed(&record(SEED, second_order), Identifier::SECOND_ORDER);
}

#[test]
fn a_drift_is_found() {
    let d = found(&record(SEED, drift));
    is_sized(is_inferred(&d, Identifier::DRIFT), "drift", DRIFT_K_PER_S);
}

/// A second lag nearly as long as the first. Failed: the residuals alone, of which the energies differ by chance, made a delay of it that
/// was `go`; and where both lags come out equal, a covariance that knew nothing of their difference gave them as if it were known. With a standard error of
/// `q` of a tenth of a lag squared they would be within 44 %; the ends are held to twice that.
#[test]
fn two_lags_that_may_be_equal_are_no_delay() {
    let lags_s = [0.15, 0.12];
    let mut sensors = [Sensor::new("T1", lags_s[0]), Sensor::new("T2", 0.6)];
    sensors[0].second_time_constant_s = Some(lags_s[1]);
    sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(1.0)));
    let gas = Gas::new(350.0, Signal::Broadband(Broadband { std_k: 16.0, corner_hz: 0.27 }));
    let record = Rig::new(1, Record::new(2000, 0.02), gas, sensors).expect("a valid rig").simulate();
    let Simulated { time_s, t1_c, t2_c, .. } = record.expect("a rig of finite numbers");
    let stretch = Stretch::new(time_s, [t1_c, t2_c]);
    let d = found(&Observations::new(vec![stretch], Some(0.02)).expect("finite and long"));
    let named: Vec<_> = d.effects.iter().map(|found| (found.effect, found.channel)).collect();
    assert_eq!(named, [(Identifier::SECOND_ORDER, Some(0))], "{}", told(&d));
    let second = d.effects[0].parameters[0].interval_95.expect("it is determined");
    let first = d.last.time_constants[0].interval_95_s.expect("it is determined");
    for (lag_s, [low_s, high_s]) in lags_s.into_iter().zip([first, second]) {
        assert!(
            low_s < lag_s && lag_s < high_s && high_s < 1.88 * lag_s,
            "{lag_s} s in [{low_s}, {high_s}]: {}",
            told(&d)
        );
    }
}

/// Two lags that last nearly as long together as the other sensor's one. Failed: two lags alone end with one on its bound, a second lag was looked for from
/// there alone, and a slow mode was named. Beside the noise, intervals are of 95 %: twice as long, they miss once in 11 000.
#[test]
fn a_second_lag_is_found_where_two_lags_alone_end_far_from_it() {
    let (lags_s, other_s) = ([0.09, 0.05], 0.15);
    let mut sensors = [Sensor::new("T1", lags_s[0]), Sensor::new("T2", other_s)];
    sensors[0].second_time_constant_s = Some(lags_s[1]);
    sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.17)));
    let gas = Gas::new(300.0, Signal::Broadband(Broadband { std_k: 17.0, corner_hz: 1.0 }));
    let record = Rig::new(1, Record::new(3000, 0.005), gas, sensors).expect("a valid rig").simulate();
    let Simulated { time_s, t1_c, t2_c, .. } = record.expect("a rig of finite numbers");
    let d = found(&Observations::new(vec![Stretch::new(time_s, [t1_c, t2_c])], Some(0.005)).expect("finite and long"));
    let named: Vec<_> = d.effects.iter().map(|found| (found.effect, found.channel)).collect();
    assert_eq!(named, [(Identifier::SECOND_ORDER, Some(0))], "{}", told(&d));
    let [one, two] = d.last.time_constants.map(|number| number.interval_95_s.expect("it is determined"));
    let second = d.effects[0].parameters[0].interval_95.expect("it is determined");
    for (lag_s, [low_s, high_s]) in [(lags_s[0], one), (other_s, two), (lags_s[1], second)] {
        let (middle_s, half_s) = (0.5 * (low_s + high_s), 0.5 * (high_s - low_s));
        assert!((lag_s - middle_s).abs() < 2.0 * half_s && half_s < 0.1 * lag_s, "{lag_s} s: {}", told(&d));
    }
}

/// Failed: "explained" by coloured noise, correlated over 0.15 s of 3 s.
#[test]
fn an_unknown_drift_is_not_misnamed() {
    is_not_misnamed(&record(SEED, drift), Identifier::DRIFT);
}

/// A defect is seen, not inferred: there is no fit without it, and no evidence.
#[test]
fn a_converter_that_saturates_is_found() {
    let d = found(&record(SEED, limited(SEED, 0)));
    let effect = is_explained_by(&d, Identifier::SATURATION);
    assert_eq!((effect.channel, effect.evidence), (Some(0), None), "{}", told(&d));
    assert!(effect.seen.is_some(), "{}", told(&d));
}

#[test]
fn an_unknown_saturation_is_not_misnamed() {
    is_not_misnamed(&record(SEED, limited(SEED, 0)), Identifier::SATURATION);
}

#[test]
fn spikes_are_found() {
    let d = found(&record(SEED, spikes));
    let effect = is_explained_by(&d, Identifier::SPIKES);
    assert_eq!((effect.channel, effect.evidence), (Some(1), None), "{}", told(&d));
}

#[test]
fn unknown_spikes_are_not_misnamed() {
    is_not_misnamed(&record(SEED, spikes), Identifier::SPIKES);
}

#[test]
fn coloured_noise_is_found() {
    let d = found(&record(SEED, coloured_noise));
    is_inferred(&d, Identifier::COLOURED_NOISE);
}

#[test]
fn unknown_coloured_noise_is_not_misnamed() {
    is_not_misnamed(&record(SEED, coloured_noise), Identifier::COLOURED_NOISE);
}

/// The effects of a rig, as they were measured once, and another record of it: the oracle is the rig's own numbers.
#[test]
fn a_known_effect_gives_the_time_constants_of_another_record() {
    let known = [
        KnownEffect {
            effect: Identifier::SECOND_ORDER,
            channel: Some(1),
            parameters: vec![("second_time_constant".into(), SECOND_S)],
        },
        KnownEffect {
            effect: Identifier::CALIBRATION,
            channel: Some(1),
            parameters: vec![("offset".into(), OFFSET_K)],
        },
    ];
    let later = record(SEED + 1, |sensors| {
        second_order(sensors);
        offset(sensors);
    });
    let with = fit_with(&later, &Settings::default(), &known).expect("a record and effects of this version").fit;
    let tests: Vec<(&str, f64)> = with.tests.iter().map(|t| (t.test.name(), t.p_value)).collect();
    recovers(&with, TAU_S, &format!("{tests:?}"));
    assert!(tests.iter().all(|(_, p)| *p > 1e-4), "only noise is left: {tests:?}");
    let without = fit_with(&later, &Settings::default(), &[]).expect("a record").fit;
    assert!(without.chi2_per_dof > 4.0 * with.chi2_per_dof, "{} {}", without.chi2_per_dof, with.chi2_per_dof);
}

/// A model of another version may have other parameters.
#[test]
fn a_known_effect_of_unknown_parameters_is_refused() {
    let known =
        KnownEffect { effect: Identifier::DELAY, channel: Some(1), parameters: vec![("lateness".into(), DELAY_S)] };
    let error = fit_with(&record(SEED, |_| ()), &Settings::default(), &[known]).expect_err("a delay has no lateness");
    assert!(error.to_string().contains("delay"), "{error}");
}

/// What is not random in one record is there in the next as well, but elsewhere: the documentation promises that defects are
/// dealt with as in a diagnosis.
#[test]
fn a_known_effect_of_spikes_takes_those_of_another_record_out() {
    let known = KnownEffect { effect: Identifier::SPIKES, channel: Some(1), parameters: Vec::new() };
    let later = record(SEED + 1, spikes);
    let fit = fit_with(&later, &Settings::default(), &[known]).expect("a record and an effect of this version").fit;
    let tests: Vec<(&str, f64)> = fit.tests.iter().map(|t| (t.test.name(), t.p_value)).collect();
    assert!(tests.iter().all(|(_, p)| *p > 1e-4), "only noise is left: {tests:?}");
}

/// A reading of the fast channel counts little at high frequencies, where the slow one's noise is all that is heard: twenty
/// standard deviations are plain in the readings and unseen in the residual.
#[test]
fn spikes_of_the_fast_channel_are_found() {
    let d = found(&record(SEED, |sensors| sensors[0].spikes = Some(Spikes::new(0.005, 20.0 * NOISE_K))));
    is_explained_by(&d, Identifier::SPIKES);
}

/// Failed: one wrong cell was never named, and left a record partly explained or a sensor with a second lag that it does not have.
#[test]
fn a_lone_wrong_reading_is_found() {
    const K: usize = 700;
    for channel in 0..2 {
        let mut simulated = readings(SEED, turbulence(), |_| ());
        let wrong = [&mut simulated.t1_c, &mut simulated.t2_c][channel].get_mut(K).expect("a long record");
        *wrong = 5.0;
        let d = found(&even(simulated.t1_c, simulated.t2_c).expect("finite and long"));
        let effect = is_explained_by(&d, Identifier::SPIKES);
        let masked: Vec<[usize; 2]> = effect.masked.iter().map(|m| m.rows).collect();
        assert_eq!((effect.channel, &masked[..]), (Some(channel), &[[K; 2]][..]), "{}", told(&d));
        assert_eq!(d.effects.len(), 1, "{}", told(&d));
    }
}

/// Named in the channel that has it, or in none.
#[test]
fn coloured_noise_of_the_fast_channel_is_not_put_into_the_other() {
    let noise = ColouredNoise::new(2.0 * NOISE_K, 15.0 * PERIOD_S);
    let d = found(&record(SEED, |sensors| sensors[0].coloured_noise = Some(noise)));
    let effect = is_inferred(&d, Identifier::COLOURED_NOISE);
    assert_ne!(effect.channel, Some(1), "{}", told(&d));
}

/// Failed: in the exhaust of an engine at 20 Hz a delay of 5 ms was given as 55 ms, a period more, and graded `go`; with seed 7 it was found
/// as radiation. A period more fits as well, which is said.
#[test]
fn a_delay_is_no_period_longer() {
    const DELAY_S: f64 = 0.005;
    for seed in 1..=8 {
        let mut sensors = [0.0238, 0.1168].map(|tau_s| Sensor::new(format!("{tau_s}"), tau_s));
        sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.5)));
        sensors[1].delay_s = DELAY_S;
        let gas = Gas::new(450.0, Signal::Engine(Engine::new(60.0, 20.0)));
        let rig = Rig::new(seed, Record::new(4000, 2.0 * PERIOD_S), gas, sensors).expect("a valid rig");
        let record = rig.simulate().expect("a rig of finite numbers");
        let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
        let diagnosis = found(&Observations::new(vec![stretch], Some(2.0 * PERIOD_S)).expect("a record"));
        let effect = diagnosis.effects.iter().find(|effect| effect.effect == Identifier::DELAY).expect("it has one");
        let delay = &effect.parameters[0];
        let error = delay.standard_error.expect("a fitted number has one");
        assert!((delay.value - DELAY_S).abs() < 4.0 * error, "seed {seed}: {delay:?}");
        let judgement = &effect.judgements[0];
        assert_eq!(judgement.grade, Grade::Conditional, "seed {seed}: {judgement:?}");
        assert!(judgement.because.contains("the gas repeats itself"), "seed {seed}: {judgement:?}");
        // A period more, to the first two decimals.
        assert!(judgement.because.contains("0.05"), "seed {seed}: {judgement:?}");
    }
}
