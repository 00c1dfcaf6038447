//! The gas temperature as readings come in: constant memory and work, nothing allocated.

use nalgebra::{SMatrix, SVector};

use crate::filter::Belief;
use crate::prior::Term;
use crate::rig::Rig;
use crate::system::{Step, System};

/// Change of the covariance, relative to its largest entry, below which it has settled.
const SETTLED_RELATIVE: f64 = 1e-15;

/// The gas temperature at an instant, from the readings up to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filtered {
    /// The gas temperature, °C.
    pub gas_c: f64,
    /// Variance of the gas temperature, K².
    pub variance_k2: f64,
    /// Normalised innovation squared: the sum of squared differences between the readings and their
    /// predictions from earlier ones, over their variances. If the rig has not changed, it is
    /// chi-square with one degree of freedom for each reading.
    pub normalised_innovation_squared: f64,
    /// The product of the innovation variances, K² each: `−2 ln` of the likelihood of the readings
    /// is `normalised_innovation_squared + ln innovation_variance` and a constant.
    pub innovation_variance: f64,
}

/// A causal filter for two sensors that are read every `period_s`: push readings, read the gas
/// temperature.
///
/// It uses the recursion of [`crate::Form::Filter`]. The covariance settles within the memory of
/// the slowest part of prior and sensors. From then on the gains are constant, and a sample costs
/// about `2 D²` multiplications, until a missing reading starts the recursion again. `D` is the
/// number of states, at least [`Stream::states`]; the smallest that suffices is the fastest.
///
/// ```
/// use twinlag_compensate::{Rig, Sensor, Stream, Term};
///
/// let rig = Rig::new([Sensor::new(0.024, 0.2), Sensor::new(0.117, 0.2)]);
/// let gas = [Term::Rough { std_k: 15.0, corner_hz: 3.0 }];
/// let mut stream = Stream::<4>::new(&rig, 300.0, &gas, 0.002).expect("four states are enough");
/// for reading_c in [300.0, 301.0, 303.0] {
///     let now = stream.push([Some(reading_c), None]);
///     assert!(now.gas_c >= 300.0 && now.variance_k2 > 0.0);
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Stream<const D: usize> {
    system: System<D>,
    step: Step<D>,
    level_c: f64,
    noise_k2: [f64; 2],
    pub(crate) belief: Belief<D>,
    pub(crate) is_first: bool,
    pub(crate) settled: Option<Settled<D>>,
}

/// Gains that no longer change.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settled<const D: usize> {
    /// The gain of each reading, and one over the variance of its innovation.
    pub(crate) gains: [(SVector<f64, D>, f64); 2],
    pub(crate) variance_k2: f64,
    pub(crate) innovation_variance: f64,
}

impl<const D: usize> Stream<D> {
    /// States that `rig` in gas of `terms` needs.
    pub fn states(rig: &Rig, terms: &[Term]) -> usize {
        crate::system::states(rig, terms)
    }

    /// A filter for sensors that are read every `period_s`, in gas that moves about `level_c` as
    /// `terms` do; `None` where `D` states are too few, or where one channel is later than the
    /// other, which a stream cannot undo.
    pub fn new(rig: &Rig, level_c: f64, terms: &[Term], period_s: f64) -> Option<Self> {
        if Self::states(rig, terms) > D || rig.delay_s != 0.0 {
            return None;
        }
        let system = System::<D>::new(rig, terms);
        let step = system.step(period_s, None);
        let belief = Belief { state: system.start(), covariance: system.before };
        let noise_k2 = [0, 1].map(|i| rig.sensors[i].noise_std_k * rig.sensors[i].noise_std_k);
        Some(Self { system, step, level_c, noise_k2, belief, is_first: true, settled: None })
    }

    /// The gas temperature once the next readings, °C, are known; `None` for one that is missing.
    pub fn push(&mut self, reading_c: [Option<f64>; 2]) -> Filtered {
        if let (Some(settled), [Some(y1), Some(y2)]) = (self.settled, reading_c) {
            self.belief.state = self.step.transition * self.belief.state;
            let mut normalised_innovation_squared = 0.0;
            for ((reads, (gain, weight)), y) in self.system.reads.iter().zip(&settled.gains).zip([y1, y2]) {
                let innovation = y - self.level_c - reads.dot(&self.belief.state);
                self.belief.state += gain * innovation;
                normalised_innovation_squared += innovation * innovation * weight;
            }
            let Settled { variance_k2, innovation_variance, .. } = settled;
            return Filtered { gas_c: self.gas_c(), variance_k2, normalised_innovation_squared, innovation_variance };
        }
        self.settled = None;
        let before = self.belief.covariance;
        if !core::mem::take(&mut self.is_first) {
            self.belief.predict(&self.step);
        }
        let mut gains = [(SVector::zeros(), 0.0); 2];
        let (mut normalised_innovation_squared, mut innovation_variance) = (0.0, 1.0);
        for i in 0..2 {
            if let Some(y) = reading_c[i] {
                let update = self.belief.update(&self.system.reads[i], y - self.level_c, self.noise_k2[i]);
                gains[i] = (update.gain, 1.0 / update.variance);
                normalised_innovation_squared += update.innovation * update.innovation / update.variance;
                innovation_variance *= update.variance;
            }
        }
        let variance_k2 = self.system.gas.dot(&(self.belief.covariance * self.system.gas));
        if reading_c.iter().all(Option::is_some) && has_settled(&before, &self.belief.covariance) {
            self.settled = Some(Settled { gains, variance_k2, innovation_variance });
        }
        Filtered { gas_c: self.gas_c(), variance_k2, normalised_innovation_squared, innovation_variance }
    }

    /// Goes through so many samples without readings, as that many calls of [`Self::push`] without any would; the work grows as the
    /// logarithm of their number.
    pub fn skip(&mut self, samples: u64) {
        if samples == 0 {
            return;
        }
        self.settled = None;
        let mut left = if core::mem::take(&mut self.is_first) { samples - 1 } else { samples };
        let mut step = self.step;
        while left > 0 {
            if left & 1 == 1 {
                self.belief.predict(&step);
            }
            step = step.twice();
            left >>= 1;
        }
    }

    /// Whether its gains no longer change.
    pub fn is_settled(&self) -> bool {
        self.settled.is_some()
    }

    fn gas_c(&self) -> f64 {
        self.level_c + self.system.gas.dot(&self.belief.state)
    }
}

fn has_settled<const D: usize>(before: &SMatrix<f64, D, D>, now: &SMatrix<f64, D, D>) -> bool {
    let largest = now.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    before.iter().zip(now).all(|(a, b)| (a - b).abs() <= SETTLED_RELATIVE * largest)
}
