//! The gas signals against their definitions.

use std::f64::consts::{FRAC_PI_2, TAU};

use twinlag_signal::{Broadband, Engine, Gas, Hold, Plunge, Rig, Sensor, Series, Signal, SignalError, Turbulence};
use twinlag_transform::Forward;

use super::{assert_close, coarse, held, lagged, mean_square, rig, rig_with};

fn gas_c(rig: &Rig) -> Vec<f64> {
    rig.clean(0).expect("simulates").gas_c
}

/// Hann-windowed periodogram, one-sided, K²/Hz.
fn periodogram(x: &[f64], sample_period_s: f64) -> Vec<f64> {
    let n = x.len();
    let window = |k: usize| (std::f64::consts::PI * k as f64 / n as f64).sin().powi(2);
    let power: f64 = (0..n).map(|k| window(k).powi(2)).sum();
    let spectrum = Forward::of(n).transform(&x.iter().enumerate().map(|(k, x)| window(k) * x).collect::<Vec<f64>>());
    spectrum.iter().map(|z| 2.0 * sample_period_s * z.norm_sqr() / power).collect()
}

const TURBULENCE: Turbulence = Turbulence { std_k: 20.0, corner_hz: 5.0, cutoff_hz: 500.0 };

/// Level `S₀` of the spectrum below the corner, from `std² = S₀ (f_c + ∫ (f/f_c)^(−5/3) df)`, and `∫ S² df`.
fn turbulence_level() -> (f64, f64) {
    let Turbulence { std_k, corner_hz, cutoff_hz } = TURBULENCE;
    let ratio = cutoff_hz / corner_hz;
    let level = std_k * std_k / (corner_hz * (1.0 + 1.5 * (1.0 - ratio.powf(-2.0 / 3.0))));
    (level, level * level * corner_hz * (1.0 + 3.0 / 7.0 * (1.0 - ratio.powf(-7.0 / 3.0))))
}

/// Trials of 4096 samples at 1 kHz: the cutoff is the Nyquist frequency, so nothing is aliased.
fn turbulence_trials(trials: u64) -> impl Iterator<Item = Vec<f64>> {
    let mut gas = held(0.0, Signal::Turbulence(TURBULENCE));
    gas.per_trial = true;
    let rig = rig_with(coarse(4096, 0.001), gas, Sensor::new("T1", 0.0238));
    (0..trials).map(move |trial| rig.clean(trial).expect("simulates").gas_c)
}

/// The logarithm of a periodogram averaged over n trials has variance 1/n in each bin; a Hann window correlates powers
/// of neighbours by (2/3)² and of next neighbours by (1/6)², which makes 1.94 of it in a sum. Four standard errors of
/// the least-squares slope, and of the mean level below the corner.
#[test]
fn turbulence_has_a_flat_spectrum_and_then_a_slope_of_minus_five_thirds() {
    let trials = 200;
    let mut spectrum = vec![0.0; 2049];
    for x in turbulence_trials(trials) {
        for (sum, power) in spectrum.iter_mut().zip(periodogram(&x, 0.001)) {
            *sum += power / trials as f64;
        }
    }
    let spread = 1.94 / trials as f64;
    let bin_hz = 1.0 / 4.096;
    let (first, last) = ((20.0 / bin_hz) as usize, (400.0 / bin_hz) as usize);
    let points: Vec<(f64, f64)> = (first..last).map(|i| ((i as f64 * bin_hz).ln(), spectrum[i].ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
    let sxx: f64 = points.iter().map(|(x, _)| (x - x0).powi(2)).sum();
    let slope = points.iter().map(|(x, y)| (x - x0) * (y - y0)).sum::<f64>() / sxx;
    assert_close("slope", slope, -5.0 / 3.0, 4.0 * (spread / sxx).sqrt());

    let flat = &spectrum[(1.0 / bin_hz) as usize..(4.0 / bin_hz) as usize];
    let level = flat.iter().sum::<f64>() / flat.len() as f64;
    let want = turbulence_level().0;
    assert_close("level", level, want, 4.0 * want * (spread / flat.len() as f64).sqrt());
}

/// The mean square of a Gaussian signal over a time T has variance `∫ S² df / T`. Four standard errors.
#[test]
fn turbulence_has_the_given_deviation_over_the_ensemble() {
    let trials = 200;
    let got = turbulence_trials(trials).map(|x| mean_square(&x)).sum::<f64>() / trials as f64;
    let tol = 4.0 * (turbulence_level().1 / (trials as f64 * 4.096)).sqrt();
    assert_close("variance", got, 400.0, tol);
}

/// The values at the sample instants are those of the same sum of sines: only rounding of some 1e5 additions differs.
#[test]
fn turbulence_does_not_depend_on_oversampling_or_hold() {
    let signal = Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 5.0, cutoff_hz: 400.0 });
    let want = gas_c(&rig(500, 0.002, held(0.0, signal.clone())));
    for oversampling in [10, 24] {
        let mut record = coarse(500, 0.002);
        (record.oversampling, record.settle_s) = (oversampling, None);
        let got = gas_c(&rig_with(record, Gas::new(0.0, signal.clone()), Sensor::new("T1", 0.0238)));
        for (got, want) in got.iter().zip(&want) {
            assert_close("gas", *got, *want, 1e-9);
        }
    }
}

