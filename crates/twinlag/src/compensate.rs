//! The gas temperature of a record: schema `twinlag.compensation/1`.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use twinlag_compensate::{
    Form, Gas, Learned, Prior, Readings, Rig, bandwidth_hz, learn, learn_quickly, learn_with_noise, reconstruct,
};
use twinlag_diagnose::{ModelFit, Verdict};
use twinlag_record::Record;

use crate::characterisation::{Characterisation, Status};
use crate::diagnose::{DiagnoseOptions, DiagnoseWatch, Model, NamedEffect, diagnose, observations, with_model};
use crate::error::Error;
use twinlag_estimate::Z_975;

/// Standard errors by which innovations may be larger than expected before bands are widened.
const CLEARLY: f64 = 4.0;

/// Factor by which the standard deviation of the noise is raised at a time, as long as readings become more probable.
const NOISE_INFLATION_STEP: f64 = 1.05;
/// Times that it is raised at most: by a third all in all.
const MAX_NOISE_INFLATIONS: usize = 6;

/// What a compensation may assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompensateOptions {
    /// How the model is found, where none is given.
    pub diagnose: DiagnoseOptions,
    /// A model that was found in another record; its effects stay fixed.
    pub model: Option<Model>,
    /// Which readings the gas temperature at an instant may use.
    pub form: Form,
    /// The channel, 0 or 1, that is trusted where gain, offset and delay differ, since two sensors
    /// alone cannot reveal which one is right.
    pub trusted: usize,
}

/// Error of the gas temperature, compared with a trusted one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgainstReference {
    /// Root mean square error, K.
    #[serde(rename = "rmse_K")]
    pub rmse_k: f64,
    /// Root mean square error of the faster sensor's uncorrected reading, K.
    #[serde(rename = "raw_rmse_K")]
    pub raw_rmse_k: f64,
    /// Share of the instants at which the reference lies inside the 95 % band.
    pub inside_95: f64,
}

/// Quality of a gas temperature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Median of its standard deviation, K.
    #[serde(rename = "median_std_K")]
    pub median_std_k: f64,
    /// Root mean square of the part of the standard deviation that is due to the model's
    /// parameters, K.
    #[serde(rename = "parameter_std_K")]
    pub parameter_std_k: f64,
    /// Highest frequency at which the readings determine the gas better than the prior, Hz; above
    /// it the answer follows from the prior. `None` if there is no such frequency.
    #[serde(rename = "bandwidth_Hz")]
    pub bandwidth_hz: Option<f64>,
    /// Mean square of the innovations (readings less their predictions from earlier ones) over
    /// their variance: 1 if model and prior are right.
    pub innovation_energy: f64,
    /// Factor by which the bands were widened because the innovations are too large.
    pub widened_by: f64,
    /// The prior of the gas, learned from the readings.
    pub prior: Prior,
    /// Comparison with the reference, if there is one.
    pub reference: Option<AgainstReference>,
}

/// The gas temperature of a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compensation {
    /// `twinlag.compensation/1`.
    pub schema: String,
    /// `ok`, or `not-identifiable` where the record does not determine the time constants: there is no gas temperature then.
    pub status: Status,
    /// Which readings the answer for an instant uses.
    pub form: Form,
    /// Quality of the gas temperature; `None` if there is no gas temperature.
    pub gas: Option<Quality>,
    /// Instants, s: those of the record, and the missing ones of an even grid. The series are not
    /// part of the JSON.
    #[serde(skip)]
    pub time_s: Vec<f64>,
    /// The gas temperature, °C.
    #[serde(skip)]
    pub gas_c: Vec<f64>,
    /// Its standard deviation, K: noise, prior and the uncertainty of the model's parameters.
    #[serde(skip)]
    pub gas_std_k: Vec<f64>,
    /// Verdict of the diagnosis, if there was one.
    pub verdict: Option<Verdict>,
    /// The effects in the model.
    pub effects: Vec<NamedEffect>,
    /// The model.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// What to know before using the numbers.
    pub warnings: Vec<String>,
    /// The rig, for pictures.
    #[serde(skip)]
    pub rig: Option<Rig>,
}

impl Compensation {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.compensation/1";
}

