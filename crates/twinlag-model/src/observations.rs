//! The two channels as the diagnosis takes them: absolute temperatures in unbroken stretches.

use std::ops::Range;
use std::sync::Arc;

use crate::error::ModelError;
use crate::flow::{Flow, FlowKind};
use crate::instants::Instants;

/// Fewest samples of a stretch that is used.
const MIN_STRETCH_SAMPLES: usize = 8;
/// Fewest and most samples that a delay may reach. Chosen.
const MIN_REACH_SAMPLES: usize = 2;
const MAX_REACH_SAMPLES: usize = 64;
/// Fewest samples of a record that can be diagnosed: fewer leave no blocks to be held out.
const MIN_RECORD_SAMPLES: usize = 60;

/// First samples of pieces of `length` samples, spread evenly over a record of `samples`, from its first sample to its last.
///
/// ```
/// use twinlag_model::evenly_spread;
///
/// assert_eq!(evenly_spread(100, 3, 20).collect::<Vec<usize>>(), [0, 40, 80]);
/// ```
///
/// # Panics
/// If a record is shorter than one piece, or for fewer than two pieces.
pub fn evenly_spread(samples: usize, pieces: usize, length: usize) -> impl Iterator<Item = usize> {
    (0..pieces).map(move |i| i * (samples - length) / (pieces - 1))
}

/// An unbroken stretch of both channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Sample instants, s, rising.
    pub time_s: Instants,
    /// Readings of channels 1 and 2, °C, which whoever has them already shares.
    pub reading_c: [Arc<Vec<f64>>; 2],
    /// Readings that do not count: missing ones, and wrong ones (spikes, saturation).
    pub masked: [Vec<bool>; 2],
    /// Samples of those that are missing, in rising order.
    missing: [Arc<Vec<usize>>; 2],
    /// Flow velocity or density, in any unit, or the speed of sensors that move, m/s.
    flow: Option<(FlowKind, Vec<f64>)>,
    /// The record that it is of, from 0, where several are joined.
    pub(crate) member: usize,
    /// Noise of each channel here over that of all stretches.
    pub(crate) noise_factor: [f64; 2],
}

impl Stretch {
    /// A stretch of which every sample counts.
    pub fn new(time_s: Vec<f64>, reading_c: [Vec<f64>; 2]) -> Self {
        Self::sharing(time_s.into(), reading_c.map(Arc::new))
    }

    /// A stretch of which every sample counts, with readings that others hold as well.
    pub fn sharing(time_s: Instants, reading_c: [Arc<Vec<f64>>; 2]) -> Self {
        let masked = [vec![false; time_s.len()], vec![false; time_s.len()]];
        Self { time_s, reading_c, masked, missing: Default::default(), flow: None, member: 0, noise_factor: [1.0; 2] }
    }

    /// This stretch, with the marked readings of either channel ignored. They are missing readings,
    /// in whose place stands a value between their neighbours.
    #[must_use]
    pub fn with_missing(self, masked: [Vec<bool>; 2]) -> Self {
        let missing = masked.each_ref().map(|masked| Arc::new((0..masked.len()).filter(|k| masked[*k]).collect()));
        Self { masked, missing, ..self }
    }

    /// Whether any reading is missing.
    pub(crate) fn has_missing(&self) -> bool {
        self.missing.iter().any(|missing| !missing.is_empty())
    }

    /// Whether a reading is missing: it is masked, and what stands in its place lies between its neighbours.
    pub(crate) fn is_missing(&self, channel: usize, sample: usize) -> bool {
        self.missing[channel].binary_search(&sample).is_ok()
    }

    /// A stretch of some of its samples, without the flow.
    fn part(&self, samples: Range<usize>) -> Self {
        Self {
            time_s: self.time_s.cut(samples.clone()),
            reading_c: [0, 1].map(|i| Arc::new(self.reading_c[i][samples.clone()].to_vec())),
            masked: [0, 1].map(|i| self.masked[i][samples.clone()].to_vec()),
            missing: self.missing.each_ref().map(|missing| {
                let of_part = missing.iter().filter(|k| samples.contains(k));
                Arc::new(of_part.map(|k| k - samples.start).collect())
            }),
            flow: None,
            member: self.member,
            noise_factor: self.noise_factor,
        }
    }

    /// This stretch with a measured flow velocity or density at each sample, positive, in any unit.
    #[must_use]
    pub fn with_flow(self, flow: Vec<f64>) -> Self {
        Self { flow: Some((FlowKind::Flow, flow)), ..self }
    }

    /// This stretch with the speed at which the sensors move at each sample, m/s, negative where they move the other way.
    #[must_use]
    pub fn with_motion(self, speed_m_s: Vec<f64>) -> Self {
        Self { flow: Some((FlowKind::Motion, speed_m_s)), ..self }
    }

    /// Its instants with the flow or the speed at each.
    fn flow_along(&self) -> Option<(&Instants, &[f64])> {
        self.flow.as_ref().map(|(_, flow)| (&self.time_s, &flow[..]))
    }

