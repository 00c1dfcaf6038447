//! `cargo xtask bench --smoother`: a gas temperature of 1e5 samples, beside the smoother that a user would write in NumPy.

use std::fs::File;
use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use twinlag::compensation::{Form, Prior, Readings, Rig, Sensor, Term, reconstruct};
use twinlag::record::{Decimals, write_csv};

use crate::root;

const SAMPLES: usize = 100_000;
const PERIOD_S: f64 = 1e-3;
const TAU_S: [f64; 2] = [0.03, 0.11];
const NOISE_STD_K: f64 = 0.1;
const LEVEL_C: f64 = 300.0;
const GAS_STD_K: f64 = 15.0;
const CORNER_HZ: f64 = 2.0;
/// Times that the pass is taken, of which the shortest counts.
const REPEATS: usize = 5;
/// Both compute the same sums, of some hundred products each, in another order; the script starts each from a covariance that is
/// solved for anew.
const MOST_APART_K: f64 = 1e-6;

pub(super) fn run() -> Result<()> {
    let time_s: Vec<f64> = (0..SAMPLES).map(|k| PERIOD_S * k as f64).collect();
    // What is read does not matter for the time that it takes.
    let reading =
        |tau_s: f64| -> Vec<f64> { time_s.iter().map(|t| LEVEL_C + GAS_STD_K * (9.0 * (t - tau_s)).sin()).collect() };
    let reading_c = TAU_S.map(reading);
    let folder = std::env::temp_dir().join("twinlag-bench");
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("smoother.csv");
    let columns: [(&str, &[f64]); 3] = [("time_s", &time_s), ("T1", &reading_c[0]), ("T2", &reading_c[1])];
    write_csv(&mut File::create(&file)?, &columns, Decimals::Shortest)?;

    let readings = Readings::new(time_s, reading_c)?;
    let rig = Rig::new(TAU_S.map(|tau_s| Sensor::new(tau_s, NOISE_STD_K)));
    let prior = Prior { level_c: LEVEL_C, terms: vec![Term::Rough { std_k: GAS_STD_K, corner_hz: CORNER_HZ }] };
    let mut ours_s = f64::INFINITY;
    let mut gas = reconstruct(&readings, &rig, &prior, Form::Smoother)?;
    for _ in 0..REPEATS {
        let start = Instant::now();
        gas = black_box(reconstruct(black_box(&readings), &rig, &prior, Form::Smoother)?);
        ours_s = ours_s.min(start.elapsed().as_secs_f64());
    }
    let numbers = [TAU_S[0], TAU_S[1], NOISE_STD_K, NOISE_STD_K, LEVEL_C, GAS_STD_K, CORNER_HZ].map(|n| n.to_string());
    let script = root()?.join("xtask/bench/rts_baseline.py");
    let output = Command::new("python3").arg(script).arg(&file).args(numbers).output();
    let output = output.context("python3 could not be started: the comparison needs Python with NumPy and SciPy")?;
    let why = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "the script failed (pip install numpy scipy?): {}",
        why.lines().last().unwrap_or("")
    );
    let text = String::from_utf8_lossy(&output.stdout);
    let number = |place: usize| -> Result<f64> {
        Ok(text.split_whitespace().nth(place).with_context(|| format!("another line: {text}"))?.parse()?)
    };
    let (theirs_s, mean_c, last_c) = (number(0)?, number(3)?, number(6)?);
    let own_mean_c = gas.gas_c.iter().sum::<f64>() / SAMPLES as f64;
    for (own_c, other_c) in [(own_mean_c, mean_c), (gas.gas_c[SAMPLES - 1], last_c)] {
        ensure!((own_c - other_c).abs() < MOST_APART_K, "the gas differs: {own_c} °C, NumPy's {other_c} °C");
    }
    println!(
        "the gas at {SAMPLES} samples, filter and smoother: {:.2} ms; in NumPy {:.2} s, {:.0} times as long",
        1e3 * ours_s,
        theirs_s,
        theirs_s / ours_s
    );
    Ok(())
}
