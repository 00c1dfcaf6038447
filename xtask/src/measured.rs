//! Measured records: each must be answered or refused with a reason, and the known facts must come out.
//!
//! The data are not part of the repository. What is known of them rests on plateaus and data sheets, not on lag fits.

mod campaigns;
mod diagnosed;
mod page;

use std::fs;
use std::path::{Path, PathBuf};

use crate::root;
use anyhow::{Context, Result, bail, ensure};
use twinlag::record::{ColumnRef, Record, Selection};
use twinlag::{Characterisation, Options, Status, characterise};

/// One question to one file: its columns, what is freed or known, and what must come out.
struct Case<A> {
    file: &'static str,
    channels: [&'static str; 2],
    with: &'static str,
    check: fn(&A) -> Result<()>,
}

const fn case<A>(
    file: &'static str,
    channels: [&'static str; 2],
    with: &'static str,
    check: fn(&A) -> Result<()>,
) -> Case<A> {
    Case { file, channels, with, check }
}

impl<A> Case<A> {
    fn selection(&self) -> Selection {
        let [t1, t2] = self.channels.map(|name| Some(ColumnRef::Name(name.into())));
        Selection { t1, t2, ..Selection::default() }
    }
}

const CASES: &[Case<Characterisation>] = &[
    case("block100/run_012b.csv", ["ref2_C", "dut_C"], "gain,offset", |answer| {
        calibration(answer, 0.9907, 0.003, 0.056, 0.1)?;
        contains("ref2_C", answer.sensors[0].interval_95_s, 69.0)?;
        contains("dut_C", answer.sensors[1].interval_95_s, 46.0)
    }),
    case("block100/run_012b.csv", ["ref2_C", "dut_C"], "", not_ok),
    case("block100/run_004.csv", ["ref_C", "dut_C"], "gain,offset", |answer| {
        calibration(answer, 0.9955, 0.003, -0.169, 0.1)
    }),
    case("block100/run_004.csv", ["ref_C", "dut_C"], "", not_ok),
    case("block100/run_010_DS18B20_ORG.csv", ["ref_C", "dut_C"], "gain,offset", |answer| {
        calibration(answer, 0.9950, 0.003, -0.221, 0.1)
    }),
    case("block100/run_010_DS18B20_ORG.csv", ["ref_C", "dut_C"], "", not_ok),
    case("ctd911/g01mcan03c.csv", ["T1_t090_C", "T2_t190_C"], "", |answer| {
        ensure!(answer.status == Status::NotIdentifiable, "status {:?}", answer.status);
        for i in 0..2 {
            ensure!(answer.sensors[i].time_constant_s.is_none(), "an absolute time constant is reported");
        }
        let [low, high] = answer.time_constant_difference_s.interval_95_s.context("no difference")?;
        ensure!(low > 0.0 && high < 0.2, "difference in [{low}, {high}] s: the casts of this pair have 0.05 to 0.15 s");
        Ok(())
    }),
    case("seaexplorer_sea046/dive12_1hz.csv", ["T1_gpctd_C", "T2_arod_C"], "", not_ok),
    case("seaexplorer_sea046/dive12_1hz.csv", ["T1_gpctd_C", "T2_arod_C"], "gain,offset", not_ok),
    case("seaglider_sg542/dive305.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "", not_ok),
    case("seaglider_sg542/dive305.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "gain,offset", not_ok),
    case("seaglider_sg542/dive306.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "", not_ok),
    case("seaglider_sg542/dive306.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "gain,offset", not_ok),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_1m_C", "tc050_1m_C"], "", not_ok),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_2m_C", "tc050_2m_C"], "", not_ok),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_3m_C", "tc050_3m_C"], "", not_ok),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_4m_C", "tc050_4m_C"], "", not_ok),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_5m_C", "tc050_5m_C"], "", not_ok),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_1m_C", "pt_1m_C"], "", not_ok),
];

/// The records that are diagnosed, each with its two channels, once.
pub(crate) fn records() -> Vec<(&'static str, [&'static str; 2])> {
    let mut out = diagnosed::records();
    out.dedup();
    out
}

/// Two first-order lags are known not to be the whole story: an answer without a warning would be a trap.
fn not_ok(answer: &Characterisation) -> Result<()> {
    ensure!(answer.status != Status::Ok, "status ok on a record that two first-order lags are known not to explain");
    Ok(())
}

fn calibration(answer: &Characterisation, gain: f64, gain_tol: f64, offset: f64, offset_tol: f64) -> Result<()> {
    let got = answer.free.gain.as_ref().context("no gain")?.value;
    ensure!((got - gain).abs() <= gain_tol, "gain {got}, the plateaus have {gain} ± {gain_tol}");
    let got = answer.free.offset_k.as_ref().context("no offset")?.value;
    ensure!((got - offset).abs() <= offset_tol, "offset {got} K, the plateaus have {offset} ± {offset_tol} K");
    Ok(())
}

