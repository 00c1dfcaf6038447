//! `twinlag study`: shards, restarts, and what happens when it is called wrongly.

use crate::common::{Bench, STUDY};

#[test]
fn shards_in_any_order_make_the_table_of_the_whole() {
    let bench = Bench::with("study-shards", "plan.toml", STUDY);
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "whole"]).code, 0);
    let whole = bench.read("whole/results.json");
    for shard in ["2/3", "0/3"] {
        assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "parts", "--shard", shard]).code, 0);
    }
    let early = bench.run(&["study", "merge", "parts"]);
    assert_eq!(early.code, 75, "{}", early.stderr);
    assert!(early.stderr.contains("1/3"), "{}", early.stderr);
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "parts", "--shard", "1/3"]).code, 0);
    assert_eq!(bench.run(&["study", "merge", "parts"]).code, 0);
    assert_eq!(bench.read("parts/results.json"), whole);
}

#[test]
fn nothing_is_overwritten_without_being_asked() {
    let bench = Bench::with("study-twice", "plan.toml", STUDY);
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "out"]).code, 0);
    let again = bench.run(&["study", "run", "plan.toml", "--out", "out"]);
    assert_eq!(again.code, 2);
    assert!(again.stderr.contains("results.json exists"), "{}", again.stderr);
    bench.write("other.toml", STUDY.replace("trials = 30", "trials = 20"));
    let other = bench.run(&["study", "run", "other.toml", "--out", "out", "--shard", "0/2"]);
    assert_eq!(other.code, 2);
    assert!(other.stderr.contains("another plan"), "{}", other.stderr);
}

#[test]
fn what_cannot_run_is_refused_with_the_reason() {
    let bench = Bench::with("study-refused", "plan.toml", STUDY.replace("\"whitened\"\n", "\"magic\"\n"));
    for (arguments, code, words) in [
        (vec!["study", "run", "plan.toml", "--out", "out"], 3, "magic"),
        (vec!["study", "run", "none.toml", "--out", "out"], 3, "none.toml"),
        (vec!["study", "merge", "nowhere"], 3, "plan.toml"),
        (vec!["study", "run", "plan.toml", "--out", "out", "--shard", "3/3"], 2, "3/3"),
        (vec!["study", "run", "plan.toml", "--out", "s3:/lab/out"], 2, "s3:/lab/out: expected s3://BUCKET/PREFIX"),
        (vec!["study", "run", "plan.toml", "--out", "s3://lab/out"], 2, "built without object stores (feature s3)"),
        (vec!["study", "merge", "gs://lab/out"], 2, "expected s3://BUCKET/PREFIX"),
        (vec!["batch", ".", "--out", "s3://lab/table.csv"], 2, "built without object stores (feature s3)"),
        (
            vec!["batch", ".", "--out", "table.csv", "--report", "s3://lab/page.html"],
            2,
            "expected a path of this machine",
        ),
        (vec!["simulate", "rig.toml", "--out", "s3://lab/run.csv"], 2, "expected a path of this machine"),
        (vec!["characterise", "s3://lab/run.csv"], 2, "expected a path of this machine"),
    ] {
        let got = bench.run(&arguments);
        assert_eq!(got.code, code, "{arguments:?}: {}", got.stderr);
        assert!(got.stderr.contains(words), "{arguments:?}: {}", got.stderr);
    }
}
