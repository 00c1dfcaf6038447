//! Scales in the properties of a channel: from counts of a converter to volts, and on to temperature.
//!
//! Each scale takes the counts or the results of scales before it; the last one is the channel's.
//! The reading of a thermocouple is, for instance: counts to volts; counts of the cold junction to its
//! temperature and to the voltage that it takes away; their sum; its temperature. Names of the
//! properties: NI, "TDMS Data and Properties". Constants are those in the file.

use super::Properties;
use super::thermocouple::Thermocouple;
use super::value::Property;

/// The number that stands for the counts where a scale is expected.
pub(super) const COUNTS: u32 = u32::MAX;
/// The property that counts scales.
const SCALES: &str = "NI_Number_Of_Scales";
const CURRENT_EXCITATION: f64 = 10134.0;
/// °C, where Callendar and Van Dusen's fourth-order term changes sign.
const BOILING_C: f64 = 100.0;

/// The scales of a channel, in their order.
#[derive(Clone, Debug)]
pub(super) struct Scales(Vec<Scale>);

#[derive(Clone, Debug)]
struct Scale {
    law: Law,
    /// One, or two of a sum.
    inputs: Vec<Input>,
}

/// What a scale takes.
#[derive(Clone, Copy, Debug)]
enum Input {
    /// Counts: which of the channel's.
    Counts(usize),
    /// The result of a scale before.
    Scale(usize),
}

/// What a scale makes of its input.
#[derive(Clone, Debug)]
enum Law {
    Same,
    /// Coefficients, the constant first.
    Polynomial(Vec<f64>),
    /// Linear between points `(x, y)`, `x` rising; constant beyond them.
    Table(Vec<(f64, f64)>),
    Resistance(Resistance),
    Thermistor(Thermistor),
    /// From µV to °C.
    Temperature(Thermocouple),
    /// From °C to µV.
    Voltage(Thermocouple),
    Sum,
    Difference,
}

/// Which properties are scales, by the start of their names: groups and files may have them for all their channels.
pub(super) fn is_of_scale(name: &str) -> bool {
    name.starts_with("NI_Scal") || name == SCALES
}

impl Scales {
    /// The scales that are to be applied to a channel's counts, if there are any; or why they cannot be.
    ///
    /// - `counts`: the scale for which each of the channel's counts stand; [`COUNTS`] for those of a
    ///   channel that has one kind only
    pub(super) fn of(properties: &Properties, counts: &[u32]) -> Result<Option<Self>, String> {
        let status = properties.get("NI_Scaling_Status").and_then(Property::text);
        let number = properties.get(SCALES).and_then(Property::number).unwrap_or(0.0) as usize;
        match (status, number) {
            (Some("unscaled"), 0) => return Err("the file has no scale for them".to_owned()),
            (Some("scaled"), _) | (_, 0) => return Ok(None),
            _ => {}
        }
        // No file has more scales than properties and counts: a damaged number is not believed.
        let scales = (0..number.min(properties.len() + counts.len())).map(|index| Scale::of(properties, counts, index));
        scales.collect::<Result<_, _>>().map(|scales| Some(Self(scales)))
    }

    /// What the laws are, in notes.
    pub(super) fn names(&self) -> String {
        let names = self.0.iter().filter_map(|scale| match &scale.law {
            Law::Same | Law::Sum | Law::Difference => None,
            Law::Polynomial(coefficients) if coefficients.len() <= 2 => Some("linear".to_owned()),
            Law::Polynomial(_) => Some("polynomial".to_owned()),
            Law::Table(_) => Some("table".to_owned()),
            Law::Resistance(_) => Some("resistance thermometer".to_owned()),
            Law::Thermistor(_) => Some("thermistor".to_owned()),
            Law::Temperature(thermocouple) => Some(format!("thermocouple type {}", thermocouple.letter())),
            Law::Voltage(_) => Some("voltage of the cold junction".to_owned()),
        });
        let mut once: Vec<String> = Vec::new();
        for name in names {
            if !once.contains(&name) {
                once.push(name);
            }
        }
        once.join(", ")
    }

