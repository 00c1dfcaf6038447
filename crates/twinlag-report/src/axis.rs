//! Axes: what a reader sees ([`Axis`]), and the ruler that turns values into pixels and finds round
//! ticks.

use crate::ReportError;
use crate::canvas::text_width;

/// Size of tick labels, in pixels.
pub(crate) const TICK_SIZE: u32 = 12;

/// How values are laid out along an axis.
#[derive(Clone, Debug, PartialEq)]
enum Scale {
    Linear,
    Logarithmic,
    Categories(Vec<String>),
}

/// An axis: its label, unit included, its scale and, if wanted, its range.
///
/// ```
/// use twinlag_report::Axis;
///
/// let noise = Axis::logarithmic("noise (K)").range(1e-3, 1.0);
/// let method = Axis::categories("", ["plain", "whitened"]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    label: String,
    scale: Scale,
    range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis; its range is that of the data, unless [`Axis::range`] says otherwise.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Linear, range: None }
    }

    /// A logarithmic axis. Values that are not positive are gaps.
    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Logarithmic, range: None }
    }

    /// An axis of named places: the first is at 0, the next at 1, and so on. For the `x` axis of
    /// charts.
    pub fn categories<S: Into<String>>(label: impl Into<String>, names: impl IntoIterator<Item = S>) -> Self {
        let names = names.into_iter().map(Into::into).collect();
        Self { label: label.into(), scale: Scale::Categories(names), range: None }
    }

    /// Shows the values from `low` to `high`; what lies outside is cut off.
    #[must_use]
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some((low, high)), ..self }
    }

    /// The range that was asked for.
    pub(crate) fn given_range(&self) -> Option<(f64, f64)> {
        self.range
    }

    pub(crate) fn label(&self) -> &str {
        &self.label
    }

    pub(crate) fn is_logarithmic(&self) -> bool {
        self.scale == Scale::Logarithmic
    }

    /// Whether the axis has a place for a value.
    pub(crate) fn shows(&self, value: f64) -> bool {
        value.is_finite() && (value > 0.0 || !self.is_logarithmic())
    }

    /// What is linear along the axis.
    pub(crate) fn position(&self, value: f64) -> f64 {
        if self.is_logarithmic() { value.log10() } else { value }
    }

    /// The range to draw: the user's, or that of `values` with a margin except at the base
    /// (`floor`).
    ///
    /// `None` if there is no range and no value to show.
    pub(crate) fn limits(
        &self,
        values: impl Iterator<Item = f64>,
        margin: f64,
        floor: Option<f64>,
    ) -> Result<Option<(f64, f64)>, ReportError> {
        if let Some((low, high)) = self.range {
            let fits = self.shows(low) && self.shows(high) && low < high;
            return if fits {
                Ok(Some((low, high)))
            } else {
                Err(ReportError::Range { axis: self.label.clone(), low, high })
            };
        }
        if let Scale::Categories(names) = &self.scale {
            return Ok((!names.is_empty()).then(|| (-0.5, names.len() as f64 - 0.5)));
        }
        let (low, high) = values
            .filter(|v| self.shows(*v))
            .map(|v| self.position(v))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            return Ok(None);
        }
        // A single value gets a decade about it, or as much again as itself.
        let least = if self.is_logarithmic() { 1e-6 } else { f64::max(1e-9, 1e-6 * low.abs().max(high.abs())) };
        let pad = if high - low > least {
            margin * (high - low)
        } else if self.is_logarithmic() {
            0.5
        } else if high == 0.0 {
            1.0
        } else {
            0.1 * high.abs()
        };
        let floor = floor.map(|f| self.position(f));
        let low = if floor == Some(low) { low } else { low - pad };
        let high = if floor == Some(high) { high } else { high + pad };
        Ok(Some(if self.is_logarithmic() { (10_f64.powf(low), 10_f64.powf(high)) } else { (low, high) }))
    }

    pub(crate) fn ticks(&self, (low, high): (f64, f64), spacing: Spacing) -> Vec<Tick> {
        let mut ticks = match &self.scale {
            Scale::Linear => linear_ticks(low, high, spacing.at_most(46.0)),
            Scale::Logarithmic => logarithmic_ticks(low, high, spacing.at_most(62.0)),
            Scale::Categories(names) => {
                names.iter().enumerate().map(|(i, name)| Tick { value: i as f64, label: name.clone() }).collect()
            }
        };
        if let (Spacing::Across(length), Scale::Linear | Scale::Logarithmic) = (spacing, &self.scale) {
            thin(&mut ticks, |value| {
                (self.position(value) - self.position(low)) / (self.position(high) - self.position(low)) * length
            });
        }
        ticks
    }

    pub(crate) fn has_categories(&self) -> bool {
        matches!(self.scale, Scale::Categories(_))
    }
}

