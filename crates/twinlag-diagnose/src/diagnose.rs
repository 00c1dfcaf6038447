//! The closed loop.

use twinlag_cross_relation::{ResidualTest, residual_tests};

use crate::defects::{self, Levels};
use crate::excitation::tones;
use crate::dense;
use crate::diagnosis::{
    BeforeAfter, Diagnosis, ErrorBudget, Evidence, Found, ModelFit, TimeConstant, Trace, Unexplained, Value, Verdict,
};
use crate::effect::{Context, Effect, Identifier, Shared, candidates};
use crate::error::DiagnoseError;
use crate::model::{Effort, Fitted, KnownTimeConstant, Model, Selection};
use crate::observations::Observations;
use crate::plant::reach;
use crate::search::{FALSE_ALARM, FAR_OFF, Search, Tried, threshold};
use crate::spectrum::{Bands, runs};
use crate::weighting::Weighting;

/// Most effects that are added.
const MOST_EFFECTS: usize = 4;
/// 97.5 % point of the normal distribution.
const Z_975: f64 = 1.959_963_984_540_054;
/// Blocks along the record, of which every eighth is kept for the judgement at the end.
const BLOCKS: usize = 80;
/// Samples of an excerpt for a quick look.
const EXCERPT: usize = 4000;
/// Robust standard deviations beyond which a single reading is wrong, and where others are.
const SPIKE: f64 = 6.0;
const SPIKE_AMONG_OTHERS: f64 = 4.5;
/// A time constant shorter than this share of a sample period is none.
const UNRESOLVED: f64 = 0.2;
/// Effects that are noise.
const NOISE: [Identifier; 2] = [Identifier::ColouredNoise, Identifier::InputMismatch];
/// Below this p-value of any test something is left over.
const LEFT_OVER: f64 = 1e-4;

/// What a diagnosis may assume.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Noise of the channels, K; found from the data if left out.
    pub noise_std_k: Option<[f64; 2]>,
    /// What is known of the time constants.
    pub known: Vec<KnownTimeConstant>,
    /// Effects that may be named.
    pub effects: Vec<Identifier>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { noise_std_k: None, known: Vec::new(), effects: Identifier::ALL.to_vec() }
    }
}

