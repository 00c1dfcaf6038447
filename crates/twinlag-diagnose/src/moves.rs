//! What the loop can do to a model. Each move is proposed with the evidence for it, applied in one
//! place ([`State::apply`]), and kept in the answer.

use serde::{Deserialize, Serialize};
use twinlag_model::{Effort, Fitted, Identifier, ModelError, Prepared, Settings, Watch};

use crate::alternatives::Replacement;
use crate::candidates::{Candidate, Search, kind};
use crate::evidence::Evidence;
use crate::other_delays::delay_s;
use crate::rank::{LookAlike, successor, worth};
use crate::rapid::RapidVariation;
use crate::remark::Remark;

/// A change of the model, and why it was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "move", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Move {
    /// An effect was added.
    Add {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// What it gained.
        evidence: Evidence,
        /// Effects that explained the record as well at the time.
        ties: Vec<Identifier>,
    },
    /// An effect got a parameter more.
    Extend {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// What the effect has gained in all.
        evidence: Evidence,
    },
    /// An effect lost a parameter: effects that came later have made it needless, or each record has one of its own.
    Reduce {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// What the effect has gained in all.
        evidence: Evidence,
    },
    /// A look-alike took the place of an effect.
    Exchange {
        /// The effect that went.
        before: Identifier,
        /// Its channel, as that of the effect that came.
        before_channel: Option<usize>,
        /// The effect that came.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// Deviance by which it is better, its parameters counted.
        advantage: f64,
    },
    /// An effect was compared with its look-alikes again, and stays, with the ties that it now has.
    Keep {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// Effects that explain the record as well, now that more is known.
        ties: Vec<Identifier>,
    },
    /// An effect was taken out.
    Remove {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// Deviance that it saved; `None` of a noise, which went since none of its colour is left
        /// over without it.
        loss: Option<f64>,
    },
    /// An effect was taken out since it does not help on records that had no part in finding it.
    Withdraw {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both, or relative.
        channel: Option<usize>,
        /// Deviance that it saves there, not above 0: it alone, or all effects that were taken out together.
        gain: f64,
    },
    /// Of delays that fit as well as the best, the shortest was taken.
    ChooseDelay {
        /// The delay that the search had found, s.
        before_s: f64,
        /// The shortest, s.
        after_s: f64,
    },
    /// Noise levels were lowered to what is left over.
    LowerNoise {
        /// Energy of the residual per residual beforehand.
        energy: f64,
    },
    /// Frequencies were weighted by the spectrum of what is left over from there on.
    Reweigh {
        /// Energy of the residual per residual beforehand.
        energy: f64,
    },
}

impl Move {
    /// That of an effect to a form with fewer parameters.
    fn reduction(shorter: &Candidate) -> Self {
        let (effect, channel) = (shorter.effect.identifier(), shorter.effect.channel());
        Self::Reduce { effect, channel, evidence: Evidence::of(shorter) }
    }

    /// What the reader has to know of it.
    pub(crate) fn remark(&self) -> Option<Remark> {
        match self {
            Self::Exchange { before, effect, .. } if before == effect => Some(Remark::OtherChannel { effect: *effect }),
            Self::Exchange { before, effect, .. } => Some(Remark::Replaced { before: *before, after: *effect }),
            Self::Remove { effect, .. } => Some(Remark::Needless { effect: *effect }),
            Self::Withdraw { effect, .. } => Some(Remark::DoesNotTransfer { effect: *effect }),
            Self::LowerNoise { .. } => Some(Remark::NoiseLowered),
            Self::Add { .. }
            | Self::Extend { .. }
            | Self::Reduce { .. }
            | Self::Keep { .. }
            | Self::ChooseDelay { .. }
            | Self::Reweigh { .. } => None,
        }
    }
}

/// A move with what it makes of the model.
pub(crate) struct Proposal {
    entry: Move,
    change: Change,
}

impl Proposal {
    /// Another form of effect `index`, tied as it was.
    fn of_form(entry: Move, index: usize, candidate: Candidate, ties: &[Candidate]) -> Self {
        Self { entry, change: Change::Put(index, Box::new(Taken { candidate, ties: ties.to_vec() })) }
    }

    /// Whether one effect takes the place of another.
    pub(crate) fn is_exchange(&self) -> bool {
        matches!(self.entry, Move::Exchange { .. })
    }
}

enum Change {
    /// One effect more, and the shorter form of the one that has lost a parameter to make room for it.
    Append {
        taken: Box<Taken>,
        shorter: Option<Box<Candidate>>,
    },
    /// Another form of an effect, or another effect, in the place of one.
    Put(usize, Box<Taken>),
    /// Other ties of an effect.
    Ties(usize, Vec<Candidate>),
    /// Without an effect, fitted again.
    Drop(usize, Box<Fitted>),
    /// Other parameters of the model that there is.
    Refit(Box<Fitted>),
    Levels,
    Weights,
}

