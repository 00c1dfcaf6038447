//! What a diagnosis says in short: verdict, effects, the record.

use twinlag::diagnosis::{Identifier, Value, Verdict};
use twinlag::{NamedEffect, NamedTwin, SensorEstimate};
use twinlag_report::{Document, Table, rounded};

use super::Page;
use crate::gas::plausibility;
use crate::words::{
    apart, capital, grade, identifiers, interval, interval_of, listed, parameter, place, seconds, sentence,
    with_interval, with_unit, words,
};

impl Page<'_> {
    pub(super) fn verdict(&self, document: Document) -> Document {
        let (answer, record) = (self.answer, self.record);
        let mut document = document.heading("Verdict").lead(self.lead());
        if answer.verdict != Verdict::Refused {
            document = document.facts(self.graded());
        }
        // Why it was refused, or what to know before the numbers are used.
        for remark in &answer.remarks {
            document = document.warning(sentence(remark));
        }
        document = plausibility(document, &answer.last);
        if answer.verdict == Verdict::Unexplained {
            document = document.paragraph(
                "What to do: see below where in frequency and in time most of it lies, and look for what happens at the \
                 rig there. Time constants and gas temperature are biased by it to an extent that the record does not \
                 reveal.",
            );
        }
        for found in &answer.effects {
            document = document.subheading(capital(&words(found.effect))).facts(facts(found));
            if !found.masked.is_empty() {
                document = masked(document, found);
            }
        }
        let samples = record.time_s.len();
        let span_s = record.time_s.last().zip(record.time_s.first()).map_or(f64::NAN, |(b, a)| b - a);
        document.subheading("The record").facts([
            ("Source", record.source.clone()),
            ("Channels", listed(self.channels())),
            ("Samples", format!("{samples}, over {}", with_unit(&rounded(span_s, 4), "s"))),
        ])
    }

    /// Both time constants and their difference, with their intervals and grades.
    fn graded(&self) -> Vec<(&'static str, String)> {
        let last = &self.answer.last;
        let of = |sensor: &SensorEstimate| match sensor.time_constant_s {
            Some(_) => format!(
                "{}: {} ({}), {}",
                sensor.channel,
                seconds(sensor),
                interval_of(sensor),
                grade(&sensor.judgement)
            ),
            None => format!("{}: not given, {}", sensor.channel, sensor.judgement.because),
        };
        let difference = &last.time_constant_difference_s;
        let apart = match difference.value {
            Some(_) => format!(
                "{} ({}), {}",
                apart(difference),
                interval(difference.interval_95_s),
                grade(&difference.judgement)
            ),
            None => format!("not given, {}", difference.judgement.because),
        };
        let [first, second] = &last.sensors;
        let name = if difference.includes_delay { "Total delay of the second channel" } else { "Difference" };
        vec![
            ("Time constant, with 95 % interval", of(first)),
            ("Time constant, with 95 % interval", of(second)),
            (name, apart),
        ]
    }

    fn lead(&self) -> String {
        let answer = self.answer;
        let effects = listed(&answer.effects.iter().map(named).collect::<Vec<_>>());
        let many = answer.effects.len() > 1;
        let left = answer.explained_to.filter(|share| *share > 0.0);
        match answer.verdict {
            Verdict::Adequate | Verdict::Explained if left.is_some() => format!(
                "{} this record to {} %: so much energy is left over beside that of the noise, and the intervals cover it.",
                if effects.is_empty() {
                    "Two first-order lags explain".into()
                } else {
                    format!("With {effects} the model explains")
                },
                rounded(100.0 * left.unwrap_or_default(), 2)
            ),
            Verdict::Adequate => {
                "Two first-order lags explain this record: what they leave over cannot be distinguished \
                                  from noise."
                    .into()
            }
            Verdict::Explained => format!(
                "Two first-order lags alone do not explain this record; with {} more, {effects}, what is left cannot be \
                 distinguished from noise.",
                if many { "these effects" } else { "one effect" },
            ),
            Verdict::PartlyExplained if answer.unexplained.is_some() => format!(
                "{effects} {} part of the residual of two first-order lags, but more than noise \
                 is left.",
                if many { "explain" } else { "explains" },
            ),
            Verdict::PartlyExplained => format!(
                "With {effects} what is left looks like noise, but one record cannot keep so many effects apart: \
                 together they may imitate another cause."
            ),
            Verdict::Unexplained => "Two first-order lags do not explain this record, and no \
                                     known effect explains the residual."
                .into(),
            Verdict::Refused => "This record cannot be diagnosed.".into(),
            _ => "The verdict is one that this report does not know.".into(),
        }
    }
}

