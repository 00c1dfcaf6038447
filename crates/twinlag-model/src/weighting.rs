//! The weights that a fit gives to frequencies.
//!
//! Where the gas has no power the whitened residual is noise whatever the parameters are, and still its energy depends on them:
//! noise of one channel multiplied by noise of the other. Its expectation does not, so a fixed weight over frequency leaves the
//! estimate consistent, and the weight `SNR/(1 + SNR)` takes off most of what such frequencies add to its scatter: sensors
//! that are sampled twenty times per time constant have most of theirs there. `SNR` is that of the disagreement,
//! `1/(1/SNR₁ + 1/SNR₂)` of the channels.

use num_complex::Complex64;
use twinlag_transform::{Inverse, Tapered, hann};

use crate::dense;
use crate::observations::Observations;

/// Points of the spectra.
const SPECTRUM_POINTS: usize = 256;
/// No frequency has less weight: a line that is not in the gas is seen there.
const MIN_WEIGHT: f64 = 0.02;
/// Fewest segments of [`SPECTRUM_POINTS`] samples whose mean is a usable spectrum: chosen, its scatter is then 35 %.
const MIN_SEGMENTS: usize = 8;
/// If the gain is above this at every frequency, no filter is used: it would lose the residuals at both ends for a gain of a
/// tenth at most.
const FLAT_GAIN: f64 = 0.9;
/// Taps on either side of the filter's middle.
const TAPS_EACH_SIDE: usize = 24;
/// Most coefficients of the autoregressive model of a residual.
const MAX_AUTOREGRESSIVE_ORDER: usize = 8;

/// A filter of zero phase for the whitened residual, its squared gain the weight; or none.
#[derive(Clone, Debug, Default)]
pub struct Weighting {
    taps: Vec<f64>,
    /// Prediction error of an autoregressive model of what is left over, where that is not noise: the filter that whitens it.
    prediction: Vec<f64>,
}

impl Weighting {
    /// From the spectra of the readings over noise of `noise_std_k`. None where samples are uneven or stretches short.
    pub fn of(observations: &Observations, noise_std_k: [f64; 2]) -> Self {
        Self::by(observations, noise_std_k, |[a, b]| {
            let snr = if a + b > 0.0 { a * b / (a + b) } else { 0.0 };
            (snr / (1.0 + snr)).max(MIN_WEIGHT).sqrt()
        })
    }

    /// Wiener's filter for the gas temperature that both readings together give: `SNR/(1 + SNR)`, `SNR = SNR₁ + SNR₂`.
    pub fn of_gas(observations: &Observations, noise_std_k: [f64; 2]) -> Self {
        Self::by(observations, noise_std_k, |[a, b]| (a + b) / (1.0 + a + b))
    }

    /// For the difference of the inferred inputs: only where both sensors see the gas well, `(SNR/(1 + SNR))²` of the disagreement.
    pub fn of_disagreement(observations: &Observations, noise_std_k: [f64; 2]) -> Self {
        Self::by(observations, noise_std_k, |[a, b]| {
            let snr = if a + b > 0.0 { a * b / (a + b) } else { 0.0 };
            (snr / (1.0 + snr)).powi(2)
        })
    }

    fn by(observations: &Observations, noise_std_k: [f64; 2], gain: impl Fn([f64; 2]) -> f64) -> Self {
        if observations.period_s.is_none() || observations.samples() < MIN_SEGMENTS * SPECTRUM_POINTS {
            return Self::default();
        }
        let snr = [0, 1].map(|i| {
            let power = spectrum(observations, i);
            let noise = noise_std_k[i] * noise_std_k[i];
            power.iter().map(|p| (p / noise - 1.0).max(0.0)).collect::<Vec<f64>>()
        });
        let gain: Vec<f64> = (0..snr[0].len())
            .map(|j| {
                // The mean of its neighbours: a single bin is uncertain by its own size.
                let around = j.saturating_sub(2)..(j + 3).min(snr[0].len());
                let n = around.len() as f64;
                gain([0, 1].map(|i| around.clone().map(|k| snr[i][k]).sum::<f64>() / n))
            })
            .collect();
        if gain.iter().all(|g| *g > FLAT_GAIN) {
            return Self::default();
        }
        let response = Inverse::of(SPECTRUM_POINTS).transform(gain.iter().map(|g| Complex64::new(*g, 0.0)).collect());
        let taps = (0..=2 * TAPS_EACH_SIDE)
            .map(|j| {
                let lag = j.abs_diff(TAPS_EACH_SIDE);
                let window = 0.5 + 0.5 * (std::f64::consts::PI * lag as f64 / (TAPS_EACH_SIDE + 1) as f64).cos();
                response[lag] / SPECTRUM_POINTS as f64 * window
            })
            .collect();
        Self { taps, prediction: Vec::new() }
    }

