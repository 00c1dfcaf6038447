//! What a program owes its users beside answers: its version, completions, a manual, options from a file, colours where they are
//! wanted, the line that a message is about.

use crate::common::{Bench, Trace};

#[test]
fn options_come_from_a_file_where_the_command_line_does_not_give_them() {
    let bench = Bench::with("config", "run.csv", Trace::GOOD.csv());
    bench.write(
        "lab.toml",
        "known = [\"T1=0.12s\"]\nquiet = true\n[characterise]\nfree = \"offset\"\n[diagnose]\nwithout = \"delay\"\n",
    );
    let options = |further: &[&str]| {
        let answer = bench.run(&[&["characterise", "run.csv", "--json", "--config", "lab.toml"], further].concat());
        assert_eq!(answer.stderr, "", "{answer:#?}");
        answer.json()["made_by"]["options"].clone()
    };
    let typed = bench.run(&["characterise", "run.csv", "--json", "--known", "T1=0.12s", "--free", "offset"]);
    assert_eq!(options(&[]), typed.json()["made_by"]["options"]);
    let other = bench.run(&["characterise", "run.csv", "--json", "--known", "T1=0.12s", "--free=gain"]);
    assert_eq!(options(&["--free=gain"]), other.json()["made_by"]["options"]);
    // Behind `--` there are files alone.
    let apart = bench.run(&["--config=lab.toml", "characterise", "--json", "--", "run.csv"]);
    assert_eq!(apart.json()["made_by"]["options"], typed.json()["made_by"]["options"]);
}

#[test]
fn a_file_of_options_that_are_none_is_refused() {
    let bench = Bench::with("wrong_config", "run.csv", Trace::GOOD.csv());
    for (text, words) in [
        ("fre = 1", &["lab.toml", "--fre"][..]),
        ("[diagnose]\nform = 1", &["lab.toml", "[diagnose]", "--form"]),
        ("[diagnoze]\n", &["lab.toml", "[diagnoze]"]),
        ("free = {", &["lab.toml", "TOML"]),
    ] {
        bench.write("lab.toml", text);
        bench.refuses(3, &["characterise", "run.csv", "--config", "lab.toml"], words);
    }
    bench.refuses(3, &["characterise", "run.csv", "--config", "none.toml"], &["none.toml", "cannot be read"]);
}

/// Failed: a wrong value was refused without a word of the file that it stands in.
#[test]
fn a_value_from_a_file_of_options_is_refused_with_that_file() {
    let bench = Bench::with("config_value", "run.csv", Trace::GOOD.csv());
    for (text, options) in [("free = \"colour\"", "--free=colour"), ("known = \"T1=blue\"", "--known=T1=blue")] {
        bench.write("lab.toml", text);
        let said = format!("(options from lab.toml: {options})");
        bench.refuses(2, &["characterise", "run.csv", "--config", "lab.toml"], &[&said]);
    }
}

/// Failed: a negative number was taken for an option, with the advice to write `-- -1`.
#[test]
fn what_says_which_numbers_an_option_may_have_says_it_of_negative_ones() {
    let bench = Bench::with("negative", "run.csv", Trace::GOOD.csv());
    for (code, arguments, words) in [
        (2, &["track", "run.csv", "--window", "-1", "--out", "out.csv"][..], &["window: expected seconds", "-1"][..]),
        (2, &["characterise", "run.csv", "--period", "-1"], &["the sample period must be positive", "-1"]),
        (2, &["batch", "run.csv", "--period", "-1", "--out", "out.csv"], &["--period", "positive", "-1"]),
        (2, &["demo", "--seed", "-1"], &["--seed", "expected a whole number from 0 to 1844"]),
        (2, &["track", "run.csv", "--live", "-5", "--out", "-"], &["--live", "-5", "200.."]),
        (2, &["batch", "run.csv", "--threads", "-1", "--out", "out.csv"], &["--threads", "-1"]),
    ] {
        bench.refuses(code, arguments, words);
    }
}