    /// This stretch as one of a record among others, `later_s` seconds later.
    pub(crate) fn as_member(&self, member: usize, later_s: f64) -> Self {
        Self { time_s: self.time_s.later(later_s), member, ..self.clone() }
    }

    /// First and last instant, s.
    pub(crate) fn ends_s(&self) -> [f64; 2] {
        [self.time_s.at(0), self.time_s.at(self.len() - 1)]
    }

    /// The mean of the first readings, °C.
    pub fn start_c(&self) -> f64 {
        0.5 * (self.reading_c[0][0] + self.reading_c[1][0])
    }

    pub(crate) fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Some of its samples.
    pub(crate) fn cut(&self, samples: Range<usize>) -> Cut<'_> {
        let reading_c = [0, 1].map(|i| &self.reading_c[i][samples.clone()]);
        Cut { time_s: &self.time_s, first: samples.start, reading_c }
    }

    /// All of its samples.
    pub(crate) fn whole(&self) -> Cut<'_> {
        self.cut(0..self.len())
    }
}

/// Successive samples of a stretch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut<'a> {
    /// Instants of the stretch.
    pub(crate) time_s: &'a Instants,
    /// The sample of the stretch with which these begin.
    pub(crate) first: usize,
    /// Readings of channels 1 and 2, °C.
    pub(crate) reading_c: [&'a [f64]; 2],
}

impl Cut<'_> {
    /// The instant in the middle of the stretch, s: no delay leads out of the stretch from there.
    pub(crate) fn middle_s(&self) -> f64 {
        self.time_s.at(self.time_s.len() / 2)
    }
}

/// Both channels of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Observations {
    /// Unbroken stretches, in order of time, shared by copies of the record.
    pub stretches: Vec<Arc<Stretch>>,
    /// The sample period where samples are evenly spaced within each stretch, s.
    pub period_s: Option<f64>,
    /// Standard deviation of the more lively channel, K.
    swing_k: f64,
    /// Flow, where it was measured.
    flow: Option<Arc<Flow>>,
    /// How many samples a delay may reach: in a record of several as in all of them.
    reach: usize,
}

impl Observations {
    /// - `stretches`: in order of time; those of fewer than 8 samples are left out
    /// - `period_s`: the sample period where samples are evenly spaced within each stretch, s
    ///
    /// ```
    /// use twinlag_model::{ModelError, Observations, Stretch};
    ///
    /// let stretch = |samples: i32, from_s: f64| {
    ///     let time_s: Vec<f64> = (0..samples).map(|k| from_s + 0.5 * f64::from(k)).collect();
    ///     let reading_c = [1.0, 3.0].map(|k| time_s.iter().map(|t| 20.0 + k * t.sin()).collect());
    ///     Stretch::new(time_s, reading_c)
    /// };
    /// // The second of three stretches is too short to be of use.
    /// let all = vec![stretch(40, 0.0), stretch(5, 30.0), stretch(30, 40.0)];
    /// let observations = Observations::new(all, Some(0.5))?;
    /// assert_eq!((observations.stretches.len(), observations.samples()), (2, 70));
    /// assert_eq!(observations.ends_s(), [0.0, 54.5]); // halves are exact in binary
    /// assert_eq!(observations.swing_k(), observations.mean_and_std(1)[1]); // the livelier channel's
    /// let few = Observations::new(vec![stretch(40, 0.0)], Some(0.5));
    /// assert_eq!(few, Err(ModelError::TooShort { samples: 40, needed: 60 }));
    /// # Ok::<(), ModelError>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelError::TooShort`] for fewer than 60 samples; [`ModelError::NotFinite`]; [`ModelError::Flow`] for a flow that is
    /// not positive everywhere, of another length, or missing in a stretch.
    pub fn new(mut stretches: Vec<Stretch>, period_s: Option<f64>) -> Result<Self, ModelError> {
        stretches.retain(|s| s.len() >= MIN_STRETCH_SAMPLES);
        let samples: usize = stretches.iter().map(Stretch::len).sum();
        if samples < MIN_RECORD_SAMPLES {
            return Err(ModelError::TooShort { samples, needed: MIN_RECORD_SAMPLES });
        }
        let is_sound = |v: &Arc<Vec<f64>>| v.iter().all(|x| x.is_finite());
        if !stretches.iter().all(|s| s.time_s.are_finite() && s.reading_c.iter().all(is_sound)) {
            return Err(ModelError::NotFinite);
        }
        let kind = stretches.first().and_then(|s| s.flow.as_ref()).map(|(kind, _)| *kind);
        if stretches.iter().any(|s| s.flow.as_ref().map(|(kind, _)| *kind) != kind) {
            return Err(ModelError::Flow);
        }
        let flow = kind.map(|kind| {
            Flow::new(kind, &stretches.iter().filter_map(Stretch::flow_along).collect::<Vec<_>>()).map(Arc::new)
        });
        let flow = flow.transpose()?;
        let stretches: Vec<Arc<Stretch>> = stretches.into_iter().map(Arc::new).collect();
        let reach = reach(&stretches);
        let mut out = Self { stretches, period_s, swing_k: 0.0, flow, reach };
        out.swing_k = out.mean_and_std(0)[1].max(out.mean_and_std(1)[1]);
        Ok(out)
    }