    /// These weights, with frequencies also weighted by the spectrum of the residual itself, whose
    /// unbroken stretches are `runs`. The residual is larger than the noise, and the larger it is,
    /// the less it says about the parameters.
    ///
    /// The filter is the prediction error of the autoregressive model that the autocorrelation gives (Yule and Walker), scaled to
    /// unit variance.
    #[must_use]
    pub fn by_residual(&self, runs: &[Vec<f64>]) -> Self {
        let filtered: Vec<Vec<f64>> = runs.iter().map(|run| self.apply(run)).collect();
        let count: usize = filtered.iter().map(Vec::len).sum();
        let order = MAX_AUTOREGRESSIVE_ORDER.min(count / 50);
        let correlation: Vec<f64> = (0..=order)
            .map(|lag| {
                let products = filtered.iter().map(|run| dense::dot(&run[lag.min(run.len())..], run));
                products.sum::<f64>() / count.max(1) as f64
            })
            .collect();
        let matrix: Vec<Vec<f64>> =
            (0..order).map(|a| (0..order).map(|b| correlation[a.abs_diff(b)]).collect()).collect();
        let Some(inverse) = dense::inverse(&matrix) else { return self.clone() };
        let coefficients = dense::times(&inverse, &correlation[1..]);
        let left = correlation[0] - dense::dot(&coefficients, &correlation[1..]);
        let scale = (self.mean() / left).sqrt();
        if !scale.is_finite() {
            return self.clone();
        }
        let prediction = [1.0].into_iter().chain(coefficients.iter().map(|a| -a)).map(|a| a * scale).collect();
        Self { taps: self.taps.clone(), prediction }
    }

    /// How many residuals at either end have no filtered value.
    pub fn half(&self) -> usize {
        self.taps.len() / 2
    }

    /// How many values before one its filtered value depends on.
    pub(crate) fn memory(&self) -> usize {
        self.half() + self.prediction.len()
    }

    /// The mean weight over frequency: degrees of freedom per residual.
    pub fn mean(&self) -> f64 {
        if self.taps.is_empty() { 1.0 } else { self.taps.iter().map(|t| t * t).sum() }
    }

    /// The weight at `omega` radians per sample.
    pub fn at(&self, omega: f64) -> f64 {
        if self.taps.is_empty() {
            return 1.0;
        }
        let middle = self.half();
        let gain: f64 = self.taps[middle]
            + 2.0 * (1..=middle).map(|l| self.taps[middle + l] * (omega * l as f64).cos()).sum::<f64>();
        gain * gain
    }

    /// Whether there is a filter.
    pub(crate) fn has_filter(&self) -> bool {
        !self.taps.is_empty()
    }

    /// Means over `half` values either way, fewer at the ends, where there is no filter.
    pub fn smooth_or_mean(&self, values: &[f64], half: usize) -> Vec<f64> {
        if !self.taps.is_empty() {
            return self.smooth(values);
        }
        let mut sums = vec![0.0];
        for v in values {
            sums.push(sums[sums.len() - 1] + v);
        }
        (0..values.len())
            .map(|k| {
                let (from, to) = (k.saturating_sub(half), (k + half + 1).min(values.len()));
                (sums[to] - sums[from]) / (to - from) as f64
            })
            .collect()
    }

    /// Smoothed values: the filter on what departs from the nearest end where it reaches past one, with unit gain at rest.
    pub fn smooth(&self, values: &[f64]) -> Vec<f64> {
        let width = self.taps.len();
        if width == 0 || values.len() < width {
            return values.to_vec();
        }
        let sum: f64 = self.taps.iter().sum();
        let half = self.half() as isize;
        let last = values.len() as isize - 1;
        (0..=last)
            .map(|k| {
                let at = |l: isize| values[(k + l).clamp(0, last) as usize];
                (-half..=half).map(|l| self.taps[(l + half) as usize] * at(l)).sum::<f64>() / sum
            })
            .collect()
    }