/// Reconstructs the gas temperature of `record` with its standard deviation, using the model given
/// or the one that a diagnosis finds.
///
/// # Errors
/// As [`crate::diagnose()`] and [`crate::characterise_with`].
pub fn compensate(
    record: &Record,
    options: &CompensateOptions,
    watch: DiagnoseWatch<'_>,
) -> Result<Compensation, Error> {
    let Modelled { last, fit, verdict, effects, warnings } = Modelled::of(record, options, watch)?;
    let mut out = Compensation {
        schema: Compensation::SCHEMA.into(),
        status: Status::NotIdentifiable,
        form: options.form,
        gas: None,
        time_s: Vec::new(),
        gas_c: Vec::new(),
        gas_std_k: Vec::new(),
        verdict,
        effects,
        last,
        warnings,
        rig: None,
    };
    let is_unknown =
        fit.time_constants.iter().any(|t| t.value_s.is_none()) || out.last.status == Status::NotIdentifiable;
    if is_unknown || verdict == Some(Verdict::Refused) {
        out.warnings.push(
            "the record does not determine both time constants, so the gas temperature cannot be \
             reconstructed: give a known time constant (--known \
             T1.time_constant_s=VALUE), or use a model from another record (--model)"
                .into(),
        );
        return Ok(out);
    }
    if matches!(verdict, Some(Verdict::PartlyExplained | Verdict::Unexplained)) {
        out.warnings.push(
            "the model does not explain the record: the bands cover noise and parameters, but not the error \
             of the model"
                .into(),
        );
    }
    let found = Found::of(&fit, options, watch)?;
    if found.widened_by > 1.0 {
        out.warnings.push(format!(
            "readings deviate from their predictions {:.2} times as far as noise explains; the bands are \
             widened by this factor",
            found.widened_by
        ));
    }
    out.warnings.push(
        "errors that both sensors share (a gain, an offset, a delay, a second lag) remain in the gas \
         temperature, and no band covers them"
            .into(),
    );
    let mut sorted = found.std_k.clone();
    sorted.sort_by(f64::total_cmp);
    out.status = Status::Ok;
    out.gas = Some(Quality {
        median_std_k: sorted.get(sorted.len() / 2).copied().unwrap_or(0.0),
        parameter_std_k: found.parameter_std_k,
        bandwidth_hz: bandwidth_hz(&found.rig, &found.prior, out.last.record.sample_period_s),
        innovation_energy: found.gas.innovation_energy,
        widened_by: found.widened_by,
        reference: against(record, &found),
        prior: found.prior,
    });
    out.time_s = found.readings.time_s().to_vec();
    (out.gas_c, out.gas_std_k, out.rig) = (found.gas.gas_c, found.std_k, Some(found.rig));
    Ok(out)
}

/// The model, and where it comes from.
struct Modelled {
    last: Characterisation,
    fit: ModelFit,
    verdict: Option<Verdict>,
    effects: Vec<NamedEffect>,
    warnings: Vec<String>,
}

impl Modelled {
    fn of(record: &Record, options: &CompensateOptions, watch: DiagnoseWatch<'_>) -> Result<Self, Error> {
        if let Some(model) = &options.model {
            let (last, fit) = with_model(record, model, &options.diagnose.characterise)?;
            let warnings = last.warnings.clone();
            return Ok(Self { last, fit, verdict: None, effects: Vec::new(), warnings });
        }
        // The reference is for the gas temperature that comes of it.
        let mut blind = record.clone();
        blind.reference_c = None;
        let answer = diagnose(&blind, &options.diagnose, watch)?;
        let fit = answer.core.expect("it was made just now").last;
        let (verdict, effects, warnings) = (Some(answer.verdict), answer.effects, answer.remarks);
        Ok(Self { last: answer.last, fit, verdict, effects, warnings })
    }
}

/// The gas with everything that its bands rest on.
struct Found {
    readings: Readings,
    rig: Rig,
    prior: Prior,
    gas: Gas,
    std_k: Vec<f64>,
    parameter_std_k: f64,
    widened_by: f64,
}

