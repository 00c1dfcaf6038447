//! Correlations over many lags, by Fourier transforms of blocks.

use twinlag_transform::{Forward, Inverse};

/// Lengths of a kernel that a block has at least: more of them leave more of each block.
const KERNELS_PER_BLOCK: usize = 4;

/// Blocks of values that overlap by as much as a kernel reaches.
struct Blocks {
    /// Lags that a kernel reaches to either side.
    lags: usize,
    forward: Forward,
    inverse: Inverse,
}

impl Blocks {
    fn of(lags: usize) -> Self {
        let samples = (KERNELS_PER_BLOCK * (2 * lags + 1)).next_power_of_two();
        Self { lags, forward: Forward::of(samples), inverse: Inverse::of(samples) }
    }

    /// Values that are new in each block.
    fn step(&self) -> usize {
        self.forward.samples() - 2 * self.lags
    }

    /// `Σ kernel[|j|] values[k + j]` for `|j|` of no more than the lags, with a kernel from its middle on.
    fn filter(&self, values: &[f64], kernel: &[f64]) -> Vec<f64> {
        let (n, lags) = (self.forward.samples(), self.lags);
        let mut mirrored = vec![0.0; n];
        mirrored[..=lags].copy_from_slice(kernel);
        (1..=lags).for_each(|lag| mirrored[n - lag] = kernel[lag]);
        let response = self.forward.transform(&mirrored);
        let mut out = Vec::with_capacity(values.len());
        for from in (0..values.len()).step_by(self.step()) {
            let mut block = vec![0.0; n];
            // The lags before the first new value come before it, and those after the last one after it.
            let begin = from.saturating_sub(lags);
            let end = (from + self.step() + lags).min(values.len());
            block[begin + lags - from..end + lags - from].copy_from_slice(&values[begin..end]);
            let spectrum = self.forward.transform(&block);
            let product = spectrum.iter().zip(&response).map(|(a, b)| a * b / n as f64).collect();
            let count = self.step().min(values.len() - from);
            out.extend_from_slice(&self.inverse.transform(product)[lags..lags + count]);
        }
        out
    }
}

/// `Σ values[k] values[k − lag] / n` at lags from none to `lags`.
pub(crate) fn autocorrelation(values: &[f64], lags: usize) -> Vec<f64> {
    let blocks = Blocks::of(lags);
    let n = blocks.forward.samples();
    let mut sums = vec![0.0; lags + 1];
    for from in (0..values.len()).step_by(blocks.step()) {
        let new = from..(from + blocks.step()).min(values.len());
        let begin = from.saturating_sub(lags);
        let (mut now, mut then) = (vec![0.0; n], vec![0.0; n]);
        now[lags..lags + new.len()].copy_from_slice(&values[new.clone()]);
        then[begin + lags - from..lags + new.len()].copy_from_slice(&values[begin..new.end]);
        let (now, then) = (blocks.forward.transform(&now), blocks.forward.transform(&then));
        let product = now.iter().zip(&then).map(|(a, b)| a * b.conj() / n as f64).collect();
        let correlation = blocks.inverse.transform(product);
        sums.iter_mut().zip(&correlation).for_each(|(sum, c)| *sum += c);
    }
    sums.iter_mut().for_each(|sum| *sum /= values.len() as f64);
    sums
}

/// Values filtered by a kernel that is the same forwards and backwards, from its middle on: zero beyond both ends of the values.
pub(crate) fn filtered(values: &[f64], kernel: &[f64]) -> Vec<f64> {
    Blocks::of(kernel.len() - 1).filter(values, kernel)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against sums over the products themselves. A transform of `N ≤ 2048` values rounds each by `ε √(log₂ N)`, 7e-16 of their root
    /// mean square, and a product of two by twice that. The correlation is a mean of a thousand, so below 1.5e-15; the filter, whose
    /// kernel sums to 11, below 1.6e-14. The bounds are some six times these.
    #[test]
    fn correlations_are_sums_of_products() {
        let values: Vec<f64> = (0..1000).map(|k| (f64::from(k * k * 7 + k) * 2.399).sin()).collect();
        for lags in [0, 1, 12, 250] {
            let got = autocorrelation(&values, lags);
            assert_eq!(got.len(), lags + 1);
            for (lag, got) in got.iter().enumerate() {
                let want = (lag..1000).map(|k| values[k] * values[k - lag]).sum::<f64>() / 1000.0;
                assert!((got - want).abs() < 1e-14, "lag {lag} of {lags}: {got}, and {want}");
            }
            let kernel: Vec<f64> = (0..=lags).map(|lag| 1.0 / (1 + lag) as f64).collect();
            for (k, got) in filtered(&values, &kernel).into_iter().enumerate() {
                let near = k.saturating_sub(lags)..(k + lags + 1).min(1000);
                let want: f64 = near.map(|j| kernel[k.abs_diff(j)] * values[j]).sum();
                assert!((got - want).abs() < 1e-13, "value {k}, {lags} lags: {got}, and {want}");
            }
        }
    }
}
