//! The whitened cost by Cholesky factorisation of the banded noise covariance: exact for any
//! spacing of the samples.
//!
//! Noise of `u` is a moving average, `V[k,m] = Σ_i s_i² Σ_j c_i,k[j] c_i,m[j + k − m]`. With
//! `V = L Lᵀ` the residual `r = L⁻¹ u` is white at the true parameters. Factor and residual are
//! built in one sweep that keeps `q` rows, and exact derivatives ride along as dual numbers:
//! `O(N q²)`. With even steps the factor settles, geometrically and to the last digit, as the start
//! of the record is forgotten; from there on a row costs what its residual does.

use num_dual::{DualNum, DualSVec64};

use crate::inverse::{Row, row};
use crate::noise_model::HoldAndNoise;
use crate::parameters::{Pair, parts};
use crate::polynomial::MAX_COEFFICIENTS;
use crate::readings::{Segment, Steps};
use crate::spectral::Sloped;

/// Relative difference that rounding makes.
const SETTLED_RELATIVE: f64 = 4.0 * f64::EPSILON;
/// Rows that must agree with the one before before the factor counts as settled.
const SETTLED_ROWS: usize = MAX_COEFFICIENTS;
/// Coefficients of a row in white noise at most, whatever the hold: of first-order lags, and of those with second ones.
const SHORT: usize = 3;
const MIDDLE: usize = 5;

/// Calls `visit` with each whitened residual of `segment` and its derivatives by the first `Q` parameters, in order of time.
pub(crate) fn sweep<const P: usize, const Q: usize>(
    segment: &Segment,
    model: &HoldAndNoise,
    pair: &Pair<DualSVec64<P>>,
    visit: impl FnMut(f64, &[f64; Q]),
) {
    const { assert!(Q <= P, "no more derivatives than parameters") };
    let first_step_s = match segment.steps() {
        Steps::Even(step_s) => *step_s,
        Steps::Uneven(steps) => steps[0],
    };
    let first = row(model, pair, first_step_s);
    let longest = first.data.iter().chain(&first.noise).map(|c| c.as_slice().len()).max();
    // Most rows are short, and what is kept of them is moved from row to row.
    match longest {
        Some(0..=SHORT) => sweep_rows::<P, Q, SHORT>(segment, model, pair, first, visit),
        Some(0..=MIDDLE) => sweep_rows::<P, Q, MIDDLE>(segment, model, pair, first, visit),
        _ => sweep_rows::<P, Q, MAX_COEFFICIENTS>(segment, model, pair, first, visit),
    }
}

