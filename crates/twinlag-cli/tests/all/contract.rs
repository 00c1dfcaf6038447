//! What scripts rely on: fields, types, streams and exit codes of the program, as `docs` and the schema's example state
//! them, and that its commands agree with each other.

use crate::common::{Bench, Trace, estimates, interval, number, recovers, reference};
use serde_json::Value;

const ESTIMATORS: [&str; 5] = ["whitened", "cross-relation", "bias-compensated", "normalised", "hybrid"];
const CLOSED_FORM: [&str; 3] = ["difference-equation-ls", "difference-equation-tls", "difference-equation-gtls"];
const OPTIMISERS: [&str; 3] = ["levenberg-marquardt", "nelder-mead", "l-bfgs"];
const TRUTH_S: [f64; 2] = [0.0238, 0.1168];

fn sine(test: &str) -> Bench {
    Bench::with(test, "sine.csv", std::fs::read(reference("sine_5pct.csv")).expect("a committed file"))
}

fn texts(value: &Value) -> Vec<&str> {
    value.as_array().expect("a list").iter().map(|text| text.as_str().expect("texts")).collect()
}

fn is_null_or_interval(value: &Value) -> bool {
    value.is_null() || interval(value).iter().all(|end| end.is_finite())
}

/// Every field of the example of schema `twinlag.characterisation/1`, with its type.
fn has_the_fields_of_the_schema(value: &Value) {
    assert_eq!(value["schema"], "twinlag.characterisation/1");
    let record = &value["record"];
    assert!(record["samples"].is_u64() && record["missing"].is_u64(), "{record}");
    assert!(number(&record["sample_period_s"]) > 0.0);
    assert_eq!(texts(&record["channels"]).len(), 2);
    assert!(ESTIMATORS.contains(&value["estimator"].as_str().expect("a text")));
    assert!(OPTIMISERS.contains(&value["optimiser"].as_str().expect("a text")));
    let sensors = value["sensors"].as_array().expect("a list");
    assert_eq!(sensors.len(), 2);
    for (sensor, channel) in sensors.iter().zip(texts(&record["channels"])) {
        assert_eq!(sensor["channel"], channel);
        for field in ["time_constant_s", "standard_error_s"] {
            assert!(sensor.get(field).is_some_and(|v| v.is_null() || number(v) > 0.0), "{field}: {sensor}");
        }
        assert!(sensor.get("interval_95_s").is_some_and(is_null_or_interval), "{sensor}");
        if !sensor["interval_95_s"].is_null() {
            let [low, high] = interval(&sensor["interval_95_s"]);
            assert!((low..=high).contains(&number(&sensor["time_constant_s"])), "{sensor}");
        }
        assert!(number(&sensor["noise_std_K"]) > 0.0, "{sensor}");
        for field in ["noise_standard_error_K", "noise_ar1", "second_time_constant_s", "interval_basis"] {
            assert!(sensor.get(field).is_some(), "{field}: {sensor}");
        }
        let sources = ["given", "quiet-segment", "third-differences", "inferred-inputs", "residual"];
        assert!(sources.contains(&sensor["noise_from"].as_str().expect("a text")), "{sensor}");
    }
    let difference = &value["time_constant_difference_s"];
    assert!(difference.get("value").is_some_and(|v| v.is_null() || v.is_f64()), "{difference}");
    assert!(difference.get("interval_95_s").is_some_and(is_null_or_interval), "{difference}");
    for name in ["gain", "offset_K"] {
        let free = value["free"].get(name).expect("gain and offset_K are always there");
        assert!(free.is_null() || (free["value"].is_f64() && is_null_or_interval(&free["interval_95"])), "{free}");
    }
    let residual = &value["residual"];
    assert!(residual.get("chi2_per_dof").is_some_and(|v| v.is_null() || number(v) > 0.0), "{residual}");
    assert!(residual["white"].is_boolean(), "{residual}");
    for test in residual["tests"].as_array().expect("a list") {
        assert!(test["test"].is_string() && number(&test["statistic"]).is_finite(), "{test}");
        assert!((0.0..=1.0).contains(&number(&test["p_value"])), "{test}");
    }
    assert!(
        ["ok", "at-bound", "not-identifiable", "model-rejected"].contains(&value["status"].as_str().expect("a text"))
    );
    texts(&value["not_identifiable"]);
    texts(&value["warnings"]);
}

