//! `twinlag study submit` and `twinlag batch --engine`, with commands in place of an engine's that run at once what is submitted. Those of
//! real engines are called by `cargo xtask cluster`.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;

use crate::common::{Answer, Bench, STUDY, Trace};

/// In place of `sbatch`: runs the tasks of an array, without those in the file `lost`, or a job, and says its number. What it was
/// called with is in `submitted`.
const SBATCH: &str = r#"#!/bin/sh
echo "$@" >> "$HERE/submitted"
[ -f "$HERE/refused" ] && { cat "$HERE/refused" >&2; exit 1; }
job=$(wc -l < "$HERE/submitted")
array=
for word; do
    case $word in
    --array=*) array=${word#--array=} ;;
    --*) ;;
    *) script=$word ;;
    esac
done
if [ -n "$array" ]; then
    for range in $(echo "$array" | tr , ' '); do
        for task in $(seq "${range%-*}" "${range#*-}"); do
            grep -qx "$task" "$HERE/lost" 2> /dev/null || SLURM_ARRAY_TASK_ID=$task sh "$script"
        done
    done
elif [ ! -f "$HERE/no-merge" ]; then
    sh "$script"
fi
echo "$job;loop"
"#;

/// In place of `squeue`: lists what is in the file `queue`.
const SQUEUE: &str = "#!/bin/sh\ncat \"$HERE/queue\" 2> /dev/null || true\n";

struct Cluster {
    bench: Bench,
    path: String,
}

impl Cluster {
    fn new(bench: Bench) -> Self {
        fs::create_dir(bench.path("bin")).expect("a new folder");
        for (name, text) in [("sbatch", SBATCH), ("squeue", SQUEUE)] {
            bench.write(&format!("bin/{name}"), text);
            fs::set_permissions(bench.path(&format!("bin/{name}")), fs::Permissions::from_mode(0o755)).expect("ours");
        }
        let path = format!("{}:{}", bench.path("bin").display(), std::env::var("PATH").unwrap_or_default());
        Self { bench, path }
    }

    fn run(&self, arguments: &[&str]) -> Answer {
        let here = self.bench.path("").display().to_string();
        self.bench.run_in_environment(arguments, &[("PATH", &self.path), ("HERE", &here)])
    }

    fn submitted(&self) -> String {
        String::from_utf8(self.bench.read("submitted")).expect("text")
    }
}

const SUBMIT: [&str; 8] = ["study", "submit", "plan.toml", "--out", "out", "--engine", "slurm", "--time-limit=5"];

