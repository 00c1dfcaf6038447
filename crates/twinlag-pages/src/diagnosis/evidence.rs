//! Why effects were added, and what the tests say before and after.

use twinlag::cross_relation::TestName;
use twinlag_report::{Document, ReportError, Table, between, probability, rounded};

use super::Page;
use crate::residual_figures::{autocorrelation_figures, quantile_figures};
use crate::words::{ABSENT, grade, identifiers, parameter_in_words, place, question, unit, words, words_of};

impl Page<'_> {
    pub(super) fn evidence(&self, document: Document) -> Document {
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
        let mut sizes = Table::new(["effect", "parameter", "value", "95 % interval", "unit", "grade"]);
        for found in &self.answer.effects {
            let place = place(found.channel.as_ref());
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
                sizes = sizes.row([
                    words(found.effect),
                    parameter_in_words(&value.name),
                    value.value.map_or(ABSENT.into(), |value| rounded(value, 4)),
                    value.interval_95.map_or_else(absent, between),
                    unit(&value.unit).to_owned(),
                    grade(&value.judgement),
                ]);
            }
        }
        if self.changed {
            document = document
                .paragraph(
                    "The statistic is twice the gain in log-likelihood, with the level of the \
                     noise free: it is chi-square distributed if the effect is absent, and the \
                     p-value is the probability of a statistic so large. The gain on held-out \
                     blocks is that on parts of the record that the fit had not seen. An effect \
                     that is due to chance does not gain there.",
                )
                .table(evidence);
        }
        if !sizes.is_empty() {
            document = document.table(sizes.caption("Parameters of the effects."));
        }
        document
    }

    pub(super) fn tests(&self, document: Document) -> Result<Document, ReportError> {
        let models = self.columns();
        let mut names: Vec<TestName> = Vec::new();
        for test in models.iter().flat_map(|m| &m.answer.residual.tests) {
            if !names.contains(&test.test) {
                names.push(test.test);
            }
        }
        let document = document.heading("Tests of what is left over");
        if names.is_empty() {
            return Ok(document.paragraph("No test could be made."));
        }
        let header = models.iter().flat_map(|m| [if self.changed { m.column } else { "statistic" }, "p-value"]);
        let mut table = Table::new(["test", "question"].into_iter().chain(header));
        for name in names {
            let cells = models.iter().flat_map(|m| {
                m.answer.residual.tests.iter().find(|t| t.test == name).map_or(
                    [ABSENT.to_owned(), ABSENT.to_owned()],
                    |t| {
                        let whole = |d: f64| if d.fract() == 0.0 { format!("{d:.0}") } else { rounded(d, 3) };
                        let freedom = t.degrees_of_freedom.map_or(String::new(), |d| format!(" ({})", whole(d)));
                        [format!("{}{freedom}", rounded(t.statistic, 3)), probability(t.p_value)]
                    },
                )
            });
            table = table.row([words_of(name.name()), question(name).into()].into_iter().chain(cells));
        }
        let document = document
            .paragraph(
                "Each test asks whether the residual is white noise of unit variance. The \
                 p-value is the probability of a statistic at least as extreme if it is, so a \
                 small one is evidence against the model.",
            )
            .table(table.caption("Statistics, with their degrees of freedom, if any, in brackets."));
        let plotted = self.models();
        let name = |k: usize| plotted[k].title();
        let document =
            document.side_by_side(autocorrelation_figures(&plotted).into_iter().enumerate().map(|(k, figure)| {
                let text = "autocorrelation of the residual; of white noise 95 % of the values lie in the pale range.";
                (figure, format!("{}: {text}", name(k)))
            }))?;
        document.side_by_side(quantile_figures(&plotted).into_iter().enumerate().map(|(k, figure)| {
            let text = "quantiles of the residual against those of noise of unit variance; the dashed line is where they are equal, and \
                        95 % of points lie in the pale range.";
            (figure, format!("{}: {text}", name(k)))
        }))
    }
}
