//! A batch as a page: how many answered, why others did not, both time constants of all of them, and which lie apart.

use std::path::{Path, PathBuf};

use twinlag_batch::{Fleet, Member, MemberTau};
use twinlag_report::{Axis, Chart, Document, Figure, KeyNumber, ReportError, Series, Table, Tone, between, rounded};

use crate::Making;
use crate::figures::{self, CHANNELS, chart};
use crate::making::file_name;
use crate::words::listed;

/// How the title of every summary begins.
const TITLE: &str = "Batch";
/// Up to so many members each has its error bar; more of them would be a grey area.
const MAX_ERROR_BARS: usize = 300;
/// Members in the table of those that lie apart.
const APART: usize = 10;
/// Values from which a range of 95 % of them leaves some out.
const MIN_FOR_QUANTILES: usize = 40;
/// Rows of the table of members, and of those of reasons and of contradictions.
const MAX_ROWS: usize = 50;
/// A normal distribution's standard deviation over its median absolute deviation, and over the half width of its 95 % interval.
const STD_OVER_MAD: f64 = 1.4826;
const STD_OVER_HALF_95: f64 = 1.0 / 1.96;

/// Names of files and rigs without the folders that all of them are in, which are the user's own business.
struct Names {
    folder: PathBuf,
}

impl Names {
    fn of(fleet: &Fleet) -> Self {
        let members = fleet.members.iter().map(|member| &member.name);
        let others = fleet.contradicting.iter().map(|(_, file)| file);
        let names = members.chain(others).chain(fleet.reasons.iter().map(|reason| &reason.first));
        let folders = names.map(|name| Path::new(name).parent().unwrap_or(Path::new("")));
        let shared = |one: PathBuf, other: &Path| one.ancestors().find(|a| other.starts_with(a)).map(Path::to_owned);
        let mut folders = folders.peekable();
        let first = folders.peek().map_or(PathBuf::new(), |folder| folder.to_path_buf());
        Self { folder: folders.fold(first, |one, other| shared(one, other).unwrap_or_default()) }
    }

    /// A name below the folder of all; the last part alone where they have none but the root.
    fn short(&self, name: &str) -> String {
        match Path::new(name).strip_prefix(&self.folder) {
            Ok(below)
                if self.folder.parent().is_some() || self.folder.as_os_str().is_empty() && below.is_relative() =>
            {
                below.display().to_string()
            }
            _ => file_name(name).to_owned(),
        }
    }
}

/// The summary of a batch: an HTML page that needs no other file. Equal summaries give equal bytes.
///
/// - `unit`: what was asked, in the plural: records, or rigs
/// - `made_by`: the program, with its version
///
/// # Errors
/// [`ReportError`] if something cannot be drawn.
pub fn fleet_report(
    fleet: &Fleet,
    title: &str,
    unit: &str,
    made_by: [&str; 2],
    making: &Making,
) -> Result<String, ReportError> {
    let counts = &fleet.units;
    let is_go = |member: &Member| member.tau.iter().all(|tau| tau.is_some_and(|tau| tau.is_go));
    let is_whole = counts.answered == counts.total() && fleet.unusable_files == 0;
    let tone = match counts.answered {
        0 => Tone::Bad,
        _ if is_whole && fleet.members.iter().all(is_go) => Tone::Good,
        _ => Tone::Caution,
    };
    let grade = format!("{} of {}", counts.answered, counts.total());
    let document = Document::new(format!("{TITLE} {}", file_name(title)))
        .byline(making.byline(&[format!("{} {unit}", counts.total())]))
        .verdict(tone, grade, sentence(fleet, unit))
        .key_numbers(keys(fleet));
    let names = Names::of(fleet);
    let document = time_constants(document, fleet)?;
    let document = each(document, fleet, &names);
    let document = found(document, fleet, unit);
    let document = apart(document, fleet, &names);
    let document = contradictions(document, fleet, &names);
    let document = reasons(document, fleet, &names);
    let [program, version] = made_by;
    Ok(making.page(&making.reproduction(document, program, version)))
}

/// Whether a file is a page that [`fleet_report`] has written.
///
/// - `head`: its first bytes; 64 KiB of them suffice
pub fn is_fleet_report(head: &[u8]) -> bool {
    let title = format!("<title>{TITLE} ");
    head.starts_with(b"<!DOCTYPE html>") && head.windows(title.len()).any(|part| part == title.as_bytes())
}

fn sentence(fleet: &Fleet, unit: &str) -> String {
    let counts = &fleet.units;
    let mut parts = vec![format!("{} of {} {unit} gave an answer", counts.answered, counts.total())];
    let rest = [
        (counts.undetermined, "without what was asked, though read"),
        (counts.unusable, "that cannot be used"),
        (counts.failed, "with another error"),
    ];
    parts.extend(
        rest.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("there are {count} {what}")),
    );
    if fleet.unusable_files > counts.unusable {
        parts.push(format!("files that cannot be used: {}", fleet.unusable_files));
    }
    format!("{}.", listed(&parts))
}