#[test]
fn shards_of_a_study_that_are_lost_are_missing_until_they_are_submitted_again() {
    let cluster = Cluster::new(Bench::with("study", "plan.toml", STUDY));
    let bench = &cluster.bench;
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "whole"]).code, 0);
    bench.write("lost", "1\n");
    let answer = cluster.run(&[&SUBMIT[..], &["--shards", "3", "--cpus", "2", "--json"]].concat());
    assert_eq!(answer.code, 0, "{answer:#?}");
    let json = answer.json();
    assert_eq!((&json["job"], &json["merge_job"], &json["shards"]), (&"1".into(), &"2".into(), &"0-2".into()));
    let submitted = cluster.submitted();
    assert!(submitted.contains("--array=0-2 ") && submitted.contains("--dependency=afterany:1 "), "{submitted}");
    let script = String::from_utf8(bench.read("out/submission/shard.sh")).expect("text");
    for line in ["#SBATCH --requeue", "#SBATCH --time=5", "#SBATCH --cpus-per-task=2", "--threads 2"] {
        assert!(script.contains(line), "{line} in {script}");
    }
    let log = String::from_utf8(bench.read("out/submission/logs/merge.log")).expect("text");
    assert!(log.contains("missing shard 1/3"), "{log}");

    let status = || cluster.run(&["study", "status", "out"]);
    let before = status();
    assert_eq!(before.code, 75, "{before:#?}");
    for words in ["20 of 30 trials in 3 shards", "done     2  0,2", "missing  1  1", "no result yet"] {
        assert!(before.stdout.contains(words), "{words} in {before:#?}");
    }
    // One that the engine still has is not sent again, and neither is the merge.
    bench.write("queue", "1 1 RUNNING\n7 1 PENDING\n2 N/A PENDING\n");
    assert!(status().stdout.contains("running  1  1"));
    cluster.run(&["study", "resubmit", "out"]).says(&["nothing is missing"]);
    // A merge that the engine has no more is, behind what still runs.
    bench.write("queue", "1 1 RUNNING\n");
    let merge = cluster.run(&["study", "resubmit", "out"]);
    assert!(merge.code == 0 && merge.stdout.contains("as job 3: the merge"), "{merge:#?}");
    assert!(cluster.submitted().lines().last().expect("a line").contains("--dependency=afterany:1 "));
    for file in ["queue", "lost"] {
        fs::remove_file(bench.path(file)).expect("there");
    }
    let again = cluster.run(&["study", "resubmit", "out", "--time-limit", "7"]);
    assert!(again.code == 0 && again.stdout.contains("shards 1, and the merge"), "{again:#?}");
    assert!(cluster.submitted().contains("--array=1 "));
    assert!(String::from_utf8(bench.read("out/submission/shard.sh")).expect("text").contains("--time=7"));
    let after = status();
    assert!(after.code == 0 && after.stdout.contains("the result is there"), "{after:#?}");
    assert_eq!(bench.read("out/results.json"), bench.read("whole/results.json"));
}

#[test]
fn a_damaged_part_is_named_and_not_overwritten() {
    let cluster = Cluster::new(Bench::with("damaged", "plan.toml", STUDY));
    let bench = &cluster.bench;
    bench.write("lost", "2\n");
    assert_eq!(cluster.run(&[&SUBMIT[..], &["--shards", "3"]].concat()).code, 0);
    let part = String::from_utf8(bench.read("out/part-0-of-3.json")).expect("text");
    bench.write("out/part-0-of-3.json", part.replace("\"trials\":10", "\"trials\":11"));
    let status = cluster.run(&["study", "status", "out"]);
    assert!(status.stdout.contains("unusable  1  0") && status.stdout.contains("hash"), "{status:#?}");
    let refused = cluster.run(&["study", "resubmit", "out"]);
    assert_eq!(refused.code, 3, "{refused:#?}");
    refused.says(&["part-0-of-3.json", "hash"]);
    fs::remove_file(bench.path("out/part-0-of-3.json")).expect("there");
    fs::remove_file(bench.path("lost")).expect("there");
    assert_eq!(cluster.run(&["study", "resubmit", "out"]).code, 0);
    assert!(cluster.submitted().contains("--array=0,2 "));
    assert_eq!(cluster.run(&["study", "status", "out"]).code, 0);
}

#[test]
fn what_cannot_be_submitted_is_refused_with_the_reason() {
    let cluster = Cluster::new(Bench::with("refused", "plan.toml", STUDY));
    let bench = &cluster.bench;
    bench.refuses(2, &["study", "submit", "plan.toml", "--out", "out"], &["--engine"]);
    bench.refuses(2, &SUBMIT, &["--shards"]);
    bench.refuses(2, &[&SUBMIT[..], &["--shards", "99999999999"]].concat(), &["from 1 to 1000000"]);
    bench.refuses(2, &[&SUBMIT[..5], &["--engine", "cron", "--shards", "3", "--time-limit", "5"]].concat(), &["slurm"]);
    bench.refuses(3, &["study", "status", "out"], &["nothing was submitted"]);
    bench.refuses(2, &["batch", "plan.toml", "--out", "t.csv", "--time-limit", "5"], &["--time-limit", "--engine"]);
    bench.refuses(2, &["batch", "plan.toml", "--out", "t.csv", "--cpus", "5"], &["--engine"]);
    bench.refuses(2, &["batch", "plan.toml", "--out", "t.csv", "--status"], &["--status"]);
    let submit = [&SUBMIT[..], &["--shards", "3"]].concat();
    bench.write("refused", "sbatch: error: invalid partition");
    let refused = cluster.run(&submit);
    assert_eq!(refused.code, 1, "{refused:#?}");
    refused.says(&["sbatch refused", "invalid partition"]);
    let nowhere = bench.path("nowhere").display().to_string();
    let without = bench.run_in_environment(&submit, &[("PATH", &nowhere)]);
    assert_eq!(without.code, 1, "{without:#?}");
    without.says(&["sbatch cannot be run"]);
    // Nothing was submitted so far.
    fs::remove_file(bench.path("refused")).expect("there");
    assert_eq!(cluster.run(&submit).code, 0);
    let twice = cluster.run(&submit);
    assert_eq!(twice.code, 2, "{twice:#?}");
}