/// [`sweep`] of rows that have `N` coefficients at most.
fn sweep_rows<const P: usize, const Q: usize, const N: usize>(
    segment: &Segment,
    model: &HoldAndNoise,
    pair: &Pair<DualSVec64<P>>,
    first: Row<DualSVec64<P>>,
    mut visit: impl FnMut(f64, &[f64; Q]),
) {
    type Dual<const P: usize> = DualSVec64<P>;
    let variance = model.white_variance();
    let (y1, y2) = (segment.y1(), segment.y2());
    let zero = Dual::<P>::from_re(0.0);
    let width = first.data[0].as_slice().len();
    let band = first.noise.iter().map(|c| c.as_slice().len()).max().expect("two channels") - 1;

    // Covariance of u[k] with u[k − lag].
    let covariance = |now: &Row<Dual<P>>, then: &Row<Dual<P>>, lag: usize| -> Dual<P> {
        let mut sum = zero;
        for i in 0..2 {
            let (now, then) = (now.noise[i].as_slice(), then.noise[i].as_slice());
            for (a, b) in now.iter().zip(then.iter().skip(lag)) {
                sum += *a * *b * variance[i];
            }
        }
        sum
    };
    let is_even = matches!(segment.steps(), Steps::Even(_));
    let fixed = std::array::from_fn::<_, N, _>(|lag| covariance(&first, &first, lag));

    // The last `band` rows, newest first: filter, factor (lags 0..=band) and residual.
    let mut rows = [first; 2];
    let mut factors = [[zero; N]; N];
    let mut residuals = [zero; N];
    let mut agreeing = 0;
    for k in 0..(y1.len() + 1).saturating_sub(width) {
        if let Steps::Uneven(steps) = segment.steps() {
            // One-step inverses alone take uneven steps, and these look one row back.
            rows.swap(0, 1);
            rows[0] = row(model, pair, steps[k]);
        }
        if agreeing >= SETTLED_ROWS {
            let settled = Settled::new([0, 1].map(|i| rows[0].data[i].as_slice()), &factors[0][..=band], pair.offset);
            let none = (0.0, [0.0; Q]);
            let before: [Sloped<Q>; MAX_COEFFICIENTS] =
                std::array::from_fn(|i| residuals.get(i).map_or(none, |r| sloped(*r)));
            match (width, band) {
                (2, 1) => settled.sweep::<2, 1>([&y1[k..], &y2[k..]], &before, visit),
                (3, 2) => settled.sweep::<3, 2>([&y1[k..], &y2[k..]], &before, visit),
                (5, 4) => settled.sweep::<5, 4>([&y1[k..], &y2[k..]], &before, visit),
                _ => settled.sweep_any(width, band, [&y1[k..], &y2[k..]], before, visit),
            }
            return;
        }
        let [d1, d2] = [0, 1].map(|i| rows[0].data[i].as_slice());
        let mut u = zero;
        for j in 0..width {
            u += d1[j] * y1[k + j] - d2[j] * (-pair.offset + y2[k + j]);
        }

        // Row k of L: entry `lag` multiplies residual k − lag. Oldest first, as each needs the
        // older ones.
        let mut factor = [zero; N];
        let reach = band.min(k);
        for lag in (0..=reach).rev() {
            let mut entry = if is_even { fixed[lag] } else { covariance(&rows[0], &rows[lag], lag) };
            for older in lag + 1..=reach {
                let other = if lag == 0 { factor[older] } else { factors[lag - 1][older - lag] };
                entry -= factor[older] * other;
            }
            factor[lag] = if lag == 0 { entry.sqrt() } else { entry / factors[lag - 1][0] };
        }
        let mut residual = u;
        for lag in 1..=reach {
            residual -= factor[lag] * residuals[lag - 1];
        }
        residual /= factor[0];
        let (r, dr) = sloped(residual);
        visit(r, &dr);

        agreeing = if is_even && k > band && agree(&factor, &factors[0]) { agreeing + 1 } else { 0 };
        factors[..=band].rotate_right(1);
        residuals[..=band].rotate_right(1);
        factors[0] = factor;
        residuals[0] = residual;
    }
}

/// A number with its derivatives by the first `Q` of `P` parameters.
fn sloped<const P: usize, const Q: usize>(x: DualSVec64<P>) -> Sloped<Q> {
    let (value, slopes) = parts(x);
    (value, std::array::from_fn(|i| slopes[i]))
}

/// The rows of even steps once the factor has settled: `r[k] = (u[k] − Σ_i l[i] r[k−i])/l[0]`, each filter divided by `l[0]`.
struct Settled<const Q: usize> {
    /// Of both channels, oldest sample first; that of the second with its sign.
    data: [[Sloped<Q>; MAX_COEFFICIENTS]; 2],
    /// What the offset adds.
    level: Sloped<Q>,
    /// Of the residuals before, newest first.
    back: [Sloped<Q>; MAX_COEFFICIENTS],
}