/// From sample to sample it is AR(1) with `φ = exp(−2π f_c Ts)`: standard errors as for such noise (Bartlett), the
/// correlation at lag m with at most `√((1 + φ²)/((1 − φ²) n))`. Four of each, continuous or held.
#[test]
fn broadband_has_the_given_deviation_and_correlation_time() {
    let (n, corner_hz, sample_period_s) = (100_000, 10.0, 0.002);
    for hold in [Hold::Continuous, Hold::ZeroOrder] {
        let mut gas = Gas::new(0.0, Signal::Broadband(Broadband { std_k: 20.0, corner_hz }));
        gas.hold = hold;
        let x = gas_c(&rig_with(coarse(n, sample_period_s), gas, Sensor::new("T1", 0.0238)));
        let phi = (-TAU * corner_hz * sample_period_s).exp();
        let spread = ((1.0 + phi * phi) / ((1.0 - phi * phi) * n as f64)).sqrt();
        let variance = mean_square(&x);
        assert_close("variance", variance, 400.0, 4.0 * 400.0 * 2.0_f64.sqrt() * spread);
        let one = lagged(&x, 1) / variance;
        assert_close("lag-one correlation", one, phi, 4.0 * ((1.0 - phi * phi) / n as f64).sqrt());
        // One correlation time is 8 samples: 1/(2π 10 Hz) = 15.9 ms.
        let eight = lagged(&x, 8) / variance;
        assert_close("lag-eight correlation", eight, phi.powi(8), 4.0 * spread);
    }
}

/// Without variation every cycle is the same and runs from the peak A down to A ε, `ε = exp(−(1 − ρ)/δ)`. The mean over
/// samples is the trapezoid rule's; at its two corners the slope jumps by `A/(δ P)` or less: `A (Ts/P)²/(6 δ)`.
#[test]
fn engine_repeats_its_cycle_with_the_given_mean_and_height() {
    let engine = Engine::new(60.0, 10.0);
    let record = coarse(1000, 0.001);
    let x = gas_c(&rig_with(record, Gas::new(450.0, Signal::Engine(engine)), Sensor::new("T1", 0.0238)));
    for (a, b) in x.iter().zip(&x[100..]) {
        assert_close("one cycle later", *b, *a, 1e-9);
    }
    let mean_c = x.iter().sum::<f64>() / 1000.0;
    assert_close("mean", mean_c, 450.0, 60.0 * 0.01_f64.powi(2) / (6.0 * 0.25));
    let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    assert_close("height", high - low, 60.0 * (1.0 - (-0.92_f64 / 0.25).exp()), 1e-9);
}

/// Periods are independent with mean 0.1 s and deviation r of it, so over a time T there are `T/P ± r √(T/P)` cycles.
/// Four of these and one for the ends. A cycle is counted by its rise through the mean, which each makes once.
#[test]
fn engine_cycles_come_at_the_mean_rate_and_differ() {
    let mut engine = Engine::new(60.0, 10.0);
    (engine.amplitude_relative_std, engine.period_relative_std) = (0.1, 0.05);
    let record = coarse(100_000, 0.001);
    let x = gas_c(&rig_with(record, Gas::new(0.0, Signal::Engine(engine)), Sensor::new("T1", 0.0238)));
    let rises: Vec<usize> = (1..x.len()).filter(|&k| x[k - 1] < 0.0 && x[k] >= 0.0).collect();
    assert_close("cycles", rises.len() as f64, 1000.0, 4.0 * 0.05 * 1000.0_f64.sqrt() + 1.0);
    let peaks: Vec<f64> = rises.windows(2).map(|w| x[w[0]..w[1]].iter().copied().fold(f64::MIN, f64::max)).collect();
    let mean = peaks.iter().sum::<f64>() / peaks.len() as f64;
    let std = (peaks.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / peaks.len() as f64).sqrt();
    // Standard error `r A √((kurtosis − 1)/(4n))`, 6.2/√(2n) with the log-normal's kurtosis of 3.16; four of these. The
    // last sample before and the first after a peak miss it by up to 1 ms of the decay's 25 ms: 2 % off the deviation
    // on average, and their scatter of 1.2 % of 60 K adds to it in quadrature: together less than 0.2 K.
    assert_close("deviation of peaks", std, 6.0, 4.0 * 6.2 / (2.0 * peaks.len() as f64).sqrt() + 0.2);
}

