//! Where noise levels come from, and that they are what they are said to be.

use crate::common::{read, record, recovers, rig};
use twinlag::bias::estimate_noise;
use twinlag::{
    CompensateOptions, Error, Model, NoiseColour, NoiseSource, Options, Setting, Status, TrackOptions, characterise,
    compensate, readings, track,
};

const TRUTH_S: [f64; 2] = [0.0238, 0.1168];
const FAST: &str = "time_constant_s = 0.0238";
const SLOW: &str = "time_constant_s = 0.1168";

/// Gas that moves from sample to sample as noise does, held between the samples, and noise of 1 % of the fast reading's swing:
/// third differences take the signal for noise, 2.6 times what there is. Four standard errors of the level found; by chance
/// once in 16 000.
#[test]
fn levels_are_right_where_the_gas_moves_from_sample_to_sample() {
    let gas = "kind = \"broadband\"\nstd_k = 15.0\ncorner_hz = 15.0\nhold = \"zero-order\"";
    let truth_k = 0.1;
    for seed in 1..=5 {
        let noise = format!("noise = {{ std_k = {truth_k} }}");
        let sensors = [FAST, SLOW].map(|s| format!("{s}\n{noise}"));
        let record = record(seed, 2500, 0.002, gas, [&sensors[0], &sensors[1]]);
        let all = readings(&record, &Options::default()).expect("even samples");
        let by_differences = estimate_noise(&all).expect("long enough")[0].std_k / truth_k;
        assert!((2.3..2.9).contains(&by_differences), "third differences: {by_differences} times the level");
        let answer = characterise(&record, &Options::default()).expect("a sound question");
        assert_eq!(answer.status, Status::Ok, "{:?}", answer.warnings);
        assert_eq!(answer.sensors[0].noise_from, Some(NoiseSource::InferredInputs));
        for sensor in &answer.sensors {
            let (got, error) = (sensor.noise_std_k, sensor.noise_standard_error_k.expect("found"));
            assert!((got - truth_k).abs() < 4.0 * error, "seed {seed}: {got} K ± {error} K, want {truth_k} K");
        }
        recovers(&answer, TRUTH_S, 4.0);
    }
}

/// The gas changes by a fifth of its standard deviation from sample to sample, so that third differences are the gas's. Failed: where
/// levels of the residual took their place (seeds 2 to 4), these came from seven eighths of the samples and were tested on all; where
/// levels of third differences stayed (seed 1), too little energy spoke against the model, as it should only where levels are given.
/// Four standard errors, by chance once in 16 000.
#[test]
fn time_constants_that_stay_are_followed_in_a_gas_rougher_than_the_sampling() {
    let gas = "kind = \"broadband\"\nstd_k = 10.0\ncorner_hz = 0.32";
    let sensors = [0.08, 0.3].map(|tau_s| format!("time_constant_s = {tau_s}\nnoise = {{ std_k = 0.05 }}"));
    for seed in 1..=4 {
        let record = record(seed, 6000, 0.01, gas, [&sensors[0], &sensors[1]]);
        let answer = track(&record, &TrackOptions::default()).expect("a sound question");
        assert_eq!(answer.status, Status::Ok, "seed {seed}: {:?}", answer.warnings);
        recovers(&answer.last, [0.08, 0.3], 4.0);
        let too_high = Options { noise_std_k: Some([0.075, 0.053]), ..Options::default() };
        let answer = track(&record, &TrackOptions { characterise: too_high, ..TrackOptions::default() });
        assert_eq!(answer.expect("a sound question").status, Status::ModelRejected, "seed {seed}");
    }
}

/// The gas changes by half of its standard deviation from sample to sample, so that levels that are found without it are wrong, and 83 %
/// of the gas were inside the bands as long as a model that was given kept them. Errors of the gas are correlated over the slower
/// time constant, 15 samples, so that four records hold 800 independent ones and a share of 95 % is good to 0.8 %; four of these.
#[test]
fn bands_of_a_rough_gas_hold_where_a_model_is_given() {
    let gas = "kind = \"broadband\"\nstd_k = 4.0\ncorner_hz = 2.0";
    let sensors = [0.04, 0.15].map(|tau_s| format!("time_constant_s = {tau_s}\nnoise = {{ std_k = 0.2 }}"));
    let inside = (1..=4).map(|seed| {
        let rig = rig(seed, 3000, 0.01, gas, [&sensors[0], &sensors[1]]);
        let mut record = read(&rig);
        record.reference_c = Some(rig.simulate().expect("a sound rig").gas_c);
        let model = Some(Model::of_two_lags(record.channels.clone()));
        let answer = compensate(&record, &CompensateOptions { model, ..CompensateOptions::default() });
        let gas = answer.expect("a sound question").gas.expect("determined");
        gas.reference.expect("there is one").inside_95
    });
    let inside = inside.sum::<f64>() / 4.0;
    assert!((inside - 0.95).abs() < 0.031, "{inside}");
}

