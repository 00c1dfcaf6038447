//! What one process of the bench does, and what it takes.

use std::hint::black_box;
use std::path::Path;
use std::str::FromStr;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rustix::time::{ClockId, clock_gettime};
use twinlag::compensation::{Rig, Sensor, Stream, Term};
use twinlag::record::{ColumnRef, Record, Selection};
use twinlag::{
    CompensateOptions, DiagnoseOptions, Model, Options, TrackOptions, characterise, compensate, diagnose, track,
};
use twinlag_transform::{Forward, sine_transform};

use super::Took;
use crate::bench::peak_mb;

const COMPENSATE_BY_MODEL: &str = "compensate --model";

/// A verb whose growth is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verb {
    Read,
    Characterise,
    Diagnose,
    Compensate,
    /// By the model of two lags, without a diagnosis.
    CompensateByModel,
    Track,
}

impl Verb {
    pub(crate) const ALL: [Self; 6] =
        [Self::Read, Self::Characterise, Self::Diagnose, Self::Compensate, Self::CompensateByModel, Self::Track];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Characterise => "characterise",
            Self::Diagnose => "diagnose",
            Self::Compensate => "compensate",
            Self::CompensateByModel => COMPENSATE_BY_MODEL,
            Self::Track => "track",
        }
    }

    /// The work that the verb cannot do without.
    pub(crate) fn bare(self) -> Step {
        match self {
            Self::Read => Step::Parse,
            Self::Characterise | Self::Diagnose => Step::Transforms,
            Self::Compensate | Self::CompensateByModel | Self::Track => Step::Filter,
        }
    }
}

/// What a process does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    Verb(Verb),
    /// The verb `diagnose`, on these columns of a measured record.
    Measured([&'static str; 2]),
    /// Splits the file into cells and these into numbers, by crates for nothing else.
    Parse,
    /// Transforms what `characterise` transforms: for two time constants nine series as long as the record.
    Transforms,
    /// Passes the readings through the causal filter of two sensors in a rough gas.
    Filter,
}

impl Step {
    /// The name on the command line.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Verb(verb) => verb.name().into(),
            Self::Measured([one, two]) => format!("measured:{one}:{two}"),
            Self::Parse => "parse".into(),
            Self::Transforms => "transforms".into(),
            Self::Filter => "filter".into(),
        }
    }
}

/// What stands on the command line.
#[derive(Clone, Debug)]
pub(crate) struct Named {
    name: String,
    channels: Option<[String; 2]>,
}

impl FromStr for Named {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(':').map(str::to_owned);
        let name = parts.next().unwrap_or_default();
        let channels = parts.next().zip(parts.next()).map(<[String; 2]>::from);
        Ok(Self { name, channels })
    }
}

impl Named {
    /// Does it and says on standard output what it took. Reading the file counts for nobody but `read` and `parse`.
    pub(crate) fn run(&self, file: &Path) -> Result<()> {
        let record = || -> Result<Record> { Ok(Record::read(file, &self.selection())?) };
        let took = match self.name.as_str() {
            "read" => timed(|| Ok(record()?.len()))?,
            "parse" => timed(|| parse(file))?,
            name => {
                let record = record()?;
                timed(|| on(name, &record).map(|()| record.len()))?
            }
        };
        println!("{}", serde_json::to_string(&took)?);
        Ok(())
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The columns that it names, if any.
    pub(crate) fn selection(&self) -> Selection {
        let [t1, t2] = [0, 1].map(|i| self.channels.as_ref().map(|names| ColumnRef::Name(names[i].clone())));
        Selection { t1, t2, ..Selection::default() }
    }
}

/// Does the work of a step on a record.
pub(crate) fn on(name: &str, record: &Record) -> Result<()> {
    match name {
        "characterise" => drop(black_box(characterise(record, &Options::default())?)),
        "diagnose" | "measured" => drop(black_box(diagnose(record, &DiagnoseOptions::default())?)),
        "compensate" => drop(black_box(compensate(record, &CompensateOptions::default())?)),
        COMPENSATE_BY_MODEL => {
            let model = Some(Model::of_two_lags(record.channels.clone()));
            drop(black_box(compensate(record, &CompensateOptions { model, ..CompensateOptions::default() })?));
        }
        "track" => drop(black_box(track(record, &TrackOptions::default())?)),
        "transforms" => transforms(record),
        "filter" => filter(record)?,
        _ => bail!("there is no step {name}"),
    }
    Ok(())
}

/// Processor time of all threads of this process so far, s.
pub(crate) fn processor_s() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec.unsigned_abs() as u32).as_secs_f64()
}

fn timed(work: impl FnOnce() -> Result<usize>) -> Result<Took> {
    let (start, before_s) = (Instant::now(), processor_s());
    let rows = work()?;
    Ok(Took { rows, wall_s: start.elapsed().as_secs_f64(), processor_s: processor_s() - before_s, peak_mb: peak_mb() })
}

fn parse(file: &Path) -> Result<usize> {
    let mut reader = csv::Reader::from_path(file)?;
    let mut columns = vec![Vec::new(); reader.byte_headers()?.len()];
    let mut row = csv::ByteRecord::new();
    while reader.read_byte_record(&mut row)? {
        for (column, cell) in columns.iter_mut().zip(&row) {
            column.push(fast_float2::parse::<f64, _>(cell)?);
        }
    }
    Ok(black_box(columns).first().map_or(0, Vec::len))
}

/// Sine transforms of both channels, of the residual, and of the residual with both derivatives for the scatter by frequency; Fourier
/// transforms of both inferred inputs for the noise, and of a channel for tones.
fn transforms(record: &Record) {
    for series in [&record.t1_c, &record.t2_c, &record.t1_c, &record.t2_c, &record.t1_c, &record.t2_c] {
        black_box(sine_transform(series));
    }
    for series in [&record.t1_c, &record.t2_c, &record.t1_c] {
        black_box(Forward::of(series.len()).transform(series));
    }
}

fn filter(record: &Record) -> Result<()> {
    const STATES: usize = 4;
    let rig = Rig::new([0.03, 0.11].map(|tau_s| Sensor::new(tau_s, 0.1)));
    let terms = [Term::Rough { std_k: 8.0, corner_hz: 5.0 }];
    let stream = Stream::<STATES>::new(&rig, 300.0, &terms, record.sampling.period_s);
    let mut stream = stream.context("the states are enough")?;
    for (t1_c, t2_c) in record.t1_c.iter().zip(record.t2_c.iter()) {
        black_box(stream.push([Some(*t1_c), Some(*t2_c)]));
    }
    Ok(())
}
