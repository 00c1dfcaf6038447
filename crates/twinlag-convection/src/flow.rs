//! What a sensor is in: a fluid and its speed.

use std::fmt;
use std::str::FromStr;

use crate::error::ConvectionError;
use crate::fluid::{ATMOSPHERE_PA, Fluid, ZERO_CELSIUS_K};
use crate::quantity::{Units, four_digits, positive};

/// A fluid that flows across a sensor.
///
/// As text it is a fluid (`air`, `water`), its speed (`m/s`, `km/h`) and, after commas, its temperature (`C`, `K`) and pressure
/// (`bar`, `kPa`) where they are not those of the readings and one atmosphere: `air@20m/s`, `air@20m/s,800C,5bar`.
///
/// ```
/// use twinlag_convection::{Flow, Fluid};
///
/// let flow: Flow = "air@20m/s,800C,5bar".parse()?;
/// assert_eq!((flow.fluid, flow.speed_m_s, flow.pressure_pa), (Fluid::Air, 20.0, 5e5));
/// assert!((flow.temperature_c.expect("given") - 800.0).abs() < 1e-9);
/// # Ok::<(), twinlag_convection::ConvectionError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Flow {
    /// What flows.
    pub fluid: Fluid,
    /// Its speed across the sensor, m/s.
    pub speed_m_s: f64,
    /// Its temperature, °C; `None` takes that of the readings.
    pub temperature_c: Option<f64>,
    /// Its pressure, Pa.
    pub pressure_pa: f64,
}

const SPEED_UNITS: Units = &[("m/s", 1.0), ("cm/s", 0.01), ("mm/s", 1e-3), ("km/h", 1.0 / 3.6)];
const KELVIN: Units = &[("K", 1.0)];
const PRESSURE_UNITS: Units = &[("bar", 1e5), ("mbar", 100.0), ("hPa", 100.0), ("kPa", 1e3), ("MPa", 1e6), ("Pa", 1.0)];

impl Flow {
    /// `fluid` at `speed_m_s`, at one atmosphere and the temperature of the readings.
    ///
    /// # Errors
    /// [`ConvectionError::NotPositive`].
    pub fn new(fluid: Fluid, speed_m_s: f64) -> Result<Self, ConvectionError> {
        if !(speed_m_s.is_finite() && speed_m_s > 0.0) {
            return Err(ConvectionError::NotPositive { what: "the speed in m/s", value: speed_m_s });
        }
        Ok(Self { fluid, speed_m_s, temperature_c: None, pressure_pa: ATMOSPHERE_PA })
    }
}

impl FromStr for Flow {
    type Err = ConvectionError;

    fn from_str(text: &str) -> Result<Self, ConvectionError> {
        let wrong =
            |expected, got: &str| ConvectionError::Text { text: text.to_owned(), expected, got: got.trim().to_owned() };
        let (fluid, rest) =
            text.split_once('@').ok_or_else(|| wrong("a fluid, @ and its speed, as in air@20m/s", text))?;
        let fluid = match fluid.trim() {
            "air" => Fluid::Air,
            "water" => Fluid::Water,
            other => return Err(wrong("air or water", other)),
        };
        let mut parts = rest.split(',');
        let speed = parts.next().unwrap_or_default();
        let speed_m_s = positive(text, speed, SPEED_UNITS, "a speed above 0 in m/s, cm/s, mm/s or km/h")?;
        let mut flow = Self::new(fluid, speed_m_s)?;
        let mut pressure_pa = None;
        for part in parts.map(str::trim) {
            let is_temperature = part.ends_with(['C', 'K']);
            let is_second = if is_temperature { flow.temperature_c.is_some() } else { pressure_pa.is_some() };
            if is_second {
                return Err(wrong("one temperature and one pressure", part));
            }
            if let Some(celsius) = part.strip_suffix("\u{b0}C").or_else(|| part.strip_suffix('C')) {
                let c = celsius.trim().parse::<f64>().ok().filter(|c| c.is_finite());
                flow.temperature_c = Some(c.ok_or_else(|| wrong("a temperature in C or K", part))?);
            } else if part.ends_with('K') {
                flow.temperature_c = Some(positive(text, part, KELVIN, "a temperature in C or K")? - ZERO_CELSIUS_K);
            } else {
                let expected = "a temperature in C or K, or a pressure in bar, mbar, hPa, kPa, MPa or Pa";
                pressure_pa = Some(positive(text, part, PRESSURE_UNITS, expected)?);
            }
        }
        flow.pressure_pa = pressure_pa.unwrap_or(ATMOSPHERE_PA);
        Ok(flow)
    }
}

impl fmt::Display for Flow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {} m/s", self.fluid, self.speed_m_s)?;
        if let Some(c) = self.temperature_c {
            write!(f, ", {c:.0} °C")?;
        }
        if self.pressure_pa == ATMOSPHERE_PA {
            Ok(())
        } else {
            write!(f, ", {} bar", four_digits(self.pressure_pa / 1e5))
        }
    }
}
