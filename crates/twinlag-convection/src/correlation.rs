//! Nusselt numbers of forced convection across a single body.

use crate::body::Shape;
use crate::error::ConvectionError;

/// A correlation, with the name that reports give it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Correlation {
    /// Cylinders across a flow.
    ChurchillBernstein,
    /// Spheres.
    Whitaker,
}

/// A Nusselt number and the Reynolds number that it belongs to, both with the diameter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Nusselt {
    /// Nusselt number.
    pub nusselt: f64,
    /// Reynolds number.
    pub reynolds: f64,
}

impl Correlation {
    /// That of a shape.
    pub(crate) const fn of(shape: Shape) -> Self {
        match shape {
            Shape::Cylinder => Self::ChurchillBernstein,
            Shape::Sphere => Self::Whitaker,
        }
    }

    /// Where it was published.
    pub const fn source(self) -> &'static str {
        match self {
            Self::ChurchillBernstein => "Churchill and Bernstein (1977)",
            Self::Whitaker => "Whitaker (1972)",
        }
    }

    /// Reynolds numbers that it was published for, in a fluid of Prandtl number `prandtl`: of a cylinder those with `Re Pr` of at least
    /// 0.2, below which natural convection and the length of the wire matter.
    fn range(self, prandtl: f64) -> [f64; 2] {
        match self {
            Self::ChurchillBernstein => [0.2 / prandtl, 1e7],
            Self::Whitaker => [3.5, 7.6e4],
        }
    }

    /// Nusselt number at Reynolds number `reynolds`, wherever that is:
    ///
    /// ```text
    /// cylinder  Nu = 0.3 + 0.62 Re^½ Pr^⅓ [1 + (0.4/Pr)^⅔]^−¼ [1 + (Re/282000)^⅝]^⅘
    /// sphere    Nu = 2 + (0.4 Re^½ + 0.06 Re^⅔) Pr^0.4
    /// ```
    ///
    /// with properties at the temperature of the fluid, so without the ratio of viscosities that Whitaker has for a surface
    /// far hotter or colder than the fluid.
    ///
    /// # Source
    /// Churchill and Bernstein, J. Heat Transfer 99 (1977) 300; Whitaker, `AIChE` Journal 18 (1972) 361.
    pub fn nusselt(self, reynolds: f64, prandtl: f64) -> f64 {
        match self {
            Self::ChurchillBernstein => {
                let laminar =
                    0.62 * reynolds.sqrt() * prandtl.cbrt() / (1.0 + (0.4 / prandtl).powf(2.0 / 3.0)).powf(0.25);
                0.3 + laminar * (1.0 + (reynolds / 282_000.0).powf(0.625)).powf(0.8)
            }
            Self::Whitaker => 2.0 + (0.4 * reynolds.sqrt() + 0.06 * reynolds.powf(2.0 / 3.0)) * prandtl.powf(0.4),
        }
    }

    /// As [`Correlation::nusselt`], where it holds.
    pub(crate) fn checked(self, reynolds: f64, prandtl: f64, speed_m_s: f64) -> Result<Nusselt, ConvectionError> {
        let range = self.range(prandtl);
        if !(reynolds >= range[0] && reynolds <= range[1]) {
            return Err(ConvectionError::Reynolds { reynolds, speed_m_s, source_of_it: self.source(), range });
        }
        Ok(Nusselt { nusselt: self.nusselt(reynolds, prandtl), reynolds })
    }
}
