//! `twinlag plan RIG_OR_DIAGNOSIS`: what the next record would have to be.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use twinlag::signal::Rig;
use twinlag::{Diagnosis, Model};
use twinlag_pages::{parameter_in_words, unit_suffix};
use twinlag_plan::{Plan, PlanError, PlanStatus, PlannedNumber, PlannedRecord, PlannedRival, Source};

use crate::arguments::Plan as Command;
use crate::columns::columns;
use crate::console::Console;
use crate::failure::Failure;
use crate::print::{self, digits};
use crate::progress::Progress;
use crate::simulate;

/// What `twinlag plan` prints with --json.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum PlanAnswer {
    /// What records are expected to give.
    Planned(Box<Plan>),
    /// Why there is nothing to plan with.
    NotPlanned {
        /// `twinlag.plan/1`.
        schema: String,
        /// `not-identifiable`.
        status: PlanStatus,
        /// Why.
        because: String,
    },
}

pub(crate) fn run(command: &Command, console: Console) -> Result<u8, Failure> {
    let subject = Subject::read(&command.file)?;
    let planned = {
        let _progress = Progress::start(console, "planning".to_owned());
        match &subject {
            Subject::Rig(rig) => Plan::of_rig(rig),
            Subject::Model(model) => Plan::of_model(model),
        }
    };
    let plan = match planned {
        Ok(plan) => plan,
        Err(PlanError::NoTimeConstant { channel }) => {
            // Here the option can be shown as it would be typed to `diagnose`.
            let example = format!("--known {channel}.time_constant_s=0.5");
            let error = PlanError::NoTimeConstant { channel };
            if console.json {
                print::json(&PlanAnswer::NotPlanned {
                    schema: Plan::SCHEMA.to_owned(),
                    status: PlanStatus::NotIdentifiable,
                    because: error.to_string(),
                })?;
            }
            return Err(Failure::Undetermined(format!("{}: {error} (for example {example})", command.file.display())));
        }
        Err(error) => return Err(Failure::File(format!("{}: {error}", command.file.display()))),
    };
    let code = if plan.status == PlanStatus::Ok { 0 } else { 4 };
    if console.json {
        print::json(&PlanAnswer::Planned(Box::new(plan)))?;
    } else {
        let text = text(&plan, &command.file);
        print::on_stdout(&text)?;
    }
    Ok(code)
}

/// What is planned for.
enum Subject {
    Rig(Box<Rig>),
    Model(Box<Model>),
}

/// What can be planned.
const EXPECTED: &str =
    "expected a rig in TOML, a model written by `twinlag diagnose --save`, or the output of `twinlag diagnose --json`";

/// What every JSON of this program begins with.
#[derive(Deserialize)]
struct Schema {
    schema: String,
}

impl Subject {
    /// A rig where the file is TOML, what a diagnosis found where it is JSON.
    fn read(file: &Path) -> Result<Self, Failure> {
        let wrong = |what: String| Failure::File(format!("{}: {what}", file.display()));
        let text = std::fs::read_to_string(file).map_err(|e| wrong(format!("cannot be read: {e}")))?;
        if !text.trim_start().starts_with('{') {
            let rig = simulate::read(file).map_err(|failure| match failure {
                Failure::File(text) => Failure::File(format!("{}\n{EXPECTED}", text.trim_end())),
                other => other,
            });
            return Ok(Self::Rig(Box::new(rig?)));
        }
        let not_json = |e: serde_json::Error| wrong(format!("{e}\n{EXPECTED}"));
        let Schema { schema } = serde_json::from_str(&text).map_err(not_json)?;
        let model = match schema.as_str() {
            Model::SCHEMA => serde_json::from_str(&text).map_err(not_json)?,
            Diagnosis::SCHEMA => serde_json::from_str::<Diagnosis>(&text).map_err(not_json)?.model(),
            other => {
                return Err(wrong(format!("expected schema {} or {}, got {other}", Model::SCHEMA, Diagnosis::SCHEMA)));
            }
        };
        Ok(Self::Model(Box::new(model)))
    }
}

