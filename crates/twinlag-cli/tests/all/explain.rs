//! What `twinlag explain` knows, and what it answers to a name that it does not.

use crate::common::Bench;

#[test]
fn names_of_every_kind_are_explained() {
    let bench = Bench::new("every_kind");
    // An effect, a verdict, a status, a grade, a test, a part of an answer, and what two sensors never reveal, each with a word that
    // its text must have.
    let names = [
        ("slow-mode", "at the rig"),
        ("unexplained", "no interval covers"),
        ("at-bound", "bound"),
        ("conditional", "assumption"),
        ("coherence", "gas"),
        ("transfer", "no part in finding the model"),
        ("two-sensors", "both sensors share"),
    ];
    for (name, word) in names {
        let answer = bench.run(&["explain", name]);
        assert_eq!((answer.code, answer.stderr.as_str()), (0, ""), "{answer:#?}");
        assert!(answer.stdout.starts_with(name) && answer.stdout.contains(word), "no \"{word}\": {answer:#?}");
        let json = bench.run(&["explain", name, "--json"]).json();
        assert_eq!(json["explanations"][0]["name"], name, "{json:#}");
    }
}

/// `calibration` is an effect and a test: both are explained.
#[test]
fn a_name_of_two_things_is_explained_twice() {
    let answer = Bench::new("two_things").run(&["explain", "calibration"]);
    for word in ["calibration (effect)", "calibration (test)"] {
        assert!(answer.stdout.contains(word), "no \"{word}\": {answer:#?}");
    }
}

/// As JSON has it, and without a name.
#[test]
fn a_field_is_explained_by_its_name_in_json_and_no_name_is_answered_with_the_list() {
    let bench = Bench::new("fields");
    let answer = bench.run(&["explain", "exact_twins"]);
    assert!(answer.code == 0 && answer.stdout.contains("no record distinguishes"), "{answer:#?}");
    let answer = bench.run(&["explain"]);
    assert_eq!((answer.code, answer.stderr.as_str()), (0, ""), "{answer:#?}");
    for name in ["delay", "adequate", "no-go", "whiteness", "transfer", "two-sensors"] {
        assert!(answer.stdout.contains(name), "no \"{name}\": {answer:#?}");
    }
}

#[test]
fn an_unknown_name_is_answered_with_the_list() {
    let bench = Bench::new("unknown");
    bench.refuses(2, &["explain", "dealy"], &["'dealy'", "delay", "partly-explained", "model-rejected", "two-sensors"]);
}
