//! The published cost: each channel passed through a model of the *other* sensor.
//!
//! `e[k] = (G2 y1)[k] − (G1 y2)[k]`, `J = mean(e²)`: with both models right, both sides are the gas
//! temperature seen through both sensors, and only noise is left. Each synthetic filter starts at
//! steady state on its first sample, which is wrong, so the first `discard` samples do not count.
//! Exact for gas held between samples; noise biases its minimum to long time constants (see the
//! crate `twinlag-bias`).
//!
//! Sensors of first order have a recursion written out by hand, those of second order one whose
//! coefficients come with their derivatives from `twinlag_sensor::Discretisation::second_order`.

use crate::error::CostError;
use crate::parameters::CostValue;
use crate::readings::{Readings, Segment};
use crate::synthetic::{Coefficients, Running};

/// Mean squared cross-relation error of two evenly sampled channels.
#[derive(Clone, Debug)]
pub struct CrossRelation<'a> {
    readings: &'a Readings,
    period_s: f64,
    discard: usize,
    counted: usize,
}

impl<'a> CrossRelation<'a> {
    /// The cost on `readings`, the first `discard` samples of every segment left out of the mean.
    ///
    /// # Errors
    /// [`CostError::UnevenSampling`]; [`CostError::TooShort`] if nothing is left to count.
    pub fn new(readings: &'a Readings, discard: usize) -> Result<Self, CostError> {
        let period_s = readings.even_period_s().ok_or(CostError::UnevenSampling)?;
        let counted = readings.segments().iter().map(|s| s.len().saturating_sub(discard)).sum();
        if counted == 0 {
            return Err(CostError::TooShort { samples: readings.len(), needed: discard + 1 });
        }
        Ok(Self { readings, period_s, discard, counted })
    }

    /// Sample period, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Samples that the mean is taken over.
    pub fn counted(&self) -> usize {
        self.counted
    }

