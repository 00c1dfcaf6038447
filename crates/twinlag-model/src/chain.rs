//! From readings to inferred gas temperature, one first-order factor after the other, with the noise carried along.
//!
//! A sensor `(1 + τ₁ s)(1 + τ₂ s) … y = x` is inverted factor by factor. On evenly spaced samples both operators of a
//! factor are those of the cubic spline through the samples,
//!
//! `S₀ = (z + 4 + z⁻¹)/6`, `S₁ = (z − z⁻¹)/(2 Ts)`, so that `S₁/S₀ = s (1 − (ω Ts)⁴/180 + …)`:
//!
//! a factor gives `S₀ v + τ S₁ v = S₀ (v + τ v')`. `S₀` cannot be taken off (its inverse is not local), so both
//! sensors' chains get the same number of factors and are compared with all their `S₀` on. On uneven samples, steps
//! `h` before and `h'` after each, the spline's own condition that its slope changes smoothly gives both operators:
//!
//! `S₀ = (h' z⁻¹ + 2 (h + h') + h z)/(3 (h + h'))`, `S₁ = (h' d + h d')/(h + h')`, `d` and `d'` the slopes of the steps.
//!
//! Every value is a local function of a few readings; its derivatives with respect to them are the [`Rows`] that carry
//! the noise.
//!
//! Chains are computed in plain numbers or in numbers with a derivative ([`crate::Number`]), and keep their memory
//! from one evaluation to the next.

use crate::number::{Curve, Real};
use crate::observations::Stretch;
use crate::rows::Rows;

/// How many samples a delay may reach where they are uneven.
pub(crate) const UNEVEN_REACH: usize = 3;

/// Taps of a factor: a sample and its neighbours.
const FACTOR_TAPS: usize = 3;

/// Taps of the spline that a delay needs.
pub(crate) const DELAY_TAPS: usize = 4;

/// Samples that a delay needs where they are uneven: four splines about an instant, the neighbours of each.
pub(crate) const UNEVEN_DELAY_TAPS: usize = 5;

/// A number that may change along the record.
#[derive(Clone, Copy)]
pub(crate) enum Along<'a, T> {
    Same(T),
    /// One for each value that the factor gives.
    Each(&'a [T]),
}

impl<T: Real> Along<'_, T> {
    fn at(&self, k: usize) -> T {
        match self {
            Self::Same(x) => *x,
            Self::Each(all) => all[k],
        }
    }
}

/// What a factor does beside its time constant: `S₀ F(v) + τ S₁ G(v)`.
#[derive(Clone, Copy, Default)]
pub(crate) struct Curves<'a> {
    /// `F`, the identity if there is none.
    pub(crate) value: Option<&'a Curve>,
    /// `G`, the identity if there is none.
    pub(crate) slope: Option<&'a Curve>,
}

/// Values on their own instants, and how they depend on the readings of one channel.
#[derive(Clone, Debug)]
pub(crate) struct Chain<T> {
    /// Instants, s; the first `skipped` of them belong to no value any more.
    time_s: Vec<f64>,
    skipped: usize,
    pub(crate) value: Vec<T>,
    pub(crate) rows: Rows<T>,
    period_s: Option<f64>,
    memory: Memory<T>,
}

/// Memory that a factor works in.
#[derive(Clone, Debug)]
struct Memory<T> {
    /// Values of `F` and of `G`, each with its slope.
    curves: [Vec<(T, T)>; 2],
    taps: Vec<T>,
}

impl<T: Real> Chain<T> {
    pub(crate) fn empty() -> Self {
        Self {
            time_s: Vec::new(),
            skipped: 0,
            value: Vec::new(),
            rows: Rows::identity(),
            period_s: None,
            memory: Memory { curves: [Vec::new(), Vec::new()], taps: Vec::new() },
        }
    }

    /// Readings of a channel as they are.
    pub(crate) fn of(stretch: &Stretch, channel: usize, period_s: Option<f64>) -> Self {
        let mut out = Self::empty();
        out.begin(stretch, channel, period_s);
        out
    }

