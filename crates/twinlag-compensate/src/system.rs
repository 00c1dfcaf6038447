//! Gas and sensors as one linear system `dz/dt = A z + noise`, and what it does over a step of
//! time.
//!
//! The state is that of the gas's terms, then of each sensor (its body, a second lag, a slow path),
//! then of noise that is not white, then a constant one that carries losses; what is left of `D`
//! rests at zero.

use nalgebra::{SMatrix, SVector};

use crate::prior::Term;
use crate::rig::{Coloured, Rig, SensorAt};

/// Terms of the exponential's series, and the norm of the matrix up to which it is used: with `‖A h‖ ≤ 1/2` the next is `2⁻¹³/13!`, below 2e-14.
const SERIES_TERMS: usize = 12;
const MAX_SERIES_NORM: f64 = 0.5;

/// Where each part of the state is.
#[derive(Clone, Copy, Debug, Default)]
struct Layout {
    gas: usize,
    body: [usize; 2],
    second: [Option<usize>; 2],
    slow: [Option<usize>; 2],
    coloured: [Option<usize>; 2],
    mismatch: Option<usize>,
    one: usize,
}

/// The system with a state of dimension `D`.
#[derive(Clone, Debug)]
pub(crate) struct System<const D: usize> {
    layout: Layout,
    rig: Rig,
    /// Rates without those of the sensors, which may change.
    rates: SMatrix<f64, D, D>,
    /// Intensity of the driving noise of that part of the gas whose intensity may change, and of
    /// everything.
    #[cfg(feature = "std")]
    drive_of_gas: SMatrix<f64, D, D>,
    drive: SMatrix<f64, D, D>,
    /// The gas about its level.
    pub(crate) gas: SVector<f64, D>,
    /// The gas's lines alone.
    #[cfg(feature = "std")]
    pub(crate) lines: SVector<f64, D>,
    /// What each channel reads.
    pub(crate) reads: [SVector<f64, D>; 2],
    /// Covariance of the state before the first reading.
    pub(crate) before: SMatrix<f64, D, D>,
}

/// What a step of time does: `z → Φ z`, and the covariance that it adds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step<const D: usize> {
    pub(crate) transition: SMatrix<f64, D, D>,
    pub(crate) added: SMatrix<f64, D, D>,
}

impl<const D: usize> Step<D> {
    /// Two of these steps in one.
    pub(crate) fn twice(&self) -> Self {
        let Self { transition, added } = self;
        Self { transition: transition * transition, added: around(transition, added) + added }
    }
}

/// Numbers that the state needs.
pub(crate) fn states(rig: &Rig, terms: &[Term]) -> usize {
    let sensor = |i: usize| {
        let s = &rig.sensors[i];
        1 + usize::from(s.second_tau_s.is_some()) + usize::from(s.slow.is_some()) + usize::from(s.coloured.is_some())
    };
    terms.iter().map(Term::states).sum::<usize>() + sensor(0) + sensor(1) + usize::from(rig.mismatch.is_some()) + 1
}

