//! Expected time constants against response times that makers of thermocouples give.

use twinlag_convection::{Body, Expected, Flow};

/// Times that sheathed thermocouples take in air of 2 m/s, s, by diameter in mm: to half of a step as the firm electronic-sensor lists
/// them ("Technische Daten für Mantelthermoelemente"; insulated and welded junctions have the same), and to nine tenths as
/// Toine Hendriks quotes another maker ("Exhaust temperature").
const HALF_S: [(f64, f64); 4] = [(0.5, 1.80), (1.0, 3.00), (1.5, 8.00), (3.0, 23.0)];
const NINE_TENTHS_S: [(f64, f64); 3] = [(0.5, 8.0), (1.0, 17.0), (3.0, 64.0)];

/// How far the logarithms of the listed time constants are from those of the expected ones, in standard deviations.
fn deviations() -> Vec<f64> {
    let flow: Flow = "air@2m/s".parse().expect("well formed");
    let half = HALF_S.map(|(mm, s)| (mm, s / 2.0_f64.ln()));
    let nine_tenths = NINE_TENTHS_S.map(|(mm, s)| (mm, s / 10.0_f64.ln()));
    let deviation = |(mm, listed_s): (f64, f64)| {
        let body: Body = format!("sheath:{mm}mm").parse().expect("well formed");
        let expected = Expected::of(&body, &flow, 20.0).expect("within the correlation");
        (listed_s / expected.time_constant_s).ln() / expected.log_std
    };
    half.into_iter().chain(nine_tenths).map(deviation).collect()
}

/// The standard deviation was taken from these seven values: this holds the code to it. The sum of their squares is a chi-square with
/// seven degrees of freedom, between 1.7 and 16.0 with a probability of 95 %.
#[test]
fn makers_times_scatter_around_the_expected_ones_as_is_stated() {
    let found = deviations();
    let sum: f64 = found.iter().map(|d| d * d).sum();
    assert!(sum > 1.7 && sum < 16.0, "{sum} of {found:?}");
}
