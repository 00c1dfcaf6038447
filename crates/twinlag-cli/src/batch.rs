//! `twinlag batch WHAT... --out TABLE`: many records in parallel, one table.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io::Read as _;
use std::num::NonZeroUsize;
use std::panic;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Value, json};
use twinlag::compensation::Form;
use twinlag::diagnosis::{Grade, Identifier};
use twinlag::record::{ColumnRef, Record};
use twinlag::{Characterisation, CompensateOptions, Compensation, DiagnoseOptions, Diagnosis, Model, Options};
use twinlag_batch::{
    Answer, Answers, BatchError, Begin, Fleet, Found, GroupBy, Journal, Manifest, Member, MemberTau, Outcome, PartOf,
    Row, Unit, Verb as RowVerb, each, find, grouped, is_table, map, name_of, part_path, run as run_units, write_csv,
    write_parquet,
};
use twinlag_pages::{fleet_report, is_fleet_report};
use twinlag_study::Shard;

use crate::arguments::{Columns, Method, Physics, Trust, form};
use crate::columns::columns;
use crate::console::Console;
use crate::failure::Failure;
use crate::keep::Kept;
use crate::output::Output;
use crate::profile::Profile;
use crate::progress;
use crate::read::{read_watched, table_watched};
use crate::{characterise, compensate, diagnose, output, print, report, several, shards};

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
makes the table of all parts: the same, to the byte, as without shards.

What is done is kept in TABLE.journal. A run that was stopped goes on with --resume, and gives the same table; so does a run
after files have been added or changed, which asks only of those.

Exit codes: 0 the table is written, and at least one unit has an answer; 4 none has, though files were read; 3 no file can be
used; 2 wrong usage; 75 a shard is missing; 1 any other error. Column exit_code has what the verb alone would have ended with.")]
pub(crate) struct Batch {
    /// Folders, quoted patterns, or files.
    #[arg(required_unless_present = "merge", value_name = "WHAT")]
    what: Vec<PathBuf>,
    /// What is asked of each.
    #[arg(long, value_name = "VERB", default_value = "characterise")]
    verb: Verb,
    /// Write the table to this file, as text or as Parquet by its ending, .csv or .parquet; may be given twice.
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
    columns: Columns,
    #[command(flatten)]
    method: Method,
    #[command(flatten)]
    physics: Physics,
}

