//! Count, mean and central moments up to the fourth, in one pass.
//!
//! With `n` values of mean `μ`, the sums `M_p = Σ (x − μ)^p`, `p = 2, 3, 4`, are updated with each
//! value and combined between two sets. The formulas are exact; what they leave is rounding, at
//! most about `n u √(1 + μ²/m₂)` relative in `M₂` with `u = 1.1e-16` and `m₂ = M₂/n` (known from
//! the literature for the update of `M₂` by one value; not looked up, and checked on a hard case).

use serde::{Deserialize, Serialize};

use crate::forest::Merge;

/// Count, mean, extremes and central moments of a set of finite numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Moments {
    n: u64,
    mean: f64,
    m2: f64,
    m3: f64,
    m4: f64,
    min: f64,
    max: f64,
}

impl Moments {
    /// Largest magnitude accepted, 1e70: the fourth powers of the differences must stay finite.
    pub const LIMIT: f64 = 1e70;

    /// Adds `x` and returns `true`, or returns `false` if `x` is not finite or beyond
    /// [`Moments::LIMIT`].
    ///
    /// Differences from the mean below about 1e-80 lose their fourth power to underflow; choose
    /// units accordingly.
    ///
    /// # Source
    /// The pairwise equations of [`Moments::merge`] with a second set of one value.
    pub fn push(&mut self, x: f64) -> bool {
        if x.is_nan() || x.abs() > Self::LIMIT {
            return false;
        }
        let before = self.n as f64;
        self.n += 1;
        let n = self.n as f64;
        let delta = x - self.mean;
        let step = delta / n;
        let step2 = step * step;
        let term = delta * step * before;
        self.mean += step;
        self.m4 += term * step2 * (n * n - 3.0 * n + 3.0) + 6.0 * step2 * self.m2 - 4.0 * step * self.m3;
        self.m3 += term * step * (n - 2.0) - 3.0 * step * self.m2;
        self.m2 += term;
        if self.n == 1 {
            (self.min, self.max) = (x, x);
        } else {
            // Not `f64::min`: which zero it returns for 0 and −0 depends on the machine.
            if x < self.min {
                self.min = x;
            }
            if x > self.max {
                self.max = x;
            }
        }
        true
    }

    /// How many values were added.
    pub fn count(&self) -> u64 {
        self.n
    }

