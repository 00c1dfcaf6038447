//! The energy of a model in which time constants change by splines, from two columns for each spline in place of one for each of
//! its coefficients.
//!
//! A residual at `t` depends on the time constants of the samples that the filters reach back to, over which a spline of a long record
//! hardly bends: `m(s) = m(t) + m'(t) (s − t)`, but for `½ m'' (s − t)²`. So of a B-spline `B` of its change, with `e = B/(1 + m)`,
//!
//! ```text
//! ∂r(t)/∂b = e(t) u(t) + e'(t) v(t)
//! ```
//!
//! `u` the derivative of the residual with respect to a change by the same share everywhere, and `v` to one that grows by that in a
//! second from nothing at `t` on. Four B-splines reach a sample, so that the sums of products of all coefficients come from one pass.
//!
//! A fit from such columns ends where they, and not the exact ones, are orthogonal to the residual. Where these are off by a share
//! `ε` of their length, that is `ε` of a standard error away, for a residual that is white: `(JᵀJ)⁻¹ Dᵀr` has the covariance
//! `(JᵀJ)⁻¹ DᵀD (JᵀJ)⁻¹` for columns `J + D`. [`is_close`] compares.

use std::ops::Range;
use std::sync::Arc;

use num_dual::DualNum;
use rayon::prelude::*;
use twinlag_optimise::{Cost, Derivatives, Variable};

use super::near::piece;
use crate::cost::{Linearised, ResidualCost};
use crate::effect::{Effect, Identifier, Parameter, Seat, Shared};
use crate::fit::{Effort, Fitted, minimised};
use crate::model::Model;
use crate::normal::NormalEquations;
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::{Plant, TimeConstantChange};
use crate::selection::Selection;
use crate::spline::{Spline, on_knots, weights};

/// Share of its length by which a column may be off: a hundredth of a standard error.
const COLUMN_ERROR: f64 = 0.01;
/// Samples whose products are added up before those of others are: the sums are the same on any number of threads.
const SUMMED_SAMPLES: usize = 16_384;
/// B-splines that reach a sample.
const REACHING: usize = 4;

/// A spline in a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    /// Which of the effects it is.
    pub(super) effect: usize,
    /// Where it begins and ends, s.
    pub(super) ends_s: [f64; 2],
    /// Whether it is the ratio of the time constants that changes by it.
    pub(super) of_ratio: bool,
}

/// A function of time, s.
type Function = Arc<dyn Fn(f64) -> f64 + Send + Sync>;

/// A change of the time constants that is given, or that many times it.
struct Given {
    function: Function,
    seat: Seat,
}

impl Given {
    fn shared(function: Function, is_fitted: bool, of_ratio: bool) -> Shared {
        let times = || Parameter::new("times", "1", Variable::linear("times", 1.0, -1.0, 1.0));
        let parameters = if is_fitted { vec![times()] } else { Vec::new() };
        let seat = Seat::new(Identifier::VARYING_TIME_CONSTANT, of_ratio.then_some(1), parameters);
        Arc::new(Self { function, seat })
    }
}

impl Effect for Given {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.seat.parameters.len()]]
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let times = values.first().copied().unwrap_or(Number::from(1.0));
        for sensor in usize::from(self.seat.channel.is_some())..2 {
            let function = self.function.clone();
            let change = TimeConstantChange::of_time(Arc::new(move |time_s| times * function(time_s)));
            plant.sensors[sensor].changes.push(change);
        }
    }

    fn is_of_the_record(&self) -> bool {
        true
    }
}

/// The energy of a model with splines.
pub(super) struct Local<'a> {
    pub(super) model: &'a Model,
    pub(super) curves: Vec<Curve>,
    pub(super) observations: &'a Observations,
    pub(super) selection: &'a Selection,
    /// Instants of all samples, s.
    pub(super) time_s: &'a [f64],
}

