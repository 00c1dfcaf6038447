//! `twinlag batch WHAT... --out TABLE`: many records in parallel, one table.

mod question;
mod said;

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::num::{NonZeroU32, NonZeroUsize};
use std::panic;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::Value;
use twinlag::compensation::Form;
use twinlag::diagnosis::Identifier;
use twinlag::record::ColumnRef;
use twinlag_batch::{
    Answers, BatchError, Begin, Fleet, Found, GroupBy, Journal, Manifest, Outcome, PartOf, Row, Unit, Verb as RowVerb,
    find, is_of_batch, name_of, part_path, parts_beside, run as run_units, write_csv, write_parquet,
};
use twinlag_cluster::{Storage, Work};
use twinlag_pages::{fleet_report, is_fleet_report};
use twinlag_study::Shard;

use crate::arguments::{Columns, Method, Physics, Trust, form};
use crate::batch::question::{Question, failed};
use crate::batch::said::say;
use crate::console::Console;
use crate::failure::Failure;
use crate::output::{Output, with_ending};
use crate::place::{self, Place};
use crate::shards::JOURNAL_ENDING;
use crate::submission::{self, Cluster};
use crate::{output, progress, report, shards};

pub(crate) use crate::batch::said::BatchAnswer;

/// What is asked of each record, or of each rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Verb {
    #[value(alias = "characterize")]
    Characterise,
    Diagnose,
    Compensate,
}

impl From<Verb> for RowVerb {
    fn from(verb: Verb) -> Self {
        match verb {
            Verb::Characterise => Self::Characterise,
            Verb::Diagnose => Self::Diagnose,
            Verb::Compensate => Self::Compensate,
        }
    }
}

/// Ask the same of many records.
#[derive(Debug, Args)]
#[command(after_help = "\
WHAT is a folder (all files in it and below), a quoted pattern ('runs/**/*.csv'), or files. The table has a row for each record:
both time constants with their intervals and grades, noise, what is left over; of a diagnosis the verdict, the effects and a
column for each of their parameters. A file that cannot be used is a row with its reason; it stops nothing.

--group-by takes the records of one rig together: all files of a folder (folder), those in which a column has the same value
(column:serial), or those whose names agree in one part ('{rig}_run*.csv'). The table then has a row for each rig (level rig)
and one for each of its records (level record), with what is left over when it is left out, and whether it agrees.

--shard K/N asks only one of N parts of the batch, on this machine or another that sees the same files, and leaves it beside the
table as TABLE.part-K-of-N. The first shard lists the files with sizes and hashes in TABLE.manifest, which the others take. --merge
makes the table of all parts: the same, to the byte, as without shards. --engine submits all shards and the merge to a cluster;
--status says how far they are, and --resubmit submits again what is missing.

