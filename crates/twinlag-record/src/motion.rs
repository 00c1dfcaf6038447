//! The speed of sensors that move, from a column of their position: the depth of a sonde, the height of a balloon.
//!
//! The slope at a row is that of the straight line through its neighbours. As many are taken on either side as it takes for the
//! slope to be known well beside the speed: a position is written in steps, and from row to row the slope is that of these steps.

/// Neighbours on either side, from few to many.
const NEIGHBOURS: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// Root mean square error of the slopes over that of the speed at which neighbours are enough: with a time constant that goes as
/// the speed it is a twentieth of that in each row, and far less in what a fit finds from all of them. Chosen.
const MAX_ERROR_SHARE: f64 = 0.05;

/// The speed in each row, in units of the position over s; NaN where the position is missing.
///
/// - `time_s`: rising; `position`: as many, NaN where missing
pub(crate) fn speed(time_s: &[f64], position: &[f64]) -> Vec<f64> {
    let rows: Vec<usize> = (0..position.len()).filter(|row| position[*row].is_finite()).collect();
    let points: Vec<[f64; 2]> = rows.iter().map(|row| [time_s[*row], position[*row]]).collect();
    let mut slopes = Vec::new();
    for neighbours in NEIGHBOURS {
        let fits: Vec<Line> = (0..points.len()).map(|at| Line::around(&points, at, neighbours)).collect();
        let mean_square = |of: fn(&Line) -> f64| fits.iter().map(of).sum::<f64>() / fits.len().max(1) as f64;
        let error = (mean_square(|line| line.variance) / mean_square(|line| line.slope * line.slope)).sqrt();
        slopes = fits.iter().map(|line| line.slope).collect();
        // A line through two points leaves nothing to tell its error by.
        if neighbours > 1 && error <= MAX_ERROR_SHARE {
            break;
        }
    }
    let mut out = vec![f64::NAN; position.len()];
    rows.into_iter().zip(slopes).for_each(|(row, slope)| out[row] = slope);
    out
}

/// A straight line through some points.
struct Line {
    slope: f64,
    /// Variance of the slope, from what the points differ from the line.
    variance: f64,
}

impl Line {
    fn around(points: &[[f64; 2]], at: usize, neighbours: usize) -> Self {
        let points = &points[at.saturating_sub(neighbours)..(at + neighbours + 1).min(points.len())];
        let n = points.len() as f64;
        let [mean_t, mean_p] = [0, 1].map(|i| points.iter().map(|point| point[i]).sum::<f64>() / n);
        let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|[t, p]| of(t - mean_t, p - mean_p)).sum::<f64>();
        let (squares, products) = (sum(&|t, _| t * t), sum(&|t, p| t * p));
        if squares <= 0.0 {
            return Self { slope: 0.0, variance: 0.0 };
        }
        let slope = products / squares;
        let left = sum(&|t, p| (p - slope * t).powi(2));
        Self { slope, variance: left / (n - 2.0).max(1.0) / squares }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A descent at 0.2 m/s in steps of a centimetre, a reading a second: uniform errors of a step have a standard deviation of
    /// 0.01/√12 m, and the slope of a line through 2m + 1 of them `√(12/(2m(2m + 1)(2m + 2)))` of that: a twentieth of 0.2 m/s is
    /// reached with m = 1 already, and m = 2 leaves 0.0009 m/s. Four of these are the tolerance.
    #[test]
    fn steps_of_a_position_are_smoothed() {
        let time_s: Vec<f64> = (0..200).map(f64::from).collect();
        let position: Vec<f64> = time_s.iter().map(|t| (0.2013 * t * 100.0).round() / 100.0).collect();
        for (row, speed) in speed(&time_s, &position).iter().enumerate().skip(2).take(196) {
            assert!((speed - 0.2013).abs() < 4.0 * 0.0009, "row {row}: {speed} m/s");
        }
    }

    /// Rows without a position have no speed, and their neighbours the slope across them.
    #[test]
    fn missing_positions_are_passed_over() {
        let time_s: Vec<f64> = (0..60).map(f64::from).collect();
        let mut position: Vec<f64> = time_s.iter().map(|t| 100.0 - 0.5 * t).collect();
        position[20] = f64::NAN;
        let got = speed(&time_s, &position);
        assert!(got[20].is_nan());
        assert!(got.iter().enumerate().all(|(row, v)| row == 20 || (v + 0.5).abs() < 1e-9), "{got:?}");
    }
}