/// Levels are independent and uniform: mean square A²/3, fourth power A⁴/5, so `A² √(4/45/N)`; waits have mean 0.1 s
/// and deviation 0.08 s, so `T/0.1 ± √(T 0.08²/0.1³)` of them begin in a time T. Four of each. A wait is seen as a run
/// of equal samples unless its level lasts less than two of 0.1 ms: 0.25 % of 0.08 s.
#[test]
fn plunge_steps_between_uniform_levels_and_has_no_jump() {
    let (amplitude_k, rise_s, sample_period_s) = (35.0, 0.02, 1e-4);
    let plunge = Plunge { amplitude_k, dwell_s: 0.1, rise_s };
    let record = coarse(2_000_000, sample_period_s);
    let x = gas_c(&rig_with(record, held(0.0, Signal::Plunge(plunge)), Sensor::new("T1", 0.0238)));
    let steepest = x.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    let steepest_allowed = FRAC_PI_2 * 2.0 * amplitude_k / rise_s * sample_period_s;
    assert!(steepest <= steepest_allowed, "got {steepest}, want at most {steepest_allowed}");
    let levels: Vec<f64> = (2..x.len()).filter(|&k| x[k] == x[k - 1] && x[k - 1] != x[k - 2]).map(|k| x[k]).collect();
    assert!(levels.iter().all(|level| level.abs() <= amplitude_k));
    let n = levels.len() as f64;
    assert_close("steps", n, 2000.0, 4.0 * (200.0_f64 * 0.08 * 0.08 / 0.001).sqrt() + 0.0025 * 2000.0);
    let square = amplitude_k * amplitude_k;
    assert_close("mean square of levels", mean_square(&levels), square / 3.0, 4.0 * square * (4.0 / 45.0 / n).sqrt());
}

#[test]
fn series_is_linear_between_its_points_and_still_before_them() {
    let values_c = vec![10.0, 20.0, 0.0];
    let series = Signal::Series(Series::Inline { values_c, period_s: 0.004 });
    let clean = rig(5, 0.002, Gas::new(100.0, series)).clean(0).expect("simulates");
    for (got, want) in clean.gas_c.iter().zip([110.0, 115.0, 120.0, 110.0, 100.0]) {
        assert_close("gas", *got, want, 1e-9);
    }
    // During the run-in of ten time constants nothing moves.
    assert_eq!([clean.readings_c[0][0], clean.readings_c[1][0]], [110.0; 2]);
}

fn series_rig(name: &str, text: &str) -> Rig {
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(dir.join(name), text).expect("temporary directory is writable");
    rig(5, 0.002, Gas::new(0.0, Signal::Series(Series::File { path: name.into() }))).with_base_dir(dir)
}

#[test]
fn series_file_may_have_a_header_comments_and_its_own_clock() {
    let text = "# comment\ntime_s, value_c\n\n3600.000,10\n3600.004, 20\n3600.008,0\n";
    let got = gas_c(&series_rig("series-good.csv", text));
    for (got, want) in got.iter().zip([10.0, 15.0, 20.0, 10.0, 0.0]) {
        // Differences of times near 3600 s are rounded to 5e-13 s: 5e-13/0.004 of 20 K.
        assert_close("gas", *got, want, 1e-8);
    }
}

#[test]
fn series_file_errors_name_the_line() {
    let error = |name, text| series_rig(name, text).simulate().expect_err("bad series");
    let bad = error("series-text.csv", "time_s,value_c\n0,10\n0.1,hot\n");
    assert!(matches!(&bad, SignalError::SeriesLine { line: 3, text, .. } if text == "0.1,hot"), "{bad}");
    let bad = error("series-nan.csv", "0,10\n0.1,nan\n");
    assert!(matches!(bad, SignalError::SeriesLine { line: 2, .. }), "{bad}");
    let bad = error("series-order.csv", "0,10\n\n0,11\n");
    assert!(matches!(bad, SignalError::SeriesOrder { line: 3, .. }), "{bad}");
    let bad = error("series-short.csv", "0,10\n0.007,11\n");
    assert!(matches!(bad, SignalError::SeriesTooShort { needed_s, .. } if needed_s == 0.008), "{bad}");
    let bad = error("series-empty.csv", "time_s,value_c\n");
    assert!(matches!(bad, SignalError::TooFew { value: 0, .. }), "{bad}");
    let missing = rig(5, 0.002, Gas::new(0.0, Signal::Series(Series::File { path: "not/there.csv".into() })));
    let bad = missing.simulate().expect_err("no such file");
    assert!(matches!(bad, SignalError::SeriesFile { kind: std::io::ErrorKind::NotFound, .. }), "{bad}");
}
