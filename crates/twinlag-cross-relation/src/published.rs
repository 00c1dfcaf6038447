//! The published cost: each channel passed through a model of the *other* sensor.
//!
//! `e[k] = (G2 y1)[k] − (G1 y2)[k]`, `J = mean(e²)`: with both models right, both sides are the gas temperature seen through
//! both sensors, and only noise is left. Each synthetic filter starts at steady state on its first sample, which is wrong,
//! so the first `discard` samples do not count. Exact for gas held between samples; noise biases its minimum to long time
//! constants (see the crate `twinlag-bias`).

use crate::error::CostError;
use crate::parameters::CostValue;
use crate::readings::Readings;

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

    /// Cost with gradient and exact Hessian at `theta` (the first `P` of [`crate::Parameter::ALL`], `P` 2 or 4).
    ///
    /// `J = mean(e², k ≥ discard)`, `e = G2(τ2) y1 − G1(τ1) (y2 − o)/g`, in the square of the channels' unit.
    ///
    /// # Source
    /// Hung, McLoone, Irwin, Kee, *Blind two-thermocouple sensor characterisation*, 2007 (abstract seen); Gillespie, Hung, Kee, McLoone 2016 (abstract seen), for `g = 1`, `o = 0`.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let mut value = 0.0;
        let mut gradient = [0.0; P];
        let mut square = [[0.0; P]; P];
        let mut bend = Bend::default();
        let chain = self.for_each(theta, |e, de, dde| {
            value += e * e;
            for i in 0..P {
                gradient[i] += e * de[i];
                for j in i..P {
                    square[i][j] += de[i] * de[j];
                }
            }
            bend.first += e * dde.first;
            bend.second += e * dde.second;
        });
        // Σ e ∂²e. All derivatives so far are by the poles; the products with gain and offset follow from the gradient.
        let mut hessian = square;
        hessian[0][0] += bend.first;
        hessian[1][1] += bend.second;
        if P == 4 {
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
        let mean = 1.0 / self.counted as f64;
        CostValue {
            value: value * mean,
            gradient: gradient.map(|g| 2.0 * mean * g),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * mean * hessian[i.min(j)][i.max(j)])),
        }
    }

    /// The error signal `e` at `theta` and its derivatives `[∂e/∂θ_i]`, one entry for each counted sample.
    pub fn error_signal<const P: usize>(&self, theta: &[f64; P]) -> Vec<(f64, [f64; P])> {
        let mut out = Vec::with_capacity(self.counted);
        let chain = self.for_each(theta, |e, de, _| out.push((e, de)));
        for (_, de) in &mut out {
            for (slope, pole) in de.iter_mut().zip(&chain.poles) {
                *slope *= pole.da;
            }
        }
        out
    }

    /// Calls `visit` with each counted error, its derivatives by both poles, gain and offset, and its second derivatives by
    /// the poles. Returns what takes derivatives by poles to derivatives by time constants.
    fn for_each<const P: usize>(&self, theta: &[f64; P], mut visit: impl FnMut(f64, [f64; P], Bend)) -> Chain {
        const { assert!(P == 2 || P == 4, "two time constants, or these with gain and offset") };
        let (gain, offset) = if P == 4 { (theta[2], theta[3]) } else { (1.0, 0.0) };
        let share = 1.0 / gain;
        let poles @ [first, second] = [0, 1].map(|i| Pole::of(theta[i], self.period_s));
        for segment in self.readings.segments() {
            // Channel 1 goes through the model of sensor 2, and the other way round.
            let mut through2 = Filtered::at_rest(segment.y1()[0]);
            let mut through1 = Filtered::at_rest(segment.y2()[0]);
            for (k, (&y1, &y2)) in segment.y1().iter().zip(segment.y2()).enumerate() {
                if k >= self.discard {
                    let inferred = (through1.w - offset) * share;
                    let all = [-through1.dw * share, through2.dw, inferred * share, share];
                    let bend = Bend { first: -through1.ddw * share, second: through2.ddw };
                    visit(through2.w - inferred, std::array::from_fn(|i| all[i]), bend);
                }
                through2.step(&second, y1);
                through1.step(&first, y2);
            }
        }
        Chain { poles, gain }
    }
}

/// Second derivatives of the error by the two poles.
#[derive(Clone, Copy, Default)]
struct Bend {
    first: f64,
    second: f64,
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
    b: f64,
    da: f64,
    dda: f64,
}

impl Pole {
    fn of(tau_s: f64, period_s: f64) -> Self {
        let a = (-period_s / tau_s).exp();
        let b = -(-period_s / tau_s).exp_m1();
        let da = a * period_s / (tau_s * tau_s);
        Self { a, b, da, dda: da * (period_s / tau_s - 2.0) / tau_s }
    }
}

/// `w[k] = a w[k−1] + (1 − a) y[k−1]` and its first two derivatives with respect to `a`.
struct Filtered {
    w: f64,
    dw: f64,
    ddw: f64,
}

impl Filtered {
    fn at_rest(y: f64) -> Self {
        Self { w: y, dw: 0.0, ddw: 0.0 }
    }

    #[inline]
    fn step(&mut self, pole: &Pole, y: f64) {
        // Each new value waits for one product and one sum of its own past; the rest is ready before.
        self.ddw = pole.a * self.ddw + 2.0 * self.dw;
        self.dw = pole.a * self.dw + (self.w - y);
        self.w = pole.a * self.w + pole.b * y;
    }
}
