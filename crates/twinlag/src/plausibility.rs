//! Whether time constants are plausible, from what is known of the sensors' sizes and of the flow.

use std::str::FromStr;

use twinlag_convection::{Body, Expected, Flow};
use twinlag_cross_relation::Parameter;
use twinlag_estimate::{Estimator, Known};

use crate::answers::{Characterisation, PlausibleTimeConstant, SensorEstimate, Status};
use crate::error::Error;
use crate::options::Options;
use crate::setting::Setting;

/// Standard deviations to either end of a 95 % range.
const DEVIATIONS_95: f64 = 1.96;
/// Standard deviation of the logarithm up to which what is expected of a time constant is taken for knowledge where the record has
/// none: a normal distribution with it has a fiftieth below zero, and one that is wider says little.
const MAX_LOG_STD_OF_KNOWN: f64 = 0.5;

/// What is typical of the time constant of one sensor.
///
/// As text it is `T1` or `T2`, `=`, and a body ([`Body`]) or a range in s or ms that holds 95 % of such sensors:
/// `T1=thermocouple:0.5mm`, `T2=0.2..0.6s`.
///
/// ```
/// use twinlag::TypicalSensor;
///
/// assert_eq!("T2=200..600ms".parse::<TypicalSensor>()?, "T2 = 0.2..0.6 s".parse()?);
/// let error = "T2=600..200ms".parse::<TypicalSensor>().expect_err("the wrong way round");
/// assert!(error.to_string().contains("LOW..HIGH in s or ms"));
/// # Ok::<(), twinlag::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TypicalSensor {
    /// 0 or 1.
    sensor: usize,
    typical: Typical,
}

/// A range of time constants, or a body that has one in a flow.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Typical {
    /// From `low_s` to `high_s`, in 95 of 100 such sensors.
    Range { low_s: f64, high_s: f64 },
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
/// The time constants that the record determines by itself are held against it; of one that the record does not determine, what is
/// expected is taken for knowledge ([`Plausibility::answer`]).
///
/// ```
#[doc = include_str!("example.txt")]
/// use twinlag::Plausibility;
/// use twinlag::convection::Flow;
///
/// // Sensors of 120 and 450 ms. The first is said to be a wire of 0.25 mm in air of 300 °C at 5 m/s.
/// let flow: Flow = "air@5m/s".parse()?;
/// let plausibility = Plausibility::new(&["T1=wire:0.25mm".parse()?], Some(&flow), 300.0)?;
/// let run = |options: Options| twinlag::characterise(&record, &options);
/// let answer = plausibility.answer(Options::default().free("offset")?, run, |answer| answer)?;
/// let [judged] = &answer.plausibility[..] else { panic!("one is judged") };
/// assert_eq!(judged.is_outside, Some(true), "{judged:?}");
/// let [_, thickest_m] = judged.would_take.expect("outside").diameter_m.expect("within the correlation");
/// assert!(thickest_m < 0.25e-3, "{thickest_m}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plausibility {
    expected: Vec<ExpectedOf>,
}

