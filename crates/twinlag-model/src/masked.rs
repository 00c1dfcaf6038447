//! The noise of masked readings: of missing ones, in whose place stands a value between their neighbours, and of wrong ones.

use crate::observations::Stretch;

/// Standard deviation of a missing reading, in times what its neighbours say that it may be off: so much that what stands in its place says
/// next to nothing. Chosen. It must not be far more: where both readings of a missing row enter the residual in the same proportions, as for
/// some value of a delay or a lag they do, one of the residuals says all that it says otherwise, and the energy has a bump there, the
/// narrower the larger this is.
const FARTHEST_SHARE: f64 = 3.0;
/// Steps from reading to reading, on either side of masked ones, that say how fast a channel moves there. Chosen.
const STEPS_BESIDE: usize = 4;
/// Standard deviation of a wrong reading, in times the swing: far beyond what the reading could say, and not so far that rounding
/// is lost to it (the square of a ratio of 1e7 to the noise is what double precision holds).
const WRONG_SWINGS: f64 = 20.0;

/// The masked readings of a channel, in rising order, each with its standard deviation, K.
///
/// How far a missing reading may be off is the largest of three: the largest step beside it, once for each sample to the nearest reading that
/// counts; its distance from the chord between the readings that count on either side; and the noise.
///
/// - `noise_std_k`: that of the readings that count, K
/// - `swing_k`: standard deviation of the more lively channel, K
pub(crate) fn masked_std_k(stretch: &Stretch, channel: usize, noise_std_k: f64, swing_k: f64) -> Vec<(usize, f64)> {
    let (y, masked) = (&stretch.reading_c[channel], &stretch.masked[channel]);
    let mut out = Vec::new();
    let mut from = 0;
    while let Some(first) = (from..masked.len()).find(|k| masked[*k]) {
        let end = (first..masked.len()).find(|k| !masked[*k]).unwrap_or(masked.len());
        let near = first.saturating_sub(STEPS_BESIDE + 1)..(end + STEPS_BESIDE + 1).min(masked.len());
        let counting: Vec<f64> = near.filter(|k| !masked[*k]).map(|k| y[k]).collect();
        let step_k = counting.windows(2).map(|pair| (pair[1] - pair[0]).abs()).reduce(f64::max).unwrap_or(swing_k);
        let [before, after] = [first.checked_sub(1), (end < masked.len()).then_some(end)];
        let chord_c = |k: usize| match [before, after] {
            [Some(a), Some(b)] => y[a] + (y[b] - y[a]) * (k - a) as f64 / (b - a) as f64,
            [one, other] => one.or(other).map_or(y[k], |end| y[end]),
        };
        let std_k = |k: usize| {
            if !stretch.is_missing(channel, k) {
                return WRONG_SWINGS * swing_k;
            }
            let distance = [before, after].into_iter().flatten().map(|end| end.abs_diff(k)).min().unwrap_or(1);
            FARTHEST_SHARE * (step_k * distance as f64).max((y[k] - chord_c(k)).abs()).max(noise_std_k)
        };
        out.extend((first..end).map(|k| (k, std_k(k))));
        from = end;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_K: f64 = 0.1;
    const SWING_K: f64 = 40.0;

    /// A stretch whose first channel has these readings, some of which are missing.
    fn stretch(y: &[f64], missing: &[usize]) -> Stretch {
        let time_s: Vec<f64> = (0..y.len()).map(|k| k as f64).collect();
        let is_missing: Vec<bool> = (0..y.len()).map(|k| missing.contains(&k)).collect();
        Stretch::new(time_s, [y.to_vec(), y.to_vec()]).with_missing([is_missing.clone(), is_missing])
    }

    fn found(stretch: &Stretch) -> Vec<(usize, f64)> {
        masked_std_k(stretch, 0, NOISE_K, SWING_K)
    }

    /// On a ramp of 2 K a step a missing reading may be off by the 4 K from one of its neighbours to the other, and one of three in a row,
    /// which leave 8 K between them, by that or, in the middle, by twice that.
    #[test]
    fn a_missing_reading_may_be_off_by_the_steps_beside_it() {
        let ramp: Vec<f64> = (0..20).map(|k| 2.0 * f64::from(k)).collect();
        assert_eq!(found(&stretch(&ramp, &[])), []);
        assert_eq!(found(&stretch(&ramp, &[10])), [(10, 12.0)]);
        assert_eq!(found(&stretch(&ramp, &[4, 10, 11, 12])), [(4, 12.0), (10, 24.0), (11, 48.0), (12, 24.0)]);
        assert_eq!(found(&stretch(&ramp, &[0, 19])), [(0, 6.0), (19, 6.0)]);
        let mut apart = ramp;
        apart[10] = 0.0;
        assert_eq!(found(&stretch(&apart, &[10])), [(10, 60.0)]);
    }

    /// Among equal readings a missing one may be off by the noise, and where there is no other one, by the swing.
    #[test]
    fn where_nothing_moves_the_noise_remains_and_where_nothing_counts_the_swing() {
        let still = [20.0; 20];
        assert_eq!(found(&stretch(&still, &[10])), [(10, 3.0 * NOISE_K)]);
        let all: Vec<usize> = (0..20).collect();
        assert!(found(&stretch(&still, &all)).iter().all(|(_, std_k)| *std_k == 3.0 * SWING_K));
    }

    /// A wrong reading may be anything, beside a missing one as well.
    #[test]
    fn a_wrong_reading_may_be_anything() {
        let mut stretch = stretch(&[20.0; 20], &[10]);
        stretch.masked[0][11] = true;
        assert_eq!(found(&stretch), [(10, 3.0 * NOISE_K), (11, 20.0 * SWING_K)]);
    }
}
