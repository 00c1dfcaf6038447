//! The closed loop on measured records: what it must find, and what it must not claim.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use twinlag::cross_relation::Z_975;
use twinlag::diagnosis::{Identifier, TimeConstant, Verdict};
use twinlag::record::Record;
use twinlag::{DiagnoseOptions, Diagnosis, Options, Status, diagnose};

use super::page::Page;
use super::{Case, case, contains};

const CASES: &[Case<Diagnosis>] = &[
    case("block100/run_004.csv", ["ref_C", "dut_C"], "", |answer| {
        calibration(answer, 0.9955, -0.169)?;
        parameter(answer, Identifier::CALIBRATION, "curvature").map(|_| ())
    }),
    case("block100/run_010_DS18B20_ORG.csv", ["ref_C", "dut_C"], "", |answer| {
        calibration(answer, 0.9950, -0.221)?;
        parameter(answer, Identifier::CALIBRATION, "curvature").map(|_| ())
    }),
    case("block100/run_012b.csv", ["ref2_C", "dut_C"], "", |answer| calibration(answer, 0.9907, 0.056)),
    case("seaexplorer_sea046/dive12_1hz.csv", ["T1_gpctd_C", "T2_arod_C"], "", rejected),
    case("seaexplorer_sea046/dive12_1hz.csv", ["T1_gpctd_C", "T2_arod_C"], "T1.time_constant_s=0.5", rejected),
    case("seaglider_sg542/dive305.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "", rejected),
    case("seaglider_sg542/dive305.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "T1.time_constant_s=0.6", |answer| {
        let share = parameter(answer, Identifier::SLOW_MODE, "share")?;
        let tau_s = parameter(answer, Identifier::SLOW_MODE, "slow_time_constant")?;
        ensure!((0.02..0.06).contains(&share), "the slow mode has a share of {share}");
        ensure!((450.0..800.0).contains(&tau_s), "the slow mode has {tau_s} s");
        Ok(())
    }),
    case("seaglider_sg542/dive306.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "", rejected),
    case("seaglider_sg542/dive306.csv", ["T1_ct_raw_C", "T2_aa4330_C"], "T1.time_constant_s=0.6", |answer| {
        parameter(answer, Identifier::SLOW_MODE, "share").map(|_| ())
    }),
    case("ctd911/g01mcan03c.csv", ["T1_t090_C", "T2_t190_C"], "", |answer| {
        let claimed = answer.last.sensors.iter().any(|s| s.time_constant_s.is_some());
        ensure!(!claimed, "an absolute time constant is reported");
        // What the fit says of noise, and the answer with the scatter between parts of the cast, of which all are about 0.08 s.
        let core = answer.core.as_ref().context("an answer without its core")?;
        let TimeConstant { value_s, standard_error_s, .. } = core.last.difference;
        let (value, error) = (value_s.context("no difference")?, standard_error_s.context("no standard error")?);
        let [low, high] = [value - Z_975 * error, value + Z_975 * error];
        ensure!(low > 0.05 && high < 0.15, "later by [{low}, {high}] s: the casts of this pair have 0.05 to 0.15 s");
        let wide = answer.last.time_constant_difference_s.interval_95_s;
        contains("difference", wide, 0.08)?;
        let [low, high] = wide.context("no difference")?;
        ensure!(low > 0.0 && high < 0.2, "later by [{low}, {high}] s with the scatter between parts");
        Ok(())
    }),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_3m_C", "pt_3m_C"], "", |answer| {
        let exponent = parameter(answer, Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, "exponent")?;
        ensure!(exponent < 0.0, "the plate's time constant grows with temperature: {exponent}");
        Ok(())
    }),
    case("sp_column_fire/Diesel_1p1.csv", ["tc025_3m_C", "tc050_3m_C"], "", |answer| {
        ensure!(answer.last.status == Status::NotIdentifiable, "status {:?}", answer.last.status);
        Ok(())
    }),
];

/// Two first-order lags are known not to be the whole story.
fn rejected(answer: &Diagnosis) -> Result<()> {
    ensure!(answer.verdict != Verdict::Adequate, "two first-order lags are said to be adequate");
    ensure!(answer.base.status != Status::Ok, "the two-lag model has status ok");
    Ok(())
}

fn parameter(answer: &Diagnosis, effect: Identifier, name: &str) -> Result<f64> {
    let of_effect = answer.effects.iter().filter(|e| e.effect == effect).flat_map(|e| &e.parameters);
    let value = of_effect.into_iter().find(|p| p.name == name).and_then(|p| p.value);
    value.with_context(|| format!("no {effect} with a {name}"))
}

fn calibration(answer: &Diagnosis, gain: f64, offset_k: f64) -> Result<()> {
    let got = parameter(answer, Identifier::CALIBRATION, "gain")?;
    ensure!((got - gain).abs() <= 0.003, "gain {got}, the plateaus have {gain} ± 0.003");
    let got = parameter(answer, Identifier::CALIBRATION, "offset")?;
    ensure!((got - offset_k).abs() <= 0.1, "offset {got} K, the plateaus have {offset_k} ± 0.1 K");
    Ok(())
}

/// The records of all cases with their channels, those of one record after each other.
pub(super) fn records() -> Vec<(&'static str, [&'static str; 2])> {
    CASES.iter().map(|case| (case.file, case.channels)).collect()
}

/// What came of all cases.
pub(super) struct Diagnosed {
    pub(super) failures: Vec<String>,
    pub(super) questions: usize,
    /// For the book.
    pub(super) page: Page,
}

pub(super) fn run(dir: &Path) -> Diagnosed {
    let mut page = Page::new();
    let mut failures = Vec::new();
    for case in CASES {
        let outcome = one(dir, case, &mut page);
        if let Err(error) = outcome {
            failures.push(format!("{} {:?} known '{}', diagnosed: {error:#}", case.file, case.channels, case.with));
        }
    }
    Diagnosed { failures, questions: CASES.len(), page }
}

fn one(dir: &Path, case: &Case<Diagnosis>, page: &mut Page) -> Result<()> {
    let record = Record::read(dir.join(case.file), &case.selection())?;
    let mut options = Options { best_effort: true, ..Options::default() };
    if !case.with.is_empty() {
        options.known.push(case.with.parse()?);
    }
    let answer = diagnose(&record, &DiagnoseOptions { characterise: options, ..DiagnoseOptions::default() })?;
    println!("{}", page.add(case.file, case.channels, case.with, &answer)?);
    (case.check)(&answer)
}
