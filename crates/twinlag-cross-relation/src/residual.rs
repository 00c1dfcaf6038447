//! Whether anything is left in the whitened residual that noise would not leave.

use std::fmt;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use twinlag_transform::sine_transform;

/// What of a residual is tested; in text its name in kebab case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum TestName {
    /// The energy of the residual.
    TotalEnergy,
    /// The energy of the residual in each band of frequencies.
    BandEnergy,
    /// Correlation of residuals a few samples apart.
    Whiteness,
    /// Agreement of both sensors at rest.
    Calibration,
    /// Coherence of the residual with the gas, at each frequency.
    Coherence,
    /// The mean of the residual, by how high the gas temperature is.
    Level,
    /// The energy of the residual, by how fast the gas temperature changes.
    Rate,
    /// The energy of the residual along the record.
    Time,
    /// The kurtosis of the residual.
    Tails,
    /// The largest power of the residual at a single frequency.
    Lines,
    /// Readings that equal the one before.
    RepeatedValues,
}

impl TestName {
    /// The name that scripts use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::TotalEnergy => "total-energy",
            Self::BandEnergy => "band-energy",
            Self::Whiteness => "whiteness",
            Self::Calibration => "calibration",
            Self::Coherence => "coherence",
            Self::Level => "level",
            Self::Rate => "rate",
            Self::Time => "time",
            Self::Tails => "tails",
            Self::Lines => "lines",
            Self::RepeatedValues => "repeated-values",
        }
    }
}

impl fmt::Display for TestName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// One test of the residual against white noise of unit variance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ResidualTest {
    /// What was tested.
    pub test: TestName,
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom of the statistic, if it has any.
    pub degrees_of_freedom: Option<f64>,
    /// Probability of a statistic at least as extreme if the model is right.
    pub p_value: f64,
}

impl ResidualTest {
    /// Whether it finds less energy than the noise has.
    pub fn finds_too_little_energy(&self) -> bool {
        self.test == TestName::TotalEnergy && self.statistic < 1.0
    }

    /// Whether the test can speak against the model. Too little energy does not where noise levels were found in the data: these are
    /// too high.
    ///
    /// - `are_levels_given`: whether the levels were known beforehand
    pub fn can_reject(&self, are_levels_given: bool) -> bool {
        are_levels_given || !self.finds_too_little_energy()
    }
}

/// Tests of a whitened residual, `segments` in order of time.
///
/// - `fitted`: number of parameters fitted to it
/// - `level_std`: relative standard deviation of the noise *variance* that the whitening assumed: 0
///   where it is known
///
/// `total-energy`: `Σ r²` over its degrees of freedom, two-sided, as a normal deviate
/// `(χ²/dof − 1)/√(2/dof + level²)`. `band-energy`: the bin energies of the sine transform in bands
/// of a third of an octave and at least 8 bins, relative to their mean; the largest deviate of any
/// band (Wilson-Hilferty), its p-value for that many bands (Šidák). `whiteness`: Ljung-Box
/// statistic of the first 20 autocorrelations, chi-square distributed.
///
/// ```
/// use twinlag_cross_relation::{TestName, residual_tests};
///
/// // Unit variance, but up and down from sample to sample: as loud as it should be, and not white.
/// let residual: Vec<f64> = (0..400).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
/// let tests = residual_tests(&[residual], 0, 0.0);
/// assert_eq!((tests[0].test, tests[0].p_value), (TestName::TotalEnergy, 1.0));
/// assert_eq!(tests[2].test, TestName::Whiteness);
/// assert!(tests[2].p_value < 1e-12); // its statistic is near 20 lags × 400, with 20 degrees of freedom
/// ```
///
/// # Source
/// Ljung and Box 1978; Wilson and Hilferty 1931.
pub fn residual_tests(segments: &[Vec<f64>], fitted: usize, level_std: f64) -> Vec<ResidualTest> {
    let mut tests = Vec::from_iter(total_energy_test(segments, fitted, level_std));
    tests.extend(band_energy(segments));
    tests.extend(whiteness(segments));
    tests
}

