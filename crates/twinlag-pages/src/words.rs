//! Words and numbers of the report.

use twinlag::cross_relation::TestName;
use twinlag::diagnosis::{Grade, Identifier, Judgement};
use twinlag::record::SamplingKind;
use twinlag::{
    Difference, DisagreementAnswer, EffectInPlace, EffectNumber, PlausibleTimeConstant, RecordAnswer, RecordSummary,
    SensorEstimate,
};
use twinlag_report::{between, plus_minus, rounded};

pub(crate) const ABSENT: &str = "not given";

/// A name for scripts as words.
pub(crate) fn words_of(name: &str) -> String {
    name.replace('-', " ")
}

pub(crate) fn words(effect: Identifier) -> String {
    words_of(effect.name())
}

pub(crate) fn identifiers(effects: &[Identifier]) -> String {
    effects.iter().map(|e| words(*e)).collect::<Vec<_>>().join(", ")
}

/// `a`, `a and b`, `a, b and c`.
pub(crate) fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

pub(crate) fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |first| first.to_uppercase().chain(chars).collect())
}

/// With a capital and a full stop; nothing stays nothing.
pub(crate) fn sentence(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() || text.ends_with(['.', '!', '?']) { capital(text) } else { format!("{}.", capital(text)) }
}

/// A parameter's name as words.
pub fn parameter_in_words(name: &str) -> String {
    match name {
        "curvature_of_first" => "curvature of the first channel".into(),
        "curvature_about" => "mean temperature of the record".into(),
        "curvature_variance" => "variance of its temperatures".into(),
        "curvature_skew" => "third moment of its temperatures over the variance".into(),
        _ => name.replace('_', " "),
    }
}

/// An effect with its channel.
pub(crate) fn in_place(EffectInPlace { effect, channel, .. }: &EffectInPlace) -> String {
    let name = words(*effect);
    channel.as_ref().map_or_else(|| name.clone(), |channel| format!("{name} in {channel}"))
}

/// Which records contradict the others, and on what, or two records each other; and what to do. Nothing where none does.
pub fn contradictions_in_words(records: &[RecordAnswer]) -> Vec<String> {
    let (known, open): (Vec<&RecordAnswer>, Vec<&RecordAnswer>) = records.iter().partition(|r| r.agrees.is_some());
    let mut out: Vec<String> = known.into_iter().flat_map(contradiction_in_words).collect();
    if !out.is_empty() {
        out.push(
            "diagnose that record alone, and the others without it: it had a part in the models that their errors are of".to_owned(),
        );
    }
    // What one of two says of the other, that says of the one.
    if let Some(lines) = open.into_iter().map(contradiction_in_words).find(|lines| !lines.is_empty()) {
        out.extend(lines);
        out.push("two records do not say which of them is of another rig: diagnose each alone".to_owned());
    }
    out
}

fn contradiction_in_words(record: &RecordAnswer) -> Vec<String> {
    let source = &record.source;
    // Of two records either may be the one of another rig.
    let (contradicts, others, they_give) = match record.agrees {
        Some(_) => ("contradicts the others", "the others", "they give"),
        None => ("contradicts the other record", "the other", "that gives"),
    };
    let effects = |found: &[EffectInPlace]| match found {
        [] => "two lags".to_owned(),
        found => format!("two lags with {}", listed(&found.iter().map(in_place).collect::<Vec<_>>())),
    };
    let mut out = Vec::new();
    if let Some(alone) = record.found_alone.as_ref().filter(|alone| **alone != record.found_on_others) {
        let (alone, of_others) = (effects(alone), effects(&record.found_on_others));
        out.push(format!(
            "{source} {contradicts}: {alone} explain it, {of_others} explain {others}, and nothing explains them together"
        ));
    } else if record.agrees == Some(false) && record.disagreements.is_empty() {
        out.push(format!(
            "{source} is explained alone, and the others are explained without it, but not all together. Effects and time constants \
             agree: a parameter of an effect or the noise may differ"
        ));
    }
    let of = |one: &DisagreementAnswer| {
        let what = match &one.of {
            Some(effect) => format!("{} of {}", parameter_in_words(&one.name), in_place(effect)),
            None => format!("the time constant of {}", one.name),
        };
        let number = |value: f64, error: f64| with_unit(&plus_minus(value, Some(error)), &one.unit);
        format!(
            "{source} {contradicts}: it gives {what} as {}, and {they_give} {}",
            number(one.value, one.standard_error),
            number(one.others, one.others_standard_error)
        )
    };
    out.extend(record.disagreements.iter().map(of));
    if are_exchanged(&record.disagreements) {
        out.push(format!(
            "{source} gives the time constants of {others} the other way round: its columns seem to be exchanged"
        ));
    }
    out
}