/// Names that a shell would take apart, a page, and a table among the records.
#[test]
fn a_batch_on_a_cluster_gives_the_table_of_a_whole_run() {
    let cluster = Cluster::new(Bench::new("batch"));
    let bench = &cluster.bench;
    fs::create_dir(bench.path("the $runs")).expect("a new folder");
    for (file, seed) in [("it's a.csv", 1), ("b \"c\".csv", 2)] {
        bench.write(&format!("the $runs/{file}"), Trace { seed, ..Trace::GOOD }.csv());
    }
    bench.write("the $runs/bad.csv", "");
    let batch = ["batch", "the $runs", "--verb", "diagnose", "--without", "slow-mode"];
    assert_eq!(bench.run(&[&batch[..], &["--out", "whole.csv"]].concat()).code, 0);
    let outs = ["--out", "the $runs/t.csv", "--report", "t.html", "--threads", "2"];
    let engine = ["--engine", "slurm", "--shards", "2", "--time-limit", "5", "--engine-option=--comment=it is #1"];
    let submitted = cluster.run(&[&batch[..], &outs, &engine].concat());
    assert_eq!(submitted.code, 0, "{submitted:#?}");
    assert_eq!(bench.read("the $runs/t.csv"), bench.read("whole.csv"));
    assert!(bench.has("t.html"));
    let script = String::from_utf8(bench.read("the $runs/t.csv.submission/shard.sh")).expect("text");
    assert!(!script.contains("t.html"), "{script}");
    // Slurm gets it as one argument, of both jobs.
    assert_eq!(cluster.submitted().matches("--comment=it is #1").count(), 2);
    let status = cluster.run(&["batch", "--status", "--out", "the $runs/t.csv", "--json"]);
    assert_eq!(status.code, 0, "{status:#?}");
    let json = status.json();
    assert_eq!((&json["done"], &json["total"], &json["units"]), (&3.into(), &3.into(), &"records".into()));
    let resubmit = ["batch", "--resubmit", "--out", "the $runs/t.csv", "--time-limit", "7"];
    cluster.run(&resubmit).says(&["nothing is missing", "the result is there"]);
    let json = cluster.run(&[&resubmit[..], &["--json"]].concat()).json();
    assert_eq!((&json["shards"], &json["job"]), (&"".into(), &serde_json::Value::Null));
    // Failed: the merge of what was submitted again refused to replace the table of the one before, which was taken for the result.
    fs::remove_file(bench.path("the $runs/t.csv.part-1-of-2")).expect("there");
    let status = cluster.run(&["batch", "--status", "--out", "the $runs/t.csv"]);
    assert_eq!(status.code, 75, "{status:#?}");
    bench.write("the $runs/t.csv", bench.read("the $runs/t.csv.manifest"));
    assert_eq!(cluster.run(&resubmit).code, 0);
    assert_eq!(bench.read("the $runs/t.csv"), bench.read("whole.csv"));
    // What was submitted is among the records now.
    assert_eq!(bench.run(&[&batch[..], &["--out", "the $runs/t.csv", "--force"]].concat()).code, 0);
    assert_eq!(bench.read("the $runs/t.csv"), bench.read("whole.csv"));
    let again = cluster.run(&[&batch[..], &["--out", "the $runs/t.csv", "--force"], &engine].concat());
    assert_eq!(again.code, 2, "{again:#?}");
    again.says(&["t.csv.part-0-of-2", "t.csv.manifest", "--resume"]);
}

