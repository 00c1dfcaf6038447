//! A gas temperature with everything that its bands rest on.
//!
//! The band of a sample adds up variances: that of the smoother, given model, prior and intensity; what
//! the model's parameters and the prior's numbers move it by, a standard error at a time; and how far
//! priors apart that fit as well put it. Of a long record, pieces show which of these matter.

use std::borrow::Cow;

use twinlag_compensate::{
    Form, Gas, GasParts, Intensity, Learned, Prior, Readings, Rig, learn, learn_from, learn_intensity,
    learn_with_noise, reconstruct, reconstruct_with,
};
use twinlag_diagnose::{Extended, ModelFit, evenly_spread};

mod cases;
mod faults;

use cases::{Case, Moved, Moves};

pub use faults::GasFault;

use crate::error::Error;
use crate::verbs::CompensateOptions;
use crate::watch::Stop;

/// Standard errors by which innovations may be larger than expected before bands are widened.
const MAX_INNOVATION_EXCESS: f64 = 4.0;
/// Factor by which noise is made louder in a step.
const NOISE_INFLATION_STEP: f64 = 1.05;
/// Most steps by which noise is made louder.
const MAX_NOISE_INFLATIONS: usize = 6;
/// Share of a variance that is left at least when the motion beyond half the sampling rate is taken off, which
/// rounding or a changing intensity may make larger than the whole. Chosen.
const LEAST_VARIANCE_SHARE: f64 = 0.05;

/// Samples of each piece of a long record in which decisions are made, and their number: with all of them together, the excess
/// of innovations is known within a hundredth. Records of less than twice as many are not long.
const PIECE_SAMPLES: usize = 4096;
const PIECES: usize = 4;

/// The gas with everything that its bands rest on.
pub(crate) struct Banded {
    /// Instants, s.
    pub(crate) time_s: Vec<f64>,
    pub(crate) rig: Rig,
    pub(crate) prior: Prior,
    pub(crate) parts: GasParts,
    /// The gas temperature; its standard deviation is that of the whole band.
    pub(crate) gas: Gas,
    /// The share of the model's parameters in it, K: the median.
    pub(crate) parameter_std_k: f64,
    pub(crate) widened_by: f64,
    pub(crate) faults: Vec<GasFault>,
}

/// How the gas is reconstructed by the model of a fit.
pub(crate) struct Reconstruction<'a> {
    /// The model with the record, until no other parameters than those of the fit are asked for.
    extended: Option<Extended>,
    covariance: Option<Vec<Vec<f64>>>,
    nominal: Nominal,
    options: &'a CompensateOptions,
    stop: &'a Stop<'a>,
}

/// Readings and rig with the parameters of the fit.
struct Nominal {
    theta: Vec<f64>,
    readings: Readings,
    rig: Rig,
    /// What makes a temperature of the first channel's scale one of the trusted channel's: a gain and an offset, K.
    scale: [f64; 2],
}

impl Nominal {
    fn of(extended: &Extended, scale: impl Fn(&[f64]) -> [f64; 2]) -> Result<Self, Error> {
        let theta = extended.parameters().to_vec();
        let (readings, rig) = extended.rig(&theta)?;
        Ok(Self { readings, rig, scale: scale(&theta), theta })
    }
}

/// What is settled before the whole record is reconstructed.
struct Settled {
    prior: Prior,
    parts: GasParts,
    ends: f64,
    noise_factor: [f64; 2],
    intensity: Option<Intensity>,
    chosen: cases::Chosen,
}

impl<'a> Reconstruction<'a> {
    /// Leaves the covariance and the model of `fit` to the reconstruction.
    pub(crate) fn of(fit: &mut ModelFit, options: &'a CompensateOptions, stop: &'a Stop<'a>) -> Result<Self, Error> {
        stop.check()?;
        Self::with(fit.extended.take().expect("a fit of a record"), fit.covariance.take(), options, stop)
    }

    fn with(
        extended: Extended,
        covariance: Option<Vec<Vec<f64>>>,
        options: &'a CompensateOptions,
        stop: &'a Stop<'a>,
    ) -> Result<Self, Error> {
        let nominal = Nominal::of(&extended, |theta| scale(&extended, options, theta))?;
        Ok(Self { extended: Some(extended), covariance, nominal, options, stop })
    }

    /// This reconstruction in pieces of a long record, evenly apart; `None` of a record that is not long.
    fn in_pieces(&self) -> Result<Option<Self>, Error> {
        let samples = self.nominal.readings.len();
        let Some(extended) = self.extended.as_ref().filter(|_| samples > 2 * PIECES * PIECE_SAMPLES) else {
            return Ok(None);
        };
        let extended = extended.excerpt(evenly_spread(samples, PIECES, PIECE_SAMPLES), PIECE_SAMPLES);
        Self::with(extended, None, self.options, self.stop).map(Some)
    }

