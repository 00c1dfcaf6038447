//! What `twinlag explain` knows, and what it answers to a name that it does not.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::common::Bench;

#[test]
fn names_of_every_kind_are_explained() {
    let bench = Bench::new("every_kind");
    // An effect, a verdict, a status, a grade, a test, a part of an answer, what two sensors never reveal, and a number, each with a
    // word that its text must have.
    let names = [
        ("slow-mode", "at the rig"),
        ("unexplained", "no interval covers"),
        ("at-bound", "bound"),
        ("conditional", "assumption"),
        ("coherence", "gas"),
        ("transfer", "no part in finding the model"),
        ("two-sensors", "both sensors share"),
        ("gain", "a number of: calibration"),
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
fn an_unknown_name_is_answered_with_the_nearest_one_and_the_list() {
    let bench = Bench::new("unknown");
    let expected = ["'dealy' (is it 'delay'?); there are", "partly-explained", "model-rejected", "two-sensors"];
    bench.refuses(2, &["explain", "dealy"], &expected);
    let stderr = bench.run(&["explain", "thermocouple"]).stderr;
    assert!(!stderr.contains("is it"), "{stderr}");
}

/// Each number that the book's table of effects lists, with its effect, and no other.
#[test]
fn numbers_of_the_effects_are_explained() {
    let bench = Bench::new("numbers");
    let book = include_str!("../../../../docs/src/closed-loop.md");
    let rows = book.lines().skip_while(|line| !line.starts_with("| identifier |")).skip(2);
    let mut in_book = BTreeSet::new();
    for row in rows.take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.split(" | ").collect();
        let effect = cells[0].trim_matches(['|', ' ', '`']);
        let names = cells[2].split('`').skip(1).step_by(2).filter(|name| !name.starts_with("--"));
        in_book.extend(names.map(|name| (effect.to_owned(), name.replace('_', "-"))));
    }
    let all = bench.run(&["explain", "--json"]).json();
    let numbers = all["explanations"].as_array().expect("a list").iter().filter(|e| e["kind"] == "number");
    let mut explained = BTreeSet::new();
    for number in numbers {
        let text = |value: &Value| value.as_str().expect("text").to_owned();
        let effects = text(&number["text"][1]);
        let effects = effects.strip_prefix("a number of: ").expect("its effects").split(", ");
        explained.extend(effects.map(|effect| (effect.to_owned(), text(&number["name"]))));
    }
    // The second coefficient of a spline is explained with the first.
    let second = ("varying-time-constant".to_owned(), "m2".to_owned());
    assert!(in_book.remove(&second) && bench.run(&["explain", "m2"]).stdout.starts_with("m1 (number)"));
    assert_eq!(explained, in_book);
}