/// How a batch goes about it; no cell of the table depends on it.
#[derive(Debug, Args)]
struct Course {
    /// Ask only part K of N, with K counted from 0; see --merge.
    #[arg(long, value_name = "K/N", conflicts_with_all = ["merge", "report"])]
    shard: Option<Shard>,
    /// Make the table of the parts that shards have left beside it.
    #[arg(long, conflicts_with_all = ["what", "verb", "group_by", "gas", "keep", "model", "without", "form", "trust", "resume", "threads"])]
    merge: bool,
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

pub(crate) fn run(command: &Batch, console: Console) -> Result<u8, Failure> {
    if command.course.merge {
        return merge(command, console);
    }
    let question = Question::of(command)?;
    let table = &command.out[0];
    let journal_path =
        command.course.shard.map_or_else(|| with_ending(table, ".journal"), |shard| part_path(table, shard));
    command.check_outputs(&journal_path)?;
    let Asked { manifest, files, units, part_of } = Asked::of(command, &question, &journal_path, console)?;
    let begin = match (command.course.resume, command.course.force) {
        (true, _) => Begin::Resume,
        (_, true) => Begin::Replace,
        _ => Begin::Create,
    };
    let gas_files = question.gas_files(&files)?;
    let is_resumed = command.course.resume && journal_path.exists();
    if let Some(gas) = gas_files.values().find(|gas| gas.exists()).filter(|_| !is_resumed && !command.course.force) {
        return Err(Failure::Usage(format!(
            "{} exists: choose another folder for --gas, or add --force",
            gas.display()
        )));
    }
    let asked = question.asked()?;
    let mut journal = match part_of {
        Some(part_of) => Journal::open_part(&journal_path, &asked, part_of, begin)?,
        None => Journal::open(&journal_path, &asked, begin)?,
    };
    match journal.other_units(&units) {
        0 => {}
        count => console.note(|| {
            let (units, journal) = (question.unit_name(), journal_path.display());
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
        Some(change) => vec![failed(unit, &change)],
        None => question.rows(unit, &gas_files),
    };
    let done = run_units(&units, &mut journal, command.course.threads, work, |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
    });
    bar.finish_and_clear();
    let _ = panic::take_hook();
    done?;
    match command.course.shard {
        Some(shard) => shards::say_done(table, &journal_path, shard, console).map(|()| 0),
        None => finish(command, &units, &mut journal, question.verb.into(), question.unit_name(), console),
    }
}

/// What a run asks of what.
struct Asked {
    /// The batch that it is a shard of.
    manifest: Option<Manifest>,
    /// All files of the batch.
    files: Vec<Found>,
    /// The units that are asked, in the order of the table.
    units: Vec<Unit>,
    part_of: Option<PartOf>,
}

impl Asked {
    fn of(command: &Batch, question: &Question<'_>, journal: &Path, console: Console) -> Result<Self, Failure> {
        let threads = command.course.threads;
        let found = || {
            let files = command.files(journal)?;
            let paths = files.iter().map(|file| file.path.clone()).collect();
            let units = question.units(paths, threads, console);
            Ok::<_, Failure>((files, units))
        };
        let Some(shard) = command.course.shard else {
            let (files, units) = found()?;
            return Ok(Self { manifest: None, files, units, part_of: None });
        };
        let (what, group_by) = (&command.what, question.group_by);
        let manifest = shards::manifest(&command.out[0], what, group_by, || {
            let (files, units) = found()?;
            shards::listed(what, group_by, &units, &files, threads, console)
        })?;
        let (files, units) = (manifest.files(), manifest.units_of(shard));
        let part_of = PartOf { manifest: manifest.sha256(), shard };
        Ok(Self { manifest: Some(manifest), files, units, part_of: Some(part_of) })
    }
}

/// Makes the table of all parts of a batch.
fn merge(command: &Batch, console: Console) -> Result<u8, Failure> {
    let table = &command.out[0];
    command.check_outputs(&shards::manifest_path(table))?;
    let (manifest, mut parts) = shards::all(table)?;
    let asked = parts.asked();
    let unit_name = unit_name(!asked["group_by"].is_null());
    let verb = serde_json::from_value(asked["verb"].clone())
        .map_err(|error| Failure::File(format!("{}: the parts ask nothing that is known: {error}", table.display())))?;
    finish(command, &manifest.units(), &mut parts, verb, unit_name, console)
}

/// Writes the table and the summary, and says what came of it.
fn finish(
    command: &Batch,
    units: &[Unit],
    answers: &mut impl Answers,
    verb: RowVerb,
    unit_name: &'static str,
    console: Console,
) -> Result<u8, Failure> {
    for out in &command.out {
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
        })?;
    }
    let fleet = Fleet::of(units, answers)?;
    if let Some(path) = &command.report {
        let making = report::making(&[] as &[&Path], command.is_static);
        let title = command.out[0].display().to_string();
        let made_by = ["twinlag", env!("CARGO_PKG_VERSION")];
        output::write(path, fleet_report(&fleet, &title, unit_name, made_by, &making)?)?;
    }
    say(command, unit_name, &fleet, console)?;
    let outcome = match (fleet.units.answered, fleet.units.undetermined, fleet.units.failed) {
        (0, 0, 0) => Outcome::Unusable,
        (0, 0, _) => Outcome::Failed,
        (0, _, _) => Outcome::Undetermined,
        _ => Outcome::Answered,
    };
    Ok(outcome.exit_code())
}

