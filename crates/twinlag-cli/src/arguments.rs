//! The command-line arguments and their help texts.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use twinlag::compensation::Form;
use twinlag::convection::Flow;
use twinlag::diagnosis::Identifier;
use twinlag::estimate::Bootstrap;
use twinlag::record::{ColumnRef, Record, SAMPLE_PERIODS_S, SamplingChoice, Selection, Unit};
use twinlag::{
    Estimator, Hold, Intervals, Known, NoiseColour, Options, Plausibility, TypicalSensor, optimise::Optimiser,
};

use crate::batch::Batch;
use crate::console::Console;
use crate::failure::Failure;
use crate::profile::Profile;
use crate::schema;
use crate::study::Study;

/// Identifies the dynamics of two temperature sensors from their readings alone.
///
/// Two thermocouples of different thickness in the same gas lag differently. From how their
/// readings differ, twinlag estimates the time constant of each without knowing the gas
/// temperature. The confidence intervals account for the noise in the readings.
#[derive(Debug, Parser)]
#[command(
    name = "twinlag",
    version = env!("TWINLAG_VERSION"),
    after_help = "\
Try it without a file:    twinlag demo
See how a file is read:   twinlag inspect run.csv
Analyse a logger file:    twinlag characterise run.csv
Name the columns:         twinlag characterise run.csv --t1 'fine [°C]' --t2 'coarse [°C]'
Find missing effects:     twinlag diagnose run.csv --report run.html
What a name means:        twinlag explain two-sensors
Get the gas temperature:  twinlag compensate run.csv --out gas.csv
Follow changing flow:     twinlag track run.csv --out tau.csv
Many files, one table:    twinlag batch runs/ --out table.csv
Plan the next record:     twinlag plan rig.toml
Use it in a script:       twinlag characterise run.csv --json
Keep options in a file:   twinlag diagnose run.csv --config lab.toml

Exit codes: 0 answered, 2 wrong usage, 3 the file cannot be used, 4 the data cannot answer the question,
75 try again (a shard of a study is missing), 1 any other error."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON object to standard output instead of text.
    #[arg(long, global = true)]
    json: bool,
    /// Print no notes and no progress on standard error; errors are still printed.
    #[arg(long, global = true)]
    quiet: bool,
    /// Take options from this file where the command line does not give them.
    #[arg(long, global = true, value_name = "TOML")]
    config: Option<PathBuf>,
}