/// Tests whether the energy `Σ r²` of a whitened residual is its degrees of freedom `n − fitted`, two-sided, by the normal deviate
/// `(Σ r²/dof − 1)/√(2/dof + level²)`; `None` of no more residuals than fitted parameters.
///
/// - `segments`, `fitted`, `level_std`: as for [`residual_tests`], of which this is one
///
/// ```
/// use twinlag_cross_relation::total_energy_test;
///
/// // 800 residuals of half the standard deviation that noise has: a quarter of the energy, whose standard error is 0.05.
/// let test = total_energy_test(&[vec![0.5; 800]], 0, 0.0).expect("more residuals than parameters");
/// assert!(test.statistic == 0.25 && test.p_value < 1e-40);
/// ```
pub fn total_energy_test(segments: &[Vec<f64>], fitted: usize, level_std: f64) -> Option<ResidualTest> {
    let count: usize = segments.iter().map(Vec::len).sum();
    let energy: f64 = segments.iter().flatten().map(|r| r * r).sum();
    let dof = count.checked_sub(fitted).filter(|dof| *dof > 0)? as f64;
    let deviate = (energy / dof - 1.0) / (2.0 / dof + level_std * level_std).sqrt();
    Some(ResidualTest {
        test: TestName::TotalEnergy,
        statistic: energy / dof,
        degrees_of_freedom: Some(dof),
        p_value: two_sided(deviate),
    })
}

fn two_sided(deviate: f64) -> f64 {
    let normal = Normal::new(0.0, 1.0).expect("the standard normal exists");
    2.0 * normal.sf(deviate.abs())
}

/// Residuals of an unbroken run up to which its spectrum is that of the whole run.
pub(crate) const MAX_WHOLE_RESIDUALS: usize = 1 << 19;
/// Residuals of the pieces of longer runs: their transforms have a power of two.
pub(crate) const PIECE_RESIDUALS: usize = (1 << 17) - 1;
/// Neighbouring residuals of longer runs that are added to one for the slow end of the spectrum.
const RESIDUALS_ADDED: usize = 64;
/// The slow end of the spectrum of sums, in cycles from sum to sum: there they keep 98.7 % of the power, `(sin x/x)²` of `π/16`.
const SLOW_END: f64 = 1.0 / 16.0;

/// Power of one frequency, summed over the pieces that share it.
struct Bin {
    /// Cycles per sample.
    frequency: f64,
    power: f64,
    /// Pieces.
    count: f64,
}

/// The bins of a whole run.
fn whole(r: &[f64]) -> impl Iterator<Item = Bin> {
    let steps = (r.len() + 1) as f64;
    let bin = move |(j, v): (usize, f64)| Bin {
        frequency: 0.5 * (j + 1) as f64 / steps,
        power: 2.0 / steps * v * v,
        count: 1.0,
    };
    sine_transform(r).into_iter().enumerate().map(bin)
}

/// The bins of a run: of a long one those of sums of neighbours at the slow end, as fine as of the whole run, and those of pieces
/// elsewhere. Of white residuals the sums are white too, and all bins have the same power.
fn bins_of(r: &[f64]) -> Vec<Bin> {
    if r.len() <= MAX_WHOLE_RESIDUALS {
        return whole(r).collect();
    }
    let added = RESIDUALS_ADDED as f64;
    let sums: Vec<f64> = r.chunks_exact(RESIDUALS_ADDED).map(|c| c.iter().sum::<f64>() / added.sqrt()).collect();
    let slow = whole(&sums).take_while(|bin| bin.frequency < SLOW_END);
    let mut out: Vec<Bin> = slow.map(|bin| Bin { frequency: bin.frequency / added, ..bin }).collect();
    let mut pieces: Vec<Bin> = Vec::new();
    let (each, rest) = r.as_chunks::<PIECE_RESIDUALS>();
    for piece in each {
        if pieces.is_empty() {
            pieces.extend(whole(piece));
        } else {
            pieces
                .iter_mut()
                .zip(whole(piece))
                .for_each(|(sum, bin)| (sum.power, sum.count) = (sum.power + bin.power, sum.count + 1.0));
        }
    }
    out.extend(pieces.into_iter().chain(whole(rest)).filter(|bin| bin.frequency >= SLOW_END / added));
    out
}

