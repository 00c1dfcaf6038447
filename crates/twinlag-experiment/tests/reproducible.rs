//! The table of an experiment has the same bytes whoever computed it; and it says what its plan asked for.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;

use twinlag_experiment::{Experiment, ExperimentError, Plan, Table};
use twinlag_study::{Options, Shard, merge, run};

const PLAN: &str = r#"
    name = "test"
    title = "A few trials"
    seed = 7
    trials = 35
    block = 10
    samples = [300]
    noise_percent = [1, 20]
    [[gases]]
    name = "sine"
    gas = { kind = "sine", mean_c = 50.5, amplitude_k = 16.5, frequency_hz = 10.0, hold = "zero-order" }
    [[methods]]
    name = "whitened"
    estimator = "whitened"
    noise = "found"
    intervals = true
    [[methods]]
    name = "swarm"
    estimator = "bias-compensated"
    optimiser = "particle-swarm"
    start = { at = [0.03, 0.1] }
    [[summaries]]
    file = "bias"
    value = "bias_percent"
    rows = [["noise_percent", "noise (%)"]]
    digits = 1
    [[pictures]]
    file = "bias"
    title = "Bias"
    x = { column = "noise_percent", label = "noise (%)" }
    y = { column = "bias_percent", label = "bias (%)" }
    y_error = "bias_error_percent"
    panels = ["sensor"]
"#;

fn plan() -> Plan {
    Plan::from_toml(PLAN).expect("a valid plan")
}

fn on(threads: usize) -> Options {
    Options { threads: NonZeroUsize::new(threads).expect("not zero"), ..Options::default() }
}

fn table(options: &Options) -> String {
    let plan = plan();
    let experiment = Experiment::new(&plan).expect("valid");
    let part = run(&experiment, options, |_| ControlFlow::Continue(())).expect("runs");
    Table::new(&plan, &part.into_results().expect("complete")).expect("a table").to_json().expect("plain data")
}

/// A folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("twinlag-experiment-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&path).expect("a temporary folder");
    path
}

#[test]
fn the_table_does_not_depend_on_the_number_of_threads() {
    let one = table(&on(1));
    assert!(one.contains("\"coverage\":0.") || one.contains("\"coverage\":1"), "{one}");
    for threads in [2, 7] {
        assert_eq!(table(&on(threads)), one, "{threads} threads");
    }
}

/// The threads stop at a different place in each round: after so many reports of progress.
#[test]
fn the_table_does_not_depend_on_interruptions() {
    let whole = table(&on(2));
    let dir = folder("interrupted");
    let plan = plan();
    let experiment = Experiment::new(&plan).expect("valid");
    for stops in [1, 3, 4] {
        let path = dir.join(format!("{stops}.json"));
        let mut options = Options { checkpoint: Some(path), ..on(2) };
        let mut reports = 0;
        let stop = |_| {
            reports += 1;
            if reports > stops { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        run(&experiment, &options, stop).expect("runs until it is stopped");
        options.resume = true;
        options.threads = NonZeroUsize::new(3).expect("not zero");
        assert_eq!(table(&options), whole, "stopped after {stops}");
    }
    std::fs::remove_dir_all(dir).expect("the folder was made above");
}

#[test]
fn the_table_does_not_depend_on_shards_nor_on_their_order() {
    let whole = table(&on(2));
    let dir = folder("shards");
    let plan = plan();
    let experiment = Experiment::new(&plan).expect("valid");
    let mut parts: Vec<PathBuf> = (0..3)
        .map(|k| {
            let path = dir.join(format!("part-{k}.json"));
            let shard = Shard::new(k, 3).expect("one of three");
            let options = Options { shard, checkpoint: Some(path.clone()), ..on(1) };
            run(&experiment, &options, |_| ControlFlow::Continue(())).expect("runs");
            path
        })
        .collect();
    for _ in 0..3 {
        parts.rotate_left(1);
        let results = merge(&parts).expect("complete");
        let merged = Table::new(&plan, &results).expect("a table").to_json().expect("plain data");
        assert_eq!(merged, whole);
    }
    let missing = merge(&parts[1..]).expect_err("a shard is missing").to_string();
    assert!(missing.contains("/3"), "{missing}");
    std::fs::remove_dir_all(dir).expect("the folder was made above");
}

#[test]
fn a_changed_number_is_named_with_its_cell() {
    let plan = plan();
    let experiment = Experiment::new(&plan).expect("valid");
    let results =
        run(&experiment, &on(2), |_| ControlFlow::Continue(())).expect("runs").into_results().expect("complete");
    let table = Table::new(&plan, &results).expect("a table");
    let text = table.to_json().expect("plain data");
    let stored: Table = serde_json::from_str(&text).expect("what was written can be read");
    assert_eq!(table.first_difference(&stored), None);
    let mut other = stored.clone();
    other.rows[5].insert("bias_percent".into(), serde_json::json!(1.25));
    let difference = table.first_difference(&other).expect("one number differs");
    assert!(difference.contains("bias_percent") && difference.contains("1.25"), "{difference}");
    assert!(difference.contains("noise_percent 20") && difference.contains("whitened"), "{difference}");
    assert_eq!(plan.summaries[0].write(&table).expect("columns exist").lines().count(), 4);
    assert!(plan.pictures[0].draw(&table).expect("columns exist").starts_with("<svg"));
}

#[test]
fn a_plan_that_cannot_run_says_why() {
    let refuse = |from: &str, to: &str| {
        let text = PLAN.replacen(from, to, 1);
        let of_plan = Plan::from_toml(&text);
        let error: ExperimentError = match &of_plan {
            Err(_) => of_plan.expect_err("just seen"),
            Ok(plan) => Experiment::new(plan).expect_err("refused one way or the other"),
        };
        error.to_string()
    };
    assert!(refuse("trials = 35", "trials = 0").contains("trials"));
    assert!(refuse("estimator = \"whitened\"", "estimator = \"magic\"").contains("bias-compensated"));
    assert!(refuse("particle-swarm", "bees").contains("levenberg-marquardt"));
    assert!(refuse("start = { at = [0.03, 0.1] }", "start = \"grid\"").contains("grid_s"));
    assert!(refuse("name = \"swarm\"", "name = \"whitened\"").contains("two methods"));
    assert!(refuse("samples = [300]", "sample = [300]").contains("sample"));
    assert!(refuse("frequency_hz = 10.0", "frequency_hz = -1.0").contains("frequency_hz"));
}
