//! Tables and pictures of an experiment of the closed loop.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::Result;
use twinlag::diagnosis::Identifier;
use twinlag::signal::undeclared::Kind;
use twinlag_report::{Axis, Chart, Figure, Reference, Series};
use twinlag_study::{Merge, Rate, Results, Tally};

use super::{Plan, VERDICTS};

pub(super) fn write(plan: &Plan, results: &Results, out: &Path) -> Result<()> {
    fs::write(out.join("found.md"), found(plan, results))?;
    fs::write(out.join("confusion.md"), confusion(plan, results))?;
    if plan.size_factors.len() > 1 {
        fs::write(out.join("power.md"), power(plan, results))?;
        fs::write(out.join("power.svg"), power_picture(plan, results)?)?;
    } else if plan.sets.len() > 1 {
        fs::write(out.join("found.svg"), found_picture(plan, results)?)?;
    }
    Ok(())
}

pub(in crate::experiment) fn set_name(kinds: &[Kind]) -> String {
    let names: Vec<&str> = kinds.iter().map(|k| k.name()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(" + ") }
}

pub(super) fn cell_name(kinds: &[Kind], size: f64, sizes: usize) -> String {
    if sizes > 1 { format!("{}, × {size}", set_name(kinds)) } else { set_name(kinds) }
}

/// A rate as counts: a cell may have so few records that one of them would be many per cent.
pub(in crate::experiment) fn hits_of_count(tally: &Tally, name: &str) -> String {
    let rate = tally.rate(name).filter(|rate| rate.count() > 0);
    rate.map_or("–".into(), |rate| format!("{} of {}", rate.hits(), rate.count()))
}

fn percent(tally: &Tally, name: &str) -> String {
    tally.rate(name).and_then(Rate::rate).map_or("-".into(), |r| format!("{:.0}", 100.0 * r))
}

fn median(tally: &Tally, name: &str, scale: f64) -> String {
    tally.values(name).and_then(|v| v.quantile(0.5)).map_or("-".into(), |q| format!("{:.2}", scale * q))
}

fn found(plan: &Plan, results: &Results) -> String {
    let mut text = String::from(
        "| effects | right first (%) | right or stated (%) | all found (%) | adequate / explained / partly / unexplained (%) | \
         wrong name (%) | covered (%) | median error (%) | median error / standard error | median error / that of the right effect | \
         held-out rms |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut row = |name: &str, tally: &Tally| {
        let both = |name: &str, of: &dyn Fn(&Tally, &str) -> String| {
            format!("{} / {}", of(tally, &format!("{name} 1")), of(tally, &format!("{name} 2")))
        };
        let verdicts: Vec<String> = VERDICTS.iter().map(|(_, name)| percent(tally, name)).collect();
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            percent(tally, "right first"),
            percent(tally, "right or stated"),
            percent(tally, "all found"),
            verdicts.join(" / "),
            percent(tally, "wrong name"),
            both("covered", &percent),
            both("relative error", &|t, n| median(t, n, 100.0)),
            both("error over its standard error", &|t, n| median(t, n, 1.0)),
            both("error over that of the right effect", &|t, n| median(t, n, 1.0)),
            median(tally, "held-out rms after", 1.0),
        );
    };
    for ((kinds, size), tally) in plan.cells().into_iter().zip(results.cells()) {
        row(&cell_name(kinds, size, plan.size_factors.len()), tally);
    }
    let mut cells = results.cells().iter();
    if let (true, Some(first)) = (results.cells().len() > 1, cells.next()) {
        let mut all = first.clone();
        cells.for_each(|tally| all.merge(tally.clone()));
        row("**all**", &all);
    }
    text
}

/// Which effect is named first, in per cent; those that never are are left out.
fn confusion(plan: &Plan, results: &Results) -> String {
    let names: Vec<String> = Identifier::ALL.iter().map(|e| e.name().to_owned()).chain(["none".into()]).collect();
    let used: Vec<&String> = names
        .iter()
        .filter(|n| {
            let rate = |t: &Tally| t.rate(&format!("first: {n}")).is_some_and(|r| r.hits() > 0);
            results.cells().iter().any(rate)
        })
        .collect();
    let mut text = format!(
        "| effects | {} |\n|---|{}\n",
        used.iter().map(|n| n.as_str()).collect::<Vec<_>>().join(" | "),
        "---|".repeat(used.len())
    );
    for ((kinds, size), tally) in plan.cells().into_iter().zip(results.cells()) {
        let row: Vec<String> = used
            .iter()
            .map(|n| match tally.rate(&format!("first: {n}")).and_then(Rate::rate) {
                Some(rate) if rate > 0.0 => format!("{:.0}", 100.0 * rate),
                _ => String::new(),
            })
            .collect();
        let _ = writeln!(text, "| {} | {} |", cell_name(kinds, size, plan.size_factors.len()), row.join(" | "));
    }
    text
}

