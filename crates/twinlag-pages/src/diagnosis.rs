//! A diagnosis as a page: what was found, how well it is shown, what it changes, and what stays open, with pictures.

use std::ops::Range;

use twinlag::diagnosis::{Diagnosis, Found, Identifier, ModelFit, TimeConstant, Trace, Verdict};
use twinlag_report::{
    Axis, Chart, Colour, Document, Figure, ReportError, Series, Table, between, plus_minus, probability, rounded,
};

use crate::figures::{WIDTH_PX, chart, frequency_figure, pairs, time_figure, trace};
use crate::words::{
    ABSENT, capital, estimate, identifiers, interval, listed, parameter, question, sentence, short, unit, with_unit,
    words, words_of,
};

const BEFORE: &str = "two first-order lags";
const AFTER: &str = "with the effects";
/// The part of the record that is shown larger, and the fewest samples that it may have.
const ZOOM: f64 = 0.05;
const ZOOM_SAMPLES: usize = 60;

/// What a report needs beside the diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportContext<'a> {
    /// Where the record is from: a file, a description.
    pub source: String,
    /// Names of both channels.
    pub channels: [String; 2],
    /// Instants, s, `[n]`.
    pub time_s: &'a [f64],
    /// Readings of the first channel, °C, `[n]`.
    pub t1_c: &'a [f64],
    /// Readings of the second channel, °C, `[n]`.
    pub t2_c: &'a [f64],
    /// A reference for the gas temperature, °C, `[n]`. It is shown and compared; the diagnosis has not seen it.
    pub reference_c: Option<&'a [f64]>,
    /// The command that makes this report again.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// What else is to be said: what was inferred on reading, what was left out.
    pub notes: Vec<String>,
}

/// The report on a diagnosis: an HTML page that needs no other file. The same diagnosis gives the same bytes.
///
/// # Errors
/// [`ReportError::LengthMismatch`] if readings, reference and instants differ in number. What a diagnosis does not
/// determine, up to one that was refused, is said in the report and is no error.
pub fn diagnosis_report(diagnosis: &Diagnosis, context: &ReportContext<'_>) -> Result<String, ReportError> {
    let expected = context.time_s.len();
    let columns = [Some(context.t1_c), Some(context.t2_c), context.reference_c];
    let names = [context.channels[0].as_str(), context.channels[1].as_str(), "reference"];
    for (column, name) in columns.into_iter().zip(names) {
        if let Some(got) = column.map(<[f64]>::len).filter(|got| *got != expected) {
            return Err(ReportError::LengthMismatch { series: name.into(), quantity: "readings", expected, got });
        }
    }
    let page = Page { diagnosis, context, changed: !diagnosis.effects.is_empty() };
    let mut document = Document::new(format!("Diagnosis of {}", context.source));
    document = page.verdict(document);
    document = page.traces(document)?;
    document = page.residual(document)?;
    document = page.evidence(document);
    document = page.numbers(document)?;
    document = page.errors(document);
    document = page.tests(document);
    document = page.unexplained(document);
    document = page.unknowable(document);
    Ok(page.reproduction(document).to_html())
}

/// Power of the residual against frequency, before and after, as SVG; none where there is no residual.
///
/// # Errors
/// [`ReportError`] if it cannot be drawn.
pub fn residual_picture(diagnosis: &Diagnosis) -> Result<Option<String>, ReportError> {
    frequency_figure(&models(diagnosis)).map(|figure| figure.to_svg()).transpose()
}

/// The models to be shown: one, if no effect was added.
fn models(diagnosis: &Diagnosis) -> Vec<Model<'_>> {
    let before = Model { name: BEFORE, column: "before", fit: &diagnosis.base, colour: Colour::Vermilion };
    let after = Model { name: AFTER, column: "after", fit: &diagnosis.last, colour: Colour::Blue };
    if diagnosis.effects.is_empty() { vec![Model { column: "value", ..before }] } else { vec![before, after] }
}

struct Page<'a> {
    diagnosis: &'a Diagnosis,
    context: &'a ReportContext<'a>,
    /// Whether any effect was added, so that there is a before and an after.
    changed: bool,
}

/// A model with its name in pictures and in tables.
pub(crate) struct Model<'a> {
    pub(crate) name: &'static str,
    pub(crate) column: &'static str,
    pub(crate) fit: &'a ModelFit,
    pub(crate) colour: Colour,
}

