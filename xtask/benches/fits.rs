//! What a fit and a trial cost, and what they are made of. `cargo xtask bench` runs this and prints the ratios.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use rand::RngExt;
use rand_distr::StandardNormal;
use twinlag::bias::{Compensated, Noise};
use twinlag::cross_relation::{CostValue, CrossRelation, Form, Readings, Whitened};
use twinlag::estimate::{Estimate, NoiseKnowledge, Task};
use twinlag::optimise::{Budget, Cost, Derivatives, End, Minimiser, Optimiser, Problem, Variable};
use twinlag::record::{Record, Selection};
use twinlag::sensor::Discretisation;
use twinlag::{Estimator, Hold, Options, characterise};
use twinlag_experiment::{Experiment, Plan};
use twinlag_study::{Outcome, Study};
use twinlag_transform::{Complex64, Forward};

/// What the SciPy script starts from, discards, and is told.
const START_S: [f64; 2] = [0.01, 0.05];
const DISCARD: usize = 300;
const NOISE_STD_K: f64 = 0.583_363_094_478_901_8;

/// A cost of two time constants, as the optimiser takes it.
struct OfTwo<F>(F);

impl<F: Fn(&[f64; 2]) -> CostValue<2>> Cost for OfTwo<F> {
    fn value(&self, x: &[f64]) -> f64 {
        self.0(&[x[0], x[1]]).value
    }

    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let c = self.0(&[x[0], x[1]]);
        Some(Derivatives {
            value: c.value,
            gradient: c.gradient.to_vec(),
            curvature: c.hessian.iter().map(|row| row.to_vec()).collect(),
        })
    }
}

fn minimise(cost: impl Fn(&[f64; 2]) -> CostValue<2>) -> [f64; 2] {
    let cost = OfTwo(cost);
    let variable = |name: &str| Variable::logarithmic(name, 0.0004, 50.0);
    let problem = Problem::new(&cost, vec![variable("T1"), variable("T2")]).expect("valid bounds");
    let fit = Optimiser::default().minimise(&problem, &START_S, &Budget::default()).expect("a valid start");
    assert_eq!(fit.end, End::Converged);
    [fit.x[0], fit.x[1]]
}

fn sine() -> Record {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/sine_5pct.csv");
    Record::read(&file, &Selection::default()).expect("the reference record")
}

/// Each fit starts from the raw channels, as the script's does from its arrays.
fn fits(c: &mut Criterion) {
    let record = sine();
    let (y1, y2, period_s) = (&record.t1_c, &record.t2_c, record.sampling.period_s);
    let readings = || Readings::even(y1, y2, period_s).expect("valid channels");
    c.bench_function("fit-plain", |b| {
        b.iter(|| {
            let readings = readings();
            let cost = CrossRelation::new(&readings, DISCARD).expect("long enough");
            minimise(|t| cost.evaluate(t))
        });
    });
    c.bench_function("fit-compensated", |b| {
        b.iter(|| {
            let readings = readings();
            let noise = [NOISE_STD_K; 2].map(|s| Noise::white(s).expect("positive"));
            let cost = Compensated::new(CrossRelation::new(&readings, DISCARD).expect("long enough"), noise);
            minimise(|t| cost.evaluate(t))
        });
    });
    let whitened = |form| {
        let readings = readings();
        let hold = Discretisation::ZeroOrderHold;
        let cost = Whitened::with_form(&readings, hold, [NOISE_STD_K; 2], form).expect("valid");
        minimise(|t| cost.evaluate(t))
    };
    c.bench_function("fit-whitened", |b| b.iter(|| whitened(Form::Compressed)));
    c.bench_function("fit-whitened-all-bins", |b| b.iter(|| whitened(Form::Spectral)));
    let held = readings();
    let full = Whitened::new(&held, Discretisation::ZeroOrderHold, [NOISE_STD_K; 2]).expect("valid");
    let compressed = full.clone().compressed(false);
    c.bench_function("evaluate-all-bins", |b| b.iter(|| full.evaluate(black_box(&START_S))));
    c.bench_function("evaluate-compressed", |b| b.iter(|| compressed.evaluate(black_box(&START_S))));
    let options = Options { hold: Hold::ZeroOrderHold, ..Options::default() };
    c.bench_function("characterise", |b| b.iter(|| characterise(&record, &options).expect("answered")));
    c.bench_function("estimate-everything-found", |b| {
        b.iter(|| {
            let mut task = Task::new(&held);
            task.noise = NoiseKnowledge::default();
            Estimator::Whitened.estimate(&task).expect("answered")
        });
    });
}

/// A trial of the study of a million, beside its noise and its transforms alone.
fn trials(c: &mut Criterion) {
    let plan = Plan::from_toml(include_str!("../bench/million.toml")).expect("a valid plan");
    let experiment = Experiment::new(&plan).expect("valid");
    let bench = plan.bench(&plan.cells()[0], 0).expect("valid");
    let n = plan.samples[0];
    let fourier = Forward::of(2 * n);
    let (mut input, mut output, mut scratch) = (vec![0.0; 2 * n], vec![Complex64::ZERO; fourier.bins()], Vec::new());
    let mut index = 0;
    c.bench_function("noise-and-transforms", |b| {
        b.iter(|| {
            index += 1;
            for mut rng in bench.rig.noise_streams(index) {
                for value in &mut input[..n] {
                    *value = rng.sample(StandardNormal);
                }
                input[n..].fill(0.0);
                fourier.transform_into(&mut input, &mut output, &mut scratch);
                black_box(&output);
            }
        });
    });
    let mut kept = experiment.scratch(0).expect("valid");
    let mut outcome = Outcome::new(&experiment.quantities(0));
    let mut tally = twinlag_study::Tally::new(&experiment.quantities(0));
    c.bench_function("trial", |b| {
        b.iter(|| {
            index += 1;
            outcome.clear();
            experiment.trial(0, index, &mut kept, &mut outcome).expect("answered");
            tally.push(&outcome);
        });
    });
}

criterion_group!(benches, fits, trials);
criterion_main!(benches);
