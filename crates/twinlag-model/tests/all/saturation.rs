//! That a converter at its limit is found, and that neither a digital thermometer on a plateau nor a reading that turns is
//! taken for one. The oracle is the rig: `twinlag-signal` integrates it in continuous time and shares no code with the
//! models that are fitted.

use twinlag_model::{Defect, Identifier, Observations, Prepared, Settings, Stretch};
use twinlag_signal::undeclared::{GasKind, Kind, undeclared};
use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Series, Signal, Simulated, SlowMode};

/// Kinds of effect of a random rig.
const KINDS: [Kind; 9] = [
    Kind::None,
    Kind::Offset,
    Kind::Gain,
    Kind::Curvature,
    Kind::Delay,
    Kind::SecondOrder,
    Kind::SlowMode,
    Kind::Radiation,
    Kind::InputMismatch,
];
const SAMPLES: usize = 3000;
const PERIOD_S: f64 = 1.0;

/// What is seen of saturation in each channel.
fn saturation(time_s: Vec<f64>, reading_c: [Vec<f64>; 2], period_s: f64) -> Vec<Defect> {
    let observations =
        Observations::new(vec![Stretch::new(time_s, reading_c)], Some(period_s)).expect("finite and long");
    let prepared = Prepared::new(&observations, &Settings::default()).expect("channels that change");
    prepared.found.into_iter().filter(|f| f.effect == Identifier::SATURATION).collect()
}

fn rounded(readings_c: Vec<f64>, step_k: f64) -> Vec<f64> {
    readings_c.into_iter().map(|y| (y / step_k).round() * step_k).collect()
}

/// A random rig without a limit, seen by digital thermometers with steps of so many standard deviations of their noise.
fn digital(seed: u64, kind: Kind, steps: f64) -> Vec<Defect> {
    let drawn = undeclared(&[kind], 1.0, None, seed).expect("a rig");
    let record = drawn.simulate().expect("finite numbers");
    let steps_k = [0, 1].map(|i| steps * drawn.rig.sensors()[i].noise.expect("every rig has noise").std_k);
    let period_s = drawn.rig.record().sample_period_s;
    saturation(record.time_s, [rounded(record.t1_c, steps_k[0]), rounded(record.t2_c, steps_k[1])], period_s)
}

/// Plateaus at temperatures that multiples of the golden ratio give, with ramps or near jumps between them:
/// sensors with time constants of 12 and 60 samples.
///
/// - `ramp`: the part of the time between two plateaus that a ramp takes
fn plateaus(seed: u64, ramp: f64, noise_k: f64, change: impl FnOnce(&mut [Sensor; 2])) -> Simulated {
    const PLATEAUS: usize = 6;
    let level = |k: usize| 40.0 * ((PLATEAUS as u64 * seed) as f64 * 0.618_034 + k as f64 * 0.618_034).fract();
    let values_c = (0..=SAMPLES)
        .map(|k| {
            let at = k as f64 / SAMPLES as f64 * (PLATEAUS - 1) as f64;
            let (from, part) = ((at as usize).min(PLATEAUS - 1), at.fract());
            let moved = ((part - (1.0 - ramp)) / ramp).max(0.0);
            level(from) + moved * (level(from + 1) - level(from))
        })
        .collect();
    let mut sensors = [Sensor::new("T1", 12.0), Sensor::new("T2", 60.0)];
    sensors.iter_mut().for_each(|s| s.noise = Some(Noise::white(noise_k)));
    change(&mut sensors);
    let gas = Gas::new(20.0, Signal::Series(Series::Inline { values_c, period_s: PERIOD_S }));
    let rig = Rig::new(seed, Record::new(SAMPLES, PERIOD_S), gas, sensors).expect("a valid rig");
    rig.simulate().expect("finite numbers")
}

/// Plateaus with noise of a fifth of the steps that they are seen with.
fn digital_plateaus(seed: u64, ramp: f64, step_k: f64, change: impl FnOnce(&mut [Sensor; 2])) -> Vec<Defect> {
    let record = plateaus(seed, ramp, 0.2 * step_k, change);
    saturation(record.time_s, [rounded(record.t1_c, step_k), rounded(record.t2_c, step_k)], PERIOD_S)
}

