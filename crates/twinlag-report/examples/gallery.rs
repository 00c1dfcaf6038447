//! One figure of each kind, from made-up numbers: `cargo run -p twinlag-report --example gallery -- <directory>`.

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use twinlag_report::{Axis, Chart, Figure, Mark, Reference, Series, Surface};

const METHODS: [&str; 6] = ["cross-relation", "compensated", "whitened", "total least squares", "subspace", "oracle"];

fn main() -> Result<(), Box<dyn Error>> {
    let directory = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "gallery".to_owned()));
    fs::create_dir_all(&directory)?;
    let figures = [
        ("bias", Figure::new("").panel(bias("Bias against noise", 1.0)).panel_size(560.0, 400.0)),
        ("surface", Figure::new("").panel(surface("Cross-relation cost", 1e-5)).panel_size(520.0, 420.0)),
        ("coverage", Figure::new("").panel(coverage()).panel_size(560.0, 380.0)),
        ("success", Figure::new("").panel(success()).panel_size(640.0, 380.0)),
        (
            "all",
            Figure::new("Two thermocouples of unknown time constants")
                .columns(3)
                .panel(bias("Bias of τ₁", 1.0))
                .panel(bias("Bias of τ₂", 0.3))
                .panel(surface("Cost, noise-free", 0.0))
                .panel(coverage())
                .panel(success())
                .panel(traces()),
        ),
    ];
    for (name, figure) in figures {
        let path = directory.join(format!("{name}.svg"));
        fs::write(&path, figure.to_svg()?)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// Six estimators whose bias grows with the square of the noise.
fn bias(title: &str, scale: f64) -> Chart {
    let noise_k = [0.003, 0.01, 0.03, 0.1, 0.3];
    let slopes = [-90.0, 9.0, -4.0, 35.0, -30.0, 0.0];
    let axes = (Axis::logarithmic("noise, standard deviation (K)"), Axis::linear("bias (%)"));
    let mut chart = Chart::new(title, axes.0, axes.1).dodge(3.0).reference(Reference::horizontal(0.0).label("no bias"));
    for (name, slope) in METHODS.into_iter().zip(slopes) {
        let bias = noise_k.map(|s| scale * slope * s * s / (0.3 + s));
        let error = noise_k.map(|s| 0.1 + 2.0 * scale * s);
        chart = chart.series(Series::line(name, noise_k, bias).errors(error));
    }
    chart
}

/// A valley along `τ₁/τ₂ = const`.
fn surface(title: &str, floor: f64) -> Surface {
    let grid =
        |low: f64, high: f64| -> Vec<f64> { (0..60).map(|i| low * (high / low).powf(f64::from(i) / 59.0)).collect() };
    let (tau1_s, tau2_s) = (grid(0.005, 0.2), grid(0.02, 0.8));
    let cost = |t1: f64, t2: f64| {
        let (u, v) = ((t1 / 0.0238).ln(), (t2 / 0.0962).ln());
        1e-3 * ((u - v).powi(2) + 0.08 * (u + v).powi(2) + 0.02 * (u + v).powi(3).sin().powi(2)) + 2e-6 + floor
    };
    let z: Vec<f64> = tau2_s.iter().flat_map(|t2| tau1_s.iter().map(move |t1| cost(*t1, *t2))).collect();
    let axes = [Axis::logarithmic("τ₁ (s)"), Axis::logarithmic("τ₂ (s)"), Axis::logarithmic("cost (K²)")];
    Surface::new(title, axes, tau1_s, tau2_s, z)
        .mark(Mark::cross("truth", 0.0238, 0.0962))
        .mark(Mark::dot("minimum", 0.0215, 0.0875))
}

/// Wilson's interval for `k` of `n`, 95 %.
fn wilson(k: f64, n: f64) -> (f64, f64) {
    let z2 = 1.96_f64 * 1.96;
    let (p, scale) = (k / n, 1.0 / (1.0 + z2 / n));
    let half = 1.96 * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    ((p + z2 / (2.0 * n) - half) * scale, (p + z2 / (2.0 * n) + half) * scale)
}

fn coverage() -> Chart {
    let trials = 400.0;
    let records = ["sine", "steps", "random walk", "engine cycle", "gusts"];
    let x: Vec<f64> = (0..records.len()).map(|i| i as f64).collect();
    let axes = (Axis::categories("record", records), Axis::linear("coverage of the 95 % interval").range(0.77, 1.0));
    let mut chart =
        Chart::new("Coverage", axes.0, axes.1).dodge(9.0).reference(Reference::horizontal(0.95).label("nominal 95 %"));
    for (name, hits) in [
        ("compensated", [379.0, 371.0, 366.0, 352.0, 374.0]),
        ("whitened", [381.0, 378.0, 383.0, 377.0, 380.0]),
        ("subspace", [372.0, 360.0, 341.0, 333.0, 351.0]),
    ] {
        let (low, high): (Vec<f64>, Vec<f64>) = hits.iter().map(|k| wilson(*k, trials)).unzip();
        let y: Vec<f64> = hits.iter().map(|k| k / trials).collect();
        chart = chart.series(Series::points(name, x.clone(), y).interval(low, high));
    }
    chart
}

fn success() -> Chart {
    let solvers = ["Nelder-Mead", "BFGS", "Levenberg-Marquardt", "particle swarm"];
    let axes = (Axis::categories("", solvers), Axis::linear("success rate (%)").range(0.0, 108.0));
    Chart::new("Success of the solvers", axes.0, axes.1)
        .series(Series::bars("start at the truth", [99.5, 99.8, 100.0, 99.0]).errors([0.4, 0.2, 0.1, 0.6]))
        .series(Series::bars("start off by 3", [88.0, 71.0, 97.5, 98.5]).errors([2.0, 2.8, 0.8, 0.7]))
        .series(Series::bars("start off by 30", [52.0, 24.0, 81.0, 98.0]).errors([3.1, 2.6, 2.4, 0.8]))
}

/// A long record with a gap, a band about it and a dashed reference.
fn traces() -> Chart {
    let time_s: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 0.002).collect();
    let gas = |t: f64| 300.0 + 20.0 * (0.35 * t).sin() + 6.0 * (2.9 * t).sin();
    let ripple = |t: f64| 1.5 * (977.0 * t).sin() * (131.0 * t).cos();
    let measured: Vec<f64> =
        time_s.iter().map(|&t| if (12.0..14.0).contains(&t) { f64::NAN } else { gas(t - 0.4) + ripple(t) }).collect();
    let truth: Vec<f64> = time_s.iter().map(|&t| gas(t)).collect();
    let low: Vec<f64> = truth.iter().map(|v| v - 4.0).collect();
    let high: Vec<f64> = truth.iter().map(|v| v + 4.0).collect();
    Chart::new("Record", Axis::linear("time (s)"), Axis::linear("temperature (°C)"))
        .series(Series::trace("measured", time_s.clone(), measured))
        .series(Series::trace("reconstructed", time_s, truth).band(low, high).dashed())
        .reference(Reference::vertical(30.0).label("valve shut"))
}
