//! A model: two lags and the effects added so far.

use std::fmt;
use std::sync::Arc;

use twinlag_cross_relation::Z_975;
use twinlag_optimise::Variable;

use crate::effect::{Identifier, Parameter, Shared, Twin};
use crate::implied::{Details, Evaluation};
use crate::number::Number;
use crate::observations::{Observations, Stretch};
use crate::plant::Plant;

/// Longest time constant beside the length of the record: of a longer one there is no more than a drift in it.
pub(crate) const MAX_TAU_SPANS: f64 = 4.0;
/// Shortest time constant beside a sample period: what happens within a tenth of it leaves no trace.
const MIN_TAU_STEPS: f64 = 0.1;
/// Shortest beside one that is known, beside a sample period. The readings show by how much one sensor lags behind the other, to
/// the noise over the slope of the gas and not to a sample period, so nothing but this keeps a time constant from being none: less
/// than any noise shows.
const MIN_TAU_STEPS_BESIDE_KNOWN: f64 = 1e-3;
/// Factor by which a fit may move a time constant that is known with a standard deviation, either way, wherever the samples end:
/// further off than any data sheet.
const KNOWN_TAU_FACTOR: f64 = 10.0;

/// Prior knowledge of a time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownTimeConstant {
    /// Sensor 0 or 1.
    pub sensor: usize,
    /// Its time constant, s.
    pub value_s: f64,
    /// Standard deviation of that knowledge, s; `None` holds it.
    pub std_s: Option<f64>,
}

/// Two lags and effects. Parameters are in the order `τ₁`, `τ₂`, then those of each effect.
#[derive(Clone)]
pub struct Model {
    /// Effects, in the order in which they were added.
    pub effects: Vec<Shared>,
    pub(crate) known: Vec<KnownTimeConstant>,
    noise_std_k: [f64; 2],
    /// Whether the effects stay as they are, and the time constants alone are fitted.
    pub(crate) is_frozen: bool,
    /// Parameters, by their places, that stay as they are because the observations do not determine them.
    pub(crate) held: Vec<usize>,
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { effects, known, noise_std_k, is_frozen, held } = self;
        let effects: Vec<&str> = effects.iter().map(|e| e.identifier().name()).collect();
        let mut out = f.debug_struct("Model");
        out.field("effects", &effects).field("known", known).field("noise_std_k", noise_std_k);
        out.field("is_frozen", is_frozen).field("held", held).finish()
    }
}

impl Model {
    /// Two first-order lags.
    ///
    /// - `known`: what is known of the time constants beforehand
    /// - `noise_std_k`: white noise of the channels, K
    pub fn new(known: &[KnownTimeConstant], noise_std_k: [f64; 2]) -> Self {
        Self { effects: Vec::new(), known: known.to_vec(), noise_std_k, is_frozen: false, held: Vec::new() }
    }

    /// This model and one more effect.
    ///
    /// ```
    /// use twinlag_model::{Identifier, Model, Observations, Prepared, Settings, Stretch, candidates};
    /// # let time_s: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
    /// # let gas_c = |t: f64| 300.0 + (9.0 * t).sin() + (31.0 * t).sin().powi(3);
    /// # let reading_c = [0.0, 0.4].map(|late| time_s.iter().map(|t| gas_c(t - late)).collect());
    ///
    /// // `time_s` and `reading_c` are a record; what can be added to the model is made for it.
    /// let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.01))?;
    /// let prepared = Prepared::new(&observations, &Settings::default())?;
    /// let offset = candidates(&[Identifier::CALIBRATION], &prepared.context).remove(0);
    /// let two_lags = Model::new(&[], [0.1, 0.1]);
    /// let model = two_lags.with(offset);
    /// assert_eq!((two_lags.parameter_count(), model.parameter_count()), (2, 3));
    /// assert_eq!(model.range(0), 2..3); // its parameter comes after both time constants
    /// assert_eq!(model.parameters().map(|p| p.name).collect::<Vec<_>>(), ["offset"]);
    /// assert_eq!(model.without(0).parameter_count(), 2);
    /// # Ok::<(), twinlag_model::ModelError>(())
    /// ```
    #[must_use]
    pub fn with(&self, effect: Shared) -> Self {
        let mut out = self.clone();
        out.effects.push(effect);
        out
    }