/// A change of the sensors, with its name.
type Wrong = (&'static str, fn(&mut [Sensor; 2]));

/// Changes of the sensors by which a two-lag model is wrong.
const WRONGS: [Wrong; 5] = [
    ("nothing", |_| ()),
    ("offset", |s| s[1].offset_k = 2.0),
    ("gain", |s| s[0].gain = 1.05),
    ("slow mode", |s| s[1].slow_mode = Some(SlowMode { fraction: 0.08, time_constant_s: 400.0 })),
    ("delay", |s| s[0].delay_s = 5.0),
];

/// The masked samples are those at the limit that the rig's converter has, and no others.
#[test]
fn a_converter_at_its_limit_is_found_with_its_samples() {
    for (seed, gas) in [(1, GasKind::Turbulence), (2, GasKind::Engine), (3, GasKind::MultiTone)] {
        let drawn = undeclared(&[Kind::Saturation, Kind::Gain], 1.0, Some(gas), seed).expect("a rig");
        let record = drawn.simulate().expect("finite numbers");
        let channel = drawn.channel.expect("a limit is of one channel");
        let adc = drawn.rig.sensors()[channel].adc.expect("a limit");
        let is_at_limit = |y: &f64| Some(*y) == adc.high_c || Some(*y) == adc.low_c;
        let readings = [&record.t1_c, &record.t2_c][channel];
        let expected: Vec<usize> = (0..readings.len()).filter(|k| is_at_limit(&readings[*k])).collect();
        let found = saturation(record.time_s, [record.t1_c, record.t2_c], drawn.rig.record().sample_period_s);
        let [defect] = &found[..] else { panic!("one channel, seed {seed}: {found:?}") };
        assert_eq!((defect.channel, &defect.masked), (channel, &expected), "seed {seed}");
    }
}

/// The limit lies within the noise of a plateau, where the other channel goes nowhere.
#[test]
fn a_limit_that_cuts_noise_is_found() {
    const LIMIT_C: f64 = 59.9;
    let values_c = (0..=SAMPLES).map(|k| if (k / 500) % 2 == 0 { 60.0 } else { 30.0 }).collect();
    let mut sensors = [Sensor::new("T1", 12.0), Sensor::new("T2", 60.0)];
    sensors.iter_mut().for_each(|s| s.noise = Some(Noise::white(0.3)));
    let gas = Gas::new(0.0, Signal::Series(Series::Inline { values_c, period_s: PERIOD_S }));
    let rig = Rig::new(1, Record::new(SAMPLES, PERIOD_S), gas, sensors).expect("a valid rig");
    let record = rig.simulate().expect("finite numbers");
    let t1_c: Vec<f64> = record.t1_c.iter().map(|y| y.min(LIMIT_C)).collect();
    let at_limit = t1_c.iter().filter(|y| **y == LIMIT_C).count();
    let found = saturation(record.time_s, [t1_c, record.t2_c], PERIOD_S);
    assert_eq!(found.iter().map(|f| (f.channel, f.masked.len())).collect::<Vec<_>>(), [(0, at_limit)]);
}

/// A converter that is coarse as well: every value comes again and again, and the limit is one of them.
#[test]
fn a_digital_thermometer_at_its_limit_is_found() {
    for (seed, gas) in [(11, GasKind::Turbulence), (12, GasKind::MultiTone)] {
        let drawn = undeclared(&[Kind::Saturation], 1.0, Some(gas), seed).expect("a rig");
        let record = drawn.simulate().expect("finite numbers");
        let channel = drawn.channel.expect("a limit is of one channel");
        let steps_k = drawn.rig.sensors().each_ref().map(|s| 4.0 * s.noise.expect("every rig has noise").std_k);
        let readings = [rounded(record.t1_c, steps_k[0]), rounded(record.t2_c, steps_k[1])];
        let found = saturation(record.time_s, readings, drawn.rig.record().sample_period_s);
        assert_eq!(found.iter().map(|f| f.channel).collect::<Vec<_>>(), [channel], "seed {seed}");
    }
}

/// Failed: steps of 0.1 °F, printed in hundredths of a degree Celsius, are on no grid, and a plateau counted as the end of a
/// range.
#[test]
fn a_plateau_in_fahrenheit_is_no_limit() {
    let fahrenheit = |readings_c: Vec<f64>| -> Vec<f64> {
        let in_f = readings_c.into_iter().map(|c| (10.0 * (32.0 + 1.8 * c)).round() / 10.0);
        in_f.map(|f| (100.0 * (f - 32.0) / 1.8).round() / 100.0).collect()
    };
    for (seed, (name, wrong)) in WRONGS.into_iter().enumerate() {
        for ramp in [0.05, 0.3, 0.9] {
            let record = plateaus(seed as u64, ramp, 0.01, wrong);
            let found = saturation(record.time_s, [fahrenheit(record.t1_c), fahrenheit(record.t2_c)], PERIOD_S);
            assert!(found.is_empty(), "{name}, ramps of {ramp}: {found:?}");
        }
    }
}

#[test]
fn a_plateau_is_no_limit() {
    for (seed, (name, wrong)) in WRONGS.into_iter().enumerate() {
        for (ramp, step_k) in [(0.05, 0.01), (0.3, 0.0625), (0.9, 0.5)] {
            let found = digital_plateaus(seed as u64, ramp, step_k, wrong);
            assert!(found.is_empty(), "{name}, ramps of {ramp}, steps of {step_k} K: {found:?}");
        }
    }
}

/// An end counts as a limit if the other channel moves on by more than at 39 places elsewhere
/// ([`twinlag_model::Policy::limit_comparisons`]), which chance does once in forty. A record has four ends, so one in ten has a limit
/// that is not there at most: of 54, fourteen or more once in a thousand times (binomial).
#[test]
fn random_rigs_without_a_limit_have_few() {
    const MOST: usize = 13;
    let mut found = Vec::new();
    for (i, kind) in KINDS.into_iter().enumerate() {
        for (j, steps) in [3.0, 10.0, 30.0].into_iter().enumerate() {
            for seed in 0..2 {
                let defects = digital(2000 + (6 * i + 2 * j) as u64 + seed, kind, steps);
                found.extend((!defects.is_empty()).then_some((kind, steps, seed)));
            }
        }
    }
    assert!(found.len() <= MOST, "{} of {}, at most {MOST}: {found:?}", found.len(), 6 * KINDS.len());
}
