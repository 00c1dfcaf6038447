//! From the last state of the loop to the answer.

use twinlag_cross_relation::TestName;
use twinlag_model::{Effort, Fitted, ModelError, ModelFit, Observations, Policy, Settings, summarise};

use crate::candidates::{Candidate, effects_on_bounds};
use crate::contradiction::Contradiction;
use crate::diagnosis::{BeforeAfter, Diagnosis, ErrorBudget, Found, Unexplained, Verdict};
use crate::errors::Squares;
use crate::excitation::SINGLE;
use crate::first_state::{FirstState, FirstStateChoice, choose};
use crate::grade::{Basis, Excess, Grade, Reason, excess};
use crate::if_known::if_known;
use crate::judge::Circumstances;
use crate::left_over::what_is_left;
use crate::limits::not_testable;
use crate::moves::{Move, Searched, State};
use crate::naming::{judge_effect, name, of_defect, of_rapid};
use crate::other_delays::delay_s;
use crate::rapid::RapidVariation;
use crate::remark::Remark;
use crate::ties::{OtherCause, Tie, widen};
use crate::transfer::Across;
use crate::twins::{ExactTwin, cover_causes, exact_twins};
use crate::whole_form::WholeForm;

/// The answer, its numbers fitted once more to the whole record, and that fit.
///
/// - `tones`: of the gas, where its power is in tones
/// - `across`: what records that were left out say, of several
///
/// # Errors
/// [`ModelError::Cancelled`] if the watch says so.
pub(crate) fn conclude(
    state: State<'_>,
    settings: &Settings,
    tones: Option<usize>,
    across: Option<&Across>,
) -> Result<(Diagnosis, Fitted), ModelError> {
    let policy = &settings.policy;
    // Before is before everything: with the defects of the data in it.
    let unmasked = state.prepared.unmasked(&state.base);
    let (with_effects, mut last, first_states) = last_fit(&state, policy);
    let is_base = unmasked.is_none() && state.taken.is_empty() && state.base.theta == state.current.theta;
    let mut base = if is_base { last.clone() } else { base_fit(&state, unmasked.as_ref(), policy) };
    let mut remarks = remarks_of(&state);
    let places = 0..state.taken.len();
    let covariance = last.covariance.as_deref();
    let twins: Vec<_> = places.map(|index| exact_twins(index, &with_effects, covariance, &settings.effects)).collect();
    let whole_forms = WholeForm::each(&with_effects, &last, &state.prepared);
    let ties = whole_ties(&state, &with_effects, &twins, &whole_forms);
    let (remark, causes) = widen(&mut last.time_constants, &mut last.difference, &ties, policy);
    remarks.extend(remark);
    let mut found = found(&state, twins.into_iter().zip(first_states), (&with_effects, &last));
    for (_, found) in found.iter_mut().filter(|(place, _)| place.is_some()) {
        found.other_causes = other_causes(found, &ties, policy);
    }
    whole_forms.iter().for_each(|whole| whole.widen_each(&mut found, &settings.effects));
    let left = what_is_left(&last, policy);
    let is_total_delay = last.time_constants.iter().all(|t| t.value_s.is_none()) && delay_s(&with_effects).is_some();
    remarks.extend(is_total_delay.then_some(Remark::LagAlone));
    let is_refused = tones == Some(SINGLE);
    remarks.extend(is_refused.then_some(Remark::SingleTone));
    remarks.extend(drop_coherent_noise(&mut found, &last, policy));
    if state.rapid.is_some() {
        // The model lacks what looks like noise of the gas.
        found.retain(|(_, found)| !found.effect.is_noise());
    }
    let excess = bounded_excess(&state, &with_effects, &last, policy);
    let unbounded = left.as_ref().filter(|_| excess.is_none());
    let contradiction = Contradiction::find(&state, &with_effects, settings, policy);
    let is_wrong =
        across.is_some_and(Across::is_refuted) || contradiction.as_ref().is_some_and(Contradiction::is_of_known);
    let fitted = verdict(&state, found.is_empty(), unbounded, policy);
    let verdict = if is_refused { Verdict::Refused } else { unless_wrong(fitted, is_wrong) };
    let is_whole = matches!(verdict, Verdict::Adequate | Verdict::Explained);
    let mut basis = basis(&state, verdict, excess, is_total_delay || !settings.known.is_empty(), policy);
    basis.reasons.extend(effects_on_bounds(&with_effects));
    basis.reasons.extend(across.and_then(Across::reason));
    remarks.extend(across.and_then(Across::remark).filter(|_| verdict == Verdict::PartlyExplained));
    basis.reasons.extend(contradiction.as_ref().map(Contradiction::reason));
    remarks.extend(contradiction.and_then(Contradiction::remark));
    let span_s = state.prepared.observations.span_s();
    let mut circumstances =
        Circumstances { is_total_delay, causes, ..Circumstances::new(basis, &settings.known, span_s, policy) };
    let search = state.search().beside(&state.current);
    let all_delays_s = search.delays(&state.current).into_iter().map(|(delay_s, _)| delay_s);
    circumstances.other_delays_s = all_delays_s.filter(|other_s| delay_s(&state.current) != Some(*other_s)).collect();
    let around = is_whole.then(|| search.around(&state.current)).transpose()?;
    if let Some(around) = &around {
        let half = half_intervals(&last, &found, &with_effects);
        let named = with_effects.model.effects.iter().map(|effect| effect.identifier()).collect();
        circumstances.hide(&search.hidden(around, &state.far, &half), named);
    }
    // What is left over may hide an effect of any size.
    let limits = around.as_ref().map_or_else(Vec::new, |around| search.limits(around));
    drop(around);
    let mut judgements = circumstances.judge(&mut last);
    let mut base_judgements = if verdict == Verdict::Adequate {
        circumstances.judge(&mut base)
    } else {
        Circumstances::new(Basis::of(None, false, policy), &settings.known, span_s, policy).judge(&mut base)
    };
    let mut effects = judged(found, &with_effects, &last, &circumstances);
    // Those under other causes were widened with the parameters that they follow from: time constants cover them as they are now.
    cover_causes(&mut last, &mut judgements, policy, &effects);
    let is_given = judgements.time_constants.iter().all(|judgement| judgement.grade != Grade::NoGo);
    withhold_other_cases(&mut effects, is_whole, is_given);
    // A time constant that is known does not make one rig of several, nor one that is wrong any better.
    let is_no_use = is_wrong || across.is_some_and(|across| across.are_of_several_rigs);
    let if_known = if is_refused || is_no_use || (is_whole && is_given) {
        None
    } else {
        if_known(&with_effects, last.chi2_per_dof, is_whole, &state, policy)
    };
    if !is_total_delay {
        let is_same = [&last, &base].map(|fit| if_known.as_ref().is_some_and(|table| table.holds(&fit.difference)));
        judgements.withhold_from_valley(&mut last, is_same[0]);
        base_judgements.withhold_from_valley(&mut base, is_same[1]);
    }
    let unexplained = left.filter(|_| !is_whole && !is_refused);
    if unexplained.is_some() {
        remarks.push(Remark::BiasUnknown { is_one_known: !settings.known.is_empty() });
    }
    remarks.sort_by_key(Remark::importance);
    let diagnosis = Diagnosis {
        verdict,
        effects,
        error: errors(&state, unmasked.as_ref(), [&base, &last]),
        base,
        last,
        unexplained,
        explained_to: excess.filter(|_| is_whole).map(|e| e.share),
        judgements,
        base_judgements,
        not_testable: not_testable(&state.prepared.observations, tones, policy),
        limits,
        if_known,
        remarks,
        transfer: None,
        moves: state.moves,
        policy: policy.clone(),
    };
    Ok((diagnosis, with_effects))
}