/// A spline at a point, and which of the sums are its.
struct Shape {
    spline: Spline,
    coefficients: Vec<f64>,
    /// Of its first B-spline; that of the mean comes after the last one.
    first: usize,
}

impl Shape {
    fn of(curve: &Curve, values: &[f64], first: usize) -> Self {
        let numbers: Vec<Number> = values.iter().copied().map(Number::from).collect();
        let [from_s, to_s] = curve.ends_s;
        Self { spline: Spline::new(from_s, to_s, &numbers), coefficients: coefficients(values), first }
    }

    /// Distance of knots, s.
    fn knot_s(&self, curve: &Curve) -> f64 {
        (curve.ends_s[1] - curve.ends_s[0]) / (self.coefficients.len() - 3) as f64
    }
}

/// What multiplies the B-splines, as [`Spline::new`] has it.
fn coefficients(values: &[f64]) -> Vec<f64> {
    let on_knots = on_knots(values);
    let last = on_knots.len() - 1;
    let [before, after] = [2.0 * on_knots[0] - on_knots[1], 2.0 * on_knots[last] - on_knots[last - 1]];
    [before].into_iter().chain(on_knots).chain([after]).collect()
}

/// The first B-spline that reaches an instant, and the four there with their slopes, 1/s.
fn reaching(curve: &Curve, knot_s: f64, time_s: f64, count: usize) -> (usize, [Number; REACHING]) {
    let pieces = (count - 3) as f64;
    let [from_s, to_s] = curve.ends_s;
    let x = ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0) * pieces;
    let piece = x.floor().min(pieces - 1.0);
    (piece as usize, weights(Number::new(x - piece, 1.0 / knot_s)))
}

/// The derivatives by which those of all B-splines are found: of the two changes of each spline, and of all other parameters.
struct Columns {
    lin: Linearised,
    shapes: Vec<Shape>,
    /// Parameters that are not those of a spline.
    others: Vec<usize>,
    middle_s: f64,
}

impl Columns {
    /// `u` and `v` of spline `which` at residual `i`.
    fn of_spline(&self, which: usize, i: usize, time_s: f64) -> [f64; 2] {
        let first = self.others.len() + 2 * which;
        let level = self.lin.columns[first][i];
        [level, self.lin.columns[first + 1][i] - (time_s - self.middle_s) * level]
    }
}