    /// The gas temperature, and how much it moves with each standard error of the model's
    /// parameters and of the prior's numbers: a column of the covariance's Cholesky factor at a
    /// time, so that what goes together moves together (JCGM 100, 5.2; of the prior Kackar and
    /// Harville 1984, Prasad and Rao 1990).
    pub(crate) fn banded(mut self) -> Result<Banded, Error> {
        let Settled { prior, parts, ends, noise_factor, intensity, chosen } = self.settled()?;
        if !chosen.moves_the_model() {
            self.extended = None;
        }
        let motion = Motion { prior: &prior, intensity: intensity.as_ref(), ends };
        let Nominal { theta, readings, scale, .. } = &self.nominal;
        let gas = self.gas(theta, &motion, noise_factor)?;
        let widened_by = if is_excessive(&gas) { gas.innovation_energy.sqrt() } else { 1.0 };
        let run = |case: &Case| self.gas(&case.theta, &Motion { prior: &case.prior, ..motion }, noise_factor).ok();
        let Moved { mut gas, of_model, of_prior } = chosen.moved(gas, intensity.is_some(), self.stop, run);
        self.stop.check()?;
        let of_parameters = gas.std_k.iter().enumerate().map(|(k, std_k)| widened_by * of_model.at(k, *std_k).sqrt());
        let parameter_std_k = median(of_parameters.collect());
        for (k, std_k) in gas.std_k.iter_mut().enumerate() {
            let share = of_model.at(k, *std_k) + of_prior.at(k, *std_k);
            *std_k = widened_by * (*std_k * *std_k + share).sqrt();
        }
        drop((of_model, of_prior));
        let (_, rig) = self.rig(theta, noise_factor)?;
        let faults = faults::of(readings, &rig, *scale, &gas.gas_c, &gas.std_k, widened_by);
        let time_s = self.nominal.readings.into_time_s();
        Ok(Banded { time_s, rig, prior, parts, gas, parameter_std_k, widened_by, faults })
    }

    /// The prior, the noise, the intensity, and how the gas temperature is to be moved; of a long record, pieces show which of
    /// this matters.
    fn settled(&self) -> Result<Settled, Error> {
        let Nominal { theta, readings, rig: nominal, .. } = &self.nominal;
        let is_found = is_noise_found(self.options, nominal);
        self.stop.say("what the gas is like", 0, 1);
        self.stop.check()?;
        let (_, nominal) = self.rig(theta, [1.0; 2])?;
        let known = self.options.model.as_ref().and_then(|model| model.gas.as_ref());
        let learned = match (is_found, known) {
            (true, _) => learn_with_noise(readings, &nominal, known)?,
            (false, Some(known)) => learn_from(readings, &nominal, known)?,
            (false, None) => learn(readings, &nominal)?,
        };
        let pieces = self.in_pieces()?;
        let part = pieces.as_ref().unwrap_or(self);
        let Learned { prior, parts, ends, mut noise_factor, .. } = learned.clone();
        let steady = Motion { prior: &prior, intensity: None, ends };
        if is_found {
            noise_factor = part.louder(&steady, noise_factor)?;
        }
        let (_, rig) = self.rig(theta, noise_factor)?;
        let intensity = self.intensity(part, readings, &rig, &prior)?;
        let cases = self.cases(learned, intensity.is_some());
        let chosen = match &pieces {
            None => cases::Chosen::all(cases),
            Some(part) => {
                let theta = &part.nominal.theta;
                let of_part = |intensity: &Intensity| intensity.of_part(readings, &part.nominal.readings);
                let intensity = intensity.as_ref().map(of_part).transpose()?;
                let motion = Motion { intensity: intensity.as_ref(), ..steady };
                let run =
                    |case: &Case| part.gas(&case.theta, &Motion { prior: &case.prior, ..motion }, noise_factor).ok();
                cases::Chosen::by(cases, &part.gas(theta, &motion, noise_factor)?, self.stop, run)
            }
        };
        Ok(Settled { prior, parts, ends, noise_factor, intensity, chosen })
    }

    /// Model and prior moved, one of their numbers at a time.
    fn cases(&self, learned: Learned, has_intensity: bool) -> Vec<Case> {
        let Learned { prior, sigma_priors, alternatives, .. } = learned;
        let theta = &self.nominal.theta;
        let columns = self.covariance.as_deref().map(columns).unwrap_or_default();
        // The prior's share counts twice: an estimated prior takes the gas for better known than it
        // is, by as much as it moves it. Beside an intensity, which would take most of it back, once.
        let times = if has_intensity { 1.0 } else { 2.0 };
        let moved = |column: &Vec<f64>| theta.iter().zip(column).map(|(t, d)| t + d).collect();
        let of_model =
            columns.iter().map(|column| Case { theta: moved(column), prior: prior.clone(), moves: Moves::Model });
        let same = |prior, moves| Case { theta: theta.clone(), prior, moves };
        let of_prior = sigma_priors.into_iter().map(|prior| same(prior, Moves::Prior { times }));
        let of_others = alternatives.into_iter().map(|(weight, prior)| same(prior, Moves::Mixture { weight }));
        of_model.chain(of_prior).chain(of_others).collect()
    }