fn band_energy(segments: &[Vec<f64>]) -> Option<ResidualTest> {
    let mut bins: Vec<Bin> = segments.iter().filter(|r| !r.is_empty()).flat_map(|r| bins_of(r)).collect();
    bins.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    let total = |bins: &[Bin]| (bins.iter().map(|b| b.power).sum::<f64>(), bins.iter().map(|b| b.count).sum::<f64>());
    let (power, count) = total(&bins);
    let mean = power / count;
    if bins.len() < 24 || mean <= 0.0 {
        return None;
    }
    let mut bands: Vec<&[Bin]> = Vec::new();
    let mut from = 0;
    while from < bins.len() {
        let edge = bins[from].frequency * 2.0_f64.powf(1.0 / 3.0);
        let mut to = bins.partition_point(|b| b.frequency <= edge).max(from + 8).min(bins.len());
        if bins.len() - to < 8 {
            to = bins.len();
        }
        bands.push(&bins[from..to]);
        from = to;
    }
    let worst = bands
        .iter()
        .map(|band| {
            let (power, in_band) = total(band);
            // The mean is taken from all bins, this band's share among them.
            let k = in_band / (1.0 - in_band / count).max(1e-6);
            let ratio = power / (in_band * mean);
            ((ratio.cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()).abs()
        })
        .fold(0.0, f64::max);
    let of_one: f64 = two_sided(worst);
    let p_value = -((bands.len() as f64) * (-of_one).ln_1p()).exp_m1();
    Some(ResidualTest {
        test: TestName::BandEnergy,
        statistic: worst,
        degrees_of_freedom: Some(bands.len() as f64),
        p_value,
    })
}

fn whiteness(segments: &[Vec<f64>]) -> Option<ResidualTest> {
    let count: usize = segments.iter().map(Vec::len).sum();
    let lags = 20.min(count / 5);
    let energy: f64 = segments.iter().flatten().map(|r| r * r).sum();
    if lags == 0 || energy <= 0.0 {
        return None;
    }
    let statistic: f64 = (1..=lags)
        .map(|lag| {
            let product: f64 =
                segments.iter().map(|r| r.iter().zip(r.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>()).sum();
            let correlation = product / energy;
            let n = count as f64;
            n * (n + 2.0) * correlation * correlation / (n - lag as f64)
        })
        .sum();
    let chi2 = ChiSquared::new(lags as f64).expect("there is a lag");
    Some(ResidualTest {
        test: TestName::Whiteness,
        statistic,
        degrees_of_freedom: Some(lags as f64),
        p_value: chi2.sf(statistic),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn white(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        (0..n).map(|_| StandardNormal.sample(rng)).collect()
    }

    /// 1000 white residuals: each test rejects at 1 % in 10 ± 3.1 of them; four standard
    /// deviations.
    #[test]
    fn white_noise_is_rejected_as_often_as_stated() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut rejections = [0; 3];
        for _ in 0..1000 {
            let segments = [white(700, &mut rng), white(300, &mut rng)];
            for (count, test) in rejections.iter_mut().zip(residual_tests(&segments, 0, 0.0)) {
                *count += i32::from(test.p_value < 0.01);
            }
        }
        for (count, name) in rejections.iter().zip(["total-energy", "band-energy", "whiteness"]) {
            assert!((count - 10).abs() <= 13, "{name}: {count} of 1000 rejected at 1 %");
        }
    }

    /// A lag-one correlation of 0.2 over 2000 samples is nine standard errors; a level 10 % off is
    /// six.
    #[test]
    fn coloured_and_mis_scaled_residuals_are_rejected() {
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let noise = white(2001, &mut rng);
        let coloured: Vec<f64> = noise.windows(2).map(|w| (w[1] + 0.2 * w[0]) / 1.04_f64.sqrt()).collect();
        let tests = residual_tests(&[coloured], 2, 0.0);
        assert!(tests[1].p_value < 1e-4 && tests[2].p_value < 1e-6, "{tests:?}");
        let loud: Vec<f64> = noise.iter().map(|r| 1.1 * r).collect();
        assert!(residual_tests(std::slice::from_ref(&loud), 2, 0.0)[0].p_value < 1e-6);
        // The same excess is nothing if the level was only known to 20 %.
        assert!(residual_tests(&[loud], 2, 0.2)[0].p_value > 0.05);
    }

    #[test]
    fn a_test_is_written_by_its_name() {
        let all = ["total-energy", "band-energy", "whiteness", "calibration", "coherence", "level", "rate", "time"];
        for name in all.into_iter().chain(["tails", "lines", "repeated-values"]) {
            let test: TestName = serde_json::from_value(name.into()).expect("the name of a test");
            assert_eq!((test.name(), serde_json::to_value(test).expect("a string")), (name, name.into()));
        }
    }

    #[test]
    fn short_or_empty_residuals_give_the_tests_that_they_can() {
        assert!(residual_tests(&[], 2, 0.0).is_empty());
        assert!(residual_tests(&[vec![0.0; 30]], 2, 0.0).len() == 1);
        assert!(residual_tests(&[vec![1.0, -1.0, 1.0]], 2, 0.0).len() == 1);
    }
}
