//! The numbers that effects have, in plain words.

use twinlag::diagnosis::Identifier;

use super::Explanation;

/// What a number is, and the effects that have it.
const NUMBERS: [(&str, &str, &[Identifier]); 29] = [
    (
        "gain",
        "by how many kelvins the second channel changes where the first changes by one, both at rest",
        &[Identifier::CALIBRATION],
    ),
    (
        "offset",
        "what the second channel reads more than the first, K: at 0 °C where a gain is found with it; of a drift, in the middle of the \
         record",
        &[Identifier::CALIBRATION, Identifier::DRIFT],
    ),
    (
        "curvature",
        "κ in κ (T − curvature_about)², which the second channel reads more than a straight line, 1/K, before its gain",
        &[Identifier::CALIBRATION],
    ),
    (
        "curvature-of-first",
        "κ in κ (T − curvature_about)², which the first channel reads more than a straight line, 1/K",
        &[Identifier::CALIBRATION],
    ),
    (
        "curvature-about",
        "the mean temperature of the record that a curvature was found in, °C",
        &[Identifier::CALIBRATION],
    ),
    (
        "curvature-variance",
        "the variance of the temperatures of that record, K²: what a curvature adds is zero in the mean over it",
        &[Identifier::CALIBRATION],
    ),
    (
        "curvature-skew",
        "the third moment of the temperatures of that record over their variance, K: gain and offset are those of the straight line \
         through it",
        &[Identifier::CALIBRATION],
    ),
    ("drift", "how fast the offset of the second channel from the first rises, K/s", &[Identifier::DRIFT]),
    ("delay", "how much later the second channel is, s; negative where it is the earlier one", &[Identifier::DELAY]),
    (
        "frequency",
        "that of a line in one channel, Hz: one above half the sample rate shows at another frequency, below it",
        &[Identifier::MAINS_PICKUP],
    ),
    ("amplitude", "that of a line in one channel, K, from its cosine and its sine", &[Identifier::MAINS_PICKUP]),
    (
        "cosine-amplitude",
        "that of the cosine of a line, K, in time from the start of the record",
        &[Identifier::MAINS_PICKUP],
    ),
    (
        "sine-amplitude",
        "that of the sine of a line, K, in time from the start of the record",
        &[Identifier::MAINS_PICKUP],
    ),
    (
        "second-time-constant",
        "the smaller of two time constants of one sensor in series, s",
        &[Identifier::SECOND_ORDER],
    ),
    (
        "share",
        "the part of a reading that follows through a slow body; or the part of the other channel that one reads beside its own",
        &[Identifier::SLOW_MODE, Identifier::CROSSTALK],
    ),
    ("slow-time-constant", "that of the slow body, s", &[Identifier::SLOW_MODE]),
    (
        "neutral-temperature",
        "the temperature of the other channel, °C, at which crosstalk adds nothing",
        &[Identifier::CROSSTALK],
    ),
    (
        "exponent",
        "the power of the measured flow, or of the absolute temperature, with which time constants change",
        &[Identifier::VARYING_TIME_CONSTANT, Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT],
    ),
    (
        "m1",
        "a coefficient of the cubic B-spline in time, of mean zero, that is the relative change of both time constants: that of its second \
         knot, with 'm2' and so on of the next ones. The change at a knot is a mean over three of them, and not the number itself",
        &[Identifier::VARYING_TIME_CONSTANT],
    ),
    (
        "gas-share",
        "the part of the gas temperature in the temperature that time constants follow: 0 is the sensor's own, ½ that of the film",
        &[Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT],
    ),
    (
        "mean-temperature",
        "the temperature, °C, at which time constants are those that are given, or at which numbers of radiation are meant",
        &[Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, Identifier::RADIATION],
    ),
    (
        "radiative-conductance",
        "the heat that a sensor exchanges with the walls for each kelvin over that with the gas, at the mean temperature",
        &[Identifier::RADIATION],
    ),
    (
        "radiative-loss",
        "how much colder than the gas a sensor is through radiation, K, at the mean temperature; negative where it is hotter",
        &[Identifier::RADIATION],
    ),
    (
        "noise-std",
        "the standard deviation of coloured noise, K: of one channel, or of the difference between the gas that either sensor sees",
        &[Identifier::COLOURED_NOISE, Identifier::INPUT_MISMATCH],
    ),
    (
        "correlation-time",
        "the time after which coloured noise has lost most of its memory, s",
        &[Identifier::COLOURED_NOISE, Identifier::INPUT_MISMATCH],
    ),
    (
        "delay-at-mean-flow",
        "how much later the second sensor sees the gas, s, at the geometric mean of the flow or speed; of sensors that move, while the \
         position grows. Negative where it is the earlier one",
        &[Identifier::SEPARATION],
    ),
    (
        "mean-flow",
        "the geometric mean of the measured flow, in its unit, over the records in which the effect was found: delays and time constants \
         hold at that flow",
        &[Identifier::SEPARATION, Identifier::VARYING_TIME_CONSTANT],
    ),
    (
        "mean-speed",
        "the geometric mean of the speed at which the sensors move, m/s, over the records in which the effect was found: delays and time \
         constants hold at that speed",
        &[Identifier::SEPARATION, Identifier::VARYING_TIME_CONSTANT],
    ),
    (
        "distance",
        "how far the second sensor is behind the first along their own motion while the position grows, m; negative where it is ahead",
        &[Identifier::SEPARATION],
    ),
];

pub(super) fn explanations() -> impl Iterator<Item = Explanation> {
    NUMBERS.into_iter().map(|(name, text, effects)| {
        let effects: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
        Explanation {
            name,
            kind: "number",
            text: vec![text.to_owned(), format!("a number of: {}", effects.join(", "))],
        }
    })
}

/// The name under which a number is explained: coefficients of a spline are explained by the first.
pub(super) fn explained(name: &str) -> &str {
    let is_coefficient = name.strip_prefix('m').is_some_and(|place| place.parse::<u8>().is_ok());
    if is_coefficient { "m1" } else { name }
}
