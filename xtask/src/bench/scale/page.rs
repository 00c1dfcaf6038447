//! What the bench says: a table on standard output, and the book's page with its picture.

use std::fmt::Write as _;
use std::fs;

use anyhow::Result;
use twinlag_report::{Axis, Chart, Figure, Series};

use super::{Measured, Results, Row, Took, Verb};
use crate::root;

/// Bytes of a reading in memory.
const READING_BYTES: f64 = 8.0;
const MEGABYTE: f64 = 1024.0 * 1024.0;
const PICTURE: &str = "images/scale.svg";

const HEAD: &str = "\
# Long records

How the time and the memory of each verb grow with the record. Ratios are those of one run on one machine; the times beside them are
those of that machine. `cargo xtask bench --scale` measures anew and writes this page; a release that is slower shows here.

The records are simulated: turbulence of 8 K that sensors of 30 and 110 ms read every millisecond in noise of 0.1 K, written with three
decimals. Each verb runs in a process of its own. Its time is that after reading, but for `read`. What it is held against is its *bare
work*, which it cannot do without, in a process of its own too:

- `read`: the same file, split into cells by the crate `csv` and these into numbers by the crate `fast-float2`;
- `characterise`, `diagnose`: sine transforms of six series as long as the record (both channels, their residual, and this with its
  derivatives by both time constants) and Fourier transforms of three (both inferred inputs, a channel);
- `compensate`, `track`: one pass of the causal filter, four states. `compensate --model` is given that the sensors are two lags, and
  makes no diagnosis.

The ratio is one of processor times, of all threads together. The memory is the most that the process has had, reading included;
beside it stands how often both channels would fit into it. The exponent is that of the growth of the processor time since the row
above.

";

/// One row of the table.
pub(super) fn line(row: &Row) -> String {
    format!(
        "{:18} {:>10} rows {:>9.2} s, processor {:>9.2} s{}, peak memory {}",
        row.verb.name(),
        row.took.rows,
        row.took.wall_s,
        row.took.processor_s,
        ratio(row).map_or(String::new(), |ratio| format!(", {ratio:.1} times its bare work")),
        row.took.peak_mb.map_or("unknown".into(), |mb| format!("{mb:.0} MB"))
    )
}

pub(super) fn print(results: &Results) {
    println!("\n{}", table(results));
    results.left_out.iter().for_each(|what| println!("left out: {what}"));
}

/// Writes the page and its picture.
pub(super) fn write(results: &Results) -> Result<()> {
    let source = root()?.join("docs/src");
    fs::write(source.join(PICTURE), picture(results)?)?;
    let mut page = HEAD.to_owned();
    let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let _ = writeln!(page, "This machine has {processors} processors.\n");
    page += &table(results);
    let _ = writeln!(page, "\n![Processor time and peak memory over the number of rows]({PICTURE})\n");
    if !results.measured.is_empty() {
        page += "## Measured records\n\nWhat is measured is uneven, rounded and coloured: `diagnose` on the records of \
                 [Measured data](measured-data.md).\n\n";
        page += &measured(&results.measured);
    }
    if !results.left_out.is_empty() {
        page += "\n## Left out\n\n";
        results.left_out.iter().for_each(|what| {
            let _ = writeln!(page, "- {what}");
        });
    }
    fs::write(source.join("scale.md"), page)?;
    println!("written: docs/src/scale.md");
    Ok(())
}

fn table(results: &Results) -> String {
    let mut out = "| verb | rows | time, s | processor, s | bare work, s | ratio | exponent | peak memory, MB | times both channels |\n\
                   |---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let mut before: Option<&Row> = None;
    for row in &results.rows {
        let exponent = before.filter(|before| before.verb == row.verb).map(|before| exponent(&before.took, &row.took));
        let _ = writeln!(
            out,
            "| `{}` | {:.0e} | {} | {} | {} | {} | {} | {} | {} |",
            row.verb.name(),
            row.took.rows as f64,
            seconds(row.took.wall_s),
            seconds(row.took.processor_s),
            seconds(row.bare.processor_s),
            ratio(row).map_or_else(none, |ratio| format!("{ratio:.1}")),
            exponent.map_or_else(none, |exponent| format!("{exponent:.2}")),
            row.took.peak_mb.map_or_else(none, |mb| format!("{mb:.0}")),
            row.took.peak_mb.map_or_else(none, |mb| format!("{:.1}", mb * MEGABYTE / channels_bytes(&row.took)))
        );
        before = Some(row);
    }
    out
}

fn measured(records: &[Measured]) -> String {
    let mut out = "| record | rows | time, s | processor, s | peak memory, MB |\n|---|---|---|---|---|\n".to_owned();
    for Measured { file, took } in records {
        let _ = writeln!(
            out,
            "| `{file}` | {} | {} | {} | {} |",
            took.rows,
            seconds(took.wall_s),
            seconds(took.processor_s),
            took.peak_mb.map_or_else(none, |mb| format!("{mb:.0}"))
        );
    }
    let (all, slowest) =
        records.iter().fold((0.0, 0.0_f64), |(all, most), r| (all + r.took.wall_s, most.max(r.took.wall_s)));
    let _ = writeln!(
        out,
        "\nAll {} together: {}s; the slowest: {} s.",
        records.len(),
        seconds(all) + " ",
        seconds(slowest)
    );
    out
}

fn none() -> String {
    "–".into()
}

fn seconds(s: f64) -> String {
    if s < 0.1 { format!("{s:.3}") } else { format!("{s:.2}") }
}

fn ratio(row: &Row) -> Option<f64> {
    (row.bare.processor_s > 0.0).then(|| row.took.processor_s / row.bare.processor_s)
}

fn exponent(before: &Took, now: &Took) -> f64 {
    (now.processor_s / before.processor_s).ln() / (now.rows as f64 / before.rows as f64).ln()
}

fn channels_bytes(took: &Took) -> f64 {
    2.0 * READING_BYTES * took.rows as f64
}

/// Processor time and peak memory over the rows, with a line of each verb.
fn picture(results: &Results) -> Result<String> {
    let rows = || Axis::logarithmic("rows");
    let mut times = Chart::new("Time", rows(), Axis::logarithmic("processor time (s)"));
    let mut memories = Chart::new("Memory", rows(), Axis::logarithmic("peak memory (MB)"));
    for verb in Verb::ALL {
        let of: Vec<&Row> = results.rows.iter().filter(|row| row.verb == verb).collect();
        let x: Vec<f64> = of.iter().map(|row| row.took.rows as f64).collect();
        let time: Vec<f64> = of.iter().map(|row| row.took.processor_s).collect();
        times = times.series(Series::line(verb.name(), x.clone(), time));
        let memory: Option<Vec<f64>> = of.iter().map(|row| row.took.peak_mb).collect();
        if let Some(memory) = memory {
            memories = memories.series(Series::line(verb.name(), x, memory));
        }
    }
    let longest = results.rows.iter().map(|row| row.took.rows).max().unwrap_or(1) as f64;
    let channels_mb = 2.0 * READING_BYTES * longest / MEGABYTE;
    let shortest = results.rows.iter().map(|row| row.took.rows).min().unwrap_or(1) as f64;
    let both = [channels_mb * shortest / longest, channels_mb];
    memories = memories.series(Series::line("both channels", vec![shortest, longest], both.to_vec()).dashed());
    Ok(Figure::new("Long records").columns(2).panel(times).panel(memories).to_svg()?)
}
