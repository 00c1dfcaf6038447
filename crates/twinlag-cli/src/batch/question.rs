//! What a batch asks of each unit, and the rows that come of it.

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use twinlag::compensation::Form;
use twinlag::diagnosis::Identifier;
use twinlag::record::{ColumnRef, Record};
use twinlag::{Characterisation, CompensateOptions, Compensation, DiagnoseOptions, Diagnosis, Kept, Model, Options};
use twinlag_batch::{Answer, Found, GroupBy, Outcome, Row, Unit, Verb as RowVerb, each, grouped, map};

use super::{Batch, GAS_ENDING, SILENT, Verb, unit_name};
use crate::arguments::{Physics, Trust};
use crate::console::Console;
use crate::failure::Failure;
use crate::keep::kept;
use crate::output::with_ending;
use crate::profile::Profile;
use crate::read::{read_watched, table_watched};
use crate::{characterise, compensate, diagnose, progress, several};

/// What is asked of each unit, whatever decides a cell of the table.
pub(super) struct Question<'a> {
    pub(super) verb: Verb,
    profile: Profile,
    options: Options,
    physics: &'a Physics,
    model: Option<(&'a Path, Model)>,
    without: &'a [Identifier],
    form: Form,
    trust: Trust,
    strict: bool,
    pub(super) group_by: Option<&'a GroupBy>,
    gas: Option<&'a Path>,
    keep: &'a [ColumnRef],
}

impl<'a> Question<'a> {
    pub(super) fn of(command: &'a Batch) -> Result<Self, Failure> {
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
    pub(super) fn asked(&self) -> Result<Value, Failure> {
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

    pub(super) fn unit_name(&self) -> &'static str {
        unit_name(self.group_by.is_some())
    }

    pub(super) fn units(&self, files: Vec<PathBuf>, threads: Option<NonZeroUsize>, console: Console) -> Vec<Unit> {
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
    pub(super) fn gas_files(&self, files: &[Found]) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
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
    pub(super) fn rows(&self, unit: &Unit, gas_files: &BTreeMap<PathBuf, PathBuf>) -> Vec<Row> {
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
        let mut records = several::of_one_rig(records, &self.profile, SILENT)?;
        if let (Some((_, model)), [record]) = (&self.model, &mut records[..]) {
            several::with_sensors(record, &model.channels, "the model", &self.profile, SILENT);
        }
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
                        let kept = kept(&unit.files()[0], &self.profile, self.keep, &records[0], SILENT)?;
                        write_gas(&answer, kept.as_ref(), path)?;
                        rows.into_iter().map(|row| row.with_gas_file(path)).collect()
                    }
                    None => rows,
                }
            }
        })
    }
}

/// The rows of a unit that was not asked, though it should have been.
pub(super) fn failed(unit: &Unit, reason: &str) -> Vec<Row> {
    let of_rig = match unit {
        Unit::Rig { name, .. } => Some(Row::rig_without_answer(name, 0, Outcome::Failed, reason)),
        _ => None,
    };
    let of_file = |file: &PathBuf| Row::without_answer(unit, file, Outcome::Failed, reason);
    of_rig.into_iter().chain(unit.files().iter().map(of_file)).collect()
}

/// Refuses what is no file: a folder here is one whose files were not found, and whoever opens a pipe or a device may wait for ever.
fn expect_file(file: &Path) -> Result<(), Failure> {
    let wrong = |what: String| Failure::File(format!("{}: {what}", file.display()));
    let about = fs::metadata(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    match (about.is_file(), about.is_dir()) {
        (true, _) => Ok(()),
        (_, true) => Err(wrong(match fs::read_dir(file) {
            Ok(_) => "a link to a folder that it is in: name the files that are meant".to_owned(),
            Err(error) => format!("this folder cannot be listed: {error}"),
        })),
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
