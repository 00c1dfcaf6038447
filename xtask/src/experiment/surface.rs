//! The experiment that is a picture rather than a table: how noise distorts each cost over both time constants, and what
//! compensation restores.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use twinlag::bias::{Compensated, Noise, Normalised};
use twinlag::cross_relation::{CrossRelation, Readings, Whitened};
use twinlag::sensor::Discretisation;
use twinlag_experiment::{Cell, NoiseOf};
use twinlag_report::{Axis, Figure, Mark, Surface};

use super::keep_last;

pub(super) const NAME: &str = "cost-surface";

/// The plan of the surfaces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    pub(super) name: String,
    pub(super) title: String,
    /// Points along each axis.
    points: usize,
    /// Ends of the axes, s.
    tau1_s: [f64; 2],
    tau2_s: [f64; 2],
    /// Samples that the published family discards.
    discard: usize,
    noise_percent: Vec<f64>,
    /// Gas, record and truth, as in the other plans.
    base: twinlag_experiment::Plan,
}

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of the cost surfaces")
    }

    /// A few points of the largest noise.
    pub(super) fn shorten(&mut self) {
        self.points = 5;
        keep_last(&mut self.noise_percent, 1);
    }
}

/// The lowest point of one surface.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Lowest {
    noise_percent: f64,
    cost: String,
    tau1_s: f64,
    tau2_s: f64,
    on_edge: bool,
}

/// A cost: its name, what its heights are, and the height at two time constants.
type Height<'v> = (&'static str, &'static str, Box<dyn Fn(&[f64; 2]) -> f64 + 'v>);

pub(super) fn run(plan: &Plan, out: &Path, check: bool) -> Result<()> {
    let axis = |[low, high]: [f64; 2]| -> Vec<f64> {
        (0..plan.points).map(|i| low * (high / low).powf(i as f64 / (plan.points - 1) as f64)).collect()
    };
    let (first, second) = (axis(plan.tau1_s), axis(plan.tau2_s));
    let mut lowest = Vec::new();
    let mut figure = Figure::new(&plan.title).columns(plan.noise_percent.len());
    let mut rows: [Vec<Surface>; 4] = Default::default();
    for (index, &noise_percent) in plan.noise_percent.iter().enumerate() {
        let template = plan.base.cells().first().cloned().context("a cell")?;
        let cell = Cell { noise_percent, noise_of: NoiseOf::Gas, ..template };
        let bench = plan.base.bench(&cell, index)?;
        let record = bench.rig.simulate()?;
        let readings = Readings::even(&record.t1_c, &record.t2_c, cell.sample_period_s)?;
        let noise =
            || -> Result<[Noise; 2]> { Ok([Noise::white(bench.noise_std_k[0])?, Noise::white(bench.noise_std_k[1])?]) };
        let published = || CrossRelation::new(&readings, plan.discard);
        let (plain, compensated) = (published()?, Compensated::new(published()?, noise()?));
        let normalised = Normalised::new(published()?, noise()?);
        let whitened = Whitened::new(&readings, Discretisation::ZeroOrderHold, bench.noise_std_k)?;
        let terms = whitened.terms(&cell.tau_s) as f64;
        let costs: [Height<'_>; 4] = [
            ("cross-relation", "mean square (K²)", Box::new(|t| plain.evaluate(t).value)),
            ("bias-compensated", "above the lowest (K²)", Box::new(|t| compensated.evaluate(t).value)),
            ("normalised", "ratio", Box::new(|t| normalised.evaluate(t).value)),
            ("whitened", "per degree of freedom", Box::new(|t| whitened.evaluate(t).value / terms)),
        ];
        for (row, (name, unit, cost)) in rows.iter_mut().zip(&costs) {
            let mut z: Vec<f64> = Vec::with_capacity(plan.points * plan.points);
            for &t2 in &second {
                z.extend(first.iter().map(|&t1| cost(&[t1, t2])));
            }
            let at = (0..z.len()).min_by(|&a, &b| z[a].total_cmp(&z[b])).context("a surface has points")?;
            let (i, j) = (at % plan.points, at / plan.points);
            let is_edge = |k: usize| k == 0 || k == plan.points - 1;
            lowest.push(Lowest {
                noise_percent,
                cost: (*name).into(),
                tau1_s: first[i],
                tau2_s: second[j],
                on_edge: is_edge(i) || is_edge(j),
            });
            if *name == "bias-compensated" {
                // A difference may be negative: heights above its lowest point can be drawn on a logarithmic scale.
                let floor = z[at];
                let least = 1e-3 * z.iter().fold(0.0_f64, |m, v| m.max(v - floor));
                z.iter_mut().for_each(|v| *v = (*v - floor).max(least));
            }
            let axes = [Axis::logarithmic("τ₁ (s)"), Axis::logarithmic("τ₂ (s)"), Axis::logarithmic(*unit)];
            let title = format!("{name}, noise {noise_percent} %");
            row.push(
                Surface::new(title, axes, first.clone(), second.clone(), z)
                    .mark(Mark::cross("truth", cell.tau_s[0], cell.tau_s[1]))
                    .mark(Mark::dot("lowest", first[i], second[j])),
            );
        }
    }
    for surface in rows.into_iter().flatten() {
        figure = figure.panel(surface);
    }
    let lines = lowest.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
    let text = format!("[\n{}\n]\n", lines.join(",\n"));
    if check {
        let stored = fs::read_to_string(out.join("results.json")).context("there is no stored table")?;
        if let Some((line, (got, want))) = text.lines().zip(stored.lines()).enumerate().find(|(_, (a, b))| a != b) {
            bail!("{NAME}: line {} is {got}, the stored table has {want}", line + 1);
        }
        println!("{NAME}: the stored table holds, to the byte");
        return Ok(());
    }
    fs::create_dir_all(out)?;
    fs::write(out.join("results.json"), text)?;
    fs::write(out.join("surfaces.svg"), figure.panel_size(400.0, 300.0).to_svg()?)?;
    println!("{NAME}: {}", out.display());
    Ok(())
}
