//! Values that an independent implementation (NumPy, filters from SciPy) gave on four records: each cost at the truth, at a
//! probe point and at its minimum. Costs must agree to 1e-9 relative, minima to 1e-6 relative in the time constants (the
//! minimiser used there stopped at about 1e-8).

use std::path::PathBuf;

use serde_json::Value;
use twinlag::bias::{Compensated, Noise, Normalised};
use twinlag::cross_relation::{CrossRelation, Form, Readings, Whitened};
use twinlag::record::{Record, Selection};
use twinlag::sensor::Discretisation;
use twinlag::{Estimator, Hold, Options, characterise, readings};

const DISCARD: usize = 300;
const COSTS: [(&str, Estimator); 4] = [
    ("cross_relation", Estimator::CrossRelation),
    ("bias_compensated_known_variance", Estimator::BiasCompensated),
    ("noise_gain_normalised", Estimator::Normalised),
    ("whitened_exact", Estimator::Whitened),
];

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

fn pair(value: &Value) -> [f64; 2] {
    [0, 1].map(|i| value[i].as_f64().expect("a pair of numbers"))
}

/// Calls `check` with each record, its name and what is expected of it.
fn for_each_record(mut check: impl FnMut(&str, &Record, &Value)) {
    let text = std::fs::read_to_string(data("expected.json")).expect("the expected values are in the repository");
    let expected: Value = serde_json::from_str(&text).expect("valid JSON");
    let records = expected["records"].as_object().expect("records by name");
    assert_eq!(records.len(), 4);
    for (name, values) in records {
        let record = Record::read(data(&format!("{name}.csv")), &Selection::default()).expect("a readable record");
        check(name, &record, values);
    }
}

fn costs(readings: &Readings, noise_std: [f64; 2], theta: &[f64; 2]) -> [f64; 4] {
    let published = || CrossRelation::new(readings, DISCARD).expect("long enough");
    let noise = || noise_std.map(|s| Noise::white(s).expect("valid level"));
    let whitened = |form| Whitened::with_form(readings, Discretisation::ZeroOrderHold, noise_std, form).expect("valid");
    let [spectral, banded] = [Form::Spectral, Form::Banded].map(|form| {
        let cost = whitened(form);
        cost.evaluate(theta).value / cost.terms(theta) as f64
    });
    // 2499 terms whose covariance has a condition of (2τ/Ts)² = 1.4e4.
    assert!((spectral / banded - 1.0).abs() < 1e-10, "spectral form {spectral}, banded form {banded}");
    [
        published().evaluate(theta).value,
        Compensated::new(published(), noise()).evaluate(theta).value,
        Normalised::new(published(), noise()).evaluate(theta).value,
        spectral,
    ]
}

fn close(what: &str, got: f64, want: f64, relative: f64) {
    assert!((got / want - 1.0).abs() <= relative, "{what}: got {got:e}, want {want:e} within {relative:e} relative");
}

#[test]
fn costs_at_the_truth_and_at_a_probe_point_are_those_of_the_reference() {
    for_each_record(|name, record, expected| {
        let readings = readings(record, &Options::default()).expect("usable");
        close(name, readings.level(), expected["common_mean_removed_C"].as_f64().expect("a number"), 1e-12);
        let noise_std = pair(&expected["noise_std_K"]);
        for (at, theta) in [("cost_at_truth", [0.0238, 0.1168]), ("cost_at_probe", [0.03, 0.1])] {
            let got = costs(&readings, noise_std, &theta);
            for (i, (cost, _)) in COSTS.iter().enumerate() {
                let want = expected[at][cost].as_f64().expect("a number");
                close(&format!("{name}, {at}, {cost}"), got[i], want, 1e-9);
            }
        }
    });
}

#[test]
fn minima_are_those_of_the_reference_for_every_optimiser() {
    for_each_record(|name, record, expected| {
        for optimiser in twinlag::optimise::Optimiser::NAMES {
            for (cost, estimator) in COSTS {
                let options = Options {
                    estimator,
                    optimiser: twinlag::optimise::Optimiser::by_name(optimiser).expect("registered"),
                    hold: Hold::ZeroOrderHold,
                    noise_std_k: Some(pair(&expected["noise_std_K"])),
                    discard: Some(DISCARD),
                    ..Options::default()
                };
                let answer = characterise(record, &options).expect("a fit that runs");
                let want = &expected["minimum"][cost];
                let what = format!("{name}, {cost}, {optimiser}");
                assert!(answer.fit.end.is_usable(), "{what}: {:?}", answer.fit);
                for (i, tau) in pair(&want["tau_s"]).iter().enumerate() {
                    close(&what, answer.fit.x[i], *tau, 1e-6);
                }
                let terms = if estimator == Estimator::Whitened { record.len() as f64 - 1.0 } else { 1.0 };
                close(&what, answer.fit.value / terms, want["cost"].as_f64().expect("a number"), 1e-9);
            }
        }
    });
}

/// The reference took its standard errors from the derivative of the whitened residual by differences: five digits.
#[test]
fn gauss_newton_standard_errors_are_those_of_the_reference() {
    for_each_record(|name, record, expected| {
        let readings = readings(record, &Options::default()).expect("usable");
        let whitened =
            Whitened::new(&readings, Discretisation::ZeroOrderHold, pair(&expected["noise_std_K"])).expect("valid");
        let minimum = &expected["minimum"]["whitened_exact"];
        let theta = pair(&minimum["tau_s"]);
        let [[a, b], [_, d]] = whitened.evaluate(&theta).hessian;
        let variance = [2.0 * d / (a * d - b * b), 2.0 * a / (a * d - b * b)];
        for (i, want) in pair(&minimum["std_log_tau_from_information"]).iter().enumerate() {
            close(name, variance[i].sqrt() / theta[i], *want, 1e-5);
        }
    });
}
