//! `twinlag explain NAME`: an effect, one of its numbers, a status, a verdict, a grade or a test in plain words.

mod numbers;

use serde::Serialize;
use twinlag::cross_relation::TestName;
use twinlag::diagnosis::{Identifier, NEVER_TESTABLE};

use crate::arguments::Explain;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;

/// What two sensors alone can never reveal.
const TWO_SENSORS: &str = "two-sensors";

const STATUSES: [(&str, &str); 4] = [
    ("ok", "both time constants are determined, and what the model leaves over is consistent with noise"),
    (
        "at-bound",
        "the best fit lies on a bound of a parameter, so its number is no estimate: the warning says which parameter, and \
         whether faster sampling or a longer record would help",
    ),
    (
        "not-identifiable",
        "the record does not determine both time constants, however well it is fitted. It may still determine their \
         difference, which is then printed. Give a time constant that is known (--known), or record a gas that changes faster",
    ),
    (
        "model-rejected",
        "what the model leaves over is more than noise, or the record contradicts a known time constant, so the time constants \
         need not be those of the sensors: 'twinlag diagnose' looks for what the model lacks",
    ),
];

/// Whether a number may be used.
const GRADES: [(&str, &str); 3] = [
    (
        "go",
        "the number and its 95 % interval may be used: what is left over is noise, and nothing else speaks against it",
    ),
    (
        "conditional",
        "the number and its interval are right if an assumption holds that the record cannot check: it is printed beside them. \
         Whoever knows that it holds, from a data sheet or from the rig, may use them. The exit code is 4 with --strict, and where a \
         diagnosis leaves something over",
    ),
    (
        "no-go",
        "nothing says how far the number may be off, so it is not given, null in JSON, and what speaks against it is printed \
         instead; the exit code is 4 where it was asked for. --best-effort prints it all the same, marked",
    ),
];

const GRADE: &str =
    "each number is go (use it), conditional (right if what is printed beside it holds) or no-go (not given, and why)";

const VERDICTS: [(&str, &str); 5] = [
    (
        "adequate",
        "two first-order lags leave only noise: no effect is needed, and effects above the limits in the report are excluded",
    ),
    ("explained", "with the effects that are named, only noise is left"),
    (
        "partly-explained",
        "the effects that are named explain a part, and more than noise is left, or there are more of them than one record \
         distinguishes: the numbers have a bias that no interval covers, and no other effect can be excluded",
    ),
    (
        "unexplained",
        "more than noise is left, and no effect of this library explains it: the numbers have a bias that no interval covers, \
         and no effect can be excluded. The report shows where in frequency and in time most of it lies",
    ),
    ("refused", "the record cannot be diagnosed, for example because the gas has a single tone: take another record"),
];

/// What a test asks of the residual, and what it may mean if it fails.
const TESTS: [(TestName, &str); 11] = [
    (
        TestName::TotalEnergy,
        "is the energy of the residual that of the noise? More may be an effect that the model lacks, or a noise level that is \
         too low",
    ),
    (
        TestName::BandEnergy,
        "does every band of frequencies have its share of the energy? A band with more shows how fast what is missing acts",
    ),
    (
        TestName::Whiteness,
        "are residuals a few samples apart unrelated? If not, something with a memory is missing, or the noise is coloured",
    ),
    (
        TestName::Calibration,
        "do both sensors agree at rest? If not, free gain and offset, or calibrate the sensors against each other",
    ),
    (
        TestName::Coherence,
        "is the residual unrelated to the gas temperature at every frequency? What goes with the gas is an error of the model and no noise",
    ),
    (
        TestName::Level,
        "is the residual unrelated to how high the gas temperature is? If not, look for radiation, curvature or a limited range",
    ),
    (
        TestName::Rate,
        "is the residual no larger where the gas changes fast? If it is, the dynamics of a sensor are not those of the model",
    ),
    (
        TestName::Time,
        "is the energy of the residual the same all along the record? If not, something changed or happened on the way",
    ),
    (TestName::Tails, "are the largest residuals those of Gaussian noise? If not, look for single wrong readings"),
    (
        TestName::Lines,
        "is no single frequency far above its neighbours? If one is, look for mains pick-up or a machine that vibrates",
    ),
    (
        TestName::RepeatedValues,
        "do readings equal the one before no more often than noise explains? If they do, the converter is coarse or repeats itself",
    ),
];

/// Fields of an answer that are about something else than a number.
const FIELDS: [(&str, &str); 5] = [
    (
        "transfer",
        "errors on what had no part in finding the model: of several records each in turn, where nothing is fitted but what belongs to \
         a record; of a single one each quarter in turn. 1 is noise; before is two first-order lags, after is the model",
    ),
    (
        "agrees",
        "whether one of several records agrees with the others. It does not if it contradicts them on a number that all share, or if it \
         is explained and so are they, but not together; not known (null) where the records do not say which of them differs, or are \
         not explained",
    ),
    (
        "interval-covers",
        "what makes an interval longer than the noise of the readings does: other-models explain the record as well and give another \
         number, left-over is what the model leaves, parts are parts of the record that differ, records are records of one rig that \
         differ. Of two records that differ by chance the interval is long, since two do not say how much a third would differ",
    ),
    (
        "exact-twins",
        "causes that no record distinguishes from the one that is named, whatever the gas and however little noise, with the numbers \
         that each would mean: a gain and a share of one channel in the other are such twins. What is known of the rig decides",
    ),
    (
        "first-state",
        "whether the slow body of a slow mode was in equilibrium with the gas as the record began, or began anywhere: the residual says \
         nothing of it, one number for each record does. The answer says which was taken, with which odds, and the numbers of the \
         other case",
    ),
];