impl Local<'_> {
    /// The fit from `start`.
    pub(super) fn fit(&self, start: &[f64]) -> Fitted {
        let variables = self.model.variables(start, self.observations);
        let fit = minimised(self, variables, start, self.selection.counted(), Effort::Finish);
        let count = self.model.degrees_of_freedom(self.count(&fit.x), &fit.x, self.observations, self.selection);
        Fitted::of(self.model, fit, count)
    }

    /// Number of residuals that count, and of what is known beforehand.
    fn count(&self, theta: &[f64]) -> usize {
        let cost = ResidualCost::new(self.model, theta, self.observations, self.selection);
        cost.energy(theta);
        cost.count()
    }

    /// Half the derivatives of the energy, without what is known beforehand of the effects.
    pub(super) fn normal(&self, theta: &[f64]) -> NormalEquations {
        let columns = self.columns(theta);
        let dimension =
            columns.others.len() + columns.shapes.iter().map(|s| s.coefficients.len() + 1).sum::<usize>() + 1;
        let n = columns.lin.samples.len();
        let starts: Vec<usize> = (0..n).step_by(SUMMED_SAMPLES).collect();
        let of_part = |from: &usize| self.sums(&columns, *from..(from + SUMMED_SAMPLES).min(n), dimension);
        let parts: Vec<Vec<f64>> = starts.par_iter().map(of_part).collect();
        let mut sums = vec![0.0; dimension * dimension];
        parts.iter().for_each(|part| sums.iter_mut().zip(part).for_each(|(sum, x)| *sum += x));
        // What is known of the other parameters beforehand comes after the samples.
        let last = dimension - 1;
        for i in n..columns.lin.residual.len() {
            let row: Vec<f64> = (0..columns.others.len()).map(|a| columns.lin.columns[a][i]).collect();
            let places = (0..row.len()).chain([last]);
            let row: Vec<(usize, f64)> = places.zip(row.iter().copied().chain([columns.lin.residual[i]])).collect();
            row.iter().for_each(|(a, x)| {
                row.iter().filter(|(b, _)| b <= a).for_each(|(b, y)| sums[a * dimension + b] += x * y);
            });
        }
        let full = |a: usize, b: usize| sums[a.max(b) * dimension + a.min(b)];
        let by = self.directions(&columns, theta.len(), dimension);
        let times: Vec<Vec<f64>> = by
            .iter()
            .map(|by| (0..dimension).map(|a| by.iter().map(|(b, x)| full(a, *b) * x).sum()).collect())
            .collect();
        let along = |by: &[(usize, f64)], row: &[f64]| by.iter().map(|(b, x)| row[*b] * x).sum::<f64>();
        NormalEquations {
            products: by.iter().map(|by| times.iter().map(|row| along(by, row)).collect()).collect(),
            slope: times.iter().map(|row| row[last]).collect(),
            energy: full(last, last),
            count: columns.lin.residual.len(),
            ..NormalEquations::none(theta.len())
        }
    }

    /// The sums that each parameter moves, and how fast.
    fn directions(&self, columns: &Columns, parameters: usize, dimension: usize) -> Vec<Vec<(usize, f64)>> {
        let mut out = vec![Vec::new(); parameters];
        columns.others.iter().enumerate().for_each(|(place, i)| out[*i].push((place, 1.0)));
        for (shape, curve) in columns.shapes.iter().zip(&self.curves) {
            let range = self.model.range(curve.effect);
            for (j, i) in range.clone().enumerate() {
                let unit: Vec<f64> = (0..range.len()).map(|k| f64::from(u8::from(k == j))).collect();
                let of_unit = Shape::of(curve, &unit, 0);
                let places = of_unit.coefficients.iter().enumerate().filter(|(_, x)| **x != 0.0);
                out[i].extend(places.map(|(l, x)| (shape.first + l, *x)));
                // The mean is what its value lacks.
                let (piece, four) = reaching(curve, shape.knot_s(curve), curve.ends_s[0], of_unit.coefficients.len());
                let sum: f64 = four.iter().zip(&of_unit.coefficients[piece..]).map(|(b, x)| b.re * x).sum();
                let mean = sum - of_unit.spline.at(curve.ends_s[0]).re;
                out[i].push((shape.first + of_unit.coefficients.len(), -mean));
            }
        }
        debug_assert!(out.iter().flatten().all(|(place, _)| place + 1 < dimension), "the residual is nobody's");
        out
    }

    /// The columns at a point.
    fn columns(&self, theta: &[f64]) -> Columns {
        let is_curve = |i: &usize| self.curves.iter().any(|c| self.model.range(c.effect).contains(i));
        let others: Vec<usize> = (0..theta.len()).filter(|i| !is_curve(i)).collect();
        let middle_s = 0.5 * self.observations.ends_s().iter().sum::<f64>();
        let mut first = others.len();
        let mut model = self.model.clone();
        let mut shapes = Vec::new();
        for curve in &self.curves {
            let shape = Shape::of(curve, &theta[self.model.range(curve.effect)], first);
            first += shape.coefficients.len() + 1;
            let spline = shape.spline.clone();
            let given: Function = Arc::new(move |time_s| spline.at(time_s).re);
            model = model.replaced(curve.effect, Given::shared(given, false, curve.of_ratio));
            shapes.push(shape);
        }
        for curve in &self.curves {
            model = with_both(&model, middle_s, curve.of_ratio);
        }
        let mut at: Vec<f64> = others.iter().map(|i| theta[*i]).collect();
        at.resize(at.len() + 2 * self.curves.len(), 0.0);
        let lin = model.linearised(&at, self.observations, self.selection);
        Columns { lin, shapes, others, middle_s }
    }

    /// Products of the rows of some samples, the lower half.
    fn sums(&self, columns: &Columns, samples: Range<usize>, dimension: usize) -> Vec<f64> {
        let (others, count) = (columns.others.len(), self.curves.len());
        let width = others + (REACHING + 1) * count + 1;
        let mut out = vec![0.0; dimension * dimension];
        let (mut row, mut products) = (vec![0.0; width], vec![0.0; width * width]);
        let mut places: Vec<usize> = (0..width).collect();
        places[width - 1] = dimension - 1;
        let mut pieces = vec![usize::MAX; count];
        for (i, sample) in samples.clone().zip(columns.lin.samples.iter_from(samples.start)) {
            let time_s = self.time_s[sample];
            for (a, value) in row[..others].iter_mut().enumerate() {
                *value = columns.lin.columns[a][i];
            }
            row[width - 1] = columns.lin.residual[i];
            for (which, (shape, curve)) in columns.shapes.iter().zip(&self.curves).enumerate() {
                let knot_s = shape.knot_s(curve);
                let (piece, four) = reaching(curve, knot_s, time_s, shape.coefficients.len());
                let first = others + (REACHING + 1) * which;
                if piece != pieces[which] {
                    flush(&mut out, dimension, &places, &mut products);
                    pieces[which] = piece;
                    (0..REACHING).for_each(|l| places[first + l] = shape.first + piece + l);
                    places[first + REACHING] = shape.first + shape.coefficients.len();
                }
                let change = four.iter().zip(&shape.coefficients[piece..]).map(|(b, x)| *b * *x).sum::<Number>();
                let factor = Number::new(shape.spline.at(time_s).re + 1.0, change.eps).recip();
                let [u, v] = columns.of_spline(which, i, time_s);
                for (value, b) in row[first..].iter_mut().zip(four.into_iter().chain([Number::from(1.0)])) {
                    let e = b * factor;
                    *value = e.re * u + e.eps * v;
                }
            }
            for (a, x) in row.iter().enumerate() {
                products[a * width..=a * width + a].iter_mut().zip(&row).for_each(|(sum, y)| *sum += x * y);
            }
        }
        flush(&mut out, dimension, &places, &mut products);
        out
    }
}

