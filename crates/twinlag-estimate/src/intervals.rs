//! 95 % intervals of the whitened estimate.
//!
//! Quadratic in `ln τ`, unless the cost's own profile disagrees: where at either end the profile
//! has not risen by what the quadratic form says, within a fifth, the ends are moved to where it
//! has.

use twinlag_cross_relation::{Whitened, Z_975, log_normal_interval_95, sandwich};
use twinlag_optimise::{Budget, End, Minimiser, Problem, Variable};

use crate::levels::NoiseLevels;
use crate::objective::{EstimatorCost, Objective, Prior};
use crate::vocabulary::IntervalBasis;

/// A profile that has risen by this share more or less than the quadratic form is not described by
/// it: a fifth of the rise is a tenth of the interval's half width.
const MAX_PROFILE_DISAGREEMENT: f64 = 0.2;
/// Bisections, in the logarithm, that place an end: `1.96/2¹²`, less than a thousandth of a
/// standard error.
const END_BISECTIONS: usize = 12;

/// Standard errors and intervals of both time constants, s.
#[derive(Clone, Copy, Debug)]
pub struct TauIntervals {
    /// Standard errors, s.
    pub standard_error_s: [f64; 2],
    /// 95 % intervals, s.
    pub interval_95_s: [[f64; 2]; 2],
    /// What each interval rests on.
    pub basis: [IntervalBasis; 2],
}

impl TauIntervals {
    /// Quadratic in the logarithm.
    pub fn quadratic<const P: usize>(theta: &[f64; P], covariance: &[[f64; P]; P]) -> Self {
        Self {
            standard_error_s: [0, 1].map(|i| covariance[i][i].sqrt()),
            interval_95_s: [0, 1].map(|i| log_normal_interval_95(theta[i], covariance[i][i].sqrt())),
            basis: [IntervalBasis::StandardError; 2],
        }
    }
}

/// `covariance` with what the uncertainty of found levels adds: the weights that they give move the
/// minimum by `−A⁻¹ ½ (∂J(θ; s') − ∂J(θ; s))`, `A` half the Hessian with the priors' part, for
/// levels `s'` one standard error off.
///
/// - `inverse`: `A⁻¹`
pub(crate) fn with_level_uncertainty<const P: usize>(
    whitened: &Whitened<'_>,
    theta: &[f64; P],
    free: &[usize],
    covariance: &[[f64; P]; P],
    levels: &NoiseLevels,
    inverse: impl FnOnce() -> Option<[[f64; P]; P]>,
) -> [[f64; P]; P] {
    let mut out = *covariance;
    let error: [f64; 2] = [0, 1].map(|i| levels.log_covariance[i][i].sqrt());
    if error == [0.0; 2] {
        return out;
    }
    let Some(inverse) = inverse() else { return out };
    let here = whitened.evaluate(theta).gradient;
    let shift = |channel: usize| -> [f64; P] {
        let mut std_k = whitened.noise_std();
        std_k[channel] *= (0.5 * error[channel]).exp();
        let Ok(moved) = whitened.clone().with_noise(std_k) else { return [0.0; P] };
        let there = moved.evaluate(theta).gradient;
        std::array::from_fn(|i| free.iter().map(|&j| -0.5 * inverse[i][j] * (there[j] - here[j])).sum::<f64>())
    };
    let shifts = [shift(0), shift(1)];
    for c in 0..2 {
        for d in 0..2 {
            let scale = error[c] * error[d];
            let correlation = if scale > 0.0 { levels.log_covariance[c][d] / scale } else { 0.0 };
            for i in 0..P {
                for j in 0..P {
                    out[i][j] += shifts[c][i] * correlation * shifts[d][j];
                }
            }
        }
    }
    out
}

/// Inverse of half the Hessian, `information`, with the priors' part, over the `free` parameters.
pub(crate) fn inverse<const P: usize>(
    mut information: [[f64; P]; P],
    free: &[usize],
    priors: &[Prior],
) -> Option<[[f64; P]; P]> {
    for prior in priors {
        information[prior.index][prior.index] += 1.0 / (prior.std * prior.std);
    }
    sandwich(&information, &information, free)
}

