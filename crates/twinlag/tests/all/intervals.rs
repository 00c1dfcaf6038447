//! What intervals are made of.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::record;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use twinlag::estimate::{Bootstrap, IntervalBasis};
use twinlag::record::{Channels, Record, SamplingChoice, SamplingKind};
use twinlag::{Hold, IntervalMethod, Intervals, Options, Status, characterise, characterise_watched};

const TRUTH_S: [f64; 2] = [0.0238, 0.1168];

fn rig(seed: u64, samples: usize) -> Record {
    let gas = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 3.0\ncutoff_hz = 60.0\nhold = \"zero-order\"";
    let sensors = TRUTH_S.map(|t| format!("time_constant_s = {t}\nnoise = {{ std_k = 0.5 }}"));
    record(seed, samples, 0.002, gas, [&sensors[0], &sensors[1]])
}

/// On a record that determines both time constants to a few per cent the three kinds are ways to the same interval. The profile
/// differs by the cost's third derivative, of the order of the relative error; a quantile of 399 replicates at 2.5 % is good
/// to `√(0.025·0.975/399)/φ(1.96)` = 0.13 standard errors, four of which are 0.27 interval half-widths; the bootstrap's
/// asymmetry and the noise found anew in each replicate add to it.
#[test]
fn profile_and_bootstrap_agree_with_standard_errors_where_these_hold() {
    let record = rig(1, 3000);
    let auto = characterise(&record, &Options::default()).expect("a sound question");
    assert_eq!((auto.status, auto.interval_method), (Status::Ok, IntervalMethod::Information));
    let bootstrap = Intervals::Bootstrap(Bootstrap { replicates: 399, seed: 1 });
    for (intervals, method, basis, tolerance) in [
        (Intervals::Profile, IntervalMethod::Information, IntervalBasis::Profile, 0.1),
        (bootstrap, IntervalMethod::Bootstrap, IntervalBasis::Bootstrap, 0.35),
    ] {
        let answer = characterise(&record, &Options { intervals, ..Options::default() }).expect("a sound question");
        assert_eq!(answer.interval_method, method);
        for (a, b) in answer.sensors.iter().zip(&auto.sensors) {
            assert_eq!((a.interval_basis, b.interval_basis), (Some(basis), Some(IntervalBasis::StandardError)));
            let (got, want) = (a.interval_95_s.expect("an answer"), b.interval_95_s.expect("an answer"));
            let half = 0.5 * (want[1] - want[0]);
            for (got, want) in got.into_iter().zip(want) {
                assert!(
                    (got - want).abs() < tolerance * half,
                    "{basis:?}: {got} s, by standard errors {want} ± {half} s"
                );
            }
        }
    }
}

/// Whatever the gas does between samples, and whichever hold is asked for or found: one of these gases is taken to go in straight lines.
/// Failed: of 40 records in a gas as fast as the first the interval around one hold missed the truth, near the other, in 12.
#[test]
fn an_interval_reaches_from_one_hold_to_the_other() {
    let mut found = Vec::new();
    for gas in [
        "kind = \"broadband\"\nstd_k = 15.0\ncorner_hz = 15.0",
        "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 3.0\ncutoff_hz = 60.0",
    ] {
        let sensors = [0.007, 0.018].map(|t| format!("time_constant_s = {t}\nnoise = {{ std_k = 0.1 }}"));
        let record = record(5, 3000, 0.002, gas, [&sensors[0], &sensors[1]]);
        let ask = |hold| {
            characterise(&record, &Options { hold, best_effort: true, ..Options::default() }).expect("a sound question")
        };
        let answers = [Hold::Auto, Hold::ZeroOrderHold, Hold::FirstOrderHold].map(ask);
        found.push(answers[0].hold.clone());
        for (sensor, truth_s) in answers.iter().flat_map(|answer| answer.sensors.iter().zip([0.007, 0.018])) {
            let [low, high] = sensor.interval_95_s.expect("an answer");
            assert!(low <= truth_s && truth_s <= high, "{gas}: {truth_s} s and [{low}, {high}]");
        }
        for (one, other) in answers.iter().flat_map(|one| answers[1..].iter().map(move |other| (one, other))) {
            for (one, other) in one.sensors.iter().zip(&other.sensors) {
                let [low, high] = one.interval_95_s.expect("an answer");
                let value = other.time_constant_s.expect("an answer");
                assert!(low <= value && value <= high, "{gas}: {value} s and [{low}, {high}]");
            }
            let [low, high] = one.time_constant_difference_s.interval_95_s.expect("an answer");
            let value = other.time_constant_difference_s.value.expect("an answer");
            assert!(low <= value && value <= high, "{gas}: difference {value} s and [{low}, {high}]");
        }
    }
    assert!(found[0] != found[1] && found.contains(&"first-order-hold".to_owned()), "{found:?}");
}

