//! A process that samples itself while it does the work of a verb.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::io::{Write, sink};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use pprof::ProfilerGuardBuilder;
use rayon::ThreadPoolBuilder;
use serde::{Deserialize, Serialize};
use twinlag::record::{Decimals, Record, write_csv};
use twinlag::{CompensateOptions, DiagnoseOptions, Options, TrackOptions, characterise, compensate, diagnose, track};

use super::fold;
use crate::bench::scale::{Named, processor_s};

/// Samples a second: a prime, so that no work that repeats itself keeps step with them.
const FREQUENCY_HZ: i32 = 199;
/// Libraries whose stack cannot be followed from inside: the one that follows it, and the kernel's clock.
const BLIND: [&str; 2] = ["libgcc", "vdso"];

/// What the samples of a process say.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sampled {
    /// Times that the verb was run.
    pub(super) runs: usize,
    /// Processor time of all runs, s.
    pub(super) processor_s: f64,
    /// How often a stack was met: its frames, the outermost first, with `;` between.
    pub(super) stacks: BTreeMap<String, usize>,
}

impl Sampled {
    pub(super) fn samples(&self) -> usize {
        self.stacks.values().sum()
    }

    /// Processor time of one run, s.
    pub(super) fn run_s(&self) -> f64 {
        self.processor_s / self.runs as f64
    }

    pub(super) fn line(&self) -> String {
        let most = fold::modules(&self.stacks).into_iter().max_by(|a, b| a.own.total_cmp(&b.own));
        let most = most.map(|part| format!(", most of them ({:.0} %) in {}", 100.0 * part.own, part.name));
        let (runs, run_s, samples) = (self.runs, self.run_s(), self.samples());
        format!("{runs} runs of {run_s:.3} s, {samples} samples{}", most.unwrap_or_default())
    }
}

/// Runs a verb for at least so many seconds of processor time and says on standard output what was sampled.
pub(super) fn run(step: &Named, file: &Path, seconds: f64) -> Result<()> {
    // All on this thread: a stack that begins on another one does not say who asked for the work.
    ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    let guard = ProfilerGuardBuilder::default().frequency(FREQUENCY_HZ).blocklist(&BLIND).build()?;
    let before_s = processor_s();
    let mut sampled = Sampled::default();
    while sampled.processor_s < seconds {
        whole(step, file)?;
        sampled.runs += 1;
        sampled.processor_s = processor_s() - before_s;
    }
    for (frames, count) in guard.report().build()?.data {
        let stack = fold::stack(&frames.frames);
        *sampled.stacks.entry(stack).or_default() += usize::try_from(count)?;
    }
    ensure!(
        sampled.samples() > 0,
        "no samples: this system does not say when a process has had its share of the processor"
    );
    println!("{}", serde_json::to_string(&sampled)?);
    Ok(())
}

/// All that a command does.
fn whole(step: &Named, file: &Path) -> Result<()> {
    let record = Record::read(file, &step.selection())?;
    match step.name() {
        "read" => drop(black_box(record)),
        "characterise" => written(&characterise(&record, &Options::default())?, &[])?,
        "diagnose" => written(&diagnose(&record, &DiagnoseOptions::default())?, &[])?,
        "compensate" => {
            let answer = compensate(&record, &CompensateOptions::default())?;
            written(
                &answer,
                &[("time_s", &answer.time_s), ("gas_C", &answer.gas_c), ("gas_std_K", &answer.gas_std_k)],
            )?;
        }
        "track" => {
            let answer = track(&record, &TrackOptions::default())?;
            let [one, two] = &answer.sensors;
            let columns = [&answer.time_s, &one.tau_s, &one.low_s, &one.high_s, &two.tau_s, &two.low_s, &two.high_s];
            let names = ["time_s", "tau1_s", "tau1_low_s", "tau1_high_s", "tau2_s", "tau2_low_s", "tau2_high_s"];
            let columns: Vec<(&str, &[f64])> = names.into_iter().zip(columns.map(Vec::as_slice)).collect();
            written(&answer, &columns)?;
        }
        name => bail!("there is no verb {name}"),
    }
    Ok(())
}

/// Writes an answer and its table, to nowhere: the disk is not the program's.
fn written(answer: &impl Serialize, columns: &[(&str, &[f64])]) -> Result<()> {
    let mut out = sink();
    serde_json::to_writer(&mut out, answer).context("an answer is JSON")?;
    if !columns.is_empty() {
        write_csv(&mut out, columns, Decimals::Shortest)?;
    }
    Ok(out.flush()?)
}
