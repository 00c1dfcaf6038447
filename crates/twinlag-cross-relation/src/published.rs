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
    /// Hung, McLoone, Irwin, Kee; Gillespie, Hung, Kee, McLoone 2016 (abstract seen), for `g = 1`, `o = 0`.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let mut value = 0.0;
        let mut gradient = [0.0; P];
        let mut hessian = [[0.0; P]; P];
        self.for_each(theta, |error| {
            value += error.value * error.value;
            for i in 0..P {
                gradient[i] += error.value * error.gradient[i];
                for j in i..P {
                    hessian[i][j] += error.gradient[i] * error.gradient[j] + error.value * error.hessian[i][j];
                }
            }
        });
        let mean = 1.0 / self.counted as f64;
        for i in 0..P {
            gradient[i] *= 2.0 * mean;
            for j in i..P {
                hessian[i][j] *= 2.0 * mean;
                hessian[j][i] = hessian[i][j];
            }
        }
        CostValue { value: value * mean, gradient, hessian }
    }

    /// The error signal `e` at `theta` and its derivatives `[∂e/∂θ_i]`, one entry for each counted sample.
    pub fn error_signal<const P: usize>(&self, theta: &[f64; P]) -> Vec<(f64, [f64; P])> {
        let mut out = Vec::with_capacity(self.counted);
        self.for_each(theta, |error| out.push((error.value, error.gradient)));
        out
    }

    fn for_each<const P: usize>(&self, theta: &[f64; P], mut visit: impl FnMut(CostValue<P>)) {
        const { assert!(P == 2 || P == 4, "two time constants, or these with gain and offset") };
        let (gain, offset) = if P == 4 { (theta[2], theta[3]) } else { (1.0, 0.0) };
        let [first, second] = [0, 1].map(|i| Pole::of(theta[i], self.period_s));
        for segment in self.readings.segments() {
            // Channel 1 goes through the model of sensor 2, and the other way round.
            let mut through2 = Filtered::at_rest(segment.y1()[0]);
            let mut through1 = Filtered::at_rest(segment.y2()[0]);
            for (k, (&y1, &y2)) in segment.y1().iter().zip(segment.y2()).enumerate() {
                if k >= self.discard {
                    visit(error_at(&through1, &through2, &first, &second, gain, offset));
                }
                through2.step(&second, y1);
                through1.step(&first, y2);
            }
        }
    }
}

fn error_at<const P: usize>(
    through1: &Filtered,
    through2: &Filtered,
    first: &Pole,
    second: &Pole,
    gain: f64,
    offset: f64,
) -> CostValue<P> {
    let centred = (through1.w - offset) / gain;
    let d_tau1 = through1.dw * first.da / gain;
    let all_gradient = [-d_tau1, through2.dw * second.da, centred / gain, 1.0 / gain];
    let mut all_hessian = [[0.0; 4]; 4];
    all_hessian[0][0] = -(through1.ddw * first.da * first.da + through1.dw * first.dda) / gain;
    all_hessian[1][1] = through2.ddw * second.da * second.da + through2.dw * second.dda;
    all_hessian[0][2] = d_tau1 / gain;
    all_hessian[2][2] = -2.0 * centred / (gain * gain);
    all_hessian[2][3] = -1.0 / (gain * gain);
    CostValue {
        value: through2.w - centred,
        gradient: std::array::from_fn(|i| all_gradient[i]),
        hessian: std::array::from_fn(|i| std::array::from_fn(|j| all_hessian[i.min(j)][i.max(j)])),
    }
}

/// A pole with its derivatives with respect to the time constant.
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
        self.ddw = pole.a * self.ddw + 2.0 * self.dw;
        self.dw = pole.a * self.dw + (self.w - y);
        self.w = pole.a * (self.w - y) + y;
    }
}
