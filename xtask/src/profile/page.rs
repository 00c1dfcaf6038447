//! The book's page of profiles, with its flame graphs.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;

use anyhow::Result;

use super::fold::Part;
use super::{OfVerb, Profiled, doc, flame, fold};
use crate::root;

const IMAGES: &str = "images/profiles";
/// Rows of the simulated record that has a picture.
const PICTURED: &str = "1e5";
/// Share in itself from which a module has a row, and with all that it calls.
const LEAST_OWN: f64 = 0.04;
/// Share with all that it calls from which a function has a row, unless it has nearly all of each record, or has as much as
/// another.
const LEAST_WITH_CALLS: f64 = 0.08;
const MOST_ROWS: usize = 12;
const NEARLY_ALL: f64 = 0.9;
const SAME_SHARE: f64 = 0.04;
/// The crates whose functions say what the numerics below them are done for.
const ABOVE: [&str; 5] = ["twinlag", "twinlag-record", "twinlag-estimate", "twinlag-diagnose", "twinlag-compensate"];
/// Share from which a library is named.
const LEAST_LIBRARY: f64 = 0.03;

const HEAD: &str = "\
# Profiles

Where the processor time of each verb goes. `cargo xtask profile --measured DIR` samples anew and writes this page.

Each verb runs in a process of its own, again and again for at least SECONDS s of processor time: it reads the file, does its
work and writes what came out. The process samples its stack 199 times a second of that time. It runs on one thread, so that
every stack reaches from the verb down; on more threads the work is the same, and it ends sooner. For each verb there are two
tables:

- *spent in*: the modules of this repository that the samples lie in, with the libraries that they call; those that have 4 %
  of some record;
- *spent for*: functions above the numerics, with all that they call; the twelve with most, of those that have 8 % of some
  record. Shares of a function and of one that it calls overlap.

Columns `1e4` to `1e6` are simulated records of so many rows, those of [Long records](scale.md); the others, one of each
campaign of [Measured data](measured-data.md). In a flame graph a frame is as wide as its share; what has less than one
percent is left out, and a library is one frame. Opened by itself, a graph can be searched and zoomed.
";

pub(super) fn write(verbs: &[OfVerb], seconds: f64, left_out: &[String]) -> Result<()> {
    let source = root()?.join("docs/src");
    let images = source.join(IMAGES);
    if images.exists() {
        fs::remove_dir_all(&images)?;
    }
    fs::create_dir_all(&images)?;
    let mut page = HEAD.replace("SECONDS", &seconds.to_string());
    for OfVerb { verb, profiles } in verbs {
        let name = verb.name();
        let _ = write!(page, "\n## `{name}`\n\n{}", tables(profiles)?);
        for profile in pictured(profiles) {
            let file = format!("{IMAGES}/{name}-{}.svg", profile.subject);
            let title = format!("{name}, {}", record(profile));
            fs::write(source.join(&file), flame::picture(&title, &profile.sampled)?)?;
            let _ = write!(page, "\n[![Flame graph of {title}]({file})]({file})\n");
        }
    }
    if !left_out.is_empty() {
        page += "\n## Left out\n\n";
        left_out.iter().for_each(|what| {
            let _ = writeln!(page, "- {what}");
        });
    }
    fs::write(source.join("profiles.md"), page)?;
    println!("written: docs/src/profiles.md");
    Ok(())
}

/// One simulated record, and the measured one that takes longest.
fn pictured(profiles: &[Profiled]) -> impl Iterator<Item = &Profiled> {
    let simulated = profiles.iter().find(|profile| profile.subject == PICTURED);
    let measured = profiles.iter().filter(|profile| profile.is_measured);
    simulated.into_iter().chain(measured.max_by(|a, b| a.sampled.run_s().total_cmp(&b.sampled.run_s())))
}

fn record(profile: &Profiled) -> String {
    if profile.is_measured {
        format!("measured: {}", profile.subject)
    } else {
        format!("{} simulated rows", profile.subject)
    }
}

/// Where the time is spent, and what for.
fn tables(profiles: &[Profiled]) -> Result<String> {
    let of_each = |of: fn(&BTreeMap<String, usize>) -> Vec<Part>| -> Vec<BTreeMap<String, Part>> {
        let named = |part: Part| (part.name.clone(), part);
        profiles.iter().map(|profile| of(&profile.sampled.stacks).into_iter().map(named).collect()).collect()
    };
    let mut out = spent(profiles, &of_each(fold::modules))?;
    if let Some(what_for) = what_for(profiles, &of_each(fold::functions))? {
        out = out + "\n" + &what_for;
    }
    Ok(out)
}

