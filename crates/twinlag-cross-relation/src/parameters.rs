//! What the parameters of a pair of sensors are, and in which order they stand in a slice.

use num_dual::DualSVec64;
use serde::{Deserialize, Serialize};

/// One parameter of the pair, in the order in which the costs take them.
///
/// Sensor 1 reads `y1 = h1 ∗ x`, sensor 2 reads `y2 = g (h2 ∗ x) + o`, where `h` are lags of unit
/// gain, of first order or of second, `g` is the *relative* gain and `o` the *relative* offset, at
/// the level that was taken off the readings. What both channels share (a common gain, a common
/// offset) cannot be seen without knowing the gas temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Parameter {
    /// Time constant of sensor 1, s.
    Tau1,
    /// Time constant of sensor 2, s.
    Tau2,
    /// Gain of channel 2 relative to channel 1.
    Gain,
    /// Offset of channel 2 against channel 1 where channel 1 reads the level of
    /// [`crate::Readings`], K.
    Offset,
    /// Time constant of a second lag in series with that of sensor 1, s; 0 for a sensor of first
    /// order.
    SecondTau1,
    /// Time constant of a second lag in series with that of sensor 2, s; 0 for a sensor of first
    /// order.
    SecondTau2,
}

impl Parameter {
    /// All six, in order. Costs take the first two (gain 1, offset 0, first order), the first four
    /// (first order), or all.
    pub const ALL: [Self; 6] = [Self::Tau1, Self::Tau2, Self::Gain, Self::Offset, Self::SecondTau1, Self::SecondTau2];
}

/// The parameters as numbers or as dual numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<D> {
    pub(crate) tau_s: [D; 2],
    pub(crate) gain: D,
    pub(crate) offset: D,
    /// Second lags, where there are any.
    pub(crate) second_tau_s: [Option<D>; 2],
}

impl<const P: usize> Pair<DualSVec64<P>> {
    /// The first `P` of [`Parameter::ALL`] as variables, the rest at gain 1, offset 0 and first
    /// order. A second time constant of zero means no second lag, and has no derivatives.
    pub(crate) fn variables(theta: &[f64; P]) -> Self {
        const { assert!(P == 2 || P == 4 || P == 6, "two time constants, with gain and offset, with second lags") };
        let variable = |i: usize, otherwise: f64| match theta.get(i) {
            Some(&value) => DualSVec64::from_re(value).derivative(i),
            None => DualSVec64::from_re(otherwise),
        };
        let second = |i: usize| theta.get(i).filter(|t| **t > 0.0).map(|_| variable(i, f64::NAN));
        Self {
            tau_s: [variable(0, f64::NAN), variable(1, f64::NAN)],
            gain: variable(2, 1.0),
            offset: variable(3, 0.0),
            second_tau_s: [second(4), second(5)],
        }
    }
}

/// Value and gradient of a dual number as plain numbers.
pub(crate) fn parts<const P: usize>(x: DualSVec64<P>) -> (f64, [f64; P]) {
    let gradient = x.eps.unwrap_generic(nalgebra::Const::<P>, nalgebra::U1);
    (x.re, std::array::from_fn(|i| gradient[i]))
}

/// Value, gradient and Hessian of a scalar cost with respect to the first `P` of
/// [`Parameter::ALL`], in their own units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostValue<const P: usize> {
    /// The cost.
    pub value: f64,
    /// First derivatives of the value.
    pub gradient: [f64; P],
    /// Second derivatives of the value; where so stated, only their Gauss-Newton part, for sums of
    /// squares whose residual is small.
    pub hessian: [[f64; P]; P],
}