    /// This model without effect `index`.
    #[must_use]
    pub fn without(&self, index: usize) -> Self {
        let mut out = self.clone();
        out.effects.remove(index);
        out
    }

    /// The first effect that is noise.
    pub fn noise(&self) -> Option<usize> {
        self.effects.iter().position(|e| e.is_noise())
    }

    /// What a record would mean if an exact twin of effect `index` were the cause, where there can be such a rig; none where an
    /// effect of the model makes of a sensor more than a first-order lag of the gas, or where it contradicts what is known of a time
    /// constant.
    ///
    /// - `theta`: all parameters
    pub fn twins(&self, index: usize, theta: &[f64]) -> Vec<Twin> {
        let leaves_lags = |(other, effect): (usize, &Shared)| other == index || effect.about().leaves_lags;
        if !self.effects.iter().enumerate().all(leaves_lags) {
            return Vec::new();
        }
        let tau_s = [theta[0], theta[1]];
        let agrees = |twin: &Twin, known: &KnownTimeConstant| {
            let off_s = (twin.time_constants_s[known.sensor] - known.value_s).abs();
            twin.time_constants_s[known.sensor] == tau_s[known.sensor]
                || known.std_s.is_some_and(|std_s| off_s <= Z_975 * std_s)
        };
        let mut out = self.effects[index].twins(&theta[self.range(index)], tau_s);
        out.retain(|twin| twin.is_possible() && self.known.iter().all(|known| agrees(twin, known)));
        out
    }

    /// This model with another effect in place of effect `index`.
    #[must_use]
    pub fn replaced(&self, index: usize, effect: Shared) -> Self {
        let mut out = self.clone();
        out.effects[index] = effect;
        out
    }

    /// This model with the time constant of a sensor held.
    ///
    /// ```
    /// use twinlag_model::Model;
    ///
    /// let model = Model::new(&[], [0.1, 0.2]).holding(1, 0.45);
    /// assert!(model.knows(1) && !model.knows(0));
    /// assert_eq!((model.parameter_count(), model.free_count()), (2, 1));
    /// assert!(format!("{model:?}").contains("value_s: 0.45"));
    /// ```
    #[must_use]
    pub fn holding(mut self, sensor: usize, value_s: f64) -> Self {
        self.known.retain(|k| k.sensor != sensor);
        self.known.push(KnownTimeConstant { sensor, value_s, std_s: None });
        self
    }

    /// This model with nothing known of the time constants beforehand.
    ///
    /// ```
    /// use twinlag_model::Model;
    ///
    /// let model = Model::new(&[], [0.1, 0.2]).holding(1, 0.45).knowing_nothing();
    /// assert!(!model.knows_of(1));
    /// ```
    #[must_use]
    pub fn knowing_nothing(mut self) -> Self {
        self.known.clear();
        self
    }

    /// This model with other white noise of the channels, K.
    #[must_use]
    pub fn with_noise(mut self, noise_std_k: [f64; 2]) -> Self {
        self.noise_std_k = noise_std_k;
        self
    }

    /// White noise of the channels, K.
    pub fn noise_std_k(&self) -> [f64; 2] {
        self.noise_std_k
    }

    /// Whether a time constant is held at a known value.
    pub fn knows(&self, sensor: usize) -> bool {
        self.known.iter().any(|k| k.sensor == sensor && k.std_s.is_none())
    }

    /// Whether something is known of a time constant beforehand: its value, or one with a standard deviation.
    ///
    /// ```
    /// use twinlag_model::{KnownTimeConstant, Model};
    ///
    /// let data_sheet = KnownTimeConstant { sensor: 0, value_s: 0.5, std_s: Some(0.1) };
    /// let model = Model::new(&[data_sheet], [0.1, 0.2]);
    /// assert!(model.knows_of(0) && !model.knows(0) && !model.knows_of(1));
    /// ```
    pub fn knows_of(&self, sensor: usize) -> bool {
        self.known.iter().any(|k| k.sensor == sensor)
    }

