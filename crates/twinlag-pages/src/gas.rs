//! A gas temperature, and time constants along a record, as pages.

use twinlag::diagnosis::Grade;
use twinlag::record::Record;
use twinlag_report::{Document, Figure, ReportError, Table, Tone, between, probability, rounded};

use crate::Making;
use crate::figures::WIDTH_PX;
use crate::making::{file_name, notes};
use crate::pictures::{spectra, temperature_figure, track_figure};
use crate::words::{
    capital, grade, interval_of, listed, plausibility_in_words, seconds, sentence, spacing_in_words, with_unit, words,
};
use twinlag::{Characterisation, Compensation, Quality, RecordSummary, Track};

/// The report on a gas temperature: an HTML page that needs no other file. Equal answers give equal
/// bytes.
///
/// # Errors
/// [`ReportError`], if something cannot be drawn. Where there is no gas temperature the page says
/// why, and that is no error.
pub fn gas_report(record: &Record, answer: &Compensation, making: &Making) -> Result<String, ReportError> {
    let document = Document::new(format!("Gas temperature of {}", file_name(&record.source)));
    let document = document.byline(making.byline(&[samples(&answer.last)]));
    let tone = tone(answer.judgement.grade);
    let worth = format!("{}.", capital(&answer.judgement.grade.to_string()));
    let document = cautions(document, &answer.last);
    let document = match &answer.gas {
        None => document.verdict(
            Tone::Bad,
            worth,
            format!("There is no gas temperature to use: {}.", answer.judgement.because),
        ),
        Some(_) if answer.judgement.grade == Grade::NoGo => document.verdict(
            tone,
            worth,
            format!("No go, and drawn only since it was asked for: {}.", answer.judgement.because),
        ),
        Some(gas) => document.verdict(
            tone,
            worth,
            format!(
                "The gas temperature is known to {} (standard deviation, median), and follows the gas up to {}.",
                with_unit(&rounded(gas.median_std_k, 2), "K"),
                gas.bandwidth_hz
                    .map_or("no frequency: it moves less than the noise".into(), |hz| with_unit(&rounded(hz, 3), "Hz"))
            ),
        ),
    };
    let mut document = plausibility(document, &answer.last);
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
        document = document
            .drawing(
                temperature_figure(record, answer, "").live(),
                "Readings, and the gas temperature with its 95 % band. Below, enlarged, some twenty time constants of the slower sensor, \
                 where it moves most.",
            )?
            .facts(facts);
    }
    if making.is_first_screen {
        return Ok(making.page(&document));
    }
    if let Some(gas) = &answer.gas {
        document = budget(document.heading("What the band consists of"), gas);
        let spectra = Figure::new("").columns(1).panel_size(WIDTH_PX, 300.0).panel(spectra(record, answer));
        document = document.heading("Before and after").drawing(
            spectra,
            "Spectra of the faster sensor's reading, of the gas temperature, and of the noise that the \
             inferred gas temperature would have without the prior. The lag is compensated up to the line; \
             beyond it the answer follows from the prior of the gas, not from the readings.",
        )?;
    }
    Ok(end(numbers(document, &answer.last), &answer.last, making))
}

/// The report on time constants along a record, like [`gas_report`].
///
/// # Errors
/// As [`gas_report`].
pub fn track_report(record: &Record, answer: &Track, making: &Making) -> Result<String, ReportError> {
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
    let document = Document::new(format!("Time constants along {}", file_name(&record.source)));
    let document = document.byline(making.byline(&[samples(&answer.last)]));
    let grade_of = answer.judgement.grade;
    let document = cautions(document, &answer.last);
    let mut document = document.verdict(tone(grade_of), format!("{}.", capital(&grade_of.to_string())), lead);
    for warning in &answer.warnings {
        document = document.warning(sentence(warning));
    }
    let mut facts = vec![("Grade", grade(&answer.judgement))];
    // That nothing changes is not claimed under a model that is contradicted.
    if let Some(ratio) = answer.ratio.filter(|ratio| ratio.stays && answer.judgement.grade != Grade::NoGo) {
        let (p, count) = (probability(ratio.test.p_value), ratio.test.degrees_of_freedom);
        facts.push(("The ratio of both", format!("shows no change (p = {p}, {count} degrees of freedom)")));
    }
    if !answer.time_s.is_empty() {
        document = document
            .drawing(track_figure(answer, "").live(), "Both time constants with their pointwise 95 % bands.")?;
    }
    document = document.facts(facts);
    if making.is_first_screen {
        return Ok(making.page(&document));
    }
    Ok(end(numbers(document, &answer.last), &answer.last, making))
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
        ("Source", file_name(&record.source).to_owned()),
        ("Samples", format!("{}, {}", record.samples, spacing(record))),
    ])
}

fn end(document: Document, last: &Characterisation, making: &Making) -> String {
    let document = making.reproduction(document, &last.made_by.program, &last.made_by.version);
    making.page(&notes(document, &last.notes))
}

/// How long the record is.
fn samples(last: &Characterisation) -> String {
    let record = &last.record;
    format!("{} samples, {}", record.samples, spacing(record))
}

fn spacing(record: &RecordSummary) -> String {
    format!("{} {}", with_unit(&rounded(record.sample_period_s, 4), "s"), spacing_in_words(record))
}

fn tone(grade: Grade) -> Tone {
    match grade {
        Grade::Go => Tone::Good,
        Grade::Conditional => Tone::Caution,
        _ => Tone::Bad,
    }
}

/// What the standard deviation of a gas temperature consists of.
fn budget(document: Document, gas: &Quality) -> Document {
    let table = Table::new(["source", "standard deviation", "how"])
        .row([
            "all together, median".to_owned(),
            with_unit(&rounded(gas.median_std_k, 3), "K"),
            "that of the band".to_owned(),
        ])
        .row([
            "the model's parameters".to_owned(),
            with_unit(&rounded(gas.parameter_std_k, 2), "K"),
            "their covariance, carried through the compensation; median".to_owned(),
        ])
        .row([
            "noise, and what the readings do not determine".to_owned(),
            "the rest, in squares".to_owned(),
            "the smoother, with the prior of the gas".to_owned(),
        ])
        .row([
            "model error".to_owned(),
            format!("× {}", rounded(gas.widened_by, 3)),
            "bands are multiplied by this, from how far readings are off what earlier ones led to expect".to_owned(),
        ]);
    document.table(table)
}