    /// Cost with gradient and exact Hessian at `theta` (the first `P` of [`crate::Parameter::ALL`],
    /// `P` 2, 4 or 6).
    ///
    /// `J = mean(e², k ≥ discard)`, `e = G2(τ2, τ₂2) y1 − G1(τ1, τ₂1) (y2 − o)/g`, in the square of
    /// the channels' unit. A second time constant of 0 is a sensor of first order, and the
    /// derivatives with respect to it are 0.
    ///
    /// ```
    #[doc = include_str!("example.txt")]
    /// // Channel 2 through an amplifier of gain 1.1 that adds 3 K.
    /// let amplified: Vec<f64> = y2.iter().map(|y| 1.1 * y + 3.0).collect();
    /// let readings = Readings::even(&y1, &amplified, 0.002)?;
    /// let cost = CrossRelation::new(&readings, 1200)?;
    ///
    /// // The offset is stated at the level that was taken off, where the gain adds to it.
    /// let truth = [0.0238, 0.1168, 1.1, 3.0 + 0.1 * readings.level()];
    /// // The start of the filters has fallen to e⁻²⁰ of the swing after 1200 samples, ten of the
    /// // slower time constants.
    /// assert!(cost.evaluate(&truth).value < 1e-12);
    /// assert!(cost.evaluate(&[0.0238, 0.1168, 1.0, 0.0]).value > 1.0); // K²
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Source
    /// Hung, McLoone, Irwin, Kee, *Blind two-thermocouple sensor characterisation*, 2007 (abstract
    /// seen); Gillespie, Hung, Kee, McLoone 2016 (abstract seen), for `g = 1`, `o = 0` and first
    /// order. Second order: after the title of Gillespie and others 2015, which was all that was
    /// seen of it; own derivation.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let (value, gradient, hessian) =
            if is_first_order(theta) { self.first_order_sums(theta) } else { self.second_order_sums(theta) };
        let mean = 1.0 / self.counted as f64;
        CostValue {
            value: value * mean,
            gradient: gradient.map(|g| 2.0 * mean * g),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * mean * hessian[i.min(j)][i.max(j)])),
        }
    }

    /// The error signal `e` at `theta` and its derivatives `[∂e/∂θ_i]`, one entry for each counted
    /// sample.
    pub fn error_signal<const P: usize>(&self, theta: &[f64; P]) -> Vec<(f64, [f64; P])> {
        let mut out = Vec::with_capacity(self.counted);
        if is_first_order(theta) {
            let chain = self.for_each(theta, |e, de, _| out.push((e, de)));
            for (_, de) in &mut out {
                for (slope, pole) in de.iter_mut().zip(&chain.poles) {
                    *slope *= pole.da;
                }
            }
        } else {
            self.for_each_of_second_order(theta, |e, de, _| out.push((e, std::array::from_fn(|i| de[i]))));
        }
        out
    }

    /// `Σ e²`, half its gradient and half its Hessian (upper triangle), for sensors of first order.
    fn first_order_sums<const P: usize>(&self, theta: &[f64; P]) -> (f64, [f64; P], [[f64; P]; P]) {
        let mut value = 0.0;
        let mut gradient = [0.0; P];
        let mut hessian = [[0.0; P]; P];
        let mut bend = [0.0; 2];
        let chain = if P == 2 {
            let poles = [0, 1].map(|i| Pole::of(theta[i], self.period_s));
            let sums = self.sums_by_poles(poles.map(|p| p.a));
            value = sums.square;
            bend = [-sums.bend[0], sums.bend[1]];
            (gradient[0], gradient[1]) = (-sums.slope[0], sums.slope[1]);
            (hessian[0][0], hessian[0][1], hessian[1][1]) = (sums.normal[0], -sums.cross, sums.normal[1]);
            Chain { poles, gain: 1.0 }
        } else {
            self.for_each(theta, |e, de, dde| {
                value += e * e;
                for i in 0..P {
                    gradient[i] += e * de[i];
                    for j in i..P {
                        hessian[i][j] += de[i] * de[j];
                    }
                }
                for i in 0..2 {
                    bend[i] += e * dde[i];
                }
            })
        };
        // Σ e ∂²e. All derivatives so far are by the poles; the products with gain and offset
        // follow from the gradient.
        for i in 0..2 {
            hessian[i][i] += 2.0 * bend[i];
        }
        if P >= 4 {
            hessian[0][2] -= gradient[0] / chain.gain;
            hessian[2][2] -= 2.0 * gradient[2] / chain.gain;
            hessian[2][3] -= gradient[3] / chain.gain;
        }
        // By the time constants: dp/dτ and d²p/dτ².
        for (i, pole) in chain.poles.iter().enumerate() {
            hessian[i][i] = hessian[i][i] * pole.da * pole.da + gradient[i] * pole.dda;
            gradient[i] *= pole.da;
            for j in 0..P {
                if j != i {
                    hessian[i.min(j)][i.max(j)] *= pole.da;
                }
            }
        }
        (value, gradient, hessian)
    }

    /// The sums that a fit of two time constants needs.
    fn sums_by_poles(&self, poles: [f64; 2]) -> Sums {
        let mut sums = Sums::default();
        self.run(poles, |Filters { input, behind, dw, half_ddw }| {
            let e = (input[1] - input[0]) + (behind[1] - behind[0]);
            sums.square += e * e;
            sums.cross += dw[0] * dw[1];
            for i in 0..2 {
                sums.slope[i] += e * dw[i];
                sums.normal[i] += dw[i] * dw[i];
                sums.bend[i] += e * half_ddw[i];
            }
        });
        sums
    }

    /// Calls `visit` with each counted error, its derivatives by both poles, gain and offset (and
    /// zeros), and *half* its second derivatives by the poles. Returns what takes derivatives by
    /// poles to derivatives by time constants.
    #[inline]
    fn for_each<const P: usize>(&self, theta: &[f64; P], mut visit: impl FnMut(f64, [f64; P], [f64; 2])) -> Chain {
        const { assert!(P == 2 || P == 4 || P == 6, "two time constants, with gain and offset, with second lags") };
        let (gain, offset) = if P >= 4 { (theta[2], theta[3]) } else { (1.0, 0.0) };
        let share = 1.0 / gain;
        let poles = [0, 1].map(|i| Pole::of(theta[i], self.period_s));
        self.run(poles.map(|p| p.a), |filters| {
            let [w1, w2] = filters.outputs();
            let inferred = (w1 - offset) * share;
            let all = [-filters.dw[0] * share, filters.dw[1], inferred * share, share, 0.0, 0.0];
            let bend = [-filters.half_ddw[0] * share, filters.half_ddw[1]];
            visit(w2 - inferred, std::array::from_fn(|i| all[i]), bend);
        });
        Chain { poles, gain }
    }

    /// Runs both filters of first order over every segment and shows them to `see` at each sample
    /// that counts.
    #[inline]
    fn run(&self, poles: [f64; 2], mut see: impl FnMut(&Filters)) {
        for segment in self.counted_segments() {
            // Two loops, so that neither asks at each sample whether it counts.
            let ([before1, counted1], [before2, counted2]) = (self.cut(segment.y1()), self.cut(segment.y2()));
            let mut filters = Filters::at_rest([segment.y2()[0], segment.y1()[0]]);
            for (&y1, &y2) in before1.iter().zip(before2) {
                filters.step(poles, [y2, y1]);
            }
            for (&y1, &y2) in counted1.iter().zip(counted2) {
                see(&filters);
                filters.step(poles, [y2, y1]);
            }
            see(&filters);
        }
    }

    /// What follows the first sample of a channel: up to the first sample that counts, and beyond
    /// it.
    fn cut<'s>(&self, channel: &'s [f64]) -> [&'s [f64]; 2] {
        let (before, counted) = channel[1..].split_at(self.discard);
        [before, counted]
    }

    /// Segments of which a sample counts.
    fn counted_segments(&self) -> impl Iterator<Item = &Segment> {
        self.readings.segments().iter().filter(|s| s.len() > self.discard)
    }

    /// `Σ e²`, half its gradient and half its Hessian (upper triangle), for sensors of second
    /// order.
    fn second_order_sums<const P: usize>(&self, theta: &[f64; P]) -> (f64, [f64; P], [[f64; P]; P]) {
        let mut value = 0.0;
        let mut gradient = [0.0; P];
        let mut hessian = [[0.0; P]; P];
        self.for_each_of_second_order(theta, |e, de, dde| {
            value += e * e;
            for i in 0..P {
                gradient[i] += e * de[i];
                for j in i..P {
                    hessian[i][j] += de[i] * de[j] + e * dde[i][j];
                }
            }
        });
        (value, gradient, hessian)
    }

    /// Calls `visit` with each counted error, its gradient by all six parameters, and its Hessian
    /// (upper triangle).
    fn for_each_of_second_order(&self, theta: &[f64], mut visit: impl FnMut(f64, [f64; 6], &[[f64; 6]; 6])) {
        let (gain, offset) = (theta[2], theta[3]);
        let share = 1.0 / gain;
        let [model1, model2] = [0, 1].map(|i| Coefficients::of(theta[i], theta[4 + i], self.period_s));
        for segment in self.counted_segments() {
            // Channel 1 goes through the model of sensor 2, and the other way round.
            let mut through2 = Running::at_rest(segment.y1()[0]);
            let mut through1 = Running::at_rest(segment.y2()[0]);
            for (k, (&y1, &y2)) in segment.y1().iter().zip(segment.y2()).enumerate() {
                if k >= self.discard {
                    let inferred = (through1.now[0] - offset) * share;
                    let by1 = through1.now.map(|w| -w * share);
                    let by2 = &through2.now;
                    let mut bend = [[0.0; 6]; 6];
                    (bend[0][0], bend[0][4], bend[4][4]) = (by1[3], by1[4], by1[5]);
                    (bend[1][1], bend[1][5], bend[5][5]) = (by2[3], by2[4], by2[5]);
                    (bend[0][2], bend[2][4]) = (-by1[1] * share, -by1[2] * share);
                    (bend[2][2], bend[2][3]) = (-2.0 * inferred * share * share, -share * share);
                    visit(through2.now[0] - inferred, [by1[1], by2[1], inferred * share, share, by1[2], by2[2]], &bend);
                }
                through2.step(&model2, y1);
                through1.step(&model1, y2);
            }
        }
    }
}

