//! How fast the causal filter takes readings, whether it says what the filter of a whole record does, and that its memory stays.

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result};
use twinlag::compensation::{Form, Prior, Readings, Rig, Sensor, Stream, Term, reconstruct};
use twinlag::signal::{Gas, Noise, Record, Rig as Simulation, Sensor as Simulated, Signal, Turbulence};

use super::peak_memory;

const PERIOD_S: f64 = 0.002;
const LEVEL_C: f64 = 300.0;
const TAU_S: [f64; 2] = [0.024, 0.117];
const NOISE_STD_K: f64 = 0.2;
/// Samples of a simulated block; two blocks in turn are the readings of any length.
const BLOCK: usize = 20_000;
const SAMPLES: usize = 100_000_000;
/// The best of so many is the rate: the machine may have other work.
const REPETITIONS: usize = 7;
/// Blocks of a repetition, with gains that have settled and with gains that are found anew.
const BLOCKS: [usize; 2] = [50, 2];

type Block = [Vec<f64>; 2];

pub(super) fn run() -> Result<()> {
    let blocks = [block(1)?, block(2)?];
    constant_memory(&blocks)?;
    println!(
        "sample pairs per second on one core, the best of {REPETITIONS} repetitions, since the machine may have other work:"
    );
    rate::<4>(&blocks)?;
    rate::<6>(&blocks)?;
    rate::<8>(&blocks)?;
    rate::<12>(&blocks)?;
    rate::<24>(&blocks)?;
    println!("largest difference from the filter of the whole record, {BLOCK} samples:");
    difference::<4>(&blocks[0])?;
    difference::<6>(&blocks[0])?;
    difference::<8>(&blocks[0])?;
    difference::<12>(&blocks[0])?;
    difference::<24>(&blocks[0])
}

/// Readings of the two sensors in turbulent gas.
fn block(seed: u64) -> Result<Block> {
    let sensors = [0, 1].map(|i| {
        let mut sensor = Simulated::new(format!("T{}", i + 1), TAU_S[i]);
        sensor.noise = Some(Noise::white(NOISE_STD_K));
        sensor
    });
    let signal = Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 3.0, cutoff_hz: 100.0 });
    let record = Simulation::new(seed, Record::new(BLOCK, PERIOD_S), Gas::new(LEVEL_C, signal), sensors)?.simulate()?;
    Ok([record.t1_c, record.t2_c])
}

fn rig() -> Rig {
    Rig::new(TAU_S.map(|tau_s| Sensor::new(tau_s, NOISE_STD_K)))
}

/// A rough gas, with as many resonances as fill `states`.
fn terms(states: usize) -> Vec<Term> {
    let mut terms = vec![Term::Rough { std_k: 15.0, corner_hz: 3.0 }];
    let mut frequency_hz = 5.0;
    while Stream::<24>::states(&rig(), &terms) + 2 <= states {
        terms.push(Term::Resonance { std_k: 3.0, frequency_hz, quality: 5.0 });
        frequency_hz += 7.0;
    }
    terms
}

fn stream<const D: usize>() -> Result<Stream<D>> {
    Stream::new(&rig(), LEVEL_C, &terms(D), PERIOD_S).context("the states are enough")
}

/// Pushes so many samples and says what the memory is at each tenth.
fn constant_memory(blocks: &[Block; 2]) -> Result<()> {
    let mut stream = stream::<4>()?;
    println!("a filter of 4 states is {} bytes; peak memory of the process {}", size_of_val(&stream), peak_memory());
    let readings = blocks.iter().flat_map(|[y1, y2]| y1.iter().zip(y2)).cycle().take(SAMPLES);
    let start = Instant::now();
    for (k, (y1, y2)) in readings.enumerate() {
        black_box(stream.push([Some(*y1), Some(*y2)]));
        if (k + 1) % (SAMPLES / 10) == 0 {
            println!("{} samples, {:.1} s, peak memory {}", k + 1, start.elapsed().as_secs_f64(), peak_memory());
        }
    }
    Ok(())
}

fn rate<const D: usize>(blocks: &[Block; 2]) -> Result<()> {
    let mut stream = stream::<D>()?;
    let settles = (1..=BLOCK).find(|k| {
        stream.push([0, 1].map(|i: usize| Some(blocks[0][i][k - 1])));
        stream.is_settled()
    });
    let settles = settles.with_context(|| format!("gains of {D} states do not settle in {BLOCK} samples"))?;
    // A reading of the slower sensor is missing at every second instant: gains never settle.
    let [settled, anew] = [false, true].map(|is_gappy| {
        let count = BLOCKS[usize::from(is_gappy)];
        let once = |stream: &mut Stream<D>| {
            let start = Instant::now();
            for [y1, y2] in blocks.iter().cycle().take(count) {
                for (k, (y1, y2)) in y1.iter().zip(y2).enumerate() {
                    black_box(stream.push([Some(*y1), (!is_gappy || k % 2 == 0).then_some(*y2)]));
                }
            }
            (count * BLOCK) as f64 / start.elapsed().as_secs_f64()
        };
        (0..REPETITIONS).map(|_| once(&mut stream)).fold(0.0, f64::max)
    });
    println!(
        "{D:2} states ({:2} terms): {settled:9.2e} with gains that have settled, after {settles} samples; {anew:9.2e} with gains found \
         anew, every second reading of one sensor missing",
        terms(D).len()
    );
    Ok(())
}

fn difference<const D: usize>(block: &Block) -> Result<()> {
    let time_s = (0..BLOCK).map(|k| k as f64 * PERIOD_S).collect();
    let prior = Prior { level_c: LEVEL_C, terms: terms(D) };
    let whole = reconstruct(&Readings::new(time_s, block.clone())?, &rig(), &prior, Form::Filter)?;
    let mut stream = stream::<D>()?;
    let (mut gas_k, mut std_k) = (0.0_f64, 0.0_f64);
    for k in 0..BLOCK {
        let now = stream.push([0, 1].map(|i: usize| Some(block[i][k])));
        gas_k = gas_k.max((now.gas_c - whole.gas_c[k]).abs());
        std_k = std_k.max((now.variance_k2.sqrt() - whole.std_k[k]).abs());
    }
    println!("{D:2} states: {gas_k:.1e} K in the gas temperature, {std_k:.1e} K in its standard deviation");
    Ok(())
}
