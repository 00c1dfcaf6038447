//! Parameters of effects.

use std::fmt;

use twinlag_optimise::Variable;

/// A parameter of an effect.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Parameter {
    /// The name that scripts use.
    pub name: &'static str,
    /// Unit of the number.
    pub unit: &'static str,
    /// Scale and bounds of its fit.
    pub variable: Variable,
    /// Values that it can have at all, where it comes from outside.
    pub domain: Domain,
    /// A number of the rig that it determines: no other effect in the model may do so as well.
    pub determines: Option<Freedom>,
    /// Whether it is how much later channel 2 is, s, as the difference of the time constants is at low frequencies.
    pub is_lateness: bool,
}

impl Parameter {
    /// A parameter of which any finite value is possible, or any positive one where it is scaled by its logarithm.
    pub fn new(name: &'static str, unit: &'static str, variable: Variable) -> Self {
        let is_positive = matches!(variable.scale, twinlag_optimise::Scale::Logarithmic);
        let domain = if is_positive { Domain::Positive } else { Domain::Finite };
        Self { name, unit, variable, domain, determines: None, is_lateness: false }
    }

    /// A parameter that can have only some values.
    #[must_use]
    pub fn within(self, domain: Domain) -> Self {
        Self { domain, ..self }
    }

    /// A parameter that determines a number of the rig.
    #[must_use]
    pub fn determining(self, freedom: Freedom) -> Self {
        Self { determines: Some(freedom), ..self }
    }

    /// The value at which it changes nothing; `None` where none of its values does.
    ///
    /// ```
    /// use twinlag_model::{Domain, Parameter};
    /// use twinlag_optimise::Variable;
    ///
    /// let gain = Parameter::new("gain", "1", Variable::linear("gain", 0.03, 0.2, 5.0)).within(Domain::NotZero);
    /// assert_eq!(gain.neutral(), Some(1.0)); // a factor
    /// let lag = Parameter::new("second_time_constant", "s", Variable::logarithmic("second time constant", 1e-4, 10.0));
    /// assert_eq!(lag.neutral(), None); // positive, however small
    /// ```
    pub fn neutral(&self) -> Option<f64> {
        let neutral = if self.domain == Domain::NotZero { 1.0 } else { 0.0 };
        let is_possible =
            self.domain.contains(neutral) && (self.variable.lower..=self.variable.upper).contains(&neutral);
        is_possible.then_some(neutral)
    }

    /// A parameter that is how much later channel 2 is, s.
    #[must_use]
    pub fn as_lateness(self) -> Self {
        Self { is_lateness: true, ..self }
    }
}

/// Numbers of a rig that more than one effect could determine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Freedom {
    /// What channel 2 reads more than channel 1 at rest, K.
    Offset,
    /// Ratio of both channels' static gains.
    Gain,
}

/// Values that a parameter can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Domain {
    /// Any finite number.
    Finite,
    /// A finite number above 0.
    Positive,
    /// A finite number of 0 or more.
    NotNegative,
    /// A finite number that is not 0.
    NotZero,
    /// A share between −1 and 1.
    Share,
}

impl Domain {
    /// Whether `value` is one of them.
    ///
    /// ```
    /// use twinlag_model::Domain;
    ///
    /// assert!(Domain::Share.contains(-0.5) && !Domain::Share.contains(1.0));
    /// assert!(Domain::NotZero.contains(-2.0) && !Domain::NotZero.contains(0.0));
    /// assert!(!Domain::Finite.contains(f64::NAN));
    /// assert_eq!(Domain::Positive.expected(), "a finite number above 0");
    /// ```
    pub fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::NotZero => value != 0.0,
                Self::Share => value.abs() < 1.0,
            }
    }

    /// What is expected, in words.
    pub fn expected(self) -> &'static str {
        match self {
            Self::Finite => "a finite number",
            Self::Positive => "a finite number above 0",
            Self::NotNegative => "a finite number of 0 or more",
            Self::NotZero => "a finite number that is not 0",
            Self::Share => "a share between -1 and 1",
        }
    }
}

/// A function of an effect's parameters.
pub type OfParameters = Box<dyn Fn(&[f64]) -> f64>;

/// A number that follows from the parameters, and is reported beside them.
pub struct Derived {
    /// The name that scripts use.
    pub name: &'static str,
    /// Unit of the number.
    pub unit: &'static str,
    /// The number from the parameters.
    pub of: OfParameters,
}

impl fmt::Debug for Derived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Derived").field("name", &self.name).field("unit", &self.unit).finish_non_exhaustive()
    }
}

impl Derived {
    /// A number that the parameters do not change: a temperature at which they are what they are.
    pub fn constant(name: &'static str, unit: &'static str, value: f64) -> Self {
        Self { name, unit, of: Box::new(move |_| value) }
    }
}

/// `values` of `parameters`, those beyond a bound on it.
pub(crate) fn inside(parameters: &[Parameter], values: &[f64]) -> Vec<f64> {
    let pairs = values.iter().zip(parameters);
    pairs.map(|(value, p)| value.clamp(p.variable.lower, p.variable.upper)).collect()
}
