//! The two channels as the costs take them: cut where samples are missing, with a common level
//! taken off.

use std::collections::BTreeMap;

use crate::error::CostError;

/// Times between the samples of one segment, s.
///
/// ```
/// use twinlag_cross_relation::{CostError, CrossRelation, Readings, Segment, Steps};
///
/// let steps = Steps::Uneven(vec![0.1, 0.25, 0.125]);
/// let segment = Segment::new(vec![20.0, 20.5, 22.0, 22.5], vec![20.0, 20.25, 21.0, 21.5], steps)?;
/// let readings = Readings::new(vec![segment])?;
/// assert_eq!(readings.even_period_s(), None);
/// // The whitened cost takes such readings as they are, the published one does not.
/// assert_eq!(CrossRelation::new(&readings, 0).err(), Some(CostError::UnevenSampling));
/// # Ok::<(), CostError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Steps {
    /// All the same.
    Even(f64),
    /// One for each pair of neighbours, `[n − 1]`.
    Uneven(Vec<f64>),
}

/// An unbroken stretch of both channels, in one temperature unit (°C or K).
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    y1: Vec<f64>,
    y2: Vec<f64>,
    steps: Steps,
}

impl Segment {
    /// Channels `y1`, `y2`, `[n]` each, `n ≥ 2`, with `steps` between their samples.
    ///
    /// # Errors
    /// [`CostError::LengthMismatch`], [`CostError::StepCount`], [`CostError::TooShort`],
    /// [`CostError::NotFinite`] or [`CostError::BadStep`].
    pub fn new(y1: Vec<f64>, y2: Vec<f64>, steps: Steps) -> Result<Self, CostError> {
        if y1.len() != y2.len() {
            return Err(CostError::LengthMismatch { first: y1.len(), second: y2.len() });
        }
        if y1.len() < 2 {
            return Err(CostError::TooShort { samples: y1.len(), needed: 2 });
        }
        for (channel, y) in [(1, &y1), (2, &y2)] {
            // All of them without a branch each; the search is for the message.
            let all_finite = y.iter().fold(true, |all, v| all & v.is_finite());
            if !all_finite && let Some((index, &value)) = y.iter().enumerate().find(|(_, v)| !v.is_finite()) {
                return Err(CostError::NotFinite { channel, index, value });
            }
        }
        let all = match &steps {
            Steps::Even(period) => std::slice::from_ref(period),
            Steps::Uneven(each) if each.len() + 1 == y1.len() => each,
            Steps::Uneven(each) => {
                return Err(CostError::StepCount { samples: y1.len(), steps: each.len(), expected: y1.len() - 1 });
            }
        };
        match all.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
            Some(&value) => Err(CostError::BadStep { value }),
            None => Ok(Self { y1, y2, steps }),
        }
    }

    /// Reading of sensor 1, the common level taken off once the segment is part of [`Readings`].
    pub fn y1(&self) -> &[f64] {
        &self.y1
    }

    /// Reading of sensor 2, likewise.
    pub fn y2(&self) -> &[f64] {
        &self.y2
    }

    /// Times between samples.
    pub fn steps(&self) -> &Steps {
        &self.steps
    }

    /// Largest absolute reading of either channel.
    pub fn highest(&self) -> f64 {
        self.y1.iter().chain(&self.y2).fold(0.0, |m, y| m.max(y.abs()))
    }

    /// Number of samples.
    #[expect(clippy::len_without_is_empty, reason = "a segment has two samples at least")]
    pub fn len(&self) -> usize {
        self.y1.len()
    }
}

/// Sum in eight strands, since each addition waits for the one before.
fn sum(x: &[f64]) -> f64 {
    let (chunks, rest) = x.as_chunks::<8>();
    let mut strands = [0.0; 8];
    for chunk in chunks {
        for (strand, x) in strands.iter_mut().zip(chunk) {
            *strand += x;
        }
    }
    strands.iter().chain(rest).sum()
}

/// Both channels of a record: one or more segments, with a common level subtracted.
///
/// At unity gain the costs do not depend on it, and taking it off keeps it out of the rounding.
/// With a free gain it is the temperature at which the offset is stated: gain and offset are least
/// entangled at the mean of the record.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    segments: Vec<Segment>,
    level: f64,
}

