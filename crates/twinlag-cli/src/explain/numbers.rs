//! The numbers that effects have, in plain words.

use twinlag::diagnosis::Identifier;

use super::Explanation;

/// What a number is, and the effects that have it.
const NUMBERS: [(&str, &str, &[Identifier]); 19] = [
    (
        "gain",
        "by how many kelvins the second channel changes where the first changes by one, both at rest",
        &[Identifier::CALIBRATION],
    ),
    (
        "offset",
        "what the second channel reads more than the first, K: of a calibration at 0 °C, beside its gain; of a drift in the middle of \
         the record",
        &[Identifier::CALIBRATION, Identifier::DRIFT, Identifier::CROSSTALK],
    ),
    (
        "curvature",
        "how the second channel bends away from a straight line over temperature, 1/K",
        &[Identifier::CALIBRATION],
    ),
    (
        "curvature-of-first",
        "how the first channel bends away from a straight line over temperature, 1/K",
        &[Identifier::CALIBRATION],
    ),
    (
        "frequency",
        "that of a line in one channel, Hz: one above half the sample rate shows at another frequency, below it",
        &[Identifier::MAINS_PICKUP],
    ),
    ("amplitude", "that of a line in one channel, K, from its cosine and its sine", &[Identifier::MAINS_PICKUP]),
    ("second-time-constant", "that of a second lag in series with the first, s", &[Identifier::SECOND_ORDER]),
    (
        "share",
        "the part of a reading that follows through a slow body, or the part of the other channel that one picks up",
        &[Identifier::SLOW_MODE, Identifier::CROSSTALK],
    ),
    ("slow-time-constant", "that of the slow body, s", &[Identifier::SLOW_MODE]),
    (
        "exponent",
        "the power of the measured flow, or of the absolute temperature, with which time constants change",
        &[Identifier::VARYING_TIME_CONSTANT, Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT],
    ),
    (
        "m1",
        "the relative change of the time constants at the second knot of a spline along the record; 'm2' and so on at the next ones",
        &[Identifier::VARYING_TIME_CONSTANT],
    ),
    (
        "gas-share",
        "the part of the gas temperature in the temperature that time constants follow: 0 is the sensor's own, ½ that of the film",
        &[Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT],
    ),
    (
        "film-temperature",
        "the mean temperature of gas and sensor: time constants that follow it have a gas share of ½",
        &[Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT],
    ),
    (
        "radiative-conductance",
        "the heat that a sensor exchanges with the walls for each kelvin over that with the gas, at the mean temperature",
        &[Identifier::RADIATION],
    ),
    (
        "radiative-loss",
        "by how much a sensor departs from the gas through radiation, K, at the mean temperature",
        &[Identifier::RADIATION],
    ),
    (
        "noise-std",
        "the standard deviation of coloured noise, K",
        &[Identifier::COLOURED_NOISE, Identifier::INPUT_MISMATCH],
    ),
    (
        "correlation-time",
        "the time after which coloured noise has lost most of its memory, s",
        &[Identifier::COLOURED_NOISE, Identifier::INPUT_MISMATCH],
    ),
    (
        "delay-at-mean-flow",
        "how much later the second sensor sees the gas at the mean flow, s",
        &[Identifier::SEPARATION],
    ),
    ("distance", "how far apart the sensors stand along the flow or their own motion, m", &[Identifier::SEPARATION]),
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
