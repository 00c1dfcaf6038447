//! What stays open: what is unexplained, and what cannot be known.

use twinlag::diagnosis::{Identifier, Verdict};
use twinlag_report::{Document, Table, rounded};

use super::Page;
use crate::words::{ABSENT, capital, place, sentence, with_unit, words};

impl Page<'_> {
    pub(super) fn unexplained(&self, document: Document) -> Document {
        let document = document.heading("What is unexplained");
        let Some(left) = &self.answer.unexplained else {
            return document.paragraph(match self.answer.verdict {
                Verdict::Refused => "The record was not diagnosed: nothing can be said.",
                _ => "Nothing that these tests show: what is left cannot be distinguished from noise.",
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

    pub(super) fn unknowable(&self, document: Document) -> Document {
        let mut items: Vec<String> = self.answer.not_testable.iter().map(|text| sentence(text)).collect();
        let mut said: Vec<Identifier> = Vec::new();
        for found in &self.answer.effects {
            if !said.contains(&found.effect) {
                said.push(found.effect);
                items.push(format!(
                    "{}: two sensors cannot reveal {}.",
                    capital(&words(found.effect)),
                    found.effect.about().unseen
                ));
            }
        }
        let mut limits = Table::new([
            "effect",
            "where",
            "parameter",
            "smallest size that would \
                                                                      have been detected",
        ]);
        for limit in &self.answer.limits {
            limits = limits.row([
                words(limit.effect),
                place(limit.channel.as_ref()),
                limit.parameter.replace('_', " "),
                with_unit(&rounded(limit.size, 2), &limit.unit),
            ]);
        }
        let document = document
            .heading("What this record cannot reveal")
            .paragraph(
                "The diagnosis sees the gas only through two sensors. Anything that affects both \
                 alike leaves no trace in their disagreement, and is not among the effects even \
                 if it is large.",
            )
            .list(items);
        if limits.is_empty() {
            return match self.answer.verdict {
                Verdict::PartlyExplained | Verdict::Unexplained => document.paragraph(
                    "Of the effects that were not found none can be excluded: what is left over may hide one of any size.",
                ),
                _ => document,
            };
        }
        document
            .paragraph(
                "Of the effects that were not found, no more is known than that they are small: below these sizes they \
                 would not have been distinguished from chance.",
            )
            .table(limits)
    }
}
