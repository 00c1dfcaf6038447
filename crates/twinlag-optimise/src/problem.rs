//! The problem to minimise: a cost over named variables with bounds, in coordinates in which they
//! are all of size one.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cholesky;

/// A scalar function to be minimised. Implement [`Cost::derivatives`] as well if you have them:
/// most solvers are then far faster, and the report can distinguish a minimum from a plateau.
pub trait Cost {
    /// The cost at `x`, in the variables' own units. A value that is not finite counts as
    /// infinitely bad.
    fn value(&self, x: &[f64]) -> f64;

    /// The cost with its derivatives at `x`; `None` if there are none.
    fn derivatives(&self, _x: &[f64]) -> Option<Derivatives> {
        None
    }
}

/// Value, gradient and curvature of a cost at one point, from one evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivatives {
    /// The cost.
    pub value: f64,
    /// First derivatives, `[n]`.
    pub gradient: Vec<f64>,
    /// Second derivatives, `[n][n]`, or the Gauss-Newton part of them: it must be symmetric.
    pub curvature: Vec<Vec<f64>>,
}

/// How a variable is scaled inside the solvers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// The solver sees `ln x`: for times, rates and other positive numbers.
    Logarithmic,
    /// The solver sees `x / typical`.
    Linear {
        /// The size of a change that matters.
        typical: f64,
    },
}

/// A variable of the cost. `lower == upper` holds it there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variable {
    /// Name of the variable in reports.
    pub name: String,
    /// How the variable is scaled inside the solvers.
    pub scale: Scale,
    /// Smallest value allowed.
    pub lower: f64,
    /// Largest value allowed.
    pub upper: f64,
}

impl Variable {
    /// A positive variable, scaled by its logarithm.
    pub fn logarithmic(name: impl Into<String>, lower: f64, upper: f64) -> Self {
        Self { name: name.into(), scale: Scale::Logarithmic, lower, upper }
    }

    /// A variable of any sign for which a change of `typical` matters.
    pub fn linear(name: impl Into<String>, typical: f64, lower: f64, upper: f64) -> Self {
        Self { name: name.into(), scale: Scale::Linear { typical }, lower, upper }
    }

    /// This variable, held at `value`.
    ///
    /// ```
    /// use twinlag_optimise::{Cost, Problem, Variable};
    ///
    /// struct Bowl;
    ///
    /// impl Cost for Bowl {
    ///     fn value(&self, x: &[f64]) -> f64 {
    ///         x[0] * x[0] + x[1] * x[1]
    ///     }
    /// }
    ///
    /// let gain = Variable::linear("gain", 0.1, 0.5, 2.0).held_at(1.0);
    /// let problem = Problem::new(&Bowl, vec![gain, Variable::linear("offset", 1.0, -5.0, 5.0)])?;
    /// assert_eq!(problem.free(), [1]); // a solver sees the offset alone
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    #[must_use]
    pub fn held_at(mut self, value: f64) -> Self {
        (self.lower, self.upper) = (value, value);
        self
    }

    pub(crate) fn is_held(&self) -> bool {
        self.lower == self.upper
    }

    fn coordinate(&self, x: f64) -> f64 {
        match self.scale {
            Scale::Logarithmic => x.ln(),
            Scale::Linear { typical } => x / typical,
        }
    }

    fn value(&self, z: f64) -> f64 {
        match self.scale {
            Scale::Logarithmic => z.exp(),
            Scale::Linear { typical } => z * typical,
        }
        // The way there and back may round past a bound.
        .clamp(self.lower, self.upper)
    }
}

/// Why a problem could not be set up.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ProblemError {
    #[error("the bounds of {name} must be finite and in order, got [{lower}, {upper}]")]
    Bounds { name: String, lower: f64, upper: f64 },
    #[error("{name} is scaled by its logarithm, so its bounds must be positive, got [{lower}, {upper}]")]
    NotPositive { name: String, lower: f64, upper: f64 },
    #[error("the typical change of {name} must be finite and positive, got {typical}")]
    Typical { name: String, typical: f64 },
    #[error("every variable is held: at least one must be free")]
    NothingFree,
    #[error("a start needs {expected} finite values, one for each variable, got {got:?}")]
    Start { expected: usize, got: Vec<f64> },
    #[error("{optimiser} needs derivatives, and this cost has none: implement `Cost::derivatives`, or use nelder-mead")]
    NeedsDerivatives { optimiser: String },
    #[error(
        "{optimiser} minimises over one variable, and {} are free here ({}): hold the others, or use another optimiser",
        free.len(),
        free.join(", ")
    )]
    OneVariable { optimiser: String, free: Vec<String> },
    #[error("at least one start is needed")]
    NoStart,
    #[error("there is no optimiser called \"{name}\"; there are {known}")]
    UnknownOptimiser { name: String, known: String },
    #[error("{optimiser} is not part of this build: it needs the feature `{feature}`")]
    NotBuilt { optimiser: String, feature: &'static str },
}