impl Batch {
    /// Refuses outputs that could not be written or would overwrite something.
    fn check_outputs(&self, journal: &Path) -> Result<(), Failure> {
        if let Some(out) = self.out.iter().find(|out| !is_parquet(out) && !has_ending(out, "csv")) {
            let text = format!("--out {}: expected a name that ends in .csv or .parquet", out.display());
            return Err(Failure::Usage(text));
        }
        let outputs = self.outputs();
        let is_resumed = self.course.resume && journal.exists();
        output::check(journal, &outputs, true)?;
        let others: Vec<_> = outputs.iter().copied().filter(|(_, path)| !(is_resumed && is_of_batch(path))).collect();
        // A shard writes none of them.
        output::check(journal, &others, self.course.force || self.course.shard.is_some())
    }

    /// The tables and the page.
    fn outputs(&self) -> Vec<Output<'_>> {
        let tables = self.out.iter().map(|path| ("--out", path.as_path()));
        tables.chain(self.report.iter().map(|path| ("--report", path.as_path()))).collect()
    }

    /// The files that are asked, without what the batch itself writes.
    fn files(&self, journal: &Path) -> Result<Vec<Found>, Failure> {
        let outputs = self.outputs();
        let gas = self.gas.as_ref().and_then(|folder| folder.canonicalize().ok());
        let is_gas = |file: &Path| {
            file.to_string_lossy().ends_with(GAS_ENDING)
                && gas.as_ref().is_some_and(|gas| file.canonicalize().is_ok_and(|file| file.starts_with(gas)))
        };
        let is_output = |file: &Path| {
            output::is_same(file, journal)
                || outputs.iter().any(|(_, output)| output::is_same(file, output))
                || shards::is_beside(&self.out[0], file)
        };
        let found = find(&self.what)?;
        let (own, files): (Vec<_>, Vec<_>) = found.into_iter().partition(|file| is_output(&file.path));
        let is_own =
            |file: &Path| output::is_same(file, journal) || is_of_batch(file) || shards::is_beside(&self.out[0], file);
        match own.iter().find(|file| !is_own(&file.path)) {
            Some(file) => Err(Failure::Usage(format!(
                "{} is one of the records: choose another name for --out or --report",
                file.path.display()
            ))),
            None => Ok(files.into_iter().filter(|file| !is_gas(&file.path)).collect()),
        }
    }
}

/// First bytes of a file by which a summary of a batch is known.
const HEAD_BYTES: u64 = 1 << 16;

/// Whether a file is a table or a summary that a batch has written.
fn is_of_batch(file: &Path) -> bool {
    let mut head = Vec::new();
    let read = fs::File::open(file).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    read.is_ok() && (is_fleet_report(&head) || is_table(file))
}

/// What is asked of each unit, whatever decides a cell of the table.
struct Question<'a> {
    verb: Verb,
    profile: Profile,
    options: Options,
    physics: &'a Physics,
    model: Option<(&'a Path, Model)>,
    without: &'a [Identifier],
    form: Form,
    trust: Trust,
    strict: bool,
    group_by: Option<&'a GroupBy>,
    gas: Option<&'a Path>,
    keep: &'a [ColumnRef],
}

