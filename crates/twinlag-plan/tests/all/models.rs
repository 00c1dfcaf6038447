//! Plans from what a diagnosis saved: which rig that is, and which files are refused.

use serde_json::{Value, json};
use twinlag::Model;
use twinlag_plan::{Plan, PlanError, PlanStatus, Source};

/// A model as `twinlag diagnose --save` writes it, with what counts here.
fn saved() -> Value {
    let mut value = serde_json::to_value(Model::of_two_lags(["fine".into(), "coarse".into()])).expect("JSON");
    value["time_constants_s"] = json!([0.05, 0.16]);
    value["noise_std_K"] = json!([0.05, 0.08]);
    value["effects"] = json!([{"effect": "delay", "channel": "coarse", "parameters": [
        {"name": "delay", "value": -0.006, "standard_error": 0.001, "interval_95": null, "unit": "s"}]}]);
    value["found_in"] = json!({"source": "run.csv", "sha256": "", "samples": 2000, "sample_period_s": 0.004, "length_s": 7.996,
                               "temperatures_C": [[280.0, 320.0], [285.0, 315.0]]});
    value["gas_spectrum"] = json!({"mean_C": 300.0, "bands": [{"frequency_hz": 0.5, "power_K2": 18.0},
        {"frequency_hz": 2.75, "power_K2": 8.0}, {"frequency_hz": 5.0, "power_K2": 4.5}]});
    value
}

fn model(change: impl Fn(&mut Value)) -> Model {
    let mut value = saved();
    change(&mut value);
    serde_json::from_value(value).expect("a model")
}

#[test]
fn a_model_is_planned_with_its_own_gas_and_effects() {
    let plan = Plan::of_model(&model(|_| ())).expect("a sound model");
    assert_eq!((plan.source.clone(), plan.status), (Source::Diagnosis, PlanStatus::Ok));
    // The variance is half the square of each amplitude, and the record has whole periods of two of the tones.
    assert!((plan.gas_std_k - 30.5_f64.sqrt()).abs() < 0.05, "{}", plan.gas_std_k);
    let delay = plan.as_it_is.numbers.iter().find(|n| n.name == "delay").expect("it is in the model");
    assert!((delay.value + 0.006).abs() < 2e-4, "{}", delay.value);
    let text = serde_json::to_string(&plan).expect("JSON");
    assert!(!text.contains("NaN") && serde_json::from_str::<Plan>(&text).is_ok_and(|read| read == plan));
}

#[test]
fn a_model_without_what_a_rig_needs_is_refused_with_what_was_expected() {
    let refused = |change: &dyn Fn(&mut Value)| Plan::of_model(&model(change)).expect_err("refused");
    let error = refused(&|m| m["time_constants_s"][1] = Value::Null);
    assert_eq!(error, PlanError::NoTimeConstant { channel: "coarse".into() });
    assert!(error.to_string().contains("no time constant of coarse: expected both"), "{error}");
    assert_eq!(refused(&|m| m["gas_spectrum"] = Value::Null), PlanError::NoSpectrum);
    assert!(matches!(refused(&|m| m["found_in"] = Value::Null), PlanError::NotSaved { .. }));
    assert!(
        matches!(refused(&|m| m["noise_std_K"][0] = json!(-1.0)), PlanError::ModelNumber { got, .. } if got == -1.0)
    );
}
