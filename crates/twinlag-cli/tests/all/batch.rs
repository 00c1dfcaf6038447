//! `twinlag batch`: one table of many records, whatever is wrong with some of them, however often it was stopped.

use std::collections::HashMap;

use crate::common::{Answer, Bench, Trace, number};

/// Three records of two rigs, and files that no record can be made of.
fn fleet(test: &str) -> Bench {
    let bench = Bench::new(test);
    std::fs::create_dir_all(bench.path("runs/below")).expect("the target directory can be written");
    for (name, seed) in [("a_1.csv", 1), ("a_2.csv", 2), ("below/b_1.csv", 3)] {
        bench.write(&format!("runs/{name}"), Trace { seed, ..Trace::GOOD }.csv());
    }
    bench.write("runs/empty.csv", "");
    bench.write("runs/a_words.csv", "time,T1,T2\n0,one,two\n1,three,four\n");
    bench
}

/// The rows of a table by their files, or by the rigs' names, each a map from column to cell.
fn rows(bench: &Bench, table: &str) -> HashMap<String, HashMap<String, String>> {
    let text = String::from_utf8(bench.read(table)).expect("UTF-8");
    let mut lines = csv_lines(&text).into_iter();
    let header = lines.next().expect("a header");
    let row = |cells: Vec<String>| -> (String, HashMap<String, String>) {
        let row: HashMap<String, String> = header.iter().cloned().zip(cells).collect();
        let key = if row["level"] == "rig" { "rig" } else { "file" };
        (row[key].clone(), row)
    };
    lines.map(row).collect()
}

/// Cells of comma-separated text with quotes.
fn csv_lines(text: &str) -> Vec<Vec<String>> {
    let (mut lines, mut cells, mut cell, mut is_quoted) = (Vec::new(), Vec::new(), String::new(), false);
    for c in text.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(std::mem::take(&mut cell)),
            '\n' if !is_quoted => {
                cells.push(std::mem::take(&mut cell));
                lines.push(std::mem::take(&mut cells));
            }
            c => cell.push(c),
        }
    }
    lines
}

fn succeeds(answer: &Answer) {
    assert_eq!(answer.code, 0, "{answer:#?}");
}

/// Failed: whether a batch had written it was asked before whether it is a file, and whoever opens a pipe waits for its writer.
#[cfg(unix)]
#[test]
fn a_pipe_in_a_folder_is_a_row() {
    let bench = Bench::new("pipe");
    std::fs::create_dir_all(bench.path("runs")).expect("the target directory can be written");
    bench.write("runs/a.csv", Trace::GOOD.csv());
    let pipe = bench.path("runs/pipe");
    let _ = std::fs::remove_file(&pipe);
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("a program of every Unix");
    assert!(made.success());
    succeeds(&bench.run(&["batch", "runs", "--out", "table.csv", "--quiet", "--force"]));
    let rows = rows(&bench, "table.csv");
    assert_eq!(rows["runs/a.csv"]["exit_code"], "0");
    assert!(rows["runs/pipe"]["reason"].contains("expected a file, found a pipe"), "{rows:#?}");
}

#[test]
fn each_record_is_a_row_with_the_numbers_of_the_verb() {
    let bench = fleet("each");
    succeeds(&bench.run(&["batch", "runs", "--out", "table.csv", "--report", "page.html", "--quiet"]));
    let rows = rows(&bench, "table.csv");
    assert_eq!(rows.len(), 5);
    for file in ["runs/a_1.csv", "runs/a_2.csv", "runs/below/b_1.csv"] {
        let alone = bench.characterise(file, &[]).json();
        let row = &rows[file];
        assert_eq!((&row["status"][..], &row["exit_code"][..]), ("ok", "0"));
        for (i, tau) in ["tau1", "tau2"].into_iter().enumerate() {
            let sensor = &alone["sensors"][i];
            for (column, want) in [
                ("_s", &sensor["time_constant_s"]),
                ("_low_s", &sensor["interval_95_s"][0]),
                ("_high_s", &sensor["interval_95_s"][1]),
            ] {
                assert_eq!(row[&format!("{tau}{column}")].parse::<f64>().expect("a number"), number(want));
            }
            assert_eq!(row[&format!("{tau}_grade")], sensor["grade"]);
        }
    }
    for (file, word) in [("runs/empty.csv", "empty"), ("runs/a_words.csv", "T1")] {
        let row = &rows[file];
        assert_eq!(row["exit_code"], "3");
        assert!(row["reason"].contains(word) && row["tau1_s"].is_empty(), "{row:#?}");
    }
    let page = String::from_utf8(bench.read("page.html")).expect("UTF-8");
    assert!(page.contains("3 of 5 records gave an answer and there are 2 that cannot be used."));
}

