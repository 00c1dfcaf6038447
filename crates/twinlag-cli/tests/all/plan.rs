//! What scripts rely on in `twinlag plan`: the fields of schema `twinlag.plan/1`, exit codes, and what is said of a file that cannot be
//! planned.

use crate::common::{Bench, FAST_RIG, Trace, csv, number};
use serde_json::Value;

fn plan(bench: &Bench, file: &str, code: i32) -> Value {
    let answer = bench.run(&["plan", file, "--json"]);
    assert_eq!(answer.code, code, "{answer:#?}");
    // Fails for anything but one object, and for NaN and infinity in it.
    answer.json()
}

/// The numbers are those of the rig, each with an expected error, and each record has the rivals of the record as it is.
#[test]
fn a_rig_is_planned_with_every_field_of_the_schema() {
    let lag = "time_constant_s = 0.024\nsecond_time_constant_s = 0.008\n";
    let rig = FAST_RIG.replacen("time_constant_s = 0.024\n", lag, 1);
    let plan = plan(&Bench::with("plan-rig", "rig.toml", rig), "rig.toml", 0);
    for (name, want) in [("schema", "twinlag.plan/1"), ("source", "rig"), ("status", "ok")] {
        assert_eq!(plan[name], want, "{name}");
    }
    for name in ["channels", "gas_std_K", "noise_std_K", "deciding_deviance", "advice", "not_testable", "remarks"] {
        assert!(plan.get(name).is_some(), "no field {name} in {plan:#}");
    }
    let now = &plan["as_it_is"];
    for (place, truth_s) in [0.024, 0.117].into_iter().enumerate() {
        let [value, error] = ["value", "standard_error"].map(|name| number(&now["numbers"][place][name]));
        assert!((value / truth_s - 1.0).abs() < 0.01 && error > 0.0 && error < 0.1 * value, "{value} ± {error}");
    }
    let rivals = now["rivals"].as_array().expect("a list");
    assert!(rivals.iter().any(|rival| rival["rival"] == "delay"), "{now:#}");
    let changed = plan["changed"].as_array().expect("a list");
    assert!(!changed.is_empty());
    for record in changed {
        assert_eq!(record["rivals"].as_array().map(Vec::len), Some(rivals.len()), "{record:#}");
    }
}

/// A saved model and the JSON of the diagnosis that it is of give the same plan.
#[test]
fn a_diagnosis_is_planned_from_its_model_and_from_its_json() {
    let bench = Bench::with("plan-model", "run.csv", Trace::GOOD.csv());
    let diagnosis = bench.run(&["diagnose", "run.csv", "--json", "--save", "model.json"]);
    bench.write("diagnosis.json", &diagnosis.stdout);
    let of_model = plan(&bench, "model.json", 0);
    assert_eq!(of_model["source"], "diagnosis");
    assert_eq!(of_model, plan(&bench, "diagnosis.json", 0));
}

/// Failed: the model of several records had no spectrum of the gas; later it had that of the longest alone.
#[test]
fn a_model_of_several_records_is_planned_in_the_gas_of_all_in_whatever_order() {
    let bench = Bench::with("plan-records", "long.csv", Trace::GOOD.csv());
    let mut short = Trace { seed: 2, samples: Trace::GOOD.samples / 2, ..Trace::GOOD }.rows();
    // Hotter by ten degrees in both sensors.
    short.iter_mut().for_each(|row| row[1..].iter_mut().for_each(|reading_c| *reading_c += 10.0));
    bench.write("short.csv", csv(&short));
    let mean_and_bands = |files: &[&str], model: &str| {
        let spectrum =
            &bench.run(&[&["diagnose"], files, &["--json", "--save", model]].concat()).json()["gas_spectrum"];
        (number(&spectrum["mean_C"]), spectrum["bands"].as_array().map(Vec::len))
    };
    let (joint_c, bands) = mean_and_bands(&["short.csv", "long.csv"], "joint.json");
    let (turned_c, _) = mean_and_bands(&["long.csv", "short.csv"], "turned.json");
    let (short_c, _) = mean_and_bands(&["short.csv"], "short.json");
    let (long_c, of_longest) = mean_and_bands(&["long.csv"], "long.json");
    assert_eq!(bands, of_longest);
    // 1000 and 2000 samples. Time constants that differ by less than a percent move the mean of a gas that scatters by 30 K by less than this.
    let [expected_c, tolerance_k] = [(short_c + 2.0 * long_c) / 3.0, 0.3];
    assert!((short_c - long_c).abs() > 10.0 * tolerance_k, "{short_c} {long_c}");
    for mean_c in [joint_c, turned_c] {
        assert!((mean_c - expected_c).abs() < tolerance_k, "{mean_c}, expected {expected_c}");
    }
    let [joint, turned] = ["joint.json", "turned.json"].map(|model| plan(&bench, model, 0));
    assert_eq!(joint["status"], "ok");
    for place in 0..2 {
        let [one, other] = [&joint, &turned].map(|plan| number(&plan["as_it_is"]["numbers"][place]["standard_error"]));
        // To four digits, to which fits of the same readings in another order agree.
        assert!((one / other - 1.0).abs() < 1e-4, "{one} {other}");
    }
}

/// Two equal sensors: the answer is that nothing is determined, not small errors.
#[test]
fn equal_sensors_end_with_4_and_no_standard_error() {
    let rig = FAST_RIG.replace("0.117", "0.024");
    let plan = plan(&Bench::with("plan-equal", "rig.toml", rig), "rig.toml", 4);
    assert_eq!(plan["status"], "not-identifiable");
    for place in 0..2 {
        assert_eq!(plan["as_it_is"]["numbers"][place]["standard_error"], Value::Null, "{plan:#}");
    }
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let bench = Bench::with("plan-refused", "silent.toml", FAST_RIG.replacen("noise = { std_k = 0.1 }\n", "", 1));
    bench.write("empty.toml", "");
    bench.write("broken.json", "{ \"schema\": ");
    bench.write("other.json", r#"{ "schema": "twinlag.track/1" }"#);
    bench.write("run.csv", Trace::GOOD.csv());
    bench.refuses(3, &["plan", "silent.toml"], &["silent.toml", "fine", "no noise", "std_k"]);
    bench.refuses(3, &["plan", "nothing.toml"], &["nothing.toml", "cannot be read"]);
    bench.refuses(3, &["plan", "empty.toml"], &["empty.toml", "expected"]);
    bench.refuses(3, &["plan", "broken.json"], &["broken.json", "expected a rig in TOML"]);
    bench.refuses(3, &["plan", "other.json"], &["other.json", "twinlag.model/1", "twinlag.track/1"]);
    bench.refuses(3, &["plan", "run.csv"], &["run.csv", "expected a rig in TOML"]);
}