/// An effect that was added, with those that explain the record as well.
#[derive(Clone)]
pub(crate) struct Taken {
    pub(crate) candidate: Candidate,
    pub(crate) ties: Vec<Candidate>,
}

impl Taken {
    fn effect(&self) -> Identifier {
        self.candidate.effect.identifier()
    }

    fn is_noise(&self) -> bool {
        self.candidate.effect.is_noise()
    }
}

fn identifiers(candidates: &[Candidate]) -> Vec<Identifier> {
    candidates.iter().map(|c| c.effect.identifier()).collect()
}

/// Which samples of a record were searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Searched {
    /// All of them.
    All,
    /// Pieces first, of so many samples; and then all of them, or none of the others where the pieces left more than noise.
    Pieces { samples: usize, is_screened: bool },
    /// A stretch, since the time constants change too fast for all of it.
    Stretch,
}

/// How far the loop has come.
pub(crate) struct State<'a> {
    pub(crate) prepared: Prepared,
    settings: &'a Settings,
    watch: Watch<'a>,
    /// Two lags.
    pub(crate) base: Fitted,
    /// With what was added.
    pub(crate) current: Fitted,
    pub(crate) taken: Vec<Taken>,
    pub(crate) moves: Vec<Move>,
    /// Effects with time constants far from those that there are, of which none was accepted.
    pub(crate) far: Vec<Candidate>,
    pub(crate) searched: Searched,
    /// Effects with such time constants that these pieces do not exclude.
    pub(crate) far_in_pieces: Option<Vec<Candidate>>,
    /// A change of the time constants that is too fast for a model of the whole record.
    pub(crate) rapid: Option<RapidVariation>,
}

impl<'a> State<'a> {
    /// Two lags.
    pub(crate) fn new(mut prepared: Prepared, settings: &'a Settings, watch: Watch<'a>) -> Self {
        let base = prepared.base(settings);
        Self::of(base, prepared, settings, watch)
    }

    /// Two lags that were fitted.
    pub(crate) fn of(base: Fitted, prepared: Prepared, settings: &'a Settings, watch: Watch<'a>) -> Self {
        let current = base.clone();
        Self {
            prepared,
            settings,
            watch,
            base,
            current,
            taken: Vec::new(),
            moves: Vec::new(),
            far: Vec::new(),
            searched: Searched::All,
            far_in_pieces: None,
            rapid: None,
        }
    }

