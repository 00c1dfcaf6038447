//! The course of a column in one line of text.

const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
const CELLS: usize = 24;

/// Blocks whose heights are the means of so many parts of the values, the least on the ground and the greatest at the top; a blank
/// where all of a part is missing. Empty where nothing differs.
pub(crate) fn sparkline(values: &[f64]) -> String {
    let part = values.len().div_ceil(CELLS).max(1);
    let mean = |part: &[f64]| {
        let known = part.iter().filter(|value| value.is_finite());
        let (sum, count) = known.fold((0.0, 0.0_f64), |(sum, count), value| (sum + value, count + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let means: Vec<Option<f64>> = values.chunks(part).map(mean).collect();
    let known = || means.iter().flatten().copied();
    let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    // Where nothing is known the greatest is below the least.
    if high <= low || !(high - low).is_finite() {
        return String::new();
    }
    let top = BLOCKS.len() - 1;
    let block = |mean: f64| BLOCKS[((mean - low) / (high - low) * top as f64).round() as usize];
    means.iter().map(|mean| mean.map_or(' ', block)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_is_on_the_ground_and_the_greatest_at_the_top() {
        assert_eq!(sparkline(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]), "▁▂▃▄▅▆▇█");
        assert_eq!(sparkline(&[0.0, f64::NAN, 7.0]), "▁ █");
        assert_eq!(sparkline(&(0..240).map(f64::from).collect::<Vec<_>>()).chars().count(), CELLS);
    }

    #[test]
    fn what_does_not_move_has_no_line() {
        for values in [&[][..], &[1.0; 50], &[f64::NAN; 3], &[f64::NAN, 2.0], &[-f64::MAX, f64::MAX]] {
            assert_eq!(sparkline(values), "", "{values:?}");
        }
    }
}