fn is_first_order(theta: &[f64]) -> bool {
    !theta.iter().skip(4).any(|second| *second > 0.0)
}

/// Sums over the counted samples with the derivatives `dw` by each filter's own pole:
/// `∂e/∂a = −dw[0]`, `∂e/∂c = dw[1]`.
#[derive(Default)]
struct Sums {
    square: f64,
    cross: f64,
    slope: [f64; 2],
    normal: [f64; 2],
    /// With half the second derivatives.
    bend: [f64; 2],
}

/// What takes derivatives by poles to derivatives by time constants.
struct Chain {
    poles: [Pole; 2],
    gain: f64,
}

/// A pole with its derivatives with respect to the time constant.
#[derive(Clone, Copy)]
struct Pole {
    a: f64,
    da: f64,
    dda: f64,
}

impl Pole {
    fn of(tau_s: f64, period_s: f64) -> Self {
        let a = (-period_s / tau_s).exp();
        let da = a * period_s / (tau_s * tau_s);
        Self { a, da, dda: da * (period_s / tau_s - 2.0) / tau_s }
    }
}

/// Both synthetic filters of first order, `w[k] = a w[k−1] + (1 − a) y[k−1]`, with derivatives by
/// their poles: that of sensor 1 on channel 2, then that of sensor 2 on channel 1. Pairs, so that
/// one instruction steps both.
struct Filters {
    /// `y[k]`.
    input: [f64; 2],
    /// `w[k] − y[k]`, which obeys `a (w[k−1] − y[k−1]) − (y[k] − y[k−1])` and feeds the derivative
    /// as it is.
    behind: [f64; 2],
    dw: [f64; 2],
    half_ddw: [f64; 2],
}

impl Filters {
    fn at_rest(input: [f64; 2]) -> Self {
        Self { input, behind: [0.0; 2], dw: [0.0; 2], half_ddw: [0.0; 2] }
    }

    #[inline]
    fn outputs(&self) -> [f64; 2] {
        [self.input[0] + self.behind[0], self.input[1] + self.behind[1]]
    }

    #[inline]
    fn step(&mut self, poles: [f64; 2], y: [f64; 2]) {
        // Each new value waits for one product and one sum of its own past; the rest is ready
        // before.
        for i in 0..2 {
            self.half_ddw[i] = poles[i] * self.half_ddw[i] + self.dw[i];
            self.dw[i] = poles[i] * self.dw[i] + self.behind[i];
            self.behind[i] = poles[i] * self.behind[i] - (y[i] - self.input[i]);
        }
        self.input = y;
    }
}
