//! A gas temperature, and time constants along a record, as pages.

use twinlag::diagnosis::Grade;
use twinlag::record::Record;
use twinlag_report::{Document, Figure, ReportError, Table, between, probability, rounded};

use crate::figures::WIDTH_PX;
use crate::pictures::{spectra, temperature_figure, track_picture};
use crate::words::{grade, interval_of, listed, plausibility_in_words, seconds, sentence, with_unit, words};
use twinlag::{Characterisation, Compensation, Track};

/// The report on a gas temperature: an HTML page that needs no other file. Equal answers give equal
/// bytes.
///
/// - `command`: the one that makes it again
///
/// # Errors
/// [`ReportError`], if something cannot be drawn. Where there is no gas temperature the page says
/// why, and that is no error.
pub fn gas_report(record: &Record, answer: &Compensation, command: &str) -> Result<String, ReportError> {
    let document = Document::new(format!("Gas temperature of {}", record.source)).heading("Gas temperature");
    let mut document = plausibility(cautions(document, &answer.last), &answer.last);
    document = match &answer.gas {
        None => document.lead(format!("There is no gas temperature to use: {}.", answer.judgement.because)),
        Some(_) if answer.judgement.grade == Grade::NoGo => {
            document.lead(format!("No go, and drawn only since it was asked for: {}.", answer.judgement.because))
        }
        Some(gas) => document.lead(format!(
            "The gas temperature is known to {} (standard deviation, median), and follows the gas up to {}.",
            with_unit(&rounded(gas.median_std_k, 2), "K"),
            gas.bandwidth_hz
                .map_or("no frequency: it moves less than the noise".into(), |hz| with_unit(&rounded(hz, 3), "Hz"))
        )),
    };
    for warning in &answer.warnings {
        document = document.warning(sentence(warning));
    }
    if let Some(gas) = &answer.gas {
        let effects: Vec<String> = answer.effects.iter().map(|e| words(e.effect)).collect();
        let mut facts = vec![
            ("Grade", grade(&answer.judgement)),
            (
                "Model",
                if effects.is_empty() {
                    "two first-order lags".into()
                } else {
                    format!("two lags, and {}", listed(&effects))
                },
            ),
            ("Its parameters' share of the standard deviation", with_unit(&rounded(gas.parameter_std_k, 2), "K")),
            ("Bands are multiplied by", rounded(gas.widened_by, 3)),
        ];
        if let Some(reference) = &gas.reference {
            facts.push((
                "Error against the reference",
                format!("{} rms", with_unit(&rounded(reference.rmse_k, 3), "K")),
            ));
            facts.push((
                "Error of the uncorrected faster sensor",
                format!("{} rms", with_unit(&rounded(reference.raw_rmse_k, 3), "K")),
            ));
            facts.push(("Reference inside the 95 % band", with_unit(&rounded(100.0 * reference.inside_95, 3), "%")));
        }
        document = document.facts(facts).figure(
            temperature_figure(record, answer, "").to_svg()?,
            "Readings, and the gas temperature with its 95 % band. Below, enlarged, the part where it moves most.",
        );
        let spectra = Figure::new("").columns(1).panel_size(WIDTH_PX, 260.0).panel(spectra(record, answer));
        document = document.heading("Before and after").figure(
            spectra.to_svg()?,
            "Spectra of the faster sensor's reading, of the gas temperature, and of the noise that the \
             inferred gas temperature would have without the prior. The lag is compensated up to the line; \
             beyond it the answer follows from the prior of the gas, not from the readings.",
        );
    }
    Ok(end(numbers(document, &answer.last), &answer.last, command))
}

/// The report on time constants along a record, like [`gas_report`].
///
/// # Errors
/// As [`gas_report`].
pub fn track_report(record: &Record, answer: &Track, command: &str) -> Result<String, ReportError> {
    let lead = match (answer.change.as_str(), answer.coefficients, &answer.step) {
        _ if answer.time_s.is_empty() => {
            format!("There are no time constants along this record to use: {}.", answer.judgement.because)
        }
        _ if answer.judgement.grade == Grade::NoGo => {
            format!("No go, and drawn only since it was asked for: {}.", answer.judgement.because)
        }
        ("smooth", Some(size), _) => {
            format!("Both time constants change smoothly along the record: {size} coefficients describe it.")
        }
        ("step", _, Some(step)) => format!(
            "Both time constants change by a factor of {} at {}, between {} (95 %).",
            rounded(step.factor, 3),
            with_unit(&rounded(step.at_s, 5), "s"),
            with_unit(&between(step.interval_95_s), "s")
        ),
        ("windows", _, _) => format!("Each of {} windows is characterised separately.", answer.time_s.len()),
        _ => "No change of the time constants is detected.".into(),
    };
    let document = Document::new(format!("Time constants along {}", record.source));
    let document = document.heading("Time constants along the record");
    let mut document = cautions(document, &answer.last).lead(lead);
    for warning in &answer.warnings {
        document = document.warning(sentence(warning));
    }
    let mut facts = vec![("Grade", grade(&answer.judgement))];
    // That nothing changes is not claimed under a model that is contradicted.
    if let Some(ratio) = answer.ratio.filter(|ratio| ratio.stays && answer.judgement.grade != Grade::NoGo) {
        let (p, count) = (probability(ratio.test.p_value), ratio.test.degrees_of_freedom);
        facts.push(("The ratio of both", format!("shows no change (p = {p}, {count} degrees of freedom)")));
    }
    document = document.facts(facts);
    if !answer.time_s.is_empty() {
        document = document.figure(track_picture(answer)?, "Both time constants with their pointwise 95 % bands.");
    }
    Ok(end(numbers(document, &answer.last), &answer.last, command))
}

/// What speaks against the use of the model that was given, before all else.
fn cautions(document: Document, last: &Characterisation) -> Document {
    last.model_remarks.iter().fold(document, |document, remark| document.warning(sentence(remark)))
}

/// Whether time constants are what was expected of them.
pub(crate) fn plausibility(document: Document, last: &Characterisation) -> Document {
    last.plausibility.iter().fold(document, |document, one| {
        let text = sentence(&plausibility_in_words(one));
        if one.is_outside == Some(true) { document.warning(text) } else { document.paragraph(text) }
    })
}

fn numbers(document: Document, last: &Characterisation) -> Document {
    let mut table = Table::new(["channel", "time constant", "95 % interval", "grade", "noise"]);
    for sensor in &last.sensors {
        table = table.row([
            sensor.channel.clone(),
            seconds(sensor),
            interval_of(sensor),
            grade(&sensor.judgement),
            with_unit(&rounded(sensor.noise_std_k, 3), "K"),
        ]);
    }
    let record = &last.record;
    document.heading("The record and its model").table(table).facts([
        ("Source", record.source.clone()),
        ("Samples", format!("{}, {} apart", record.samples, with_unit(&rounded(record.sample_period_s, 4), "s"))),
    ])
}

fn end(document: Document, last: &Characterisation, command: &str) -> String {
    let mut document = document.heading("How to reproduce this").command(command);
    document = document.paragraph(format!("Made by {} {}.", last.made_by.program, last.made_by.version));
    last.notes.iter().fold(document, |document, note| document.note(note.clone())).to_html()
}