impl Readings {
    /// Joins `segments` into one record, the mean of both channels' means taken off.
    ///
    /// ```
    /// use twinlag_cross_relation::{Readings, Segment, Steps};
    ///
    /// // A reading is missing between the two stretches.
    /// let before = Segment::new(vec![20.0, 21.0, 23.0], vec![20.0, 20.5, 21.5], Steps::Even(0.1))?;
    /// let after = Segment::new(vec![24.0, 24.5], vec![22.5, 23.0], Steps::Even(0.1))?;
    /// let readings = Readings::new(vec![before, after])?;
    /// assert_eq!(readings.level(), 22.0); // the mean of 22.5 and 21.5, exact in binary
    /// assert_eq!(readings.segments()[0].y1(), [-2.0, -1.0, 1.0]);
    /// assert_eq!((readings.len(), readings.even_period_s()), (5, Some(0.1)));
    /// # Ok::<(), twinlag_cross_relation::CostError>(())
    /// ```
    ///
    /// # Errors
    /// [`CostError::TooShort`] if they hold fewer than 4 samples in all.
    pub fn new(segments: Vec<Segment>) -> Result<Self, CostError> {
        let samples = segments.iter().map(Segment::len).sum::<usize>() as f64;
        let mean_of = |channel: fn(&Segment) -> &[f64]| segments.iter().map(|s| sum(channel(s))).sum::<f64>() / samples;
        let mean = 0.5 * (mean_of(Segment::y1) + mean_of(Segment::y2));
        Self::about(segments, mean)
    }

    /// Joins `segments` into one record, `level` taken off: the temperature at which the relative
    /// offset is stated.
    ///
    /// # Errors
    /// As [`Readings::new`].
    pub fn about(mut segments: Vec<Segment>, level: f64) -> Result<Self, CostError> {
        let samples: usize = segments.iter().map(Segment::len).sum();
        if samples < 4 {
            return Err(CostError::TooShort { samples, needed: 4 });
        }
        for segment in &mut segments {
            segment.y1.iter_mut().chain(&mut segment.y2).for_each(|y| *y -= level);
        }
        Ok(Self { segments, level })
    }

    /// One unbroken, evenly sampled record: `y1`, `y2` `[n]`, `period_s` between samples.
    ///
    /// # Errors
    /// As [`Segment::new`] and [`Readings::new`].
    pub fn even(y1: &[f64], y2: &[f64], period_s: f64) -> Result<Self, CostError> {
        Self::new(vec![Segment::new(y1.to_vec(), y2.to_vec(), Steps::Even(period_s))?])
    }

    /// The unbroken stretches, common level taken off.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// How many segments there are of each length, from short to long.
    pub(crate) fn lengths(&self) -> BTreeMap<usize, usize> {
        let mut out = BTreeMap::new();
        for segment in &self.segments {
            *out.entry(segment.len()).or_default() += 1;
        }
        out
    }

    /// What was taken off: the mean of all samples of both channels, unless something else was
    /// asked for.
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Difference between the highest and the lowest reading of either channel.
    pub fn swing(&self) -> f64 {
        let all = || self.segments.iter().flat_map(|s| s.y1.iter().chain(&s.y2));
        all().copied().fold(f64::NEG_INFINITY, f64::max) - all().copied().fold(f64::INFINITY, f64::min)
    }

    /// Samples of each channel.
    #[expect(clippy::len_without_is_empty, reason = "there are four samples at least")]
    pub fn len(&self) -> usize {
        self.segments.iter().map(Segment::len).sum()
    }

    /// The sample period, if it is the same throughout.
    pub fn even_period_s(&self) -> Option<f64> {
        let mut periods = self.segments.iter().map(|s| match s.steps {
            Steps::Even(period) => Some(period),
            Steps::Uneven(_) => None,
        });
        let first = periods.next()??;
        periods.all(|p| p == Some(first)).then_some(first)
    }

    /// Mean time between neighbouring samples of a segment, s.
    pub fn mean_step_s(&self) -> f64 {
        self.span_s() / (self.len() - self.segments.len()) as f64
    }

    /// Time covered by all segments together, s.
    pub fn span_s(&self) -> f64 {
        let span = |s: &Segment| match &s.steps {
            Steps::Even(period) => period * (s.len() - 1) as f64,
            Steps::Uneven(each) => each.iter().sum(),
        };
        self.segments.iter().map(span).sum()
    }
}
