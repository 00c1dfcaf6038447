//! The closed loop: fit, examine the residual, add the effect that explains it, repeat, and judge
//! the result on data that were not used.

use twinlag_model::{
    DiagnoseError, Effort, Fitted, Identifier, LEFT_OVER, ModelFit, Observations, Prepared, Settings, Watch, Weighting,
    is_unresolved, summarise,
};

use crate::diagnosis::{BeforeAfter, Diagnosis, ErrorBudget, Found, Limit, Verdict};
use crate::excitation::tones;
use crate::naming::{name, not_testable, of_defect, what_is_left, widen};
use crate::search::{FALSE_ALARM, FAR_OFF, Search, TIE, Tried, threshold};

/// Most effects that are added.
const MOST_EFFECTS: usize = 4;
/// Number of tones that determine two time constants and nothing else.
const SINGLE: usize = 1;

/// What is said where noise levels are lowered.
const LOWERED: &str = "the noise levels come from the residual, because the fastest changes of the readings \
    are larger and belong to the gas";

/// Finds which physical effects two first-order lags fail to describe in `observations`.
///
/// # Errors
/// [`DiagnoseError`] for a record that is too short, or in which a channel never changes.
pub fn diagnose(
    observations: &Observations,
    settings: &Settings,
    watch: Watch<'_>,
) -> Result<Diagnosis, DiagnoseError> {
    let tones = tones(observations);
    let is_refused = tones == Some(SINGLE);
    let mut prepared = Prepared::new(observations, settings)?;
    watch("two lags", 0, 1);
    let base = prepared.base(settings);
    let mut state = State { current: base.clone(), base, steps: Vec::new(), remarks: Vec::new(), is_reweighed: false };
    while state.steps.len() < MOST_EFFECTS
        && !is_refused
        && (state.step(&mut prepared, settings, watch)
            || state.lower_noise(&mut prepared, settings)
            || state.reweigh(&mut prepared))
    {}
    let limits = Search::of(&prepared, settings, watch).limits(&state.current);
    Ok(state.conclude(&prepared, tones, limits))
}

/// How far the loop has come.
struct State {
    /// Two lags.
    base: Fitted,
    /// With what was added.
    current: Fitted,
    /// What was added, each with those that explain the record as well.
    steps: Vec<(Tried, Vec<Tried>)>,
    remarks: Vec<String>,
    /// Whether frequencies are weighted by the spectrum of what is left over.
    is_reweighed: bool,
}

impl State {
    /// Adds an effect. Whether to go on.
    fn step(&mut self, prepared: &mut Prepared, settings: &Settings, watch: Watch<'_>) -> bool {
        let mut search = Search::of(prepared, settings, watch);
        search.look(&self.current);
        let tried = search.try_all(&self.current, self.current.mean_energy() > FAR_OFF);
        let Some((chosen, ties)) = search.choose(&self.current, &tried) else { return false };
        self.current = chosen.fitted.clone().in_order();
        let effect = chosen.effect.clone();
        self.steps.push((chosen, ties));
        if effect.about().is_narrow {
            // A line is in the third differences as well.
            prepared.find_levels(&self.current, settings);
            (self.current, self.base) = (prepared.refit(&self.current), prepared.refit(&self.base));
        }
        let is_blind = settings.known.is_empty() && is_unresolved(&self.current, &prepared.observations);
        if is_blind && !effect.is_noise() {
            // What imitates a time constant that is not resolved can be refined at will.
            return false;
        }
        let search = Search::of(prepared, settings, watch);
        self.drop_needless(&search);
        self.grow(&search);
        self.think_again(&search);
        self.doubt_noise(prepared, &search);
        true
    }

    /// Puts the look-alikes of every effect in its place, now that more is known: one that is better takes it, those that are as
    /// good are its ties.
    fn think_again(&mut self, search: &Search<'_>) {
        if self.steps.len() < 2 {
            return;
        }
        for index in 0..self.steps.len() {
            let alike = search.look_alikes(&self.current, index, &self.steps[index].0);
            let is_static = |t: &Tried| t.effect.about().is_static;
            let is_imitator = self.steps[index].0.effect.about().imitates_static;
            // A static disagreement before its subtler imitators.
            let better =
                alike.iter().find(|t| t.advantage > TIE || (is_imitator && is_static(t) && t.advantage > -TIE));
            if let Some(better) = better.cloned() {
                self.current = better.fitted.clone().in_order();
                let before = std::mem::replace(&mut self.steps[index].0, better);
                self.remarks.push(format!(
                    "{} was added first and later replaced, because {} explains more",
                    before.effect.identifier(),
                    self.steps[index].0.effect.identifier()
                ));
                self.steps[index].1.clear();
                self.drop_needless(search);
                self.grow(search);
                return;
            }
            if !self.steps[index].0.effect.is_noise() {
                self.steps[index].1 = alike.into_iter().filter(|t| t.advantage > -TIE).collect();
            }
        }
    }

