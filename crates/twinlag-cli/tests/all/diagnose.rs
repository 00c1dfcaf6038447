//! What scripts rely on in `twinlag diagnose` and in the models that it saves: the fields of schema `twinlag.diagnosis/1`, exit
//! codes, and that no file is overwritten unasked.

use crate::common::{Answer, Bench, FAST_RIG, Gas, Trace, csv, estimates, interval, number, recovers};
use serde_json::Value;

/// Of the second channel. Noise of 0.3 K lets 2000 samples tell 0.01 K.
const OFFSET_K: f64 = 2.0;
const VERDICTS: [&str; 5] = ["adequate", "explained", "partly-explained", "unexplained", "refused"];
const EFFECTS: [&str; 15] = [
    "calibration",
    "second-order",
    "slow-mode",
    "delay",
    "varying-time-constant",
    "temperature-dependent-time-constant",
    "radiation",
    "drift",
    "mains-pickup",
    "coloured-noise",
    "input-mismatch",
    "spikes",
    "quantisation",
    "saturation",
    "crosstalk",
];

fn with_offset(trace: Trace) -> String {
    let mut rows = trace.rows();
    rows.iter_mut().for_each(|row| row[2] += OFFSET_K);
    csv(&rows)
}

/// A bench with a record of an offset as `run.csv` and one of the same sensors on another day as `later.csv`.
fn offset(test: &str) -> Bench {
    let bench = Bench::with(test, "run.csv", with_offset(Trace::GOOD));
    bench.write("later.csv", with_offset(Trace { seed: 2, ..Trace::GOOD }));
    bench
}

/// The object that `twinlag diagnose run.csv --json` prints; asserts that it ends with `code`.
fn diagnosis(bench: &Bench, further: &[&str], code: i32) -> (Value, Answer) {
    let answer = bench.run(&[&["diagnose", "run.csv", "--json"], further].concat());
    assert_eq!(answer.code, code, "{answer:#?}");
    // Fails for anything but one object, and for NaN and infinity in it.
    (answer.json(), answer)
}

/// The field, which must be there even if it is null.
fn field<'a>(value: &'a Value, name: &str) -> &'a Value {
    value.get(name).unwrap_or_else(|| panic!("no field {name} in {value:#}"))
}

fn text<'a>(value: &'a Value, name: &str) -> &'a str {
    field(value, name).as_str().unwrap_or_else(|| panic!("{name} is no text in {value:#}"))
}

fn list<'a>(value: &'a Value, name: &str) -> &'a [Value] {
    field(value, name).as_array().unwrap_or_else(|| panic!("{name} is no list in {value:#}"))
}

/// The fields of a characterisation that a reader of both schemas needs.
fn has_the_fields_of_a_characterisation(value: &Value) {
    assert_eq!(value["schema"], "twinlag.characterisation/1", "{value:#}");
    for name in ["record", "estimator", "optimiser", "time_constant_difference_s", "free", "residual", "status"] {
        field(value, name);
    }
    assert_eq!(list(value, "sensors").len(), 2);
    for sensor in list(value, "sensors") {
        text(sensor, "channel");
        for name in ["time_constant_s", "standard_error_s"] {
            let number = field(sensor, name);
            assert!(number.is_null() || number.as_f64().is_some_and(|n| n > 0.0), "{name}: {sensor}");
        }
        let both = field(sensor, "interval_95_s");
        assert!(both.is_null() || interval(both)[0] > 0.0, "{sensor}");
        assert!(number(field(sensor, "noise_std_K")) > 0.0, "{sensor}");
    }
    assert!(["ok", "at-bound", "not-identifiable", "model-rejected"].contains(&text(value, "status")));
    list(value, "not_identifiable");
    list(value, "warnings");
    list(field(value, "residual"), "tests");
}