Tables, summary and parts may be in an object store (--out s3://BUCKET/PREFIX/TABLE.csv); records are files.

What is done is kept in TABLE.journal. A run that was stopped goes on with --resume, and gives the same table; so does a run
after files have been added or changed, which asks only of those.

Exit codes: 0 the table is written, and at least one unit has an answer; 4 none has, though files were read; 3 no file can be
used, or a part cannot be; 2 wrong usage; 75 a shard is missing, or another run has not ended;
1 any other error. Column exit_code has what the verb alone would have ended with.")]
pub(crate) struct Batch {
    /// Folders, quoted patterns, or files.
    #[arg(required_unless_present_any = ["merge", "status", "resubmit"], value_name = "WHAT")]
    what: Vec<PathBuf>,
    /// What is asked of each.
    #[arg(long, value_name = "VERB", default_value = "characterise")]
    verb: Verb,
    /// Write the table to this file or `s3://BUCKET/PREFIX/TABLE`, as text or as Parquet by its ending, .csv or .parquet; may be given twice.
    #[arg(long, value_name = "TABLE", required = true)]
    out: Vec<PathBuf>,
    /// Write a summary with pictures, as one self-contained HTML file.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// With --report: without a script, for print and mail.
    #[arg(long = "static", requires = "report")]
    is_static: bool,
    /// Take the records of one rig together: folder, column:NAME, or a pattern of file names with {rig} in it.
    #[arg(long, value_name = "HOW")]
    group_by: Option<GroupBy>,
    /// With --verb compensate: write the gas temperature of each record into this folder.
    #[arg(long, value_name = "FOLDER")]
    gas: Option<PathBuf>,
    /// With --gas: write this column of each file as well, as it is; `all` for every one that is not read.
    #[arg(long, value_name = "COL", value_delimiter = ',', requires = "gas")]
    keep: Vec<ColumnRef>,
    /// Use a model written by `twinlag diagnose --save`, with --verb characterise or compensate.
    #[arg(long, value_name = "JSON", conflicts_with = "group_by")]
    model: Option<PathBuf>,
    /// Leave this effect out; separate several by commas, or repeat the option.
    #[arg(long, value_name = "EFFECT", value_delimiter = ',')]
    without: Vec<Identifier>,
    /// With --verb compensate: smoother, filter or lag:N, as of `twinlag compensate`.
    #[arg(long, value_name = "FORM", default_value = "smoother", value_parser = form)]
    form: Form,
    /// With --verb compensate: the channel to trust where gain, offset or delay differ.
    #[arg(long, value_name = "CHANNEL", default_value = "T1", ignore_case = true)]
    trust: Trust,
    #[command(flatten)]
    course: Course,
    #[command(flatten)]
    division: Division,
    #[command(flatten)]
    cluster: Cluster,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    method: Method,
    #[command(flatten)]
    physics: Physics,
}

/// What a run on its own is of, and nothing else goes with.
const OF_RUN: [&str; 20] = [
    "what",
    "verb",
    "group_by",
    "gas",
    "keep",
    "model",
    "without",
    "form",
    "trust",
    "resume",
    "shard",
    "engine",
    "shards",
    "cpus",
    "memory",
    "engine_option",
    "dry_run",
    "Columns",
    "Method",
    "Physics",
];

/// The shards of a batch; no cell of the table depends on them.
#[derive(Debug, Args)]
struct Division {
    /// Ask only part K of N, with K counted from 0; see --merge.
    #[arg(long, value_name = "K/N", allow_hyphen_values = true, conflicts_with_all = ["report", "engine"])]
    shard: Option<Shard>,
    /// Make the table of the parts that shards have left beside it.
    #[arg(long, conflicts_with_all = OF_RUN, conflicts_with = "time_limit")]
    merge: bool,
    /// Say how far the shards are that were submitted with --engine.
    #[arg(long, conflicts_with_all = OF_RUN, conflicts_with_all = ["merge", "resubmit", "report", "force", "threads", "time_limit"])]
    status: bool,
    /// Submit again the shards that are missing, which are neither done nor waiting nor running, and the merge.
    #[arg(long, conflicts_with_all = OF_RUN, conflicts_with_all = ["merge", "report", "force", "threads"])]
    resubmit: bool,
}

/// How a batch goes about it; no cell of the table depends on it.
#[derive(Debug, Args)]
struct Course {
    /// Go on where an earlier run stopped; only files that were added or changed since are asked again.
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Number of records or rigs worked on at once; one per processor if left out. The table does not depend on it.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Begin anew, and overwrite output files that exist.
    #[arg(long)]
    force: bool,
}

/// How the files of gas temperatures end.
const GAS_ENDING: &str = ".gas.csv";

/// Within a batch, a record says nothing on its own.
const SILENT: Console = Console { json: true, quiet: true };

pub(crate) fn run(mut command: Batch, console: Console) -> Result<u8, Failure> {
    if command.cluster.time_limit.is_some() && command.cluster.engine.is_none() && !command.division.resubmit {
        return Err(Failure::Usage("--time-limit needs --engine or --resubmit".to_owned()));
    }
    let (given, _) = place::split(&command.out[0]);
    command.expect_one_place(&given)?;
    place::at(&given, |place| {
        command.work_in(place);
        command.fetch(place)?;
        let command = &command;
        let Division { merge, status, resubmit, .. } = command.division;
        match (merge, status || resubmit) {
            (true, _) => merge_parts(command, place, console),
            (_, true) => follow(command, place, console),
            _ => start(command, place, console),
        }
    })
}

/// Asks all units, or those of a shard, or submits the shards.
fn start(command: &Batch, place: &mut Place, console: Console) -> Result<u8, Failure> {
    let table = &command.out[0];
    let question = Question::of(command)?;
    if let Some(shard) = command.division.shard {
        shards::expect_one_division(table, place, shard.of(), Failure::Usage)?;
    }
    let journal_path =
        command.division.shard.map_or_else(|| with_ending(table, JOURNAL_ENDING), |shard| part_path(table, shard));
    command.check_outputs(&journal_path)?;
    let asked = question.asked()?;
    if command.cluster.engine.is_some() {
        return submit(command, &question, &asked, &journal_path, place, console);
    }
    let is_divided = command.division.shard.is_some() && shards::manifest_path(table).exists();
    let Scope { manifest, files, units, part_of } =
        Scope::of(command, &question, &asked, &journal_path, place, console)?;
    let begin = match (command.course.resume, command.course.force) {
        (true, _) => Begin::Resume,
        (_, true) => Begin::Replace,
        _ => Begin::Create,
    };
    let gas_files = question.gas_files(&files)?;
    // The units have the paths.
    drop(files);
    // A part that was removed leaves the gas temperatures of its records behind.
    let is_resumed = command.course.resume && (journal_path.exists() || is_divided);
    if !is_resumed {
        command.expect_no_gas(&gas_files)?;
    }
    let mut journal = match part_of {
        Some(part_of) => Journal::open_part(&journal_path, &asked, part_of, begin)?,
        None => Journal::open(&journal_path, &asked, begin)?,
    };
    match journal.other_units(&units) {
        0 => {}
        count => console.note(|| {
            let (units, journal) = (question.unit_name(), place.named(&journal_path));
            let journal = journal.display();
            format!(
                "not asked for now, and left out of the table: {count} of the earlier run's {units}, kept in {journal}"
            )
        }),
    }
    for unit in &units {
        // Its gas temperature goes elsewhere now, or is gone.
        let gas = gas_files.get(&unit.files()[0]).map(|gas| name_of(gas));
        let is_moved =
            |row: &Row| row.gas_file().is_some_and(|is| gas.as_deref() != Some(is) || !Path::new(is).exists());
        if journal.rows(unit)?.iter().any(is_moved) {
            journal.forget(unit);
        }
    }

    // What a panic says is in the row of its file.
    panic::set_hook(Box::new(|_| {}));
    let bar = progress::bar(console).with_message(question.unit_name());
    let work = |unit: &Unit| match manifest.as_ref().and_then(|manifest| manifest.change_in(unit)) {
        Some(change) => failed(unit, &change),
        None => question.rows(unit, &gas_files),
    };
    let done = run_units(&units, &mut journal, command.course.threads, work, |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
        place.store_so_far(&journal_path, console)
    });
    bar.finish_and_clear();
    let _ = panic::take_hook();
    place.store(&journal_path)?;
    done?;
    match command.division.shard {
        Some(shard) => shards::say_done(&place.named(table), &place.named(&journal_path), shard, console).map(|()| 0),
        None => finish(command, &units, &mut journal, question.verb.into(), question.unit_name(), place, console),
    }
}

