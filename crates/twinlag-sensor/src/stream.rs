//! Sensors sample by sample, in constant memory and without allocation. Each gives exactly the
//! values of the method for a whole record.

use crate::difference::DifferenceEquation;

/// The reading of a [`crate::FirstOrder`] sensor, one gas temperature after the other, held between
/// samples: `y[0] = x[0]`, `y[k] = a y[k−1] + (1 − a) x[k−1]`.
///
/// ```
/// let mut responder = twinlag_sensor::FirstOrder::new(0.0238, 0.002)?.responder();
/// assert_eq!(responder.push(20.0), 20.0); // at rest in the first
/// assert_eq!(responder.push(100.0), 20.0); // 20 °C were held until now
/// assert!((responder.push(100.0) - 26.4).abs() < 0.1); // 8 % of the step in each period
/// # Ok::<(), twinlag_sensor::ModelError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrderResponder {
    input_gain: f64,
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Last {
    gas: f64,
    reading: f64,
}

impl FirstOrderResponder {
    pub(crate) fn new(input_gain: f64) -> Self {
        Self { input_gain, last: None }
    }

    /// Reading at the instant from which on the gas has the temperature `gas` (any unit).
    pub fn push(&mut self, gas: f64) -> f64 {
        let reading = match self.last {
            Some(last) => last.reading + self.input_gain * (last.gas - last.reading),
            None => gas,
        };
        self.last = Some(Last { gas, reading });
        reading
    }
}

/// The gas temperature from the reading of a [`crate::FirstOrder`] sensor, one reading after the
/// other: `f[k−1] = (y[k] − a y[k−1])/(1 − a)`.
///
/// Exact inverse of [`FirstOrderResponder`], one sample later, whatever the state before the first
/// reading. Measurement noise is amplified by `(1 + a²)/(1 − a)²` in variance.
///
/// ```
/// let sensor = twinlag_sensor::FirstOrder::new(0.0238, 0.002)?;
/// let (mut responder, mut inverter) = (sensor.responder(), sensor.inverter());
/// let mut before = None;
/// for gas in [20.0, 20.0, 100.0, 60.0] {
///     let back = inverter.push(responder.push(gas));
///     assert_eq!(back.is_some(), before.is_some());
///     if let (Some(back), Some(before)) = (back, before) {
///         assert!(f64::abs(back - before) < 1e-9);
///     }
///     before = Some(gas);
/// }
/// # Ok::<(), twinlag_sensor::ModelError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrderInverter {
    input_gain: f64,
    last: Option<f64>,
}

impl FirstOrderInverter {
    pub(crate) fn new(input_gain: f64) -> Self {
        Self { input_gain, last: None }
    }

    /// Gas temperature between the reading before and this one (any unit); `None` for the first.
    pub fn push(&mut self, reading: f64) -> Option<f64> {
        let last = self.last.replace(reading)?;
        Some(last + (reading - last) / self.input_gain)
    }
}

/// The reading of any sensor that has a [`DifferenceEquation`], one gas temperature after the
/// other, at rest in the first.
///
/// ```
/// use twinlag_sensor::{Discretisation, Lag, SecondOrder};
///
/// let sensor = SecondOrder::new(0.05, 0.011, 0.004)?;
/// let mut responder = sensor.difference_equation(Discretisation::FirstOrderHold)?.responder();
/// assert!((responder.push(20.0) - 20.0).abs() < 1e-12);
/// let mut reading = 20.0;
/// for _ in 0..200 {
///     reading = responder.push(100.0);
/// }
/// assert!((reading - 100.0).abs() < 1e-4); // sixteen time constants later
/// # Ok::<(), twinlag_sensor::ModelError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EquationResponder {
    equation: DifferenceEquation,
    last: Option<LastTwo>,
}

/// The newest first.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastTwo {
    gas: [f64; 2],
    reading: [f64; 2],
}

impl EquationResponder {
    pub(crate) fn new(equation: DifferenceEquation) -> Self {
        Self { equation, last: None }
    }

    /// Reading at the instant at which the gas has the temperature `gas` (any unit).
    pub fn push(&mut self, gas: f64) -> f64 {
        let last = self.last.unwrap_or(LastTwo { gas: [gas; 2], reading: [gas; 2] });
        let input = weighted(self.equation.numerator(), &[gas, last.gas[0], last.gas[1]]);
        let output = weighted(&self.equation.denominator()[1..], &last.reading);
        let reading = input - output;
        self.last = Some(LastTwo { gas: [gas, last.gas[0]], reading: [reading, last.reading[0]] });
        reading
    }
}

fn weighted(coefficients: &[f64], values: &[f64]) -> f64 {
    coefficients.iter().zip(values).map(|(c, v)| c * v).sum()
}