/// Each sample's noise carries half of the last one's. Asked for white noise the residual is not white, and the advice names
/// the option; asked for autoregressive noise all is well. A coefficient is good to about `√((1 − φ²)/n)` = 0.02 where the noise
/// stands alone, which it does in part of the band only: 0.15 is generous. Levels within four standard errors, time constants
/// within three (once in 370; seeds are fixed).
#[test]
fn autoregressive_noise_is_found_and_the_time_constants_with_it() {
    let gas = "kind = \"turbulence\"\nstd_k = 20.0\ncorner_hz = 3.0\ncutoff_hz = 60.0";
    let truth_k = [0.5, 0.15];
    let sensors = [(FAST, 0.5), (SLOW, 0.15)].map(|(s, k)| format!("{s}\nnoise = {{ std_k = {k}, ar1 = 0.5 }}"));
    for seed in 1..=5 {
        let record = record(seed, 4000, 0.002, gas, [&sensors[0], &sensors[1]]);
        let white = characterise(&record, &Options::default()).expect("a sound question");
        assert_eq!(white.status, Status::ModelRejected);
        assert!(white.advice.contains(&Setting::NoiseColour), "{:?}", white.warnings);
        assert!(white.sensors.iter().all(|s| s.noise_ar1.is_none()));
        let options = Options { noise_colour: NoiseColour::Autoregressive, ..Options::default() };
        let answer = characterise(&record, &options).expect("a sound question");
        assert_eq!(answer.status, Status::Ok, "{:?} {:?}", answer.warnings, answer.residual.tests);
        assert!(answer.residual.white);
        for (sensor, truth_k) in answer.sensors.iter().zip(truth_k) {
            let ar1 = sensor.noise_ar1.expect("asked for");
            assert!((ar1 - 0.5).abs() < 0.15, "seed {seed}, {}: coefficient {ar1}, want 0.5", sensor.channel);
            let (got, error) = (sensor.noise_std_k, sensor.noise_standard_error_k.expect("found"));
            assert!((got - truth_k).abs() < 4.0 * error, "seed {seed}, {}: {got} K ± {error} K", sensor.channel);
        }
        recovers(&answer, TRUTH_S, 3.0);
    }
}

/// The gas rests for the first second of four, at 500 Hz: `s²` from 498 degrees of freedom, `s` to 3.2 %. Autoregressive noise
/// of coefficient `φ` has `(1 + φ²)/(1 − φ²)` times the variance of `s²`.
#[test]
fn a_quiet_segment_gives_the_levels() {
    let gas = "kind = \"plunge\"\namplitude_k = 60.0\ndwell_s = 1.2\nrise_s = 0.03";
    for (colour, phi) in [(NoiseColour::White, 0.0_f64), (NoiseColour::Autoregressive, 0.6)] {
        let sensors =
            [(FAST, 0.4), (SLOW, 0.2)].map(|(s, std_k)| format!("{s}\nnoise = {{ std_k = {std_k}, ar1 = {phi} }}"));
        let record = record(7, 2000, 0.002, gas, [&sensors[0], &sensors[1]]);
        let options = Options { quiet_segments_s: vec![[0.0, 1.0]], noise_colour: colour, ..Options::default() };
        let answer = characterise(&record, &options).expect("a sound question");
        for (sensor, truth_k) in answer.sensors.iter().zip([0.4, 0.2]) {
            assert_eq!(sensor.noise_from, Some(NoiseSource::QuietSegment));
            let (got, error) = (sensor.noise_std_k, sensor.noise_standard_error_k.expect("found"));
            let want = truth_k * (0.5 / 499.0 * (1.0 + phi * phi) / (1.0 - phi * phi)).sqrt();
            // The coefficient that is found and the level itself are 10 % off at most in three standard errors.
            assert!((error / want - 1.0).abs() < 0.25, "error {error} K, want {want} K");
            assert!((got - truth_k).abs() < 4.0 * error, "{got} K ± {error} K, want {truth_k} K");
            let ar1 = sensor.noise_ar1.unwrap_or(0.0);
            // √((1 − φ²)/500) = 0.036 for φ = 0.6: four of it.
            assert!((ar1 - phi).abs() < 0.15, "coefficient {ar1}, want {phi}");
        }
    }
}

