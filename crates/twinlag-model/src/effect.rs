//! Physical effects that a model of two first-order lags may lack.
//!
//! What is known of a kind of effect before any record stands in its [`About`]; an [`Identifier`] names it. An
//! [`Effect`] is one in its place, with parameters: what can be added to a model. Each of ours has a file of its own in
//! `effect/` and a line in [`Identifier::ALL`]; effects of other crates are made the same way, and handed over in
//! [`crate::Settings::effects`].

pub(crate) mod calibration;
pub(crate) mod coloured_noise;
pub(crate) mod crosstalk;
pub(crate) mod delay;
pub(crate) mod drift;
pub(crate) mod input_mismatch;
pub(crate) mod mains_pickup;
pub(crate) mod quantisation;
pub(crate) mod radiation;
pub(crate) mod saturation;
pub(crate) mod second_order;
pub(crate) mod separation;
pub(crate) mod slow_mode;
pub(crate) mod spikes;
pub(crate) mod temperature_dependence;
pub(crate) mod varying;

mod about;
mod context;
mod flow_reference;
mod identifier;
mod known;
mod of_members;
mod parameter;
mod twin;

use std::ops::Range;
use std::sync::Arc;

use twinlag_optimise::Scale;

pub use about::About;
pub use context::Context;
pub use identifier::Identifier;
pub use known::KnownEffect;
pub use parameter::{Derived, Domain, Freedom, OfParameters, Parameter};
pub use twin::Twin;

use crate::departure::Departure;
use crate::directions::Parts;
use crate::error::ModelError;
use crate::gas::Gas;
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::Plant;

/// Where an effect sits, and the numbers that describe it.
#[derive(Clone, Debug)]
pub struct Seat {
    /// Which effect.
    pub identifier: Identifier,
    /// Channel 0 or 1; `None` where it is of both. Functions of time or temperature that an effect of one channel
    /// installs are that sensor's.
    pub channel: Option<usize>,
    /// Parameters that are fitted, in the order in which [`Effect::install`] takes them.
    pub parameters: Vec<Parameter>,
}

impl Seat {
    /// A seat of an effect.
    pub fn new(identifier: Identifier, channel: Option<usize>, parameters: Vec<Parameter>) -> Self {
        Self { identifier, channel, parameters }
    }
}

/// An effect in one place with its parameters: what can be added to the model.
///
/// Three functions are an effect; the others have defaults that hold for most. An example in a crate of its own is
/// `examples/own-effect`.
pub trait Effect: Send + Sync {
    /// Where it sits, and its parameters.
    fn seat(&self) -> &Seat;

    /// Values that fits start from, at least one set, each with as many values as there are parameters, finite and within
    /// their bounds. With a single set even an obvious effect can be missed.
    fn starts(&self) -> Vec<Vec<f64>>;

    /// By how much the effect delays changes in its channel that are slow beside all its lags, s. A search then also starts a fit at which the shorter
    /// time constant makes up for this delay. 0 if not implemented, as for a slow mode, beside whose lag few changes are slow: no such start.
    fn lag_s(&self, _values: &[f64]) -> f64 {
        0.0
    }

    /// Puts the effect into the model. Derivatives of the cost come from the arithmetic with `values`.
    fn install(&self, values: &[Number], plant: &mut Plant);

    /// Parts by which derivatives are computed in place of those by each parameter: of an effect whose parameters change a
    /// function along the record, and that is quicker to compute where each part acts. By default there are none.
    fn parts(&self, _values: &[f64]) -> Option<Parts> {
        None
    }

    /// Which of [`Self::parameters`] is the size of the effect, counted from 0; `None` where none is, as in a function of
    /// time.
    fn main(&self) -> Option<usize> {
        Some(0)
    }

    /// How large the effect usually is where there is one: the standard deviation beforehand of [`Self::main`] about where it
    /// changes nothing, in its unit. By default what counts as typical of its scale, or the largest of [`Self::starts`] where
    /// that is logarithmic. An effect that has no such parameter has no usual size either, and is not looked for unseen.
    fn usual_size(&self) -> Option<f64> {
        let main = self.main()?;
        Some(match self.parameters()[main].variable.scale {
            Scale::Linear { typical } => typical,
            Scale::Logarithmic => self.starts().iter().map(|start| start[main]).fold(0.0, f64::max),
        })
    }