/// The fit of all effects to the whole record, in numbers as well, and the first state of the slow body of each effect.
pub(crate) fn last_fit(state: &State<'_>, policy: &Policy) -> (Fitted, ModelFit, Vec<Option<FirstState>>) {
    let prepared = &state.prepared;
    let in_numbers = |fitted: Fitted| {
        let fit = summary(&fitted, state, policy);
        (fitted, fit)
    };
    // A noise is fitted again to what is left over where that is noise, and not an error of the model.
    let settled = state.current.model.noise().map(|_| {
        let settled = to_the_end(&state.search().with_settled_noise(state.current.clone()), state);
        in_numbers(settled.without_mismatch_bias(&prepared.observations, &prepared.everything))
    });
    let settled = settled.filter(|(_, fit)| what_is_left(fit, policy).is_none());
    let (free, fit) = settled.unwrap_or_else(|| in_numbers(to_the_end(&state.current, state)));
    let is_noise_left = what_is_left(&fit, policy).is_none() && state.rapid.is_none();
    let (fitted, first_states) = choose(free, prepared, is_noise_left);
    let is_any_kept = first_states.iter().flatten().any(|first| first.choice == FirstStateChoice::Equilibrium);
    let mut fit = if is_any_kept { summary(&fitted, state, policy) } else { fit };
    if let Some(covariance) = &mut fit.covariance {
        for (at, variance) in state.search().noise_variances(&fitted) {
            covariance[at][at] = variance;
        }
    }
    (fitted, fit, first_states)
}