    pub(crate) fn search(&self) -> Search<'_> {
        Search::of(&self.prepared, self.settings, self.watch)
    }

    pub(crate) fn has_noise(&self) -> bool {
        self.current.model.noise().is_some()
    }

    /// Makes a move, and puts it down.
    pub(crate) fn apply(&mut self, proposal: Proposal) {
        let Proposal { entry, change } = proposal;
        let mut shortened = None;
        match change {
            Change::Append { mut taken, shorter } => {
                self.current = taken.candidate.fitted.clone().in_order();
                if taken.effect().about().is_narrow {
                    // A line is in the third differences as well.
                    self.prepared.find_levels(&self.current);
                    self.refit();
                }
                shortened = taken.candidate.shortened.take().zip(shorter);
                self.taken.push(*taken);
            }
            Change::Put(index, taken) => {
                self.current = taken.candidate.fitted.clone().in_order();
                self.taken[index] = *taken;
            }
            Change::Ties(index, ties) => self.taken[index].ties = ties,
            Change::Drop(index, fitted) => {
                self.current = *fitted;
                self.taken.remove(index);
            }
            Change::Refit(fitted) => self.current = fitted.in_order(),
            Change::Levels => {
                self.prepared.lower_levels(&self.current, self.settings);
                self.refit();
            }
            Change::Weights => {
                self.prepared.weigh_by(&self.current);
                self.refit();
            }
        }
        self.moves.push(entry);
        if let Some((index, shorter)) = shortened {
            self.moves.push(Move::reduction(&shorter));
            self.taken[index].candidate = *shorter;
        }
    }

    /// Both models with the levels and weights that there are now.
    pub(crate) fn refit(&mut self) {
        (self.current, self.base) = (self.prepared.refit(&self.current), self.prepared.refit(&self.base));
    }

    /// Adds the effect that explains best what is left over.
    pub(crate) fn add(&self) -> Result<Option<Proposal>, ModelError> {
        let search = self.search().beside(&self.current);
        let candidates = search.fitted(&self.current)?;
        Ok(self.addition(&search, &candidates))
    }

    /// Adds the effect that explains the record best with time constants far from those that there are; where none is
    /// accepted, keeps what came closest.
    pub(crate) fn add_from_afar(&mut self) -> Result<Option<Proposal>, ModelError> {
        let search = self.search().beside(&self.current);
        let candidates = match &self.far_in_pieces {
            Some(far) => search.far_in_whole(&self.current, far)?,
            None => search.far_away(&self.current)?,
        };
        let addition = self.addition(&search, &candidates);
        self.far = if addition.is_none() { candidates } else { Vec::new() };
        Ok(addition)
    }

    fn addition(&self, search: &Search<'_>, candidates: &[Candidate]) -> Option<Proposal> {
        let (candidate, ties) = search.accepted(&self.current, candidates)?;
        let entry = Move::Add {
            effect: candidate.effect.identifier(),
            channel: candidate.effect.channel(),
            evidence: Evidence::of(&candidate),
            ties: identifiers(&ties),
        };
        let shortened = |index: usize| search.shortened(&candidate.fitted, index, &self.taken[index].candidate);
        let shorter = candidate.shortened.map(shortened).map(Box::new);
        Some(Proposal { entry, change: Change::Append { taken: Box::new(Taken { candidate, ties }), shorter } })
    }

    /// Takes the shortest of all delays that fit as well as the best.
    pub(crate) fn choose_delay(&self) -> Option<Proposal> {
        let before_s = delay_s(&self.current)?;
        let (after_s, fitted) = self.search().delays(&self.current).into_iter().next()?;
        let entry = Move::ChooseDelay { before_s, after_s };
        (after_s != before_s).then(|| Proposal { entry, change: Change::Refit(Box::new(fitted)) })
    }

    /// Takes effect `index` out of the model, and gives it; what was compared with it beside it is forgotten.
    pub(crate) fn take_out(&mut self, index: usize) -> Taken {
        let (model, theta) = self.current.without(index);
        self.current = Fitted { model, theta, ..self.current.clone() };
        self.taken.iter_mut().for_each(|taken| taken.ties.clear());
        self.far.clear();
        self.taken.remove(index)
    }

    /// Gives effect `index` a parameter more, now that more is known.
    pub(crate) fn extend(&self, index: usize) -> Option<Proposal> {
        let Taken { candidate, ties } = &self.taken[index];
        let candidate = self.search().extended(&self.current, index, candidate)?;
        let (effect, channel) = (candidate.effect.identifier(), candidate.effect.channel());
        let entry = Move::Extend { effect, channel, evidence: Evidence::of(&candidate) };
        Some(Proposal::of_form(entry, index, candidate, ties))
    }

    /// Takes from effect `index` a parameter that later effects have made needless.
    pub(crate) fn reduce(&self, index: usize) -> Option<Proposal> {
        if !self.may_be_needless(index) {
            return None;
        }
        let Taken { candidate, ties } = &self.taken[index];
        let candidate = self.search().reduced(&self.current, index, candidate)?;
        Some(Proposal::of_form(Move::reduction(&candidate), index, candidate, ties))
    }

    /// Whether later effects can have made effect `index`, or a part of it, needless: there are some, and no noise, whose weights hide what
    /// made them.
    fn may_be_needless(&self, index: usize) -> bool {
        index + 1 < self.taken.len() && !self.has_noise()
    }

    /// Takes out effect `index` if later effects have made it needless.
    pub(crate) fn remove_needless(&self, index: usize) -> Option<Proposal> {
        if !self.may_be_needless(index) {
            return None;
        }
        let (model, theta) = self.current.without(index);
        let search = self.search();
        let without = model.fit(&theta, search.observations, search.selection, Effort::Compare);
        let (effect, parameters) = (&self.current.model.effects[index], self.current.model.range(index).len());
        let loss = search.white_gain(&without, &self.current, effect);
        let is_needless = loss < worth(parameters, search.residuals(&self.current, effect), search.policy);
        is_needless.then(|| self.removal(index, without, Some(loss)))
    }

    /// Takes noise out that came before the effects that explain it: model error, seen from afar,
    /// looks like noise.
    pub(crate) fn remove_explained_noise(&self) -> Option<Proposal> {
        let index = self.current.model.noise().filter(|index| index + 1 < self.taken.len())?;
        let (model, theta) = self.current.without(index);
        let model = model.with_noise(self.prepared.levels.std_k);
        let search = self.search();
        let without = model.fit(&theta, search.observations, search.selection, Effort::Compare);
        let is_explained = !search.needs_noise(&without, &self.taken[index].candidate);
        is_explained.then(|| self.removal(index, without, None))
    }

    /// Takes out effect `index`, which gains no deviance on records that were left out.
    pub(crate) fn withdrawal(&self, index: usize, gain: f64) -> Proposal {
        let (model, theta) = self.current.without(index);
        let model = if self.taken[index].is_noise() { model.with_noise(self.prepared.levels.std_k) } else { model };
        let search = self.search();
        let without = model.fit(&theta, search.observations, search.selection, Effort::Compare);
        let effect = &self.taken[index].candidate.effect;
        let entry = Move::Withdraw { effect: effect.identifier(), channel: effect.channel(), gain };
        Proposal { entry, change: Change::Drop(index, Box::new(without)) }
    }

    /// Puts the noise that another search added, and its removal, before all moves.
    pub(crate) fn begin_with_removed_noise(&mut self, other: &State<'_>) {
        let noise = other.moves.iter().find_map(|entry| match entry {
            Move::Add { effect, channel, .. } if effect.is_noise() => Some((entry.clone(), *effect, *channel)),
            _ => None,
        });
        if let Some((added, effect, channel)) = noise {
            self.moves.splice(0..0, [added, Move::Remove { effect, channel, loss: None }]);
        }
    }

    fn removal(&self, index: usize, without: Fitted, loss: Option<f64>) -> Proposal {
        let effect = &self.taken[index].candidate.effect;
        let entry = Move::Remove { effect: effect.identifier(), channel: effect.channel(), loss };
        Proposal { entry, change: Change::Drop(index, Box::new(without)) }
    }

    /// Proposes a look-alike in the place of effect `index`, now that more is known, if one is better;
    /// otherwise the ties that the effect now has, if it has or had any. `None` of a noise.
    pub(crate) fn compare(&self, index: usize) -> Result<Option<Proposal>, ModelError> {
        let search = self.search();
        let taken = &self.taken[index];
        if taken.is_noise() {
            return Ok(None);
        }
        let mut alike = search.look_alikes(&self.current, index, &taken.candidate)?;
        let value = |Replacement { candidate, advantage }: &Replacement| LookAlike {
            kind: kind(&candidate.effect),
            can_replace: search.can_replace(&self.current, index, &candidate.fitted),
            advantage: *advantage,
        };
        let values: Vec<LookAlike> = alike.iter().map(value).collect();
        let policy = &self.settings.policy;
        let (effect, channel) = (taken.effect(), taken.candidate.effect.channel());
        let Some(at) = successor(kind(&taken.candidate.effect), &values, policy) else {
            let tied = alike.into_iter().zip(values).filter(|(_, value)| value.is_tied(policy));
            let ties: Vec<Candidate> = tied.map(|(replacement, _)| replacement.candidate).collect();
            let entry = Move::Keep { effect, channel, ties: identifiers(&ties) };
            if ties.is_empty() && taken.ties.is_empty() {
                return Ok(None);
            }
            return Ok(Some(Proposal { entry, change: Change::Ties(index, ties) }));
        };
        let replacement = alike.swap_remove(at);
        let entry = Move::Exchange {
            before: effect,
            before_channel: channel,
            effect: replacement.candidate.effect.identifier(),
            channel: replacement.candidate.effect.channel(),
            advantage: replacement.advantage,
        };
        let taken = Taken { candidate: replacement.candidate, ties: Vec::new() };
        Ok(Some(Proposal { entry, change: Change::Put(index, Box::new(taken)) }))
    }

    /// Compares again what was compared beside an effect that has been taken out since: ties hold beside the effects that there are.
    pub(crate) fn compare_again(&mut self) -> Result<(), ModelError> {
        for index in 0..self.taken.len() {
            let effects = self.current.model.effects.len();
            let is_of_others = |tie: &Candidate| tie.fitted.model.effects.len() != effects;
            if self.taken[index].ties.iter().any(is_of_others)
                && let Some(proposal) = self.compare(index)?
            {
                self.apply(proposal);
            }
        }
        Ok(())
    }

    /// Lowers noise levels to what is left over, where that is clearly less.
    pub(crate) fn lower_noise(&self) -> Option<Proposal> {
        let is_due = self.prepared.has_high_levels(&self.current);
        let entry = Move::LowerNoise { energy: self.current.mean_energy() };
        is_due.then_some(Proposal { entry, change: Change::Levels })
    }

    /// Weighs frequencies by the spectrum of what is left over, once, where nothing explains it and
    /// it is far more than noise.
    pub(crate) fn reweigh(&self) -> Option<Proposal> {
        let is_reweighed = self.moves.iter().any(|m| matches!(m, Move::Reweigh { .. }));
        let energy = self.current.mean_energy();
        let is_due = !is_reweighed && !self.has_noise() && energy >= self.settings.policy.far_off_energy;
        is_due.then_some(Proposal { entry: Move::Reweigh { energy }, change: Change::Weights })
    }
}
