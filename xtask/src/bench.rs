//! How long a fit takes, beside the SciPy script that a user would otherwise write: same record, same cost, same start, same
//! minimum, in one run.

use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use twinlag::bias::{Compensated, Noise};
use twinlag::cross_relation::{CostValue, CrossRelation, Readings, Whitened};
use twinlag::optimise::{Budget, Cost, Derivatives, End, Minimiser, Optimiser, Problem, Variable};
use twinlag::record::{Record, Selection};
use twinlag::sensor::Discretisation;
use twinlag::{Hold, Options, characterise};

use crate::root;

/// What the SciPy script starts from, discards, and is told.
const START_S: [f64; 2] = [0.01, 0.05];
const DISCARD: usize = 300;
const NOISE_STD_K: f64 = 0.583_363_094_478_901_8;
/// Fits that the script averages over.
const SCIPY_FITS: usize = 20;
/// Agreement of the minima, relative.
const SAME: f64 = 1e-6;

/// A cost of two time constants, as the optimiser takes it.
struct OfTwo<F>(F);

impl<F: Fn(&[f64; 2]) -> CostValue<2>> Cost for OfTwo<F> {
    fn value(&self, x: &[f64]) -> f64 {
        self.0(&[x[0], x[1]]).value
    }

    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let c = self.0(&[x[0], x[1]]);
        Some(Derivatives {
            value: c.value,
            gradient: c.gradient.to_vec(),
            curvature: c.hessian.iter().map(|row| row.to_vec()).collect(),
        })
    }
}

fn fit(cost: impl Fn(&[f64; 2]) -> CostValue<2>, period_s: f64, span_s: f64) -> Result<[f64; 2]> {
    let cost = OfTwo(cost);
    let variable = |name: &str| Variable::logarithmic(name, 0.2 * period_s, 10.0 * span_s);
    let problem = Problem::new(&cost, vec![variable("T1"), variable("T2")])?;
    let fit = Optimiser::default().minimise(&problem, &START_S, &Budget::default())?;
    ensure!(fit.end == End::Converged, "the fit ended {:?}", fit.end);
    Ok([fit.x[0], fit.x[1]])
}

/// Mean seconds per call over at least a second of calls, after a tenth of one.
fn time<T>(mut call: impl FnMut() -> Result<T>) -> Result<(f64, T)> {
    let mut last = call()?;
    for least_s in [0.1, 1.0] {
        let (start, mut calls) = (Instant::now(), 0);
        while start.elapsed().as_secs_f64() < least_s {
            last = black_box(call()?);
            calls += 1;
        }
        if least_s == 1.0 {
            return Ok((start.elapsed().as_secs_f64() / f64::from(calls), last));
        }
    }
    bail!("no call was timed")
}

pub(crate) fn run() -> Result<()> {
    let file = root()?.join("tests/data/sine_5pct.csv");
    let record = Record::read(&file, &Selection::default())?;
    let (y1, y2) = (&record.t1_c, &record.t2_c);
    let (period_s, span_s) = (record.sampling.period_s, record.time_s[record.len() - 1]);

    // Each fit starts from the raw channels, as the script's does from its arrays.
    let (plain_s, plain) = time(|| {
        let readings = Readings::even(y1, y2, period_s)?;
        let cost = CrossRelation::new(&readings, DISCARD)?;
        fit(|t| cost.evaluate(t), period_s, span_s)
    })?;
    let (compensated_s, compensated) = time(|| {
        let readings = Readings::even(y1, y2, period_s)?;
        let noise = [Noise::white(NOISE_STD_K)?, Noise::white(NOISE_STD_K)?];
        let cost = Compensated::new(CrossRelation::new(&readings, DISCARD)?, noise);
        fit(|t| cost.evaluate(t), period_s, span_s)
    })?;
    let (whitened_s, _) = time(|| {
        let readings = Readings::even(y1, y2, period_s)?;
        let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [NOISE_STD_K; 2])?;
        fit(|t| cost.evaluate(t), period_s, span_s)
    })?;
    let options = Options { hold: Hold::ZeroOrderHold, ..Options::default() };
    let (whole_s, _) = time(|| Ok(characterise(&record, &options)?))?;
    println!("{:34} {:>10.3} ms", "plain cross-relation, one fit", 1e3 * plain_s);
    println!("{:34} {:>10.3} ms", "compensated, one fit", 1e3 * compensated_s);
    println!("{:34} {:>10.3} ms", "whitened, one fit", 1e3 * whitened_s);
    println!("{:34} {:>10.3} ms", "characterise, all of it", 1e3 * whole_s);

    let script = root()?.join("xtask/bench/scipy_baseline.py");
    let output = Command::new("python3")
        .arg(&script)
        .arg(&file)
        .args([NOISE_STD_K.to_string(), SCIPY_FITS.to_string()])
        .output()
        .context("python3 could not be started: the comparison needs Python with NumPy and SciPy")?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        bail!("the SciPy script failed (pip install numpy scipy?): {}", why.lines().last().unwrap_or(""));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    for (name, ours_s, ours) in [("plain", plain_s, plain), ("compensated", compensated_s, compensated)] {
        let line =
            text.lines().find(|l| l.starts_with(name)).with_context(|| format!("no line '{name}' in: {text}"))?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| -> Result<f64> { Ok(words.get(i).context("a shorter line")?.parse()?) };
        let theirs_ms = number(1)?;
        // The script prints six decimals of a second: the last of them, and what it stands for, may differ.
        for (i, got) in ours.iter().enumerate() {
            let want = number(4 + i)?;
            ensure!((got - want).abs() < 0.5e-6 + SAME * want, "{name}: minimum at {got}, SciPy's at {want}");
        }
        println!("{name}: SciPy {theirs_ms:.3} ms, {:.0} times as long, same minimum", theirs_ms / (1e3 * ours_s));
    }
    Ok(())
}
