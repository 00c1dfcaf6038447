//! The whitened cost by Cholesky factorisation of the banded noise covariance: exact for any spacing of the samples.
//!
//! Noise of `u` is a moving average, `V[k,m] = Σ_i s_i² Σ_j c_i,k[j] c_i,m[j + k − m]`. With `V = L Lᵀ` the residual
//! `r = L⁻¹ u` is white at the true parameters. Factor and residual are built in one sweep that keeps `q` rows, and exact
//! derivatives ride along as dual numbers: `O(N q²)`.

use num_dual::{DualNum, DualSVec64};
use twinlag_sensor::Discretisation;

use crate::inverse::{Row, WIDEST, row, width};
use crate::parameters::Pair;
use crate::readings::{Segment, Steps};

/// Calls `visit` with each whitened residual of `segment`, in order of time.
pub(crate) fn sweep<const P: usize>(
    segment: &Segment,
    hold: Discretisation,
    noise_std: [f64; 2],
    pair: &Pair<DualSVec64<P>>,
    mut visit: impl FnMut(DualSVec64<P>),
) {
    type Dual<const P: usize> = DualSVec64<P>;
    let width = width(hold).expect("checked when the cost was built");
    let band = width - 1;
    let variance = noise_std.map(|s| s * s);
    let (y1, y2) = (segment.y1(), segment.y2());
    let zero = Dual::<P>::from_re(0.0);

    // Covariance of u[k] with u[k − lag].
    let covariance = |now: &Row<Dual<P>>, then: &Row<Dual<P>>, lag: usize| -> Dual<P> {
        let mut sum = zero;
        for j in 0..width - lag {
            sum += now.c1[j] * then.c1[j + lag] * variance[0] + now.c2[j] * then.c2[j + lag] * variance[1];
        }
        sum
    };
    let fixed = match segment.steps() {
        Steps::Even(step_s) => Some(row(hold, pair, *step_s)),
        Steps::Uneven(_) => None,
    };
    let fixed_covariance = fixed
        .map(|r| std::array::from_fn::<_, WIDEST, _>(|lag| if lag < width { covariance(&r, &r, lag) } else { zero }));

    // The last `band` rows, newest first: filter, factor (lags 0..=band) and residual.
    let mut rows: [Option<Row<Dual<P>>>; WIDEST] = [None; WIDEST];
    let mut factors = [[zero; WIDEST]; WIDEST];
    let mut residuals = [zero; WIDEST];
    for k in 0..(y1.len() + 1).saturating_sub(width) {
        let now = match segment.steps() {
            Steps::Even(_) => fixed.expect("even steps share one row"),
            Steps::Uneven(steps) => row(hold, pair, steps[k]),
        };
        let mut u = zero;
        for j in 0..width {
            u += now.c1[j] * y1[k + j] - now.c2[j] * (-pair.offset + y2[k + j]);
        }

        // Row k of L: entry `lag` multiplies residual k − lag. Oldest first, as each needs the older ones.
        let mut factor = [zero; WIDEST];
        let reach = band.min(k);
        for lag in (0..=reach).rev() {
            let mut entry = match (&fixed_covariance, lag) {
                (Some(c), _) => c[lag],
                (None, 0) => covariance(&now, &now, 0),
                (None, _) => covariance(&now, &rows[lag - 1].expect("lag reaches no further back than k"), lag),
            };
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

        rows.rotate_right(1);
        factors.rotate_right(1);
        residuals.rotate_right(1);
        rows[0] = Some(now);
        factors[0] = factor;
        residuals[0] = residual;
    }
}