/// Adds products to the sums that they belong to, and forgets them.
fn flush(out: &mut [f64], dimension: usize, places: &[usize], products: &mut [f64]) {
    let width = places.len();
    for a in 0..width {
        for b in 0..=a {
            let (high, low) = (places[a].max(places[b]), places[a].min(places[b]));
            out[high * dimension + low] += products[a * width + b];
        }
    }
    products.fill(0.0);
}

/// `model` with a change by the same share everywhere, and with one that grows by that in a second.
fn with_both(model: &Model, middle_s: f64, of_ratio: bool) -> Model {
    let level = Given::shared(Arc::new(|_| 1.0), true, of_ratio);
    model.with(level).with(Given::shared(Arc::new(move |time_s| time_s - middle_s), true, of_ratio))
}

impl Cost for Local<'_> {
    fn value(&self, theta: &[f64]) -> f64 {
        let numbers: Vec<Number> = theta.iter().copied().map(Number::from).collect();
        let known: f64 = self.model.knowledge(&numbers, self.observations).map(|k| k.re * k.re).sum();
        self.model.energy(theta, self.observations, self.selection) + known
    }

    fn derivatives(&self, theta: &[f64]) -> Option<Derivatives> {
        let NormalEquations { mut products, mut slope, mut energy, .. } = self.normal(theta);
        let prior = prior(self.model, theta);
        for row in &prior {
            energy += row.value * row.value;
            for (a, x) in row.slope.iter().enumerate() {
                slope[a] += x * row.value;
                products[a].iter_mut().zip(&row.slope).for_each(|(sum, y)| *sum += x * y);
            }
        }
        let double = |row: Vec<f64>| row.into_iter().map(|x| 2.0 * x).collect::<Vec<f64>>();
        let curvature = products.into_iter().map(double).collect();
        Some(Derivatives { value: energy, gradient: double(slope), curvature })
    }
}