/// Every field of the example of schema `twinlag.diagnosis/1`, with its type.
fn has_the_fields_of_a_diagnosis(value: &Value) {
    assert_eq!(text(value, "schema"), "twinlag.diagnosis/1");
    assert!(VERDICTS.contains(&text(value, "verdict")), "{value:#}");
    has_the_fields_of_a_characterisation(field(value, "base"));
    has_the_fields_of_a_characterisation(field(value, "final"));
    for effect in list(value, "effects") {
        assert!(EFFECTS.contains(&text(effect, "effect")), "{effect:#}");
        assert!(field(effect, "channel").is_null() || ["T1", "T2"].contains(&text(effect, "channel")), "{effect:#}");
        for parameter in list(effect, "parameters") {
            text(parameter, "name");
            text(parameter, "unit");
            assert!(number(field(parameter, "value")).is_finite(), "{parameter}");
            let error = field(parameter, "standard_error");
            assert!(error.is_null() || number(error) > 0.0, "{parameter}");
        }
        let evidence = field(effect, "evidence");
        if !evidence.is_null() {
            assert!(number(field(evidence, "statistic")) > 0.0, "{evidence}");
            assert!(field(evidence, "dof").as_u64().is_some_and(|dof| dof > 0), "{evidence}");
            assert!((0.0..=1.0).contains(&number(field(evidence, "p_value"))), "{evidence}");
            number(field(evidence, "held_out_gain_nats"));
        }
        for other in list(effect, "alternatives") {
            assert!(EFFECTS.contains(&other.as_str().expect("a name")), "{effect:#}");
        }
    }
    let error = field(value, "error");
    for name in ["chi2_per_dof", "held_out_normalised_rms"] {
        let both = field(error, name);
        assert!(number(field(both, "before")) > 0.0 && number(field(both, "after")) > 0.0, "{name}: {both}");
    }
    field(error, "reference_rmse_K");
    field(value, "unexplained");
}

#[test]
fn an_offset_is_named_with_every_field_of_the_schema() {
    let (value, answer) = diagnosis(&offset("fields"), &[], 0);
    has_the_fields_of_a_diagnosis(&value);
    assert_eq!(value["verdict"], "explained", "{answer:#?}");
    let effect = &value["effects"][0];
    assert_eq!(effect["effect"], "calibration", "{answer:#?}");
    assert!(effect["evidence"].is_object(), "inferred, so there is evidence: {answer:#?}");
    assert!(value["unexplained"].is_null() && value["error"]["reference_rmse_K"].is_null(), "{answer:#?}");
    for name in ["chi2_per_dof", "held_out_normalised_rms"] {
        let both = &value["error"][name];
        assert!(number(&both["after"]) < number(&both["before"]), "{both}");
    }
    recovers(&value["final"], Trace::GOOD.tau_s);
}

/// The offset is that which was added, to four of the standard errors that are reported.
#[test]
fn the_offset_is_that_of_the_file() {
    let (value, answer) = diagnosis(&offset("size"), &["--quiet"], 0);
    let parameters = list(&value["effects"][0], "parameters");
    let offset = parameters.iter().find(|p| p["name"] == "offset").expect("a calibration has one");
    let (got, error) = (number(&offset["value"]), number(&offset["standard_error"]));
    assert!((got - OFFSET_K).abs() <= 4.0 * error, "got {got}, want {OFFSET_K} ± 4 × {error}: {answer:#?}");
    assert_eq!(answer.stderr, "", "--quiet");
}

#[test]
fn a_record_of_two_lags_is_adequate() {
    let bench = Bench::with("adequate", "run.csv", Trace::GOOD.csv());
    let (value, answer) = diagnosis(&bench, &[], 0);
    has_the_fields_of_a_diagnosis(&value);
    assert_eq!(value["verdict"], "adequate", "{answer:#?}");
    assert!(list(&value, "effects").is_empty() && value["unexplained"].is_null(), "{answer:#?}");
    recovers(&value["final"], Trace::GOOD.tau_s);
}

/// Failed: the exit code said that there was an answer.
#[test]
fn a_record_that_determines_no_time_constant_ends_with_4_whatever_the_verdict() {
    let bench = Bench::with("equal", "run.csv", Trace { tau_s: [0.05, 0.05], ..Trace::GOOD }.csv());
    let (value, answer) = diagnosis(&bench, &[], 4);
    assert_eq!(value["verdict"], "adequate", "{answer:#?}");
    assert_eq!(value["final"]["status"], "not-identifiable", "{answer:#?}");
}

