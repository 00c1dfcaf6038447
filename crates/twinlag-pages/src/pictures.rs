//! Pictures of the gas temperature, and of time constants along a record.

use twinlag::compensation::power_spectrum;
use twinlag::cross_relation::Z_975;
use twinlag::record::Record;
use twinlag_report::{Axis, Chart, Colour, Figure, Reference, ReportError, Series};

use crate::figures::{CHANNELS, GAS, REFERENCE, WIDTH_PX, robust_axis, trace};
use twinlag::{Compensation, Track};

/// Length of the part that is shown large, in time constants of the slower sensor.
const EXCERPT_TIME_CONSTANTS: f64 = 20.0;
/// Part of the record that is shown large where there is none.
const EXCERPT: usize = 20;
/// A step longer than this multiple of the period is a gap.
const GAP_STEPS: f64 = 2.5;

/// Readings and gas temperature with its band, over the record and where it moves most, and the
/// spectra before and after with the frequency up to which the readings decide: one SVG.
///
/// # Errors
/// [`ReportError`], if there is nothing to draw.
pub fn gas_picture(record: &Record, answer: &Compensation) -> Result<String, ReportError> {
    let title = format!("gas temperature: {}", answer.judgement.grade);
    temperature_figure(record, answer, &title).panel(spectra(record, answer)).to_svg()
}

/// Both readings over the record: one SVG.
///
/// # Errors
/// [`ReportError`], if there is nothing to draw.
pub fn readings_picture(record: &Record) -> Result<String, ReportError> {
    let mut chart = Chart::new("Readings", Axis::linear("time (s)"), Axis::linear("temperature (°C)"));
    for (i, values) in [&record.t1_c, &record.t2_c].into_iter().enumerate() {
        let series = trace(&record.channels[i], &record.time_s, values, [Colour::Blue, Colour::Orange][i]);
        chart = series.into_iter().fold(chart, Chart::series);
    }
    Figure::new("readings").columns(1).panel_size(WIDTH_PX, 230.0).panel(chart).to_svg()
}

/// Readings and gas temperature with its band, over the record and where it moves most.
pub(crate) fn temperature_figure(record: &Record, answer: &Compensation, title: &str) -> Figure {
    let n = answer.time_s.len();
    let slowest_s = answer.rig.map_or(0.0, |rig| rig.sensors.iter().fold(0.0, |most: f64, s| most.max(s.tau_s)));
    let length = match (EXCERPT_TIME_CONSTANTS * slowest_s / record.sampling.period_s) as usize {
        0 => n / EXCERPT,
        samples => samples,
    };
    let length = length.max(50).min(n);
    let swing = |from: usize| {
        let part = &answer.gas_c[from..from + length];
        let (low, high) = part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(*c), h.max(*c)));
        high - low
    };
    let starts = (0..=n - length).step_by((length / 2).max(1));
    let from = starts.max_by(|a, b| swing(*a).total_cmp(&swing(*b))).unwrap_or(0);
    let figure = Figure::new(title).columns(1).panel_size(WIDTH_PX, 230.0);
    figure.panel(temperatures(record, answer, "The whole record", 0..n)).panel(temperatures(
        record,
        answer,
        "Where it moves most",
        from..from + length,
    ))
}

