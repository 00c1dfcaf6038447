//! Lengths of series whose transforms are fast.

/// Factors of lengths whose transforms are fast.
const FAST_FACTORS: [usize; 4] = [2, 3, 5, 7];

/// The longest series of at most `samples` values whose transform is fast: of no factor but 2, 3, 5 and 7.
///
/// The transform of a large prime factor takes several times as long. Of a thousand values and more, less than 4 % is lost.
///
/// ```
/// use twinlag_transform::fast_length;
///
/// assert_eq!(fast_length(16_384), 16_384);
/// assert_eq!(fast_length(9973), 9800);
/// ```
pub fn fast_length(samples: usize) -> usize {
    let rest = |n: usize| {
        FAST_FACTORS.iter().fold(n, |mut rest, factor| {
            while rest % factor == 0 {
                rest /= factor;
            }
            rest
        })
    };
    (1..=samples).rev().find(|n| rest(*n) == 1).unwrap_or(samples)
}
