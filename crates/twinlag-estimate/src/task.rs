//! What an estimator is given: two channels, what is known beforehand, and what may be fitted.

use twinlag_cross_relation::{Parameter, Readings, Segment};
use twinlag_optimise::{Minimiser, Optimiser, Variable};
use twinlag_sensor::Discretisation;

use crate::known::Known;
use crate::objective::Prior;
use crate::starts::hold_known;
use crate::vocabulary::{NoiseColour, NoiseKnowledge};

/// Shortest first time constant that is looked for, sample periods. The pole of one is `exp(−5)`:
/// its sensor's reading is the gas to within 0.7 %, and shorter ones look the same.
pub(crate) const MIN_TAU_PERIODS: f64 = 0.2;
/// Longest first time constant that is looked for, spans of the record. A sensor of ten spans has
/// moved by a tenth of a step; of longer ones only the ratio of both shows.
const MAX_TAU_SPANS: f64 = 10.0;
/// Shortest second time constant that is looked for, sample periods. With a pole of `exp(−20)` it
/// delays by 0.05 periods.
pub(crate) const MIN_SECOND_TAU_PERIODS: f64 = 0.05;
/// Longest second time constant that is looked for, spans of the record: the first one is longer
/// still.
const MAX_SECOND_TAU_SPANS: f64 = 1.0;
/// Gains of channel 2 relative to channel 1 that are looked for: sensors of one kind agree far
/// better.
const GAIN_BOUNDS: [f64; 2] = [0.2, 5.0];
/// Typical deviation of a gain from 1: one per cent, as of uncalibrated thermometers.
const TYPICAL_GAIN_DEVIATION: f64 = 0.01;
/// Largest offset that is looked for, in swings of the readings, and levels above 0 °C.
const MAX_OFFSET_SWINGS: f64 = 10.0;
/// What was known with an uncertainty may be found at a tenth to ten times its value, whatever the
/// other bounds.
const KNOWN_WITHIN: f64 = 10.0;
/// A second lag starts at this share of the first where starts are given without one.
const SECOND_START_SHARE: f64 = 0.2;

/// An unbroken run of samples in which the gas is at rest.
#[derive(Clone, Copy, Debug)]
pub struct RunAtRest<'a> {
    /// When they were taken, s, `[n]`.
    pub time_s: &'a [f64],
    /// Both channels, °C, `[n]` each.
    pub readings: [&'a [f64]; 2],
}

/// What an estimator is given.
/// ```
#[doc = include_str!("../doc/readings.txt")]
/// use twinlag_estimate::{Known, NoiseKnowledge, Task};
///
/// let known: Vec<Known> = vec!["T1.time_constant_s=0.0238".parse()?];
/// let task = Task { noise: NoiseKnowledge::Ratio(1.0), free_gain: true, known: &known, ..Task::new(&readings) };
/// assert_eq!(task.parameters(), 4);
/// # Ok::<(), twinlag_estimate::EstimateError>(())
/// ```
#[derive(Clone)]
pub struct Task<'a> {
    /// The two channels.
    pub readings: &'a Readings,
    /// What the gas does between samples.
    pub hold: Discretisation,
    /// What is known of the noise.
    pub noise: NoiseKnowledge,
    /// Runs of samples in which the gas is at rest: levels to be found come from there. None by
    /// default.
    pub at_rest: &'a [RunAtRest<'a>],
    /// How costs are minimised.
    pub minimiser: &'a dyn Minimiser,
    /// Time constants to start from, s; the estimator finds its own where there are none.
    pub starts_s: Vec<[f64; 2]>,
    /// Samples left out at the start of each unbroken stretch by the published family; by default
    /// ten times the longest time constant of the whitened estimate, or of the start.
    pub discard: Option<usize>,
    /// Whether the gain of channel 2 relative to channel 1 is fitted too.
    pub free_gain: bool,
    /// Whether the offset of channel 2 relative to channel 1 is fitted too.
    pub free_offset: bool,
    /// Which sensors have a second lag that is fitted too.
    pub second_order: [bool; 2],
    /// What is known of parameters: held at its value, or weighed by its standard deviation. The
    /// published family takes values alone.
    pub known: &'a [Known],
    /// Whether standard errors and intervals are wanted.
    pub intervals: bool,
}

impl std::fmt::Debug for Task<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Task")
            .field("samples", &self.readings.len())
            .field("hold", &self.hold)
            .field("noise", &self.noise)
            .field("minimiser", &self.minimiser.name())
            .field("starts_s", &self.starts_s)
            .field("discard", &self.discard)
            .field("free_gain", &self.free_gain)
            .field("free_offset", &self.free_offset)
            .field("second_order", &self.second_order)
            .field("known", &self.known)
            .finish_non_exhaustive()
    }
}

impl<'a> Task<'a> {
    /// `readings` with nothing known, held gas, the default optimiser.
    pub fn new(readings: &'a Readings) -> Self {
        const DEFAULT: Optimiser = Optimiser::LevenbergMarquardt { step_tolerance: 1e-9 };
        Self {
            readings,
            hold: Discretisation::ZeroOrderHold,
            noise: NoiseKnowledge::default(),
            at_rest: &[],
            minimiser: &DEFAULT,
            starts_s: Vec::new(),
            discard: None,
            free_gain: false,
            free_offset: false,
            second_order: [false; 2],
            known: &[],
            intervals: true,
        }
    }