/// Kinds of names, in the order in which they are listed.
const KINDS: [&str; 8] = ["effect", "number", "verdict", "status", "grade", "test", "answer", "limit"];

/// Most letters that are missing, needless, wrong or swapped in a name that is taken for a misspelt one. Chosen.
const MAX_EDITS: usize = 2;

/// A name with what it means.
#[derive(Serialize)]
struct Explanation {
    name: &'static str,
    kind: &'static str,
    text: Vec<String>,
}

/// Everything that has the name.
#[derive(Serialize)]
struct Explanations<'a> {
    explanations: Vec<&'a Explanation>,
}

pub(crate) fn run(command: &Explain, console: Console) -> Result<u8, Failure> {
    let all = explanations();
    let of = |kind: &str| all.iter().filter(|e| e.kind == kind).map(|e| e.name).collect::<Vec<_>>().join(", ");
    let list = KINDS.map(|kind| format!("\n  {kind}: {}", of(kind))).concat();
    let asked = command.name.as_ref().map(|name| name.to_lowercase().replace('_', "-"));
    let asked = asked.as_deref().map(numbers::explained);
    // `calibration` is an effect and a test.
    let found: Vec<&Explanation> = all.iter().filter(|e| asked.is_none_or(|asked| e.name == asked)).collect();
    match &command.name {
        Some(name) if found.is_empty() => {
            let nearest = asked.and_then(|asked| nearest(asked, &all));
            let nearest = nearest.map(|other| format!(" (is it '{other}'?)")).unwrap_or_default();
            return Err(Failure::Usage(format!("nothing is called '{name}'{nearest}; there are{list}")));
        }
        None if !console.json => {
            print::on_stdout(&format!("twinlag explain NAME, with one of{list}\n"))?;
            return Ok(0);
        }
        _ => {}
    }
    if console.json {
        print::json(&Explanations { explanations: found })?;
        return Ok(0);
    }
    let texts: Vec<String> =
        found.iter().map(|e| format!("{} ({})\n  {}\n", e.name, e.kind, e.text.join("\n  "))).collect();
    print::on_stdout(&texts.concat())?;
    Ok(0)
}

/// The name with the fewest edits; of a short one fewer than half its letters, or any word would be near it.
fn nearest(asked: &str, all: &[Explanation]) -> Option<&'static str> {
    let edits = all.iter().map(|e| (strsim::osa_distance(asked, e.name), e.name));
    edits.filter(|(edits, name)| *edits <= MAX_EDITS && 2 * edits < name.len()).min().map(|(_, name)| name)
}

fn explanations() -> Vec<Explanation> {
    let effects = Identifier::ALL.into_iter().map(of_effect);
    let worded = |kind: &'static str| {
        move |(name, text): (&'static str, &'static str)| Explanation { name, kind, text: vec![text.to_owned()] }
    };
    let tests = TESTS.map(|(test, text)| (test.name(), text));
    let never = NEVER_TESTABLE.iter().map(|what| format!("- {what}"));
    let first = "The gas is seen through the two sensors alone. Whatever changes both alike leaves no trace in their \
                 disagreement, even if it is large. No record, however long, reveals:";
    let two_sensors =
        Explanation { name: TWO_SENSORS, kind: "limit", text: [first.to_owned()].into_iter().chain(never).collect() };
    effects
        .chain(numbers::explanations())
        .chain(VERDICTS.map(worded("verdict")))
        .chain(STATUSES.map(worded("status")))
        .chain(GRADES.map(worded("grade")))
        .chain([("grades", GRADE)].map(worded("grade")))
        .chain(tests.map(worded("test")))
        .chain(FIELDS.map(worded("answer")))
        .chain([two_sensors])
        .collect()
}

fn of_effect(effect: Identifier) -> Explanation {
    let about = effect.about();
    let mut text = vec![
        about.explanation.to_owned(),
        format!("at the rig: {}", about.advice),
        format!("two sensors cannot reveal: {}", about.unseen),
    ];
    let alike: Vec<&str> = effect.imitates().map(Identifier::name).collect();
    if !alike.is_empty() {
        text.push(format!("resembles, if it is small: {}", alike.join(", ")));
    }
    Explanation { name: effect.name(), kind: "effect", text }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn names_of_one_kind_differ() {
        let all = explanations();
        let names: BTreeSet<(&str, &str)> = all.iter().map(|e| (e.kind, e.name)).collect();
        assert_eq!(names.len(), all.len());
        assert!(all.iter().all(|e| !e.text.is_empty() && e.text.iter().all(|line| !line.ends_with(": "))));
    }
}
