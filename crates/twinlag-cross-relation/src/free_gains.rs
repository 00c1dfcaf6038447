//! The published cost with both gains free: `G1 = b z⁻¹/(1 − a z⁻¹)`, `G2 = d z⁻¹/(1 − c z⁻¹)`.

use crate::error::CostError;
use crate::parameters::CostValue;
use crate::published::CrossRelation;
use crate::readings::Readings;

/// Mean squared cross-relation error as a function of `[a, b, c, d]`.
///
/// **Only the relative gain is identifiable.** `e` is linear in `(b, d)`: scaling both by `κ`
/// scales the cost by `κ²`, and `b = d = 0` makes it zero. So this function has no isolated
/// minimum; hold one static gain (say `b = 1 − a`) or minimise [`CrossRelation`] over two time
/// constants and the relative gain `g`, which is `d/(1 − c)` over `b/(1 − a)`.
#[derive(Clone, Debug)]
pub struct FreeGains<'a> {
    unity: CrossRelation<'a>,
}

impl<'a> FreeGains<'a> {
    /// The cost on `readings`, the first `discard` samples of every segment left out of the mean.
    ///
    /// # Errors
    /// As [`CrossRelation::new`].
    pub fn new(readings: &'a Readings, discard: usize) -> Result<Self, CostError> {
        Ok(Self { unity: CrossRelation::new(readings, discard)? })
    }

    /// Cost with gradient and exact Hessian at `[a, b, c, d]`, poles in (0, 1), gains positive.
    ///
    /// The filters start at the steady state of their first sample, as with unit gain. With static
    /// gains `β = b/(1 − a)`, `δ = d/(1 − c)` the error is `δ` times the unit-gain error at
    /// relative gain `g = δ/β`; derivatives follow by the chain rule.
    ///
    /// ```
    #[doc = include_str!("example.txt")]
    /// let cost = FreeGains::new(&readings, 100)?;
    /// let (a, c) = (0.92, 0.98);
    /// let unit = cost.evaluate([a, 1.0 - a, c, 1.0 - c]).value;
    /// // Both gains doubled leave the relative gain as it is: four times the cost, so it has no
    /// // minimum of its own.
    /// let doubled = cost.evaluate([a, 2.0 * (1.0 - a), c, 2.0 * (1.0 - c)]).value;
    /// assert!((doubled / unit - 4.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn evaluate(&self, [a, b, c, d]: [f64; 4]) -> CostValue<4> {
        let period_s = self.unity.period_s();
        let delta = d / (1.0 - c);
        let gain = delta * (1.0 - a) / b;
        let inner = self.unity.evaluate(&[-period_s / a.ln(), -period_s / c.ln(), gain, 0.0]);

        // θ(a, b, c, d) = [τ1(a), τ2(c), g(a, b, c, d)]: first and second derivatives.
        let tau = |p: f64| {
            let l = p.ln();
            let first = period_s / (p * l * l);
            (first, -first * (1.0 + 2.0 / l) / p)
        };
        let (da, daa) = tau(a);
        let (dc, dcc) = tau(c);
        let log_gain = [-1.0 / (1.0 - a), -1.0 / b, 1.0 / (1.0 - c), 1.0 / d];
        let log_gain2 = [-1.0 / (1.0 - a).powi(2), 1.0 / (b * b), 1.0 / (1.0 - c).powi(2), -1.0 / (d * d)];
        let jacobian = [[da, 0.0, 0.0, 0.0], [0.0, 0.0, dc, 0.0], log_gain.map(|l| gain * l)];
        let curvature = |theta: usize, i: usize, j: usize| match (theta, i, j) {
            (0, 0, 0) => daa,
            (1, 2, 2) => dcc,
            (2, _, _) => gain * (log_gain[i] * log_gain[j] + if i == j { log_gain2[i] } else { 0.0 }),
            _ => 0.0,
        };
        let inner_gradient: [f64; 4] =
            std::array::from_fn(|i| (0..3).map(|t| inner.gradient[t] * jacobian[t][i]).sum());
        let inner_hessian = |i: usize, j: usize| -> f64 {
            (0..3)
                .map(|t| {
                    inner.gradient[t] * curvature(t, i, j)
                        + (0..3).map(|u| inner.hessian[t][u] * jacobian[t][i] * jacobian[u][j]).sum::<f64>()
                })
                .sum()
        };
        // J = δ² J_unity(θ); δ depends on c and d.
        let scale = delta * delta;
        let log_scale = [0.0, 0.0, 2.0 / (1.0 - c), 2.0 / d];
        let log_scale2 = [0.0, 0.0, 2.0 / (1.0 - c).powi(2), -2.0 / (d * d)];
        CostValue {
            value: scale * inner.value,
            gradient: std::array::from_fn(|i| scale * (log_scale[i] * inner.value + inner_gradient[i])),
            hessian: std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let own = log_scale[i] * log_scale[j] + if i == j { log_scale2[i] } else { 0.0 };
                    scale
                        * (own * inner.value
                            + log_scale[i] * inner_gradient[j]
                            + log_scale[j] * inner_gradient[i]
                            + inner_hessian(i, j))
                })
            }),
        }
    }
}