/// What is expected of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ExpectedOf {
    sensor: usize,
    /// The range that holds 95 % of such sensors, s.
    range_95_s: [f64; 2],
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
            let (range_95_s, computed) = match one.typical {
                Typical::Range { low_s, high_s } => ([low_s, high_s], None),
                Typical::Body(body) => {
                    let Some(flow) = flow else {
                        let expected = "what flows around it and how fast, as in air@20m/s";
                        return wrong(Setting::Fluid, expected, format!("{body} alone"), &[Setting::Typical]);
                    };
                    let expected = Expected::of(&body, flow, temperature_c)?;
                    (expected.range_95_s(), Some(expected))
                }
            };
            Ok(ExpectedOf { sensor: one.sensor, range_95_s, computed })
        };
        Ok(Self { expected: typical.iter().map(of).collect::<Result<_, _>>()? })
    }

    /// The answer of `run`, with the time constants that the record determines by itself held against what is expected of them
    /// ([`Characterisation::plausibility`]). Where it does not determine one, and something is expected of it, `run` is asked
    /// again and knows that.
    ///
    /// - `last`: what holds the time constants of an answer
    ///
    /// # Errors
    /// Those of `run`; [`Error::Setting`] where `options` know a time constant that something is expected of.
    pub fn answer<A, E: From<Error>>(
        &self,
        options: Options,
        run: impl Fn(Options) -> Result<A, E>,
        last: impl Fn(&mut A) -> &mut Characterisation,
    ) -> Result<A, E> {
        if let Some(known) = self.expected.iter().find_map(|one| options.known(one.parameter())) {
            let expected = "a sensor whose time constant is not known besides";
            return wrong(Setting::Typical, expected, known.to_string(), &[Setting::Known]).map_err(E::from);
        }
        let mut answer = run(options.clone())?;
        let own = last(&mut answer);
        let mut plausibility: Vec<PlausibleTimeConstant> =
            self.expected.iter().map(|one| one.beside(&own.sensors[one.sensor])).collect();
        let is_undetermined = matches!(own.status, Status::NotIdentifiable | Status::AtBound);
        if is_undetermined && options.estimator == Estimator::Whitened {
            let mut knowing = options;
            for (one, judged) in self.expected.iter().zip(&mut plausibility) {
                judged.is_taken_as_known = judged.found_s.is_none() && one.log_std() <= MAX_LOG_STD_OF_KNOWN;
                knowing.known.extend(judged.is_taken_as_known.then(|| one.known()));
            }
            if plausibility.iter().any(|judged| judged.is_taken_as_known) {
                answer = run(knowing)?;
            }
        }
        last(&mut answer).plausibility = plausibility;
        Ok(answer)
    }
}

impl ExpectedOf {
    fn parameter(&self) -> Parameter {
        [Parameter::Tau1, Parameter::Tau2][self.sensor]
    }

    /// The middle of the range, in the logarithm, s.
    fn value_s(&self) -> f64 {
        let [low_s, high_s] = self.range_95_s;
        (low_s * high_s).sqrt()
    }

    /// Standard deviation of the logarithm.
    fn log_std(&self) -> f64 {
        let [low_s, high_s] = self.range_95_s;
        0.5 * (high_s / low_s).ln() / DEVIATIONS_95
    }

    fn known(&self) -> Known {
        // Reports print it as it is, and no more of it is meant.
        let three_digits = |value: f64| format!("{value:.2e}").parse().unwrap_or(value);
        let std_s = three_digits(self.log_std() * self.value_s());
        Known { parameter: self.parameter(), value: three_digits(self.value_s()), std: Some(std_s) }
    }

    /// This beside what the record says of the sensor.
    fn beside(&self, sensor: &SensorEstimate) -> PlausibleTimeConstant {
        let [shortest_s, longest_s] = self.range_95_s;
        let is_outside = sensor.interval_95_s.map(|[low, high]| high < shortest_s || low > longest_s);
        let would_take = sensor.time_constant_s.zip(self.computed).map(|(s, computed)| computed.would_take(s));
        PlausibleTimeConstant {
            channel: sensor.channel.clone(),
            expected_s: self.value_s(),
            range_95_s: self.range_95_s,
            basis: self.basis(),
            found_s: sensor.time_constant_s,
            found_interval_95_s: sensor.interval_95_s,
            is_outside,
            would_take: would_take.filter(|_| is_outside == Some(true)),
            is_taken_as_known: false,
        }
    }

    /// What it follows from, for the reader.
    fn basis(&self) -> String {
        let Some(Expected { body, flow, temperature_c, correlation, numbers, .. }) = &self.computed else {
            return "the range that was given".into();
        };
        let properties = match flow.temperature_c {
            Some(_) => String::new(),
            None => format!(" of {temperature_c:.0} °C"),
        };
        let (source, reynolds) = (correlation.source(), numbers.reynolds);
        format!("{body} in {flow}{properties}; {source}, Reynolds number {reynolds:.0}")
    }
}

fn wrong<T>(setting: Setting, expected: &str, got: String, also: &[Setting]) -> Result<T, Error> {
    Err(Error::Setting { setting, expected: expected.into(), got, also: also.to_vec() })
}