/// What a run is of.
struct Scope {
    /// The batch that it is a shard of.
    manifest: Option<Manifest>,
    /// The files of the units.
    files: Vec<Found>,
    /// The units that are asked, in the order of the table.
    units: Vec<Unit>,
    part_of: Option<PartOf>,
}

impl Scope {
    fn of(
        command: &Batch,
        question: &Question<'_>,
        asked: &Value,
        journal: &Path,
        place: &mut Place,
        console: Console,
    ) -> Result<Self, Failure> {
        let Some(shard) = command.division.shard else {
            let (files, units) = command.units(question, journal, console)?;
            return Ok(Self { manifest: None, files, units, part_of: None });
        };
        let manifest = command.manifest(question, asked, journal, place, console)?;
        let units = manifest.units_of(shard);
        command.note_unlisted(&manifest, journal, place, console)?;
        let files = manifest.files_of(shard);
        let part_of = PartOf { manifest: manifest.sha256().to_owned(), shard };
        Ok(Self { manifest: Some(manifest), files, units, part_of: Some(part_of) })
    }
}

/// Submits all shards of a batch to a cluster.
fn submit(
    command: &Batch,
    question: &Question<'_>,
    asked: &Value,
    journal: &Path,
    place: &mut Place,
    console: Console,
) -> Result<u8, Failure> {
    let table = &command.out[0];
    let parts = parts_beside(table)?;
    if let Some((shard, part)) = parts.first().filter(|_| !command.course.resume) {
        return Err(Failure::Usage(format!(
            "{} is there from an earlier run, of {} shards: go on with them (option --resume), or remove all parts and {}",
            part.display(),
            shard.of(),
            shards::manifest_path(table).display()
        )));
    }
    let shards = command.cluster.shards();
    shards::expect_one_division(table, place, shards, Failure::Usage)?;
    let manifest = command.manifest(question, asked, journal, place, console)?;
    command.note_unlisted(&manifest, journal, place, console)?;
    let dropped = ["report", "static", "force", "resume", "threads", "json", "quiet"].map(str::to_owned).to_vec();
    let mut shard = submission::arguments_without("batch", &[dropped, Cluster::options()].concat())?;
    let threads = command.cluster.cpus.unwrap_or(NonZeroU32::MIN);
    // Behind the name of the command, whatever stands behind `--`.
    let behind = shard.iter().position(|argument| argument == "batch").map_or(0, |place| place + 1);
    shard.splice(
        behind..behind,
        ["--shard", Work::SHARD, "--resume", "--quiet", "--threads", &threads.to_string()].map(str::to_owned),
    );
    let mut merge = vec!["batch".to_owned(), "--merge".to_owned()];
    for (option, path) in command.outputs() {
        merge.extend([option.to_owned(), submission::text(place.named(path))?]);
    }
    merge.extend(command.is_static.then(|| "--static".to_owned()));
    // Nothing was there, or it was to be replaced: what is there then is of an earlier merge.
    merge.push("--force".to_owned());
    let name = table.file_stem().unwrap_or_default().to_string_lossy();
    // The records are in files.
    let storage = if place.is_stored() { Storage::FoldersAndObjects } else { Storage::Folders };
    let work = command.cluster.work(&name, storage, shard, merge)?;
    command.cluster.submit(&scripts(table, place), work, console)
}

