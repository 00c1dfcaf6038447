//! Time constants, noise and errors, before and after.

use twinlag::{IntervalMethod, LeftOutUnit};
use twinlag_report::{Axis, Document, Figure, ReportError, Series, Table, rounded};

use super::{Column, Page};
use crate::figures::{CHANNELS, WIDTH_PX, chart};
use crate::words::{apart, grade, interval, interval_of, place, seconds, sentence, short, with_unit, words};

impl Page<'_> {
    pub(super) fn numbers(&self, document: Document) -> Result<Document, ReportError> {
        let columns = self.columns();
        let header = columns.iter().flat_map(|m| [m.column, "95 % interval", "grade"].map(str::to_owned));
        let mut table = Table::new([String::new()].into_iter().chain(header));
        for (k, channel) in self.channels().iter().enumerate() {
            let of = |m: &Column<'_>| {
                let sensor = &m.answer.sensors[k];
                [seconds(sensor), interval_of(sensor), grade(&sensor.judgement)]
            };
            table = table.row([format!("time constant of {channel}")].into_iter().chain(columns.iter().flat_map(of)));
        }
        let of = |m: &Column<'_>| {
            let difference = &m.answer.time_constant_difference_s;
            [apart(difference), interval(difference.interval_95_s), grade(&difference.judgement)]
        };
        let is_total = self.answer.last.time_constant_difference_s.includes_delay;
        let name = if is_total { "total delay of the second channel" } else { "difference" };
        table = table.row([name.to_owned()].into_iter().chain(columns.iter().flat_map(of)));
        for (k, channel) in self.channels().iter().enumerate() {
            let noise = |m: &Column<'_>| with_unit(&rounded(m.answer.sensors[k].noise_std_k, 3), "K");
            let cells = columns.iter().flat_map(|m| [noise(m), String::new(), String::new()]);
            table = table.row([format!("noise of {channel}")].into_iter().chain(cells));
        }
        let mut document = document.heading("Time constants and noise, before and after").table(table);
        for model in columns.iter().filter(|m| m.answer.interval_method == IntervalMethod::ResidualSpectrum) {
            let when = if self.changed { format!(" {}", model.column) } else { String::new() };
            document = document.note(format!(
                "The residual{when} is not white, so the errors{when} follow from its own \
                 spectrum. They do not cover the bias that its cause may have."
            ));
        }
        if let Some(figure) = self.time_constant_figure() {
            document = document.drawing(
                figure,
                "Both time constants under each alternative, with their 95 % intervals: each model, and each other cause that explains \
                 the record as well as one that was found.",
            )?;
        }
        Ok(document)
    }

    /// Time constants under each model, and under each other cause that explains the record as well.
    fn time_constant_figure(&self) -> Option<Figure> {
        let columns = self.columns();
        let effects = &self.answer.effects;
        let twins = effects.iter().flat_map(|effect| &effect.exact_twins).map(|twin| (&twin.of, &twin.time_constants));
        let others =
            effects.iter().flat_map(|effect| &effect.other_causes).map(|other| (&other.of, &other.time_constants));
        let causes: Vec<_> = twins.chain(others).collect();
        let mut figure = None;
        for k in 0..2 {
            let of_models = columns.iter().map(|m| {
                let sensor = &m.answer.sensors[k];
                (m.name.to_owned(), sensor.time_constant_s, sensor.interval_95_s)
            });
            let of_causes = causes.iter().map(|(of, time_constants)| {
                let tau = &time_constants[k];
                let place = place(of.channel.as_ref());
                (format!("if it is {} in {place}", words(of.effect)), Some(tau.value), tau.interval_95)
            });
            let all = of_models.chain(of_causes).filter(|(_, value, _)| value.is_some());
            let of: Vec<(String, Option<f64>, Option<[f64; 2]>)> = all.collect();
            // One alone has nothing to be compared with.
            if of.len() < 2 {
                continue;
            }
            let names = of.iter().map(|(name, ..)| name.clone());
            let values: Vec<f64> = of.iter().map(|(_, value, _)| value.unwrap_or(f64::NAN)).collect();
            let (low, high): (Vec<f64>, Vec<f64>) =
                of.iter().map(|(.., ends)| ends.map_or((f64::NAN, f64::NAN), |[a, b]| (a, b))).unzip();
            let places: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
            let known = values.iter().any(|v| v.is_finite());
            let series = known.then(|| Series::points("", places, values).interval(low, high).colour(CHANNELS[k]));
            let axes = [Axis::categories("", names), Axis::linear("time constant (s)")];
            if let Some(chart) = chart(short(&self.channels()[k]), axes, [series]) {
                figure =
                    Some(figure.unwrap_or(Figure::new("").columns(2).panel_size(WIDTH_PX / 2.0, 270.0)).panel(chart));
            }
        }
        figure
    }

    pub(super) fn errors(&self, document: Document) -> Document {
        let budget = &self.answer.error.budget;
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
        if let Some(transfer) = self.answer.transfer.filter(|_| self.changed) {
            let name = match transfer.left_out {
                LeftOutUnit::Block => "Residual on a quarter of the record left out of the fit, root mean square",
                _ => "Residual on a record left out of the search, root mean square",
            };
            let rms = transfer.error.held_out_normalised_rms;
            rows.push((name, "", rms.before, rms.after));
        }
        if let Some(rmse) = self.answer.error.reference_rmse_k {
            rows.push((
                "Reconstructed gas temperature less the reference on held-out blocks, root mean square",
                "K",
                rmse.before,
                rmse.after,
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
                "Held-out blocks are parts of the record that took no part in choosing effects or in fitting them. In the \
                 first two rows, 1 is what noise alone makes.",
            )
            .table(table);
        let document =
            self.answer.what_got_worse().iter().fold(document, |document, why| document.paragraph(sentence(why)));
        if self.answer.error.reference_rmse_k.is_none() {
            return document;
        }
        document.paragraph(
            "The diagnosis has not seen the reference. The error against it includes what two sensors alone cannot \
             reveal: what both share, and which of them is right where they disagree about gain and offset.",
        )
    }
}
