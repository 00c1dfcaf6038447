//! Whether the record contradicts what was given of the time constants.
//!
//! What was given pulls the fit to it, and effects may be found that make up for a wrong value. So the record is fitted without it.
//! Where two lags then leave only noise, and clearly less than effects with what was given, their numbers allowed for, the deviance
//! that what was given costs two lags is a chi-square with as many degrees of freedom as there are values. Otherwise the last model is
//! fitted without it in their place: its effects may be wrong, so numbers are conditional. Where that leaves more than noise as well,
//! what is missing may account for the deviance. A fit that has then left behind what was given with a deviation may not be used.

use twinlag_model::{
    ChannelNoise, Effort, Fitted, KnownTimeConstant, ModelFit, Observations, Policy, Selection, Settings, summarise,
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
                grade,
            })
        };
        // Where two lags alone leave only noise, effects that were found make up for what was given.
        let two_lags = |selection: &Selection, levels: &ChannelNoise| {
            let model = state.base.model.clone().with_noise(levels.std_k);
            let alone = model.clone().knowing_nothing().fit_over_grid(&[], STARTS, observations, selection);
            let held = model.fit(&state.base.theta, observations, selection, Effort::Finish);
            let lost = lost_by_effects(with_effects, &alone, settings, observations, selection);
            let are_likelier = lost.is_some_and(|deviance| deviance < CONTRADICTING_DEVIANCES[0]);
            of(&held, &alone, selection, levels, Grade::NoGo).filter(|_| !are_likelier)
        };
        let levels = &state.prepared.levels;
        two_lags(everything, levels)
            .or_else(|| {
                // A fit that a wrong value spoils may have put what it leaves over into noise levels or weights.
                let is_put = |entry: &Move| matches!(entry, Move::LowerNoise { .. } | Move::Reweigh { .. });
                let (selection, levels) = state.moves.iter().any(is_put).then(|| state.prepared.before_residuals())?;
                two_lags(&selection, levels)
            })
            .or_else(|| {
                let free = with_effects.model.clone().knowing_nothing();
                let free = free.fit(&with_effects.theta, observations, everything, Effort::Finish);
                of(with_effects, &free, everything, levels, Grade::Conditional)
            })
            .or_else(|| Self::left_behind(with_effects, settings))
    }

    /// What was given with a deviation, where the last model is far from it: what is missing drags the fit away.
    fn left_behind(with_effects: &Fitted, settings: &Settings) -> Option<Self> {
        let deviations =
            |known: &KnownTimeConstant| Some((with_effects.theta[known.sensor] - known.value_s).abs() / known.std_s?);
        let far = settings.known.iter().filter_map(|known| Some((known, deviations(known)?)));
        let (known, deviations) = far.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_far = deviations > LEFT_BEHIND_DEVIATIONS;
        is_far.then(|| Self { what: given(known), instead: None, deviations, grade: Grade::NoGo })
    }

    /// Whether what was given is wrong, and effects that were found make up for that.
    pub(crate) fn is_of_known(&self) -> bool {
        self.grade == Grade::NoGo
    }

    /// The reason that each number has for it.
    pub(crate) fn reason(&self) -> Reason {
        let Self { what, deviations, grade, .. } = self;
        if self.instead.is_none() {
            return Reason::LeftBehind { what: what.clone(), deviations: *deviations };
        }
        Reason::Contradicted { what: what.clone(), deviations: *deviations, grade: *grade }
    }

    /// The remark that says it, where there are other time constants to name.
    pub(crate) fn remark(self) -> Option<Remark> {
        let Self { what, instead, deviations, .. } = self;
        Some(Remark::Contradicted { what, instead: instead?, deviations })
    }
}

/// The deviance that effects leave with what was given beyond that of two lags `alone` without it, by Schwarz's criterion: each number
/// that they have more costs the logarithm of the number of residuals. `None` where no effect was found, and beside a noise, whose
/// likelihood is not that of the residual alone.
fn lost_by_effects(
    with_effects: &Fitted,
    alone: &Fitted,
    settings: &Settings,
    observations: &Observations,
    selection: &Selection,
) -> Option<f64> {
    let Fitted { model, theta, .. } = with_effects;
    if model.effects.is_empty() || model.noise().is_some() {
        return None;
    }
    let energy = model.clone().with_noise(alone.model.noise_std_k()).energy(theta, observations, selection);
    let more = theta.len() as f64 - alone.theta.len() as f64 - settings.known.len() as f64;
    Some((energy - alone.chi2) / alone.mean_energy().max(1.0) + more * alone.count.ln())
}

/// The time constants that the record gives without what was given, for the reader.
fn instead(settings: &Settings, fit: &ModelFit, free: &Fitted) -> String {
    let of = |sensor: usize| {
        let error_s = fit.time_constants[sensor].standard_error_s;
        Remark::time_constant(&format!("T{}", sensor + 1), free.theta[sensor], error_s)
    };
    settings.known.iter().map(|known| of(known.sensor)).collect::<Vec<_>>().join(" and ")
}
