//! Tables and the picture of changing flow.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Result, anyhow};
use twinlag_report::{Axis, Chart, Colour, Figure, Series};
use twinlag_study::{Rate, Results, Tally};

use super::{Kind, SIZES, Tracking, fixed};

pub(super) fn write(study: &Tracking, results: &Results, out: &Path) -> Result<()> {
    let of = |kind: Kind| -> Vec<(usize, &Tally)> {
        results.cells().iter().enumerate().filter(|(cell, _)| study.place(*cell).0 == kind).collect()
    };
    fs::write(out.join("tracking.md"), tracking(study, &of(Kind::Swing)))?;
    fs::write(out.join("steps.md"), steps(study, &of(Kind::Step)))?;
    fs::write(out.join("steady.md"), steady(study, &of(Kind::Steady)))?;
    fs::write(out.join("tracking.svg"), picture(study)?)?;
    Ok(())
}

fn mean(tally: &Tally, name: &str) -> f64 {
    tally.values(name).and_then(|v| v.moments().mean()).unwrap_or(f64::NAN)
}

/// Mean over both sensors.
fn both(tally: &Tally, name: &str) -> f64 {
    0.5 * (1..3).map(|sensor| mean(tally, &format!("{name} {sensor}"))).sum::<f64>()
}

fn median(tally: &Tally, name: &str) -> f64 {
    tally.values(name).and_then(|v| v.quantile(0.5)).unwrap_or(f64::NAN)
}

fn percent(tally: &Tally, name: &str) -> String {
    tally.rate(name).and_then(Rate::rate).map_or("-".into(), |r| format!("{:.0}", 100.0 * r))
}

/// A number, or that there is none.
fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "-".into() }
}

fn heading(study: &Tracking, cell: usize) -> String {
    let (_, gas, percent) = study.place(cell);
    format!("{} | {percent}", study.plan.gases[gas].name)
}

fn changes(tally: &Tally) -> String {
    super::CHANGES.map(|name| percent(tally, name)).join(" / ")
}

fn tracking(study: &Tracking, cells: &[(usize, &Tally)]) -> String {
    let mut text = String::from(
        "| gas | noise (%) | smooth / step / constant (%) | coefficients | error of τ1 (%) | of τ2 (%) | error / bound | of τ2 | \
         median over records | systematic / bound | best fixed spline | error / its bound and systematic error | τ1 inside the 95 % band (%) | τ2 inside (%) | \
         ratio said to change (%) |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (cell, tally) in cells {
        let rms = |name: &str| mean(tally, name).sqrt();
        let ratio = |sensor: usize| rms(&format!("mean square error {sensor}")) / rms(&format!("bound {sensor}"));
        let systematic = (both(tally, "systematic") / both(tally, "bound")).sqrt();
        // Sizes that all records tell.
        let told = |size: &usize| tally.column(&fixed(*size)).is_some_and(|c| c.absent() == 0);
        let best = SIZES.into_iter().filter(told).map(|size| (size, 0.5 * mean(tally, &fixed(size))));
        let (size, total) = best.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {size} | {} | {} | {} | {} |",
            heading(study, *cell),
            changes(tally),
            number(mean(tally, "coefficients"), 1),
            number(100.0 * rms("mean square error 1"), 2),
            number(100.0 * rms("mean square error 2"), 2),
            number(ratio(1), 3),
            number(ratio(2), 3),
            number(median(tally, "square error over that of the bound").sqrt(), 3),
            number(systematic, 2),
            number((both(tally, "mean square error") / total).sqrt(), 3),
            number(100.0 * mean(tally, "inside 1"), 1),
            number(100.0 * mean(tally, "inside 2"), 1),
            percent(tally, "ratio changes"),
        );
    }
    text
}