/// Medians of both time constants, and how far members scatter.
fn keys(fleet: &Fleet) -> Vec<KeyNumber> {
    let key = |i: usize| {
        let given = given(fleet, i);
        let values: Vec<f64> = given.iter().map(|(_, tau)| tau.value_s).collect();
        let value = median(values.clone())?;
        let (range, what) = if let [(_, alone)] = &given[..] {
            (alone.interval_95_s, "95 %:")
        } else {
            let (share, what) =
                if values.len() < MIN_FOR_QUANTILES { (0.0, "all of them") } else { (0.025, "95 % of them") };
            ([quantile(values.clone(), share)?, quantile(values, 1.0 - share)?], what)
        };
        let grade = if given.iter().all(|(_, tau)| tau.is_go) {
            (Tone::Good, "go".to_owned())
        } else {
            (Tone::Caution, "some conditional".to_owned())
        };
        Some(KeyNumber {
            name: if given.len() == 1 {
                format!("T{}, of the only one", i + 1)
            } else {
                format!("T{}, median of {}", i + 1, given.len())
            },
            value: format!("{} s", rounded(value, 4)),
            interval: format!("{what} {} s", between(range)),
            grade,
        })
    };
    (0..2).filter_map(key).collect()
}

fn time_constants(document: Document, fleet: &Fleet) -> Result<Document, ReportError> {
    let panel = |i: usize| -> Option<Chart> {
        let given = given(fleet, i);
        let place: Vec<f64> = given.iter().map(|(place, _)| (place + 1) as f64).collect();
        let value: Vec<f64> = given.iter().map(|(_, tau)| tau.value_s).collect();
        let [low, high] = [0, 1].map(|end| given.iter().map(|(_, tau)| tau.interval_95_s[end]).collect::<Vec<_>>());
        let has_bars = fleet.members.len() <= MAX_ERROR_BARS;
        let ends = if has_bars { [&low[..], &high[..]].concat() } else { Vec::new() };
        let (axis, outside) = figures::robust_axis("time constant (s)", value.iter().copied().chain(ends));
        let series = if has_bars {
            Series::points("", place, value).interval(low, high)
        } else {
            Series::trace("", place, value)
        };
        let series = (!given.is_empty()).then(|| series.colour(CHANNELS[i]));
        chart(format!("T{}{outside}", i + 1), [Axis::linear("number among those that were read"), axis], [series])
    };
    let panels: Vec<Chart> = (0..2).filter_map(panel).collect();
    if panels.is_empty() {
        return Ok(document);
    }
    let figure =
        panels.into_iter().fold(Figure::new("").columns(1).panel_size(figures::WIDTH_PX, 220.0).live(), Figure::panel);
    let bars = if fleet.members.len() <= MAX_ERROR_BARS { " Bars are 95 % intervals." } else { "" };
    document.heading("Both time constants").drawing(
        figure,
        format!("Time constants that are given, in the order of the table.{bars} What is graded no-go is left out."),
    )
}

fn found(document: Document, fleet: &Fleet, unit: &str) -> Document {
    if fleet.verdicts.is_empty() {
        return document;
    }
    let table = |counts: &[(String, usize)], what: &str| {
        let row = |table: Table, (name, count): &(String, usize)| table.row([name.clone(), count.to_string()]);
        counts.iter().take(MAX_ROWS).fold(Table::new([what, unit]), row)
    };
    let document = document.heading("What was found").table(table(&fleet.verdicts, "verdict"));
    if fleet.effects.is_empty() { document } else { document.table(table(&fleet.effects, "effect")) }
}

/// Each member with its numbers, where there are few.
fn each(document: Document, fleet: &Fleet, names: &Names) -> Document {
    if fleet.members.is_empty() || fleet.members.len() > MAX_ROWS {
        return document;
    }
    let number = |tau: Option<MemberTau>| match tau {
        Some(tau) => {
            let condition = if tau.is_go { "" } else { ", conditional" };
            format!("{} s ({}{condition})", rounded(tau.value_s, 4), between(tau.interval_95_s))
        }
        None => "not given".to_owned(),
    };
    let row = |table: Table, (place, member): (usize, &Member)| {
        let [one, two] = member.tau.map(number);
        let found = if member.effects.is_empty() { &member.verdict } else { &member.effects };
        table.row([(place + 1).to_string(), names.short(&member.name), one, two, found.clone()])
    };
    let table = Table::new(["number", "name", "T1", "T2", "found"]);
    document.table(fleet.members.iter().enumerate().fold(table, row).caption("Time constants with 95 % intervals"))
}