impl<const D: usize> System<D> {
    pub(crate) fn new(rig: &Rig, terms: &[Term]) -> Self {
        let mut next = 0;
        let mut take = |count: usize| {
            next += count;
            next - count
        };
        let mut rates = SMatrix::<f64, D, D>::zeros();
        let mut drive = SMatrix::<f64, D, D>::zeros();
        let mut before = SMatrix::<f64, D, D>::zeros();
        let mut gas = SVector::<f64, D>::zeros();
        for term in terms {
            let at = take(term.states());
            gas[at] = 1.0;
            move_gas(term, at, [&mut rates, &mut drive, &mut before]);
        }
        #[cfg(feature = "std")]
        let (drive_of_gas, lines) = changing(terms, &drive);
        let mut layout = Layout { gas: take(0), ..Layout::default() };
        let mut reads = [SVector::<f64, D>::zeros(); 2];
        let swing = gas.dot(&(before * gas));
        for (i, sensor) in rig.sensors.iter().enumerate() {
            layout.body[i] = take(1);
            let mut direct = layout.body[i];
            if let Some(tau_s) = sensor.second_tau_s {
                let at = take(1);
                rates[(at, direct)] = 1.0 / tau_s;
                rates[(at, at)] = -1.0 / tau_s;
                layout.second[i] = Some(at);
                direct = at;
            }
            reads[i][direct] = 1.0;
            if let Some(slow) = sensor.slow {
                let at = take(1);
                rates[(at, direct)] = 1.0 / slow.tau_s;
                rates[(at, at)] = -1.0 / slow.tau_s;
                reads[i][direct] -= slow.share;
                reads[i][at] = slow.share;
                layout.slow[i] = Some(at);
            }
            let mut noise = |coloured: Coloured| {
                let at = take(1);
                rates[(at, at)] = -1.0 / coloured.correlation_s;
                drive[(at, at)] = 2.0 * coloured.std_k * coloured.std_k / coloured.correlation_s;
                before[(at, at)] = coloured.std_k * coloured.std_k;
                at
            };
            layout.coloured[i] = sensor.coloured.map(&mut noise);
            if let Some(at) = layout.coloured[i] {
                reads[i][at] = 1.0;
            }
            if i == 1 {
                layout.mismatch = rig.mismatch.map(&mut noise);
            }
        }
        layout.one = take(1);
        before[(layout.one, layout.one)] = 0.0;
        // Where each body was before the first reading nobody knows: as far from the level as the
        // gas goes, twice.
        for i in 0..2 {
            for at in [Some(layout.body[i]), layout.second[i], layout.slow[i]].into_iter().flatten() {
                before[(at, at)] = 4.0 * swing;
            }
        }
        Self {
            layout,
            rig: *rig,
            rates,
            #[cfg(feature = "std")]
            drive_of_gas,
            drive,
            gas,
            #[cfg(feature = "std")]
            lines,
            reads,
            before,
        }
    }

    /// The state before the first reading.
    pub(crate) fn start(&self) -> SVector<f64, D> {
        let mut state = SVector::zeros();
        state[self.layout.one] = 1.0;
        state
    }

    /// What happens in `step_s`, with each sensor as it is then. `reading_k` is what each reads
    /// about the level, where losses are known.
    pub(crate) fn step(&self, step_s: f64, locals: Option<[(SensorAt, f64); 2]>) -> Step<D> {
        exponential(&self.rates(locals), &self.drive, step_s)
    }

    /// What that part of the gas whose intensity may change adds to the covariance of the state in
    /// `step_s`.
    #[cfg(feature = "std")]
    pub(crate) fn added_by_gas(&self, step_s: f64, locals: Option<[(SensorAt, f64); 2]>) -> SMatrix<f64, D, D> {
        exponential(&self.rates(locals), &self.drive_of_gas, step_s).added
    }

    /// Whether the gas has lines.
    #[cfg(feature = "std")]
    pub(crate) fn has_lines(&self) -> bool {
        self.lines.iter().any(|share| *share > 0.0)
    }

    /// Whether anything else is driven by noise.
    #[cfg(feature = "std")]
    pub(crate) fn has_steady_drive(&self) -> bool {
        self.drive != self.drive_of_gas
    }

    /// The rates with each sensor as it is then.
    fn rates(&self, locals: Option<[(SensorAt, f64); 2]>) -> SMatrix<f64, D, D> {
        let mut rates = self.rates;
        for i in 0..2 {
            let (local, reading_k) =
                locals.map_or((SensorAt { tau_factor: 1.0, loss_k: 0.0, loss_slope: 0.0 }, 0.0), |l| l[i]);
            let rate = 1.0 / (self.rig.sensors[i].tau_s * local.tau_factor);
            let body = self.layout.body[i];
            for at in 0..self.layout.gas {
                rates[(body, at)] = rate * self.gas[at];
            }
            if let Some(at) = self.layout.mismatch {
                rates[(body, at)] = if i == 0 { -0.5 * rate } else { 0.5 * rate };
            }
            rates[(body, body)] = -rate * (1.0 + local.loss_slope);
            rates[(body, self.layout.one)] = -rate * (local.loss_k - local.loss_slope * reading_k);
        }
        rates
    }
}

/// `a b`, in loops that are not unrolled, one copy for each size: otherwise the larger sizes take
/// minutes to compile.
#[inline(never)]
pub(crate) fn product<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut out = SMatrix::<f64, D, D>::zeros();
    let (a, b) = (a.as_slice(), b.as_slice());
    for (column, factors) in out.as_mut_slice().chunks_exact_mut(D).zip(b.chunks_exact(D)) {
        for (part, factor) in a.chunks_exact(D).zip(factors) {
            for (sum, value) in column.iter_mut().zip(part) {
                *sum += value * factor;
            }
        }
    }
    out
}

