//! The whitened cost with its gradient, and gas temperatures, against fifty digits: `tests/data/oracle.py`, dense matrices by mpmath.

use std::f64::consts::PI;
use std::path::Path;

use serde::Deserialize;
use twinlag::compensation as gas;
use twinlag::cross_relation::{CostError, Form, Readings, Segment, Steps, Whitened};
use twinlag::sensor::Discretisation;

#[derive(Deserialize)]
struct Oracle {
    cases: Vec<Case>,
    gas: Vec<GasCase>,
}

impl Oracle {
    fn stored() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/oracle.json");
        let text = std::fs::read_to_string(path).expect("it is in the repository");
        serde_json::from_str(&text).expect("as the oracle writes it")
    }
}

#[derive(Deserialize)]
struct Case {
    name: String,
    hold: String,
    even: bool,
    steps_s: Vec<f64>,
    y1: Vec<f64>,
    y2: Vec<f64>,
    tau_s: [f64; 2],
    noise_std_k: [f64; 2],
    value: f64,
    gradient: [f64; 2],
}

impl Case {
    fn readings(&self) -> Readings {
        let steps = if self.even { Steps::Even(self.steps_s[0]) } else { Steps::Uneven(self.steps_s.clone()) };
        let segment = Segment::new(self.y1.clone(), self.y2.clone(), steps).expect("sound readings");
        Readings::new(vec![segment]).expect("sound readings")
    }

    fn hold(&self) -> Discretisation {
        match self.hold.as_str() {
            "zero-order-hold" => Discretisation::ZeroOrderHold,
            "bilinear" => Discretisation::Bilinear,
            other => panic!("a hold of the oracle: {other}"),
        }
    }
}

/// What rounding may take of a cost relative to itself: `n κ ε`, the backward error of a solution with V of `n` rows, times the condition
/// of V. For one period its eigenvalues are `1 + a² − 2 a cos(jπ/n)` in one unit, so that `κ ≤ (2n/π)²` however slow the sensors are;
/// steps that differ by a factor `r` multiply it by `r²`.
fn tolerance(case: &Case) -> f64 {
    let n = case.y1.len() as f64;
    let shortest = case.steps_s.iter().copied().fold(f64::INFINITY, f64::min);
    let longest = case.steps_s.iter().copied().fold(0.0, f64::max);
    n * f64::EPSILON * (2.0 * n / PI * longest / shortest).powi(2)
}

#[test]
fn costs_and_gradients_have_the_digits_that_they_should() {
    let cases = Oracle::stored().cases;
    assert_eq!(cases.len(), 28);
    for case in &cases {
        let readings = case.readings();
        let forms: &[Form] = if case.even { &[Form::Spectral, Form::Banded] } else { &[Form::Banded] };
        for form in forms {
            let cost = Whitened::with_form(&readings, case.hold(), case.noise_std_k, *form).expect("a cost");
            let got = cost.evaluate(&case.tau_s);
            let tolerance = tolerance(case);
            // Slopes with respect to the logarithm, whose terms are as large as the cost, or larger.
            let slopes = |gradient: [f64; 2]| [0, 1].map(|i| gradient[i] * case.tau_s[i]);
            let (want, found) = (slopes(case.gradient), slopes(got.gradient));
            let largest = want[0].abs().max(want[1].abs()).max(case.value);
            let of_value = (got.value / case.value - 1.0).abs();
            let of_gradient = (found[0] - want[0]).abs().max((found[1] - want[1]).abs()) / largest;
            let what = format!("{}, {form:?}, relative error within {tolerance:.1e}", case.name);
            assert!(of_value < tolerance, "{what}: cost {} for {}, {of_value:.1e}", got.value, case.value);
            assert!(of_gradient < tolerance, "{what}: slopes {found:?} for {want:?}, {of_gradient:.1e}");
        }
    }
}

/// Failed: of noise of 1e-301 K the cost was infinite, and of 1e-141 K its gradient was wrong.
#[test]
fn noise_whose_powers_are_no_numbers_is_refused() {
    let (y1, y2) = ([1e-300, 3e-300, 2e-300, 1e-300], [1e-300, 2e-300, 2e-300, 2e-300]);
    let readings = Readings::even(&y1, &y2, 0.1).expect("sound readings");
    for noise_std_k in [[1e-301, 0.1], [0.1, 1e-141], [0.1, 1e141]] {
        let refused = Whitened::new(&readings, Discretisation::ZeroOrderHold, noise_std_k);
        assert!(matches!(refused, Err(CostError::OutOfRange { .. })), "{noise_std_k:?}");
    }
}

#[derive(Deserialize)]
struct GasCase {
    name: String,
    time_s: Vec<f64>,
    y1: Vec<f64>,
    y2: Vec<f64>,
    tau_s: [f64; 2],
    noise_std_k: [f64; 2],
    gas_std_k: f64,
    corner_hz: f64,
    gas_k: Vec<f64>,
    std_k: Vec<f64>,
}

impl GasCase {
    /// What rounding may take of a mean, in standard deviations, and of a standard deviation: a variance of the body that was four times
    /// that of the gas becomes one of the noise, and keeps a rounding of what it was, for each of four numbers of the state and each sample.
    /// Where the noise is less than some 1e-5 of the gas, that leaves no bound; half of the digits are asked for.
    fn tolerance(&self) -> f64 {
        let least_k = self.noise_std_k[0].min(self.noise_std_k[1]);
        let span = 4.0 * (self.gas_std_k / least_k).powi(2);
        (4.0 * self.time_s.len() as f64 * f64::EPSILON * span).min(f64::EPSILON.sqrt())
    }
}

#[test]
fn gas_temperatures_have_the_digits_that_they_should() {
    let cases = Oracle::stored().gas;
    assert_eq!(cases.len(), 20);
    for case in &cases {
        let readings =
            gas::Readings::new(case.time_s.clone(), [case.y1.clone(), case.y2.clone()]).expect("sound readings");
        let rig = gas::Rig::new([0, 1].map(|i| gas::Sensor::new(case.tau_s[i], case.noise_std_k[i])));
        let term = gas::Term::Rough { std_k: case.gas_std_k, corner_hz: case.corner_hz };
        let prior = gas::Prior { level_c: 300.0, terms: vec![term] };
        let got = gas::reconstruct(&readings, &rig, &prior, gas::Form::Smoother).expect("a sound rig");
        let tolerance = case.tolerance();
        for k in 0..case.time_s.len() {
            let of_mean = (got.gas_c[k] - 300.0 - case.gas_k[k]).abs() / case.std_k[k];
            let of_std = (got.std_k[k] / case.std_k[k] - 1.0).abs();
            let what = format!("{}, sample {k}, within {tolerance:.1e}", case.name);
            assert!(of_mean < tolerance, "{what}: gas {} for {}, {of_mean:.1e}", got.gas_c[k] - 300.0, case.gas_k[k]);
            assert!(of_std < tolerance, "{what}: std {} for {}, {of_std:.1e}", got.std_k[k], case.std_k[k]);
        }
    }
}