/// Standard errors within which two time constants are one. Chosen: by chance one pair in 16 000 is further apart.
const SAME_SE: f64 = 4.0;

/// Whether a record has each time constant that the others have of the other sensor, where theirs are two.
fn are_exchanged(disagreements: &[DisagreementAnswer]) -> bool {
    let mut time_constants = disagreements.iter().filter(|one| one.of.is_none());
    let is_same = |one: [f64; 2], other: [f64; 2]| (one[0] - other[0]).abs() < SAME_SE * one[1].hypot(other[1]);
    let own = |one: &DisagreementAnswer| [one.value, one.standard_error];
    let others = |one: &DisagreementAnswer| [one.others, one.others_standard_error];
    match [time_constants.next(), time_constants.next()] {
        [Some(first), Some(second)] => {
            let is_crosswise = is_same(own(first), others(second)) && is_same(own(second), others(first));
            is_crosswise && !is_same(others(first), others(second))
        }
        _ => false,
    }
}

/// Whether a time constant is what was expected of it, and what it would take where it is not.
pub fn plausibility_in_words(one: &PlausibleTimeConstant) -> String {
    let channel = &one.channel;
    let range =
        |[low, high]: [f64; 2], scale: f64| format!("{} to {}", rounded(low * scale, 2), rounded(high * scale, 2));
    let expected = format!("{} s ({})", range(one.range_95_s, 1.0), one.basis);
    let Some((found_s, [low, high])) = one.found_s.zip(one.found_interval_95_s) else {
        let instead = if one.is_taken_as_known {
            "does not determine it, so that was taken as known"
        } else {
            "gives none to compare"
        };
        return format!("expected of {channel}: {expected}; the record {instead}");
    };
    let found = format!("{} s [{}, {}]", rounded(found_s, 3), rounded(low, 3), rounded(high, 3));
    if one.is_outside != Some(true) {
        return format!("plausible: {channel} has {found}, expected are {expected}");
    }
    let take = one.would_take.map_or(String::new(), |take| {
        let diameter = take.diameter_m.map(|ends| format!("a diameter of {} mm", range(ends, 1e3)));
        let speed = take.speed_m_s.map(|ends| format!("a speed of {} m/s", range(ends, 1.0)));
        match (diameter, speed) {
            (Some(diameter), Some(speed)) => format!("; it would take {diameter}, or {speed}"),
            (Some(one), None) | (None, Some(one)) => format!("; it would take {one}"),
            (None, None) => "; it would take more than the correlation covers".into(),
        }
    });
    format!("implausible: {channel} has {found}, expected are {expected}{take}")
}

/// A name that does not fill a legend: its middle is left out, since names of one rig differ at their ends.
pub(crate) fn short(name: &str) -> String {
    const END: usize = 14;
    let length = name.chars().count();
    if length <= 2 * END {
        return name.into();
    }
    name.chars().take(END).chain(['…']).chain(name.chars().skip(length - END + 1)).collect()
}

/// A unit as it is printed: numbers without one have `1`.
pub(crate) fn unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// What is said behind the time from one sample to the next: `apart`, and of a record whose steps differ `apart on average`.
pub fn spacing_in_words(record: &RecordSummary) -> &'static str {
    if record.sampling.kind == SamplingKind::Irregular { "apart on average" } else { "apart" }
}

/// A unit as it stands behind a number: that of a flow is known to the user alone.
fn behind_a_number(unit: &str) -> &str {
    if unit == "its unit" { "in its unit" } else { unit }
}

/// A unit behind a number, with the blank between them; nothing of a number without one.
pub fn unit_suffix(of: &str) -> String {
    if unit(of).is_empty() { String::new() } else { format!(" {}", behind_a_number(of)) }
}