impl<'a> Question<'a> {
    fn of(command: &'a Batch) -> Result<Self, Failure> {
        let usage = |text: &str| Err(Failure::Usage(text.to_owned()));
        let verb = command.verb;
        if verb == Verb::Compensate && command.group_by.is_some() {
            return usage("--group-by with --verb compensate: the gas is each record's own; leave --group-by out");
        }
        if verb != Verb::Compensate && command.gas.is_some() {
            return usage("--gas needs --verb compensate");
        }
        if verb == Verb::Diagnose && command.model.is_some() {
            return usage(
                "--model with --verb diagnose: a diagnosis finds the model; use --verb characterise or compensate",
            );
        }
        if verb == Verb::Characterise && !command.without.is_empty() {
            return usage("--without needs --verb diagnose or compensate: two lags have no effects");
        }
        let model =
            command.model.as_deref().map(|path| Ok::<_, Failure>((path, characterise::model(path)?))).transpose()?;
        let question = Self {
            verb,
            profile: command.columns.profile()?,
            options: command.method.options()?,
            physics: &command.physics,
            model,
            without: &command.without,
            form: command.form,
            trust: command.trust,
            strict: command.method.strict,
            group_by: command.group_by.as_ref(),
            gas: command.gas.as_deref(),
            keep: &command.keep,
        };
        // What is wrong with the options is wrong with every record.
        question.physics.plausibility(&[])?;
        Ok(question)
    }

    /// All of it, for the journal.
    fn asked(&self) -> Result<Value, Failure> {
        Ok(json!({
            "program": env!("TWINLAG_VERSION"),
            "verb": RowVerb::from(self.verb),
            "group_by": self.group_by.map(ToString::to_string),
            "profile": self.profile.text()?,
            "options": self.options,
            "physics": format!("{:?}", self.physics),
            "model": self.model.as_ref().map(|(_, model)| model),
            "without": self.without,
            "form": self.form,
            "trust": format!("{:?}", self.trust),
            "strict": self.strict,
            "gas": self.gas,
            "keep": self.keep.iter().map(ToString::to_string).collect::<Vec<_>>(),
        }))
    }