    /// The filtered values, zero where the filter reaches past an end.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        self.apply_into(values, &mut out);
        out
    }

    /// Writes the filtered values to `out`, zero where the filter reaches past an end.
    pub(crate) fn apply_into(&self, values: &[f64], out: &mut Vec<f64>) {
        out.clear();
        if self.taps.is_empty() {
            out.extend_from_slice(values);
        } else {
            out.resize(values.len(), 0.0);
            self.smooth_inside(values, out);
        }
        // Backwards, so that what is needed is not yet overwritten.
        for k in (0..out.len()).rev().filter(|_| !self.prediction.is_empty()) {
            let sum = |k: usize| self.prediction.iter().enumerate().map(|(lag, c)| c * out[k - lag]).sum();
            out[k] = if k + 1 >= self.prediction.len() { sum(k) } else { 0.0 };
        }
    }

    /// What each of `values` adds to the products of filtered values with `weights`, one for each of them: the filter
    /// transposed.
    pub(crate) fn transposed(&self, weights: &[f64]) -> Vec<f64> {
        let n = weights.len();
        let of_smooth: Vec<f64> = if self.prediction.is_empty() {
            weights.to_vec()
        } else {
            let begin = self.prediction.len() - 1;
            let lags = |k: usize| begin.saturating_sub(k)..self.prediction.len().min(n - k);
            (0..n).map(|k| lags(k).map(|lag| self.prediction[lag] * weights[k + lag]).sum()).collect()
        };
        if self.taps.is_empty() {
            return of_smooth;
        }
        let half = self.half();
        // Nothing is filtered where the filter reaches past an end, and both ends take part in what is.
        let inside = half..n.saturating_sub(half).max(half);
        let mut wide = vec![0.0; n + 2 * half];
        wide[half + inside.start.min(n)..half + inside.end.min(n)]
            .copy_from_slice(&of_smooth[inside.start.min(n)..inside.end.min(n)]);
        let mut out = vec![0.0; wide.len()];
        self.smooth_inside(&wide, &mut out);
        out[half..half + n].to_vec()
    }

    /// The filter of zero phase where it reaches past no end: both sides of a pair of taps at once, for as many values side by
    /// side as registers hold sums.
    fn smooth_inside(&self, values: &[f64], out: &mut [f64]) {
        const LANES: usize = 16;
        let half = self.half();
        let count = (values.len() + 1).saturating_sub(self.taps.len());
        let whole = count - count % LANES;
        for from in (0..whole).step_by(LANES) {
            let around = &values[from..][..2 * half + LANES];
            out[from + half..][..LANES].copy_from_slice(&self.sums::<LANES>(around));
        }
        for from in whole..count {
            out[from + half] = self.sums::<1>(&values[from..][..=2 * half])[0];
        }
    }

    /// `N` filtered values of those `around` them.
    fn sums<const N: usize>(&self, around: &[f64]) -> [f64; N] {
        let half = self.half();
        let of = |from: usize| -> &[f64; N] { around[from..].first_chunk().expect("as many as the filter reaches") };
        let mut sums = of(half).map(|v| self.taps[half] * v);
        for (lag, tap) in self.taps[half..].iter().enumerate().skip(1) {
            let (before, after) = (of(half - lag), of(half + lag));
            for ((sum, a), b) in sums.iter_mut().zip(before).zip(after) {
                *sum += tap * (a + b);
            }
        }
        sums
    }
}

/// Mean power of a channel, white noise of unit variance having 1, in `SPECTRUM_POINTS/2 + 1` bins: Hann's window.
fn spectrum(observations: &Observations, channel: usize) -> Vec<f64> {
    let tapered = Tapered::new(hann(SPECTRUM_POINTS));
    let scale = tapered.energy();
    let mut sum = vec![0.0; SPECTRUM_POINTS / 2 + 1];
    let mut count = 0.0_f64;
    for stretch in &observations.stretches {
        for piece in tapered.halves(&stretch.reading_c[channel]) {
            let mean = piece.iter().sum::<f64>() / SPECTRUM_POINTS as f64;
            let spectrum = tapered.transform(piece.iter().map(|y| y - mean));
            sum.iter_mut().zip(&spectrum).for_each(|(s, x)| *s += x.norm_sqr() / scale);
            count += 1.0;
        }
    }
    sum.iter().map(|s| s / count.max(1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(F v)ᵀ w` is `vᵀ (Fᵀ w)`. Both are sums of some 200 values times 50 taps of size one: rounding leaves 1e4 · 1.1e-16.
    #[test]
    fn the_transposed_filter_has_the_products_of_the_filter() {
        let value = |k: usize| ((k * k * 7 + k) as f64 * 2.399).sin();
        let taps: Vec<f64> = (0..49_usize).map(|j| 1.0 / (1.0 + j.abs_diff(24) as f64)).collect();
        let prediction = vec![1.0, -0.6, 0.2];
        for (taps, prediction) in
            [(vec![], vec![]), (taps.clone(), vec![]), (vec![], prediction.clone()), (taps, prediction)]
        {
            let weighting = Weighting { taps, prediction };
            for n in [1, 2, 30, 49, 50, 200] {
                let values: Vec<f64> = (0..n).map(value).collect();
                let weights: Vec<f64> = (0..n).map(|k| value(k + 1000)).collect();
                let (want, got) = (weighting.apply(&values), weighting.transposed(&weights));
                let (want, got) = (dense::dot(&want, &weights), dense::dot(&got, &values));
                assert!((got - want).abs() < 1.1e-12, "{n} values: {got}, and {want}");
            }
        }
    }
}