    /// Begins again, with the readings of a channel as they are.
    pub(crate) fn begin(&mut self, stretch: &Stretch, channel: usize, period_s: Option<f64>) {
        self.time_s.clear();
        self.time_s.extend_from_slice(&stretch.time_s);
        self.skipped = 0;
        self.value.clear();
        self.value.extend(stretch.reading_c[channel].iter().map(|y| T::from(*y)));
        self.rows.begin();
        self.period_s = period_s;
    }

    pub(crate) fn len(&self) -> usize {
        self.value.len()
    }

    /// Instants of the values, s.
    pub(crate) fn times_s(&self) -> &[f64] {
        &self.time_s[self.skipped..self.skipped + self.len()]
    }

    /// Values after another factor.
    pub(crate) fn after_factor(&self) -> usize {
        self.len() + 1 - FACTOR_TAPS
    }

    /// The instant of value `k` after another factor, s.
    pub(crate) fn time_after_factor_s(&self, k: usize) -> f64 {
        self.times_s()[k + 1]
    }

    /// Adds to every value what depends on time alone.
    pub(crate) fn add(&mut self, what: impl Fn(f64) -> T) {
        let times_s = &self.time_s[self.skipped..];
        for (v, t) in self.value.iter_mut().zip(times_s) {
            *v += what(*t);
        }
    }

    /// Multiplies every value.
    pub(crate) fn scale(&mut self, by: T) {
        self.value.iter_mut().for_each(|v| *v *= by);
        self.rows.scale(by);
    }

    /// Takes each value through a curve.
    pub(crate) fn map(&mut self, curve: &Curve) {
        let slopes = &mut self.memory.taps;
        slopes.clear();
        for v in &mut self.value {
            let (value, slope) = through(curve, *v);
            *v = value;
            slopes.push(slope);
        }
        self.rows.scale_each(slopes);
    }

    /// `S₀ F(v) + τ S₁ G(v)`.
    pub(crate) fn factor(&mut self, tau_s: Along<'_, T>, curves: Curves<'_>) {
        let count = self.after_factor();
        if let (Along::Same(tau), None, None, Some(period_s)) = (tau_s, curves.value, curves.slope, self.period_s) {
            let (mean, difference) = even_operators(period_s);
            let taps = [0, 1, 2].map(|j| T::from(mean[j]) + tau * difference[j]);
            for k in 0..count {
                let v = &mut self.value[k..k + FACTOR_TAPS];
                v[0] = taps[0] * v[0] + taps[1] * v[1] + taps[2] * v[2];
            }
            self.rows.combine_same(&taps);
        } else {
            self.factor_each(count, tau_s, curves);
        }
        self.value.truncate(count);
        self.skipped += 1;
    }

    /// A factor whose weights change from value to value.
    fn factor_each(&mut self, count: usize, tau_s: Along<'_, T>, curves: Curves<'_>) {
        let Memory { curves: [of_f, of_g], taps } = &mut self.memory;
        for (out, curve) in [(&mut *of_f, curves.value), (&mut *of_g, curves.slope)] {
            out.clear();
            if let Some(curve) = curve {
                out.extend(self.value.iter().map(|v| through(curve, *v)));
            }
        }
        taps.clear();
        let even = self.period_s.map(even_operators);
        for k in 0..count {
            let tau = tau_s.at(k);
            // Weights of F and of G in value k.
            let (mean, difference) = even.unwrap_or_else(|| {
                let times_s = &self.time_s[self.skipped + k..];
                operators(times_s[1] - times_s[0], times_s[2] - times_s[1])
            });
            let mut sum = T::from(0.0);
            for j in 0..FACTOR_TAPS {
                let plain = (self.value[k + j], T::from(1.0));
                let (f, df) = of_f.get(k + j).copied().unwrap_or(plain);
                let (g, dg) = of_g.get(k + j).copied().unwrap_or(plain);
                sum += f * mean[j] + tau * g * difference[j];
                taps.push(df * mean[j] + tau * dg * difference[j]);
            }
            // Later values need those from the next one on.
            self.value[k] = sum;
        }
        self.rows.combine_each(count, FACTOR_TAPS, taps);
    }

