//! What the gas does between samples, which no sample shows: the fit with the other hold beside the
//! one that was made.

use twinlag_cross_relation::{Readings, Segment, Steps};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::fitting::polish;
use crate::task::Task;
use crate::whitened::WhitenedFit;

/// How far steps may be from their mean, rms, as a fraction of it, to be taken for even ones in a comparison of two holds; chosen: clocks of
/// programs jitter by some per cent, and a record that lost every other sample is at 0.5.
const MAX_JITTER: f64 = 0.25;

impl<const P: usize> WhitenedFit<'_, P> {
    /// The hold to compare with: a straight line between samples, or none where that is the one there is. Between samples that are not
    /// even the bilinear rule stands for the straight line: like this it undoes the `(Ts/τ)²/12` by which a zero-order hold takes the time
    /// constants of a smooth gas for shorter (the theory chapter of the book, on the bilinear rule).
    pub fn other_hold(&self) -> Discretisation {
        match (self.task.hold, self.readings().even_period_s()) {
            (Discretisation::FirstOrderHold, Some(_)) => Discretisation::ZeroOrderHold,
            (_, Some(_)) => Discretisation::FirstOrderHold,
            (Discretisation::ZeroOrderHold, None) => Discretisation::Bilinear,
            (_, None) => Discretisation::ZeroOrderHold,
        }
    }

    /// How much straight lines between samples in place of the zero-order hold would move both time constants of a record whose samples are
    /// nearly even, relative. Straight lines take even samples: the same readings are fitted with either hold as though they were even, so
    /// that what is wrong with that is in both. `None` of even records and more uneven ones, and where a fit does not end.
    ///
    /// # Errors
    /// Those of [`WhitenedFit::find`].
    pub fn moved_by_straight_lines(&self) -> Result<Option<[f64; 2]>, EstimateError> {
        let readings = self.readings();
        let period_s = readings.mean_step_s();
        let mut squares = Vec::new();
        for segment in readings.segments() {
            let Steps::Uneven(steps_s) = segment.steps() else { return Ok(None) };
            squares.extend(steps_s.iter().map(|step_s| (step_s / period_s - 1.0).powi(2)));
        }
        let jitter = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        if self.task.hold != Discretisation::ZeroOrderHold || jitter > MAX_JITTER {
            return Ok(None);
        }
        let even =
            |segment: &Segment| Segment::new(segment.y1().to_vec(), segment.y2().to_vec(), Steps::Even(period_s));
        let segments = readings.segments().iter().map(even).collect::<Result<_, _>>()?;
        let readings = Readings::new(segments)?;
        let theta = self.theta();
        let task = Task { readings: &readings, starts_s: vec![[theta[0], theta[1]]], ..self.task.clone() };
        let held = WhitenedFit::<P>::find(&task)?;
        let straight = held.with_hold(Discretisation::FirstOrderHold)?;
        let end = held.fit.end.is_usable() && straight.fit.end.is_usable();
        Ok(end.then(|| [0, 1].map(|i| straight.theta()[i] / held.theta()[i] - 1.0)))
    }

    /// This fit with `hold`, at noise of one size, from where it ended: close to where it will end.
    ///
    /// # Errors
    /// [`EstimateError::Cost`] for a hold that the record's sampling does not take.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{Task, WhitenedFit};
    ///
    /// let task = Task::new(&readings);
    /// let fit = WhitenedFit::<2>::find(&task)?;
    /// let other = fit.with_hold(fit.other_hold())?;
    /// // The gas of this record moves little between samples, which do not show what it does there.
    /// assert!((0.1..0.9).contains(&other.probability_beside(&fit)));
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn with_hold(&self, hold: Discretisation) -> Result<Self, EstimateError> {
        let mut ended = self.minimise_again(hold, self.whitened.noise_std(), Some(&self.fit.x))?;
        polish::<P>(&ended.whitened, &self.priors, &self.variables, &mut ended.fit);
        Ok(Self {
            task: Task { hold, ..self.task.clone() },
            whitened: ended.whitened,
            levels: self.levels,
            variables: self.variables.clone(),
            priors: self.priors.clone(),
            fit: ended.fit,
            starts: self.starts,
            evaluations: ended.evaluations,
            unseen: self.unseen,
        })
    }

    /// Probability that the hold of this fit is the right one and not that of `other`, a fit at the same noise:
    /// `1/(1 + exp(½ (χ² − χ²_other)/e))`, with `e` the energy per degree of freedom that the fit of `other` leaves, at
    /// least one. Both are equally probable before the readings.
    pub fn probability_beside(&self, other: &Self) -> f64 {
        let energy = other.energy_of_assumed_noise().max(1.0);
        (1.0 + (0.5 * (self.value() - other.value()) / energy).exp()).recip()
    }
}
