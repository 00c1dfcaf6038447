//! What `characterise` reports is what the estimator of `twinlag-estimate` returns, which is what
//! the experiments measure.

use std::path::PathBuf;

use twinlag::cross_relation::CostError;
use twinlag::estimate::{Estimate, EstimateError, NoiseKnowledge, Task};
use twinlag::record::{Record, Selection};
use twinlag::{Estimator, Hold, Options, Status, characterise, readings};

fn record(name: &str) -> Record {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
    Record::read(path, &Selection::default()).expect("a readable record")
}

/// Time constants and standard errors have the same bits, wherever no other hold is compared; else the hold's part joins the
/// interval, which is then no shorter.
#[test]
fn characterise_reports_the_estimator_s_own_numbers() {
    // Sensors whose time constants, and whose intervals, were compared.
    let (mut values, mut intervals) = (0, 0);
    for name in ["sine_1pct.csv", "sine_5pct.csv", "broadband_5pct.csv", "broadband_20pct.csv"] {
        let record = record(name);
        for estimator in Estimator::ALL {
            // Also of a biased estimate, which is not given otherwise.
            let options = Options { estimator, hold: Hold::ZeroOrderHold, best_effort: true, ..Options::default() };
            let answer = characterise(&record, &options).expect("a sound question");
            let readings = readings(&record, &options).expect("usable");
            let task = Task { noise: NoiseKnowledge::default(), ..Task::new(&readings) };
            let found = match estimator.estimate(&task) {
                Err(EstimateError::Cost(CostError::Singular)) => {
                    assert_eq!(answer.status, Status::NotIdentifiable, "{name}, {estimator}");
                    continue;
                }
                found => found.expect("a sound question"),
            };
            if matches!(answer.status, Status::NotIdentifiable | Status::AtBound) {
                continue;
            }
            let (error_s, interval_s) = (found.standard_error_s.expect("one"), found.interval_95_s.expect("one"));
            for (i, sensor) in answer.sensors.iter().enumerate() {
                assert_eq!(sensor.time_constant_s, Some(found.tau_s[i]), "{name}, {estimator}");
                values += 1;
                let (got_s, [low_s, high_s]) =
                    (sensor.standard_error_s.expect("one"), sensor.interval_95_s.expect("one"));
                if answer.hold_sensitivity.is_none() && answer.status == Status::Ok {
                    // The ends went through a logarithm and back.
                    let is_close = |got: f64, want: f64| (got / want - 1.0).abs() < 1e-12;
                    let same = is_close(low_s, interval_s[i][0]) && is_close(high_s, interval_s[i][1]);
                    assert!(got_s == error_s[i] && same, "{name}, {estimator}: {got_s} s, {low_s} … {high_s} s");
                    intervals += 1;
                } else if answer.status == Status::Ok {
                    assert!(
                        got_s >= error_s[i],
                        "{name}, {estimator}: {got_s} s, the estimator's own {} s",
                        error_s[i]
                    );
                    assert!(low_s <= interval_s[i][0] && high_s >= interval_s[i][1], "{name}, {estimator}");
                    intervals += 1;
                }
            }
        }
    }
    assert_eq!((values, intervals), (58, 42), "of 64: two sensors, eight estimators, four records");
}