    /// `S₀` at instants later by `delay_s`, within `reach` samples either way, which are cut off at both ends: the
    /// spline's own values between the samples. On uneven samples the reach is three.
    pub(crate) fn advance(&mut self, delay_s: T, reach: usize) {
        let Some(period_s) = self.period_s else { return self.advance_uneven(delay_s) };
        let shift = delay_s / period_s;
        let whole = shift.value().floor().clamp(-(reach as f64), reach as f64 - 1.0);
        let d = shift - whole;
        // The cubic B-spline at the four samples around, and nothing at the fifth.
        let taps = crate::spline::weights(d);
        // Value k is of sample k + reach + 1; its first tap is one sample before that.
        let first = (reach as f64 + whole) as usize;
        let count = self.len() - 2 * reach - DELAY_TAPS + 1;
        for k in 0..count {
            let mut sum = T::from(0.0);
            for (tap, v) in taps.iter().zip(&self.value[first + k..]) {
                sum += *tap * *v;
            }
            self.value[k] = sum;
        }
        self.value.truncate(count);
        self.rows.skip(first);
        self.rows.combine_values(count, &taps);
        self.skipped += reach + 1;
    }

    /// `S₀` on uneven samples, later by `delay_s`: the cubic B-splines on the samples as knots, which smooth alike wherever between
    /// the samples an instant lies. Their coefficients are the values at the means of three knots (Schoenberg), which lie beside the
    /// samples and are taken there along the slope, so that a straight line stays one.
    fn advance_uneven(&mut self, delay_s: T) {
        let reach = UNEVEN_REACH;
        let span = 2 * reach + UNEVEN_DELAY_TAPS;
        let middle = reach + 2;
        let count = self.len() + 1 - span;
        let times_s = &self.time_s[self.skipped..];
        // The interval that an instant lies in, counted from sample k.
        let interval = |k: usize| {
            let at_s = times_s[k + middle] + delay_s.value();
            times_s[k..k + span].partition_point(|t| *t <= at_s).clamp(3, span - 3) - 1
        };
        let [low, high] = (0..count).map(interval).fold([span, 0], |[low, high], j| [low.min(j), high.max(j)]);
        // Samples that any of them reaches: six, and as many more as the intervals differ.
        let (first, length) = (low - 2, high - low + 6);
        let taps = &mut self.memory.taps;
        taps.clear();
        taps.resize(count * length, T::from(0.0));
        for (k, taps) in taps.chunks_exact_mut(length).enumerate() {
            let j = interval(k) - first;
            let window = &times_s[k + first..k + first + length];
            let mut at = delay_s + times_s[k + middle];
            if at.value() < window[j] || at.value() > window[j + 1] {
                at = T::from(at.value().clamp(window[j], window[j + 1]));
            }
            for (c, weight) in (j - 1..).zip(b_splines(at, &window[j - 2..j + 4])) {
                let (before_s, after_s) = (window[c] - window[c - 1], window[c + 1] - window[c]);
                let (_, slope) = operators(before_s, after_s);
                taps[c] += weight;
                for (tap, per_s) in taps[c - 1..].iter_mut().zip(slope) {
                    *tap += weight * (per_s * (after_s - before_s) / 3.0);
                }
            }
        }
        for (k, taps) in taps.chunks_exact(length).enumerate() {
            let mut sum = T::from(0.0);
            for (tap, v) in taps.iter().zip(&self.value[k + first..]) {
                sum += *tap * *v;
            }
            self.value[k] = sum;
        }
        self.skipped += middle;
        self.value.truncate(count);
        self.rows.skip(first);
        self.rows.combine_each(count, length, taps);
    }

    /// `v[k+1] − ρ v[k]`.
    pub(crate) fn difference(&mut self, rho: f64) {
        let count = self.len() - 1;
        for k in 0..count {
            self.value[k] = self.value[k + 1] - self.value[k] * rho;
        }
        self.value.truncate(count);
        self.rows.difference(rho, count);
        self.skipped += 1;
    }
}