/// The journal is cut in the middle of a line, as by a kill, with one thread before and two after.
#[test]
fn a_run_that_was_stopped_gives_the_same_bytes() {
    let bench = fleet("stopped");
    let batch = ["batch", "runs", "--out", "table.csv", "--out", "table.parquet", "--threads"];
    let run = |further: &[&str]| bench.run(&[&batch[..], further].concat());
    succeeds(&run(&["1"]));
    let whole = [bench.read("table.csv"), bench.read("table.parquet")];
    let journal = bench.read("table.csv.journal");
    for share in [0.3, 0.6, 0.99] {
        bench.write("table.csv.journal", &journal[..(share * journal.len() as f64) as usize]);
        succeeds(&run(&["2", "--resume"]));
        assert!([bench.read("table.csv"), bench.read("table.parquet")] == whole, "cut at {share}");
    }
}

#[test]
fn only_what_is_new_or_changed_is_asked_again() {
    let bench = fleet("changed");
    let batch = ["batch", "runs/*.csv", "--out", "table.csv", "--resume"];
    succeeds(&bench.run(&batch));
    let before = rows(&bench, "table.csv");
    let lines = |bench: &Bench| String::from_utf8(bench.read("table.csv.journal")).expect("UTF-8").lines().count();
    assert_eq!(lines(&bench), 1 + 4);
    bench.write("runs/empty.csv", Trace { seed: 4, ..Trace::GOOD }.csv());
    bench.write("runs/c.csv", Trace { seed: 5, ..Trace::GOOD }.csv());
    succeeds(&bench.run(&batch));
    assert_eq!(lines(&bench), 1 + 4 + 2);
    let after = rows(&bench, "table.csv");
    assert_eq!((after["runs/empty.csv"]["exit_code"].as_str(), after.len()), ("0", 5));
    assert_eq!(after["runs/a_1.csv"], before["runs/a_1.csv"]);
    // Fewer files are a smaller table.
    let fewer = bench.run(&["batch", "runs/a_*.csv", "--out", "table.csv", "--resume"]);
    assert!(fewer.stderr.contains("2 of the earlier run's records"), "{fewer:#?}");
    assert_eq!(rows(&bench, "table.csv").len(), 3);
    let again = bench.run(&batch);
    assert!(!again.stderr.contains("earlier run") && rows(&bench, "table.csv") == after, "{again:#?}");
    // Another question has other answers.
    let other = ["batch", "runs/*.csv", "--out", "table.csv", "--resume", "--free", "gain"];
    bench.refuses(2, &other, &["it differs in options.free", "--force"]);
}

#[test]
fn records_of_one_rig_are_asked_together() {
    let bench = fleet("rigs");
    succeeds(&bench.run(&["batch", "runs", "--group-by", "{rig}_*.csv", "--out", "table.csv"]));
    let rows = rows(&bench, "table.csv");
    let together = bench.run(&["characterise", "runs/a_1.csv", "runs/a_2.csv", "--json"]).json();
    let rig = &rows["a"];
    assert_eq!((&rig["records"][..], &rig["level"][..]), ("2", "rig"));
    for (i, column) in ["tau1_s", "tau2_s"].into_iter().enumerate() {
        assert_eq!(rig[column].parse::<f64>().expect("a number"), number(&together["sensors"][i]["time_constant_s"]));
    }
    let record = &rows["runs/a_1.csv"];
    assert_eq!((&record["level"][..], &record["rig"][..], &record["agrees"][..]), ("record", "a", "true"));
    let left_out = number(&together["records"][0]["error"]["held_out_normalised_rms"]["after"]);
    assert_eq!(record["left_out_rms_after"].parse::<f64>().expect("a number"), left_out);
    assert!(record["tau1_s"].is_empty());
    assert_eq!(rows["runs/a_words.csv"]["rig"], "a");
    // Every file is somewhere, a single record of a rig as well.
    assert_eq!((&rows["b"]["records"][..], &rows["runs/below/b_1.csv"]["rig"][..]), ("1", "b"));
    assert_eq!(rows.len(), 2 + 5);
    assert!(rows["runs/empty.csv"]["reason"].contains("{rig}_*.csv"));
}