/// The folder of what was submitted.
fn scripts(table: &Path, place: &Place) -> PathBuf {
    place.scripts(table, shards::submission_path(table))
}

/// Says how far the shards of a table are, or submits again what is missing of them.
fn follow(command: &Batch, place: &Place, console: Console) -> Result<u8, Failure> {
    let table = &command.out[0];
    let scripts = scripts(table, place);
    let progress = |of| shards::progress_of(table, place, of);
    let result = is_written(table).then_some(table.as_path());
    if command.division.resubmit {
        return submission::resubmit(&scripts, progress, result, command.cluster.time_limit, console);
    }
    let is_grouped = shards::manifest_path(table).exists() && !shards::asked(table)?["group_by"].is_null();
    submission::status(&scripts, progress, unit_name(is_grouped), result, console)
}

/// Makes the table of all parts of a batch.
fn merge_parts(command: &Batch, place: &mut Place, console: Console) -> Result<u8, Failure> {
    let table = &command.out[0];
    command.check_outputs(&shards::manifest_path(table))?;
    let (manifest, mut parts) = shards::all(table)?;
    let asked = manifest.asked();
    let unit_name = unit_name(!asked["group_by"].is_null());
    let verb = serde_json::from_value(asked["verb"].clone())
        .map_err(|error| Failure::File(format!("{}: the parts ask nothing that is known: {error}", table.display())))?;
    finish(command, &manifest.units(), &mut parts, verb, unit_name, place, console)
}

