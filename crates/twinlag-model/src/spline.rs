//! A smooth function of time with mean zero: a cubic spline on even knots, straight at both ends.

/// Coefficients of the cubic B-splines over `[from, to]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    from_s: f64,
    to_s: f64,
    coefficients: Vec<f64>,
    mean: f64,
}

impl Spline {
    /// - `free`: coefficients of the splines that have their middle on the knots from the second on, at least 3. That of the first
    ///   knot is minus their sum; those beyond either end make the second derivative there zero: the record says little of them
    pub fn new(from_s: f64, to_s: f64, free: &[f64]) -> Self {
        let on_knots = on_knots(free);
        let last = on_knots.len() - 1;
        let mut coefficients = vec![2.0 * on_knots[0] - on_knots[1]];
        coefficients.extend_from_slice(&on_knots);
        coefficients.push(2.0 * on_knots[last] - on_knots[last - 1]);
        let mut out = Self { from_s, to_s, coefficients, mean: 0.0 };
        let points = 40 * out.coefficients.len();
        let total: f64 = (0..points).map(|i| out.at(from_s + (to_s - from_s) * (i as f64 + 0.5) / points as f64)).sum();
        out.mean = total / points as f64;
        out
    }

    pub fn at(&self, time_s: f64) -> f64 {
        let pieces = (self.coefficients.len() - 3) as f64;
        let x = ((time_s - self.from_s) / (self.to_s - self.from_s)).clamp(0.0, 1.0) * pieces;
        let piece = x.floor().min(pieces - 1.0);
        let d = x - piece;
        let c = 1.0 - d;
        let weights = [
            c * c * c / 6.0,
            (4.0 - 6.0 * d * d + 3.0 * d * d * d) / 6.0,
            (4.0 - 6.0 * c * c + 3.0 * c * c * c) / 6.0,
            d * d * d / 6.0,
        ];
        let from = piece as usize;
        weights.iter().zip(&self.coefficients[from..]).map(|(w, a)| w * a).sum::<f64>() - self.mean
    }
}

/// The coefficients on knots: the first is minus the sum of the others.
pub fn on_knots(free: &[f64]) -> Vec<f64> {
    [-free.iter().sum::<f64>()].into_iter().chain(free.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over the record is taken off by a midpoint rule of 40 points a coefficient, exact for cubics to a few parts in a
    /// million.
    #[test]
    fn the_mean_is_zero_and_a_slope_is_a_straight_line() {
        let spline = Spline::new(2.0, 7.0, &[0.3, -0.2, 0.5, 0.1, 0.0]);
        let mean: f64 = (0..100_000).map(|i| spline.at(2.0 + 5.0 * (f64::from(i) + 0.5) / 1e5)).sum::<f64>() / 1e5;
        assert!(mean.abs() < 1e-4, "mean {mean}");
        // Even steps from knot to knot, centred: −0.2, −0.1, 0, 0.1, 0.2.
        let line = Spline::new(0.0, 1.0, &[-0.1, 0.0, 0.1, 0.2]);
        for i in 0..=10 {
            let t = 0.1 * f64::from(i);
            let (got, want) = (line.at(t), 0.4 * (t - 0.5));
            assert!((got - want).abs() < 1e-12, "at {t}: got {got}, want {want}");
        }
    }
}