#[test]
fn an_answer_has_every_field_of_the_schema() {
    let value = sine("schema").characterise("sine.csv", &[]).status(&["ok"]);
    has_the_fields_of_the_schema(&value);
    let record = &value["record"];
    assert_eq!((&record["samples"], &record["missing"]), (&2500.into(), &0.into()));
    assert_eq!(texts(&record["channels"]), ["T1", "T2"]);
    // The stamps are multiples of 2 ms to the millisecond; the mean step over 5 s is that to many digits.
    assert!((number(&record["sample_period_s"]) - 0.002).abs() < 1e-9, "{record}");
    assert!(value["free"]["gain"].is_null() && value["free"]["offset_K"].is_null());
    assert!(!value["residual"]["tests"].as_array().expect("a list").is_empty());
    recovers(&value, TRUTH_S);
}

#[test]
fn an_answer_with_calibration_has_gain_and_offset_as_objects() {
    let bench = Bench::with("calibration", "run.csv", Trace::GOOD.csv());
    let value = bench.characterise("run.csv", &["--free", "gain,offset"]).status(&["ok"]);
    has_the_fields_of_the_schema(&value);
    // Four standard errors: by chance once in 16 000.
    for (name, want) in [("gain", 1.0), ("offset_K", 0.0)] {
        let free = &value["free"][name];
        let (got, error) = (number(&free["value"]), number(&free["standard_error"]));
        assert!((got - want).abs() <= 4.0 * error, "{name}: got {got} ± {error}, want {want}");
        let [low, high] = interval(&free["interval_95"]);
        assert!(low < got && got < high);
    }
}

#[test]
fn an_answer_that_is_none_has_every_field_too_and_exit_code_four() {
    let text = Trace { tau_s: [0.05, 0.05], ..Trace::GOOD }.csv();
    let answer = Bench::with("no_answer", "run.csv", text).characterise("run.csv", &[]);
    let value = answer.status(&["not-identifiable", "at-bound"]);
    has_the_fields_of_the_schema(&value);
    assert_eq!(answer.code, 4);
    let unknown = texts(&value["not_identifiable"]);
    assert!(unknown.contains(&"T1.time_constant_s") && unknown.contains(&"T2.time_constant_s"), "{unknown:?}");
}

/// One object, a line feed, nothing before or behind; what was understood of the file goes to the other stream.
#[test]
fn the_answer_goes_to_one_stream_and_the_notes_to_the_other() {
    let bench = sine("streams");
    let answer = bench.characterise("sine.csv", &[]);
    assert!(answer.stdout.starts_with('{') && answer.stdout.ends_with("}\n"), "{answer:#?}");
    answer.json();
    answer.says(&["time guessed to be column 1 'time_s'", "T1 guessed to be column 2", "T2 guessed to be column 3"]);
    assert!(!answer.stderr.is_empty() && answer.stderr.lines().all(|l| l.starts_with("note: ")), "{answer:#?}");
    let quiet = bench.characterise("sine.csv", &["--quiet"]);
    assert_eq!((quiet.stderr.as_str(), quiet.stdout.as_str()), ("", answer.stdout.as_str()));
}

#[test]
fn quiet_does_not_silence_errors() {
    let answer = Bench::new("quiet_error").run(&["characterise", "nothing.csv", "--quiet"]);
    assert_eq!(answer.code, 3);
    answer.says(&["nothing.csv", "cannot be read"]);
}

#[test]
fn text_for_people_holds_what_the_json_holds() {
    let bench = sine("text");
    let value = bench.characterise("sine.csv", &[]).json();
    let answer = bench.run(&["characterise", "sine.csv"]);
    assert_eq!(answer.code, 0);
    for (sensor, (tau_s, _)) in value["sensors"].as_array().expect("two").iter().zip(estimates(&value)) {
        // Three digits are shown at least.
        let channel = sensor["channel"].as_str().expect("a text");
        let shown = answer.stdout.lines().find(|line| line.trim_start().starts_with(channel)).expect("a line for it");
        let number = shown.split_whitespace().find_map(|word| word.parse::<f64>().ok()).expect("a number in it");
        assert!((number / tau_s - 1.0).abs() < 5e-3, "{shown}, want {tau_s}");
    }
    assert!(answer.stdout.contains("status: ok") && answer.stdout.contains("95 %"), "{answer:#?}");
}