/// What is left over beside the noise, where intervals can cover it.
fn bounded_excess(state: &State<'_>, fitted: &Fitted, fit: &ModelFit, policy: &Policy) -> Option<Excess> {
    let is_bounded = |excess: &Excess| excess.is_bounded(policy) && state.rapid.is_none();
    excess(fit, fitted.model.noise().is_some()).filter(is_bounded)
}

/// Whether two lags and what a search has found explain its record.
pub(crate) fn is_explained(state: &State<'_>, settings: &Settings) -> bool {
    let policy = &settings.policy;
    let (fitted, fit, _) = last_fit(state, policy);
    let left = what_is_left(&fit, policy);
    let unbounded = left.as_ref().filter(|_| bounded_excess(state, &fitted, &fit, policy).is_none());
    matches!(verdict(state, state.taken.is_empty(), unbounded, policy), Verdict::Adequate | Verdict::Explained)
}

/// Whether a search has left more than noise in its record.
pub(crate) fn leaves_more_than_noise(state: &State<'_>, settings: &Settings) -> bool {
    let (_, fit, _) = last_fit(state, &settings.policy);
    what_is_left(&fit, &settings.policy).is_some()
}

/// A fit of the search, of the whole record.
pub(crate) fn to_the_end(fitted: &Fitted, state: &State<'_>) -> Fitted {
    let (observations, everything) = (&state.prepared.observations, &state.prepared.everything);
    fitted.model.fit(&fitted.theta, observations, everything, Effort::Finish).in_order()
}

fn summary(fitted: &Fitted, state: &State<'_>, policy: &Policy) -> ModelFit {
    let prepared = &state.prepared;
    summarise(fitted, &prepared.observations, &prepared.everything, &prepared.levels, policy)
}

/// Two lags and the whole record.
///
/// - `unmasked`: two lags and the record as it came, where some of that is masked
fn base_fit(state: &State<'_>, unmasked: Option<&Fitted>, policy: &Policy) -> ModelFit {
    let Some(unmasked) = unmasked else { return summary(&to_the_end(&state.base, state), state, policy) };
    let (raw, levels) = &state.prepared.raw;
    let everything = &state.prepared.everything;
    let fitted = unmasked.model.fit(&unmasked.theta, raw, everything, Effort::Finish);
    summarise(&fitted, raw, everything, levels, policy)
}

/// Ties of the whole model: those of a time when less was known have been looked at again. None of
/// them is noise, and those that are exact twins are known without a fit.
///
/// - `last`: the whole model
/// - `twins`: of each effect
/// - `whole_forms`: of effects that are parts
fn whole_ties(state: &State<'_>, last: &Fitted, twins: &[Vec<ExactTwin>], whole_forms: &[WholeForm]) -> Vec<Tie> {
    let effects = state.current.model.effects.len();
    let mut out: Vec<Tie> = whole_forms.iter().map(WholeForm::tie).collect();
    for (taken, twins) in state.taken.iter().zip(twins) {
        let place = |candidate: &Candidate| (candidate.effect.identifier(), candidate.effect.channel());
        let named = place(&taken.candidate);
        out.extend(twins.iter().map(|twin| Tie::exact(named, twin)));
        let fitted = taken.ties.iter().filter_map(|tie| {
            let other = place(tie);
            let is_exact = twins.iter().any(|twin| (twin.effect, Some(twin.channel)) == other);
            let is_whole = tie.fitted.model.effects.len() == effects;
            let is_new = !tie.effect.is_noise() && is_whole && !is_exact;
            is_new.then(|| Tie::fitted((named, last), other, &tie.fitted, &state.prepared)).flatten()
        });
        out.extend(fitted);
    }
    out
}

