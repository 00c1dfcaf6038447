//! A diagnosis as a page: what was found, how well it is shown, what it changes, and what stays
//! open, with pictures.

mod budget;
mod evidence;
mod if_known;
mod likelihood;
mod limits;
mod numbers;
mod records;
mod series;
mod verdict;

use twinlag::diagnosis::Diagnosis as Core;
use twinlag::record::Record;
use twinlag::{Characterisation, Diagnosis};
use twinlag_report::{Document, ReportError};

use crate::Making;
use crate::figures::{self, PlottedModel};
use crate::making::{file_names, notes};
use crate::residual_figures::frequency_figure;

const BEFORE: &str = "two first-order lags";
const AFTER: &str = "with the effects";

/// The report on the diagnosis of `record`: an HTML page that needs no other file. Equal answers
/// give equal bytes. Its numbers are those of the answer; its pictures need the series of
/// [`Diagnosis::core`], and an answer that was read from JSON has none.
///
/// # Errors
/// [`ReportError`] if something cannot be drawn. What a diagnosis does not determine, up to one
/// that was refused, is said in the report and is no error.
pub fn diagnosis_report(record: &Record, answer: &Diagnosis, making: &Making) -> Result<String, ReportError> {
    let page = Page { record, answer, changed: has_two_models(answer) };
    let base = &answer.base;
    let mut document = Document::new(format!("Diagnosis of {}", file_names(&record.source, &answer.records)));
    document = page.first_screen(document, making)?;
    if making.is_first_screen {
        return Ok(making.page(&document));
    }
    document = page.found(document);
    document = page.traces(document)?;
    document = page.residual(document)?;
    document = page.evidence(document);
    document = page.numbers(document)?;
    document = page.budget(document);
    document = page.likelihood(document)?;
    document = page.records(document)?;
    document = page.if_known(document)?;
    document = page.errors(document);
    document = page.tests(document)?;
    document = page.unexplained(document);
    document = page.unknowable(document);
    document = making.reproduction(document, &base.made_by.program, &base.made_by.version);
    Ok(making.page(&notes(document, &base.notes)))
}

/// Power of the residual against frequency, before and after, as SVG; `None` if the answer has no
/// residual, as one that was read from JSON.
///
/// # Errors
/// [`ReportError`] if it cannot be drawn.
pub fn residual_picture(answer: &Diagnosis) -> Result<Option<String>, ReportError> {
    frequency_figure(&models(answer), "Power of the residual").map(|figure| figure.to_svg()).transpose()
}

/// Whether the answer has a model beside that of two lags: one with effects, or one in which model error that was taken
/// for noise weights the fit.
fn has_two_models(answer: &Diagnosis) -> bool {
    !answer.effects.is_empty() || answer.base.sensors != answer.last.sensors
}

struct Page<'a> {
    record: &'a Record,
    answer: &'a Diagnosis,
    /// Whether there is a before and an after.
    changed: bool,
}

/// A model with its name in tables.
struct Column<'a> {
    name: &'static str,
    column: &'static str,
    answer: &'a Characterisation,
}

/// The models to be shown in pictures: one, if no effect was added; none of an answer without
/// series.
fn models(answer: &Diagnosis) -> Vec<PlottedModel<'_>> {
    let Some(core) = answer.core.as_deref() else { return Vec::new() };
    let before = PlottedModel { name: BEFORE, fit: &core.base, colour: figures::BEFORE };
    let after = PlottedModel { name: AFTER, fit: &core.last, colour: figures::AFTER };
    if has_two_models(answer) { vec![before, after] } else { vec![before] }
}

impl Page<'_> {
    fn channels(&self) -> &[String; 2] {
        &self.record.channels
    }

    fn core(&self) -> Option<&Core> {
        self.answer.core.as_deref()
    }

    fn models(&self) -> Vec<PlottedModel<'_>> {
        models(self.answer)
    }

    /// The models to be shown in tables.
    fn columns(&self) -> Vec<Column<'_>> {
        let before = Column { name: BEFORE, column: "before", answer: &self.answer.base };
        let after = Column { name: AFTER, column: "after", answer: &self.answer.last };
        if self.changed { vec![before, after] } else { vec![Column { column: "value", ..before }] }
    }
}