    /// Takes noise out that came before the effects that explain it: model error, seen from afar, looks like noise.
    fn doubt_noise(&mut self, prepared: &Prepared, search: &Search<'_>) {
        let Some(index) = self.current.model.noise() else { return };
        if index + 1 == self.steps.len() {
            return;
        }
        let (model, theta) = self.current.without(index);
        let model = model.with_noise(prepared.levels.std_k);
        let without = model.fit(&theta, search.observations, search.selection, Effort::Finish);
        if search.needs_noise(&without, &self.steps[index].0.effect) {
            return;
        }
        self.take_out(index, without);
        self.drop_needless(search);
    }

    /// Goes on with `without`, the fit without effect `index`.
    fn take_out(&mut self, index: usize, without: Fitted) {
        let effect = self.current.model.effects[index].identifier();
        self.remarks.push(format!(
            "{effect} was added first and later removed, because other effects explain \
            the record without it"
        ));
        self.current = without;
        self.steps.remove(index);
    }

    /// Lowers noise levels to what is left over, where that is less. Whether to look again.
    fn lower_noise(&mut self, prepared: &mut Prepared, settings: &Settings) -> bool {
        if !prepared.lower_levels(&self.current, settings) {
            return false;
        }
        if !self.remarks.iter().any(|r| r == LOWERED) {
            self.remarks.push(LOWERED.into());
        }
        (self.current, self.base) = (prepared.refit(&self.current), prepared.refit(&self.base));
        true
    }

    /// Where nothing explains what is left over and that is far more than noise: weights frequencies by its own spectrum from here
    /// on, once. Whether to look again.
    fn reweigh(&mut self, prepared: &mut Prepared) -> bool {
        let has_noise = self.current.model.noise().is_some();
        if self.is_reweighed || has_noise || self.current.mean_energy() < FAR_OFF {
            return false;
        }
        self.is_reweighed = true;
        prepared.weigh_by(&self.current);
        (self.current, self.base) = (prepared.refit(&self.current), prepared.refit(&self.base));
        true
    }

    /// Gives each effect the parameters that the data support, now that more is known.
    fn grow(&mut self, search: &Search<'_>) {
        let mut index = 0;
        while index < self.steps.len() {
            match search.grown(&self.current, index, &self.steps[index].0) {
                Some(tried) => {
                    self.current = tried.fitted.clone();
                    self.steps[index].0 = tried;
                }
                None => index += 1,
            }
        }
    }

    /// Takes out earlier effects that the later ones made needless.
    fn drop_needless(&mut self, search: &Search<'_>) {
        if self.current.model.noise().is_some() {
            // Weights that are those of the residual hide what made them.
            return;
        }
        let mut index = 0;
        while index + 1 < self.steps.len() {
            let (model, theta) = self.current.without(index);
            let without = model.fit(&theta, search.observations, search.selection, Effort::Finish);
            let (n, parameters) = (self.current.count, self.current.model.range(index).len());
            let loss = n * (without.mean_energy() / self.current.mean_energy()).ln();
            if loss < threshold(parameters, FALSE_ALARM).max(parameters as f64 * n.ln()) {
                self.take_out(index, without);
            } else {
                index += 1;
            }
        }
    }

