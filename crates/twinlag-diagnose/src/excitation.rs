//! What the gas does: how many tones there are to learn from.

use twinlag_model::{Observations, Policy, levels};
use twinlag_transform::{Complex64, Forward};

/// Tones of a gas from which nothing but two time constants can be learned.
pub(crate) const SINGLE: usize = 1;
/// Bins of one tone under the window: its main lobe and rounding.
const TONE_BINS: usize = 12;
/// Bins of the window's main lobe to either side of a tone.
const HALF_LOBE_BINS: usize = 4;
/// Power of a tone's side lobes beside its own: less than that is no tone.
const LEAST_SHARE: f64 = 1e-9;

/// Whether the gas is a single tone, as far as `observations` show: its amplitude and phase are two
/// equations, and the two time constants take both.
pub fn is_single_tone(observations: &Observations, policy: &Policy) -> bool {
    tones(observations, policy) == Some(SINGLE)
}

/// Whether the readings of a channel, evenly sampled and with noise of `noise_k`, are a single tone.
pub fn is_single_tone_in(reading_c: &[f64], noise_k: f64, policy: &Policy) -> bool {
    tones_of(reading_c, policy, || Some(noise_k)) == Some(SINGLE)
}

/// Number of separate tones in the more lively channel, 1 for a single sine; `None` where samples
/// are uneven or the power is spread. Each tone gives two equations, and two time constants take
/// two. The level of the record, what drifts in it, and what a start out of balance leaves do not count.
pub(crate) fn tones(observations: &Observations, policy: &Policy) -> Option<usize> {
    observations.period_s?;
    let channel = usize::from(observations.mean_and_std(1)[1] > observations.mean_and_std(0)[1]);
    let stretch = observations.stretches.iter().max_by_key(|s| s.time_s.len())?;
    tones_of(&stretch.reading_c[channel], policy, || Some(levels(observations)?.std_k[channel]))
}

/// Number of separate tones of one record, as of [`tones`], or of all of several together; `None` where one of them is spread.
pub(crate) fn tones_of_each(observations: &Observations, policy: &Policy) -> Option<usize> {
    if !observations.is_joined() {
        return tones(observations, policy);
    }
    observations.members().iter().map(|member| tones(&observations.of_member(member.number), policy)).sum()
}

/// Number of separate tones in the readings of one channel, as of [`tones`].
///
/// - `noise_k`: standard deviation of the noise, asked for where there are readings enough
fn tones_of(y: &[f64], policy: &Policy, noise_k: impl FnOnce() -> Option<f64>) -> Option<usize> {
    let n = y.len() & !1;
    if n < policy.tone_fewest_samples {
        return None;
    }
    let noise_k = noise_k()?;
    // Blackman and Harris: side lobes of a millionth of a millionth part of the power.
    let window = |k: usize| {
        let c = (std::f64::consts::TAU * (k as f64 + 0.5) / n as f64).cos();
        let (double, triple) = (2.0 * c * c - 1.0, (4.0 * c * c - 3.0) * c);
        0.35875 - 0.48829 * c + 0.14128 * double - 0.01168 * triple
    };
    let mut tapered: Vec<f64> = (0..n).map(window).collect();
    let scale: f64 = tapered.iter().map(|w| w * w).sum();
    // The level under the window: the plain mean is another where the last period is not whole, and leaves a line at zero.
    let weight: f64 = tapered.iter().sum();
    let level = tapered.iter().zip(y).map(|(w, y)| w * y).sum::<f64>() / weight;
    tapered.iter_mut().zip(y).for_each(|(w, y)| *w *= y - level);
    let plan = Forward::once(n);
    let mut spectrum = vec![Complex64::ZERO; plan.bins()];
    plan.transform_into(&mut tapered, &mut spectrum, &mut Vec::new());
    drop(tapered);
    let power: Vec<f64> = spectrum.into_iter().map(|x| x.norm_sqr() / scale).collect();
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
            bin += 1;
        }
        // The lobe of what is too slow ends before this bin.
        if bin <= policy.tone_fewest_periods + HALF_LOBE_BINS {
            continue;
        }
        held += power[from..bin].iter().sum::<f64>();
        tones += 1 + (bin - from) / TONE_BINS;
    }
    // A gas that is rough from sample to sample is taken for noise, of which its largest bin then sticks out.
    let above_noise = power.iter().sum::<f64>() - power.len() as f64 * noise_k * noise_k;
    (held > policy.tone_power_share * above_noise.max(held)).then_some(tones)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

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

    /// Whether both channels of so many rows, 10 ms apart, are a single tone with what `reading_k` has of time.
    fn is_single_with(samples: usize, noise_std_k: f64, reading_k: impl Fn(f64) -> f64) -> bool {
        let time_s: Vec<f64> = (0..samples).map(|k| 0.01 * k as f64).collect();
        let reading_c = [1, 2].map(|seed| {
            let readings = time_s.iter().map(|t| 300.0 + reading_k(*t));
            readings.zip(noise(noise_std_k, samples, seed)).map(|(reading, noise)| reading + noise).collect()
        });
        let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.01)).expect("a record");
        is_single_tone(&observations, &Policy::default())
    }

    fn is_single(amplitude_k: f64, noise_std_k: f64) -> bool {
        is_single_with(20_000, noise_std_k, |t| amplitude_k * (TAU * t).sin())
    }

    /// A tone is one however loud the noise, as long as it can be seen; noise alone is none.
    #[test]
    fn a_tone_below_the_noise_is_a_single_tone() {
        assert!(is_single(1.0, 0.01));
        assert!(is_single(1.0, 0.8));
        assert!(!is_single(0.0, 0.8));
    }

    /// Failed: with a last period that is not whole the mean is not the level, and the difference counted as a second tone.
    #[test]
    fn neither_the_level_nor_a_start_out_of_balance_is_a_tone() {
        for samples in [700, 3000, 4001, 20_000, 100_000] {
            for periods in [12.5, 13.37, 40.25] {
                let hz = periods / (0.01 * samples as f64);
                let tone = |t: f64| 20.0 * (TAU * hz * t).sin();
                // The longest is a fortieth of the record.
                for tau_s in [0.1, 0.01 * samples as f64 / 40.0] {
                    let start = |t: f64| 15.0 * (-t / tau_s).exp();
                    assert!(is_single_with(samples, 0.02, tone), "{samples} rows, {periods} periods");
                    assert!(is_single_with(samples, 0.02, |t| tone(t) + start(t)), "{samples}, {periods}, {tau_s} s");
                }
                // Half a kelvin of another rate, or a step in the middle, is more to learn from.
                let middle_s = 0.005 * samples as f64;
                assert!(!is_single_with(samples, 0.02, |t| tone(t) + 0.5 * (TAU * 2.3 * hz * t).sin()));
                assert!(!is_single_with(samples, 0.02, |t| tone(t) + if t > middle_s { 2.0 } else { 0.0 }));
            }
        }
    }
}