/// A cost with its variables.
pub struct Problem<'a> {
    cost: &'a dyn Cost,
    variables: Vec<Variable>,
    free: Vec<usize>,
    bounds: Vec<(f64, f64)>,
    /// Part of the cost by which a change of it means something.
    resolution: f64,
}

/// Why there are no derivatives at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub(crate) enum NoDerivatives {
    #[error("the cost has no derivatives")]
    Anywhere,
    #[error("the cost has no finite derivatives at this point")]
    NotFinite,
}

/// Without the cost, which need not be printable.
impl fmt::Debug for Problem<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Problem").field("variables", &self.variables).finish_non_exhaustive()
    }
}

impl<'a> Problem<'a> {
    /// Minimise `cost` over `variables`, in the order in which the cost takes them.
    ///
    /// # Errors
    /// [`ProblemError`] for bounds out of order, not finite, or not positive where they must be,
    /// and where no variable is free.
    pub fn new(cost: &'a dyn Cost, variables: Vec<Variable>) -> Result<Self, ProblemError> {
        for v in &variables {
            let Variable { name, lower, upper, .. } = v.clone();
            if !(lower.is_finite() && upper.is_finite() && lower <= upper) {
                return Err(ProblemError::Bounds { name, lower, upper });
            }
            match v.scale {
                Scale::Logarithmic if lower <= 0.0 => return Err(ProblemError::NotPositive { name, lower, upper }),
                Scale::Linear { typical } if !(typical.is_finite() && typical > 0.0) => {
                    return Err(ProblemError::Typical { name, typical });
                }
                _ => {}
            }
        }
        let free: Vec<usize> = (0..variables.len()).filter(|&i| !variables[i].is_held()).collect();
        if free.is_empty() {
            return Err(ProblemError::NothingFree);
        }
        let bounds = free
            .iter()
            .map(|&i| {
                let v = &variables[i];
                (v.coordinate(v.lower), v.coordinate(v.upper))
            })
            .collect();
        Ok(Self { cost, variables, free, bounds, resolution: 0.0 })
    }

    /// This problem, of which a relative change of the cost below `resolution` means nothing: Levenberg-Marquardt stops where a
    /// whole Newton step would lower the cost by no more, however far it would go, and the point counts as a minimum.
    ///
    /// In the sum of squares of `n` residuals of unit variance, half a standard error of a parameter is a change of 0.25, or
    /// `0.25/n` of the cost. Without a resolution, which is 0, a fit goes on until no variable moves.
    ///
    /// ```
    /// use twinlag_optimise::{Budget, Cost, Derivatives, End, Minimiser, Optimiser, Problem, Variable};
    ///
    /// /// `1 + x⁴ + x²/1000`, as flat as a variable that the data hardly determine.
    /// struct Flat;
    ///
    /// impl Cost for Flat {
    ///     fn value(&self, x: &[f64]) -> f64 {
    ///         1.0 + x[0].powi(4) + 1e-3 * x[0] * x[0]
    ///     }
    ///
    ///     fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
    ///         let gradient = vec![4.0 * x[0].powi(3) + 2e-3 * x[0]];
    ///         let curvature = vec![vec![12.0 * x[0] * x[0] + 2e-3]];
    ///         Some(Derivatives { value: self.value(x), gradient, curvature })
    ///     }
    /// }
    ///
    /// let variable = || vec![Variable::linear("x", 1.0, -5.0, 5.0)];
    /// let fit = |problem: &Problem<'_>| {
    ///     let solver = Optimiser::LevenbergMarquardt { step_tolerance: 1e-9 };
    ///     solver.minimise(problem, &[1.0], &Budget::default()).expect("it has derivatives")
    /// };
    /// let whole = fit(&Problem::new(&Flat, variable())?);
    /// let coarse = fit(&Problem::new(&Flat, variable())?.with_resolution(1e-4));
    /// assert!(coarse.evaluations.derivatives < whole.evaluations.derivatives);
    /// assert!(coarse.value - whole.value < 1e-4);
    /// assert_eq!((coarse.end, whole.end), (End::Converged, End::Converged));
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    #[must_use]
    pub fn with_resolution(mut self, resolution: f64) -> Self {
        self.resolution = resolution;
        self
    }

