//! What a sensor is like: shape, size, material.

use std::fmt;
use std::str::FromStr;

use crate::error::ConvectionError;
use crate::quantity::{Units, four_digits, positive};

/// Shape of the part that measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shape {
    /// A long cylinder across the flow: a wire, a sheath.
    Cylinder,
    /// A sphere: a bead.
    Sphere,
}

impl Shape {
    /// Volume over surface, in diameters.
    pub(crate) const fn volume_per_surface(self) -> f64 {
        match self {
            Self::Cylinder => 0.25,
            Self::Sphere => 1.0 / 6.0,
        }
    }
}

/// What a sensor is made of, with mean values of its heat capacity and conductivity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Material {
    /// Thermocouple alloys of types E, J, K, N and T.
    BaseMetal,
    /// Platinum and its alloys with rhodium: types B, R and S, resistance wires.
    Platinum,
    /// A mineral-insulated cable: a nickel alloy around magnesia and two wires.
    Sheathed,
}

impl Material {
    /// Heat capacity of a volume at room temperature, J/(m³ K); in hot gas that of alloys is some 10 to 20 % larger.
    ///
    /// Base metals: the mean of Chromel (8730 kg/m³ · 448 J/(kg K)), Alumel (8600 · 523), constantan (8920 · 394), iron
    /// (7870 · 447) and copper (8933 · 385), which are within 20 % of it. Platinum: 21450 · 133. Sheathed: a wall of 0.12 and
    /// two wires of 0.15 diameters, as makers give them, of nickel alloy (8470 · 444) and magnesia (3580 · 940, compacted
    /// to 85 %).
    pub const fn heat_capacity_j_m3_k(self) -> f64 {
        match self {
            Self::BaseMetal => 3.78e6,
            Self::Platinum => 2.85e6,
            Self::Sheathed => 3.28e6,
        }
    }

    /// Thermal conductivity, W/(m K): the lowest of the alloys (Nicrosil, platinum with rhodium), and compacted magnesia.
    const fn conductivity_w_m_k(self) -> f64 {
        match self {
            Self::BaseMetal => 13.0,
            Self::Platinum => 30.0,
            Self::Sheathed => 3.0,
        }
    }

    /// Emissivity: of oxidised alloys, and of platinum, which stays bright.
    pub(crate) const fn emissivity(self) -> f64 {
        match self {
            Self::BaseMetal | Self::Sheathed => 0.8,
            Self::Platinum => 0.2,
        }
    }
}

/// A sensor as convection sees it.
///
/// As text it is a kind and a diameter (`um`, `mm`, `m`): `thermocouple:0.5mm` or `wire:50um`, a bare wire of base metal;
/// `platinum:25um`, a wire of platinum; `bead:0.8mm`, a bead of base metal; `sheath:3mm`, a mineral-insulated thermocouple.
///
/// ```
/// use twinlag_convection::{Body, Material, Shape};
///
/// let body: Body = "sheath:3mm".parse()?;
/// assert_eq!((body.shape, body.material, body.diameter_m), (Shape::Cylinder, Material::Sheathed, 0.003));
/// let error = "rod:3mm".parse::<Body>().expect_err("no such kind").to_string();
/// assert!(error.contains("thermocouple, wire, platinum, bead or sheath"), "{error}");
/// # Ok::<(), twinlag_convection::ConvectionError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Body {
    /// Its shape.
    pub shape: Shape,
    /// What it is made of.
    pub material: Material,
    /// Its diameter, m.
    pub diameter_m: f64,
}

const LENGTH_UNITS: Units =
    &[("um", 1e-6), ("\u{b5}m", 1e-6), ("\u{3bc}m", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

impl Body {
    /// A sensor of diameter `diameter_m`.
    ///
    /// # Errors
    /// [`ConvectionError::NotPositive`].
    pub fn new(shape: Shape, material: Material, diameter_m: f64) -> Result<Self, ConvectionError> {
        if !(diameter_m.is_finite() && diameter_m > 0.0) {
            return Err(ConvectionError::NotPositive { what: "the diameter in m", value: diameter_m });
        }
        Ok(Self { shape, material, diameter_m })
    }

    /// Time constant under a heat transfer coefficient `h_w_m2_k`, s.
    pub(crate) fn time_constant_s(&self, h_w_m2_k: f64) -> f64 {
        self.material.heat_capacity_j_m3_k() * self.shape.volume_per_surface() * self.diameter_m / h_w_m2_k
    }

    /// The resistance to heat inside over that at the surface: the Biot number `h (V/A) / k`.
    pub(crate) fn biot(&self, h_w_m2_k: f64) -> f64 {
        h_w_m2_k * self.shape.volume_per_surface() * self.diameter_m / self.material.conductivity_w_m_k()
    }
}

impl FromStr for Body {
    type Err = ConvectionError;

    fn from_str(text: &str) -> Result<Self, ConvectionError> {
        let wrong =
            |expected, got: &str| ConvectionError::Text { text: text.to_owned(), expected, got: got.trim().to_owned() };
        let (kind, size) = text
            .split_once(':')
            .ok_or_else(|| wrong("a kind, a colon and a diameter, as in thermocouple:0.5mm", text))?;
        let (shape, material) = match kind.trim() {
            "thermocouple" | "wire" => (Shape::Cylinder, Material::BaseMetal),
            "platinum" => (Shape::Cylinder, Material::Platinum),
            "bead" => (Shape::Sphere, Material::BaseMetal),
            "sheath" => (Shape::Cylinder, Material::Sheathed),
            other => return Err(wrong("thermocouple, wire, platinum, bead or sheath", other)),
        };
        Self::new(shape, material, positive(text, size, LENGTH_UNITS, "a diameter in um, mm, cm or m")?)
    }
}

impl fmt::Display for Body {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match (self.material, self.shape) {
            (Material::Sheathed, _) => "mineral-insulated thermocouple",
            (Material::Platinum, Shape::Sphere) => "platinum bead",
            (Material::Platinum, _) => "platinum wire",
            (_, Shape::Sphere) => "bead of thermocouple alloy",
            (Material::BaseMetal, _) => "bare thermocouple wire",
        };
        write!(f, "{what} of {} mm", four_digits(self.diameter_m * 1e3))
    }
}