impl Arguments {
    pub(crate) fn console(&self) -> Console {
        Console { json: self.json, quiet: self.quiet }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Estimate both time constants of a record, with intervals, noise levels and residual tests.
    #[command(visible_alias = "characterize")]
    Characterise(Box<Characterise>),
    /// Find the physical effects that two first-order lags fail to describe, add them to the model,
    /// and compare the errors before and after.
    Diagnose(Box<Diagnose>),
    /// Reconstruct the gas temperature at every sample, with its standard deviation.
    Compensate(Box<Compensate>),
    /// Follow both time constants along a record taken in changing flow, with confidence bands.
    Track(Box<Track>),
    /// Simulate a record from the description of a rig: gas, sensors, noise, converter.
    Simulate(Simulate),
    /// Show what is in a file and how it would be read, and save that as a profile for files like it.
    Inspect(Box<Inspect>),
    /// Ask the same of many records on all processors: one table, files that cannot be used as rows.
    Batch(Box<Batch>),
    /// Say what the next record would have to be for narrower intervals, or to distinguish two effects, from a rig or a diagnosis.
    Plan(Plan),
    /// Run a Monte-Carlo study of estimators from a plan, in shards if need be, and merge the
    /// results.
    #[command(subcommand)]
    Study(Study),
    /// Explain an effect, one of its numbers, a verdict, a status, a grade or a test in plain words, or what two sensors can never reveal.
    Explain(Explain),
    /// Simulate a built-in rig with an effect unknown to the estimator, and diagnose it; needs no
    /// file.
    Demo(Demo),
    /// Print a script with which a shell completes commands and options.
    #[command(after_help = "\
bash:        twinlag completions bash > ~/.local/share/bash-completion/completions/twinlag
zsh:         twinlag completions zsh > a file _twinlag in a folder of $fpath
fish:        twinlag completions fish > ~/.config/fish/completions/twinlag.fish
PowerShell:  twinlag completions powershell >> $PROFILE")]
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Print the JSON Schema of an answer.
    Schema {
        /// Which answer.
        name: schema::Name,
    },
    /// Write the manual as pages for `man`, one for each command.
    Man {
        /// The folder for the pages, created if necessary.
        #[arg(long, value_name = "FOLDER")]
        out: PathBuf,
    },
}

/// Estimate both time constants of a record, or of several of one rig.
#[derive(Debug, Args)]
#[command(after_help = "\
FILE is text as loggers write it (comma, semicolon or tab; decimal comma; units in the header; comments; ISO or numeric time;
gaps and missing values), or the file of a measurement program (MDF, TDMS, xlsx, Parquet, HDF5, netCDF, MATLAB, NumPy); `-` is
standard input. Columns are guessed from the header, and the guess is printed.

Status:
  ok                 both time constants are determined, and the residual is consistent with noise
  not-identifiable   the record does not determine both; it may still determine their difference
  at-bound           the best fit lies on a bound, so it is not an estimate
  model-rejected     the residual is more than noise: two first-order lags do not explain the record

Two thermometers rarely agree at rest. If the model is rejected, try --free gain,offset first, then --second-order T1,T2.
A data-sheet value for one sensor often settles the rest: --known T1=0.5s+-10%. If the gas temperature is
steady for a while, say when: --quiet-segment 0..2.5.

Exit codes: 0 status ok and both time constants given, 4 otherwise (with --strict also where one of them or their difference is conditional), 2 wrong usage, 3 the file cannot be used, 1 any other error.")]
pub(crate) struct Characterise {
    #[command(flatten)]
    pub(crate) input: Input,
    #[command(flatten)]
    pub(crate) physics: Physics,
    /// More records of the same rig: one pair of time constants for all of them.
    #[arg(value_name = "MORE")]
    pub(crate) more: Vec<PathBuf>,
    /// Use a model written by `twinlag diagnose --save`: its effects stay fixed and only the time
    /// constants are fitted, except on its own record, where all are.
    #[arg(long, value_name = "JSON")]
    pub(crate) model: Option<PathBuf>,
}

/// Find which physical effects two first-order lags fail to describe.
#[derive(Debug, Args)]
#[command(after_help = "\
Verdict:
  adequate          two first-order lags leave only noise in the residual
  explained         with the effects that are named, only noise is left
  partly-explained  the effects that are named explain part of the residual; or only noise is left, but they are not known to be the
                    cause, as where records that had no part in finding them contradict them
  unexplained       more than noise is left, and no known effect explains it
  refused           the record cannot be diagnosed, for example because the gas has a single tone

An effect is named if it explains the residual whatever the colour of the noise, and also on blocks of the record that were
left out of the fit. The errors before and after are measured on other blocks, used neither to choose effects nor to fit.
Other effects that explain the record equally well are named as alternatives.

Grade of each number:
  go                may be used, with its interval
  conditional       right if the assumption holds that is printed with it
  not given         no-go: nothing says how far it may be off (--best-effort prints it all the same)

A time constant that is known exactly (--known T1=0.5s) counts as go. What is found with it is conditional at best, so the
exit code is 0, and 4 with --strict; where the record contradicts it nothing is given, and the exit code is 4.

Exit codes: 0 diagnosed, 4 the record was refused, a time constant is not given, or something is left over and a number is
not go (with --strict also where a number is conditional), 2 wrong usage, 3 the file cannot be used, 1 any other error.")]
pub(crate) struct Diagnose {
    #[command(flatten)]
    pub(crate) input: Input,
    #[command(flatten)]
    pub(crate) physics: Physics,
    /// More records of the same rig: one model for all of them, each record left out in turn to see what the model is worth on it.
    #[arg(value_name = "MORE")]
    pub(crate) more: Vec<PathBuf>,
    /// Write a report with pictures, as one self-contained HTML file.
    #[arg(long, value_name = "HTML")]
    pub(crate) report: Option<PathBuf>,
    /// With --report: without a script, for print and mail; traces cannot be enlarged then.
    #[arg(long = "static", requires = "report")]
    pub(crate) is_static: bool,
    /// Save the model with its effects, for `--model` of other commands.
    #[arg(long, value_name = "JSON")]
    pub(crate) save: Option<PathBuf>,
    /// Leave this effect out; separate several by commas, or repeat the option.
    #[arg(long, value_name = "EFFECT", value_delimiter = ',')]
    pub(crate) without: Vec<Identifier>,
    /// Overwrite output files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// Reconstruct the gas temperature of a record.
#[derive(Debug, Args)]
#[command(after_help = "\
The output has the columns time_s, gas_C, gas_std_K and grade, then the dates and times of the file and what --keep names, with a
row for every sample and, on an even grid, for every missing one. The standard deviation covers the noise, the high frequencies that the readings do not determine, and the uncertainty
of the model's parameters.

The model is the one that `twinlag diagnose` finds, or the one given with --model. The gas is assumed to keep fluctuating as
it did in the record; how strongly and how fast is estimated. Up to the printed bandwidth the readings determine the answer;
above it, that assumption does.

Exit codes: 0 compensated, 4 the record does not determine the time constants, 2 wrong usage, 3 the file cannot be used,
1 any other error.")]
pub(crate) struct Compensate {
    #[command(flatten)]
    pub(crate) input: Input,
    #[command(flatten)]
    pub(crate) physics: Physics,
    /// Write the gas temperature to this file; `-` is standard output.
    #[arg(long, value_name = "CSV")]
    pub(crate) out: PathBuf,
    /// Write this column of the file as well, as it is; `all` for every one that is not read. Dates and times are kept in any case.
    #[arg(long, value_name = "COL", value_delimiter = ',')]
    pub(crate) keep: Vec<ColumnRef>,
    /// Draw the readings, the gas temperature with its band, and the spectra, as one SVG file.
    #[arg(long, value_name = "SVG")]
    pub(crate) picture: Option<PathBuf>,
    /// Write a report with pictures, as one self-contained HTML file.
    #[arg(long, value_name = "HTML")]
    pub(crate) report: Option<PathBuf>,
    /// With --report: without a script, for print and mail; traces cannot be enlarged then.
    #[arg(long = "static", requires = "report")]
    pub(crate) is_static: bool,
    /// Use a model written by `twinlag diagnose --save` instead of diagnosing this record; its
    /// effects stay fixed, except on its own record.
    #[arg(long, value_name = "JSON")]
    pub(crate) model: Option<PathBuf>,
    /// Save the model with what the gas is like, for `--model` with other records: the search for what
    /// their gas is like begins there.
    #[arg(long, value_name = "JSON")]
    pub(crate) save: Option<PathBuf>,
    /// Which readings each answer may use: smoother (the whole record), filter (those up to that
    /// instant), or lag:N (those and the next N samples).
    #[arg(long, value_name = "FORM", default_value = "smoother", value_parser = form)]
    pub(crate) form: Form,
    /// The channel to trust where gain, offset or delay differ; two sensors alone cannot reveal
    /// which one is right.
    #[arg(long, value_name = "CHANNEL", default_value = "T1", ignore_case = true)]
    pub(crate) trust: Trust,
    /// Do not consider this effect; may be given several times.
    #[arg(long, value_name = "EFFECT")]
    pub(crate) without: Vec<Identifier>,
    /// Overwrite output files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// Follow both time constants along a record.
#[derive(Debug, Args)]
#[command(after_help = "\
The output has the columns time_s, tau1_s, tau1_low_s, tau1_high_s, tau2_s, tau2_low_s, tau2_high_s and grade, then the dates and
times of the file and what --keep names: each time constant with its pointwise 95 % band. Both time constants are assumed to change by the same factor, as they do when the flow
changes. Schwarz's criterion (BIC) chooses among a smooth change with as many coefficients as the record supports, a single
step, and no change. Whether the ratio of the two stays constant is tested.

With --window each window is characterised separately, as in published work: the bands are wider, and nothing is shared.
Cells are empty where the readings do not determine a time constant.

With --live rows are processed as they arrive, from a pipe that need not end: logger | twinlag track - --live 2000 --out -
The program first collects that many rows and estimates sensors, noise and gas from them. It then writes for each row, using
only the rows read so far, the gas temperature with its standard deviation and both time constants with their bands:
time_s, gas_C, gas_std_K, tau1_s, tau1_low_s, ...

Exit codes: 0 tracked, 4 the record does not determine the time constants, 2 wrong usage, 3 the file cannot be used,
1 any other error.")]
pub(crate) struct Track {
    #[command(flatten)]
    pub(crate) input: Input,
    /// Write the time constants to this file; `-` is standard output.
    #[arg(long, value_name = "CSV")]
    pub(crate) out: PathBuf,
    /// Write this column of the file as well, as it is; `all` for every one that is not read. Dates and times are kept in any case.
    #[arg(long, conflicts_with = "live", value_name = "COL", value_delimiter = ',')]
    pub(crate) keep: Vec<ColumnRef>,
    /// Draw both time constants with their bands, as one SVG file.
    #[arg(long, value_name = "SVG")]
    pub(crate) picture: Option<PathBuf>,
    /// Write a report with pictures, as one self-contained HTML file.
    #[arg(long, value_name = "HTML")]
    pub(crate) report: Option<PathBuf>,
    /// With --report: without a script, for print and mail; traces cannot be enlarged then.
    #[arg(long = "static", requires = "report")]
    pub(crate) is_static: bool,
    /// Use a model written by `twinlag diagnose --save`; its effects stay fixed, except a change of
    /// the time constants, which is what is tracked.
    #[arg(long, value_name = "JSON")]
    pub(crate) model: Option<PathBuf>,
    /// Characterise sliding windows of this length instead.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) window: Option<f64>,
    /// Process rows as they arrive, after learning from this many.
    #[arg(long, value_name = "ROWS", conflicts_with_all = ["window", "picture", "report"], value_parser = clap::value_parser!(u32).range(200..))]
    pub(crate) live: Option<u32>,
    /// With --live: how far the time constants may change within one second, as a fraction
    /// (standard deviation; it grows with the square root of time) [default: 0.1 within ten time
    /// constants of the slower sensor].
    #[arg(long, value_name = "SHARE", requires = "live")]
    pub(crate) change: Option<f64>,
    /// With --live: keep in this file what is known, and go on from it where it exists: nothing is learned again, of a file the new
    /// rows are read, and rows are appended to --out.
    #[arg(long, value_name = "JSON", requires = "live")]
    pub(crate) state: Option<PathBuf>,
    /// Overwrite output files that exist.
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

pub(crate) fn form(text: &str) -> Result<Form, String> {
    match (text, text.strip_prefix("lag:").map(str::parse)) {
        ("smoother", _) => Ok(Form::Smoother),
        ("filter", _) => Ok(Form::Filter),
        (_, Some(Ok(samples))) => Ok(Form::FixedLag(samples)),
        _ => Err("expected smoother, filter, or lag:N with a whole number of samples N".into()),
    }
}

/// The record and how to analyse it.
#[derive(Debug, Args)]
pub(crate) struct Input {
    /// The logger file; `-` reads standard input.
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) columns: Columns,
    #[command(flatten)]
    pub(crate) method: Method,
}

/// What is known of the sensors' sizes and of the flow.
#[derive(Debug, Args)]
#[command(next_help_heading = "Plausibility")]
pub(crate) struct Physics {
    /// What a sensor is: `T1=thermocouple:0.5mm` or `T1=wire:50um` (a bare wire), `platinum:25um`, `bead:0.8mm`, `sheath:3mm`
    /// (mineral-insulated), or a range that holds 95 % of such time constants, `T1=0.2..0.6s`. A time constant outside of what is
    /// expected is named with what it would take; one that the record does not determine is taken to be as expected. May be given
    /// once for each sensor.
    #[arg(long, value_name = "T1=KIND:SIZE")]
    sensor: Vec<TypicalSensor>,
    /// What flows around sensors of a given size, and how fast: air@20m/s, water@0.5m/s; after commas temperature and pressure
    /// where they are not those of the readings and one atmosphere (air@20m/s,800C,5bar).
    #[arg(long, value_name = "FLUID@SPEED")]
    fluid: Option<Flow>,
}

impl Physics {
    /// What is expected of sensors whose readings `records` are.
    pub(crate) fn plausibility(&self, records: &[Record]) -> Result<Plausibility, Failure> {
        let readings = records.iter().flat_map(|record| record.t1_c.iter().chain(record.t2_c.iter()));
        let (sum, count) =
            readings.filter(|c| c.is_finite()).fold((0.0, 0.0_f64), |(sum, count), c| (sum + c, count + 1.0));
        Ok(Plausibility::new(&self.sensor, self.fluid.as_ref(), sum / count.max(1.0))?)
    }
}

/// Which columns to use and how to read time.
#[derive(Debug, Args)]
#[command(next_help_heading = "Columns")]
pub(crate) struct Columns {
    /// Time column: its name, or its number counted from 1.
    #[arg(long, value_name = "COL")]
    time: Option<ColumnRef>,
    /// Unit of a time column of numbers, in place of the one in its header: s, ms, us, ns, min, h or d. Of a clock with two parts, as
    /// 10:30, that of the first: h or min.
    #[arg(long, value_name = "UNIT", value_parser = time_unit)]
    time_unit: Option<Unit>,
    /// First sensor: column name, or number counted from 1.
    #[arg(long, value_name = "COL")]
    t1: Option<ColumnRef>,
    /// Second sensor: column name, or number counted from 1.
    #[arg(long, value_name = "COL")]
    t2: Option<ColumnRef>,
    /// A trusted temperature, used for scoring only and never in an estimate.
    #[arg(long, value_name = "COL")]
    reference: Option<ColumnRef>,
    /// A flow velocity or density, in any unit: `diagnose` tries time constants proportional to a
    /// power of it.
    #[arg(long, value_name = "COL")]
    flow: Option<ColumnRef>,
    /// The position of sensors that move, in m (or dbar of water): a depth, a height. `diagnose` tries time constants that go
    /// with a power of their speed, and sensors that stand apart along the motion.
    #[arg(long, value_name = "COL", conflicts_with = "flow")]
    position: Option<ColumnRef>,
    /// Time from row to row, for files without a time column; a guessed time column is then
    /// ignored.
    #[arg(long, value_name = "SECONDS", value_parser = period)]
    period: Option<f64>,
    /// How to read the time stamps: auto, uniform (evenly spaced, whatever they say) or as-stamped [default: auto].
    #[arg(long, value_name = "HOW", value_parser = sampling)]
    sampling: Option<SamplingChoice>,
    /// The sheet, channel group or data set to read, of a file that has several.
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Join channels of several groups: put all of them on the stamps of the one with the lowest sampling rate, or of --group, the others interpolated.
    #[arg(long)]
    join: bool,
    /// Read the file as this profile says, which `twinlag inspect --save-profile` writes; other options here go before it.
    #[arg(long, value_name = "TOML")]
    profile: Option<PathBuf>,
}

fn time_unit(text: &str) -> Result<Unit, String> {
    match Unit::parse(text) {
        unit @ Unit::Time { .. } => Ok(unit),
        _ => Err("expected s, ms, us, ns, min, h or d".into()),
    }
}

fn period(text: &str) -> Result<f64, String> {
    let period_s: f64 = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    let is_period = SAMPLE_PERIODS_S.contains(&period_s);
    let wrong = || format!("the sample period must be positive, from a nanosecond to a year, got {text} s");
    if is_period { Ok(period_s) } else { Err(wrong()) }
}

/// Of all random numbers.
fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("expected a whole number from 0 to {}", u64::MAX))
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
    /// What the options say, and where they say nothing what the profile says.
    pub(crate) fn profile(&self) -> Result<Profile, Failure> {
        let selection = Selection {
            time: self.time.clone(),
            time_unit: self.time_unit.clone(),
            t1: self.t1.clone(),
            t2: self.t2.clone(),
            reference: self.reference.clone(),
            flow: self.flow.clone(),
            position: self.position.clone(),
            period_s: self.period,
            sampling: self.sampling.unwrap_or_default(),
        };
        let said = Profile { selection, group: self.group.clone(), join: self.join };
        match &self.profile {
            Some(path) => Ok(said.or(Profile::read(path)?)),
            None => Ok(said),
        }
    }
}

/// How to estimate.
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub(crate) struct Method {
    /// Noise standard deviations of the two channels in K, both positive; estimated from the data
    /// if left out.
    #[arg(long, value_name = "S1,S2", value_parser = pair, allow_hyphen_values = true, help_heading = "Noise")]
    noise: Option<Pair>,
    /// Ratio S2/S1 of the noise levels, if only the ratio is known.
    #[arg(long, value_name = "R", allow_hyphen_values = true, help_heading = "Noise")]
    noise_ratio: Option<f64>,
    /// A stretch of steady gas temperature, in seconds from the start: its scatter gives the noise
    /// levels. May be given several times.
    #[arg(long, value_name = "FROM..TO", value_parser = stretch, allow_hyphen_values = true, help_heading = "Noise")]
    quiet_segment: Vec<Stretch>,
    /// Model of the noise that is estimated: white, or autoregressive (each sample keeps a share of
    /// the previous one's).
    #[arg(long, value_name = "KIND", default_value = "white", help_heading = "Noise")]
    noise_colour: NoiseColour,
    /// One of whitened, cross-relation, bias-compensated, normalised, hybrid,
    /// difference-equation-ls, difference-equation-tls, difference-equation-gtls.
    #[arg(long, value_name = "NAME", default_value = "whitened", help_heading = "Research")]
    estimator: Estimator,
    #[arg(long, value_name = "NAME", default_value = "levenberg-marquardt", help = optimisers(), help_heading = "Research")]
    optimiser: String,
    /// Also fit the calibration of channel 2 relative to channel 1: gain, offset or gain,offset.
    #[arg(long, value_name = "LIST")]
    free: Option<String>,
    /// Also fit a second lag in series in these sensors: T1, T2 or T1,T2.
    #[arg(long, value_name = "LIST")]
    second_order: Option<String>,
    /// A parameter that is already known, exactly or with a standard deviation, for example
    /// T1=0.5s+-20%. Names are T1 and T2 for the time constants (units s, ms, us, min), gain, offset
    /// (K), T1.second and T2.second for second time constants; in full `T1.time_constant_s`,
    /// `T2.time_constant_s`, `T2.gain`, `T2.offset_K`, `T1.second_time_constant_s`,
    /// `T2.second_time_constant_s`. May be given once for each.
    #[arg(long, value_name = "NAME=VALUE[+-SD]", allow_hyphen_values = true)]
    known: Vec<Known>,
    /// Samples that the cross-relation, bias-compensated, normalised and hybrid estimators leave
    /// out at the start of each unbroken stretch.
    #[arg(long, value_name = "K0", help_heading = "Research")]
    discard: Option<usize>,
    /// How the gas is assumed to move between samples: auto, zero-order-hold, first-order-hold or
    /// bilinear.
    #[arg(long, value_name = "HOW", default_value = "auto", help_heading = "Research")]
    hold: Hold,
    /// How to find 95 % intervals: auto (from standard errors, or from the profile of the cost
    /// where standard errors do not describe it), profile, or bootstrap (by repeating the estimate
    /// on simulated records).
    #[arg(long, value_name = "HOW", default_value = "auto", value_parser = ["auto", "profile", "bootstrap"], help_heading = "Research")]
    intervals: String,
    /// Number of simulated records of the bootstrap, at least 39 [default: 199].
    #[arg(long, value_name = "N", help_heading = "Research")]
    replicates: Option<usize>,
    /// Seed of the bootstrap [default: 1].
    #[arg(long, value_name = "N", value_parser = seed, help_heading = "Research")]
    seed: Option<u64>,
    /// Also print numbers that are graded no-go, each marked as such: they may be far off.
    #[arg(long, help_heading = "Grades")]
    best_effort: bool,
    /// Exit with 4 also where a number is right only under a condition.
    #[arg(long, help_heading = "Grades")]
    pub(crate) strict: bool,
}

fn optimisers() -> String {
    let names: Vec<&str> = Optimiser::names().collect();
    format!("One of {}", names.join(", "))
}

/// A stretch of time. It has its own type because clap takes a list to mean a repeated option.
#[derive(Clone, Copy, Debug)]
struct Stretch([f64; 2]);

fn stretch(text: &str) -> Result<Stretch, String> {
    let wrong = || format!("expected FROM..TO in seconds from the start, FROM the smaller, got '{text}'");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|s| s.is_finite()).ok_or_else(wrong);
    let (from_s, to_s) = (number(from)?, number(to)?);
    if from_s < to_s { Ok(Stretch([from_s, to_s])) } else { Err(wrong()) }
}