    fn unit_name(&self) -> &'static str {
        unit_name(self.group_by.is_some())
    }

    fn units(&self, files: Vec<PathBuf>, threads: Option<NonZeroUsize>, console: Console) -> Vec<Unit> {
        let Some(by) = self.group_by else { return each(files) };
        let bar = progress::bar(console).with_message("reading the names of rigs");
        let rig = |file: &PathBuf| by.rig(file, |column| self.rig_by_column(file, column));
        let rigs = map(&files, threads, rig, |progress| {
            bar.set_length(progress.total as u64);
            bar.set_position(progress.done as u64);
        });
        bar.finish_and_clear();
        grouped(files, rigs)
    }

    fn rig_by_column(&self, file: &Path, name: &str) -> Result<String, String> {
        let table = expect_file(file).and_then(|()| table_watched(file, &self.profile.choice(), SILENT));
        let table = table.map_err(|failure| failure.to_string())?;
        let column = name.parse().unwrap_or_else(|_| ColumnRef::Name(name.to_owned()));
        let index = table.find(&column).map_err(|error| error.to_string())?;
        table.constant(index).ok_or_else(|| {
            format!("column {name} is not the same in all rows, so it does not say which rig the record is of")
        })
    }

    /// The file of each record's gas temperature: in the `--gas` folder, under its record's relative path with [`GAS_ENDING`] appended.
    fn gas_files(&self, files: &[Found]) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
        let Some(folder) = self.gas else { return Ok(BTreeMap::new()) };
        if folder.exists() && !folder.is_dir() {
            return Err(Failure::Usage(format!("--gas {}: expected a folder, and this is a file", folder.display())));
        }
        let mut gas_files = BTreeMap::new();
        let mut taken: BTreeMap<PathBuf, &Path> = BTreeMap::new();
        for Found { path, below, .. } in files {
            let gas = with_ending(&folder.join(below), GAS_ENDING);
            if let Some(other) = taken.insert(gas.clone(), path) {
                return Err(Failure::Usage(format!(
                    "{} and {} would have the same file of gas temperature, {}: name a folder that holds both",
                    other.display(),
                    path.display(),
                    gas.display()
                )));
            }
            gas_files.insert(path.clone(), gas);
        }
        Ok(gas_files)
    }

    /// The rows of a unit.
    fn rows(&self, unit: &Unit, gas_files: &BTreeMap<PathBuf, PathBuf>) -> Vec<Row> {
        match unit {
            Unit::Rig { name, files } => self.rows_of_rig(unit, name, files),
            unit => {
                let file = &unit.files()[0];
                let rows = self.read(file).and_then(|record| self.ask(unit, vec![record], gas_files.get(file)));
                rows.unwrap_or_else(|failure| vec![without_answer(unit, file, &failure)])
            }
        }
    }

    fn rows_of_rig(&self, unit: &Unit, name: &str, files: &[PathBuf]) -> Vec<Row> {
        let (mut records, mut rows) = (Vec::new(), Vec::new());
        for file in files {
            match self.read(file) {
                Ok(record) => records.push(record),
                Err(failure) => rows.push(without_answer(unit, file, &failure)),
            }
        }
        let read: Vec<(String, usize)> = records.iter().map(|record| (record.source.clone(), record.len())).collect();
        let of_rig = if records.is_empty() {
            vec![Row::rig_without_answer(name, 0, Outcome::Unusable, "none of its files can be used")]
        } else {
            self.ask(unit, records, None).unwrap_or_else(|failure| {
                vec![Row::rig_without_answer(name, read.len(), outcome(&failure), &failure.to_string())]
            })
        };
        let outcome = of_rig.iter().find_map(Row::outcome).unwrap_or(Outcome::Failed);
        let has_row = |file: &str| of_rig.iter().any(|row| row.file() == Some(file));
        rows.extend(
            read.iter()
                .filter(|(file, _)| !has_row(file))
                .map(|(file, samples)| Row::with_its_rig(unit, file, *samples, outcome)),
        );
        rows.extend(of_rig);
        // The rig first, which has no file.
        rows.sort_by(|a, b| a.file().cmp(&b.file()));
        rows
    }

    fn read(&self, file: &Path) -> Result<Record, Failure> {
        expect_file(file)?;
        read_watched(file, &self.profile, SILENT)
    }

    /// The rows of what the records of a unit answer.
    fn ask(&self, unit: &Unit, records: Vec<Record>, gas_file: Option<&PathBuf>) -> Result<Vec<Row>, Failure> {
        let records = several::of_one_rig(records, &self.profile, SILENT)?;
        let plausibility = self.physics.plausibility(&records)?;
        let options = self.options.clone();
        let diagnose = |characterise| DiagnoseOptions {
            characterise,
            without: self.without.to_vec(),
            ..DiagnoseOptions::default()
        };
        Ok(match self.verb {
            Verb::Characterise => {
                let model = self.model.as_ref().map(|(path, model)| (*path, model));
                let run = |options: Options| characterise::ask(&records, model, &options, SILENT);
                let answer: Characterisation = plausibility.answer(options, run, |answer| answer)?;
                let outcome = Outcome::of_exit_code(characterise::exit_code(&answer, self.strict));
                Row::of(unit, outcome, &Answer::Characterisation(&answer))
            }
            Verb::Diagnose => {
                let run = |options: Options| diagnose::ask(&records, &diagnose(options), SILENT);
                let answer: Diagnosis = plausibility.answer(options, run, |answer| &mut answer.last)?;
                let outcome = Outcome::of_exit_code(diagnose::exit_code(&answer, self.strict));
                Row::of(unit, outcome, &Answer::Diagnosis(&answer))
            }
            Verb::Compensate => {
                let run = |options: Options| {
                    let options = CompensateOptions {
                        diagnose: diagnose(options),
                        model: self.model.as_ref().map(|(_, model)| model.clone()),
                        form: self.form,
                        trusted: usize::from(self.trust == Trust::T2),
                    };
                    compensate::ask(&records[0], &options, SILENT)
                };
                let answer: Compensation = plausibility.answer(options, run, |answer| &mut answer.last)?;
                let outcome = Outcome::of_exit_code(compensate::exit_code(&answer, self.strict));
                let rows = Row::of(unit, outcome, &Answer::Compensation(&answer));
                match gas_file.filter(|_| answer.gas.is_some()) {
                    Some(path) => {
                        let kept = Kept::of(&unit.files()[0], &self.profile, self.keep, &records[0], SILENT)?;
                        write_gas(&answer, kept.as_ref(), path)?;
                        rows.into_iter().map(|row| row.with_gas_file(path)).collect()
                    }
                    None => rows,
                }
            }
        })
    }
}