    /// Whether its parameters enter functions of time or temperature of each sensor. By default those of the channel it sits in, or of
    /// both.
    fn has_functions_in(&self) -> [bool; 2] {
        [0, 1].map(|i| self.channel().is_none_or(|channel| channel == i))
    }

    /// Whether this form gives way to another form of the same effect where the record hardly distinguishes them. A curvature of the
    /// first channel does: calibration is relative, and named of the second.
    fn yields_to_other_forms(&self) -> bool {
        false
    }

    /// Forms of this effect with more or fewer parameters, tried once it is chosen.
    fn sizes(&self) -> Vec<Shared> {
        Vec::new()
    }

    /// This effect with one parameter more, and where its fit starts from `values` of this one. Tried whenever more is
    /// known, since what is small hides behind what is large.
    fn extended(&self, _values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        None
    }

    /// Forms of this effect with one parameter less, each with the values that its fit starts from; `values` are those of this form.
    /// They are tried whenever another effect has been added: a parameter may have stood in for it. By default there are none.
    fn reduced(&self, _values: &[f64]) -> Vec<(Shared, Vec<f64>)> {
        Vec::new()
    }

    /// The whole form of which this one is a part, such as gain and offset of a gain alone, and where its fit starts. Intervals of the
    /// part have to cover it, since the rest is small in an instrument and not nil. `None`, the default, where this form is whole.
    fn whole(&self, _values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        None
    }

    /// Whether parameters belong to a record and not to the rig: the phase of a line, a function of time. They are
    /// fitted again where the effect is known from another record, and of several records each has its own. Such an effect
    /// installs functions of time and offsets, nothing else.
    fn is_of_the_record(&self) -> bool {
        false
    }

    /// The record, from 0, that one of [`Self::parameters`] belongs to, in a model of several; `None` where all share it.
    fn record_of(&self, _parameter: usize) -> Option<usize> {
        None
    }

    /// The effect as one record has it, and the places of its values, in a model of several where each has its own.
    fn in_record(&self, _number: usize) -> Option<(Shared, Range<usize>)> {
        None
    }

    /// What a record would mean if an exact twin of the effect were the cause: each is right with the time constants that it says, and
    /// no record distinguishes them. By default there are none.
    ///
    /// - `tau_s`: time constants with this effect, s, where both sensors are first-order lags
    fn twins(&self, _values: &[f64], _tau_s: [f64; 2]) -> Vec<Twin> {
        Vec::new()
    }

    /// Prior knowledge of the parameters: functions of `values` that have zero mean and unit variance beforehand.
    fn prior(&self, _values: &[Number]) -> Vec<Number> {
        Vec::new()
    }

    /// This effect with the body that it holds in equilibrium with the gas as each record began. `None` of one that holds none.
    fn in_equilibrium(&self, _plant: &Plant, _observations: &Observations) -> Option<Shared> {
        None
    }

    /// How far from equilibrium the body that it holds began, as each record says, where it is taken to have begun there. Of an effect
    /// that [`Self::in_equilibrium`] did not make there are none.
    fn departures(&self) -> &[Departure] {
        &[]
    }

    /// This effect with another estimate of the gas temperature. `None` of one that does not depend on it.
    fn in_gas(&self, _gas: &Arc<Gas>) -> Option<Shared> {
        None
    }

    /// Numbers that are reported beside the fitted ones.
    fn derived(&self) -> Vec<Derived> {
        Vec::new()
    }

    /// The parameter that is a lag in series with the time constant of its sensor, by its place: the model depends on their sum and product
    /// alone. The time constant is the larger. `None` if there is none.
    fn series_lag(&self) -> Option<usize> {
        None
    }

    /// Which effect it is.
    fn identifier(&self) -> Identifier {
        self.seat().identifier
    }

    /// What is known of it before any record.
    fn about(&self) -> &'static About {
        self.seat().identifier.about()
    }

    /// The channel that it sits in, 0 or 1; `None` where it is of both.
    fn channel(&self) -> Option<usize> {
        self.seat().channel
    }

    /// Parameters that are fitted.
    fn parameters(&self) -> &[Parameter] {
        &self.seat().parameters
    }

    /// Whether it is a model of noise, fitted by the likelihood of the residual and not by its energy.
    fn is_noise(&self) -> bool {
        self.about().is_noise
    }
}

