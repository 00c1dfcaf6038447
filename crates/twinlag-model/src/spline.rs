//! A smooth function of time with mean zero: a cubic spline on even knots, straight at both ends.

use num_dual::DualNum;

use crate::directions::Weights;
use crate::number::Number;

/// Points of the midpoint rule by which the mean is taken off, for each coefficient: exact for cubics to some parts in
/// a million.
const POINTS_PER_COEFFICIENT: usize = 40;

/// Weights of the four cubic B-splines that reach a point, from its place `d` in `[0, 1]` between two knots.
pub(crate) fn weights<T: DualNum<Primitive = f64> + Copy>(d: T) -> [T; 4] {
    let c = -d + 1.0;
    let inner = |x: T| (x * x * x * 3.0 - x * x * 6.0 + 4.0) / 6.0;
    [c * c * c / 6.0, inner(d), inner(c), d * d * d / 6.0]
}

/// A smooth function of time with mean zero: a cubic spline on even knots, straight at both ends.
#[derive(Clone, Debug)]
pub struct Spline {
    from_s: f64,
    to_s: f64,
    coefficients: Vec<Number>,
    mean: Number,
}

impl Spline {
    /// The spline over `[from_s, to_s]`.
    ///
    /// - `free`: coefficients of the B-splines that have their middle on the knots from the second on, at least 3. That
    ///   of the first knot is minus their sum; those beyond either end make the second derivative there zero, since the
    ///   record says little of them
    pub fn new(from_s: f64, to_s: f64, free: &[Number]) -> Self {
        let on_knots = on_knots(free);
        let last = on_knots.len() - 1;
        let mut coefficients = vec![on_knots[0] * 2.0 - on_knots[1]];
        coefficients.extend_from_slice(&on_knots);
        coefficients.push(on_knots[last] * 2.0 - on_knots[last - 1]);
        let mut out = Self { from_s, to_s, coefficients, mean: Number::from(0.0) };
        let points = POINTS_PER_COEFFICIENT * out.coefficients.len();
        let midpoint_s = |i: usize| from_s + (to_s - from_s) * (i as f64 + 0.5) / points as f64;
        out.mean = (0..points).map(|i| out.at(midpoint_s(i))).sum::<Number>() / points as f64;
        out
    }

    /// Its value at an instant.
    ///
    /// ```
    /// use twinlag_model::{Number, Spline};
    ///
    /// // Even steps from knot to knot: a straight line of mean zero. The first knot's coefficient
    /// // is −0.2, minus the sum.
    /// let line = Spline::new(0.0, 10.0, &[-0.1, 0.0, 0.1, 0.2].map(Number::from));
    /// assert!((line.at(10.0).re - line.at(0.0).re - 0.4).abs() < 1e-12 && line.at(5.0).re.abs() < 1e-12); // rounding
    /// // With the derivative by the last coefficient, which the coefficients carry along.
    /// let mut free = [-0.1, 0.0, 0.1, 0.2].map(Number::from);
    /// free[3] = free[3].derivative();
    /// let (now, step) = (Spline::new(0.0, 10.0, &free).at(8.0), 1e-3);
    /// free[3] = Number::from(0.2 + step);
    /// let moved = Spline::new(0.0, 10.0, &free).at(8.0);
    /// assert!((now.eps - (moved.re - now.re) / step).abs() < 1e-10); // it is linear in each of them
    /// ```
    pub fn at(&self, time_s: f64) -> Number {
        let pieces = (self.coefficients.len() - 3) as f64;
        let x = ((time_s - self.from_s) / (self.to_s - self.from_s)).clamp(0.0, 1.0) * pieces;
        let piece = x.floor().min(pieces - 1.0);
        let mut sum = -self.mean;
        for (weight, coefficient) in weights(x - piece).iter().zip(&self.coefficients[piece as usize..]) {
            sum += *coefficient * *weight;
        }
        sum
    }
}

/// A spline with its derivative by one of its parts, and the instants between which that acts, s; `None` where it acts
/// everywhere.
pub(crate) type LocalSpline = (Spline, Option<[f64; 2]>);

/// The spline with its derivative by each B-spline, and by the mean; and for each free coefficient the weights by which its
/// derivative is a sum of these.
pub(crate) fn parts(from_s: f64, to_s: f64, free: &[f64]) -> (Vec<LocalSpline>, Vec<Weights>) {
    let numbers: Vec<Number> = free.iter().copied().map(Number::from).collect();
    let spline = Spline::new(from_s, to_s, &numbers);
    let count = spline.coefficients.len();
    let intervals = count - 3;
    let at_s = |interval: usize| from_s + (to_s - from_s) * interval as f64 / intervals as f64;
    let bump = |l: usize| {
        let mut out = spline.clone();
        out.coefficients[l] = out.coefficients[l].derivative();
        let first_s = if l <= 3 { f64::NEG_INFINITY } else { at_s(l - 3) };
        let last_s = if l + 1 >= intervals { f64::INFINITY } else { at_s(l + 1) };
        (out, Some([first_s, last_s]))
    };
    let mut level = spline.clone();
    level.mean.eps = -1.0;
    let parts = (0..count).map(bump).chain([(level, None)]).collect();
    let of_free = |i: usize| {
        let mut moved = numbers.clone();
        moved[i] = moved[i].derivative();
        let moved = Spline::new(from_s, to_s, &moved);
        let of_bumps = moved.coefficients.iter().map(|c| c.eps).enumerate().filter(|(_, weight)| *weight != 0.0);
        of_bumps.chain([(count, -moved.mean.eps)]).collect()
    };
    (parts, (0..free.len()).map(of_free).collect())
}

/// The coefficients on knots: the first is minus the sum of the others.
pub(crate) fn on_knots<T: DualNum + Copy>(free: &[T]) -> Vec<T> {
    let sum: T = free.iter().copied().sum();
    [-sum].into_iter().chain(free.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over the record is taken off by a midpoint rule of 320 points, 40 a coefficient, which is wrong by
    /// `h² (f'(1) − f'(0))/24`, with `f` of the share of the record that has passed (Euler and Maclaurin). The coefficients on the six knots are −0.7,
    /// 0.3, −0.2, 0.5, 0.1 and 0: straight at both ends, it begins with a slope of 5 · 1.0 and ends with one of
    /// −5 · 0.1, so that the mean is 5.5/(24 · 320²) = 2.24e-6 from zero. The bound is 3 % above.
    #[test]
    fn the_mean_is_zero_and_a_slope_is_a_straight_line() {
        let spline = Spline::new(2.0, 7.0, &[0.3, -0.2, 0.5, 0.1, 0.0].map(Number::from));
        let mean: f64 = (0..100_000).map(|i| spline.at(2.0 + 5.0 * (f64::from(i) + 0.5) / 1e5).re).sum::<f64>() / 1e5;
        assert!(mean.abs() < 2.3e-6, "mean {mean}");
        // Even steps from knot to knot, centred: −0.2, −0.1, 0, 0.1, 0.2.
        let line = Spline::new(0.0, 1.0, &[-0.1, 0.0, 0.1, 0.2].map(Number::from));
        for i in 0..=10 {
            let t = 0.1 * f64::from(i);
            let (got, want) = (line.at(t).re, 0.4 * (t - 0.5));
            assert!((got - want).abs() < 1e-12, "at {t}: got {got}, want {want}");
        }
    }
}