/// Writes a table, as text or as Parquet by its ending.
fn write_table(out: &Path, units: &[Unit], answers: &mut impl Answers, verb: RowVerb) -> Result<(), Failure> {
    output::replace(out, |file| {
        let written = if is_parquet(out) {
            write_parquet(units, answers, verb, file)
        } else {
            write_csv(units, answers, verb, std::io::BufWriter::new(file))
        };
        written.map_err(|error| match error {
            BatchError::Table { .. } => Failure::Other(format!("{}: {error}", out.display())),
            error => error.into(),
        })
    })
}

/// Writes the table and the summary, and says what came of it.
fn finish(
    command: &Batch,
    units: &[Unit],
    answers: &mut impl Answers,
    verb: RowVerb,
    unit_name: &'static str,
    place: &mut Place,
    console: Console,
) -> Result<u8, Failure> {
    // The first table last: where it is, so are the others and the summary.
    let [first, others @ ..] = &command.out[..] else { unreachable!("one is required") };
    others.iter().try_for_each(|out| write_table(out, units, answers, verb))?;
    let fleet = Fleet::of(units, answers)?;
    if let Some(path) = &command.report {
        let making = report::making(&[] as &[&Path], command.is_static);
        let title = place.named(first).display().to_string();
        let made_by = ["twinlag", env!("CARGO_PKG_VERSION")];
        output::write(path, fleet_report(&fleet, &title, unit_name, made_by, &making)?)?;
    }
    write_table(first, units, answers, verb)?;
    others.iter().chain(&command.report).chain([first]).try_for_each(|path| place.store(path))?;
    let tables: Vec<PathBuf> = command.out.iter().map(|out| place.named(out)).collect();
    say(&tables, unit_name, &fleet, console)?;
    let outcome = match (fleet.units.answered, fleet.units.undetermined, fleet.units.failed) {
        (0, 0, 0) => Outcome::Unusable,
        (0, 0, _) => Outcome::Failed,
        (0, _, _) => Outcome::Undetermined,
        _ => Outcome::Answered,
    };
    Ok(outcome.exit_code())
}

impl Batch {
    /// Refuses paths that the place of the first table does not allow.
    fn expect_one_place(&self, given: &Path) -> Result<(), Failure> {
        if let Some(path) = self.what.iter().chain(&self.gas).find(|path| place::is_url(path)) {
            return place::expect_file(path);
        }
        let is_elsewhere = |path: &&PathBuf| place::is_url(path) && place::split(path).0 != given;
        match self.out.iter().chain(&self.report).find(is_elsewhere) {
            None => Ok(()),
            Some(path) => {
                let (path, given) = (path.display(), given.display());
                Err(Failure::Usage(format!(
                    "{path}: expected a path of this machine, or one in {given}, as the first table has"
                )))
            }
        }
    }

    /// Has outputs that go into a store written into the folder of the place.
    fn work_in(&mut self, place: &Place) {
        for path in self.out.iter_mut().chain(&mut self.report).filter(|path| place::is_url(path)) {
            *path = place.folder().join(place::split(path).1);
        }
    }

