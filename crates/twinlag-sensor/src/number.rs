//! The number type in which the formulas of the coefficients are written.

use core::ops::Neg;

#[cfg(feature = "std")]
use num_dual::DualNum;
use num_traits::NumOps;

/// A number that the formulas of the coefficients take: `f64`, and with the feature `std` every
/// dual number of `num-dual` over `f64`, which gives derivatives.
pub trait Number: Copy + From<f64> + Neg<Output = Self> + NumOps + NumOps<f64> {
    /// The value of the number, without derivatives.
    fn value(self) -> f64;

    /// `1/x`.
    #[must_use]
    fn recip(self) -> Self;

    /// `eˣ`.
    #[must_use]
    fn exp(self) -> Self;

    /// `eˣ − 1`, to full precision also where `x` is small.
    #[must_use]
    fn exp_m1(self) -> Self;
}

#[cfg(feature = "std")]
impl<D: DualNum<Primitive = f64> + Copy> Number for D {
    fn value(self) -> f64 {
        self.re()
    }

    fn recip(self) -> Self {
        DualNum::recip(&self)
    }

    fn exp(self) -> Self {
        DualNum::exp(&self)
    }

    fn exp_m1(self) -> Self {
        DualNum::exp_m1(&self)
    }
}

#[cfg(not(feature = "std"))]
impl Number for f64 {
    fn value(self) -> f64 {
        self
    }

    fn recip(self) -> Self {
        1.0 / self
    }

    fn exp(self) -> Self {
        num_traits::Float::exp(self)
    }

    fn exp_m1(self) -> Self {
        num_traits::Float::exp_m1(self)
    }
}