#[test]
fn a_single_sine_is_refused_with_its_json() {
    let bench = Bench::with("sine", "run.csv", Trace { gas: Gas::Sine, ..Trace::GOOD }.csv());
    let (value, answer) = diagnosis(&bench, &[], 4);
    has_the_fields_of_a_diagnosis(&value);
    assert_eq!(value["verdict"], "refused", "{answer:#?}");
    assert!(list(&value, "effects").is_empty(), "{answer:#?}");
    assert!(!list(&value, "remarks").is_empty(), "refused without a word of why: {answer:#?}");
    assert_ne!(value["final"]["status"], "ok", "{answer:#?}");
}

/// A converter that ends where a twentieth of the readings are above. The lines are those of the file, its comment and its
/// header counted.
#[test]
fn readings_at_a_limit_are_listed_by_their_lines_and_times() {
    let mut rows = Trace::GOOD.rows();
    let mut sorted: Vec<f64> = rows.iter().map(|row| row[1]).collect();
    sorted.sort_by(f64::total_cmp);
    let limit_c = (1e6 * sorted[sorted.len() * 19 / 20]).round() / 1e6;
    rows.iter_mut().for_each(|row| row[1] = row[1].min(limit_c));
    let bench = Bench::with("limit", "run.csv", format!("# a converter that ends\n{}", csv(&rows)));
    let (value, answer) = diagnosis(&bench, &[], 0);
    let effect = &value["effects"][0];
    assert_eq!((text(effect, "effect"), text(effect, "channel")), ("saturation", "T1"), "{answer:#?}");
    let mut lines = Vec::new();
    for run in list(effect, "masked") {
        let [first, last] = [0, 1].map(|end| run["rows"][end].as_u64().expect("a line") as usize);
        for (end, line) in [first, last].into_iter().enumerate() {
            // Stamps are printed to 1e-6 s.
            assert!((number(&run["time_s"][end]) - rows[line - 3][0]).abs() < 1e-6, "{run}");
        }
        lines.extend(first..=last);
    }
    // One that is below by less than the digits of the file is printed as the limit.
    let expected: Vec<usize> = (0..rows.len()).filter(|k| limit_c - rows[*k][1] < 5e-7).map(|k| k + 3).collect();
    assert_eq!(lines, expected);
    let shown = bench.run(&["diagnose", "run.csv", "--quiet"]).stdout;
    let first = list(effect, "masked")[0]["rows"][0].as_u64().expect("a line");
    assert!(shown.contains(&format!("left out of T1: rows {first}")), "{shown}");
}

/// While something is left over, no effect is excluded; and another command says what no record reveals.
#[test]
fn nothing_is_excluded_while_something_is_left_over() {
    let bench = offset("excluded");
    let (adequate, _) = diagnosis(&bench, &[], 0);
    assert!(!list(&adequate, "limits").is_empty(), "explained: {adequate:#}");
    // Whatever an offset looks like.
    let alike = ["calibration", "radiation", "drift", "crosstalk", "coloured-noise", "input-mismatch"];
    let without: Vec<&str> = alike.iter().flat_map(|name| ["--without", name]).collect();
    let answer = bench.run(&[&["diagnose", "run.csv", "--json"], &without[..]].concat());
    let left = answer.json();
    assert!(["partly-explained", "unexplained"].contains(&text(&left, "verdict")), "{answer:#?}");
    assert!(list(&left, "limits").is_empty() && !list(&left, "not_testable").is_empty(), "{answer:#?}");
    let shown = bench.run(&[&["diagnose", "run.csv"], &without[..]].concat()).stdout;
    assert!(shown.contains("nothing can be excluded") && shown.contains("twinlag explain two-sensors"), "{shown}");
    assert!(!shown.contains("that both sensors share"), "{shown}");
}

