//! What can be asked on the command line, and the help that teaches it.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use twinlag::record::{ColumnRef, SamplingChoice, Selection};
use twinlag::{Estimator, Hold, Known, Options, optimise::Optimiser};

use crate::failure::Failure;

/// Tells two temperature sensors' dynamics from their readings alone.
///
/// Two thermocouples of different thickness in the same gas lag differently. From how they disagree twinlag finds the time
/// constant of each, without knowing the gas temperature, with intervals that account for the noise it finds.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "\
Try it without a file:   twinlag demo
On a logger file:        twinlag characterise run.csv
With named columns:      twinlag characterise run.csv --t1 'fine [°C]' --t2 'coarse [°C]'
For a script:            twinlag characterise run.csv --json

Exit codes: 0 answered, 2 wrong usage, 3 the file cannot be used, 4 the data cannot answer, 1 anything else."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON object to standard output instead of text.
    #[arg(long, global = true)]
    json: bool,
    /// No notes and no progress on standard error; errors are still printed.
    #[arg(long, global = true)]
    quiet: bool,
}

/// How the program talks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Talk {
    pub(crate) json: bool,
    pub(crate) quiet: bool,
}

impl Arguments {
    pub(crate) fn talk(&self) -> Talk {
        Talk { json: self.json, quiet: self.quiet }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Both time constants of a record, with intervals, noise levels and residual tests.
    Characterise(Characterise),
    /// A record from a described rig: gas, sensors, noise, converter.
    Simulate(Simulate),
    /// Simulates an embedded rig and characterises it: no file needed.
    Demo(Demo),
}

/// Both time constants of a record.
#[derive(Debug, Args)]
#[command(after_help = "\
The file: delimited text as loggers write it (comma, semicolon, tab; decimal comma; units in the header; comments; ISO or
numeric time; gaps and missing values). Columns are guessed from the header, and the guess is printed.

What the status says:
  ok                 both time constants are determined and only noise is left over
  not-identifiable   the record does not tell both; the difference may still be known
  at-bound           the best fit lies on a bound: no estimate
  model-rejected     more than noise is left over: two first-order lags do not explain the record

Thermometers rarely agree at rest: if the model is rejected, try --free gain,offset first. A data-sheet value of one sensor
often decides: --known T1.time_constant_s=0.5+-0.05.

Exit codes: 0 status ok, 4 any other status, 2 wrong usage, 3 the file cannot be used, 1 anything else.")]
pub(crate) struct Characterise {
    /// The record; `-` reads standard input.
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) columns: Columns,
    #[command(flatten)]
    pub(crate) method: Method,
}

/// Which columns, and how time is meant.
#[derive(Debug, Args)]
#[command(next_help_heading = "Columns")]
pub(crate) struct Columns {
    /// Time column: name, or number from 1.
    #[arg(long, value_name = "COL")]
    time: Option<ColumnRef>,
    /// First sensor: name, or number from 1.
    #[arg(long, value_name = "COL")]
    t1: Option<ColumnRef>,
    /// Second sensor: name, or number from 1.
    #[arg(long, value_name = "COL")]
    t2: Option<ColumnRef>,
    /// A trusted temperature, for scoring only: no estimate uses it.
    #[arg(long, value_name = "COL")]
    reference: Option<ColumnRef>,
    /// Time from row to row, for files without a time column; a guessed time column is then not used.
    #[arg(long, value_name = "SECONDS")]
    period: Option<f64>,
    /// How time stamps are meant: auto, uniform (evenly spaced whatever they say), as-stamped.
    #[arg(long, value_name = "HOW", default_value = "auto", value_parser = sampling)]
    sampling: SamplingChoice,
}

fn sampling(text: &str) -> Result<SamplingChoice, String> {
    match text {
        "auto" => Ok(SamplingChoice::Auto),
        "uniform" => Ok(SamplingChoice::Uniform),
        "as-stamped" => Ok(SamplingChoice::AsStamped),
        _ => Err("expected auto, uniform or as-stamped".into()),
    }
}

impl Columns {
    pub(crate) fn selection(&self) -> Selection {
        Selection {
            time: self.time.clone(),
            t1: self.t1.clone(),
            t2: self.t2.clone(),
            reference: self.reference.clone(),
            period_s: self.period,
            sampling: self.sampling,
        }
    }
}