/// Failed: the page of a batch showed the folders of the machine that it was made on.
#[test]
fn a_page_names_no_folder_of_the_machine() {
    let bench = Bench::with("folders", "run.csv", Trace::GOOD.csv());
    let here = bench.path("").to_string_lossy().into_owned();
    let file = bench.path("run.csv").to_string_lossy().into_owned();
    let table = bench.path("table.csv").to_string_lossy().into_owned();
    let report = format!("--report={}", bench.path("page.html").display());
    assert_eq!(bench.run(&["batch", &file, "--out", &table, &report]).code, 0);
    let page = String::from_utf8(bench.read("page.html")).expect("a page is text");
    assert!(page.contains("batch .../run.csv --out .../table.csv --report=.../page.html"), "{page}");
    assert!(!page.contains(here.trim_end_matches('/')), "{page}");
}

#[test]
fn the_line_that_a_message_is_about_is_shown() {
    let mut lines = Trace::GOOD.lines();
    lines[7] = "0.07,warm,300".to_owned();
    let bench = Bench::with("excerpt", "run.csv", lines.join("\n"));
    bench.refuses(3, &["characterise", "run.csv"], &["line 8", "\n  8 | 0.07,warm,300\n"]);
}

#[test]
fn colours_are_for_terminals() {
    let bench = Bench::with("colours", "run.csv", Trace::GOOD.csv());
    let plain = bench.run(&["characterise", "run.csv"]);
    assert!(plain.stdout.contains("  go\n") && !plain.stdout.contains('\u{1b}'), "{plain:#?}");
    let coloured = bench.run_in_environment(&["characterise", "run.csv"], &[("CLICOLOR_FORCE", "1")]);
    assert!(coloured.stdout.contains("\u{1b}[1m\u{1b}[32mgo\u{1b}[0m"), "{coloured:#?}");
    let without = bench.run_in_environment(&["characterise", "run.csv"], &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]);
    assert_eq!(without.stdout, plain.stdout);
}

#[test]
fn shells_and_man_know_every_command() {
    let bench = Bench::new("manual");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let answer = bench.run(&["completions", shell]);
        assert!(answer.code == 0 && answer.stdout.contains("save-profile"), "{answer:#?}");
    }
    assert_eq!(bench.run(&["man", "--out", "pages", "--quiet"]).code, 0);
    for page in ["twinlag", "twinlag-batch", "twinlag-study-run"] {
        let text = String::from_utf8(bench.read(&format!("pages/{page}.1"))).expect("UTF-8");
        assert!(text.contains(".TH"), "{page}");
    }
}

/// A file with dates, a column that is not read, and a row that is missing in the middle.
#[test]
fn what_is_not_read_goes_to_the_output_as_it_is() {
    let lines = Trace::GOOD.lines();
    let row = |(k, line): (usize, &String)| match k {
        0 => format!("when,{line},rpm,note"),
        k => format!("2026-01-31 12:00:{:07.4},{line},{},\"a, {k}\"", 0.002 * (k - 1) as f64, 1500 + k),
    };
    let mut rows: Vec<String> = lines.iter().enumerate().map(row).collect();
    rows.remove(1000);
    let bench = Bench::with("keep", "run.csv", rows.join("\n"));
    let time = ["--time", "when", "--t1", "T1", "--t2", "T2"];
    let out = |further: &[&str]| {
        let answer =
            bench.run(&[&["compensate", "run.csv", "--out", "gas.csv", "--force"], &time[..], further].concat());
        assert_eq!(answer.code, 0, "{answer:#?}");
        String::from_utf8(bench.read("gas.csv")).expect("UTF-8").lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let dates = out(&[]);
    assert!(
        dates[0] == "time_s,gas_C,gas_std_K,grade,when" && dates[1].ends_with(",2026-01-31 12:00:00.0000"),
        "{:?}",
        &dates[..2]
    );
    let all = out(&["--keep", "rpm,note"]);
    assert_eq!(all[0], "time_s,gas_C,gas_std_K,grade,when,rpm,note");
    for k in [1, 2, 999, 1001, 1900] {
        assert!(all[k].ends_with(&format!(",{},\"a, {k}\"", 1500 + k)), "{}", all[k]);
    }
    // The sample that is missing has a gas temperature, and nothing else.
    assert!(all[1000].ends_with(",,,"), "{}", all[1000]);
    bench.refuses(
        3,
        &[&["compensate", "run.csv", "--out", "x.csv", "--keep", "load"], &time[..]].concat(),
        &["no column 'load'"],
    );
}