/// What is in an answer besides where the record came from and what was asked.
fn findings(value: &Value) -> Vec<&Value> {
    ["sensors", "time_constant_difference_s", "residual", "status", "fit"].iter().map(|name| &value[*name]).collect()
}

#[test]
fn a_dash_reads_standard_input() {
    let bench = sine("dash");
    let file = bench.characterise("sine.csv", &[]).json();
    let piped = bench.run_with_input(&["characterise", "-", "--json"], &bench.read("sine.csv")).json();
    assert_eq!(findings(&file), findings(&piped));
}

#[test]
fn column_numbers_and_names_select_the_same_columns() {
    let bench = sine("columns");
    let guessed = bench.characterise("sine.csv", &[]).json();
    for columns in [["time_s", "T1", "T2"], ["1", "2", "3"], ["time", "t1", "T2"]] {
        let [time, t1, t2] = columns;
        let answer = bench.characterise("sine.csv", &["--time", time, "--t1", t1, "--t2", t2]);
        assert!(!answer.stderr.contains("guessed"), "{answer:#?}");
        assert_eq!(findings(&answer.json()), findings(&guessed), "{columns:?}");
    }
    // The other way round is another question: names of the channels change sides.
    let swapped = bench.characterise("sine.csv", &["--t1", "3", "--t2", "2"]).json();
    assert_eq!(texts(&swapped["record"]["channels"]), ["T2", "T1"]);
}

#[test]
fn given_noise_levels_are_those_of_the_answer() {
    let bench = sine("noise");
    // The truth of this record, from tests/data/expected.json.
    let value = bench.characterise("sine.csv", &["--noise", "0.583363,0.583363"]).status(&["ok"]);
    assert!((0..2).all(|i| number(&value["sensors"][i]["noise_std_K"]) == 0.583_363), "{value:#}");
    assert!((0..2).all(|i| value["sensors"][i]["noise_standard_error_K"].is_null()), "{value:#}");
    assert!((0..2).all(|i| value["sensors"][i]["noise_from"] == "given"), "{value:#}");
    recovers(&value, TRUTH_S);
    // A tenth of the truth: a hundred times the energy, which must not pass for noise.
    let value = bench.characterise("sine.csv", &["--noise", "0.0583,0.0583"]).status(&["model-rejected"]);
    assert!((number(&value["residual"]["chi2_per_dof"]) / 100.0 - 1.0).abs() < 0.2, "{value:#}");
}

#[test]
fn a_value_known_exactly_is_held_and_has_no_error() {
    let bench = sine("held");
    let value = bench.characterise("sine.csv", &["--known", "T1.time_constant_s=0.025"]).status(&["ok"]);
    let held = &value["sensors"][0];
    assert_eq!(number(&held["time_constant_s"]), 0.025);
    assert!(held["standard_error_s"].is_null() && held["interval_95_s"].is_null(), "{held}");
    assert_eq!((&held["known"], &value["sensors"][1]["known"]), (&true.into(), &false.into()));
    let free = bench.characterise("sine.csv", &[]).json();
    assert!(number(&value["sensors"][1]["standard_error_s"]) < estimates(&free)[1].1);
    let calibrated = bench.characterise("sine.csv", &["--known", "T2.gain=1.0", "--known", "T2.offset_K=0"]).json();
    // Gain one and no offset is what is assumed anyway; the optimisers stop at steps of 1e-9, the errors are 2e-2.
    for (a, b) in estimates(&calibrated).iter().zip(estimates(&free)) {
        assert!((a.0 / b.0 - 1.0).abs() < 1e-6, "{a:?}, {b:?}");
    }
}