/// How often the right effect is named first or stated as a tie, in each set.
fn found_picture(plan: &Plan, results: &Results) -> Result<String> {
    let names: Vec<String> = plan.sets.iter().map(|set| set_name(set)).collect();
    let share = |name: &str| -> Vec<f64> {
        results.cells().iter().map(|t| t.rate(name).and_then(Rate::rate).map_or(f64::NAN, |r| 100.0 * r)).collect()
    };
    // What a set is asked for: that its one effect is named, that all of them are, or, of effects that no library has, that none is.
    let (title, name) = if plan.sets.iter().all(|s| s.iter().all(|k| k.effect().is_none())) {
        ("called explained", "explained")
    } else if plan.without_own {
        ("a wrong name with full confidence", "wrong name")
    } else if plan.sets.iter().any(|s| s.len() > 1) {
        ("all of the effects found", "all found")
    } else {
        ("the right effect first, or stated as a tie", "right or stated")
    };
    let axis = Axis::linear("records (%)").range(0.0, 100.0);
    let chart =
        Chart::new(title, Axis::categories("", names), axis).series(Series::bars(title, share(name))).without_legend();
    Ok(Figure::new(plan.title.clone()).panel_size(1100.0, 420.0).panel(chart).to_svg()?)
}

/// Shares of records in which the effect is found, by size, for each set.
fn shares<'a>(plan: &'a Plan, results: &'a Results) -> impl Iterator<Item = (&'a [Kind], Vec<[f64; 2]>)> {
    let sizes = plan.size_factors.len();
    plan.sets.iter().zip(results.cells().chunks(sizes)).map(move |(set, cells)| {
        let rates = cells.iter().map(|t| t.rate("right or stated").and_then(Rate::rate).unwrap_or(f64::NAN));
        (set.as_slice(), plan.size_factors.iter().copied().zip(rates).map(|(size, rate)| [size, rate]).collect())
    })
}

/// The size at which the share first reaches `wanted` for good, on straight lines over the logarithm of the size.
fn reaches(curve: &[[f64; 2]], wanted: f64) -> Option<f64> {
    let above = curve.iter().rposition(|[_, share]| *share < wanted).map_or(0, |below| below + 1);
    let &[high, share] = curve.get(above)?;
    match above.checked_sub(1) {
        None => Some(high),
        Some(below) => {
            let [low, before] = curve[below];
            Some(low * (high / low).powf((wanted - before) / (share - before)))
        }
    }
}

fn power(plan: &Plan, results: &Results) -> String {
    let header: Vec<String> = plan.size_factors.iter().map(|s| format!("× {s}")).collect();
    let mut text = format!(
        "| effect | {} | found half the time | found 95 % of the time |\n|---|{}---|---|\n",
        header.join(" | "),
        "---|".repeat(header.len())
    );
    for (set, curve) in shares(plan, results) {
        let row: Vec<String> = curve.iter().map(|[_, share]| format!("{:.0}", 100.0 * share)).collect();
        let smallest = plan.size_factors[0];
        let size = |wanted| match reaches(&curve, wanted) {
            Some(size) if size <= smallest => format!("below × {smallest}"),
            Some(size) => format!("× {size:.2}"),
            None => "beyond".into(),
        };
        let _ = writeln!(text, "| {} | {} | {} | {} |", set_name(set), row.join(" | "), size(0.5), size(0.95));
    }
    text
}

fn power_picture(plan: &Plan, results: &Results) -> Result<String> {
    let mut figure = Figure::new(plan.title.clone()).columns(4).panel_size(270.0, 200.0);
    for (set, curve) in shares(plan, results) {
        let (x, y): (Vec<f64>, Vec<f64>) = curve.iter().map(|[size, share]| (*size, 100.0 * share)).unzip();
        let axes = (Axis::logarithmic("size, × the usual"), Axis::linear("found (%)").range(0.0, 105.0));
        let chart = Chart::new(set_name(set), axes.0, axes.1)
            .series(Series::line("found", x, y))
            .reference(Reference::horizontal(95.0))
            .reference(Reference::horizontal(50.0))
            .without_legend();
        figure = figure.panel(chart);
    }
    Ok(figure.to_svg()?)
}