impl Page<'_> {
    fn place(&self, channel: Option<usize>) -> String {
        channel.and_then(|k| self.context.channels.get(k)).map_or("both, or between them".into(), Clone::clone)
    }

    /// `delay (T2) or second order`.
    fn named(&self, found: &Found) -> String {
        let place = found.channel.and_then(|k| self.context.channels.get(k));
        let place = place.map_or(String::new(), |name| format!(" ({name})"));
        let first = format!("{}{place}", words(found.effect));
        let others = found.alternatives.iter().map(|other| words(*other));
        [first].into_iter().chain(others).collect::<Vec<_>>().join(" or ")
    }

    fn verdict(&self, document: Document) -> Document {
        let (diagnosis, context) = (self.diagnosis, self.context);
        let effects = listed(&diagnosis.effects.iter().map(|f| self.named(f)).collect::<Vec<_>>());
        let many = diagnosis.effects.len() > 1;
        let lead = match diagnosis.verdict {
            Verdict::Adequate => "Two first-order lags explain this record: their residual cannot be \
                distinguished from noise."
                .into(),
            Verdict::Explained => format!(
                "Two first-order lags alone do not explain this record; with {} more, {effects}, the residual \
                 cannot be distinguished from noise.",
                if many { "these effects" } else { "one effect" },
            ),
            Verdict::PartlyExplained if diagnosis.unexplained.is_some() => format!(
                "{effects} {} part of the residual of two first-order lags, but more than noise is left.",
                if many { "explain" } else { "explains" },
            ),
            Verdict::PartlyExplained => format!(
                "With {effects} the residual looks like noise, but one record cannot distinguish so many \
                 effects: together they may imitate another cause."
            ),
            Verdict::Unexplained => "Two first-order lags do not explain this record, and no known effect \
                explains the residual."
                .into(),
            Verdict::Refused => "This record cannot be diagnosed.".into(),
            _ => "The verdict is one that this report does not know.".into(),
        };
        let samples = context.time_s.len();
        let span_s = context.time_s.last().zip(context.time_s.first()).map_or(f64::NAN, |(b, a)| b - a);
        let mut document = document.heading("Verdict").lead(lead);
        if diagnosis.verdict != Verdict::Refused {
            let [first, second] = &diagnosis.last.time_constants;
            document = document.paragraph(format!(
                "Time constants{}: {} {}, {} {}.",
                if self.changed { " with the effects" } else { "" },
                context.channels[0],
                estimate(first),
                context.channels[1],
                estimate(second)
            ));
        }
        // Why it was refused, or what to know before the numbers are used.
        for remark in &diagnosis.remarks {
            document = document.warning(sentence(&remark.to_string()));
        }
        if diagnosis.verdict == Verdict::Unexplained {
            document = document.paragraph(
                "What to do: see below at which frequencies and times most of it lies, and look for what \
                 happens at the rig there. It biases time constants and gas temperature by an amount that the \
                 record does not determine.",
            );
        }
        for found in &diagnosis.effects {
            let about = found.effect.about();
            let mut facts = vec![("Where", self.place(found.channel)), ("What it is", sentence(about.explanation))];
            let sizes: Vec<String> = found.parameters.iter().map(parameter).collect();
            let seen = found.seen.iter().cloned().chain((!sizes.is_empty()).then(|| sizes.join("; ")));
            facts.push(("What was found", sentence(&seen.collect::<Vec<_>>().join("; "))));
            facts.push(("What to do", sentence(about.advice)));
            facts.push(("Explains this record equally well", identifiers(&found.alternatives)));
            let confusable: Vec<Identifier> =
                found.effect.imitates().filter(|other| !found.alternatives.contains(other)).collect();
            facts.push(("Resembles, if it is small", identifiers(&confusable)));
            facts.retain(|(_, text)| !text.is_empty());
            document = document.subheading(capital(&words(found.effect))).facts(facts);
        }
        document.subheading("The record").facts([
            ("Source", context.source.clone()),
            ("Channels", listed(&context.channels)),
            ("Samples", format!("{samples}, over {}", with_unit(&rounded(span_s, 4), "s"))),
        ])
    }

    fn traces(&self, document: Document) -> Result<Document, ReportError> {
        let context = self.context;
        let document = document.heading("Readings and gas temperature");
        let everything = 0..context.time_s.len();
        let zoom = busiest(context);
        let whole = self.trace_chart("Whole record", everything.clone());
        let Some(whole) = whole else {
            return Ok(document.note("There are no readings to show."));
        };
        let mut figure = Figure::new("").columns(1).panel_size(WIDTH_PX, 320.0).panel(whole);
        let mut caption = format!(
            "Readings of {} and {}, and the gas temperature inferred from both{}.",
            context.channels[0],
            context.channels[1],
            if context.reference_c.is_some() { "; the reference was not used" } else { "" }
        );
        if zoom.len() < everything.len()
            && let Some(chart) = self.trace_chart("Where the readings move most", zoom)
        {
            figure = figure.panel(chart.without_legend());
            caption.push_str(" Below, enlarged, the part of the record where the readings move most.");
        }
        Ok(document.figure(figure.to_svg()?, caption))
    }

    /// Readings, gas and reference of some samples; `None` if there is nothing to be drawn.
    fn trace_chart(&self, title: &str, samples: Range<usize>) -> Option<Chart> {
        let (context, fitted) = (self.context, &self.diagnosis.last.trace);
        let time_s = &context.time_s[samples.clone()];
        let (from, to) = (*time_s.first()?, *time_s.last()?);
        let mut series = Vec::new();
        let (gas_s, gas_c): (Vec<f64>, Vec<f64>) = pairs(&fitted.time_s, &fitted.gas_c, from, to).unzip();
        series.push(trace("gas, inferred", &gas_s, &gas_c, Colour::Green));
        if let Some(reference) = context.reference_c {
            let reference = trace("reference", time_s, &reference[samples.clone()], Colour::Black);
            series.push(reference.map(Series::dashed));
        }
        for (k, column) in [context.t1_c, context.t2_c].into_iter().enumerate() {
            let colour = [Colour::Blue, Colour::Vermilion][k];
            series.push(trace(short(&context.channels[k]), time_s, &column[samples.clone()], colour));
        }
        chart(title, [Axis::linear("time (s)"), Axis::linear("temperature (°C)")], series)
    }

    fn residual(&self, document: Document) -> Result<Document, ReportError> {
        let document = document.heading("What is left over, before and after").paragraph(
            "The residual is the difference of the two inferred gas temperatures, in units of the difference \
             that the noise of both sensors makes, and without the memory that the filters give it. If the \
             model is right, it is \
             white noise of unit variance.",
        );
        let models = models(self.diagnosis);
        let Some(figure) = time_figure(&models) else {
            return Ok(document.note("There is no residual to show."));
        };
        let mut document = document.figure(
            figure.to_svg()?,
            "The residual along the record, and its root mean square in hundredths of it, with the range that \
             holds 95 % of \
             such parts if it is white noise of unit variance.",
        );
        if let Some(figure) = frequency_figure(&models) {
            document = document.figure(
                figure.to_svg()?,
                "Power of the residual against frequency, in units of that of the noise. The pale range holds \
                 95 % of the \
                 bands if the residual is white noise of unit variance: one in twenty lies outside by chance.",
            );
        }
        Ok(document)
    }

    fn evidence(&self, document: Document) -> Document {
        let mut document = document.heading("Evidence for each effect");
        if !self.changed {
            document = document.paragraph("No effect was added.");
        }
        let mut evidence = Table::new([
            "effect",
            "where",
            "statistic",
            "degrees of freedom",
            "p-value",
            "gain on held-out blocks (nats)",
            "statistic, noise free in each band",
            "explains it equally well",
        ]);
        let mut sizes = Table::new(["effect", "parameter", "value", "95 % interval", "unit"]);
        for found in &self.diagnosis.effects {
            let place = self.place(found.channel);
            let absent = || "–".to_owned();
            let others = if found.alternatives.is_empty() { "none".into() } else { identifiers(&found.alternatives) };
            evidence = evidence.row(match &found.evidence {
                Some(e) => [
                    words(found.effect),
                    place,
                    rounded(e.statistic, 4),
                    e.dof.to_string(),
                    probability(e.p_value),
                    rounded(e.held_out_gain_nats, 3),
                    e.robust_statistic.map_or_else(absent, |s| rounded(s, 4)),
                    others,
                ],
                None => [
                    words(found.effect),
                    place,
                    "seen in the data".into(),
                    absent(),
                    absent(),
                    absent(),
                    absent(),
                    others,
                ],
            });
            for value in &found.parameters {
                let error = value.standard_error;
                sizes = sizes.row([
                    words(found.effect),
                    value.name.replace('_', " "),
                    plus_minus(value.value, error),
                    value.interval_95.map_or(ABSENT.into(), between),
                    unit(&value.unit).to_owned(),
                ]);
            }
        }
        if self.changed {
            document = document
                .paragraph(
                    "The statistic is twice the gain in log-likelihood, with the level of the noise free: it \
                     is chi-square distributed if the effect is absent, and the p-value is the probability of \
                     a statistic \
                     so large. The gain on held-out blocks is that on parts of the record that the fit had \
                     not seen. An effect that is due to chance does not gain there.",
                )
                .table(evidence);
        }
        if !sizes.is_empty() {
            document = document.table(sizes.caption("Parameters of the effects, with standard errors."));
        }
        document
    }

    fn numbers(&self, document: Document) -> Result<Document, ReportError> {
        let models = models(self.diagnosis);
        let [first, second] = &self.context.channels;
        let interval_95 = || "95 % interval".to_owned();
        let header = models.iter().flat_map(|m| [m.column.to_owned(), interval_95()]);
        let mut table = Table::new([String::new()].into_iter().chain(header));
        let names = [format!("time constant of {first}"), format!("time constant of {second}"), "difference".into()];
        for (k, name) in names.into_iter().enumerate() {
            let of = |m: &Model<'_>| [m.fit.time_constants[0], m.fit.time_constants[1], m.fit.difference][k];
            let cells = models.iter().flat_map(|m| [estimate(&of(m)), interval(&of(m))]);
            table = table.row([name].into_iter().chain(cells));
        }
        for (k, channel) in self.context.channels.iter().enumerate() {
            let noise = |m: &Model<'_>| with_unit(&rounded(m.fit.noise_std_k[k], 3), "K");
            let cells = models.iter().flat_map(|m| [noise(m), String::new()]);
            table = table.row([format!("noise of {channel}")].into_iter().chain(cells));
        }
        let mut document = document.heading("Time constants and noise, before and after").table(table);
        for model in models.iter().filter(|m| m.fit.is_weighted_by_residual) {
            let when = if self.changed { format!(" {}", model.column) } else { String::new() };
            document = document.note(format!(
                "The residual{when} is not white, so the errors{when} follow from its own spectrum. They do \
                 not cover the bias that its cause may have."
            ));
        }
        if let Some(figure) = self.time_constant_figure() {
            document = document.figure(figure.to_svg()?, "Both time constants with their 95 % intervals.");
        }
        Ok(document)
    }

    fn time_constant_figure(&self) -> Option<Figure> {
        let models = models(self.diagnosis);
        let mut figure = None;
        for k in 0..2 {
            let of: Vec<&TimeConstant> = models.iter().map(|m| &m.fit.time_constants[k]).collect();
            let names = models.iter().map(|m| match m.fit.time_constants[k].value_s {
                Some(_) => m.name.to_owned(),
                None => format!("{}: {ABSENT}", m.name),
            });
            let values: Vec<f64> = of.iter().map(|t| t.value_s.unwrap_or(f64::NAN)).collect();
            let (low, high): (Vec<f64>, Vec<f64>) =
                of.iter().map(|t| t.interval_95_s.map_or((f64::NAN, f64::NAN), |[a, b]| (a, b))).unzip();
            let places: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
            let known = values.iter().any(|v| v.is_finite());
            let series = known.then(|| Series::points("", places, values).interval(low, high).colour(Colour::Blue));
            let axes = [Axis::categories("", names), Axis::linear("time constant (s)")];
            if let Some(chart) = chart(short(&self.context.channels[k]), axes, [series]) {
                figure =
                    Some(figure.unwrap_or(Figure::new("").columns(2).panel_size(WIDTH_PX / 2.0, 270.0)).panel(chart));
            }
        }
        figure
    }

    fn errors(&self, document: Document) -> Document {
        let budget = &self.diagnosis.error;
        let mut rows = vec![
            ("Energy of the residual per degree of freedom, whole record", "", budget.chi2_per_dof),
            ("Residual on held-out blocks, root mean square", "", budget.held_out_normalised_rms),
            (
                "Difference of the inferred gas temperatures on held-out blocks, root mean square",
                "K",
                budget.held_out_input_difference_k,
            ),
        ]
        .into_iter()
        .map(|(name, unit, pair)| (name, unit, pair.before, pair.after))
        .collect::<Vec<_>>();
        if let Some(reference) = self.context.reference_c {
            let rms = |trace: &Trace| against_reference(trace, self.context.time_s, reference);
            let (before, after) = (rms(&self.diagnosis.base.trace), rms(&self.diagnosis.last.trace));
            rows.push((
                "Inferred gas temperature less the reference on held-out blocks, root mean square",
                "K",
                before,
                after,
            ));
        }
        let mut table =
            Table::new(if self.changed { vec!["", "before", "after", "after / before"] } else { vec!["", "value"] });
        for (name, unit, before, after) in rows {
            let ratio = rounded(after / before, 3);
            let cells = [with_unit(&rounded(before, 4), unit), with_unit(&rounded(after, 4), unit), ratio];
            let shown = if self.changed { 3 } else { 1 };
            table = table.row([name.to_owned()].into_iter().chain(cells.into_iter().take(shown)));
        }
        let document = document
            .heading("Error before and after")
            .paragraph(
                "Held-out blocks are parts of the record that took no part in choosing effects or in fitting \
                 them. In the \
                 first two rows, 1 is what noise alone makes.",
            )
            .table(table);
        if self.context.reference_c.is_none() {
            return document;
        }
        document.paragraph(
            "The diagnosis has not used the reference. The error against it also includes errors that both \
             sensors share, and depends on which sensor is right where they disagree about gain and offset. \
             Two sensors alone cannot reveal either.",
        )
    }

    fn tests(&self, document: Document) -> Document {
        let models = models(self.diagnosis);
        let mut names: Vec<&str> = Vec::new();
        for test in models.iter().flat_map(|m| &m.fit.tests) {
            if !names.contains(&test.test.as_str()) {
                names.push(&test.test);
            }
        }
        let document = document.heading("Tests of what is left over");
        if names.is_empty() {
            return document.paragraph("No test could be made.");
        }
        let header = models.iter().flat_map(|m| [if self.changed { m.column } else { "statistic" }, "p-value"]);
        let mut table = Table::new(["test", "question"].into_iter().chain(header));
        for name in names {
            let cells = models.iter().flat_map(|m| {
                m.fit.tests.iter().find(|t| t.test == name).map_or([ABSENT.to_owned(), ABSENT.to_owned()], |t| {
                    let whole = |d: f64| if d.fract() == 0.0 { format!("{d:.0}") } else { rounded(d, 3) };
                    let freedom = t.degrees_of_freedom.map_or(String::new(), |d| format!(" ({})", whole(d)));
                    [format!("{}{freedom}", rounded(t.statistic, 3)), probability(t.p_value)]
                })
            });
            table = table.row([words_of(name), question(name).into()].into_iter().chain(cells));
        }
        document
            .paragraph(
                "Each test asks whether the residual is white noise of unit variance. The p-value is the \
                 probability of a statistic at least as extreme if it is, so a small one is evidence against \
                 the model.",
            )
            .table(table.caption("Statistics, with their degrees of freedom, if any, in brackets."))
    }

    fn unexplained(&self, document: Document) -> Document {
        let document = document.heading("What is unexplained");
        let Some(left) = &self.diagnosis.unexplained else {
            return document.paragraph(match self.diagnosis.verdict {
                Verdict::Refused => "The record was not diagnosed: nothing can be said.",
                _ => "Nothing that these tests show: the residual cannot be distinguished from noise.",
            });
        };
        let span = |ends: Option<[f64; 2]>, unit: &str| {
            ends.map_or(ABSENT.into(), |[low, high]| {
                format!("{} to {}", rounded(low, 3), with_unit(&rounded(high, 3), unit))
            })
        };
        document.warning(sentence(&left.description)).facts([
            ("Frequencies with most of it", span(left.band_hz, "Hz")),
            ("Energy there", with_unit(&rounded(left.energy_ratio, 3), "times that of the noise")),
            ("Tenth of the record with most of it", span(left.worst_s, "s")),
        ])
    }

    fn unknowable(&self, document: Document) -> Document {
        let mut items: Vec<String> = self.diagnosis.not_testable.iter().map(|text| sentence(text)).collect();
        let mut told: Vec<Identifier> = Vec::new();
        for found in &self.diagnosis.effects {
            if !told.contains(&found.effect) {
                told.push(found.effect);
                items.push(format!(
                    "{}: not detectable is {}.",
                    capital(&words(found.effect)),
                    found.effect.about().unseen
                ));
            }
        }
        let mut limits = Table::new([
            "effect",
            "where",
            "parameter",
            "smallest size that would have been \
            detected",
        ]);
        for limit in &self.diagnosis.limits {
            limits = limits.row([
                words(limit.effect),
                self.place(limit.channel),
                limit.parameter.replace('_', " "),
                with_unit(&rounded(limit.size, 2), &limit.unit),
            ]);
        }
        let document = document
            .heading("What this record cannot reveal")
            .paragraph(
                "The diagnosis sees the gas only through two sensors. Anything that affects both alike leaves \
                 no trace in their disagreement, and is not among the effects even if it is large.",
            )
            .list(items);
        if limits.is_empty() {
            return document;
        }
        document
            .paragraph(
                "The effects that were not found may still be present, but small: below these sizes they \
                 would not have been distinguished from chance.",
            )
            .table(limits)
    }

    fn reproduction(&self, document: Document) -> Document {
        let context = self.context;
        let mut document = document.heading("How to reproduce this");
        if !context.command.is_empty() {
            document = document.command(context.command.clone());
        }
        document = document.paragraph(format!("Made by twinlag {}.", context.version));
        for note in &context.notes {
            document = document.note(note.clone());
        }
        document
    }
}

