//! Whether the record contradicts what was given of the time constants.
//!
//! What was given pulls the fit to it, and effects may be found that make up for a wrong value. So the record is fitted without it.
//! Where two lags then leave only noise, the deviance that what was given costs them is a chi-square with as many degrees of freedom as
//! there are values. It speaks against what was given if effects with that leave clearly more than two lags without, their numbers
//! allowed for; where they leave about as much, either may be. So it is with each model that has one effect less. Otherwise the last
//! model is fitted without it in their place: its effects may be wrong, so numbers are conditional. Where that leaves more than noise as well,
//! what is missing may account for the deviance. A fit that has then left behind what was given with a deviation may not be used.

use twinlag_model::{
    ChannelNoise, Effort, Fitted, Identifier, KnownTimeConstant, ModelFit, Observations, Policy, Selection, Settings,
    summarise,
};

use crate::grade::{Grade, REJECTING_CHI2, Reason};
use crate::judge::given;
use crate::moves::{Move, State};
use crate::remark::Remark;

/// Quantiles of the chi-square distribution with one and with two degrees of freedom that chance exceeds once in 10⁴, as a test of
/// the residual does.
const CONTRADICTING_DEVIANCES: [f64; 2] = [REJECTING_CHI2, 18.42];
/// Standard deviations of what was given beyond which the fit leaves it behind: by chance once in 370.
const LEFT_BEHIND_DEVIATIONS: f64 = 3.0;
/// Points of the grid of time constants from which the record is fitted without what was given.
const STARTS: usize = 3;

/// What speaks against what was given.
pub(crate) struct Contradiction {
    what: String,
    /// The time constants without what was given, for the reader, where they are to be had.
    instead: Option<String>,
    deviations: f64,
    /// Effects that are not needed without what was given.
    needless: Vec<Identifier>,
    /// Of numbers that rest on what was given, as far as this goes.
    grade: Grade,
}

impl Contradiction {
    /// What a fit without what was given says of that; `None` where nothing was given, or the record does not contradict it.
    ///
    /// - `with_effects`: the last model
    pub(crate) fn find(state: &State<'_>, with_effects: &Fitted, settings: &Settings, policy: &Policy) -> Option<Self> {
        let Settings { known, .. } = settings;
        if known.is_empty() {
            return None;
        }
        let (observations, everything) = (&state.prepared.observations, &state.prepared.everything);
        let of = |held: &Fitted, free: &Fitted, selection: &Selection, levels: &ChannelNoise, grade| {
            let fit = summarise(free, observations, selection, levels, policy);
            let deviance = (held.chi2 - free.chi2) / free.mean_energy().max(1.0);
            let beyond = CONTRADICTING_DEVIANCES[known.len().min(2) - 1];
            (!fit.is_contradicted() && deviance > beyond).then(|| Self {
                what: known.iter().map(given).collect::<Vec<_>>().join(" and "),
                instead: Some(instead(settings, &fit, free)),
                deviations: deviance.sqrt(),
                needless: Vec::new(),
                grade,
            })
        };
        // Against the last model, a model without some of its effects.
        let without = |needless: &[Identifier], fewer: [&Fitted; 2], selection: &Selection, levels: &ChannelNoise| {
            let [held, free] = fewer;
            let grade = match lost_by_effects(with_effects, free, settings, observations, selection) {
                Some(deviance) if deviance < 0.0 => return None,
                Some(deviance) if deviance < CONTRADICTING_DEVIANCES[0] => Grade::Go,
                _ => Grade::NoGo,
            };
            Some(Self { needless: needless.to_vec(), ..of(held, free, selection, levels, grade)? })
        };
        let effects: Vec<Identifier> = with_effects.model.effects.iter().map(|effect| effect.identifier()).collect();
        // Where two lags alone leave only noise, effects that were found may make up for what was given.
        let two_lags = |selection: &Selection, levels: &ChannelNoise| {
            let model = state.base.model.clone().with_noise(levels.std_k);
            let alone = model.clone().knowing_nothing().fit_over_grid(&[], STARTS, observations, selection);
            let held = model.fit(&state.base.theta, observations, selection, Effort::Finish);
            without(&effects, [&held, &alone], selection, levels)
        };
        let levels = &state.prepared.levels;
        let of_two_lags = two_lags(everything, levels).or_else(|| {
            // A fit that a wrong value spoils may have put what it leaves over into noise levels or weights.
            let is_put = |entry: &Move| matches!(entry, Move::LowerNoise { .. } | Move::Reweigh { .. });
            let (selection, levels) = state.moves.iter().any(is_put).then(|| state.prepared.before_residuals())?;
            two_lags(&selection, levels)
        });
        let without_one = |index: usize| {
            let (model, theta) = with_effects.without(index);
            let free = model.clone().knowing_nothing().fit_over_grid(&theta[2..], STARTS, observations, everything);
            let held = model.fit(&theta, observations, everything, Effort::Finish);
            without(&effects[index..=index], [&held, &free], everything, levels)
        };
        // Beside a noise there is nothing to hold a model against, and of one effect two lags are what is left.
        let count = effects.len();
        let each = if count > 1 && with_effects.model.noise().is_none() { 0..count } else { 0..0 };
        let of_fewer = of_two_lags.into_iter().chain(each.filter_map(without_one)).max_by_key(|found| found.grade);
        if of_fewer.as_ref().is_some_and(Self::is_of_known) {
            return of_fewer;
        }
        let free = with_effects.model.clone().knowing_nothing();
        let free = free.fit(&with_effects.theta, observations, everything, Effort::Finish);
        of(with_effects, &free, everything, levels, Grade::Conditional)
            .or_else(|| Self::left_behind(with_effects, settings))
            .or(of_fewer)
    }

