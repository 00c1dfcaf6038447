//! The summary of a batch: how many answered, why others did not, and both time constants of each.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use twinlag::diagnosis::Grade;

use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::Answers;
use crate::outcome::Outcome;
use crate::row::{Row, TAU, graded_columns};

/// How many units ended how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Counts {
    /// Number of those with [`Outcome::Answered`].
    pub answered: usize,
    /// Number of those with [`Outcome::Undetermined`].
    pub undetermined: usize,
    /// Number of those with [`Outcome::Unusable`] or [`Outcome::NotApplicable`].
    pub unusable: usize,
    /// Number of those with [`Outcome::Failed`].
    pub failed: usize,
}

impl Counts {
    fn add(&mut self, outcome: Outcome) {
        *match outcome {
            Outcome::Answered => &mut self.answered,
            Outcome::Undetermined => &mut self.undetermined,
            Outcome::Unusable | Outcome::NotApplicable => &mut self.unusable,
            Outcome::Failed => &mut self.failed,
        } += 1;
    }

    /// All of them.
    pub fn total(&self) -> usize {
        self.answered + self.undetermined + self.unusable + self.failed
    }
}

/// Why files cannot be used: reasons that differ by nothing but the file's name and numbers are one.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ReasonCount {
    /// The reason as the first of them has it.
    pub reason: String,
    /// The first of them.
    pub first: String,
    /// How many have it.
    pub count: usize,
}

/// A time constant of a member of the fleet.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MemberTau {
    /// The estimate, s.
    pub value_s: f64,
    /// Its 95 % interval, s.
    pub interval_95_s: [f64; 2],
    /// Whether it may be used without a condition.
    pub is_go: bool,
}

/// A record, or a rig, that was asked.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Member {
    /// The file, or the name of the rig.
    pub name: String,
    /// Both time constants; `None` where one is not given.
    pub tau: [Option<MemberTau>; 2],
    /// Effects that were found, in words; empty without any.
    pub effects: String,
    /// What a diagnosis said; empty without one.
    pub verdict: String,
}

/// What a batch found.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Fleet {
    /// How the units ended: records, or rigs where records are grouped.
    pub units: Counts,
    /// Files that cannot be used, those within rigs included.
    pub unusable_files: usize,
    /// Why files cannot be used, or why records and rigs have no answer, the most frequent first.
    pub reasons: Vec<ReasonCount>,
    /// Records that contradict the others of their rig: rig and file.
    pub contradicting: Vec<(String, String)>,
    /// Verdicts, by how many have them, the most frequent first; none without diagnoses.
    pub verdicts: Vec<(String, usize)>,
    /// Effects, by how many have them, the most frequent first.
    pub effects: Vec<(String, usize)>,
    /// Units that were read, in their order.
    pub members: Vec<Member>,
}

