//! What each value of the first time constant would make of the record: a table and a curve.

use twinlag::diagnosis::{Held, IfKnown};
use twinlag_report::{Axis, Document, Figure, ReportError, Series, Table, rounded};

use super::Page;
use crate::figures::{CHANNELS, WIDTH_PX, chart};
use crate::words::{ABSENT, interval, parameter_in_words, short, with_unit, words};

impl Page<'_> {
    pub(super) fn if_known(&self, document: Document) -> Result<Document, ReportError> {
        let Some(answer) = &self.answer.if_known else { return Ok(document) };
        let (held, fitted) = (&answer.held, &answer.fitted);
        let excludes = if answer.values.iter().any(|v| v.is_excluded.is_none()) {
            "Something else is left over, which might allow any value, so none is excluded; the deviance is how much \
             worse each explains the record than the best."
        } else {
            "A value is excluded if its residual is larger than that of the best by more than the 95 % point of a \
             likelihood ratio."
        };
        let document = document
            .heading(format!("If the time constant of {held} were known"))
            .paragraph(format!(
                "With the time constant of {held} held at each of these values, everything else was fitted again, with the \
                 effects that were found. {excludes}"
            ))
            .table(table(answer));
        let document = match figure(answer) {
            Some(figure) => document.drawing(
                figure,
                format!("The time constant of {fitted} against that of {held}, with its 95 % interval."),
            )?,
            None => document,
        };
        Ok(document
            .paragraph("A value from a data sheet, given as known with its deviation, narrows this down to one row, unless that is no-go."))
    }
}

fn table(answer: &IfKnown<String>) -> Table {
    let header = [
        answer.held.clone(),
        answer.fitted.clone(),
        "95 % interval".into(),
        "grade".into(),
        "difference".into(),
        "gas differs from the faster sensor by".into(),
        "effects".into(),
        "record".into(),
    ];
    answer.values.iter().fold(Table::new(header), |table, v| {
        table.row([
            with_unit(&rounded(v.time_constant_s, 2), "s"),
            v.other.value_s.map_or(ABSENT.into(), |t| with_unit(&rounded(t, 3), "s")),
            interval(v.other.interval_95_s),
            v.judgement.grade.to_string(),
            interval(v.difference.interval_95_s),
            with_unit(&rounded(v.gas_change_k, 2), "K"),
            effects(v),
            match v.is_excluded {
                Some(true) => "excludes it".to_owned(),
                Some(false) => "allows it".to_owned(),
                None => format!("deviance {}", rounded(v.deviance, 2)),
            },
        ])
    })
}

/// The first parameter of each effect that is not noise.
fn effects(held: &Held<String>) -> String {
    let of_effect = held.effects.iter().filter(|e| !e.effect.is_noise()).filter_map(|e| {
        let p = e.parameters.first()?;
        let number = with_unit(&rounded(p.value, 3), &p.unit);
        Some(format!("{}: {} {number}", words(e.effect), parameter_in_words(&p.name)))
    });
    of_effect.collect::<Vec<_>>().join(", ")
}

/// The curve, where there are numbers that may be used; `None` if there is none.
fn figure(answer: &IfKnown<String>) -> Option<Figure> {
    let given = answer.values.iter().filter_map(|v| {
        let [low, high] = v.other.interval_95_s.unwrap_or([f64::NAN; 2]);
        Some((v.time_constant_s, v.other.value_s?, low, high))
    });
    let (x, y, low, high) = given.collect::<(Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>)>();
    let axes = [&answer.held, &answer.fitted]
        .map(|channel| Axis::logarithmic(format!("time constant of {} (s)", short(channel))));
    let series = (!x.is_empty()).then(|| Series::points("", x, y).interval(low, high).colour(CHANNELS[1]));
    Some(Figure::new("").columns(1).panel_size(WIDTH_PX, 320.0).panel(chart("", axes, [series])?))
}
