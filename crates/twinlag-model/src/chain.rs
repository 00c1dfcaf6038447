//! From readings to inferred gas temperature, one first-order factor after the other, with the noise carried along.
//!
//! A sensor `(1 + τ₁ s)(1 + τ₂ s) … y = x` is inverted factor by factor. On evenly spaced samples both operators of a factor
//! are those of the cubic spline through the samples,
//!
//! `S₀ = (z + 4 + z⁻¹)/6`, `S₁ = (z − z⁻¹)/(2 Ts)`, so that `S₁/S₀ = s (1 − (ω Ts)⁴/180 + …)`:
//!
//! a factor gives `S₀ v + τ S₁ v = S₀ (v + τ v')`. `S₀` cannot be taken off (its inverse is not local), so both sensors' chains get
//! the same number of factors and are compared with all their `S₀` on. On uneven samples the operators are the mean and the
//! slope of each interval. Every value is a local function of a few readings; its derivatives with respect to them are the rows
//! that carry the noise.

use crate::observations::Stretch;

/// How many samples a delay may reach where they are uneven.
pub const UNEVEN_REACH: usize = 3;

/// The derivatives of each value with respect to the readings: row `k` belongs to the samples `start + k …`.
#[derive(Clone, Debug)]
pub struct Rows {
    pub width: usize,
    pub start: usize,
    /// One row if all are the same, otherwise all of them.
    data: Vec<f64>,
    is_same: bool,
}

impl Rows {
    pub fn identity() -> Self {
        Self { width: 1, start: 0, data: vec![1.0], is_same: true }
    }

    pub fn at(&self, k: usize) -> &[f64] {
        let from = if self.is_same { 0 } else { k * self.width };
        &self.data[from..from + self.width]
    }

    pub fn is_same(&self) -> bool {
        self.is_same
    }

    /// Each row times its own factor.
    fn scale_each(&mut self, factors: &[f64]) {
        let width = self.width;
        let data = (0..factors.len()).flat_map(|k| self.at(k).iter().map(move |c| c * factors[k])).collect();
        (self.data, self.is_same, self.width) = (data, false, width);
    }

    pub fn scale(&mut self, factor: f64) {
        self.data.iter_mut().for_each(|c| *c *= factor);
    }

    /// `self + factor · other`, which belongs to the same values.
    pub fn plus(&self, other: &Self, factor: f64, values: usize) -> Self {
        let start = self.start.min(other.start);
        let end = (self.start + self.width).max(other.start + other.width);
        let width = end - start;
        let is_same = self.is_same && other.is_same;
        let count = if is_same { 1 } else { values };
        let mut data = vec![0.0; count * width];
        for k in 0..count {
            let row = &mut data[k * width..(k + 1) * width];
            self.at(k).iter().enumerate().for_each(|(j, c)| row[self.start - start + j] += c);
            other.at(k).iter().enumerate().for_each(|(j, c)| row[other.start - start + j] += factor * c);
        }
        Self { width, start, data, is_same }
    }

    /// Rows of `Σ_j taps(k)[j] · v[k + j]`, of which there are `values`.
    fn combine(&self, values: usize, length: usize, taps: &Taps) -> Self {
        let width = self.width + length - 1;
        let is_same = self.is_same && taps.is_same();
        let count = if is_same { 1 } else { values };
        let mut data = vec![0.0; count * width];
        for (k, row) in data.chunks_exact_mut(width).enumerate() {
            for j in 0..length {
                let tap = taps.at(k, j);
                for (c, old) in row[j..].iter_mut().zip(self.at(k + j)) {
                    *c += tap * old;
                }
            }
        }
        Self { width, start: self.start, data, is_same }
    }
}

/// The weights of neighbouring values.
enum Taps {
    Same(Vec<f64>),
    Each { length: usize, data: Vec<f64> },
}

impl Taps {
    fn is_same(&self) -> bool {
        matches!(self, Self::Same(_))
    }