/// What `--` ends are names, whatever they begin with, and which shard it is does not stand among them.
#[test]
fn names_may_begin_with_a_hyphen() {
    let cluster = Cluster::new(Bench::with("hyphen", "-plan.toml", STUDY));
    let bench = &cluster.bench;
    bench.write("-record.csv", Trace::GOOD.csv());
    let batch =
        ["batch", "--out", "t.csv", "--engine", "slurm", "--shards", "1", "--time-limit", "5", "--", "-record.csv"];
    assert_eq!(cluster.run(&batch).code, 0);
    assert!(bench.has("t.csv"), "{}", String::from_utf8_lossy(&bench.read("t.csv.submission/logs/shard-0.log")));
    let study = [
        "study",
        "submit",
        "--out=-out",
        "--engine",
        "slurm",
        "--shards",
        "1",
        "--time-limit",
        "5",
        "--",
        "-plan.toml",
    ];
    assert_eq!(cluster.run(&study).code, 0);
    assert!(bench.has("-out/results.json"));
}

/// The merge can be lost as any job: then it alone is submitted again. Until then an old result is not taken for that of the shards.
#[test]
fn a_merge_that_is_lost_is_submitted_again() {
    let cluster = Cluster::new(Bench::with("lost-merge", "plan.toml", STUDY));
    let bench = &cluster.bench;
    bench.write("no-merge", "");
    assert_eq!(cluster.run(&[&SUBMIT[..], &["--shards", "2"]].concat()).code, 0);
    bench.write("queue", "2 N/A PENDING\n");
    cluster.run(&["study", "resubmit", "out"]).says(&["nothing is missing", "so does the merge"]);
    for file in ["queue", "no-merge"] {
        fs::remove_file(bench.path(file)).expect("there");
    }
    let again = cluster.run(&["study", "resubmit", "out", "--json"]);
    let json = again.json();
    assert_eq!((&json["job"], &json["merge_job"]), (&serde_json::Value::Null, &"3".into()), "{again:#?}");
    assert!(!cluster.submitted().lines().last().expect("a line").contains("--dependency"));
    assert_eq!(cluster.run(&["study", "status", "out"]).code, 0);
    // A part that is newer than the result.
    let result = fs::metadata(bench.path("out/results.json")).and_then(|file| file.modified()).expect("a time");
    let file = fs::File::options().write(true).open(bench.path("out/part-1-of-2.json")).expect("ours");
    file.set_modified(result + std::time::Duration::from_secs(1)).expect("ours");
    assert_eq!(cluster.run(&["study", "status", "out"]).code, 75);
}

/// Parts of another division, of another program, and options that an engine would not heed are refused before anything is submitted.
#[test]
fn what_would_fail_later_is_refused_at_once() {
    let cluster = Cluster::new(Bench::with("early", "plan.toml", STUDY));
    let bench = &cluster.bench;
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "out", "--shard", "0/3"]).code, 0);
    let submit = [&SUBMIT[..], &["--shards", "2"]].concat();
    let refused = cluster.run(&submit);
    assert_eq!(refused.code, 2, "{refused:#?}");
    refused.says(&["part-0-of-3.json", "another number of shards"]);
    for (engine, option) in
        [("parallel", "--memory=2G"), ("hyperqueue", "--memory=2G"), ("kubernetes", "--engine-option=--x")]
    {
        let refused = cluster.run(&[&SUBMIT[..6], &[engine, "--time-limit=5", "--shards=3", option]].concat());
        assert_eq!(refused.code, 2, "{refused:#?}");
        refused.says(&[engine, option.split('=').next().expect("a name")]);
    }
    assert!(!bench.has("submitted"));
    // Options of a file that are for a run are none of a question about it.
    bench.write("lab.toml", "[batch]\nverb = \"diagnose\"\nengine = \"slurm\"\nshards = 3\ntime-limit = 5\ncpus = 2\n");
    let status = bench.run(&["batch", "--status", "--out", "t.csv", "--config", "lab.toml"]);
    assert_eq!(status.code, 3, "{status:#?}");
    status.says(&["nothing was submitted"]);
}