/// A weighted mean: with the record's own `t ± s` and the knowledge `t0 ± s0`, independent, it is at
/// `(t/s² + t0/s0²)/(1/s² + 1/s0²)` with variance `1/(1/s² + 1/s0²)`. The record's likelihood is a parabola only about; at a
/// relative error of 2 % its curvature changes by as much over a standard error, so 5 % of a standard error are allowed for
/// the mean and 5 % for the error.
#[test]
fn a_value_known_with_an_error_is_weighed_against_the_record() {
    let bench = sine("weighed");
    let (t, s) = estimates(&bench.characterise("sine.csv", &[]).json())[0];
    let (t0, s0) = (0.0245, 0.0005_f64);
    let value = bench.characterise("sine.csv", &["--known", "T1.time_constant_s=0.0245+-0.0005"]).status(&["ok"]);
    let (got, error) = estimates(&value)[0];
    let weight = s.powi(-2) + s0.powi(-2);
    let (want, want_error) = ((t * s.powi(-2) + t0 * s0.powi(-2)) / weight, weight.sqrt().recip());
    assert!((got - want).abs() < 0.05 * want_error, "got {got}, want {want} ± {want_error}");
    assert!((error / want_error - 1.0).abs() < 0.05, "got {error}, want {want_error}");
    assert_eq!(value["sensors"][0]["known"], false);
}

/// The unbiased estimators are within five of the larger standard error of each other: they are consistent for the same
/// numbers on the same data, so their difference scatters less than either. An optimiser must add nothing to an error:
/// a hundredth of it is allowed for where it stops.
#[test]
fn every_estimator_with_every_optimiser_finds_the_same_time_constants() {
    let bench = sine("estimators");
    let want = estimates(&bench.characterise("sine.csv", &[]).json());
    for estimator in ESTIMATORS {
        let mut first = None;
        for optimiser in OPTIMISERS {
            if (estimator, optimiser) == ("hybrid", "nelder-mead") {
                // The spread at which the simplex stops is below the rounding of this cost, a difference of near equals.
                continue;
            }
            let options = ["--estimator", estimator, "--optimiser", optimiser];
            let value = bench.characterise("sine.csv", &options).status(&["ok"]);
            assert_eq!((&value["estimator"], &value["optimiser"]), (&estimator.into(), &optimiser.into()));
            let got = estimates(&value);
            let first = *first.get_or_insert(got);
            for i in 0..2 {
                let (tau_s, error) = got[i];
                let from_first = (tau_s - first[i].0).abs();
                assert!(from_first < 0.01 * error, "{options:?}: {tau_s}, by the first optimiser {}", first[i].0);
                let from_default = (tau_s - want[i].0).abs();
                let is_biased = estimator == "cross-relation";
                let limit = 5.0 * error.max(want[i].1);
                assert!(is_biased || from_default < limit, "{options:?}: {tau_s} ± {error}, want {:?}", want[i]);
                // Noise makes the plain cost's time constants too long, which the answer must say.
                assert!(!is_biased || tau_s > want[i].0, "{options:?}: {tau_s}");
            }
            let warns = value["warnings"].to_string().contains("biased");
            assert_eq!(warns, estimator == "cross-relation", "{value:#}");
        }
    }
}

/// In closed form: no optimiser, no start. The generalised one is consistent and within five of the larger standard error of the
/// whitened estimate; least squares is too short, which the answer says.
#[test]
fn the_estimators_in_closed_form_answer_without_an_optimiser() {
    let bench = sine("closed_form");
    let want = estimates(&bench.characterise("sine.csv", &[]).json());
    for estimator in CLOSED_FORM {
        // Least squares leaves more than noise, and its numbers are not given unless asked for.
        let value = bench.characterise("sine.csv", &["--estimator", estimator, "--best-effort"]);
        let value: Value = serde_json::from_str(&value.stdout).expect("an object");
        assert_eq!((&value["estimator"], &value["optimiser"]), (&estimator.into(), &"closed-form".into()));
        assert_eq!((&value["fit"]["optimiser"], &value["starts"]), (&"closed-form".into(), &0.into()));
        let is_consistent = estimator == "difference-equation-gtls";
        assert_eq!(value["warnings"].to_string().contains("biases"), !is_consistent, "{value:#}");
        if estimator == "difference-equation-tls" {
            // Biased either way.
            continue;
        }
        for (got, want) in estimates(&value).iter().zip(want) {
            if is_consistent {
                assert!((got.0 - want.0).abs() < 5.0 * got.1.max(want.1), "{estimator}: {got:?}, want {want:?}");
            } else {
                assert!(got.0 < want.0, "{estimator}: {got:?}, want less than {want:?}");
            }
        }
    }
}