    /// The channel's values: as many as there are of its first counts.
    pub(super) fn apply(&self, counts: &[Vec<f64>]) -> Vec<f64> {
        let rows = counts.iter().map(Vec::len).min().unwrap_or(0);
        let mut results = vec![0.0; self.0.len()];
        let value = |row: usize| {
            for (index, scale) in self.0.iter().enumerate() {
                results[index] = scale.value(|input| match input {
                    Input::Counts(which) => counts[which][row],
                    Input::Scale(before) => results[before],
                });
            }
            results.last().copied().unwrap_or(f64::NAN)
        };
        (0..rows).map(value).collect()
    }
}

impl Scale {
    fn of(properties: &Properties, counts: &[u32], index: usize) -> Result<Self, String> {
        let input = |source: u32| match counts.iter().position(|&of| of == source) {
            Some(which) => Ok(Input::Counts(which)),
            None if source == COUNTS && counts.len() == 1 => Ok(Input::Counts(0)),
            None if (source as usize) < index => Ok(Input::Scale(source as usize)),
            None => Err(format!("its scale {index} takes {source}, which is no scale before it")),
        };
        let prefix = format!("NI_Scale[{index}]_");
        let Some(kind) = properties.get(&format!("{prefix}Scale_Type")).and_then(Property::text) else {
            // The counts themselves have no properties.
            return Ok(Self { law: Law::Same, inputs: vec![input(index as u32)?] });
        };
        let given = Given { properties, prefix: format!("{prefix}{kind}_") };
        let law = match kind {
            "AdvancedAPI" => Law::Same,
            "Linear" => Law::Polynomial(vec![given.number("Y_Intercept")?, given.number("Slope")?]),
            "Polynomial" => {
                let size = given.number_or("Coefficients_Size", 4.0);
                Law::Polynomial(given.list("Coefficients", size)?)
            }
            "Table" => given.table()?,
            "RTD" => Law::Resistance(Resistance::of(&given)?),
            "Thermistor" => Law::Thermistor(Thermistor::of(&given)?),
            "Thermocouple" => {
                let number = given.number("Thermocouple_Type")?;
                let thermocouple =
                    Thermocouple::of(number).ok_or_else(|| format!("its thermocouple is of type {number}"))?;
                let is_voltage = given.number_or("Scaling_Direction", 0.0) == 1.0;
                if is_voltage { Law::Voltage(thermocouple) } else { Law::Temperature(thermocouple) }
            }
            "Add" => Law::Sum,
            "Subtract" => Law::Difference,
            other => return Err(format!("its scale is of kind '{other}', which gives no temperature")),
        };
        let sources = match law {
            Law::Sum | Law::Difference => {
                vec![given.number("Left_Operand_Input_Source")?, given.number("Right_Operand_Input_Source")?]
            }
            _ => vec![given.number_or("Input_Source", f64::from(COUNTS))],
        };
        let inputs = sources.into_iter().map(|source| input(source as u32)).collect::<Result<_, _>>()?;
        Ok(Self { law, inputs })
    }

    fn value(&self, of: impl Fn(Input) -> f64) -> f64 {
        let x = of(self.inputs[0]);
        match &self.law {
            Law::Same => x,
            Law::Polynomial(coefficients) => polynomial(coefficients, x),
            Law::Table(points) => interpolated(points, x),
            Law::Resistance(resistance) => resistance.temperature_c(x),
            Law::Thermistor(thermistor) => thermistor.temperature(x),
            Law::Temperature(thermocouple) => thermocouple.temperature_c(x / 1000.0),
            Law::Voltage(thermocouple) => 1000.0 * thermocouple.emf_mv(x),
            Law::Sum => x + of(self.inputs[1]),
            // From the right one the left one is taken: so do the programs of National Instruments.
            Law::Difference => of(self.inputs[1]) - x,
        }
    }
}

/// The properties of one scale.
struct Given<'a> {
    properties: &'a Properties,
    prefix: String,
}

impl Given<'_> {
    fn number(&self, name: &str) -> Result<f64, String> {
        let name = format!("{}{name}", self.prefix);
        self.properties.get(&name).and_then(Property::number).ok_or_else(|| format!("its scale has no '{name}'"))
    }

    fn number_or(&self, name: &str, otherwise: f64) -> f64 {
        self.number(name).unwrap_or(otherwise)
    }

    fn list(&self, name: &str, size: f64) -> Result<Vec<f64>, String> {
        (0..size as usize).map(|index| self.number(&format!("{name}[{index}]"))).collect()
    }

    fn table(&self) -> Result<Law, String> {
        let list = |name: &str| self.list(name, self.number(&format!("{name}_Size"))?);
        let mut points: Vec<(f64, f64)> = list("Pre_Scaled_Values")?.into_iter().zip(list("Scaled_Values")?).collect();
        if points.first().is_some_and(|first| points.last().is_some_and(|last| last.0 < first.0)) {
            points.reverse();
        }
        let is_rising = points.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if points.is_empty() || !is_rising {
            return Err("its table of a scale neither rises nor falls".to_owned());
        }
        Ok(Law::Table(points))
    }
}

