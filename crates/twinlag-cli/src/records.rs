//! What each of several records has for itself, as a table.

use twinlag::{Diagnosis, DisagreementAnswer, EffectInPlace, LeftOutUnit, RecordAnswer};
use twinlag_pages::parameter_in_words;

use crate::columns::columns;
use crate::print::{digits, interval};

/// The table, after an empty line; nothing of a single record.
pub(crate) fn lines(answer: &Diagnosis) -> Vec<String> {
    let Some(transfer) = answer.transfer.as_ref().filter(|transfer| transfer.left_out == LeftOutUnit::Record) else {
        return Vec::new();
    };
    let mut lines = vec![
        String::new(),
        "on a record that had no part in finding the model (rms of the whitened residual):".to_owned(),
    ];
    let header = ["record", "two lags", "with effects", "effects that the others show", "agrees"].map(str::to_owned);
    let row = |name: &str, before: f64, after: f64, found: String, agrees: &str| {
        vec![name.to_owned(), digits(before, 4), digits(after, 4), found, agrees.to_owned()]
    };
    let of_record = |record: &RecordAnswer| {
        let rms = record.error.held_out_normalised_rms;
        let agrees = match record.agrees {
            Some(true) => "yes",
            Some(false) => "no",
            None => "not known",
        };
        row(&record.source, rms.before, rms.after, effects(&record.found_on_others), agrees)
    };
    let rms = transfer.error.held_out_normalised_rms;
    let all = row("all", rms.before, rms.after, String::new(), "");
    let rows: Vec<Vec<String>> =
        [header.to_vec()].into_iter().chain(answer.records.iter().map(of_record)).chain([all]).collect();
    lines.extend(columns(&rows, |column| ![1, 2].contains(&column)).into_iter().map(|line| format!("  {line}")));
    for record in &answer.records {
        lines.extend(own(record));
        lines.extend(record.disagreements.iter().map(|one| disagreement(&record.source, one)));
        if record.agrees == Some(false) && record.disagreements.is_empty() {
            lines.push(format!(
                "  {} contradicts the others: it is explained alone, and they are without it, but not together",
                record.source
            ));
        }
    }
    lines
}

fn effects(found: &[EffectInPlace]) -> String {
    if found.is_empty() {
        return "-".to_owned();
    }
    found.iter().map(in_place).collect::<Vec<_>>().join(", ")
}

fn in_place(EffectInPlace { effect, channel, .. }: &EffectInPlace) -> String {
    channel.as_ref().map_or_else(|| effect.to_string(), |channel| format!("{effect} in {channel}"))
}

/// Numbers of the record alone.
fn own(record: &RecordAnswer) -> Vec<String> {
    let number = |own: &twinlag::RecordNumber| {
        let unit = if own.unit == "1" { String::new() } else { format!(" {}", own.unit) };
        let value = match own.interval_95 {
            Some([low, high]) => interval(own.value, low, high, &unit),
            None => format!("{}{unit}", digits(own.value, 4)),
        };
        format!("  {} alone: {} of {} {value}", record.source, parameter_in_words(&own.name), in_place(&own.of))
    };
    record.own.iter().map(number).collect()
}

fn disagreement(source: &str, one: &DisagreementAnswer) -> String {
    let what = match &one.of {
        Some(effect) => format!("{} of {}", parameter_in_words(&one.name), in_place(effect)),
        None => format!("the time constant of {}", one.name),
    };
    let unit = if one.unit == "1" { String::new() } else { format!(" {}", one.unit) };
    format!(
        "  {source} contradicts the others: it gives {what} as {} ± {}{unit}, and they give {} ± {}{unit}",
        digits(one.value, 4),
        digits(one.standard_error, 2),
        digits(one.others, 4),
        digits(one.others_standard_error, 2)
    )
}
