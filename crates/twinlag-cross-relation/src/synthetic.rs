//! The synthetic filter: a sensor of first or second order as the cross-relation uses it, with
//! derivatives.
//!
//! `w[k] = n1 y[k−1] + n2 y[k−2] − d1 w[k−1] − d2 w[k−2]`, exact for gas held between samples
//! (zero-order hold). The derivatives of `w` obey the same recursion, fed by what the derivatives
//! of the coefficients make of `y` and `w`: run side by side, they are exact.

use num_dual::Dual2SVec64;
use twinlag_sensor::{Discretisation, FirstOrderCoefficients, SecondOrderCoefficients};

/// Coefficients of the sensor `1/((1 + s τ)(1 + s τ₂))` under the zero-order hold, with their first
/// and second derivatives with respect to `[τ, τ₂]`, from `tau_s`, `second_tau_s` (s) and the
/// sample period (s).
///
/// `second_tau_s = 0` is the sensor of first order, `n2 = d2 = 0`, which does not depend on `τ₂`.
///
/// ```
/// use twinlag_cross_relation::synthetic_filter;
///
/// let filter = synthetic_filter(0.0238, 0.005, 0.002);
/// let sum = |terms: &[num_dual::Dual2SVec64<2>]| terms.iter().map(|t| t.re).sum::<f64>();
/// // Unit gain at rest, whatever the time constants are: rounding only.
/// assert!((sum(&filter.numerator) / sum(&filter.denominator) - 1.0).abs() < 1e-12);
/// // Without a second lag it is the filter of first order, whose pole is e^(−Ts/τ).
/// let first = synthetic_filter(0.0238, 0.0, 0.002);
/// assert!((first.denominator[1].re + (-0.002_f64 / 0.0238).exp()).abs() < 1e-15);
/// assert_eq!((first.numerator[2].re, first.denominator[2].re), (0.0, 0.0));
/// ```
#[expect(clippy::missing_panics_doc, reason = "the zero-order hold has a difference equation")]
pub fn synthetic_filter(tau_s: f64, second_tau_s: f64, period_s: f64) -> SecondOrderCoefficients<Dual2SVec64<2>> {
    let hold = Discretisation::ZeroOrderHold;
    let zero = Dual2SVec64::from_re(0.0);
    let tau = Dual2SVec64::from_re(tau_s).derivative(0);
    if second_tau_s > 0.0 {
        let second = Dual2SVec64::from_re(second_tau_s).derivative(1);
        hold.second_order(tau, second, period_s).expect("the zero-order hold has a difference equation")
    } else {
        let FirstOrderCoefficients { numerator: [b0, b1], denominator: [one, d1] } =
            hold.first_order(tau, period_s).expect("the zero-order hold has a difference equation");
        SecondOrderCoefficients { numerator: [b0, b1, zero], denominator: [one, d1, zero] }
    }
}

/// A value with its derivatives: `[x, ∂τ, ∂τ₂, ∂τ∂τ, ∂τ∂τ₂, ∂τ₂∂τ₂]`.
pub(crate) type Jet = [f64; 6];

fn jet(x: &Dual2SVec64<2>) -> Jet {
    let first = x.v1.unwrap_generic(nalgebra::U1, nalgebra::Const::<2>);
    let second = x.v2.unwrap_generic(nalgebra::Const::<2>, nalgebra::Const::<2>);
    [x.re, first[0], first[1], second[(0, 0)], second[(0, 1)], second[(1, 1)]]
}

/// The coefficients as plain numbers, for the two samples before.
pub(crate) struct Coefficients {
    feed: [Jet; 2],
    back: [Jet; 2],
}

impl Coefficients {
    pub(crate) fn of(tau_s: f64, second_tau_s: f64, period_s: f64) -> Self {
        let SecondOrderCoefficients { numerator: [_, n1, n2], denominator: [_, d1, d2] } =
            synthetic_filter(tau_s, second_tau_s, period_s);
        Self { feed: [jet(&n1), jet(&n2)], back: [jet(&d1), jet(&d2)] }
    }
}

/// The filter under way: the outputs `w[k]`, `w[k−1]` and the input `y[k−1]`.
pub(crate) struct Running {
    pub(crate) now: Jet,
    before: Jet,
    input: f64,
}

impl Running {
    pub(crate) fn at_rest(y: f64) -> Self {
        let rest = [y, 0.0, 0.0, 0.0, 0.0, 0.0];
        Self { now: rest, before: rest, input: y }
    }

    /// From sample `k` to `k + 1`, with `y` the input at `k`.
    pub(crate) fn step(&mut self, with: &Coefficients, y: f64) {
        let mut next = [0.0; 6];
        for i in 0..6 {
            next[i] = with.feed[0][i] * y + with.feed[1][i] * self.input;
        }
        for (d, w) in with.back.iter().zip([&self.now, &self.before]) {
            next[0] -= d[0] * w[0];
            next[1] -= d[1] * w[0] + d[0] * w[1];
            next[2] -= d[2] * w[0] + d[0] * w[2];
            next[3] -= d[3] * w[0] + 2.0 * d[1] * w[1] + d[0] * w[3];
            next[4] -= d[4] * w[0] + d[1] * w[2] + d[2] * w[1] + d[0] * w[4];
            next[5] -= d[5] * w[0] + 2.0 * d[2] * w[2] + d[0] * w[5];
        }
        self.before = std::mem::replace(&mut self.now, next);
        self.input = y;
    }
}