/// `S₀` and `S₁` at a sample `before_s` after one and `after_s` before the other of its neighbours.
fn operators(before_s: f64, after_s: f64) -> ([f64; FACTOR_TAPS], [f64; FACTOR_TAPS]) {
    let both_s = before_s + after_s;
    let (first, last) = (after_s / (before_s * both_s), before_s / (after_s * both_s));
    ([after_s / (3.0 * both_s), 2.0 / 3.0, before_s / (3.0 * both_s)], [-first, first - last, last])
}

/// `S₀` and `S₁` on even samples.
fn even_operators(period_s: f64) -> ([f64; FACTOR_TAPS], [f64; FACTOR_TAPS]) {
    ([1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], [-0.5 / period_s, 0.0, 0.5 / period_s])
}

/// The four cubic B-splines that reach the instant `at_s` between the third and the fourth of six knots (de Boor and Cox).
fn b_splines<T: Real>(at_s: T, knots_s: &[f64]) -> [T; 4] {
    let mut out = [T::from(1.0), T::from(0.0), T::from(0.0), T::from(0.0)];
    for degree in 1..4 {
        let mut carried = T::from(0.0);
        for (i, spline) in out.iter_mut().enumerate().take(degree) {
            let (from_s, to_s) = (knots_s[3 + i - degree], knots_s[3 + i]);
            let share = *spline * (1.0 / (to_s - from_s));
            *spline = carried + (T::from(to_s) - at_s) * share;
            carried = (at_s - from_s) * share;
        }
        out[degree] = carried;
    }
    out
}

fn through<T: Real>(curve: &Curve, v: T) -> (T, T) {
    let (value, slope) = curve(v.number());
    (T::of(value), T::of(slope))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn chain(value: impl Fn(f64) -> f64, time_s: Vec<f64>, period_s: Option<f64>) -> Chain<f64> {
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
        got.factor(Along::Same(tau_s), Curves::default());
        let smooth = (2.0 + omega.cos()) / 3.0;
        for (v, t) in got.value.iter().zip(got.times_s()) {
            let want = smooth * ((omega * t).sin() + omega * tau_s * (omega * t).cos());
            assert!((v - want).abs() < 2e-7, "at {t}: got {v}, want {want}");
        }
    }

    /// A cubic is a spline on any samples, so its slope is the one that `S₁` takes for it: `S₀ v + τ S₁ v = S₀ (v + τ v')`. Values of
    /// some 4e5 at most lose 1e-16 of themselves in each of ten operations, and `S₁` divides by half a step: 2e-9 with all of one
    /// sign.
    #[test]
    fn a_factor_is_exact_for_cubics_on_uneven_samples() {
        let times: Vec<f64> = (0..60).map(|k| f64::from(k) + 0.3 * f64::from(k % 3)).collect();
        let (value, slope) = (|t: f64| t * (t * (2.0 * t - 5.0) + 7.0), |t: f64| t * (6.0 * t - 10.0) + 7.0);
        let tau_s = 1.7;
        let mut got = chain(value, times.clone(), None);
        got.factor(Along::Same(tau_s), Curves::default());
        let mut want = chain(|t| value(t) + tau_s * slope(t), times.clone(), None);
        want.factor(Along::Same(0.0), Curves::default());
        assert_eq!(got.times_s(), &times[1..59]);
        for ((got, want), t) in got.value.iter().zip(&want.value).zip(&times[1..]) {
            assert!((got - want).abs() < 2e-9, "at {t}: got {got}, want {want}");
        }
        // And S₀ takes a line to itself.
        let mut line = chain(|t| 3.0 - 0.5 * t, times, None);
        line.factor(Along::Same(0.0), Curves::default());
        for (got, t) in line.value.iter().zip(line.times_s()) {
            assert!((got - (3.0 - 0.5 * t)).abs() < 1e-13, "at {t}: got {got}");
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
                for (v, t) in got.value.iter().zip(got.times_s()) {
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
            let bent: Curve = Arc::new(|v| (v + v * v * 0.05, v * 0.1 + 1.0));
            chain.map(&bent);
            let tau_s: Vec<f64> = (0..28).map(|k| 2.0 + 0.1 * f64::from(k)).collect();
            chain.factor(Along::Each(&tau_s), Curves::default());
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