/// Told how far a diagnosis has come: what it is doing, how much of that is done, of how much.
pub type Watch<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Finds what two first-order lags leave over in `observations`, and which effects account for it.
///
/// # Errors
/// [`DiagnoseError`] for a record that is too short, or in which a channel never changes.
pub fn diagnose(observations: &Observations, settings: &Settings, watch: Watch<'_>) -> Result<Diagnosis, DiagnoseError> {
    for i in 0..2 {
        if observations.mean_and_std(i)[1] <= 0.0 {
            return Err(DiagnoseError::Constant { channel: i + 1 });
        }
    }
    let tones = tones(observations);
    let mut observations = observations.clone();
    let samples = observations.samples();
    let mut levels = defects::levels(&observations).ok_or(DiagnoseError::TooShort { samples, needed: 60 })?;
    if let Some(std_k) = settings.noise_std_k {
        levels.std_k = std_k;
        levels.log_error = [0.0; 2];
    }
    let mut found = data_defects(&mut observations, &levels, &settings.effects);
    let weighting = Weighting::of(&observations, levels.std_k);
    let everything = selection(&observations, false, &weighting);
    let judged = |s: usize| everything.holds(s) && is_judge(s, samples);
    let searched = selection(&observations, true, &weighting);

    let model = Model::new(&settings.known, levels.std_k);
    let context = context(&observations, &levels);
    let mut current = search_in(&observations, &searched, &context, settings, watch).base(&model);
    // Isolated wrong readings show once there is a model.
    if settings.effects.contains(&Identifier::Spikes) {
        let evaluation = current.model.plant(&current.theta, &observations).whitened(&observations, true);
        let mut counts = [0; 2];
        for far in [SPIKE, SPIKE_AMONG_OTHERS] {
            let spikes = defects::spikes(&observations, &evaluation, far);
            for i in 0..2 {
                // Where there are some there are smaller ones.
                if far == SPIKE || counts[i] > 0 {
                    defects::mask(&mut observations, i, &spikes[i]);
                    counts[i] += spikes[i].len();
                }
            }
        }
        for (i, count) in counts.into_iter().enumerate().filter(|(_, c)| *c > 0) {
            found.push(defect(Identifier::Spikes, i, format!("{count} single readings")));
        }
        if found.iter().any(|f| f.effect == Identifier::Spikes) {
            current = search_in(&observations, &searched, &context, settings, watch).base(&model);
        }
    }
    let observations = observations;
    let relevel = |current: &Fitted, levels: &Levels| -> Levels {
        let found = defects::levels(&current.model.without_lines(&current.theta, &observations));
        match (settings.noise_std_k, found) {
            (None, Some(found)) => Levels { coarse_step_k: levels.coarse_step_k, ..found },
            _ => *levels,
        }
    };
    if !found.is_empty() {
        levels = relevel(&current, &levels);
        let model = model.clone().with_noise(levels.std_k);
        current = model.fit(&current.theta, &observations, &searched, Effort::Finish);
    }
    let mut search = search_in(&observations, &searched, &context, settings, watch);
    let mut base = current.clone();
    let mut steps: Vec<(Tried, Vec<Tried>)> = Vec::new();
    let is_refused = tones == Some(1);
    let mut remarks = Vec::new();
    while steps.len() < MOST_EFFECTS && !is_refused {
        search.context.tau_s = [current.theta[0], current.theta[1]];
        let evaluation = current.model.evaluate(&current.theta, &observations);
        let lines = defects::lines(&observations, &evaluation, |s| searched.holds(s));
        search.context.lines_hz = lines.iter().map(|l| l.frequency_hz).collect();
        let tried = search.try_all(&current, current.mean_energy() > FAR_OFF);
        let Some((chosen, ties)) = search.choose(&current, &tried) else { break };
        current = chosen.fitted.clone();
        if chosen.effect.identifier() == Identifier::MainsPickup {
            // A line is in the third differences as well.
            levels = relevel(&current, &levels);
            let again = |fitted: &Fitted| {
                let model = fitted.model.clone().with_noise(levels.std_k);
                model.fit(&fitted.theta, &observations, &searched, Effort::Finish)
            };
            (current, base) = (again(&current), again(&base));
        }
        let is_noise = chosen.effect.is_noise();
        steps.push((chosen, ties));
        if !is_noise && settings.known.is_empty() && is_unresolved(&current, &observations) {
            // What imitates a time constant that is not resolved can be refined at will.
            break;
        }
        current = drop_needless(&search, current, &mut steps, &mut remarks);
    }

    let limits = search.limits(&current);
    let last = current.model.fit(&current.theta, &observations, &everything, Effort::Finish);
    let first = base.model.fit(&base.theta, &observations, &everything, Effort::Finish);
    let base_fit = summarise(&first, &observations, &everything, &levels);
    let mut last_fit = summarise(&last, &observations, &everything, &levels);
    if let [(_, ties)] = &steps[..] {
        widen(&mut last_fit, ties, &observations, &everything, &mut remarks);
    }
    let rms = |fitted: &Fitted| {
        let evaluation = fitted.model.evaluate(&fitted.theta, &observations);
        let mean = |values: &[f64]| {
            let chosen: Vec<f64> = values
                .iter()
                .zip(&evaluation.sample)
                .filter(|(_, s)| judged(**s))
                .map(|(v, _)| v * v)
                .collect();
            (chosen.iter().sum::<f64>() / chosen.len().max(1) as f64).sqrt()
        };
        [mean(&evaluation.residual), mean(&evaluation.disagreement_k)]
    };
    // The fits that chose, which have not seen the blocks that judge.
    let (before, after) = (rms(&base), rms(&current));
    let error = ErrorBudget {
        chi2_per_dof: BeforeAfter { before: base_fit.chi2_per_dof, after: last_fit.chi2_per_dof },
        held_out_normalised_rms: BeforeAfter { before: before[0], after: after[0] },
        held_out_input_difference_k: BeforeAfter { before: before[1], after: after[1] },
    };
    found.extend(steps.iter().enumerate().map(|(index, (tried, ties))| name(index, tried, ties, &last, &observations, &everything)));
    let left = what_is_left(&last, &last_fit, &observations, &everything, &levels);
    if last_fit.time_constants.iter().all(|t| t.value_s.is_none()) && found.iter().any(|f| f.effect == Identifier::Delay) {
        remarks.push(
            "time constants and delay are not told apart: the difference is how much later channel 2 is as a whole, \
             τ2 − τ1 + delay"
                .into(),
        );
    }
    if is_refused {
        remarks.push(
            "the gas is a single tone: its amplitude and phase are two equations for two time constants, and whatever else is              missing hides in them without a trace. Take a record in which the gas changes at more than one rate"
                .into(),
        );
    }
    let is_coherent = last_fit.tests.iter().any(|t| t.test == "coherence" && t.p_value < LEFT_OVER);
    if is_coherent && found.iter().any(|f| NOISE.contains(&f.effect)) {
        // What goes with the gas is no noise; its spectrum is what the fit is weighted by all the same.
        found.retain(|f| !NOISE.contains(&f.effect));
        remarks.push(
            "what is left over goes with the gas temperature: it is an error of the model, not noise. The fit is weighted by its \
             spectrum, and the intervals rest on it"
                .into(),
        );
    }
    let verdict = match (found.is_empty(), &left) {
        _ if is_refused => Verdict::Refused,
        (true, None) => Verdict::Adequate,
        (true, Some(_)) => Verdict::Unexplained,
        // Two effects can be told apart; what takes more has some other cause that together they imitate.
        (false, None) if steps.iter().filter(|s| !s.0.effect.is_noise()).count() > 2 => Verdict::PartlyExplained,
        (false, None) => Verdict::Explained,
        (false, Some(_)) => Verdict::PartlyExplained,
    };
    Ok(Diagnosis {
        verdict,
        effects: found,
        base: base_fit,
        last: last_fit,
        error,
        unexplained: left.filter(|_| !is_refused),
        not_testable: not_testable(&observations),
        limits,
        remarks,
    })
}