/// The samples to be shown larger: where the readings have most variance.
fn busiest(context: &ReportContext<'_>) -> Range<usize> {
    let n = context.time_s.len();
    let window = ((ZOOM * n as f64) as usize).max(ZOOM_SAMPLES).min(n);
    // Sums up to each sample, of both channels: count, value, square.
    let sums = [context.t1_c, context.t2_c].map(|readings| {
        let finite = || readings.iter().copied().filter(|y| y.is_finite());
        // Less their mean, or squares of 300 °C would swamp variances of 0.1 K².
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        let mut sums = vec![[0.0; 3]];
        let mut sum = [0.0; 3];
        for y in readings.iter().map(|y| y - mean) {
            if y.is_finite() {
                sum = [sum[0] + 1.0, sum[1] + y, sum[2] + y * y];
            }
            sums.push(sum);
        }
        sums
    });
    let variance = |start: usize| -> f64 {
        sums.iter()
            .map(|sums| {
                let [count, sum, squares] = [0, 1, 2].map(|k| sums[start + window][k] - sums[start][k]);
                let count = count.max(1.0);
                squares / count - (sum / count).powi(2)
            })
            .sum()
    };
    let start = (0..=n - window).max_by(|a, b| variance(*a).total_cmp(&variance(*b))).unwrap_or(0);
    start..start + window
}