    /// Whether a Newton step from a point lowers the cost by less than means anything; not where the curvature is not positive
    /// definite.
    ///
    /// - `free`: coordinates that the step may move
    pub(crate) fn is_resolved(&self, at: &Derivatives, free: &[usize]) -> bool {
        if self.resolution <= 0.0 {
            return false;
        }
        let mut matrix: Vec<f64> = free.iter().flat_map(|&i| free.iter().map(move |&j| at.curvature[i][j])).collect();
        let mut step: Vec<f64> = free.iter().map(|&i| at.gradient[i]).collect();
        if cholesky::solve(&mut matrix, &mut step).is_none() {
            return false;
        }
        let gain: f64 = 0.5 * free.iter().zip(&step).map(|(&i, s)| at.gradient[i] * s).sum::<f64>();
        gain <= self.resolution * at.value
    }

    /// The variables.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Indices of the variables that are not held.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// `x`, moved inside the bounds, as coordinates of the free variables.
    ///
    /// ```
    /// # use twinlag_optimise::{Cost, Problem, Variable};
    /// # struct Flat;
    /// # impl Cost for Flat {
    /// #     fn value(&self, _: &[f64]) -> f64 { 0.0 }
    /// # }
    /// let tau = Variable::logarithmic("tau", 1e-3, 10.0);
    /// let problem = Problem::new(&Flat, vec![tau, Variable::linear("offset", 0.5, -5.0, 5.0)])?;
    /// let z = problem.coordinates(&[1.0, 7.0])?;
    /// assert_eq!(z, [0.0, 10.0]); // ln 1, and 7 moved to its bound of 5, over 0.5
    /// assert_eq!(problem.point(&z), [1.0, 5.0]);
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    ///
    /// # Errors
    /// [`ProblemError::Start`] unless `x` has one finite value for each variable.
    pub fn coordinates(&self, x: &[f64]) -> Result<Vec<f64>, ProblemError> {
        if x.len() != self.variables.len() || !x.iter().all(|v| v.is_finite()) {
            return Err(ProblemError::Start { expected: self.variables.len(), got: x.to_vec() });
        }
        Ok(self
            .free
            .iter()
            .map(|&i| {
                let v = &self.variables[i];
                v.coordinate(x[i].clamp(v.lower, v.upper))
            })
            .collect())
    }

    /// Bounds of the free coordinates, `(lower, upper)` each.
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// All variables, in their own units, at coordinates `z` (inside the bounds).
    pub fn point(&self, z: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = self.variables.iter().map(|v| v.lower).collect();
        for (&i, &z) in self.free.iter().zip(z) {
            x[i] = self.variables[i].value(z);
        }
        x
    }

    /// The cost at coordinates `z` inside the bounds; infinite where it is not finite.
    pub fn value_at(&self, z: &[f64]) -> f64 {
        let value = self.cost.value(&self.point(z));
        if value.is_finite() { value } else { f64::INFINITY }
    }

    /// Derivatives with respect to the coordinates. `None` without derivatives, or where they are
    /// not finite.
    pub fn derivatives_at(&self, z: &[f64]) -> Option<Derivatives> {
        self.look_at(z).ok()
    }

    /// The derivatives of [`Problem::derivatives_at`], or the reason why there are none.
    pub(crate) fn look_at(&self, z: &[f64]) -> Result<Derivatives, NoDerivatives> {
        let x = self.point(z);
        let mut d = self.cost.derivatives(&x).ok_or(NoDerivatives::Anywhere)?;
        let slope = |i: usize| match self.variables[i].scale {
            Scale::Logarithmic => x[i],
            Scale::Linear { typical } => typical,
        };
        // In place: free indices rise, so what belongs at `p` is still where the cost put it, at
        // `i ≥ p`.
        for (p, &i) in self.free.iter().enumerate() {
            d.curvature.swap(p, i);
            for (q, &j) in self.free.iter().enumerate() {
                d.curvature[p][q] = d.curvature[p][j] * slope(i) * slope(j);
            }
            d.curvature[p].truncate(self.free.len());
            // x = exp z has dx/dz = d²x/dz² = x; the second derivative enters through the gradient.
            if self.variables[i].scale == Scale::Logarithmic {
                d.curvature[p][p] += d.gradient[i] * x[i];
            }
            d.gradient[p] = d.gradient[i] * slope(i);
        }
        d.gradient.truncate(self.free.len());
        d.curvature.truncate(self.free.len());
        let finite =
            d.value.is_finite() && d.gradient.iter().chain(d.curvature.iter().flatten()).all(|v| v.is_finite());
        if finite { Ok(d) } else { Err(NoDerivatives::NotFinite) }
    }
}