impl<const Q: usize> Settled<Q> {
    fn new<const P: usize>(data: [&[DualSVec64<P>]; 2], factor: &[DualSVec64<P>], offset: DualSVec64<P>) -> Self {
        let inverse = factor[0].recip();
        let none = (0.0, [0.0; Q]);
        let mut out = Self { data: [[none; MAX_COEFFICIENTS]; 2], level: none, back: [none; MAX_COEFFICIENTS] };
        let mut sum = DualSVec64::from_re(0.0);
        for j in 0..data[0].len() {
            sum += data[1][j];
            out.data[0][j] = sloped(data[0][j] * inverse);
            out.data[1][j] = sloped(-data[1][j] * inverse);
        }
        out.level = sloped(sum * offset * inverse);
        for (back, factor) in out.back.iter_mut().zip(&factor[1..]) {
            *back = sloped(-*factor * inverse);
        }
        out
    }

    /// All residuals of readings `y`, whose filters have `W` coefficients each and whose factor reaches back by `B` residuals.
    ///
    /// - `before`: the last residuals, newest first
    fn sweep<const W: usize, const B: usize>(
        &self,
        y: [&[f64]; 2],
        before: &[Sloped<Q>],
        mut visit: impl FnMut(f64, &[f64; Q]),
    ) {
        let data: [[Sloped<Q>; W]; 2] = [0, 1].map(|i| std::array::from_fn(|j| self.data[i][j]));
        let back: [Sloped<Q>; B] = std::array::from_fn(|i| self.back[i]);
        let mut last: [Sloped<Q>; B] = std::array::from_fn(|i| before[i]);
        let windows = |i: usize| y[i].windows(W).map(|w| <&[f64; W]>::try_from(w).expect("windows of W"));
        for (y1, y2) in windows(0).zip(windows(1)) {
            let (mut r, mut dr) = self.level;
            for j in 0..W {
                r += data[0][j].0 * y1[j] + data[1][j].0 * y2[j];
                for p in 0..Q {
                    dr[p] += data[0][j].1[p] * y1[j] + data[1][j].1[p] * y2[j];
                }
            }
            // What was last counts last: only that has to be waited for.
            for i in (0..B).rev() {
                r += back[i].0 * last[i].0;
                for p in 0..Q {
                    dr[p] += back[i].1[p] * last[i].0 + back[i].0 * last[i].1[p];
                }
            }
            visit(r, &dr);
            last.copy_within(..B - 1, 1);
            last[0] = (r, dr);
        }
    }

    /// As [`Self::sweep`], for filters of any length.
    fn sweep_any(
        &self,
        width: usize,
        band: usize,
        y: [&[f64]; 2],
        mut last: [Sloped<Q>; MAX_COEFFICIENTS],
        mut visit: impl FnMut(f64, &[f64; Q]),
    ) {
        for (y1, y2) in y[0].windows(width).zip(y[1].windows(width)) {
            let (mut r, mut dr) = self.level;
            for (data, y) in self.data.iter().zip([y1, y2]) {
                for (c, y) in data.iter().zip(y) {
                    r += c.0 * y;
                    (0..Q).for_each(|p| dr[p] += c.1[p] * y);
                }
            }
            for (c, last) in self.back[..band].iter().zip(&last).rev() {
                r += c.0 * last.0;
                (0..Q).for_each(|p| dr[p] += c.1[p] * last.0 + c.0 * last.1[p]);
            }
            visit(r, &dr);
            last.copy_within(..band, 1);
            last[0] = (r, dr);
        }
    }
}

/// Whether two rows of the factor are the same to rounding, derivatives included.
fn agree<const P: usize, const N: usize>(now: &[DualSVec64<P>; N], before: &[DualSVec64<P>; N]) -> bool {
    let parts = |row: &[DualSVec64<P>; N]| row.map(parts);
    let (now, before) = (parts(now), parts(before));
    let size = now[0].0;
    let slope = |p: usize| now.iter().map(|x| x.1[p].abs()).fold(0.0, f64::max);
    now.iter().zip(&before).all(|(a, b)| {
        (a.0 - b.0).abs() <= SETTLED_RELATIVE * size
            && (0..P).all(|p| (a.1[p] - b.1[p]).abs() <= SETTLED_RELATIVE * slope(p))
    })
}
