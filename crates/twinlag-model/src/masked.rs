//! How far masked readings may be off: missing ones, in whose place stands a value between their neighbours, and those that are known to be
//! wrong.

use crate::observations::Stretch;

/// Standard deviation of a masked reading, in times what its neighbours say that it may be off: so much that what stands in its place says next
/// to nothing. Chosen. It must not be without bound: where both readings of a missing row enter the residual in the same proportions, as for
/// some value of a delay or a lag they do, one of the residuals would say all that it says otherwise, and the energy would have a bump, the
/// narrower the larger this is.
const FARTHEST_SHARE: f64 = 3.0;
/// Steps from reading to reading, on either side of masked ones, that say how fast a channel moves there. Chosen.
const STEPS_BESIDE: usize = 4;

/// The masked readings of a channel, in rising order, each with its standard deviation, K.
///
/// How far a reading may be off is the largest of three: the largest step beside it, once for each sample to the nearest reading that counts;
/// its distance from the chord between the readings that count on either side; and the noise.
///
/// - `noise_std_k`: that of the other readings, K
/// - `swing_k`: what stands for the largest step where there is none, K
pub(crate) fn masked_std_k(stretch: &Stretch, channel: usize, noise_std_k: f64, swing_k: f64) -> Vec<(usize, f64)> {
    let (y, masked) = (&stretch.reading_c[channel], &stretch.masked[channel]);
    let mut out = Vec::new();
    let mut from = 0;
    while let Some(first) = (from..masked.len()).find(|k| masked[*k]) {
        let end = (first..masked.len()).find(|k| !masked[*k]).unwrap_or(masked.len());
        let before = first.checked_sub(1);
        let after = Some(end).filter(|k| *k < masked.len());
        let ends_c = [before, after].map(|k| k.map(|k| y[k]));
        let chord = |k: usize| match ends_c {
            [Some(a), Some(b)] => a + (b - a) * (k + 1 - first) as f64 / (end + 1 - first) as f64,
            [one, other] => one.or(other).unwrap_or(y[k]),
        };
        let near = first.saturating_sub(STEPS_BESIDE + 1)..(end + STEPS_BESIDE + 1).min(masked.len());
        let good: Vec<f64> = near.filter(|k| !masked[*k]).map(|k| y[k]).collect();
        let step_k = good.windows(2).map(|pair| (pair[1] - pair[0]).abs()).reduce(f64::max).unwrap_or(swing_k);
        out.extend((first..end).map(|k| {
            let distance = [before.map(|b| k - b), after.map(|a| a - k)].into_iter().flatten().min().unwrap_or(1);
            let off_k = (step_k * distance as f64).max((y[k] - chord(k)).abs()).max(noise_std_k);
            (k, FARTHEST_SHARE * off_k)
        }));
        from = end;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_K: f64 = 0.1;
    const SWING_K: f64 = 40.0;

    /// Of both channels, of which the first has these readings and masks.
    fn found(y: &[f64], masked: &[usize]) -> Vec<(usize, f64)> {
        let time_s: Vec<f64> = (0..y.len()).map(|k| k as f64).collect();
        let is_masked: Vec<bool> = (0..y.len()).map(|k| masked.contains(&k)).collect();
        let stretch = Stretch::new(time_s, [y.to_vec(), y.to_vec()]).with_missing([is_masked.clone(), is_masked]);
        masked_std_k(&stretch, 0, NOISE_K, SWING_K)
    }

    /// On a ramp of 2 K a step a missing reading may be off by the 4 K from one of its neighbours to the other, and one of three in a row, which
    /// leave 8 K between them, by that or, in the middle, by twice that.
    #[test]
    fn a_missing_reading_may_be_off_by_the_steps_beside_it() {
        let ramp: Vec<f64> = (0..20).map(|k| 2.0 * f64::from(k)).collect();
        assert_eq!(found(&ramp, &[]), []);
        assert_eq!(found(&ramp, &[10]), [(10, 12.0)]);
        assert_eq!(found(&ramp, &[4, 10, 11, 12]), [(4, 12.0), (10, 24.0), (11, 48.0), (12, 24.0)]);
        assert_eq!(found(&ramp, &[0, 19]), [(0, 6.0), (19, 6.0)]);
    }

    /// A spike is off by its height, a reading among equal ones by the noise, and where there is no other one, by the swing.
    #[test]
    fn a_wrong_reading_may_be_off_by_its_distance_from_the_others() {
        let mut still = vec![20.0; 20];
        assert_eq!(found(&still, &[10]), [(10, 3.0 * NOISE_K)]);
        still[10] = -30.0;
        assert_eq!(found(&still, &[10]), [(10, 150.0)]);
        let all: Vec<usize> = (0..20).collect();
        assert!(found(&still, &all).iter().all(|(_, std_k)| *std_k == 3.0 * SWING_K));
    }
}