    /// - `tones`: of the gas, where its power is in tones
    fn conclude(mut self, prepared: &Prepared, tones: Option<usize>, limits: Vec<Limit>) -> Diagnosis {
        let is_refused = tones == Some(SINGLE);
        let (observations, everything) = (&prepared.observations, &prepared.everything);
        let to_the_end =
            |fitted: &Fitted| fitted.model.fit(&fitted.theta, observations, everything, Effort::Finish).in_order();
        let last = to_the_end(&self.current);
        let summary = |fitted: &Fitted| summarise(fitted, observations, everything, &prepared.levels);
        // Before is before everything: with the defects of the data in it.
        let unmasked = prepared.unmasked(&self.base);
        let base_fit = if let Some(unmasked) = &unmasked {
            let (raw, levels) = &prepared.raw;
            let fitted = unmasked.model.fit(&unmasked.theta, raw, everything, Effort::Finish);
            summarise(&fitted, raw, everything, levels)
        } else {
            summary(&to_the_end(&self.base))
        };
        let mut last_fit = summary(&last);
        // Those of the whole model: ties of a time when less was known have been looked at again.
        let is_whole = |t: &&Tried| t.fitted.model.effects.len() == last.model.effects.len();
        let ties = self.steps.iter().flat_map(|s| &s.1).filter(|t| !t.effect.is_noise()).filter(is_whole);
        widen(&mut last_fit, ties, observations, everything, &mut self.remarks);
        let before = unmasked.as_ref().map_or((&self.base, observations), |unmasked| (unmasked, &prepared.raw.0));
        let error = self.errors(prepared, before, [&base_fit, &last_fit]);
        let mut found: Vec<Found> = prepared.found.iter().map(of_defect).collect();
        found.extend(
            self.steps.iter().enumerate().map(|(index, (tried, ties))| name(index, tried, ties, &last, &last_fit)),
        );
        let left = what_is_left(&last_fit);
        let has = |is_one: fn(Identifier) -> bool| found.iter().any(|f| is_one(f.effect));
        let is_blind = last_fit.time_constants.iter().all(|t| t.value_s.is_none());
        if is_blind && has(|effect| effect == Identifier::DELAY) {
            self.remarks.push(
                "this record does not distinguish time constants from a delay: the difference is the total \
                 delay of channel 2, τ2 − τ1 + delay"
                    .into(),
            );
        }
        if is_refused {
            self.remarks.push(
                "the gas is a single tone. Its amplitude and phase are two equations for two time constants, \
                 which absorb any missing effect without a trace. Take a record in which the gas changes at \
                 more than one rate"
                    .into(),
            );
        }
        let is_coherent = last_fit.tests.iter().any(|t| t.test == "coherence" && t.p_value < LEFT_OVER);
        if is_coherent && has(Identifier::is_noise) {
            // What goes with the gas is no noise; its spectrum is what the fit is weighted by all the same.
            found.retain(|f| !f.effect.is_noise());
            self.remarks.push(
                "the residual is coherent with the gas temperature, so it is model error and not noise. Its \
                 spectrum weights the fit and sets the intervals"
                    .into(),
            );
        }
        // Two effects can be told apart; what takes more has some other cause that together they imitate.
        let is_imitated = self.steps.iter().filter(|s| !s.0.effect.is_noise()).count() > 2;
        let verdict = match (found.is_empty(), &left) {
            _ if is_refused => Verdict::Refused,
            (true, None) => Verdict::Adequate,
            (true, Some(_)) => Verdict::Unexplained,
            (false, None) if !is_imitated => Verdict::Explained,
            (false, _) => Verdict::PartlyExplained,
        };
        if matches!(verdict, Verdict::PartlyExplained | Verdict::Unexplained) && left.is_some() {
            self.remarks
                .push("the intervals cover noise and the residual, but not the bias from the missing effect".into());
        }
        Diagnosis {
            verdict,
            effects: found,
            base: base_fit,
            last: last_fit,
            error,
            unexplained: left.filter(|_| !is_refused),
            not_testable: not_testable(observations, tones),
            limits,
            remarks: self.remarks,
        }
    }

    /// Errors on the blocks that judge, of the fits that chose, which have not seen them.
    ///
    /// - `before`: the two-lag model and the readings that it is of
    /// - `fits`: before and after, of the whole record
    fn errors(&self, prepared: &Prepared, before: (&Fitted, &Observations), fits: [&ModelFit; 2]) -> ErrorBudget {
        let rms = |(fitted, observations): (&Fitted, &Observations)| {
            let evaluation = fitted.model.evaluate(&fitted.theta, observations);
            // Without the frequencies in which there is only noise, which each factor of the inverse makes larger.
            let filter = Weighting::of_disagreement(observations, fitted.model.noise_std_k());
            // Or, where no spectrum tells, changes within the faster time constant are left out.
            let half = (fitted.theta[0].min(fitted.theta[1]) / observations.step_s()).clamp(1.0, 50.0) as usize;
            let ends = evaluation.begins.iter().skip(1).copied().chain([evaluation.disagreement_k.len()]);
            let apart: Vec<f64> = evaluation
                .begins
                .iter()
                .zip(ends)
                .flat_map(|(from, to)| filter.smooth_or_mean(&evaluation.disagreement_k[*from..to], half))
                .collect();
            [&evaluation.residual, &apart].map(|values| {
                let pairs = values.iter().zip(&evaluation.sample).filter(|(_, s)| prepared.judges(**s));
                let (sum, count) = pairs.fold((0.0, 0.0_f64), |(sum, n), (v, _)| (sum + v * v, n + 1.0));
                (sum / count.max(1.0)).sqrt()
            })
        };
        let ([r0, k0], [r1, k1]) = (rms(before), rms((&self.current, &prepared.observations)));
        let [base, last] = fits;
        ErrorBudget {
            chi2_per_dof: BeforeAfter { before: base.chi2_per_dof, after: last.chi2_per_dof },
            held_out_normalised_rms: BeforeAfter { before: r0, after: r1 },
            held_out_input_difference_k: BeforeAfter { before: k0, after: k1 },
        }
    }
}