    /// How the gas's intensity changes, if it does so in `part` of the record. It is learned from the whole record, so a filter,
    /// which may not know what comes, keeps a constant one, and so does a fixed lag.
    fn intensity(
        &self,
        part: &Self,
        readings: &Readings,
        rig: &Rig,
        prior: &Prior,
    ) -> Result<Option<Intensity>, Error> {
        if self.options.form != Form::Smoother {
            return Ok(None);
        }
        self.stop.check()?;
        let of_part = &part.nominal.readings;
        if of_part.len() < readings.len() && learn_intensity(of_part, rig, prior)?.is_none() {
            return Ok(None);
        }
        Ok(learn_intensity(readings, rig, prior)?)
    }

    fn model(&self) -> &Extended {
        self.extended.as_ref().expect("kept as long as a case moves the model")
    }

    fn rig(&self, theta: &[f64], noise_factor: [f64; 2]) -> Result<(Cow<'_, Readings>, Rig), Error> {
        let (readings, rig) = if theta == self.nominal.theta {
            (Cow::Borrowed(&self.nominal.readings), self.nominal.rig)
        } else {
            let (readings, rig) = self.model().rig(theta)?;
            (Cow::Owned(readings), rig)
        };
        Ok((readings, Rig { clock: self.options.trusted, ..rig }.with_noise_times(noise_factor)))
    }

    fn gas(&self, theta: &[f64], motion: &Motion<'_>, noise_factor: [f64; 2]) -> Result<Gas, Error> {
        let (readings, rig) = self.rig(theta, noise_factor)?;
        let form = self.options.form;
        let mut gas = match motion.intensity {
            Some(intensity) => reconstruct_with(&readings, &rig, motion.prior, intensity, form)?,
            None => reconstruct(&readings, &rig, motion.prior, form)?,
        };
        motion.take_off_what_is_beyond(&mut gas, 0.5 / readings.period_s());
        let is_nominal = theta == self.nominal.theta;
        let [gain, offset_k] = if is_nominal { self.nominal.scale } else { scale(self.model(), self.options, theta) };
        gas.gas_c.iter_mut().for_each(|c| *c = gain * *c + offset_k);
        gas.std_k.iter_mut().for_each(|k| *k *= gain.abs());
        Ok(gas)
    }

    /// The noise, made louder as long as readings that are farther from their predictions than they should be become more
    /// probable. Where the prior's spectrum does not end as the gas's does, it has pushed the noise aside: it comes back as far
    /// as the readings say.
    fn louder(&self, motion: &Motion<'_>, noise_factor: [f64; 2]) -> Result<[f64; 2], Error> {
        let at = |factor| self.gas(&self.nominal.theta, motion, factor);
        let (mut best, mut gas) = (noise_factor, at(noise_factor)?);
        if !is_excessive(&gas) {
            return Ok(best);
        }
        for _ in 0..MAX_NOISE_INFLATIONS {
            let louder = best.map(|factor| factor * NOISE_INFLATION_STEP);
            let other = at(louder)?;
            if other.log_likelihood <= gas.log_likelihood {
                break;
            }
            (best, gas) = (louder, other);
        }
        Ok(best)
    }
}

/// The value in the middle, 0 of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// [`Nominal::scale`] with other parameters.
fn scale(extended: &Extended, options: &CompensateOptions, theta: &[f64]) -> [f64; 2] {
    if options.trusted == 1 { extended.calibration(theta) } else { [1.0, 0.0] }
}

/// How the gas moves.
#[derive(Clone, Copy)]
struct Motion<'a> {
    prior: &'a Prior,
    intensity: Option<&'a Intensity>,
    /// Probability that it ends at half the sampling rate.
    ends: f64,
}

impl Motion<'_> {
    /// Takes the motion beyond half the sampling rate off the variance, as likely as it is not there. It is independent of what
    /// is slower, and hardly read.
    fn take_off_what_is_beyond(&self, gas: &mut Gas, half_rate_hz: f64) {
        let beyond = self.ends * self.prior.variance_above_k2(half_rate_hz);
        let factors = self.intensity.map(Intensity::factors);
        for (k, std_k) in gas.std_k.iter_mut().enumerate() {
            let variance = *std_k * *std_k;
            let left = variance - beyond * factors.map_or(1.0, |factors| factors[k]);
            *std_k = left.max(LEAST_VARIANCE_SHARE * variance).sqrt();
        }
    }
}

/// Whether readings are clearly farther from what the others led to expect than they should be.
fn is_excessive(gas: &Gas) -> bool {
    gas.innovation_energy - 1.0 > MAX_INNOVATION_EXCESS * (2.0 / gas.innovations as f64).sqrt()
}

/// Whether the white noise of both channels is what the record itself seemed to say.
fn is_noise_found(options: &CompensateOptions, rig: &Rig) -> bool {
    let given = &options.diagnose.characterise;
    let is_white = rig.mismatch.is_none() && rig.sensors.iter().all(|s| s.coloured.is_none());
    is_white && given.noise_std_k.is_none() && given.quiet_segments_s.is_empty()
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
