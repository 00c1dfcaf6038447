//! What can be asked on the command line, and the help that teaches it.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use twinlag::compensation::Form;
use twinlag::diagnosis::Identifier;
use twinlag::estimate::Bootstrap;
use twinlag::record::{ColumnRef, SamplingChoice, Selection};
use twinlag::{Estimator, Hold, Intervals, Known, NoiseColour, Options, optimise::Optimiser};

use crate::failure::Failure;
use crate::study::Study;

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
What the model lacks:    twinlag diagnose run.csv --report run.html
The gas temperature:     twinlag compensate run.csv --out gas.csv
In changing flow:        twinlag track run.csv --out tau.csv
For a script:            twinlag characterise run.csv --json

Exit codes: 0 answered, 2 wrong usage, 3 the file cannot be used, 4 the data cannot answer, 75 try again (a shard of a
study is missing), 1 anything else."
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

impl Talk {
    /// A line on standard error, unless the program is to be quiet.
    pub(crate) fn say(self, text: impl FnOnce() -> String) {
        if !self.quiet {
            eprintln!("{}", text());
        }
    }
}

impl Arguments {
    pub(crate) fn talk(&self) -> Talk {
        Talk { json: self.json, quiet: self.quiet }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Both time constants of a record, with intervals, noise levels and residual tests.
    Characterise(Box<Characterise>),
    /// The closed loop: what two first-order lags leave over, which physical effect accounts for it, and the error before and
    /// after it is in the model.
    Diagnose(Box<Diagnose>),
    /// The gas temperature at every sample, with its standard deviation.
    Compensate(Box<Compensate>),
    /// Both time constants along the record, in flow that changes, with bands.
    Track(Box<Track>),
    /// A record from a described rig: gas, sensors, noise, converter.
    Simulate(Simulate),
    /// Monte-Carlo studies of estimators, described by a plan: run, in shards if need be, and merge.
    #[command(subcommand)]
    Study(Study),
    /// Simulates an embedded rig with an effect that the estimator is not told of, and diagnoses it: no file needed.
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

Thermometers rarely agree at rest: if the model is rejected, try --free gain,offset first, then --second-order T1,T2. A
data-sheet value of one sensor often decides: --known T1.time_constant_s=0.5+-0.05. If the gas rests for a while, say when:
--quiet-segment 0..2.5.

Exit codes: 0 status ok, 4 any other status, 2 wrong usage, 3 the file cannot be used, 1 anything else.")]
pub(crate) struct Characterise {
    #[command(flatten)]
    pub(crate) input: Input,
    /// A model that `twinlag diagnose --save` wrote: its effects stay as they are, the time constants are fitted.
    #[arg(long, value_name = "JSON")]
    pub(crate) model: Option<PathBuf>,
}

/// What two first-order lags leave over, and why.
#[derive(Debug, Args)]
#[command(after_help = "\
What the verdict says:
  adequate          two first-order lags leave nothing but noise
  explained         with the effects that are named, nothing but noise is left
  partly-explained  the effects that are named explain a part, something else is left
  unexplained       something is left that no known effect accounts for
  refused           the record cannot be diagnosed, such as one with a single tone

An effect is named if it explains the residual whatever the colour of the noise, on blocks of the record that were left out of
the fit as well; errors before and after are those of other blocks, which neither chose the effects nor were fitted. Effects that
explain the record as well are named as alternatives.

Exit codes: 0 diagnosed, 4 refused, 2 wrong usage, 3 the file cannot be used, 1 anything else.")]
pub(crate) struct Diagnose {
    #[command(flatten)]
    pub(crate) input: Input,
    /// Writes a report to look at: one HTML file that needs nothing else.
    #[arg(long, value_name = "HTML")]
    pub(crate) report: Option<PathBuf>,
    /// Writes the model with its effects, for `twinlag characterise --model`.
    #[arg(long, value_name = "JSON")]
    pub(crate) save: Option<PathBuf>,
    /// An effect that is not to be considered; may be given several times.
    #[arg(long, value_name = "EFFECT")]
    pub(crate) without: Vec<Identifier>,
    /// Overwrite outputs that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// The gas temperature of a record.
#[derive(Debug, Args)]
#[command(after_help = "\
OUT.csv has the columns time_s, gas_C and gas_std_K: at every sample, and at those that are missing in an even grid. The standard
deviation is of noise, of what the readings cannot say at high frequencies, and of the uncertainty of the model's parameters.

The model is the one that `twinlag diagnose` finds, or that of --model. Of the gas it is taken that it goes on as it has done:
how much it moves, and how fast, is found from the readings. The bandwidth that is printed says up to which frequency they decide.

Exit codes: 0 compensated, 4 the record does not determine the time constants, 2 wrong usage, 3 the file cannot be used,
1 anything else.")]
pub(crate) struct Compensate {
    #[command(flatten)]
    pub(crate) input: Input,
    /// Where the gas temperature goes; `-` is standard output.
    #[arg(long, value_name = "CSV")]
    pub(crate) out: PathBuf,
    /// Draws readings, gas temperature with its band, and spectra: one SVG.
    #[arg(long, value_name = "SVG")]
    pub(crate) picture: Option<PathBuf>,
    /// Writes a report to look at: one HTML file that needs nothing else.
    #[arg(long, value_name = "HTML")]
    pub(crate) report: Option<PathBuf>,
    /// A model that `twinlag diagnose --save` wrote, instead of a diagnosis of this record: its effects stay as they are.
    #[arg(long, value_name = "JSON")]
    pub(crate) model: Option<PathBuf>,
    /// What the answer for an instant may rest on: smoother (the whole record), filter (what was read by then), or lag:N (that and N
    /// samples more).
    #[arg(long, value_name = "FORM", default_value = "smoother", value_parser = form)]
    pub(crate) form: Form,
    /// The channel that is right where gain, offset or delay differ: no record of two sensors tells.
    #[arg(long, value_name = "CHANNEL", default_value = "T1", ignore_case = true)]
    pub(crate) trust: Trust,
    /// An effect that is not to be considered; may be given several times.
    #[arg(long, value_name = "EFFECT")]
    pub(crate) without: Vec<Identifier>,
    /// Overwrite outputs that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// Time constants along a record.
#[derive(Debug, Args)]
#[command(after_help = "\
OUT.csv has the columns time_s, tau1_s, tau1_low_s, tau1_high_s, tau2_s, tau2_low_s and tau2_high_s: each time constant with its
pointwise 95 % band. Both change by the same share, as they do in flow that changes: as a smooth function of time with as many
coefficients as the record supports, in one step, or not at all, whichever Schwarz's criterion prefers. Whether their ratio stays is
tested.

With --window each window is characterised by itself, the published way: wider bands, and nothing is shared.

With --live rows are answered as they come, from a pipe that need not end: logger | twinlag track - --live 2000 --out -
The first rows are waited for, and tell what sensors, noise and gas are like; then each row gives the gas temperature, its standard
deviation and both time constants with their bands, from what was read by then: time_s, gas_C, gas_std_K, tau1_s, tau1_low_s, ...

Exit codes: 0 tracked, 4 the record does not determine the time constants, 2 wrong usage, 3 the file cannot be used,
1 anything else.")]
pub(crate) struct Track {
    #[command(flatten)]
    pub(crate) input: Input,
    /// Where the time constants go; `-` is standard output.
    #[arg(long, value_name = "CSV")]
    pub(crate) out: PathBuf,
    /// Draws both time constants with their bands: one SVG.
    #[arg(long, value_name = "SVG")]
    pub(crate) picture: Option<PathBuf>,
    /// Writes a report to look at: one HTML file that needs nothing else.
    #[arg(long, value_name = "HTML")]
    pub(crate) report: Option<PathBuf>,
    /// A model that `twinlag diagnose --save` wrote: its other effects stay as they are.
    #[arg(long, value_name = "JSON")]
    pub(crate) model: Option<PathBuf>,
    /// Length of a sliding window.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) window: Option<f64>,
    /// Answers rows as they come, once so many have.
    #[arg(long, value_name = "ROWS", conflicts_with_all = ["window", "picture", "report"], value_parser = clap::value_parser!(u32).range(200..))]
    pub(crate) live: Option<u32>,
    /// With --live: by what share the time constants may change in a second (standard deviation; it grows as the root of time) [default:
    /// a tenth in ten time constants of the slower sensor].
    #[arg(long, value_name = "SHARE", requires = "live")]
    pub(crate) change: Option<f64>,
    /// Overwrite outputs that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// One of the two channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Trust {
    #[value(name = "T1")]
    T1,
    #[value(name = "T2")]
    T2,
}

fn form(text: &str) -> Result<Form, String> {
    match (text, text.strip_prefix("lag:").map(str::parse)) {
        ("smoother", _) => Ok(Form::Smoother),
        ("filter", _) => Ok(Form::Filter),
        (_, Some(Ok(samples))) => Ok(Form::FixedLag(samples)),
        _ => Err("expected smoother, filter, or lag:N with a whole number of samples N".into()),
    }
}

/// The record, and how it is asked.
#[derive(Debug, Args)]
pub(crate) struct Input {
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
    /// A flow velocity or density, in any unit: `diagnose` tries time constants that go with a power of it.
    #[arg(long, value_name = "COL")]
    flow: Option<ColumnRef>,
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
            flow: self.flow.clone(),
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
    #[arg(long, value_name = "S1,S2", value_parser = pair, allow_hyphen_values = true, help_heading = "Noise")]
    noise: Option<Pair>,
    /// Ratio S2/S1 of the noise levels, where only that is known.
    #[arg(long, value_name = "R", allow_hyphen_values = true, help_heading = "Noise")]
    noise_ratio: Option<f64>,
    /// A stretch in which the gas is at rest, in seconds from the start: noise is taken from its scatter. May be given several
    /// times.
    #[arg(long, value_name = "FROM..TO", value_parser = stretch, allow_hyphen_values = true, help_heading = "Noise")]
    quiet_segment: Vec<Stretch>,
    /// What noise is like where it is found: white, or autoregressive (each sample carries a share of the last one's).
    #[arg(long, value_name = "KIND", default_value = "white", help_heading = "Noise")]
    noise_colour: NoiseColour,
    /// whitened, cross-relation, bias-compensated, normalised, hybrid, difference-equation-ls, difference-equation-tls or
    /// difference-equation-gtls.
    #[arg(long, value_name = "NAME", default_value = "whitened")]
    estimator: Estimator,
    #[arg(long, value_name = "NAME", default_value = "levenberg-marquardt", help = optimisers())]
    optimiser: String,
    /// Relative calibration of channel 2 to fit as well: gain, offset or gain,offset.
    #[arg(long, value_name = "LIST")]
    free: Option<String>,
    /// Sensors with a second lag in series, to fit as well: T1, T2 or T1,T2.
    #[arg(long, value_name = "LIST")]
    second_order: Option<String>,
    /// A parameter known beforehand, exactly or with a standard deviation; may be given once for each of
    /// `T1.time_constant_s`, `T2.time_constant_s`, `T2.gain`, `T2.offset_K`, `T1.second_time_constant_s`,
    /// `T2.second_time_constant_s`.
    #[arg(long, value_name = "NAME=VALUE[+-SD]", allow_hyphen_values = true)]
    known: Vec<Known>,
    /// Samples that the cross-relation, bias-compensated, normalised and hybrid estimators leave out at the start of each
    /// unbroken stretch.
    #[arg(long, value_name = "K0")]
    discard: Option<usize>,
    /// What the gas does between samples: auto, zero-order-hold, first-order-hold or bilinear.
    #[arg(long, value_name = "HOW", default_value = "auto")]
    hold: Hold,
    /// What 95 % intervals are made of: auto (standard errors, or the profile of the cost where these do not describe it),
    /// profile, or bootstrap (the same estimator on simulated records).
    #[arg(long, value_name = "HOW", default_value = "auto", value_parser = ["auto", "profile", "bootstrap"])]
    intervals: String,
    /// Simulated records of the bootstrap, at least 39 [default: 199].
    #[arg(long, value_name = "N")]
    replicates: Option<usize>,
    /// Seed of the bootstrap [default: 1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

fn optimisers() -> String {
    let names: Vec<&str> = Optimiser::names().collect();
    format!("One of {}", names.join(", "))
}

/// A stretch of time, in a type of its own for the same reason as [`Pair`].
#[derive(Clone, Copy, Debug)]
struct Stretch([f64; 2]);

fn stretch(text: &str) -> Result<Stretch, String> {
    let wrong = || format!("expected FROM..TO in seconds from the start, FROM the smaller, got '{text}'");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|s| s.is_finite()).ok_or_else(wrong);
    let (from_s, to_s) = (number(from)?, number(to)?);
    if from_s < to_s { Ok(Stretch([from_s, to_s])) } else { Err(wrong()) }
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
            noise_ratio: self.noise_ratio,
            quiet_segments_s: self.quiet_segment.iter().map(|s| s.0).collect(),
            noise_colour: self.noise_colour,
            known: self.known.clone(),
            discard: self.discard,
            intervals: self.intervals()?,
            ..Options::default()
        };
        let options = options.free(self.free.as_deref().unwrap_or(""))?;
        Ok(options.second_order(self.second_order.as_deref().unwrap_or(""))?)
    }

    fn intervals(&self) -> Result<Intervals, Failure> {
        let needs_bootstrap = |option: &str| {
            Err(Failure::Usage(format!(
                "{option} belongs to the bootstrap: add --intervals bootstrap, or leave it out"
            )))
        };
        match (self.intervals.as_str(), self.replicates, self.seed) {
            ("bootstrap", replicates, seed) => {
                let usual = Bootstrap::default();
                Ok(Intervals::Bootstrap(Bootstrap {
                    replicates: replicates.unwrap_or(usual.replicates),
                    seed: seed.unwrap_or(usual.seed),
                }))
            }
            (_, Some(_), _) => needs_bootstrap("--replicates"),
            (_, _, Some(_)) => needs_bootstrap("--seed"),
            ("profile", ..) => Ok(Intervals::Profile),
            _ => Ok(Intervals::Auto),
        }
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
#[command(after_help = "Exit codes: 0 diagnosed, 4 refused, 1 anything else.")]
pub(crate) struct Demo {
    /// Seed of all random numbers, in place of the rig's own.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
}