/// A resistance thermometer that a current is sent through: Callendar and Van Dusen,
/// `R = R0 (1 + a T + b T² + c (T - 100) T³)`, the last term below 0 °C only.
#[derive(Clone, Debug)]
struct Resistance {
    current_a: f64,
    at_zero_ohm: f64,
    a: f64,
    b: f64,
    c: f64,
    leads_ohm: f64,
}

impl Resistance {
    fn of(given: &Given<'_>) -> Result<Self, String> {
        Ok(Self {
            current_a: given.number("Current_Excitation")?,
            at_zero_ohm: given.number("R0_Nominal_Resistance")?,
            a: given.number("A")?,
            b: given.number("B")?,
            c: given.number("C")?,
            leads_ohm: leads_ohm(given, CURRENT_EXCITATION)?,
        })
    }

    fn temperature_c(&self, volts: f64) -> f64 {
        const STEPS: usize = 8;
        let Self { a, b, c, .. } = *self;
        let ratio = (volts / self.current_a - self.leads_ohm) / self.at_zero_ohm;
        let above = (-a + (a * a - 4.0 * b * (1.0 - ratio)).sqrt()) / (2.0 * b);
        if ratio >= 1.0 {
            return above;
        }
        // The last term makes 3 K at -200 °C: Newton's steps begin without it.
        (0..STEPS).fold(above, |t, _| {
            let excess = 1.0 + a * t + b * t * t + c * (t - BOILING_C) * t.powi(3) - ratio;
            t - excess / (a + 2.0 * b * t + c * (4.0 * t.powi(3) - 3.0 * BOILING_C * t * t))
        })
    }
}

/// A thermistor: Steinhart and Hart, `1/T = a + b ln R + c (ln R)³`, less an offset that makes °C of K.
#[derive(Clone, Debug)]
struct Thermistor {
    /// A, or V over the divider.
    excitation: f64,
    /// Ω of the other resistor of the divider; none where a current is sent through.
    divider_ohm: Option<f64>,
    leads_ohm: f64,
    coefficients: [f64; 4],
    offset: f64,
}

impl Thermistor {
    fn of(given: &Given<'_>) -> Result<Self, String> {
        let kind = given.number("Excitation_Type")?;
        let divider_ohm = given.number("R1_Reference_Resistance")?;
        Ok(Self {
            excitation: given.number("Excitation_Value")?,
            divider_ohm: (kind != CURRENT_EXCITATION).then_some(divider_ohm),
            leads_ohm: leads_ohm(given, kind)?,
            coefficients: [given.number("A")?, given.number("B")?, 0.0, given.number("C")?],
            offset: given.number("Temperature_Offset")?,
        })
    }

    fn temperature(&self, volts: f64) -> f64 {
        let with_leads = match self.divider_ohm {
            Some(divider_ohm) => divider_ohm / (self.excitation / volts - 1.0),
            None => volts / self.excitation,
        };
        1.0 / polynomial(&self.coefficients, (with_leads - self.leads_ohm).ln()) - self.offset
    }
}

/// Resistance of the leads that is measured with the sensor's: of one with three wires, of both with two.
fn leads_ohm(given: &Given<'_>, excitation: f64) -> Result<f64, String> {
    let wires = given.number("Resistance_Configuration")?;
    let one = given.number("Lead_Wire_Resistance")?;
    Ok(match wires {
        3.0 => one,
        2.0 if excitation == CURRENT_EXCITATION => 2.0 * one,
        _ => 0.0,
    })
}

fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|point| point.0 <= x);
    match (after.checked_sub(1).map(|before| points[before]), points.get(after)) {
        _ if x.is_nan() => x,
        (Some((x0, y0)), Some(&(x1, y1))) => (y1 - y0) / (x1 - x0) * (x - x0) + y0,
        (Some((_, y)), None) | (None, Some(&(_, y))) => y,
        (None, None) => f64::NAN,
    }
}