/// `delay (T2) or second order`.
fn named(found: &NamedEffect) -> String {
    let place = found.channel.as_ref().map_or(String::new(), |name| format!(" ({name})"));
    let first = format!("{}{place}", words(found.effect));
    let others = found.alternatives.iter().map(|other| words(*other));
    [first].into_iter().chain(others).collect::<Vec<_>>().join(" or ")
}

/// Places of masked readings that are listed at most.
const MAX_MASKED: usize = 40;

/// Which readings are left out of the fit.
fn masked(document: Document, found: &NamedEffect) -> Document {
    let range = |first: String, last: String| if first == last { first } else { format!("{first} to {last}") };
    let rows = found.masked.iter().take(MAX_MASKED).map(|run| {
        let ([first, last], [from_s, to_s]) = (run.rows, run.time_s);
        [range(first.to_string(), last.to_string()), range(rounded(from_s, 6), rounded(to_s, 6))]
    });
    let table = rows.fold(Table::new(["rows", "time (s)"]), Table::row);
    let more = found.masked.len().saturating_sub(MAX_MASKED);
    let rest = if more > 0 { format!(" {more} more places are in the JSON.") } else { String::new() };
    document.table(table.caption(format!(
        "Readings of {} that are left out of the fit; rows are lines of the file, if there is one.{rest}",
        place(found.channel.as_ref())
    )))
}

/// An effect that no record distinguishes, with the numbers if it is the cause.
fn twin(twin: &NamedTwin) -> String {
    let number =
        |number: &Value| format!("{} {}", number.name, with_interval(number.value, number.interval_95, &number.unit));
    let [one, two] = &twin.time_constants;
    let what = format!("{} in {}", words(twin.of.effect), place(twin.of.channel.as_ref()));
    format!("{what}, with {}; {}; {}", number(&twin.parameter), number(one), number(two))
}

/// What is said of an effect.
fn facts(found: &NamedEffect) -> Vec<(&'static str, String)> {
    let about = found.effect.about();
    let mut facts = vec![("Where", place(found.channel.as_ref())), ("What it is", sentence(about.explanation))];
    let sizes: Vec<String> = found.parameters.iter().map(parameter).collect();
    let seen = found.seen.iter().cloned().chain((!sizes.is_empty()).then(|| sizes.join("; ")));
    facts.push(("What was found", sentence(&seen.collect::<Vec<_>>().join("; "))));
    facts.push(("What to do", sentence(about.advice)));
    facts.push(("Explains this record equally well", identifiers(&found.alternatives)));
    let twins: Vec<String> = found.exact_twins.iter().map(twin).collect();
    facts.push(("Would look exactly the same", twins.join("; ")));
    facts.push((
        "How it began",
        found.first_state.as_ref().map(|state| sentence(&state.to_string())).unwrap_or_default(),
    ));
    let confusable: Vec<Identifier> =
        found.effect.imitates().filter(|other| !found.alternatives.contains(other)).collect();
    facts.push(("Resembles, if it is small", identifiers(&confusable)));
    facts.retain(|(_, text)| !text.is_empty());
    facts
}
