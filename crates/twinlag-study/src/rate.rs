//! How often something happened.

use serde::{Deserialize, Serialize};

use crate::forest::Merge;

/// `k` of `n`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Rate {
    k: u64,
    n: u64,
}

impl Rate {
    /// Counts one more case, in which it happened or not.
    pub fn push(&mut self, happened: bool) {
        self.n += 1;
        self.k += u64::from(happened);
    }

    /// Number of times that the event happened.
    pub fn hits(&self) -> u64 {
        self.k
    }

    /// Number of times that it could have happened.
    pub fn count(&self) -> u64 {
        self.n
    }

    /// `k/n`; `None` if `n` is zero.
    pub fn rate(&self) -> Option<f64> {
        (self.n > 0).then(|| self.k as f64 / self.n as f64)
    }

    /// Wilson's 95 % interval of the underlying probability; `None` if `n` is zero.
    ///
    /// With `p = k/n` and `z = 1.96`: `(p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n)`. Its
    /// coverage is near 95 % on average over the probability; for single probabilities, above all
    /// near 0 and 1, it can be less.
    ///
    /// ```
    /// use twinlag_study::Rate;
    ///
    /// let mut covered = Rate::default();
    /// (0..20).for_each(|trial| covered.push(trial != 7));
    /// assert_eq!(covered.rate(), Some(0.95));
    /// // (0.95 + 0.0960 ± 0.1355)/1.1921, to the four digits shown.
    /// let [low, high] = covered.wilson_interval().expect("20 trials");
    /// assert!((low - 0.7639).abs() < 5e-5 && (high - 0.9911).abs() < 5e-5);
    /// ```
    ///
    /// # Source
    /// Wilson 1927, from memory; the ends are checked against the equation that defines them.
    pub fn wilson_interval(&self) -> Option<[f64; 2]> {
        // The 97.5 % point of the standard normal distribution.
        const Z: f64 = 1.959_963_984_540_054;
        let (p, n) = (self.rate()?, self.n as f64);
        let z2n = Z * Z / n;
        let centre = p + z2n / 2.0;
        let half = (z2n * (p * (1.0 - p) + z2n / 4.0)).sqrt();
        // At k = 0 and k = n an end is 0 or 1 exactly; rounding would miss it.
        let lower = if self.k == 0 { 0.0 } else { (centre - half) / (1.0 + z2n) };
        let upper = if self.k == self.n { 1.0 } else { (centre + half) / (1.0 + z2n) };
        Some([lower, upper])
    }
}

impl Merge for Rate {
    fn merge(&mut self, later: Self) {
        self.k += later.k;
        self.n += later.n;
    }
}

#[derive(Deserialize)]
struct Unchecked {
    k: u64,
    n: u64,
}

impl TryFrom<Unchecked> for Rate {
    type Error = String;

    fn try_from(Unchecked { k, n }: Unchecked) -> Result<Self, String> {
        if k > n { Err(format!("{k} of {n} is no rate")) } else { Ok(Self { k, n }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends of Wilson's interval are, by definition, the probabilities p₀ with (p − p₀)² = z²
    /// p₀ (1 − p₀)/n. Rounding of a few operations on numbers of order one: 1e-14.
    #[test]
    fn the_interval_ends_where_the_observed_rate_is_z_standard_deviations_away() {
        for (k, n) in [(0, 10), (1, 10), (5, 10), (10, 10), (13, 250), (40_000, 1_000_000)] {
            let rate = Rate { k, n };
            let p = rate.rate().unwrap();
            let [lower, upper] = rate.wilson_interval().unwrap();
            assert!(lower <= p && p <= upper);
            for p0 in [lower, upper] {
                let (got, want) = ((p - p0).powi(2), 1.959_963_984_540_054_f64.powi(2) * p0 * (1.0 - p0) / n as f64);
                assert!((got - want).abs() < 1e-14, "{k} of {n}, end {p0}: got {got:e}, want {want:e} ± 1e-14");
            }
        }
        assert_eq!(Rate::default().wilson_interval(), None);
    }

    #[test]
    fn more_hits_than_cases_are_refused() {
        assert!(serde_json::from_str::<Rate>(r#"{"k":3,"n":2}"#).is_err());
    }
}