/// A tick; a minor one has no label.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// The room that ticks have: pixels along the axis, labels side by side (`Across`) or one below the
/// other (`Down`).
#[derive(Clone, Copy, Debug)]
pub(crate) enum Spacing {
    Across(f64),
    Down(f64),
}

impl Spacing {
    fn at_most(self, each_across: f64) -> usize {
        let (length, each) = match self {
            Self::Across(length) => (length, each_across),
            Self::Down(length) => (length, 30.0),
        };
        ((length / each) as usize).max(2)
    }
}

/// Values to pixels.
#[derive(Clone, Debug)]
pub(crate) struct Ruler {
    axis: Axis,
    low: f64,
    high: f64,
    from_px: f64,
    to_px: f64,
}

impl Ruler {
    pub(crate) fn new(axis: &Axis, (low, high): (f64, f64), from_px: f64, to_px: f64) -> Self {
        Self { low: axis.position(low), high: axis.position(high), from_px, to_px, axis: axis.clone() }
    }

    /// The pixel of a value; not finite where the axis has no place for it.
    pub(crate) fn px(&self, value: f64) -> f64 {
        if self.axis.shows(value) { self.px_of_position(self.axis.position(value)) } else { f64::NAN }
    }

    fn px_of_position(&self, position: f64) -> f64 {
        self.from_px + (position - self.low) / (self.high - self.low) * (self.to_px - self.from_px)
    }

    /// The pixel of the base of bars: zero, or the lower end of a logarithmic axis, brought into
    /// the axis.
    pub(crate) fn base_px(&self) -> f64 {
        self.px_of_position(if self.axis.is_logarithmic() { self.low } else { 0.0_f64.clamp(self.low, self.high) })
    }
}

/// Takes away labels, least important first, until no two stand closer than 10 px: those not of a
/// power of ten go first.
fn thin(ticks: &mut [Tick], px: impl Fn(f64) -> f64) {
    let crowded = |ticks: &[Tick]| {
        let labelled: Vec<&Tick> = ticks.iter().filter(|t| !t.label.is_empty()).collect();
        labelled.windows(2).any(|pair| {
            let half = |t: &Tick| text_width(&t.label, TICK_SIZE) / 2.0;
            px(pair[1].value) - half(pair[1]) - px(pair[0].value) - half(pair[0]) < 10.0
        })
    };
    if !crowded(ticks) {
        return;
    }
    let powers = ticks.iter().filter(|t| !t.label.is_empty() && is_power_of_ten(t.value)).count();
    // Few powers of ten: a linear axis, or a short logarithmic one. There, every other label goes.
    for (k, tick) in ticks.iter_mut().filter(|t| !t.label.is_empty()).enumerate() {
        if if powers >= 2 { !is_power_of_ten(tick.value) } else { k % 2 == 1 } {
            tick.label.clear();
        }
    }
    if powers >= 2 && crowded(ticks) {
        for tick in ticks.iter_mut().filter(|t| !t.label.is_empty()).skip(1).step_by(2) {
            tick.label.clear();
        }
    }
}

fn is_power_of_ten(value: f64) -> bool {
    value > 0.0 && (value.log10() - value.log10().round()).abs() < 1e-9
}

/// Multiples of 1, 2 or 5 times a power of ten, at most `at_most` or so.
fn linear_ticks(low: f64, high: f64, at_most: usize) -> Vec<Tick> {
    let rough = (high - low) / at_most as f64;
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|s| *s >= rough * 0.999).unwrap_or(rough);
    let decimals = (-step.log10().floor() + 1e-9).max(0.0) as usize;
    let largest = low.abs().max(high.abs());
    let (first, last) = ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor());
    // More than some ten ticks cannot come of `at_most`, unless the range is lost in rounding.
    (0..=(last - first).clamp(0.0, 100.0) as usize)
        .map(|k| {
            let value = (first + k as f64) * step;
            let label = if largest >= 1e5 || step < 1e-4 {
                scientific(value, largest, step)
            } else {
                minus(&format!("{:.decimals$}", value + 0.0))
            };
            Tick { value, label }
        })
        .collect()
}