/// Effects that are no noise.
fn effects(state: &State<'_>) -> usize {
    state.taken.iter().filter(|t| !t.candidate.effect.is_noise()).count()
}

/// What the search asks to be said: its moves once each, a change too fast for a model, and how it was cut.
fn remarks_of(state: &State<'_>) -> Vec<Remark> {
    let mut out: Vec<Remark> = Vec::new();
    for remark in state.moves.iter().filter_map(Move::remark) {
        if !out.contains(&remark) {
            out.push(remark);
        }
    }
    out.extend(state.rapid.as_ref().map(RapidVariation::remark));
    if let Searched::Pieces { samples, is_screened } = state.searched {
        out.push(Remark::SearchedInPieces { samples, all: state.prepared.observations.samples(), is_screened });
    }
    out
}

/// Defects and effects, each with its place in the model `last`, if it is in there.
///
/// - `said`: twins of each effect, and the first state of its slow body
fn found(
    state: &State<'_>,
    said: impl Iterator<Item = (Vec<ExactTwin>, Option<FirstState>)>,
    (last, fit): (&Fitted, &ModelFit),
) -> Vec<(Option<usize>, Found)> {
    let defects = state.prepared.found.iter().map(|d| (None, of_defect(d, &state.prepared, fit)));
    let rapid = state.rapid.iter().map(|variation| (None, of_rapid(variation)));
    let named = state.taken.iter().zip(said).enumerate();
    let named = named.map(|(index, (taken, (twins, first_state)))| {
        (Some(index), name(index, taken, twins, first_state, (last, fit)))
    });
    defects.chain(rapid).chain(named).collect()
}

/// What the time constants are under other causes that explain the record as well as `found`, but for its exact twins.
fn other_causes(found: &Found, ties: &[Tie], policy: &Policy) -> Vec<OtherCause> {
    let is_twin = |tie: &&Tie| found.exact_twins.iter().any(|twin| (twin.effect, Some(twin.channel)) == tie.other);
    let of_this = ties.iter().filter(|tie| tie.named == (found.effect, found.fitted_in) && !is_twin(tie));
    let mut out: Vec<OtherCause> = Vec::new();
    for cause in of_this.filter_map(|tie| tie.other_cause(policy)) {
        // Forms of one effect are one cause.
        match out.iter_mut().find(|other| (other.effect, other.channel) == (cause.effect, cause.channel)) {
            Some(other) => other.cover(&cause),
            None => out.push(cause),
        }
    }
    out
}

/// Takes a noise out of what is named where much of the residual goes with the gas, which no noise does; its spectrum is what
/// the fit is weighted by all the same.
fn drop_coherent_noise(found: &mut Vec<(Option<usize>, Found)>, last: &ModelFit, policy: &Policy) -> Option<Remark> {
    let is_coherent = last.tests.iter().any(|t| {
        t.test == TestName::Coherence && t.p_value < policy.rejection_p_value() && t.statistic > policy.noise_coherence
    });
    let named = found.len();
    found.retain(|(_, f)| !(is_coherent && f.effect.is_noise()));
    (found.len() < named).then_some(Remark::ModelErrorAsNoise)
}

/// Effects with the grades of their numbers, by their places in the model `last`.
fn judged(
    found: Vec<(Option<usize>, Found)>,
    last: &Fitted,
    fit: &ModelFit,
    circumstances: &Circumstances<'_>,
) -> Vec<Found> {
    let of_place = |(index, mut found): (Option<usize>, Found)| {
        if let Some(index) = index {
            judge_effect(&mut found, index, last, fit, circumstances);
        }
        found
    };
    found.into_iter().map(of_place).collect()
}

/// A verdict on how well the model fits, where something else says that it is no cause.
fn unless_wrong(verdict: Verdict, is_wrong: bool) -> Verdict {
    if verdict == Verdict::Explained && is_wrong { Verdict::PartlyExplained } else { verdict }
}

