//! Several records of one instrument together: the error on records that had no part in finding the model, and what is left over by
//! frequency, position and rate.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use twinlag::model::ModelFit;
use twinlag::record::{ColumnRef, Record, Selection, Table};
use twinlag::{DiagnoseOptions, Diagnosis, EffectInPlace, Options, diagnose_records, joined};
use twinlag_report::{Axis, Chart, Colour, Figure, Reference, Series};

use super::files;
use super::page::{Page, named};

/// Several records of one instrument.
struct Campaign {
    folder: &'static str,
    channels: [&'static str; 2],
    /// A time constant from a data sheet, as `--known` takes it.
    known: Option<&'static str>,
    /// Column of the position.
    position: &'static str,
    /// Its name on an axis.
    axis: &'static str,
}

const CAMPAIGNS: [Campaign; 3] = [
    Campaign {
        folder: "seaglider_sg542",
        channels: ["T1_ct_raw_C", "T2_aa4330_C"],
        known: Some("T1=0.55s"),
        position: "depth_m",
        axis: "depth (m)",
    },
    Campaign {
        folder: "seaexplorer_sea046",
        channels: ["T1_gpctd_C", "T2_arod_C"],
        known: Some("T1=0.5s+-0.1s"),
        position: "pressure_dbar",
        axis: "pressure (dbar)",
    },
    Campaign {
        folder: "ctd911",
        channels: ["T1_t090_C", "T2_t190_C"],
        known: None,
        position: "pressure_dbar",
        axis: "pressure (dbar)",
    },
];

/// Parts of a record in a picture, of as many residuals each.
const PARTS: usize = 24;

impl Campaign {
    fn selection(&self) -> Selection {
        let name = |name: &str| Some(ColumnRef::Name(name.into()));
        let [t1, t2] = self.channels.map(name);
        Selection { t1, t2, position: name(self.position), ..Selection::default() }
    }