/// A row of a table.
fn row(cells: impl IntoIterator<Item = String>) -> String {
    format!("| {} |\n", cells.into_iter().collect::<Vec<_>>().join(" | "))
}

fn head(first: &str, profiles: &[Profiled]) -> String {
    let names = profiles.iter().map(|profile| format!("`{}`", profile.subject));
    row([first.to_owned(), "what it is".into()].into_iter().chain(names)) + &row(vec!["---".into(); profiles.len() + 2])
}

fn cells(first: String, second: String, others: impl Iterator<Item = String>) -> String {
    row([first, second].into_iter().chain(others))
}

fn share(found: Option<&f64>) -> String {
    found.map_or_else(|| "–".to_owned(), |share| percent(*share))
}

/// The modules in which the time is spent.
fn spent(profiles: &[Profiled], of_each: &[BTreeMap<String, Part>]) -> Result<String> {
    let most =
        |module: &str| of_each.iter().filter_map(|parts| parts.get(module)).map(|part| part.own).fold(0.0, f64::max);
    let all: BTreeSet<&String> = of_each.iter().flat_map(BTreeMap::keys).collect();
    let mut modules: Vec<&String> = all.into_iter().filter(|module| most(module) >= LEAST_OWN).collect();
    modules.sort_by(|a, b| most(b).total_cmp(&most(a)));
    let mut out = head("spent in", profiles);
    out += &cells(
        "processor time of one run, s".into(),
        String::new(),
        profiles.iter().map(|profile| seconds(profile.sampled.run_s())),
    );
    for module in modules {
        let shares = of_each.iter().map(|parts| share(parts.get(module).map(|part| &part.own)));
        out += &cells(format!("`{module}`"), doc::of_module(module)?, shares);
    }
    let libraries: Vec<BTreeMap<String, f64>> = profiles.iter().map(|p| fold::libraries(&p.sampled.stacks)).collect();
    let is_named = |library: &(&String, &f64)| *library.1 >= LEAST_LIBRARY;
    let named: BTreeSet<&String> = libraries.iter().flatten().filter(is_named).map(|(name, _)| name).collect();
    for name in named {
        let shares = libraries.iter().map(|libraries| share(libraries.get(name)));
        out += &cells(format!("of it in `{name}`"), "a library".into(), shares);
    }
    Ok(out)
}

/// What the time is spent for: the functions above the numerics, without those that call little but one of them.
fn what_for(profiles: &[Profiled], of_each: &[BTreeMap<String, Part>]) -> Result<Option<String>> {
    let shares = |name: &str| -> Vec<f64> {
        of_each.iter().map(|parts| parts.get(name).map_or(0.0, |part| part.with_calls)).collect()
    };
    let is_above = |name: &&String| ABOVE.iter().any(|krate| name.starts_with(&format!("{krate}::")));
    let all: BTreeSet<&String> = of_each.iter().flat_map(BTreeMap::keys).filter(is_above).collect();
    let mut rows: Vec<(&String, Vec<f64>)> = all.into_iter().map(|name| (name, shares(name))).collect();
    let sum = |shares: &[f64]| shares.iter().sum::<f64>();
    rows.retain(|(_, shares)| {
        shares.iter().any(|share| *share >= LEAST_WITH_CALLS) && shares.iter().any(|share| *share < NEARLY_ALL)
    });
    rows.sort_by(|a, b| sum(&b.1).total_cmp(&sum(&a.1)));
    let mut kept: Vec<(&String, Vec<f64>)> = Vec::new();
    for (name, shares) in rows {
        let is_same =
            |other: &(&String, Vec<f64>)| other.1.iter().zip(&shares).all(|(a, b)| (a - b).abs() < SAME_SHARE);
        if kept.len() < MOST_ROWS && !kept.iter().any(is_same) {
            kept.push((name, shares));
        }
    }
    let mut out = head("spent for", profiles);
    for (name, shares) in &kept {
        out += &cells(
            format!("`{}`", name.replace(fold::IN, "::")),
            doc::of_function(name)?,
            shares.iter().map(|s| share(Some(s))),
        );
    }
    Ok((!kept.is_empty()).then_some(out))
}

fn percent(share: f64) -> String {
    if share < 0.005 { "–".into() } else { format!("{:.0} %", 100.0 * share) }
}

fn seconds(value: f64) -> String {
    if value < 0.1 { format!("{value:.4}") } else { format!("{value:.2}") }
}
