//! Noise levels from the data, estimated from changes that are too fast for a smooth signal.
//!
//! Sensors are low-pass, so their highest frequencies usually show the noise floor. The third
//! difference `y[k] − 3 y[k+1] + 3 y[k+2] − y[k+3]` of a smooth signal is small; of white noise it
//! has variance `20 s²`. It fails where the samples lie as far apart as the faster time constant,
//! with coloured noise, and below the step of the converter, which therefore sets a floor of
//! `q/√12`.

use twinlag_cross_relation::{Readings, Segment, Steps};

use crate::error::NoiseError;

/// A converter whose own noise `q/√12` is a larger share than this of a channel's noise level is
/// coarse: its errors can no longer be taken for white noise. Dimensionless.
///
/// Gaussian noise of standard deviation `σ` ahead of a converter of step `q` leaves it a mean error
/// of at most `(q/π) exp(−2π² σ²/q²)`, which repeats wherever the signal passes the same place
/// between two steps. The level `s² = σ² + q²/12` with `q/√12 = s/2` means `σ = q/2`, and there
/// that is 0.0023 `q`: 0.8 % of the converter's own noise. At a share of 0.7 it would be 20 %.
///
/// # Source
/// Own derivation: first term of the Fourier series of the sawtooth error, averaged over the noise.
pub const COARSE_STEP_NOISE_RATIO: f64 = 0.5;

/// Noise of one channel as the data show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevel {
    /// Standard deviation, K: the larger of the third-difference estimate and the quantisation
    /// floor.
    pub std_k: f64,
    /// Standard error of `std_k`, K, for white Gaussian noise.
    pub standard_error_k: f64,
    /// Step of the converter, K, if the readings lie on a grid.
    pub quantisation_step_k: Option<f64>,
    /// Number of third differences left out because they are too large for noise. A dropout causes
    /// up to four of them, and a sharp step of the gas some.
    pub outliers: usize,
    /// Number of these at which the other channel does nothing unusual: it changes across them by no more than three robust
    /// standard deviations of its changes over as many samples anywhere. A sharp step of the gas moves both.
    pub lone_outliers: usize,
}

/// Samples beside a third difference over which the other channel's change across it is taken: a slower sensor needs some to
/// follow. Chosen.
const SAMPLES_BESIDE: usize = 4;

impl NoiseLevel {
    /// The converter's step, K, where it is coarser than the noise: see
    /// [`COARSE_STEP_NOISE_RATIO`].
    ///
    /// ```
    /// use twinlag_bias::estimate_noise;
    /// use twinlag_cross_relation::Readings;
    ///
    /// // Both channels come from a converter of 0.25 K, without any noise.
    /// let coarse = |phase: f64| -> Vec<f64> {
    ///     (0..400).map(|k| (20.0 * (0.02 * f64::from(k) + phase).sin()).round() / 4.0).collect()
    /// };
    /// let levels = estimate_noise(&Readings::even(&coarse(0.0), &coarse(0.5), 0.1)?)?;
    /// for level in levels {
    ///     let step_k = level.coarse_step_k().expect("nothing but steps");
    ///     assert!((step_k - 0.25).abs() < 1e-12); // differences of readings less their mean: rounding
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn coarse_step_k(&self) -> Option<f64> {
        self.quantisation_step_k.filter(|q| q / 12.0_f64.sqrt() > COARSE_STEP_NOISE_RATIO * self.std_k)
    }
}

/// Noise levels `[s1, s2]` of both channels.
///
/// For uneven steps the third divided difference takes the place of the third difference, each
/// scaled to unit noise.
///
/// ```
/// use rand::SeedableRng;
/// use rand_distr::{Distribution, Normal};
/// use twinlag_bias::estimate_noise;
/// use twinlag_cross_relation::Readings;
///
/// let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
/// let mut noisy = |std_k: f64| -> Result<Vec<f64>, rand_distr::NormalError> {
///     let noise = Normal::new(0.0, std_k)?;
///     Ok((0..1000).map(|k| 10.0 * (0.01 * f64::from(k)).sin() + noise.sample(&mut rng)).collect())
/// };
/// let readings = Readings::even(&noisy(0.05)?, &noisy(0.2)?, 0.002)?;
/// for (level, truth) in estimate_noise(&readings)?.iter().zip([0.05, 0.2]) {
///     // Beyond four standard errors once in 16 000; the gas, slow as it is, adds 1e-5 K.
///     assert!((level.std_k - truth).abs() < 4.0 * level.standard_error_k, "{level:?}");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`NoiseError::TooShort`] without at least 8 runs of four neighbouring samples.
pub fn estimate_noise(readings: &Readings) -> Result<[NoiseLevel; 2], NoiseError> {
    let level = |channel: fn(&Segment) -> &[f64], other: fn(&Segment) -> &[f64]| -> Result<NoiseLevel, NoiseError> {
        let mut differences = Vec::with_capacity(readings.len());
        for segment in readings.segments() {
            let y = channel(segment);
            for (k, four) in y.windows(4).enumerate() {
                let weights = third_difference(segment.steps(), k);
                differences.push(weights.iter().zip(four).map(|(w, y)| w * y).sum::<f64>());
            }
        }
        if differences.len() < 8 {
            return Err(NoiseError::TooShort { samples: readings.len(), needed: 11 });
        }
        let limit_k = largest_of_noise(&differences);
        let all = differences.len();
        let is_far: Vec<bool> = differences.iter().map(|d| d.abs() > limit_k).collect();
        differences.retain(|d| d.abs() <= limit_k);
        let count = differences.len();
        let from_differences = (differences.iter().map(|d| d * d).sum::<f64>() / count as f64).sqrt();
        // Of a long record each of these vectors counts.
        drop(differences);
        let lone_outliers = lone(&is_far, readings.segments().iter().map(other));
        let step = quantisation_step(&readings.segments().iter().map(channel));
        let floor = step.map_or(0.0, |q| q / 12.0_f64.sqrt());
        let std_k = from_differences.max(floor);
        // The third differences of white noise have autocorrelations −3/4, 3/10, −1/20: their mean
        // square over n has relative variance 2 (1 + 2 (9/16 + 9/100 + 1/400))/n = 4.62/n, half of
        // it in the standard deviation.
        Ok(NoiseLevel {
            std_k,
            standard_error_k: 0.5 * std_k * (4.62 / count as f64).sqrt(),
            quantisation_step_k: step,
            outliers: all - count,
            lone_outliers,
        })
    };
    Ok([level(Segment::y1, Segment::y2)?, level(Segment::y2, Segment::y1)?])
}

