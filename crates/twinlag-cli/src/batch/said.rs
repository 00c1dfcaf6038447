//! What a batch says when it is done.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;
use twinlag::diagnosis::Grade;
use twinlag_batch::{Fleet, Member, MemberTau};

use crate::columns::columns;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;

/// What `twinlag batch` prints with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct BatchAnswer {
    /// `twinlag.batch/1`.
    schema: &'static str,
    /// Files of the table.
    out: Vec<PathBuf>,
    /// `records` or `rigs`: what one answer is for.
    units: &'static str,
    /// Number of records or rigs that answered.
    answered: usize,
    /// Number of records or rigs that were read, but of which at least one number that was asked for may not be used.
    undetermined: usize,
    /// Number of records or rigs whose files cannot be used, or to which what was asked does not apply.
    unusable: usize,
    /// Number of records or rigs with another error, such as an output that cannot be written.
    failed: usize,
    /// Number of files that cannot be used, or to which what was asked does not apply, those of rigs included.
    unusable_files: usize,
    /// Number of records that contradict the others of their rig.
    contradicting_records: usize,
}

/// Says what came of it.
///
/// - `tables`: as the user would call them
pub(super) fn say(tables: &[PathBuf], unit_name: &'static str, fleet: &Fleet, console: Console) -> Result<(), Failure> {
    let counts = &fleet.units;
    if console.json {
        return print::json(&BatchAnswer {
            schema: "twinlag.batch/1",
            out: tables.to_owned(),
            units: unit_name,
            answered: counts.answered,
            undetermined: counts.undetermined,
            unusable: counts.unusable,
            failed: counts.failed,
            unusable_files: fleet.unusable_files,
            contradicting_records: fleet.contradicting.len(),
        });
    }
    let names: Vec<String> = tables.iter().map(|out| out.display().to_string()).collect();
    let unit = if counts.total() == 1 { unit_name.trim_end_matches('s') } else { unit_name };
    let mut lines = vec![format!(
        "{}: {} {}: {} answered, {} undetermined, {} unusable, {} failed",
        names.join(", "),
        counts.total(),
        unit,
        counts.answered,
        counts.undetermined,
        counts.unusable,
        counts.failed
    )];
    lines.extend(members(fleet));
    if fleet.members.len() > SHOWN {
        lines.extend(fleet.verdicts.iter().map(|(verdict, count)| format!("  {count} {verdict}")));
    }
    let reasons = fleet.reasons.iter().take(REASONS);
    lines.extend(reasons.map(|reason| format!("  {} without an answer: {}", reason.count, reason.reason)));
    if fleet.reasons.len() > REASONS {
        lines.push(format!("  and {} other reasons: see column reason", fleet.reasons.len() - REASONS));
    }
    // Names of files are the user's, and may hold anything.
    let plain = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let lines: Vec<String> = lines.iter().map(|line| line.chars().map(plain).collect()).collect();
    print::on_stdout(&(lines.join("\n") + "\n"))
}

/// Members up to which each is shown on the console; chosen, so that they fit on one screen.
const SHOWN: usize = 20;
/// Reasons that are shown on the console, the most frequent; chosen, so that they fit on one screen with the members.
const REASONS: usize = 5;

/// Both time constants of each member with their grades, where there are few.
fn members(fleet: &Fleet) -> Vec<String> {
    if fleet.members.is_empty() || fleet.members.len() > SHOWN {
        return Vec::new();
    }
    let has_verdict = fleet.members.iter().any(|member| !member.verdict.is_empty());
    let cells = |name: &str, taus: [String; 2], verdict: String| {
        let verdict = Some(verdict).filter(|_| has_verdict);
        [name.to_owned()].into_iter().chain(taus).chain(verdict).collect::<Vec<String>>()
    };
    let header = cells("", ["T1", "T2"].map(str::to_owned), "verdict".to_owned());
    let row = |member: &Member| {
        let taus = member.tau.map(|tau| match tau {
            Some(MemberTau { value_s, interval_95_s: [low, high], is_go, .. }) => {
                let grade = if is_go { Grade::Go } else { Grade::Conditional };
                format!("{}  {grade}", print::interval(value_s, low, high, " s"))
            }
            None => "not given".to_owned(),
        });
        let effects = if member.effects.is_empty() { String::new() } else { format!(": {}", member.effects) };
        cells(&member.name, taus, format!("{}{effects}", member.verdict))
    };
    let rows: Vec<Vec<String>> = [header].into_iter().chain(fleet.members.iter().map(row)).collect();
    columns(&rows, |_| true).into_iter().map(|line| format!("  {line}")).collect()
}