/// What is known of the effects beforehand: a value over its uncertainty, and its derivatives.
pub(super) struct Prior {
    pub(super) value: f64,
    pub(super) slope: Vec<f64>,
}

/// All that is known of the effects of a model beforehand.
pub(super) fn prior(model: &Model, theta: &[f64]) -> Vec<Prior> {
    let mut numbers: Vec<Number> = theta.iter().copied().map(Number::from).collect();
    let mut out: Vec<Prior> =
        model.prior(&numbers).iter().map(|p| Prior { value: p.re, slope: Vec::with_capacity(theta.len()) }).collect();
    for i in 0..theta.len() {
        numbers[i] = numbers[i].derivative();
        out.iter_mut().zip(model.prior(&numbers)).for_each(|(row, p)| row.slope.push(p.eps));
        numbers[i].eps = 0.0;
    }
    out
}

/// Whether the columns of a spline of `size` coefficients are those that [`Local`] makes, but for [`COLUMN_ERROR`]: compared for
/// the B-spline in the middle of the record, at a model without changes.
pub(super) fn is_close(
    model: &Model,
    theta: &[f64],
    observations: &Observations,
    selection: &Selection,
    ends_s: [f64; 2],
    size: usize,
) -> bool {
    let curve = Curve { effect: 0, ends_s, of_ratio: false };
    let count = coefficients(&vec![0.0; size]).len();
    let knot_s = (ends_s[1] - ends_s[0]) / (count - 3) as f64;
    let middle = count / 2;
    let bump = move |time_s: f64| {
        let (piece, four) = reaching(&curve, knot_s, time_s, count);
        middle.checked_sub(piece).and_then(|l| four.get(l).copied()).unwrap_or(Number::from(0.0))
    };
    let samples = observations.samples();
    let reach = (3.0 * knot_s / observations.step_s()) as usize;
    // The middle of the B-spline, which reaches over four intervals.
    let centre_s = ends_s[0] + (middle as f64 - 1.0) * knot_s;
    let centre = observations.stretches.iter().flat_map(|s| s.time_s.iter()).take_while(|t| *t < centre_s).count();
    let part = piece(observations, selection, centre.min(samples - 1), reach.min(samples));
    let (observations, selection) = part.as_ref().map_or((observations, selection), |(o, s)| (o, s));
    let middle_s = 0.5 * observations.ends_s().iter().sum::<f64>();
    let exact = Given::shared(Arc::new(move |time_s| bump(time_s).re), true, false);
    let at: Vec<f64> = theta.iter().copied().chain([0.0; 3]).collect();
    let lin = with_both(model, middle_s, false).with(exact).linearised(&at, observations, selection);
    let time_s: Vec<f64> = observations.stretches.iter().flat_map(|s| s.time_s.iter()).collect();
    let [level, line, exact] = [0, 1, 2].map(|k| &lin.columns[theta.len() + k]);
    let (mut off, mut all) = (0.0, 0.0);
    for (i, sample) in lin.samples.iter().enumerate() {
        let (t, b) = (time_s[sample], bump(time_s[sample]));
        off += (exact[i] - b.re * level[i] - b.eps * (line[i] - (t - middle_s) * level[i])).powi(2);
        all += exact[i] * exact[i];
    }
    off < COLUMN_ERROR * COLUMN_ERROR * all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense;
    use crate::effect::varying;
    use crate::track::fixture::{Fixture, TAU_S};

    const SAMPLES: usize = 3000;
    const SIZE: usize = 9;
    const ENDS_S: [f64; 2] = [0.0, SAMPLES as f64 - 1.0];

    fn fixture() -> Fixture {
        Fixture::of(SAMPLES, |t| 1.0 + 0.2 * (std::f64::consts::TAU * t / 1500.0).sin())
    }

    /// Knots are 300 s apart and the filters reach over time constants, so that columns are off by `2.4 (4/300)²`, 4e-4 of their length
    /// (the root mean square of the second derivative of a B-spline is 2.4 of its own, in distances of knots): products of columns of
    /// unit length by twice that, and the slope by that times the length of the residual where both lie alike. The bound is three times
    /// that. The energy is that of the same residual.
    #[test]
    fn sums_are_those_of_all_columns() {
        let fixture = fixture();
        let tracker = fixture.tracker();
        let smooth = varying::smooth(SIZE, ENDS_S, SAMPLES, 2.0).expect("enough samples");
        let model = fixture.constant.model.with(smooth).with(varying::ratio(ENDS_S));
        let values = (0..SIZE + varying::RATIO_SIZE).map(|k| 0.1 * (1.9 * k as f64).sin());
        let theta: Vec<f64> = TAU_S.into_iter().chain(values).collect();
        let curve = |effect, of_ratio| Curve { effect, ends_s: ENDS_S, of_ratio };
        let got = tracker.local(&model, vec![curve(0, false), curve(1, true)]).normal(&theta);
        let lin = model.linearised(&theta, &tracker.prepared.observations, tracker.selection);
        let want = NormalEquations::of(&lin, lin.residual.len() - prior(&model, &theta).len());
        let tol = 3.0 * 2.4 * (TAU_S[1] / 300.0).powi(2);
        assert!((got.energy / want.energy - 1.0).abs() < 1e-10, "{} and {}", got.energy, want.energy);
        let length = |a: usize| want.products[a][a].sqrt();
        for a in 0..theta.len() {
            let off = (got.slope[a] - want.slope[a]).abs() / (length(a) * want.energy.sqrt());
            assert!(off < tol, "slope {a}: {} and {}", got.slope[a], want.slope[a]);
            for b in 0..theta.len() {
                let off = (got.products[a][b] - want.products[a][b]).abs() / (length(a) * length(b));
                assert!(off < 2.0 * tol, "{a}, {b}: {} and {}", got.products[a][b], want.products[a][b]);
            }
        }
    }

    /// A fit from these columns is one from all columns, to the hundredth of a standard error that they may be off by; and the columns
    /// of knots as close as three time constants are not taken for such.
    #[test]
    fn a_fit_ends_where_the_exact_one_does() {
        let fixture = fixture();
        let tracker = fixture.tracker();
        let (observations, selection) = (&tracker.prepared.observations, tracker.selection);
        let constant = &fixture.constant;
        let is_close = |size: usize| is_close(&constant.model, &constant.theta, observations, selection, ENDS_S, size);
        assert!(is_close(SIZE) && !is_close(250));
        let smooth = varying::smooth(SIZE, ENDS_S, SAMPLES, 2.0).expect("enough samples");
        let model = constant.model.with(smooth);
        let start: Vec<f64> = constant.theta.iter().copied().chain([0.0; SIZE]).collect();
        let got = tracker.local(&model, vec![Curve { effect: 0, ends_s: ENDS_S, of_ratio: false }]).fit(&start);
        let want = model.fit(&start, observations, selection, Effort::Finish);
        let lin = model.linearised(&want.theta, observations, selection);
        let covariance = dense::inverse(&dense::gram(&lin.columns)).expect("determined");
        assert_eq!(got.count, want.count);
        for a in 0..start.len() {
            let off = (got.theta[a] - want.theta[a]).abs() / covariance[a][a].sqrt();
            // Either fit ends within a hundredth of a standard error of its own minimum.
            assert!(off < 3.0 * COLUMN_ERROR, "{a}: {} and {}, {off} standard errors", got.theta[a], want.theta[a]);
        }
        assert!(
            got.chi2 >= want.chi2 * (1.0 - 1e-9)
                && got.chi2 - want.chi2 < (start.len() as f64) * 10.0 * COLUMN_ERROR.powi(2)
        );
    }
}