    /// What was given with a deviation, where the last model is far from it: what is missing drags the fit away.
    fn left_behind(with_effects: &Fitted, settings: &Settings) -> Option<Self> {
        let deviations =
            |known: &KnownTimeConstant| Some((with_effects.theta[known.sensor] - known.value_s).abs() / known.std_s?);
        let far = settings.known.iter().filter_map(|known| Some((known, deviations(known)?)));
        let (known, deviations) = far.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_far = deviations > LEFT_BEHIND_DEVIATIONS;
        is_far.then(|| Self { what: given(known), instead: None, deviations, needless: Vec::new(), grade: Grade::NoGo })
    }

    /// Whether what was given is wrong, and effects that were found would make up for that.
    pub(crate) fn is_of_known(&self) -> bool {
        self.grade == Grade::NoGo
    }

    /// The reason that each number has for it.
    pub(crate) fn reason(&self) -> Reason {
        let (what, deviations, grade) = (self.what.clone(), self.deviations, self.grade);
        match (&self.instead, grade) {
            (None, _) => Reason::LeftBehind { what, deviations },
            (Some(_), Grade::Go) => Reason::EffectsOrGiven { what },
            (Some(_), _) => Reason::Contradicted { what, deviations, grade },
        }
    }

    /// The remark that says it, where there are other time constants to name.
    pub(crate) fn remark(self) -> Option<Remark> {
        let Self { what, instead, deviations, needless, grade } = self;
        let instead = instead?;
        Some(match grade {
            Grade::Go => Remark::EffectsOrGiven { what, instead, effects: needless },
            _ => Remark::Contradicted { what, instead, deviations },
        })
    }
}

/// The deviance that effects leave with what was given beyond that of `fewer` without it, by Schwarz's criterion: each number
/// that they have more costs the logarithm of the number of residuals. `None` where no effect was found, and beside a noise, whose
/// likelihood is not that of the residual alone.
fn lost_by_effects(
    with_effects: &Fitted,
    fewer: &Fitted,
    settings: &Settings,
    observations: &Observations,
    selection: &Selection,
) -> Option<f64> {
    let Fitted { model, theta, .. } = with_effects;
    if model.effects.is_empty() || model.noise().is_some() {
        return None;
    }
    let energy = model.clone().with_noise(fewer.model.noise_std_k()).energy(theta, observations, selection);
    let more = theta.len() as f64 - fewer.theta.len() as f64 - settings.known.len() as f64;
    Some((energy - fewer.chi2) / fewer.mean_energy().max(1.0) + more * fewer.count.ln())
}

/// The time constants that the record gives without what was given, for the reader.
fn instead(settings: &Settings, fit: &ModelFit, free: &Fitted) -> String {
    let of = |sensor: usize| {
        let error_s = fit.time_constants[sensor].standard_error_s;
        Remark::time_constant(&format!("T{}", sensor + 1), free.theta[sensor], error_s)
    };
    settings.known.iter().map(|known| of(known.sensor)).collect::<Vec<_>>().join(" and ")
}