/// An effect as it was found in another record.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownEffect {
    /// Which.
    pub effect: Identifier,
    /// Channel, 0 or 1; `None` where it is of both, or relative.
    pub channel: Option<usize>,
    /// Its parameters by name.
    pub parameters: Vec<(String, f64)>,
}

/// Both time constants of `observations` with `effects` as they are in the model; defects of the data are dealt with as in
/// [`diagnose`].
///
/// # Errors
/// As [`diagnose`]; [`DiagnoseError::Model`] for an effect that is none of this library, or whose parameters are others.
pub fn fit_with(
    observations: &Observations,
    settings: &Settings,
    effects: &[KnownEffect],
) -> Result<ModelFit, DiagnoseError> {
    let mut observations = observations.clone();
    let samples = observations.samples();
    let mut levels = defects::levels(&observations).ok_or(DiagnoseError::TooShort { samples, needed: 60 })?;
    levels.std_k = settings.noise_std_k.unwrap_or(levels.std_k);
    data_defects(&mut observations, &levels, &settings.effects);
    let mut context = context(&observations, &levels);
    let mut model = Model::new(&settings.known, levels.std_k);
    model.is_frozen = true;
    let mut rest = Vec::new();
    for known in effects {
        let is_defect = [Identifier::Saturation, Identifier::Quantisation, Identifier::Spikes].contains(&known.effect);
        if is_defect {
            continue;
        }
        let value = |name: &str| known.parameters.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
        context.lines_hz = value("frequency").into_iter().collect();
        let fits = |e: &Shared| {
            e.identifier() == known.effect
                && e.channel() == known.channel
                && e.parameters().iter().all(|p| value(p.name).is_some())
        };
        let all = candidates(&context);
        let sizes: Vec<Shared> = all.iter().flat_map(|e| e.sizes()).collect();
        // Of those whose parameters are all given the one with the most of them.
        let effect = all.into_iter().chain(sizes).filter(fits).max_by_key(|e| e.parameters().len());
        let effect = effect.ok_or_else(|| DiagnoseError::Model { effect: known.effect.name() })?;
        rest.extend(effect.parameters().iter().filter_map(|p| value(p.name)));
        model = model.with(effect);
    }
    let everything = selection(&observations, false, &Weighting::of(&observations, levels.std_k));
    let search = search_in(&observations, &everything, &context, settings, &|_, _, _| ());
    let fitted = search.from_grid(&model, &rest, 3);
    Ok(summarise(&fitted, &observations, &everything, &levels))
}