/// A minimum of the whitened cost, and all that its neighbourhood depends on.
pub(crate) struct Minimum<'m, 'a, const P: usize> {
    pub(crate) whitened: &'m Whitened<'a>,
    pub(crate) theta: [f64; P],
    pub(crate) free: &'m [usize],
    pub(crate) covariance: &'m [[f64; P]; P],
    pub(crate) variables: &'m [Variable],
    pub(crate) priors: &'m [Prior],
    pub(crate) minimiser: &'m dyn Minimiser,
}

impl<const P: usize> Minimum<'_, '_, P> {
    /// Intervals of both time constants; by the profile `always`, or where the quadratic form
    /// does not describe it.
    pub(crate) fn intervals(&self, always: bool) -> TauIntervals {
        let mut out = TauIntervals::quadratic(&self.theta, self.covariance);
        let inverse = inverse(self.whitened.observed_information(&self.theta), self.free, self.priors);
        for i in (0..2).filter(|i| self.free.contains(i)) {
            (out.interval_95_s[i], out.basis[i]) = self.interval_beside(i, inverse.as_ref(), always);
        }
        out
    }

    /// Interval of the time constant `i` alone, which is free.
    pub(crate) fn interval(&self, i: usize, always: bool) -> ([f64; 2], IntervalBasis) {
        let inverse = inverse(self.whitened.observed_information(&self.theta), self.free, self.priors);
        self.interval_beside(i, inverse.as_ref(), always)
    }

    /// - `inverse`: of half the Hessian with the priors' part
    fn interval_beside(&self, i: usize, inverse: Option<&[[f64; P]; P]>, always: bool) -> ([f64; 2], IntervalBasis) {
        let Self { theta, free, variables, .. } = self;
        let ends = log_normal_interval_95(theta[i], self.covariance[i][i].sqrt());
        let Some(inverse) = inverse else {
            return (ends, IntervalBasis::StandardError);
        };
        let cost = self.whitened.clone();
        let cost = EstimatorCost::Whitened(if P == 6 { cost } else { cost.compressed(P == 4) });
        let objective = Objective::<P> { cost: &cost, priors: self.priors };
        let lowest = objective.at(theta).value;
        // The profile rises by z² times this at the ends: it knows nothing of the noise-noise term.
        let inflation = self.covariance[i][i] / inverse[i][i];
        let rise = |held_s: f64| -> Option<f64> {
            let mut variables = variables.to_vec();
            variables[i] = variables[i].clone().held_at(held_s);
            let mut from = theta.to_vec();
            from[i] = held_s;
            let value = if free.len() == 1 {
                objective.at(&from).value
            } else {
                let problem = Problem::new(&objective, variables).ok()?;
                let fit = self.minimiser.minimise(&problem, &from, &Budget::default()).ok()?;
                if matches!(fit.end, End::OnBound(_)) {
                    return None;
                }
                fit.value
            };
            Some((value - lowest) / (inflation * Z_975 * Z_975))
        };
        let bounds = [variables[i].lower, variables[i].upper];
        let at_ends = || ends.map(|end| if end > bounds[0] && end < bounds[1] { rise(end) } else { None });
        if !always && at_ends().iter().all(|r| r.is_some_and(|r| (r - 1.0).abs() < MAX_PROFILE_DISAGREEMENT)) {
            return (ends, IntervalBasis::StandardError);
        }
        (ends.map(|end| edge(theta[i], end, bounds, &rise)), IntervalBasis::Profile)
    }
}

/// Where `rise` reaches one, from `inside` towards and past `guess`; the bound where it does not.
fn edge(inside: f64, guess: f64, [lower, upper]: [f64; 2], rise: &dyn Fn(f64) -> Option<f64>) -> f64 {
    let is_above = |at: f64| rise(at).is_none_or(|r| r > 1.0);
    let (mut inside, mut outside) = (inside.ln(), guess.clamp(lower, upper).ln());
    let step = outside - inside;
    while !is_above(outside.exp()) {
        let bound = if step > 0.0 { upper.ln() } else { lower.ln() };
        if outside == bound {
            return outside.exp();
        }
        inside = outside;
        outside = if step > 0.0 { (outside + step).min(bound) } else { (outside + step).max(bound) };
    }
    for _ in 0..END_BISECTIONS {
        let middle = 0.5 * (inside + outside);
        if is_above(middle.exp()) { outside = middle } else { inside = middle }
    }
    (0.5 * (inside + outside)).exp()
}