    /// Brings what this run needs of what is in the place.
    fn fetch(&self, place: &mut Place) -> Result<(), Failure> {
        let table = &self.out[0];
        let is = |path: &Path, name: &str| path.file_name().is_some_and(|file| file == name);
        let needed = |name: &str| match self.division.shard {
            Some(shard) => is(&shards::manifest_path(table), name) || is(&part_path(table, shard), name),
            None => self.outputs().iter().any(|(_, path)| is(path, name)) || shards::is_named_beside(table, name),
        };
        place.fetch(needed)
    }

    /// Refuses outputs that could not be written or would overwrite something.
    fn check_outputs(&self, journal: &Path) -> Result<(), Failure> {
        if let Some(out) = self.out.iter().find(|out| !is_parquet(out) && !has_ending(out, "csv")) {
            let text = format!("--out {}: expected a name that ends in .csv or .parquet", out.display());
            return Err(Failure::Usage(text));
        }
        if self.division.shard.is_some() || self.division.merge || self.cluster.engine.is_some() {
            let table = &self.out[0];
            if table.to_str().is_none() {
                return Err(Failure::Usage(format!(
                    "--out {}: is no Unicode, as a batch in shards needs it",
                    table.display()
                )));
            }
            let others = self.out[1..].iter().chain(&self.report);
            if let Some(part) = others.into_iter().find(|path| shards::is_beside(table, path)) {
                return Err(Failure::Usage(format!(
                    "{}: would be a part of {}: choose another name",
                    part.display(),
                    table.display()
                )));
            }
        }
        let outputs = self.outputs();
        let is_resumed = self.course.resume && journal.exists();
        output::check(journal, &outputs, true)?;
        let others: Vec<_> = outputs.iter().copied().filter(|(_, path)| !(is_resumed && is_written(path))).collect();
        // A shard writes none of them.
        output::check(journal, &others, self.course.force || self.division.shard.is_some())
    }

    /// The tables and the page.
    fn outputs(&self) -> Vec<Output<'_>> {
        let tables = self.out.iter().map(|path| ("--out", path.as_path()));
        tables.chain(self.report.iter().map(|path| ("--report", path.as_path()))).collect()
    }

    /// The records, and what is asked together.
    fn units(
        &self,
        question: &Question<'_>,
        journal: &Path,
        console: Console,
    ) -> Result<(Vec<Found>, Vec<Unit>), Failure> {
        let (files, others) = self.records(find(&self.what)?, journal)?;
        if let Some(first) = others.first() {
            let (count, first) = (others.len(), first.path.display());
            console.note(|| format!("not asked for: {count} files that batches have written, first {first}"));
        }
        let paths = files.iter().map(|file| file.path.clone()).collect();
        let units = question.units(paths, self.course.threads, console);
        Ok((files, units))
    }

    /// The manifest of its shards, made where there is none.
    fn manifest(
        &self,
        question: &Question<'_>,
        asked: &Value,
        journal: &Path,
        place: &mut Place,
        console: Console,
    ) -> Result<Manifest, Failure> {
        shards::manifest(&self.out[0], &self.what, asked, place, || {
            let (files, units) = self.units(question, journal, console)?;
            self.expect_no_gas(&question.gas_files(&files)?)?;
            shards::listed(&self.what, asked, &units, &files, self.course.threads, console)
        })
    }

    /// Says which files have come since a batch was divided.
    fn note_unlisted(
        &self,
        manifest: &Manifest,
        journal: &Path,
        place: &Place,
        console: Console,
    ) -> Result<(), Failure> {
        let (unlisted, _) = self.records(manifest.unlisted(find(&self.what)?), journal)?;
        if !unlisted.is_empty() {
            let (count, path) = (unlisted.len(), place.named(&shards::manifest_path(&self.out[0])));
            console.note(|| {
                format!(
                    "not asked for: {count} files that {} does not list; remove it and all parts beside it to divide the batch anew",
                    path.display()
                )
            });
        }
        Ok(())
    }

    /// Refuses to write a gas temperature over a file that is there.
    fn expect_no_gas(&self, gas_files: &BTreeMap<PathBuf, PathBuf>) -> Result<(), Failure> {
        match gas_files.values().find(|gas| gas.exists()).filter(|_| !self.course.force) {
            None => Ok(()),
            Some(gas) => {
                let gas = gas.display();
                Err(Failure::Usage(format!("{gas} exists: choose another folder for --gas, or add --force")))
            }
        }
    }

    /// The records among files, and what other batches have written among them.
    fn records(&self, found: Vec<Found>, journal: &Path) -> Result<(Vec<Found>, Vec<Found>), Failure> {
        let outputs = self.outputs();
        let gas = self.gas.as_ref().and_then(|folder| folder.canonicalize().ok());
        let is_gas = |file: &Path| {
            file.to_string_lossy().ends_with(GAS_ENDING)
                && gas.as_ref().is_some_and(|gas| file.canonicalize().is_ok_and(|file| file.starts_with(gas)))
        };
        let is_output = |file: &Path| outputs.iter().any(|(_, output)| output::is_same(file, output));
        // One that is empty yet is known by its name alone.
        let is_beside = |file: &Path| output::is_same(file, journal) || shards::is_beside(&self.out[0], file);
        let (written, mut files): (Vec<_>, Vec<_>) =
            found.into_iter().partition(|file| is_beside(&file.path) || is_written(&file.path));
        if let Some(file) = files.iter().find(|file| is_output(&file.path)) {
            return Err(Failure::Usage(format!(
                "{} is one of the records: choose another name for --out or --report",
                file.path.display()
            )));
        }
        files.retain(|file| !is_gas(&file.path));
        let others = written.into_iter().filter(|file| !is_beside(&file.path) && !is_output(&file.path));
        Ok((files, others.collect()))
    }
}

