//! Quantiles from counts in fixed bins.
//!
//! A bin is determined by the sign, the exponent and the first seven bits after the leading one of
//! a floating-point number: 128 bins to the octave, at most 1/128 of their lower edge wide. The bin
//! of a number is a shift of its bits, exact and the same on every machine, with no logarithm in
//! it. Bins are never joined, so that counts from any sources add up to the same sketch in any
//! order. (Sketches that bound their number of bins by joining the outermost lose that.)

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF as _, Normal};

use crate::forest::Merge;

/// Bits of the significand that a bin does not see: 52 less 7.
const UNSEEN: u32 = 45;

/// A histogram with bins of fixed relative width, for quantiles of any finite numbers.
///
/// Memory is in proportion to the bins in use: about 128 for each octave between the smallest and
/// largest magnitude that occur.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "Vec<(i32, u64)>", try_from = "Vec<(i32, u64)>")]
pub struct Sketch {
    bins: BTreeMap<i32, u64>,
}

/// Zero, and numbers too small to be normal, are bin 0; negative numbers have the bins of their
/// magnitude, negated.
fn bin(x: f64) -> i32 {
    if x.abs() < f64::MIN_POSITIVE {
        return 0;
    }
    let bin = (x.abs().to_bits() >> UNSEEN) as i32;
    if x < 0.0 { -bin } else { bin }
}

/// The middle of a bin.
fn middle(bin: i32) -> f64 {
    if bin == 0 {
        return 0.0;
    }
    let magnitude = f64::from_bits((u64::from(bin.unsigned_abs()) << UNSEEN) | (1 << (UNSEEN - 1)));
    if bin < 0 { -magnitude } else { magnitude }
}

/// Expected bytes, as text, of a sketch of normal numbers.
///
/// A bin is in use with the probability `1 − (1 − p)^n`, where `p` is the probability of a number in it. Bins that lie together within a
/// quarter of an octave, and within a quarter of the standard deviation, count as equally probable.
///
/// - `count`: how many numbers
pub(crate) fn expected_bytes(mean: f64, deviation: f64, count: f64) -> f64 {
    /// Bins of an octave.
    const BINS: f64 = 128.0;
    /// Standard deviations beyond which there is nothing.
    const FARTHEST: f64 = 8.0;
    /// Brackets, commas, and the six digits that the number of most bins has.
    const FIXED: f64 = 10.0;
    let digits = |count: f64| count.max(1.0).log10().floor() + 1.0;
    let Ok(normal) = Normal::new(mean, deviation) else { return FIXED + digits(count) };
    let of_sign = |sign: f64| {
        // So near zero that none of all numbers is expected there.
        let lowest = (1e-3 * deviation / count).max(sign * mean - FARTHEST * deviation).max(f64::MIN_POSITIVE);
        let (mut upper, mut bytes) = (sign * mean + FARTHEST * deviation, 0.0);
        while upper > lowest {
            let lower = (upper * (-0.25_f64).exp2()).max(upper - deviation / 4.0);
            let lower = lower.min(upper * (-1.0 / BINS).exp2());
            let bins = BINS * (upper / lower).log2();
            let probability = (normal.cdf(sign * upper) - normal.cdf(sign * lower)).abs() / bins;
            let in_use = -(count * (-probability).ln_1p()).exp_m1();
            let minus = f64::from(sign < 0.0);
            bytes += bins * in_use * (FIXED + minus + digits(count * probability));
            upper = lower;
        }
        bytes
    };
    of_sign(1.0) + of_sign(-1.0)
}

impl Sketch {
    /// Largest relative error of a quantile, 1/256 or 0.39 %: half a bin's width over its lower
    /// edge.
    ///
    /// Magnitudes below `f64::MIN_POSITIVE`, 2.2e-308, count as zero.
    pub const RELATIVE_ERROR: f64 = 1.0 / 256.0;

    /// Counts `x` and returns `true`, or returns `false` if it is not finite.
    pub fn push(&mut self, x: f64) -> bool {
        if !x.is_finite() {
            return false;
        }
        *self.bins.entry(bin(x)).or_default() += 1;
        true
    }

    /// How many numbers were counted.
    pub fn count(&self) -> u64 {
        self.bins.values().sum()
    }

    /// The number of rank `⌈q n⌉` (1 at least) of the `n` counted, to within
    /// [`Sketch::RELATIVE_ERROR`] of itself.
    ///
    /// `None` if nothing was counted, or `q` is not in [0, 1].
    pub fn quantile(&self, q: f64) -> Option<f64> {
        if !(0.0..=1.0).contains(&q) {
            return None;
        }
        let rank = ((q * self.count() as f64).ceil() as u64).max(1);
        let mut seen = 0;
        for (&bin, &count) in &self.bins {
            seen += count;
            if seen >= rank {
                return Some(middle(bin));
            }
        }
        None
    }
}

impl Merge for Sketch {
    fn merge(&mut self, later: Self) {
        for (bin, count) in later.bins {
            *self.bins.entry(bin).or_default() += count;
        }
    }
}

impl From<Sketch> for Vec<(i32, u64)> {
    fn from(sketch: Sketch) -> Self {
        sketch.bins.into_iter().collect()
    }
}

