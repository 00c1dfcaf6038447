//! A page of an answer of which nothing is determined: every section is there, and no number that is
//! none.

use std::ops::ControlFlow;

use serde_json::json;
use twinlag::diagnosis::{
    BeforeAfter, Diagnosis as Core, ErrorBudget, Observations, Settings, Stretch, Trace, Unexplained, Verdict, diagnose,
};
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::{Diagnosis, NamedEffect};
use twinlag_pages::{Making, diagnosis_report};

const SECTIONS: [&str; 10] = [
    "What was found",
    "Readings and gas temperature",
    "What is left over, before and after",
    "Evidence for each effect",
    "Time constants and noise, before and after",
    "Error before and after",
    "Tests of what is left over",
    "What is unexplained",
    "What this record cannot reveal",
    "How to reproduce this",
];

fn record() -> Record {
    let time_s: Vec<f64> = (0..200).map(f64::from).collect();
    let channels = Channels {
        source: "a <b>.csv".into(),
        names: ["T\"1\"".into(), "T2 & more".into()],
        t1_c: time_s.clone(),
        t2_c: time_s.iter().map(|t| t + 1.0).collect(),
        reference_c: Some(time_s.clone()),
        time_s,
    };
    Record::from_channels(channels, SamplingChoice::Auto).expect("a record")
}

/// What the loop says where it determines nothing: the answer to some record, emptied.
fn core() -> Core {
    let time_s: Vec<f64> = (0..200).map(f64::from).collect();
    let reading_c = [0.0, 1.0].map(|late_s| time_s.iter().map(|t| (0.3 * (t - late_s)).sin()).collect());
    let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(1.0)).expect("finite and long");
    let settings = Settings { effects: Vec::new(), ..Settings::default() };
    let mut core = diagnose(&observations, &settings, &|_, _, _| ControlFlow::Continue(())).expect("an answer");
    for fit in [&mut core.base, &mut core.last] {
        for tau in fit.time_constants.iter_mut().chain([&mut fit.difference]) {
            (tau.value_s, tau.standard_error_s, tau.interval_95_s) = (None, None, None);
        }
        (fit.noise_std_k, fit.chi2_per_dof) = ([f64::NAN; 2], f64::NAN);
        (fit.covariance, fit.extended) = (None, None);
        fit.tests.clear();
        fit.trace = Trace::default();
    }
    core.error = budget();
    core.unexplained = None;
    (core.remarks, core.moves) = (Vec::new(), Vec::new());
    core
}

fn budget() -> ErrorBudget {
    let pair = json!({"before": 0.0, "after": 0.0});
    let budget = json!({"chi2_per_dof": pair, "held_out_normalised_rms": pair, "held_out_input_difference_K": pair});
    let mut budget: ErrorBudget = serde_json::from_value(budget).expect("the schema");
    let nothing = BeforeAfter { before: f64::NAN, after: f64::INFINITY };
    (budget.chi2_per_dof, budget.held_out_normalised_rms) = (nothing, nothing);
    budget.held_out_input_difference_k = nothing;
    budget
}

fn nothing(verdict: Verdict, record: &Record) -> Diagnosis {
    let sensor = |i: usize| {
        json!({"channel": record.channels[i], "time_constant_s": null, "standard_error_s": null,
            "interval_95_s": null, "interval_basis": null, "second_time_constant_s": null, "noise_std_K": 1.0,
            "noise_standard_error_K": null, "noise_ar1": null, "noise_from": null, "known": false})
    };
    let characterisation = json!({
        "schema": "twinlag.characterisation/1",
        "record": {"source": record.source, "samples": 200, "sample_period_s": 1.0, "missing": 0,
            "channels": record.channels, "segments": 1, "sampling": record.sampling},
        "estimator": "none", "optimiser": "none", "hold": "none", "hold_sensitivity": null,
        "sensors": [sensor(0), sensor(1)],
        "time_constant_difference_s": {"value": null, "interval_95_s": null},
        "free": {"gain": null, "offset_K": null},
        "residual": {"chi2_per_dof": null, "white": false, "tests": []},
        "interval_method": "none", "status": "not-identifiable", "not_identifiable": [], "warnings": [],
        "fit": {"optimiser": "none", "start": [], "x": [], "value": 0.0, "end": "limit-reached", "iterations": 0,
            "evaluations": {"values": 0, "derivatives": 0}},
        "starts": null, "notes": [],
        "made_by": {"program": "twinlag", "version": "0.0.0", "options": {}}
    });
    let one = json!({"before": 1.0, "after": 1.0});
    let answer = json!({
        "schema": "twinlag.diagnosis/1", "base": characterisation, "verdict": verdict, "effects": [],
        "error": {"chi2_per_dof": one, "held_out_normalised_rms": one, "held_out_input_difference_K": one,
            "reference_rmse_K": one},
        "final": characterisation, "unexplained": null, "not_testable": ["the record is too short"], "limits": [],
        "remarks": ["the gas is a single tone"], "without": [], "has_flow": false
    });
    let mut answer: Diagnosis = serde_json::from_value(answer).expect("the schema");
    answer.error.budget = budget();
    answer.error.reference_rmse_k = Some(budget().chi2_per_dof);
    for sensor in answer.base.sensors.iter_mut().chain(&mut answer.last.sensors) {
        sensor.noise_std_k = f64::NAN;
    }
    answer
}