#[test]
fn a_second_lag_is_an_object_of_its_sensor_and_null_where_not_asked() {
    let second = "time_constant_s = 0.0238\nsecond_time_constant_s = 0.008";
    let text = rig(GASES[2].1, 4000).replacen("time_constant_s = 0.0238", second, 1);
    let bench = Bench::with("second_lag", "rig.toml", text);
    assert_eq!(bench.run(&["simulate", "rig.toml", "--out", "run.csv"]).code, 0);
    bench.characterise("run.csv", &[]).status(&["model-rejected"]);
    let value = bench.characterise("run.csv", &["--second-order", "T1"]).status(&["ok"]);
    recovers(&value, TRUTH_S);
    let lag = &value["sensors"][0]["second_time_constant_s"];
    let (got, error) = (number(&lag["value"]), number(&lag["standard_error"]));
    // Four standard errors: by chance once in 16 000.
    assert!((got - 0.008).abs() < 4.0 * error, "got {got} ± {error}, want 0.008");
    let [low, high] = interval(&lag["interval_95"]);
    assert!(low < got && got < high);
    assert!(value["sensors"][1]["second_time_constant_s"].is_null());
    let text = bench.run(&["characterise", "run.csv", "--second-order", "T1,T2"]).stdout;
    assert!(text.contains("second time constant 0.0") && text.contains("second time constant not detected"), "{text}");
}

#[test]
fn intervals_say_what_they_are_made_of() {
    let bench = sine("intervals");
    let basis = |value: &Value| [0, 1].map(|i| value["sensors"][i]["interval_basis"].as_str().unwrap_or("").to_owned());
    for (further, method, want) in [
        (&[][..], "information", "standard-error"),
        (&["--intervals", "profile"], "information", "profile"),
        (&["--intervals", "bootstrap", "--replicates", "59", "--seed", "3"], "bootstrap", "bootstrap"),
    ] {
        let value = bench.characterise("sine.csv", further).status(&["ok"]);
        assert_eq!(value["interval_method"], method);
        assert_eq!(basis(&value), [want, want]);
    }
    let same = ["--intervals", "bootstrap", "--replicates", "39"];
    assert_eq!(bench.characterise("sine.csv", &same).stdout, bench.characterise("sine.csv", &same).stdout);
}

fn rig(gas: &str, samples: usize) -> String {
    let [fast, slow] = TRUTH_S;
    format!(
        "seed = 1\n[record]\nsamples = {samples}\nsample_period_s = 0.002\n[gas]\nmean_c = 300.0\n{gas}\n\
         [[sensors]]\nchannel = \"T1\"\ntime_constant_s = {fast}\nnoise = {{ std_k = 0.5 }}\n\
         [[sensors]]\nchannel = \"T2\"\ntime_constant_s = {slow}\nnoise = {{ std_k = 0.5 }}\n"
    )
}

const GASES: [(&str, &str); 6] = [
    (
        "multi-tone",
        "kind = \"multi-tone\"\ntones = [{ amplitude_k = 25.0, frequency_hz = 1.0 }, \
         { amplitude_k = 20.0, frequency_hz = 4.3 }, { amplitude_k = 15.0, frequency_hz = 11.0 }]",
    ),
    ("engine", "kind = \"engine\"\namplitude_k = 60.0\nfrequency_hz = 8.0\namplitude_relative_std = 0.2"),
    ("turbulence", "kind = \"turbulence\"\nstd_k = 20.0\ncorner_hz = 3.0\ncutoff_hz = 60.0"),
    ("plunge", "kind = \"plunge\"\namplitude_k = 60.0\ndwell_s = 0.4\nrise_s = 0.03"),
    ("broadband", "kind = \"broadband\"\nstd_k = 20.0\ncorner_hz = 3.0"),
    ("series", "kind = \"series\"\npath = \"gas.csv\""),
];

