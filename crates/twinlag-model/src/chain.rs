//! From readings to inferred gas temperature, one first-order factor after the other, with the noise carried along.
//!
//! A sensor `(1 + τ₁ s)(1 + τ₂ s) … y = x` is inverted factor by factor. On evenly spaced samples both operators of a
//! factor are those of the cubic spline through the samples,
//!
//! `S₀ = (z + 4 + z⁻¹)/6`, `S₁ = (z − z⁻¹)/(2 Ts)`, so that `S₁/S₀ = s (1 − (ω Ts)⁴/180 + …)`:
//!
//! a factor gives `S₀ v + τ S₁ v = S₀ (v + τ v')`. `S₀` cannot be taken off (its inverse is not local), so both
//! sensors' chains get the same number of factors and are compared with all their `S₀` on. On uneven samples the
//! operators are the mean and the slope of each interval. Every value is a local function of a few readings; its
//! derivatives with respect to them are the [`Rows`] that carry the noise.
//!
//! Chains are computed in plain numbers or in numbers with a derivative ([`crate::Number`]), and keep their memory
//! from one evaluation to the next.

use crate::number::{Curve, Real};
use crate::observations::Cut;
use crate::rows::Rows;

/// How many samples a delay may reach where they are uneven.
pub(crate) const UNEVEN_REACH: usize = 3;

/// Taps of the spline that a delay needs.
pub(crate) const DELAY_TAPS: usize = 4;

/// A number that may change along the record.
#[derive(Clone, Copy)]
pub(crate) enum Along<'a, T> {
    Same(T),
    /// One for each value that the factor gives.
    Each(&'a [T]),
}

/// How much later a value is, s.
#[derive(Clone, Copy)]
pub(crate) enum Delay<'a, T> {
    Same(T),
    /// That of an instant, with the least and the largest of all.
    Each {
        at: &'a dyn Fn(f64) -> T,
        ends_s: [f64; 2],
    },
}

impl<T: Real> Delay<'_, T> {
    fn at(&self, time_s: f64) -> T {
        match self {
            Self::Same(delay_s) => *delay_s,
            Self::Each { at, .. } => at(time_s),
        }
    }

    fn ends_s(&self) -> [f64; 2] {
        match self {
            Self::Same(delay_s) => [delay_s.value(); 2],
            Self::Each { ends_s, .. } => *ends_s,
        }
    }
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
    /// The interval between samples in which each value lies, later by a delay.
    intervals: Vec<usize>,
}

impl<T: Real> Chain<T> {
    pub(crate) fn empty() -> Self {
        Self {
            time_s: Vec::new(),
            skipped: 0,
            value: Vec::new(),
            rows: Rows::identity(),
            period_s: None,
            memory: Memory { curves: [Vec::new(), Vec::new()], taps: Vec::new(), intervals: Vec::new() },
        }
    }

    /// Readings of a channel as they are.
    pub(crate) fn of(cut: Cut<'_>, channel: usize, period_s: Option<f64>) -> Self {
        let mut out = Self::empty();
        out.begin(cut, channel, period_s);
        out
    }