/// The text says what the JSON says: verdict, effect, both time constants.
#[test]
fn the_text_names_verdict_and_effect() {
    let answer = offset("text").run(&["diagnose", "run.csv"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    for word in ["explained", "calibration", "T1", "T2", "ms"] {
        assert!(answer.stdout.contains(word), "no \"{word}\": {answer:#?}");
    }
    assert!(!answer.stdout.contains("NaN"), "{answer:#?}");
}

#[test]
fn a_saved_model_characterises_a_later_record() {
    let bench = offset("save");
    diagnosis(&bench, &["--save", "model.json"], 0);
    let model: Value = serde_json::from_slice(&bench.read("model.json")).expect("JSON");
    assert_eq!(text(&model, "schema"), "twinlag.model/1");
    assert_eq!(model["effects"][0]["effect"], "calibration", "{model:#}");
    // Two lags alone do not explain the later record: what follows is the model's doing.
    let plain = bench.characterise("later.csv", &[]).json();
    assert_ne!(plain["status"], "ok", "{plain:#}");
    let answer = bench.characterise("later.csv", &["--model", "model.json"]);
    let value = answer.status(&["ok"]);
    has_the_fields_of_a_characterisation(&value);
    recovers(&value, Trace::GOOD.tau_s);
}

/// Which column is asked for as the first is the user's choice: an effect goes with the name of its channel. Where it cannot
/// (a calibration is that of the second channel), the model is refused, not put on the other sensor.
#[test]
fn a_saved_model_knows_its_channels_by_name() {
    let bench = offset("swapped");
    diagnosis(&bench, &["--save", "model.json"], 0);
    let answer = bench.characterise("later.csv", &["--model", "model.json", "--t1", "T2", "--t2", "T1"]);
    if answer.code == 3 {
        answer.says(&["model.json", "T2"]);
        return;
    }
    let [fast_s, slow_s] = Trace::GOOD.tau_s;
    recovers(&answer.status(&["ok"]), [slow_s, fast_s]);
}

/// Failed: a file of the same rig whose columns have other names, or are sorted by name, could not be used with the model, nor in a group.
#[test]
fn sensors_of_other_files_are_those_of_the_first() {
    let bench = offset("sensors");
    diagnosis(&bench, &["--save", "model.json"], 0);
    let rows = |file: &str| {
        let text = String::from_utf8(bench.read(file)).expect("text");
        text.split_once('\n').expect("a header").1.to_owned()
    };
    bench.write("renamed.csv", format!("time_s,fine,coarse\n{}", rows("later.csv")));
    let renamed = bench.characterise("renamed.csv", &["--model", "model.json", "--t1", "fine", "--t2", "coarse"]);
    recovers(&renamed.status(&["ok"]), Trace::GOOD.tau_s);
    let mut sorted = "time_s,coarse,fine\n".to_owned();
    for line in rows("run.csv").lines() {
        let cells: Vec<&str> = line.split(',').collect();
        sorted.push_str(&[cells[0], cells[2], cells[1]].join(","));
        sorted.push('\n');
    }
    bench.write("sorted.csv", sorted);
    let together = bench.run(&["characterise", "renamed.csv", "sorted.csv"]);
    let note = "note: sorted.csv: fine is taken as the first sensor, as in renamed.csv";
    assert!(together.stderr.contains(note), "{together:#?}");
}

/// Nothing but noise: neither time constant is determined, and both schemas say so by the same names.
#[test]
fn what_is_unknown_has_the_names_of_a_characterisation() {
    let bench = Bench::with("unknown_names", "run.csv", Trace { gas: Gas::Still, ..Trace::GOOD }.csv());
    let value = bench.run(&["diagnose", "run.csv", "--json"]).json();
    let unknown = list(&value["final"], "not_identifiable");
    assert!(!unknown.is_empty(), "{value:#}");
    for name in unknown {
        let name = name.as_str().expect("a text");
        assert!(["T1.time_constant_s", "T2.time_constant_s"].contains(&name), "{name}");
    }
}

/// The record that made the model gives with it the time constants that the diagnosis gave, and their standard errors, since the numbers of
/// the effect are fitted again: they agree to a tenth of a standard error, which is where fits stop, and the errors to a hundredth. Intervals
/// of the diagnosis also cover other causes, which the condition names.
#[test]
fn a_saved_model_gives_its_own_record_the_same_time_constants() {
    let bench = offset("same");
    let (diagnosed, _) = diagnosis(&bench, &["--save", "model.json"], 0);
    let with = bench.characterise("run.csv", &["--model", "model.json"]).status(&["ok"]);
    for ((got, got_error), (want, error)) in estimates(&with).into_iter().zip(estimates(&diagnosed["final"])) {
        assert!((got - want).abs() < 0.1 * error, "got {got}, want {want} ± 0.1 × {error}");
        assert!((got_error / error - 1.0).abs() < 0.01, "got {got_error}, want {error}");
    }
}

#[test]
fn an_output_that_exists_is_kept() {
    let bench = offset("kept");
    for option in ["--save", "--report"] {
        bench.write("out", "mine");
        bench.refuses(2, &["diagnose", "run.csv", option, "out"], &["out", "exists", "--force"]);
        assert_eq!(bench.read("out"), b"mine", "{option}");
    }
}

#[test]
fn an_output_that_exists_is_overwritten_by_force() {
    let bench = offset("force");
    bench.write("model.json", "mine");
    diagnosis(&bench, &["--save", "model.json", "--force"], 0);
    let model: Value = serde_json::from_slice(&bench.read("model.json")).expect("JSON");
    assert_eq!(text(&model, "schema"), "twinlag.model/1");
}

/// A record that is there twice is not left out when one of the two is.
#[test]
fn a_copy_of_a_record_is_refused() {
    let bench = offset("diagnose-copy");
    bench.write("copy.csv", with_offset(Trace::GOOD));
    bench.refuses(
        2,
        &["diagnose", "run.csv", "copy.csv"],
        &["copy.csv: 2000 of its 2000 rows are also rows of run.csv"],
    );
}

/// So is a part of a record, and what a logger wrote to the end of one file and to the beginning of the next.
#[test]
fn records_with_readings_of_each_other_are_refused() {
    let bench = offset("diagnose-shared");
    let rows = |seed: u64| {
        let mut rows = Trace { seed, ..Trace::GOOD }.rows();
        rows.iter_mut().for_each(|row| row[2] += OFFSET_K);
        rows
    };
    let (run, later) = (rows(Trace::GOOD.seed), rows(2));
    bench.write("cut.csv", csv(&run[700..1900]));
    let mut goes_on = [&run[1500..], &later[..800]].concat();
    goes_on.iter_mut().enumerate().for_each(|(k, row)| row[0] = Trace::GOOD.period_s * k as f64);
    bench.write("next.csv", csv(&goes_on));
    bench.refuses(2, &["diagnose", "run.csv", "cut.csv"], &["cut.csv: 1200 of its 1200 rows are also rows of run.csv"]);
    bench.refuses(
        2,
        &["characterise", "cut.csv", "run.csv"],
        &["run.csv: 1200 of its 2000 rows are also rows of cut.csv"],
    );
    bench.refuses(
        2,
        &["diagnose", "run.csv", "next.csv"],
        &["next.csv: 500 of its 1300 rows are also rows of run.csv"],
    );
}

/// Two steps of a coarse converter in turn, at rest before and after a run, are in both records, and are no rows of one in the other.
#[test]
fn records_that_rest_alike_are_two_records() {
    let bench = Bench::new("diagnose-rest");
    for (seed, name) in [(1, "one.csv"), (2, "two.csv")] {
        let mut rows = Trace { seed, ..Trace::GOOD }.rows();
        let count = rows.len();
        let rests = (0..40).chain(count - 40..count);
        rests.for_each(|k| rows[k][1..].fill(if k % 2 == 0 { 20.0 } else { 20.5 }));
        bench.write(name, csv(&rows));
    }
    let answer = bench.run(&["characterise", "one.csv", "two.csv"]);
    assert!(answer.code != 2 && !answer.stderr.contains("are also rows"), "{answer:#?}");
}

/// Both time constants of several records: what is read of each is said with its name, and a model is of one.
#[test]
fn several_records_are_characterised_together() {
    let bench = Bench::new("characterise-several");
    for (seed, file) in ["1", "2", "3"].iter().zip(["a.csv", "b.csv", "c.csv"]) {
        bench.write("rig.toml", FAST_RIG);
        let answer = bench.run(&["simulate", "rig.toml", "--seed", seed, "--out", file, "--quiet"]);
        assert_eq!(answer.code, 0, "{answer:#?}");
    }
    let answer = bench.run(&["characterise", "a.csv", "b.csv", "c.csv", "--json"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    answer.says(&["note: b.csv: ", "note: c.csv: "]);
    let value = answer.json();
    let sources: Vec<&str> = list(&value, "records").iter().map(|record| text(record, "source")).collect();
    assert_eq!(sources, ["a.csv", "b.csv", "c.csv"]);
    assert_eq!(value["transfer"]["count"], 3);
    let shown = bench.run(&["characterise", "a.csv", "b.csv", "c.csv", "--quiet"]);
    for words in ["with the time constants of the others", "what each record says by itself"] {
        assert!(shown.stdout.contains(words), "{shown:#?}");
    }
    let answer = bench.run(&["diagnose", "a.csv", "b.csv", "--report", "page.html", "--quiet"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    let page = String::from_utf8(bench.read("page.html")).expect("text");
    assert!(page.contains("Each record") && page.contains("b.csv"), "{page}");
    let message = &["--model m.json", "one file", "3", "twinlag diagnose"];
    bench.refuses(2, &["characterise", "a.csv", "b.csv", "c.csv", "--model", "m.json"], message);
    bench.refuses(2, &["characterise", "a.csv", "a.csv"], &["a.csv is named twice"]);
}

/// Of several records the one that cannot be used is named.
#[test]
fn the_record_that_is_too_short_is_named() {
    let bench = offset("diagnose-short");
    bench.write("short.csv", csv(&Trace::GOOD.rows()[..30]));
    bench.refuses(
        3,
        &["diagnose", "run.csv", "short.csv"],
        &["short.csv: a model of the rig needs at least 60 samples"],
    );
}

#[test]
fn a_model_that_cannot_be_written_is_said() {
    let answer = offset("no_place").run(&["diagnose", "run.csv", "--save", "nowhere/model.json"]);
    assert_eq!(answer.code, 1, "{answer:#?}");
    answer.says(&["nowhere/model.json", "cannot be written"]);
}

#[test]
fn an_unknown_effect_is_refused_with_the_list() {
    let bench = offset("unknown");
    bench.refuses(2, &["diagnose", "run.csv", "--without", "magic"], &[&["magic"], &EFFECTS[..]].concat());
}

/// Nothing else in the library imitates an offset of a tenth of the gas without a trace but drift and radiation, which
/// `alternatives` or the verdict then say.
#[test]
fn an_effect_that_is_left_out_is_not_named() {
    let (value, answer) = diagnosis(&offset("without"), &["--without", "calibration,drift"], 0);
    has_the_fields_of_a_diagnosis(&value);
    for effect in list(&value, "effects") {
        let names = [&[effect["effect"].clone()], list(effect, "alternatives")].concat();
        assert!(!names.iter().any(|n| n == "calibration" || n == "drift"), "{answer:#?}");
    }
}

#[test]
fn a_model_that_cannot_be_read_is_refused() {
    let bench = offset("bad_model");
    let with = |model: &str, words: &[&str]| bench.refuses(3, &["characterise", "run.csv", "--model", model], words);
    with("missing.json", &["missing.json", "cannot be read"]);
    bench.write("text.json", "time constants: 1, 2\n");
    with("text.json", &["text.json", "expected a model", "--save"]);
    bench.write("other.json", r#"{"schema": "twinlag.model/1"}"#);
    with("other.json", &["other.json", "expected a model"]);
}

/// As a program of another version would have written it.
#[test]
fn a_model_of_another_schema_or_effect_is_refused() {
    let bench = offset("other_model");
    diagnosis(&bench, &["--save", "model.json"], 0);
    let model: Value = serde_json::from_slice(&bench.read("model.json")).expect("JSON");
    let changed = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut model = model.clone();
        change(&mut model);
        bench.write(name, model.to_string());
        bench.refuses(3, &["characterise", "run.csv", "--model", name], &[name]);
    };
    changed("schema.json", &|m| m["schema"] = "twinlag.model/99".into());
    changed("effect.json", &|m| m["effects"][0]["effect"] = "magic".into());
}

/// The same for parameters that the effect does not have: the message names the effect.
#[test]
fn a_model_of_other_parameters_is_refused() {
    let bench = offset("parameters");
    diagnosis(&bench, &["--save", "model.json"], 0);
    let mut model: Value = serde_json::from_slice(&bench.read("model.json")).expect("JSON");
    for parameter in model["effects"][0]["parameters"].as_array_mut().expect("a list") {
        parameter["name"] = "wrong".into();
    }
    bench.write("model.json", model.to_string());
    bench.refuses(3, &["characterise", "run.csv", "--model", "model.json"], &["calibration", "version"]);
}

#[test]
fn a_file_that_is_no_record_is_refused() {
    Bench::with("empty", "run.csv", "").refuses(3, &["diagnose", "run.csv"], &["run.csv", "empty"]);
    Bench::new("missing").refuses(3, &["diagnose", "run.csv"], &["run.csv", "cannot be read"]);
}

/// The numbers are the same to the last digit on one processor.
#[test]
fn the_answer_does_not_depend_on_the_number_of_processors() {
    let bench = offset("processors");
    let (mut plain, _) = diagnosis(&bench, &[], 0);
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join("processors");
    let program = env!("CARGO_BIN_EXE_twinlag");
    let run = std::process::Command::new("taskset")
        .args(["-c", "0", program, "diagnose", "run.csv", "--json", "--quiet"])
        .current_dir(dir)
        .output();
    // A machine without `taskset`, or on which processor 0 is not ours, has nothing to compare with.
    let Some(output) = run.ok().filter(|o| o.status.success()) else { return };
    let mut one: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for value in [&mut plain, &mut one] {
        ["base", "final"].iter().for_each(|part| forget_time(&mut value[*part]));
    }
    assert_eq!(plain, one);
}

/// Wall-clock times, the only numbers that may differ.
fn forget_time(value: &mut Value) {
    if let Some(fields) = value.as_object_mut() {
        fields.retain(|name, _| !name.contains("wall") && !name.contains("elapsed") && name != "date");
        fields.values_mut().for_each(forget_time);
    }
}

/// The code of a digital sensor that did not answer, at the end of the record as well. Failed: neighbours on one side only were none, and
/// a gas of minus 146 868 °C followed.
#[test]
fn wrong_readings_at_the_ends_of_a_record_are_found() {
    let bench = Bench::simulated("spikes_at_the_ends", crate::common::RIG);
    let text = String::from_utf8(bench.read("run.csv")).expect("UTF-8");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let last = lines.len() - 1;
    for row in [300, 600, 900, last] {
        let mut cells: Vec<&str> = lines[row].split(',').collect();
        cells[2] = "-127.00";
        lines[row] = cells.join(",");
    }
    bench.write("wrong.csv", lines.join("\n"));
    let value = bench.run(&["diagnose", "wrong.csv", "--json"]).json();
    let spikes = list(&value, "effects").iter().find(|effect| effect["effect"] == "spikes").expect("is found");
    // Lines are counted from 1.
    let first = |run: &Value| run["rows"][0].as_u64().expect("a line");
    let masked: Vec<u64> = list(spikes, "masked").iter().map(first).collect();
    assert_eq!(masked, [301, 601, 901, last as u64 + 1], "{spikes:#}");
}