fn search_in<'a>(
    observations: &'a Observations,
    selection: &'a Selection,
    context: &Context,
    settings: &'a Settings,
    watch: Watch<'a>,
) -> Search<'a> {
    let excerpt = observations.excerpt(EXCERPT, 8);
    let whole = self::selection(&excerpt, false, &selection.weighting);
    Search { observations, selection, context: context.clone(), allowed: &settings.effects, watch, excerpt: (excerpt, whole) }
}

/// Intervals of both time constants that hold whichever of the tied effects is the right one.
fn widen(
    fit: &mut ModelFit,
    ties: &[Tried],
    observations: &Observations,
    selection: &Selection,
    remarks: &mut Vec<String>,
) {
    let mut widened = Vec::new();
    for tie in ties {
        let other = tie.fitted.model.fit(&tie.fitted.theta, observations, selection, Effort::Finish);
        let Some(covariance) = covariance(&other, observations, selection, false) else { continue };
        for i in 0..2 {
            let (value, se) = (other.theta[i], covariance[i][i].max(0.0).sqrt());
            let Some([low, high]) = &mut fit.time_constants[i].interval_95_s else { continue };
            if se > 0.0 && se < 0.5 * value {
                let f = (Z_975 * se / value).exp();
                if value / f < 0.999 * *low || value * f > 1.001 * *high {
                    widened.push(tie.effect.identifier().name());
                }
                (*low, *high) = (low.min(value / f), high.max(value * f));
            }
        }
    }
    widened.sort_unstable();
    widened.dedup();
    if !widened.is_empty() {
        remarks.push(format!(
            "the intervals of the time constants hold for the alternatives as well ({}), which put them elsewhere",
            widened.join(", ")
        ));
    }
}

/// What no record of two sensors tells, and what this one does not.
fn not_testable(observations: &Observations) -> Vec<String> {
    let mut out = vec![
        "anything that both sensors share: gain, offset, drift, delay, a second lag, a slow mode, radiation".to_owned(),
        "crosstalk that takes the place of a part of the reading: it is a wrong time constant and nothing else".to_owned(),
        "which channel picks up a line that only one of them has".to_owned(),
    ];
    if observations.period_s.is_none() {
        out.push("coloured noise, input mismatch and lines: these take evenly spaced samples".to_owned());
    }
    out
}

/// Takes out earlier effects that the later ones made needless.
fn drop_needless(
    search: &Search<'_>,
    mut current: Fitted,
    steps: &mut Vec<(Tried, Vec<Tried>)>,
    remarks: &mut Vec<String>,
) -> Fitted {
    let mut index = 0;
    if current.model.effects.iter().any(|e| e.is_noise()) {
        // Weights that are those of the residual hide what made them.
        return current;
    }
    while steps.len() > 1 && index + 1 < steps.len() {
        let effect = &current.model.effects[index];
        if effect.is_noise() {
            index += 1;
            continue;
        }
        let range = current.model.range(index);
        let mut theta = current.theta.clone();
        theta.drain(range.clone());
        let without = current.model.without(index).fit(&theta, search.observations, search.selection, Effort::Finish);
        let n = current.count;
        let loss = n * (without.mean_energy() / current.mean_energy()).ln();
        if loss < threshold(range.len(), FALSE_ALARM).max(range.len() as f64 * n.ln()) {
            remarks.push(format!("{} was taken up first and found needless once more was known", effect.identifier()));
            current = without;
            steps.remove(index);
        } else {
            index += 1;
        }
    }
    current
}

/// Whether a time constant is shorter than the samples tell.
fn is_unresolved(fitted: &Fitted, observations: &Observations) -> bool {
    (0..2).any(|i| !fitted.model.knows(i) && fitted.theta[i] < UNRESOLVED * observations.step_s())
}

/// Saturation and coarse converters, masked and named.
fn data_defects(observations: &mut Observations, levels: &Levels, allowed: &[Identifier]) -> Vec<Found> {
    let mut out = Vec::new();
    if allowed.contains(&Identifier::Saturation) {
        let counts = defects::mask_saturation(observations, levels.coarse_step_k);
        for (i, count) in counts.into_iter().enumerate().filter(|(_, c)| *c > 0) {
            out.push(defect(Identifier::Saturation, i, format!("{count} readings at an end of the range")));
        }
    }
    if allowed.contains(&Identifier::Quantisation) {
        for i in 0..2 {
            if let Some(step_k) = levels.coarse_step_k[i] {
                out.push(defect(Identifier::Quantisation, i, format!("steps of {step_k:.4} K")));
            }
        }
    }
    out
}