fn found() -> NamedEffect {
    let found = json!({
        "effect": "delay", "channel": "T2 & more", "fitted_in": "T2 & more",
        "parameters": [{"name": "delay", "value": 0.0, "standard_error": 0.0, "interval_95": null, "unit": "s"}],
        "evidence": {"statistic": 0.0, "dof": 1, "p_value": 0.0, "held_out_gain_nats": 0.0, "robust_statistic": null},
        "alternatives": ["second-order"], "seen": null
    });
    let mut found: NamedEffect = serde_json::from_value(found).expect("the schema");
    (found.parameters[0].value, found.parameters[0].standard_error) = (Some(f64::NAN), Some(f64::NAN));
    let evidence = found.evidence.as_mut().expect("given");
    (evidence.statistic, evidence.held_out_gain_nats) = (f64::INFINITY, f64::NAN);
    found
}

fn left() -> Unexplained {
    let left = json!({"description": "something", "band_Hz": null, "energy_ratio": 0.0, "worst_s": null});
    let mut left: Unexplained = serde_json::from_value(left).expect("the schema");
    left.energy_ratio = f64::NAN;
    left
}

fn has_every_section(page: &str) {
    // The script knows of NaN.
    let page = page.split("<script>").next().unwrap_or_default();
    assert!(!page.contains("NaN") && !page.contains("inf "), "{page}");
    assert!(page.contains("not given") && page.contains("a &lt;b&gt;.csv"));
    let mut rest = page;
    for section in SECTIONS {
        let heading = format!("<h2>{section}</h2>");
        rest = rest.split_once(&heading).unwrap_or_else(|| panic!("{section} is out of place")).1;
    }
}

#[test]
fn a_report_on_nothing_has_every_section_and_no_nan() {
    let record = record();
    let nowhere = core();
    let mut gaps = nowhere.clone();
    for fit in [&mut gaps.base, &mut gaps.last] {
        (fit.trace.gas_c.time_s, fit.trace.gas_c.value) = (record.time_s.clone(), vec![f64::NAN; 200]);
    }
    for verdict in
        [Verdict::Adequate, Verdict::Explained, Verdict::PartlyExplained, Verdict::Unexplained, Verdict::Refused]
    {
        for (effects, unexplained) in [(vec![], None), (vec![found()], Some(left()))] {
            for core in [None, Some(nowhere.clone()), Some(gaps.clone())] {
                let mut answer = nothing(verdict, &record);
                (answer.effects, answer.unexplained) = (effects.clone(), unexplained.clone());
                answer.core = core.map(Box::new);
                answer.core.iter_mut().for_each(|core| core.verdict = verdict);
                let command = "twinlag diagnose 'a <b>.csv'".to_owned();
                for is_static in [false, true] {
                    let making = Making { command: command.clone(), is_static, ..Making::default() };
                    has_every_section(&diagnosis_report(&record, &answer, &making).expect("a page"));
                    let first = Making { is_first_screen: true, ..making };
                    let page = diagnosis_report(&record, &answer, &first).expect("a page");
                    assert!(page.contains("class=\"lead") && !page.contains("<h2>"), "{page}");
                }
            }
        }
    }
}