    /// These as pieces of a longer record, whose more lively channel has the standard deviation `swing_k` (K).
    #[must_use]
    pub fn of_record_with_swing(self, swing_k: f64) -> Self {
        Self { swing_k, ..self }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.stretches.iter().map(|s| s.len()).sum()
    }

    /// Whether any reading is missing.
    pub fn has_missing(&self) -> bool {
        self.stretches.iter().any(|stretch| stretch.has_missing())
    }

    /// First and last instant, s.
    pub fn ends_s(&self) -> [f64; 2] {
        let first = self.stretches.first().map_or(0.0, |s| s.ends_s()[0]);
        let last = self.stretches.last().map_or(1.0, |s| s.ends_s()[1]);
        [first, last]
    }

    /// Time from the first to the last sample, s; of several records that of the longest.
    pub fn span_s(&self) -> f64 {
        self.members().iter().map(|member| member.ends_s[1] - member.ends_s[0]).fold(0.0, f64::max)
    }

    /// Mean time from sample to sample, s.
    pub fn step_s(&self) -> f64 {
        self.period_s.unwrap_or_else(|| {
            let (sum, count) = self
                .stretches
                .iter()
                .map(|s| (s.ends_s(), s.len() - 1))
                .fold((0.0, 0), |(sum, count), ([from_s, to_s], steps)| (sum + to_s - from_s, count + steps));
            sum / count as f64
        })
    }

    /// Every reading of a channel.
    pub fn channel(&self, i: usize) -> impl Iterator<Item = f64> + '_ {
        self.stretches.iter().flat_map(move |s| s.reading_c[i].iter().copied())
    }

    /// Mean and standard deviation of a channel.
    pub fn mean_and_std(&self, i: usize) -> [f64; 2] {
        let n = self.samples() as f64;
        let mean = self.channel(i).sum::<f64>() / n;
        [mean, (self.channel(i).map(|y| (y - mean) * (y - mean)).sum::<f64>() / n).sqrt()]
    }

    /// Mean, variance and third central moment over variance of the mean of both channels.
    pub fn moments(&self) -> [f64; 3] {
        let level = || self.channel(0).zip(self.channel(1)).map(|(a, b)| 0.5 * (a + b));
        let n = self.samples() as f64;
        let mean = level().sum::<f64>() / n;
        let second = level().map(|y| (y - mean).powi(2)).sum::<f64>() / n;
        let third = level().map(|y| (y - mean).powi(3)).sum::<f64>() / n;
        [mean, second, if second > 0.0 { third / second } else { 0.0 }]
    }

    /// Flow, where it was measured in all stretches.
    pub fn flow(&self) -> Option<&Arc<Flow>> {
        self.flow.as_ref()
    }

    /// The standard deviation of the more lively channel, K.
    pub fn swing_k(&self) -> f64 {
        self.swing_k
    }

    /// Pieces of `length` samples from each of `starts` on, counted through the stretches; those that would reach over the end of a
    /// stretch are left out.
    #[must_use]
    pub fn excerpt(&self, starts: impl Iterator<Item = usize>, length: usize) -> Self {
        let mut stretches = Vec::new();
        for mut from in starts {
            for stretch in &self.stretches {
                let n = stretch.len();
                if from >= n {
                    from -= n;
                    continue;
                }
                if from + length <= n {
                    stretches.push(Arc::new(stretch.part(from..from + length)));
                }
                break;
            }
        }
        if stretches.is_empty() {
            return self.clone();
        }
        Self { reach: reach(&stretches), ..self.with_stretches(stretches) }
    }

    /// How many samples a delay may reach.
    pub(crate) fn reach(&self) -> usize {
        self.reach
    }

    /// These with delays that reach over no more samples than `most`, or the fewest that they need.
    pub(crate) fn reaching_at_most(self, most: usize) -> Self {
        Self { reach: self.reach.min(most.max(MIN_REACH_SAMPLES)), ..self }
    }

    /// Some stretches of the record, with the flow and the reach of all of it.
    pub(crate) fn with_stretches(&self, stretches: Vec<Arc<Stretch>>) -> Self {
        Self { stretches, flow: self.flow.clone(), ..*self }
    }
}

/// How many samples a delay may reach: not so many that stretches with a tenth of the samples or more are lost to it.
fn reach(stretches: &[Arc<Stretch>]) -> usize {
    let mut lengths: Vec<usize> = stretches.iter().map(|s| s.len()).collect();
    let samples: usize = lengths.iter().sum();
    lengths.sort_unstable();
    let mut shorter = 0;
    let typical = lengths.into_iter().find(|n| {
        shorter += n;
        10 * shorter >= samples
    });
    (samples / 50).min(typical.unwrap_or(0) / 10).clamp(MIN_REACH_SAMPLES, MAX_REACH_SAMPLES)
}
