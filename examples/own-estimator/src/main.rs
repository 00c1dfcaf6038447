//! An estimator of one's own, in a study beside those of the family, with an optimiser of one's own.
//!
//! It splits the record in two, lets the whitened estimator answer each half, and takes the geometric mean: it should scatter
//! little more than the whole record's estimate, and the study says how much.

use std::error::Error;
use std::ops::ControlFlow;

use twinlag::Estimator;
use twinlag::cross_relation::{Readings, Segment};
use twinlag::estimate::{Estimate, EstimateError, Outcome, Task};
use twinlag::optimise::Optimiser;
use twinlag_experiment::{Experiment, Own, Plan, Table};
use twinlag_study::{Options, run};

// ANCHOR: estimator
/// Geometric mean of the whitened estimates of both halves of the first stretch.
struct Halves;

impl Estimate for Halves {
    fn name(&self) -> String {
        "halves".into()
    }

    fn source(&self) -> &'static str {
        "this example"
    }

    fn assumes(&self) -> &'static str {
        "what the whitened estimator does"
    }

    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
        let whole = &task.readings.segments()[0];
        let half = whole.len() / 2;
        let of = |rows: std::ops::Range<usize>| -> Result<Outcome, EstimateError> {
            let (y1, y2) = (whole.y1()[rows.clone()].to_vec(), whole.y2()[rows].to_vec());
            let readings = Readings::new(vec![Segment::new(y1, y2, whole.steps().clone())?])?;
            Estimator::Whitened.estimate(&Task { readings: &readings, starts_s: task.starts_s.clone(), ..*task })
        };
        let (first, second) = (of(0..half)?, of(half..whole.len())?);
        let mut mean = if first.end.is_usable() { second.clone() } else { first.clone() };
        for i in 0..2 {
            mean.tau_s[i] = (first.tau_s[i] * second.tau_s[i]).sqrt();
        }
        (mean.standard_error_s, mean.interval_95_s) = (None, None);
        Ok(mean)
    }
}
// ANCHOR_END: estimator

const PLAN: &str = r#"
    name = "halves"
    title = "The whole record beside its halves"
    seed = 1
    trials = 400
    samples = [1000]
    noise_percent = [5]
    [[gases]]
    name = "broadband"
    gas = { kind = "broadband", mean_c = 50.5, std_k = 11.667, corner_hz = 10.0, hold = "zero-order" }
    [[methods]]
    name = "whole"
    estimator = "whitened"
    [[methods]]
    name = "halves"
    estimator = "halves"
    optimiser = "strict"
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let plan = Plan::from_toml(PLAN)?;
    let strict = Optimiser::LevenbergMarquardt { step_tolerance: 1e-12 };
    let own = Own { estimators: vec![("halves", &Halves)], optimisers: vec![("strict", &strict)] };
    let experiment = Experiment::with(&plan, &own)?;
    let results = run(&experiment, &Options::default(), |_| ControlFlow::Continue(()))?.into_results()?;
    let table = Table::of(&experiment, &results)?;
    for row in &table.rows {
        println!("{} τ{}: RMSE {} of the bound", row["method"], row["sensor"], row["rmse_over_bound"]);
    }
    // Two halves know what the whole knows, less a little at their ends: within a tenth, and never clearly better.
    let ratio = |row: usize| table.rows[row]["rmse_over_bound"].as_f64().unwrap_or(f64::NAN);
    for sensor in 0..2 {
        assert!(ratio(2 + sensor) < 1.15 * ratio(sensor) && ratio(2 + sensor) > 0.95 * ratio(sensor));
    }
    Ok(())
}
