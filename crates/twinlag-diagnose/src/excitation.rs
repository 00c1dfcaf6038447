//! What the gas does: how many tones there are to learn from.

use twinlag_model::{Observations, Policy, levels};
use twinlag_transform::Tapered;

/// Tones of a gas from which nothing but two time constants can be learned.
pub(crate) const SINGLE: usize = 1;
/// Bins of one tone under the window: its main lobe and rounding.
const TONE_BINS: usize = 12;
/// Power of a tone's side lobes beside its own: less than that is no tone.
const LEAST_SHARE: f64 = 1e-9;

/// Whether the gas is a single tone, as far as `observations` show: its amplitude and phase are two
/// equations, and the two time constants take both.
pub fn is_single_tone(observations: &Observations, policy: &Policy) -> bool {
    tones(observations, policy) == Some(SINGLE)
}

/// Number of separate tones in the more lively channel, 1 for a single sine; `None` where samples
/// are uneven or the power is spread. Each tone gives two equations, and two time constants take
/// two.
pub(crate) fn tones(observations: &Observations, policy: &Policy) -> Option<usize> {
    observations.period_s?;
    let channel = usize::from(observations.mean_and_std(1)[1] > observations.mean_and_std(0)[1]);
    let stretch = observations.stretches.iter().max_by_key(|s| s.time_s.len())?;
    let y = &stretch.reading_c[channel];
    let n = y.len() & !1;
    if n < policy.tone_fewest_samples {
        return None;
    }
    let noise_k = levels(observations)?.std_k[channel];
    let mean = y[..n].iter().sum::<f64>() / n as f64;
    // Blackman and Harris: side lobes of a millionth of a millionth part of the power.
    let window = |k: usize| {
        let x = std::f64::consts::TAU * (k as f64 + 0.5) / n as f64;
        0.35875 - 0.48829 * x.cos() + 0.14128 * (2.0 * x).cos() - 0.01168 * (3.0 * x).cos()
    };
    let tapered = Tapered::new((0..n).map(window).collect());
    let scale = tapered.energy();
    let spectrum = tapered.transform(y[..n].iter().map(|y| y - mean));
    let power: Vec<f64> = spectrum.iter().map(|x| x.norm_sqr() / scale).collect();
    let largest = power.iter().copied().fold(0.0, f64::max);
    let least = (policy.tone_power_ratio * noise_k * noise_k).max(LEAST_SHARE * largest);
    // What moves less than a few times in the whole record is no tone: it is not seen to come back.
    let strongest = power.iter().position(|p| *p == largest)?;
    if strongest < policy.tone_fewest_periods {
        return None;
    }
    let (mut tones, mut bin, mut held) = (0, 0, 0.0);
    while bin < power.len() {
        if power[bin] <= least {
            bin += 1;
            continue;
        }
        let from = bin;
        while bin < power.len() && power[bin] > least {
            held += power[bin];
            bin += 1;
        }
        tones += 1 + (bin - from) / TONE_BINS;
    }
    // A gas that is rough from sample to sample is taken for noise, of which its largest bin then sticks out.
    let above_noise = power.iter().sum::<f64>() - power.len() as f64 * noise_k * noise_k;
    (held > policy.tone_power_share * above_noise.max(held)).then_some(tones)
}

#[cfg(test)]
mod tests {
    use twinlag_model::Stretch;

    use super::*;

    /// Uniform noise by a congruential generator.
    fn noise(std_k: f64, samples: usize, mut seed: u64) -> Vec<f64> {
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..samples).map(|_| 12.0_f64.sqrt() * std_k * (next() - 0.5)).collect()
    }

    fn is_single(amplitude_k: f64, noise_std_k: f64) -> bool {
        const SAMPLES: usize = 20_000;
        let time_s: Vec<f64> = (0..SAMPLES).map(|k| 0.01 * k as f64).collect();
        let reading_c = [1, 2].map(|seed| {
            let tone = time_s.iter().map(|t| 300.0 + amplitude_k * (std::f64::consts::TAU * t).sin());
            tone.zip(noise(noise_std_k, SAMPLES, seed)).map(|(gas, noise)| gas + noise).collect()
        });
        let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.01)).expect("a record");
        is_single_tone(&observations, &Policy::default())
    }

    /// A tone is one however loud the noise, as long as it can be seen; noise alone is none.
    #[test]
    fn a_tone_below_the_noise_is_a_single_tone() {
        assert!(is_single(1.0, 0.01));
        assert!(is_single(1.0, 0.8));
        assert!(!is_single(0.0, 0.8));
    }
}
