//! The speed of sensors that move, from a column of their position: the depth of a sonde, the height of a balloon.
//!
//! The slope at a row is that of the straight line through its neighbours. As many are taken on either side as it takes for the
//! slope to be known well beside the speed: a position is written in steps, and from row to row the slope is that of these steps.
//! Where a gap in time is, nobody knows how the sensors moved, so that rows on its other side are no neighbours.

use std::ops::Range;

/// Neighbours on either side, from few to many.
const NEIGHBOURS: [usize; 5] = [2, 4, 8, 16, 32];
/// Root mean square error of the slopes over that of the speed at which neighbours are enough: with a time constant that goes as
/// the speed it is a twentieth of that in each row, and far less in what a fit finds from all of them. Chosen.
const MAX_ERROR_SHARE: f64 = 0.05;

/// The speed in each row, in units of the position over s; NaN where the position is missing.
///
/// - `time_s`: rising; `position`: as many, NaN where missing
/// - `runs`: rows without a gap between them
pub(crate) fn speed(time_s: &[f64], position: &[f64], runs: &[Range<usize>]) -> Vec<f64> {
    let known = |run: &Range<usize>| run.clone().filter(|row| position[*row].is_finite()).collect();
    let runs: Vec<Vec<usize>> = runs.iter().map(known).collect();
    let points = |rows: &Vec<usize>| rows.iter().map(|row| [time_s[*row], position[*row]]).collect();
    let points: Vec<Vec<[f64; 2]>> = runs.iter().map(points).collect();
    let mut slopes = Vec::new();
    for neighbours in NEIGHBOURS {
        let of_run =
            |points: &Vec<[f64; 2]>| (0..points.len()).map(|at| Line::around(points, at, neighbours)).collect();
        let fits: Vec<Line> = points.iter().flat_map(|points| -> Vec<Line> { of_run(points) }).collect();
        let mean_square = |of: fn(&Line) -> f64| fits.iter().map(of).sum::<f64>() / fits.len().max(1) as f64;
        let error = (mean_square(|line| line.variance) / mean_square(|line| line.slope * line.slope)).sqrt();
        slopes = fits.iter().map(|line| line.slope).collect();
        if error <= MAX_ERROR_SHARE {
            break;
        }
    }
    let mut out = vec![f64::NAN; position.len()];
    runs.into_iter().flatten().zip(slopes).for_each(|(row, slope)| out[row] = slope);
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
        for (row, speed) in
            speed(&time_s, &position, std::slice::from_ref(&(0..200))).iter().enumerate().skip(2).take(196)
        {
            assert!((speed - 0.2013).abs() < 4.0 * 0.0009, "row {row}: {speed} m/s");
        }
    }

    /// Rows without a position have no speed, and their neighbours the slope across them.
    #[test]
    fn missing_positions_are_passed_over() {
        let time_s: Vec<f64> = (0..60).map(f64::from).collect();
        let mut position: Vec<f64> = time_s.iter().map(|t| 100.0 - 0.5 * t).collect();
        position[20] = f64::NAN;
        let got = speed(&time_s, &position, std::slice::from_ref(&(0..60)));
        assert!(got[20].is_nan());
        assert!(got.iter().enumerate().all(|(row, v)| row == 20 || (v + 0.5).abs() < 1e-9), "{got:?}");
    }

    /// A sonde goes down at 0.5 m/s, is lost for a quarter of an hour, and is found on its way up: no row has the speed of the line from
    /// there to here.
    #[test]
    fn no_speed_is_taken_across_a_gap() {
        let time_s: Vec<f64> = (0..40).map(|k| f64::from(k) + if k < 20 { 0.0 } else { 900.0 }).collect();
        let position: Vec<f64> =
            (0..40).map(|k| if k < 20 { 0.5 * f64::from(k) } else { 80.0 - 0.5 * f64::from(k) }).collect();
        for (row, speed) in speed(&time_s, &position, &[0..20, 20..40]).iter().enumerate() {
            let want = if row < 20 { 0.5 } else { -0.5 };
            assert!((speed - want).abs() < 1e-9, "row {row}: {speed} m/s");
        }
    }

    /// A glider turns at the bottom: the speed is exact in every row whose two neighbours on either side lie on one side of the turn, and
    /// nothing in the row of the turn.
    #[test]
    fn a_turn_is_as_short_as_the_neighbours_are_few() {
        let time_s: Vec<f64> = (0..200).map(f64::from).collect();
        let position: Vec<f64> = time_s.iter().map(|t| (t - 100.0).abs() * 0.2).collect();
        for (row, speed) in speed(&time_s, &position, std::slice::from_ref(&(0..200))).iter().enumerate() {
            let away = row as f64 - 100.0;
            if away.abs() > 2.0 {
                assert!((speed - 0.2 * away.signum()).abs() < 1e-9, "row {row}: {speed} m/s");
            }
        }
        assert!(speed(&time_s, &position, std::slice::from_ref(&(0..200)))[100].abs() < 1e-9);
    }
}