fn defect(effect: Identifier, channel: usize, seen: String) -> Found {
    Found {
        effect,
        channel: Some(channel),
        parameters: Vec::new(),
        evidence: None,
        alternatives: Vec::new(),
        seen: Some(seen),
    }
}

fn is_judge(sample: usize, samples: usize) -> bool {
    (sample * BLOCKS / samples.max(1)) % 8 == 4
}

/// All residuals away from the ends; without the blocks that judge, and their surroundings, if these are to be kept.
fn selection(observations: &Observations, keeps_judges: bool, weighting: &Weighting) -> Selection {
    let samples = observations.samples();
    let margin = 8 + reach(samples) + weighting.half();
    let gap = (samples / BLOCKS / 10).min(20);
    let mut counts = vec![true; samples];
    let mut first = 0;
    for stretch in &observations.stretches {
        let n = stretch.len();
        // Every model of a stretch has residuals for these, whatever factors it needs.
        let inside = if n > 4 * margin { margin..n - margin } else { n / 8 + 1..n - n / 8 - 1 };
        for k in (0..n).filter(|k| !inside.contains(k)) {
            counts[first + k] = false;
        }
        first += n;
    }
    if keeps_judges {
        for (k, counts) in counts.iter_mut().enumerate() {
            let near = [k.saturating_sub(gap), k, (k + gap).min(samples - 1)];
            *counts &= !near.iter().any(|s| is_judge(*s, samples));
        }
    }
    Selection { counts, weighting: weighting.clone() }
}

fn context(observations: &Observations, levels: &Levels) -> Context {
    let step_s = observations.step_s();
    Context {
        ends_s: observations.ends_s(),
        step_s,
        is_even: observations.period_s.is_some(),
        samples: observations.samples(),
        mean_c: [0, 1].map(|i| observations.mean_and_std(i)[0]),
        moments: observations.moments(),
        swing_k: observations.swing_k(),
        noise_std_k: levels.std_k,
        tau_s: [10.0 * step_s; 2],
        lines_hz: Vec::new(),
    }
}

/// Covariance of the parameters: `H⁻¹ B H⁻¹`, `H` half the second derivatives of the energy, `B` the covariance of half its first
/// ones, for white noise or, where the residual is not that, with its own autocorrelation.
fn covariance(
    fitted: &Fitted,
    observations: &Observations,
    selection: &Selection,
    by_residual: bool,
) -> Option<Vec<Vec<f64>>> {
    let lin = fitted.model.linearised(&fitted.theta, observations, selection);
    let p = lin.columns.len();
    let inverse = fitted.model.curvature(&fitted.theta, observations, selection, &lin)?;
    let n = lin.samples.len();
    // Filtered once more: the score is that of the residual before the filter.
    let filtered: Vec<Vec<f64>> = lin.columns.iter().map(|c| selection.weighting.apply(&c[..n])).collect();
    let mut middle: Vec<Vec<f64>> =
        (0..p).map(|a| (0..p).map(|b| dense::dot(&filtered[a], &filtered[b])).collect()).collect();
    for (a, row) in middle.iter_mut().enumerate() {
        for (b, m) in row.iter_mut().enumerate() {
            *m += dense::dot(&lin.columns[a][n..], &lin.columns[b][n..]);
        }
    }
    if by_residual {
        // Bartlett's window over the lags in which the residual remembers.
        let lags = (2.0 * (n as f64).sqrt()) as usize;
        let r = &lin.residual[..n];
        let correlation = |lag: usize| (lag..n).map(|k| r[k] * r[k - lag]).sum::<f64>() / n as f64;
        let products: Vec<Vec<f64>> = (0..p)
            .map(|a| (0..p).map(|b| dense::dot(&lin.columns[a][..n], &lin.columns[b][..n])).collect())
            .collect();
        let energy = correlation(0);
        let mut coloured: Vec<Vec<f64>> =
            products.iter().map(|row| row.iter().map(|m| m * energy).collect()).collect();
        for lag in 1..=lags.min(n / 4) {
            let weight = (1.0 - lag as f64 / (lags + 1) as f64) * correlation(lag);
            for a in 0..p {
                for b in 0..=a {
                    let (x, y) = (&lin.columns[a][..n], &lin.columns[b][..n]);
                    let product = dense::dot(&x[lag..], &y[..n - lag]) + dense::dot(&x[..n - lag], &y[lag..]);
                    coloured[a][b] += weight * product;
                    if a != b {
                        coloured[b][a] += weight * product;
                    }
                }
            }
        }
        // No less than white noise alone.
        for a in 0..p {
            let ratio = (coloured[a][a] / middle[a][a].max(f64::MIN_POSITIVE)).max(0.0);
            if ratio < 1.0 {
                coloured[a][a] = middle[a][a];
            }
        }
        middle = coloured;
    }
    Some(dense::product(&dense::product(&inverse, &middle), &inverse))
}

