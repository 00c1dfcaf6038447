//! What `twinlag explain` knows, and what it answers to a name that it does not.

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
    let expected = ["'dealy'", "is it 'delay'?", "partly-explained", "model-rejected", "two-sensors"];
    bench.refuses(2, &["explain", "dealy"], &expected);
    let stderr = bench.run(&["explain", "thermocouple"]).stderr;
    assert!(!stderr.contains("is it"), "{stderr}");
}

/// Numbers that the book's table of effects lists between backticks, each with its effect; `cosine_amplitude` and the like are parts
/// of one that is explained.
#[test]
fn numbers_of_the_effects_are_explained() {
    let bench = Bench::new("numbers");
    let all = bench.run(&["explain", "--json"]).json();
    let all = all["explanations"].as_array().expect("a list");
    let texts = |name: &str| {
        let of_name = all.iter().filter(|e| e["kind"] == "number" && e["name"] == name.replace('_', "-"));
        of_name.map(|e| e["text"].to_string()).collect::<String>()
    };
    let book = include_str!("../../../../docs/src/closed-loop.md");
    let rows = book.lines().skip_while(|line| !line.starts_with("| identifier |")).skip(2);
    let mut seen = 0;
    for row in rows.take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.split(" | ").collect();
        let effect = cells[0].trim_matches(['|', ' ', '`']);
        let names = cells[2].split('`').skip(1).step_by(2);
        for name in names.filter(|name| !name.starts_with("--") && !name.ends_with("sine_amplitude")) {
            let text = texts(name);
            let is_effect = all.iter().any(|e| e["kind"] == "effect" && e["name"] == name);
            assert!(text.contains(effect) || is_effect || name == "m2", "{name} of {effect}: {text}");
            seen += 1;
        }
    }
    assert!(seen > 20, "{seen} numbers");
}