    /// Arithmetic mean; `None` without values.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then_some(self.mean)
    }

    /// Smallest value; `None` without values.
    pub fn min(&self) -> Option<f64> {
        (self.n > 0).then_some(self.min)
    }

    /// Largest value; `None` without values.
    pub fn max(&self) -> Option<f64> {
        (self.n > 0).then_some(self.max)
    }

    /// The central moment `M_p/n` for `p` = 2, 3 or 4; `None` for other `p` and without values.
    pub fn central(&self, p: u32) -> Option<f64> {
        let sum = match p {
            2 => self.m2,
            3 => self.m3,
            4 => self.m4,
            _ => return None,
        };
        (self.n > 0).then(|| sum / self.n as f64)
    }

    /// Standard deviation of one value, `√(M₂/(n − 1))`; `None` below two values.
    ///
    /// ```
    /// use twinlag_study::Moments;
    ///
    /// let mut errors = Moments::default();
    /// for x in [1.0, 2.0, 3.0, 4.0] {
    ///     assert!(errors.push(x));
    /// }
    /// // Departures ±1.5 and ±0.5: M₂ = 5, to rounding of a few operations on numbers of that size.
    /// let got = errors.standard_deviation().expect("four values");
    /// assert!((got - (5.0_f64 / 3.0).sqrt()).abs() < 10.0 * f64::EPSILON);
    /// assert_eq!(errors.mean(), Some(2.5));
    /// ```
    pub fn standard_deviation(&self) -> Option<f64> {
        (self.n > 1).then(|| (self.m2 / (self.n - 1) as f64).sqrt())
    }

    /// Root mean square about zero, `√(μ² + M₂/n)`; `None` without values. If the values are
    /// errors, this is the RMSE.
    ///
    /// ```
    /// use twinlag_study::Moments;
    ///
    /// let mut errors = Moments::default();
    /// for x in [3.0, -4.0] {
    ///     errors.push(x);
    /// }
    /// // √((9 + 16)/2), to rounding of a few operations on numbers of size 25.
    /// let got = errors.root_mean_square().expect("two values");
    /// assert!((got - 12.5_f64.sqrt()).abs() < 25.0 * f64::EPSILON);
    /// ```
    pub fn root_mean_square(&self) -> Option<f64> {
        Some((self.mean()?.powi(2) + self.central(2)?).sqrt())
    }

    /// Standard error of the mean, `s/√n`; `None` below two values.
    pub fn mean_error(&self) -> Option<f64> {
        Some(self.standard_deviation()? / (self.n as f64).sqrt())
    }

    /// Standard error of the standard deviation, for values of any distribution with a fourth
    /// moment.
    ///
    /// `√(Var(s²))/(2 s)`, `Var(s²) = (m₄ − m₂² (n − 3)/(n − 1))/n` with the sample's own moments;
    /// the first order of the delta method, so for large `n`. `None` below four values, and where
    /// all values are equal.
    pub fn standard_deviation_error(&self) -> Option<f64> {
        let n = self.n as f64;
        let (m2, m4) = (self.central(2)?, self.central(4)?);
        let variance = (m4 - m2 * m2 * (n - 3.0) / (n - 1.0)) / n;
        (self.n > 3 && m4 > 0.0 && variance >= 0.0).then(|| variance.sqrt() / (2.0 * (m2 * n / (n - 1.0)).sqrt()))
    }

    /// Standard error of [`Moments::root_mean_square`], by the delta method: `sd(x²)/(2 rms √n)`.
    ///
    /// `Var(x²) = 4 μ² m₂ + 4 μ m₃ + m₄ − m₂²` over the sample, times `n/(n − 1)`. `None` below two
    /// values, and where all values are zero.
    pub fn root_mean_square_error(&self) -> Option<f64> {
        let n = self.n as f64;
        let (mean, rms) = (self.mean()?, self.root_mean_square()?);
        let (m2, m3, m4) = (self.central(2)?, self.central(3)?, self.central(4)?);
        // Values of one size and both signs have no variance of the square: rounding may leave it
        // below zero.
        let variance = (4.0 * mean * (mean * m2 + m3) + m4 - m2 * m2).max(0.0);
        (self.n > 1 && rms > 0.0).then(|| (variance / (n - 1.0)).sqrt() / (2.0 * rms))
    }
}

impl Merge for Moments {
    /// Adds the values of another set.
    ///
    /// # Source
    /// Pébay 2008 (SAND2008-6212), pairwise equations, from memory; checked against two-pass sums.
    fn merge(&mut self, later: Self) {
        if later.n == 0 {
            return;
        }
        if self.n == 0 {
            *self = later;
            return;
        }
        let (na, nb) = (self.n as f64, later.n as f64);
        let n = na + nb;
        let delta = later.mean - self.mean;
        // Weights first and powers after: products such as δ⁴ nₐ nᵦ could overflow.
        let (wa, wb) = (na / n, nb / n);
        let between = delta * delta * (na * wb);
        let m4 = self.m4
            + later.m4
            + between * (delta * delta) * (wa * wa - wa * wb + wb * wb)
            + 6.0 * (delta * delta) * (wa * wa * later.m2 + wb * wb * self.m2)
            + 4.0 * delta * (wa * later.m3 - wb * self.m3);
        let m3 = self.m3 + later.m3 + between * delta * (wa - wb) + 3.0 * delta * (wa * later.m2 - wb * self.m2);
        self.m2 += later.m2 + between;
        (self.m3, self.m4) = (m3, m4);
        self.mean += delta * wb;
        self.n += later.n;
        if later.min < self.min {
            self.min = later.min;
        }
        if later.max > self.max {
            self.max = later.max;
        }
    }
}

