//! The numbers of a fit, each with its grade.

use twinlag_model::{Identifier, KnownTimeConstant, ModelFit, Policy, TimeConstant};
use twinlag_optimise::End;

use crate::grade::{Basis, Judgement, Number, Reason, RecordScatter};
use crate::transfer::EffectInChannel;

/// Grades of the numbers that every fit has.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Judgements {
    /// Both time constants.
    pub time_constants: [Judgement; 2],
    /// Their difference, or the total delay of channel 2.
    pub difference: Judgement,
}

impl Judgements {
    /// Takes back a difference of time constants neither of which is determined: it is that of where the fit ended in their valley.
    ///
    /// - `is_same_throughout`: whether the difference is the same for all time constants that the record allows
    pub fn withhold_from_valley(&mut self, fit: &mut ModelFit, is_same_throughout: bool) {
        let is_neither_determined = fit.time_constants.iter().all(|t| t.value_s.is_none());
        if is_neither_determined && !is_same_throughout {
            fit.difference = TimeConstant::default();
            self.difference = Judgement::of(&[Reason::NotDetermined]);
        }
    }
}

/// What the numbers of a fit are judged by.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Circumstances<'a> {
    /// What all of them rest on.
    pub basis: Basis,
    /// Time constants that were known beforehand.
    pub known: &'a [KnownTimeConstant],
    /// Length of the record, s.
    pub span_s: f64,
    /// Whether the difference is the total delay of channel 2, which holds wherever the fit ended.
    pub is_total_delay: bool,
    /// Delays that fit as well as that of the model, the shortest first, s.
    pub other_delays_s: Vec<f64>,
    /// The effect, in its channel, that both time constants and their difference are right with alone, where others that explain
    /// the record as well give other values.
    pub causes: [Option<EffectInChannel>; 3],
    /// Effects that may be there unseen and would move the number, for both time constants and their difference.
    pub hidden: [Vec<Identifier>; 3],
    /// Effects that may be there unseen and would move the number, for each parameter of the effects in the model.
    pub hidden_from_parameters: Vec<Vec<Identifier>>,
    /// Effects of the model. Where one of them may be there unseen, it is in the other sensor.
    pub named: Vec<Identifier>,
    /// The numbers that decide.
    pub policy: &'a Policy,
}

/// What was given, for the reader.
pub(crate) fn given(known: &KnownTimeConstant) -> String {
    let KnownTimeConstant { sensor, value_s, std_s } = known;
    let spread = std_s.map_or(String::new(), |std_s| format!(" ± {std_s}"));
    format!("T{} = {value_s}{spread} s", sensor + 1)
}

impl<'a> Circumstances<'a> {
    /// A record of `span_s` seconds, of whose model nothing is known but what `basis` says.
    pub fn new(basis: Basis, known: &'a [KnownTimeConstant], span_s: f64, policy: &'a Policy) -> Self {
        let (causes, hidden_from_parameters) = ([None; 3], Vec::new());
        let hidden = std::array::from_fn(|_| Vec::new());
        let (named, other_delays_s) = (Vec::new(), Vec::new());
        Self {
            basis,
            known,
            span_s,
            is_total_delay: false,
            other_delays_s,
            causes,
            hidden,
            hidden_from_parameters,
            named,
            policy,
        }
    }

    /// Puts down the effects that may be there unseen: for both time constants, their difference, and each parameter.
    ///
    /// - `named`: effects of the model
    pub(crate) fn hide(&mut self, hidden: &[Vec<Identifier>], named: Vec<Identifier>) {
        self.named = named;
        self.hidden = [0, 1, 2].map(|i| hidden[i].clone());
        self.hidden_from_parameters = hidden[3..].to_vec();
    }

    /// What was given beforehand, for the reader.
    fn given(&self) -> impl Iterator<Item = Reason> {
        self.known.iter().map(|known| Reason::Given { what: given(known) })
    }

    /// What all numbers rest on, what was given among it.
    pub fn whole_basis(&self) -> Basis {
        let mut out = self.basis.clone();
        out.reasons.extend(self.given());
        out
    }

    /// Judges the numbers of `fit`, and widens their intervals to what they have to cover.
    pub fn judge(&self, fit: &mut ModelFit) -> Judgements {
        let basis = self.whole_basis();
        let time_constants = [0, 1].map(|i| {
            let is_held = self.known.iter().any(|k| k.sensor == i && k.std_s.is_none());
            if is_held {
                return Judgement::of_given(&basis);
            }
            let between = RecordScatter::of(fit.between.as_ref().and_then(|between| between.parameters[i].as_ref()));
            self.judged(&mut fit.time_constants[i], between, i, &basis)
        });
        let is_on_bound = matches!(&fit.fit.end, End::OnBound(which) if which.iter().any(|i| *i < 2));
        if is_on_bound && !self.is_total_delay {
            fit.difference = TimeConstant::default();
        }
        let between = fit.between.as_ref().filter(|_| !self.is_total_delay);
        let between = RecordScatter::of(between.and_then(|between| between.difference.as_ref()));
        let difference = self.judged(&mut fit.difference, between, 2, &basis);
        Judgements { time_constants, difference }
    }

    fn judged(
        &self,
        number: &mut TimeConstant,
        between: Option<RecordScatter>,
        index: usize,
        basis: &Basis,
    ) -> Judgement {
        let Some(value) = number.value_s else {
            // What was given and is wrong may be why.
            let reasons: Vec<Reason> = basis.against_given().cloned().chain([Reason::NotDetermined]).collect();
            return Judgement::of(&reasons);
        };
        let most_s = self.policy.longest_given_share * self.span_s;
        let cause = self.causes[index].map(|(effect, channel)| Reason::Cause { effect, channel });
        let hidden = Reason::hidden(&self.hidden[index], &self.named);
        let mut own: Vec<Reason> = cause.into_iter().chain(hidden).collect();
        if value.abs() > most_s {
            own.push(Reason::TooLong { most_s });
        }
        let TimeConstant { standard_error_s: standard_error, interval_95_s: interval_95, scatter, .. } = *number;
        let (judgement, interval) =
            Number { value, standard_error, interval_95, scatter, between, is_positive: index < 2 }.judged(
                own,
                basis,
                self.policy,
            );
        number.interval_95_s = interval;
        judgement
    }
}
