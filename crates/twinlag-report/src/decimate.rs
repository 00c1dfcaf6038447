//! Thinning of long traces without loss of their envelope: of the points that share a pixel column,
//! the first, the lowest, the highest and the last are kept. The drawn line then covers the same
//! pixels, up to slanted strokes within one column.

/// Indices of the points to keep so that a trace drawn over `columns` pixel columns looks the same,
/// in increasing order.
///
/// - `x`, `y`: the trace, `[n]` each, `x` in increasing order (in another order extremes are still
///   kept, but more points than needed with them)
/// - `columns`: number of equally wide bins between the smallest and the largest `x`; zero counts
///   as one
///
/// Kept are at most four points for each bin, and of each run of values that are not finite one, so
/// that a gap stays a gap. If `x` and `y` differ in length, the shorter counts.
///
/// ```
/// let x: Vec<f64> = (0..100_000).map(f64::from).collect();
/// let mut y = vec![0.0; x.len()];
/// y[12_345] = 1.0; // a spike of one sample
/// let keep = twinlag_report::decimate(&x, &y, 400);
/// assert!(keep.len() <= 1600 && keep.contains(&12_345));
/// ```
pub fn decimate(x: &[f64], y: &[f64], columns: usize) -> Vec<usize> {
    let n = x.len().min(y.len());
    let columns = columns.max(1);
    let finite = || x[..n].iter().copied().filter(|v| v.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    // The bin of a point; `None` for a gap.
    let bin = |i: usize| {
        (x[i].is_finite() && y[i].is_finite()).then(|| {
            let position = if high > low { (x[i] - low) / (high - low) } else { 0.0 };
            ((position * columns as f64) as usize).min(columns - 1)
        })
    };
    let mut keep = Vec::new();
    let mut start = 0;
    while start < n {
        let here = bin(start);
        let (mut end, mut lowest, mut highest) = (start + 1, start, start);
        while end < n && bin(end) == here {
            if y[end] < y[lowest] {
                lowest = end;
            }
            if y[end] > y[highest] {
                highest = end;
            }
            end += 1;
        }
        if here.is_some() {
            let mut kept = [start, lowest, highest, end - 1];
            kept.sort_unstable();
            keep.extend_from_slice(&kept);
        } else {
            keep.push(start);
        }
        start = end;
    }
    keep.dedup();
    keep
}

#[cfg(test)]
mod tests {
    use super::decimate;

    /// Oracle: the extremes of each column, sought by brute force over all points.
    #[test]
    fn minima_and_maxima_of_every_column_are_kept() {
        let n = 9973;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i) / f64::from(n - 1)).collect();
        let y: Vec<f64> = (0..n).map(|i| (f64::from(i) * 0.7).sin() * (f64::from(i) * 0.013).cos()).collect();
        let columns = 50;
        let keep = decimate(&x, &y, columns);
        assert!(keep.len() <= 4 * columns, "kept {}", keep.len());
        assert!(keep.windows(2).all(|pair| pair[0] < pair[1]), "not increasing");
        for column in 0..columns {
            let inside = |i: &usize| ((x[*i] * columns as f64) as usize).min(columns - 1) == column;
            let extremes = |indices: &mut dyn Iterator<Item = usize>| {
                indices.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), i| (l.min(y[i]), h.max(y[i])))
            };
            let want = extremes(&mut (0..x.len()).filter(inside));
            let got = extremes(&mut keep.iter().copied().filter(inside));
            assert_eq!(got, want, "column {column}");
        }
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut y = vec![1.0; 1000];
        y[400..500].fill(f64::NAN);
        y[700] = f64::INFINITY;
        let keep = decimate(&x, &y, 10);
        assert_eq!(keep.iter().filter(|i| !y[**i].is_finite()).count(), 2);
        assert!(keep.contains(&0) && keep.contains(&399) && keep.contains(&500) && keep.contains(&999));
    }

    #[test]
    fn degenerate_traces_are_no_trouble() {
        assert!(decimate(&[], &[], 10).is_empty());
        assert_eq!(decimate(&[1.0], &[2.0], 0), [0]);
        assert_eq!(decimate(&[1.0, 1.0, 1.0], &[2.0, 5.0, 3.0], 8), [0, 1, 2]);
        assert_eq!(decimate(&[f64::NAN; 3], &[0.0; 3], 8), [0]);
    }
}