/// As after a shard was lost, or its part damaged.
#[test]
fn a_shard_whose_part_is_gone_writes_its_gas_temperatures_again() {
    let cluster = Cluster::new(Bench::with("gas", "a.csv", Trace::GOOD.csv()));
    let bench = &cluster.bench;
    let batch = ["batch", "a.csv", "--verb", "compensate", "--gas", "gas", "--out", "t.csv"];
    let engine = ["--engine", "slurm", "--shards", "1", "--time-limit", "5"];
    assert_eq!(cluster.run(&[&batch[..], &engine].concat()).code, 0);
    let table = bench.read("t.csv");
    fs::remove_file(bench.path("t.csv.part-0-of-1")).expect("there");
    assert_eq!(cluster.run(&["batch", "--resubmit", "--out", "t.csv"]).code, 0);
    assert!(bench.has("t.csv.part-0-of-1"));
    assert_eq!(bench.read("t.csv"), table);
    // To a folder that has the gas temperatures of another batch.
    let other = cluster.run(&[&batch[..7], &["other.csv"], &engine].concat());
    assert_eq!(other.code, 2, "{other:#?}");
    other.says(&["a.csv.gas.csv exists", "--force"]);
    assert!(!bench.has("other.csv.manifest"));
}

/// The commands that are printed do what submitting does.
#[test]
fn commands_of_a_dry_run_can_be_typed() {
    let cluster = Cluster::new(Bench::with("dry", "plan.toml", STUDY));
    let bench = &cluster.bench;
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "whole"]).code, 0);
    let dry = cluster.run(&[&SUBMIT[..], &["--shards", "2", "--dry-run"]].concat());
    assert_eq!(dry.code, 0, "{dry:#?}");
    assert!(!bench.has("submitted") && dry.stdout.starts_with("job=$(sbatch --parsable '--array=0-1' "), "{dry:#?}");
    for engine in ["parallel", "kubernetes", "hyperqueue"] {
        let answer =
            cluster.run(&[&SUBMIT[..6], &[engine, "--shards", "2", "--time-limit", "5", "--dry-run"]].concat());
        assert_eq!(answer.code, 0, "{answer:#?}");
    }
    assert!(String::from_utf8(bench.read("out/submission/job.yaml")).expect("text").contains("completions: 2"));
    for shard in ["0", "1"] {
        let script = bench.path("out/submission/shard.sh");
        assert!(std::process::Command::new("sh").arg(script).arg(shard).status().expect("a shell").success());
    }
    let merge = std::process::Command::new("sh").arg(bench.path("out/submission/merge.sh")).status();
    assert!(merge.expect("a shell").success());
    assert_eq!(bench.read("out/results.json"), bench.read("whole/results.json"));
    // As it is printed.
    for folder in
        ["out/submission", "out/part-0-of-2.json", "out/part-1-of-2.json", "out/results.json", "out/results.csv"]
    {
        let path = bench.path(folder);
        if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }.expect("ours");
    }
    let dry = cluster.run(&[&SUBMIT[..], &["--shards", "2", "--dry-run"]].concat());
    let mut typed = std::process::Command::new("sh");
    typed.args(["-c", &dry.stdout]).env("PATH", &cluster.path).env("HERE", bench.path("")).current_dir(bench.path(""));
    assert!(typed.status().expect("a shell").success());
    let submitted = cluster.submitted();
    assert!(submitted.contains("--dependency=afterany:1 "), "{submitted}");
    assert_eq!(bench.read("out/results.json"), bench.read("whole/results.json"));
}