fn summarise(fitted: &Fitted, observations: &Observations, selection: &Selection, levels: &Levels) -> ModelFit {
    let evaluation = fitted.model.evaluate(&fitted.theta, observations);
    let residual_runs = runs(&evaluation, |s| selection.holds(s));
    let level_std = 2.0 * levels.log_error[0].max(levels.log_error[1]);
    let mut tests = residual_tests(&residual_runs, fitted.model.fitted(), level_std);
    tests.extend(crate::residual::tests(fitted, observations, selection));
    let count: usize = residual_runs.iter().map(Vec::len).sum();
    let dof = count.saturating_sub(fitted.model.fitted()).max(1);
    let chi2_per_dof = residual_runs.iter().flatten().map(|r| r * r).sum::<f64>() / dof as f64;
    let rejects = tests.iter().any(|t| t.p_value < LEFT_OVER);
    let covariance = covariance(fitted, observations, selection, rejects);
    let time_constant = |value: f64, variance: Option<f64>, is_log: bool| {
        let se = variance.filter(|v| v.is_finite() && *v > 0.0).map(f64::sqrt);
        let interval = se.map(|se| {
            if is_log {
                let f = (Z_975 * se / value).exp();
                [value / f, value * f]
            } else {
                [value - Z_975 * se, value + Z_975 * se]
            }
        });
        // A factor of seven either way is no estimate.
        let known = !is_log || se.is_some_and(|se| se / value < 0.5);
        let held = variance == Some(0.0);
        TimeConstant {
            value_s: (known || held).then_some(value),
            standard_error_s: se.filter(|_| known),
            interval_95_s: interval.filter(|_| known),
        }
    };
    let theta = &fitted.theta;
    // A time constant that the samples do not resolve is on its bound, or as good as there; the other is then a guess as well.
    let unresolved = is_unresolved(fitted, observations);
    let c = covariance.as_ref();
    let variance = |i: usize| c.map(|c| c[i][i]);
    // Where the time constants are not told apart from a delay, what is told is how much later channel 2 is as a whole.
    let delay = fitted.model.effects.iter().position(|e| e.identifier() == Identifier::Delay);
    let lag: Vec<(usize, f64)> = match delay.filter(|_| unresolved) {
        Some(index) => vec![(0, -1.0), (1, 1.0), (fitted.model.range(index).start, 1.0)],
        None => vec![(0, -1.0), (1, 1.0)],
    };
    let difference_value: f64 = lag.iter().map(|(i, s)| s * theta[*i]).sum();
    let difference =
        c.map(|c| lag.iter().map(|(i, s)| lag.iter().map(|(j, t)| s * t * c[*i][*j]).sum::<f64>()).sum::<f64>());
    let bands = Bands::of(&residual_runs);
    let to_hz = 1.0 / (std::f64::consts::TAU * observations.step_s());
    ModelFit {
        time_constants: [0, 1].map(|i| {
            let out = time_constant(theta[i], variance(i), true);
            if unresolved && !fitted.model.knows(i) { TimeConstant { value_s: None, standard_error_s: None, interval_95_s: None } } else { out }
        }),
        difference: time_constant(difference_value, difference, false),
        fit: fitted.report.clone(),
        noise_std_k: fitted.model.noise_std_k(),
        tests,
        chi2_per_dof,
        is_weighted_by_residual: rejects,
        trace: Trace {
            time_s: evaluation.time_s,
            residual: evaluation.residual,
            gas_c: crate::residual::estimated_gas(fitted, observations),
            is_judge: evaluation.sample.iter().map(|s| selection.holds(*s) && is_judge(*s, observations.samples())).collect(),
            sample: evaluation.sample,
            disagreement_k: evaluation.disagreement_k,
            bands: bands.0.iter().map(|b| [b.omega * to_hz, b.power(), b.dof()]).collect(),
        },
    }
}