/// What the units of a batch are.
fn unit_name(is_grouped: bool) -> &'static str {
    if is_grouped { "rigs" } else { "records" }
}

/// The row of a unit that was not asked, though it should have been.
fn failed(unit: &Unit, reason: &str) -> Row {
    match unit {
        Unit::Rig { name, .. } => Row::rig_without_answer(name, 0, Outcome::Failed, reason),
        unit => Row::without_answer(unit, &unit.files()[0], Outcome::Failed, reason),
    }
}

/// Refuses what is no file: whoever opens a pipe or a device may wait for ever.
fn expect_file(file: &Path) -> Result<(), Failure> {
    let wrong = |what: String| Failure::File(format!("{}: {what}", file.display()));
    let about = fs::metadata(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    match (about.is_file(), about.is_dir()) {
        (true, _) => Ok(()),
        (_, true) => Err(wrong("this folder cannot be listed: check its permissions".to_owned())),
        _ => Err(wrong("expected a file, found a pipe or a device".to_owned())),
    }
}

fn write_gas(answer: &Compensation, kept: Option<&Kept>, path: &Path) -> Result<(), Failure> {
    if let Some(folder) = path.parent() {
        let wrong = |error| Failure::Other(format!("{}: cannot be created: {error}", folder.display()));
        fs::create_dir_all(folder).map_err(wrong)?;
    }
    compensate::write_gas(answer, kept, path, false)
}

fn without_answer(unit: &Unit, file: &Path, failure: &Failure) -> Row {
    Row::without_answer(unit, file, outcome(failure), &failure.to_string())
}

fn outcome(failure: &Failure) -> Outcome {
    Outcome::of_exit_code(failure.exit_code())
}

fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(ending);
    name.into()
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|is| is.eq_ignore_ascii_case(ending))
}

fn is_parquet(path: &Path) -> bool {
    has_ending(path, "parquet")
}

/// What `twinlag batch` prints with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct BatchAnswer {
    /// `twinlag.batch/1`.
    schema: &'static str,
    /// Files of the table.
    out: Vec<PathBuf>,
    /// `records` or `rigs`: what one answer is for.
    units: &'static str,
    /// Number of records or rigs that answered.
    answered: usize,
    /// Number of records or rigs that were read, but of which at least one number that was asked for may not be used.
    undetermined: usize,
    /// Number of records or rigs whose files cannot be used, or to which what was asked does not apply.
    unusable: usize,
    /// Number of records or rigs with another error, such as an output that cannot be written.
    failed: usize,
    /// Number of files that cannot be used, or to which what was asked does not apply, those of rigs included.
    unusable_files: usize,
    /// Number of records that contradict the others of their rig.
    contradicting_records: usize,
}