impl Fleet {
    /// Reads the summary from the rows.
    ///
    /// # Errors
    /// [`BatchError::Read`].
    pub fn of(units: &[Unit], answers: &mut impl Answers) -> Result<Self, BatchError> {
        let mut fleet = Self::default();
        let mut reasons: BTreeMap<String, ReasonCount> = BTreeMap::new();
        let (mut verdicts, mut effects) = (BTreeMap::new(), BTreeMap::new());
        let is_grouped = !units.iter().any(|unit| matches!(unit, Unit::Record(_)));
        for unit in units {
            let rows = answers.rows(unit)?;
            for row in &rows {
                if let Some(reason) = reason_without_answer(row) {
                    let name = row.name();
                    let count = reasons.entry(kind(reason, name)).or_insert_with(|| ReasonCount {
                        reason: without_file(reason, name),
                        first: name.to_owned(),
                        count: 0,
                    });
                    count.count += 1;
                }
                let is_unusable = matches!(row.outcome(), Some(Outcome::Unusable | Outcome::NotApplicable));
                fleet.unusable_files += usize::from(row.is_unread() && is_unusable);
                if row.get("agrees").and_then(serde_json::Value::as_bool) == Some(false) {
                    let cell = |column| row.get_text(column).unwrap_or_default().to_owned();
                    fleet.contradicting.push((cell("rig"), cell("file")));
                }
            }
            let of_unit = rows.iter().find(|row| match unit {
                Unit::Rig { .. } => row.is_of_rig(),
                Unit::Record(_) | Unit::WithoutRig { .. } => true,
            });
            // A file of which nothing says whose it is belongs to no rig.
            if !(is_grouped && matches!(unit, Unit::WithoutRig { .. })) {
                fleet.units.add(of_unit.and_then(Row::outcome).unwrap_or(Outcome::Failed));
            }
            let Some(row) = of_unit.filter(|row| row.get_number("samples").is_some()) else { continue };
            let member = Member::of(row);
            if !member.verdict.is_empty() {
                *verdicts.entry(member.verdict.clone()).or_default() += 1;
            }
            for effect in row.effect_names() {
                *effects.entry(effect.to_owned()).or_default() += 1;
            }
            fleet.members.push(member);
        }
        fleet.reasons = reasons.into_values().collect();
        fleet.reasons.sort_by_key(|reason| Reverse(reason.count));
        (fleet.verdicts, fleet.effects) = (most_frequent_first(verdicts), most_frequent_first(effects));
        Ok(fleet)
    }
}

impl Member {
    fn of(row: &Row) -> Self {
        let text = |column| row.in_words(column).unwrap_or_default().into_owned();
        let tau = TAU.map(|tau| {
            let [value, low, high, grade, _] = graded_columns(tau);
            let is_go = row.get_text(&grade) == Some(&Grade::Go.to_string());
            let interval_95_s = [row.get_number(&low)?, row.get_number(&high)?];
            Some(MemberTau { value_s: row.get_number(&value)?, interval_95_s, is_go })
        });
        Self { name: row.name().to_owned(), tau, effects: text("effects"), verdict: text("verdict") }
    }
}

/// Why a row has no answer; `None` of one that has, and of one that rests on its rig.
fn reason_without_answer(row: &Row) -> Option<&str> {
    if row.outcome() == Some(Outcome::Answered) {
        return None;
    }
    let [[.., one], [.., two]] = TAU.map(graded_columns);
    ["reason", &one, &two, "gas_because"].into_iter().find_map(|why| row.get_text(why))
}

/// A reason without the name of the file that it begins with.
fn without_file(reason: &str, file: &str) -> String {
    reason.strip_prefix(file).map_or(reason, |rest| rest.trim_start_matches([':', ',', ' '])).to_owned()
}

/// A reason with its file name and numbers replaced, equal for reasons of one kind.
fn kind(reason: &str, file: &str) -> String {
    let text = without_file(reason, file);
    let text = if file.is_empty() { text } else { text.replace(file, "FILE") };
    let mut kind = String::new();
    for c in text.chars() {
        match c {
            '0'..='9' if kind.ends_with('#') => {}
            '0'..='9' => kind.push('#'),
            c => kind.push(c),
        }
    }
    kind
}

fn most_frequent_first(counts: BTreeMap<String, usize>) -> Vec<(String, usize)> {
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| Reverse(*count));
    counts
}

#[cfg(test)]
mod tests {
    use super::{kind, without_file};

    #[test]
    fn reasons_are_of_one_kind_whatever_their_numbers() {
        let [one, other] = ["a.csv", "b/c.csv"].map(|file| (format!("{file}, line 12: expected 3 cells"), file));
        assert_eq!(kind(&one.0, one.1), kind(&other.0.replace("12", "7"), other.1));
        assert_eq!(without_file(&one.0, one.1), "line 12: expected 3 cells");
        assert_eq!(kind("periods of 12 and 7 ms", ""), kind("periods of 3 and 100 ms", ""));
        assert_ne!(kind("a.csv: the file is empty", "a.csv"), kind("b.csv: one column", "b.csv"));
    }
}