#[test]
fn a_rig_is_known_by_its_folder_or_by_a_column() {
    let bench = fleet("column");
    succeeds(&bench.run(&["batch", "runs", "--group-by", "folder", "--out", "folders.csv"]));
    let folders = rows(&bench, "folders.csv");
    assert_eq!((&folders["runs"]["records"][..], &folders["runs/below"]["records"][..]), ("2", "1"));
    for (name, serial, seed) in [("x.csv", "TC-7", 1), ("y.csv", "TC-7", 2), ("z.csv", "8", 3)] {
        let trace = Trace { seed, ..Trace::GOOD }.csv();
        let (header, lines) = trace.split_once('\n').expect("a header");
        let lines: Vec<String> = lines.lines().map(|line| format!("{line},{serial}")).collect();
        bench.write(&format!("runs/below/{name}"), format!("{header},serial\n{}\n", lines.join("\n")));
    }
    succeeds(&bench.run(&["batch", "runs/below", "--group-by", "column:serial", "--out", "serials.csv"]));
    let serials = rows(&bench, "serials.csv");
    assert_eq!((&serials["TC-7"]["records"][..], &serials["8"]["records"][..]), ("2", "1"));
    assert!(serials["runs/below/b_1.csv"]["reason"].contains("serial"));
}

#[test]
fn gas_temperatures_go_to_a_folder() {
    let bench = fleet("gas");
    succeeds(&bench.run(&["batch", "runs", "--verb", "compensate", "--gas", "gas", "--out", "table.csv"]));
    let rows = rows(&bench, "table.csv");
    assert_eq!(rows["runs/below/b_1.csv"]["gas_file"], "gas/below/b_1.csv.gas.csv");
    succeeds(&bench.run(&["compensate", "runs/a_1.csv", "--out", "alone.csv"]));
    assert_eq!(bench.read("gas/a_1.csv.gas.csv"), bench.read("alone.csv"));
    assert!(!bench.has("gas/empty.csv.gas.csv"));
    // What is gone is made again, and what is there is not replaced unasked.
    let again = ["batch", "runs", "--verb", "compensate", "--gas", "gas", "--out", "table.csv"];
    std::fs::remove_file(bench.path("gas/a_1.csv.gas.csv")).expect("is there");
    succeeds(&bench.run(&[&again[..], &["--resume"]].concat()));
    assert_eq!(bench.read("gas/a_1.csv.gas.csv"), bench.read("alone.csv"));
    let elsewhere = ["batch", "runs", "--verb", "compensate", "--gas", "gas", "--out", "other.csv"];
    bench.refuses(2, &elsewhere, &["a_1.csv.gas.csv exists", "--force"]);
}

/// Whatever a path looks like, its gas goes below the folder; the gas of an earlier run is no record.
#[test]
fn gas_stays_below_its_folder() {
    let bench = fleet("below");
    let whole = bench.path("runs/below/b_1.csv");
    let files = ["batch", "./runs/../runs/a_1.csv", whole.to_str().expect("UTF-8")];
    let gas = ["--verb", "compensate", "--gas", "runs/gas"];
    succeeds(&bench.run(&[&files[..], &gas, &["--out", "table.csv"]].concat()));
    assert!(bench.has("runs/gas/a_1.csv.gas.csv") && bench.has("runs/gas/b_1.csv.gas.csv"));
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere", bench.path("runs/dangling.csv")).expect("can be linked");
    succeeds(&bench.run(&[&["batch", "runs"], &gas[..], &["--out", "all.csv", "--force"]].concat()));
    let all = rows(&bench, "all.csv");
    assert_eq!(all["runs/below/b_1.csv"]["gas_file"], "runs/gas/below/b_1.csv.gas.csv");
    assert!(all.keys().all(|file| !file.contains("gas")), "{:?}", all.keys());
    // Two records of one name, each found by itself.
    bench.write("runs/below/a_1.csv", Trace { seed: 6, ..Trace::GOOD }.csv());
    let same = ["batch", "runs/a_1.csv", "runs/below/a_1.csv", "--verb", "compensate", "--gas", "g", "--out", "t.csv"];
    bench.refuses(2, &same, &["the same file of gas temperature"]);
}

