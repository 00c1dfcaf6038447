//! What the inverse of a rig is computed in: plain numbers, or numbers that carry a derivative along.

use num_dual::{Dual64, DualNum};

/// A number and its derivative with respect to one parameter of the model.
///
/// An effect computes what it installs from parameters of this type, so that derivatives of the cost are exact.
/// Arithmetic and functions are those of [`num_dual::DualNum`]; `Number::from(1.5)` is a constant.
pub type Number = Dual64;

/// A function of time, s, that a model contains: a disturbance in K, or a relative change.
pub type TimeFunction = std::sync::Arc<dyn Fn(f64) -> Number + Send + Sync>;

/// A function of a temperature in °C: its value and its slope there.
pub type Curve = std::sync::Arc<dyn Fn(Number) -> (Number, Number) + Send + Sync>;

/// Whether a number is this value, and no parameter moves it.
pub(crate) fn is_exactly(number: Number, value: f64) -> bool {
    number.re == value && number.eps == 0.0
}

/// [`Number`], or its value alone.
pub(crate) trait Real: DualNum<Primitive = f64> + Copy + Send + Sync {
    /// What is kept of a number.
    fn of(number: Number) -> Self;

    /// The number that this is of, with no derivative where none is kept.
    fn number(self) -> Number;

    /// The value.
    fn value(self) -> f64 {
        self.number().re
    }
}

impl Real for f64 {
    fn of(number: Number) -> Self {
        number.re
    }

    fn number(self) -> Number {
        Number::from(self)
    }
}

impl Real for Number {
    fn of(number: Number) -> Self {
        number
    }

    fn number(self) -> Number {
        self
    }
}