fn contains(name: &str, interval: Option<[f64; 2]>, truth: f64) -> Result<()> {
    let [low, high] = interval.with_context(|| format!("{name}: no interval"))?;
    ensure!(low <= truth && truth <= high, "{name}: [{low}, {high}] s does not contain {truth} s");
    Ok(())
}

/// Runs all cases, then every other file with guessed columns.
pub(crate) fn run(dir: &Path, of_campaigns: Option<&Path>, write: bool) -> Result<()> {
    ensure!(dir.is_dir(), "{}: no such folder: name the folder of the measured data", dir.display());
    let mut failures = Vec::new();
    println!("{:38} {:24} {:12} {:16} answer", "file", "channels", "free", "status");
    for case in CASES {
        let answer = ask(&dir.join(case.file), &case.selection(), case.with).and_then(|answer| {
            row(case, &answer);
            whole(&answer)?;
            (case.check)(&answer)
        });
        if let Err(error) = answer {
            failures.push(format!("{} {:?} free '{}': {error:#}", case.file, case.channels, case.with));
        }
    }
    for path in files(dir)? {
        let name = path.strip_prefix(dir).unwrap_or(&path).display().to_string();
        match ask(&path, &Selection::default(), "") {
            Ok(answer) => {
                if let Err(error) = whole(&answer) {
                    failures.push(format!("{name}, guessed columns: {error:#}"));
                }
                println!("{name}, guessed columns: {:?}", answer.status);
            }
            Err(error) => println!("{name}, guessed columns: refused: {error:#}"),
        }
    }
    let mut diagnosed = diagnosed::run(dir);
    if let Some(dir) = of_campaigns {
        campaigns::run(dir, &mut diagnosed.page)?;
    }
    failures.extend(diagnosed.failures);
    let questions = CASES.len() + diagnosed.questions;
    if write {
        let book = root()?.join("docs/src");
        fs::write(book.join("measured-table.md"), &diagnosed.page.table)?;
        fs::write(book.join("measured-records.md"), &diagnosed.page.sections)?;
        if of_campaigns.is_some() {
            campaigns::write(&book, &diagnosed.page)?;
        }
        let images = book.join("images/measured");
        fs::create_dir_all(&images)?;
        for (name, svg) in &diagnosed.page.pictures {
            fs::write(images.join(name), svg)?;
        }
    }
    if failures.is_empty() {
        println!("{questions} questions to measured records answered as known, 0 failed");
        Ok(())
    } else {
        bail!("{} of {questions} questions failed:\n{}", failures.len(), failures.join("\n"))
    }
}

/// What is found, also what may not be used: it is the finding that is held against what is known.
fn ask(path: &Path, selection: &Selection, free: &str) -> Result<Characterisation> {
    let record = Record::read(path, selection)?;
    let options = Options { best_effort: true, ..Options::default() };
    Ok(characterise(&record, &options.free(free)?)?)
}

/// A number is finite or absent, and an answer that is none says why.
fn whole(answer: &Characterisation) -> Result<()> {
    let numbers = answer.sensors.iter().flat_map(|s| {
        [s.time_constant_s, s.standard_error_s, s.interval_95_s.map(|i| i[0]), s.interval_95_s.map(|i| i[1])]
    });
    ensure!(numbers.flatten().all(f64::is_finite), "a number that is not finite: {:?}", answer.sensors);
    ensure!(answer.residual.chi2_per_dof.is_some_and(f64::is_finite), "the residual's energy is not finite");
    ensure!(answer.status == Status::Ok || !answer.warnings.is_empty(), "no answer, and no reason given");
    Ok(())
}

fn row(case: &Case<Characterisation>, answer: &Characterisation) {
    let seconds = |i: usize| match (answer.sensors[i].time_constant_s, answer.sensors[i].interval_95_s) {
        (Some(tau), Some([low, high])) => format!("{tau:.4} [{low:.4}, {high:.4}] s"),
        _ => "-".into(),
    };
    let difference = answer.time_constant_difference_s.interval_95_s;
    let difference = difference.map_or("-".into(), |[low, high]| format!("[{low:.4}, {high:.4}] s"));
    let calibration = match (&answer.free.gain, &answer.free.offset_k) {
        (Some(gain), Some(offset)) => format!(", gain {:.4}, offset {:.3} K", gain.value, offset.value),
        _ => String::new(),
    };
    println!(
        "{:38} {:24} {:12} {:16} {}, {}, difference {difference}{calibration}, chi2/dof {:.3}",
        case.file,
        case.channels.join(" "),
        case.with,
        format!("{:?}", answer.status),
        seconds(0),
        seconds(1),
        answer.residual.chi2_per_dof.unwrap_or_default()
    );
}

fn files(dir: &Path) -> Result<Vec<PathBuf>> {
    let mut out = Vec::new();
    for entry in fs::read_dir(dir)? {
        let path = entry?.path();
        if path.is_dir() {
            out.extend(files(&path)?);
        } else if path.extension().is_some_and(|e| e == "csv") {
            out.push(path);
        }
    }
    out.sort();
    Ok(out)
}