    fn command(&self) -> String {
        let known = self.known.map_or(String::new(), |known| format!(" --known {known}"));
        format!("twinlag diagnose *.csv --position {}{known}", self.position)
    }
}

/// Diagnoses every instrument of the folder, prints what came of it and puts it on the page.
pub(super) fn run(dir: &Path, page: &mut Page) -> Result<()> {
    let mut text = String::new();
    for campaign in &CAMPAIGNS {
        let paths = files(&dir.join(campaign.folder))?;
        let read = |path: &PathBuf| Ok(Record::read(path, &campaign.selection())?);
        let records: Vec<Record> = paths.iter().map(read).collect::<Result<_>>()?;
        let mut characterise = Options::default();
        if let Some(known) = campaign.known {
            characterise.known.push(known.parse()?);
        }
        let options = DiagnoseOptions { characterise, ..DiagnoseOptions::default() };
        let answer = diagnose_records(&records, &options)?;
        let from = text.len();
        section(campaign, &answer, &mut text)?;
        let name = format!("campaign-{}.svg", campaign.folder.replace('_', "-"));
        let what = "What is left over by frequency, position and rate of change of the gas";
        let _ = writeln!(text, "\n![{what}](images/measured/{name})\n");
        print!("{}", &text[from..]);
        page.pictures.push((name, picture(campaign, &answer, &records, &paths)?));
    }
    page.campaigns = text;
    Ok(())
}

fn section(campaign: &Campaign, answer: &Diagnosis, text: &mut String) -> Result<()> {
    let verdict = serde_json::to_value(answer.verdict)?;
    let effects: Vec<String> = answer.effects.iter().map(|effect| named(effect, true)).collect();
    let _ = write!(
        text,
        "### `{}`: {} records\n\n`{}`: **{}**.\n\n",
        campaign.folder,
        answer.records.len(),
        campaign.command(),
        verdict.as_str().unwrap_or("?")
    );
    effects.iter().for_each(|effect| {
        let _ = writeln!(text, "- {effect}");
    });
    for sensor in &answer.last.sensors {
        let given = match (sensor.time_constant_s, sensor.interval_95_s) {
            (Some(tau_s), Some([low, high])) => format!("{tau_s:.4} s [{low:.4}, {high:.4}]"),
            (Some(tau_s), None) => format!("{tau_s:.4} s"),
            _ => format!("not given ({})", sensor.judgement.because),
        };
        let _ = writeln!(text, "- {}: {given}", sensor.channel);
    }
    if let Some(left) = &answer.unexplained {
        let _ = writeln!(text, "- left over: {}", left.description);
    }
    text.push_str(
        "\n| left out | two lags | with effects | effects that the others show | agrees |\n|---|---|---|---|---|\n",
    );
    for record in &answer.records {
        let in_place = |e: &EffectInPlace| {
            e.channel.as_ref().map_or(e.effect.to_string(), |channel| format!("{} in {channel}", e.effect))
        };
        let found: Vec<String> = record.found_on_others.iter().map(in_place).collect();
        let rms = record.error.held_out_normalised_rms;
        let agrees = record.agrees.map_or("not known", |agrees| if agrees { "yes" } else { "no" });
        let name = Path::new(&record.source).file_name().map(|name| name.to_string_lossy().into_owned());
        let name = name.unwrap_or_default();
        let _ = writeln!(
            text,
            "| `{name}` | {:.2} | {:.2} | {} | {agrees} |",
            rms.before,
            rms.after,
            if found.is_empty() { "none".into() } else { found.join(", ") }
        );
    }
    if let Some(transfer) = &answer.transfer {
        let rms = transfer.error.held_out_normalised_rms;
        let _ = writeln!(text, "| **all** | {:.2} | {:.2} | | |", rms.before, rms.after);
    }
    Ok(())
}

/// Root mean square of the residual in parts of equal count, from the least to the largest of what it goes with.
fn in_parts(mut of: Vec<[f64; 2]>) -> [Vec<f64>; 2] {
    of.retain(|pair| pair.iter().all(|value| value.is_finite()));
    of.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let part = |part: &[[f64; 2]]| {
        let middle = part[part.len() / 2][0];
        let mean_square = part.iter().map(|[_, r]| r * r).sum::<f64>() / part.len() as f64;
        [middle, mean_square.sqrt()]
    };
    let parts: Vec<[f64; 2]> = of.chunks(of.len().div_ceil(PARTS).max(1)).map(part).collect();
    [0, 1].map(|i| parts.iter().map(|pair| pair[i]).collect())
}

fn picture(campaign: &Campaign, answer: &Diagnosis, records: &[Record], paths: &[PathBuf]) -> Result<String> {
    let core = answer.core.as_deref().context("an answer without its series")?;
    let time_s = joined(records)?.time_s;
    let mut position = Vec::new();
    for path in paths {
        let table = Table::from_path(path)?;
        position.extend_from_slice(table.numbers(table.find(&ColumnRef::Name(campaign.position.into()))?)?);
    }
    let after = |values: &[f64], t: f64| values.partition_point(|other| *other <= t).saturating_sub(1);
    let position_at = |_: &ModelFit, t: f64| position.get(after(&time_s, t)).copied().unwrap_or(f64::NAN);
    let rate_at = |fit: &ModelFit, t: f64| {
        let gas = &fit.trace.gas_c;
        let k = after(&gas.time_s, t);
        let (before, next) = (k.saturating_sub(1), (k + 1).min(gas.time_s.len() - 1));
        ((gas.value[next] - gas.value[before]) / (gas.time_s[next] - gas.time_s[before])).abs()
    };
    let panel = |label: Axis, of: &dyn Fn(&ModelFit, f64) -> f64| {
        let mut chart = Chart::new("", label, Axis::logarithmic("rms of the residual over the noise"));
        for (name, fit, colour) in
            [("two lags", &core.base, Colour::Vermilion), ("with effects", &core.last, Colour::Blue)]
        {
            let residual = &fit.trace.residual;
            // The gas is that of the model with the effects in both.
            let pairs = residual.time_s.iter().zip(&residual.value).map(|(t, r)| [of(&core.last, *t), *r]).collect();
            let [x, y] = in_parts(pairs);
            chart = chart.series(Series::line(name, x, y).colour(colour));
        }
        chart.reference(Reference::horizontal(1.0))
    };
    let mut bands =
        Chart::new("", Axis::logarithmic("frequency (Hz)"), Axis::logarithmic("power over that of the noise"));
    for (name, fit, colour) in [("two lags", &core.base, Colour::Vermilion), ("with effects", &core.last, Colour::Blue)]
    {
        let [x, y] = [0, 1].map(|i| fit.trace.bands.iter().map(|band| band[i]).collect::<Vec<f64>>());
        bands = bands.series(Series::line(name, x, y).colour(colour));
    }
    let figure = Figure::new(campaign.folder).columns(3).panel_size(460.0, 340.0);
    let figure = figure.panel(bands.reference(Reference::horizontal(1.0)));
    let figure = figure.panel(panel(Axis::linear(campaign.axis), &position_at));
    Ok(figure.panel(panel(Axis::logarithmic("rate of change of the gas (K/s)"), &rate_at)).to_svg()?)
}

/// The part of the book on them.
pub(super) fn write(book: &Path, page: &Page) -> Result<()> {
    Ok(fs::write(book.join("measured-campaigns.md"), &page.campaigns)?)
}