/// An effect with its numbers.
fn name(
    index: usize,
    tried: &Tried,
    ties: &[Tried],
    last: &Fitted,
    observations: &Observations,
    selection: &Selection,
) -> Found {
    let effect: &dyn Effect = tried.effect.as_ref();
    let covariance = if effect.is_noise() { None } else { covariance(last, observations, selection, false) };
    let range = last.model.range(index);
    let scale = last.mean_energy().max(1.0);
    let mut parameters: Vec<Value> = effect
        .parameters()
        .iter()
        .zip(range.clone())
        .map(|(p, i)| {
            let se = covariance.as_ref().map(|c| (c[i][i] * scale).sqrt()).filter(|s| *s > 0.0 && s.is_finite());
            let value = last.theta[i];
            Value {
                name: p.name.into(),
                value,
                standard_error: se,
                interval_95: se.map(|se| [value - Z_975 * se, value + Z_975 * se]),
                unit: p.unit.into(),
            }
        })
        .collect();
    parameters.extend(effect.derived().into_iter().map(|d| Value {
        name: d.name.into(),
        value: (d.of)(&last.theta[range.clone()], effect),
        standard_error: None,
        interval_95: None,
        unit: d.unit.into(),
    }));
    let mut alternatives: Vec<Identifier> = ties.iter().map(|t| t.effect.identifier()).collect();
    alternatives.sort_unstable();
    alternatives.dedup();
    Found {
        effect: effect.identifier(),
        channel: effect.channel(),
        parameters,
        evidence: Some(Evidence {
            statistic: tried.gain,
            dof: tried.added,
            p_value: tail(tried.added, tried.gain),
            held_out_gain_nats: tried.held_out_nats,
            robust_statistic: (!effect.is_noise()).then_some(tried.robust_gain),
        }),
        alternatives,
        seen: None,
    }
}

fn tail(dof: usize, statistic: f64) -> f64 {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    ChiSquared::new(dof.max(1) as f64).map_or(1.0, |c| c.sf(statistic.max(0.0)))
}

/// What is left, if more than noise is.
fn what_is_left(
    last: &Fitted,
    fit: &ModelFit,
    observations: &Observations,
    selection: &Selection,
    levels: &Levels,
) -> Option<Unexplained> {
    let _ = (last, levels);
    let fails: Vec<&ResidualTest> = fit.tests.iter().filter(|t| t.p_value < LEFT_OVER).collect();
    if fails.is_empty() {
        return None;
    }
    let worst_band = fit
        .trace
        .bands
        .iter()
        .max_by(|a, b| ((a[1] - 1.0) * a[2]).total_cmp(&((b[1] - 1.0) * b[2])))
        .copied()
        .unwrap_or([0.0, 1.0, 1.0]);
    let n = fit.trace.residual.len();
    let tenth = (n / 10).max(1);
    let worst_time = fit
        .trace
        .residual
        .chunks(tenth)
        .enumerate()
        .max_by(|a, b| energy(a.1).total_cmp(&energy(b.1)))
        .map(|(i, chunk)| [fit.trace.time_s[i * tenth], fit.trace.time_s[i * tenth + chunk.len() - 1]]);
    let _ = (observations, selection);
    let names: Vec<&str> = fails.iter().map(|t| t.test.as_str()).collect();
    Some(Unexplained {
        description: format!(
            "the residual is not noise ({}): most of what is too much lies around {:.4} Hz, {:.2} times the noise there",
            names.join(", "),
            worst_band[0],
            worst_band[1]
        ),
        band_hz: Some([worst_band[0] / 1.19_f64.sqrt(), worst_band[0] * 1.19_f64.sqrt()]),
        energy_ratio: worst_band[1],
        worst_s: worst_time,
    })
}

fn energy(chunk: &[f64]) -> f64 {
    chunk.iter().map(|r| r * r).sum::<f64>() / chunk.len().max(1) as f64
}