/// Two numbers. They have their own type because clap takes a list to mean a repeated option.
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
            best_effort: self.best_effort,
            ..Options::default()
        };
        let options = options.free(self.free.as_deref().unwrap_or(""))?;
        Ok(options.second_order(self.second_order.as_deref().unwrap_or(""))?)
    }

    /// Whether numbers are printed that may not be used.
    pub(crate) fn best_effort(&self) -> bool {
        self.best_effort
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

/// Simulate a record from the description of a rig.
#[derive(Debug, Args)]
#[command(after_help = "\
SPEC is a TOML file such as:

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
With a [stream] its velocity is the column velocity_m_s, for --flow.

Exit codes: 0 written, 2 wrong usage, 3 the rig cannot be used, 1 any other error.")]
pub(crate) struct Simulate {
    /// The description of the rig, a TOML file.
    pub(crate) spec: PathBuf,
    /// Write the record to this file; `-` is standard output.
    #[arg(long, value_name = "CSV")]
    pub(crate) out: PathBuf,
    /// Seed for all random numbers, in place of the one in the rig.
    #[arg(long, value_name = "N", value_parser = seed)]
    pub(crate) seed: Option<u64>,
    /// Overwrite the output if it exists.
    #[arg(long)]
    pub(crate) force: bool,
}

/// Show what is in a file and how it would be read.
#[derive(Debug, Args)]
#[command(after_help = "\
Each column is listed with its unit, how many of its cells are missing, its range, and what it would be taken for. A line of
blocks shows its course, from the first row to the last, each block the mean of its part. If the file cannot be read as it is,
the reason stands below, with what to do; --time, --t1 and the other options below say it otherwise, and the saved profile
repeats it for other files: twinlag diagnose run2.csv --profile logger.toml

Exit codes: 0 the file can be read, 2 wrong usage, 3 it cannot be used as it is, 1 any other error.")]
pub(crate) struct Inspect {
    /// The file; `-` is standard input.
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) columns: Columns,
    /// Save how the file is read, for `--profile` of other commands.
    #[arg(long, value_name = "TOML")]
    pub(crate) save_profile: Option<PathBuf>,
    /// Draw both temperatures over time, as one SVG file.
    #[arg(long, value_name = "SVG")]
    pub(crate) picture: Option<PathBuf>,
    /// Overwrite output files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// Say what the next record would have to be.
#[derive(Debug, Args)]
#[command(after_help = "\
FILE is a rig (see 'twinlag simulate --help'), a model written by 'twinlag diagnose --save', or the output of
'twinlag diagnose --json'. A rig is taken as it is described. After a diagnosis the sensors are those that it found, in a gas
with the spectrum that the record showed.

Standard errors are expected from a record of the rig that is simulated without noise, to first order in the noise: for the record
as it is, for other rates and lengths, for other gas, for other sensors, and for noise levels that are known. The deviance
between two effects is that to expect with everything fitted again. Nothing is said of effects that are not in the rig.

Exit codes: 0 planned, 4 the record as it is does not determine both time constants, or the model has none, 2 wrong usage, 3 the file
cannot be used, 1 any other error.")]
pub(crate) struct Plan {
    /// The rig, a TOML file; or a model or a diagnosis, a JSON file.
    pub(crate) file: PathBuf,
}

/// Explain a name in plain words.
#[derive(Debug, Args)]
#[command(after_help = "\
NAME is an effect (delay), a number of one (gas_share), a verdict (partly-explained), a status (model-rejected), a grade (conditional),
a test of the residual (coherence), a part of an answer (transfer), or two-sensors, which is what two sensors alone can never reveal.")]
pub(crate) struct Explain {
    /// What to explain; without it, all that can be explained is listed.
    pub(crate) name: Option<String>,
}

/// Simulate a built-in rig and diagnose it.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 diagnosed, 4 the record was refused or does not determine both time constants, 1 any other error."
)]
pub(crate) struct Demo {
    /// Seed for all random numbers, in place of the one in the rig.
    #[arg(long, value_name = "N", value_parser = seed)]
    pub(crate) seed: Option<u64>,
}
