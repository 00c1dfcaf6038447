//! Where the time of each verb goes: `cargo xtask profile`.
//!
//! Each verb runs in a process of its own, which samples its own stack by processor time: it reads a record, does the work of
//! the verb and writes what came out, again and again until there are samples enough. It runs on one thread, so that every
//! stack reaches from the verb down to what it does; on more threads the work is the same.

mod doc;
mod flame;
mod fold;
mod page;
mod sample;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;

use crate::bench::scale::{Named, Verb, simulated};
use crate::root;
use sample::Sampled;

/// Rows of the simulated records.
const ROWS: [usize; 3] = [10_000, 100_000, 1_000_000];
/// Those of a quick run, and how long it samples each verb, s.
const QUICK_ROWS: usize = 1000;
const QUICK_S: f64 = 0.2;
/// Processor time that is sampled at least, s: at 199 samples a second a share of 5 % is then known to half a percent.
const SAMPLED_S: f64 = 10.0;

#[derive(Args)]
pub(crate) struct Profile {
    /// One short record, two verbs, and no page: whether profiles can be made at all.
    #[arg(long)]
    quick: bool,
    /// A folder of measured records, as for `measured`: one of each campaign is profiled as well.
    #[arg(long, value_name = "DIR", conflicts_with = "quick")]
    measured: Option<PathBuf>,
    /// A verb that would take more processor time is not asked for more rows, s.
    #[arg(long, default_value_t = 600.0)]
    limit: f64,
    /// One verb, in a process of its own.
    #[arg(long, hide = true, requires = "file")]
    step: Option<Named>,
    /// Processor time for which each verb is sampled at least, s.
    #[arg(long, default_value_t = SAMPLED_S)]
    seconds: f64,
    /// The record of that step.
    #[arg(hide = true)]
    file: Option<PathBuf>,
}

/// A record that verbs are profiled on.
struct Subject {
    /// What stands above its column.
    name: String,
    file: PathBuf,
    /// The columns of a measured record.
    channels: Option<[&'static str; 2]>,
}

/// Times that a verb is begun: its stack is followed from within a signal, and the unwinder crashes there now and then.
const ATTEMPTS: usize = 8;

/// The profile of a verb on one record.
struct Profiled {
    subject: String,
    is_measured: bool,
    sampled: Sampled,
}

/// The profiles of a verb.
struct OfVerb {
    verb: Verb,
    profiles: Vec<Profiled>,
}

pub(crate) fn run(arguments: &Profile) -> Result<()> {
    if let (Some(step), Some(file)) = (&arguments.step, &arguments.file) {
        return sample::run(step, file, arguments.seconds);
    }
    if arguments.quick {
        return quick();
    }
    let folder = folder()?;
    let of = |rows: &usize| {
        Ok(Subject {
            name: format!("{rows:.0e}", rows = *rows as f64),
            file: simulated(&folder, *rows)?,
            channels: None,
        })
    };
    let mut subjects = ROWS.iter().map(of).collect::<Result<Vec<Subject>>>()?;
    let mut left_out = Vec::new();
    match &arguments.measured {
        Some(dir) => subjects.extend(one_of_each_campaign(dir)?),
        None => left_out.push("measured records: no folder was given".to_owned()),
    }
    let mut verbs = Vec::new();
    for verb in Verb::ALL {
        verbs.push(OfVerb { verb, profiles: profiles(verb, &subjects, arguments, &mut left_out) });
    }
    page::write(&verbs, arguments.seconds, &left_out)
}

/// A verb on all records that it does not take too long for.
fn profiles(verb: Verb, subjects: &[Subject], arguments: &Profile, left_out: &mut Vec<String>) -> Vec<Profiled> {
    let mut out: Vec<Profiled> = Vec::new();
    for subject in subjects {
        let is_measured = subject.channels.is_some();
        let growth = out.last().filter(|_| !is_measured).map(|last| last.sampled.run_s() * 10.0);
        if let Some(expected_s) = growth.filter(|expected_s| *expected_s > arguments.limit) {
            let (verb, rows, limit) = (verb.name(), &subject.name, arguments.limit);
            left_out.push(format!(
                "`{verb}` of {rows} rows: it would take some {expected_s:.0} s, and more than {limit:.0} s are not waited for"
            ));
            continue;
        }
        match child(verb, subject, arguments.seconds) {
            Ok(sampled) => {
                println!("{} {}: {}", verb.name(), subject.name, sampled.line());
                out.push(Profiled { subject: subject.name.clone(), is_measured, sampled });
            }
            Err(error) => left_out.push(format!("`{}` of {}: {error:#}", verb.name(), subject.name)),
        }
    }
    out
}

fn child(verb: Verb, subject: &Subject, seconds: f64) -> Result<Sampled> {
    let step = subject.channels.map_or(verb.name().to_owned(), |[one, two]| format!("{}:{one}:{two}", verb.name()));
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["profile", "--step", &step, "--seconds", &seconds.to_string()]).arg(&subject.file);
    let mut outputs = (0..ATTEMPTS).map(|_| command.output().context("the profile could not start itself"));
    // Without a code it was ended by a signal.
    let last = outputs.find(|output| output.as_ref().map_or(true, |output| output.status.code().is_some()));
    let output = last.with_context(|| format!("crashed {ATTEMPTS} times in the library that follows the stack"))??;
    let error = String::from_utf8_lossy(&output.stderr);
    let last = error.lines().last().unwrap_or("no message").trim_start_matches("xtask: ");
    ensure!(output.status.success(), "{last}");
    serde_json::from_slice(&output.stdout).with_context(|| format!("{step}: what it says is no profile"))
}

/// The first record of each folder of measured ones.
fn one_of_each_campaign(dir: &Path) -> Result<Vec<Subject>> {
    ensure!(dir.is_dir(), "{}: no such folder: name the folder of the measured data", dir.display());
    let mut out: Vec<Subject> = Vec::new();
    for (file, channels) in crate::measured::records() {
        let name = Path::new(file).parent().map(|campaign| campaign.display().to_string()).unwrap_or_default();
        if out.iter().all(|subject| subject.name != name) {
            out.push(Subject { name, file: dir.join(file), channels: Some(channels) });
        }
    }
    Ok(out)
}

/// Where the simulated records lie that `bench --scale` takes too.
fn folder() -> Result<PathBuf> {
    let folder = root()?.join("target/scale");
    fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Whether a short record has a profile and a picture.
pub(crate) fn quick() -> Result<()> {
    let file = simulated(&folder()?, QUICK_ROWS)?;
    let subject = Subject { name: QUICK_ROWS.to_string(), file, channels: None };
    for verb in [Verb::Read, Verb::Characterise] {
        let sampled = child(verb, &subject, QUICK_S)?;
        println!("{}: {}", verb.name(), sampled.line());
        let own: f64 = fold::modules(&sampled.stacks).iter().map(|part| part.own).sum();
        ensure!((own - 1.0).abs() < 1e-9, "the parts of {} are {own} of it", verb.name());
        ensure!(flame::picture(verb.name(), &sampled)?.contains("</svg>"), "{}: no flame graph", verb.name());
    }
    Ok(())
}
