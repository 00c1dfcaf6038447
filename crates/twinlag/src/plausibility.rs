//! Whether time constants are plausible, from what is known of the sensors' sizes and of the flow.

use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinlag_convection::{Body, Expected, Flow};
use twinlag_cross_relation::Parameter;
use twinlag_estimate::Known;

use crate::answers::{PlausibleTimeConstant, SensorEstimate};
use crate::error::Error;
use crate::options::Options;
use crate::setting::Setting;

/// Standard deviations to either end of a 95 % range.
const DEVIATIONS_95: f64 = 1.96;

/// What is typical of the time constant of one sensor.
///
/// As text it is `T1` or `T2`, `=`, and a body ([`Body`]) or a range in s or ms that holds 95 % of such sensors:
/// `T1=thermocouple:0.5mm`, `T2=0.2..0.6s`.
///
/// ```
/// use twinlag::{Typical, TypicalSensor};
///
/// let typical: TypicalSensor = "T2=200..600ms".parse()?;
/// assert_eq!((typical.sensor, typical.typical), (1, Typical::Range { low_s: 0.2, high_s: 0.6 }));
/// assert!("T2=600..200ms".parse::<TypicalSensor>().is_err());
/// # Ok::<(), twinlag::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TypicalSensor {
    /// 0 or 1.
    pub sensor: usize,
    /// What is typical of it.
    pub typical: Typical,
}

/// A range of time constants, or a body that has one in a flow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Typical {
    /// From `low_s` to `high_s`, in 95 of 100 such sensors.
    Range {
        /// The short end, s.
        low_s: f64,
        /// The long end, s.
        high_s: f64,
    },
    /// A body, whose time constant follows from the flow.
    Body(Body),
}

impl FromStr for TypicalSensor {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = |expected: &str| Error::Setting {
            setting: Setting::Typical,
            expected: expected.into(),
            got: text.into(),
            also: Vec::new(),
        };
        let (name, what) =
            text.split_once('=').ok_or_else(|| wrong("a sensor, = and what it is, as in T1=thermocouple:0.5mm"))?;
        let sensor = match name.trim() {
            "T1" => 0,
            "T2" => 1,
            _ => return Err(wrong("T1 or T2 before the =")),
        };
        let Some((low, high)) = what.split_once("..") else {
            return Ok(Self { sensor, typical: Typical::Body(what.trim().parse()?) });
        };
        let (high, over) = match high.trim().strip_suffix("ms") {
            Some(high) => (high, 1e3),
            None => (high.trim().strip_suffix('s').unwrap_or(high), 1.0),
        };
        let time_s = |text: &str| text.trim().parse::<f64>().ok().filter(|s| s.is_finite() && *s > 0.0);
        match (time_s(low), time_s(high)) {
            (Some(low), Some(high)) if low < high => {
                Ok(Self { sensor, typical: Typical::Range { low_s: low / over, high_s: high / over } })
            }
            _ => Err(wrong("LOW..HIGH in s or ms, LOW the smaller and above 0, as in T1=0.2..0.6s")),
        }
    }
}

/// What time constants are expected to be, before a record says what they are.
///
/// An expected value enters the estimate as something known with a standard deviation ([`Plausibility::with`]), and the answer
/// is held against it ([`Plausibility::judge`]).
///
/// ```
#[doc = include_str!("example.txt")]
/// use twinlag::Plausibility;
/// use twinlag::convection::Flow;
///
/// // Sensors of 120 and 450 ms, of which one is said to be a wire of 0.1 mm in air at 5 m/s.
/// let typical = ["T1=wire:0.1mm".parse()?];
/// let flow: Flow = "air@5m/s".parse()?;
/// let plausibility = Plausibility::new(&typical, Some(&flow), 300.0)?;
/// let answer = twinlag::characterise(&record, &plausibility.with(Options::default())?)?;
/// let [judged] = &plausibility.judge(&answer.sensors)[..] else { panic!("one is judged") };
/// assert_eq!(judged.is_outside, Some(false), "{judged:?}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plausibility {
    expected: Vec<OfSensor>,
}

/// What is expected of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OfSensor {
    sensor: usize,
    value_s: f64,
    std_s: f64,
    /// What it was computed from, where it was not given.
    computed: Option<Expected>,
}