/// An effect that several models share.
pub type Shared = Arc<dyn Effect>;

/// Every candidate of `effects`. Defects of the data have none: they are dealt with before. Of several records, those that belong
/// to a record have parameters of their own in each.
pub fn candidates(effects: &[Identifier], context: &Context) -> Vec<Shared> {
    effects.iter().flat_map(|e| candidates_of(*e, context)).collect()
}

fn candidates_of(effect: Identifier, context: &Context) -> Vec<Shared> {
    let make = effect.about().candidates;
    let all = make(context);
    if context.members.len() < 2 || !all.iter().any(|candidate| candidate.is_of_the_record()) {
        return all;
    }
    let of_member: Vec<_> = context.each_member().map(|(member, own)| (member, make(&own))).collect();
    let in_each = |candidate: Shared| {
        if candidate.is_of_the_record() { of_members::in_each(&candidate, &of_member) } else { Some(candidate) }
    };
    all.into_iter().filter_map(in_each).collect()
}

/// That effects of other crates among `effects` have names of their own and return what [`Effect`] promises. Those of
/// this library are held to it by a test.
pub(crate) fn check_all(effects: &[Identifier], context: &Context) -> Result<(), ModelError> {
    for foreign in effects.iter().filter(|e| !e.is_of_this_library()) {
        let same = effects.iter().filter(|e| *e == foreign).count();
        if same > 1 {
            return Err(ModelError::EffectTwice { effect: foreign.name() });
        }
        candidates(&[*foreign], context).iter().try_for_each(check)?;
    }
    Ok(())
}

/// That an effect returns what [`Effect`] promises, in all its sizes.
pub(crate) fn check(effect: &Shared) -> Result<(), ModelError> {
    check_one(effect)?;
    effect.sizes().iter().try_for_each(check_one)
}

fn check_one(effect: &Shared) -> Result<(), ModelError> {
    let wrong = |expected, got| Err(ModelError::Effect { effect: effect.identifier().name(), expected, got });
    let (parameters, starts) = (effect.parameters(), effect.starts());
    if let Some(channel) = effect.channel().filter(|channel| *channel > 1) {
        return wrong("channel 0 or 1, or none", channel as f64);
    }
    if let Some(main) = effect.main().filter(|main| *main >= parameters.len()) {
        return wrong("a main parameter that it has, counted from 0", main as f64);
    }
    if let Some(usual) = effect.usual_size().filter(|usual| !(usual.is_finite() && *usual > 0.0)) {
        return wrong("a usual size that is finite and above 0", usual);
    }
    if starts.is_empty() {
        return wrong("at least one set of values to start from", 0.0);
    }
    if let Some(start) = starts.iter().find(|start| start.len() != parameters.len()) {
        return wrong("as many values in each start as it has parameters", start.len() as f64);
    }
    let is_outside = |(p, x): &(&Parameter, &f64)| !(p.variable.lower..=p.variable.upper).contains(*x);
    let mut values = starts.iter().flat_map(|start| parameters.iter().zip(start));
    if let Some((_, value)) = values.find(is_outside) {
        return wrong("starts that are finite and within the bounds of their parameters", *value);
    }
    Ok(())
}

/// Of `candidates`, in all their sizes, the one that `known` describes: in its channel, with all parameters given, and
/// with the most of them.
pub fn described_by(known: &KnownEffect, candidates: Vec<Shared>) -> Option<Shared> {
    let is_described =
        |e: &Shared| e.channel() == known.channel && e.parameters().iter().all(|p| known.parameter(p.name).is_some());
    let sizes: Vec<Shared> = candidates.iter().flat_map(|e| e.sizes()).collect();
    candidates.into_iter().chain(sizes).filter(is_described).max_by_key(|e| e.parameters().len())
}

#[cfg(test)]
mod tests {
    use twinlag_optimise::Variable;

    use super::*;
    use crate::observations::{Observations, Stretch};
    use crate::prepare::Prepared;
    use crate::settings::Settings;

    static FOREIGN: About = About::new("foreign", 20, |_| vec![Foreign::with(|_| ())]);
    static LATE: About = About::new("late", 21, late);
    static DELAY: About = About::new("delay", 20, |_| Vec::new());