#[test]
fn a_given_level_comes_before_a_quiet_segment_and_a_short_one_is_refused() {
    let gas = "kind = \"turbulence\"\nstd_k = 20.0\ncorner_hz = 3.0\ncutoff_hz = 60.0";
    let sensors = [FAST, SLOW].map(|s| format!("{s}\nnoise = {{ std_k = 0.5 }}"));
    let record = record(1, 2000, 0.002, gas, [&sensors[0], &sensors[1]]);
    let both = Options { noise_std_k: Some([0.5, 0.5]), quiet_segments_s: vec![[0.0, 1.0]], ..Options::default() };
    let answer = characterise(&record, &both).expect("a sound question");
    for sensor in &answer.sensors {
        assert_eq!((sensor.noise_from, sensor.noise_std_k), (Some(NoiseSource::Given), 0.5));
        assert!(sensor.noise_standard_error_k.is_none());
    }
    for stretch in [[0.0, 0.01], [-3.0, -2.0], [100.0, 200.0]] {
        let options = Options { quiet_segments_s: vec![stretch], ..Options::default() };
        let error = characterise(&record, &options).expect_err("nothing there");
        assert!(matches!(error, Error::QuietSegment { .. }) && error.is_usage(), "{error}");
    }
}

/// With the ratio alone the level is that of the residual: `s` to `√(1/2n)` = 1.1 % of 4000 terms, and the time constants are
/// those that given levels of that ratio have, to where the optimiser stops (1e-9, with errors of 1e-2).
#[test]
fn a_ratio_is_enough_for_the_time_constants() {
    let gas = "kind = \"turbulence\"\nstd_k = 20.0\ncorner_hz = 3.0\ncutoff_hz = 60.0\nhold = \"zero-order\"";
    let sensors = [(FAST, 0.5), (SLOW, 0.25)].map(|(s, std_k)| format!("{s}\nnoise = {{ std_k = {std_k} }}"));
    let record = record(1, 4000, 0.002, gas, [&sensors[0], &sensors[1]]);
    let ratio = Options { noise_ratio: Some(0.5), ..Options::default() };
    let levels = Options { noise_std_k: Some([0.5, 0.25]), ..Options::default() };
    let [by_ratio, by_levels] = [&ratio, &levels].map(|o| characterise(&record, o).expect("a sound question"));
    assert_eq!((by_ratio.status, by_ratio.residual.chi2_per_dof), (Status::Ok, None));
    for (a, b) in by_ratio.sensors.iter().zip(&by_levels.sensors) {
        let (a_s, b_s) = (a.time_constant_s.expect("determined"), b.time_constant_s.expect("determined"));
        assert!((a_s / b_s - 1.0).abs() < 1e-6, "{a_s} s by the ratio, {b_s} s by the levels");
        let error = a.noise_standard_error_k.expect("found");
        assert_eq!(a.noise_from, Some(NoiseSource::Residual));
        assert!(
            (a.noise_std_k - b.noise_std_k).abs() < 4.0 * error,
            "{} ± {error}, want {}",
            a.noise_std_k,
            b.noise_std_k
        );
        assert!((error / a.noise_std_k / 0.0112 - 1.0).abs() < 0.02, "relative error {}", error / a.noise_std_k);
    }
    for estimator in ["bias-compensated", "normalised", "hybrid", "difference-equation-gtls"] {
        let options = Options { estimator: estimator.parse().expect("a name"), ..ratio.clone() };
        let answer = characterise(&record, &options).expect("a sound question");
        assert_eq!(answer.status, Status::Ok, "{estimator}: {:?}", answer.warnings);
        recovers(&answer, TRUTH_S, 4.0);
    }
}