#[test]
fn a_bootstrap_is_repeatable_and_tells_how_far_it_is() {
    let record = rig(2, 800);
    let ask = |seed: u64| {
        let told = AtomicUsize::new(0);
        let watch = |task: &str, done: usize, of: usize| {
            assert!(done <= of, "{task}: {done} of {of}");
            // Other steps of the answer are reported as well.
            if task.contains("bootstrap") {
                assert_eq!(of, 39);
                told.fetch_add(1, Ordering::Relaxed);
            }
            ControlFlow::Continue(())
        };
        let intervals = Intervals::Bootstrap(Bootstrap { replicates: 39, seed });
        let options = Options { intervals, ..Options::default() };
        let answer = characterise_watched(&record, &options, &watch).expect("a sound question");
        assert_eq!(told.load(Ordering::Relaxed), 39);
        answer.sensors.map(|s| s.interval_95_s)
    };
    assert_eq!(ask(1), ask(1));
    assert_ne!(ask(1), ask(2));
}

/// A sine has all its power in one line, and the noise around it must not pass for gas: it once did, through the straight line
/// that was drawn between two noisy ends, and the intervals of the slow sensor came out a fifth too short. Widths of 8 records
/// with 99 replicates each: a width has a relative standard error of some 0.13, their mean of 0.05; three of these.
#[test]
fn a_bootstrap_does_not_take_noise_for_gas() {
    let gas = "kind = \"sine\"\namplitude_k = 16.5\nfrequency_hz = 10.0\nhold = \"zero-order\"";
    let sensors = TRUTH_S.map(|t| format!("time_constant_s = {t}\nnoise = {{ std_k = 0.583 }}"));
    let mut ratio = [0.0; 2];
    for seed in 0..8 {
        let record = record(seed, 2500, 0.002, gas, [&sensors[0], &sensors[1]]);
        let widths = |intervals| {
            let hold = twinlag::Hold::ZeroOrderHold;
            // Of a record that a test rejects by chance the widths count as well.
            let options = Options { intervals, hold, best_effort: true, ..Options::default() };
            let answer = characterise(&record, &options).expect("a sound question");
            answer.sensors.map(|s| s.interval_95_s.map(|[low, high]| (high / low).ln()).expect("an answer"))
        };
        let (auto, boot) = (widths(Intervals::Auto), widths(Intervals::Bootstrap(Bootstrap { replicates: 99, seed })));
        (0..2).for_each(|i| ratio[i] += boot[i] / auto[i] / 8.0);
    }
    assert!(ratio.iter().all(|r| (r - 1.0).abs() < 0.15), "bootstrap over standard errors: {ratio:?}");
}

/// Stamps that jitter by 3 % of the period, as those of a program that waits between readings. The gas is a sum of tones, so that what a
/// sensor of one lag reads at any instant is known in closed form. Of 24 intervals of 95 % that hold the truth three and more miss it
/// with a probability of 0.12, five and more with 0.006. Failed: of 24 intervals around the zero-order hold alone 21 missed it.
#[test]
fn an_interval_of_uneven_stamps_reaches_to_the_other_hold() {
    const PERIOD_S: f64 = 0.1;
    const TAU_S: [f64; 2] = [0.3, 0.8];
    let mut missed = 0;
    for seed in 0..12 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let tones: Vec<[f64; 3]> = (0..60)
            .map(|_| {
                let hz: f64 = random.random_range(0.01..1.5);
                [hz, 1.5 / (1.0 + hz), random.random_range(0.0..std::f64::consts::TAU)]
            })
            .collect();
        let time_s: Vec<f64> =
            (0..1200).map(|k| PERIOD_S * (f64::from(k) + random.random_range(-0.05..0.05))).collect();
        let [t1_c, t2_c] = TAU_S.map(|tau_s| {
            let reads = |at_s: &f64| {
                let tone = |[hz, size_k, phase]: &[f64; 3]| {
                    let turn = std::f64::consts::TAU * hz;
                    size_k / (turn * tau_s).hypot(1.0) * (turn * at_s + phase - (turn * tau_s).atan()).sin()
                };
                let noise: f64 = random.sample(StandardNormal);
                60.0 + tones.iter().map(tone).sum::<f64>() + 0.05 * noise
            };
            time_s.iter().map(reads).collect()
        });
        let names = ["T1", "T2"].map(str::to_owned);
        let channels = Channels { source: "tones".into(), names, time_s, t1_c, t2_c, reference_c: None };
        let record = Record::from_channels(channels, SamplingChoice::Auto).expect("a record");
        assert_eq!(record.sampling.kind, SamplingKind::Irregular);
        let answer = characterise(&record, &Options::default()).expect("a sound question");
        assert!(answer.hold_sensitivity.is_some());
        missed += answer
            .sensors
            .iter()
            .zip(TAU_S)
            .filter(|(sensor, truth_s)| {
                let [low, high] = sensor.interval_95_s.expect("an answer");
                // Not by being wide: noise moves it by up to 1 % either way, and the hold by 2 %.
                assert!(high / low < 1.04, "[{low}, {high}] s");
                !(low..=high).contains(truth_s)
            })
            .count();
    }
    assert!(missed <= 4, "{missed} of 24");
}
