//! What a diagnosis says in short: verdict, effects, the record.

use twinlag::diagnosis::{Grade, Identifier, Judgement, Value, Verdict};
use twinlag::{Diagnosis, NamedCause, NamedEffect, NamedTwin, SensorEstimate};
use twinlag_report::{Document, KeyNumber, ReportError, Table, Tone, rounded};

use super::Page;
use crate::Making;
use crate::gas::plausibility;
use crate::residual_figures::reason_figure;
use crate::words::{
    ABSENT, apart, capital, grade, identifiers, interval, interval_of, listed, parameter, place, seconds, sentence,
    short, with_interval, with_unit, words,
};

impl Page<'_> {
    /// The verdict in a sentence, the numbers that readers come for, and the picture that shows why.
    pub(super) fn first_screen(&self, document: Document, making: &Making) -> Result<Document, ReportError> {
        let (answer, record) = (self.answer, self.record);
        let samples = record.time_s.len();
        let facts = [
            format!("{samples} samples over {}", with_unit(&rounded(record.length_s(), 4), "s")),
            format!("channels {}", listed(self.channels())),
        ];
        let (tone, worth) = self.worth();
        let mut document = document.byline(making.byline(&facts)).verdict(tone, worth, capital(&self.lead()));
        if answer.verdict != Verdict::Refused {
            document = document.key_numbers(self.key_numbers());
        }
        if let Some(figure) = reason_figure(&self.models()) {
            document = document.drawing(figure, self.why())?;
        }
        // Why it was refused, or what to know before the numbers are used.
        Ok(answer.remarks.iter().fold(document, |document, remark| document.warning(sentence(remark))))
    }

    /// What the picture on the first screen shows.
    fn why(&self) -> String {
        let of = if self.changed { "each model leaves" } else { "two first-order lags leave" };
        format!("Why: what {of} over, in units of the noise. If it is noise alone, 95 % of it lies in the pale range.")
    }

    /// What the numbers are worth together, and the colour of that.
    fn worth(&self) -> (Tone, &'static str) {
        let grades = self.answer.last.grades();
        if self.answer.verdict == Verdict::Refused || grades.iter().all(|grade| *grade == Grade::NoGo) {
            (Tone::Bad, "No go.")
        } else if grades.iter().all(|grade| *grade == Grade::Go) {
            (Tone::Good, "Go.")
        } else if grades.contains(&Grade::NoGo) {
            (Tone::Caution, "In part: some numbers are not given.")
        } else {
            (Tone::Caution, "Conditional.")
        }
    }

    /// What was found, effect by effect.
    pub(super) fn found(&self, document: Document) -> Document {
        let answer = self.answer;
        let mut document = plausibility(document.heading("What was found"), &answer.last);
        if answer.verdict == Verdict::Unexplained {
            document = document.paragraph(
                "What to do: see below where in frequency and in time most of it lies, and look for what happens at the \
                 rig there. Where it is the highest frequencies, the gas may move faster than it is sampled: sample \
                 faster. Time constants and gas temperature are biased by it to an extent that the record does not \
                 reveal.",
            );
        } else if answer.effects.is_empty() {
            document = document.paragraph(match answer.verdict {
                Verdict::Refused => "Nothing was looked for.",
                _ => "No effect beside the two lags.",
            });
        }
        for found in &answer.effects {
            document = document.subheading(capital(&words(found.effect))).facts(facts(found));
            if !found.masked.is_empty() {
                document = masked(document, found);
            }
        }
        document
    }

    /// Both time constants and their difference, with their intervals and grades.
    fn key_numbers(&self) -> Vec<KeyNumber> {
        let last = &self.answer.last;
        let key = |name: String, value: String, interval: String, judgement: &Judgement| {
            let tone = match judgement.grade {
                Grade::Go => Tone::Good,
                Grade::Conditional => Tone::Caution,
                _ => Tone::Bad,
            };
            let grade =
                if judgement.grade == Grade::NoGo { format!("no-go: {}", judgement.because) } else { grade(judgement) };
            let interval = if interval == ABSENT { String::new() } else { interval };
            KeyNumber { name, value, interval, grade: (tone, grade) }
        };
        let as_interval = |text: String| if text.contains(" to ") { format!("95 %: {text}") } else { text };
        let difference = &last.time_constant_difference_s;
        let name = if difference.includes_delay { "Total delay of the second channel" } else { "Difference" };
        let of_sensor = |sensor: &SensorEstimate| {
            let name = format!("Time constant of {}", short(&sensor.channel));
            key(name, seconds(sensor), as_interval(interval_of(sensor)), &sensor.judgement)
        };
        let [first, second] = &last.sensors;
        let of_difference =
            key(name.into(), apart(difference), as_interval(interval(difference.interval_95_s)), &difference.judgement);
        vec![of_sensor(first), of_sensor(second), of_difference]
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
            Verdict::Adequate if answer.last.sensors.iter().all(|sensor| sensor.time_constant_s.is_none()) => {
                "What two first-order lags leave over cannot be distinguished from noise, but the record does not determine their time \
                 constants."
                    .into()
            }
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
            Verdict::PartlyExplained if effects_of_the_model(answer) <= answer.policy.most_distinguished_effects => {
                format!(
                    "With {effects} what is left looks like noise where the model was fitted, but {} not known to be the cause; the \
                     reasons are beside the numbers.",
                    if many { "they are" } else { "it is" },
                )
            }
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

/// Effects that were named, noise aside.
fn effects_of_the_model(answer: &Diagnosis) -> usize {
    answer.effects.iter().filter(|found| !found.effect.is_noise()).count()
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
    let [one, two] = twin.time_constants.each_ref().map(in_words);
    let what = format!("{} in {}", words(twin.of.effect), place(twin.of.channel.as_ref()));
    format!("{what}, with {}; {one}; {two}", in_words(&twin.parameter))
}

/// Another cause with the time constants that it means.
fn other_cause(other: &NamedCause) -> String {
    let [one, two] = other.time_constants.each_ref().map(in_words);
    format!("{} in {}, with {one} and {two}", words(other.of.effect), place(other.of.channel.as_ref()))
}

/// A number with its name and its interval.
fn in_words(number: &Value) -> String {
    format!("{} {}", number.name, with_interval(number.value, number.interval_95, &number.unit))
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
    let others: Vec<String> = found.other_causes.iter().map(other_cause).collect();
    facts.push(("Time constants with another cause", others.join("; ")));
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