    /// Where the parameters of effect `index` are.
    pub fn range(&self, index: usize) -> std::ops::Range<usize> {
        let from = 2 + self.effects[..index].iter().map(|e| e.parameters().len()).sum::<usize>();
        from..from + self.effects[index].parameters().len()
    }

    /// Parameters of the effects.
    pub fn parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.effects.iter().flat_map(|e| e.parameters())
    }

    /// The record, from 0, that a parameter belongs to, in a model of several; `None` where all share it.
    pub fn record_of(&self, parameter: usize) -> Option<usize> {
        let index = (0..self.effects.len()).find(|index| self.range(*index).contains(&parameter))?;
        self.effects[index].record_of(parameter - self.range(index).start)
    }

    /// Parameters that belong to records which `observations` are not of.
    pub(crate) fn of_other_records(&self, observations: &Observations) -> Vec<usize> {
        let of_records: Vec<(usize, usize)> =
            (2..self.parameter_count()).filter_map(|i| Some((i, self.record_of(i)?))).collect();
        if of_records.is_empty() {
            return Vec::new();
        }
        let members = observations.members();
        let is_there = |record: usize| members.iter().any(|member| member.number == record);
        of_records.into_iter().filter(|(_, record)| !is_there(*record)).map(|(i, _)| i).collect()
    }

    /// Prior knowledge of the effects' parameters: functions that have zero mean and unit variance beforehand.
    pub(crate) fn prior(&self, theta: &[Number]) -> Vec<Number> {
        self.effects.iter().enumerate().flat_map(|(index, e)| e.prior(&theta[self.range(index)])).collect()
    }

    /// How far slow bodies that are taken to have begun in equilibrium were from it.
    fn departures(&self, theta: &[Number], observations: &Observations) -> Vec<Number> {
        let mut all = self.effects.iter().flat_map(|effect| effect.departures()).peekable();
        if all.peek().is_none() {
            return Vec::new();
        }
        let plant = self.plant_of(theta, observations);
        all.filter(|departure| departure.counts_in(observations, &plant))
            .map(|departure| departure.value(&plant))
            .collect()
    }

    /// What is known beforehand of time constants, effects and first states, over its uncertainty.
    pub(crate) fn knowledge<'a>(
        &'a self,
        theta: &'a [Number],
        observations: &Observations,
    ) -> impl Iterator<Item = Number> + 'a {
        let of_tau = self.known.iter().filter_map(|known| Some((known, known.std_s?)));
        let of_tau = of_tau.map(|(known, std_s)| (theta[known.sensor] - known.value_s) / std_s);
        of_tau.chain(self.prior(theta)).chain(self.departures(theta, observations))
    }

    /// The energy of prior knowledge of the effects' parameters.
    pub(crate) fn prior_energy(&self, theta: &[f64]) -> f64 {
        let theta: Vec<Number> = theta.iter().copied().map(Number::from).collect();
        self.prior(&theta).iter().map(|p| p.re * p.re).sum()
    }

    /// Number of all parameters.
    pub fn parameter_count(&self) -> usize {
        2 + self.parameters().count()
    }

    /// Number of parameters that are fitted to the readings, known ones left out.
    pub fn free_count(&self) -> usize {
        self.parameter_count() - self.known.iter().filter(|k| k.std_s.is_none()).count()
    }

    /// The rig with these parameters.
    pub fn plant(&self, theta: &[f64], observations: &Observations) -> Plant {
        let theta: Vec<Number> = theta.iter().copied().map(Number::from).collect();
        self.plant_of(&theta, observations)
    }

    /// The rig with these parameters, and the derivative that they carry.
    pub(crate) fn plant_of(&self, theta: &[Number], observations: &Observations) -> Plant {
        let mut plant = self.two_lags(theta, observations);
        for (index, effect) in self.effects.iter().enumerate() {
            effect.install(&theta[self.range(index)], &mut plant);
        }
        plant
    }

    /// The rig without effects.
    pub(crate) fn two_lags(&self, theta: &[Number], observations: &Observations) -> Plant {
        Plant::new(observations, [theta[0], theta[1]], self.noise_std_k)
    }

    /// In which of the sensors a parameter may change functions of time or temperature.
    pub(crate) fn sensors_of_functions(&self, parameter: usize) -> [bool; 2] {
        if parameter < 2 {
            return [false; 2];
        }
        let effect = (0..self.effects.len()).find(|index| self.range(*index).contains(&parameter));
        effect.map_or([true; 2], |index| self.effects[index].has_functions_in())
    }

    /// The readings without the disturbances of the model.
    pub(crate) fn without_disturbances(&self, theta: &[f64], observations: &Observations) -> Observations {
        let plant = self.plant(theta, observations);
        let mut out = observations.clone();
        for stretch in &mut out.stretches {
            let Stretch { time_s, reading_c, .. } = Arc::make_mut(stretch);
            for (readings, sensor) in reading_c.iter_mut().zip(&plant.sensors) {
                for (y, t) in Arc::make_mut(readings).iter_mut().zip(time_s.iter()) {
                    *y -= sensor.reading.disturbance_at(t).re;
                }
            }
        }
        out
    }

    /// What the model implies of the record.
    pub fn evaluate(&self, theta: &[f64], observations: &Observations) -> Evaluation {
        self.plant(theta, observations).evaluate(observations)
    }

    pub(crate) fn details(&self, theta: &[f64], observations: &Observations) -> Details {
        self.plant(theta, observations).details(observations)
    }

    /// Shortest and longest that a fit takes a time constant to be, s.
    fn tau_bounds_s(&self, sensor: usize, observations: &Observations) -> [f64; 2] {
        let steps = if self.knows_of(1 - sensor) { MIN_TAU_STEPS_BESIDE_KNOWN } else { MIN_TAU_STEPS };
        let (shortest_s, longest_s) = (steps * observations.step_s(), MAX_TAU_SPANS * observations.span_s());
        match self.known.iter().find(|k| k.sensor == sensor) {
            Some(KnownTimeConstant { value_s, .. }) => {
                [shortest_s.min(value_s / KNOWN_TAU_FACTOR), longest_s.max(KNOWN_TAU_FACTOR * value_s)]
            }
            None => [shortest_s, longest_s],
        }
    }

    /// Variables of the fit. Noise is held: its likelihood is another.
    pub(crate) fn variables(&self, theta: &[f64], observations: &Observations) -> Vec<Variable> {
        let tau = |i: usize| {
            let [shortest_s, longest_s] = self.tau_bounds_s(i, observations);
            let variable = Variable::logarithmic(["tau 1", "tau 2"][i], shortest_s, longest_s);
            match self.known.iter().find(|k| k.sensor == i) {
                Some(known) if known.std_s.is_none() => variable.held_at(known.value_s),
                _ => variable,
            }
        };
        let mut out = vec![tau(0), tau(1)];
        out.extend(self.parameters().map(|p| p.variable.clone()));
        for i in self.of_other_records(observations).into_iter().chain(self.held.iter().copied()) {
            out[i] = out[i].clone().held_at(theta[i]);
        }
        for (index, effect) in self.effects.iter().enumerate() {
            if effect.is_noise() || (self.is_frozen && !effect.is_of_the_record()) {
                for i in self.range(index) {
                    out[i] = out[i].clone().held_at(theta[i]);
                }
            } else if effect.identifier() == Identifier::SECOND_ORDER {
                // Of two lags the time constant is the longer, so what is known of it is an end to the other.
                let known = self.known.iter().find(|k| Some(k.sensor) == effect.channel());
                for i in self.range(index) {
                    let longest_s = known.map_or(f64::INFINITY, |k| k.value_s).max(out[i].lower);
                    out[i].upper = out[i].upper.min(longest_s);
                }
            }
        }
        out
    }
}