    fn at(&self, k: usize, j: usize) -> f64 {
        match self {
            Self::Same(taps) => taps[j],
            Self::Each { length, data } => data[k * length + j],
        }
    }
}

/// A number that may change along the record.
pub enum Along {
    Same(f64),
    /// One for each value that the factor gives.
    Each(Vec<f64>),
}

impl Along {
    fn at(&self, k: usize) -> f64 {
        match self {
            Self::Same(x) => *x,
            Self::Each(all) => all[k],
        }
    }
}

/// A function of each value, with its derivative.
pub struct Pointwise {
    pub value: Vec<f64>,
    pub derivative: Vec<f64>,
}

/// Values on their own instants, and how they depend on the readings of one channel.
#[derive(Clone, Debug)]
pub struct Chain {
    pub time_s: Vec<f64>,
    pub value: Vec<f64>,
    pub rows: Rows,
    period_s: Option<f64>,
}

impl Chain {
    pub fn of(stretch: &Stretch, channel: usize, period_s: Option<f64>) -> Self {
        Self {
            time_s: stretch.time_s.clone(),
            value: stretch.reading_c[channel].clone(),
            rows: Rows::identity(),
            period_s,
        }
    }

    pub fn len(&self) -> usize {
        self.value.len()
    }

    /// Taps of a factor.
    fn length(&self) -> usize {
        if self.period_s.is_some() { 3 } else { 2 }
    }

    /// Values after another factor.
    pub fn after_factor(&self) -> usize {
        self.len() + 1 - self.length()
    }

    /// Instants after another factor, s.
    pub fn times_after_factor(&self) -> Vec<f64> {
        match self.period_s {
            Some(_) => self.time_s[1..self.len() - 1].to_vec(),
            None => self.time_s.windows(2).map(|t| 0.5 * (t[0] + t[1])).collect(),
        }
    }

    /// Adds to every value what depends on time alone, and multiplies: `(v + add(t)) · by`.
    pub fn affine(&mut self, add: impl Fn(f64) -> f64, by: f64) {
        for (v, t) in self.value.iter_mut().zip(&self.time_s) {
            *v = (*v + add(*t)) * by;
        }
        self.rows.scale(by);
    }

    /// Each value through a function that returns value and derivative.
    pub fn map(&mut self, f: impl Fn(f64) -> (f64, f64)) {
        let (value, derivative): (Vec<f64>, Vec<f64>) = self.value.iter().map(|v| f(*v)).unzip();
        self.value = value;
        self.rows.scale_each(&derivative);
    }

    /// `S₀ F(v) + τ S₁ G(v)`, where `F` and `G` are the identity unless given.
    pub fn factor(&mut self, tau_s: &Along, value: Option<&Pointwise>, slope: Option<&Pointwise>) {
        let count = self.after_factor();
        let length = self.length();
        let times = self.times_after_factor();
        let even = self.period_s.map(|t| ([1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], [-0.5 / t, 0.0, 0.5 / t]));
        // Weights of F and of G in value k.
        let weights = |k: usize, j: usize| {
            if let Some((mean, difference)) = even {
                return (mean[j], difference[j]);
            }
            let step_s = self.time_s[k + 1] - self.time_s[k];
            (0.5, if j == 0 { -1.0 / step_s } else { 1.0 / step_s })
        };
        let taps = if let (Along::Same(tau), None, None, Some((mean, difference))) = (tau_s, value, slope, even) {
            Taps::Same((0..3).map(|j| mean[j] + tau * difference[j]).collect())
        } else {
            let mut data = Vec::with_capacity(count * length);
            for k in 0..count {
                let tau = tau_s.at(k);
                for j in 0..length {
                    let (mean, difference) = weights(k, j);
                    let df = value.map_or(1.0, |f| f.derivative[k + j]);
                    let dg = slope.map_or(1.0, |g| g.derivative[k + j]);
                    data.push(mean * df + tau * difference * dg);
                }
            }
            Taps::Each { length, data }
        };
        let new = if value.is_none() && slope.is_none() {
            (0..count).map(|k| (0..length).map(|j| taps.at(k, j) * self.value[k + j]).sum()).collect()
        } else {
            let (f, g) = (value.map_or(&self.value, |f| &f.value), slope.map_or(&self.value, |g| &g.value));
            (0..count)
                .map(|k| {
                    let tau = tau_s.at(k);
                    (0..length)
                        .map(|j| {
                            let (mean, difference) = weights(k, j);
                            mean * f[k + j] + tau * difference * g[k + j]
                        })
                        .sum()
                })
                .collect()
        };
        self.rows = self.rows.combine(count, length, &taps);
        (self.value, self.time_s) = (new, times);
    }

