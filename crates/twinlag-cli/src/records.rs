//! What each of several records has for itself, as a table.

use twinlag::{Characterisation, Diagnosis, EffectInPlace, LeftOutUnit, OwnTimeConstant, RecordAnswer, SensorEstimate};
use twinlag_pages::{contradictions_in_words, parameter_in_words, unit_suffix};

use crate::columns::columns;
use crate::print::{digits, interval};

/// Two lags on each record, after an empty line; nothing of a single record.
pub(crate) fn of_characterisation(answer: &Characterisation) -> Vec<String> {
    let Some(transfer) = &answer.transfer else { return Vec::new() };
    let header = ["record", "rms", "agrees"].map(str::to_owned);
    let row = |name: &str, rms: f64, agrees: &str| vec![name.to_owned(), digits(rms, 4), agrees.to_owned()];
    let of_record = |record: &RecordAnswer| {
        row(&record.source, record.error.held_out_normalised_rms.after, in_words(record.agrees))
    };
    let all = row("all", transfer.error.held_out_normalised_rms.after, "");
    let rows: Vec<Vec<String>> =
        [header.to_vec()].into_iter().chain(answer.records.iter().map(of_record)).chain([all]).collect();
    let mut lines = vec![
        String::new(),
        "on a record with the time constants of the others (rms of the whitened residual):".to_owned(),
    ];
    lines.extend(indented(&rows, |column| column != 1));
    lines.extend(each(&answer.records, &answer.sensors));
    lines
}

/// The model on each record, after an empty line; nothing of a single record.
pub(crate) fn of_diagnosis(answer: &Diagnosis) -> Vec<String> {
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
        row(&record.source, rms.before, rms.after, effects(&record.found_on_others), in_words(record.agrees))
    };
    let rms = transfer.error.held_out_normalised_rms;
    let all = row("all", rms.before, rms.after, String::new(), "");
    let rows: Vec<Vec<String>> =
        [header.to_vec()].into_iter().chain(answer.records.iter().map(of_record)).chain([all]).collect();
    lines.extend(indented(&rows, |column| ![1, 2].contains(&column)));
    lines.extend(each(&answer.records, &answer.last.sensors));
    lines
}

fn in_words(agrees: Option<bool>) -> &'static str {
    match agrees {
        Some(true) => "yes",
        Some(false) => "no",
        None => "not known",
    }
}

fn indented(rows: &[Vec<String>], is_text: impl Fn(usize) -> bool) -> impl Iterator<Item = String> {
    columns(rows, is_text).into_iter().map(|line| format!("  {line}"))
}

/// What each record says by itself, and where it contradicts the others.
fn each(records: &[RecordAnswer], sensors: &[SensorEstimate; 2]) -> Vec<String> {
    let [one, two] = sensors.each_ref().map(|sensor| sensor.channel.as_str());
    let are_given = records.iter().any(|record| record.time_constants.iter().any(Option::is_some));
    let (title, mut header) = if are_given {
        let title = "what each record says by itself, with standard errors, the rest of the model at its best:";
        (title, vec!["record".to_owned(), format!("time constant of {one}"), format!("of {two}")])
    } else {
        ("the noise of each record:", vec!["record".to_owned()])
    };
    header.extend([format!("noise of {one}"), format!("of {two}")]);
    let of_record = |record: &RecordAnswer| {
        let time_constants = record.time_constants.map(own_time_constant).into_iter().filter(|_| are_given);
        let noise = record.noise_std_k.map(|std_k| format!("{} K", digits(std_k, 3)));
        [record.source.clone()].into_iter().chain(time_constants).chain(noise).collect()
    };
    let rows: Vec<Vec<String>> = [header].into_iter().chain(records.iter().map(of_record)).collect();
    let mut lines = vec![String::new(), title.to_owned()];
    lines.extend(indented(&rows, |_| true));
    lines.extend(records.iter().flat_map(own));
    lines.extend(contradictions_in_words(records).into_iter().map(|line| format!("  {line}")));
    lines
}

fn own_time_constant(own: Option<OwnTimeConstant>) -> String {
    own.map_or("-".to_owned(), |own| format!("{} ± {} s", digits(own.value_s, 4), digits(own.standard_error_s, 2)))
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
        let unit = unit_suffix(&own.unit);
        let value = match own.interval_95 {
            Some([low, high]) => interval(own.value, low, high, &unit),
            None => format!("{}{unit}", digits(own.value, 4)),
        };
        format!("  {} alone: {} of {} {value}", record.source, parameter_in_words(&own.name), in_place(&own.of))
    };
    record.own.iter().map(number).collect()
}