fn text(plan: &Plan, file: &Path) -> String {
    let now = &plan.as_it_is;
    let of = match plan.source {
        Source::Diagnosis => "the sensors and the gas that a diagnosis found",
        _ => "the rig as described",
    };
    let mut lines = vec![format!(
        "{}: {of}, {} samples, {} s apart; the gas deviates by {} K, noise {} and {} K",
        file.display(),
        now.samples,
        digits(now.sample_period_s, 4),
        digits(plan.gas_std_k, 3),
        digits(plan.noise_std_k[0], 3),
        digits(plan.noise_std_k[1], 3),
    )];
    lines.push(String::new());
    lines.push("assumed, with the standard error expected of the record as it is:".to_owned());
    lines.extend(now.numbers.iter().map(|number| format!("  {}", assumed(number))));
    lines.push(String::new());
    lines.push("expected standard errors beside those of the record as it is:".to_owned());
    let header = std::iter::once("record".to_owned()).chain(now.numbers.iter().map(name));
    let row = |record: &PlannedRecord| {
        let cells = record.numbers.iter().map(over_now);
        std::iter::once(record.description.clone()).chain(cells).collect::<Vec<_>>()
    };
    lines.extend(table(&std::iter::once(header.collect()).chain(plan.changed.iter().map(row)).collect::<Vec<_>>()));
    let mut first = 0;
    for rivals in now.rivals.chunk_by(|a, b| (&a.effect, &a.channel) == (&b.effect, &b.channel)) {
        let places = first..first + rivals.len();
        first = places.end;
        lines.push(String::new());
        lines.push(format!(
            "expected deviance between {} and what looks like it (deciding: {}; clear: two standard deviations more):",
            rivals[0].effect_in_words(),
            digits(plan.deciding_deviance, 2)
        ));
        let header = std::iter::once("record".to_owned()).chain(rivals.iter().map(PlannedRival::rival_in_words));
        let row = |record: &PlannedRecord| {
            let cells = record.rivals.get(places.clone()).unwrap_or_default().iter().map(deviance);
            std::iter::once(record.description.clone()).chain(cells).collect::<Vec<_>>()
        };
        let all = std::iter::once(now).chain(&plan.changed);
        lines.extend(table(&std::iter::once(header.collect()).chain(all.map(row)).collect::<Vec<_>>()));
    }
    lines.push(String::new());
    lines.push("advice:".to_owned());
    lines.extend(plan.advice.iter().map(|line| format!("  {line}")));
    lines.push(String::new());
    lines.push("what no change of the record reveals: twinlag explain two-sensors".to_owned());
    lines.extend(plan.remarks.iter().map(|remark| format!("remark: {remark}")));
    lines.join("\n") + "\n"
}

fn name(number: &PlannedNumber) -> String {
    let place = |text: String| match &number.channel {
        Some(channel) => format!("{text} of {channel}"),
        None => text,
    };
    match number.name.as_str() {
        "time_constant_s" => place("time constant".to_owned()),
        "time_constant_difference_s" => "their difference".to_owned(),
        other => place(parameter_in_words(other)),
    }
}

fn assumed(number: &PlannedNumber) -> String {
    let unit = unit_suffix(&number.unit);
    match number.standard_error {
        Some(error) => format!("{}: {}{unit} ± {}{unit}", name(number), digits(number.value, 4), digits(error, 2)),
        None => format!("{}: {}{unit}, not determined", name(number), digits(number.value, 4)),
    }
}

fn over_now(number: &PlannedNumber) -> String {
    match (number.over_now, number.standard_error) {
        (Some(ratio), Some(_)) => format!("× {ratio:.2}"),
        (_, Some(error)) => format!("± {}", digits(error, 2)),
        _ => "not determined".to_owned(),
    }
}

fn deviance(rival: &PlannedRival) -> String {
    let clear = if rival.is_distinguished { " clear" } else { "" };
    format!("{:.1} ± {:.1}{clear}", rival.deviance, rival.standard_deviation)
}

/// A table whose rows are named in the first column.
fn table(rows: &[Vec<String>]) -> impl Iterator<Item = String> {
    columns(rows, |column| column == 0).into_iter().map(|line| format!("  {line}"))
}