/// Six robust standard deviations (1.4826 times the median absolute value) of the differences. White Gaussian noise has one
/// in five hundred million beyond. Where more than half are zero, as with a coarse converter, there is no scale to judge by
/// and it is infinite.
fn largest_of_noise(differences: &[f64]) -> f64 {
    match 6.0 * robust_std(differences) {
        limit if limit > 0.0 => limit,
        _ => f64::INFINITY,
    }
}

/// 1.4826 times the median absolute value, which is the standard deviation of Gaussian values; 0 of none.
fn robust_std(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() { 0.0 } else { 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// How many of the differences of four readings that are too large lie where the `other` channel does nothing unusual.
///
/// - `is_far`: of each difference, through all segments
fn lone<'a>(is_far: &[bool], other: impl Iterator<Item = &'a [f64]>) -> usize {
    let mut changes = Vec::with_capacity(is_far.len());
    for y in other {
        for k in 0..y.len().saturating_sub(3) {
            let (from, to) = (k.saturating_sub(SAMPLES_BESIDE), (k + 3 + SAMPLES_BESIDE).min(y.len() - 1));
            changes.push(y[to] - y[from]);
        }
    }
    let usual = 3.0 * robust_std(&changes);
    is_far.iter().zip(&changes).filter(|(is_far, change)| **is_far && change.abs() <= usual).count()
}

/// Weights of unit sum of squares that take any parabola through samples `k..k+4` to zero.
fn third_difference(steps: &Steps, k: usize) -> [f64; 4] {
    match steps {
        Steps::Even(_) => [1.0, -3.0, 3.0, -1.0].map(|w: f64| w / 20.0_f64.sqrt()),
        Steps::Uneven(each) => {
            let mut t = [0.0; 4];
            for i in 1..4 {
                t[i] = t[i - 1] + each[k + i - 1];
            }
            let raw: [f64; 4] =
                std::array::from_fn(|i| (0..4).filter(|&j| j != i).map(|j| t[i] - t[j]).product::<f64>().recip());
            let norm = raw.iter().map(|w| w * w).sum::<f64>().sqrt();
            raw.map(|w| w / norm)
        }
    }
}

/// The grid that all differences between neighbouring readings lie on, if it is coarse enough to
/// matter.
///
/// A grid counts if nearly all differences are whole multiples of the smallest one. Written
/// decimals always make some grid; it is the floor that they imply that is used, and it is small
/// where the decimals are fine.
fn quantisation_step<'a>(channels: &(impl Iterator<Item = &'a [f64]> + Clone)) -> Option<f64> {
    let differences = || channels.clone().flat_map(|y| y.windows(2).map(|w| (w[1] - w[0]).abs())).filter(|d| *d > 1e-9);
    let step = differences().fold(f64::INFINITY, f64::min);
    if !step.is_finite() {
        return None;
    }
    let is_on_grid = |d: f64| ((d / step) - (d / step).round()).abs() < 0.05;
    let (all, on_grid) =
        differences().fold((0_u32, 0_u32), |(all, on_grid), d| (all + 1, on_grid + u32::from(is_on_grid(d))));
    (f64::from(on_grid) >= 0.95 * f64::from(all)).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn noisy(n: usize, std_k: [f64; 2], t: impl Fn(usize) -> f64) -> [Vec<f64>; 2] {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        std_k.map(|s| {
            (0..n)
                .map(|k| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    40.0 + 10.0 * (std::f64::consts::TAU * t(k) / 50.0).sin() + s * noise
                })
                .collect()
        })
    }

    /// A sine of 50 samples a period leaves `10 (2π/50)³/√2 = 0.014 K` of third difference, over
    /// √20: 3 mK, against a noise of 0.3 K. Four standard errors.
    #[test]
    fn white_noise_on_a_smooth_signal_is_found_in_both_channels() {
        let [y1, y2] = noisy(5000, [0.3, 1.1], |k| k as f64);
        let levels = estimate_noise(&Readings::even(&y1, &y2, 0.01).expect("valid")).expect("long enough");
        for (level, want) in levels.iter().zip([0.3, 1.1]) {
            let tol = 4.0 * level.standard_error_k;
            assert!((level.std_k - want).abs() < tol, "got {}, want {want} ± {tol}", level.std_k);
            // √(4.62/4997)/2
            assert!((level.standard_error_k / level.std_k - 0.0152).abs() < 1e-4);
        }
    }

    /// Uneven steps, the signal a parabola in time, which the divided differences take to zero
    /// whatever the steps: what is left is the noise. Neighbouring differences correlate more than
    /// at even steps: eight standard errors.
    #[test]
    fn uneven_steps_do_not_let_the_signal_through() {
        let steps: Vec<f64> = (0..4999).map(|k| 1.0 + 0.7 * f64::from(k % 3)).collect();
        let mut t = vec![0.0];
        steps.iter().for_each(|s| t.push(t[t.len() - 1] + s));
        let [n1, n2] = noisy(5000, [0.3, 1.1], |_| 0.0);
        let bent = |n: &[f64]| n.iter().zip(&t).map(|(n, t)| n + 1e-3 * t * t).collect::<Vec<_>>();
        let segment = Segment::new(bent(&n1), bent(&n2), Steps::Uneven(steps)).expect("valid");
        let levels = estimate_noise(&Readings::new(vec![segment]).expect("valid")).expect("long enough");
        for (level, want) in levels.iter().zip([0.3, 1.1]) {
            let tol = 8.0 * level.standard_error_k;
            assert!((level.std_k - want).abs() < tol, "got {}, want {want} ± {tol}", level.std_k);
        }
    }

    /// One dropout in 3000 samples would multiply the level by ten; it is left out and counted:
    /// four differences see it.
    #[test]
    fn a_dropout_does_not_pass_for_noise() {
        let [mut y1, y2] = noisy(3000, [0.3, 1.1], |k| k as f64);
        y1[1500] = -200.0;
        let levels = estimate_noise(&Readings::even(&y1, &y2, 0.01).expect("valid")).expect("long enough");
        let tol = 4.0 * levels[0].standard_error_k;
        assert!((levels[0].std_k - 0.3).abs() < tol, "got {}, want 0.3 ± {tol}", levels[0].std_k);
        assert_eq!([levels[0].outliers, levels[1].outliers], [4, 0]);
    }

    #[test]
    fn a_coarse_converter_sets_the_floor() {
        let y: Vec<f64> = (0..200).map(|k| (f64::from(k) * 0.01 / 0.0625).round() * 0.0625).collect();
        let levels = estimate_noise(&Readings::even(&y, &y, 1.0).expect("valid")).expect("long enough");
        let step = levels[0].quantisation_step_k.expect("all readings lie on a grid");
        assert!((step - 0.0625).abs() < 1e-12, "got {step}"); // what taking off the mean rounds
        assert!(levels[0].std_k > 0.01804); // 0.0625/√12 = 0.018042
    }

    /// The mean error of a converter under Gaussian noise, by integration over the noise, at the
    /// noise where a step is just coarse: its largest value over the places between two steps is
    /// 0.8 % of `q/√12`, to the 0.1 % that two digits leave.
    #[test]
    fn noise_that_a_step_is_just_coarse_for_hides_the_step() {
        let level = 1.0 / (12.0_f64.sqrt() * COARSE_STEP_NOISE_RATIO);
        let sigma = (level * level - 1.0 / 12.0).sqrt();
        assert!((sigma - 0.5).abs() < 1e-12, "half a step of noise ahead of the converter, got {sigma}");
        let mean_error = |place: f64| {
            let each = (-4000..4000).map(|k| {
                let z = 2e-3 * f64::from(k);
                let y = place + sigma * z;
                (y.round() - y) * (-0.5 * z * z).exp() * 2e-3 / std::f64::consts::TAU.sqrt()
            });
            each.sum::<f64>()
        };
        let largest = (0..50).map(|i| mean_error(0.01 * f64::from(i)).abs()).fold(0.0, f64::max);
        let share = largest * 12.0_f64.sqrt();
        assert!((share - 0.008).abs() < 1e-3, "got {share}");
    }

    #[test]
    fn a_handful_of_samples_is_refused() {
        let y = [1.0, 2.0, 4.0, 3.0, 1.0, 7.0];
        assert!(estimate_noise(&Readings::even(&y, &y, 1.0).expect("valid")).is_err());
    }
}
