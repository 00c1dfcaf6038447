//! `twinlag schema NAME`: what the JSON of an answer looks like, as JSON Schema.

use clap::ValueEnum;
use schemars::generate::SchemaSettings;
use twinlag::{Characterisation, Compensation, Diagnosis, Inspection, Model, Track};

use crate::batch::BatchAnswer;
use crate::failure::Failure;
use crate::plan::PlanAnswer;
use crate::print;
use crate::shards::BatchPart;
use crate::simulate::Simulation;
use crate::study::{StudyAnswer, StudyPart, StudyPlan};
use crate::submission::{SubmissionAnswer, SubmissionStatus};

/// What can be described.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Name {
    /// The answer of `characterise`.
    Characterisation,
    /// The answer of `diagnose`.
    Diagnosis,
    /// The answer of `compensate`, without its series, which are in the file of `--out`.
    Compensation,
    /// The answer of `track`, without its series.
    Track,
    /// What `--save` writes.
    Model,
    /// The answer of `inspect`.
    Inspection,
    /// The answer of `batch`; its table is described in the book.
    Batch,
    /// The answer of `batch` with --shard.
    BatchPart,
    /// The answer of `plan`.
    Plan,
    /// The answer of `simulate`.
    Simulation,
    /// The answer of `study run` and `study merge`.
    Study,
    /// The answer of `study run` with --shard.
    StudyPart,
    /// The answer of `study plan`.
    StudyPlan,
    /// The answer of `study submit` and `study resubmit`, and of `batch` with --engine and --resubmit.
    Submission,
    /// The answer of `study status` and of `batch` with --status.
    SubmissionStatus,
}

/// Prints the schema, of draft 2020-12.
pub(crate) fn run(name: Name) -> Result<u8, Failure> {
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let schema = match name {
        Name::Characterisation => generator.into_root_schema_for::<Characterisation>(),
        Name::Diagnosis => generator.into_root_schema_for::<Diagnosis>(),
        Name::Compensation => generator.into_root_schema_for::<Compensation>(),
        Name::Track => generator.into_root_schema_for::<Track>(),
        Name::Model => generator.into_root_schema_for::<Model>(),
        Name::Inspection => generator.into_root_schema_for::<Inspection>(),
        Name::Batch => generator.into_root_schema_for::<BatchAnswer>(),
        Name::BatchPart => generator.into_root_schema_for::<BatchPart>(),
        Name::Plan => generator.into_root_schema_for::<PlanAnswer>(),
        Name::Simulation => generator.into_root_schema_for::<Simulation>(),
        Name::Study => generator.into_root_schema_for::<StudyAnswer>(),
        Name::StudyPart => generator.into_root_schema_for::<StudyPart>(),
        Name::StudyPlan => generator.into_root_schema_for::<StudyPlan>(),
        Name::Submission => generator.into_root_schema_for::<SubmissionAnswer>(),
        Name::SubmissionStatus => generator.into_root_schema_for::<SubmissionStatus>(),
    };
    print::json(&schema)?;
    Ok(0)
}