#[test]
fn what_cannot_be_opened_stops_nothing() {
    let bench = fleet("unopened");
    #[cfg(unix)]
    for (link, to) in [("dangling.csv", "nowhere"), ("below/up", "..")] {
        std::os::unix::fs::symlink(to, bench.path("runs").join(link)).expect("can be linked");
    }
    succeeds(&bench.run(&["batch", "runs", "./runs/a_1.csv", "--out", "table.csv", "--threads", "99999"]));
    let rows = rows(&bench, "table.csv");
    #[cfg(unix)]
    {
        assert!(rows["runs/dangling.csv"]["reason"].contains("cannot be read") && rows.len() == 7, "{rows:#?}");
        assert!(rows["runs/below/up"]["reason"].contains("a link to a folder that it is in"), "{rows:#?}");
    }
    std::fs::create_dir_all(bench.path("none")).expect("can be created");
    bench.refuses(3, &["batch", "none", "--out", "t.csv"], &["none", "no file in this folder"]);
}

#[test]
fn a_diagnosis_has_a_column_for_each_parameter() {
    let bench = Bench::simulated("diagnosis", crate::common::RIG);
    succeeds(&bench.run(&["batch", "run.csv", "--verb", "diagnose", "--out", "table.csv"]));
    let alone = bench.run(&["diagnose", "run.csv", "--json"]).json();
    let row = &rows(&bench, "table.csv")["run.csv"];
    assert_eq!(row["verdict"], alone["verdict"]);
    let offset = &alone["effects"][0]["parameters"][0];
    assert_eq!((offset["name"].as_str(), offset["unit"].as_str()), (Some("offset"), Some("K")));
    for (column, want) in [("_K", &offset["value"]), ("_low_K", &offset["interval_95"][0])] {
        let column = format!("calibration2_offset{column}");
        assert_eq!(row[&column].parse::<f64>().expect("a number"), number(want), "{column}");
    }
}

#[test]
fn what_cannot_be_asked_is_refused() {
    fn batch<'a>(further: &[&'a str]) -> Vec<&'a str> {
        [&["batch", "runs"], further].concat()
    }
    let bench = fleet("refused");
    bench.refuses(2, &batch(&["--out", "table.txt"]), &["table.txt", ".csv or .parquet"]);
    bench.refuses(2, &batch(&["--out", "t.csv", "--group-by", "*.csv"]), &["{rig}"]);
    bench.refuses(2, &batch(&["--out", "t.csv", "--gas", "gas"]), &["--verb compensate"]);
    bench.refuses(2, &batch(&["--out", "runs/a_1.csv"]), &["exists"]);
    bench.refuses(2, &batch(&["--out", "runs/a_1.csv", "--force"]), &["one of the records"]);
    bench.write("is_a_file", "");
    bench.refuses(2, &batch(&["--out", "t.csv", "--verb", "compensate", "--gas", "is_a_file"]), &["expected a folder"]);
    bench.refuses(3, &["batch", "no*.csv", "--out", "t.csv"], &["no*.csv"]);
    assert!(!bench.has("t.csv") && !bench.has("t.csv.journal"));
    let none = bench.run(&["batch", "runs/empty.csv", "--out", "t.csv"]);
    assert_eq!(none.code, 3, "{none:#?}");
    assert_eq!(rows(&bench, "t.csv").len(), 1);
    bench.refuses(2, &["batch", "runs", "--out", "t.csv"], &["t.csv", "--force"]);
    // A table that is there does not make a record its summary.
    let report = ["batch", "runs", "--out", "t.csv", "--report", "runs/a_1.csv"];
    bench.refuses(2, &[&report[..], &["--force"]].concat(), &["a_1.csv is one of the records"]);
    bench.refuses(2, &[&report[..], &["--resume"]].concat(), &["a_1.csv exists"]);
    bench.write("notes.html", "<!DOCTYPE html><title>Notes</title>");
    bench.refuses(
        2,
        &["batch", "runs", "--out", "t.csv", "--report", "notes.html", "--resume"],
        &["notes.html exists"],
    );
}

