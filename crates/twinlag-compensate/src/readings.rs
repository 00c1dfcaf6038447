//! What is compensated.

use std::sync::Arc;

use crate::error::CompensateError;
use crate::rig::SensorAt;

/// Temperatures of two sensors: readings with whatever their calibration does to them already taken
/// off.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    time_s: Vec<f64>,
    reading_c: [Arc<Vec<f64>>; 2],
    missing: [Vec<bool>; 2],
    locals: Option<[Vec<SensorAt>; 2]>,
}

impl Readings {
    /// Readings at `time_s`, which increases; steps may differ.
    ///
    /// # Errors
    /// [`CompensateError::Lengths`], [`CompensateError::Time`], [`CompensateError::Reading`].
    pub fn new(time_s: Vec<f64>, reading_c: [Vec<f64>; 2]) -> Result<Self, CompensateError> {
        let missing = [vec![false; time_s.len()], vec![false; time_s.len()]];
        Self::with_missing(time_s, reading_c, missing)
    }

    /// Readings at `time_s`, of which those marked in `missing` are ignored, whatever their value.
    ///
    /// ```
    /// use twinlag_compensate::{CompensateError, Readings};
    ///
    /// let time_s = vec![0.0, 0.1, 0.2];
    /// let reading_c = [vec![20.0, f64::NAN, 21.0], vec![20.0, 20.1, 20.2]];
    /// // A reading that is no number has to be marked.
    /// let unmarked = Readings::new(time_s.clone(), reading_c.clone());
    /// assert!(matches!(unmarked, Err(CompensateError::Reading { channel: 1, sample: 1, .. })));
    /// let readings = Readings::with_missing(time_s, reading_c, [vec![false, true, false], vec![false; 3]])?;
    /// assert_eq!((readings.reading_c(0, 1), readings.reading_c(1, 1)), (None, Some(20.1)));
    /// # Ok::<(), CompensateError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Readings::new`].
    pub fn with_missing(
        time_s: Vec<f64>,
        reading_c: [Vec<f64>; 2],
        missing: [Vec<bool>; 2],
    ) -> Result<Self, CompensateError> {
        Self::sharing(time_s, reading_c.map(Arc::new), missing)
    }

    /// As [`Readings::with_missing`], of readings that others hold as well.
    ///
    /// # Errors
    /// As [`Readings::new`].
    pub fn sharing(
        time_s: Vec<f64>,
        reading_c: [Arc<Vec<f64>>; 2],
        missing: [Vec<bool>; 2],
    ) -> Result<Self, CompensateError> {
        let expected = time_s.len();
        let lengths = [reading_c[0].len(), reading_c[1].len(), missing[0].len(), missing[1].len()];
        if let Some(&got) = lengths.iter().find(|n| **n != expected) {
            return Err(CompensateError::Lengths { expected, got });
        }
        if let Some(k) = time_s.windows(2).position(|t| !(t[1] - t[0]).is_finite() || t[1] <= t[0]) {
            return Err(CompensateError::Time { sample: k + 1 });
        }
        for (i, readings) in reading_c.iter().enumerate() {
            if let Some(k) = (0..expected).find(|&k| !missing[i][k] && !readings[k].is_finite()) {
                return Err(CompensateError::Reading { channel: i + 1, sample: k, got: readings[k] });
            }
        }
        Ok(Self { time_s, reading_c, missing, locals: None })
    }

    /// With what each sensor does at each instant, where that changes along the record.
    ///
    /// # Errors
    /// [`CompensateError::Lengths`].
    pub fn with_locals(self, locals: [Vec<SensorAt>; 2]) -> Result<Self, CompensateError> {
        let expected = self.len();
        match locals.iter().map(Vec::len).find(|n| *n != expected) {
            Some(got) => Err(CompensateError::Lengths { expected, got }),
            None => Ok(Self { locals: Some(locals), ..self }),
        }
    }

    /// The first `count` instants.
    pub(crate) fn first(&self, count: usize) -> Self {
        let count = count.min(self.len());
        let locals = self.locals.as_ref().map(|locals| [0, 1].map(|i| locals[i][..count].to_vec()));
        Self {
            time_s: self.time_s[..count].to_vec(),
            reading_c: [0, 1].map(|i| Arc::new(self.reading_c[i][..count].to_vec())),
            missing: [0, 1].map(|i| self.missing[i][..count].to_vec()),
            locals,
        }
    }

    /// Instants.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there are no readings.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Instants, s.
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Instants, s, of readings that are not needed any more.
    pub fn into_time_s(self) -> Vec<f64> {
        self.time_s
    }

    /// The reading of `channel` at instant `k`, °C; `None` where it is missing.
    pub fn reading_c(&self, channel: usize, k: usize) -> Option<f64> {
        (!self.missing[channel][k]).then(|| self.reading_c[channel][k])
    }

    /// Both sensors at instant `k`, each with its reading about `level_c`: the last one, where it
    /// is missing.
    pub(crate) fn locals(&self, k: usize, level_c: f64) -> Option<[(SensorAt, f64); 2]> {
        let locals = self.locals.as_ref()?;
        Some([0, 1].map(|i| (locals[i][k], self.reading_c[i][k] - level_c)))
    }

    /// Median of how far steps are from the nearest multiple of the median one, as a share of that.
    pub(crate) fn unevenness(&self) -> f64 {
        let period_s = self.period_s();
        let off = |t: &[f64]| {
            let steps = (t[1] - t[0]) / period_s;
            (steps - steps.round().max(1.0)).abs()
        };
        let mut all: Vec<f64> = self.time_s.windows(2).map(off).collect();
        let middle = all.len() / 2;
        if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// The median step, s.
    pub fn period_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.time_s.windows(2).map(|t| t[1] - t[0]).collect();
        let middle = steps.len() / 2;
        if steps.is_empty() { 1.0 } else { *steps.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }
}
