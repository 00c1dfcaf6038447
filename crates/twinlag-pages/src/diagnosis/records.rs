//! Several records of one rig, each beside the others.

use twinlag::cross_relation::Z_975;
use twinlag::{LeftOutUnit, OwnTimeConstant, RecordAnswer, TransferAnswer};
use twinlag_report::{Axis, Document, Figure, Reference, ReportError, Series, Table, plus_minus, rounded};

use super::Page;
use crate::figures::{CHANNELS, WIDTH_PX, chart};
use crate::making::file_name;
use crate::words::{ABSENT, contradictions_in_words, in_place, listed, short, with_unit};

impl Page<'_> {
    /// What each record says; nothing of a single one.
    pub(super) fn records(&self, document: Document) -> Result<Document, ReportError> {
        let of_records = |transfer: &TransferAnswer| transfer.left_out == LeftOutUnit::Record;
        let Some(transfer) = self.answer.transfer.filter(of_records) else { return Ok(document) };
        let document = document
            .heading("Each record")
            .paragraph(
                "Each record was left out in turn: the effects and all that the records share were found on the others. The root mean \
                 square of its whitened residual under their model is 1 where only noise is left. The time constants are those of the \
                 record by itself, the rest of the model at its best, with their standard errors.",
            )
            .table(self.record_table(&transfer));
        let document = match self.record_figure() {
            Some(figure) => document.drawing(
                figure,
                "Both time constants as each record has them by itself, with 95 % intervals; the line is that of all records together.",
            )?,
            None => document,
        };
        Ok(contradictions_in_words(&self.answer.records).into_iter().fold(document, Document::warning))
    }

    fn record_table(&self, transfer: &TransferAnswer) -> Table {
        let [one, two] = self.channels();
        let header = [
            "record".to_owned(),
            "two lags".to_owned(),
            "with the effects".to_owned(),
            "effects that the others show".to_owned(),
            format!("time constant of {one}"),
            format!("time constant of {two}"),
            "agrees".to_owned(),
        ];
        let of_record = |record: &RecordAnswer| {
            let rms = record.error.held_out_normalised_rms;
            let [one, two] = record.time_constants.map(|own| own.map_or(ABSENT.to_owned(), own_time_constant));
            let found: Vec<String> = record.found_on_others.iter().map(in_place).collect();
            let agrees = record.agrees.map_or("not known", |agrees| if agrees { "yes" } else { "no" });
            [
                file_name(&record.source).to_owned(),
                rounded(rms.before, 4),
                rounded(rms.after, 4),
                listed(&found),
                one,
                two,
                agrees.to_owned(),
            ]
        };
        let rms = transfer.error.held_out_normalised_rms;
        let nothing = String::new;
        let all = [
            "all".to_owned(),
            rounded(rms.before, 4),
            rounded(rms.after, 4),
            nothing(),
            nothing(),
            nothing(),
            nothing(),
        ];
        self.answer.records.iter().map(of_record).chain([all]).fold(Table::new(header), Table::row)
    }

    /// `None` where no record gives a time constant.
    fn record_figure(&self) -> Option<Figure> {
        let mut figure = None;
        for (sensor, channel) in self.channels().iter().enumerate() {
            let given =
                self.answer.records.iter().filter_map(|r| Some((name_of(&r.source), r.time_constants[sensor]?)));
            let (names, own): (Vec<&str>, Vec<OwnTimeConstant>) = given.unzip();
            if own.is_empty() {
                continue;
            }
            let places: Vec<f64> = (0..own.len()).map(|i| i as f64).collect();
            let end = |side: f64| {
                let of = |own: &OwnTimeConstant| own.value_s + side * Z_975 * own.standard_error_s;
                own.iter().map(of).collect::<Vec<f64>>()
            };
            let series = Series::points("", places, end(0.0)).interval(end(-1.0), end(1.0)).colour(CHANNELS[sensor]);
            let axes = [Axis::categories("", names), Axis::linear("time constant (s)")];
            if let Some(mut panel) = chart(short(channel), axes, [Some(series)]) {
                if let Some(shared_s) = self.answer.last.sensors[sensor].time_constant_s {
                    panel = panel.reference(Reference::horizontal(shared_s));
                }
                figure =
                    Some(figure.unwrap_or(Figure::new("").columns(2).panel_size(WIDTH_PX / 2.0, 270.0)).panel(panel));
            }
        }
        figure
    }
}

/// The name of a file without its folder and its ending.
fn name_of(source: &str) -> &str {
    std::path::Path::new(source).file_stem().and_then(std::ffi::OsStr::to_str).unwrap_or(source)
}

fn own_time_constant(own: OwnTimeConstant) -> String {
    with_unit(&plus_minus(own.value_s, Some(own.standard_error_s)), "s")
}