impl TryFrom<Vec<(i32, u64)>> for Sketch {
    type Error = String;

    fn try_from(pairs: Vec<(i32, u64)>) -> Result<Self, String> {
        let last = bin(f64::MAX).unsigned_abs();
        if let Some((bin, count)) = pairs.iter().find(|(bin, count)| *count == 0 || bin.unsigned_abs() > last) {
            return Err(format!(
                "bin {bin} with a count of {count}: bins are within ±{last} and their counts positive"
            ));
        }
        if pairs.windows(2).any(|w| w[0].0 >= w[1].0) {
            return Err("the bins of a sketch must ascend".into());
        }
        if pairs.iter().try_fold(0_u64, |sum, (_, count)| sum.checked_add(*count)).is_none() {
            return Err("the counts of a sketch add up to more than 2⁶⁴".into());
        }
        Ok(Self { bins: pairs.into_iter().collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both signs, zero, and magnitudes from 1e-9 to 1e9.
    fn wide(n: i32) -> Vec<f64> {
        (0..n)
            .map(|i| {
                let u = (f64::from(i) * 0.618_033_988_749_894_8).fract();
                if i % 97 == 0 { 0.0 } else { (u - 0.4).signum() * 10_f64.powf(18.0 * u - 9.0) }
            })
            .collect()
    }

    fn sketch(values: &[f64]) -> Sketch {
        let mut s = Sketch::default();
        assert!(values.iter().all(|&x| s.push(x)));
        s
    }

    /// The oracle is the sorted sample. The bound is exact: the middle of a bin is computed without
    /// rounding.
    #[test]
    fn quantiles_are_within_the_stated_relative_error_of_the_sorted_sample() {
        let mut values = wide(10_007);
        let s = sketch(&values);
        values.sort_by(f64::total_cmp);
        for i in 0..=1000 {
            let q = f64::from(i) / 1000.0;
            let want = values[((q * values.len() as f64).ceil() as usize).max(1) - 1];
            let got = s.quantile(q).unwrap();
            let tol = Sketch::RELATIVE_ERROR * want.abs();
            assert!((got - want).abs() <= tol, "quantile {q}: got {got:e}, want {want:e} ± {tol:e}");
        }
    }

    #[test]
    fn the_error_is_bounded_at_the_edges_of_every_kind_of_bin() {
        for x in [1.0, 1.0 + f64::EPSILON, 2.0 - f64::EPSILON, f64::MIN_POSITIVE, f64::MAX, 1.0 + 1.0 / 128.0, 0.1] {
            for x in [x, -x] {
                let got = sketch(&[x]).quantile(0.5).unwrap();
                assert!((got / x - 1.0).abs() <= Sketch::RELATIVE_ERROR, "got {got:e}, want {x:e} ± 1/256");
            }
        }
        for zero in [0.0, -0.0, 1e-310] {
            assert_eq!(sketch(&[zero]).quantile(0.5), Some(0.0));
        }
    }

    #[test]
    fn merging_is_counting_everything_at_once() {
        let values = wide(5000);
        let whole = sketch(&values);
        for split in [0, 1, 2500, 5000] {
            let (a, b) = (sketch(&values[..split]), sketch(&values[split..]));
            let (mut ab, mut ba) = (a.clone(), b.clone());
            ab.merge(b);
            ba.merge(a);
            assert_eq!((&ab, &ba), (&whole, &whole));
        }
    }

    /// The oracle is the text itself, of normal numbers by Box and Muller. How many bins are in use varies by no more than its square
    /// root, of which four are allowed, and equal probabilities cost some percent.
    #[test]
    fn the_bytes_of_normal_numbers_are_foreseen() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for (mean, deviation) in [(0.0, 1.0), (3.0, 1.0), (0.1, 0.001)] {
            for count in [100, 10_000, 300_000] {
                let mut s = Sketch::default();
                for _ in 0..count {
                    let normal = (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
                    s.push(mean + deviation * normal);
                }
                let is = serde_json::to_string(&s).unwrap().len() as f64;
                let expected = expected_bytes(mean, deviation, f64::from(count));
                let tolerance = 4.0 / (s.bins.len() as f64).sqrt() + 0.05;
                assert!(
                    (expected / is - 1.0).abs() < tolerance.min(0.5),
                    "{mean} {deviation} {count}: {expected} of {is}"
                );
            }
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        let mut s = Sketch::default();
        assert!(!s.push(f64::NAN) && !s.push(f64::INFINITY) && !s.push(f64::NEG_INFINITY));
        assert_eq!((s.count(), s.quantile(0.5)), (0, None));
        assert_eq!(sketch(&[1.0]).quantile(1.1), None);
        assert_eq!(sketch(&[1.0]).quantile(f64::NAN), None);
    }

    #[test]
    fn a_sketch_survives_json_and_a_false_one_is_refused() {
        let s = sketch(&wide(5000));
        assert_eq!(serde_json::from_str::<Sketch>(&serde_json::to_string(&s).unwrap()).unwrap(), s);
        for bad in ["[[1,0]]", "[[2,1],[1,1]]", "[[262143,1]]", "[[-2147483648,1]]"] {
            assert!(serde_json::from_str::<Sketch>(bad).is_err(), "{bad} was accepted");
        }
    }
}
