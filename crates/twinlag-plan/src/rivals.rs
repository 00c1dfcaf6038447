//! How clearly a record distinguishes an effect from those that look like it.
//!
//! A rival takes the place of an effect, and everything else is fitted again: time constants, the other effects. On a record without
//! noise of the rig it leaves the energy `λ` more than the model that is right; on noisy records the deviance between the two scatters
//! about `λ` with a standard deviation of `2 √λ` at most, if the levels of the noise are known. Where they are not, the rival takes what it
//! leaves over for noise: of `n` residuals, one factor of both levels fitted again, `n ln(1 + λ/n)` is left. This is the deviance by which
//! `twinlag diagnose` compares effects.

use twinlag::diagnosis::accepts;
use twinlag::model::{Effort, Fitted, Identifier, Shared, candidates};

use crate::expected::Expected;

/// Rivals of an effect that are followed through the changes of a record: those that come closest. Chosen: it costs time.
const MOST_RIVALS: usize = 3;

/// A model with another effect in the place of one of its own.
#[derive(Clone, Debug)]
pub(crate) struct Rival {
    /// The place of the effect in the model.
    pub(crate) index: usize,
    pub(crate) effect: Identifier,
    pub(crate) channel: Option<usize>,
    fitted: Fitted,
    /// Time constants of the model that it is a rival of, s.
    beside_tau_s: [f64; 2],
    /// Energy that it leaves over beyond that of the model, all samples counted: the deviance if noise levels are known.
    pub(crate) deviance_known_noise: f64,
    /// The deviance with one factor of both noise levels fitted again.
    pub(crate) deviance: f64,
}

impl Rival {
    fn of(expected: &Expected, index: usize, fitted: Fitted) -> Self {
        let effect = &fitted.model.effects[index];
        let (identifier, channel) = (effect.identifier(), effect.channel());
        let of_own = &expected.fitted;
        let deviance_known_noise = (expected.energy(&fitted) - expected.energy(of_own)).max(0.0);
        let residuals = expected.residual_count();
        let deviance = residuals * (deviance_known_noise / residuals).ln_1p();
        Self {
            index,
            effect: identifier,
            channel,
            beside_tau_s: [of_own.theta[0], of_own.theta[1]],
            deviance_known_noise,
            deviance,
            fitted,
        }
    }

    pub(crate) fn fitted(&self) -> &Fitted {
        &self.fitted
    }

    /// This rival where the levels of the noise are known.
    pub(crate) fn with_known_noise(&self) -> Self {
        Self { deviance: self.deviance_known_noise, ..self.clone() }
    }

    /// This rival on another record.
    pub(crate) fn on(&self, expected: &Expected) -> Self {
        let own = &expected.fitted;
        let mut theta = self.fitted.theta.clone();
        for (i, tau_s) in theta.iter_mut().take(2).enumerate() {
            *tau_s *= own.theta[i] / self.beside_tau_s[i];
        }
        let of = |effect: Shared| {
            let model = own.model.replaced(self.index, effect);
            Self::of(expected, self.index, finished(expected, &model, &[theta.clone(), self.restarted(&model, own)]))
        };
        let other = &self.fitted.model.effects[self.index];
        // An effect holds means and length of its record, so it is made anew. There may be several with the same channel and parameters:
        // crosstalk has one for each temperature at which it adds nothing. The one that fits best is the rival.
        let closest = like(other, expected)
            .into_iter()
            .map(&of)
            .min_by(|a, b| a.deviance_known_noise.total_cmp(&b.deviance_known_noise));
        closest.unwrap_or_else(|| of(other.clone()))
    }

    /// The model's own numbers, and the first start of the rival's effect.
    fn restarted(&self, model: &twinlag::model::Model, own: &Fitted) -> Vec<f64> {
        let mut theta = own.theta.clone();
        let start = model.effects[self.index].starts().into_iter().next().unwrap_or_default();
        theta.splice(own.model.range(self.index), start);
        theta
    }
}

/// Effects of the same kind, channel and parameters, made for the record of `expected`.
fn like(effect: &Shared, expected: &Expected) -> Vec<Shared> {
    let names = |e: &Shared| e.parameters().iter().map(|p| p.name).collect::<Vec<_>>();
    let mut all = forms(&[effect.identifier()], expected);
    all.retain(|other| other.channel() == effect.channel() && names(other) == names(effect));
    all
}

/// The candidates of some kinds, and the whole forms of which they are parts, such as crosstalk with an offset.
fn forms(effects: &[Identifier], expected: &Expected) -> Vec<Shared> {
    let parts = candidates(effects, &expected.prepared.context);
    let whole = |part: &Shared| part.starts().first().and_then(|start| part.whole(start)).map(|(whole, _)| whole);
    let wholes: Vec<Shared> = parts.iter().filter_map(whole).collect();
    parts.into_iter().chain(wholes).collect()
}

/// The best fit of a model from any of some starts.
fn finished(expected: &Expected, model: &twinlag::model::Model, starts: &[Vec<f64>]) -> Fitted {
    let (observations, selection) = (&expected.prepared.observations, &expected.prepared.everything);
    let looked = starts.iter().map(|start| model.fit(start, observations, selection, Effort::Look));
    let best = looked.min_by(|a, b| a.chi2.total_cmp(&b.chi2)).expect("an effect has a start");
    model.fit(&best.theta, observations, selection, Effort::Finish)
}

/// The rivals of each effect of the model that come closest, the closest first.
pub(crate) fn rivals(expected: &Expected) -> Vec<Rival> {
    let own = &expected.fitted;
    let mut out = Vec::new();
    for (index, effect) in own.model.effects.iter().enumerate().filter(|(_, effect)| !effect.is_noise()) {
        let rest = own.model.without(index);
        let is_alike = |other: &Shared| {
            let id = other.identifier();
            !id.about().is_defect
                && !other.is_noise()
                && !other.is_of_the_record()
                && (effect.identifier().resembles(id)
                    || (id == effect.identifier() && other.channel() != effect.channel()))
                && accepts(&rest, other)
        };
        let all = forms(&Identifier::ALL, expected);
        let mut of_effect: Vec<Rival> = Vec::new();
        for other in all.into_iter().filter(is_alike) {
            let model = own.model.replaced(index, other.clone());
            let start = |values: Vec<f64>| {
                let mut theta = own.theta.clone();
                theta.splice(own.model.range(index), values);
                theta
            };
            let starts: Vec<Vec<f64>> = other.starts().into_iter().map(start).collect();
            let rival = Rival::of(expected, index, finished(expected, &model, &starts));
            let seat = |rival: &Rival| (rival.effect, rival.channel);
            match of_effect.iter_mut().find(|known| seat(known) == seat(&rival)) {
                Some(known) if known.deviance_known_noise <= rival.deviance_known_noise => {}
                Some(known) => *known = rival,
                None => of_effect.push(rival),
            }
        }
        of_effect.sort_by(|a, b| a.deviance_known_noise.total_cmp(&b.deviance_known_noise));
        of_effect.truncate(MOST_RIVALS);
        out.extend(of_effect);
    }
    out
}
