//! A smooth function of time with mean zero: a cubic spline on even knots.

/// Coefficients of the cubic B-splines over `[from, to]`; the first is fixed by the mean.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spline {
    from_s: f64,
    to_s: f64,
    coefficients: Vec<f64>,
    mean: f64,
}

impl Spline {
    /// - `free`: all coefficients but the first, at least 3
    pub(crate) fn new(from_s: f64, to_s: f64, free: &[f64]) -> Self {
        let mut coefficients = vec![0.0];
        coefficients.extend_from_slice(free);
        let mut out = Self { from_s, to_s, coefficients, mean: 0.0 };
        let points = 40 * out.coefficients.len();
        let total: f64 = (0..points).map(|i| out.at(from_s + (to_s - from_s) * (i as f64 + 0.5) / points as f64)).sum();
        out.mean = total / points as f64;
        out
    }

    pub(crate) fn at(&self, time_s: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over the record is taken off by a midpoint rule of 40 points a coefficient, exact for cubics to a few parts in a
    /// million.
    #[test]
    fn the_mean_is_zero_and_equal_coefficients_are_a_constant() {
        let spline = Spline::new(2.0, 7.0, &[0.3, -0.2, 0.5, 0.1, 0.0]);
        let mean: f64 = (0..100_000).map(|i| spline.at(2.0 + 5.0 * (f64::from(i) + 0.5) / 1e5)).sum::<f64>() / 1e5;
        assert!(mean.abs() < 1e-4, "mean {mean}");
        // All but the first, which is fixed at zero, far from that end.
        let flat = Spline::new(0.0, 1.0, &[1.0; 9]);
        assert!((flat.at(0.9) - flat.at(0.6)).abs() < 1e-12);
    }
}
