//! Autoregressive noise of first order as the moments of the inferred inputs show it: levels and
//! coefficients together.

use nalgebra::Matrix2;
use twinlag_bias::{JointLevels, NoiseMoments};
use twinlag_optimise::{Budget, Cost, Minimiser, Optimiser, Problem, Variable};

/// Largest autoregressive coefficient that is looked for, dimensionless. Half the power of such
/// noise lies below `(1 − 0.97)/2π`, a two-hundredth of the sampling rate, where the gas has its
/// own and the moments have no weight.
pub(crate) const MAX_AR1: f64 = 0.97;
/// Step of a coefficient in central differences, dimensionless: half the standard error
/// `√((1 − φ²)/n)` that `φ = 0.5` has in 2500 samples, so that the misfit's third derivative hardly
/// counts.
const AR1_DIFFERENCE_STEP: f64 = 0.01;
/// Rounds of weights and coefficients. Weights enter the second order alone: experiment
/// `coloured-noise` runs on three.
const WEIGHING_ROUNDS: usize = 3;
/// Spread of the misfit at the corners of a simplex, as a share of its value at the start, at which the simplex stops: of a chi-square
/// of `M` it leaves the coefficients within `√(1e-7 M)` of their standard errors.
const AR1_SPREAD: f64 = 1e-7;
/// Edge of the first simplex, in coefficients: a sixth of the range from −0.97 to 0.97.
const AR1_EDGE: f64 = 0.3;

/// The misfit of the moments as a function of both coefficients.
struct Misfit<'a> {
    moments: &'a NoiseMoments,
    std_k: [f64; 2],
    weighing_ar1: [f64; 2],
}

impl Cost for Misfit<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let levels = self.moments.levels_weighed(self.std_k, self.weighing_ar1, [x[0], x[1]]);
        levels.map_or(f64::INFINITY, |l| l.misfit)
    }
}

/// Autoregressive noise as the moments show it.
pub(super) struct Coloured {
    pub(super) levels: JointLevels,
    pub(super) ar1: [f64; 2],
    /// How the logarithms of both variances shift for either principal standard error of the
    /// coefficients.
    pub(super) by_ar1: [[f64; 2]; 2],
}

/// Levels and coefficients of autoregressive noise.
pub(super) fn coloured(moments: &NoiseMoments, start_std_k: [f64; 2]) -> Option<Coloured> {
    let (mut levels, mut ar1) = (moments.levels(start_std_k, [0.0; 2])?, [0.0; 2]);
    let simplex = Optimiser::NelderMead { spread_tolerance: AR1_SPREAD, edge: AR1_EDGE };
    for _ in 0..WEIGHING_ROUNDS {
        let misfit = Misfit { moments, std_k: levels.std_k, weighing_ar1: ar1 };
        let variable = |name: &str| Variable::linear(name, 1.0, -MAX_AR1, MAX_AR1);
        let problem = Problem::new(&misfit, vec![variable("T1.ar1"), variable("T2.ar1")]).ok()?;
        let fit = simplex.minimise(&problem, &ar1, &Budget::default()).ok()?;
        ar1 = [fit.x[0], fit.x[1]];
        levels = moments.levels(levels.std_k, ar1)?;
    }
    Some(Coloured { by_ar1: by_ar1(moments, &levels, ar1).unwrap_or([[0.0; 2]; 2]), levels, ar1 })
}

/// `∂ln s²/∂φ` times the Cholesky factor of the coefficients' covariance, which is the inverse of
/// half the misfit's Hessian; by differences.
fn by_ar1(moments: &NoiseMoments, levels: &JointLevels, ar1: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let at = |d1: f64, d2: f64| {
        moments.levels_weighed(
            levels.std_k,
            ar1,
            [ar1[0] + d1 * AR1_DIFFERENCE_STEP, ar1[1] + d2 * AR1_DIFFERENCE_STEP],
        )
    };
    let (up, down) = ([at(1.0, 0.0)?, at(0.0, 1.0)?], [at(-1.0, 0.0)?, at(0.0, -1.0)?]);
    let here = at(0.0, 0.0)?.misfit;
    let own =
        |k: usize| (up[k].misfit - 2.0 * here + down[k].misfit) / (2.0 * AR1_DIFFERENCE_STEP * AR1_DIFFERENCE_STEP);
    let mixed = (at(1.0, 1.0)?.misfit - at(1.0, -1.0)?.misfit - at(-1.0, 1.0)?.misfit + at(-1.0, -1.0)?.misfit)
        / (8.0 * AR1_DIFFERENCE_STEP * AR1_DIFFERENCE_STEP);
    let covariance = Matrix2::new(own(0), mixed, mixed, own(1)).cholesky()?.inverse();
    let factor = covariance.cholesky()?.l();
    let slope = |i: usize, k: usize| 2.0 * (up[k].std_k[i] / down[k].std_k[i]).ln() / (2.0 * AR1_DIFFERENCE_STEP);
    Some([0, 1].map(|column| [0, 1].map(|i| (0..2).map(|k| slope(i, k) * factor[(k, column)]).sum())))
}