/// Root mean square of the inferred gas temperature less a reference, on the blocks that judge.
fn against_reference(trace: &Trace, time_s: &[f64], reference_c: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for ((t, gas_c), _) in trace.time_s.iter().zip(&trace.gas_c).zip(&trace.is_judge).filter(|(_, judges)| **judges) {
        // The nearest row: stamps may be off the grid by some of their jitter.
        let after = time_s.partition_point(|u| u < t);
        let distance = |row: &usize| (time_s[*row] - t).abs();
        let rows = after.saturating_sub(1)..(after + 1).min(time_s.len());
        let Some(row) = rows.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { continue };
        let error = gas_c - reference_c[row];
        if error.is_finite() {
            sum += error * error;
            count += 1;
        }
    }
    // None to be compared: not a number, which is shown as not determined.
    (sum / count as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{ReportContext, diagnosis_report};
    use twinlag::diagnosis::{
        BeforeAfter, Diagnosis, ErrorBudget, Evidence, Found, Identifier, ModelFit, Policy, Remark, TimeConstant,
        Trace, Unexplained, Value, Verdict,
    };
    use twinlag::optimise::{End, Evaluations, Fit};
    use twinlag_report::ReportError;

    const SECTIONS: [&str; 10] = [
        "Verdict",
        "Readings and gas temperature",
        "What is left over, before and after",
        "Evidence for each effect",
        "Time constants and noise, before and after",
        "Error before and after",
        "Tests of what is left over",
        "What is unexplained",
        "What this record cannot reveal",
        "How to reproduce this",
    ];

    /// A diagnosis of which nothing is determined, as one that was refused has it.
    fn nothing(verdict: Verdict) -> Diagnosis {
        let none = TimeConstant { value_s: None, standard_error_s: None, interval_95_s: None };
        let fit = ModelFit {
            time_constants: [none; 2],
            difference: none,
            fit: Fit {
                optimiser: "none".into(),
                start: Vec::new(),
                x: Vec::new(),
                value: f64::NAN,
                end: End::LimitReached,
                iterations: 0,
                evaluations: Evaluations::default(),
            },
            noise_std_k: [f64::NAN; 2],
            tests: Vec::new(),
            chi2_per_dof: f64::NAN,
            is_weighted_by_residual: false,
            covariance: None,
            extended: None,
            trace: Trace::default(),
        };
        let pair = BeforeAfter { before: f64::NAN, after: f64::INFINITY };
        Diagnosis {
            verdict,
            effects: Vec::new(),
            base: fit.clone(),
            last: fit,
            error: ErrorBudget { chi2_per_dof: pair, held_out_normalised_rms: pair, held_out_input_difference_k: pair },
            unexplained: None,
            not_testable: vec!["the record is too short".into()],
            limits: Vec::new(),
            remarks: vec![Remark::SingleTone],
            moves: Vec::new(),
            policy: Policy::default(),
        }
    }

    fn context<'a>(time_s: &'a [f64], t1_c: &'a [f64], t2_c: &'a [f64]) -> ReportContext<'a> {
        ReportContext {
            source: "a <b>.csv".into(),
            channels: ["T\"1\"".into(), "T2 & more".into()],
            time_s,
            t1_c,
            t2_c,
            reference_c: None,
            command: "twinlag diagnose 'a <b>.csv'".into(),
            version: "0.0.0".into(),
            notes: Vec::new(),
        }
    }

    /// Whatever was not determined is said so, and every section is there, in its order.
    #[test]
    fn a_report_on_nothing_has_every_section_and_no_nan() {
        let time_s: Vec<f64> = (0..200).map(f64::from).collect();
        let gaps = vec![f64::NAN; 200];
        let found = Found {
            effect: Identifier::DELAY,
            channel: Some(1),
            fitted_in: Some(1),
            parameters: vec![Value {
                name: "delay".into(),
                value: f64::NAN,
                standard_error: Some(f64::NAN),
                interval_95: None,
                unit: "s".into(),
            }],
            evidence: Some(Evidence {
                statistic: f64::INFINITY,
                dof: 1,
                p_value: 0.0,
                held_out_gain_nats: f64::NAN,
                robust_statistic: None,
            }),
            alternatives: vec![Identifier::SECOND_ORDER],
            seen: None,
        };
        let left =
            Unexplained { description: "something".into(), band_hz: None, energy_ratio: f64::NAN, worst_s: None };
        for verdict in
            [Verdict::Adequate, Verdict::Explained, Verdict::PartlyExplained, Verdict::Unexplained, Verdict::Refused]
        {
            for (effects, unexplained) in [(vec![], None), (vec![found.clone()], Some(left.clone()))] {
                let diagnosis = Diagnosis { effects, unexplained, ..nothing(verdict) };
                for (t, y) in [(&time_s, &gaps), (&time_s, &time_s), (&vec![], &vec![])] {
                    let mut context = context(t, y, y);
                    context.reference_c = Some(y);
                    let page = diagnosis_report(&diagnosis, &context).expect("a report");
                    assert!(!page.contains("NaN") && !page.contains("inf "), "{verdict:?}");
                    assert!(page.contains("not determined") && page.contains("a &lt;b&gt;.csv"));
                    let mut rest = page.as_str();
                    for section in SECTIONS {
                        let heading = format!("<h2>{section}</h2>");
                        rest = rest.split_once(&heading).unwrap_or_else(|| panic!("{section} is out of place")).1;
                    }
                }
            }
        }
    }

    #[test]
    fn readings_of_another_length_are_refused() {
        let got = diagnosis_report(&nothing(Verdict::Refused), &context(&[0.0, 1.0], &[1.0, 2.0], &[1.0]));
        let series = "T2 & more".into();
        assert_eq!(got, Err(ReportError::LengthMismatch { series, quantity: "readings", expected: 2, got: 1 }));
    }
}
