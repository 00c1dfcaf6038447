//! The published schemas are those of the program, and its answers are as they say.

use std::path::Path;

use crate::common::Bench;
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

/// With `tone.csv`, a record of a single tone.
fn with_tone(test: &str) -> Bench {
    let bench = Bench::simulated(test, crate::common::RIG);
    let tone = crate::common::RIG
        .replace("kind = \"turbulence\"", "kind = \"sine\"")
        .replace("std_k = 15.0\ncorner_hz = 0.5\ncutoff_hz = 45.0", "amplitude_k = 15.0\nfrequency_hz = 0.5");
    bench.write("tone.toml", tone);
    let simulated = bench.run(&["simulate", "tone.toml", "--out", "tone.csv"]);
    assert_eq!(simulated.code, 0, "{simulated:#?}");
    bench
}

/// A rig with an offset, and one of a single tone, which is refused.
#[test]
fn answers_are_as_their_schemas_say() {
    let bench = with_tone("answers");
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

/// Answers that are no estimates: inspections of a readable and an unreadable file, a batch, plans, a simulation, a study and its part.
#[test]
fn answers_of_the_other_verbs_are_as_their_schemas_say() {
    let bench = with_tone("others");
    bench.write("one.csv", "time_s,T1\n0,20\n1,21\n2,20\n3,22\n");
    let inspection = schema(&bench, "inspection");
    fits(&inspection, &bench.run(&["inspect", "run.csv", "--json", "--t1", "T1", "--time-unit", "s"]).json());
    let unusable = bench.run(&["inspect", "one.csv", "--json"]);
    assert_eq!(unusable.code, 3, "{unusable:#?}");
    fits(&inspection, &unusable.json());
    fits(&schema(&bench, "batch"), &bench.run(&["batch", "run.csv", "one.csv", "--out", "t.csv", "--json"]).json());
    let part = bench.run(&["batch", "run.csv", "one.csv", "--out", "t.csv", "--shard", "1/2", "--json"]);
    fits(&schema(&bench, "batch-part"), &part.json());
    let simulated = bench.run(&["simulate", "rig.toml", "--out", "again.csv", "--json"]);
    fits(&schema(&bench, "simulation"), &simulated.json());
    let plan = schema(&bench, "plan");
    fits(&plan, &bench.run(&["plan", "rig.toml", "--json"]).json());
    bench.write("tone.json", bench.run(&["diagnose", "tone.csv", "--json"]).stdout);
    let not_planned = bench.run(&["plan", "tone.json", "--json"]);
    assert_eq!(not_planned.code, 4, "{not_planned:#?}");
    fits(&plan, &not_planned.json());
    bench.write("study.toml", crate::common::STUDY);
    let run = |shard: &str| bench.run(&["study", "run", "study.toml", "--out", "study", "--shard", shard, "--json"]);
    fits(&schema(&bench, "study-part"), &run("0/2").json());
    assert_eq!(run("1/2").code, 0);
    fits(&schema(&bench, "study"), &bench.run(&["study", "merge", "study", "--json"]).json());
    let plan = ["study", "plan", "study.toml", "--pilot-seconds", "1", "--json"];
    fits(&schema(&bench, "study-plan"), &bench.run(&plan).json());
    let submit = ["study", "submit", "study.toml", "--out", "other", "--engine", "parallel", "--shards", "2"];
    let submitted = bench.run(&[&submit[..], &["--time-limit", "5", "--json"]].concat());
    fits(&schema(&bench, "submission"), &submitted.json());
    fits(&schema(&bench, "submission-status"), &bench.run(&["study", "status", "other", "--json"]).json());
}

/// A schema that takes anything would take every answer.
#[test]
fn what_an_answer_is_not_does_not_fit() {
    let bench = Bench::simulated("wrong", crate::common::RIG);
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
