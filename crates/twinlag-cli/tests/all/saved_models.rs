//! What a saved model says of itself, and what is said where it is used: the grade of every number, and the first line.

use crate::common::{Answer, Bench, RIG};
use serde_json::Value;

/// A record and the model of it, which says that the second channel reads 2 K too hot.
fn saved(test: &str) -> (Bench, Value) {
    let bench = Bench::simulated(test, RIG);
    let answer = bench.run(&["diagnose", "run.csv", "--save", "model.json", "--quiet"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    let model = serde_json::from_slice(&bench.read("model.json")).expect("JSON");
    (bench, model)
}

/// Writes `model` after a change.
fn change(bench: &Bench, model: &Value, change: impl Fn(&mut Value)) {
    let mut model = model.clone();
    change(&mut model);
    bench.write("model.json", model.to_string());
}

/// `run.csv` with the readings of both channels higher by some kelvin, in `other.csv`.
fn hotter(bench: &Bench, by_k: [f64; 2]) {
    let text = String::from_utf8(bench.read("run.csv")).expect("text");
    let mut lines = text.lines();
    let mut out = format!("{}\n", lines.next().expect("a header"));
    for line in lines {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        for (cell, by_k) in cells[1..].iter_mut().zip(by_k) {
            *cell = (cell.parse::<f64>().expect("a number") + by_k).to_string();
        }
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    bench.write("other.csv", out);
}

fn remarks(value: &Value) -> Vec<String> {
    let list = value["model_remarks"].as_array().unwrap_or_else(|| panic!("no remarks: {value:#}"));
    list.iter().map(|r| r.as_str().expect("a text").to_owned()).collect()
}

/// Asserts that all numbers of a characterisation are conditional, and returns why the first of them is.
fn condition(value: &Value) -> &str {
    for number in [&value["sensors"][0], &value["sensors"][1], &value["time_constant_difference_s"]] {
        assert_eq!(number["grade"], "conditional", "{value:#}");
    }
    value["sensors"][0]["because"].as_str().expect("a text")
}

/// Of the answer; how the file was read is noted before there is one.
fn first_line(answer: &Answer) -> &str {
    let text = if answer.stdout.is_empty() { &answer.stderr } else { &answer.stdout };
    text.lines().find(|line| !line.starts_with("note: ")).unwrap_or_else(|| panic!("no answer: {answer:#?}"))
}

#[test]
fn a_model_says_what_it_was_found_in_and_how_well() {
    let (bench, model) = saved("says");
    let diagnosis = bench.run(&["diagnose", "run.csv", "--json", "--quiet"]).json();
    assert_eq!(model["verdict"], "explained", "{model:#}");
    assert_eq!(model["explained_to"], diagnosis["explained_to"]);
    for i in 0..2 {
        let sensor = &diagnosis["final"]["sensors"][i];
        assert_eq!(model["time_constant_grades"][i]["grade"], sensor["grade"]);
        assert_eq!(model["time_constant_grades"][i]["because"], sensor["because"]);
    }
    let found = &diagnosis["effects"][0]["parameters"];
    let held = model["effects"][0]["parameters"].as_array().expect("a list");
    assert!(!held.is_empty(), "{model:#}");
    for (k, number) in held.iter().enumerate() {
        for field in ["name", "unit", "grade", "because"] {
            assert_eq!(number[field], found[k][field], "{field}");
        }
        assert!(number["value"].is_f64() && number["standard_error"].is_f64() && number["interval_95"].is_array());
    }
    let data = &model["found_in"];
    assert_eq!((&data["source"], &data["samples"]), (&"run.csv".into(), &3000.into()));
    let text = String::from_utf8(bench.read("run.csv")).expect("text");
    for i in 0..2 {
        let column =
            || text.lines().skip(1).map(|l| l.split(',').nth(1 + i).expect("a cell").parse().expect("a number"));
        assert_eq!(data["temperatures_C"][i][0], column().fold(f64::INFINITY, f64::min));
        assert_eq!(data["temperatures_C"][i][1], column().fold(f64::NEG_INFINITY, f64::max));
    }
    assert_eq!(data["sha256"].as_str().map(str::len), Some(64));
}

/// On its own record a model is fitted again, and rests on what the diagnosis did; on another one its numbers are taken as exact, and the
/// sensors must be those. Along the record it is held where it was, in its own too.
#[test]
fn numbers_found_with_a_model_are_conditional_on_it() {
    let (bench, _) = saved("conditional");
    let own = bench.characterise("run.csv", &["--model", "model.json"]).status(&["ok"]);
    assert_eq!(remarks(&own), Vec::<String>::new());
    assert!(condition(&own).starts_with("it follows from the time constants in the model: "), "{own:#}");
    let along = bench.run(&["track", "run.csv", "--model", "model.json", "--out", "tau.csv", "--json", "--quiet"]);
    let along: Value = serde_json::from_str(&along.stdout).expect("JSON");
    assert!(condition(&along["final"]).contains("right if the sensors are those of run.csv"), "{along:#}");
    hotter(&bench, [0.5, 0.5]);
    let other = bench.characterise("other.csv", &["--model", "model.json"]).status(&["ok"]);
    assert_eq!(remarks(&other), Vec::<String>::new());
    assert!(condition(&other).contains("right if the sensors are those of run.csv"), "{other:#}");
    let strict = bench.run(&["characterise", "other.csv", "--model", "model.json", "--quiet", "--strict"]);
    assert_eq!(strict.code, 4, "{strict:#?}");
    assert_eq!(first_line(&strict), "other.csv: 3000 samples, 0.01000 s apart");
}

/// As versions wrote it that stored neither verdict nor grades.
#[test]
fn an_older_model_is_read_with_a_caution() {
    let (bench, model) = saved("older");
    change(&bench, &model, |m| {
        let fields = m.as_object_mut().expect("an object");
        for field in ["verdict", "explained_to", "time_constant_grades", "found_in"] {
            assert!(fields.remove(field).is_some(), "{field}");
        }
        for number in m["effects"][0]["parameters"].as_array_mut().expect("a list") {
            let number = number.as_object_mut().expect("an object");
            assert!(number.remove("grade").is_some() && number.remove("because").is_some());
        }
    });
    let value = bench.characterise("run.csv", &["--model", "model.json"]).status(&["ok"]);
    assert_eq!(remarks(&value), ["the model does not say how well it explains its own record"]);
    assert!(condition(&value).contains("right if the sensors are those of the model"), "{value:#}");
    let text = bench.run(&["characterise", "run.csv", "--model", "model.json", "--quiet"]);
    assert_eq!(first_line(&text), "caution: the model does not say how well it explains its own record");
}

/// 300 K hotter: every verb says so before all else, and in the page it is before the summary.
#[test]
fn a_record_outside_the_data_of_its_model_says_so_first() {
    let (bench, _) = saved("outside");
    hotter(&bench, [300.0, 300.0]);
    let with = ["--model", "model.json"];
    let value = bench.characterise("other.csv", &with).status(&["ok"]);
    assert_eq!(remarks(&value).len(), 1, "{value:#}");
    assert!(condition(&value).starts_with("right if this does no harm: the model is used outside"), "{value:#}");
    let says_so = |answer: &Answer, is_of: &str| {
        assert_eq!(answer.code, 0, "{answer:#?}");
        let first = first_line(answer);
        assert!(first.starts_with("caution: the model is used outside the data"), "{answer:#?}");
        assert!(first.contains("T1 is ") && first.contains("T2 is ") && first.contains(" in run.csv"), "{answer:#?}");
        assert!(answer.stdout.contains(is_of) || answer.stderr.contains(is_of), "{answer:#?}");
    };
    let run = |arguments: &[&str]| bench.run(&[arguments, &with[..]].concat());
    says_so(&run(&["characterise", "other.csv", "--quiet"]), "whitened estimate");
    let gas = run(&["compensate", "other.csv", "--out", "gas.csv", "--report", "gas.html", "--quiet"]);
    says_so(&gas, "gas temperature: written to gas.csv, 3000 samples  conditional");
    says_so(
        &run(&["track", "other.csv", "--out", "tau.csv", "--report", "tau.html", "--quiet"]),
        "time constants written",
    );
    says_so(&run(&["track", "other.csv", "--out", "live.csv", "--live", "2000"]), "started");
    for (page, lead) in
        [("gas.html", "The gas temperature is known to"), ("tau.html", "No change of the time constants")]
    {
        let page = String::from_utf8(bench.read(page)).expect("text");
        let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("no \"{text}\" in the page"));
        assert!(at("The model is used outside the data") < at(lead), "{lead}");
    }
}

/// The model that is left after an incomplete diagnosis is used with a caution, whether it holds effects or not.
#[test]
fn a_model_that_did_not_explain_its_record_says_so_first() {
    let (bench, model) = saved("unexplained");
    change(&bench, &model, |m| {
        m["verdict"] = "partly-explained".into();
        m["effects"][0]["parameters"][0]["grade"] = "no-go".into();
    });
    hotter(&bench, [0.5, 0.5]);
    let value = bench.characterise("other.csv", &["--model", "model.json"]).status(&["ok"]);
    let said = remarks(&value);
    assert_eq!(said[0], "the model leaves more than noise in its own record, run.csv (partly-explained)");
    let name = model["effects"][0]["parameters"][0]["name"].as_str().expect("a text");
    assert!(said[1].ends_with(&format!("did not give: {name} of calibration")), "{value:#}");
    assert!(condition(&value).contains(&said[0]) && condition(&value).contains(&said[1]), "{value:#}");
    change(&bench, &model, |m| {
        m["verdict"] = "unexplained".into();
        m["effects"] = Value::Array(Vec::new());
    });
    // The record that two lags explain: without the offset.
    hotter(&bench, [0.0, -2.0]);
    let value = bench.characterise("other.csv", &["--model", "model.json"]).status(&["ok"]);
    assert_eq!(remarks(&value), ["the model leaves more than noise in its own record, run.csv (unexplained)"]);
    assert!(condition(&value).starts_with("right if this does no harm: the model leaves more"), "{value:#}");
}

/// The second sensor was changed for one that reads 1 K hotter still.
#[test]
fn what_a_model_does_not_explain_is_not_given() {
    let (bench, _) = saved("rejected");
    hotter(&bench, [0.0, 1.0]);
    let answer = bench.characterise("other.csv", &["--model", "model.json"]);
    assert_eq!(answer.code, 4, "{answer:#?}");
    let value: Value = serde_json::from_str(&answer.stdout).expect("JSON");
    assert_eq!(value["status"], "model-rejected", "{value:#}");
    for i in 0..2 {
        let sensor = &value["sensors"][i];
        assert_eq!((&sensor["grade"], &sensor["time_constant_s"]), (&"no-go".into(), &Value::Null), "{value:#}");
    }
    assert_eq!(value["time_constant_difference_s"]["value"], Value::Null, "{value:#}");
    let gas = bench.run(&["compensate", "other.csv", "--out", "gas.csv", "--model", "model.json", "--quiet"]);
    assert_eq!(gas.code, 4, "{gas:#?}");
    assert!(!bench.has("gas.csv"), "{gas:#?}");
}

#[test]
fn a_file_that_is_no_model_is_refused_for_what_it_is() {
    let (bench, _) = saved("no-model");
    let words = ["run.csv", "expected a model written by `twinlag diagnose --save`", "begins with {"];
    bench.refuses(3, &["characterise", "run.csv", "--model", "run.csv"], &words);
}