/// Members whose time constants lie furthest from the median, in units of how far members scatter and of their own uncertainty.
fn apart(document: Document, fleet: &Fleet, names: &Names) -> Document {
    let mut distances: Vec<(f64, usize, &Member, MemberTau)> = Vec::new();
    for i in 0..2 {
        let given = given(fleet, i);
        let logs: Vec<f64> = given.iter().map(|(_, tau)| tau.value_s.ln()).collect();
        let Some(middle) = median(logs.clone()) else { continue };
        let spread = median(logs.iter().map(|log| (log - middle).abs()).collect()).unwrap_or(0.0) * STD_OVER_MAD;
        distances.extend(given.iter().map(|(place, tau)| {
            let own = 0.5 * (tau.interval_95_s[1] - tau.interval_95_s[0]) / tau.value_s * STD_OVER_HALF_95;
            let distance = (tau.value_s.ln() - middle).abs() / spread.hypot(own).max(f64::MIN_POSITIVE);
            (distance, i, &fleet.members[*place], *tau)
        }));
    }
    if fleet.members.len() <= APART {
        return document;
    }
    distances.sort_by(|a, b| b.0.total_cmp(&a.0));
    let row = |table: Table, (distance, i, member, tau): &(f64, usize, &Member, MemberTau)| {
        table.row([
            names.short(&member.name),
            format!("T{}", i + 1),
            format!("{} s", rounded(tau.value_s, 4)),
            format!("{} s", between(tau.interval_95_s)),
            rounded(*distance, 3),
        ])
    };
    let header = ["name", "sensor", "time constant", "95 % interval", "distance"];
    let table = distances.iter().take(APART).fold(Table::new(header), row);
    document.heading("Which lie apart").table(table.caption(
        "Time constants furthest from the median of their sensor. The distance is that of the logarithms, in units of the scatter of \
         all of them and of the number's own standard error together.",
    ))
}

fn contradictions(document: Document, fleet: &Fleet, names: &Names) -> Document {
    if fleet.contradicting.is_empty() {
        return document;
    }
    let row = |table: Table, (rig, file): &(String, String)| table.row([rig.clone(), names.short(file)]);
    let table = fleet.contradicting.iter().take(MAX_ROWS).fold(Table::new(["rig", "record"]), row);
    document.heading("Records that contradict the others of their rig").table(table)
}

fn reasons(document: Document, fleet: &Fleet, names: &Names) -> Document {
    if fleet.reasons.is_empty() {
        return document;
    }
    let table = Table::new(["first file", "how many", "why, as the first of them says it"]);
    let row = |table: Table, reason: &twinlag_batch::ReasonCount| {
        table.row([names.short(&reason.first), reason.count.to_string(), reason.reason.clone()])
    };
    document.heading("What has no answer").table(fleet.reasons.iter().take(MAX_ROWS).fold(table, row))
}

/// Members that have a time constant, with their places.
fn given(fleet: &Fleet, sensor: usize) -> Vec<(usize, MemberTau)> {
    let members = fleet.members.iter().enumerate();
    members.filter_map(|(place, member)| Some((place, member.tau[sensor]?))).collect()
}

/// The middle value, or the mean of both; `None` without values.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(0.5 * (values[last / 2] + values[last.div_ceil(2)]))
}

/// The value below which that share of all lies; `None` without values.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(values[(share * last as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::{Fleet, Making, Names, fleet_report, is_fleet_report};

    #[test]
    fn a_summary_is_known_by_its_first_bytes() {
        for is_static in [true, false] {
            let making = Making { is_static, ..Making::default() };
            let page = fleet_report(&Fleet::default(), "table.csv", "records", ["twinlag", "0"], &making);
            assert!(is_fleet_report(&page.expect("nothing to draw").as_bytes()[..4096]));
        }
        assert!(!is_fleet_report(b"<!DOCTYPE html><title>Notes</title>"));
    }

    /// Failed: records of one name in two folders were both called by it.
    #[test]
    fn names_are_those_below_the_folder_of_all() {
        let short = |folder: &str, name: &str| Names { folder: folder.into() }.short(name);
        assert_eq!(short("same", "same/mon/run1.csv"), "mon/run1.csv");
        assert_eq!(short("", "mon/run1.csv"), "mon/run1.csv");
        assert_eq!(short("/home/someone/runs", "/home/someone/runs/mon/run1.csv"), "mon/run1.csv");
        assert_eq!(short("/", "/home/someone/run1.csv"), "run1.csv");
        assert_eq!(short("", "/home/someone/run1.csv"), "run1.csv");
    }
}
