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

/// Relative difference that rounding makes.
const SETTLED_RELATIVE: f64 = 4.0 * f64::EPSILON;
/// Rows that must agree with the one before before the factor counts as settled.
const SETTLED_ROWS: usize = MAX_COEFFICIENTS;

/// Calls `visit` with each whitened residual of `segment`, in order of time.
pub(crate) fn sweep<const P: usize>(
    segment: &Segment,
    model: &HoldAndNoise,
    pair: &Pair<DualSVec64<P>>,
    mut visit: impl FnMut(DualSVec64<P>),
) {
    type Dual<const P: usize> = DualSVec64<P>;
    let variance = model.white_variance();
    let (y1, y2) = (segment.y1(), segment.y2());
    let zero = Dual::<P>::from_re(0.0);
    let first_step_s = match segment.steps() {
        Steps::Even(step_s) => *step_s,
        Steps::Uneven(steps) => steps[0],
    };
    let first = row(model, pair, first_step_s);
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
    let fixed = std::array::from_fn::<_, MAX_COEFFICIENTS, _>(|lag| covariance(&first, &first, lag));

    // The last `band` rows, newest first: filter, factor (lags 0..=band) and residual.
    let mut rows = [first; 2];
    let mut factors = [[zero; MAX_COEFFICIENTS]; MAX_COEFFICIENTS];
    let mut residuals = [zero; MAX_COEFFICIENTS];
    let mut agreeing = 0;
    for k in 0..(y1.len() + 1).saturating_sub(width) {
        if let Steps::Uneven(steps) = segment.steps() {
            // One-step inverses alone take uneven steps, and these look one row back.
            rows.swap(0, 1);
            rows[0] = row(model, pair, steps[k]);
        }
        let [d1, d2] = [0, 1].map(|i| rows[0].data[i].as_slice());
        let mut u = zero;
        for j in 0..width {
            u += d1[j] * y1[k + j] - d2[j] * (-pair.offset + y2[k + j]);
        }

        if agreeing >= SETTLED_ROWS {
            let mut residual = u;
            for lag in 1..=band {
                residual -= factors[0][lag] * residuals[lag - 1];
            }
            residual /= factors[0][0];
            visit(residual);
            residuals[..=band].rotate_right(1);
            residuals[0] = residual;
            continue;
        }

        // Row k of L: entry `lag` multiplies residual k − lag. Oldest first, as each needs the
        // older ones.
        let mut factor = [zero; MAX_COEFFICIENTS];
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
        visit(residual);

        agreeing = if is_even && k > band && agree(&factor, &factors[0]) { agreeing + 1 } else { 0 };
        factors[..=band].rotate_right(1);
        residuals[..=band].rotate_right(1);
        factors[0] = factor;
        residuals[0] = residual;
    }
}

/// Whether two rows of the factor are the same to rounding, derivatives included.
fn agree<const P: usize>(now: &[DualSVec64<P>; MAX_COEFFICIENTS], before: &[DualSVec64<P>; MAX_COEFFICIENTS]) -> bool {
    let parts = |row: &[DualSVec64<P>; MAX_COEFFICIENTS]| row.map(parts);
    let (now, before) = (parts(now), parts(before));
    let size = now[0].0;
    let slope = |p: usize| now.iter().map(|x| x.1[p].abs()).fold(0.0, f64::max);
    now.iter().zip(&before).all(|(a, b)| {
        (a.0 - b.0).abs() <= SETTLED_RELATIVE * size
            && (0..P).all(|p| (a.1[p] - b.1[p]).abs() <= SETTLED_RELATIVE * slope(p))
    })
}
