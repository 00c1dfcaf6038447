//! Grades on the console, and in the exit code.

use anstyle::{AnsiColor, Effects};
use twinlag::diagnosis::{Grade, Judgement};

/// The exit code of an answer: 4 where what was asked for may not be used.
///
/// - `asked`: grades of the numbers that the question is about
/// - `others`: grades of all others
/// - `is_partial`: whether the model leaves more than noise
/// - `strict`: whether a condition is as bad
pub(crate) fn exit_code(asked: &[Grade], others: &[Grade], is_partial: bool, strict: bool) -> u8 {
    let least = if strict { Grade::Go } else { Grade::Conditional };
    let is_usable = asked.iter().all(|grade| *grade <= least);
    let is_whole = !is_partial || asked.iter().chain(others).all(|grade| *grade == Grade::Go);
    if is_usable && is_whole { 0 } else { 4 }
}

/// The exit code of an answer. Where `--strict` changes it, standard error says why.
///
/// - `code`: the exit code, from whether a condition is as bad
pub(crate) fn strictly(strict: bool, code: impl Fn(bool) -> u8) -> u8 {
    let asked = code(strict);
    if strict && asked != code(false) {
        eprintln!("twinlag: exit code {asked}: with --strict every number has to be go, and one is conditional");
    }
    asked
}

/// A number with its grade.
pub(crate) fn graded(number: Option<String>, judgement: &Judgement) -> String {
    match (number, judgement.grade) {
        (None, grade) => painted("not given", grade),
        (Some(number), Grade::Go) => format!("{number}  {}", painted("go", Grade::Go)),
        (Some(number), Grade::Conditional) => format!("{number}  {}", painted("conditional", Grade::Conditional)),
        (Some(number), grade) => format!("{number}  {}", painted("NO-GO", grade)),
    }
}

/// Text in the colour of a grade. Where it is no terminal that it goes to, [`crate::print::on_stdout`] takes the colour out.
pub(crate) fn painted(text: &str, grade: Grade) -> String {
    let colour = match grade {
        Grade::Go => AnsiColor::Green,
        Grade::Conditional => AnsiColor::Yellow,
        _ => AnsiColor::Red,
    };
    let style = colour.on_default().effects(Effects::BOLD);
    format!("{style}{text}{style:#}")
}

/// Why numbers are not simply `go`, and what intervals cover beside noise, each reason once with the names of the numbers that it is of.
pub(crate) fn reasons<'a>(numbers: impl IntoIterator<Item = (String, &'a Judgement)>, indent: &str) -> Vec<String> {
    let mut groups: Vec<(Grade, String, Vec<String>)> = Vec::new();
    for (name, judgement) in numbers {
        let reasons: Vec<String> = match judgement.grade {
            Grade::Go => judgement.interval_covers.iter().map(ToString::to_string).collect(),
            _ => judgement.because.split("; ").map(str::to_owned).collect(),
        };
        for reason in reasons {
            match groups.iter_mut().find(|(grade, other, _)| (*grade, &other[..]) == (judgement.grade, &reason[..])) {
                Some((_, _, names)) => names.push(name.clone()),
                None => groups.push((judgement.grade, reason, vec![name.clone()])),
            }
        }
    }
    let line = |(grade, reason, names): (Grade, String, Vec<String>)| {
        format!("{indent}{grade} ({}): {reason}", names.join(", "))
    };
    groups.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use twinlag::diagnosis::Reason;

    use super::*;

    #[test]
    fn what_may_not_be_used_exits_with_4() {
        use Grade::{Conditional, Go, NoGo};
        assert_eq!(exit_code(&[Go, Conditional], &[NoGo], false, false), 0);
        assert_eq!(exit_code(&[Go, NoGo], &[], false, false), 4);
        assert_eq!(exit_code(&[Go, Conditional], &[], false, true), 4);
        assert_eq!(exit_code(&[Go, Conditional], &[], true, false), 4);
        assert_eq!(exit_code(&[Go, Go], &[Go], true, true), 0);
    }

    #[test]
    fn a_reason_is_said_once() {
        let left = Judgement::of(&[Reason::LeftOver]);
        let given = Judgement::of(&[Reason::Given { what: "T1 = 2 s".into() }]);
        let numbers = [("T1".to_owned(), &left), ("T2".to_owned(), &given), ("difference".to_owned(), &left)];
        let lines = reasons(numbers, "  ");
        assert_eq!(lines.len(), 2);
        assert!(lines[0].starts_with("  no-go (T1, difference): the model leaves more than noise"), "{lines:?}");
        assert_eq!(lines[1], "  conditional (T2): right if T1 = 2 s, as given");
        // Failed: a reason that is one of several was said again for each number that has others.
        let twice = Judgement::of(&[Reason::LeftOver, Reason::LeftOver]);
        assert_eq!(twice, left);
        let both = Judgement::of(&[Reason::Given { what: "T1 = 2 s".into() }, Reason::Biased]);
        let lines = reasons([("T2".to_owned(), &given), ("gain".to_owned(), &both)], "");
        assert_eq!(lines[0], "conditional (T2, gain): right if T1 = 2 s, as given");
        assert!(lines[1].starts_with("conditional (gain): ") && lines.len() == 2, "{lines:?}");
    }
}
