//! The difference of the two inferred gas temperatures as one short filter on each channel.
//!
//! A first-order sensor obeys `A_i y_i = B_i x`. Multiplying sensor 1's equation by `B2` and sensor 2's by `B1` removes `x`:
//! `u = B2 A1 y1 − B1 A2 y2'`, `y2' = (y2 − o)/g`. A factor that `B1` and `B2` share (the delay of the zero-order hold, the
//! `1 + z⁻¹` of the bilinear rule) is left off, and both filters are scaled to unit gain at rest, so that `u` is in kelvin of
//! gas temperature: for those two holds it is `f1 − f2` of the theory, `f_i[k] = (y_i[k+1] − a_i y_i[k])/(1 − a_i)`.

use num_dual::DualSVec64;
use twinlag_sensor::Discretisation;

use crate::parameters::Pair;

/// Samples that the widest filter looks at.
pub(crate) const WIDEST: usize = 3;

/// `u[k] = Σ_j c1[j] y1[k+j] − Σ_j c2[j] (y2[k+j] − o)`, the gain of channel 2 inside `c2`. Entries past `width` are zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<D> {
    pub(crate) c1: [D; WIDEST],
    pub(crate) c2: [D; WIDEST],
}

/// How many neighbouring samples of each channel `u[k]` takes; `None` where there is no difference equation.
pub(crate) fn width(hold: Discretisation) -> Option<usize> {
    match hold {
        Discretisation::ZeroOrderHold | Discretisation::Bilinear => Some(2),
        Discretisation::FirstOrderHold => Some(3),
        _ => None,
    }
}

/// The filters for samples `step_s` apart. `hold` must have a difference equation.
pub(crate) fn row<const P: usize>(hold: Discretisation, pair: &Pair<DualSVec64<P>>, step_s: f64) -> Row<DualSVec64<P>> {
    let [s1, s2] = pair.tau_s.map(|tau| hold.first_order(tau, step_s).expect("checked when the cost was built"));
    let zero = DualSVec64::from_re(0.0);
    let filters = if width(hold) == Some(2) {
        [s1, s2].map(|s| [s.denominator[1], s.denominator[0], zero])
    } else {
        [(s1, s2), (s2, s1)].map(|(own, other)| {
            let (a, b) = (own.denominator, other.numerator);
            [a[1] * b[1], a[0] * b[1] + a[1] * b[0], a[0] * b[0]]
        })
    };
    // Each filter is scaled by its own sum: the sums are equal where the numerators are part of them, and the scale of a
    // one-step filter is that of its own sensor alone.
    let [c1, c2] = filters.map(|c| {
        let sum = c[0] + c[1] + c[2];
        c.map(|v| v / sum)
    });
    Row { c1, c2: c2.map(|v| v / pair.gain) }
}
