//! The summary of a batch: how many answered, why others did not, and both time constants of each.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::Journal;
use crate::row::Row;

/// How units ended, by the exit code that the program would have had on each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Counts {
    /// Answered.
    pub answered: usize,
    /// Read, but the data do not answer the question.
    pub undetermined: usize,
    /// The file cannot be used.
    pub unusable: usize,
    /// The program failed: a panic, or an output that cannot be written.
    pub failed: usize,
}

impl Counts {
    fn add(&mut self, exit_code: Option<u8>) {
        *match exit_code {
            Some(0) => &mut self.answered,
            Some(4) => &mut self.undetermined,
            // 2: what was asked does not go for this file.
            Some(3 | 2) => &mut self.unusable,
            _ => &mut self.failed,
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
    pub fn of(units: &[Unit], journal: &mut Journal) -> Result<Self, BatchError> {
        let mut fleet = Self::default();
        let mut reasons: BTreeMap<String, ReasonCount> = BTreeMap::new();
        let (mut verdicts, mut effects) = (BTreeMap::new(), BTreeMap::new());
        let is_grouped = !units.iter().any(|unit| matches!(unit, Unit::Record(_)));
        for unit in units {
            let rows = journal.rows(unit)?;
            for row in &rows {
                if let Some(reason) = reason_without_answer(row) {
                    let name = row.get_text("file").or(row.get_text("rig")).unwrap_or_default();
                    let count = reasons.entry(kind(reason, name)).or_insert_with(|| ReasonCount {
                        reason: without_file(reason, name),
                        first: name.to_owned(),
                        count: 0,
                    });
                    count.count += 1;
                }
                fleet.unusable_files += usize::from(row.is_unread() && matches!(row.exit_code(), Some(2 | 3)));
                if row.get("agrees").and_then(serde_json::Value::as_bool) == Some(false) {
                    let cell = |column| row.get_text(column).unwrap_or_default().to_owned();
                    fleet.contradicting.push((cell("rig"), cell("file")));
                }
            }
            let of_unit = rows.iter().find(|row| match unit {
                Unit::Rig { .. } => row.get_text("level") == Some("rig"),
                Unit::Record(_) | Unit::WithoutRig { .. } => true,
            });
            // A file of which nothing says whose it is belongs to no rig.
            if !(is_grouped && matches!(unit, Unit::WithoutRig { .. })) {
                fleet.units.add(of_unit.and_then(Row::exit_code));
            }
            let Some(row) = of_unit.filter(|row| row.get_number("samples").is_some()) else { continue };
            let member = Member::of(row);
            if !member.verdict.is_empty() {
                *verdicts.entry(member.verdict.clone()).or_default() += 1;
            }
            for effect in member.effects.split("; ").filter(|effect| !effect.is_empty()) {
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
        let text = |column| row.get_text(column).unwrap_or_default().to_owned();
        let name = if row.get_text("level") == Some("rig") { text("rig") } else { text("file") };
        let tau = ["tau1", "tau2"].map(|tau| {
            let number = |column: &str| row.get_number(&format!("{tau}{column}"));
            let interval_95_s = [number("_low_s")?, number("_high_s")?];
            let is_go = row.get_text(&format!("{tau}_grade")) == Some("go");
            Some(MemberTau { value_s: number("_s")?, interval_95_s, is_go })
        });
        Self { name, tau, effects: text("effects"), verdict: text("verdict") }
    }
}

/// Why a row has no answer; `None` of one that has, and of one that rests on its rig.
fn reason_without_answer(row: &Row) -> Option<&str> {
    let whys = ["reason", "tau1_because", "tau2_because", "gas_because"];
    if row.exit_code() == Some(0) { None } else { whys.into_iter().find_map(|why| row.get_text(why)) }
}

/// A reason without the name of the file that it begins with.
fn without_file(reason: &str, file: &str) -> String {
    reason.strip_prefix(file).map_or(reason, |rest| rest.trim_start_matches([':', ',', ' '])).to_owned()
}

/// What reasons of one kind share: a number is like any other.
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