/// Over many decades the powers of ten, over few also 2 and 5 times these, over less than one as on
/// a linear axis.
fn logarithmic_ticks(low: f64, high: f64, at_most: usize) -> Vec<Tick> {
    let decades = high.log10() - low.log10();
    if decades < 0.7 {
        return linear_ticks(low, high, at_most);
    }
    let (first, last) = ((low.log10() - 1e-9).floor() as i32, (high.log10() + 1e-9).ceil() as i32);
    let all_plain = low >= 0.9e-3 && high <= 1.1e4;
    let every = (decades / at_most as f64).ceil().max(1.0) as i32;
    let mut ticks = Vec::new();
    for exponent in first..=last {
        for digit in 1..10 {
            let value = f64::from(digit) * 10_f64.powi(exponent);
            if value < low * (1.0 - 1e-9) || value > high * (1.0 + 1e-9) {
                continue;
            }
            let labelled = match digit {
                1 => exponent.rem_euclid(every) == 0,
                2 | 5 => decades * 3.0 <= at_most as f64 + 1.5,
                3 => decades * 2.0 <= at_most as f64 + 1.5 && decades * 3.0 > at_most as f64 + 1.5,
                _ => false,
            };
            // Where not even all decades have labels, minor ticks would be a grey bar.
            if !labelled && digit > 1 && every > 1 {
                continue;
            }
            let label = match (labelled, all_plain) {
                (false, _) => String::new(),
                (true, true) => format!("{:.*}", usize::try_from(-exponent).unwrap_or(0), value),
                (true, false) if digit == 1 => format!("10{}", superscript(exponent)),
                (true, false) => format!("{digit}×10{}", superscript(exponent)),
            };
            ticks.push(Tick { value, label });
        }
    }
    ticks
}

/// Replaces the hyphen by a proper minus sign.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}

/// `1.5×10⁻⁵`, with one power of ten for a whole axis, that of its largest value.
fn scientific(value: f64, largest: f64, step: f64) -> String {
    if value.abs() < step / 2.0 {
        return "0".to_owned();
    }
    let exponent = largest.log10().floor() as i32;
    let unit = 10_f64.powi(exponent);
    let decimals = (-(step / unit).log10().floor() + 1e-9).clamp(0.0, 6.0) as usize;
    let mantissa = format!("{:.decimals$}", value / unit);
    minus(&format!("{mantissa}×10{}", superscript(exponent)))
}

pub(crate) fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c.to_digit(10) {
            Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
            None => '⁻',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Axis, Spacing};

    fn labels(axis: &Axis, low: f64, high: f64, spacing: Spacing) -> String {
        let labels: Vec<String> = axis.ticks((low, high), spacing).into_iter().map(|t| t.label).collect();
        labels.into_iter().filter(|l| !l.is_empty()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn ticks_are_round_and_carry_proper_minus_signs() {
        let (linear, logarithmic) = (Axis::linear("x"), Axis::logarithmic("x"));
        for (axis, low, high, want) in [
            (&linear, -4.2, 1.1, "−4 −3 −2 −1 0 1"),
            (&linear, 0.0, 1.0, "0.0 0.2 0.4 0.6 0.8 1.0"),
            (&linear, -0.013, 0.012, "−0.010 −0.005 0.000 0.005 0.010"),
            (&linear, 0.0, 2.3e-5, "0 0.5×10⁻⁵ 1.0×10⁻⁵ 1.5×10⁻⁵ 2.0×10⁻⁵"),
            (&logarithmic, 1e-3, 1.0, "0.001 0.003 0.01 0.03 0.1 0.3 1"),
            (&logarithmic, 1e-6, 1e3, "10⁻⁶ 10⁻⁴ 10⁻² 10⁰ 10²"),
            (&logarithmic, 0.008, 0.12, "0.01 0.02 0.05 0.1"),
            (&logarithmic, 1.0, 4.0, "1.0 1.5 2.0 2.5 3.0 3.5 4.0"),
        ] {
            assert_eq!(labels(axis, low, high, Spacing::Across(420.0)), want, "{low} to {high}");
        }
    }

    #[test]
    fn a_flat_line_gets_room_and_a_bad_range_is_refused() {
        let limits = |axis: Axis, values: &[f64]| axis.limits(values.iter().copied(), 0.05, None);
        assert_eq!(limits(Axis::linear("x"), &[0.0, f64::NAN]), Ok(Some((-1.0, 1.0))));
        assert_eq!(limits(Axis::linear("x"), &[f64::NAN, f64::INFINITY]), Ok(None));
        assert_eq!(limits(Axis::logarithmic("x"), &[-1.0, 0.0]), Ok(None));
        assert!(limits(Axis::logarithmic("x").range(0.0, 1.0), &[]).is_err());
        assert!(limits(Axis::linear("x").range(1.0, 1.0), &[]).is_err());
    }
}