/// Whatever the shards, the table is the same; and one that is not there yet asks to be tried again.
#[test]
fn shards_give_the_table_of_a_whole_run() {
    let bench = Bench::new("shards");
    for (file, seed) in [("runs_a.csv", 1), ("runs_b.csv", 2)] {
        bench.write(file, Trace { seed, ..Trace::GOOD }.csv());
    }
    bench.write("runs_c.csv", "");
    let batch = ["batch", "runs_*.csv", "--group-by", "{rig}_*.csv"];
    assert_eq!(bench.run(&[&batch[..], &["--out", "whole.csv"]].concat()).code, 0);
    let run = |shard: &str| bench.run(&[&batch[..], &["--out", "t.csv", "--shard", shard, "--resume"]].concat());
    let merge = || bench.run(&["batch", "--merge", "--out", "t.csv"]);
    assert_eq!(run("1/2").code, 0);
    // Failed: only the merge saw that a shard had asked something else.
    bench.refuses(
        2,
        &[&batch[..], &["--out", "t.csv", "--shard", "0/2", "--strict"]].concat(),
        &["strict", "t.csv.manifest"],
    );
    let incomplete = merge();
    assert_eq!(incomplete.code, 75, "{incomplete:#?}");
    incomplete.says(&["missing", "shard 0 of 2"]);
    assert_eq!(run("0/2").code, 0);
    assert_eq!(merge().code, 0);
    assert_eq!(bench.read("t.csv"), bench.read("whole.csv"));
    // Failed: the other machine could not read the manifest where another user ran it.
    let permissions = |file| bench.path(file).metadata().expect("there").permissions();
    assert_eq!(permissions("t.csv.manifest"), permissions("t.csv"));
    bench.refuses(2, &["batch", "--merge", "--out", "t.csv"], &["t.csv exists", "--force"]);
    bench.refuses(2, &["batch", "--merge", "--out", "t.csv", "--force", "--strict"], &["--merge", "--strict"]);
    bench.refuses(2, &["batch", "--merge", "--out", "t.csv", "--report", "t.csv.part-0-of-2", "--force"], &["part"]);
    // What a shard finds changed is a row that says so.
    bench.write("runs_a.csv", Trace { seed: 3, ..Trace::GOOD }.csv());
    let again = ["batch", "runs_*.csv", "--group-by", "{rig}_*.csv", "--out", "t.csv", "--force"];
    for shard in ["0/2", "1/2"] {
        assert_eq!(bench.run(&[&again[..], &["--shard", shard]].concat()).code, 0);
    }
    assert_eq!(bench.run(&["batch", "--merge", "--out", "t.csv", "--force"]).code, 1);
    let table = String::from_utf8(bench.read("t.csv")).expect("text");
    assert!(table.contains("runs_a.csv: has changed since the batch was divided"), "{table}");
}

/// Failed: a shard took the gas temperatures of others for files in its way, and the manifest for a record, where the table lies among them.
#[test]
fn shards_with_gas_in_the_folder_of_the_records_give_the_table_of_a_whole_run() {
    let bench = Bench::new("shards_gas");
    for (file, seed) in [("a.csv", 1), ("b.csv", 2), ("c.csv", 3)] {
        bench.write(file, Trace { seed, ..Trace::GOOD }.csv());
    }
    let batch = ["batch", ".", "--verb", "compensate", "--without", "slow-mode", "--out", "t.csv", "--gas", "gas"];
    for shard in ["1/2", "0/2"] {
        let answer = bench.run(&[&batch[..], &["--shard", shard, "--resume"]].concat());
        assert_eq!(answer.code, 0, "{answer:#?}");
    }
    assert_eq!(bench.run(&["batch", "--merge", "--out", "t.csv"]).code, 0);
    let merged = bench.read("t.csv");
    for file in ["t.csv", "t.csv.manifest", "t.csv.part-0-of-2", "t.csv.part-1-of-2"] {
        std::fs::remove_file(bench.path(file)).expect("there");
    }
    assert_eq!(bench.run(&[&batch[..], &["--force"]].concat()).code, 0);
    assert_eq!(merged, bench.read("t.csv"));
    // Failed: what other batches in the folder had written was taken for records.
    let other = ["batch", ".", "--verb", "compensate", "--without", "slow-mode", "--out", "other.csv", "--gas", "gas"];
    let answer = bench.run(&[&other[..], &["--force"]].concat());
    answer.says(&["not asked for: 2 files", "t.csv"]);
    assert_eq!(merged, bench.read("other.csv"));
    // A file that is added later is in no shard.
    bench.run(&[&batch[..], &["--shard", "0/1", "--force"]].concat());
    bench.write("d.csv", Trace::GOOD.csv());
    bench
        .run(&[&batch[..], &["--shard", "0/1", "--force"]].concat())
        .says(&["1 files that t.csv.manifest does not list"]);
}