fn temperatures(record: &Record, answer: &Compensation, title: &str, shown: std::ops::Range<usize>) -> Chart {
    let time_s = &answer.time_s[shown.clone()];
    // Nothing is drawn across a gap: the instants at its ends have none between them.
    let is_apart =
        |k: usize| k > shown.start && answer.time_s[k] - answer.time_s[k - 1] > GAP_STEPS * record.sampling.period_s;
    let ends = [time_s.first().copied().unwrap_or(0.0), time_s.last().copied().unwrap_or(0.0)];
    let rows = record.time_s.partition_point(|t| *t < ends[0])..record.time_s.partition_point(|t| *t <= ends[1]);
    let broken = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
        shown.clone().flat_map(|k| is_apart(k).then_some(f64::NAN).into_iter().chain([value(k)])).collect()
    };
    let band = |sign: f64| broken(&|k| answer.gas_c[k] + sign * Z_975 * answer.gas_std_k[k]);
    // The instant of a break is that of what comes after it.
    let at_s: Vec<f64> = shown.clone().flat_map(|k| vec![answer.time_s[k]; 1 + usize::from(is_apart(k))]).collect();
    let gas = Series::trace("gas, with its 95 % band", at_s, broken(&|k| answer.gas_c[k])).colour(GAS);
    let readings = [&record.t1_c, &record.t2_c].into_iter().flat_map(|values| values[rows.clone()].iter().copied());
    let (axis, outside) = robust_axis("temperature (°C)", readings.chain(shown.clone().map(|k| answer.gas_c[k])));
    let mut chart = Chart::new(format!("{title}{outside}"), Axis::linear("time (s)"), axis);
    if let Some(reference) = &record.reference_c {
        let series = trace("reference", &record.time_s[rows.clone()], &reference[rows.clone()], REFERENCE);
        chart = series.into_iter().map(Series::dashed).fold(chart, Chart::series);
    }
    for (i, values) in [&record.t1_c, &record.t2_c].into_iter().enumerate() {
        let colour = CHANNELS[i];
        let series = trace(&record.channels[i], &record.time_s[rows.clone()], &values[rows.clone()], colour);
        chart = series.into_iter().fold(chart, Chart::series);
    }
    chart.series(gas.band(band(-1.0), band(1.0)))
}

pub(crate) fn spectra(record: &Record, answer: &Compensation) -> Chart {
    let period_s = record.sampling.period_s;
    let faster = answer.rig.is_some_and(|rig| rig.sensors[1].tau_s < rig.sensors[0].tau_s);
    let (name, raw) = if faster { (&record.channels[1], &record.t2_c) } else { (&record.channels[0], &record.t1_c) };
    let known: Vec<f64> = raw.iter().copied().filter(|c| c.is_finite()).collect();
    let (hz, density) = power_spectrum(&known, period_s);
    let (gas_hz, gas) = power_spectrum(&answer.gas_c, period_s);
    let mut chart = Chart::new("Spectra", Axis::logarithmic("frequency (Hz)"), Axis::logarithmic("density (K²/Hz)"))
        .series(Series::line(format!("{name}, uncorrected"), hz, density).colour(CHANNELS[usize::from(faster)]))
        .series(Series::line("gas", gas_hz.clone(), gas).colour(GAS));
    if let (Some(quality), Some(rig)) = (&answer.gas, &answer.rig) {
        let noise: Vec<f64> = gas_hz.iter().map(|hz| rig.noise_density_k2_per_hz(*hz, period_s)).collect();
        chart = chart.series(Series::trace("noise of the inferred gas", gas_hz, noise).colour(Colour::Grey).dashed());
        if let Some(hz) = quality.bandwidth_hz {
            chart = chart.reference(Reference::vertical(hz).label("determined by the readings up to here"));
        }
    }
    chart
}

/// Both time constants along the record with their bands: one SVG.
///
/// # Errors
/// [`ReportError`], if there is nothing to draw.
pub fn track_picture(answer: &Track) -> Result<String, ReportError> {
    track_figure(answer, &format!("time constants along the record: {}", answer.judgement.grade)).to_svg()
}

/// Both time constants along the record with their bands.
pub(crate) fn track_figure(answer: &Track, title: &str) -> Figure {
    let mut figure = Figure::new(title).columns(1).panel_size(WIDTH_PX, 230.0);
    for (i, along) in answer.sensors.iter().enumerate() {
        let name = &answer.last.sensors[i].channel;
        let colour = CHANNELS[i];
        let series = Series::trace("time constant, with its 95 % band", answer.time_s.clone(), along.tau_s.clone());
        let series = series.colour(colour).band(along.low_s.clone(), along.high_s.clone());
        let axis = Axis::linear("time constant (s)");
        let mut chart = Chart::new(name, Axis::linear("time (s)"), axis).series(series).without_legend();
        if let Some(step) = &answer.step {
            chart = chart.reference(Reference::vertical(step.at_s).label("step"));
        }
        figure = figure.panel(chart);
    }
    figure
}
