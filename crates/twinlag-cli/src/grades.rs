//! Grades on the console, and in the exit code.

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

/// A number with its grade; in its place, of one that is not given, why.
pub(crate) fn graded(number: Option<String>, judgement: &Judgement) -> String {
    let Judgement { grade, because, .. } = judgement;
    match (number, grade) {
        (None, Grade::NoGo) => format!("not given: {because}"),
        (None, _) => "not determined by this record".into(),
        (Some(number), Grade::Go) => format!("{number}  go"),
        (Some(number), Grade::Conditional) => format!("{number}  conditional: {because}"),
        (Some(number), _) => format!("{number}  NO-GO, do not use: {because}"),
    }
}

#[cfg(test)]
mod tests {
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
}
