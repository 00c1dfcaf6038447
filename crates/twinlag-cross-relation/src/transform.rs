//! Sine transforms of a segment, and what depends on its length alone.
//!
//! The sine transform of type I of a channel and of the channel one sample later both follow from
//! *one* Fourier transform of the channel padded with as many zeros: with `N` samples,
//! `w_j = π j/N` and `Y_j = Σ_m y[m] e^(−i w_j m)`,
//!
//! ```text
//! Σ_k y[k+1] sin(w_j (k+1)) = −Im Y_j            k = 0 … N−2
//! Σ_k y[k]   sin(w_j (k+1)) = −cos w_j Im Y_j + sin w_j Re Y_j
//! ```
//!
//! the last since `sin(w_j N) = 0`. Two real transforms serve both channels.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use twinlag_transform::{Complex64, Forward};

use crate::bands::Bands;
use crate::readings::{Segment, Steps};

/// Lengths whose plans are kept by each thread.
const PLANS_KEPT: usize = 4;

/// What the transforms of all segments of one length share.
pub(crate) struct Plan {
    samples: usize,
    fourier: Forward,
    /// `cos w_j`, `j = 1 … N−1`.
    pub(crate) cosines: Vec<f64>,
    sines: Vec<f64>,
    /// The transform of ones.
    ones: OnceLock<Vec<f64>>,
    /// How bins are gathered into bands.
    bands: OnceLock<Arc<Bands>>,
}

impl std::fmt::Debug for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Plan({} samples)", self.samples)
    }
}

impl Plan {
    /// The plan for `samples`, from this thread's store where it is kept.
    pub(crate) fn of(samples: usize) -> Arc<Self> {
        thread_local! {
            static STORE: RefCell<Vec<Arc<Plan>>> = const { RefCell::new(Vec::new()) };
        }
        STORE.with_borrow_mut(|kept| {
            if let Some(place) = kept.iter().position(|p| p.samples == samples) {
                kept[..=place].rotate_right(1);
            } else {
                kept.truncate(PLANS_KEPT - 1);
                kept.insert(0, Arc::new(Self::new(samples)));
            }
            kept[0].clone()
        })
    }

    fn new(samples: usize) -> Self {
        let angles = (1..samples).map(|j| std::f64::consts::PI * j as f64 / samples as f64);
        let (sines, cosines) = angles.map(f64::sin_cos).unzip();
        let fourier = Forward::of(2 * samples);
        Self { samples, fourier, cosines, sines, ones: OnceLock::new(), bands: OnceLock::new() }
    }

    /// How the bins are gathered into bands.
    pub(crate) fn bands(&self) -> &Arc<Bands> {
        self.bands.get_or_init(|| Arc::new(Bands::new(&self.cosines)))
    }

    fn scale(&self) -> f64 {
        (2.0 / self.samples as f64).sqrt()
    }

    /// `√(2/N) Σ_k sin(w_j (k + 1))`: `cot(w_j/2)` for odd `j`, nothing for even.
    pub(crate) fn ones(&self) -> &[f64] {
        self.ones.get_or_init(|| {
            let bin = |j: usize| {
                if j.is_multiple_of(2) {
                    0.0
                } else {
                    (0.5 * std::f64::consts::PI * j as f64 / self.samples as f64).tan().recip()
                }
            };
            (1..self.samples).map(|j| self.scale() * bin(j)).collect()
        })
    }
}

/// One evenly sampled segment, transformed: `T_i` channel `i` without its last sample, `S_i`
/// without its first.
#[derive(Clone, Debug)]
pub(crate) struct Transformed {
    pub(crate) period_s: f64,
    pub(crate) plan: Arc<Plan>,
    /// `T1 − T2`.
    pub(crate) difference: Vec<f64>,
    /// `S1 − T1` and `S2 − T2`: what changes from sample to sample.
    pub(crate) change: [Vec<f64>; 2],
    /// `T2`.
    pub(crate) second: Vec<f64>,
}

impl Transformed {
    /// All `segments`, in order; `None` if one is unevenly sampled. Those of one length share a plan, however many
    /// lengths there are.
    pub(crate) fn all(segments: &[Segment]) -> Option<Vec<Self>> {
        let mut plans: HashMap<usize, Arc<Plan>> = HashMap::new();
        let each = segments.iter().map(|segment| {
            let Steps::Even(period_s) = *segment.steps() else { return None };
            let plan = plans.entry(segment.len()).or_insert_with(|| Plan::of(segment.len()));
            Some(Self::with_plan(plan.clone(), segment.y1(), segment.y2(), period_s))
        });
        each.collect()
    }

    /// Readings `y1`, `y2` `[n]`, `period_s` between samples.
    pub(crate) fn of(y1: &[f64], y2: &[f64], period_s: f64) -> Self {
        Self::with_plan(Plan::of(y1.len()), y1, y2, period_s)
    }

    fn with_plan(plan: Arc<Plan>, y1: &[f64], y2: &[f64], period_s: f64) -> Self {
        let mut padded = vec![0.0; plan.fourier.samples()];
        let mut spectrum = vec![Complex64::ZERO; plan.fourier.bins()];
        let mut scratch = Vec::new();
        let mut transform = |y: &[f64]| {
            padded[..y.len()].copy_from_slice(y);
            padded[y.len()..].fill(0.0);
            plan.fourier.transform_into(&mut padded, &mut spectrum, &mut scratch);
            let scale = plan.scale();
            let both = |(y, (cosine, sine)): (&Complex64, (&f64, &f64))| {
                let without_last = scale * (sine * y.re - cosine * y.im);
                (without_last, -scale * y.im - without_last)
            };
            spectrum[1..].iter().zip(plan.cosines.iter().zip(&plan.sines)).map(both).unzip()
        };
        let (first, change1): (Vec<f64>, Vec<f64>) = transform(y1);
        let (second, change2): (Vec<f64>, Vec<f64>) = transform(y2);
        let difference = first.iter().zip(&second).map(|(a, b)| a - b).collect();
        Self { period_s, plan, difference, change: [change1, change2], second }
    }

    /// Bins of this segment.
    pub(crate) fn len(&self) -> usize {
        self.difference.len()
    }

    /// What `u` is made of in each bin: three series at unity gain, five with gain and offset.
    pub(crate) fn parts(&self) -> [&[f64]; 5] {
        [&self.difference, &self.change[0], &self.change[1], &self.second, self.plan.ones()]
    }
}