fn steps(study: &Tracking, cells: &[(usize, &Tally)]) -> String {
    let mut text = String::from(
        "| gas | noise (%) | smooth / step / constant (%) | median error of the instant (ms) | in samples | in the faster time constant | \
         median half width of its interval (ms) | what the bound resolves (ms) | inside the interval (%) | error of the factor (%) |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (cell, tally) in cells {
        let error_s = median(tally, "error of the instant");
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            heading(study, *cell),
            changes(tally),
            number(1e3 * error_s, 1),
            number(error_s / study.plan.sample_period_s, 1),
            number(error_s / study.plan.tau_s[0], 2),
            number(1e3 * median(tally, "half width"), 1),
            number(1e3 * median(tally, "resolution"), 1),
            percent(tally, "instant inside"),
            number(100.0 * mean(tally, "error of the factor").sqrt(), 2),
        );
    }
    text
}

fn steady(study: &Tracking, cells: &[(usize, &Tally)]) -> String {
    let mut text = String::from(
        "| gas | noise (%) | smooth / step / constant (%) | error of τ1 / bound | of τ2 | τ1 inside the 95 % band (%) | τ2 inside (%) | \
         ratio said to change (%) | p of the ratio below 5 % (%) |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for (cell, tally) in cells {
        let ratio = |sensor: usize| {
            (mean(tally, &format!("mean square error {sensor}")) / mean(tally, &format!("bound {sensor}"))).sqrt()
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            heading(study, *cell),
            changes(tally),
            number(ratio(1), 3),
            number(ratio(2), 3),
            number(100.0 * mean(tally, "inside 1"), 1),
            number(100.0 * mean(tally, "inside 2"), 1),
            percent(tally, "ratio changes"),
            percent(tally, "p of the ratio below 5 %"),
        );
    }
    text
}

/// The first record of each gas in a swinging flow, and in a step: the faster sensor, the other being that times a number.
fn picture(study: &Tracking) -> Result<String> {
    let plan = &study.plan;
    let title = "The faster time constant along single records, with its 95 % band";
    let mut figure = Figure::new(title).columns(plan.gases.len()).panel_size(370.0, 240.0);
    for (kind, flow) in [(Kind::Swing, "swinging flow"), (Kind::Step, "a step")] {
        for (gas, named) in plan.gases.iter().enumerate() {
            // With the noise that is asked for, or that of the first cell.
            let of_gas = |(cell, place): (usize, (Kind, usize, f64))| {
                (place.0 == kind && place.1 == gas).then_some((cell, place.2))
            };
            let cells: Vec<(usize, f64)> = study.places().into_iter().enumerate().filter_map(of_gas).collect();
            let wanted = cells.iter().find(|(_, percent)| *percent == plan.pictured_percent).or(cells.first());
            let Some((cell, percent)) = wanted else { continue };
            let trial = study.run(*cell, 0).map_err(|e| anyhow!("{e}"))?;
            let time_s = &trial.answer.time_s;
            let in_ms = |values: &[f64]| values.iter().map(|v| 1e3 * v).collect::<Vec<f64>>();
            let along = &trial.answer.sensors[0];
            let found = Series::trace("found", time_s.clone(), in_ms(&along.tau_s)).colour(Colour::Blue);
            let found = found.band(in_ms(&along.low_s), in_ms(&along.high_s));
            let truth: Vec<f64> = time_s.iter().map(|t| plan.tau_s[0] * trial.factor(*t)).collect();
            let truth = Series::trace("truth", time_s.clone(), in_ms(&truth)).colour(Colour::Orange).dashed();
            let title = format!("{}, {flow}, {percent} % noise", named.name);
            let axes = (Axis::linear("time (s)"), Axis::linear("time constant (ms)"));
            let chart = Chart::new(title, axes.0, axes.1).series(found).series(truth);
            let has_legend = kind == Kind::Swing && gas == 0;
            figure = figure.panel(if has_legend { chart } else { chart.without_legend() });
        }
    }
    Ok(figure.to_svg()?)
}