impl Found {
    /// The gas temperature, and how much it moves with each standard error of the model's parameters and of the prior's numbers: a column
    /// of the covariance's Cholesky factor at a time, so that what goes together moves together (JCGM 100, 5.2; of the prior Kackar
    /// and Harville 1984, Prasad and Rao 1990).
    fn of(fit: &ModelFit, options: &CompensateOptions, watch: DiagnoseWatch<'_>) -> Result<Self, Error> {
        let extended = fit.extended.as_ref().expect("a fit of a record");
        let theta = extended.parameters();
        let rig = |theta: &[f64], noise_factor: [f64; 2]| -> Result<(Readings, Rig), Error> {
            let (readings, mut rig) = extended.rig(theta)?;
            rig.sensors.iter_mut().zip(noise_factor).for_each(|(sensor, factor)| sensor.noise_std_k *= factor);
            Ok((readings, Rig { clock: options.trusted, ..rig }))
        };
        let (readings, nominal) = rig(theta, [1.0; 2])?;
        let with = |theta: &[f64], prior: &Prior, noise_factor: [f64; 2]| -> Result<Gas, Error> {
            let (readings, rig) = rig(theta, noise_factor)?;
            let mut gas = reconstruct(&readings, &rig, prior, options.form)?;
            if options.trusted == 1 {
                let [gain, offset_k] = extended.calibration(theta);
                gas.gas_c.iter_mut().for_each(|c| *c = gain * *c + offset_k);
                gas.std_k.iter_mut().for_each(|k| *k *= gain.abs());
            }
            Ok(gas)
        };
        let is_found = is_noise_found(options, &nominal);
        let learned = if is_found { learn_with_noise(&readings, &nominal)? } else { learn(&readings, &nominal)? };
        let Learned { prior, sigma_priors, alternatives, mut noise_factor } = learned;
        let mut gas = with(theta, &prior, noise_factor)?;
        if is_found && is_excessive(&gas) {
            // Where the prior's spectrum does not end as the gas's does, it has pushed the noise aside: as much as the readings say.
            for _ in 0..MAX_NOISE_INFLATIONS {
                let louder = noise_factor.map(|factor| factor * NOISE_INFLATION_STEP);
                let other = with(theta, &prior, louder)?;
                if other.log_likelihood <= gas.log_likelihood {
                    break;
                }
                (noise_factor, gas) = (louder, other);
            }
        }
        let (_, rig) = rig(theta, noise_factor)?;
        let columns = fit.covariance.as_deref().map(columns).unwrap_or_default();
        let moved = columns.iter().map(|column| theta.iter().zip(column).map(|(t, d)| t + d).collect());
        let of_model: Vec<(Vec<f64>, &Prior)> = moved.map(|moved| (moved, &prior)).collect();
        let of_prior: Vec<(Vec<f64>, &Prior)> = sigma_priors.iter().map(|prior| (theta.to_vec(), prior)).collect();
        let of_other: Vec<(Vec<f64>, &Prior)> = alternatives.iter().map(|(_, prior)| (theta.to_vec(), prior)).collect();
        let cases = [of_model, of_prior, of_other].concat();
        let others = in_parallel(&cases, watch, |(theta, prior)| with(theta, prior, noise_factor).ok());
        let variance = |others: &[Option<Gas>]| {
            let mut variance = vec![0.0; gas.gas_c.len()];
            for other in others.iter().flatten() {
                for ((v, a), b) in variance.iter_mut().zip(&other.gas_c).zip(&gas.gas_c) {
                    *v += (a - b) * (a - b);
                }
            }
            variance
        };
        let (of_model, rest) = others.split_at(columns.len());
        let (of_prior, of_other) = rest.split_at(sigma_priors.len());
        let (of_model, of_prior) = (variance(of_model), variance(of_prior));
        let widened_by = if is_excessive(&gas) { gas.innovation_energy.sqrt() } else { 1.0 };
        let parameter_std_k = (of_model.iter().sum::<f64>() / of_model.len().max(1) as f64).sqrt();
        // The prior's share counts twice: an estimated prior takes the gas for better known than it is, by as much as it moves it.
        let shares = of_model.iter().zip(&of_prior).map(|(model, prior)| model + 2.0 * prior);
        let gas = averaged(&gas, alternatives.iter().map(|(weight, _)| *weight).zip(of_other));
        let std_k = gas.std_k.iter().zip(shares).map(|(s, v)| widened_by * (s * s + v).sqrt()).collect();
        Ok(Self { readings, rig, prior, gas, std_k, parameter_std_k, widened_by })
    }
}