pub(crate) fn with_unit(number: &str, of: &str) -> String {
    if number == ABSENT || unit(of).is_empty() { number.into() } else { format!("{number} {}", behind_a_number(of)) }
}

/// A number with its interval.
pub(crate) fn with_interval(value: f64, interval_95: Option<[f64; 2]>, unit: &str) -> String {
    let ends = interval_95.map_or(String::new(), |ends| format!(", 95 % from {}", between(ends)));
    format!("{}{ends}", with_unit(&rounded(value, 4), unit))
}

/// A number of an effect with its interval and its grade, or why it is not given.
pub(crate) fn parameter(number: &EffectNumber) -> String {
    let name = parameter_in_words(&number.name);
    match number.value {
        Some(value) => {
            let number_in_words = with_interval(value, number.interval_95, &number.unit);
            format!("{name} {number_in_words} ({})", number.judgement.grade)
        }
        None => format!("{name} not given ({})", number.judgement.because),
    }
}

/// The grade of a number, with its reason where it has a condition or an interval that covers more than noise.
pub(crate) fn grade(judgement: &Judgement) -> String {
    match judgement.grade {
        Grade::Go if judgement.interval_covers.is_empty() => "go".into(),
        grade => format!("{grade}: {}", judgement.because),
    }
}

/// A time constant to five digits.
pub(crate) fn seconds(of: &SensorEstimate) -> String {
    of.time_constant_s.map_or(ABSENT.into(), |value| with_unit(&rounded(value, 5), "s"))
}

/// A difference to four digits.
pub(crate) fn apart(of: &Difference) -> String {
    of.value.map_or(ABSENT.into(), |value| with_unit(&rounded(value, 4), "s"))
}

pub(crate) fn interval(ends_s: Option<[f64; 2]>) -> String {
    ends_s.map_or(ABSENT.into(), |ends| match ends {
        [0.0, most_s] => format!("at most {}", with_unit(&rounded(most_s, 2), "s")),
        ends => with_unit(&between(ends), "s"),
    })
}

/// The interval of a time constant; one that is known exactly has none.
pub(crate) fn interval_of(of: &SensorEstimate) -> String {
    if of.known { "known beforehand".into() } else { interval(of.interval_95_s) }
}

/// Where an effect sits.
pub(crate) fn place(channel: Option<&String>) -> String {
    channel.map_or("both, or between them".into(), Clone::clone)
}

/// What a test asks.
pub(crate) fn question(test: TestName) -> &'static str {
    match test {
        TestName::TotalEnergy => "Is its energy that of the noise?",
        TestName::BandEnergy => "Does every frequency band have its share of the energy?",
        TestName::Whiteness => "Are values a few samples apart unrelated?",
        TestName::Coherence => "Is it unrelated to the inferred gas temperature, at every frequency?",
        TestName::Level => "Is it unrelated to how high the gas temperature is?",
        TestName::Rate => "Is it unrelated to how fast the gas temperature changes?",
        TestName::Time => "Is its energy the same all along the record?",
        TestName::Tails => "Are its largest values those of Gaussian noise?",
        TestName::Lines => "Is no single frequency far above its neighbours?",
        TestName::RepeatedValues => "Do readings equal the one before no more often than noise explains?",
        TestName::Calibration => "Do both sensors agree at rest?",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exchanged_columns_are_recognised() {
        let within = |error: f64, name: &str, value: f64, others: f64| -> DisagreementAnswer {
            let answer = serde_json::json!({
                "of": null, "name": name, "value": value, "standard_error": error, "others": others,
                "others_standard_error": error, "unit": "s", "p_value": 1e-9
            });
            serde_json::from_value(answer).expect("a disagreement")
        };
        let one = |name: &str, value: f64, others: f64| within(0.001, name, value, others);
        let exchanged = [one("fine", 0.4506, 0.1202), one("coarse", 0.1204, 0.4499)];
        assert!(are_exchanged(&exchanged));
        assert!(!are_exchanged(&exchanged[..1]));
        assert!(!are_exchanged(&[one("fine", 0.4506, 0.1202), one("coarse", 0.13, 0.4499)]));
        // Errors so wide that the sensors of the others may be alike.
        assert!(!are_exchanged(&[within(0.1, "fine", 0.4506, 0.1202), within(0.1, "coarse", 0.1204, 0.4499)]));
    }
}