/// First bytes of a file by which a summary of a batch is known.
const HEAD_BYTES: u64 = 1 << 16;

/// Whether a file is a table, a summary, a journal, a part or a manifest that a batch has written.
fn is_written(file: &Path) -> bool {
    let is_summary = || {
        let mut head = Vec::new();
        let read = fs::File::open(file).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
        read.is_ok() && is_fleet_report(&head)
    };
    // Whoever opens a pipe may wait for ever.
    file.is_file() && (is_of_batch(file) || is_summary())
}

/// What the units of a batch are.
fn unit_name(is_grouped: bool) -> &'static str {
    if is_grouped { "rigs" } else { "records" }
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|is| is.eq_ignore_ascii_case(ending))
}

fn is_parquet(path: &Path) -> bool {
    has_ending(path, "parquet")
}

/// A batch whose outputs are there depends on how the program was called.
impl From<BatchError> for Failure {
    fn from(error: BatchError) -> Self {
        let text = error.to_string();
        match error {
            BatchError::Exists { .. } => Self::Usage(format!("{text} (options --resume, --force)")),
            BatchError::OtherQuestion { .. } => Self::Usage(format!("{text} (option --force)")),
            BatchError::OtherBatch { .. } | BatchError::Pattern { .. } | BatchError::GroupBy { .. } => {
                Self::Usage(text)
            }
            BatchError::Damaged { .. } => Self::File(format!("{text} (option --force)")),
            BatchError::Incomplete { .. } | BatchError::NoParts => {
                Self::NotYet(format!("{text} (options --shard, --resume)"))
            }
            BatchError::Busy { .. } => Self::NotYet(text),
            BatchError::NothingFound { .. }
            | BatchError::Empty { .. }
            | BatchError::NoJournal { .. }
            | BatchError::DamagedManifest { .. }
            | BatchError::DamagedPart { .. }
            | BatchError::NoUnicode { .. }
            | BatchError::Foreign { .. }
            | BatchError::Divisions { .. }
            | BatchError::Twice { .. } => Self::File(text),
            _ => Self::Other(text),
        }
    }
}