/// Takes back numbers under other causes and in other cases where those of this one are not given.
///
/// - `is_given`: whether both time constants are
fn withhold_other_cases(effects: &mut [Found], is_whole: bool, is_given: bool) {
    if !is_given {
        // What they would be under another cause follows from both.
        effects.iter_mut().for_each(|found| {
            found.exact_twins.clear();
            found.other_causes.clear();
        });
    }
    let is_withheld = |found: &Found| !is_whole || found.judgements.iter().any(|j| j.grade == Grade::NoGo);
    for found in effects.iter_mut().filter(|found| is_withheld(found)) {
        found.first_state.iter_mut().for_each(|first| first.otherwise.clear());
    }
}

/// Half the intervals of both time constants, of their difference, and of the parameters of effects, by their places in the
/// model `last`.
fn half_intervals(fit: &ModelFit, found: &[(Option<usize>, Found)], last: &Fitted) -> Vec<Option<f64>> {
    let half = |interval: Option<[f64; 2]>| interval.map(|[low, high]| 0.5 * (high - low));
    let [one, two] = &fit.time_constants;
    let mut out: Vec<Option<f64>> = [one, two, &fit.difference].map(|number| half(number.interval_95_s)).to_vec();
    out.resize(1 + last.theta.len(), None);
    for (place, effect) in found {
        let Some(range) = place.map(|index| last.model.range(index)) else { continue };
        for (at, value) in range.zip(&effect.parameters) {
            out[1 + at] = half(value.interval_95);
        }
    }
    out
}

/// What all numbers of the model rest on.
///
/// - `excess`: what is left over beside the noise, where intervals can cover it
/// - `is_bounded_otherwise`: whether a number holds without the rest of the model, or knowledge holds it
fn basis(
    state: &State<'_>,
    verdict: Verdict,
    excess: Option<Excess>,
    is_bounded_otherwise: bool,
    policy: &Policy,
) -> Basis {
    let mut basis = Basis::of(excess, is_bounded_otherwise, policy);
    match verdict {
        Verdict::Refused => basis.reasons = vec![Reason::Refused],
        Verdict::PartlyExplained if excess.is_some() => {
            basis.reasons.push(Reason::ManyEffects { count: effects(state) });
        }
        Verdict::Adequate | Verdict::Explained => {
            let model = &state.current.model;
            let noise = model.noise().map(|index| model.effects[index].identifier());
            basis.reasons.extend(noise.map(|effect| Reason::FoundAsNoise { effect }));
        }
        _ => {}
    }
    basis
}

/// Whether the effects that were found explain the record. Of more of them than can be
/// distinguished together they imitate some other cause.
///
/// - `left`: what is left over, where that is more than intervals can cover
fn verdict(state: &State<'_>, is_nothing_found: bool, left: Option<&Unexplained>, policy: &Policy) -> Verdict {
    match (is_nothing_found, left) {
        _ if state.rapid.is_some() => Verdict::PartlyExplained,
        (true, None) => Verdict::Adequate,
        (true, Some(_)) => Verdict::Unexplained,
        (false, None) if effects(state) <= policy.most_distinguished_effects => Verdict::Explained,
        (false, _) => Verdict::PartlyExplained,
    }
}

/// Errors on the blocks that judge, of the fits that chose, which have not seen them.
///
/// - `unmasked`: two lags and the record as it came, where some of that is masked
/// - `fits`: before and after, of the whole record
fn errors(state: &State<'_>, unmasked: Option<&Fitted>, fits: [&ModelFit; 2]) -> ErrorBudget {
    let [base, last] = fits;
    let prepared = &state.prepared;
    let rms = |fitted: &Fitted, observations: &Observations| {
        Squares::of(fitted, observations, |sample| prepared.judges(sample)).roots()
    };
    let [r0, k0] = match unmasked {
        Some(unmasked) => rms(unmasked, &prepared.raw.0),
        None => rms(&state.base, &prepared.observations),
    };
    let [r1, k1] = rms(&state.current, &prepared.observations);
    ErrorBudget {
        chi2_per_dof: BeforeAfter { before: base.chi2_per_dof, after: last.chi2_per_dof },
        held_out_normalised_rms: BeforeAfter { before: r0, after: r1 },
        held_out_input_difference_k: BeforeAfter { before: k0, after: k1 },
    }
}
