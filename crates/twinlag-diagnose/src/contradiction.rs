//! Whether the record contradicts what was given of the time constants.
//!
//! What was given pulls the fit to it, and effects may be found that make up for a wrong value. So the record is fitted without it.
//! Where two lags then leave only noise, the deviance that what was given costs is a chi-square with as many degrees of freedom as
//! there are values. Where they leave more, the last model is fitted without it in their place: its effects may be wrong, so numbers
//! are conditional. Where that leaves more than noise as well, what is missing may account for the deviance, and nothing is said.

use twinlag_model::{Effort, Fitted, ModelFit, Policy, Settings, summarise};

use crate::grade::{Grade, Reason};
use crate::judge::given;
use crate::moves::State;
use crate::remark::Remark;

/// Quantiles of the chi-square distribution with one and with two degrees of freedom that chance exceeds once in 10⁴, as a test of
/// the residual does.
const CONTRADICTING_DEVIANCES: [f64; 2] = [15.14, 18.42];
/// Points of the grid of time constants from which the record is fitted without what was given.
const STARTS: usize = 3;

/// What speaks against what was given.
pub(crate) struct Contradiction {
    what: String,
    instead: String,
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
        let of = |held: &Fitted, free: &Fitted, grade| {
            let fit = summarise(free, observations, everything, &state.prepared.levels, policy);
            let deviance = (held.chi2 - free.chi2) / free.mean_energy().max(1.0);
            let beyond = CONTRADICTING_DEVIANCES[known.len().min(2) - 1];
            (!fit.is_contradicted() && deviance > beyond).then(|| Self {
                what: known.iter().map(given).collect::<Vec<_>>().join(" and "),
                instead: instead(settings, &fit, free),
                deviations: deviance.sqrt(),
                grade,
            })
        };
        // Where two lags alone leave only noise, effects that were found make up for what was given.
        let alone = state.base.model.clone().knowing_nothing();
        let alone = alone.fit_over_grid(&[], STARTS, observations, everything);
        let held = state.base.model.fit(&state.base.theta, observations, everything, Effort::Finish);
        of(&held, &alone, Grade::NoGo).or_else(|| {
            let free = with_effects.model.clone().knowing_nothing();
            let free = free.fit(&with_effects.theta, observations, everything, Effort::Finish);
            of(with_effects, &free, Grade::Conditional)
        })
    }

    /// The reason that each number has for it.
    pub(crate) fn reason(&self) -> Reason {
        Reason::Contradicted { what: self.what.clone(), deviations: self.deviations, grade: self.grade }
    }

    /// The remark that says it.
    pub(crate) fn remark(self) -> Remark {
        Remark::Contradicted { what: self.what, instead: self.instead, deviations: self.deviations }
    }
}

/// The time constants that the record gives without what was given, for the reader.
fn instead(settings: &Settings, fit: &ModelFit, free: &Fitted) -> String {
    let of = |sensor: usize| {
        let error_s = fit.time_constants[sensor].standard_error_s;
        Remark::time_constant(&format!("T{}", sensor + 1), free.theta[sensor], error_s)
    };
    settings.known.iter().map(|known| of(known.sensor)).collect::<Vec<_>>().join(" and ")
}