    /// How many parameters the costs are asked with: 2, 4 with a calibration, 6 with second lags.
    /// Costs of fewer are faster.
    pub fn parameters(&self) -> usize {
        if self.has_second_lag() != [false; 2] {
            6
        } else if self.calibrates() {
            4
        } else {
            2
        }
    }

    /// Which sensors have a second lag: one that is fitted, or known.
    pub fn has_second_lag(&self) -> [bool; 2] {
        let is_known = |parameter| self.known(parameter).is_some();
        [
            self.second_order[0] || is_known(Parameter::SecondTau1),
            self.second_order[1] || is_known(Parameter::SecondTau2),
        ]
    }

    /// Whether gain or offset play a part.
    pub fn calibrates(&self) -> bool {
        self.free_gain
            || self.free_offset
            || self.known.iter().any(|k| matches!(k.parameter, Parameter::Gain | Parameter::Offset))
    }

    pub(crate) fn known(&self, parameter: Parameter) -> Option<&Known> {
        self.known.iter().find(|k| k.parameter == parameter)
    }

    /// Colour of the noise where its levels are found, and whether a fit may correct them.
    pub(crate) fn colour_to_find(&self) -> Option<NoiseColour> {
        match self.noise {
            NoiseKnowledge::Found(colour) if self.at_rest.is_empty() => Some(colour),
            _ => None,
        }
    }

    /// Whether the size of the noise is that of the residual: nothing else says as well, once the
    /// model is taken for right.
    pub(crate) fn noise_has_size_of_residual(&self) -> bool {
        matches!(self.noise, NoiseKnowledge::Ratio(_)) || self.colour_to_find().is_some()
    }

    /// Knowledge that is weighed against the record.
    pub(crate) fn priors(&self) -> Vec<Prior> {
        let index = |parameter| Parameter::ALL.iter().position(|p| *p == parameter).expect("ALL has every parameter");
        let prior = |k: &Known| k.std.map(|std| Prior { index: index(k.parameter), mean: k.value, std });
        self.known.iter().filter_map(prior).collect()
    }

    /// The variables of a cost with `P` parameters, of which those that are not fitted are held: at
    /// what is known, or at a gain of 1, no offset, no second lag.
    ///
    /// - `offset_scale_k`: size of a typical offset, K
    pub(crate) fn variables<const P: usize>(&self, offset_scale_k: f64) -> Vec<Variable> {
        let variable = |i: usize| {
            let is_free = match Parameter::ALL[i] {
                Parameter::Tau1 | Parameter::Tau2 => true,
                Parameter::Gain => self.free_gain,
                Parameter::Offset => self.free_offset,
                Parameter::SecondTau1 => self.second_order[0],
                Parameter::SecondTau2 => self.second_order[1],
            };
            let widest = self.widest(i, offset_scale_k);
            match self.known(Parameter::ALL[i]) {
                Some(Known { value, std: None, .. }) => widest.held_at(*value),
                // Wherever it is said to lie, it may be found.
                Some(Known { value, .. }) => Variable {
                    lower: widest.lower.min(value / KNOWN_WITHIN),
                    upper: widest.upper.max(value * KNOWN_WITHIN),
                    ..widest
                },
                None if is_free => widest,
                None => {
                    let value = if Parameter::ALL[i] == Parameter::Gain { 1.0 } else { 0.0 };
                    Variable::linear(widest.name, 1.0, value, value)
                }
            }
        };
        (0..P).map(variable).collect()
    }

    /// Parameter `i` with the widest bounds that make sense for the record.
    fn widest(&self, i: usize, offset_scale_k: f64) -> Variable {
        let (name, readings) = (Known::NAMES[i], self.readings);
        let (step_s, span_s) = (readings.mean_step_s(), readings.span_s());
        match Parameter::ALL[i] {
            Parameter::Tau1 | Parameter::Tau2 => {
                Variable::logarithmic(name, MIN_TAU_PERIODS * step_s, MAX_TAU_SPANS * span_s)
            }
            Parameter::SecondTau1 | Parameter::SecondTau2 => {
                Variable::logarithmic(name, MIN_SECOND_TAU_PERIODS * step_s, MAX_SECOND_TAU_SPANS * span_s)
            }
            Parameter::Gain => Variable::linear(name, TYPICAL_GAIN_DEVIATION, GAIN_BOUNDS[0], GAIN_BOUNDS[1]),
            Parameter::Offset => {
                // At 0 °C a gain may hide in the offset, so the level counts too.
                let level = readings.segments().iter().map(Segment::highest).fold(0.0, f64::max);
                let widest_k = MAX_OFFSET_SWINGS * (readings.swing() + level);
                Variable::linear(name, offset_scale_k, -widest_k, widest_k)
            }
        }
    }

    /// The given starts as points of `P` parameters, inside the bounds of `variables`.
    pub(crate) fn starts<const P: usize>(&self, variables: &[Variable]) -> Vec<Vec<f64>> {
        let second = |i: usize, tau_s: f64| if self.second_order[i] { SECOND_START_SHARE * tau_s } else { 0.0 };
        let point = |t: &[f64; 2]| {
            let mut x = [t[0], t[1], 1.0, 0.0, second(0, t[0]), second(1, t[1])][..P].to_vec();
            hold_known(&mut x, variables);
            x
        };
        self.starts_s.iter().map(point).collect()
    }
}
