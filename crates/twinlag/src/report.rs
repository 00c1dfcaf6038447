//! A diagnosis as a page: what was found, how well it is shown, what it changes, and what stays open, with pictures.

use std::ops::Range;

use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag_diagnose::{Diagnosis, Found, Identifier, ModelFit, TimeConstant, Trace, Verdict};
use twinlag_report::{
    Axis, Chart, Colour, Document, Figure, Reference, ReportError, Series, Table, between, plus_minus, probability, rounded,
};

const ABSENT: &str = "not determined";
const BEFORE: &str = "two first-order lags";
const AFTER: &str = "with the effects";
const NOISE: &str = "95 % of white noise";
const WIDTH_PX: f64 = 900.0;
/// Parts of the record whose mean energies are shown.
const PARTS: usize = 100;
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
pub fn report(diagnosis: &Diagnosis, context: &ReportContext<'_>) -> Result<String, ReportError> {
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

struct Page<'a> {
    diagnosis: &'a Diagnosis,
    context: &'a ReportContext<'a>,
    /// Whether any effect was added, so that there is a before and an after.
    changed: bool,
}

impl Page<'_> {
    fn channel(&self, channel: Option<usize>) -> String {
        match channel.and_then(|k| self.context.channels.get(k)) {
            Some(name) => name.clone(),
            None => "both channels, or between them".into(),
        }
    }

    /// `delay (T2), or second order`.
    fn named(&self, found: &Found) -> String {
        let place = found.channel.and_then(|k| self.context.channels.get(k));
        let place = place.map_or(String::new(), |name| format!(" ({name})"));
        let others: String = found.alternatives.iter().map(|other| format!(" or {}", words(*other))).collect();
        format!("{}{place}{others}", words(found.effect))
    }

    fn verdict(&self, document: Document) -> Document {
        let (diagnosis, context) = (self.diagnosis, self.context);
        let effects = listed(&diagnosis.effects.iter().map(|f| self.named(f)).collect::<Vec<_>>());
        let many = diagnosis.effects.len() > 1;
        let lead = match diagnosis.verdict {
            Verdict::Adequate => "Two first-order lags explain this record: what they leave over cannot be told from \
                                  noise."
                .into(),
            Verdict::Explained => format!(
                "Two first-order lags alone do not explain this record; with {} more, {effects}, what is left cannot be \
                 told from noise.",
                if many { "these effects" } else { "one effect" },
            ),
            Verdict::PartlyExplained if diagnosis.unexplained.is_some() => format!(
                "Of what two first-order lags leave over, {effects} {} a part, but not all: something else is left.",
                if many { "explain" } else { "explains" },
            ),
            Verdict::PartlyExplained => format!(
                "With {effects} what is left looks like noise, but so many effects cannot be told apart from one record: \
                 together they may imitate another cause."
            ),
            Verdict::Unexplained => "Two first-order lags do not explain this record, and none of the known effects \
                                     accounts for what is left over."
                .into(),
            Verdict::Refused => "This record cannot be diagnosed.".into(),
            _ => "The verdict is one that this report does not know.".into(),
        };
        let samples = context.time_s.len();
        let span_s = context.time_s.last().zip(context.time_s.first()).map_or(f64::NAN, |(b, a)| b - a);
        let mut document = document.heading("Verdict").lead(lead);
        if diagnosis.verdict == Verdict::Refused {
            document = document.list(diagnosis.not_testable.iter().cloned());
        }
        if diagnosis.verdict == Verdict::Unexplained {
            document = document.paragraph(
                "What to do: see below where in frequency and in time most of it lies, and look for what happens at the \
                 rig there. Time constants and gas temperature are biased by it to an extent that the record does not \
                 tell.",
            );
        }
        for found in &diagnosis.effects {
            let about = found.effect.about();
            let mut facts = vec![("Where", self.channel(found.channel)), ("What it is", sentence(about.explanation))];
            let sizes: Vec<String> = found.parameters.iter().map(parameter).collect();
            let seen = found.seen.iter().cloned().chain((!sizes.is_empty()).then(|| sizes.join("; ")));
            facts.push(("What was found", sentence(&seen.collect::<Vec<_>>().join("; "))));
            facts.push(("What to do", sentence(about.advice)));
            facts.push(("Explains this record as well", identifiers(&found.alternatives)));
            let confusable: Vec<Identifier> =
                about.confusable.iter().copied().filter(|other| !found.alternatives.contains(other)).collect();
            facts.push(("Resembles, where it is small", identifiers(&confusable)));
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
            "Readings of {} and {}, and the gas temperature inferred from both, the mean of the two inferred inputs",
            context.channels[0], context.channels[1]
        );
        if context.reference_c.is_some() {
            caption.push_str("; the reference was not used");
        }
        caption.push('.');
        if zoom.len() < everything.len()
            && let Some(chart) = self.trace_chart("Where the readings move most", zoom)
        {
            figure = figure.panel(chart.without_legend());
            caption.push_str(&format!(" Below, the {:.0} % of the record where the readings move most.", 100.0 * ZOOM));
        }
        Ok(document.figure(figure.to_svg()?, caption))
    }

    /// Readings, gas and reference of some samples; `None` if there is nothing to be drawn.
    fn trace_chart(&self, title: &str, samples: Range<usize>) -> Option<Chart> {
        let (context, trace) = (self.context, &self.diagnosis.last.trace);
        let time_s = &context.time_s[samples.clone()];
        let (from, to) = (*time_s.first()?, *time_s.last()?);
        let mut series = Vec::new();
        let (gas_s, gas_c): (Vec<f64>, Vec<f64>) = pairs(&trace.time_s, &trace.gas_c, from, to).unzip();
        series.push(Series::trace("gas, inferred", gas_s, gas_c).colour(Colour::Green));
        if let Some(reference) = context.reference_c {
            let reference = &reference[samples.clone()];
            series.push(Series::trace("reference", time_s, reference).colour(Colour::Black).dashed());
        }
        for (k, column) in [context.t1_c, context.t2_c].into_iter().enumerate() {
            let colour = [Colour::Blue, Colour::Vermilion][k];
            series.push(Series::trace(short(&context.channels[k]), time_s, &column[samples.clone()]).colour(colour));
        }
        chart(title, Axis::linear("time (s)"), Axis::linear("temperature (°C)"), series)
    }

    /// The models to be shown, with their names: one, if no effect was added.
    fn models(&self) -> Vec<(&'static str, &ModelFit, Colour)> {
        let before = (BEFORE, &self.diagnosis.base, Colour::Vermilion);
        if self.changed { vec![before, (AFTER, &self.diagnosis.last, Colour::Blue)] } else { vec![before] }
    }

    fn residual(&self, document: Document) -> Result<Document, ReportError> {
        let document = document.heading("What is left over, before and after").paragraph(
            "The residual is how far the two inferred gas temperatures disagree, in units of what the noise of both \
             sensors makes of it, and with the memory that the filters give it taken off. If the model is right, it is \
             white noise of unit variance.",
        );
        let models = self.models();
        let Some(figure) = time_figure(&models) else {
            return Ok(document.note("There is no residual to show."));
        };
        let mut document = document.figure(
            figure.to_svg()?,
            format!(
                "The residual along the record, and its root mean square in {PARTS} parts of it, with the range that holds \
                 95 % of such parts if it is white noise of unit variance."
            ),
        );
        if let Some(figure) = frequency_figure(&models) {
            document = document.figure(
                figure.to_svg()?,
                "Power of the residual against frequency, in units of that of the noise. The pale range holds 95 % of the \
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
            "explains it as well",
        ]);
        let mut sizes = Table::new(["effect", "parameter", "value", "95 % interval", "unit"]);
        for found in &self.diagnosis.effects {
            let place = found.channel.map_or("both, or between".into(), |k| self.channel(Some(k)));
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
                None => [words(found.effect), place, "seen in the data".into(), absent(), absent(), absent(), absent(), others],
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
                    "The statistic is twice the gain in log-likelihood, with the level of the noise free: it is \
                     chi-square distributed if the effect is not there, and the p-value is the probability of a statistic \
                     so large. The gain on held-out blocks is that on parts of the record that the fit had not seen: what \
                     is there by chance does not gain.",
                )
                .table(evidence);
        }
        if !sizes.is_empty() {
            document = document.table(sizes.caption("Parameters of the effects, with standard errors."));
        }
        if !self.diagnosis.rejected.is_empty() {
            document = document
                .subheading("Looked at and not taken")
                .list(self.diagnosis.rejected.iter().map(|text| sentence(text)));
        }
        document
    }

    fn numbers(&self, document: Document) -> Result<Document, ReportError> {
        let (base, last) = (&self.diagnosis.base, &self.diagnosis.last);
        let [first, second] = &self.context.channels;
        let mut table = Table::new(["", "before", "95 % interval", "after", "95 % interval"]);
        let names = [format!("time constant of {first}"), format!("time constant of {second}"), "difference".into()];
        let of = |fit: &ModelFit| [fit.time_constants[0], fit.time_constants[1], fit.difference];
        for ((name, before), after) in names.into_iter().zip(of(base)).zip(of(last)) {
            let [value, interval, value_after, interval_after] =
                [estimate(&before), interval(&before), estimate(&after), interval(&after)];
            table = table.row([name, value, interval, value_after, interval_after]);
        }
        for (k, channel) in self.context.channels.iter().enumerate() {
            let noise = |fit: &ModelFit| with_unit(&rounded(fit.noise_std_k[k], 3), "K");
            table = table.row([format!("noise of {channel}"), noise(base), String::new(), noise(last), String::new()]);
        }
        let mut document = document.heading("Time constants and noise, before and after").table(table);
        for (fit, when) in [(base, "before"), (last, "after")] {
            if fit.is_weighted_by_residual && (self.changed || when == "after") {
                let when = if self.changed { format!(" {when}") } else { String::new() };
                document = document.note(format!(
                    "The residual{when} is not white: the errors{when} rest on its own spectrum. They do not cover the \
                     bias that what is left may cause."
                ));
            }
        }
        if let Some(figure) = self.time_constant_figure() {
            document =
                document.figure(figure.to_svg()?, "Both time constants with 95 % intervals, before and after the effects.");
        }
        Ok(document)
    }

    fn time_constant_figure(&self) -> Option<Figure> {
        let models = self.models();
        let mut figure = None;
        for k in 0..2 {
            let names = models.iter().map(|m| m.0);
            let of: Vec<&TimeConstant> = models.iter().map(|m| &m.1.time_constants[k]).collect();
            let values: Vec<f64> = of.iter().map(|t| t.value_s.unwrap_or(f64::NAN)).collect();
            let (low, high): (Vec<f64>, Vec<f64>) =
                of.iter().map(|t| t.interval_95_s.map_or((f64::NAN, f64::NAN), |[a, b]| (a, b))).unzip();
            let places: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
            let series = Series::points("", places, values).interval(low, high).colour(Colour::Blue);
            let axes = (Axis::categories("", names), Axis::linear("time constant (s)"));
            if let Some(chart) = chart(short(&self.context.channels[k]), axes.0, axes.1, [series]) {
                figure = Some(figure.unwrap_or(Figure::new("").columns(2).panel_size(WIDTH_PX / 2.0, 270.0)).panel(chart));
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
            rows.push(("Inferred gas temperature less the reference, root mean square", "K", before, after));
        }
        let mut table = Table::new(["", "before", "after", "after / before"]);
        for (name, unit, before, after) in rows {
            let ratio = after / before;
            table = table.row([
                name.into(),
                with_unit(&rounded(before, 4), unit),
                with_unit(&rounded(after, 4), unit),
                rounded(ratio, 3),
            ]);
        }
        document
            .heading("Error before and after")
            .paragraph(
                "Held-out blocks are parts of the record that took no part in choosing effects or in fitting them. In the \
                 first two rows, 1 is what noise alone makes.",
            )
            .table(table)
    }

    fn tests(&self, document: Document) -> Document {
        let (base, last) = (&self.diagnosis.base.tests, &self.diagnosis.last.tests);
        let mut names: Vec<&str> = Vec::new();
        for test in base.iter().chain(last) {
            if !names.contains(&test.test.as_str()) {
                names.push(&test.test);
            }
        }
        let document = document.heading("Tests of what is left over");
        if names.is_empty() {
            return document.paragraph("No test could be made.");
        }
        let mut table = Table::new(["test", "question", "before", "p-value", "after", "p-value"]);
        for name in names {
            let of = |tests: &[twinlag_cross_relation::ResidualTest]| {
                tests.iter().find(|t| t.test == name).map_or([ABSENT.to_owned(), ABSENT.to_owned()], |t| {
                    let freedom = t.degrees_of_freedom.map_or(String::new(), |d| format!(" ({})", rounded(d, 3)));
                    [format!("{}{freedom}", rounded(t.statistic, 3)), probability(t.p_value)]
                })
            };
            let ([before, p_before], [after, p_after]) = (of(base), of(last));
            table = table.row([words_of(name), question(name).into(), before, p_before, after, p_after]);
        }
        document
            .paragraph(
                "Each asks whether the residual is white noise of unit variance. The p-value is the probability of a \
                 statistic at least as extreme if it is: a small one speaks against the model.",
            )
            .table(table.caption("Statistics, with their degrees of freedom where they have any."))
    }

    fn unexplained(&self, document: Document) -> Document {
        let document = document.heading("What is unexplained");
        let Some(left) = &self.diagnosis.unexplained else {
            return document.paragraph(match self.diagnosis.verdict {
                Verdict::Refused => "The record was not diagnosed: nothing can be said.",
                _ => "Nothing that these tests show: what is left cannot be told from noise.",
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
        let mut items: Vec<String> = Vec::new();
        if self.diagnosis.verdict != Verdict::Refused {
            items.extend(self.diagnosis.not_testable.iter().map(|text| sentence(text)));
        }
        let mut told: Vec<Identifier> = Vec::new();
        for found in &self.diagnosis.effects {
            if !told.contains(&found.effect) {
                told.push(found.effect);
                items.push(format!("{}: not seen is {}.", capital(&words(found.effect)), found.effect.about().unseen));
            }
        }
        document
            .heading("What this record cannot tell")
            .paragraph(
                "The diagnosis sees the gas only through two sensors. What does the same to both leaves no trace in how \
                 they disagree, and is not among the effects even where it is large.",
            )
            .list(items)
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

/// A chart, without series of which nothing can be drawn; `None` if none is left.
fn chart(title: impl Into<String>, x: Axis, y: Axis, series: impl IntoIterator<Item = Series>) -> Option<Chart> {
    let mut chart = None;
    for one in series {
        let with = chart.clone().unwrap_or_else(|| Chart::new("", x.clone(), y.clone())).series(one);
        todo!()
    }
    chart
}