    /// Begins again, with the readings of a channel as they are.
    pub(crate) fn begin(&mut self, cut: Cut<'_>, channel: usize, period_s: Option<f64>) {
        self.time_s.clear();
        cut.time_s.write(cut.first..cut.first + cut.reading_c[channel].len(), &mut self.time_s);
        self.skipped = 0;
        self.value.clear();
        self.value.extend(cut.reading_c[channel].iter().map(|y| T::from(*y)));
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

    /// Taps of a factor.
    fn length(&self) -> usize {
        if self.period_s.is_some() { 3 } else { 2 }
    }

    /// Values after another factor.
    pub(crate) fn after_factor(&self) -> usize {
        self.len() + 1 - self.length()
    }

    /// The instant of value `k` after another factor, s.
    pub(crate) fn time_after_factor_s(&self, k: usize) -> f64 {
        let times_s = self.times_s();
        if self.period_s.is_some() { times_s[k + 1] } else { 0.5 * (times_s[k] + times_s[k + 1]) }
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
        let (count, length) = (self.after_factor(), self.length());
        let even = self.period_s.map(|t| ([1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], [-0.5 / t, 0.0, 0.5 / t]));
        if let (Along::Same(tau), None, None, Some((mean, difference))) = (tau_s, curves.value, curves.slope, even) {
            let taps = [0, 1, 2].map(|j| T::from(mean[j]) + tau * difference[j]);
            for k in 0..count {
                let v = &mut self.value[k..k + 3];
                v[0] = taps[0] * v[0] + taps[1] * v[1] + taps[2] * v[2];
            }
            self.rows.combine_same(&taps);
        } else {
            self.factor_each(count, length, even, tau_s, curves);
        }
        self.value.truncate(count);
        if self.period_s.is_some() {
            self.skipped += 1;
        } else {
            for k in 0..count {
                self.time_s[k] = 0.5 * (self.time_s[k] + self.time_s[k + 1]);
            }
        }
    }

    /// A factor whose weights change from value to value.
    fn factor_each(
        &mut self,
        count: usize,
        length: usize,
        even: Option<([f64; 3], [f64; 3])>,
        tau_s: Along<'_, T>,
        curves: Curves<'_>,
    ) {
        let Memory { curves: [of_f, of_g], taps, .. } = &mut self.memory;
        for (out, curve) in [(&mut *of_f, curves.value), (&mut *of_g, curves.slope)] {
            out.clear();
            if let Some(curve) = curve {
                out.extend(self.value.iter().map(|v| through(curve, *v)));
            }
        }
        taps.clear();
        for k in 0..count {
            let tau = tau_s.at(k);
            let mut sum = T::from(0.0);
            for j in 0..length {
                // Weights of F and of G in value k.
                let (mean, difference) = if let Some((mean, difference)) = even {
                    (mean[j], difference[j])
                } else {
                    let step_s = self.time_s[k + 1] - self.time_s[k];
                    (0.5, if j == 0 { -1.0 / step_s } else { 1.0 / step_s })
                };
                let plain = (self.value[k + j], T::from(1.0));
                let (f, df) = of_f.get(k + j).copied().unwrap_or(plain);
                let (g, dg) = of_g.get(k + j).copied().unwrap_or(plain);
                sum += f * mean + tau * g * difference;
                taps.push(df * mean + tau * dg * difference);
            }
            // Later values need those from the next one on.
            self.value[k] = sum;
        }
        self.rows.combine_each(count, length, taps);
    }

    /// `S₀` at instants later by a delay, s, within `reach` samples either way, which are cut off at both ends: the spline's own
    /// values between the samples. On uneven samples other cubics stand in, and the reach is three.
    pub(crate) fn advance(&mut self, delay: Delay<'_, T>, reach: usize) {
        let Some(period_s) = self.period_s else { return self.advance_uneven(|time_s| delay.at(time_s)) };
        // A solver may ask for what is no number: then no value is one.
        let finite = |shift: f64| if shift.is_finite() { shift } else { 0.0 };
        let whole = |shift: f64| finite(shift).floor().clamp(-(reach as f64), reach as f64 - 1.0);
        let [low, high] = delay.ends_s().map(|end_s| whole(end_s / period_s));
        // Value k is of sample k + reach + 1; its first tap is one sample before that.
        let first = (reach as f64 + low) as usize;
        let count = self.len() - 2 * reach - DELAY_TAPS + 1;
        let length = DELAY_TAPS + (high - low) as usize;
        let is_one = matches!(delay, Delay::Same(_));
        let mut taps = std::mem::take(&mut self.memory.taps);
        taps.clear();
        taps.resize(if is_one { length } else { count * length }, T::from(0.0));
        for (k, taps) in taps.chunks_exact_mut(length).enumerate() {
            let shift = delay.at(self.times_s()[k + reach + 1]) / period_s;
            let whole = whole(shift.value()).clamp(low, high);
            // The cubic B-spline at the four samples around, and nothing at the fifth.
            let place = (whole - low) as usize;
            taps[place..place + DELAY_TAPS].copy_from_slice(&crate::spline::weights(shift - whole)[..DELAY_TAPS]);
        }
        for k in 0..count {
            let mut sum = T::from(0.0);
            let taps = if is_one { &taps } else { &taps[k * length..(k + 1) * length] };
            for (tap, v) in taps.iter().zip(&self.value[first + k..]) {
                sum += *tap * *v;
            }
            self.value[k] = sum;
        }
        self.value.truncate(count);
        self.rows.skip(first);
        if is_one {
            self.rows.combine_values(count, &taps);
        } else {
            self.rows.combine_each(count, length, &taps);
        }
        self.memory.taps = taps;
        self.skipped += reach + 1;
    }

    /// The values in the middle of each interval, later by a delay: on cubics with the slopes of Catmull and Rom
    /// between the samples, so that they change smoothly with the delay.
    fn advance_uneven(&mut self, delay_s: impl Fn(f64) -> T) {
        let reach = UNEVEN_REACH;
        let span = 2 * reach + DELAY_TAPS;
        let count = self.len() - span + 1;
        let middle_s = |times_s: &[f64], k: usize| 0.5 * (times_s[k + reach + 1] + times_s[k + reach + 2]);
        // The interval that an instant lies in, counted from sample k.
        let interval = |times_s: &[f64], k: usize| {
            let middle_s = middle_s(times_s, k);
            let at_s = middle_s + delay_s(middle_s).value();
            times_s[k..k + span].partition_point(|t| *t <= at_s).clamp(2, span - 2) - 1
        };
        let Memory { taps, intervals, .. } = &mut self.memory;
        intervals.clear();
        intervals.extend((0..count).map(|k| interval(&self.time_s, k)));
        let [low, high] = intervals.iter().fold([span, 0], |[low, high], j| [low.min(*j), high.max(*j)]);
        // Samples that any of them reaches: four, and as many more as the intervals differ.
        let (first, length) = (low - 1, high - low + DELAY_TAPS);
        taps.clear();
        taps.resize(count * length, T::from(0.0));
        for (k, (taps, interval)) in taps.chunks_exact_mut(length).zip(intervals).enumerate() {
            let j = *interval - first;
            let window = &self.time_s[k + first..k + first + length];
            let middle_s = middle_s(&self.time_s, k);
            let at = delay_s(middle_s) + middle_s;
            let step_s = window[j + 1] - window[j];
            let mut u = (at - window[j]) / step_s;
            if u.value() < 0.0 || u.value() > 1.0 {
                u = T::from(u.value().clamp(0.0, 1.0));
            }
            let one = T::from(1.0);
            taps[j] += (one + u * 2.0) * (one - u) * (one - u);
            taps[j + 1] += (T::from(3.0) - u * 2.0) * u * u;
            // The slope at a sample is that from the one before it to the one after it.
            for (i, weight) in [(j, u * (one - u) * (one - u)), (j + 1, -(u * u * (one - u)))] {
                let per_k = weight * (step_s / (window[i + 1] - window[i - 1]));
                taps[i + 1] += per_k;
                taps[i - 1] -= per_k;
            }
        }
        for (k, taps) in taps.chunks_exact(length).enumerate() {
            let mut sum = T::from(0.0);
            for (tap, v) in taps.iter().zip(&self.value[k + first..]) {
                sum += *tap * *v;
            }
            self.value[k] = sum;
        }
        for k in 0..count {
            // Instants before this one are needed no more.
            self.time_s[k] = middle_s(&self.time_s, k);
        }
        self.value.truncate(count);
        self.rows.skip(first);
        self.rows.combine_each(count, length, taps);
    }

    /// `v[k+1] − ρ v[k]`.
    pub(crate) fn difference(&mut self, rho: f64) {
        difference(&mut self.value, rho);
        self.rows.difference(rho, self.value.len());
        self.skipped += 1;
    }
}

/// `v[k+1] − ρ v[k]`, one value less.
pub(crate) fn difference<T: Real>(values: &mut Vec<T>, rho: f64) {
    let count = values.len() - 1;
    for k in 0..count {
        values[k] = values[k + 1] - values[k] * rho;
    }
    values.truncate(count);
}

fn through<T: Real>(curve: &Curve, v: T) -> (T, T) {
    let (value, slope) = curve(v.number());
    (T::of(value), T::of(slope))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::observations::Stretch;

    fn chain(value: impl Fn(f64) -> f64, time_s: Vec<f64>, period_s: Option<f64>) -> Chain<f64> {
        let reading: Vec<f64> = time_s.iter().map(|t| value(*t)).collect();
        Chain::of(Stretch::new(time_s, [reading.clone(), reading]).whole(), 0, period_s)
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

    /// A straight line is the same line later, whatever part of a sample that is; on uneven samples as well.
    #[test]
    fn a_line_is_advanced_exactly() {
        let uneven: Vec<f64> = (0..60).map(|k| f64::from(k) + 0.2 * f64::from(k % 3)).collect();
        for (times, period_s) in [((0..60).map(f64::from).collect::<Vec<_>>(), Some(1.0)), (uneven, None)] {
            for delay_s in [-2.4, -1.0, 0.0, 0.3, 1.0, 2.49] {
                let mut got = chain(|t| 3.0 - 0.5 * t, times.clone(), period_s);
                got.advance(Delay::Same(delay_s), 4);
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
            chain.advance(Delay::Each { at: &|t| 0.3 + 0.02 * t, ends_s: [0.3, 0.9] }, 2);
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