    /// An effect that starts outside its bounds.
    fn late(_: &Context) -> Vec<Shared> {
        vec![Foreign::with(|f| (f.seat.identifier, f.starts[0][0]) = (Identifier::of(&LATE), 3.0))]
    }

    /// An effect of one parameter between −1 and 1, which does nothing.
    struct Foreign {
        seat: Seat,
        starts: Vec<Vec<f64>>,
        main: Option<usize>,
    }

    impl Foreign {
        fn with(change: impl Fn(&mut Self)) -> Shared {
            let parameters = vec![Parameter::new("size", "1", Variable::linear("size", 0.1, -1.0, 1.0))];
            let seat = Seat::new(Identifier::of(&FOREIGN), Some(1), parameters);
            let mut out = Self { seat, starts: vec![vec![0.1], vec![-1.0]], main: Some(0) };
            change(&mut out);
            Arc::new(out)
        }
    }

    impl Effect for Foreign {
        fn seat(&self) -> &Seat {
            &self.seat
        }

        fn starts(&self) -> Vec<Vec<f64>> {
            self.starts.clone()
        }

        fn install(&self, _values: &[Number], _plant: &mut Plant) {}

        fn main(&self) -> Option<usize> {
            self.main
        }
    }

    fn observations(samples: u32) -> Observations {
        let time_s: Vec<f64> = (0..samples).map(|k| 0.01 * f64::from(k)).collect();
        let gas_c = |t: f64| 300.0 + (9.0 * t).sin() + (31.0 * t).sin().powi(3);
        let reading_c = [0.0, 0.4].map(|late_s| time_s.iter().map(|t| gas_c(t - late_s)).collect());
        Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.01)).expect("finite and long")
    }

    #[test]
    fn an_effect_that_breaks_a_promise_is_refused_with_what_was_expected() {
        assert_eq!(check(&Foreign::with(|_| ())), Ok(()));
        assert_eq!(check(&Foreign::with(|f| f.main = None)), Ok(()));
        let refused = |change: fn(&mut Foreign), expects: &str| {
            let error = check(&Foreign::with(change)).expect_err(expects).to_string();
            assert!(error.contains("\"foreign\"") && error.contains(expects), "{error}");
        };
        refused(|f| f.starts.clear(), "at least one set");
        refused(|f| f.starts[1].push(0.1), "as many values");
        refused(|f| f.starts[1].clear(), "as many values");
        refused(|f| f.starts[0][0] = 1.1, "within the bounds");
        refused(|f| f.starts[1][0] = f64::NAN, "finite");
        refused(|f| f.main = Some(1), "main parameter");
        refused(|f| f.seat.channel = Some(2), "channel 0 or 1");
    }

    /// Where a record meets the settings, before any fit.
    #[test]
    fn settings_with_such_an_effect_or_with_one_twice_are_refused() {
        let with = |more: &[&'static About]| {
            let mut settings = Settings::default();
            settings.effects.extend(more.iter().map(|about| Identifier::of(about)));
            Prepared::new(&observations(2000), &settings).map(|_| ())
        };
        assert_eq!(with(&[&FOREIGN]), Ok(()));
        let named = |result: Result<(), ModelError>| match result.expect_err("refused") {
            ModelError::Effect { effect, got, .. } => (effect, got),
            ModelError::EffectTwice { effect } => (effect, 2.0),
            other => panic!("{other}"),
        };
        assert_eq!(named(with(&[&FOREIGN, &LATE])), ("late", 3.0));
        assert_eq!(named(with(&[&FOREIGN, &FOREIGN])), ("foreign", 2.0));
        assert_eq!(named(with(&[&DELAY])), ("delay", 2.0));
    }

    #[test]
    fn the_effects_of_this_library_keep_the_promises() {
        for samples in [60, 200, 2000] {
            let prepared = Prepared::new(&observations(samples), &Settings::default()).expect("a record");
            let context = Context { lines: vec![(20.0, 0)], ..prepared.context };
            let made = candidates(&Identifier::ALL, &context);
            assert!(made.len() > 10, "{}", made.len());
            for effect in &made {
                assert_eq!(check(effect), Ok(()), "{samples} samples");
            }
        }
    }
}
