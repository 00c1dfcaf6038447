//! A page of an answer of which nothing is determined: every section is there, and no number that is
//! none.

use serde_json::json;
use twinlag::Diagnosis;
use twinlag::diagnosis::{
    BeforeAfter, Diagnosis as Core, ErrorBudget, Evidence, Found, Identifier, ModelFit, TimeConstant, Trace,
    Unexplained, Value, Verdict,
};
use twinlag::optimise::{End, Evaluations, Fit};
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag_pages::diagnosis_report;

const SECTIONS: [&str; 10] = [
    "Verdict",
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

/// What the loop says where it determines nothing.
fn core(verdict: Verdict, trace: Trace) -> Core {
    let none = TimeConstant { value_s: None, standard_error_s: None, interval_95_s: None };
    let fit = ModelFit {
        rejection_p_value: 1e-4,
        time_constants: [none; 2],
        difference: none,
        fit: Fit {
            optimiser: "none".into(),
            start: Vec::new(),
            x: Vec::new(),
            value: f64::NAN,
            end: End::LimitReached,
            iterations: 0,
            evaluations: Evaluations::default(),
        },
        noise_std_k: [f64::NAN; 2],
        is_noise_of_residual: false,
        tests: Vec::new(),
        chi2_per_dof: f64::NAN,
        is_weighted_by_residual: false,
        covariance: None,
        extended: None,
        trace,
    };
    Core {
        verdict,
        effects: Vec::new(),
        base: fit.clone(),
        last: fit,
        error: budget(),
        unexplained: None,
        not_testable: Vec::new(),
        limits: Vec::new(),
        remarks: Vec::new(),
        moves: Vec::new(),
        policy: twinlag::diagnosis::Policy::default(),
    }
}

fn budget() -> ErrorBudget {
    let pair = BeforeAfter { before: f64::NAN, after: f64::INFINITY };
    ErrorBudget { chi2_per_dof: pair, held_out_normalised_rms: pair, held_out_input_difference_k: pair }
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

fn found() -> Found<String> {
    Found {
        effect: Identifier::DELAY,
        channel: Some("T2 & more".into()),
        fitted_in: Some("T2 & more".into()),
        parameters: vec![Value {
            name: "delay".into(),
            value: f64::NAN,
            standard_error: Some(f64::NAN),
            interval_95: None,
            unit: "s".into(),
        }],
        evidence: Some(Evidence {
            statistic: f64::INFINITY,
            dof: 1,
            p_value: 0.0,
            held_out_gain_nats: f64::NAN,
            robust_statistic: None,
        }),
        alternatives: vec![Identifier::SECOND_ORDER],
        seen: None,
    }
}

fn has_every_section(page: &str) {
    assert!(!page.contains("NaN") && !page.contains("inf "), "{page}");
    assert!(page.contains("not determined") && page.contains("a &lt;b&gt;.csv"));
    let mut rest = page;
    for section in SECTIONS {
        let heading = format!("<h2>{section}</h2>");
        rest = rest.split_once(&heading).unwrap_or_else(|| panic!("{section} is out of place")).1;
    }
}

#[test]
fn a_report_on_nothing_has_every_section_and_no_nan() {
    let record = record();
    let left = Unexplained { description: "something".into(), band_hz: None, energy_ratio: f64::NAN, worst_s: None };
    let gaps = Trace { time_s: record.time_s.clone(), gas_c: vec![f64::NAN; 200], ..Trace::default() };
    for verdict in
        [Verdict::Adequate, Verdict::Explained, Verdict::PartlyExplained, Verdict::Unexplained, Verdict::Refused]
    {
        for (effects, unexplained) in [(vec![], None), (vec![found()], Some(left.clone()))] {
            for core in [None, Some(core(verdict, Trace::default())), Some(core(verdict, gaps.clone()))] {
                let mut answer = nothing(verdict, &record);
                (answer.effects, answer.unexplained) = (effects.clone(), unexplained.clone());
                answer.core = core.map(Box::new);
                has_every_section(&diagnosis_report(&record, &answer, "twinlag diagnose 'a <b>.csv'").expect("a page"));
            }
        }
    }
}