    /// `S₀` at instants later by `delay_s`, within `reach` samples either way, which are cut off at both ends: the spline's own
    /// values between the samples. On uneven samples other cubics stand in, and the reach is three.
    pub fn advance(&mut self, delay_s: f64, reach: usize) {
        let Some(period_s) = self.period_s else { return self.advance_uneven(delay_s) };
        let shift = delay_s / period_s;
        let whole = shift.floor().clamp(-(reach as f64), reach as f64 - 1.0);
        let d = shift - whole;
        // The cubic B-spline at the four samples around, and nothing at the fifth.
        let c = 1.0 - d;
        let taps = vec![
            c * c * c / 6.0,
            (4.0 - 6.0 * d * d + 3.0 * d * d * d) / 6.0,
            (4.0 - 6.0 * c * c + 3.0 * c * c * c) / 6.0,
            d * d * d / 6.0,
        ];
        // Value k is of sample k + reach + 1; its first tap is one sample before that.
        let first = (reach as f64 + whole) as usize;
        let count = self.len() - 2 * reach - 3;
        let new = (0..count).map(|k| (0..4).map(|j| taps[j] * self.value[first + k + j]).sum()).collect();
        let mut rows = Self::skip(&self.rows, first);
        rows = rows.combine(count, 4, &Taps::Same(taps));
        rows.start = self.rows.start + first;
        self.rows = rows;
        self.value = new;
        self.time_s = self.time_s[reach + 1..reach + 1 + count].to_vec();
    }

    /// The values in the middle of each interval, later by `delay_s`: on cubics with the slopes of Catmull and Rom between the
    /// samples, so that they change smoothly with the delay.
    fn advance_uneven(&mut self, delay_s: f64) {
        let reach = UNEVEN_REACH;
        let length = 2 * reach + 4;
        let count = self.len() - length + 1;
        let middle = |k: usize| 0.5 * (self.time_s[k + reach + 1] + self.time_s[k + reach + 2]);
        let mut data = vec![0.0; count * length];
        for (k, taps) in data.chunks_exact_mut(length).enumerate() {
            let window = &self.time_s[k..k + length];
            let at = middle(k) + delay_s;
            let j = window.partition_point(|t| *t <= at).clamp(2, length - 2) - 1;
            let step_s = window[j + 1] - window[j];
            let u = ((at - window[j]) / step_s).clamp(0.0, 1.0);
            taps[j] += (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u);
            taps[j + 1] += (3.0 - 2.0 * u) * u * u;
            // The slope at a sample is that from the one before it to the one after it.
            for (i, weight) in [(j, u * (1.0 - u) * (1.0 - u)), (j + 1, -u * u * (1.0 - u))] {
                let per_k = weight * step_s / (window[i + 1] - window[i - 1]);
                taps[i + 1] += per_k;
                taps[i - 1] -= per_k;
            }
        }
        let times = (0..count).map(middle).collect();
        let new = data
            .chunks_exact(length)
            .enumerate()
            .map(|(k, taps)| taps.iter().zip(&self.value[k..]).map(|(t, v)| t * v).sum())
            .collect();
        self.rows = self.rows.combine(count, length, &Taps::Each { length, data });
        (self.value, self.time_s) = (new, times);
    }