/// How long trials take is not known beforehand; what follows from it is.
#[test]
fn what_a_study_takes_is_planned_from_a_few_trials() {
    let bench = Bench::with(
        "plan",
        "plan.toml",
        STUDY.replace("trials = 30", "trials = 100000000").replace("block = 10", "block = 1000"),
    );
    let plan = ["study", "plan", "plan.toml", "--pilot-seconds", "1", "--json"];
    let answer = bench.run(&plan);
    assert_eq!(answer.code, 0, "{answer:#?}");
    let json = answer.json();
    let number = |name: &str| json[name].as_f64().expect("a number");
    let [low, high] = [0, 1].map(|end| json["core_hours_interval"][end].as_f64().expect("a number"));
    assert!(low <= number("core_hours") && number("core_hours") <= high);
    assert!(number("pilot_trials") >= 6.0 && number("trials") == 1e8);
    // Shards of half an hour have all of the time.
    let minutes = number("shards") * number("longest_shard_min");
    assert!((minutes / 60.0 / number("core_hours") - 1.0).abs() < 0.05 && number("longest_shard_min") < 31.0);
    assert!(number("time_limit_min") >= number("longest_shard_min"));
    assert!(number("largest_part_bytes") * number("shards") >= number("bytes"));
    let words = bench.run(&plan[..5]).stdout;
    assert!(words.contains("--shards") && words.contains("at the speed of this pilot"), "{words}");
    bench.refuses(3, &["study", "plan", "nowhere.toml"], &["nowhere.toml"]);
}

/// A second submission replaces no first, started by hand or not, and what was removed of the first is written anew.
#[test]
fn a_submission_is_not_replaced_and_its_scripts_are_written_anew() {
    let cluster = Cluster::new(Bench::with("scripts", "plan.toml", STUDY));
    let bench = &cluster.bench;
    let by_hand = [&SUBMIT[..6], &["parallel", "--time-limit=5", "--shards=2"]].concat();
    assert_eq!(cluster.run(&by_hand).code, 0);
    assert_eq!(cluster.run(&by_hand).code, 2);
    fs::rename(bench.path("out"), bench.path("moved")).expect("ours");
    for gone in ["shard.sh", "merge.sh"] {
        fs::remove_file(bench.path(&format!("moved/submission/{gone}"))).expect("there");
    }
    fs::remove_dir_all(bench.path("moved/submission/logs")).expect("there");
    let again = cluster.run(&["study", "resubmit", "moved"]);
    assert!(again.code == 0 && again.stdout.contains("moved/submission/shard.sh"), "{again:#?}");
    for written in ["shard.sh", "merge.sh", "logs"] {
        assert!(bench.has(&format!("moved/submission/{written}")), "{written}");
    }
}

/// What a file of the user's is called in the folder of the results is for the user to say.
#[test]
fn a_study_replaces_no_file_that_is_not_its_own() {
    let bench = Bench::with("own-file", "plan.toml", STUDY);
    fs::create_dir(bench.path("out")).expect("a new folder");
    bench.write("out/results.csv", "my,own\n");
    bench.refuses(2, &["study", "run", "plan.toml", "--out", "out"], &["results.csv exists"]);
    bench.refuses(2, &[&SUBMIT[..], &["--shards", "2"]].concat(), &["results.csv exists"]);
    assert_eq!(bench.read("out/results.csv"), b"my,own\n");
    // Nor are trials run that are there in another division.
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "parts", "--shard", "0/2"]).code, 0);
    bench.refuses(2, &["study", "run", "plan.toml", "--out", "parts", "--shard", "0/3"], &["part-0-of-2.json", "0/3"]);
    assert_eq!(bench.run(&["study", "run", "plan.toml", "--out", "parts", "--shard", "2/4"]).code, 0);
}