/// How to estimate.
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub(crate) struct Method {
    /// Noise standard deviations of the two channels in K, both positive; found from the data if left out.
    #[arg(long, value_name = "S1,S2", value_parser = pair, allow_hyphen_values = true)]
    noise: Option<Pair>,
    /// whitened, cross-relation, bias-compensated or normalised.
    #[arg(long, value_name = "NAME", default_value = "whitened")]
    estimator: Estimator,
    /// levenberg-marquardt, nelder-mead or l-bfgs.
    #[arg(long, value_name = "NAME", default_value = "levenberg-marquardt")]
    optimiser: String,
    /// Relative calibration of channel 2 to fit as well: gain, offset or gain,offset.
    #[arg(long, value_name = "LIST")]
    free: Option<String>,
    /// A parameter known beforehand, exactly or with a standard deviation; may be given once for each of
    /// `T1.time_constant_s`, `T2.time_constant_s`, `T2.gain`, `T2.offset_K`.
    #[arg(long, value_name = "NAME=VALUE[+-SD]", allow_hyphen_values = true)]
    known: Vec<Known>,
    /// Samples that the estimators other than whitened leave out at the start of each unbroken stretch.
    #[arg(long, value_name = "K0")]
    discard: Option<usize>,
    /// What the gas does between samples: auto, zero-order-hold, first-order-hold or bilinear.
    #[arg(long, value_name = "HOW", default_value = "auto")]
    hold: Hold,
}

/// Two numbers, in a type of their own: a list would mean an option given twice.
#[derive(Clone, Copy, Debug)]
struct Pair([f64; 2]);

fn pair(text: &str) -> Result<Pair, String> {
    let wrong = || format!("expected two positive numbers S1,S2 in K, got '{text}'");
    let numbers: Vec<f64> = text.split(',').map(|s| s.trim().parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    match numbers[..] {
        [a, b] if a.is_finite() && b.is_finite() && a > 0.0 && b > 0.0 => Ok(Pair([a, b])),
        _ => Err(wrong()),
    }
}

impl Method {
    pub(crate) fn options(&self) -> Result<Options, Failure> {
        let options = Options {
            estimator: self.estimator,
            optimiser: Optimiser::by_name(&self.optimiser).map_err(twinlag::Error::from)?,
            hold: self.hold,
            noise_std_k: self.noise.map(|pair| pair.0),
            known: self.known.clone(),
            discard: self.discard,
            ..Options::default()
        };
        Ok(options.free(self.free.as_deref().unwrap_or(""))?)
    }
}

/// A record from a described rig.
#[derive(Debug, Args)]
#[command(after_help = "\
A rig, in TOML:

  seed = 1
  [record]
  samples = 2500
  sample_period_s = 0.002
  [gas]                          # sine, multi-tone, engine, turbulence, plunge, broadband or series
  kind = \"engine\"
  mean_c = 450.0
  amplitude_k = 60.0
  frequency_hz = 20.0
  [[sensors]]
  channel = \"T1\"
  time_constant_s = 0.0238
  noise = { std_k = 0.5 }
  [[sensors]]
  channel = \"T2\"
  time_constant_s = 0.1168
  noise = { std_k = 0.5 }

The record has the columns time_s,T1,T2,Tref; Tref is the true gas temperature, for scoring.

Exit codes: 0 written, 2 wrong usage, 3 the rig cannot be used, 1 anything else.")]
pub(crate) struct Simulate {
    /// The rig.
    pub(crate) spec: PathBuf,
    /// The record to write; `-` writes standard output.
    #[arg(long, value_name = "CSV")]
    pub(crate) out: PathBuf,
    /// Seed of all random numbers, in place of the rig's own.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Overwrite the output if it exists.
    #[arg(long)]
    pub(crate) force: bool,
}

/// The embedded rig.
#[derive(Debug, Args)]
#[command(after_help = "Exit codes: 0 status ok, 4 any other status, 1 anything else.")]
pub(crate) struct Demo {
    /// Seed of all random numbers, in place of the rig's own.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
}