    /// `v[k+1] − ρ v[k]`.
    pub fn difference(&mut self, rho: f64) {
        let count = self.len() - 1;
        self.value = self.value.windows(2).map(|v| v[1] - rho * v[0]).collect();
        self.rows = self.rows.combine(count, 2, &Taps::Same(vec![-rho, 1.0]));
        self.time_s.remove(0);
    }

    fn skip(rows: &Rows, first: usize) -> Rows {
        if rows.is_same || first == 0 {
            return rows.clone();
        }
        Rows { data: rows.data[first * rows.width..].to_vec(), ..rows.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(value: impl Fn(f64) -> f64, time_s: Vec<f64>, period_s: Option<f64>) -> Chain {
        let reading: Vec<f64> = time_s.iter().map(|t| value(*t)).collect();
        Chain::of(&Stretch::new(time_s, [reading.clone(), reading]), 0, period_s)
    }

    /// `y = sin ωt` through `1 + τ s` has amplitude `√(1 + ω²τ²)`; the operators smooth by `(2 + cos ωT)/3` and differ from the
    /// derivative by `(ωT)⁴/180`: 1e-7 of the slope at `ωT = 0.06`.
    #[test]
    fn a_factor_inverts_a_lag() {
        let (omega, tau_s) = (0.06, 10.0);
        let times: Vec<f64> = (0..400).map(f64::from).collect();
        let mut got = chain(|t| (omega * t).sin(), times, Some(1.0));
        got.factor(&Along::Same(tau_s), None, None);
        let smooth = (2.0 + omega.cos()) / 3.0;
        for (v, t) in got.value.iter().zip(&got.time_s) {
            let want = smooth * ((omega * t).sin() + omega * tau_s * (omega * t).cos());
            assert!((v - want).abs() < 2e-7, "at {t}: got {v}, want {want}");
        }
    }

    /// A straight line is the same line later, whatever part of a sample that is; on uneven samples as well.
    #[test]
    fn a_line_is_advanced_exactly() {
        let uneven: Vec<f64> = (0..60).map(|k| f64::from(k) + 0.2 * f64::from(k % 3)).collect();
        for (times, period_s) in [((0..60).map(f64::from).collect::<Vec<_>>(), Some(1.0)), (uneven, None)] {
            for delay_s in [-2.4, -1.0, 0.0, 0.3, 1.0, 2.49] {
                let mut got = chain(|t| 3.0 - 0.5 * t, times.clone(), period_s);
                got.advance(delay_s, 4);
                for (v, t) in got.value.iter().zip(&got.time_s) {
                    let want = 3.0 - 0.5 * (t + delay_s);
                    assert!((v - want).abs() < 1e-12, "{period_s:?}, {delay_s} at {t}: got {v}, want {want}");
                }
            }
        }
    }

    /// Rows are the derivatives of the values: moving one reading moves the values by them.
    #[test]
    fn rows_are_derivatives() {
        let times: Vec<f64> = (0..30).map(f64::from).collect();
        let value = |t: f64| (0.4 * t).sin() + 0.1 * t;
        let through = |moved: Option<usize>| {
            let mut chain = chain(value, times.clone(), Some(1.0));
            if let Some(k) = moved {
                chain.value[k] += 1e-6;
            }
            chain.map(|v| (v + 0.05 * v * v, 1.0 + 0.1 * v));
            chain.factor(&Along::Each((0..28).map(|k| 2.0 + 0.1 * f64::from(k)).collect()), None, None);
            chain.advance(0.3, 2);
            chain
        };
        let (still, moved) = (through(None), through(Some(14)));
        for k in 0..still.len() {
            let row = still.rows.at(k);
            let want = 14usize.checked_sub(still.rows.start + k).and_then(|j| row.get(j)).copied().unwrap_or(0.0);
            let got = (moved.value[k] - still.value[k]) / 1e-6;
            // Second derivatives of size one times the step.
            assert!((got - want).abs() < 1e-5, "value {k}: got {got}, want {want}");
        }
    }
}