#[derive(Deserialize)]
struct Unchecked {
    n: u64,
    mean: f64,
    m2: f64,
    m3: f64,
    m4: f64,
    min: f64,
    max: f64,
}

impl TryFrom<Unchecked> for Moments {
    type Error = String;

    fn try_from(u: Unchecked) -> Result<Self, String> {
        let Unchecked { n, mean, m2, m3, m4, min, max } = u;
        let finite = [mean, m2, m3, m4, min, max].iter().all(|x| x.is_finite());
        if !finite || m2 < 0.0 || min > max || (n == 0 && [mean, m2, m3, m4, min, max].iter().any(|&x| x != 0.0)) {
            return Err(format!(
                "these are the moments of no set of numbers: n = {n}, mean = {mean}, m2 = {m2}, m3 = {m3}, m4 = {m4}, \
                 min = {min}, max = {max}"
            ));
        }
        Ok(Self { n, mean, m2, m3, m4, min, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(values: &[f64]) -> Moments {
        let mut m = Moments::default();
        assert!(values.iter().all(|&x| m.push(x)));
        m
    }

    /// Numbers in (0, 1) with a skewed distribution: squares of a Weyl sequence. No generator is
    /// needed for an identity.
    fn skewed(n: usize) -> Vec<f64> {
        (1..=n).map(|i| (i as f64 * 0.618_033_988_749_894_8).fract().powi(2)).collect()
    }

    fn two_pass(values: &[f64]) -> [f64; 4] {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let central = |p| values.iter().map(|x| (x - mean).powi(p)).sum::<f64>() / n;
        [mean, central(2), central(3), central(4)]
    }

    fn assert_close(what: &str, got: f64, want: f64, tol: f64) {
        assert!((got - want).abs() <= tol, "{what}: got {got:e}, want {want:e} ± {tol:e}");
    }

    /// The values are of order one, with μ²/m₂ about 1, so rounding is at most a few n u = 1e3 ×
    /// 1.1e-16 relative to moments of order 0.1; 1e-13 is ten times that and far below what a wrong
    /// term does.
    #[test]
    fn moments_are_those_of_two_passes_pushed_or_merged() {
        let values = skewed(1000);
        let want = two_pass(&values);
        for split in [0, 1, 2, 137, 500, 999, 1000] {
            let mut m = moments(&values[..split]);
            m.merge(moments(&values[split..]));
            assert_eq!(m.count(), 1000);
            assert_close("mean", m.mean().unwrap(), want[0], 1e-13);
            for p in 2..5 {
                assert_close(&format!("m{p}"), m.central(p).unwrap(), want[p as usize - 1], 1e-13);
            }
        }
        let m = moments(&values);
        assert_eq!(m.min().unwrap(), values.iter().copied().fold(f64::INFINITY, f64::min));
        assert_eq!(m.max().unwrap(), values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    }

    /// The set `NumAcc4` of the statistical reference data of NIST: 10000000.2 once, then
    /// 10000000.1 and 10000000.3, 500 times each. Certified mean 10000000.2 and standard deviation
    /// 0.1. The data themselves are rounded to u × 1e7 = 1e-9, that is 1e-8 of the standard
    /// deviation; the rounding of the method is at most n u μ/s = 1001 × 1.1e-16 × 1e8 = 1.1e-5 of
    /// it. The textbook Σx² − nμ² has no digit left here.
    #[test]
    fn a_tiny_variance_on_a_large_mean_survives() {
        let values: Vec<f64> = std::iter::once(1e7 + 0.2)
            .chain((0..1000).map(|i| if i % 2 == 0 { 1e7 + 0.1 } else { 1e7 + 0.3 }))
            .collect();
        let whole = moments(&values);
        let mut halves = moments(&values[..400]);
        halves.merge(moments(&values[400..]));
        for m in [whole, halves] {
            assert_close("mean", m.mean().unwrap(), 1e7 + 0.2, 1e7 * 1e3 * f64::EPSILON);
            assert_close("standard deviation", m.standard_deviation().unwrap(), 0.1, 0.1 * 1.1e-5);
        }
    }

    /// The squares' standard deviation, computed from the squares. Rounding as above.
    #[test]
    fn the_error_of_the_root_mean_square_is_that_of_the_mean_of_the_squares() {
        let values: Vec<f64> = skewed(1000).iter().map(|x| x - 0.4).collect();
        let m = moments(&values);
        let squares = moments(&values.iter().map(|x| x * x).collect::<Vec<_>>());
        let rms = squares.mean().unwrap().sqrt();
        assert_close("rms", m.root_mean_square().unwrap(), rms, 1e-13);
        let want = squares.mean_error().unwrap() / (2.0 * rms);
        assert_close("its error", m.root_mean_square_error().unwrap(), want, 1e-13);
    }

    /// For ±1 in equal numbers m₄ = m₂² = 1, so Var(s²) = (1 − (n − 3)/(n − 1))/n = 2/(n (n − 1)),
    /// and for a Gaussian sample it tends to 2σ⁴/n. Both by hand: n = 100, s² = 100/99. For the
    /// Gaussian, the quantiles at (i − ½)/n of a logistic distribution stand in: kurtosis 4.2, so
    /// Var(s²) → 3.2 σ⁴/n, and its tails are cut at n: 1 % at n = 10⁵.
    #[test]
    fn the_error_of_the_standard_deviation_takes_the_fourth_moment() {
        let signs: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let want = (2.0 / 9900.0_f64).sqrt() / (2.0 * (100.0 / 99.0_f64).sqrt());
        assert_close("of signs", moments(&signs).standard_deviation_error().unwrap(), want, 1e-14);

        let n = 100_000_u32;
        let logistic: Vec<f64> = (0..n)
            .map(|i| {
                let p = (f64::from(i) + 0.5) / f64::from(n);
                (p / (1.0 - p)).ln()
            })
            .collect();
        let sigma = std::f64::consts::PI / 3.0_f64.sqrt();
        let want = sigma * (3.2 / f64::from(n)).sqrt() / 2.0;
        assert_close("of logistic", moments(&logistic).standard_deviation_error().unwrap(), want, 0.01 * want);
    }

    #[test]
    fn what_is_unknown_is_none() {
        let none = Moments::default();
        assert_eq!((none.mean(), none.min(), none.max(), none.root_mean_square()), (None, None, None, None));
        let one = moments(&[3.0]);
        assert_eq!(one.root_mean_square(), Some(3.0));
        assert_eq!((one.standard_deviation(), one.mean_error(), one.root_mean_square_error()), (None, None, None));
        let equal = moments(&[0.1; 10]);
        assert_eq!(equal.standard_deviation(), Some(0.0));
        assert_eq!(equal.standard_deviation_error(), None);
        assert_eq!(moments(&[0.0; 10]).root_mean_square_error(), None);
    }

    /// 1e70 and −1e70 differ by 2e70, whose fourth power is 1.6e281.
    #[test]
    fn what_would_overflow_or_is_no_number_is_refused() {
        let mut m = Moments::default();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.1e70, -1.1e70] {
            assert!(!m.push(bad), "{bad} was accepted");
        }
        assert_eq!(m, Moments::default());
        for _ in 0..1000 {
            assert!(m.push(1e70) && m.push(-1e70));
        }
        for _ in 0..40 {
            m.merge(m);
        }
        assert_eq!(m.count(), 2000 << 40);
        assert!(m.central(4).unwrap().is_finite());
    }

    #[test]
    fn moments_survive_json_to_the_bit() {
        let m = moments(&skewed(1234));
        let text = serde_json::to_string(&m).unwrap();
        assert_eq!(serde_json::from_str::<Moments>(&text).unwrap(), m);
        assert!(serde_json::from_str::<Moments>(&text.replace("\"m2\":", "\"m2\":-")).is_err());
    }
}
