//! The published schemas are those of the program, and its answers are as they say.

mod common;

use std::path::Path;

use common::Bench;
use jsonschema::Validator;
use serde_json::Value;

const PUBLISHED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/schemas");
/// What makes the test write the published schemas anew.
const OVERWRITE: &str = "SCHEMAS";

/// The schema of an answer, after a look at the published one.
fn schema(bench: &Bench, name: &str) -> Validator {
    let answer = bench.run(&["schema", name]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    let path = Path::new(PUBLISHED).join(format!("{name}.json"));
    if std::env::var_os(OVERWRITE).is_some_and(|how| how == "overwrite") {
        std::fs::write(&path, &answer.stdout).expect("can be written");
    }
    let published = std::fs::read_to_string(&path).expect("is published");
    assert!(published == answer.stdout, "{} is another: write it with {OVERWRITE}=overwrite", path.display());
    let schema: Value = serde_json::from_str(&answer.stdout).expect("JSON");
    jsonschema::validator_for(&schema).expect("a schema")
}

fn fits(schema: &Validator, answer: &Value) {
    let errors: Vec<String> = schema.iter_errors(answer).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(errors.is_empty(), "{errors:#?}");
}

/// A rig with an offset, and one of a single tone, which is refused.
#[test]
fn answers_are_as_their_schemas_say() {
    let bench = Bench::simulated("answers", common::RIG);
    let tone = common::RIG
        .replace("kind = \"turbulence\"", "kind = \"sine\"")
        .replace("std_k = 15.0\ncorner_hz = 0.5\ncutoff_hz = 45.0", "amplitude_k = 15.0\nfrequency_hz = 0.5");
    bench.write("tone.toml", tone);
    let simulated = bench.run(&["simulate", "tone.toml", "--out", "tone.csv"]);
    assert_eq!(simulated.code, 0, "{simulated:#?}");
    let characterisation = schema(&bench, "characterisation");
    let diagnosis = schema(&bench, "diagnosis");
    for file in ["run.csv", "tone.csv"] {
        fits(&characterisation, &bench.characterise(file, &["--free", "gain,offset"]).json());
        fits(&diagnosis, &bench.run(&["diagnose", file, "--json", "--reference", "Tref"]).json());
    }
    let saved = ["diagnose", "run.csv", "tone.csv", "--json", "--known", "T1=0.12s+-10%", "--save", "model.json"];
    fits(&diagnosis, &bench.run(&saved).json());
    let model: Value = serde_json::from_slice(&bench.read("model.json")).expect("JSON");
    fits(&schema(&bench, "model"), &model);
    let gas = ["compensate", "run.csv", "--out", "gas.csv", "--json", "--reference", "Tref", "--save", "gas.json"];
    fits(&schema(&bench, "compensation"), &bench.run(&gas).json());
    let model: Value = serde_json::from_slice(&bench.read("gas.json")).expect("JSON");
    fits(&schema(&bench, "model"), &model);
    fits(&schema(&bench, "track"), &bench.run(&["track", "run.csv", "--out", "tau.csv", "--json"]).json());
}

/// A schema that takes anything would take every answer.
#[test]
fn what_an_answer_is_not_does_not_fit() {
    let bench = Bench::simulated("wrong", common::RIG);
    let schema = schema(&bench, "characterisation");
    let answer = bench.characterise("run.csv", &[]).json();
    fits(&schema, &answer);
    for (pointer, wrong) in [
        ("/status", Value::from("fine")),
        ("/sensors/0/time_constant_s", Value::from("0.1 s")),
        ("/sensors/0/grade", Value::from("good")),
        ("/record/samples", Value::Null),
    ] {
        let mut other = answer.clone();
        *other.pointer_mut(pointer).expect("is there") = wrong;
        assert!(!schema.is_valid(&other), "{pointer}");
    }
}