/// Says what came of it.
fn say(command: &Batch, unit_name: &'static str, fleet: &Fleet, console: Console) -> Result<(), Failure> {
    let counts = &fleet.units;
    if console.json {
        return print::json(&BatchAnswer {
            schema: "twinlag.batch/1",
            out: command.out.clone(),
            units: unit_name,
            answered: counts.answered,
            undetermined: counts.undetermined,
            unusable: counts.unusable,
            failed: counts.failed,
            unusable_files: fleet.unusable_files,
            contradicting_records: fleet.contradicting.len(),
        });
    }
    let names: Vec<String> = command.out.iter().map(|out| out.display().to_string()).collect();
    let unit = if counts.total() == 1 { unit_name.trim_end_matches('s') } else { unit_name };
    let mut lines = vec![format!(
        "{}: {} {}: {} answered, {} undetermined, {} unusable, {} failed",
        names.join(", "),
        counts.total(),
        unit,
        counts.answered,
        counts.undetermined,
        counts.unusable,
        counts.failed
    )];
    lines.extend(members(fleet));
    if fleet.members.len() > SHOWN {
        lines.extend(fleet.verdicts.iter().map(|(verdict, count)| format!("  {count} {verdict}")));
    }
    let reasons = fleet.reasons.iter().take(REASONS);
    lines.extend(reasons.map(|reason| format!("  {} without an answer: {}", reason.count, reason.reason)));
    if fleet.reasons.len() > REASONS {
        lines.push(format!("  and {} other reasons: see column reason", fleet.reasons.len() - REASONS));
    }
    // Names of files are the user's, and may hold anything.
    let plain = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let lines: Vec<String> = lines.iter().map(|line| line.chars().map(plain).collect()).collect();
    print::on_stdout(&(lines.join("\n") + "\n"))
}

/// Members up to which each is shown on the console; chosen, so that they fit on one screen.
const SHOWN: usize = 20;
/// Reasons that are shown on the console, the most frequent; chosen, so that they fit on one screen with the members.
const REASONS: usize = 5;

/// Both time constants of each member with their grades, where there are few.
fn members(fleet: &Fleet) -> Vec<String> {
    if fleet.members.is_empty() || fleet.members.len() > SHOWN {
        return Vec::new();
    }
    let has_verdict = fleet.members.iter().any(|member| !member.verdict.is_empty());
    let cells = |name: &str, taus: [String; 2], verdict: String| {
        let verdict = Some(verdict).filter(|_| has_verdict);
        [name.to_owned()].into_iter().chain(taus).chain(verdict).collect::<Vec<String>>()
    };
    let header = cells("", ["T1", "T2"].map(str::to_owned), "verdict".to_owned());
    let row = |member: &Member| {
        let taus = member.tau.map(|tau| match tau {
            Some(MemberTau { value_s, interval_95_s: [low, high], is_go, .. }) => {
                let grade = if is_go { Grade::Go } else { Grade::Conditional };
                format!("{}  {grade}", print::interval(value_s, low, high, " s"))
            }
            None => "not given".to_owned(),
        });
        let effects = if member.effects.is_empty() { String::new() } else { format!(": {}", member.effects) };
        cells(&member.name, taus, format!("{}{effects}", member.verdict))
    };
    let rows: Vec<Vec<String>> = [header].into_iter().chain(fleet.members.iter().map(row)).collect();
    columns(&rows, |_| true).into_iter().map(|line| format!("  {line}")).collect()
}

/// A batch whose outputs are there depends on how the program was called.
impl From<BatchError> for Failure {
    fn from(error: BatchError) -> Self {
        let text = error.to_string();
        match error {
            BatchError::Exists { .. } => Self::Usage(format!("{text} (options --resume, --force)")),
            BatchError::OtherQuestion { .. } => Self::Usage(format!("{text} (option --force)")),
            BatchError::Pattern { .. } | BatchError::GroupBy { .. } => Self::Usage(text),
            BatchError::Damaged { .. } => Self::File(format!("{text} (option --force)")),
            BatchError::Incomplete { .. } => Self::NotYet(format!("{text} (options --shard, --resume)")),
            BatchError::NothingFound { .. }
            | BatchError::Empty { .. }
            | BatchError::NoJournal { .. }
            | BatchError::DamagedManifest { .. }
            | BatchError::DamagedPart { .. }
            | BatchError::NoUnicode { .. }
            | BatchError::Foreign { .. }
            | BatchError::Twice { .. } => Self::File(text),
            _ => Self::Other(text),
        }
    }
}