/// A triangle of 0.7 s and a saw tooth of 1.1 s, about 0 °C, each 20 K high, for 9 s.
fn series() -> String {
    (0..900).fold("time_s,value_c\n".to_owned(), |text, k| {
        let t = f64::from(k) * 0.01;
        let value = 20.0 * (2.0 * (t / 0.7).fract() - 1.0).abs() + 20.0 * (t / 1.1).fract() - 20.0;
        format!("{text}{t:.2},{value:.4}\n")
    })
}

/// The rig's gas moves on between the samples, where the estimator knows nothing: part of the standard error it states.
#[test]
fn what_is_simulated_is_recovered_for_every_kind_of_gas_but_one_tone() {
    for (kind, gas) in GASES {
        let bench = Bench::with(&format!("recovers_{kind}"), "rig.toml", rig(gas, 4000));
        bench.write("gas.csv", series());
        for seed in ["1", "2", "3"] {
            let answer = bench.run(&["simulate", "rig.toml", "--out", "out.csv", "--seed", seed, "--force"]);
            assert_eq!((answer.code, answer.stdout.as_str()), (0, ""), "{answer:#?}");
            let value = bench.characterise("out.csv", &[]).status(&["ok"]);
            assert_eq!((&value["record"]["samples"], &value["record"]["missing"]), (&4000.into(), &0.into()), "{kind}");
            recovers(&value, TRUTH_S);
            for i in 0..2 {
                // Given 4000 samples, the level is known to a few per cent: third differences of white noise have
                // 35 degrees of freedom for 18 of the samples' own. The gas between the samples adds a little.
                let noise = number(&value["sensors"][i]["noise_std_K"]);
                assert!((noise / 0.5 - 1.0).abs() < 0.15, "{kind}: {noise} K, want 0.5 K");
            }
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let bench = Bench::with("seeds", "rig.toml", rig(GASES[2].1, 500));
    let simulate = |out: &str, further: &[&str]| {
        let answer = bench.run(&[&["simulate", "rig.toml", "--out", out], further].concat());
        assert_eq!(answer.code, 0, "{answer:#?}");
        answer.stdout
    };
    for (out, seed) in [("a.csv", "5"), ("b.csv", "5"), ("c.csv", "6"), ("one.csv", "1")] {
        assert_eq!(simulate(out, &["--seed", seed]), "");
    }
    simulate("own.csv", &[]);
    assert_eq!(bench.read("a.csv"), bench.read("b.csv"));
    assert_ne!(bench.read("a.csv"), bench.read("c.csv"));
    assert_eq!(bench.read("own.csv"), bench.read("one.csv"), "the rig's own seed is 1");
    assert_eq!(simulate("-", &["--seed", "5"]).as_bytes(), bench.read("a.csv"), "standard output and file");
    let value: Value = serde_json::from_str(&simulate("d.csv", &["--seed", "5", "--json"])).expect("one JSON object");
    assert_eq!((&value["rig"]["seed"], &value["samples"]), (&5.into(), &500.into()));
    assert_eq!(bench.read("d.csv"), bench.read("a.csv"));
}

#[test]
fn the_same_question_gives_the_same_bytes() {
    let bench = sine("repeat");
    assert_eq!(bench.characterise("sine.csv", &[]).stdout, bench.characterise("sine.csv", &[]).stdout);
}

#[test]
fn the_demo_needs_no_file_and_finds_the_effect_that_it_is_not_told_of() {
    let bench = Bench::new("demo");
    let text = bench.run(&["demo"]);
    assert_eq!(text.code, 0, "{text:#?}");
    for word in
        ["time constant", "verdict: explained", "second-order in T2", "truth: T1 0.0238 s", "truth: T2 0.1168 s"]
    {
        assert!(text.stdout.contains(word), "no {word} in {text:#?}");
    }
    text.says(&["time_constant_s = 0.0238", "kind = \"engine\""]);
    let value = bench.run(&["demo", "--json"]).json();
    assert_eq!(value["schema"], "twinlag.diagnosis/1");
    has_the_fields_of_the_schema(&value["base"]);
    has_the_fields_of_the_schema(&value["final"]);
    for i in 0..2 {
        let [low, high] = interval(&value["final"]["sensors"][i]["interval_95_s"]);
        assert!((low..=high).contains(&TRUTH_S[i]), "{} s is not in [{low}, {high}] s", TRUTH_S[i]);
    }
    assert_eq!(bench.run(&["demo", "--quiet"]).stderr, "");
}

/// Twenty seeds: each interval misses one in twenty times, both are in 90 % of the demos or more often; fewer than 14 of 20
/// then have a chance of 1 in 400.
#[test]
fn the_demo_holds_for_other_seeds() {
    let bench = Bench::new("demo_seeds");
    let inside = (0..20).filter(|seed: &u32| {
        let value = bench.run(&["demo", "--json", "--seed", &seed.to_string()]).json();
        (0..2).all(|i| {
            let [low, high] = interval(&value["final"]["sensors"][i]["interval_95_s"]);
            (low..=high).contains(&TRUTH_S[i])
        })
    });
    let inside = inside.count();
    assert!(inside >= 14, "the truth is inside both intervals for {inside} of 20 seeds");
}

#[test]
fn help_goes_to_standard_output_and_names_every_command_and_option() {
    let bench = Bench::new("help");
    for (arguments, words) in [
        (&["--help"][..], &["characterise", "simulate", "demo", "--json", "--quiet", "Exit codes: 0 answered"][..]),
        (
            &["characterise", "--help"],
            &[
                "--t1",
                "--noise",
                "--noise-ratio",
                "--noise-colour",
                "--quiet-segment",
                "--estimator",
                "--optimiser",
                "--free",
                "--second-order",
                "--known",
                "--discard",
                "--intervals",
                "--replicates",
                "--seed",
                "not-identifiable",
            ],
        ),
        (&["simulate", "--help"], &["--out", "--seed", "--force", "[[sensors]]", "time_constant_s"]),
        (&["demo", "--help"], &["--seed", "--json"]),
    ] {
        let answer = bench.run(arguments);
        assert_eq!((answer.code, answer.stderr.as_str()), (0, ""), "{answer:#?}");
        for word in words {
            assert!(answer.stdout.contains(word), "no {word} in {answer:#?}");
        }
    }
    let help = bench.run(&["characterise", "--help"]).stdout;
    ESTIMATORS
        .iter()
        .chain(&CLOSED_FORM)
        .chain(&OPTIMISERS)
        .for_each(|name| assert!(help.contains(name), "{name} is not in the help"));
}

/// The rig in the help is one to copy.
#[test]
fn the_rig_in_the_help_can_be_simulated_and_characterised() {
    let bench = Bench::new("help_rig");
    let help = bench.run(&["simulate", "--help"]).stdout;
    let rig = &help[help.find("  seed = 1").expect("the rig begins")..help.find("The record has").expect("and ends")];
    bench.write("rig.toml", rig);
    let answer = bench.run(&["simulate", "rig.toml", "--out", "out.csv"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    recovers(&bench.characterise("out.csv", &["--reference", "Tref"]).status(&["ok"]), TRUTH_S);
}

#[test]
fn the_help_of_every_command_tells_the_exit_codes_or_the_statuses() {
    let bench = Bench::new("help_codes");
    for command in ["characterise", "diagnose", "simulate", "demo"] {
        let help = bench.run(&[command, "--help"]).stdout.to_lowercase();
        assert!(help.contains("exit code") || help.contains("not-identifiable"), "{help}");
    }
}

#[test]
fn a_record_of_twenty_thousand_samples_is_answered() {
    let bench = Bench::with("long", "run.csv", Trace { samples: 20_000, ..Trace::GOOD }.csv());
    let value = bench.characterise("run.csv", &[]).status(&["ok"]);
    assert_eq!(value["record"]["samples"], 20_000);
    recovers(&value, TRUTH_S);
}

/// With an eighth of the record errors are about the square root of eight larger; twice as large or more is 0.35 short of
/// that, and the two records share their scatter in an eighth of the data alone.
#[test]
fn a_longer_record_tells_more() {
    let bench = Bench::with("long_all", "all.csv", Trace { samples: 16_000, ..Trace::GOOD }.csv());
    bench.write("part.csv", Trace::GOOD.csv());
    let [all, part] = ["all.csv", "part.csv"].map(|file| estimates(&bench.characterise(file, &[]).json()));
    for i in 0..2 {
        assert!(part[i].1 > 2.0 * all[i].1, "{part:?} from an eighth of the record, {all:?} from all");
    }
}
