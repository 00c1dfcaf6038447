//! Properties of fluids.

use std::fmt;

use crate::error::ConvectionError;

/// 0 °C, K.
pub(crate) const ZERO_CELSIUS_K: f64 = 273.15;
/// One atmosphere, Pa.
pub(crate) const ATMOSPHERE_PA: f64 = 101_325.0;
/// Gas constant of dry air, J/(kg K).
const AIR_GAS_CONSTANT_J_KG_K: f64 = 287.05;

/// What flows around a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fluid {
    /// Dry air; lean combustion gas is close to it.
    Air,
    /// Liquid water; sea water is close to it.
    Water,
}

/// Properties of a fluid at one temperature and pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Properties {
    /// Thermal conductivity, W/(m K).
    pub conductivity_w_m_k: f64,
    /// Kinematic viscosity, m²/s.
    pub viscosity_m2_s: f64,
    /// Prandtl number.
    pub prandtl: f64,
}

impl Fluid {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Air => "air",
            Self::Water => "water",
        }
    }

    /// Whether heat passes through it by radiation.
    pub(crate) const fn is_transparent(self) -> bool {
        matches!(self, Self::Air)
    }

    /// Temperatures between which the properties are known, °C.
    const fn range_c(self) -> [f64; 2] {
        match self {
            Self::Air => [-100.0, 1000.0],
            Self::Water => [0.0, 100.0],
        }
    }

    /// Properties at `temperature_c` and `pressure_pa`.
    ///
    /// Air: viscosity `1.716·10⁻⁵ (T/273)^1.5 384/(T + 111)` Pa s and conductivity `0.0241 (T/273)^1.5 467/(T + 194)`
    /// W/(m K) (Sutherland's law with the constants of White, Viscous Fluid Flow, 2006; up to 6 % off tables), an ideal gas with a Prandtl
    /// number of 0.70. Water: viscosity `2.414·10⁻⁵ · 10^(247.8/(T − 140))` Pa s (2.5 % off), conductivity
    /// `−0.5752 + 6.397·10⁻³ T − 8.151·10⁻⁶ T²` W/(m K), 4182 J/(kg K) and 1000 kg/m³ less what it has expanded.
    ///
    /// # Errors
    /// [`ConvectionError::Temperature`].
    pub fn properties(self, temperature_c: f64, pressure_pa: f64) -> Result<Properties, ConvectionError> {
        let range_c = self.range_c();
        if !(temperature_c >= range_c[0] && temperature_c <= range_c[1]) {
            return Err(ConvectionError::Temperature { fluid: self.name(), temperature_c, range_c });
        }
        let t_k = temperature_c + ZERO_CELSIUS_K;
        Ok(match self {
            Self::Air => {
                let sutherland = |s: f64| (t_k / ZERO_CELSIUS_K).powf(1.5) * (ZERO_CELSIUS_K + s) / (t_k + s);
                let density_kg_m3 = pressure_pa / (AIR_GAS_CONSTANT_J_KG_K * t_k);
                Properties {
                    conductivity_w_m_k: 0.0241 * sutherland(194.0),
                    viscosity_m2_s: 1.716e-5 * sutherland(111.0) / density_kg_m3,
                    prandtl: 0.70,
                }
            }
            Self::Water => {
                let viscosity_pa_s = 2.414e-5 * 10f64.powf(247.8 / (t_k - 140.0));
                let conductivity_w_m_k = -0.5752 + 6.397e-3 * t_k - 8.151e-6 * t_k * t_k;
                // To 0.3 % from 0 to 100 °C.
                let density_kg_m3 = 1000.0 - 0.0044 * (temperature_c - 4.0).powi(2);
                Properties {
                    conductivity_w_m_k,
                    viscosity_m2_s: viscosity_pa_s / density_kg_m3,
                    prandtl: viscosity_pa_s * 4182.0 / conductivity_w_m_k,
                }
            }
        })
    }
}

impl fmt::Display for Fluid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