/// `a b aᵀ`.
#[inline(never)]
pub(crate) fn around<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    product(&product(a, b), &a.transpose())
}

/// `Φ = exp(A t)` and `∫₀ᵗ exp(A u) Q exp(Aᵀ u) du`: their series over a part of the step, doubled
/// until it is whole, so that nothing cancels. Most of `A` is zero, which the series makes use of.
fn exponential<const D: usize>(rates: &SMatrix<f64, D, D>, drive: &SMatrix<f64, D, D>, step_s: f64) -> Step<D> {
    let size = (0..D).map(|row| rates.row(row).iter().map(|r| r.abs()).sum::<f64>()).fold(0.0, f64::max) * step_s;
    let mut doublings = 0;
    let mut part_s = step_s;
    let mut left = size;
    while left > MAX_SERIES_NORM {
        left *= 0.5;
        part_s *= 0.5;
        doublings += 1;
    }
    let times_rates = |x: &SMatrix<f64, D, D>| {
        let mut out = SMatrix::<f64, D, D>::zeros();
        for column in 0..D {
            for row in 0..D {
                let rate = rates[(row, column)] * part_s;
                if rate != 0.0 {
                    for k in 0..D {
                        out[(row, k)] += rate * x[(column, k)];
                    }
                }
            }
        }
        out
    };
    let mut power = SMatrix::<f64, D, D>::identity();
    let mut transition = power;
    let mut driven = drive * part_s;
    let mut added = driven;
    for k in 1..=SERIES_TERMS {
        power = times_rates(&power) / k as f64;
        transition += power;
        let half = times_rates(&driven);
        driven = (half + half.transpose()) / (k + 1) as f64;
        added += driven;
    }
    for _ in 0..doublings {
        added += around(&transition, &added);
        transition = product(&transition, &transition);
    }
    Step { transition, added }
}

/// Adds a term of the gas whose first state is `at` to the rates, the drive and the covariance before the first reading.
fn move_gas<const D: usize>(term: &Term, at: usize, [rates, drive, before]: [&mut SMatrix<f64, D, D>; 3]) {
    match *term {
        Term::Rough { std_k, corner_hz } => {
            let rate = core::f64::consts::TAU * corner_hz;
            rates[(at, at)] = -rate;
            drive[(at, at)] = 2.0 * rate * std_k * std_k;
            before[(at, at)] = std_k * std_k;
        }
        Term::Resonance { std_k, frequency_hz, quality } => {
            let rate = core::f64::consts::TAU * frequency_hz;
            rates[(at, at + 1)] = rate;
            rates[(at + 1, at)] = -rate;
            rates[(at + 1, at + 1)] = -rate / quality;
            drive[(at + 1, at + 1)] = 2.0 * rate / quality * std_k * std_k;
            before[(at, at)] = std_k * std_k;
            before[(at + 1, at + 1)] = std_k * std_k;
        }
    }
}

/// Whether a term is a line: a movement that goes on for more than three cycles, in which the present
/// drive has little part.
#[cfg(feature = "std")]
fn is_line(term: &Term) -> bool {
    const MIN_QUALITY: f64 = 10.0;
    matches!(term, Term::Resonance { quality, .. } if *quality > MIN_QUALITY)
}

/// Of the gas's driving noise that part whose intensity may change: of everything but lines, or of
/// these where there is nothing else. And the lines.
#[cfg(feature = "std")]
fn changing<const D: usize>(terms: &[Term], drive: &SMatrix<f64, D, D>) -> (SMatrix<f64, D, D>, SVector<f64, D>) {
    let mut changing = SMatrix::<f64, D, D>::zeros();
    let mut lines = SVector::<f64, D>::zeros();
    let has_lines_alone = terms.iter().all(is_line);
    let mut first = 0;
    for term in terms {
        lines[first] = if is_line(term) { 1.0 } else { 0.0 };
        let next = first + term.states();
        for at in first..next {
            changing[(at, at)] = if is_line(term) && !has_lines_alone { 0.0 } else { drive[(at, at)] };
        }
        first = next;
    }
    (changing, lines)
}