/// Whether readings are clearly farther from what the others led to expect than they should be.
fn is_excessive(gas: &Gas) -> bool {
    gas.innovation_energy - 1.0 > CLEARLY * (2.0 / gas.innovations as f64).sqrt()
}

/// Whether the white noise of both channels is what the record itself seemed to say.
fn is_noise_found(options: &CompensateOptions, rig: &Rig) -> bool {
    let given = &options.diagnose.characterise;
    let is_white = rig.mismatch.is_none() && rig.sensors.iter().all(|s| s.coloured.is_none());
    is_white && options.model.is_none() && given.noise_std_k.is_none() && given.quiet_segments_s.is_empty()
}

/// The mean of `gas` and of those by other priors, with the variance of the mixture.
fn averaged<'a>(gas: &Gas, others: impl Iterator<Item = (f64, &'a Option<Gas>)>) -> Gas {
    let others: Vec<(f64, &Gas)> = others.filter_map(|(weight, other)| Some((weight, other.as_ref()?))).collect();
    let own = 1.0 - others.iter().map(|(weight, _)| weight).sum::<f64>();
    let of = |k: usize| {
        let all = || others.iter().copied().chain([(own, gas)]);
        let mean_c: f64 = all().map(|(w, g)| w * g.gas_c[k]).sum();
        let variance: f64 = all().map(|(w, g)| w * (g.std_k[k].powi(2) + (g.gas_c[k] - mean_c).powi(2))).sum();
        (mean_c, variance.sqrt())
    };
    let (gas_c, std_k) = (0..gas.gas_c.len()).map(of).unzip();
    Gas { gas_c, std_k, ..gas.clone() }
}

/// The work on each of `cases`, in their order whatever the number of threads.
fn in_parallel<Case: Sync>(
    cases: &[Case],
    watch: DiagnoseWatch<'_>,
    work: impl Fn(&Case) -> Option<Gas> + Sync,
) -> Vec<Option<Gas>> {
    let done = AtomicUsize::new(0);
    let reported = |case: &Case| {
        let result = work(case);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        watch("how model and prior move the gas temperature", done, cases.len());
        result
    };
    cases.par_iter().map(reported).collect()
}

/// The gas temperature by the model of `fit`, without what its parameters add to the bands; `None` where the model gives none.
pub(crate) fn gas(fit: &ModelFit) -> Option<Gas> {
    let extended = fit.extended.as_ref()?;
    let (readings, rig) = extended.rig(extended.parameters()).ok()?;
    let prior = learn_quickly(&readings, &rig).ok()?.prior;
    reconstruct(&readings, &rig, &prior, Form::Smoother).ok()
}

/// Columns of the Cholesky factor of `covariance`; what is held has none.
fn columns(covariance: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = covariance.len();
    let mut left: Vec<Vec<f64>> = covariance.to_vec();
    let mut out = Vec::new();
    for j in 0..n {
        let pivot = left[j][j];
        if !pivot.is_finite() || pivot <= 1e-12 * covariance[j][j].abs() {
            continue;
        }
        let column: Vec<f64> = (0..n).map(|i| left[i][j] / pivot.sqrt()).collect();
        for a in 0..n {
            for b in 0..n {
                left[a][b] -= column[a] * column[b];
            }
        }
        out.push(column);
    }
    out
}

fn against(record: &Record, found: &Found) -> Option<AgainstReference> {
    let reference = record.reference_c.as_ref()?;
    let (_, rows) = observations(record).ok()?;
    let faster = usize::from(found.rig.sensors[1].tau_s < found.rig.sensors[0].tau_s);
    let raw = [&record.t1_c, &record.t2_c][faster];
    let (mut squares, mut raw_squares, mut inside, mut count) = (0.0, 0.0, 0.0, 0.0_f64);
    for (k, row) in rows.iter().enumerate() {
        let Some(row) = *row else { continue };
        if !reference[row].is_finite() || !raw[row].is_finite() {
            continue;
        }
        let error = found.gas.gas_c[k] - reference[row];
        squares += error * error;
        raw_squares += (raw[row] - reference[row]).powi(2);
        inside += f64::from(u8::from(error.abs() <= Z_975 * found.std_k[k]));
        count += 1.0;
    }
    (count > 0.0).then(|| AgainstReference {
        rmse_k: (squares / count).sqrt(),
        raw_rmse_k: (raw_squares / count).sqrt(),
        inside_95: inside / count,
    })
}