impl Plausibility {
    /// What `typical` sensors are expected to have.
    ///
    /// - `temperature_c`: the mean of the readings, at which properties of the fluid are taken where it has no temperature of its own
    ///
    /// # Errors
    /// [`Error::Setting`] for a sensor that is named twice, a body without a flow, a flow without a body;
    /// [`Error::Convection`] where the correlations do not reach.
    pub fn new(typical: &[TypicalSensor], flow: Option<&Flow>, temperature_c: f64) -> Result<Self, Error> {
        let name = |sensor: usize| format!("T{}", sensor + 1);
        for (at, one) in typical.iter().enumerate() {
            if typical[..at].iter().any(|other| other.sensor == one.sensor) {
                return wrong(Setting::Typical, "each sensor once", name(one.sensor), &[]);
            }
        }
        let is_body = |one: &TypicalSensor| matches!(one.typical, Typical::Body(_));
        if let Some(flow) = flow.filter(|_| !typical.iter().any(is_body)) {
            let expected = "a sensor of a given size beside it, as in T1=thermocouple:0.5mm";
            return wrong(Setting::Fluid, expected, flow.to_string(), &[Setting::Typical]);
        }
        let of = |one: &TypicalSensor| {
            let (value_s, std_s, computed) = match one.typical {
                Typical::Range { low_s, high_s } => {
                    (0.5 * (low_s + high_s), 0.5 * (high_s - low_s) / DEVIATIONS_95, None)
                }
                Typical::Body(body) => {
                    let Some(flow) = flow else {
                        let expected = "what flows around it and how fast, as in air@20m/s";
                        return wrong(Setting::Fluid, expected, format!("{body} alone"), &[Setting::Typical]);
                    };
                    let expected = Expected::of(&body, flow, temperature_c)?;
                    (expected.time_constant_s, expected.std_s, Some(expected))
                }
            };
            Ok(OfSensor { sensor: one.sensor, value_s, std_s, computed })
        };
        Ok(Self { expected: typical.iter().map(of).collect::<Result<_, _>>()? })
    }

    /// `options` that know what is expected.
    ///
    /// # Errors
    /// [`Error::Setting`] where they know a time constant already.
    pub fn with(&self, mut options: Options) -> Result<Options, Error> {
        for one in &self.expected {
            let parameter = [Parameter::Tau1, Parameter::Tau2][one.sensor];
            if let Some(known) = options.known(parameter) {
                let expected = "a sensor whose time constant is not known besides";
                return wrong(Setting::Typical, expected, known.to_string(), &[Setting::Known]);
            }
            options.known.push(Known { parameter, value: one.value_s, std: Some(one.std_s) });
        }
        Ok(options)
    }

    /// How the time constants of `sensors` compare with what is expected.
    pub fn judge(&self, sensors: &[SensorEstimate; 2]) -> Vec<PlausibleTimeConstant> {
        let judged = |one: &OfSensor| {
            let sensor = &sensors[one.sensor];
            let range_95_s = [-1.0, 1.0].map(|sign| (one.value_s + sign * DEVIATIONS_95 * one.std_s).max(0.0));
            let found_s = sensor.time_constant_s;
            // Both the range and the interval are of 95 %.
            let is_outside = sensor
                .interval_95_s
                .or(found_s.map(|s| [s; 2]))
                .map(|[low, high]| high < range_95_s[0] || low > range_95_s[1]);
            let would_take = found_s.zip(one.computed).map(|(s, computed)| computed.would_take(s));
            PlausibleTimeConstant {
                channel: sensor.channel.clone(),
                expected_s: one.value_s,
                range_95_s,
                from: from(one),
                found_s,
                is_outside,
                would_take: would_take.filter(|_| is_outside == Some(true)),
            }
        };
        self.expected.iter().map(judged).collect()
    }
}

/// What an expected value follows from, for the reader.
fn from(one: &OfSensor) -> String {
    let Some(Expected { body, flow, temperature_c, correlation, numbers, .. }) = &one.computed else {
        return "the range that was given".into();
    };
    format!(
        "{body} in {flow}, properties at {temperature_c:.0} °C, {} with a Reynolds number of {:.3}",
        correlation.source(),
        numbers.reynolds
    )
}

fn wrong<T>(setting: Setting, expected: &str, got: String, also: &[Setting]) -> Result<T, Error> {
    Err(Error::Setting { setting, expected: expected.into(), got, also: also.to_vec() })
}
